"""What the tests of `rungd-opcua` with a foreign client (asyncua) share: a controller, a server, a subscriber.

Arguments of each script: RUNGD RUNGD_OPCUA FOLDER. Each passed part is a line `ok NAME`. Called by foreign.rs.
"""

import asyncio
import os
import pathlib
import signal
import subprocess
import sys
import time

from asyncua import Client, ua

RUNGD, OPCUA, FOLDER = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PORT = int(os.environ.get("OPCUA_PORT", "48411"))
URL = f"opc.tcp://127.0.0.1:{PORT}/"
# Nothing of a test depends on the machine's speed: this only ends a test that hangs.
WAIT = 120

LADDER = """
[ladder]
name = "t"

[[record]]
name = "Step"
[record.fields]
target = { type = "real", min = 0, max = 500 }
time   = { type = "int", min = 0, max = 7200, unit = "s" }

[tags]
start  = { type = "bit", doc = "Starts the counting" }
fast   = { type = "int", doc = "Counts every scan" }
level  = { at = "R0", unit = "l", min = 0, max = 250, doc = "In the tank" }
speed  = { type = "int", min = 0, max = 1500, unit = "1/min" }
step   = { type = "int", texts = { 0 = "idle", 1 = "dosing" } }
parts  = { type = "counter" }
trip   = { type = "bit", alarm = "The drive has tripped", priority = "high" }
slots  = { type = "int", count = 4 }
dose   = { type = "int", count = 2, min = 0, max = 100 }
recipe = { type = "Step", count = 2 }

[[program]]
name = "Main"
[[program.rung]]
when = ["start"]
do   = ["MATH fast = fast + 1"]
[[program.rung]]
leg.up  = ["start"]
leg.rst = ["!start"]
do      = ["CNT parts preset=1000000"]
"""


def write(name, text):
    (FOLDER / name).write_text(text)


def rungd(*words):
    named = {**os.environ, "RUNGD_SOCKET": "t.sock"}
    done = subprocess.run([RUNGD, *words], cwd=FOLDER, env=named, capture_output=True, text=True, timeout=WAIT)
    assert done.returncode == 0, (words, done.stdout, done.stderr)
    return done.stdout


def passed(name):
    print(f"ok {name}", flush=True)


class Process:
    """A process with its log in a file."""

    every = []

    def __init__(self, words, name, until):
        self.log = FOLDER / name
        Process.every.append(self)
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(words, cwd=FOLDER, stdout=log, stderr=log)
        self.awaits(until)

    def awaits(self, text):
        end = time.monotonic() + WAIT
        while text not in self.log.read_text(errors="replace"):
            assert self.process.poll() is None, self.log.read_text(errors="replace")
            assert time.monotonic() < end, f"{text!r}: {self.log.read_text(errors='replace')}"
            time.sleep(0.05)

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(WAIT)


def end_all():
    """Ends what runs after a test, passed or not."""
    for one in Process.every:
        if one.process.poll() is None:
            one.end()


async def awaits(what, condition):
    end = time.monotonic() + WAIT
    while True:
        value = await condition()
        if value:
            return value
        assert time.monotonic() < end, what
        await asyncio.sleep(0.05)


def controller():
    return Process([RUNGD, "run", "t.toml"], "rungd.log", "INFO")


def server(log="opcua.log"):
    return Process([OPCUA, "opcua.toml"], log, "rungd-opcua: serves")


def tag(client, name):
    return client.get_node(ua.NodeId(name, 2))


async def value(client, name):
    return await tag(client, name).read_value()


async def is_value(client, name, wanted):
    try:
        return await value(client, name) == wanted
    except ua.uaerrors.BadNodeIdUnknown:
        # A server that has begun does not know the program yet.
        return False


async def refused_with(status, change):
    """A change of a client is refused with this status."""
    try:
        await change
    except ua.UaStatusCodeError as error:
        assert status in type(error).__name__, error
        return
    raise AssertionError("it was not refused")


def write_with_reason(client, name, variant, reason):
    """Calls the method for writes with a reason."""
    method = ua.NodeId("/WriteWithReason", 2)
    return client.get_node(ua.NodeId("/", 2)).call_method(method, name, variant, reason)


# The bit Overflow of a DataValue (OPC 10000-4, 7.39); the library leaves its info type out.
OVERFLOW = 0x80


class Seen:
    """Remembers what a subscription tells."""

    def __init__(self):
        self.changes, self.events = [], []

    def datachange_notification(self, node, val, data):
        self.changes.append((node.nodeid.Identifier, val, data.monitored_item.Value))

    def event_notification(self, event):
        self.events.append(event)

    def status_change_notification(self, status):
        pass


class Statuses(Seen):
    """Remembers the last status of each node."""

    def __init__(self):
        super().__init__()
        self.last, self.gaps = {}, set()

    def datachange_notification(self, node, val, data):
        status = data.monitored_item.Value.StatusCode
        self.last[node.nodeid.Identifier] = ua.StatusCode(status.value & ~OVERFLOW).name
        if status.value & OVERFLOW:
            self.gaps.add(node.nodeid.Identifier)

    async def are(self, status, count):
        return list(self.last.values()) == [status] * count

    async def have_gaps(self, names):
        return self.gaps == names


async def enough_events(seen, count):
    return len(seen.events) >= count


def condition_filter():
    """The fields of a condition."""
    paths = [["EventId"], ["EventType"], ["SourceName"], ["Message"], ["Severity"], ["Retain"],
             ["ActiveState", "Id"], ["AckedState", "Id"], ["SuppressedOrShelved"], ["Comment"], ["ClientUserId"],
             ["ShelvingState", "CurrentState"], ["ShelvingState", "UnshelveTime"], ["MaxTimeShelved"],
             ["OutOfServiceState", "Id"]]
    return event_filter(ua.ObjectIds.AlarmConditionType, paths)


def event_filter(type_id, paths):
    """These fields of all events of a type (OfType)."""
    filter = ua.EventFilter()
    for path in paths:
        operand = ua.SimpleAttributeOperand()
        operand.TypeDefinitionId = ua.NodeId(type_id)
        operand.BrowsePath = [ua.QualifiedName(name, 0) for name in path]
        operand.AttributeId = ua.AttributeIds.Value
        filter.SelectClauses.append(operand)
    element = ua.ContentFilterElement()
    element.FilterOperator = ua.FilterOperator.OfType
    kind = ua.Variant(ua.NodeId(type_id))
    element.FilterOperands = [ua.LiteralOperand(Value=kind)]
    filter.WhereClause.Elements.append(element)
    return filter


def settings(more, users=""):
    write("opcua.toml", f"""
[server]
name = "t"
listen = "127.0.0.1:{PORT}"
certificates = "pki"
{users}
{more}
[controller]
socket = "t.sock"
[tags]
write = ["start", "speed", "slots", "dose"]
[alarms]
acknowledge = true
shelve = true
""")
