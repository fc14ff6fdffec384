//! Scenarios that pin what a program does now: random inputs, and what the program made of them.
//!
//! Called by `rungd import --pin`, after the files of the project are written. The steps are drawn
//! first and executed as a test executes them; what the memory is then becomes expectations. So the
//! test passes at once, and a change of behaviour shows. It knows nothing of what the program
//! should do.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use super::pasted::quoted;
use super::reading::{ReadSuite, read_text};
use super::runner::programs;
use super::traced::trace;
use crate::rig::RigProgram;
use crate::rig::simulation::all_named;
use crate::traces::trace::TracedOperand;
use rungd_base::random::SplitMix64;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BitSpace, Word, WordSpace};
use rungd_history::observe::Subject;
use rungd_language::source::span::SourceFile;

/// The maximum number of scans of a scenario.
const SCENARIO_SCANS: u64 = 2000;
/// How long inputs may stay, in scans: timers of seconds come to their end too.
const STAYS: [u64; 8] = [1, 1, 2, 5, 20, 100, 300, 300];
/// What words become.
const WORDS: [i32; 10] = [0, 1, 2, 5, 10, 100, 1000, -1, -100, 32767];
/// What reals become.
const REALS: [f32; 7] = [0.0, 1.0, 2.5, 10.0, 99.5, 1000.0, -1.5];
/// The maximum number of operands in one `expect` line.
const OPERANDS_MAX: usize = 8;
/// How many operands that did not change are expected after each change of inputs, in turn.
const UNCHANGED: usize = 16;
/// The maximum length of the text, in bytes. What is beyond it is left out.
const BYTES_MAX: usize = 1 << 20;

/// What is pinned.
pub struct Pin<'a> {
    /// The path of the test file; the files that it names must exist.
    pub path: &'a Path,
    /// What the test file begins with: comments, `controller` or `ladder`.
    pub head: String,
    /// The number of scans, at least 1.
    pub scans: u64,
    /// The seed of the random inputs.
    pub seed: u64,
    /// Whether the values of an operand are pinned, by its name.
    pub is_pinned: &'a dyn Fn(&str) -> bool,
}

/// The text of a test file.
///
/// # Errors
/// The program has errors: the findings of the test file.
pub fn pinned(pin: &Pin<'_>) -> Result<String, Box<ReadSuite>> {
    let idle = format!("{}\n[[scenario]]\nname = \"idle\"\nsteps = [\"run 1 scans\"]\n", pin.head);
    let read = read(pin, idle);
    let Some(suite) = &read.suite else { return Err(Box::new(read)) };
    let bench = Bench::of(pin, Subject::new(Arc::clone(&suite.programs[0].program), Vec::new()));
    let mut random = SplitMix64(pin.seed);
    let (mut scenarios, mut left) = (Vec::new(), pin.scans.max(1));
    while left > 0 {
        let scenario = bench.drawn(&mut random, left.min(SCENARIO_SCANS));
        left -= scenario.iter().map(|stay| stay.scans).sum::<u64>();
        scenarios.push(scenario);
    }
    let mut text = pin.head.clone();
    for scenario in &scenarios {
        text += &scenario_text(scenario, |_| Vec::new());
    }
    let read = self::read(pin, text);
    let Some(suite) = &read.suite else { return Err(Box::new(read)) };
    let programs = programs(suite);
    let mut text = pin.head.clone();
    for (at, scenario) in scenarios.iter().enumerate() {
        let seen = bench.seen(suite, &programs, at, scenario);
        let mut expected = Expected::new(&bench);
        let part = scenario_text(scenario, |stay| {
            let is_last = stay + 1 == scenario.len();
            seen.get(stay).map_or(Vec::new(), |values| expected.lines(values, is_last))
        });
        if at > 0 && text.len() + part.len() > BYTES_MAX {
            let _ = writeln!(text, "\n# The rest of {} scans would be too long.", pin.scans);
            break;
        }
        let name = format!("what the program did at first, part {}", at + 1);
        text += &part.replacen(NAME, &quoted(&name), 1);
    }
    Ok(text)
}

fn read(pin: &Pin<'_>, text: String) -> ReadSuite {
    let mut number = 0;
    let mut named = String::new();
    for piece in text.split_inclusive(NAME) {
        number += 1;
        named += &piece.replace(NAME, &format!("\"{number}\""));
    }
    let file = SourceFile { name: pin.path.display().to_string(), text: named };
    read_text(pin.path, file, None)
}

/// In place of the name of a scenario.
const NAME: &str = "\"\"";

/// The program with its inputs and what is expected of it.
struct Bench {
    subject: Subject,
    inputs: Vec<TracedOperand>,
    watched: Vec<TracedOperand>,
}

/// Changes of inputs, and how long they stay.
struct InputStay {
    sets: Vec<String>,
    scans: u64,
}

impl Bench {
    fn of(pin: &Pin<'_>, subject: Subject) -> Bench {
        let program = subject.program();
        let own = |operand: &TracedOperand| {
            let address = subject.symbols().layout.address(operand.cell);
            (pin.is_pinned)(&operand.name) && address.is_some_and(is_memory)
        };
        let mut named = all_named(program, subject.symbols());
        whole_words(&mut named, &subject);
        named.retain(own);
        named.sort_by(|one, other| one.name.cmp(&other.name));
        let cold = rungd_engine::Engine::new(subject.code().clone());
        let (watched, free): (Vec<_>, Vec<_>) =
            named.into_iter().partition(|operand| subject.is_driven(operand.cell));
        // What begins with a value is a setting, and stays as it is.
        let inputs = free.into_iter().filter(|operand| operand.value(cold.image()) == 0).collect();
        Bench { subject, inputs, watched }
    }

    /// A scenario of some scans.
    fn drawn(&self, random: &mut SplitMix64, scans: u64) -> Vec<InputStay> {
        let mut values = vec![0; self.inputs.len()];
        let mut stays: Vec<InputStay> = Vec::new();
        let mut left = scans;
        while left > 0 {
            let mut changed: Vec<usize> = Vec::new();
            if stays.is_empty() {
                changed = (0..self.inputs.len()).filter(|_| below(random, 2) == 0).collect();
            } else if !self.inputs.is_empty() {
                let most = 1 + self.inputs.len() as u64 / 8;
                let count = 1 + below(random, most);
                changed.extend((0..count).map(|_| below(random, values.len() as u64) as usize));
                changed.sort_unstable();
                changed.dedup();
            }
            for at in &changed {
                values[*at] = self.drawn_value(random, *at, values[*at]);
            }
            let scans = STAYS[below(random, STAYS.len() as u64) as usize].min(left);
            let sets = changed.into_iter().map(|at| self.set(at, values[at])).collect();
            stays.push(InputStay { sets, scans });
            left -= scans;
        }
        stays
    }

    fn drawn_value(&self, random: &mut SplitMix64, at: usize, now: i32) -> i32 {
        let input = &self.inputs[at];
        match input.cell {
            Cell::Word(_) if input.real => {
                REALS[below(random, REALS.len() as u64) as usize].to_bits() as i32
            }
            Cell::Word(_) => WORDS[below(random, WORDS.len() as u64) as usize],
            Cell::Bit(_) | Cell::WordBit(_) => i32::from(now == 0),
        }
    }

    fn set(&self, at: usize, value: i32) -> String {
        let input = &self.inputs[at];
        format!("set {} {}", input.name, self.subject.symbols().layout.text(input.cell, value))
    }

    /// The watched operands at the end of each stay of a scenario.
    fn seen(
        &self,
        suite: &super::suite::Suite,
        programs: &[Arc<RigProgram>],
        at: usize,
        scenario: &[InputStay],
    ) -> Vec<Vec<i32>> {
        let (mut end, mut seen) = (0, Vec::new());
        let ends: HashSet<u64> = scenario
            .iter()
            .map(|stay| {
                end += stay.scans;
                end
            })
            .collect();
        let row = &mut |scan: super::TracedScan<'_>| {
            if ends.contains(&scan.number) {
                seen.push(self.watched.iter().map(|one| one.value(scan.image)).collect());
            }
            Ok(())
        };
        // The trace itself writes nothing, so it cannot fail.
        drop(trace(suite, programs, at, row));
        seen
    }
}

/// Memory that a program and its plant share: no bits of blocks, Stages and the controller.
fn is_memory(address: Address) -> bool {
    match address {
        Address::Bit(Bit::Space(space, _)) => space != BitSpace::St,
        Address::Word(Word::Space(space, _)) => space != WordSpace::Dst,
        Address::Bit(_) | Address::Word(_) | Address::Structure(_) => false,
    }
}

/// Puts words in place of their bits.
fn whole_words(named: &mut Vec<TracedOperand>, subject: &Subject) {
    let layout = &subject.symbols().layout;
    for operand in named.iter_mut() {
        if let Cell::WordBit(bit) = operand.cell {
            let cell = Cell::Word(bit.word);
            *operand = TracedOperand::new(&subject.operand(cell).name, cell, layout);
        }
    }
    let mut seen = HashSet::new();
    named.retain(|operand| seen.insert(operand.name.clone()));
}

/// What the lines of a scenario have told.
struct Expected<'b> {
    bench: &'b Bench,
    told: Vec<Option<i32>>,
    /// The next operand that is expected although it did not change.
    turn: usize,
}

impl Expected<'_> {
    fn new(bench: &Bench) -> Expected<'_> {
        Expected { bench, told: vec![None; bench.watched.len()], turn: 0 }
    }

    /// What is expected now: what changed, and some of the rest; all at the end.
    fn lines(&mut self, values: &[i32], is_last: bool) -> Vec<String> {
        let count = values.len();
        let mut wanted: Vec<bool> =
            self.told.iter().zip(values).map(|(told, value)| *told != Some(*value)).collect();
        for _ in 0..UNCHANGED.min(count) {
            wanted[self.turn % count] = true;
            self.turn += 1;
        }
        let mut conditions = Vec::new();
        for (at, value) in values.iter().enumerate() {
            if wanted[at] || is_last {
                self.told[at] = Some(*value);
                conditions.push(self.condition(at, *value));
            }
        }
        let lines = conditions.chunks(OPERANDS_MAX);
        lines.map(|some| format!("expect: {}", some.join(" & "))).collect()
    }

    fn condition(&self, at: usize, value: i32) -> String {
        let operand = &self.bench.watched[at];
        match operand.cell {
            Cell::Word(_) => {
                let text = self.bench.subject.symbols().layout.text(operand.cell, value);
                format!("{} == {text}", operand.name)
            }
            Cell::Bit(_) | Cell::WordBit(_) if value == 0 => format!("!{}", operand.name),
            Cell::Bit(_) | Cell::WordBit(_) => operand.name.clone(),
        }
    }
}

/// A scenario without its name. `expected`: the lines behind a stay.
fn scenario_text(scenario: &[InputStay], mut expected: impl FnMut(usize) -> Vec<String>) -> String {
    let mut text = format!("\n[[scenario]]\nname  = {NAME}\nsteps = [\n");
    for (at, stay) in scenario.iter().enumerate() {
        let mut lines = stay.sets.clone();
        lines.push(format!("run {} scans", stay.scans));
        lines.extend(expected(at));
        lines.iter().for_each(|line| text += &format!("    {},\n", quoted(line)));
    }
    text + "]\n"
}

/// A number below another one.
fn below(random: &mut SplitMix64, end: u64) -> u64 {
    random.next() % end.max(1)
}
