//! Events of field devices: found, lost, back.

rows! {
    DEVICE = 1101, "device", Info, NONE, ByName:
        "b61b8419197f460785895fd67b29d200",
        "rungd started a field device of the controller file. The line has its driver, its peer \
         and its number of points.",
        "Nothing.";

    DEVICE_PRESENT = 1102, "device-present", Info, NONE, ByName:
        "2bc25580ef4743a29dbbc1fd569fa683",
        "A field device exchanged for the first time: from this scan on, its inputs are those \
         that it sent.",
        "Nothing.";

    DEVICE_ABSENT = 1103, "device-absent", Warn, NONE, Never:
        "d71f8f00529f448684726e0fd65a9e40",
        "No exchange with a field device has succeeded in full since the start, for longer than \
         its `loss-after`. Its `.Stale` is ON. Inputs that were never read have the `initial` \
         value of their tags.",
        "See the line before it for the reason; check the device's supply, cable and address.";

    DEVICE_LOST = 1104, "device-lost", Warn, NONE, Never:
        "9021052623be4ea3aa097c8b7c59efe8",
        "The last exchange that succeeded in full with a field device is longer ago than its \
         `loss-after`. Its `.Stale` is ON. Inputs that were not read for that long are held or \
         zero, as `on-loss` says; inputs that are still read follow the device. Only the device \
         itself decides what its outputs do meanwhile.",
        "See device-trouble before it for the reason; check supply, cable, switch and address. \
         rungd tries again by itself until it succeeds.";

    DEVICE_BACK = 1105, "device-back", Info, NONE, Never:
        "4cdc93e15dee4df69374951f99ee3150",
        "A lost field device exchanges again; lost_ms and scans say for how long the ladder saw \
         it as lost.",
        "Nothing; if it comes and goes, look at its cable and its load.";

    DEVICE_TROUBLE = 1106, "device-trouble", Warn, NONE, ByName:
        "adae0a9c2f2249f491c97ac462172ecd",
        "An exchange with a field device failed, for the reason in the line; its `.Ok` is OFF \
         until an exchange succeeds. One line for each outage: `rungd status` shows the latest \
         reason, and device-well counts all of them.",
        "An exception: the device does not have what the map names. No answer: check that it is \
         there. If it comes back within `loss-after`, the ladder saw only `.Ok` go OFF.";

    DEVICE_WELL = 1107, "device-well", Info, NONE, ByName:
        "250dc75d733940729217a27f55854773",
        "Exchanges with a field device succeed again; lasted_ms is the duration of the outage, \
         failures the number of failed exchanges.",
        "Nothing.";

    DEVICE_ENDED = 1108, "device-ended", Error, NONE, Never:
        "e873095093724c6ea8687a069bf6fbdf",
        "The task of a field device ended in a panic, which is a bug in rungd. The device is lost \
         until a restart; everything else continues.",
        "Restart rungd when the plant allows it, and report the lines before this one.";

    DEVICE_UNSAFE = 1109, "device-unsafe", Error, NONE, Never:
        "7d4b9c26fa0e44a9bc8e5048878a88cb",
        "At the end of the process rungd tried for two seconds to write the safe values to a \
         field device, and failed: its outputs may be as the last good write left them.",
        "Look at the device's outputs. Only the device's own watchdog, or the next start of \
         rungd, makes them safe now.";
}
