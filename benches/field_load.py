#!/usr/bin/env python3
"""Cost of 2,000 points on 16 Modbus devices: processor time of rungd, and lateness of its scans.

usage: benches/field_load.py [SECONDS [POLL_MS...]]        (default 30, 20 10)

Needs a release build (`cargo build --release`, or RUNGD=PATH) and Python 3. A separate process
simulates 16 devices (tests/peer/watched_io.py) of 125 points each: 40 discrete inputs, 20 input
registers, 40 coils, 25 holding registers. The period is 10 ms, 16 outputs of each device change in
every scan, and no input changes. Runs without and with devices alternate. It prints the processor
time of the rungd process (utime + stime) as a share of one core, its overruns and its lateness. The
aim is a quarter of a core. The times depend on the machine: state its load with the figures.
"""

import json
import os
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RUNGD = os.environ.get("RUNGD", os.path.join(HERE, "target/release/rungd"))
DEVICES, COILS, DISCRETES, WORDS_OUT, WORDS_IN = 16, 40, 40, 25, 20
CHANGING = 16
TICK = os.sysconf("SC_CLK_TCK")


def ladder():
    """Each device has coils that change with every scan."""
    rungs = []
    for device in range(DEVICES):
        first = device * COILS
        outs = ", ".join(f'"OUT Y{first + n}"' for n in range(CHANGING))
        rest = ", ".join(f'"OUT Y{first + n}"' for n in range(CHANGING, COILS))
        rungs.append(f'  {{ when = ["$ScanToggle"], do = [{outs}] }},')
        rungs.append(f'  {{ when = ["X{device * DISCRETES}"], do = [{rest}] }},')
    return '[[program]]\nname = "Main"\nrung = [\n' + "\n".join(rungs) + "\n]\n"


def controller(ports, poll_ms):
    text = 'ladder = ["ladder.toml"]\n'
    text += f"memory = {{ X = {DEVICES * DISCRETES}, Y = {DEVICES * COILS}, D = 2048 }}\n"
    for device, port in enumerate(ports):
        x, y = device * DISCRETES, device * COILS
        into, out = device * WORDS_IN, 1000 + device * WORDS_OUT
        text += f"""
[[device]]
name = "io{device}"
driver = "modbus-tcp"
address = "127.0.0.1:{port}"
poll = "{poll_ms}ms"
map = [
  {{ from = "discrete 0..{DISCRETES - 1}", to = "X{x}..X{x + DISCRETES - 1}" }},
  {{ from = "input 0..{WORDS_IN - 1}", to = "D{into}..D{into + WORDS_IN - 1}" }},
  {{ from = "Y{y}..Y{y + COILS - 1}", to = "coil 0..{COILS - 1}" }},
  {{ from = "D{out}..D{out + WORDS_OUT - 1}", to = "holding 0..{WORDS_OUT - 1}" }},
]
"""
    return text


def processor_s(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def run(folder, ports, poll_ms, seconds):
    """One turn; without ports it has no devices."""
    with open(os.path.join(folder, "controller.toml"), "w", encoding="utf-8") as file:
        file.write(controller(ports, poll_ms))
    command = [RUNGD, "run", os.path.join(folder, "controller.toml"), "--log-format", "json"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as rungd:
        time.sleep(2)
        before, since = processor_s(rungd.pid), time.monotonic()
        time.sleep(seconds)
        spent, over = processor_s(rungd.pid) - before, time.monotonic() - since
        rungd.terminate()
        lines = [json.loads(line) for line in rungd.stderr]
    whole = next(line for line in lines if line["event"] == "statistics")
    bad = [line["message"] for line in lines if line["event"] in ("device-trouble", "mode-fault")]
    return 100 * spent / over, whole, bad


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 30
    polls = [int(text) for text in sys.argv[2:]] or [20, 10]
    if not os.access(RUNGD, os.X_OK):
        sys.exit(f"no {RUNGD}: cargo build --release, or set RUNGD")
    peer = os.path.join(HERE, "tests/peer/watched_io.py")
    places = ["127.0.0.1:0"] * DEVICES
    watched = subprocess.Popen(
        [sys.executable, peer, *places], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    ports = json.loads(watched.stdout.readline())["listening"]
    points = DEVICES * (COILS + DISCRETES + WORDS_OUT + WORDS_IN)
    print(f"{DEVICES} devices, {points} points, 10 ms, {seconds:.0f} s each")
    print(f"load average {os.getloadavg()[0]:.1f}, {os.cpu_count()} processors")
    head = ["", "% of a core", "overruns", "skipped", "late p50 us", "late p99 us", "scan p99 us"]
    print(f"{head[0]:<12}" + "".join(f"{name:>13}" for name in head[1:]))
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "ladder.toml"), "w", encoding="utf-8") as file:
            file.write(ladder())
        for poll_ms in [None, *polls]:
            share, whole, bad = run(folder, ports if poll_ms else [], poll_ms, seconds)
            name = f"poll {poll_ms} ms" if poll_ms else "no devices"
            fields = ["late_us_p50", "late_us_p99", "scan_us_p99"]
            row = [share, whole["overruns"], whole["skipped"], *(whole[field] for field in fields)]
            print(f"{name:<12}" + "".join(f"{value:>13.1f}" for value in row))
            for message in bad[:5]:
                print(f"  {message}")
    watched.stdin.close()
    watched.wait()


if __name__ == "__main__":
    main()
