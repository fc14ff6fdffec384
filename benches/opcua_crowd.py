#!/usr/bin/env python3
"""Fifty OPC UA sessions for ten minutes, with a controller beside them and a control run.

    cargo build --release -p rungd -p rungd-opcua && nice -n 19 benches/opcua_crowd.py [SECONDS [SECONDS_OF_CONTROL]]

Two equal controllers (10,000 tags, of which 1,000 change every 100 ms, 10 ms a scan) run at the same time. In the first
run `rungd-opcua` serves fifty sessions from one of them, each with 20 monitored items of which ten change every 100 ms;
all clients are in one process, as nice as this one. In the control run the server and its clients are replaced by fifty
processes that only use as much of the processors. So what a run adds to the overruns of the first controller and not
to those of the second one is the server's. Prints the overruns of both in both runs, the memory of the server once a
minute, and the values that were received and lost: told by the overflow bit, or not. asyncua makes a subscription anew if
it hears nothing for one and a half of its keepalive times, and loses what its queues held: that is counted too. Needs
pip: asyncua. docs/opcua.md has the figures.
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

TAGS, CHANGING, SESSIONS = 10_000, 1_000, 50
STATIC, MOVING, QUEUE = 10, 10, 100
# Of a status: a queue was too short (OPC 10000-4, 7.39).
OVERFLOW = 0x80
# The server as its unit runs it.
SERVER_NICE = int(os.environ.get("SERVER_NICE", "10"))
BUILT = Path(os.environ.get("CARGO_TARGET_DIR", Path(__file__).resolve().parent.parent / "target")) / "release"
RUNGD = os.environ.get("RUNGD_BIN", BUILT / "rungd")


def write_files(folder, port):
    tags = "\n".join(f'value{n} = {{ at = "D{n}" }}' for n in range(TAGS))
    do = ",\n".join(f'"MATH value{n} = value{n} + 1"' for n in range(CHANGING))
    rung = f'[[program.rung]]\nwhen = ["rise($100ms)"]\ndo = [\n{do},\n]\n'
    (folder / "ladder.toml").write_text(f'[ladder]\nname = "t"\n[tags]\n{tags}\n[[program]]\nname = "Main"\n{rung}')
    for name in ("served", "beside"):
        (folder / f"{name}.toml").write_text(f'ladder = ["ladder.toml"]\noperator.socket = "{name}.sock"\n'
                                             f'scan.period = "10ms"\nmemory.D = {TAGS}\n')
    (folder / "opcua.toml").write_text(
        f'[server]\nname = "t"\nlisten = "127.0.0.1:{port}"\ncertificates = "pki"\ninsecure = true\n'
        f'sessions = {SESSIONS}\n[controller]\nsocket = "served.sock"\n')


class Item:
    """A changing value: the last one, and those that were skipped and are not told yet."""

    def __init__(self):
        self.last, self.skipped, self.left = None, 0, 0


class Counter:
    """The values of a session, and those that a changing item skipped: told by the overflow bit, or not."""

    def __init__(self):
        self.values, self.told, self.untold, self.items, self.numbers = 0, 0, 0, {}, set()

    def datachange_notification(self, node, val, data):
        self.values += 1
        if val is None:
            return
        item = self.items.setdefault(node.nodeid.Identifier, Item())
        if item.last is not None and val > item.last + 1:
            item.skipped, item.left = item.skipped + val - item.last - 1, QUEUE
        item.last = val
        if data.monitored_item.Value.StatusCode.value & OVERFLOW:
            self.told, item.skipped = self.told + item.skipped, 0
        # The bit is in one of those values that were in the queue with the first one after the gap.
        item.left -= 1
        if item.skipped and item.left <= 0:
            self.untold, item.skipped = self.untold + item.skipped, 0

    def counts(self):
        untold = self.untold + sum(item.skipped for item in self.items.values())
        return {"values": self.values, "told": self.told, "untold": untold, "anew": len(self.numbers) - 1}


async def session(url, at, counter, over):
    # A client gives its connection up if the server's answer takes longer than the watchdog's time.
    async with Client(url, timeout=120, watchdog_intervall=60) as client:
        params = ua.CreateSubscriptionParameters(RequestedPublishingInterval=1000, RequestedLifetimeCount=3000,
                                                 RequestedMaxKeepAliveCount=600)
        subscription = await client.create_subscription(params, counter)
        counter.numbers.add(subscription.subscription_id)
        first = at * MOVING % CHANGING
        names = [f"value{first + n}" for n in range(MOVING)] + [f"value{CHANGING + n}" for n in range(STATIC)]
        nodes = [client.get_node(ua.NodeId(name, 2)) for name in names]
        await subscription.subscribe_data_change(nodes, queuesize=QUEUE, sampling_interval=0)
        await over.wait()
        counter.numbers.add(subscription.subscription_id)


def crowd(url, ready, report):
    """All sessions, in this process, until a signal ends it."""
    import logging
    logging.disable(logging.CRITICAL)

    async def whole():
        over, counters = asyncio.Event(), [Counter() for _ in range(SESSIONS)]
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, over.set)
        tasks = [asyncio.create_task(session(url, at, one, over)) for at, one in enumerate(counters)]
        while not all(one.values for one in counters):
            for task in tasks:
                assert not task.done(), task.exception()
            await asyncio.sleep(0.2)
        os.write(ready, b"r")
        # A session that ends early ends the bench.
        ended = asyncio.create_task(over.wait())
        done, _ = await asyncio.wait([ended, *tasks], return_when=asyncio.FIRST_COMPLETED)
        assert ended in done, [task.exception() for task in done]
        await asyncio.gather(*tasks)
        counts = [one.counts() for one in counters]
        os.write(report, json.dumps({name: sum(one[name] for one in counts) for name in counts[0]}).encode())
    asyncio.run(whole())


def burner(share):
    """Uses a share of a processor."""
    while True:
        began = time.process_time()
        while time.process_time() - began < share * 0.1:
            pass
        time.sleep(0.1 * (1 - share))


def forked(act, *arguments):
    child = os.fork()
    if child == 0:
        try:
            act(*arguments)
        finally:
            os._exit(0)
    return child


def overruns(folder, name):
    shown = subprocess.run([RUNGD, "status", "--socket", f"{name}.sock", "--json"], cwd=folder,
                           capture_output=True, text=True, check=True).stdout
    scan = json.loads(shown)["scan"]
    return scan["overruns"]


class Measured:
    """The overruns of both controllers from now on."""

    def __init__(self, folder):
        self.folder, self.before = folder, {name: overruns(folder, name) for name in ("served", "beside")}

    def text(self):
        added = {name: overruns(self.folder, name) - before for name, before in self.before.items()}
        return f"overruns {added['served']} of the served controller, {added['beside']} of the one beside it"


def answers(log, process):
    while "INFO" not in log.read_text() and "answers" not in log.read_text():
        assert process.poll() is None, log.read_text()
        time.sleep(0.1)


def main():
    lasts = float(sys.argv[1]) if len(sys.argv) > 1 else 600
    control_lasts = float(sys.argv[2]) if len(sys.argv) > 2 else lasts
    with tempfile.TemporaryDirectory() as folder:
        folder, port = Path(folder), free_port()
        write_files(folder, port)
        processes = []

        def start(words, name, nice):
            log = folder / f"{name}.log"
            with open(log, "wb") as out:
                process = subprocess.Popen(words, cwd=folder, stdout=out, stderr=out,
                                           preexec_fn=lambda: os.setpriority(os.PRIO_PROCESS, 0, nice))
            processes.append(process)
            answers(log, process)
            return process

        for name in ("served", "beside"):
            start([RUNGD, "run", f"{name}.toml"], name, 0)
        serving = start([BUILT / "rungd-opcua", "opcua.toml"], "opcua", SERVER_NICE)
        (ready, tells_ready), (report, tells) = os.pipe(), os.pipe()
        child = forked(crowd, f"opc.tcp://127.0.0.1:{port}/", tells_ready, tells)
        assert os.read(ready, 1) == b"r"
        time.sleep(5)
        measured, begin, used = Measured(folder), time.monotonic(), [seconds(serving.pid), seconds(child)]
        memory = [megabytes(serving.pid)]
        while (left := lasts - (time.monotonic() - begin)) > 0:
            time.sleep(min(60, left))
            memory.append(megabytes(serving.pid))
        took = time.monotonic() - begin
        used = [(seconds(pid) - before) / took for pid, before in zip((serving.pid, child), used)]
        print(f"{SESSIONS} sessions, {took:.0f} s: {measured.text()}")
        print(f"rungd-opcua {used[0]:.1%} of a core, its clients {used[1]:.1%}")
        print("memory of rungd-opcua, MB:", " ".join(f"{one:.0f}" for one in memory), flush=True)
        os.kill(child, signal.SIGTERM)
        counts = json.loads(os.read(report, 1000))
        print(f"{counts['values']} values received; {counts['told']} lost and told by the overflow bit, "
              f"{counts['untold']} lost and not told; {counts['anew']} subscriptions made anew", flush=True)
        os.waitpid(child, 0)
        serving.send_signal(signal.SIGTERM)
        serving.wait(20)

        burners = [forked(burner, sum(used) / SESSIONS) for _ in range(SESSIONS)]
        time.sleep(5)
        measured, begin, before = Measured(folder), time.monotonic(), sum(map(seconds, burners))
        time.sleep(control_lasts)
        took = time.monotonic() - begin
        share = (sum(map(seconds, burners)) - before) / took
        print(f"control, {SESSIONS} processes with {share:.1%} of a core, {took:.0f} s: {measured.text()}")
        for pid in burners:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
        for process in processes[:2]:
            process.send_signal(signal.SIGTERM)
            process.wait(20)


main()
