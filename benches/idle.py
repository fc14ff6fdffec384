#!/usr/bin/env python3
"""What a controller costs that nobody looks at: processor time and wake-ups of each thread.

usage: benches/idle.py [CONTROLLER [SECONDS [PERIOD …]]]
       (default config/rungd.toml, 20, 10ms 1ms)

One run for each period. The first second, with the start, is left out. The figures are nanoseconds
of /proc/PID/task/*/schedstat, user and system together, and the voluntary switches of its `status`;
a thread is told by its name. Other work on the machine makes each
wake-up dearer: compare two binaries in one run, one after the other, with RUNGD=old,new.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
CONTROLLER = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "config/rungd.toml"
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 20
PERIODS = sys.argv[3:] or ["10ms", "1ms"]
RUNGDS = os.environ.get("RUNGD", str(HERE / "target/release/rungd")).split(",")


def with_period(period):
    """The controller's text with a period, and with its ladders' paths made absolute."""
    folder = CONTROLLER.resolve().parent
    text = CONTROLLER.read_text()
    text = re.sub(r'"([^"\n]+\.toml)"', lambda path: f'"{folder / path[1]}"', text)
    text, found = re.subn(r'(?m)^(period\s*=\s*)"[^"]*"', rf'\1"{period}"', text)
    return text if found else sys.exit(f"{CONTROLLER} has no `period`")


def thread_times(pid):
    """The name of each thread, its processor time in ns and its wake-ups, by its number."""
    times = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        name = (task / "comm").read_text().strip()
        ns = int((task / "schedstat").read_text().split()[0])
        status = (task / "status").read_text()
        wakes = int(re.search(r"(?m)^voluntary_ctxt_switches:\s+(\d+)", status)[1])
        times[task.name] = (name, ns, wakes)
    return times


def measured(rungd, period):
    """Of a core in percent, and wake-ups a second: by the names of threads."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "controller.toml"
        file.write_text(with_period(period))
        environment = {**os.environ, "XDG_RUNTIME_DIR": folder, "TMPDIR": folder}
        with open(f"{folder}/log", "w") as log:
            process = subprocess.Popen([rungd, "run", file], env=environment, stdout=log, stderr=log)
        time.sleep(1)
        if process.poll() is not None:
            sys.exit(Path(folder, "log").read_text())
        begin, before = time.monotonic(), thread_times(process.pid)
        time.sleep(SECONDS)
        took, after = time.monotonic() - begin, thread_times(process.pid)
        process.terminate()
        process.wait()
    shares = {}
    for number, (name, ns, wakes) in after.items():
        _, ns_before, wakes_before = before.get(number, (name, 0, 0))
        share, rate = shares.get(name, (0, 0))
        shares[name] = (share + (ns - ns_before) / took / 1e7, rate + (wakes - wakes_before) / took)
    return shares


def main():
    for period in PERIODS:
        for rungd in RUNGDS:
            shares = measured(rungd, period)
            whole = sum(share for share, _ in shares.values())
            print(f"{period}, {rungd}: {whole:.2f} % of a core")
            for name, (share, rate) in sorted(shares.items(), key=lambda pair: -pair[1][0]):
                print(f"    {name:16} {share:6.2f} % {rate:8.0f} wake-ups a second")


main()
