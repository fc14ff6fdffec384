#!/usr/bin/env python3
"""Field devices behind a network that fails: rungd in one network namespace, remote I/O in another.

usage: tests/field_network.py [--long]       as root, with iproute2; RUNGD=PATH for the binary

Two veth pairs join the two namespaces. The peer (tests/peer/watched_io.py) is three devices: `line1` behind
the link that fails, `line2` behind a second link that does not, and `line3` behind a proxy that delays,
splits, garbles, doubles and truncates answers. Each case checks the health that the ladder reads (`.Ok` and
`.Stale`, which it copies to line2) and the log, and prints the time until the output is right after the
trouble, and the reaction time of line2 during the trouble. The number of skipped grid points is printed beside
that of a quiet time, but not checked: a busy machine skips some, which is not a fault of the network. With
`--long` each case lasts 5 s, and there are 500 reconnects; without it, the whole run takes about 20 s.
Exit code 77: the test cannot run here.
"""

import argparse
import json
import os
import random
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RUNGD = os.environ.get("RUNGD") or os.path.join(
    os.environ.get("CARGO_TARGET_DIR", os.path.join(HERE, "target")), "debug/rungd"
)
PERIOD_MS = 10
TIMEOUT_MS, LOSS_MS = 200, 300

LADDER = """
[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["OUT Y0"] },
  { when = ["X1"], do = ["OUT Y1"] },
  { when = ["X2"], do = ["OUT Y2"] },
]
"""


def cannot(why):
    print(f"tests/field_network.py cannot be run here: {why}", file=sys.stderr)
    sys.exit(77)


def sh(command, check=True):
    return subprocess.run(command, shell=True, check=check, capture_output=True, text=True)


class Network:
    """Two namespaces, two links between them: a0/b0 fails, a1/b1 does not."""

    def __init__(self):
        self.ours, self.theirs = f"rungd-a-{os.getpid()}", f"rungd-b-{os.getpid()}"

    def make(self):
        for name in (self.ours, self.theirs):
            if sh(f"ip netns add {name}", check=False).returncode:
                cannot("no network namespace to be had")
            sh(f"ip -n {name} link set lo up")
        for at in (0, 1):
            made = f"ip -n {self.ours} link add a{at} type veth peer name b{at} netns {self.theirs}"
            if sh(made, check=False).returncode:
                cannot("no veth pair to be had")
            for name, end, host in ((self.ours, f"a{at}", 1), (self.theirs, f"b{at}", 2)):
                sh(f"ip -n {name} address add 10.77.{at}.{host}/24 dev {end}")
                sh(f"ip -n {name} link set {end} up")

    def drop(self):
        for name in (self.ours, self.theirs):
            sh(f"ip netns del {name}", check=False)


class Peer:
    """Remote I/O in the other namespace."""

    def __init__(self, network):
        script = os.path.join(HERE, "tests/peer/watched_io.py")
        places = ["10.77.0.2:502", "10.77.1.2:502", "10.77.1.2:503"]
        command = ["ip", "netns", "exec", network.theirs, sys.executable, script, *places]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        assert json.loads(self.process.stdout.readline())["listening"] == [502, 502, 503]

    def ask(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def input(self, device, value):
        return self.ask(f"set {device} discrete 0 {value}")["at"]

    def coil(self, device, at=0):
        return self.ask(f"values {device} coil {at} 1")["values"][0]

    def seen(self):
        """The changes of line1's and line3's health, as written to line2, since the last call."""
        changes = self.ask("history 1")["changes"]
        return {name: [c[3] for c in changes if c[2] == at] for name, at in SHOWN.items()}


SHOWN = {"line1.Ok": 8, "line1.Stale": 9, "line3.Ok": 10, "line3.Stale": 11}


class Proxy:
    """The proxy between rungd and line3: a second process of this script, in the other namespace."""

    def __init__(self, network):
        command = ["ip", "netns", "exec", network.theirs, sys.executable, __file__, "--proxy"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        self.process.stdout.readline()

    def set(self, change):
        """Sets the change that is applied to all later answers."""
        self.process.stdin.write(f"{change}\n")
        self.process.stdin.flush()
        self.process.stdout.readline()


class Passing:
    """The proxy itself: it applies `change` to each answer."""

    def __init__(self):
        self.listener = socket.create_server(("10.77.1.2", 504))
        self.change = whole
        threading.Thread(target=self.accept, daemon=True).start()
        print("listening", flush=True)
        for line in sys.stdin:
            self.change = globals()[line.strip()]
            print(line.strip(), flush=True)

    def accept(self):
        while True:
            client, _ = self.listener.accept()
            threading.Thread(target=self.pass_on, args=(client,), daemon=True).start()

    def pass_on(self, client):
        server = socket.create_connection(("10.77.1.2", 503), timeout=2)
        for end in (client, server):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            while True:
                for end in select.select([client, server], [], [])[0]:
                    data = end.recv(4096)
                    if not data:
                        return
                    if end is client:
                        server.sendall(data)
                        continue
                    for wait_s, part in self.change(data):
                        time.sleep(wait_s)
                        client.sendall(part)
        except OSError:
            pass
        finally:
            client.close()
            server.close()


def whole(data):
    yield 0, data


def late(data):
    yield 0.05, data


def too_late(data):
    yield 0.3, data


def bytes_alone(data):
    for at in range(len(data)):
        yield 0.0005, data[at : at + 1]


def garbled(data):
    yield 0, bytes(random.randrange(256) for _ in data)


def doubled(data):
    yield 0, data + data


def truncated(data):
    yield 0, data[: len(data) // 2]


def another_transaction(data):
    yield 0, bytes([data[0] ^ 0x55]) + data[1:]


# The changes of answers, each with whether the device is lost by it.
CHANGES = [
    (late, False),
    (bytes_alone, False),
    (too_late, True),
    (garbled, True),
    (doubled, True),
    (truncated, True),
    (another_transaction, True),
]


def controller(folder):
    common = f'driver = "modbus-tcp"\npoll = "20ms"\ntimeout = "{TIMEOUT_MS}ms"\n'
    common += f'connect-timeout = "{TIMEOUT_MS}ms"\nloss-after = "{LOSS_MS}ms"\n'
    text = f'ladder = ["ladder.toml"]\n[operator]\nsocket = "{folder}/socket"\n'
    for at, address in enumerate(["10.77.0.2:502", "10.77.1.2:502", "10.77.1.2:504"]):
        rows = [
            f'{{ from = "discrete 0", to = "X{at}" }}',
            f'{{ from = "Y{at}", to = "coil 0" }}',
        ]
        if at == 1:
            rows += [
                f'{{ from = "{name}", to = "coil {coil}", hold = true }}'
                for name, coil in SHOWN.items()
            ]
        text += f'[[device]]\nname = "line{at + 1}"\naddress = "{address}"\n{common}'
        text += "map = [\n  " + ",\n  ".join(rows) + ",\n]\n"
    return text


class Rungd:
    """The real binary in its namespace, its log read line by line."""

    def __init__(self, network, folder):
        for name, text in (("ladder", LADDER), ("controller", controller(folder))):
            with open(f"{folder}/{name}.toml", "w", encoding="utf-8") as file:
                file.write(text)
        run = [RUNGD, "run", f"{folder}/controller.toml", "--log-format", "json"]
        command = ["ip", "netns", "exec", network.ours, *run]
        # `ip netns exec` replaces itself by the command, so the process id is rungd's.
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        self.socket = f"{folder}/socket"
        self.lines = []
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stderr:
            self.lines.append(json.loads(line))

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def status(self):
        command = [RUNGD, "status", "--json", "--socket", self.socket]
        return json.loads(subprocess.run(command, capture_output=True, check=True).stdout)

    def said(self, event, device, since):
        lines = [line for line in self.lines[since:] if line["event"] == event]
        return [line for line in lines if line.get("device") == device]


class Test:
    """One rungd process, and the cases, one after the other."""

    def __init__(self, network, folder):
        self.peer, self.network, self.failed = Peer(network), network, 0
        self.proxy = Proxy(network)
        self.rungd = Rungd(network, folder)
        self.until("the first exchange", lambda: self.all_follow(1) and self.all_follow(0))

    def until(self, what, is_so, patience_s=15):
        deadline = time.monotonic() + patience_s
        while not is_so():
            if time.monotonic() > deadline:
                self.judge(False, f"{what}: not in {patience_s} s")
                return False
            time.sleep(0.005)
        return True

    def judge(self, is_so, what):
        if not is_so:
            self.failed += 1
            print(f"    FAILED: {what}")

    def all_follow(self, value):
        for device in (0, 1, 2):
            self.peer.input(device, value)
        deadline = time.monotonic() + 1
        while time.monotonic() < deadline:
            if all(self.peer.coil(device) == value for device in (0, 1, 2)):
                return True
            time.sleep(0.005)
        return False

    def case(self, name, begin, end, lasts_s, line="line1", is_lost=True):
        """Causes trouble for some time; checks its effects, and that everything works again afterwards."""
        device = {"line1": 0, "line3": 2}[line]
        self.peer.seen()
        since, before = len(self.rungd.lines), self.overruns()
        begin()
        begun = time.monotonic()
        time.sleep(0.03)
        self.peer.input(device, 1)
        follows_ms = []
        while time.monotonic() - begun < lasts_s:
            follows_ms.append(self.other_follows())
        ended = time.monotonic()
        end()
        self.until(f"{name}: the output follows again", lambda: self.peer.coil(device) == 1)
        back_s = time.monotonic() - ended
        self.peer.input(device, 0)
        self.until(f"{name}: and back", lambda: self.peer.coil(device) == 0)
        self.report(name, line, (since, before), (is_lost, back_s, max(follows_ms)))

    def other_follows(self):
        """The time in ms from a change of line2's input to that of its output; line2 has no trouble."""
        value = 1 - self.peer.coil(1)
        since = time.monotonic()
        self.peer.input(1, value)
        self.until("line2 follows", lambda: self.peer.coil(1) == value, 2)
        return 1000 * (time.monotonic() - since)

    def report(self, name, line, at_first, found):
        (since, before), (is_lost, back_s, slowest_ms) = at_first, found
        time.sleep(0.1)
        seen, after = self.peer.seen(), self.overruns()
        lost = self.rungd.said("device-lost", line, since)
        back = self.rungd.said("device-back", line, since)
        trouble = self.rungd.said("device-trouble", line, since)
        says = back[-1]["message"] if back else "never lost"
        print(f"  {name}: {says}; outputs right {back_s:.2f} s after; line2 within "
              f"{slowest_ms:.0f} ms; {after - before} grid points skipped")
        if trouble:
            print(f"    {trouble[0]['message']}")
        stale = seen[f"{line}.Stale"]
        self.judge(stale == [1, 0] * (len(stale) // 2), f"{line}.Stale went {stale}")
        self.judge(bool(lost) == is_lost and len(lost) == len(back), f"{lost} {back}")
        if is_lost:
            self.judge(len(stale) >= 2, f"{line}.Stale went {stale}")
            self.judge(seen[f"{line}.Ok"][-1:] == [1], f"{line}.Ok went {seen[f'{line}.Ok']}")
        other = "line3" if line == "line1" else "line1"
        self.judge(not seen[f"{other}.Stale"], f"{other}.Stale went {seen[f'{other}.Stale']}")
        self.judge(len(trouble) < 20, f"{len(trouble)} lines of trouble")

    def overruns(self):
        """Grid points skipped so far."""
        return self.rungd.status()["scan"]["skipped"]

    def reconnects(self, count):
        """Makes `count` connections that the peer cuts; checks that no more descriptors are open than before."""
        self.until("line1", lambda: self.peer.coil(0) == 0)
        before = self.rungd.descriptors()
        for at in range(count):
            self.peer.ask("cut 0")
            time.sleep(0.001)
            self.peer.ask("mend 0")
            value = at & 1 ^ 1
            self.peer.input(0, value)
            self.until(f"reconnect {at}", lambda v=value: self.peer.coil(0) == v)
        after = self.rungd.descriptors()
        print(f"  {count} reconnects: {before} descriptors before, {after} after")
        self.judge(after <= before, "descriptors leak")
        self.peer.input(0, 0)

    def end(self):
        self.rungd.process.terminate()
        code = self.rungd.process.wait(5)
        self.judge(code == 0, f"exit code {code}")
        faults = [line for line in self.rungd.lines if line["event"] in ("mode-fault", "bug")]
        self.judge(not faults, faults)
        for process in (self.peer.process, self.proxy.process):
            process.kill()
            process.wait()


def cases(test, lasts_s):
    """Runs all cases; each has a command that begins the trouble and one that ends it."""
    ours, theirs = test.network.ours, test.network.theirs
    link, address = f"ip -n {theirs} link set b0", f"ip -n {ours} address"
    wall = f"ip netns exec {theirs} nft"
    drop = (f"{wall} add table inet wall && {wall} 'add chain inet wall in "
            "{ type filter hook input priority 0; }' && "
            f"{wall} 'add rule inet wall in iifname b0 drop'")
    pass_on = f"{wall} delete table inet wall"

    def run(command):
        return lambda: sh(command)

    def forget():
        # Neither FIN nor RST was delivered: the peer is back, but has forgotten the connection.
        test.peer.ask("cut 0")
        sh(pass_on)
        test.peer.ask("mend 0")

    test.case("the link is cut", run(f"{link} down"), run(f"{link} up"), lasts_s)
    test.case("our address is gone", run(f"{address} del 10.77.0.1/24 dev a0"),
              run(f"{address} add 10.77.0.1/24 dev a0"), lasts_s)
    if sh(f"{wall} list tables", check=False).returncode == 0:
        test.case("all packets are dropped", run(drop), run(pass_on), lasts_s)
        test.case("half-open: the peer has forgotten it", run(drop), forget, lasts_s)
    else:
        print("  packets that are dropped: no nft here")
    for change, is_lost in CHANGES:
        name = change.__name__
        test.case(f"answers {name.replace('_', ' ')}", lambda n=name: test.proxy.set(n),
                  lambda: test.proxy.set("whole"), lasts_s, "line3", is_lost)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--proxy", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.proxy:
        Passing()
        return
    is_long = options.long
    if os.geteuid() != 0:
        cannot("it wants root")
    if sh("command -v ip", check=False).returncode:
        cannot("no iproute2")
    if not os.access(RUNGD, os.X_OK):
        sys.exit(f"no {RUNGD}: cargo build, or set RUNGD")
    network = Network()
    try:
        network.make()
        with tempfile.TemporaryDirectory() as folder:
            test = Test(network, folder)
            before = test.overruns()
            time.sleep(10 if is_long else 1)
            print(f"  quiet: {test.overruns() - before} grid points skipped")
            cases(test, 5 if is_long else 0.7)
            test.reconnects(500 if is_long else 25)
            test.end()
    finally:
        network.drop()
    print(f"{test.failed} failed")
    sys.exit(1 if test.failed else 0)


if __name__ == "__main__":
    main()
