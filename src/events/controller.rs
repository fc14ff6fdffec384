//! Events of the controller itself: its process, its posture, its modes.

use super::{Event, Level, Limit};

pub(super) const EVENTS: &[Event] = &[
    Event {
        number: 1,
        name: "process-start",
        level: Level::Info,
        id: "63f400b4263649a189afe95d4121598d",
        limit: Limit::NONE,
        meaning: "rungd was started with this controller file.",
        remedy: "Nothing. If nobody started it, see the lines before: systemd restarts it after a \
                 crash or a watchdog.",
    },
    Event {
        number: 2,
        name: "ladder-loaded",
        level: Level::Info,
        id: "acf762f009b6413da17f3e3e35e693be",
        limit: Limit::NONE,
        meaning: "The ladder was read and checked, and is what will be scanned.",
        remedy: "Nothing. To see whether it is the ladder you think it is, compare sha256 with \
                 `cat FILES | sha256sum`.",
    },
    Event {
        number: 3,
        name: "ladder-warnings",
        level: Level::Warn,
        id: "8a2bcbed1eb346efa818db97b660c9be",
        limit: Limit::NONE,
        meaning: "The check of the ladder has warnings. It runs all the same.",
        remedy: "See them with `rungd check` and the controller file, and mend or allow each.",
    },
    Event {
        number: 4,
        name: "simulated-device",
        level: Level::Info,
        id: "1cf973db919f48e8810b922fbf72a8ad",
        limit: Limit::NONE,
        meaning: "A simulated device moves inputs: this is no real plant.",
        remedy: "On a real plant, take the `[[simulated-device]]` tables out of the controller \
                 file.",
    },
    Event {
        number: 5,
        name: "process-end",
        level: Level::Info,
        id: "61462cda98654a4cb1012be91dc1ab68",
        limit: Limit::NONE,
        meaning: "rungd ends; the line says in which mode and after how many scans.",
        remedy: "Nothing, if it was asked to. The lines before say who asked.",
    },
    Event {
        number: 6,
        name: "start-refused",
        level: Level::Error,
        id: "9dc8041a8e7540beb064d85df311782a",
        limit: Limit::NONE,
        meaning: "rungd does not start; the line says why. Nothing was scanned.",
        remedy: "Mend what the line names, then start it again. `rungd check` tells beforehand \
                 whether a controller file can be run.",
    },
    Event {
        number: 7,
        name: "finding",
        level: Level::Error,
        id: "5c6a8c016f8949fa88f2e0b59727966b",
        limit: Limit::NONE,
        meaning: "A part of what is wrong with the ladder or the controller file: the findings \
                  line by line, as `rungd check` prints them.",
        remedy: "Run `rungd check` with the controller file, and `rungd explain` with the \
                 finding's name.",
    },
    Event {
        number: 8,
        name: "signal",
        level: Level::Info,
        id: "f72011ec680a45859008e99bb0a307f9",
        limit: Limit::NONE,
        meaning: "A signal asks for an orderly end: one more scan, the termination passes, safe \
                  outputs.",
        remedy: "Nothing. `systemctl stop`, a shutdown, or Ctrl-C send one.",
    },
    Event {
        number: 9,
        name: "signal-again",
        level: Level::Warn,
        id: "673dfa38b8594a8aaa098a82af621739",
        limit: Limit::NONE,
        meaning: "A second signal came while rungd was stopping: it ended at once, and the \
                  termination passes may not have run.",
        remedy: "Send one signal, and wait. If one was not enough, see what kept the last scan.",
    },
    Event {
        number: 10,
        name: "drivers-late",
        level: Level::Warn,
        id: "9ca0d2e0f6b5493ca4d3e47c87690373",
        limit: Limit::NONE,
        meaning: "A driver did not end in time after the last scan, and was abandoned. The \
                  outputs of a device in trouble, or whose last write was under way, may be as \
                  they were.",
        remedy: "Look at the outputs of devices with a `device-trouble` before it. What else \
                 makes them safe is the device's own watchdog.",
    },
    Event {
        number: 11,
        name: "end-stuck",
        level: Level::Error,
        id: "aa6dc2fd22de441e8691d0de4520159a",
        limit: Limit::NONE,
        meaning: "The last scan did not end though a stop was asked for; the process ends \
                  without it.",
        remedy: "See what the machine was doing then. If it was idle, report it with the log.",
    },
    Event {
        number: 12,
        name: "bug",
        level: Level::Error,
        id: "24bb4febea72457ea4c03cb4b11d2d81",
        limit: Limit::NONE,
        meaning: "rungd met a state that cannot be: a bug in rungd, not in the ladder. If it was \
                  the scan thread's, outputs are safe and a mode-fault line follows.",
        remedy: "Restart it, and report the line with those around it.",
    },
    Event {
        number: 13,
        name: "restart-guard",
        level: Level::Warn,
        id: "75a3c77a9dc0444e97478306a5ba9b3b",
        limit: Limit::NONE,
        meaning: "rungd was killed, by the watchdog or otherwise, or crashed again and again \
                  without a healthy time between: it starts in STOP, and drives nothing.",
        remedy: "Find out why: the lines before each start, and what systemd says there. Then \
                 `rungd mode run`, or `systemctl restart rungd`.",
    },
    Event {
        number: 14,
        name: "restart-counted",
        level: Level::Warn,
        id: "d2f8388cd0ca4718b7b27e502a28298c",
        limit: Limit::NONE,
        meaning: "The process before this one was killed or crashed, and this start is counted: \
                  after too many without a healthy time between, rungd would start in STOP.",
        remedy: "Find out why it ended: the lines before this start, and `journalctl -u rungd -b` \
                 for what systemd says of it.",
    },
    Event {
        number: 15,
        name: "restart-guard-reset",
        level: Level::Info,
        id: "926a4b2701f8408c9ef2de24c0d19cf0",
        limit: Limit::NONE,
        meaning: "rungd has run well for long enough: restarts are counted anew.",
        remedy: "Nothing.",
    },
    Event {
        number: 16,
        name: "restart-guard-file",
        level: Level::Warn,
        id: "cb51828f845748b4a21b5d107a95ec07",
        limit: Limit::NONE,
        meaning: "The file that counts restarts cannot be read or written: they are not counted, \
                  or counted wrong. Nothing else suffers.",
        remedy: "Mend what the line names: RuntimeDirectory= in the unit, or the folder and its \
                 rights.",
    },
    Event {
        number: 101,
        name: "posture",
        level: Level::Info,
        id: "eba8e506e61546feb13242e4443b1887",
        limit: Limit::NONE,
        meaning: "What was asked of the machine for punctual scans, and what it granted.",
        remedy: "Nothing. Where granted is less than asked, posture-refused lines say why.",
    },
    Event {
        number: 102,
        name: "posture-refused",
        level: Level::Warn,
        id: "0a02aac7760e4e26956532e6b32dd2b0",
        limit: Limit::NONE,
        meaning: "The machine refused a part of the real-time posture; the line says which and \
                  why. Scans run, and may be less punctual.",
        remedy: "Grant it as docs/running.md says (limits in the unit, access to the device), or \
                 do not ask for it.",
    },
    Event {
        number: 201,
        name: "mode-run",
        level: Level::Info,
        id: "caa587f71c714fa5b065283473733a09",
        limit: Limit::PLANT,
        meaning: "The mode is RUN: scans begin, and outputs are driven from the end of the first \
                  complete one.",
        remedy: "Nothing.",
    },
    Event {
        number: 202,
        name: "mode-stop",
        level: Level::Info,
        id: "bc44a52dc10e4fa0aacfeb43264919ff",
        limit: Limit::PLANT,
        meaning: "The mode is STOP: every block had its termination pass, nothing is scanned, \
                  outputs are at their safe values. The line says who asked for it.",
        remedy: "If the ladder executed STOP, find out which condition it stands for before you \
                 run again: `rungd mode run`, or restart rungd.",
    },
    Event {
        number: 203,
        name: "mode-fault",
        level: Level::Error,
        id: "dade74f34ec04033844951228232d428",
        limit: Limit::PLANT,
        meaning: "The mode is FAULT: a scan took too long, did not end or did not come, or rungd \
                  has a bug. Nothing is scanned, outputs are at their safe values, no \
                  termination pass ran.",
        remedy: "Do what the line says. For a late scan: compare the mean in the heartbeats \
                 before with `[scan] watchdog`, and see what else the machine was doing.",
    },
    Event {
        number: 204,
        name: "mode-still",
        level: Level::Warn,
        id: "5965b9cbaedc47deae7920cf4b19e3b5",
        limit: Limit::NONE,
        meaning: "The STOP or FAULT told before still lasts. Repeated every minute.",
        remedy: "As for the mode-stop or mode-fault line that came first.",
    },
    Event {
        number: 205,
        name: "fault-scan-ended",
        level: Level::Info,
        id: "cbb786153e8140f084edddda42da4f26",
        limit: Limit::NONE,
        meaning: "The fault was called while the scan still went on; now it is over. It is not \
                  complete, and the mode stays FAULT.",
        remedy: "scan_us says how long it took: compare it with `[scan] watchdog`.",
    },
    Event {
        number: 206,
        name: "fault-thread-back",
        level: Level::Info,
        id: "9ea73fdc5ef04251ae3a0fa54427174c",
        limit: Limit::NONE,
        meaning: "The scan thread, missing when the fault was called, has come back. It does not \
                  scan, and the mode stays FAULT.",
        remedy: "The machine gave it no time: see what else ran, and the real-time posture.",
    },
];
