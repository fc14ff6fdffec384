//! Events of the plant and of the scan: alarms, tags, blocks, overruns, the heartbeat, the log.

use super::{Event, Level, Limit};

pub(super) const EVENTS: &[Event] = &[
    Event {
        number: 301,
        name: "alarm-on",
        level: Level::Warn,
        id: "cee4db88c3f24fe387a305e32f579a42",
        limit: Limit::NONE,
        meaning: "A bit that the ladder declares an alarm went ON. The text is its author's.",
        remedy: "Do what the plant's instructions say for this alarm. alarm-off with the same tag \
                 tells its end.",
    },
    Event {
        number: 302,
        name: "alarm-off",
        level: Level::Info,
        id: "50a22ea57cb7432995254fcf6c4e3728",
        limit: Limit::NONE,
        meaning: "The alarm is over; lasted_ms says how long it stood.",
        remedy: "Nothing.",
    },
    Event {
        number: 303,
        name: "tag-on",
        level: Level::Info,
        id: "ac6a8e0c937a48b38ce0234cc416a999",
        limit: Limit::PLANT,
        meaning: "A bit with `log = \"change\"` went ON.",
        remedy: "Nothing.",
    },
    Event {
        number: 304,
        name: "tag-off",
        level: Level::Info,
        id: "a685c68d90c54d799a44985e92302f3e",
        limit: Limit::PLANT,
        meaning: "A bit with `log = \"change\"` went OFF; lasted_ms says how long it was ON.",
        remedy: "Nothing.",
    },
    Event {
        number: 305,
        name: "tag-value",
        level: Level::Info,
        id: "9ccf74aed5614ff8a74b51d001ee7055",
        limit: Limit::PLANT,
        meaning: "A word with `log = \"change\"` has another value: from and to.",
        remedy: "Nothing.",
    },
    Event {
        number: 401,
        name: "block-started",
        level: Level::Info,
        id: "274eb387ce934a6dbb53a814a9bfda4e",
        limit: Limit::PLANT,
        meaning: "A Program or Task was started. What built-in Tasks do is at level debug.",
        remedy: "Nothing.",
    },
    Event {
        number: 402,
        name: "block-stopped",
        level: Level::Info,
        id: "554f5447fa704ace882645180f9b85db",
        limit: Limit::PLANT,
        meaning: "A Program or Task was stopped, by HALT, by RESTART or by a STOP of the \
                  controller.",
        remedy: "Nothing.",
    },
    Event {
        number: 403,
        name: "block-completed",
        level: Level::Info,
        id: "ef06f65e3e8e491b90197ff77ddea4bd",
        limit: Limit::PLANT,
        meaning: "A Program or Task came to its end by itself.",
        remedy: "Nothing.",
    },
    Event {
        number: 404,
        name: "stage-on",
        level: Level::Info,
        id: "ca58370959f34ab185c1534a5dea3bb5",
        limit: Limit::PLANT,
        meaning: "A Stage is ON: its rungs are executed.",
        remedy: "Nothing.",
    },
    Event {
        number: 405,
        name: "stage-off",
        level: Level::Info,
        id: "e20be995a1fd4141871a71d68c7c2149",
        limit: Limit::PLANT,
        meaning: "A Stage is OFF, and will have its termination pass.",
        remedy: "Nothing.",
    },
    Event {
        number: 406,
        name: "termination-pass",
        level: Level::Info,
        id: "5b319003fe274492be11718593e5cebe",
        limit: Limit::PLANT,
        meaning: "A Program, Task or Stage that ended had its termination pass: its coils went \
                  OFF, its timers and counters were reset as docs/semantics.md says.",
        remedy: "Nothing.",
    },
    Event {
        number: 501,
        name: "overrun",
        level: Level::Warn,
        id: "78491505164848b0b17a011d48673fdd",
        limit: Limit::NONE,
        meaning: "A scan was not over at the next grid point, and grid points passed without a \
                  scan. The line says whether the scan was long or the machine woke it late.",
        remedy: "If late: look at the real-time posture and at what else runs. If long, and the \
                 mean in the heartbeat is near the period: raise `[scan] period`.",
    },
    Event {
        number: 502,
        name: "heartbeat",
        level: Level::Info,
        id: "37b8bedd8fe9453d8eec0bf720c149f3",
        limit: Limit::NONE,
        meaning: "A sign of life with the statistics since the last one: mode, scans, how long \
                  they took, how late they were, forces, lines that the log lost since the \
                  start. Every `[log] statistics`.",
        remedy: "Nothing. Watch scan_us_max against the watchdog, and overruns.",
    },
    Event {
        number: 503,
        name: "statistics",
        level: Level::Info,
        id: "85d0693e140c4a5093ba89d7d93eb148",
        limit: Limit::NONE,
        meaning: "The scan statistics since RUN was last entered, when the process ends.",
        remedy: "Nothing.",
    },
    Event {
        number: 601,
        name: "lines-withheld",
        level: Level::Warn,
        id: "0d214eebad0c479cb3d56e91ac093e77",
        limit: Limit::NONE,
        meaning: "Lines of one event came more often than its limit, and so many were left out. \
                  The field withheld names the event.",
        remedy: "Find what chatters: a bouncing sensor, a client in a loop. At level debug \
                 nothing but alarms is withheld.",
    },
    Event {
        number: 602,
        name: "log-dropped",
        level: Level::Warn,
        id: "29bc791452d949638c791b845bad29d1",
        limit: Limit::NONE,
        meaning: "The log could not keep up or could not be written: so many lines are lost. No \
                  scan waited for it.",
        remedy: "See whether the journal or the disk was stuck or full. What happened meanwhile \
                 is not in the log.",
    },
    Event {
        number: 603,
        name: "records-dropped",
        level: Level::Warn,
        id: "2e90653c20b045339ee6a73920011a0f",
        limit: Limit::NONE,
        meaning: "More happened in the ladder than the scan thread could hand over: so many \
                  events are lost. No scan waited.",
        remedy: "Nothing for the plant. Let fewer tags have `log = \"change\"`.",
    },
    Event {
        number: 604,
        name: "events-lost",
        level: Level::Warn,
        id: "72d6a9c4ba7646179e43905e967b8b74",
        limit: Limit::CLIENTS,
        meaning: "In one scan more happened to Programs, Tasks and Stages than can be told: so \
                  many are not in the log.",
        remedy: "Nothing for the plant: all of it was executed.",
    },
];
