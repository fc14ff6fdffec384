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
}
