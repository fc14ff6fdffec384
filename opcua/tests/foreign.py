"""A foreign OPC UA client (asyncua) against `rungd-opcua` and a running controller.

Usage: foreign.py RUNGD RUNGD_OPCUA FOLDER. Each passed part is a line `ok NAME`. Called by foreign.rs.
"""

import asyncio
import datetime
import json
import os
import pathlib
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import time

from asyncua import Client, ua
from asyncua.crypto.cert_gen import generate_private_key, generate_self_signed_app_certificate
from asyncua.crypto.security_policies import SecurityPolicyAes256Sha256RsaPss as Pss
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256 as Basic
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID

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
    done = subprocess.run([RUNGD, *words], cwd=FOLDER, capture_output=True, text=True, timeout=WAIT)
    assert done.returncode == 0, (words, done.stdout, done.stderr)
    return done.stdout


def passed(name):
    print(f"ok {name}", flush=True)


class Process:
    """A process with its log in a file."""

    def __init__(self, words, name, until):
        self.log = FOLDER / name
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
        self.last = {}

    def datachange_notification(self, node, val, data):
        self.last[node.nodeid.Identifier] = data.monitored_item.Value.StatusCode.name

    async def are(self, status, count):
        return list(self.last.values()) == [status] * count


async def browse_and_read(client):
    """All tags of the program, with the values that `rungd read` shows."""
    names = {}

    async def walk(node):
        for child in await node.get_children():
            if child.nodeid.NamespaceIndex == 2 and isinstance(child.nodeid.Identifier, str):
                if await child.read_node_class() == ua.NodeClass.Variable:
                    names[child.nodeid.Identifier] = child
                await walk(child)

    await walk(tag(client, "/tags"))
    shown = {name for name in names if "/" not in name}
    wanted = {"start", "fast", "level", "speed", "step", "trip", "slots"}
    wanted |= {f"parts.{member}" for member in ("Acc", "Done", "Reset", "Zero")} & shown
    wanted |= {f"recipe[{at}].{field}" for at in (0, 1) for field in ("target", "time")}
    assert wanted <= shown, (wanted - shown, shown)
    for name in sorted(shown - {"fast", "slots"}):
        read = json.loads(rungd("read", name, "--json"))["values"][0]["value"]
        got = await names[name].read_value()
        assert abs(float(got) - float(read)) < 1e-6, (name, got, read)
    assert await names["slots"].read_value() == [0, 0, 0, 0]
    kinds = {name: (await names[name].read_data_type_as_variant_type()).name for name in shown}
    assert kinds["start"] == "Boolean" and kinds["level"] == "Float" and kinds["speed"] == "Int32", kinds
    assert (await tag(client, "level").read_description()).Text == "In the tank"
    unit = await tag(client, "level/EngineeringUnits").read_value()
    limits = await tag(client, "level/EURange").read_value()
    assert unit.DisplayName.Text == "l" and (limits.Low, limits.High) == (0, 250)
    texts = await tag(client, "step/EnumValues").read_value()
    assert [(text.Value, text.DisplayName.Text) for text in texts] == [(0, "idle"), (1, "dosing")]
    assert (await tag(client, "step/ValueAsText").read_value()).Text == "idle"
    passed("browse and read")


async def writes(client):
    await tag(client, "speed").write_value(ua.Variant(900, ua.VariantType.Int32))
    assert json.loads(rungd("read", "speed", "--json"))["values"][0]["value"] == 900
    await awaits("900", lambda: is_value(client, "speed", 900))
    slots = ua.Variant([1, 2, 3, 4], ua.VariantType.Int32)
    await tag(client, "slots").write_value(slots)
    await awaits("slots", lambda: is_value(client, "slots", [1, 2, 3, 4]))
    for name, variant, status in [
        ("speed", ua.Variant(1501, ua.VariantType.Int32), "BadOutOfRange"),
        ("speed", ua.Variant("x", ua.VariantType.String), "BadTypeMismatch"),
        ("level", ua.Variant(1.0, ua.VariantType.Float), "BadUserAccessDenied|BadNotWritable"),
        ("slots", ua.Variant([1, 2], ua.VariantType.Int32), "BadIndexRangeNoData"),
    ]:
        try:
            await tag(client, name).write_value(variant)
            raise AssertionError(f"{name} was written")
        except ua.UaStatusCodeError as error:
            assert re.search(status, str(error)) or re.search(status, type(error).__name__), (name, error)
    assert json.loads(rungd("read", "speed", "--json"))["values"][0]["value"] == 900
    log = (FOLDER / "rungd.log").read_text()
    assert re.search("opcua.*speed|speed.*opcua", log), log[-2000:]
    passed("writes")


async def is_value(client, name, wanted):
    return await value(client, name) == wanted


async def changes(client):
    """Every scan's change reaches the queue, with the time of its scan."""
    seen = Seen()
    params = ua.CreateSubscriptionParameters(RequestedPublishingInterval=100)
    subscription = await client.create_subscription(params, seen)
    await subscription.subscribe_data_change(tag(client, "fast"), queuesize=5000, sampling_interval=0)
    await tag(client, "start").write_value(True)
    await awaits("1000 changes", lambda: enough(seen, 1000))
    await tag(client, "start").write_value(False)
    count = json.loads(rungd("read", "fast", "--json"))["values"][0]["value"]
    await awaits("the last change", lambda: has_last(seen, count))
    await subscription.delete()
    values = [val for name, val, _ in seen.changes]
    first = values[0]
    assert values == list(range(first, count + 1)), "a change was lost"
    times = [data.SourceTimestamp for _, _, data in seen.changes[1:]]
    assert all(a < b for a, b in zip(times, times[1:])), "the times of scans do not rise"
    passed("every change of a subscription")
    return count


async def enough(seen, count):
    return len(seen.changes) > count


async def has_last(seen, count):
    return seen.changes and seen.changes[-1][1] == count


async def history(client, count):
    """The past has the same values as the subscription had."""
    start = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(minutes=10)

    async def whole():
        past = await tag(client, "fast").read_raw_history(start, None, 0)
        values = [data.Value.Value for data in past]
        return values if values and values[-1] == count else None

    values = await awaits("the whole past", whole)
    assert values == list(range(values[0], count + 1)), values[:20]
    few = await tag(client, "fast").read_raw_history(start, None, 5)
    assert len(few) == 5, few
    passed("history")


def condition_filter():
    """The fields of a condition, of all events of the type AlarmConditionType (OfType)."""
    paths = [["EventId"], ["EventType"], ["SourceName"], ["Message"], ["Severity"], ["Retain"],
             ["ActiveState", "Id"], ["AckedState", "Id"]]
    filter = ua.EventFilter()
    for path in paths:
        operand = ua.SimpleAttributeOperand()
        operand.TypeDefinitionId = ua.NodeId(ua.ObjectIds.AlarmConditionType)
        operand.BrowsePath = [ua.QualifiedName(name, 0) for name in path]
        operand.AttributeId = ua.AttributeIds.Value
        filter.SelectClauses.append(operand)
    element = ua.ContentFilterElement()
    element.FilterOperator = ua.FilterOperator.OfType
    kind = ua.Variant(ua.NodeId(ua.ObjectIds.AlarmConditionType))
    element.FilterOperands = [ua.LiteralOperand(Value=kind)]
    filter.WhereClause.Elements.append(element)
    return filter


async def alarms(client):
    seen = Seen()
    subscription = await client.create_subscription(100, seen)
    source = client.get_node(ua.NodeId("/", 2))
    await subscription.subscribe_events(source, evfilter=condition_filter())
    rungd("write", "trip", "1")
    await awaits("the alarm", lambda: enough_events(seen, 1))
    event = seen.events[0]
    assert event.SourceName == "trip" and event.Message.Text == "The drive has tripped", event
    assert event.Severity == 700 and event.Retain
    fields = event.get_event_props_as_fields_dict()
    assert fields["ActiveState/Id"].Value is True and fields["AckedState/Id"].Value is False, fields
    conditions = client.get_node(ua.NodeId("/alarms/trip", 2))
    acknowledge = ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Acknowledge)
    wrong = ua.Variant(b"nothing", ua.VariantType.ByteString)
    comment = ua.Variant(ua.LocalizedText("seen"), ua.VariantType.LocalizedText)
    try:
        await conditions.call_method(acknowledge, wrong, comment)
        raise AssertionError("a wrong event was acknowledged")
    except ua.UaStatusCodeError as error:
        assert "EventId" in type(error).__name__, error
    right = ua.Variant(event.EventId, ua.VariantType.ByteString)
    await conditions.call_method(acknowledge, right, comment)
    await awaits("acknowledged", lambda: enough_events(seen, 2))
    fields = seen.events[1].get_event_props_as_fields_dict()
    assert fields["AckedState/Id"].Value is True, fields
    rungd("write", "trip", "0")
    await awaits("over", lambda: enough_events(seen, 3))
    fields = seen.events[2].get_event_props_as_fields_dict()
    assert fields["ActiveState/Id"].Value is False and not seen.events[2].Retain, fields
    await subscription.delete()
    assert "acknowledged alarm trip" in (FOLDER / "rungd.log").read_text()
    passed("alarms")


async def enough_events(seen, count):
    return len(seen.events) >= count


async def reload(client):
    """A reload adds and removes nodes; those of other tags stay, with their subscriptions."""
    seen = Seen()
    subscription = await client.create_subscription(100, seen)
    await subscription.subscribe_data_change(tag(client, "speed"))
    text = (FOLDER / "ladder.toml").read_text()
    write("ladder.toml", text.replace("[tags]", "[tags]\nadded = { type = \"bit\" }").replace("slots  = { type = \"int\", count = 4 }\n", ""))
    rungd("reload")

    async def is_new():
        names = [child.nodeid.Identifier for child in await tag(client, "/tags").get_children()]
        return "added" in names and "slots" not in names

    await awaits("the new tag", is_new)
    await tag(client, "speed").write_value(ua.Variant(77, ua.VariantType.Int32))
    await awaits("77", lambda: has_value(seen, 77))
    await subscription.delete()
    passed("reload")


async def has_value(seen, wanted):
    return any(val == wanted for _, val, _ in seen.changes)


async def endings(client, running):
    """The values are bad while the controller is away, and good when it is back; a subscription says so,
    although no value changes, also between two samples."""
    told = Statuses()
    subscription = await client.create_subscription(100, told)
    for name, interval in [("speed", 0), ("/status/Mode", 1_000), ("level", 3_600_000)]:
        await subscription.subscribe_data_change(tag(client, name), sampling_interval=interval)
    await awaits("first values", lambda: told.are("Good", 3))
    running.end(signal.SIGKILL)

    async def status(name):
        data = await tag(client, name).read_data_value(raise_on_bad_status=False)
        return data.StatusCode.name

    async def is_bad():
        return await status("speed") == "BadNoCommunication" and await status("/status/Mode") == "BadNoCommunication"

    async def is_good():
        return await status("speed") == "Good" and await status("/status/Mode") == "Good"

    await awaits("bad values", is_bad)
    await awaits("bad values of a subscription", lambda: told.are("BadNoCommunication", 3))
    running = controller()
    await awaits("good values", is_good)
    await awaits("good values of a subscription", lambda: told.are("Good", 3))
    await subscription.delete()
    passed("a controller that ends and starts")
    return running


async def secure():
    """Encryption, a certificate that a person trusts, users."""
    key, certificate = FOLDER / "client.pem", FOLDER / "client.der"
    private = generate_private_key()
    key.write_bytes(private.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    made = generate_self_signed_app_certificate(
        private, "a client", {"organizationName": "t"}, [x509.UniformResourceIdentifier("urn:a-client")],
        extended=[ExtendedKeyUsageOID.CLIENT_AUTH], days=365,
    )
    certificate.write_bytes(made.public_bytes(Encoding.DER))

    async def connected(policy, user=None, password=None):
        client = Client(URL, timeout=30)
        client.application_uri = "urn:a-client"
        own = FOLDER / "pki/own/cert.der"
        await client.set_security(policy, str(certificate), str(key), server_certificate=str(own))
        if user:
            client.set_user(user)
            client.set_password(password)
        await client.connect()
        return client

    async def refused(*words):
        try:
            client = await connected(*words)
            await client.disconnect()
            raise AssertionError("it was let in")
        except (ua.UaError, ConnectionError, asyncio.TimeoutError, TimeoutError) as error:
            return error

    await refused(Basic, "anna", "correct horse")
    listed = subprocess.run([OPCUA, "trust", "opcua.toml", "list"], cwd=FOLDER, capture_output=True, text=True)
    found = re.search(r"rejected  ([0-9a-f]{40})  a client", listed.stdout)
    assert found, listed
    subprocess.run([OPCUA, "trust", "opcua.toml", "add", found[1][:8]], cwd=FOLDER, check=True)
    await refused(Basic, "anna", "wrong password")
    await refused(Basic)
    for policy in (Basic, Pss):
        client = await connected(policy, "anna", "correct horse")
        assert await value(client, "speed") is not None
        await tag(client, "speed").write_value(ua.Variant(5, ua.VariantType.Int32))
        await client.disconnect()
    assert re.search("anna.*speed|speed.*anna", (FOLDER / "rungd.log").read_text())
    # Without encryption nobody gets in.
    try:
        async with Client(URL, timeout=10):
            raise AssertionError("it was let in")
    except (ua.UaError, ConnectionError, asyncio.TimeoutError, TimeoutError):
        pass
    subprocess.run([OPCUA, "trust", "opcua.toml", "remove", found[1]], cwd=FOLDER, check=True)
    await refused(Basic, "anna", "correct horse")
    mode = (FOLDER / "pki/private/private.pem").stat().st_mode & 0o777
    assert mode == 0o600, oct(mode)
    passed("encryption, trust and users")


async def strangers(client):
    """Bytes that are no OPC UA, and pieces of messages without a channel, end only their connection."""
    random.seed(1)
    hello = struct.pack("<IIIIII", 0, 65536, 65536, 0, 0, len(URL)) + URL.encode()
    hello = b"HELF" + struct.pack("<I", 8 + len(hello)) + hello
    for count in range(100):
        lengths = [0, 7, 8, 12, 2**31, 2**32 - 1]
        piece = b"OPNF" + struct.pack("<I", random.choice(lengths)) + random.randbytes(400)
        chunk = b"MSGC" + struct.pack("<I", 65535) + bytes(65527)
        for bytes_sent in (random.randbytes(1000), hello + piece, hello + chunk * 3):
            with socket.create_connection(("127.0.0.1", PORT), timeout=WAIT) as stranger:
                try:
                    stranger.sendall(bytes_sent)
                except OSError:
                    pass
    filter = condition_filter()
    operand = ua.ElementOperand(Index=0)
    filter.WhereClause.Elements[0].FilterOperator = ua.FilterOperator.Not
    filter.WhereClause.Elements[0].FilterOperands = [operand]
    subscription = await client.create_subscription(100, Seen())
    try:
        await subscription.subscribe_events(client.get_node(ua.NodeId("/", 2)), evfilter=filter)
        raise AssertionError("a filter that refers to itself was accepted")
    except ua.UaStatusCodeError:
        pass
    await subscription.delete()
    assert await value(client, "speed") is not None
    passed("strangers")


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
write = ["start", "speed", "slots"]
[alarms]
acknowledge = true
""")


async def main():
    write("ladder.toml", LADDER)
    write("t.toml", 'ladder = ["ladder.toml"]\noperator.socket = "t.sock"\n[scan]\nperiod = "2ms"\n')
    settings("insecure = true")
    running, serving = controller(), server()
    try:
        async with Client(URL, timeout=30) as client:
            await awaits("good values", lambda: is_value(client, "speed", 0))
            await browse_and_read(client)
            await writes(client)
            count = await changes(client)
            await history(client, count)
            await alarms(client)
            await reload(client)
            await strangers(client)
            running = await endings(client, running)
        serving.end()
        log = (FOLDER / "opcua.log").read_text()
        assert "opcua writes speed" in log and "ends after a signal" in log, log
        users = subprocess.run([RUNGD, "web", "passwd", "anna", "--users-file", "users"], cwd=FOLDER,
                               input="correct horse\n", capture_output=True, text=True)
        assert users.returncode == 0, users
        settings("", 'users-file = "users"')
        serving = server("secure.log")
        await secure()
    finally:
        for process in (serving, running):
            if process.process.poll() is None:
                process.end()


asyncio.run(main())
