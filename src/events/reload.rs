//! Events of reloads: RUNGD-10xx.

use super::{Event, Level, Limit};

pub(super) const EVENTS: &[Event] = &[
    Event {
        number: 1001,
        name: "reload-done",
        level: Level::Info,
        id: "61fdf8cbafd74dd58874156b12b46427",
        limit: Limit::NONE,
        meaning: "The controller read its files anew, and goes on with another program without \
                  a stop. reload-difference lines before it say what was kept, new and gone.",
        remedy: "Nothing. Within the probation a fault takes it back; `rungd rollback` does \
                 so by hand.",
    },
    Event {
        number: 1002,
        name: "reload-difference",
        level: Level::Info,
        id: "04886ed9dd7743a388d5c865ac71a8f5",
        limit: Limit::PLANT,
        meaning: "One difference between the program before a reload (or rollback) and the one \
                  after it.",
        remedy: "Nothing. `rungd reload --dry-run` prints the same beforehand.",
    },
    Event {
        number: 1003,
        name: "reload-refused",
        level: Level::Error,
        id: "92b5cbad520a444eb4e445544a6a0d6b",
        limit: Limit::NONE,
        meaning: "A reload or rollback was asked for and is not done: the program that ran \
                  goes on untouched. Where files are wrong, it names the first error, and the \
                  reload-finding lines behind it say all.",
        remedy: "Mend what the lines name (`rungd check`), and reload again.",
    },
    Event {
        number: 1004,
        name: "reload-restart",
        level: Level::Warn,
        id: "7e005d8a475545f28d893e7c5bf1b951",
        limit: Limit::NONE,
        meaning: "The controller file says something new that a reload does not apply: it is \
                  as it was at the start.",
        remedy: "Restart rungd when the plant allows it.",
    },
    Event {
        number: 1005,
        name: "reload-proved",
        level: Level::Info,
        id: "75b84215efdc403185496685fbba2905",
        limit: Limit::NONE,
        meaning: "The reloaded program has run for its probation without a fault. From here on \
                  a fault does not take it back.",
        remedy: "Nothing.",
    },
    Event {
        number: 1006,
        name: "rolled-back",
        level: Level::Warn,
        id: "7903d68a24644c03892b8cf735bf8eb5",
        limit: Limit::NONE,
        meaning: "The program before the last reload is back, with memory as it is: since the \
                  new one faulted within its probation (then it goes on in RUN), or because an \
                  operator asked for it (then the mode stays: out of FAULT `rungd mode run` is \
                  next).",
        remedy: "Mend the files: they still hold the program that was taken back, and a \
                 restart would run it.",
    },
    Event {
        number: 1007,
        name: "rollback-failed",
        level: Level::Error,
        id: "6856386cfd10417481ad22b0b25a7d7d",
        limit: Limit::NONE,
        meaning: "A program faulted within its probation, and the one before it could not be \
                  put back yet. It is tried again, but not behind a bug in the engine.",
        remedy: "See the mode-fault line before; where the scan thread does not come back, \
                 restart rungd with the old files.",
    },
    Event {
        number: 1008,
        name: "program-swapped",
        level: Level::Debug,
        id: "960c7400bc294443a8b2d8ff05594384",
        limit: Limit::NONE,
        meaning: "The scan thread has swapped programs between two scans; swap_us is how long \
                  that took.",
        remedy: "Nothing.",
    },
    Event {
        number: 1009,
        name: "reload-same",
        level: Level::Info,
        id: "ba15168d27024a8bbfe54a83c5f7c210",
        limit: Limit::NONE,
        meaning: "A reload was asked for, and the files are those that run already: nothing was \
                  swapped, and the way back is as it was.",
        remedy: "Nothing. If something was to change, look whether the edited files are those \
                 that the controller file names.",
    },
    Event {
        number: 1010,
        name: "reload-warning",
        level: Level::Warn,
        id: "beaf937d54fe4230bfbba28539a97f17",
        limit: Limit::PLANT,
        meaning: "A difference between the program before a reload (or rollback) and the one \
                  after it that wants a look: a tag has another address now, and the value that \
                  it had stays at the old one.",
        remedy: "See whether the value at the new address is the one that is meant: `rungd read` \
                 shows it, `rungd write` puts another one there.",
    },
    Event {
        number: 1011,
        name: "reload-finding",
        level: Level::Info,
        id: "65a7d5150e824638a1fdb4d9372094ce",
        limit: Limit::NONE,
        meaning: "A part of what is wrong with the files of a reload that was refused: the \
                  findings of `rungd check`, line by line, behind reload-refused.",
        remedy: "Mend what the lines name; `rungd explain NAME` says more about a finding by its \
                 name.",
    },
];
