//! The keys of the simulated plant (`simulated`) in a `[[device]]`: its parts and faults.
//!
//! A part's keys are those of its kind: a table tells which key is of what form and whose. What
//! they mean together, and what their texts name, is the resolver's business.

use super::super::keys::{Kind, belongs, named};
use crate::source::reader::{Table, Text};
use crate::source::span::{Located, Span};

/// What a `[[device]]` says of its plant.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// `[[device.part]]`, in file order.
    pub parts: Vec<Part>,
    /// `[[device.fault]]`, in file order.
    pub faults: Vec<Fault>,
    /// `seed`: of what is random.
    pub seed: Option<Located<i64>>,
}

/// `[[device.part]]`.
#[derive(Clone, Debug)]
pub struct Part {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `kind`, where it is one.
    pub kind: Option<PartKind>,
    /// Keys that name the point by which a command is driven.
    pub driven: Vec<(&'static str, Text)>,
    /// Its keys that are durations, ms.
    pub times: Vec<(&'static str, Located<i32>)>,
    /// Its keys that are numbers.
    pub numbers: Vec<(&'static str, Located<i64>)>,
    /// Its keys that are a pair of numbers.
    pub pairs: Vec<(&'static str, Located<Vec<i64>>)>,
    /// `eyes` of a conveyor, `switches` of a tank: a name, and where it is.
    pub places: Vec<(Text, Located<i64>)>,
    /// `invert`.
    pub invert: bool,
}

/// What a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PartKind {
    Delay,
    Motor,
    Conveyor,
    Tank,
    Sensor,
    Pulse,
}

/// `[[device.fault]]`.
#[derive(Clone, Debug)]
pub struct Fault {
    /// The place of its header.
    pub span: Span,
    /// `name`.
    pub name: Option<Text>,
    /// `point`: whose value it falsifies.
    pub point: Option<Text>,
    /// `kind`, where it is one.
    pub kind: Option<FaultKind>,
    /// `when`: the point that brings it about.
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

/// What a fault does.
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

/// What stands behind a part's key.
enum Form {
    /// The point by which the command of this name is driven.
    Driven,
    Time,
    Number(i64, i64),
    Pair,
    /// Named places, from and to.
    Places,
}

const ANY: (i64, i64) = (i32::MIN as i64, i32::MAX as i64);
const NUMBER: i64 = i32::MAX as i64;

/// The keys of a part beside `name`, `kind` and `invert`, and whose they are.
const KEYS: [(&str, Form, &[PartKind]); 27] = {
    use Form::{Driven, Number, Pair, Places, Time};
    use PartKind::{Conveyor, Delay, Motor, Pulse, Sensor, Tank};
    [
        ("in", Driven, &[Delay]),
        ("of", Driven, &[Sensor]),
        ("run", Driven, &[Motor, Conveyor, Pulse]),
        ("trip", Driven, &[Motor]),
        ("reset", Driven, &[Motor]),
        ("feed", Driven, &[Conveyor]),
        ("jam", Driven, &[Conveyor]),
        ("fill", Driven, &[Tank]),
        ("drain", Driven, &[Tank]),
        ("after", Time, &[Delay, Motor, Sensor]),
        ("release", Time, &[Delay, Motor, Sensor]),
        ("pulse", Time, &[Pulse]),
        ("every", Time, &[Pulse, Conveyor]),
        ("offset", Time, &[Pulse]),
        ("length", Number(1, 100_000), &[Conveyor]),
        ("speed", Number(1, 10_000), &[Conveyor]),
        ("part-length", Number(10, 100_000), &[Conveyor]),
        ("eyes", Places, &[Conveyor]),
        ("capacity", Number(1, NUMBER), &[Tank]),
        ("fill-rate", Number(0, NUMBER), &[Tank]),
        ("drain-rate", Number(0, NUMBER), &[Tank]),
        ("initial", Number(0, NUMBER), &[Tank]),
        ("switches", Places, &[Tank]),
        ("on-at", Number(ANY.0, ANY.1), &[Sensor]),
        ("off-at", Number(ANY.0, ANY.1), &[Sensor]),
        ("range", Pair, &[Sensor]),
        ("raw", Pair, &[Sensor]),
    ]
};

impl PartKind {
    /// All kinds by name.
    pub const NAMES: [(&'static str, PartKind); 6] = [
        ("delay", PartKind::Delay),
        ("motor", PartKind::Motor),
        ("conveyor", PartKind::Conveyor),
        ("tank", PartKind::Tank),
        ("sensor", PartKind::Sensor),
        ("pulse", PartKind::Pulse),
    ];

    /// As written.
    pub fn name(self) -> &'static str {
        PartKind::NAMES[self as usize].0
    }
}

impl FaultKind {
    /// All kinds by name.
    pub const NAMES: [(&'static str, FaultKind); 6] = [
        ("stuck-on", FaultKind::StuckOn),
        ("stuck-off", FaultKind::StuckOff),
        ("stuck", FaultKind::Stuck),
        ("noisy", FaultKind::Noisy),
        ("late", FaultKind::Late),
        ("lost", FaultKind::Lost),
    ];

    /// As written.
    pub fn name(self) -> &'static str {
        FaultKind::NAMES[self as usize].0
    }
}

impl Part {
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

impl Keys {
    pub(in crate::controller::device) fn read(table: &mut Table<'_>, driver: Option<Kind>) -> Keys {
        if !belongs(driver, &[Kind::Simulated]) {
            return Keys::default();
        }
        Keys {
            parts: table.tables("part", "a part").into_iter().map(read_part).collect(),
            faults: table.tables("fault", "a fault").into_iter().map(read_fault).collect(),
            seed: table.integer("seed", (0, i64::MAX)),
        }
    }
}

fn read_part(mut table: Table<'_>) -> Part {
    let name = table.required_string("name");
    table.require("kind", "\"conveyor\"");
    let text = table.string("kind");
    let kind = text.and_then(|text| named(&table, &text, "kind of part", &PartKind::NAMES));
    let mut part = Part {
        span: table.span(),
        name,
        kind,
        driven: Vec::new(),
        times: Vec::new(),
        numbers: Vec::new(),
        pairs: Vec::new(),
        places: Vec::new(),
        invert: false,
    };
    let is_of = |kinds: &[PartKind]| kind.is_none_or(|kind| kinds.contains(&kind));
    for (key, form, kinds) in &KEYS {
        if is_of(kinds) {
            part.read(&mut table, key, form);
        }
    }
    if is_of(&[PartKind::Delay, PartKind::Sensor]) {
        part.invert = table.boolean("invert").is_some_and(|invert| invert.value);
    }
    table.finish();
    part
}

impl Part {
    fn read(&mut self, table: &mut Table<'_>, key: &'static str, form: &Form) {
        match form {
            Form::Driven => self.driven.extend(table.string(key).map(|text| (key, text))),
            Form::Time => self.times.extend(table.duration(key).map(|ms| (key, ms))),
            Form::Number(min, max) => {
                self.numbers.extend(table.integer(key, (*min, *max)).map(|number| (key, number)));
            }
            Form::Pair => self.pairs.extend(table.integers(key, ANY).map(|pair| (key, pair))),
            Form::Places => {
                if let Some(mut places) = table.table(key, "the places of a part") {
                    self.places = places.integers_by_name((0, NUMBER));
                }
            }
        }
    }
}

fn read_fault(mut table: Table<'_>) -> Fault {
    use FaultKind::{Late, Lost, Noisy, Stuck};
    let name = table.required_string("name");
    table.require("kind", "\"stuck\"");
    let text = table.string("kind");
    let kind = text.and_then(|text| named(&table, &text, "kind of fault", &FaultKind::NAMES));
    let is_of = |of: FaultKind| kind.is_none_or(|kind| kind == of);
    let mut fault = Fault {
        span: table.span(),
        name,
        point: None,
        kind,
        when: table.string("when"),
        value: None,
        every_ms: None,
        amplitude: None,
        by_ms: None,
    };
    if kind != Some(Lost) {
        fault.point = table.string("point");
    }
    if is_of(Stuck) {
        fault.value = table.integer("value", ANY);
    }
    if is_of(Noisy) {
        fault.every_ms = table.duration("every");
        fault.amplitude = table.integer("amplitude", (1, NUMBER));
    }
    if is_of(Late) {
        fault.by_ms = table.duration("by");
    }
    table.finish();
    fault
}
