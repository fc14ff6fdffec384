//! A test file as written: its keys, with the place of every part.
//!
//! [`read`] parses the text of the file. Steps and conditions are texts here: `step_text` and the
//! parser of contacts read them; `steps` and `random` resolve the names.

use super::interlock;
use super::written_prove::{self, WrittenProve, plain};
use rungd_config::controller::simulated_side::{self, WrittenSimulated};
use rungd_config::controller::test_settings;
use rungd_config::controller::written::WrittenController;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, advise, pair, possible};
use rungd_language::source::key::{Key, NOT_EMPTY, key};
use rungd_language::source::lost::LostText;
use rungd_language::source::observer;
use rungd_language::source::reader::{self, Constant, Table, Text, TextOrTable};
use rungd_language::source::shape::TableShape;
use rungd_language::source::slot::{DeclaredKind, KeySlot, Slot};
use rungd_language::source::span::{FileId, Located, Span};

/// The maximum number of tests of a file.
const TESTS_MAX: usize = 10_000;
/// The maximum number of steps of a file.
const STEPS_MAX: usize = 100_000;

/// A test file.
#[derive(Debug)]
pub(super) struct WrittenSuite {
    /// The ladders or controller under test; `None` after an error.
    pub bench: Option<WrittenBench>,
    /// `always`.
    pub always: Vec<Text>,
    /// `[[interlock]]`: the outputs of each.
    pub interlocks: Vec<Vec<Text>>,
    /// `[[simulated]]`.
    pub simulated: Vec<WrittenSimulated>,
    /// `[[scenario]]`.
    pub scenarios: Vec<WrittenScenario>,
    /// `[[random]]`.
    pub randoms: Vec<WrittenRandom>,
    /// Whether there is an `[observer]`.
    pub has_observer: bool,
    /// `[prove]`.
    pub prove: Option<WrittenProve>,
    /// The missing parts, if a part of the file is not TOML.
    pub lost: Option<LostText>,
}

/// The ladders or controller that a test file tests.
#[derive(Debug)]
pub(super) enum WrittenBench {
    /// `ladder`, `period`, `[retain]`.
    Ladders(Box<WrittenController>),
    /// `controller`.
    Controller(Text),
}

/// `set`.
pub(super) type WrittenSet = Vec<(Text, Located<Constant>)>;

/// `[[scenario]]`.
#[derive(Debug)]
pub(super) struct WrittenScenario {
    pub span: Span,
    pub name: Option<Text>,
    pub set: WrittenSet,
    pub steps: Vec<Text>,
}

/// `[[random]]`.
#[derive(Debug)]
pub(super) struct WrittenRandom {
    pub span: Span,
    pub name: Option<Text>,
    pub runs: Option<Located<i64>>,
    pub scans: Option<Located<i64>>,
    pub seed: Option<Located<i64>>,
    pub set: WrittenSet,
    pub events: WrittenEvents,
    pub changes: Vec<(Text, WrittenChange)>,
}

/// `events` of a random test: the probabilities.
#[derive(Debug, Default)]
pub(super) struct WrittenEvents {
    pub lose: Option<Text>,
    pub power_cut: Option<Text>,
    pub restart: Option<Text>,
    pub stop: Option<Text>,
    pub writes: Vec<(Text, WrittenChange)>,
}

/// An entry of `change`.
#[derive(Debug)]
pub(super) enum WrittenChange {
    /// `"1%"`.
    Toggle(Text),
    /// `{ walk = "0..100", step = 3, chance = "10%" }`, `{ jump = "0..9", chance = "2%" }`.
    Moves {
        span: Span,
        walk: Option<Text>,
        jump: Option<Text>,
        step: Option<Text>,
        chance: Option<Text>,
    },
}

/// A JSON Schema: exactly one of `ladder` and `controller`; `period` and `[retain]` only with
/// `ladder`.
const ONE_OF_BOTH: &str = r#"{
    "not": { "required": ["ladder", "controller"] },
    "anyOf": [
        { "required": ["ladder"] },
        { "required": ["controller"], "properties": { "period": false, "retain": false } }
    ]
}"#;
/// A JSON Schema: exactly one of `walk`, which has a step, and `jump`.
const WALK_OR_JUMP: &str = r#"{
    "not": { "required": ["walk", "jump"] },
    "anyOf": [
        { "required": ["walk", "step"] },
        { "required": ["jump"], "properties": { "step": false } }
    ]
}"#;
/// A JSON Schema: `change` or `events`, or both.
const CHANGE_OR_EVENTS: &str = r#"{"anyOf":[{"required":["change"]},{"required":["events"]}]}"#;
const NAME: &str = r#"{"minLength":1}"#;
/// A JSON Schema: a probability.
const CHANCE: &str = r#"{"pattern":"^[0-9]+([.][0-9]+)?%$"}"#;
/// A JSON Schema: two limits.
const LIMITS: &str = r#"{"pattern":"^-?[0-9].*[.][.]-?[0-9]"}"#;

/// Reads a test file; `None` if the text is not TOML.
pub(super) fn read(source: &str, file: FileId) -> (Option<WrittenSuite>, Vec<Finding>) {
    reader::document(source, file, |root| read_root(root, file))
}

/// The keys of a test file.
pub fn shape() -> TableShape {
    reader::shape(|root| drop(read_root(root, FileId(0))))
}

fn read_root(mut root: Table<'_>, file: FileId) -> WrittenSuite {
    root.together(ONE_OF_BOTH);
    let lost = root.doc().lost();
    let bench = read_bench(&mut root, file);
    let conditions =
        key("always", "Contacts that must be ON at the end of every scan.").holds(Slot::Condition);
    let always = root.strings(conditions).map_or(Vec::new(), |texts| texts.value);
    let always = plain(&root, always, Code::ContactSyntax, "a condition");
    let interlocks = interlock::read(&mut root);
    let has_observer = observer::read(&mut root).is_some();
    let simulated = simulated_side::read_in(&mut root);
    let scenarios = root.tables(
        key("scenario", "Tests, each a cold start and steps in virtual time."),
        "a scenario",
    );
    let scenarios: Vec<WrittenScenario> = scenarios.into_iter().map(read_scenario).collect();
    let randoms =
        root.tables(key("random", "Tests with inputs that change at random."), "a random test");
    let randoms: Vec<WrittenRandom> = randoms.into_iter().map(read_random).collect();
    let prove = written_prove::read(&mut root);
    limits(&root, &scenarios, &randoms);
    root.finish();
    WrittenSuite {
        bench,
        always,
        interlocks,
        has_observer,
        simulated,
        scenarios,
        randoms,
        prove,
        lost,
    }
}

/// `ladder` with `period` and `[retain]`, or `controller`.
fn read_bench(root: &mut Table<'_>, file: FileId) -> Option<WrittenBench> {
    let ladder = root.strings(
        key("ladder", "The ladder files, relative to this file: one program.")
            .limited(NOT_EMPTY)
            .holds(Slot::File),
    );
    let controller = root.string(key(
        "controller",
        "The controller file, relative to this file: its ladders, period, memory, retention, and \
         its simulated devices.",
    ).holds(Slot::File));
    let names = ladder.as_ref().map_or(Vec::new(), |ladder| ladder.value.clone());
    let settings = test_settings::read(root, names, file);
    let finding = |place, message: &str| Finding::new(Code::TestFile, place, message);
    match (root.key_span("ladder"), root.key_span("controller")) {
        (Some(_), Some(place)) => {
            let finding = finding(place, "a test file has `ladder` or `controller`, not both");
            let help = "a controller file names its ladders itself: take one away";
            root.find(finding.help(help).fix(possible(FixEdit::Delete)));
            None
        }
        (None, None) => {
            let place = root.span();
            let finding = Finding::new(Code::MissingKey, place, "the file names no ladder to test");
            let files = ["ladder = [\"ladder.toml\"]", "controller = \"rungd.toml\""];
            let files = files.map(|file| pair(file).possible());
            root.find(finding.help(advise("give it one: `{}`, or `{}`", files)));
            None
        }
        (Some(_), None) => {
            let ladder = ladder?;
            if ladder.value.is_empty() && !root.doc().has_finding_in(ladder.span) {
                let finding = finding(ladder.span, "no ladder file is named");
                root.find(finding.propose(pair("ladder = [\"ladder.toml\"]")));
                return None;
            }
            Some(WrittenBench::Ladders(Box::new(settings)))
        }
        (None, Some(_)) => {
            for name in ["period", "retain"] {
                if let Some(place) = root.key_span(name) {
                    let message = format!("`{name}` cannot be given together with `controller`");
                    let finding = finding(place, &message);
                    let help = "take it away: the controller file has this setting";
                    root.find(finding.help(help).fix(FixEdit::Delete));
                }
            }
            Some(WrittenBench::Controller(controller?))
        }
    }
}

fn read_scenario(mut table: Table<'_>) -> WrittenScenario {
    let name = read_name(&mut table);
    let set = read_set(&mut table);
    table.require("steps", "[\"run 1s\"]");
    let steps = table
        .strings(key("steps", "The steps and the conditions, in this order.").holds(Slot::Step));
    if let Some(steps) = &steps
        && steps.value.is_empty()
        && !table.doc().has_finding_in(steps.span)
    {
        let finding = Finding::new(Code::TestEmpty, steps.span, "a scenario without steps");
        let finding = finding.help("give it steps: `\"run 1s\"`, `\"expect: pusher\"`");
        table.find(finding.fix(pair("steps = [\"run 1s\"]").possible()));
    }
    let steps = steps.map_or(Vec::new(), |steps| steps.value);
    let steps = plain(&table, steps, Code::TestStep, "a step");
    let span = table.span();
    table.finish();
    WrittenScenario { span, name, set, steps }
}

fn read_random(mut table: Table<'_>) -> WrittenRandom {
    let name = read_name(&mut table);
    for (key, example) in [("runs", "100"), ("scans", "1000")] {
        table.require(key, example);
    }
    let runs = table.integer(key("runs", "How many runs; each is a cold start."), 1..=RUNS_MAX);
    let scans = table.integer(key("scans", "How many scans a run has."), 1..=SCANS_MAX);
    let seed = table.integer(
        key(
            "seed",
            "The seed of the generator: the same seed gives the same runs; 0 if not given.",
        ),
        0..=i64::MAX,
    );
    let set = read_set(&mut table);
    table.together(CHANGE_OR_EVENTS);
    let what = key("change", "What changes, and how often; before each scan.");
    let changes = table.table(what, "`change`").map_or(Vec::new(), read_changes);
    let what = "What happens to the controller and its field devices, and how often.";
    let events = table.table(key("events", what), "`events`").map(read_events);
    if !table.has("change") && !table.has("events") {
        let message = "a random test in which nothing changes";
        let finding = Finding::new(Code::MissingKey, table.span(), message);
        let example = pair("change = { start = \"1%\" }").possible();
        table.find(finding.help(advise("say what changes, and how often: `{}`", [example])));
    }
    let span = table.span();
    table.finish();
    let events = events.unwrap_or_default();
    WrittenRandom { span, name, runs, scans, seed, set, events, changes }
}

fn read_events(mut table: Table<'_>) -> WrittenEvents {
    let mut chance = |name, explanation| table.string(key(name, explanation).limited(CHANCE));
    let events = WrittenEvents {
        lose: chance(
            "lose",
            "The probability with which a field device is lost in a scan, and with which it comes \
             back: `0.1%`. Each device by itself.",
        ),
        power_cut: chance("power-cut", "The probability of a crash and a new process: `0.01%`."),
        restart: chance("restart", "The probability of an orderly stop and a new process."),
        stop: chance("stop", "The probability of an orderly stop, with RUN at the next scan."),
        writes: Vec::new(),
    };
    let what = "What an operator writes, and how often: as `change`.";
    let writes = table.table(key("write", what), "`write`").map_or(Vec::new(), read_changes);
    table.finish();
    WrittenEvents { writes, ..events }
}

/// The maximum number of runs of a random test.
const RUNS_MAX: i64 = 1_000_000;
/// The maximum number of scans of a run.
const SCANS_MAX: i64 = 1_000_000_000;

fn read_name(table: &mut Table<'_>) -> Option<Text> {
    let name = table.required_string(
        key("name", "Its name; unique in this file.").limited(NAME).declares(DeclaredKind::Test),
    )?;
    if name.text.trim().is_empty() {
        let finding = Finding::new(Code::TestFile, name.span, "an empty name");
        let example = pair("name = \"a full crate is pushed out\"").possible();
        table.find(finding.help(advise("say what it tests: `{}`", [example])));
        return None;
    }
    Some(name)
}

fn read_set(table: &mut Table<'_>) -> WrittenSet {
    let set = key("set", "Inputs and memory before the first scan, by name.");
    let Some(mut set) = table.table(set, "`set`") else { return Vec::new() };
    set.constants_by_name(
        key("*", "A tag or an address, and its value: `true`, `3`, `\"2s\"`.")
            .named(KeySlot::Operand),
    )
}

fn read_changes(mut table: Table<'_>) -> Vec<(Text, WrittenChange)> {
    let any: Key = key(
        "*",
        "A tag or an address. A bit: the probability with which it toggles in a scan, `\"1%\"`.",
    )
    .named(KeySlot::Operand);
    let entries = table.texts_or_tables(any, "a change");
    let entries = entries.into_iter().map(|(name, entry)| match entry {
        TextOrTable::Text(text) => (name, WrittenChange::Toggle(text)),
        TextOrTable::Table(mut table) => {
            table.together(WALK_OR_JUMP);
            let walk = key("walk", "Goes up or down by `step`, within these limits: `0..100`.");
            let jump = key("jump", "Takes any value within these limits: `0..9`.");
            table.require("chance", "\"10%\"");
            let change = WrittenChange::Moves {
                span: table.span(),
                walk: table.string(walk.limited(LIMITS)),
                jump: table.string(jump.limited(LIMITS)),
                step: table.scalar(key("step", "The size of a step of `walk`.")),
                chance: table.string(
                    key("chance", "The probability of a change in a scan: `10%`.").limited(CHANCE),
                ),
            };
            table.finish();
            (name, change)
        }
    });
    entries.collect()
}

/// The keys of which a test file has at least one.
const FILE_ASKS: [&str; 5] = ["scenario", "random", "always", "prove", "interlock"];

/// Refuses a file without tests, and a file with too many tests or steps.
fn limits(root: &Table<'_>, scenarios: &[WrittenScenario], randoms: &[WrittenRandom]) {
    let tests = scenarios.len() + randoms.len();
    let steps = scenarios.iter().map(|scenario| scenario.steps.len()).sum::<usize>();
    let place =
        |keys: &[&str]| keys.iter().find_map(|key| root.key_span(key)).unwrap_or(root.span());
    let find = |code, message: String, help: &str| {
        let place = place(&["scenario", "random", "always", "ladder", "controller"]);
        root.find(Finding::new(code, place, message).help(help));
    };
    let asks = |key: &str| root.has(key);
    if tests == 0 && !FILE_ASKS.into_iter().any(asks) {
        let help = "write a `[[scenario]]` with `name` and `steps`, or a `[[random]]`";
        find(Code::TestEmpty, "a test file without a test".to_owned(), help);
    }
    let help = "divide it into several files";
    if tests > TESTS_MAX {
        find(Code::TestFile, format!("{tests} tests; a file has at most {TESTS_MAX}"), help);
    }
    if steps > STEPS_MAX {
        find(Code::TestFile, format!("{steps} steps; a file has at most {STEPS_MAX}"), help);
    }
}
