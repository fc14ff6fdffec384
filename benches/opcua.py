#!/usr/bin/env python3
"""The cost of `rungd-opcua` with 10,000 tags, of which 1,000 change every 100 ms, and five subscribers of all.

    cargo build --release -p rungd -p rungd-opcua && benches/opcua.py [SECONDS]

Prints the share of a core that `rungd-opcua` takes and the values that each subscriber received, and beside it the
controller's share, the overruns, and the memory of the server at the begin and at the end. SUBSCRIBERS=50 has more of
them. Needs pip: asyncua. docs/opcua.md has the figures.
"""

import asyncio
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from asyncua import Client, ua

from processes import free_port, megabytes, seconds

TAGS, CHANGING = 10_000, 1_000
SUBSCRIBERS = int(os.environ.get("SUBSCRIBERS", "5"))
BUILT = Path(os.environ.get("CARGO_TARGET_DIR", Path(__file__).resolve().parent.parent / "target")) / "release"


def write_files(folder, port):
    tags = "\n".join(f'value{n} = {{ at = "D{n}" }}' for n in range(TAGS))
    do = ",\n".join(f'"MATH value{n} = value{n} + 1"' for n in range(CHANGING))
    rung = f'[[program.rung]]\nwhen = ["rise($100ms)"]\ndo = [\n{do},\n]\n'
    (folder / "ladder.toml").write_text(f'[ladder]\nname = "t"\n[tags]\n{tags}\n[[program]]\nname = "Main"\n{rung}')
    (folder / "t.toml").write_text(
        'ladder = ["ladder.toml"]\noperator.socket = "t.sock"\nscan.period = "10ms"\nmemory.D = 10000\n')
    (folder / "opcua.toml").write_text(
        f'[server]\nname = "t"\nlisten = "127.0.0.1:{port}"\ncertificates = "pki"\ninsecure = true\n'
        f'sessions = {SUBSCRIBERS + 1}\n[controller]\nsocket = "t.sock"\n')


class Counter:
    def __init__(self):
        self.values = 0

    def datachange_notification(self, node, val, data):
        self.values += 1


async def subscriber(url, ready, over, counter):
    # A client gives its connection up if the server's answer takes longer than the watchdog's time.
    async with Client(url, timeout=120, watchdog_intervall=60) as client:
        subscription = await client.create_subscription(500, counter)
        nodes = [client.get_node(ua.NodeId(f"value{n}", 2)) for n in range(TAGS)]
        for at in range(0, TAGS, 1000):
            await subscription.subscribe_data_change(nodes[at:at + 1000], queuesize=10, sampling_interval=0)
        ready.release()
        await over.wait()


def subscribe(url, seconds_long, report):
    """A subscriber, in a process of its own: Python decodes slowly."""
    async def whole():
        ready, over, counter = asyncio.Semaphore(0), asyncio.Event(), Counter()
        task = asyncio.create_task(subscriber(url, ready, over, counter))
        await ready.acquire()
        os.write(report, b"r")
        before = counter.values
        await asyncio.sleep(seconds_long)
        os.write(report, json.dumps(counter.values - before).encode().rjust(16))
        over.set()
        await task
    asyncio.run(whole())


def main():
    lasts = float(sys.argv[1]) if len(sys.argv) > 1 else 30
    with tempfile.TemporaryDirectory() as folder:
        folder, port = Path(folder), free_port()
        write_files(folder, port)
        logs = [open(folder / name, "wb") for name in ("rungd.log", "opcua.log")]
        running = subprocess.Popen([BUILT / "rungd", "run", "t.toml"], cwd=folder, stdout=logs[0], stderr=logs[0])
        serving = subprocess.Popen([BUILT / "rungd-opcua", "opcua.toml"], cwd=folder, stdout=logs[1], stderr=logs[1])
        while "answers" not in (folder / "opcua.log").read_text():
            assert serving.poll() is None and running.poll() is None, (folder / "opcua.log").read_text()
            time.sleep(0.1)
        pipes, children = [], []
        for _ in range(SUBSCRIBERS):
            read, write = os.pipe()
            child = os.fork()
            if child == 0:
                subscribe(f"opc.tcp://127.0.0.1:{port}/", lasts + 5, write)
                os._exit(0)
            pipes.append(read)
            children.append(child)
        for pipe in pipes:
            assert os.read(pipe, 1) == b"r"
        time.sleep(2)
        begin, used = time.monotonic(), [seconds(running.pid), seconds(serving.pid)]
        memory = megabytes(serving.pid)
        time.sleep(lasts)
        took = time.monotonic() - begin
        used = [(seconds(process.pid) - before) / took for process, before in zip((running, serving), used)]
        print(f"rungd-opcua {used[1]:.1%} of a core, the controller {used[0]:.1%}; "
              f"memory {memory:.0f} MB, then {megabytes(serving.pid):.0f} MB")
        received = [int(os.read(pipe, 16)) for pipe in pipes]
        wanted = CHANGING * 10 * (lasts + 5)
        print(f"values a subscriber: {min(received)} to {max(received)}; {wanted:.0f} were made in that time")
        shown = subprocess.run([BUILT / "rungd", "status", "--socket", "t.sock", "--json"], cwd=folder,
                               capture_output=True, text=True).stdout
        print("overruns:", json.loads(shown)["scan"]["overruns"])
        for process in (serving, running):
            process.send_signal(signal.SIGTERM)
            process.wait(20)
        for child in children:
            os.waitpid(child, 0)


main()
