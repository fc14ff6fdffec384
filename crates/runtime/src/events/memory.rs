//! Events of retentive memory.

rows! {
    RETAIN_RESTORED = 901, "retain-restored", Info, NONE, Never:
        "f298a90a2f8b4814a746ba6602018a5a",
        "rungd found retentive memory and restored it before the first scan. The line says how \
         much, of which scan, and whether the controller had stopped in order.",
        "Nothing. If something was not restored, retain-dropped lines say what and why.";

    RETAIN_COLD = 902, "retain-cold", Error, NONE, Never:
        "35b3e9c2ba6c4a418344b0cdc585441f",
        "Retentive memory is configured, and rungd found nothing to restore: memory is as after a \
         cold start. The mode is STOP, unless `[retain] cold-start` lets the controller run.",
        "At the very first start: `rungd mode run`. Later: find out where the file is (a disk that \
         is not mounted, a changed `file`), or which tags had other names (the retain-dropped \
         lines before it; the file keeps the image until the next run). Force the important \
         values, `rungd mode run`, then unforce them: a controller in STOP refuses `write`.";

    RETAIN_DROPPED = 903, "retain-dropped", Warn, NONE, Never:
        "ee6501b3734044af8945b154452a478e",
        "The program changed, and has no place for something in the file of retentive memory. The \
         line says what and why.",
        "If you still want the value: start the former ladder once more, read the value, and \
         write it by hand. The file keeps it until the first images of the new ladder are written.";

    RETAIN_SLOT = 904, "retain-slot", Warn, NONE, ByName:
        "5f077a522e094fcc814362dd6113d182",
        "A slot in the file of retentive memory holds no whole image. rungd skipped it, and used \
         the newest whole image.",
        "Nothing after a power cut, which leaves such a slot. Without a power cut, the disk may \
         be failing.";

    RETAIN_ASIDE = 905, "retain-aside", Warn, NONE, Never:
        "5f8eea8800eb40ec8092152214785ac0",
        "The path of retentive memory had a file that is foreign, damaged, or of a later rungd. \
         rungd renamed that file, and did not overwrite it.",
        "If the file is memory of a later rungd, run that version. Else delete it once nobody \
         needs it.";

    RETAIN_MADE = 906, "retain-made", Info, NONE, ByName:
        "efa3805980f646e5bc49a6bc27ba2630",
        "rungd made a new file for retentive memory, in its full size.",
        "Nothing.";

    RETAIN_FAILED = 907, "retain-failed", Error, NONE, Never:
        "47dfd9b13c864d98bfd923e10af6de7a",
        "Retentive memory cannot be written. Scans continue; a restart would restore the last \
         image that is durable. The line comes every minute while the trouble lasts.",
        "Do what the line says: free room on the disk, correct the rights of the directory, \
         replace a disk that fails, change `[retain] file`.";

    RETAIN_RECOVERED = 908, "retain-recovered", Info, NONE, Never:
        "b9355878ccde4d43b268f300c30b4886",
        "Retentive memory is written again.",
        "Nothing.";

    RETAIN_SLOW = 909, "retain-slow", Warn, NONE, ByName:
        "ea6e9a91a7b1498195e7cc2cef3ca29c",
        "An image took longer than the interval to become durable. A power cut would have cost \
         the changes of that time.",
        "Find what else writes to that disk, or move the file to another disk.";

    RETAIN_WEAR = 910, "retain-wear", Warn, NONE, ByName:
        "4b0780c927e54c27b7123c06f3b9793f",
        "At the present rate, retentive memory writes more bytes a day than `[retain] \
         budget-mb-per-day` allows.",
        "Choose a longer `interval`, retain less, or leave values that change at every scan out of \
         the ranges. If the disk endures it, raise the budget.";

    RETAIN_FINAL = 911, "retain-final", Info, NONE, ByName:
        "da82d693a2974613a214e2ec53f99d74",
        "The last image is durable: the next start restores what memory held at the end.",
        "Nothing.";

    RETAIN_LOST = 912, "retain-lost", Error, NONE, Never:
        "46e81725e0dc4fae936f481ab9e1f494",
        "rungd ends, and the last image is not durable: the next start restores the image before \
         it.",
        "The line says why. After the next start, write the important values by hand.";

    RETAIN_SAVED = 913, "retain-saved", Info, CLIENTS, Never:
        "1b7f40ec1278449e92f3250f7dac06e6",
        "An operator asked rungd to keep retentive memory, and the image is durable.",
        "Nothing.";
}
