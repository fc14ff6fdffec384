//! Events of the plant and of the scan: alarms, tags, blocks, overruns, the heartbeat, the log.

rows! {
    ALARM_ON = 301, "alarm-on", Warn, NONE, Never:
        "cee4db88c3f24fe387a305e32f579a42",
        "A bit that the ladder declares as an alarm went ON, or a line of `[[watch]]` does \
         not hold. The text is the alarm's text in the ladder or in the controller file.",
        "Do what the plant's instructions say for this alarm. An alarm-off line with the same tag \
         reports the end of the alarm.";

    ALARM_OFF = 302, "alarm-off", Info, NONE, Never:
        "50a22ea57cb7432995254fcf6c4e3728",
        "The alarm is over; lasted_ms says how long it stood.",
        "Nothing.";

    TAG_ON = 303, "tag-on", Info, PLANT, ByName:
        "ac6a8e0c937a48b38ce0234cc416a999",
        "A bit with `log = \"change\"` went ON.",
        "Nothing.";

    TAG_OFF = 304, "tag-off", Info, PLANT, ByName:
        "a685c68d90c54d799a44985e92302f3e",
        "A bit with `log = \"change\"` went OFF; lasted_ms says how long it was ON.",
        "Nothing.";

    TAG_VALUE = 305, "tag-value", Info, PLANT, ByName:
        "9ccf74aed5614ff8a74b51d001ee7055",
        "A word with `log = \"change\"` changed its value: from and to.",
        "Nothing.";

    ALARM_UNSHELVED = 306, "alarm-unshelved", Info, PLANT, Never:
        "2bcada23b73043bca0d632bc5c2cf992",
        "A shelved alarm is back, or one that was out of service, without a request: its time is \
         over, or the program does not have it, or calls it critical.",
        "If the alarm stands: care for it, and acknowledge it. It can be shelved again.";

    BLOCK_STARTED = 401, "block-started", Info, PLANT, ByBlocks:
        "274eb387ce934a6dbb53a814a9bfda4e",
        "A Program or Task was started. Built-in Tasks are logged at level debug.",
        "Nothing.";

    BLOCK_STOPPED = 402, "block-stopped", Info, PLANT, ByBlocks:
        "554f5447fa704ace882645180f9b85db",
        "A Program or Task was stopped, by HALT, by RESTART or by a STOP of the controller.",
        "Nothing.";

    BLOCK_COMPLETED = 403, "block-completed", Info, PLANT, ByBlocks:
        "ef06f65e3e8e491b90197ff77ddea4bd",
        "A Program or Task completed by itself.",
        "Nothing.";

    STAGE_ON = 404, "stage-on", Info, PLANT, ByStages:
        "ca58370959f34ab185c1534a5dea3bb5",
        "A Stage went ON: its rungs are executed.",
        "Nothing.";

    STAGE_OFF = 405, "stage-off", Info, PLANT, ByStages:
        "e20be995a1fd4141871a71d68c7c2149",
        "A Stage went OFF. Its termination pass follows.",
        "Nothing.";

    TERMINATION_PASS = 406, "termination-pass", Info, PLANT, ByBlocks:
        "5b319003fe274492be11718593e5cebe",
        "A Program, Task or Stage that ended had its termination pass: its coils went OFF, and \
         its timers and counters were reset as docs/semantics.md says.",
        "Nothing.";

    MATH_MISHAP = 407, "math-mishap", Warn, PLANT, ByName:
        "ff392c16e7b4435ebc100217196062d9",
        "A MATH divided by 0, had a result at a limit or called a function outside its domain, or \
         an instruction had an index outside of its array. bits names the status bits that are ON \
         for the rest of the scan, rung has the instruction. At most 16 instructions of a scan are \
         logged.",
        "Look at the operands of the rung: `rungd watch` shows them. If it is intended, limit them \
         first with clamp(), max() or if().";

    OVERRUN = 501, "overrun", Warn, NONE, Never:
        "78491505164848b0b17a011d48673fdd",
        "A scan did not end before the next grid point, and grid points passed without a scan. \
         The line says whether the scan was long or the machine woke the scan thread late.",
        "If late: look at the real-time posture, and at what else the machine runs. If long, and \
         scan_us_mean of the heartbeat is near the period: raise `[scan] period`.";

    HEARTBEAT = 502, "heartbeat", Info, NONE, ByName:
        "37b8bedd8fe9453d8eec0bf720c149f3",
        "A sign of life, with the statistics since the line before: mode, scans, execution times, \
         lateness, forces, and how many lines the log lost since the start. It comes every `[log] \
         statistics`.",
        "Nothing. Watch overruns, and scan_us_max against the watchdog.";

    STATISTICS = 503, "statistics", Info, NONE, ByName:
        "85d0693e140c4a5093ba89d7d93eb148",
        "The scan statistics since RUN was last entered. The line comes at the end of the \
         process.",
        "Nothing.";

    LINES_WITHHELD = 601, "lines-withheld", Warn, NONE, Never:
        "0d214eebad0c479cb3d56e91ac093e77",
        "Lines of one event came more often than its limit allows. The log left some out: \
         withheld names the event, lines says how many.",
        "Find what chatters: a bouncing sensor, a client in a loop. At level debug the log leaves \
         out lines of alarms only.";

    LOG_DROPPED = 602, "log-dropped", Warn, NONE, Never:
        "29bc791452d949638c791b845bad29d1",
        "The log could not be written, or was read too slowly. The log lost lines; lines says how \
         many. No scan waited for the log.",
        "Find out whether the journal or the disk was stuck or full. The lost lines are nowhere \
         else.";

    RECORDS_DROPPED = 603, "records-dropped", Warn, NONE, Never:
        "2e90653c20b045339ee6a73920011a0f",
        "More happened in the ladder than the scan thread could hand over. The log lost records; \
         records says how many. No scan waited.",
        "Nothing for the plant. Give `log = \"change\"` to fewer tags.";

    EVENTS_LOST = 604, "events-lost", Warn, CLIENTS, Never:
        "72d6a9c4ba7646179e43905e967b8b74",
        "In one scan more happened to Programs, Tasks, Stages and MATHs than the scan thread can \
         hand over. The log lost events; events says how many.",
        "Nothing for the plant: all of it was executed.";

    ALARM_FILE = 605, "alarm-file", Warn, PLANT, Never:
        "bfb4458eb4884e358bf0008c33dd8e52",
        "The file that keeps shelves and acknowledgements over a restart is damaged, or cannot be \
         read or written. The controller runs. A damaged file is renamed.",
        "See the reason: the disk, or the rights of the folder. Shelve alarms again if they are to \
         be shelved.";

    LOG_CHAIN = 606, "log-chain", Info, NONE, Never:
        "5833c0fc90b247f286066899d2b7723d",
        "The lines of the audit trail are chained, as RUNGD_LOG_CHAIN asks for: the line says \
         whether a chain begins, or goes on behind that of the last start. At level error, the \
         trail is not chained, or its newest link is not kept; the line has the reason.",
        "Copy the newest link elsewhere from time to time; `rungd audit --verify` judges the \
         trail. If it is not chained, correct the file that RUNGD_LOG_CHAIN names, and restart.";
}
