//! Events of field devices: found, lost, back.

rows! {
    DEVICE = 1101, "device", Info, NONE:
        "b61b8419197f460785895fd67b29d200",
        "A field device of the controller file was started: its driver, its peer and how many \
         points it has.",
        "Nothing.";

    DEVICE_PRESENT = 1102, "device-present", Info, NONE:
        "2bc25580ef4743a29dbbc1fd569fa683",
        "A field device exchanged for the first time: its inputs are what it says from this scan \
         on.",
        "Nothing.";

    DEVICE_ABSENT = 1103, "device-absent", Warn, NONE:
        "d71f8f00529f448684726e0fd65a9e40",
        "A field device has not exchanged once since the start, for longer than its `loss-after`. \
         Its inputs are what their tags' `initial` says, its `.Stale` is ON.",
        "See the line before it for the reason; check the device's supply, cable and address.";

    DEVICE_LOST = 1104, "device-lost", Warn, NONE:
        "9021052623be4ea3aa097c8b7c59efe8",
        "The last good exchange with a field device is longer ago than its `loss-after`. Its \
         `.Stale` is ON; its inputs are held or zero, as `on-loss` says. What its outputs do \
         meanwhile only the device itself decides.",
        "See device-trouble before it for the reason; check supply, cable, switch and address. \
         rungd tries again by itself, for as long as it takes.";

    DEVICE_BACK = 1105, "device-back", Info, NONE:
        "4cdc93e15dee4df69374951f99ee3150",
        "A lost field device exchanges again; lost_ms and scans say for how long the ladder saw \
         it as lost.",
        "Nothing; if it comes and goes, look at its cable and its load.";

    DEVICE_TROUBLE = 1106, "device-trouble", Warn, NONE:
        "adae0a9c2f2249f491c97ac462172ecd",
        "An exchange with a field device failed, for the reason given; its `.Ok` is OFF until one \
         succeeds. Told when the trouble begins, and when its reason changes.",
        "An exception: the device does not know what the map asks for. No answer: check that it \
         is there. If it comes back within `loss-after`, the ladder saw nothing but `.Ok`.";

    DEVICE_WELL = 1107, "device-well", Info, NONE:
        "250dc75d733940729217a27f55854773",
        "Exchanges with a field device succeed again; lasted_ms says how long they did not.",
        "Nothing.";

    DEVICE_ENDED = 1108, "device-ended", Error, NONE:
        "e873095093724c6ea8687a069bf6fbdf",
        "The task of a field device ended in a panic, which is a bug in rungd. The device is lost \
         until a restart; all else goes on.",
        "Restart rungd when the plant allows it, and report the lines before this one.";
}
