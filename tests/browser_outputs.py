"""What every page of `rungd web` shows of an output is what the machine has: checks for tests/browser.py.

A device of tests/peer/watched_io.py records what it really got. In RUN, on probation, in STOP, in FAULT and with the
device lost, each place that shows an output (panel, tags, ladder, trend, why) is compared with that record, and the
present mode must stand on every page, also while a scan of the past is looked at.
"""

import ctypes
import json
import os
import subprocess
import sys

import browser_rig as rig
from browser_rig import Look, Pages, Plant, wait_for

# Set and reset bits keep their values outside RUN; the safe values of the outputs differ.
LADDER = """
[ladder]
name = "oven"
devices = ["cabinet"]
[tags]
heat = { at = "C0" }
cool = { at = "C1" }
heater = { at = "Y0", doc = "Safe OFF" }
fan = { at = "Y1", doc = "Safe ON" }
valve = { at = "Y2", doc = "Holds" }
[[program]]
name = "Main"
rung = [
  { name = "on", when = ["heat"], do = ["SET heater", "SET valve"] },
  { name = "off", when = ["cool"], do = ["RST heater"] },
  { name = "air", when = ["$Off"], do = ["OUT fan"] },
]
"""
CONTROLLER = """
ladder = ["ladder.toml"]
scan.period = "20ms"
scan.watchdog = "3s"
operator.socket = "s"
[reload]
probation = "1h"
[outputs]
on = ["Y1"]
hold = ["Y2"]
[[device]]
name = "cabinet"
driver = "modbus-tcp"
address = "127.0.0.1:PORT"
timeout = "2s"
poll = "50ms"
loss-after = "30s"
map = [{ from = "Y0..Y2", to = "coil 0..2" }, { from = "discrete 0", to = "X0" }]
[[panel]]
name = "Oven"
show = [{ lamp = "heater" }, { lamp = "fan" }, { lamp = "valve" }, { value = "heater" }, { trend = "heater" }]
"""
# From linux/ptrace.h and linux/wait.h.
PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH, WALL = 0x4206, 0x4207, 17, 0x40000000
SCAN_THREAD = "rungd-scan"
OUTPUTS = ["heater", "fan", "valve"]
PAGES = ["overview", "ladder/Main", "tags", "alarms", "events", "devices", "panel", "trend/heater"]


class Cabinet:
    """The device: a process of its own, with its own record of what it got."""

    def __init__(self):
        script = os.path.join(rig.HERE, "tests/peer/watched_io.py")
        command = [sys.executable, script, "127.0.0.1:0"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.port = json.loads(self.process.stdout.readline())["listening"][0]

    def say(self, words):
        self.process.stdin.write(words + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def got(self):
        """ON or OFF of each output, as the device has it."""
        values = self.say(f"values 0 coil 0 {len(OUTPUTS)}")["values"]
        return dict(zip(OUTPUTS, ["ON" if value else "OFF" for value in values]))

    def end(self):
        self.process.kill()
        self.process.wait()


# The text of each place of the open page that shows an output.
PLACES = {
    "panel": """name => [...document.querySelectorAll(`[data-lamp=${name}], .panel [data-value-of=${name}]`)]
      .map(of => of.textContent.replace(/^[●○?] /, ''))""",
    "tags": "name => [document.querySelector(`main tbody [data-value=${name}]`).textContent]",
    "ladder/Main": """name => [...document.querySelectorAll(`[data-output=${name}]`)]
      .map(of => of.hidden ? null : of.querySelector('[data-value]').textContent)""",
}
TREND = "document.querySelector('main .tools [data-value]').textContent"
WHY = "document.querySelector('#why pre')?.textContent.split('\\n')[0] || ''"


def shows(look, place, fits):
    """Every place of a page shows each output as `fits` wants it."""
    look.open(place)
    for name in OUTPUTS:
        wanted = json.dumps(fits[name])
        look.until(f"name => {{ const all = ({PLACES[place]})(name); return all.length > 0"
                   f" && all.every(text => {wanted}.some(one => text === one || one && text?.startsWith(one))); }}", name)


def judge(look, plant, got, how):
    """Compares all pages with the device's record. `how`: the words after the value, or None in RUN."""
    value = {name: [got[name]] for name in OUTPUTS}
    if how == "safe value":
        value = {name: [f"{got[name]}, safe value"] for name in OUTPUTS}
    if how == "not known":
        value = {name: [f"not known, last {got[name]}"] for name in OUTPUTS}
    shows(look, "panel", value)
    look.picture(f"outputs-panel-{plant.mode()}-{how}".replace(" ", "-"))
    shows(look, "tags", value)
    look.picture(f"outputs-tags-{plant.mode()}-{how}".replace(" ", "-"))
    # The coil of a rung that is executed shows an output that follows memory.
    shows(look, "ladder/Main", value if how else {name: [None] for name in OUTPUTS})
    look.picture(f"outputs-ladder-{plant.mode()}-{how}".replace(" ", "-"))
    for name in OUTPUTS:
        look.open(f"trend/{name}")
        look.until(f"text => {TREND}.startsWith(text)", value[name][0])
        points = "async name => (await (await fetch('/api/trend?operand=' + name)).json()).points.at(-1)[2]"
        last = {"ON": True, "OFF": False}[got[name]] if how != "not known" else None
        look.until(f"async ([name, last]) => await ({points})(name) === last", [name, last])
        look.page.click("h2 button")
        tells = {None: f"is {got[name]}", "safe value": f"its output is {got[name]}, the safe value",
                 "not known": f"its output is not known, last {got[name]}"}[how]
        look.until(f"tells => {WHY}.includes(tells)", tells)
        look.page.keyboard.press("Escape")
    look.picture(f"outputs-trend-{plant.mode()}-{how}".replace(" ", "-"))
    mode_stands(look, plant)


def mode_stands(look, plant):
    """The present mode is in the head of every page, and outside RUN no block runs."""
    mode = plant.mode()
    for name in PAGES:
        look.open(name)
        look.until("mode => document.querySelector('#mode').textContent.startsWith(mode)", mode)
    look.open("overview")
    runs = "runs" if mode == "RUN" else "does not run"
    look.until("runs => document.querySelector('#runs td')?.textContent === runs", runs)
    look.picture(f"outputs-overview-{mode}")


def fault(plant, is_over):
    """Holds the scan thread alone, longer than the watchdog allows, until `is_over`."""
    tasks = f"/proc/{plant.process.pid}/task"
    threads = {open(f"{tasks}/{tid}/comm").read().strip(): int(tid) for tid in os.listdir(tasks)}
    thread = threads[SCAN_THREAD]
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long] * 4
    for request in (PTRACE_SEIZE, PTRACE_INTERRUPT):
        assert libc.ptrace(request, thread, 0, 0) == 0, os.strerror(ctypes.get_errno())
    os.waitpid(thread, WALL)
    wait_for("a FAULT", is_over)
    libc.ptrace(PTRACE_DETACH, thread, 0, 0)


def what_is_shown_of_an_output_is_what_the_device_got(test):
    cabinet = Cabinet()
    plant = Plant(LADDER, CONTROLLER.replace("PORT", str(cabinet.port)))
    pages = Pages(plant)
    try:
        look = Look(test.browser, pages.link)
        plant.say("write", "heat", "ON")
        on = {"heater": "ON", "fan": "OFF", "valve": "ON"}
        wait_for("the outputs at the device", lambda: cabinet.got() == on)
        judge(look, plant, cabinet.got(), None)
        # Memory keeps a bit that is set; the device has the safe values.
        plant.say("mode", "stop")
        safe = {"heater": "OFF", "fan": "ON", "valve": "ON"}
        wait_for("the safe values", lambda: cabinet.got() == safe)
        assert plant.value("heater") in (True, 1)
        judge(look, plant, cabinet.got(), "safe value")
        plant.say("mode", "run")
        wait_for("RUN again", lambda: plant.mode() == "RUN" and cabinet.got()["heater"] == "ON")
        a_scan_of_the_past_hides_no_fault(look, plant, cabinet)
        judge(look, plant, cabinet.got(), "safe value")
        plant.say("mode", "run")
        wait_for("RUN again", lambda: plant.mode() == "RUN" and cabinet.got()["heater"] == "ON")
        # The device does not answer: nobody knows whether it has the last command.
        before = cabinet.got()
        cabinet.say("silent 0 on")
        wait_for("a lost device", lambda: plant.say("read", "heater")["values"][0].get("unknown"))
        plant.say("write", "heat", "OFF")
        plant.say("write", "cool", "ON")
        wait_for("the bit", lambda: plant.value("heater") in (False, 0))
        assert cabinet.got() == before
        judge(look, plant, cabinet.got(), "not known")
        cabinet.say("silent 0 off")
        wait_for("a device that answers", lambda: cabinet.got()["heater"] == "OFF")
        shows(look, "panel", {name: [cabinet.got()[name]] for name in OUTPUTS})
        # On probation the new program drives; after a fault the program before it.
        plant.write(LADDER.replace('["$Off"]', '["$On"]'))
        assert "failed" not in plant.say("reload")
        wait_for("the new program's output", lambda: cabinet.got()["fan"] == "ON")
        judge(look, plant, cabinet.got(), None)
        fault(plant, lambda: cabinet.got()["heater"] == "OFF" and plant.mode() == "FAULT")
        wait_for("the program before it", lambda: plant.mode() == "RUN" and cabinet.got()["fan"] == "OFF")
        judge(look, plant, cabinet.got(), None)
        look.fine()
    finally:
        pages.end()
        plant.end()
        cabinet.end()


def a_scan_of_the_past_hides_no_fault(look, plant, cabinet):
    look.open("ladder/Main")
    # The minute that is held is one that has been shown.
    look.until("state.now.mode === 'RUN' && state.mode === 'RUN'")
    look.hold()
    fault(plant, lambda: plant.mode() == "FAULT" and cabinet.got()["heater"] == "OFF")
    for name in ["ladder/Main", "overview", "tags", "panel"]:
        look.page.goto(f"{look.origin}/#{name}")
        look.until("state.hold && document.querySelector('#mode').textContent.startsWith('FAULT')")
        look.until("/you look at scan \\d+, .* in RUN/.test(document.querySelector('#clock').textContent)")
    look.page.goto(f"{look.origin}/#overview")
    look.until("document.querySelector('#runs td')?.textContent === 'does not run'")
    look.picture("outputs-paused-FAULT")
    look.page.goto(f"{look.origin}/#ladder/Main")
    look.page.click("#hold")
    look.until("!state.hold")
