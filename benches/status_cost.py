#!/usr/bin/env python3
"""Cost of observers: `rungd status` twice a second, and `rungd watch` of 50 operands, against idle.

usage: benches/status_cost.py [ROUNDS [PERIOD]]      (default 10, 1ms)

One controller with 1000 rungs runs through all rounds, with SCHED_FIFO 80 if that is granted. A round
has four phases: idle, status, idle, watch. Each phase lasts for three of the controller's two-second
reports; the first report is left out, as it began in the phase before. It prints the medians over the
reports of each kind, in microseconds, and the differences of status and watch from idle. RUNGD names
a different binary.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROUNDS = int(sys.argv[1]) if len(sys.argv) > 1 else 10
PERIOD = sys.argv[2] if len(sys.argv) > 2 else "1ms"
HERE = Path(__file__).resolve().parent.parent
RUNGD = os.environ.get("RUNGD", str(HERE / "target/release/rungd"))
FIGURES = ["late_us_p50", "late_us_p99", "late_us_max", "scan_us_p50", "scan_us_p99", "scan_us_max"]
OPERANDS = [f"D{n}" for n in range(25)] + [f"C{n}" for n in range(25)]


def ladder():
    rungs = "".join(
        f'  {{ when = ["X{n % 64} | !C{n % 500}"], do = ["TMR T{n % 250} preset=1s"] }},\n'
        if n < 250
        else f'  {{ when = ["X{n % 64}", "!T{n % 250}.Done"], do = ["MOVE {n} to=D{n % 100}"] }},\n'
        for n in range(1000)
    )
    return f'[[program]]\nname = "Main"\nrung = [\n{rungs}]\n'


class Reports:
    """Collects the statistics that the controller logs."""

    def __init__(self, log):
        self.lines, self.arrived = [], threading.Condition()
        threading.Thread(target=self.read, args=(log,), daemon=True).start()

    def read(self, log):
        for line in log:
            line = json.loads(line)
            if line["message"].startswith("scan statistics of the last"):
                with self.arrived:
                    self.lines.append(line)
                    self.arrived.notify_all()

    def next(self, count):
        with self.arrived:
            first = len(self.lines)
            done = lambda: len(self.lines) >= first + count
            if not self.arrived.wait_for(done, timeout=60):
                sys.exit("no report of statistics came")
            return self.lines[first : first + count]


def phase(kind, reports, environment):
    stop = threading.Event()

    def status():
        while not stop.wait(0.5):
            subprocess.run([RUNGD, "status"], env=environment, stdout=subprocess.DEVNULL, check=True)

    looker = None
    if kind == "status":
        threading.Thread(target=status, daemon=True).start()
    elif kind == "watch":
        looker = subprocess.Popen([RUNGD, "watch", *OPERANDS], env=environment, stdout=subprocess.DEVNULL)
    found = reports.next(3)[1:]
    stop.set()
    if looker:
        looker.kill()
        looker.wait()
    return found


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "ladder.toml").write_text(ladder())
        fifo = subprocess.run(["chrt", "-f", "80", "true"], capture_output=True).returncode == 0
        posture = '[realtime]\npolicy = "fifo"\npriority = 80\n' if fifo else ""
        (folder / "controller.toml").write_text(
            f'ladder = ["ladder.toml"]\nscan.period = "{PERIOD}"\nlog.statistics = "2s"\n{posture}'
            '[operator]\nsocket = "s"\n'
        )
        environment = {**os.environ, "RUNGD_SOCKET": str(folder / "s")}
        command = [RUNGD, "run", str(folder / "controller.toml"), "--log-format", "json"]
        rungd = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
        try:
            measure(Reports(rungd.stderr), environment, fifo)
        finally:
            rungd.terminate()
            rungd.wait()


def measure(reports, environment, fifo):
    began = time.time()
    found = {"idle": [], "status": [], "watch": []}
    reports.next(1)
    for _ in range(ROUNDS):
        for kind in ["idle", "status", "idle", "watch"]:
            found[kind] += phase(kind, reports, environment)
    how = "SCHED_FIFO 80" if fifo else "no SCHED_FIFO here"
    print(f"period {PERIOD}, {how}, {time.time() - began:.0f} s; medians over reports of 2 s, us")
    print(f"{'':14}" + "".join(f"{kind:>10}" for kind in found) + "   status-idle  watch-idle")
    for figure in FIGURES:
        middle = {kind: statistics.median(line[figure] for line in found[kind]) for kind in found}
        row = "".join(f"{middle[kind]:10.1f}" for kind in found)
        differences = (middle["status"] - middle["idle"], middle["watch"] - middle["idle"])
        print(f"{figure:14}{row}{differences[0]:14.1f}{differences[1]:12.1f}")
    for figure in ["overruns", "skipped", "scans"]:
        row = "".join(f"{sum(line[figure] for line in found[kind]):10}" for kind in found)
        print(f"{figure:14}{row}")


main()
