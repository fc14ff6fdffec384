//! Events of the controller itself: its process, its posture, its modes.

rows! {
    PROCESS_START = 1, "process-start", Info, NONE, Never:
        "63f400b4263649a189afe95d4121598d",
        "rungd started with this controller file.",
        "Nothing. If nobody started it, read the lines before it: systemd restarts rungd after a \
         crash or a watchdog.";

    LADDER_LOADED = 2, "ladder-loaded", Info, NONE, Never:
        "acf762f009b6413da17f3e3e35e693be",
        "The ladder was read and checked. rungd will scan it.",
        "Nothing. To make sure that it is the ladder you mean, compare sha256 with `cat FILES | \
         sha256sum`.";

    LADDER_WARNINGS = 3, "ladder-warnings", Warn, NONE, ByName:
        "8a2bcbed1eb346efa818db97b660c9be",
        "The check of the ladder has warnings. rungd runs the ladder all the same.",
        "Show the warnings with `rungd check` and the controller file. Correct or allow each.";

    SIMULATED_DEVICE = 4, "simulated-device", Info, NONE, Never:
        "1cf973db919f48e8810b922fbf72a8ad",
        "A simulated device moves inputs: no real plant is behind them.",
        "On a real plant, take the simulated parts out of the controller file.";

    PROCESS_END = 5, "process-end", Info, NONE, Never:
        "61462cda98654a4cb1012be91dc1ab68",
        "rungd ends. The line says in which mode, and after how many scans.",
        "Nothing, if somebody asked for the end: the lines before it name the signal or the \
         command.";

    START_REFUSED = 6, "start-refused", Error, NONE, Never:
        "9dc8041a8e7540beb064d85df311782a",
        "rungd does not start, for the reason in the line. Nothing was scanned.",
        "Correct what the line names, then start rungd again. `rungd check` reports beforehand \
         whether rungd can run a controller file.";

    FINDING = 7, "finding", Error, NONE, Never:
        "5c6a8c016f8949fa88f2e0b59727966b",
        "One line of the findings about the ladder or the controller file, as `rungd check` \
         prints them.",
        "Run `rungd check` with the controller file, and `rungd explain` with the finding's name.";

    SIGNAL = 8, "signal", Info, NONE, Never:
        "f72011ec680a45859008e99bb0a307f9",
        "A signal asks rungd to end in order: one more scan, the termination passes, safe \
         outputs.",
        "Nothing. `systemctl stop`, a shutdown and Ctrl-C send a signal.";

    SIGNAL_AGAIN = 9, "signal-again", Warn, NONE, Never:
        "673dfa38b8594a8aaa098a82af621739",
        "A second signal came while rungd was stopping. rungd ended at once; the termination \
         passes may not have run.",
        "Send one signal, and wait. If rungd does not end by itself, find what delayed the last \
         scan.";

    DRIVERS_LATE = 10, "drivers-late", Warn, NONE, Never:
        "9ca0d2e0f6b5493ca4d3e47c87690373",
        "A driver did not end in time after the last scan, and rungd ended without it. The outputs \
         of its device may be unchanged.",
        "Look at the outputs of each device that has a `device-trouble` line before this one. \
         Only the device's own watchdog makes them safe now.";

    END_STUCK = 11, "end-stuck", Error, NONE, Never:
        "aa6dc2fd22de441e8691d0de4520159a",
        "A stop was asked for, and the last scan did not end. The process ends without it.",
        "Find what the machine was doing at that time. If it was idle, report the line with the \
         log.";

    BUG = 12, "bug", Error, NONE, Never:
        "24bb4febea72457ea4c03cb4b11d2d81",
        "rungd reached an impossible state: a bug in rungd, not in the ladder. If the bug was in \
         the scan thread, outputs are safe and a mode-fault line follows.",
        "Restart rungd. Report the line with the lines around it.";

    RESTART_GUARD = 13, "restart-guard", Warn, NONE, Never:
        "75a3c77a9dc0444e97478306a5ba9b3b",
        "rungd crashed or was killed several times, and never ran long enough in between to count \
         as healthy. It starts in STOP, and drives nothing.",
        "Find the cause in the lines before each start, and in what systemd says there. Then \
         `rungd mode run`, or `systemctl restart rungd`. If `cold-start = \"stop\"` finds nothing \
         to restore, a restart waits in STOP as well.";

    RESTART_COUNTED = 14, "restart-counted", Warn, NONE, Never:
        "d2f8388cd0ca4718b7b27e502a28298c",
        "The process before this one crashed or was killed, and rungd counts this start. After \
         too many such starts without a healthy run in between, rungd would start in STOP.",
        "Find the cause in the lines before this start, and in what systemd says: `journalctl -u \
         rungd -b`.";

    RESTART_GUARD_RESET = 15, "restart-guard-reset", Info, NONE, ByName:
        "926a4b2701f8408c9ef2de24c0d19cf0",
        "rungd has run long enough to count as healthy. The count of restarts begins at 0 again.",
        "Nothing.";

    RESTART_GUARD_FILE = 16, "restart-guard-file", Warn, NONE, ByName:
        "cb51828f845748b4a21b5d107a95ec07",
        "rungd cannot read or write the file that counts restarts. Restarts are not counted, or \
         the count is wrong. Nothing else is affected.",
        "Correct what the line names: `RuntimeDirectory=` in the unit, or the folder and its \
         rights.";

    TIME_ZONE = 17, "time-zone", Warn, NONE, ByName:
        "14ed3928923b4640abfa469118e2be6f",
        "The time zone of TZ, or of /etc/localtime, cannot be read. The ladder's time of day \
         ($Year to $Second), and the log's time if that is local, keep the zone that was read \
         before, or are UTC. Nothing else depends on it.",
        "Set TZ to a name such as Europe/Berlin whose file is in /usr/share/zoneinfo, or let \
         /etc/localtime be such a file. rungd looks again every second.";

    START_WAITS = 18, "start-waits", Warn, NONE, Never:
        "ea2392f6c67f4f7e8b9947329cb94e50",
        "The start has waited for seconds for what the line names: a disk that does not answer, or \
         a very long file. No scan comes before, no device is driven, and `rungd status` finds no \
         controller. systemd gets a request for more time. A signal ends the wait.",
        "A disk or a share on the network: find why it does not answer (`dmesg`, `findmnt`, \
         `cat /proc/mounts`), and make it answer; rungd goes on by itself. A long file: nothing, \
         or split the ladder.";

    START_GOES_ON = 19, "start-goes-on", Info, NONE, Never:
        "6e24a68f6cc7475e947a08ed99888c85",
        "What the start waited for is there.",
        "Nothing, if it does not repeat.";

    POSTURE = 101, "posture", Info, NONE, ByName:
        "eba8e506e61546feb13242e4443b1887",
        "What rungd requested from the machine for punctual scans, and what the machine granted.",
        "Nothing. If the machine granted less, posture-refused lines say why.";

    POSTURE_REFUSED = 102, "posture-refused", Warn, NONE, ByName:
        "0a02aac7760e4e26956532e6b32dd2b0",
        "The machine refused a part of the real-time posture. The line says which part and why. \
         Scans run, and may be less punctual.",
        "Grant it as docs/running.md says (limits in the unit, access to the device), or do not \
         request it in the controller file.";

    FAULT_TOO_LATE = 103, "fault-too-late", Warn, NONE, Never:
        "20eacd9e80e545009f211e0da7143f66",
        "systemd ends rungd before a scan that is too long becomes a fault: `[scan] watchdog` is \
         more than three quarters of the unit's `WatchdogSec=`. Only the devices' own watchdogs \
         and the next start make the outputs safe then.",
        "Lower `[scan] watchdog`, or raise `WatchdogSec=` in the unit.";

    MODE_RUN = 201, "mode-run", Info, PLANT, Never:
        "caa587f71c714fa5b065283473733a09",
        "The mode is RUN: scans begin. Outputs are driven from the end of the first complete \
         scan.",
        "Nothing.";

    MODE_STOP = 202, "mode-stop", Info, PLANT, Never:
        "bc44a52dc10e4fa0aacfeb43264919ff",
        "The mode is STOP: every block had its termination pass, nothing is scanned, outputs are \
         at their safe values. The line says what caused the STOP.",
        "If the ladder executed STOP, find out which condition caused it before you run the \
         controller again: `rungd mode run`, or restart rungd. If `cold-start = \"stop\"` finds \
         nothing to restore, a restart waits in STOP as well.";

    MODE_FAULT = 203, "mode-fault", Error, PLANT, Never:
        "dade74f34ec04033844951228232d428",
        "The mode is FAULT: a scan took too long, did not end or did not begin, or rungd has a \
         bug. Nothing is scanned, outputs are at their safe values, no termination pass ran.",
        "Do what the line says. After a late scan, compare scan_us_mean of the heartbeats before \
         it with `[scan] watchdog`, and find what else the machine was doing.";

    MODE_STILL = 204, "mode-still", Warn, NONE, Never:
        "5965b9cbaedc47deae7920cf4b19e3b5",
        "The controller is still in STOP or FAULT. The line comes every minute.",
        "Do what the mode-stop or mode-fault line before it says.";

    FAULT_SCAN_ENDED = 205, "fault-scan-ended", Info, NONE, Never:
        "cbb786153e8140f084edddda42da4f26",
        "The scan that caused the FAULT has ended. It is not complete, and the mode stays FAULT.",
        "Compare scan_us, the time that the scan took, with `[scan] watchdog`.";

    FAULT_THREAD_BACK = 206, "fault-thread-back", Info, NONE, Never:
        "9ea73fdc5ef04251ae3a0fa54427174c",
        "The scan thread, whose absence caused the FAULT, is back. It does not scan, and the mode \
         stays FAULT.",
        "The machine gave the thread no time: find what else ran, and look at the real-time \
         posture.";
}
