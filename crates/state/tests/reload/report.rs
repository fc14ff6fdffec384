//! Compares the difference report with the engine's memory after the swap, for random pairs of
//! programs: one from the reference model's generator, the other an edited copy of it.
//!
//! Tests `RUNGD_PROPERTY_PROGRAMS` (30) pairs from the seed `RUNGD_PROPERTY_SEED` (1) on.

#[allow(dead_code, unused_imports)]
use std::collections::HashSet;

use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Bit, BitSpace, BlockId, StageId};
use rungd_engine::{Cell, Engine, EngineCall, Image, ScanTimes};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_state::reload::{FileTexts, LoweredProgram, OldMemory, ReloadPlan};
use rungd_test_support::model::case::{BUILTIN, Case, Rung, Tag};
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::run;
use rungd_test_support::setting::setting;

struct Loaded {
    program: Program,
    code: rungd_engine::EngineProgram,
    symbols: Symbols,
}

impl Loaded {
    fn new(case: &Case) -> Option<Loaded> {
        let program = run::load(&case.ladder()).ok()?;
        let (code, symbols) = lower(&program);
        Some(Loaded { program, code, symbols })
    }

    fn side(&self) -> LoweredProgram<'_> {
        LoweredProgram { program: &self.code, symbols: &self.symbols }
    }

    fn value(&self, image: &Image, name: &str) -> i64 {
        let cell = run::cell(&self.program, &self.symbols, name);
        run::value(image, cell.unwrap_or_else(|error| panic!("{name}: {error}")))
    }
}

/// The lists of rungs of a block: its own, then its Stages'.
fn elements(case: &mut Case, block: usize) -> Vec<&mut Vec<Rung>> {
    let block = &mut case.blocks[block];
    let stages = block.stages.iter_mut().map(|stage| &mut stage.rungs);
    std::iter::once(&mut block.rungs).chain(stages).collect()
}

/// Removes or moves a block, a Stage or a rung.
fn edit(case: &mut Case, rng: &mut Rng) {
    let block = rng.below(case.blocks.len());
    let fixed = |name: &str| name == "Main" || BUILTIN.contains(&name);
    match rng.below(8) {
        0 if !fixed(&case.blocks[block].name) => {
            let gone = case.blocks.remove(block);
            case.order = case.order.take().map(|mut order| {
                order.retain(|name| *name != gone.name);
                order
            });
            forget(case, &gone.name);
        }
        1 if !case.blocks[block].stages.is_empty() => {
            let count = case.blocks[block].stages.len();
            case.blocks[block].stages.remove(rng.below(count));
        }
        2 if !case.blocks[block].stages.is_empty() => {
            let count = case.blocks[block].stages.len();
            case.blocks[block].stages.swap(0, rng.below(count));
        }
        3 | 4 => {
            let mut lists = elements(case, block);
            let (from, to) = (rng.below(lists.len()), rng.below(lists.len()));
            if !lists[from].is_empty() {
                let at = rng.below(lists[from].len());
                let rung = lists[from].remove(at);
                lists[to].push(rung);
            }
        }
        _ => {
            let mut lists = elements(case, block);
            let at = rng.below(lists.len());
            if !lists[at].is_empty() {
                let rung = rng.below(lists[at].len());
                lists[at].remove(rung);
            }
        }
    }
}

/// Removes every rung that names a block.
fn forget(case: &mut Case, name: &str) {
    for block in 0..case.blocks.len() {
        for list in elements(case, block) {
            list.retain(|rung| !format!("{rung:?}").contains(name));
        }
    }
}

fn tag(name: &str, body: &str) -> Tag {
    let body = format!("{body}, spare = true");
    Tag { name: name.to_owned(), body, watched: Vec::new() }
}

/// Arrays with a `type`, which every program has.
fn with_arrays(mut case: Case) -> Case {
    case.tags
        .push(tag("m_bits", "type = \"bit\", count = 4, initial = [true, false, true, false]"));
    case.tags.push(tag("m_ints", "type = \"int\", count = 3, initial = [100, 7, 3]"));
    case.tags.push(tag("m_reals", "type = \"real\", count = 2"));
    case.tags.push(tag("k_ints", "at = \"D4000\", count = 3, initial = [11, 12, 13]"));
    case
}

/// Adds tags that move the places of the arrays.
fn push_arrays(case: &mut Case, rng: &mut Rng) {
    for (n, kind) in ["bit", "int", "real"].iter().enumerate() {
        let count = rng.below(4);
        if count == 0 {
            continue;
        }
        case.tags.push(tag(&format!("a{n}"), &format!("type = \"{kind}\", count = {count}")));
    }
}

/// Moves or renames the array with addresses, or leaves it.
fn move_addresses(case: &mut Case, rng: &mut Rng) {
    let Some(array) = case.tags.iter_mut().find(|tag| tag.name == "k_ints") else { return };
    match rng.below(4) {
        0 => array.body = array.body.replace("D4000", "D4001"),
        1 => array.body = array.body.replace("D4000", "D4010"),
        2 => array.name = "k_others".to_owned(),
        _ => {}
    }
}

/// Tries a few random edits, and returns the first one that can be loaded.
fn edited(case: &Case, rng: &mut Rng) -> Option<Loaded> {
    (0..20).find_map(|_| {
        let mut other = case.clone();
        push_arrays(&mut other, rng);
        move_addresses(&mut other, rng);
        (0..1 + rng.below(4)).for_each(|_| edit(&mut other, rng));
        Loaded::new(&other)
    })
}

struct Swap<'a> {
    old: &'a Loaded,
    new: &'a Loaded,
    bits: Vec<u8>,
    words: Vec<i32>,
    /// The new memory right after the swap.
    after: &'a Image,
    plan: &'a ReloadPlan,
}

impl Swap<'_> {
    fn was_on(&self, bit: Bit) -> bool {
        self.bits[self.old.symbols.layout.bit(bit).0 as usize] != 0
    }

    /// Whether the engine does not transfer a tag's value.
    fn leaves(&self, tag: &str) -> bool {
        let cell = |of: &Loaded| run::cell(&of.program, &of.symbols, tag).expect(tag);
        self.plan.transfer.cell(cell(self.old)) != Some(cell(self.new))
    }

    /// The number of elements, in an array of three words, whose value differs after the swap.
    fn differing(&self, array: &str) -> usize {
        let differs = |n: &i32| {
            let name = format!("{array}[{n}]");
            let cell = run::cell(&self.old.program, &self.old.symbols, &name);
            let Ok(Cell::Word(at)) = cell else { panic!("{name}") };
            i64::from(self.words[at.0 as usize]) != self.new.value(self.after, &name)
        };
        (0..3).filter(differs).count()
    }

    /// The accumulator of a structure of the new program.
    fn acc(&self, of: &str) -> String {
        let of = of.trim_start_matches('(').trim_end_matches(')');
        let sensaphone = format!("{of}.ACC");
        match run::cell(&self.new.program, &self.new.symbols, &sensaphone) {
            Ok(_) => sensaphone,
            Err(_) => format!("{of}.Acc"),
        }
    }

    /// Whether the claim of a line of the report is true.
    fn holds(&self, line: &str) -> bool {
        let words: Vec<&str> = line.split_whitespace().collect();
        let new = |name: &str| self.new.value(self.after, name);
        let old_block = |name: &str| {
            let mut blocks = self.old.symbols.names.blocks.iter();
            let at = blocks.position(|block| block.name == name).expect(line);
            self.was_on(Bit::Running(BlockId(at as u32)))
        };
        let old_stage = |name: &str| {
            let mut stages = self.old.symbols.names.stages.iter();
            let at = stages.position(|stage| stage.whole == name).expect(line);
            self.was_on(Bit::Stage(StageId(at as u32)))
        };
        match words[..] {
            ["Program" | "Task", block, "continues", "to", "run"] => new(&running(block)) == 1,
            ["Program" | "Task" | "Subroutine", block, "is", "gone", "and", ..] => old_block(block),
            ["Program" | "Task" | "Subroutine", block, "is", "gone;", ..] => !old_block(block),
            ["Subroutine", block, "is", "not", "called", .., "terminated"] => old_block(block),
            ["Subroutine", block, "is", "not", "called", ..] => !old_block(block),
            ["Subroutine", ..] => true,
            ["Task", block, "is", "disabled", ..] => old_block(block) && new(&running(block)) == 0,
            ["Program" | "Task", block, "is", "new,", "and", "starts"] => new(&running(block)) == 1,
            ["Program" | "Task", block, "is", "new"] => new(&running(block)) == 0,
            ["Program", block, "begins", "at", "its", "Stage", stage] => {
                // A Program that was just restarted has not run yet, so none of its Stages is ON.
                let begin = format!("{block}.");
                let mut stages = self.new.symbols.names.stages.iter().map(|stage| &stage.whole);
                new(stage) == 1 || !stages.any(|name| name.starts_with(&begin) && new(name) == 1)
            }
            ["Stage", stage, "stays", "ON"] => old_stage(stage) && new(stage) == 1,
            ["Stage", stage, "is", "gone", "and", ..] => old_stage(stage),
            ["Stage", stage, "is", "gone;", ..] => !old_stage(stage),
            [bit, "is", "not", "driven", .., "goes", "OFF"] => new(bit) == 0,
            ["warning:", bit, "stays", "ON,", ..] => new(bit) == 1,
            ["tag", tag, "moved", ..] | ["warning:", "tag", tag, "moved", ..] => self.leaves(tag),
            ["array", array, "moved", .., "the", "same"] => {
                self.leaves(&format!("{array}[0]")) && self.differing(array) == 0
            }
            ["warning:", "array", array, "moved", _, _, _, _, count, "of", "3", ..] => {
                self.leaves(&format!("{array}[0]")) && self.differing(array).to_string() == count
            }
            ["array", array, _, "was", "renamed", "to", now] => (0..3).all(|n| {
                let [from, to] = [(self.old, array), (self.new, now)].map(|(of, name)| {
                    run::cell(&of.program, &of.symbols, &format!("{name}[{n}]")).expect(line)
                });
                self.plan.transfer.cell(from) == Some(to)
            }),
            [.., "any", "more"] => true,
            [of, "keeps", ..] | [_, of, "keeps", ..] => {
                let name = self.acc(of);
                let cell = run::cell(&self.old.program, &self.old.symbols, &name).unwrap();
                let Cell::Word(at) = cell else { panic!("{line}") };
                i64::from(self.words[at.0 as usize]) == new(&name)
            }
            [of, "is", "new"] | [of, "starts", "again:", ..] => new(&self.acc(of)) == 0,
            [_, of, "is", "new"] | [_, of, "starts", "again:", ..] => new(&self.acc(of)) == 0,
            _ => true,
        }
    }

    /// Blocks that stopped running and bits that went OFF without a line of the report.
    fn missed(&self, report: &[String]) -> Vec<String> {
        let says = |begin: String| report.iter().any(|line| line.starts_with(&begin));
        let mut missed = Vec::new();
        let is_subroutine = |id: BlockId| self.old.program.block(id).is_subroutine();
        let blocks = self.plan.transfer.blocks.iter();
        for (from, to) in blocks.filter(|(from, _)| !is_subroutine(*from)) {
            let name = &self.old.symbols.names.block(*from).name;
            let (was, is) =
                (self.was_on(Bit::Running(*from)), self.new.value(self.after, &running(name)) == 1);
            let told = ["disabled", "continues"].map(|what| {
                ["Task", "Program"].iter().any(|kind| {
                    report
                        .iter()
                        .any(|l| l.starts_with(&format!("{kind} {name} ")) && l.contains(what))
                })
            });
            let silent = name == "Main" || BUILTIN.contains(&name.as_str());
            if !silent && told != [was && !is, was && is] {
                missed.push(format!("{name} ({to:?}): {was} → {is}, told {told:?}"));
            }
        }
        let is_gone = |line: &&String| line.contains("is gone") || line.contains("is not called");
        let gone = report.iter().any(|line| is_gone(&line));
        for n in (0..2048).filter(|_| !gone) {
            for space in [BitSpace::Y, BitSpace::C] {
                let bit = Bit::Space(space, n);
                if !self.was_on(bit) {
                    continue;
                }
                // A tag with a `type` keeps its bit when its place changes.
                let from = Cell::Bit(self.old.symbols.layout.bit(bit));
                let to = self.plan.transfer.cell(from);
                let is_on = matches!(to, Some(Cell::Bit(to)) if self.after.bit(to));
                let named = says(
                    self.old.symbols.names.address(rungd_engine::isa::Address::Bit(bit)) + " ",
                ) || report
                    .iter()
                    .any(|l| l.contains(&format!("({bit}) ")) || l.contains("is new"));
                if !is_on && !named {
                    missed.push(format!("{bit} went OFF"));
                }
            }
        }
        missed
    }
}

fn running(block: &str) -> String {
    format!("{block}.Running")
}

/// Checks a swap; returns the number of lines in which the dry run's forecast differs.
fn judge(case: &Case, swap: &Swap<'_>, forecast: &[String], report: &[String]) -> usize {
    let seed = case.seed;
    let false_ones: Vec<_> = report.iter().filter(|line| !swap.holds(line)).collect();
    let missed = swap.missed(report);
    assert!(
        false_ones.is_empty() && missed.is_empty(),
        "seed {seed}: false {false_ones:#?}, missed {missed:#?}, of {report:#?}\n{}",
        case.ladder()
    );
    let (said, done): (HashSet<_>, HashSet<_>) =
        (forecast.iter().collect(), report.iter().collect());
    let undriven = |line: &&&String| !line.contains("is not driven in");
    assert_eq!(
        said.difference(&done).find(undriven),
        None,
        "seed {seed}: a dry run says otherwise: {report:#?}"
    );
    said.difference(&done).count()
}

#[test]
fn every_line_of_the_report_is_true_of_the_engine() {
    let first = setting("RUNGD_PROPERTY_SEED", 1);
    let (mut swaps, mut lines, mut otherwise) = (0, 0, 0);
    for seed in first..first + setting("RUNGD_PROPERTY_PROGRAMS", 30) {
        let mut rng = Rng::new(seed ^ 0x5eed);
        let case = with_arrays(generate(seed));
        let old = Loaded::new(&case).expect("it is generated so");
        let Some(new) = edited(&case, &mut rng) else { continue };
        let plan = ReloadPlan::new(old.side(), new.side());
        let look_up = |name: &str| run::target(&old.program, &old.symbols, name);
        let stimulus = Stimulus::parse(&case.stimulus(), &look_up).map_err(|e| e.message).unwrap();
        let (mut engine, mut next) = (Engine::new(old.code.clone()), 0);
        engine.start(0);
        let every = 1 + rng.below(9) as u64;
        for scan in 0..case.scans as u64 {
            engine.begin_scan(
                scan * case.period as u64 * 1_000_000,
                &ScanTimes::default(),
                &LocalTime::default(),
            );
            for change in stimulus.of_scan(scan, &mut next) {
                match change {
                    StimulusChange::Input(n, on) => engine.set_input(n, on),
                    StimulusChange::Bit(cell, on) => {
                        engine.apply(EngineCall::Write(cell, on.into()))
                    }
                    StimulusChange::Word(cell, value) => engine.write_word(cell, value),
                }
            }
            if engine.execute().last {
                break;
            }
            if scan % every != 0 {
                continue;
            }
            // The swap is made in a copy; the program itself continues unchanged.
            let mut copy = again(&mut engine, &old);
            let (bits, words) = (copy.image().bits().to_vec(), copy.image().words().to_vec());
            let (bits, words, passed) = (&bits[..], &words[..], None);
            let (before, after) = (&old.symbols, &new.symbols);
            let seen = OldMemory { old: before, new: after, bits, words, forces: &[], passed };
            let forecast = plan.report(&seen, FileTexts::default());
            let mut other = Engine::new(new.code.clone());
            other.adopt(&mut copy, &plan.transfer, true, &[]);
            let seen = OldMemory { passed: Some(copy.image().bits()), ..seen };
            let report = plan.report(&seen, FileTexts::default());
            let after = other.image();
            let swap = Swap {
                old: &old,
                new: &new,
                bits: bits.to_vec(),
                words: words.to_vec(),
                after,
                plan: &plan,
            };
            otherwise += judge(&case, &swap, &forecast, &report);
            (swaps, lines) = (swaps + 1, lines + report.len());
        }
    }
    println!("{swaps} swaps, {lines} lines, {otherwise} of them forecast otherwise");
}

/// A copy of the engine, made by a reload of the identical program, which leaves no trace.
fn again(engine: &mut Engine, of: &Loaded) -> Engine {
    let mut copy = Engine::new(of.code.clone());
    copy.adopt(engine, &ReloadPlan::new(of.side(), of.side()).transfer, true, &[]);
    copy
}
