"""Rights at a panel: checks for tests/browser.py.

A user is asked for a reason, is signed out after a while without a touch, sees on, and signs in again; a user
who may only look has no buttons that work.
"""

from browser_hold import CRANE, CRANE_CONTROLLER, SAID
from browser_panels import BAKERY, BAKERY_CONTROLLER, CONTROLLER, PASSWORD, USER, Panel
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


def a_button_that_is_held_asks_for_its_reason_once(test):
    controller = CRANE_CONTROLLER.replace('text = "Jog" }', 'text = "Jog", reason = true }')
    with Panel(test, CRANE, controller) as panel:
        look, page = panel.look, panel.look.page
        box = page.locator("button.hold").bounding_box()
        page.mouse.move(box["x"] + 20, box["y"] + 20)
        page.mouse.down()
        page.mouse.up()
        page.get_by_text("Jog: why?").wait_for()
        page.keyboard.type("Align the hook")
        page.keyboard.press("Enter")
        panel.said("Jog", "now hold it pressed: Align the hook")
        assert panel.plant.value("jog") is False, "it was pressed before its reason was given"
        page.mouse.down()
        look.until(f"!{SAID}.startsWith('…')")
        page.mouse.up()
        wait_for("its reason in the log", lambda: "wrote ON to jog" in panel.log() and "reason: Align the hook" in panel.log())
        look.fine()


def alarms_are_shelved_and_brought_back_by_buttons(test):
    with Panel(test, BAKERY, BAKERY_CONTROLLER + ROLES % "operate") as panel:
        look, page, plant = panel.look, panel.look.page, panel.plant
        plant.say("write", "hot", "ON")
        panel.said("Alarms of the oven", "The oven is too hot")
        page.get_by_role("button", name="Shelve…").click()
        dialog = page.get_by_role("dialog")
        look.picture("panel-shelve")
        assert "out of service" not in dialog.text_content(), "only maintenance takes an alarm out of service"
        dialog.get_by_label("For how long").select_option("1 hour")
        dialog.get_by_label("why").fill("The sensor is exchanged")
        dialog.get_by_role("button", name="Shelve").click()
        panel.said("Alarms of the oven", "The sensor is exchanged")
        wait_for("who and why in the log", lambda: f"{USER} by " in panel.log() and "shelved alarm hot for 1h" in panel.log())
        look.picture("panel-shelved")
        page.get_by_role("button", name="Unshelve").click()
        panel.said("Alarms of the oven", "not acknowledged")
        # Out of service from elsewhere: this user does not return it.
        plant.say("shelve", "hot", "--out-of-service", "--why", "No oven")
        panel.said("Alarms of the oven", "out of service")
        look.until("![...document.querySelectorAll('.panel button')].some(of => /service/.test(of.textContent))")
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
    a_button_that_is_held_asks_for_its_reason_once,
    alarms_are_shelved_and_brought_back_by_buttons,
    a_reason_is_asked_for_and_logged,
    a_user_without_a_touch_is_signed_out_and_sees_on,
    a_user_who_may_only_look_has_no_button_that_works,
]
