"""The shared parts of tests/browser.py and benches/browser.py: a controller, `rungd web`, and a page of the browser.

Playwright drives headless Chromium. This module checks and measures nothing: the checks are in
tests/browser.py, the measurements in benches/browser.py.
"""

import http.server
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
TARGET = os.environ.get("CARGO_TARGET_DIR", os.path.join(HERE, "target"))
RUNGD = os.environ.get("RUNGD") or os.path.join(TARGET, "release/rungd")
PICTURES = os.path.join(TARGET, "browser")
# The longest wait for an event that should come within seconds; no result depends on it.
PATIENCE = float(os.environ.get("RUNGD_PATIENCE", "300"))

LADDER = """
[ladder]
name = "packing"
doc = "A line that packs parts."
[tags]
start = { at = "C0", doc = "Starts the line" }
halt = { at = "C1", doc = "Stops the line" }
level = { at = "D0", min = 0, max = 100, doc = "Set by people" }
lamp = { at = "Y0", doc = "The line runs" }
horn = { at = "Y1" }
parts = { at = "CT0", doc = "Parts in the box" }
wait = { type = "timer" }
status = { at = "D1", doc = "Set by people" }
stuck = { type = "bit", alarm = "The line is stuck" }
[[program]]
name = "Main"
doc = "What runs the line."
[[program.rung]]
name = "run"
doc = "It holds itself until it is halted"
when = ["start | lamp", "!halt", "level > 10"]
do = ["OUT lamp"]
[[program.rung]]
leg.up = ["rise(start)"]
leg.rst = ["halt"]
do = ["CNT parts preset=5"]
[[program.rung]]
when = ["lamp", "!halt"]
do = ["TMR wait preset=20s"]
[[program.rung]]
when = ["halt", "start"]
do = ["OUT stuck", "OUT horn"]
[[program.rung]]
name = "drain"
when = ["level * 2 - 1 > 120 | status.3", "wait.Acc < 20s"]
do = ["CALL Drain", "OUT status.4"]
"""
# Rungs far below the visible part of the page, a block that does not run, and Stages.
MORE = "".join(f'[[program.rung]]\nwhen = ["X{n}", "lamp"]\ndo = ["OUT C{n + 100}"]\n' for n in range(60))
MORE += """
[[subroutine]]
name = "Drain"
doc = "Called while the level is high."
[[subroutine.rung]]
when = ["level > 90"]
do = ["OUT Y3"]
[[subroutine.rung]]
when = ["level > 20"]
do = ["CALL Deep"]
[[subroutine]]
name = "Deep"
[[subroutine.rung]]
when = ["level > 30"]
do = ["OUT C90"]
[[program]]
name = "Side"
[[program.rung]]
when = ["start"]
do = ["OUT Y2"]
[[program]]
name = "Steps"
autostart = true
[[program.stage]]
name = "Empty"
[[program.stage.rung]]
when = ["lamp"]
do = ["JMP Full"]
[[program.stage]]
name = "Full"
[[program.stage.rung]]
when = ["!lamp"]
do = ["JMP Empty"]
"""
# The keys of every controller file here, which come first.
HEAD = """
ladder = ["ladder.toml"]
scan.period = "20ms"
scan.watchdog = "30s"
operator.socket = "s"
"""
CONTROLLER = HEAD + """
[web]
write = ["level", "start", "halt"]
[[panel]]
name = "Line"
show = [
  { lamp = "lamp", text = "Running" },
  { button = "start", text = "Start" },
  { value = "level" },
  { bar = "level", min = 0, max = 100 },
  { trend = "parts.Acc" },
]
"""
PAGES = ["overview", "ladder/Main", "ladder/Steps.Empty", "ladder/Side", "tags", "alarms", "events", "devices", "panel", "trend/level"]


def cannot(why):
    print(f"tests/browser.py cannot be run here: {why}", file=sys.stderr)
    sys.exit(77)


def wait_for(what, is_there):
    """Calls `is_there` until its result is true; returns the result."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = is_there()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(f"not in {PATIENCE} s: {what}")


class Plant:
    """A controller in its own folder."""

    def __init__(self, ladder=LADDER + MORE, controller=CONTROLLER):
        self.folder = tempfile.mkdtemp(prefix="rungd-b-")
        self.socket = os.path.join(self.folder, "s")
        self.write(ladder)
        with open(os.path.join(self.folder, "controller.toml"), "w") as file:
            file.write(controller)
        self.start()

    def write(self, ladder):
        with open(os.path.join(self.folder, "ladder.toml"), "w") as file:
            file.write(ladder)

    def start(self):
        log = open(os.path.join(self.folder, "log"), "a")
        # In its folder, so that the pages show short names of files.
        command = [os.path.abspath(RUNGD), "run", "controller.toml"]
        self.process = subprocess.Popen(command, stderr=log, stdout=log, cwd=self.folder)
        wait_for("a controller that runs", lambda: self.mode() == "RUN")

    def say(self, *words):
        command = [RUNGD, *words, "--socket", self.socket, "--json"]
        done = subprocess.run(command, capture_output=True, text=True)
        return json.loads(done.stdout) if done.returncode == 0 else {"failed": done.stderr}

    def mode(self):
        return self.say("status").get("mode")

    def value(self, operand):
        return self.say("read", operand)["values"][0]["value"]

    def last_line(self):
        with open(os.path.join(self.folder, "log")) as file:
            return file.read().splitlines()[-1:]

    def end(self):
        self.process.kill()
        self.process.wait()


class Pages:
    """`rungd web` for a controller."""

    def __init__(self, plant, *arguments):
        command = [RUNGD, "web", "--socket", plant.socket, "--listen", "127.0.0.1:0", *arguments]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        first = next(line for line in self.process.stderr if "://" in line)
        found = re.search(r"(http://[^/\s]+)(/in\S*)?", first)
        assert found, first
        self.address, self.link = found.group(1), found.group(0)
        threading.Thread(target=self.process.stderr.read, daemon=True).start()

    def end(self):
        self.process.kill()
        self.process.wait()


class Foreign(http.server.BaseHTTPRequestHandler):
    """The server of a different site, with empty pages."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!DOCTYPE html><title>elsewhere</title><p>elsewhere</p>")

    def log_message(self, *_):
        pass


class Look:
    """A page of the browser, and its errors."""

    def __init__(self, browser, link, **options):
        options = {"viewport": {"width": 1200, "height": 850}, **options}
        self.context = browser.new_context(**options)
        self.context.set_default_timeout(PATIENCE * 1000)
        self.page = self.context.new_page()
        self.errors = []
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(link)
        self.origin = re.match(r"http://[^/]+", link).group(0)

    def open(self, name):
        """Opens a page, and waits until it shows live values."""
        self.page.goto(f"{self.origin}/#{name}")
        self.until("page && state.scan > 0 && !document.querySelector('#link.error')")
        if name.startswith("ladder"):
            self.until("document.querySelectorAll('.rung').length > 0"
                       " && [...page.shown.places.values()].some(of => of.power !== undefined)")
        if name.startswith("trend"):
            self.until("/changes/.test(document.querySelector('main p[role=status]').textContent)")
        if name == "tags":
            self.until("document.querySelectorAll('main tbody tr').length > 3")
        self.until("![...document.querySelectorAll('main [data-value]')].some("
                   "of => of.offsetParent && of.getBoundingClientRect().top < innerHeight && of.textContent === '…')")

    def until(self, script, argument=None):
        """Waits until a script returns true. (The page's CSP forbids Playwright's own waiting.)"""
        def is_so():
            try:
                return self.says(script, argument)
            except Exception as error:  # the browser may be leaving the page
                return "context was destroyed" not in str(error) and self.fail(error)
        wait_for(script, is_so)

    def until_asked(self, requests, count):
        """Lets the browser work until `count` requests wait in the list of a route."""
        wait_for(f"{count} requests", lambda: self.says("true") and len(requests) >= count)

    def fail(self, error):
        raise error

    def says(self, script, argument=None):
        return self.page.evaluate(script, argument)

    def hold(self):
        """Pauses at the last scan of the minute."""
        self.page.click("#hold")
        self.until("state.hold && state.scan === Number(document.querySelector('#scan').value)"
                   " && state.scan === state.scans[1]")

    def picture(self, name):
        self.page.screenshot(path=os.path.join(PICTURES, f"{name}.png"))

    def fine(self):
        assert not self.errors, self.errors
        self.context.close()


def tell(page, name):
    """Prints what a page shows and knows after a failure, and keeps its picture."""
    try:
        known = page.evaluate("""() => [location.href, document.querySelector('#link')?.textContent,
            page && 'a page', state.scan, state.mode, source && source.readyState, JSON.stringify(view)].join('; ')""")
        print(f"  {known}\n  {' '.join(page.inner_text('main').split())[:300]}")
        page.screenshot(path=os.path.join(PICTURES, f"{name}.png"))
    except Exception as error:  # a page that does not answer
        print(f"  {name}: {error}")


def chromium():
    """The path of the browser's program, and Playwright."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        cannot("no Playwright: pip install playwright")
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not found:
        cannot("no Chromium: apt-get install chromium")
    return found, sync_playwright
