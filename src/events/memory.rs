//! Events of retentive memory.

rows! {
    RETAIN_RESTORED = 901, "retain-restored", Info, NONE:
        "f298a90a2f8b4814a746ba6602018a5a",
        "Retentive memory was found and restored before the first scan; the line says how much, \
         of which scan, and whether an orderly stop came before.",
        "Nothing. Where something was not restored, retain-dropped lines say what and why.";

    RETAIN_COLD = 902, "retain-cold", Error, NONE:
        "35b3e9c2ba6c4a418344b0cdc585441f",
        "Retentive memory is asked for, and nothing was found that could be restored: memory is \
         as after a cold start. Unless `[retain] cold-start` lets it run, the mode is STOP.",
        "At the very first start: `rungd mode run`. Later: find out where the file is (a disk \
         that is not mounted, another `file`), or which tags had other names (the retain-dropped \
         lines before it; the image stays until the next run), put right by hand what counts, then \
         `rungd mode run`.";

    RETAIN_DROPPED = 903, "retain-dropped", Warn, NONE:
        "ee6501b3734044af8945b154452a478e",
        "Something in the file of retentive memory was given to nothing, since the program has \
         changed; the line says what and why.",
        "If its value is still wanted: start the former ladder once more, read it, and write it \
         by hand. The file keeps it until the first images of the new one are written.";

    RETAIN_SLOT = 904, "retain-slot", Warn, NONE:
        "5f077a522e094fcc814362dd6113d182",
        "A slot of the file of retentive memory holds no whole image, and was passed over. Behind \
         a power cut that is as it should be: the image before it counts.",
        "Nothing behind a power cut. If it comes without one, the disk may be failing.";

    RETAIN_ASIDE = 905, "retain-aside", Warn, NONE:
        "5f8eea8800eb40ec8092152214785ac0",
        "Where retentive memory is to be kept lay a file that is foreign, damaged, or of a later \
         rungd. It was given another name, and not written over.",
        "If it is memory of a later rungd, run that one. Else delete it once nobody needs it.";

    RETAIN_MADE = 906, "retain-made", Info, NONE:
        "efa3805980f646e5bc49a6bc27ba2630",
        "A new file for retentive memory was made, in full.",
        "Nothing.";

    RETAIN_FAILED = 907, "retain-failed", Error, NONE:
        "47dfd9b13c864d98bfd923e10af6de7a",
        "Retentive memory cannot be written: scans go on, and a restart would restore the last \
         image that is durable. Repeated every minute while it lasts.",
        "Do what the line says: room on the disk, the rights of the directory, a disk that fails, \
         `[retain] file`.";

    RETAIN_RECOVERED = 908, "retain-recovered", Info, NONE:
        "b9355878ccde4d43b268f300c30b4886",
        "Retentive memory is written again.",
        "Nothing.";

    RETAIN_SLOW = 909, "retain-slow", Warn, NONE:
        "ea6e9a91a7b1498195e7cc2cef3ca29c",
        "It took longer than the interval until an image was durable: a power cut could have cost \
         as much.",
        "See what else writes to that disk, or put the file on another.";

    RETAIN_WEAR = 910, "retain-wear", Warn, NONE:
        "4b0780c927e54c27b7123c06f3b9793f",
        "As it goes now, more bytes a day are written for retentive memory than `[retain] \
         budget-mb-per-day` allows.",
        "Choose a longer `interval`, retain less, or keep what changes at every scan out of the \
         ranges. If the disk takes it, raise the budget.";

    RETAIN_FINAL = 911, "retain-final", Info, NONE:
        "da82d693a2974613a214e2ec53f99d74",
        "The last image is durable: the next start restores what memory held at the end.",
        "Nothing.";

    RETAIN_LOST = 912, "retain-lost", Error, NONE:
        "46e81725e0dc4fae936f481ab9e1f494",
        "rungd ends, and its last image is not durable: the next start restores the one before.",
        "See the line for why; after the next start, put right what counts.";

    RETAIN_SAVED = 913, "retain-saved", Info, CLIENTS:
        "1b7f40ec1278449e92f3250f7dac06e6",
        "An operator had retentive memory kept, and it is durable.",
        "Nothing.";
}
