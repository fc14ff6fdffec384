#!/usr/bin/env python3
"""The cost of a viewer of `rungd web`: in the browser, in `rungd web`, in the controller.

usage: benches/browser.py [BINARY [SECONDS [WORD]]]      (default: target/release/rungd, 10; WORD: lift or rungs)

For the lift station and for a ladder of 10,000 rungs (10 ms a scan) it prints:
  - the time from navigation to the first rung that is drawn with its power: for the first visitor
    of the process, for a visitor after some time without visitors, and for the next visitor;
  - over SECONDS with one viewer of the ladder: events per second, the share of time for which the
    browser's main thread has tasks (Chromium's `Performance.getMetrics`, TaskDuration), the share
    of a core of the process of `rungd web`, and of the controller's;
  - the controller's lateness (p50, p99, max) and its overruns, each in a separate RUN: without a
    viewer, with a browser on this machine, with a viewer elsewhere, and without a viewer again.
It has no limits to pass or fail: figures of a busy machine mean little. It needs the same programs as
tests/browser.py.
"""

import os
import shutil
import sys
import threading
import time
import urllib.request

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(HERE, "tests"))

import browser_rig as rig  # noqa: E402

RUNGS, TAGS = 10_000, 5_000
LARGE = """
ladder = ["ladder.toml"]
scan.period = "10ms"
scan.watchdog = "30s"
operator.socket = "s"
memory.C = 6000
"""
# A time without viewers that is longer than `VIEWED` of crates/web/src/follow.rs.
NOBODY_S = 12

FIRST = """new MutationObserver((_, self) => {
  if (!window.first && document.querySelector('.rung .on')) { window.first = performance.now(); self.disconnect(); }
}).observe(document, { subtree: true, childList: true, attributes: true, attributeFilter: ['class'] });"""


def large_ladder():
    def rung(n):
        one, other = n % TAGS, (7 * n + 1) % TAGS
        when = f'["tag_{one} | C{n % 200}", "!X{n % 60}", "D{n % 200} < {n % 30000 + 1}"]'
        return f'[[program.rung]]\nwhen = {when}\ndo = ["SET tag_{other}", "RST tag_{one}"]\n'

    tags = "".join(f'tag_{n} = {{ type = "bit", doc = "Number {n}" }}\n' for n in range(TAGS))
    rungs = "".join(rung(n) for n in range(RUNGS))
    return f'[ladder]\nname = "large"\n[tags]\n{tags}[[program]]\nname = "Main"\n{rungs}'


def lift_station():
    """The shipped example, in its own folder."""
    plant = rig.Plant.__new__(rig.Plant)
    plant.folder = rig.tempfile.mkdtemp(prefix="rungd-b-")
    shutil.copytree(os.path.join(HERE, "config"), plant.folder, dirs_exist_ok=True)
    with open(os.path.join(HERE, "config/lift-station.toml")) as file:
        text = file.read().replace('watchdog = "200ms"', 'watchdog = "30s"').replace('"lift-station.sock"', '"s"')
    with open(os.path.join(plant.folder, "controller.toml"), "w") as file:
        file.write(text)
    plant.socket = os.path.join(plant.folder, "s")
    plant.start()
    return plant


def cpu_s(process):
    """Processor time of a process so far."""
    with open(f"/proc/{process.pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def first_rung_ms(context, address, element):
    """Navigation to the first rung with power."""
    page = context.new_page()
    page.add_init_script(FIRST)
    page.goto(f"{address}/#ladder/{element}")
    return round(rig.wait_for("a rung with power", lambda: page.evaluate("window.first"))), page


def new_run(plant):
    """Starts a new RUN, so that the statistics start again."""
    plant.say("mode", "stop")
    rig.wait_for("a stop", lambda: plant.mode() != "RUN")
    plant.say("mode", "run")
    rig.wait_for("a run", lambda: plant.mode() == "RUN")


def lateness(plant, seconds, name):
    new_run(plant)
    time.sleep(seconds)
    scan = plant.say("status")["scan"]
    late = scan["lateness"]
    shown = ", ".join(f"{key[:-3]} {late[key]} us" for key in ("p50_us", "p99_us", "max_us") if key in late)
    print(f"  lateness {name}: {shown}; {scan['overruns']} overruns")


def viewed(plant, pages, page, seconds):
    """The cost of one viewer for the browser, for `rungd web` and for the controller."""
    page.evaluate("() => { window.events = 0; const before = take; take = (event) => { window.events++; before(event); }; }")
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")

    def busy_s():
        metrics = session.send("Performance.getMetrics")["metrics"]
        return next(of["value"] for of in metrics if of["name"] == "TaskDuration")

    before = [busy_s(), cpu_s(pages.process), cpu_s(plant.process), page.evaluate("window.events"), time.monotonic()]
    time.sleep(seconds)
    after = [busy_s(), cpu_s(pages.process), cpu_s(plant.process), page.evaluate("window.events"), time.monotonic()]
    main, web, daemon, events, wall = (b - a for a, b in zip(before, after))
    print(f"  one viewer: {events / wall:.1f} events/s; main thread busy {100 * main / wall:.1f} %; "
          f"rungd web {100 * web / wall:.1f} % of a core; controller {100 * daemon / wall:.1f} %")


class FarViewer:
    """A viewer whose browser is on a different machine: it only reads the events of a part of the ladder."""

    def __init__(self, context, pages, element):
        cookie = "; ".join(f"{of['name']}={of['value']}" for of in context.cookies())
        address = f"{pages.address}/events?element={element}&from=1&to=12"
        request = urllib.request.Request(address, headers={"Cookie": cookie})
        self.answer = urllib.request.urlopen(request)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        try:
            while self.answer.read1():
                pass
        except (OSError, ValueError, AttributeError):
            pass  # the connection was closed


def measure(browser, plant, element, seconds):
    lateness(plant, seconds, "without a viewer")
    pages = rig.Pages(plant)
    context = browser.new_context(viewport={"width": 1200, "height": 850})
    # Gets only the session's cookie: no page is open that would send requests.
    context.request.get(pages.link, max_redirects=0)
    cold, page = first_rung_ms(context, pages.address, element)
    page.close()
    time.sleep(NOBODY_S)
    idle, page = first_rung_ms(context, pages.address, element)
    page.close()
    warm, page = first_rung_ms(context, pages.address, element)
    print(f"  first rung with power: {cold} ms (first visitor), {idle} ms (nobody looked for {NOBODY_S} s), {warm} ms (next)")
    time.sleep(2)
    viewed(plant, pages, page, seconds)
    lateness(plant, seconds, "with a viewer on this machine")
    page.close()
    far = FarViewer(context, pages, element)
    before = cpu_s(pages.process)
    lateness(plant, seconds, "with a viewer on another one")
    print(f"  for that viewer: rungd web {100 * (cpu_s(pages.process) - before) / seconds:.1f} % of a core")
    far.answer.close()
    context.close()
    pages.end()
    lateness(plant, seconds, "without a viewer again")


def main():
    if len(sys.argv) > 1:
        rig.RUNGD = os.path.abspath(sys.argv[1])
    seconds = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    path, sync_playwright = rig.chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name, start, element in [
            ("the lift station, 50 ms a scan", lift_station, "Pumps"),
            (f"{RUNGS} rungs, 10 ms a scan", lambda: rig.Plant(large_ladder(), LARGE), "Main"),
        ]:
            if len(sys.argv) > 3 and sys.argv[3] not in name:
                continue
            print(f"{name}:", flush=True)
            plant = start()
            try:
                measure(browser, plant, element, seconds)
            finally:
                plant.end()
                shutil.rmtree(plant.folder, ignore_errors=True)
        browser.close()


if __name__ == "__main__":
    main()
