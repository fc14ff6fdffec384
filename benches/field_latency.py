#!/usr/bin/env python3
"""Latency from an input's change at a remote device to the output's change there: a histogram.

usage: benches/field_latency.py [SAMPLES]        (default 1000 a row)

Needs a release build (`cargo build --release`, or RUNGD=PATH) and Python 3. The peer is one device
of tests/peer/watched_io.py, in this process. It turns a discrete input ON or OFF at a random moment;
rungd reads the input, the ladder copies it to an output, and rungd writes the output. The peer's
clock measures the whole time. For each period and `poll` it prints the share of samples above the
bound: two scan periods, one poll, and the duration of the last exchange according to `rungd
status`. The times depend on the machine: state its load with the figures.
"""

import json
import os
import random
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(HERE, "tests/peer"))

from watched_io import Device, Serving, now_us  # noqa: E402

RUNGD = os.environ.get("RUNGD", os.path.join(HERE, "target/release/rungd"))
ROWS = [(1, 1), (1, 5), (1, 20), (10, 5), (10, 10), (10, 20)]
PATIENCE_S = 2
LADDER = '[[program]]\nname = "Main"\nrung = [ { when = ["X0"], do = ["OUT Y0"] } ]\n'


class Echo:
    """Changes the input, and waits for the output."""

    def __init__(self):
        self.device = Device(("127.0.0.1", 0))
        self.device.on_change = self.changed
        self.serving = Serving([self.device])
        self.came = threading.Event()
        self.at_us = 0
        self.over = False
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self):
        while not self.over:
            self.serving.turn(0.05)

    def changed(self, _device, bank, address, value):
        if (bank, address) == ("coil", 0) and value == self.device.banks["discrete"][0]:
            self.at_us = now_us()
            self.came.set()

    def sample(self, value):
        """The ms from the input's change to the output's; None: the output did not change."""
        self.came.clear()
        since_us = now_us()
        self.device.banks["discrete"][0] = value
        return (self.at_us - since_us) / 1000 if self.came.wait(PATIENCE_S) else None


def controller(port, period_ms, poll_ms, socket):
    return f"""ladder = ["ladder.toml"]
[scan]
period = "{period_ms}ms"
[operator]
socket = "{socket}"
[[device]]
name = "io"
driver = "modbus-tcp"
address = "127.0.0.1:{port}"
poll = "{poll_ms}ms"
map = [ {{ from = "discrete 0", to = "X0" }}, {{ from = "Y0", to = "coil 0" }} ]
"""


def exchange_ms(socket):
    """The durations of the last and of the slowest exchange, according to `rungd status`."""
    command = [RUNGD, "status", "--json", "--socket", socket]
    status = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    device = status["devices"]["field"][0]
    return device["took_us"] / 1000, device["took_max_us"] / 1000


def row(folder, period_ms, poll_ms, samples):
    echo = Echo()
    socket = os.path.join(folder, "socket")
    path = os.path.join(folder, "controller.toml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(controller(echo.device.address[1], period_ms, poll_ms, socket))
    with subprocess.Popen([RUNGD, "run", path], stderr=subprocess.DEVNULL) as rungd:
        time.sleep(1)
        times, lost = [], 0
        for at in range(samples):
            took = echo.sample(1 - at % 2)
            if took is None:
                lost += 1
            else:
                times.append(took)
            time.sleep(random.uniform(0.001, (period_ms + poll_ms) / 1000))
        answer = exchange_ms(socket)
        rungd.terminate()
    echo.over = True
    echo.thread.join()
    return sorted(times), lost, answer


def show(period_ms, poll_ms, times, lost, answer):
    bound = 2 * period_ms + poll_ms + answer[0]
    over = sum(took > bound for took in times)
    share = lambda p: times[min(len(times) - 1, int(len(times) * p))]  # noqa: E731
    print(
        f"\nperiod {period_ms} ms, poll {poll_ms} ms: p50 {share(0.5):.2f}, p99 {share(0.99):.2f}, "
        f"max {times[-1]:.2f} ms; exchange {answer[0]:.2f} (slowest {answer[1]:.2f}) ms"
    )
    print(f"  bound {bound:.2f} ms: {over} of {len(times)} took longer, {lost} never came")
    step = bound / 10
    bars = [0] * 16
    for took in times:
        bars[min(15, int(took / step))] += 1
    for at, count in enumerate(bars):
        if count:
            to = f"{(at + 1) * step:6.2f}" if at < 15 else "      "
            bar = "#" * max(1, 60 * count // max(bars))
            print(f"  {at * step:7.2f}..{to} ms {count:6d} {bar}")


def main():
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    if not os.access(RUNGD, os.X_OK):
        sys.exit(f"no {RUNGD}: cargo build --release, or set RUNGD")
    print(f"load average {os.getloadavg()[0]:.1f}, {os.cpu_count()} processors")
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "ladder.toml"), "w", encoding="utf-8") as file:
            file.write(LADDER)
        for period_ms, poll_ms in ROWS:
            show(period_ms, poll_ms, *row(folder, period_ms, poll_ms, samples))


if __name__ == "__main__":
    main()
