//! Events of field devices: found, lost, back.

use super::{Event, Level, Limit};

pub(super) const EVENTS: &[Event] = &[
    Event {
        number: 1101,
        name: "device",
        level: Level::Info,
        id: "b61b8419197f460785895fd67b29d200",
        limit: Limit::NONE,
        meaning: "A field device of the controller file was started: its driver, its peer and \
                 how many points it has.",
        remedy: "Nothing.",
    },
    Event {
        number: 1102,
        name: "device-present",
        level: Level::Info,
        id: "2bc25580ef4743a29dbbc1fd569fa683",
        limit: Limit::NONE,
        meaning: "A field device exchanged for the first time: its inputs are what it says from \
                 this scan on.",
        remedy: "Nothing.",
    },
    Event {
        number: 1103,
        name: "device-absent",
        level: Level::Warn,
        id: "d71f8f00529f448684726e0fd65a9e40",
        limit: Limit::NONE,
        meaning: "A field device has not exchanged once since the start, for longer than its \
                 `loss-after`. Its inputs are what their tags' `initial` says, its `.Stale` is \
                 ON.",
        remedy: "See the line before it for the reason; check the device's supply, cable and \
                 address.",
    },
    Event {
        number: 1104,
        name: "device-lost",
        level: Level::Warn,
        id: "9021052623be4ea3aa097c8b7c59efe8",
        limit: Limit::NONE,
        meaning: "The last good exchange with a field device is longer ago than its \
                 `loss-after`. Its `.Stale` is ON; its inputs are held or zero, as `on-loss` says. \
                 What its outputs do meanwhile only the device itself decides.",
        remedy: "See device-trouble before it for the reason; check supply, cable, switch and \
                 address. rungd tries again by itself, for as long as it takes.",
    },
    Event {
        number: 1105,
        name: "device-back",
        level: Level::Info,
        id: "4cdc93e15dee4df69374951f99ee3150",
        limit: Limit::NONE,
        meaning: "A lost field device exchanges again; lost_ms and scans say for how long the \
                 ladder saw it as lost.",
        remedy: "Nothing; if it comes and goes, look at its cable and its load.",
    },
    Event {
        number: 1106,
        name: "device-trouble",
        level: Level::Warn,
        id: "adae0a9c2f2249f491c97ac462172ecd",
        limit: Limit::NONE,
        meaning: "An exchange with a field device failed, for the reason given; its `.Ok` is OFF \
                 until one succeeds. Told when the trouble begins, and when its reason changes.",
        remedy: "An exception: the device does not know what the map asks for. No answer: check \
                 that it is there. If it comes back within `loss-after`, the ladder saw nothing \
                 but `.Ok`.",
    },
    Event {
        number: 1107,
        name: "device-well",
        level: Level::Info,
        id: "250dc75d733940729217a27f55854773",
        limit: Limit::NONE,
        meaning: "Exchanges with a field device succeed again; lasted_ms says how long they did \
                 not.",
        remedy: "Nothing.",
    },
    Event {
        number: 1108,
        name: "device-ended",
        level: Level::Error,
        id: "e873095093724c6ea8687a069bf6fbdf",
        limit: Limit::NONE,
        meaning: "The task of a field device ended in a panic, which is a bug in rungd. The device \
                  is lost until a restart; all else goes on.",
        remedy: "Restart rungd when the plant allows it, and report the lines before this one.",
    },
];
