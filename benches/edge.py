#!/usr/bin/env python3
"""The cost of an edge node that publishes 1,000 tags, which change every 100 ms, to a mosquitto on this machine.

    cargo build --release && benches/edge.py [SECONDS]

Prints the share of a core that `rungd edge` takes, the share that the controller takes, and the number of values
that a host received in the same time. Needs mosquitto; pip: pysparkplug (with paho-mqtt 1). docs/edge.md has the figures.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import paho.mqtt.client as mqtt
from pysparkplug._protobuf import sparkplug_b_pb2

from processes import free_port, seconds

TAGS = 1000
RUNGD = Path(__file__).resolve().parent.parent / "target" / os.environ.get("PROFILE", "release") / "rungd"


def write_files(folder, port):
    tags = "\n".join(f'value{n} = {{ at = "D{n}" }}' for n in range(TAGS))
    do = ",\n".join(f'"MATH value{n} = value{n} + 1"' for n in range(TAGS))
    rung = f'[[program.rung]]\nwhen = ["rise($100ms)"]\ndo = [{do}]\n'
    (folder / "ladder.toml").write_text(f'[tags]\n{tags}\n[[program]]\nname = "Main"\n{rung}')
    (folder / "controller.toml").write_text(
        'ladder = ["ladder.toml"]\nscan.period = "10ms"\noperator.socket = "s"\nmemory.D = 1000\n'
    )
    (folder / "edge.toml").write_text(
        f'[node]\ngroup = "bench"\nname = "edge"\nsocket = "s"\nstate-dir = "state"\n'
        f'[broker]\naddresses = ["mqtt://127.0.0.1:{port}"]\n'
    )
    (folder / "mosquitto.conf").write_text(
        f"listener {port} 127.0.0.1\nallow_anonymous true\n"
    )


def listen(port):
    """Counts the received values of NDATA; the count is the only number of the returned list."""
    heard, client = [0], mqtt.Client()

    def on_message(client, data, message):
        payload = sparkplug_b_pb2.Payload()
        payload.ParseFromString(message.payload)
        heard[0] += sum(metric.alias > 0 for metric in payload.metrics)

    client.on_message = on_message
    client.connect("127.0.0.1", port)
    client.subscribe("spBv1.0/bench/NDATA/edge")
    client.loop_start()
    return heard


def main():
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 30
    with tempfile.TemporaryDirectory() as name:
        folder, port = Path(name), free_port()
        write_files(folder, port)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
        started = []
        try:
            started.append(subprocess.Popen(["mosquitto", "-c", "mosquitto.conf"], **quiet))
            controller = subprocess.Popen([RUNGD, "run", "controller.toml"], **quiet)
            started.append(controller)
            time.sleep(2)
            edge = subprocess.Popen([RUNGD, "edge", "edge.toml"], **quiet)
            started.append(edge)
            time.sleep(3)
            if any(process.poll() is not None for process in started):
                sys.exit("a process has ended: `rungd check` and the logs say why")
            heard = listen(port)
            time.sleep(1)
            heard_before = heard[0]
            before = [seconds(process.pid) for process in (edge, controller)]
            began = time.monotonic()
            time.sleep(duration)
            passed = time.monotonic() - began
            after = [seconds(process.pid) for process in (edge, controller)]
            values = heard[0] - heard_before
            memory = Path(f"/proc/{edge.pid}/status").read_text().split("VmRSS:")[1].split()[0]
        finally:
            for process in reversed(started):
                process.send_signal(signal.SIGTERM)
                process.wait()
    used = [100 * (end - begin) / passed for begin, end in zip(before, after)]
    print(f"{TAGS} tags every 100 ms over {passed:.0f} s:")
    print(f"rungd edge   {used[0]:5.1f} % of a core, {int(memory) / 1000:.0f} MB")
    print(f"heard        {values / passed:5.0f} values a second")
    print(f"rungd run    {used[1]:5.1f} % of a core")


if __name__ == "__main__":
    main()
