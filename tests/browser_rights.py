"""Rights at a panel: checks for tests/browser.py.

A user is asked for a reason, is signed out after a while without a touch, sees on, and signs in again; a user
who may only look has no buttons that work.
"""

from browser_panels import CONTROLLER, PASSWORD, USER, Panel
from browser_rig import wait_for

ROLES = """
[[user]]
name = "anna"
role = "%s"
"""


def a_reason_is_asked_for_and_logged(test):
    with Panel(test, controller=CONTROLLER.replace('decimals = 1 }', 'decimals = 1, reason = true }', 1)) as panel:
        look, page = panel.look, panel.look.page
        panel.press("Set Gain")
        page.keyboard.type("2.5")
        page.keyboard.press("Enter")
        page.get_by_text("Gain: why?").wait_for()
        look.picture("panel-reason")
        panel.press("Cancel")
        look.until("!document.querySelector('dialog')")
        assert panel.plant.value("gain") == 1.25, "it was written without a reason"
        panel.press("Set Gain")
        page.keyboard.type("2.5")
        page.keyboard.press("Enter")
        page.get_by_text("Gain: why?").wait_for()
        page.keyboard.type("Foam in the tank")
        page.keyboard.press("Enter")
        wait_for("a value", lambda: panel.plant.value("gain") == 2.5)
        wait_for("its reason in the log", lambda: "reason: Foam in the tank" in panel.log())
        look.fine()


def a_user_without_a_touch_is_signed_out_and_sees_on(test):
    with Panel(test, controller=CONTROLLER.replace("[web]\n", '[web]\nsign-out = "3s"\n', 1)) as panel:
        look, page = panel.look, panel.look.page
        panel.said("Start", "signed out: sign in again")
        panel.said("Level", "2.35 m")
        look.picture("panel-signed-out")
        page.get_by_role("button", name="Sign in", exact=True).click()
        page.get_by_label("Password").fill(PASSWORD)
        page.locator("form.sign button").click()
        page.get_by_role("button", name=f"Sign out {USER}").wait_for()
        panel.press("Set Gain")
        page.keyboard.type("2.5")
        page.keyboard.press("Enter")
        wait_for("a value", lambda: panel.plant.value("gain") == 2.5)


def a_user_who_may_only_look_has_no_button_that_works(test):
    with Panel(test, controller=CONTROLLER + ROLES % "view") as panel:
        panel.said("Start", "`[web] write` does not list it for the role view")
        assert panel.look.page.get_by_role("button", name="Start", exact=True).is_disabled()
        panel.look.fine()


RIGHTS_CHECKS = [
    a_reason_is_asked_for_and_logged,
    a_user_without_a_touch_is_signed_out_and_sees_on,
    a_user_who_may_only_look_has_no_button_that_works,
]
