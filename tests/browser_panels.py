"""Panels as operators handle them: checks for tests/browser.py.

A machine with commands, set values and states runs behind a panel at the size of a tablet, with touch. What an
operator presses is compared with what the controller has and logs.
"""

import os
import re
import shutil
import subprocess
import tempfile

import browser_rig as rig
from browser_rig import HEAD, Pages, Plant, wait_for

LADDER = """
[ladder]
name = "mixer"
[tags]
start = { at = "C0", doc = "Command: starts a batch" }
late = { at = "C1", doc = "Command: taken after two seconds" }
driven = { at = "C2", doc = "Driven by a coil" }
running = { at = "Y0" }
level = { at = "D0", min = 0, max = 1000, initial = 235, unit = "cm" }
gain = { at = "R0", min = 0.5, max = 2.5, initial = 1.25 }
step = { at = "D1", texts = { 0 = "idle", 1 = "dosing", 2 = "mixing" } }
batches = { type = "counter" }
slow = { type = "timer" }
[[program]]
name = "Main"
rung = [
  { leg.up = ["start"], leg.rst = ["$Off"], do = ["CNT batches preset=9"] },
  { when = ["start"], do = ["RST start", "SET running"] },
  { when = ["late"], do = ["TMR slow preset=2s"] },
  { when = ["slow.Done"], do = ["RST late"] },
  { when = ["$Off"], do = ["OUT driven"] },
]
"""
CONTROLLER = HEAD + """
[web]
write = ["start", "late", "driven", "level", "gain", "step"]
[[panel]]
name = "Mixer"
show = [
  { lamp = "running", text = "Running" },
  { button = "start", text = "Start", confirm = "Start the batch?" },
  { button = "late", text = "Late" },
  { button = "driven", text = "Driven" },
  { value = "level", text = "Level", unit = "m", decimals = 2 },
  { value = "gain", text = "Gain", decimals = 1 },
  { value = "step", text = "Step" },
  { bar = "level", text = "Tank", min = 0, max = 1000, unit = "m", decimals = 2 },
  { trend = "level", text = "Level, a minute", decimals = 2 },
]
"""
USER, PASSWORD = "anna", "correct horse"
TABLET = {"viewport": {"width": 1024, "height": 768}, "has_touch": True}


class Panel:
    """A machine, its pages, and a user who has signed in at a tablet."""

    def __init__(self, test, ladder=LADDER, controller=CONTROLLER, mimics=None, plant=None, **options):
        self.plant = plant or Plant(ladder, controller)
        users = os.path.join(self.plant.folder, "users")
        command = [rig.RUNGD, "web", "passwd", USER, "--users-file", users]
        subprocess.run(command, input=PASSWORD + "\n", text=True, check=True, capture_output=True)
        self.pages = Pages(self.plant, "--users-file", users, *(["--mimics", mimics] if mimics else []))
        self.look = test.look(self.pages, **{**TABLET, **options})
        self.look.page.get_by_label("User").fill(USER)
        self.look.page.get_by_label("Password").fill(PASSWORD)
        self.look.page.get_by_role("button", name="Sign in").click()
        self.look.page.get_by_role("button", name=f"Sign out {USER}").wait_for()
        self.look.open("panel")
        # Before the sign-in the page had no session.
        self.look.errors.clear()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.pages.end()
        self.plant.end()
        shutil.rmtree(self.plant.folder, ignore_errors=True)

    def press(self, name):
        self.look.page.get_by_role("button", name=name, exact=True).click()

    def said(self, title, words):
        """Waits until the part with this title says the words."""
        self.look.until("([title, words]) => [...document.querySelectorAll('.panel .card')].some(of =>"
                        " of.getAttribute('aria-label') === title && of.textContent.includes(words))", [title, words])

    def log(self):
        with open(os.path.join(self.plant.folder, "log")) as file:
            return file.read()


def a_command_is_taken_and_an_operator_is_never_told_to_force(test):
    with Panel(test) as panel:
        look = panel.look
        look.picture("panel-tablet")
        panel.press("Start")
        look.page.get_by_text("Start the batch?").wait_for()
        look.picture("panel-confirm")
        panel.press("Cancel")
        look.until("!document.querySelector('dialog')")
        assert panel.plant.value("batches.Acc") == 0, "a command that was not confirmed was sent"
        panel.press("Start")
        look.page.get_by_role("dialog").get_by_role("button", name="Start").click()
        panel.said("Start", "taken, ")
        wait_for("a batch", lambda: panel.plant.value("batches.Acc") == 1)
        assert f"{USER} by " in panel.log() and "wrote ON to start" in panel.log()
        # Taken scans later: the part says first that it waits.
        panel.press("Late")
        panel.said("Late", "ON: waits for the ladder")
        panel.said("Late", "taken, ")
        # A bit that a coil drives takes no command, and the page says so.
        panel.press("Driven")
        panel.said("Driven", "not taken: the ladder has overwritten it")
        assert "force" not in look.says("document.querySelector('main').textContent")
        look.picture("panel-commands")
        look.fine()


def a_set_value_is_entered_by_a_keypad_within_its_limits(test):
    with Panel(test) as panel:
        look, page = panel.look, panel.look.page
        panel.said("Level", "2.35 m")
        panel.said("Step", "idle (0)")
        panel.press("Set Level")
        look.picture("panel-keypad")
        keys = page.get_by_role("dialog")

        def enter(*names):
            for name in names:
                keys.get_by_role("button", name=name, exact=True).click()

        enter("1", "1", "OK")
        keys.get_by_text("outside of 0.00 to 10.00 m").wait_for()
        enter("delete all", "3", ".", "0", "5", "7", "OK")
        keys.get_by_text("at most 2 behind the point").wait_for()
        assert panel.plant.value("level") == 235, "a refused value was written"
        enter("delete the last digit", "OK")
        wait_for("a value", lambda: panel.plant.value("level") == 305)
        panel.said("Level", "now 3.05 m")
        panel.said("Tank", "3.05 m")
        # By the keyboard; a decimal comma is read as people write it.
        panel.press("Set Gain")
        page.keyboard.type("2,5")
        page.keyboard.press("Enter")
        wait_for("a real", lambda: panel.plant.value("gain") == 2.5)
        panel.said("Gain", "2.5")
        # A state is chosen by its text.
        panel.press("Set Step")
        look.picture("panel-states")
        enter("mixing (2)")
        wait_for("a state", lambda: panel.plant.value("step") == 2)
        panel.said("Step", "mixing (2)")
        assert re.search(r"anna by \S+ .*wrote 305 to level", panel.log())
        # Escape changes nothing.
        panel.press("Set Level")
        page.keyboard.type("1")
        page.keyboard.press("Escape")
        look.until("!document.querySelector('dialog')")
        assert panel.plant.value("level") == 305
        look.fine()


BAKERY = """
[ladder]
name = "bakery"
[[record]]
name = "Recipe"
fields = { sugar = { type = "int", min = 0, max = 500, unit = "g" }, heat = { type = "real", min = 0, max = 300, unit = "°C" }, nuts = { type = "bit" } }
[tags]
recipes = { type = "Recipe", count = 4, initial = [{ sugar = 100, heat = 180.5 }, { sugar = 200, nuts = true }] }
jam = { at = "C0", alarm = "The mixer is jammed", group = "Mixer" }
hot = { at = "C1", alarm = "The oven is too hot", group = "Oven" }
door = { at = "C2" }
[[program]]
name = "Main"
rung = [{ when = ["recipes[0].nuts", "recipes[0].sugar > 0", "recipes[0].heat > 1.0"], do = ["OUT Y0"] }]
"""
BAKERY_CONTROLLER = HEAD + """
[web]
write = ["recipes"]
[[panel]]
name = "Bakery"
show = [
  { recipe = "recipes", text = "Cakes" },
  { alarms = "Oven", text = "Alarms of the oven" },
  { lamp = "door", text = "Door", color = "amber" },
]
"""


def a_recipe_is_edited_loaded_saved_and_written_as_one_change(test):
    with Panel(test, BAKERY, BAKERY_CONTROLLER) as panel:
        look, page = panel.look, panel.look.page
        page.get_by_role("button", name="Cakes 1, sugar: 200").wait_for()
        page.get_by_role("button", name="Cakes 0, sugar: 100").click()
        keys = page.get_by_role("dialog")
        for key in ["2", "5", "0", "OK"]:
            keys.get_by_role("button", name=key, exact=True).click()
        page.get_by_role("button", name="Cakes 3, nuts: OFF").click()
        look.picture("panel-recipe")
        assert panel.plant.value("recipes[0].sugar") == 100, "an edited value was written"
        panel.press("Write 2 changes")
        page.get_by_role("dialog").get_by_role("button", name="Write").click()
        panel.said("Cakes", "written as one change")
        assert panel.plant.value("recipes[0].sugar") == 250 and panel.plant.value("recipes[3].nuts") is True
        assert "wrote in one change" in panel.log()
        with page.expect_download() as saved:
            panel.press("Save a file")
        path = os.path.join(panel.plant.folder, "cakes.toml")
        saved.value.save_as(path)
        with open(path) as file:
            text = file.read()
        assert text.startswith("recipes = [") and "sugar = 250" in text, text
        # The file is changed elsewhere, and loaded: what differs is shown, and written as one change.
        for wrong, words in [("recipes = [", "line "), ("other = 5", "no value of `recipes`"), ("recipes = [{ salt = 1 }]", "does not have")]:
            with open(path, "w") as file:
                file.write(wrong)
            page.set_input_files("input[type=file]", path)
            panel.said("Cakes", words)
        with open(path, "w") as file:
            file.write(text.replace("sugar = 250", "sugar = 501").replace("sugar = 200", "sugar = 50"))
        page.set_input_files("input[type=file]", path)
        panel.said("Cakes", "2 values differ")
        panel.press("Write 2 changes")
        page.get_by_role("dialog").get_by_role("button", name="Write").click()
        panel.said("Cakes", "takes 0 to 500")
        look.picture("panel-recipe-refused")
        assert panel.plant.value("recipes[1].sugar") == 200, "a part of a refused change was written"
        panel.press("Undo")
        look.until("!document.querySelector('.cell.changed, .cell.wrong')")
        look.errors = [of for of in look.errors if not re.search("status of 4(00|09)", of)]
        look.fine()


def a_panel_lists_the_alarms_of_its_group_and_lamps_have_colours(test):
    with Panel(test, BAKERY, BAKERY_CONTROLLER) as panel:
        look = panel.look
        for bit in ["jam", "hot", "door"]:
            panel.plant.say("write", bit, "ON")
        panel.said("Alarms of the oven", "The oven is too hot")
        assert not look.says("document.querySelector('main').textContent.includes('jammed')"), "the alarm of another group"
        look.until("document.querySelector('[data-lamp=door]').matches('.on.amber')")
        look.page.get_by_role("button", name="Acknowledge").click()
        panel.said("Alarms of the oven", f"acknowledged by {USER}")
        look.picture("panel-alarms")
        look.fine()


TANK = """
[ladder]
name = "tank"
[tags]
pump = { at = "C0" }
level = { at = "D0", min = 0, max = 1000, unit = "cm" }
valve = { at = "C1" }
[[program]]
name = "Main"
rung = [{ when = ["pump", "level > 0", "valve"], do = ["OUT Y0"] }]
"""
TANK_CONTROLLER = HEAD + """
[[panel]]
name = "Tank"
show = [{ mimic = "tank.svg", text = "The tank" }]
"""
DRAWING = """<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 400 200" onload="window.hacked = 1">
  <script>window.hacked = 2</script>
  <style>* { display: none }</style>
  <image xlink:href="http://127.0.0.1:9/x.png" width="9" height="9"/>
  <a xlink:href="javascript:window.hacked = 3"><text x="10" y="10">link</text></a>
  <foreignObject><iframe src="javascript:window.hacked = 4"/></foreignObject>
  <animate attributeName="x" onbegin="window.hacked = 5"/>
  <rect id="content" x="20" y="40" width="120" height="120" fill="#ddd" stroke="#555" onclick="window.hacked = 6"/>
  <circle data-tag="pump" data-on="#0a7d2c" data-off="#999" cx="220" cy="120" r="30" fill="#ccc"/>
  <path data-tag="valve" data-on="#b3261e" data-off="#777" d="M140 120 L190 120" fill="none" stroke="#777" stroke-width="8"/>
  <text data-tag="level" data-text="" data-decimals="2" data-unit="m" x="30" y="100" font-size="22" fill="#222">level</text>
  <text data-tag="valve" data-show="on" x="150" y="90" font-size="16" fill="#b3261e">open</text>
  <text data-tag="nobody" data-text="" x="300" y="20" font-size="12">?</text>
  <path d="M0 0 GIANT" fill="none" stroke="#eee"/>
</svg>
"""


def a_mimic_follows_its_tags_and_nothing_of_it_executes(test):
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "tank.svg"), "w") as file:
            file.write(DRAWING.replace("GIANT", "L1e9 1e9 L3 4 " * 30000))
        with Panel(test, TANK, TANK_CONTROLLER, mimics=folder) as panel:
            look, plant = panel.look, panel.plant
            asked = []
            look.page.on("request", lambda request: asked.append(request.url))
            for name, value in [("level", "235"), ("pump", "ON"), ("valve", "OFF")]:
                plant.say("write", name, value)
            of = "document.querySelector('.mimic [data-tag=%s]')"
            look.until(f"{of % 'pump'}?.getAttribute('fill') === '#0a7d2c'")
            look.until(f"{of % 'level'}.textContent === '2.35 m'")
            look.until("document.querySelector('.mimic [data-show]').getAttribute('visibility') === 'hidden'")
            plant.say("write", "valve", "ON")
            look.until(f"{of % 'valve'}.getAttribute('stroke') === '#b3261e'")
            look.until("document.querySelector('.mimic [data-show]').getAttribute('visibility') === 'visible'")
            panel.said("The tank", "not in the ladder: nobody")
            panel.said("The tank", "script")
            look.picture("panel-mimic")
            look.page.locator(".mimic circle").click()
            look.until("document.querySelector('#why pre')?.textContent.startsWith('pump (C0) is ON')")
            look.page.keyboard.press("Escape")
            look.page.locator(".mimic rect").click(position={"x": 5, "y": 5})
            assert look.says("window.hacked === undefined"), look.says("window.hacked")
            left = look.says("[...document.querySelectorAll('.mimic *')].filter(of => /^(script|style|image|a|use|foreignObject|animate|iframe)$/i.test(of.localName)"
                             " || [...of.attributes].some(at => /^on|href/i.test(at.name))).map(of => of.outerHTML)")
            assert not left, left
            assert look.says("document.getElementById('content').localName") == "main", "a name of the drawing hides one of the page"
            assert all(look.origin in url for url in asked), asked
            look.fine()


PANEL_CHECKS = [
    a_mimic_follows_its_tags_and_nothing_of_it_executes,
    a_recipe_is_edited_loaded_saved_and_written_as_one_change,
    a_panel_lists_the_alarms_of_its_group_and_lamps_have_colours,
    a_command_is_taken_and_an_operator_is_never_told_to_force,
    a_set_value_is_entered_by_a_keypad_within_its_limits,
]
