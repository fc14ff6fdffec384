//! The steps of a test: name, form, meaning. `step_text` names the form in its findings; an editor
//! shows form and meaning.

/// The names of the steps, each with its form and its meaning.
pub const FORMS: [(&str, &str, &str); 18] = [
    (
        "set",
        "set bottle 1",
        "An input holds the value from the next scan on; any other operand is written once.",
    ),
    ("force", "force pusher 1", "Forces a bit or word, until `unforce`."),
    ("unforce", "unforce pusher", "Ends a force."),
    (
        "pulse",
        "pulse bottle 100ms every 400ms times 3",
        "A bit that is OFF goes ON for the time, then OFF; perhaps several times.",
    ),
    ("beat", "beat pulses 100ms every 1s", "Pulses in the background, until the bit is set."),
    ("run", "run 2s", "Time passes: a duration, or `run 3 scans`."),
    ("late", "late 2", "The next scan comes this number of periods after it was due."),
    ("expect", "expect: pusher", "The condition must be true at the end of the last scan."),
    (
        "within",
        "within 2s: pusher",
        "Runs until the condition is true; fails if that takes longer.",
    ),
    (
        "hold",
        "hold 300ms: full_lamp",
        "Runs for the time; the condition must be true at the end of each scan.",
    ),
    ("stop", "stop", "An orderly stop, after one last scan."),
    ("start", "start", "From STOP to RUN."),
    (
        "restart",
        "restart for 8h",
        "A stop, and a new process with the retained memory, at once or after a time.",
    ),
    (
        "power-cut",
        "power-cut lose 2s for 8h",
        "A new process after a crash, at once or after a time, with the newest retained image, or \
         an older one.",
    ),
    ("reload", "reload ladder.toml", "Reloads these files, as `rungd reload` does."),
    ("lose", "lose plant", "The field device is gone."),
    ("restore", "restore plant", "The field device is back."),
    ("clock", "clock 2026-11-22T06:00:00", "Sets the time of day."),
];

/// The form and the meaning of a step.
pub fn step_form(name: &str) -> Option<(&'static str, &'static str)> {
    let found = FORMS.iter().find(|(known, ..)| *known == name);
    found.map(|(_, form, meaning)| (*form, *meaning))
}
