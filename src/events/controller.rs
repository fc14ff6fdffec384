//! Events of the controller itself: its process, its posture, its modes.

rows! {
    PROCESS_START = 1, "process-start", Info, NONE:
        "63f400b4263649a189afe95d4121598d",
        "rungd was started with this controller file.",
        "Nothing. If nobody started it, see the lines before: systemd restarts it after a crash \
         or a watchdog.";

    LADDER_LOADED = 2, "ladder-loaded", Info, NONE:
        "acf762f009b6413da17f3e3e35e693be",
        "The ladder was read and checked, and is what will be scanned.",
        "Nothing. To see whether it is the ladder you think it is, compare sha256 with `cat FILES \
         | sha256sum`.";

    LADDER_WARNINGS = 3, "ladder-warnings", Warn, NONE:
        "8a2bcbed1eb346efa818db97b660c9be",
        "The check of the ladder has warnings. It runs all the same.",
        "See them with `rungd check` and the controller file, and mend or allow each.";

    SIMULATED_DEVICE = 4, "simulated-device", Info, NONE:
        "1cf973db919f48e8810b922fbf72a8ad",
        "A simulated device moves inputs: this is no real plant.",
        "On a real plant, take the `[[simulated-device]]` tables out of the controller file.";

    PROCESS_END = 5, "process-end", Info, NONE:
        "61462cda98654a4cb1012be91dc1ab68",
        "rungd ends; the line says in which mode and after how many scans.",
        "Nothing, if it was asked to. The lines before say who asked.";

    START_REFUSED = 6, "start-refused", Error, NONE:
        "9dc8041a8e7540beb064d85df311782a",
        "rungd does not start; the line says why. Nothing was scanned.",
        "Mend what the line names, then start it again. `rungd check` tells beforehand whether a \
         controller file can be run.";

    FINDING = 7, "finding", Error, NONE:
        "5c6a8c016f8949fa88f2e0b59727966b",
        "A part of what is wrong with the ladder or the controller file: the findings line by \
         line, as `rungd check` prints them.",
        "Run `rungd check` with the controller file, and `rungd explain` with the finding's name.";

    SIGNAL = 8, "signal", Info, NONE:
        "f72011ec680a45859008e99bb0a307f9",
        "A signal asks for an orderly end: one more scan, the termination passes, safe outputs.",
        "Nothing. `systemctl stop`, a shutdown, or Ctrl-C send one.";

    SIGNAL_AGAIN = 9, "signal-again", Warn, NONE:
        "673dfa38b8594a8aaa098a82af621739",
        "A second signal came while rungd was stopping: it ended at once, and the termination \
         passes may not have run.",
        "Send one signal, and wait. If one was not enough, see what kept the last scan.";

    DRIVERS_LATE = 10, "drivers-late", Warn, NONE:
        "9ca0d2e0f6b5493ca4d3e47c87690373",
        "A driver did not end in time after the last scan, and was abandoned. The outputs of a \
         device in trouble, or whose last write was under way, may be as they were.",
        "Look at the outputs of devices with a `device-trouble` before it. What else makes them \
         safe is the device's own watchdog.";

    END_STUCK = 11, "end-stuck", Error, NONE:
        "aa6dc2fd22de441e8691d0de4520159a",
        "The last scan did not end though a stop was asked for; the process ends without it.",
        "See what the machine was doing then. If it was idle, report it with the log.";

    BUG = 12, "bug", Error, NONE:
        "24bb4febea72457ea4c03cb4b11d2d81",
        "rungd met a state that cannot be: a bug in rungd, not in the ladder. If it was the scan \
         thread's, outputs are safe and a mode-fault line follows.",
        "Restart it, and report the line with those around it.";

    RESTART_GUARD = 13, "restart-guard", Warn, NONE:
        "75a3c77a9dc0444e97478306a5ba9b3b",
        "rungd was killed, by the watchdog or otherwise, or crashed again and again without a \
         healthy time between: it starts in STOP, and drives nothing.",
        "Find out why: the lines before each start, and what systemd says there. Then `rungd mode \
         run`, or `systemctl restart rungd`.";

    RESTART_COUNTED = 14, "restart-counted", Warn, NONE:
        "d2f8388cd0ca4718b7b27e502a28298c",
        "The process before this one was killed or crashed, and this start is counted: after too \
         many without a healthy time between, rungd would start in STOP.",
        "Find out why it ended: the lines before this start, and `journalctl -u rungd -b` for \
         what systemd says of it.";

    RESTART_GUARD_RESET = 15, "restart-guard-reset", Info, NONE:
        "926a4b2701f8408c9ef2de24c0d19cf0",
        "rungd has run well for long enough: restarts are counted anew.",
        "Nothing.";

    RESTART_GUARD_FILE = 16, "restart-guard-file", Warn, NONE:
        "cb51828f845748b4a21b5d107a95ec07",
        "The file that counts restarts cannot be read or written: they are not counted, or \
         counted wrong. Nothing else suffers.",
        "Mend what the line names: RuntimeDirectory= in the unit, or the folder and its rights.";

    POSTURE = 101, "posture", Info, NONE:
        "eba8e506e61546feb13242e4443b1887",
        "What was asked of the machine for punctual scans, and what it granted.",
        "Nothing. Where granted is less than asked, posture-refused lines say why.";

    POSTURE_REFUSED = 102, "posture-refused", Warn, NONE:
        "0a02aac7760e4e26956532e6b32dd2b0",
        "The machine refused a part of the real-time posture; the line says which and why. Scans \
         run, and may be less punctual.",
        "Grant it as docs/running.md says (limits in the unit, access to the device), or do not \
         ask for it.";

    MODE_RUN = 201, "mode-run", Info, PLANT:
        "caa587f71c714fa5b065283473733a09",
        "The mode is RUN: scans begin, and outputs are driven from the end of the first complete \
         one.",
        "Nothing.";

    MODE_STOP = 202, "mode-stop", Info, PLANT:
        "bc44a52dc10e4fa0aacfeb43264919ff",
        "The mode is STOP: every block had its termination pass, nothing is scanned, outputs are \
         at their safe values. The line says who asked for it.",
        "If the ladder executed STOP, find out which condition it stands for before you run \
         again: `rungd mode run`, or restart rungd.";

    MODE_FAULT = 203, "mode-fault", Error, PLANT:
        "dade74f34ec04033844951228232d428",
        "The mode is FAULT: a scan took too long, did not end or did not come, or rungd has a \
         bug. Nothing is scanned, outputs are at their safe values, no termination pass ran.",
        "Do what the line says. For a late scan: compare the mean in the heartbeats before with \
         `[scan] watchdog`, and see what else the machine was doing.";

    MODE_STILL = 204, "mode-still", Warn, NONE:
        "5965b9cbaedc47deae7920cf4b19e3b5",
        "The STOP or FAULT told before still lasts. Repeated every minute.",
        "As for the mode-stop or mode-fault line that came first.";

    FAULT_SCAN_ENDED = 205, "fault-scan-ended", Info, NONE:
        "cbb786153e8140f084edddda42da4f26",
        "The fault was called while the scan still went on; now it is over. It is not complete, \
         and the mode stays FAULT.",
        "scan_us says how long it took: compare it with `[scan] watchdog`.";

    FAULT_THREAD_BACK = 206, "fault-thread-back", Info, NONE:
        "9ea73fdc5ef04251ae3a0fa54427174c",
        "The scan thread, missing when the fault was called, has come back. It does not scan, and \
         the mode stays FAULT.",
        "The machine gave it no time: see what else ran, and the real-time posture.";
}
