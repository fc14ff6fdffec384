//! The steps of a test: name, form, meaning, what a step names. `step_text` names the form in its
//! findings; an editor shows form and meaning, and finds the names.

/// What an author writes for a step.
pub struct StepForm {
    /// Its verb.
    pub name: &'static str,
    /// An example.
    pub form: &'static str,
    /// Its meaning, a sentence.
    pub meaning: &'static str,
    /// The names behind its verb.
    pub names: StepNames,
    /// The rest of its form, with a numbered gap for each word: ` ${1:name} ${2:1}`.
    pub gaps: &'static str,
}

/// The names behind the verb of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepNames {
    /// None.
    Nothing,
    /// The first word is the name of a bit or word.
    Operand,
    /// The first word is a field device.
    Device,
    /// Each word is a file.
    Files,
    /// A condition, behind a colon.
    Condition,
}

/// The forms of all steps.
pub const FORMS: [StepForm; 18] = [
    step(
        "set",
        "set bottle 1",
        "An input holds the value from the next scan on; any other operand is written once.",
    )
    .with(StepNames::Operand, " ${1:name} ${2:1}"),
    step("force", "force pusher 1", "Forces a bit or word, until `unforce`.")
        .with(StepNames::Operand, " ${1:name} ${2:1}"),
    step("unforce", "unforce pusher", "Ends a force.").with(StepNames::Operand, " ${1:name}"),
    step(
        "pulse",
        "pulse bottle 100ms every 400ms times 3",
        "A bit that is OFF goes ON for the time, then OFF; perhaps several times.",
    )
    .with(StepNames::Operand, " ${1:name} ${2:100ms}"),
    step("beat", "beat pulses 100ms every 1s", "Pulses in the background, until the bit is set.")
        .with(StepNames::Operand, " ${1:name} ${2:100ms} every ${3:1s}"),
    step("run", "run 2s", "Time passes: a duration, or `run 3 scans`.")
        .with(StepNames::Nothing, " ${1:1s}"),
    step("late", "late 2", "The next scan comes this number of periods after it was due.")
        .with(StepNames::Nothing, " ${1:1}"),
    step("expect", "expect: pusher", "The condition must be true at the end of the last scan.")
        .with(StepNames::Condition, ": $1"),
    step(
        "within",
        "within 2s: pusher",
        "Runs until the condition is true; fails if that takes longer.",
    )
    .with(StepNames::Condition, " ${1:2s}: $2"),
    step(
        "hold",
        "hold 300ms: full_lamp",
        "Runs for the time; the condition must be true at the end of each scan.",
    )
    .with(StepNames::Condition, " ${1:300ms}: $2"),
    step("stop", "stop", "An orderly stop, after one last scan."),
    step("start", "start", "From STOP to RUN."),
    step(
        "restart",
        "restart for 8h",
        "A stop, and a new process with the retained memory, at once or after a time.",
    ),
    step(
        "power-cut",
        "power-cut lose 2s for 8h",
        "A new process after a crash, at once or after a time, with the newest retained image, or \
         an older one.",
    ),
    step("reload", "reload ladder.toml", "Reloads these files, as `rungd reload` does.")
        .with(StepNames::Files, " ${1:ladder.toml}"),
    step("lose", "lose plant", "The field device is gone.").with(StepNames::Device, " ${1:device}"),
    step("restore", "restore plant", "The field device is back.")
        .with(StepNames::Device, " ${1:device}"),
    step("clock", "clock 2026-11-22T06:00:00", "Sets the time of day.")
        .with(StepNames::Nothing, " ${1:2026-11-22T06:00:00}"),
];

const fn step(name: &'static str, form: &'static str, meaning: &'static str) -> StepForm {
    StepForm { name, form, meaning, names: StepNames::Nothing, gaps: "" }
}

impl StepForm {
    const fn with(self, names: StepNames, gaps: &'static str) -> StepForm {
        StepForm { names, gaps, ..self }
    }
}

/// The form of a step.
pub fn step_form(name: &str) -> Option<&'static StepForm> {
    FORMS.iter().find(|step| step.name == name)
}
