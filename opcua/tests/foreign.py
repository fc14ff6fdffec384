"""A foreign OPC UA client (asyncua) against `rungd-opcua` and a running controller.

Usage: foreign.py RUNGD RUNGD_OPCUA FOLDER. Each passed part is a line `ok NAME`. Called by foreign.rs.
"""

import asyncio
import datetime
import json
import re
import signal

from asyncua import Client, ua

from support import (FOLDER, LADDER, OVERFLOW, URL, Seen, Statuses, awaits, condition_filter, controller, end_all,
                     enough_events, event_filter, is_value, passed, refused_with, rungd, server, settings, tag, value,
                     write, write_with_reason)


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
    for name in sorted(shown - {"fast", "slots", "dose"}):
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
    await overflow(client)
    return json.loads(rungd("read", "fast", "--json"))["values"][0]["value"]


async def overflow(client):
    """A queue that is too short is told by the overflow bit, beside the newest values."""
    seen = Seen()
    params = ua.CreateSubscriptionParameters(RequestedPublishingInterval=500)
    subscription = await client.create_subscription(params, seen)
    await subscription.subscribe_data_change(tag(client, "fast"), queuesize=2, sampling_interval=0)
    await tag(client, "start").write_value(True)
    await awaits("an overflow", lambda: has_overflow(seen))
    await tag(client, "start").write_value(False)
    await subscription.delete()
    passed("a queue that is too short")


async def has_overflow(seen):
    return any(data.StatusCode.value & OVERFLOW for _, _, data in seen.changes)


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


async def reload(client):
    """A reload adds and removes nodes, and tells which; those of other tags stay, with their subscriptions."""
    seen = Seen()
    subscription = await client.create_subscription(100, seen)
    await subscription.subscribe_data_change(tag(client, "speed"))
    changed = ua.ObjectIds.GeneralModelChangeEventType
    await subscription.subscribe_events(client.nodes.server, evfilter=event_filter(changed, [["Changes"]]))
    text = (FOLDER / "ladder.toml").read_text()
    text = text.replace("[tags]", "[tags]\nadded = { type = \"bit\" }")
    write("ladder.toml", text.replace("slots  = { type = \"int\", count = 4 }\n", ""))
    rungd("reload")

    async def is_new():
        names = [child.nodeid.Identifier for child in await tag(client, "/tags").get_children()]
        return "added" in names and "slots" not in names

    await awaits("the new tag", is_new)
    await tag(client, "speed").write_value(ua.Variant(77, ua.VariantType.Int32))
    await awaits("77", lambda: has_value(seen, 77))
    await awaits("the event", lambda: enough_events(seen, 1))
    fields = seen.events[0].get_event_props_as_fields_dict()
    told = {(change.Affected.Identifier, change.Verb) for change in fields["Changes"].Value}
    assert told == {("added", 1), ("slots", 2)}, told
    await subscription.delete()
    passed("reload")


async def reasons(client):
    """What a panel writes with a reason alone is written so here too, and the controller's log has the reason."""
    dose, both = tag(client, "dose"), ua.Variant([1, 2], ua.VariantType.Int32)

    async def is_writable(wanted):
        return (ua.AccessLevel.CurrentWrite in await dose.get_access_level()) == wanted

    async def plain():
        await dose.write_value(both)

    await plain()
    write("t.toml", CONTROLLER + '[[panel]]\nname = "Doses"\nshow = [{ value = "dose[0]", reason = true }]\n')
    rungd("reload")
    await awaits("a node that is not writable", lambda: is_writable(False))
    await refused_with("BadNotWritable", plain())
    line = "opcua writes dose[0] to dose[1], and is refused: `dose[0]` is written with a reason alone"
    await awaits(line, lambda: is_in_log(line, "opcua.log"))
    root = client.get_node(ua.NodeId("/", 2))
    [method] = [node for node in await root.get_children() if await node.read_node_class() == ua.NodeClass.Method]
    [arguments] = [node for node in await method.get_properties()]
    assert [one.Name for one in await arguments.read_value()] == ["Tag", "Value", "Reason"]
    one = ua.Variant(7, ua.VariantType.Int32)
    await write_with_reason(client, "dose", ua.Variant([3, 4], ua.VariantType.Int32), "Foam in the tank")
    assert await value_of("dose[0]") == 3 and await value_of("dose[1]") == 4
    await write_with_reason(client, "dose[1]", one, ua.Variant(ua.LocalizedText(" Calibration "),
                                                               ua.VariantType.LocalizedText))
    assert await value_of("dose[1]") == 7
    await write_with_reason(client, "speed", one, "No reason is asked for")
    for reason in ("Foam in the tank", "Calibration", "No reason is asked for"):
        await awaits(reason, lambda: is_in_log(f"reason: {reason}"))
    for name, variant, reason, status in [
        ("dose[1]", one, "", "BadInvalidArgument"),
        ("dose[1]", one, "two\nlines", "BadInvalidArgument"),
        ("dose[1]", one, "x" * 201, "BadInvalidArgument"),
        (ua.Variant(5, ua.VariantType.Int32), one, "Why", "BadInvalidArgument"),
        ("dose[2]", one, "Why", "BadIndexRangeNoData"),
        ("dose[1]", ua.Variant(101, ua.VariantType.Int32), "Why", "BadOutOfRange"),
        ("dose[1]", ua.Variant("x", ua.VariantType.String), "Why", "BadTypeMismatch"),
        ("nothing", one, "Why", "BadNodeIdUnknown"),
        ("level", ua.Variant(1.0, ua.VariantType.Float), "Why", "BadNotWritable"),
    ]:
        await refused_with(status, write_with_reason(client, name, variant, reason))
    assert await value_of("dose[1]") == 7
    write("t.toml", CONTROLLER)
    rungd("reload")
    await awaits("a writable node", lambda: is_writable(True))
    await plain()
    passed("writes with a reason")


async def is_in_log(text, name="rungd.log"):
    return text in (FOLDER / name).read_text()


async def value_of(name):
    return json.loads(rungd("read", name, "--json"))["values"][0]["value"]


async def has_value(seen, wanted):
    return any(val == wanted for _, val, _ in seen.changes)


async def endings(client, running):
    """The values are bad while the controller is away, and good when it is back; a subscription says so,
    although no value changes, also between two samples."""
    told = Statuses()
    subscription = await client.create_subscription(100, told)
    number = subscription.subscription_id
    for name, interval in [("speed", 0), ("/status/Mode", 1_000), ("level", 3_600_000)]:
        await subscription.subscribe_data_change(tag(client, name), queuesize=10, sampling_interval=interval)
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
    assert not told.gaps, told.gaps
    running = controller()
    await awaits("good values", is_good)
    await awaits("good values of a subscription", lambda: told.are("Good", 3))
    # What the values were in between nobody knows.
    await awaits("a gap of both tags", lambda: told.have_gaps({"speed", "level"}))
    assert subscription.subscription_id == number, "the client took the subscription for dead and made another one"
    await subscription.delete()
    passed("a controller that ends and starts")
    return running


CONTROLLER = 'ladder = ["ladder.toml"]\noperator.socket = "t.sock"\n[scan]\nperiod = "2ms"\n'


async def main():
    write("ladder.toml", LADDER)
    write("t.toml", CONTROLLER)
    settings("insecure = true")
    try:
        running, serving = controller(), server()
        async with Client(URL, timeout=30) as client:
            await awaits("good values", lambda: is_value(client, "speed", 0))
            await browse_and_read(client)
            await writes(client)
            count = await changes(client)
            await history(client, count)
            await alarms(client)
            await reload(client)
            await reasons(client)
            running = await endings(client, running)
        serving.end()
        log = (FOLDER / "opcua.log").read_text()
        assert "opcua writes speed" in log and "ends after a signal" in log, log
    finally:
        end_all()


asyncio.run(main())
