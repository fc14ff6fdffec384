//! Events of the scan log.

rows! {
    RECORD_BEGINS = 1201, "record-begins", Info, NONE, ByName:
        "1f0f3c5d6ab94f0e8f3e8f4c55a0c1d7",
        "rungd records the inputs of the controller, scan by scan, in the folder that the line \
         names.",
        "Nothing. `rungd record list` shows what is there; `rungd why` and `rungd replay` read it.";

    RECORD_FAILED = 1202, "record-failed", Error, NONE, Never:
        "8a4b1d7c93e2465fb1c7d2a95e6f7083",
        "The scan log cannot be written. Scans continue, and the last minute stays in memory; the \
         scans from now on are missing on disk. The line comes every minute while the trouble \
         lasts.",
        "Do what the line says: free room on the disk, correct the rights of the folder, replace a \
         disk that fails, stop another rungd of the same name, change `[record] dir`. rungd tries \
         again by itself.";

    RECORD_RESUMED = 1203, "record-resumed", Info, NONE, Never:
        "c2d5e8f1a40b4b6f9d3a7e60b8c91f24",
        "The scan log is written again. The line says how long nothing was recorded.",
        "Nothing. The gap shows in `rungd record list`.";

    RECORD_LOST = 1204, "record-lost", Warn, CLIENTS, Never:
        "5be0a9c7d8134e21a6f4b3c2d1e09f78",
        "The thread of the scan log was late, and scans are missing in it. Control was not \
         affected: the scan thread does not wait for the scan log. The gap is marked, and nothing \
         is invented.",
        "If it repeats: the machine has too little time for ordinary threads, or too much comes \
         in at every scan.";

    RECORD_BEHIND = 1205, "record-behind", Warn, NONE, Never:
        "7e1d52b3c8f04a6a9b30d4f6a1c7e285",
        "The disk needs seconds to make the scan log durable, and the copy on it is more than five \
         seconds behind. Nothing is lost: the scans wait in memory, `rungd status` shows how far \
         the copy is behind, and an orderly stop writes all of them. A power cut would cost as \
         much.",
        "If it repeats: find what keeps the disk busy (`iostat -x 1`), or change `[record] dir` to \
         a faster disk.";

    RECORD_CAUGHT_UP = 1206, "record-caught-up", Info, NONE, Never:
        "b94c07e6d1a84f5c8e2f63a0d7b51c94",
        "The copy of the scan log on the disk is complete again, up to the last second. The line \
         says how far it was behind.",
        "Nothing.";

    RECORD_FILE_GONE = 1207, "record-file-gone", Warn, NONE, Never:
        "3f8a6d20b7c94e1d95e0c2f4817ab63e",
        "Somebody removed, renamed or replaced the file that the scan log was written to, or its \
         folder. rungd begins a new file. The scans in a removed file are lost; the last minute \
         stays in memory.",
        "Leave the newest file in the folder alone: `[record] keep` and `size` limit the folder, \
         and `rungd record cut` copies a part of it.";

    RECORD_ENDS = 1208, "record-ends", Info, NONE, Never:
        "d06b9f14e5c347a2b1c8a7e93f60d258",
        "rungd ends, and its disk needs more than a second for the last scans of the scan log. The \
         end waits for them, up to a minute; the second line says how long it took.",
        "Nothing. `TimeoutStopSec=` of a service must be longer than a minute.";
}
