#!/usr/bin/env python3
"""A fleet under attack: many controllers and edge nodes, brokers that are killed, edges that are stopped, a link that is cut.

usage: benches/fleet.py RUNGD [--nodes 100] [--broker mosquitto|nats] [--seconds 120] [--quiet]
       as root (network namespaces), with mosquitto, nats-server, iproute2; pip: pysparkplug (with paho-mqtt 1)

Each node is a controller that scans a ladder of changing tags every 100 ms and records it in a folder, with a `rungd edge`
beside it. Their primary host is independent of rungd (paho-mqtt, pysparkplug's decoder) and stores all received values.
During the run each broker is killed by SIGKILL and started again, a fifth of the edges is stopped (SIGSTOP) for longer than
the keepalive, and a second fifth, which is in a network namespace, loses its link. At the end the controllers stop, and the
values that the host received are compared with the scan logs, executed again by `rungd record export`. Every change of every
tag must be there, live or historical, with one value for each (node, metric, time). There must be no value that the tag never
had, and live values must be in order. `--quiet`: without attacks, to compare the overruns. Prints a table. Exit code 1:
something is missing, wrong or out of order; 77: the trial cannot run here.
"""

import argparse
import bisect
import collections
import csv
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

import paho.mqtt.client as mqtt
from pysparkplug._protobuf import sparkplug_b_pb2

from processes import free_port

GROUP, HOST = "trial", "judge"
KEEPALIVE_S = 5
PERIOD = "100ms"

CONTROLLER = """ladder = ["ladder.toml"]

[scan]
period = "{period}"
watchdog = "3s"

[operator]
socket = "rungd.sock"

[record]
dir = "record"
"""

LADDER = """[ladder]
name = "node-{number}"

[tags]
parts = {{ at = "CT0", doc = "parts of this shift" }}
level = {{ at = "D0", unit = "cm", min = 0, max = 30000 }}
temperature = {{ type = "real", unit = "°C" }}
lamp = {{ at = "Y0" }}
second = {{ at = "C0" }}
jam = {{ at = "C1", alarm = "Parts jam", priority = "high" }}
long = {{ type = "int" }}
rest = {{ type = "int" }}

[[program]]
name = "Main"

[[program.rung]]
leg.up = ["$1Second"]
leg.rst = ["parts.Acc >= {wrap}"]
do = ["CNT parts preset=10"]

[[program.rung]]
when = ["$1Second"]
do = ["OUT second", "OUT lamp"]

[[program.rung]]
when = ["rise($1Second) | fall($1Second)"]
do = [
  "MATH level = (level * 7 + {number} + 1) % 9973",
  "MATH long = (long * 7 - level) % 1000003",
  "MATH temperature = level / 7.0",
  "MATH rest = level % 5",
]

[[program.rung]]
when = ["rest == 0"]
do = ["OUT jam"]
"""

EDGE = """[node]
group = "{group}"
name = "{name}"
socket = "{folder}/rungd.sock"
state-dir = "{folder}/state"

[broker]
addresses = [{brokers}]
keepalive = "{keepalive}s"

[sparkplug]
primary-host = "{host}"
interval = "500ms"

[history]
margin = "40s"
"""
TAGS = ["parts.Acc", "parts.Done", "level", "temperature", "lamp", "second", "jam", "long"]


def sh(*words):
    return subprocess.run(words, capture_output=True, text=True)


class Brokers:
    """One mosquitto, or three NATS servers; on the loopback and on the veth's address."""

    def __init__(self, kind, folder, address):
        self.kind, self.count = kind, 3 if kind == "nats" else 1
        self.mqtt = [free_port() for _ in range(self.count)]
        self.commands, self.running, self.folder = [], [None] * self.count, folder
        routes, clients = [[free_port() for _ in range(3)] for _ in range(2)]
        for n in range(self.count):
            conf = os.path.join(folder, f"broker-{n}.conf")
            with open(conf, "w") as file:
                if kind == "nats":
                    urls = ", ".join(f'"nats-route://127.0.0.1:{port}"' for port in routes)
                    file.write(
                        f'server_name: "n{n}"\nlisten: "127.0.0.1:{clients[n]}"\n'
                        f'jetstream {{ store_dir: "{folder}/store-{n}", sync_interval: always }}\n'
                        f'cluster {{ name: rungd, listen: "127.0.0.1:{routes[n]}", routes: [{urls}] }}\n'
                        f'mqtt {{ listen: "0.0.0.0:{self.mqtt[n]}" }}\n'
                    )
                else:
                    file.write(f"listener {self.mqtt[n]} 0.0.0.0\nallow_anonymous true\nmax_queued_messages 0\nset_tcp_nodelay true\n")
            server = shutil.which("nats-server") if kind == "nats" else shutil.which("mosquitto") or "/usr/sbin/mosquitto"
            self.commands.append([server, "-c", conf])
        self.address = address

    def start(self, n):
        log = open(os.path.join(self.folder, f"broker-{n}.log"), "a")
        self.running[n] = subprocess.Popen(self.commands[n], stdout=log, stderr=log)

    def kill(self, n):
        self.running[n].kill()
        self.running[n].wait()

    def urls(self, address):
        return [f"mqtt://{address}:{port}" for port in self.mqtt]


class Host:
    """The primary host: receives everything, and requests a birth if it does not know an alias."""

    def __init__(self, brokers):
        self.brokers, self.at, self.ends = brokers, 0, False
        self.names = {}
        self.heard = collections.defaultdict(list)  # node -> (name, ms, value, historical, session, born)
        self.born = {}
        self.last = {}
        self.births, self.gaps, self.asked, self.connections = collections.Counter(), collections.Counter(), 0, 0
        self.seq = {}
        self.lost = {}
        self.session = 0
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.ends:
            port = self.brokers.mqtt[self.at % self.brokers.count]
            self.at += 1
            client = mqtt.Client(client_id=f"judge-{self.at}", protocol=mqtt.MQTTv311)
            stamp = int(time.time() * 1000)
            state = lambda online: json.dumps({"online": online, "timestamp": stamp})
            client.will_set(f"spBv1.0/STATE/{HOST}", state(False), qos=1, retain=True)
            client.on_message = self.on_message

            def on_connect(client, data, flags, code):
                if code != 0:
                    client.disconnect()
                    return
                self.connections += 1
                self.session += 1
                self.names.clear()
                client.subscribe([(f"spBv1.0/{GROUP}/#", 0)])
                client.publish(f"spBv1.0/STATE/{HOST}", state(True), qos=1, retain=True)

            client.on_connect = on_connect
            self.client = client
            try:
                client.connect("127.0.0.1", port, keepalive=KEEPALIVE_S)
                self.loop(client)
            except OSError:
                pass
            time.sleep(0.5)

    def loop(self, client):
        while not self.ends and client.loop(0.5) == mqtt.MQTT_ERR_SUCCESS:
            pass

    def on_message(self, client, data, message):
        _, group, kind, node = message.topic.split("/")[:4]
        payload = sparkplug_b_pb2.Payload()
        payload.ParseFromString(message.payload)
        if kind == "NBIRTH":
            self.births[node] += 1
            self.names[node] = {m.alias: (m.name, m.datatype) for m in payload.metrics if m.HasField("alias")}
            self.seq[node] = 0
        elif kind == "NDATA":
            if node not in self.names:
                self.ask(client, node)
                return
            self.seq[node] = (self.seq[node] + 1) % 256
            if self.seq[node] != payload.seq:
                self.gaps[node] += 1
                del self.names[node]
                self.ask(client, node)
                return
        else:
            return
        for metric in payload.metrics:
            name, datatype = (metric.name, metric.datatype) if metric.name else self.names[node][metric.alias]
            value = None if metric.is_null else getattr(metric, metric.WhichOneof("value"))
            if datatype in (1, 2, 3) and value is not None and value >= 1 << 31:
                value -= 1 << 32
            if name == "rungd/scan":
                self.last[node] = value
            elif name == "rungd/history/lost":
                self.lost[node] = value
            elif name in TAGS:
                born = kind == "NBIRTH"
                self.heard[node].append((name, metric.timestamp, value, metric.is_historical, self.session, born))

    def ask(self, client, node):
        payload = sparkplug_b_pb2.Payload()
        payload.timestamp = int(time.time() * 1000)
        metric = payload.metrics.add()
        metric.name, metric.datatype, metric.boolean_value = "Node Control/Rebirth", 11, True
        self.asked += 1
        client.publish(f"spBv1.0/{GROUP}/NCMD/{node}", payload.SerializeToString(), qos=0)


class Node:
    def __init__(self, rungd, folder, number):
        self.rungd, self.number, self.name = rungd, number, f"n{number:03}"
        self.edge, self.looked_ms = None, None
        self.folder = os.path.join(folder, self.name)
        os.makedirs(self.folder)
        self.put("controller.toml", CONTROLLER.format(period=PERIOD))
        self.put("ladder.toml", LADDER.format(number=number, wrap=20 + number))

    def put(self, name, text):
        with open(os.path.join(self.folder, name), "w") as file:
            file.write(text)

    def start(self):
        done = sh(self.rungd, "check", os.path.join(self.folder, "controller.toml"))
        assert done.returncode == 0, done.stdout + done.stderr
        log = open(os.path.join(self.folder, "rungd.log"), "w")
        self.controller = subprocess.Popen([self.rungd, "run", "controller.toml"], cwd=self.folder, stderr=log)

    def start_edge(self, brokers, inside):
        address = brokers.address if inside else "127.0.0.1"
        urls = brokers.urls(address)
        random.Random(self.number).shuffle(urls)
        urls = ", ".join(f'"{url}"' for url in urls)
        self.put("edge.toml", EDGE.format(group=GROUP, name=self.name, folder=self.folder, brokers=urls, keepalive=KEEPALIVE_S, host=HOST))
        os.makedirs(os.path.join(self.folder, "state"), exist_ok=True)
        log = open(os.path.join(self.folder, "edge.log"), "w")
        command = [self.rungd, "edge", "edge.toml"]
        if inside:
            command = ["ip", "netns", "exec", inside] + command
        self.edge = subprocess.Popen(command, cwd=self.folder, stderr=log)

    def has_looked(self):
        """Whether the edge has reached the controller; its journal reports this after the first answer."""
        if self.edge and self.looked_ms is None:
            with open(os.path.join(self.folder, "edge.log")) as log:
                if re.search(r"the controller at .* answers", log.read()):
                    self.looked_ms = time.time() * 1000
        return self.looked_ms is not None

    def status(self):
        socket_path = os.path.join(self.folder, "rungd.sock")
        return json.loads(sh(self.rungd, "status", "--json", "--socket", socket_path).stdout)

    def truth(self):
        """Each change of each tag: name -> [(ms since 1970, value)]."""
        record = os.path.join(self.folder, "record")
        stretches = json.loads(sh(self.rungd, "record", "list", "--json", record).stdout)["stretches"]
        assert len(stretches) == 1, stretches
        out = os.path.join(self.folder, "truth.csv")
        done = sh(self.rungd, "record", "export", record, "--watch", ",".join(TAGS), "-o", out)
        assert done.returncode == 0, done.stderr
        begin, changes, before = stretches[0]["begin_unix_ns"], {tag: [] for tag in TAGS}, {}
        with open(out) as file:
            for row in csv.DictReader(file):
                ms = (begin + float(row["time_ms"]) * 1e6) / 1e6
                for tag in TAGS:
                    if row[tag] != before.get(tag):
                        changes[tag].append((ms, float(row[tag])))
                        before[tag] = row[tag]
        return changes


class Network:
    """A namespace whose link to the brokers can be cut."""

    name, outside, inside = f"rungd-fleet-{os.getpid()}", f"rf{os.getpid()}a", f"rf{os.getpid()}b"
    address = "10.213.77.1"

    def make(self):
        for words in [
            f"ip netns add {self.name}",
            f"ip link add {self.outside} type veth peer name {self.inside}",
            f"ip link set {self.inside} netns {self.name}",
            f"ip addr add {self.address}/24 dev {self.outside}",
            f"ip link set {self.outside} up",
            f"ip -n {self.name} addr add 10.213.77.2/24 dev {self.inside}",
            f"ip -n {self.name} link set {self.inside} up",
            f"ip -n {self.name} link set lo up",
        ]:
            done = sh(*words.split())
            if done.returncode:
                print(f"benches/fleet.py cannot be run here: {words}: {done.stderr}", file=sys.stderr)
                sys.exit(77)

    def cut(self, is_cut):
        # Packets are lost silently: there is no reset and no "unreachable".
        verb = "add" if is_cut else "del"
        sh("tc", "qdisc", verb, "dev", self.outside, "root", "netem", "loss", "100%")
        sh("ip", "netns", "exec", self.name, "tc", "qdisc", verb, "dev", self.inside, "root", "netem", "loss", "100%")
        if "netem" not in sh("tc", "qdisc", "show", "dev", self.outside).stdout and is_cut:
            sh("ip", "link", "set", self.outside, "down")
        elif not is_cut:
            sh("ip", "link", "set", self.outside, "up")

    def end(self):
        sh("ip", "netns", "del", self.name)
        sh("ip", "link", "del", self.outside)


def attack(arguments, nodes, brokers, network):
    """Makes the attacks, spread over the time; prints each."""
    said = lambda text: print(f"{time.strftime('%H:%M:%S')}  {text}", flush=True)
    part = arguments.seconds / 6
    fifth = max(1, len(nodes) // 5)
    standing, cut = nodes[fifth : 2 * fifth], nodes[:fifth]
    time.sleep(part)
    for n in range(brokers.count):
        said(f"broker {n}: kill -9, back after 4 s")
        brokers.kill(n)
        time.sleep(4)
        brokers.start(n)
        time.sleep(max(part - 4, 8))
    said(f"{len(standing)} edges: SIGSTOP for {4 * KEEPALIVE_S} s")
    for node in standing:
        node.edge.send_signal(signal.SIGSTOP)
    time.sleep(4 * KEEPALIVE_S)
    for node in standing:
        node.edge.send_signal(signal.SIGCONT)
    time.sleep(part)
    said(f"{len(cut)} edges: no packet for {4 * KEEPALIVE_S} s")
    network.cut(True)
    time.sleep(4 * KEEPALIVE_S)
    network.cut(False)
    said("the link is back")
    time.sleep(part)


def settle(host, nodes, patience=240):
    """Waits until each node has published a scan from after the attacks."""
    wanted = {node.name: node.status()["scans"] for node in nodes}
    until = time.monotonic() + patience
    while time.monotonic() < until:
        behind = [name for name, scan in wanted.items() if (host.last.get(name) or 0) < scan]
        if not behind:
            time.sleep(10)
            return
        time.sleep(1)
    print(f"behind: {behind}")


def look(nodes):
    """Notes when each edge has reached its controller: all changes after that time must arrive."""
    return all([node.has_looked() for node in nodes])


def judge(nodes, host):
    count = collections.Counter()
    wrong = []
    for node in nodes:
        truth, heard = node.truth(), host.heard[node.name]
        last = max((ms for _, ms, _, _, _, _ in heard), default=0)
        by_name = collections.defaultdict(dict)
        for name, ms, value, historical, session, born in heard:
            if value is None or born:
                continue
            count["copies"] += ms in by_name[name]
            known = by_name[name].setdefault(ms, value)
            if known != value:
                wrong.append(f"{node.name} {name}: two values at {ms}: {known}, {value}")
        order(node, heard, wrong)
        for tag, changes in truth.items():
            got = sorted(by_name[tag].items())
            times = [ms for ms, _ in got]
            used = set()
            # The first change is the value of the first scan, which is in the birth.
            for ms, value in changes[1:]:
                if ms > last - 1500:
                    continue
                # An edge node need not publish changes from before its first contact with the controller.
                if ms < node.looked_ms:
                    count["before"] += 1
                    continue
                count["changes"] += 1
                at = bisect.bisect_left(times, ms - 1.5)
                found = [k for k in range(at, len(got)) if times[k] <= ms + 1.5]
                match = [k for k in found if alike(got[k][1], value) and k not in used]
                if not match:
                    wrong.append(f"{node.name} {tag}: {value} at {ms:.1f} did not arrive; near: {[got[k] for k in found]}")
                    count["missing"] += 1
                    continue
                used.add(match[0])
            for k in range(len(got)):
                if k in used or not changes[0][0] + 1.5 < times[k] <= last - 1500:
                    continue
                # The beginning of a part of the past repeats each value.
                near = [value for ms, value in changes if abs(ms - times[k]) <= 1.5]
                at = bisect.bisect_right(changes, (times[k] + 1.5, float("inf")))
                if any(alike(got[k][1], value) for value in near + [changes[at - 1][1]]):
                    count["told again"] += 1
                else:
                    count["never was"] += 1
                    wrong.append(f"{node.name} {tag}: {got[k]} never was")
    return count, wrong


def alike(heard, value):
    return abs(float(heard) - value) <= 1e-3 * max(1.0, abs(value))


def order(node, heard, wrong):
    """Checks that, within a connection of the host, the live values are in order."""
    newest = {}
    for name, ms, value, historical, session, born in heard:
        if historical or born:
            continue
        key = (session, name)
        if ms < newest.get(key, 0):
            wrong.append(f"{node.name} {name}: live value of {ms} behind {newest[key]}")
        newest[key] = ms


def processor_s(process):
    with open(f"/proc/{process.pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("rungd")
    parser.add_argument("--nodes", type=int, default=100)
    parser.add_argument("--broker", choices=["mosquitto", "nats"], default="nats")
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--quiet", action="store_true")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))
    folder, network = tempfile.mkdtemp(prefix="rungd-fleet-"), Network()
    rungd = os.path.abspath(arguments.rungd)
    nodes, brokers, host = [], None, None
    try:
        network.make()
        brokers = Brokers(arguments.broker, folder, network.address)
        for n in range(brokers.count):
            brokers.start(n)
        nodes = [Node(rungd, folder, number) for number in range(arguments.nodes)]
        for node in nodes:
            node.start()
        time.sleep(10)
        host = Host(brokers)
        while not host.connections:
            time.sleep(0.2)
        for number, node in enumerate(nodes):
            node.start_edge(brokers, network.name if number < max(1, len(nodes) // 5) else None)
            look(nodes)
        while len(host.births) < len(nodes) or not look(nodes):
            time.sleep(0.1)
        print(f"{time.strftime('%H:%M:%S')}  all {len(nodes)} nodes are born", flush=True)
        before = [node.status()["scan"]["overruns"] for node in nodes]
        begun, used = time.monotonic(), sum(processor_s(node.edge) for node in nodes)
        if arguments.quiet:
            time.sleep(arguments.seconds)
        else:
            attack(arguments, nodes, brokers, network)
        took = time.monotonic() - begun
        used = sum(processor_s(node.edge) for node in nodes) - used
        overruns = [node.status()["scan"]["overruns"] - was for node, was in zip(nodes, before)]
        settle(host, nodes)
        host.ends = True
        host.thread.join(10)
        for node in nodes:
            node.edge.terminate()
            node.controller.terminate()
        for node in nodes:
            node.edge.wait(60)
            node.controller.wait(60)
        count, wrong = judge(nodes, host)
        print(f"nodes {len(nodes)}, {arguments.broker}, {took:.0f} s")
        print(f"changes of tags in the scan logs   {count['changes']}")
        print(f"  did not arrive                   {count['missing']}")
        print(f"  arrived, but never were          {count['never was']}")
        print(f"  before an edge's first look      {count['before']} (not counted above)")
        print(f"  copies, dropped by their time    {count['copies']}")
        print(f"  unchanged values told again      {count['told again']}")
        print(f"  told lost by the edges           {sum(v or 0 for v in host.lost.values())} scans")
        print(f"births {sum(host.births.values())}, gaps of seq {sum(host.gaps.values())}, rebirths asked {host.asked}, the host's connections {host.connections}")
        print(f"overruns of the controllers        {sum(overruns)} (of {int(took * 10) * len(nodes)} scans)")
        print(f"edges                              {100 * used / took / len(nodes):.2f} % of a core each")
        for line in wrong[:20]:
            print(line)
        if len(wrong) > 20:
            print(f"… and {len(wrong) - 20} more")
        sys.exit(1 if wrong else 0)
    finally:
        if host:
            host.ends = True
        for node in nodes:
            for process in (getattr(node, "edge", None), getattr(node, "controller", None)):
                if process and process.poll() is None:
                    process.send_signal(signal.SIGCONT)
                    process.kill()
        for process in (brokers.running if brokers else []):
            if process:
                process.kill()
        network.end()
        if os.environ.get("KEEP") is None:
            shutil.rmtree(folder, ignore_errors=True)
        else:
            print(folder)


main()
