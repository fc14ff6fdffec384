//! Events of retentive memory.

use super::{Event, Level, Limit};

pub(super) const EVENTS: &[Event] = &[
    Event {
        number: 901,
        name: "retain-restored",
        level: Level::Info,
        id: "f298a90a2f8b4814a746ba6602018a5a",
        limit: Limit::NONE,
        meaning: "Retentive memory was found and restored before the first scan; the line says \
                  how much, of which scan, and whether an orderly stop came before.",
        remedy: "Nothing. Where something was not restored, retain-dropped lines say what and why.",
    },
    Event {
        number: 902,
        name: "retain-cold",
        level: Level::Error,
        id: "35b3e9c2ba6c4a418344b0cdc585441f",
        limit: Limit::NONE,
        meaning: "Retentive memory is asked for, and nothing was found that could be restored: \
                  memory is as after a cold start. Unless `[retain] cold-start` lets it run, the \
                  mode is STOP.",
        remedy: "At the very first start: `rungd mode run`. Later: find out where the file is \
                 (a disk that is not mounted, another `file`), or which tags had other names (the \
                 retain-dropped lines before it; the image stays until the next run), put \
                 right by hand what counts, then `rungd mode run`.",
    },
    Event {
        number: 903,
        name: "retain-dropped",
        level: Level::Warn,
        id: "ee6501b3734044af8945b154452a478e",
        limit: Limit::NONE,
        meaning: "Something in the file of retentive memory was given to nothing, since the \
                  program has changed; the line says what and why.",
        remedy: "If its value is still wanted: start the former ladder once more, read it, and \
                 write it by hand. The file keeps it until the first images of the new one are \
                 written.",
    },
    Event {
        number: 904,
        name: "retain-slot",
        level: Level::Warn,
        id: "5f077a522e094fcc814362dd6113d182",
        limit: Limit::NONE,
        meaning: "A slot of the file of retentive memory holds no whole image, and was passed \
                  over. Behind a power cut that is as it should be: the image before it counts.",
        remedy: "Nothing behind a power cut. If it comes without one, the disk may be failing.",
    },
    Event {
        number: 905,
        name: "retain-aside",
        level: Level::Warn,
        id: "5f8eea8800eb40ec8092152214785ac0",
        limit: Limit::NONE,
        meaning: "Where retentive memory is to be kept lay a file that is foreign, damaged, or of \
                  a later rungd. It was given another name, and not written over.",
        remedy: "If it is memory of a later rungd, run that one. Else delete it once nobody needs \
                 it.",
    },
    Event {
        number: 906,
        name: "retain-made",
        level: Level::Info,
        id: "efa3805980f646e5bc49a6bc27ba2630",
        limit: Limit::NONE,
        meaning: "A new file for retentive memory was made, in full.",
        remedy: "Nothing.",
    },
    Event {
        number: 907,
        name: "retain-failed",
        level: Level::Error,
        id: "47dfd9b13c864d98bfd923e10af6de7a",
        limit: Limit::NONE,
        meaning: "Retentive memory cannot be written: scans go on, and a restart would restore \
                  the last image that is durable. Repeated every minute while it lasts.",
        remedy: "Do what the line says: room on the disk, the rights of the directory, a disk that \
                 fails, `[retain] file`.",
    },
    Event {
        number: 908,
        name: "retain-recovered",
        level: Level::Info,
        id: "b9355878ccde4d43b268f300c30b4886",
        limit: Limit::NONE,
        meaning: "Retentive memory is written again.",
        remedy: "Nothing.",
    },
    Event {
        number: 909,
        name: "retain-slow",
        level: Level::Warn,
        id: "ea6e9a91a7b1498195e7cc2cef3ca29c",
        limit: Limit::NONE,
        meaning: "It took longer than the interval until an image was durable: a power cut could \
                  have cost as much.",
        remedy: "See what else writes to that disk, or put the file on another.",
    },
    Event {
        number: 910,
        name: "retain-wear",
        level: Level::Warn,
        id: "4b0780c927e54c27b7123c06f3b9793f",
        limit: Limit::NONE,
        meaning: "As it goes now, more bytes a day are written for retentive memory than \
                  `[retain] budget-mb-per-day` allows.",
        remedy: "Choose a longer `interval`, retain less, or keep what changes at every scan out \
                 of the ranges. If the disk takes it, raise the budget.",
    },
    Event {
        number: 911,
        name: "retain-final",
        level: Level::Info,
        id: "da82d693a2974613a214e2ec53f99d74",
        limit: Limit::NONE,
        meaning: "The last image is durable: the next start restores what memory held at the end.",
        remedy: "Nothing.",
    },
    Event {
        number: 912,
        name: "retain-lost",
        level: Level::Error,
        id: "46e81725e0dc4fae936f481ab9e1f494",
        limit: Limit::NONE,
        meaning: "rungd ends, and its last image is not durable: the next start restores the one \
                  before.",
        remedy: "See the line for why; after the next start, put right what counts.",
    },
    Event {
        number: 913,
        name: "retain-saved",
        level: Level::Info,
        id: "1b7f40ec1278449e92f3250f7dac06e6",
        limit: Limit::CLIENTS,
        meaning: "An operator had retentive memory kept, and it is durable.",
        remedy: "Nothing.",
    },
];
