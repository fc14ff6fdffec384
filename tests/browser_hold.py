"""Hold-to-run: checks for tests/browser.py, and the trials of docs/web.md.

A finger lies on the jog button of a crane, in a browser of its own; then the browser, the network or the server is
gone, in each of `CUTS`. The controller's own recording says when the motor stood; a control beside it is cut by
nothing.

usage of the trials: RUNGD_HOLD_TRIALS=17 tests/browser.py BINARY held_bit_goes_off_when_the_browser
"""

import os
import signal
import time

from browser_panels import Panel
from browser_rig import HEAD, Look, Pages, chromium, wait_for

CRANE = """
[ladder]
name = "crane"
[tags]
jog = { at = "C0", doc = "Jog button" }
limit = { at = "C1", doc = "Limit switch" }
motor = { at = "Y0" }
[[program]]
name = "Main"
rung = [
  { when = ["limit"], do = ["RST jog"] },
  { when = ["jog"], do = ["OUT motor"] },
]
"""
CRANE_CONTROLLER = HEAD + """
[web]
write = ["jog"]
[[panel]]
name = "Crane"
show = [{ hold = "jog", text = "Jog" }, { lamp = "motor", text = "Motor" }]
"""
# What the part of the button says.
SAID = "document.querySelector('.hold ~ [role=status]').textContent"
# A hold lasts so long after the last sign of the page, ms.
HOLD_MS = 400
# `scan.period` of every controller here.
SCAN_MS = 20


class OwnBrowser:
    """A browser of its own, whose processes can be signalled. Has what a check's `test` has for a look."""

    def __init__(self, beside):
        # The processes of all browsers name their program's folder alone: this one has a name for itself.
        self.name = f"--rungd-trial={os.getpid()}-{time.monotonic_ns()}"
        kind = beside.browser_type
        self.browser = kind.launch(executable_path=chromium()[0], args=["--no-sandbox", self.name])

    def look(self, pages, **options):
        return Look(self.browser, pages.link, **options)

    def processes(self):
        """Its processes, each with its command line: the one with the name, and those below it."""
        all_of = {}
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{pid}/stat") as file:
                    parent = int(file.read().rsplit(")", 1)[1].split()[1])
                with open(f"/proc/{pid}/cmdline", "rb") as file:
                    all_of[int(pid)] = parent, file.read().decode(errors="replace").replace("\0", " ")
            except OSError:
                pass  # it has ended
        own = {pid for pid, (_, command) in all_of.items() if self.name in command and "--type=" not in command}
        while more := {pid for pid, (parent, _) in all_of.items() if parent in own} - own:
            own |= more
        return {pid: all_of[pid][1] for pid in own}

    def signal(self, number, words=""):
        """Sends a signal to its processes with these words in their command lines."""
        for pid in [pid for pid, command in self.processes().items() if words in command]:
            try:
                os.kill(pid, number)
            except ProcessLookupError:
                pass  # its parent took it along

    def kill(self):
        self.signal(signal.SIGKILL)
        try:
            self.browser.close()
        except Exception:  # it is gone
            pass


class Crane(Panel):
    """A crane with a jog button in a browser of its own, and a second `rungd web`, which reads the controller's own recording."""

    def __init__(self, test):
        self.browser = OwnBrowser(test.browser)
        super().__init__(self.browser, CRANE, CRANE_CONTROLLER)
        self.watching = Pages(self.plant)
        self.watcher = test.look(self.watching)
        self.watcher.open("panel")

    def __exit__(self, *wrong):
        # Two hundred trials leave no page behind that costs time in the next one.
        self.browser.kill()
        self.watcher.context.close()
        self.watching.end()
        super().__exit__(*wrong)

    def press(self):
        """Puts a finger on the button until the motor runs; on a busy machine a press may come too late."""
        box = self.look.page.locator("button.hold").bounding_box()
        self.look.page.mouse.move(box["x"] + 20, box["y"] + 20)
        for _ in range(50):
            self.look.page.mouse.down()
            self.look.until(f"!{SAID}.startsWith('…')")
            if self.look.says(SAID) == "ON while pressed":
                return
            self.look.page.mouse.up()
        raise AssertionError("the motor never ran")

    def ended(self, gone_ms):
        """The times from `gone_ms` to the last scan in which the motor ran, and to the first one in which it did not, in ms, by the scan log."""
        wait_for("a motor that stands", lambda: self.plant.value("motor") in (False, 0))
        found = wait_for("the last scan that ran", lambda: self.watcher.says("""async () => {
          const points = (await (await fetch('/api/trend?operand=motor')).json()).points.filter(point => point[1]);
          const off = points[points.length - 1];
          if (!off || off[2] !== false || points.length < 2) return null;
          const hold = (await (await fetch('/api/hold')).json()).hold;
          const scan = await fetch(`/api/scan?tags=motor&hold=${hold}&scan=${off[1] - 1}`);
          return scan.ok ? { last: await scan.json(), off_ms: off[0] } : null;
        }"""))
        assert found["last"]["values"]["motor"] is True, found
        return found["last"]["time_ms"] - gone_ms, found["off_ms"] - gone_ms


def now_ms():
    return time.time() * 1000


def a_held_bit_goes_off_when_the_finger_leaves_it(test):
    with Crane(test) as crane:
        look = crane.look
        crane.press()
        wait_for("a motor that runs", lambda: crane.plant.value("motor"))
        look.picture("panel-hold")
        # It goes on for longer than one hold, and ends when the finger leaves.
        seen = look.says("state.scan")
        look.until("scan => state.scan > scan + 60", seen)
        if look.says(SAID) == "ON while pressed":
            assert crane.plant.value("motor")
        look.page.mouse.up()
        crane.ended(now_ms())
        assert "released jog" in crane.log() or "is gone from the button of jog" in crane.log()
        # What the ladder resets stays OFF while the finger is still there.
        crane.press()
        crane.plant.say("write", "limit", "ON")
        crane.plant.say("write", "limit", "OFF")
        look.until("state.values.jog === false")
        look.page.mouse.up()
        # By the keyboard.
        look.page.locator("button.hold").focus()
        look.page.keyboard.down(" ")
        look.until(f"{SAID} !== '…'")
        look.page.keyboard.up(" ")
        crane.ended(now_ms())
        look.errors.clear()


def a_held_bit_goes_off_when_the_browser_the_network_or_the_server_is_gone(test):
    """Each way once; RUNGD_HOLD_TRIALS=N: N times, and no failure ends the trials."""
    told, late = [], []
    count = int(os.environ.get("RUNGD_HOLD_TRIALS", "1"))
    for trial in range(count):
        the_control_runs_on(test, trial)
        for name, cut in CUTS.items():
            with Crane(test) as crane:
                crane.press()
                cut(crane)
                last, off = crane.ended(now_ms())
            told.append((name, off))
            print(f"  {name}, trial {trial}: OFF {off:.0f} ms after it" if off > 0 else f"  {name}, trial {trial}: OFF before it was told", flush=True)
            # The last scan that ran does not depend on how late a scan comes on a busy machine.
            if last > HOLD_MS:
                late.append((name, trial, last, off))
    worst = max(told, key=lambda one: one[1])
    print(f"  {len(told)} cuts in {len(CUTS)} ways; the latest OFF was {worst[1]:.0f} ms after it ({worst[0]})", flush=True)
    assert not late, f"the motor ran on for longer than a hold: {late}"


def the_control_runs_on(test, trial):
    """Nothing is cut: the motor runs for three times as long as a hold without a renewal."""
    with Crane(test) as crane:
        crane.press()
        seen = crane.watcher.says("state.scan")
        crane.watcher.until(f"scan => state.scan > scan + {3 * HOLD_MS // SCAN_MS}", seen)
        runs, said = crane.plant.value("motor"), crane.look.says(SAID)
        # On a busy machine the page itself may be late, and says so.
        assert runs or said != "ON while pressed", "the motor stands, and the button says that it runs"
        print(f"  nothing is cut, trial {trial}: " + ("it runs on" if runs else f"the button says `{said}`"), flush=True)
        crane.look.page.mouse.up()
        crane.look.errors.clear()


def cut_network(crane):
    devtools = crane.look.context.new_cdp_session(crane.look.page)
    devtools.send("Network.enable")
    devtools.send("Network.emulateNetworkConditions", {"offline": True, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1})


def freeze_tab(crane):
    devtools = crane.look.context.new_cdp_session(crane.look.page)
    # As in a debugger: not one more line of the page is executed.
    devtools.send("Debugger.enable")
    devtools.send("Debugger.pause")


def block_tab(crane):
    # The page's only thread is busy for ever.
    crane.look.page.evaluate("setTimeout(() => { const end = Date.now() + 3000; while (Date.now() < end); }, 0)")


def close_connections(crane):
    # What stands between the browser and the controller lets no connection through and breaks those that there are.
    crane.look.context.route("**/api/press", lambda route: route.abort())


CUTS = {
    "the network is cut": cut_network,
    "every request fails": close_connections,
    "the tab is frozen": freeze_tab,
    "the page is busy": block_tab,
    "the tab is killed": lambda crane: crane.browser.signal(signal.SIGKILL, "--type=renderer"),
    "the tab stands still": lambda crane: crane.browser.signal(signal.SIGSTOP, "--type=renderer"),
    "the browser is killed": lambda crane: crane.browser.signal(signal.SIGKILL),
    "the browser stands still": lambda crane: crane.browser.signal(signal.SIGSTOP),
    "the page is closed": lambda crane: crane.look.page.close(),
    "the page is left": lambda crane: crane.look.page.goto("about:blank"),
    "rungd web is killed": lambda crane: crane.pages.process.kill(),
    "rungd web stands still": lambda crane: crane.pages.process.send_signal(signal.SIGSTOP),
}


def a_slow_network_makes_no_press_longer(test):
    with Crane(test) as crane:
        look = crane.look
        look.until("clock !== null")
        # Every press and renewal is on its way for longer than a hold lasts.
        waiting = []
        look.page.route("**/api/press", lambda route: waiting.append(route))
        box = look.page.locator("button.hold").bounding_box()
        look.page.mouse.move(box["x"] + 20, box["y"] + 20)
        look.page.mouse.down()
        look.until_asked(waiting, 1)
        sent = time.monotonic()
        wait_for("time to pass", lambda: time.monotonic() > sent + HOLD_MS / 1000)
        for route in waiting:
            route.continue_()
        look.page.unroute("**/api/press")
        look.until("/nothing is done|no answer/.test(document.querySelector('.hold ~ [role=status]').textContent)")
        look.page.mouse.up()
        assert "wrote ON to jog" not in crane.log(), "a press that was late moved the machine"
        look.errors.clear()


HOLD_CHECKS = [
    a_held_bit_goes_off_when_the_finger_leaves_it,
    a_held_bit_goes_off_when_the_browser_the_network_or_the_server_is_gone,
    a_slow_network_makes_no_press_longer,
]
