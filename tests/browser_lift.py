"""The lift station by its pages alone, as an operator with a tablet handles it: a check for tests/browser.py.

Each fault that the plant can have is injected. The alarm on the overview leads by `Why …?` to what is wrong; then it
is acknowledged, shelved, and a set value is changed. A recipe is loaded into the shipped filling line.
"""

import os
import re
import shutil
import tempfile

import browser_rig as rig
from browser_panels import USER, Panel
from browser_rig import Plant, wait_for

# What is done to the plant (the controller file says it), the alarm that tells of it, and what the answer to
# `Why …?` names at its end.
FAULTS = [
    (["write", "C101"], "p1.failed", "running1"),
    (["write", "C102"], "p2.tripped", "healthy2"),
    (["force", "high_float"], "high_level", "high_float"),
    (["write", "C100"], "level.broken", "level_raw"),
    (["write", "C104"], "lost", "plant.Stale"),
]


class ShippedPlant(Plant):
    """A shipped example in a folder of its own."""

    def __init__(self, name, socket):
        self.folder = tempfile.mkdtemp(prefix="rungd-b-")
        shutil.copytree(os.path.join(rig.HERE, "config"), self.folder, dirs_exist_ok=True)
        with open(os.path.join(self.folder, f"{name}.toml")) as file:
            text = file.read().replace('watchdog = "200ms"', 'watchdog = "30s"').replace(f'"{socket}"', '"s"')
        with open(os.path.join(self.folder, "controller.toml"), "w") as file:
            file.write(text)
        self.socket = os.path.join(self.folder, "s")
        self.start()


def shipped(test, name, socket):
    """A shipped example behind its pages, and a user who has signed in."""
    return Panel(test, plant=ShippedPlant(name, socket))


def each_fault_of_the_lift_station_is_found_by_the_pages_alone(test):
    with shipped(test, "lift-station", "lift-station.sock") as panel:
        look, page, plant = panel.look, panel.look.page, panel.plant
        for number, (fault, alarm, cause) in enumerate(FAULTS):
            plant.say(*fault, "ON")
            look.open("overview")
            link = page.get_by_role("button", name=f"Why {alarm}?", exact=True)
            link.wait_for()
            look.picture(f"lift-{number}-overview")
            link.click()
            look.until("words => document.querySelector('#why pre')?.textContent.includes(words)", cause)
            look.picture(f"lift-{number}-why")
            page.keyboard.press("Escape")
        look.open("alarms")
        look.picture("lift-alarms")
        look.fine()


def the_lift_station_is_operated_by_the_pages_alone(test):
    with shipped(test, "lift-station", "lift-station.sock") as panel:
        look, page, plant = panel.look, panel.look.page, panel.plant
        plant.say("write", "C102", "ON")
        look.open("alarms")
        row = page.get_by_role("row", name=re.compile("the motor protection has tripped"))
        row.get_by_role("button", name="Acknowledge").click()
        row.get_by_text(f"acknowledged by {USER}").wait_for()
        row.get_by_role("button", name="Shelve…").click()
        dialog = page.get_by_role("dialog")
        look.picture("lift-shelf")
        dialog.get_by_label("Why").fill("the electrician comes at two")
        dialog.get_by_role("button", name="Shelve").click()
        row.get_by_text(re.compile("shelved until .* by anna: the electrician")).wait_for()
        # A critical alarm is acknowledged, and has no shelf.
        plant.say("force", "high_float", "ON")
        row = page.get_by_role("row", name=re.compile("High level"))
        row.get_by_role("button", name="Acknowledge").wait_for()
        assert row.get_by_role("button", name="Shelve…").count() == 0
        look.picture("lift-shelved")
        look.open("events")
        look.picture("lift-events")
        look.open("panel")
        panel.press("Set One pump from")
        keys = page.get_by_role("dialog")
        for key in ["1", ".", "4", "5", "OK"]:
            keys.get_by_role("button", name=key, exact=True).click()
        wait_for("a set value", lambda: abs(plant.value("start1") - 1.45) < 1e-6)
        panel.said("One pump from", "1.45 m")
        look.picture("lift-panel")
        look.open("ladder/Pumps")
        look.picture("lift-ladder")
        look.fine()


def a_recipe_of_the_filling_line_is_loaded_by_the_pages_alone(test):
    with shipped(test, "filling-line", "filling-line.sock") as panel:
        look, page, plant = panel.look, panel.look.page, panel.plant
        look.picture("filling-panel")
        path = os.path.join(plant.folder, "light.toml")
        with open(path, "w") as file:
            file.write("nominal = [450, 700, 950]\n")
        page.locator("input[type=file]").first.set_input_files(path)
        panel.said("Grams of each product", "3 values differ")
        look.picture("filling-recipe")
        panel.press("Write 3 changes")
        page.get_by_role("dialog").get_by_role("button", name="Write").click()
        panel.said("Grams of each product", "written as one change")
        assert [plant.value(f"nominal[{n}]") for n in range(3)] == [450, 700, 950]
        look.fine()


LIFT_CHECKS = [
    each_fault_of_the_lift_station_is_found_by_the_pages_alone,
    the_lift_station_is_operated_by_the_pages_alone,
    a_recipe_of_the_filling_line_is_loaded_by_the_pages_alone,
]
