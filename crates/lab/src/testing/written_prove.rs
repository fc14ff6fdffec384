//! `[prove]` of a test file as written: what may change in a proof, and what is asked beside
//! `always`.
//!
//! Called by `written`; `proving` resolves the names.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{advise, pair};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::Located;
use rungd_language::source::value_kind::{KeyWords, Millis, ParsedText, ValueKind, WrongWord};

/// The maximum number of periods from one scan to the next in a proof.
const LATE_MAX: u32 = 100;
/// The time for one line, if the file does not give one, ms.
const TIME_MS: u32 = 60_000;

/// What may happen to a controller in a proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProofEvent {
    /// A crash and a new process.
    PowerCut,
    /// An orderly stop and a new process.
    Restart,
    /// An orderly stop, and RUN.
    Stop,
    /// A field device is lost, or comes back.
    DeviceLoss,
    /// An operator writes what `writable` lists.
    Writes,
}

impl ProofEvent {
    /// Its word in a test file.
    pub fn word(self) -> &'static str {
        EVENTS.word(self)
    }
}

/// The events with their words.
const EVENTS: KeyWords<ProofEvent> = KeyWords::new(&[
    ("power-cut", ProofEvent::PowerCut),
    ("restart", ProofEvent::Restart),
    ("stop", ProofEvent::Stop),
    ("device-loss", ProofEvent::DeviceLoss),
    ("writes", ProofEvent::Writes),
])
.refused_as(WrongWord::NoneCalled("event of a proof"));

/// The memory with which proofs begin: `true` for any retained values.
const FROM: KeyWords<bool> = KeyWords::new(&[("cold", false), ("retained", true)]);

/// A JSON Schema: the steps of time.
const STEPS: &str = r#"{"pattern":"^(nominal|1[.][.][0-9]+)$"}"#;
const STEP: ParsedText<u32> = ParsedText::new(step).limited(STEPS);

/// `[prove]`.
#[derive(Debug)]
pub(super) struct WrittenProve {
    /// `None`: every input that the question depends on.
    pub inputs: Option<Vec<Text>>,
    pub assume: Vec<Text>,
    pub can: Vec<Text>,
    /// The maximum number of periods from one scan to the next.
    pub late_max: u32,
    pub from_retained: bool,
    pub events: Vec<ProofEvent>,
    pub writable: Vec<Text>,
    pub any: Vec<Text>,
    pub states: Option<u64>,
    pub depth: Option<u64>,
    pub time_ms: u32,
}

impl Default for WrittenProve {
    fn default() -> WrittenProve {
        let none = Vec::new;
        WrittenProve {
            inputs: None,
            assume: none(),
            can: none(),
            late_max: 1,
            from_retained: false,
            events: Vec::new(),
            writable: none(),
            any: none(),
            states: None,
            depth: None,
            time_ms: TIME_MS,
        }
    }
}

/// Reads `[prove]`.
pub(super) fn read(root: &mut Table<'_>) -> Option<WrittenProve> {
    let explained = key("prove", "What `rungd prove` assumes, and what it asks beside `always`.");
    let mut table = root.table(explained, "`[prove]`")?;
    let inputs = table.strings(
        key(
            "inputs",
            "What may change before each scan; if not given, every input that a line depends on.",
        )
        .holds(Slot::Operand),
    );
    let assume = "Contacts that are ON in every scan: only such inputs come. They are judged \
                  before the rungs, so what the ladder writes has its value of the scan before.";
    let can = "Contacts that some sequence of inputs turns ON, from every state that can be \
               reached.";
    let (assume, can) =
        (conditions(&mut table, "assume", assume), conditions(&mut table, "can", can));
    let step = key("step", "The time from one scan to the next: `nominal`, or 1 to N periods.");
    let late_max = table.value_of(step, &STEP).unwrap_or(1);
    let from = key(
        "from",
        "The memory before the first scan: `cold`, or any values of what is `retained`.",
    );
    let from_retained = table.value_of(from, &FROM).unwrap_or(false);
    let events = key(
        "events",
        "What happens to the controller: `power-cut`, `restart`, `stop`, `device-loss`, `writes`.",
    );
    let events = table.strings(events).map_or(Vec::new(), |all| all.value);
    let events = events.iter().filter_map(|text| {
        let mut find = |mut finding: Finding| {
            finding.code = Code::TestFile;
            table.find(finding);
        };
        EVENTS.read("events", text, &mut find)
    });
    let events = events.collect();
    let names = |table: &mut Table<'_>, name, explained| {
        table.strings(key(name, explained).holds(Slot::Operand)).map_or(Vec::new(), |all| all.value)
    };
    let writable =
        names(&mut table, "writable", "What an operator writes, with `writes` in `events`.");
    let any = names(
        &mut table,
        "any",
        "Bits and words that have any value in every scan, whatever the ladder writes there.",
    );
    let states = table
        .integer(key("states", "The maximum number of states that are explored."), 1..=i64::MAX);
    let depth = table
        .integer(key("depth", "The maximum number of scans that are looked at."), 1..=i64::MAX);
    let time = key("time", "The time for each line.");
    let time_ms = table.value_of(time, &Millis::some("60s")).unwrap_or(TIME_MS);
    table.finish();
    let whole = |number: Option<Located<i64>>| number.map(|number| number.value.unsigned_abs());
    Some(WrittenProve {
        inputs: inputs.map(|all| all.value),
        assume,
        can,
        late_max,
        from_retained,
        events,
        writable,
        any,
        states: whole(states),
        depth: whole(depth),
        time_ms,
    })
}

fn conditions(table: &mut Table<'_>, name: &'static str, explained: &'static str) -> Vec<Text> {
    let texts = table
        .strings(key(name, explained).holds(Slot::Condition))
        .map_or(Vec::new(), |texts| texts.value);
    plain(table, texts, Code::ContactSyntax, "a condition")
}

/// The texts in which every part has a place.
pub(super) fn plain(table: &Table<'_>, texts: Vec<Text>, code: Code, one: &str) -> Vec<Text> {
    texts.into_iter().filter(|text| table.doc().is_plain(text, code, one)).collect()
}

/// `nominal`, or `1..N`.
fn step(_: &str, text: &Text) -> Result<u32, Finding> {
    if text.text == "nominal" {
        return Ok(1);
    }
    let most = text.text.strip_prefix("1..").and_then(|most| most.parse::<u32>().ok());
    match most {
        Some(most @ 1..=LATE_MAX) => Ok(most),
        Some(_) | None => {
            let message = format!("`{}` is no time from one scan to the next", text.text);
            let finding = Finding::new(Code::TestFile, text.span, message);
            let forms = ["step = \"nominal\"", "step = \"1..3\""].map(|form| pair(form).possible());
            let words = "exactly a period, `{}`, or one to N periods, N at most 100: `{}`";
            Err(finding.help(advise(words, forms)))
        }
    }
}
