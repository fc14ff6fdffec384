//! The keys of the simulated plant (`simulated`) in a `[[device]]`: its parts and faults.
//!
//! The kind of a part decides its keys: the table `KEYS` has each key's form, and the kinds that
//! have the key. The resolver checks the combination of keys, and the names in their texts.

use std::ops::RangeInclusive;

use super::super::scaling::ScalingKeys;
use rungd_language::source::key::{Key, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{KeyWords, WrongWord};

/// The keys of a `[[device]]` for its plant.
#[derive(Clone, Debug, Default)]
pub struct PlantKeys {
    /// `[[device.part]]`, in file order.
    pub parts: Vec<WrittenPart>,
    /// `[[device.fault]]`, in file order.
    pub faults: Vec<WrittenFault>,
    /// `seed` of the noise.
    pub seed: Option<Located<i64>>,
    /// The scaling of each row of the map.
    pub rows: Vec<ScalingKeys>,
}

/// `[[device.part]]`.
#[derive(Clone, Debug)]
pub struct WrittenPart {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `kind`, if it is a known one.
    pub kind: Option<PlantPartKind>,
    /// The keys that name the drivers of a command: one point, or several for an opening. A key
    /// that names memory becomes a row (`rows_of_parts`).
    pub driven: Vec<(&'static str, Vec<Text>)>,
    /// Its durations, ms, by key.
    pub times: Vec<(&'static str, Located<i32>)>,
    /// Its numbers, by key.
    pub numbers: Vec<(&'static str, Located<i64>)>,
    /// Its pairs of numbers, by key.
    pub pairs: Vec<(&'static str, Located<Vec<i64>>)>,
    /// `eyes` of a conveyor, `switches` of a tank: a name and its place.
    pub places: Vec<(Text, Located<i64>)>,
    /// `to`: the memory that its `out` moves.
    pub to: Option<Text>,
    /// `invert`.
    pub invert: bool,
}

/// The kind of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PlantPartKind {
    Delay,
    Motor,
    Conveyor,
    Tank,
    Sensor,
    Pulse,
    Lag,
}

/// `[[device.fault]]`.
#[derive(Clone, Debug)]
pub struct WrittenFault {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `point`: the point whose value it falsifies.
    pub point: Option<Text>,
    /// `kind`, if it is a known one.
    pub kind: Option<FaultKind>,
    /// `when`: the point that causes it.
    pub when: Option<Text>,
    /// `value` of `stuck`.
    pub value: Option<Located<i64>>,
    /// `every` of `noisy`, ms.
    pub every_ms: Option<Located<i32>>,
    /// `amplitude` of `noisy`.
    pub amplitude: Option<Located<i64>>,
    /// `by` of `late`, ms.
    pub by_ms: Option<Located<i32>>,
}

/// The effect of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FaultKind {
    StuckOn,
    StuckOff,
    Stuck,
    Noisy,
    Late,
    Lost,
}

/// A named place.
const PLACE: Key = key("*", "Where it is.");
/// The name of a part.
const PART_NAME: &str = r#"{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}"#;
/// The name of a fault.
const FAULT_NAME: &str = r#"{"pattern":"^[a-z][A-Za-z0-9_]*$"}"#;

/// The form of a part's key.
enum PartKeyForm {
    /// The point that drives the command of this name.
    Driven,
    /// The points that drive the opening of this name together.
    DrivenTogether,
    Time,
    Number(RangeInclusive<i64>),
    Pair,
    /// Named places.
    Places,
}

const ANY: RangeInclusive<i64> = i32::MIN as i64..=i32::MAX as i64;
const NUMBER: i64 = i32::MAX as i64;

/// The keys of a part besides `name`, `kind` and `invert`, and the kinds of part that have them.
const KEYS: [(Key, PartKeyForm, &[PlantPartKind]); 31] = {
    use PartKeyForm::{Driven, DrivenTogether, Number, Pair, Places, Time};
    use PlantPartKind::{Conveyor, Delay, Lag, Motor, Pulse, Sensor, Tank};
    [
        (
            key("in", "The point of the plant, or the memory, that a delay or a lag follows."),
            Driven,
            &[Delay, Lag],
        ),
        (
            key("of", "A sensor's: the point of the plant, or the memory, that it measures."),
            Driven,
            &[Sensor],
        ),
        (
            key("enable", "A delay's: the point or bit without which it is at rest."),
            Driven,
            &[Delay],
        ),
        (
            key("run", "The point of the plant, or the memory, that makes it run."),
            Driven,
            &[Motor, Conveyor, Pulse],
        ),
        (
            key("trip", "A motor's: the point of the plant, or the bit, that trips it."),
            Driven,
            &[Motor],
        ),
        (
            key("reset", "A motor's: the point of the plant, or the bit, that resets it."),
            Driven,
            &[Motor],
        ),
        (
            key(
                "feed",
                "A conveyor's: the point of the plant, or the bit, that lays a part on it.",
            ),
            Driven,
            &[Conveyor],
        ),
        (
            key("jam", "A conveyor's: the point of the plant, or the bit, that jams its parts."),
            Driven,
            &[Conveyor],
        ),
        (
            key("fill", "A tank's: the point of the plant that opens its inlet, or several."),
            DrivenTogether,
            &[Tank],
        ),
        (
            key("drain", "A tank's: the point of the plant that opens its outlet, or several."),
            DrivenTogether,
            &[Tank],
        ),
        (
            key("after", "How long its command must be ON before it comes ON."),
            Time,
            &[Delay, Motor, Sensor],
        ),
        (
            key(
                "release",
                "How long its command must be OFF before it goes OFF; `after` if not given.",
            ),
            Time,
            &[Delay, Motor, Sensor],
        ),
        (key("pulse", "How long a pulse is ON."), Time, &[Pulse]),
        (
            key("every", "The time between pulses, or between parts on the belt."),
            Time,
            &[Pulse, Conveyor],
        ),
        (key("offset", "When the first pulse begins."), Time, &[Pulse]),
        (key("length", "A conveyor's length, in mm."), Number(1..=100_000), &[Conveyor]),
        (key("speed", "A conveyor's speed, in mm/s."), Number(1..=10_000), &[Conveyor]),
        (
            key("part-length", "The length of the parts on a conveyor, in mm; 100 if not given."),
            Number(10..=100_000),
            &[Conveyor],
        ),
        (
            key("eyes", "A conveyor's eyes: names and places on the belt, in mm."),
            Places,
            &[Conveyor],
        ),
        (key("capacity", "The most that a tank holds."), Number(1..=NUMBER), &[Tank]),
        (
            key("fill-rate", "The inflow per second while the inlet is open."),
            Number(0..=NUMBER),
            &[Tank],
        ),
        (
            key("drain-rate", "The outflow per second while the outlet is open."),
            Number(0..=NUMBER),
            &[Tank],
        ),
        (
            key("initial", "The level of a tank, or the value of a lag, at the start."),
            Number(ANY),
            &[Tank, Lag],
        ),
        (
            key("gain", "A lag's: how far its input at full moves it from `ambient`."),
            Number(ANY),
            &[Lag],
        ),
        (key("ambient", "A lag's value without any input; 0 if not given."), Number(ANY), &[Lag]),
        (key("time-constant", "How long a lag takes for 63.2 % of a change."), Time, &[Lag]),
        (
            key("switches", "A tank's switches: names and the levels from which they are ON."),
            Places,
            &[Tank],
        ),
        (key("on-at", "A sensor is ON from this value; 1 if not given."), Number(ANY), &[Sensor]),
        (
            key("off-at", "It is OFF below this value; `on-at` if not given."),
            Number(ANY),
            &[Sensor],
        ),
        (key("range", "The ends of the range that a sensor measures."), Pair, &[Sensor]),
        (key("raw", "The sensor's values at these ends."), Pair, &[Sensor]),
    ]
};

impl PlantPartKind {
    /// All kinds with their names.
    pub const NAMES: [(&'static str, PlantPartKind); 7] = [
        ("delay", PlantPartKind::Delay),
        ("motor", PlantPartKind::Motor),
        ("conveyor", PlantPartKind::Conveyor),
        ("tank", PlantPartKind::Tank),
        ("sensor", PlantPartKind::Sensor),
        ("pulse", PlantPartKind::Pulse),
        ("lag", PlantPartKind::Lag),
    ];

    /// Its name in a controller file.
    pub fn name(self) -> &'static str {
        PlantPartKind::NAMES[self as usize].0
    }
}

impl FaultKind {
    /// All kinds with their names.
    pub const NAMES: [(&'static str, FaultKind); 6] = [
        ("stuck-on", FaultKind::StuckOn),
        ("stuck-off", FaultKind::StuckOff),
        ("stuck", FaultKind::Stuck),
        ("noisy", FaultKind::Noisy),
        ("late", FaultKind::Late),
        ("lost", FaultKind::Lost),
    ];

    /// Its name in a controller file.
    pub fn name(self) -> &'static str {
        FaultKind::NAMES[self as usize].0
    }
}

impl WrittenPart {
    /// A duration, ms.
    pub fn time(&self, key: &str) -> Option<&Located<i32>> {
        self.times.iter().find(|(name, _)| *name == key).map(|(_, ms)| ms)
    }

    /// A number.
    pub fn number(&self, key: &str) -> Option<&Located<i64>> {
        self.numbers.iter().find(|(name, _)| *name == key).map(|(_, number)| number)
    }

    /// A pair of numbers.
    pub fn pair(&self, key: &str) -> Option<&Located<Vec<i64>>> {
        self.pairs.iter().find(|(name, _)| *name == key).map(|(_, pair)| pair)
    }
}

impl PlantKeys {
    pub(super) fn read_device(&mut self, table: &mut Table<'_>) {
        let parts = table.tables(key("part", "`simulated`: the parts of its plant."), "a part");
        self.parts = parts.into_iter().map(read_part).collect();
        let faults = table.tables(
            key("fault", "`simulated`: the faults of its plant, caused on demand."),
            "a fault",
        );
        self.faults = faults.into_iter().map(read_fault).collect();
        self.seed = table.integer(
            key("seed", "`simulated`: the seed of the noise; 1 if not given."),
            0..=i64::MAX,
        );
    }
}

fn read_part(mut table: Table<'_>) -> WrittenPart {
    let name = table.required_string(
        key("name", "Its name: `NAME.point` is one of its points.").limited(PART_NAME),
    );
    table.require("kind", "\"conveyor\"");
    let kinds =
        KeyWords::new(&PlantPartKind::NAMES).refused_as(WrongWord::NoneCalled("kind of part"));
    let kind = table.value_of(key("kind", "What it is."), &kinds);
    let mut part = WrittenPart {
        span: table.span(),
        name,
        kind,
        driven: Vec::new(),
        times: Vec::new(),
        numbers: Vec::new(),
        pairs: Vec::new(),
        places: Vec::new(),
        to: None,
        invert: false,
    };
    let is_of = |kinds: &[PlantPartKind]| kind.is_none_or(|kind| kinds.contains(&kind));
    for (key, form, kinds) in &KEYS {
        if is_of(kinds) {
            part.read(&mut table, *key, form);
        }
    }
    if is_of(&[PlantPartKind::Delay, PlantPartKind::Sensor, PlantPartKind::Pulse]) {
        part.to = table.string(
            key("to", "The bit that its `out` moves, if no row of the map has it.")
                .holds(Slot::Point),
        );
        part.invert = table.flag(key("invert", "Whether its output is inverted."), false);
    }
    table.finish();
    part
}

impl WrittenPart {
    fn read(&mut self, table: &mut Table<'_>, key: Key, form: &PartKeyForm) {
        match form {
            PartKeyForm::Driven => {
                let key = key.holds(Slot::Point);
                self.driven.extend(table.string(key).map(|text| (key.name, vec![text])))
            }
            PartKeyForm::DrivenTogether => {
                self.driven.push((key.name, table.string_or_strings(key)));
            }
            PartKeyForm::Time => self.times.extend(table.duration(key).map(|ms| (key.name, ms))),
            PartKeyForm::Number(range) => {
                self.numbers
                    .extend(table.integer(key, range.clone()).map(|number| (key.name, number)));
            }
            PartKeyForm::Pair => {
                self.pairs.extend(table.integers(key, ANY).map(|pair| (key.name, pair)))
            }
            PartKeyForm::Places => {
                if let Some(mut places) = table.table(key, "the places of a part") {
                    self.places = places.integers_by_name(PLACE, 0..=NUMBER);
                }
            }
        }
    }
}

fn read_fault(mut table: Table<'_>) -> WrittenFault {
    use FaultKind::{Late, Lost, Noisy, Stuck};
    let name =
        table.required_string(key("name", "Its name: `fault.NAME` causes it.").limited(FAULT_NAME));
    table.require("kind", "\"stuck\"");
    let kinds = KeyWords::new(&FaultKind::NAMES).refused_as(WrongWord::NoneCalled("kind of fault"));
    let kind = table.value_of(key("kind", "What it does."), &kinds);
    let is_of = |own_kind: FaultKind| kind.is_none_or(|kind| kind == own_kind);
    let mut fault = WrittenFault {
        span: table.span(),
        name,
        point: None,
        kind,
        when: table.string(key("when", "The point of the plant that causes it.")),
        value: None,
        every_ms: None,
        amplitude: None,
        by_ms: None,
    };
    if kind != Some(Lost) {
        fault.point = table.string(key("point", "The point of the plant that it falsifies."));
    }
    if is_of(Stuck) {
        fault.value = table
            .integer(key("value", "The value of a stuck point; its last value if not given."), ANY);
    }
    if is_of(Noisy) {
        fault.every_ms =
            table.duration(key("every", "How often the noise changes; 20ms if not given."));
        fault.amplitude =
            table.integer(key("amplitude", "The largest deviation of a noisy number."), 1..=NUMBER);
    }
    if is_of(Late) {
        fault.by_ms = table.duration(key("by", "The delay of a late point."));
    }
    table.finish();
    fault
}
