//! Events of reloads: RUNGD-10xx.

rows! {
    RELOAD_DONE = 1001, "reload-done", Info, NONE:
        "61fdf8cbafd74dd58874156b12b46427",
        "The controller read its files anew, and goes on with another program without a stop. \
         reload-difference lines before it say what was kept, new and gone.",
        "Nothing. Within the probation a fault takes it back; `rungd rollback` does so by hand.";

    RELOAD_DIFFERENCE = 1002, "reload-difference", Info, PLANT:
        "04886ed9dd7743a388d5c865ac71a8f5",
        "One difference between the program before a reload (or rollback) and the one after it.",
        "Nothing. `rungd reload --dry-run` prints the same beforehand.";

    RELOAD_REFUSED = 1003, "reload-refused", Error, NONE:
        "92b5cbad520a444eb4e445544a6a0d6b",
        "A reload or rollback was asked for and is not done: the program that ran goes on \
         untouched. Where files are wrong, it names the first error, and the reload-finding lines \
         behind it say all.",
        "Mend what the lines name (`rungd check`), and reload again.";

    RELOAD_RESTART = 1004, "reload-restart", Warn, NONE:
        "7e005d8a475545f28d893e7c5bf1b951",
        "The controller file says something new that a reload does not apply: it is as it was at \
         the start.",
        "Restart rungd when the plant allows it.";

    RELOAD_PROVED = 1005, "reload-proved", Info, NONE:
        "75b84215efdc403185496685fbba2905",
        "The reloaded program has run for its probation without a fault. From here on a fault \
         does not take it back.",
        "Nothing.";

    ROLLED_BACK = 1006, "rolled-back", Warn, NONE:
        "7903d68a24644c03892b8cf735bf8eb5",
        "The program before the last reload is back, with memory as it is: since the new one \
         faulted within its probation (then it goes on in RUN), or because an operator asked for \
         it (then the mode stays: out of FAULT `rungd mode run` is next).",
        "Mend the files: they still hold the program that was taken back, and a restart would run \
         it.";

    ROLLBACK_FAILED = 1007, "rollback-failed", Error, NONE:
        "6856386cfd10417481ad22b0b25a7d7d",
        "A program faulted within its probation, and the one before it could not be put back yet. \
         It is tried again, but not behind a bug in the engine.",
        "See the mode-fault line before; where the scan thread does not come back, restart rungd \
         with the old files.";

    PROGRAM_SWAPPED = 1008, "program-swapped", Debug, NONE:
        "960c7400bc294443a8b2d8ff05594384",
        "The scan thread has swapped programs between two scans; swap_us is how long that took.",
        "Nothing.";

    RELOAD_SAME = 1009, "reload-same", Info, NONE:
        "ba15168d27024a8bbfe54a83c5f7c210",
        "A reload was asked for, and the files are those that run already: nothing was swapped, \
         and the way back is as it was.",
        "Nothing. If something was to change, look whether the edited files are those that the \
         controller file names.";

    RELOAD_WARNING = 1010, "reload-warning", Warn, PLANT:
        "beaf937d54fe4230bfbba28539a97f17",
        "A difference between the program before a reload (or rollback) and the one after it that \
         wants a look: a tag has another address now, and the value that it had stays at the old \
         one.",
        "See whether the value at the new address is the one that is meant: `rungd read` shows \
         it, `rungd write` puts another one there.";

    RELOAD_FINDING = 1011, "reload-finding", Info, NONE:
        "65a7d5150e824638a1fdb4d9372094ce",
        "A part of what is wrong with the files of a reload that was refused: the findings of \
         `rungd check`, line by line, behind reload-refused.",
        "Mend what the lines name; `rungd explain NAME` says more about a finding by its name.";
}
