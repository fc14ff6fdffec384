//! The power of scans, and an engine that executes only what can change something, beside an engine
//! that executes everything and a walk that sees every rung: the same in every cell, contact and
//! compare, for all shipped ladders and random ones, with random inputs, writes, forces, stops,
//! starts, timers, Stages, subroutines, and states of other times to continue from.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

use super::slices::{BLOCKS, Random, calls, cells, files, subject};
use crate::observe::leaves::states;
use crate::observe::walk::{WalkedProgram, Witness, walk};
use crate::observe::{
    FormulaNumber, LadderCompare, PowerRun, ScanPower, SparingEngine, Subject, WholeProgram,
};
use rungd_engine::{
    Cell, Element, Engine, EngineCall, EngineState, Image, ScanStep, ScanTimes, Slice,
};
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::Mode;
use rungd_runtime::{SectionStart, TapeEntry, TapeSection};

const SCANS: u64 = 150;
/// The number of random ladders.
const LADDERS: usize = 40;

/// What a walk of the whole program sees in one scan.
struct WholeWalk<'a> {
    subject: &'a Subject,
    compares: &'a [LadderCompare],
    compared: BTreeMap<u32, [FormulaNumber; 2]>,
    contacts: Vec<Option<bool>>,
    executed: Vec<bool>,
}

impl Witness for WholeWalk<'_> {
    /// What is shown of a subroutine is its last execution.
    fn before(&mut self, deed: ScanStep, _: u32, _: &Image) {
        let ScanStep::Element(Element::Block(block)) = deed else { return };
        if !self.subject.program.block(block).is_subroutine() {
            return;
        }
        let parts = self.subject.sites.parts.iter().enumerate();
        for (at, part) in parts.filter(|(_, part)| part.element.block == block) {
            self.executed[at] = false;
            self.compared.retain(|contact, _| !part.leaves.contains(contact));
            self.contacts[part.leaves.start as usize..part.leaves.end as usize].fill(None);
        }
    }

    fn part(&mut self, part: u32, _: u32, image: &Image) {
        self.executed[part as usize] = true;
        let leaves = &self.subject.part(part).leaves;
        let states = states(self.subject, part, image);
        for (place, on) in self.contacts[leaves.start as usize..].iter_mut().zip(states) {
            *place = Some(on);
        }
        let own = self.compares.iter().filter(|compare| leaves.contains(&compare.contact));
        self.compared.extend(own.map(|compare| (compare.contact, compare.values(image))));
    }
}

/// A ladder in three engines.
struct Trial<'a> {
    name: &'a str,
    subject: Arc<Subject>,
    slice: Slice,
    compares: Vec<LadderCompare>,
    all: Vec<Cell>,
    whole: Engine,
    sparing: SparingEngine,
    run: PowerRun,
    section: TapeSection,
    scan: u64,
}

impl Trial<'_> {
    fn call(&mut self, call: EngineCall) {
        self.whole.apply(call);
        self.sparing.apply(call);
        self.section.entries.push(TapeEntry::Call(call));
    }

    /// Executes a scan in all of them. `is_seen`: its power is compared.
    fn execute(&mut self, is_seen: bool) -> bool {
        let last = self.whole.stops();
        self.section.entries.push(TapeEntry::Call(EngineCall::Execute));
        self.sparing.apply(EngineCall::Execute);
        let parts = self.subject.sites.parts.len();
        let mut seen = WholeWalk {
            subject: &self.subject,
            compares: &self.compares,
            compared: BTreeMap::new(),
            contacts: vec![None; self.subject.sites.leaves.len()],
            executed: vec![false; parts],
        };
        let program = WalkedProgram { subject: &self.subject, slice: &self.slice };
        walk(program, &mut self.whole, EngineCall::Execute, &mut seen);
        assert_eq!(
            EngineState::of(self.sparing.engine()),
            EngineState::of(&self.whole),
            "{}, scan {}",
            self.name,
            self.scan
        );
        if is_seen {
            let power = self.run.last_of(&self.section).expect("a scan");
            assert_eq!(power.scan, self.scan);
            compare(self.name, &power, &seen);
            for cell in &self.all {
                let right = self.whole.image().value(*cell);
                assert_eq!(power.value(*cell), right, "{}: {cell:?}", self.name);
            }
        }
        self.scan += 1;
        last
    }

    /// A new section begins, here or at an earlier state.
    fn cut(&mut self, state: &EngineState) {
        assert!(self.whole.resume(state) && self.sparing.resume(state));
        self.section = section(state.clone(), self.scan);
    }
}

fn compare(name: &str, power: &ScanPower, right: &WholeWalk<'_>) {
    for (number, on) in (0..).zip(&right.contacts) {
        let place = format!("{name}: contact {number} in scan {}", power.scan);
        assert_eq!(power.contact(number), *on, "{place}");
        assert_eq!(power.compared(number), right.compared.get(&number).copied(), "{place}");
    }
    for (number, executed) in (0..).zip(&right.executed) {
        assert_eq!(power.is_executed(number), *executed, "{name}: part {number}");
    }
}

fn section(state: EngineState, number: u64) -> TapeSection {
    let (lost, follows) = (0, false);
    let mode = Mode::Run;
    let start = SectionStart { generation: 1, number, mode, unix_offset_ns: 0, lost, follows };
    TapeSection { start, state, entries: Vec::new(), who: Vec::new() }
}

fn try_ladder(name: &str, subject: Subject, random: &mut Random) {
    let [all, _, named] = cells(&subject, random);
    let subject = Arc::new(subject);
    let program = WholeProgram::new(Arc::clone(&subject));
    let slice = subject.seen.whole();
    let whole = Engine::new(slice.program.clone());
    let first = EngineState::of(&whole);
    let mut trial = Trial {
        name,
        slice,
        compares: subject.compares(),
        all,
        sparing: program.sparing_engine(),
        run: PowerRun::of(program),
        section: section(first.clone(), 0),
        subject,
        whole,
        scan: 0,
    };
    let (mut last, mut kept) = (false, vec![first]);
    for scan in 0..SCANS {
        for call in calls(scan, last, &named, random) {
            trial.call(call);
        }
        last = trial.execute(random.below(3) == 0);
        match random.below(20) {
            0 | 1 => kept.push(EngineState::of(&trial.whole)),
            2 | 3 if !last => trial.cut(&EngineState::of(&trial.whole)),
            4 if !last => {
                let state = kept[random.below(kept.len())].clone();
                trial.cut(&state);
            }
            _ => {}
        }
    }
}

/// Bits, and words, of random ladders.
const BITS: [&str; 14] = [
    "X0", "X1", "X2", "C0", "C1", "C2", "C3", "Y0", "bits[at]", "T0.Done", "CT0.Done", "$On",
    "D1.3", "$1Second",
];
const WORDS: [&str; 8] = ["D0", "D1", "D2", "row[at]", "T0.Acc", "CT0.Acc", "R0", "3"];
const DEEDS: [&str; 22] = [
    "OUT C0",
    "OUT C1",
    "SET C2",
    "RST C2",
    "SET C3",
    "RST C3",
    "PD Y0",
    "SET bits[at]",
    "MOVE D1 to=row[at]",
    "ADD D0 1 to=D0",
    "MATH D2 = row[at] * D0 / D1",
    "MATH R0 = R0 + 0.5",
    "MOVE 2 to=D1",
    "SET D1.3",
    "RST D1.3",
    "RUN Side",
    "HALT Side",
    "ENTASK Once",
    "CALL Inner",
    "CALL Outer",
    "PONOFF Y1",
    "RESTART Side",
];

fn contact(random: &mut Random) -> String {
    let bit = |random: &mut Random| {
        let opposite = ["", "!"][random.below(2)];
        format!("{opposite}{}", BITS[random.below(BITS.len())])
    };
    match random.below(5) {
        0 => {
            let sign = ["<", ">=", "==", "!="][random.below(4)];
            let [a, b] = [0; 2].map(|_| WORDS[random.below(WORDS.len())]);
            format!("{a} {sign} {b}")
        }
        1 => format!("{} | {}", bit(random), bit(random)),
        _ => bit(random),
    }
}

fn rungs(key: &str, count: usize, random: &mut Random) -> String {
    let mut text = String::new();
    for _ in 0..count {
        let when = [0; 2].map(|_| format!("'{}'", contact(random))).join(", ");
        let deed = DEEDS[random.below(DEEDS.len())];
        let jump = match (key, random.below(4)) {
            ("program.stage.rung", 0) => ", \"JMP one\"",
            ("program.stage.rung", 1) => ", \"JMP two\"",
            ("subroutine.rung", 0) => ", \"RETURN\"",
            _ => "",
        };
        // A subroutine calls none of those around it.
        let deed = if key == "subroutine.rung" {
            deed.replace("CALL Outer", "OUT Y3")
        } else {
            deed.into()
        };
        writeln!(text, "[[{key}]]\nwhen = [{when}]\ndo = [\"{deed}\"{jump}]").expect("text");
    }
    text
}

/// A ladder of random rungs in a Program, two Stages, a Task and subroutines.
fn random_ladder(random: &mut Random) -> String {
    let mut text = String::from(
        "tags.row = { type = \"int\", count = 4 }\ntags.bits = { type = \"bit\", count = 8 }\n\
         tags.at = { at = \"D0\", min = 0, max = 5 }\n\n[[program]]\nname = \"Main\"\n",
    );
    text += "[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"TMR T0 preset=row[at]\"]\n";
    text +=
        "[[program.rung]]\nleg.up = [\"X1\"]\nleg.rst = [\"X2\"]\ndo = [\"CNT CT0 preset=3\"]\n";
    text += &rungs("program.rung", 8, random);
    text += "\n[[program]]\nname = \"Side\"\n";
    text += &rungs("program.rung", 3, random);
    for stage in ["one", "two"] {
        writeln!(text, "[[program.stage]]\nname = \"{stage}\"").expect("text");
        text += &rungs("program.stage.rung", 3, random);
    }
    text += "\n[[task]]\nname = \"Once\"\n";
    text += &rungs("task.rung", 2, random);
    text += "\n[[subroutine]]\nname = \"Outer\"\n";
    text += &rungs("subroutine.rung", 3, random);
    text += "\n[[subroutine]]\nname = \"Inner\"\n";
    text += &rungs("subroutine.rung", 3, random).replace("CALL Inner", "OUT Y2");
    text
}

#[test]
fn the_power_and_memory_of_shipped_ladders_are_those_of_a_whole_execution() {
    let mut random = Random(11);
    let mut all = files("programs");
    all.push(SourceFile { name: "blocks".into(), text: BLOCKS.into() });
    for file in all {
        try_ladder(&file.name.clone(), subject(file), &mut random);
    }
}

#[test]
fn the_power_and_memory_of_random_ladders_are_those_of_a_whole_execution() {
    let mut random = Random(12);
    for at in 0..LADDERS {
        let text = random_ladder(&mut random);
        let name = format!("random ladder {at}");
        let file = SourceFile { name: name.clone(), text };
        try_ladder(&name, subject(file), &mut random);
    }
}

#[test]
fn a_state_without_a_force_makes_what_the_force_held_back() {
    let main = "[[program]]\nname = \"Main\"\nrung = [ { when = [\"X0\"], do = [\"OUT C0\"] } ]\n";
    let subject = Arc::new(super::tape::ladder(main).subject);
    let [input, coil] = ["X0", "C0"].map(|name| subject.cell(name).expect("a cell"));
    let mut engine = WholeProgram::new(subject).sparing_engine();
    let scan = |engine: &mut SparingEngine, calls: &[EngineCall]| {
        let begin = EngineCall::Begin { now_ns: 0, times: ScanTimes::default(), local_s: 0 };
        engine.apply(begin);
        calls.iter().for_each(|call| engine.apply(*call));
        engine.apply(EngineCall::Execute);
    };
    engine.apply(EngineCall::Start { now_ns: 0 });
    scan(&mut engine, &[EngineCall::Write(input, 1), EngineCall::Force(coil, 0)]);
    let mut other = Engine::new(engine.engine().program().clone());
    assert!(other.resume(&EngineState::of(engine.engine())));
    scan(&mut engine, &[]);
    other.apply(EngineCall::Release(coil));
    assert!(engine.resume(&EngineState::of(&other)));
    assert_eq!(engine.engine().image().value(coil), 0);
    scan(&mut engine, &[]);
    assert_eq!(engine.engine().image().value(coil), 1);
}
