"""What a plant shows to a foreign client (asyncua): Programs with their Stages, the ladder's hash, a field device that
is lost, shelves of alarms, the recorded past.

Usage: plant.py RUNGD RUNGD_OPCUA FOLDER. Each passed part is a line `ok NAME`. Called by foreign.rs.
"""

import asyncio
import csv
import datetime
import io
import json
import re
import signal

from asyncua import Client, ua

from support import (FOLDER, PORT, RUNGD, URL, Process, Seen, Statuses, awaits, condition_filter, controller, end_all,
                     enough_events, is_value, passed, rungd, server, settings, tag, value, write)

PLANT = """
[ladder]
name = "plant"

[tags]
start   = { type = "bit" }
speed   = { type = "int", unit = "1/min" }
gate    = { at = "X0", doc = "The gate is open" }
lamp    = { at = "Y0" }
level   = { type = "real" }
trip    = { type = "bit", alarm = "The drive has tripped", priority = "high" }
burning = { type = "bit", alarm = "Fire", priority = "critical" }

[[program]]
name = "Main"
[[program.rung]]
when = ["start"]
do   = ["MATH speed = speed + 1", "MATH level = level + 0.25"]
[[program.stage]]
name = "Fill"
[[program.stage.rung]]
when = ["start"]
do   = ["JMP Mix"]
[[program.stage]]
name = "Mix"
[[program.stage.rung]]
when = ["gate"]
do   = ["OUT lamp"]
"""

FAR = """
[ladder]
name = "far"
[tags]
gate = { at = "X0" }
lamp = { at = "C5" }
seen = { at = "C0" }
[[program]]
name = "Main"
[[program.rung]]
when = ["gate"]
do   = ["OUT seen"]
"""

DEVICE = """
[[device]]
name       = "far"
driver     = "modbus-tcp"
address    = "127.0.0.1:{port}"
poll       = "20ms"
loss-after = "200ms"
map = [
  {{ from = "discrete 0", to = "X0" }},
  {{ from = "Y0", to = "coil 0" }},
]
"""

FAR_PORT = PORT + 1


def far():
    return Process([RUNGD, "run", "far.toml"], "far.log", "INFO")


async def status_of(client, name):
    return (await tag(client, name).read_data_value(raise_on_bad_status=False)).StatusCode.name


async def has_status(client, name, wanted):
    return await status_of(client, name) == wanted


async def programs(client):
    """Programs with their Stages, and the status of the controller."""
    children = [child.nodeid.Identifier for child in await tag(client, "/programs").get_children()]
    assert children == ["/programs/Main"], children
    stages = [child.nodeid.Identifier for child in await tag(client, "/programs/Main").get_children()]
    assert sorted(stages) == ["Main.Fill", "Main.Mix", "Main.Running"], stages
    # The values follow the scan log, which is a look behind.
    for name, wanted in [("Main.Running", True), ("Main.Fill", True), ("Main.Mix", False)]:
        await awaits(name, lambda: is_value(client, name, wanted))
    rungd("write", "start", "1")
    for name, wanted in [("Main.Fill", False), ("Main.Mix", True)]:
        await awaits(name, lambda: is_value(client, name, wanted))
    rungd("write", "start", "0")
    status = json.loads(rungd("status", "--json"))
    assert await value(client, "/status/LadderSha256") == status["ladder"]["sha256"]
    assert await value(client, "/status/Ladder") == "plant"
    assert await value(client, "/status/Mode") == status["mode"]
    passed("programs and status")


async def device(client, running):
    """A lost device makes its inputs uncertain and its outputs bad, and both are good when it is back."""
    seen = Statuses()
    subscription = await client.create_subscription(100, seen)
    number = subscription.subscription_id
    for name in ("gate", "lamp", "speed"):
        await subscription.subscribe_data_change(tag(client, name), sampling_interval=0)
    for name in ("gate", "lamp", "speed", "far.Ok"):
        await awaits(f"{name} is good", lambda: has_status(client, name, "Good"))
    running.end(signal.SIGKILL)
    await awaits("an uncertain input", lambda: has_status(client, "gate", "UncertainNoCommunicationLastUsableValue"))
    await awaits("a bad output", lambda: has_status(client, "lamp", "BadNoCommunication"))
    await awaits("far.Ok", lambda: is_value(client, "far.Ok", False))
    await awaits("far.Stale", lambda: is_value(client, "far.Stale", True))
    assert await status_of(client, "speed") == "Good"

    async def told(gate, lamp):
        return (seen.last.get("gate"), seen.last.get("lamp"), seen.last.get("speed")) == (gate, lamp, "Good")

    await awaits("told", lambda: told("UncertainNoCommunicationLastUsableValue", "BadNoCommunication"))
    running = far()
    await awaits("told", lambda: told("Good", "Good"))
    await awaits("good again", lambda: has_status(client, "gate", "Good"))
    assert subscription.subscription_id == number, "the client took the subscription for dead and made another one"
    await subscription.delete()
    passed("a device that is lost")
    return running


METHODS = ua.ObjectIds


def comment(text):
    return ua.Variant(ua.LocalizedText(text), ua.VariantType.LocalizedText)


def duration(ms):
    return ua.Variant(float(ms), ua.VariantType.Double)


async def refused(node, method, *arguments):
    """The status with which a method is refused."""
    try:
        await node.call_method(ua.NodeId(method), *arguments)
    except ua.UaStatusCodeError as error:
        return ua.StatusCode(error.code).name
    raise AssertionError("it was done")


def shelf(name):
    alarms = json.loads(rungd("alarms", "--json"))["alarms"]
    return next((alarm.get("shelved") for alarm in alarms if alarm["tag"] == name), None)


async def shelves(client):
    """The methods of shelves do what `rungd shelve` and `unshelve` do, with the user's name in the log."""
    seen = Seen()
    subscription = await client.create_subscription(100, seen)
    await subscription.subscribe_events(client.get_node(ua.NodeId("/", 2)), evfilter=condition_filter())
    rungd("write", "trip", "1")
    await awaits("the alarm", lambda: enough_events(seen, 1))
    condition = client.get_node(ua.NodeId("/alarms/trip", 2))
    state = client.get_node(ua.NodeId("/alarms/trip/ShelvingState", 2))
    unknown = client.get_node(ua.NodeId("/tags/trip", 2))
    timed = METHODS.ShelvedStateMachineType_TimedShelve
    hour = 3_600_000

    for wrong in (0, -1, float("nan"), 168 * hour + 1, float("inf")):
        assert await refused(condition, timed, duration(wrong)) == "BadShelvingTimeOutOfRange", wrong
    assert await refused(condition, timed) == "BadArgumentsMissing"
    assert await refused(condition, timed, comment("x")) == "BadTypeMismatch"
    assert await refused(unknown, timed, duration(hour)) == "BadNodeIdUnknown"
    assert await refused(condition, METHODS.ShelvedStateMachineType_OneShotShelve) == "BadNotImplemented"
    assert await refused(condition, METHODS.ShelvedStateMachineType_Unshelve) == "BadConditionNotShelved"
    critical = client.get_node(ua.NodeId("/alarms/burning", 2))
    assert await refused(critical, timed, duration(hour)) == "BadRequestNotAllowed"
    long = METHODS.AlarmConditionType_ShelvingState_TimedShelve2
    assert await refused(state, long, duration(hour), comment("a\nb")) == "BadInvalidArgument"
    assert shelf("trip") is None and len(seen.events) == 1

    await condition.call_method(ua.NodeId(timed), duration(hour))
    kept = shelf("trip")
    assert kept["why"] == "by opcua, over OPC UA without a comment" and "opcua" in kept["who"], kept
    assert abs((kept["until_ns"] - kept["since_ns"]) / 1e6 - hour) < 1, kept
    await awaits("shelved", lambda: enough_events(seen, 2))
    fields = seen.events[1].get_event_props_as_fields_dict()
    assert fields["SuppressedOrShelved"].Value is True and seen.events[1].Retain, fields
    assert fields["ShelvingState/CurrentState"].Value.Text == "Timed Shelved", fields
    assert hour - 60_000 < fields["ShelvingState/UnshelveTime"].Value <= hour, fields
    assert fields["MaxTimeShelved"].Value == 168 * hour and fields["OutOfServiceState/Id"].Value is False, fields
    # A second time replaces the first one.
    await state.call_method(ua.NodeId(long), duration(2 * hour), comment("New bearing on Friday"))
    assert shelf("trip")["why"] == "New bearing on Friday"
    await awaits("shelved anew", lambda: enough_events(seen, 3))
    assert seen.events[2].get_event_props_as_fields_dict()["Comment"].Value.Text == "New bearing on Friday"
    await state.call_method(ua.NodeId(METHODS.ShelvedStateMachineType_Unshelve2), comment("Repaired"))
    assert shelf("trip") is None
    await awaits("back", lambda: enough_events(seen, 4))
    fields = seen.events[3].get_event_props_as_fields_dict()
    assert fields["SuppressedOrShelved"].Value is False
    assert fields["ShelvingState/CurrentState"].Value.Text == "Unshelved"
    assert fields["AckedState/Id"].Value is False and fields["ShelvingState/UnshelveTime"].Value == 0, fields

    remove, place = (METHODS.AlarmConditionType_RemoveFromService, METHODS.AlarmConditionType_PlaceInService2)
    assert await refused(condition, place, comment("x")) == "BadInvalidState"
    await condition.call_method(ua.NodeId(remove))
    await awaits("out of service", lambda: enough_events(seen, 5))
    fields = seen.events[4].get_event_props_as_fields_dict()
    assert fields["OutOfServiceState/Id"].Value is True and "until_ns" not in shelf("trip"), fields
    assert await refused(condition, METHODS.ShelvedStateMachineType_Unshelve) == "BadConditionNotShelved"
    await condition.call_method(ua.NodeId(place), comment("Back"))
    assert shelf("trip") is None
    await awaits("in service", lambda: enough_events(seen, 6))
    await subscription.delete()
    log = (FOLDER / "rungd.log").read_text()
    assert re.search("opcua.* shelved alarm trip", log) and "New bearing on Friday" in log, log[-3000:]
    for did in ("brought alarm trip back", "took alarm trip out of service"):
        assert re.search(f"opcua.* {did}", log), log[-3000:]
    lines = (FOLDER / "opcua.log").read_text()
    assert "opcua shelves trip, and is refused: rungd has no shelf that ends with the alarm" in lines, lines
    assert "opcua shelves burning, and is refused: `burning` is critical" in lines, lines
    assert "opcua brings back from its shelf trip (Repaired)" in lines, lines
    rungd("write", "trip", "0")
    passed("shelves")


async def not_permitted(client):
    """Without `[alarms] shelve` and `acknowledge` nobody does either."""
    condition = client.get_node(ua.NodeId("/alarms/trip", 2))
    timed = ua.ObjectIds.ShelvedStateMachineType_TimedShelve
    assert await refused(condition, timed, duration(1000)) == "BadUserAccessDenied"
    event = ua.Variant(b"x", ua.VariantType.ByteString)
    acknowledge = ua.ObjectIds.AcknowledgeableConditionType_Acknowledge
    assert await refused(condition, acknowledge, event, comment("x")) == "BadUserAccessDenied"
    passed("methods that are not listed")


async def past(client):
    """The past has the values of `rungd record export`; minimum, maximum and average are those of these values."""
    await awaits("start", lambda: is_value(client, "start", False))
    begin = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(minutes=10)
    rungd("write", "start", "1")
    await awaits("500 scans", lambda: is_above(client, "speed", 500))
    rungd("write", "start", "0")
    last = json.loads(rungd("read", "speed", "--json"))["values"][0]["value"]

    async def whole():
        data = await tag(client, "speed").read_raw_history(begin, None, 0)
        return data if data and data[-1].Value.Value == last else None

    data = await awaits("the whole past", whole)
    table = list(csv.DictReader(io.StringIO(rungd("record", "export", "--watch", "speed,level", "-o", "-"))))
    for name, read in [("speed", int), ("level", float)]:
        exported = [read(row[name]) for row in table]
        exported = [value for at, value in enumerate(exported) if at == 0 or value != exported[at - 1]]
        raw = await tag(client, name).read_raw_history(begin, None, 0)
        values = [one.Value.Value for one in raw]
        # The log's last minute moves on between the two: the later one may begin later.
        assert len(values) > 500 and values[-len(exported):] == exported[-len(values):], (values[:5], exported[:5])
    times = [one.SourceTimestamp for one in data]
    assert times == sorted(times)

    # From the first change to the last one, whole and in ten parts.
    start, end = data[1].SourceTimestamp, data[-1].SourceTimestamp
    length = (end - start) / datetime.timedelta(milliseconds=1)
    for parts in (1, 10):
        for aggregate in ("Minimum", "Maximum", "Average"):
            got = await processed(client, "speed", aggregate, (start, end, length / parts))
            assert parts <= len(got) <= parts + 1, len(got)
            for at in range(parts):
                part = [start + (end - start) * side / parts for side in (at, at + 1)]
                wanted = aggregated(data, aggregate, part)
                # A limit between two ticks of 100 ns may fall to either side of a change.
                assert abs(got[at] - wanted) <= 1.01, (aggregate, parts, at, got[at], wanted)
    passed("history beside the export")


async def is_above(client, name, limit):
    return await value(client, name) > limit


def aggregated(data, aggregate, part):
    """Of the values of a part of the time, each of which holds until the next."""
    pieces = []
    for at, one in enumerate(data):
        until = data[at + 1].SourceTimestamp if at + 1 < len(data) else part[1]
        begin, end = max(one.SourceTimestamp, part[0]), min(until, part[1])
        if begin < end:
            pieces.append((one.Value.Value, (end - begin).total_seconds()))
    if aggregate == "Average":
        return sum(value * time for value, time in pieces) / sum(time for _, time in pieces)
    return (min if aggregate == "Minimum" else max)(value for value, _ in pieces)


async def processed(client, name, aggregate, span):
    details = ua.ReadProcessedDetails()
    details.StartTime, details.EndTime, details.ProcessingInterval = span
    details.AggregateType = [ua.NodeId(getattr(ua.ObjectIds, f"AggregateFunction_{aggregate}"))]
    asked = ua.HistoryReadValueId()
    asked.NodeId = ua.NodeId(name, 2)
    params = ua.HistoryReadParameters()
    params.HistoryReadDetails = details
    params.NodesToRead, params.ReleaseContinuationPoints = [asked], False
    [answer] = await client.uaclient.history_read(params)
    answer.StatusCode.check()
    return [one.Value.Value for one in answer.HistoryData.DataValues]


async def endless(client):
    """Reads of the past that ask for more than there is end: they are refused, or answered with what there is."""
    now = datetime.datetime.now(datetime.timezone.utc)
    never = datetime.datetime(9999, 12, 31, tzinfo=datetime.timezone.utc)
    for step in (1e13, 1e300, 0.0):
        assert len(await processed(client, "speed", "Maximum", (now, never, step))) >= 1
    for span in [(now, never, 1.0), (never, now, 1.0), (now, now, 1.0)]:
        try:
            await processed(client, "speed", "Maximum", span)
            raise AssertionError(f"{span} was answered")
        except ua.UaStatusCodeError as error:
            assert "BadInvalidArgument" in type(error).__name__, error
    passed("reads without an end")


async def main():
    write("ladder.toml", PLANT)
    write("far-ladder.toml", FAR)
    write("t.toml", 'ladder = ["ladder.toml"]\noperator.socket = "t.sock"\n[scan]\nperiod = "2ms"\n'
          + DEVICE.format(port=FAR_PORT))
    write("far.toml", f'ladder = ["far-ladder.toml"]\noperator.socket = "far.sock"\n'
          f'[modbus-server]\nlisten = "127.0.0.1:{FAR_PORT}"\nwritable = ["C5"]\nstandard-map = false\n'
          '[[modbus-server.map]]\noperand = "X0"\ntable = "discrete"\naddress = 0\n'
          '[[modbus-server.map]]\noperand = "C5"\ntable = "coil"\naddress = 0\n')
    settings("insecure = true")
    try:
        away = far()
        running, serving = controller(), server()
        async with Client(URL, timeout=30) as client:
            await awaits("good values", lambda: is_value(client, "speed", 0))
            await programs(client)
            away = await device(client, away)
            await shelves(client)
            await past(client)
            await endless(client)
        serving.end()
        text = (FOLDER / "opcua.toml").read_text()
        write("opcua.toml", text.replace("shelve = true", "").replace("acknowledge = true", ""))
        serving = server("quiet.log")
        async with Client(URL, timeout=30) as client:
            await not_permitted(client)
    finally:
        end_all()


asyncio.run(main())
