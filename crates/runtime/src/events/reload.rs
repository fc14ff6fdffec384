//! Events of reloads: RUNGD-10xx.

rows! {
    RELOAD_DONE = 1001, "reload-done", Info, NONE, Never:
        "61fdf8cbafd74dd58874156b12b46427",
        "The controller read its files again, and runs the new program without a stop. The \
         reload-difference lines before it say what was kept, what is new and what is gone.",
        "Nothing. A fault within the probation brings the old program back; `rungd rollback` does \
         so by hand.";

    RELOAD_DIFFERENCE = 1002, "reload-difference", Info, PLANT, Never:
        "04886ed9dd7743a388d5c865ac71a8f5",
        "One difference between the program before a reload or rollback and the program after it.",
        "Nothing. `rungd reload --dry-run` prints the same beforehand.";

    RELOAD_REFUSED = 1003, "reload-refused", Error, NONE, Never:
        "92b5cbad520a444eb4e445544a6a0d6b",
        "A reload or rollback was refused: the running program continues unchanged. If the files \
         are wrong, the line has the first error, and the reload-finding lines after it have all \
         findings.",
        "Correct what the lines name (`rungd check`), and reload again.";

    RELOAD_RESTART = 1004, "reload-restart", Warn, NONE, Never:
        "7e005d8a475545f28d893e7c5bf1b951",
        "The controller file has a change that a reload does not apply. The setting stays as it \
         was at the start.",
        "Restart rungd when the plant allows it.";

    RELOAD_PROVED = 1005, "reload-proved", Info, NONE, Never:
        "75b84215efdc403185496685fbba2905",
        "The reloaded program has run for its probation without a fault. From now on a fault does \
         not bring the old program back.",
        "Nothing.";

    ROLLED_BACK = 1006, "rolled-back", Warn, NONE, Never:
        "7903d68a24644c03892b8cf735bf8eb5",
        "The last program before the running one that passed its probation is back, with memory as \
         it is. Either the new program faulted within its probation: then the controller continues \
         in RUN. Or an operator requested it: then the mode stays, and `rungd mode run` leaves \
         FAULT.",
        "Correct the files: they still contain the program that was taken back, and a restart \
         would run it.";

    ROLLBACK_FAILED = 1007, "rollback-failed", Error, NONE, Never:
        "6856386cfd10417481ad22b0b25a7d7d",
        "A program faulted within its probation, and rungd could not put the program before it \
         back. rungd tries again, but not after a bug in the engine.",
        "See the mode-fault line before it. If the scan thread does not come back, restart rungd \
         with the old files.";

    PROGRAM_SWAPPED = 1008, "program-swapped", Debug, NONE, ByName:
        "960c7400bc294443a8b2d8ff05594384",
        "The scan thread swapped programs between two scans; swap_us says how long the swap took.",
        "Nothing.";

    RELOAD_SAME = 1009, "reload-same", Info, NONE, Never:
        "ba15168d27024a8bbfe54a83c5f7c210",
        "A reload was asked for, and the files are unchanged. Nothing was swapped, and a rollback \
         has the same target as before.",
        "Nothing. If you expected a change, check that the files you edited are those that the \
         controller file names.";

    RELOAD_WARNING = 1010, "reload-warning", Warn, PLANT, Never:
        "beaf937d54fe4230bfbba28539a97f17",
        "A difference between the program before a reload or rollback and the program after it \
         that needs attention: a tag has a new address, and its value stays at the old address.",
        "See whether the value at the new address is the right one: `rungd read` shows it, `rungd \
         write` changes it.";

    RELOAD_FINDING = 1011, "reload-finding", Info, NONE, Never:
        "65a7d5150e824638a1fdb4d9372094ce",
        "One line of the findings about the files of a refused reload, as `rungd check` prints \
         them. It follows a reload-refused line.",
        "Correct what the line names; `rungd explain NAME` says more about a finding by its name.";
}
