//! The verdict: the named write, the named contacts, and the proposed change.

use super::bench::Bench;
use super::contacts::{Reader, Tree};
use super::trace::{By, Instruction, Trace, content, trace};
use rungd_engine::{Cell, Engine, EngineCall, ScanTimes};
use rungd_history::observe::{
    Cause, ContactDetail, ContactSeen, Edit, Explanation, Followed, Hindrance, LegSeen, Node,
    Place, QuestionTime, Remedy, RungName, Since, Stop,
};
use rungd_language::lower::lower;
use rungd_test_support::model::rng::Rng;
use std::collections::BTreeMap;

/// The number of random assignments of contacts that are tried.
const TRIES: u64 = 40;

pub fn judge(
    bench: &Bench,
    cell: Cell,
    at: QuestionTime,
    answer: &Explanation,
    rng: &mut Rng,
) -> Result<(), String> {
    let trace = trace(bench, cell, at);
    if trace.state.value(cell) != answer.root.value {
        return Err(format!("the value is {}", trace.state.value(cell)));
    }
    write(bench, &trace, answer)?;
    changed(bench, &trace, answer)?;
    if let Some(cause) = answer.changed.as_ref().and_then(|changed| changed.cause.as_ref()) {
        reasons(bench, cause, rng)?;
    }
    node(bench, &answer.root, rng)?;
    match &answer.change {
        Some(found) => change(bench, cell, &trace, found),
        None => Ok(()),
    }
}

/// (a) The named write is that of the judge's trace.
fn write(bench: &Bench, trace: &Trace, answer: &Explanation) -> Result<(), String> {
    let write = &answer.root.write;
    if trace.forced {
        return match write.cause {
            Cause::Force { .. } => Ok(()),
            _ => Err("it is forced".to_owned()),
        };
    }
    let expected = trace.expected();
    if write.in_last_scan && write.before.is_none() && is_unjudged(&write.cause, bench) {
        return Ok(());
    }
    let Some(step) = expected else {
        return match write.cause {
            Cause::Initial | Cause::Restored | Cause::Older(_) => Ok(()),
            _ => Err("nothing wrote it".to_owned()),
        };
    };
    let same = is_by(bench, trace, &step.by, &write.cause);
    let scan = scan_of(write.since);
    if !same || scan != step.scan || write.before.is_some() != step.changed {
        let text = match &step.by {
            By::Instruction(number) | By::Pass(number) => {
                let of = &trace.instructions[*number as usize];
                format!(" ({}, rung {}: {})", of.element, of.rung, of.text)
            }
            _ => String::new(),
        };
        return Err(format!("the judge found {step:?}{text}"));
    }
    Ok(())
}

fn scan_of(since: Since) -> Option<u64> {
    match since {
        Since::At(when) => when.scan,
        Since::Before(_) => None,
    }
}

/// Whether a cause equals the judge's.
fn is_by(bench: &Bench, trace: &Trace, by: &By, cause: &Cause) -> bool {
    let is_it = |number: u32, rung: &RungName, place: &Place| {
        let of = &trace.instructions[number as usize];
        let Instruction { element, rung: at, branch, text, .. } = of;
        (element, *at, *branch, text) == (&rung.element.name, rung.number, rung.branch, &place.text)
    };
    match (by, cause) {
        (By::Instruction(number), Cause::Instruction { rung, place, .. })
        | (By::Pass(number), Cause::Pass { rung, place, .. }) => is_it(*number, rung, place),
        (By::Turn(block), Cause::Turn { block: of, .. }) => {
            bench.case.blocks[*block as usize].name == of.name
        }
        (By::Write, Cause::Outside { .. })
        | (By::Force, Cause::Force { .. })
        | (By::Controller, Cause::Controller | Cause::Resumed) => true,
        _ => false,
    }
}

/// (a) The answer names the last change if and only if the last scan only wrote the same value
/// again. The scan and the cause of this change are those of the judge's trace.
fn changed(bench: &Bench, trace: &Trace, answer: &Explanation) -> Result<(), String> {
    let write = &answer.root.write;
    let is_step = matches!(write.cause, Cause::Instruction { .. } | Cause::Pass { .. });
    let is_again = is_step && write.in_last_scan && write.before.is_none();
    let last = trace.steps.iter().rfind(|step| step.changed);
    let is_older = last.is_none_or(|step| step.scan != trace.scan);
    let Some(changed) = &answer.changed else {
        return match is_again && is_older {
            true => Err(format!("it changed last before that: {last:?}")),
            false => Ok(()),
        };
    };
    if !is_again || !is_older {
        return Err("the last change is that of the last write".to_owned());
    }
    let is_bit = answer.root.operand.is_bit;
    let same = match (last, &changed.cause) {
        (None, Some(Cause::Initial | Cause::Restored)) => true,
        (Some(_), None) if !is_bit => true,
        // The cause is the instruction that wrote in the last scan.
        (Some(step), None) => is_by(bench, trace, &step.by, &write.cause),
        (Some(step), Some(cause)) => is_bit && is_by(bench, trace, &step.by, cause),
        (None, _) => false,
    };
    let scan = last.and_then(|step| step.scan);
    if !same || scan_of(changed.since) != scan || changed.before.is_some() != last.is_some() {
        return Err(format!("it changed last by {last:?}, and {changed:?} was told"));
    }
    Ok(())
}

/// Whether the cause is an instruction whose writes of an unchanged value the judge does not
/// detect.
fn is_unjudged(cause: &Cause, bench: &Bench) -> bool {
    let Cause::Instruction { place, .. } = cause else { return false };
    let words: Vec<&str> = place.text.split_whitespace().collect();
    let to = words.iter().find_map(|word| word.strip_prefix("to="));
    let target = to.unwrap_or(words.get(1).copied().unwrap_or_default());
    matches!(words[0], "COPY" | "FILL" | "UNPACK") || bench.cell(target).is_none()
}

/// (b) The named contacts decide the leg. (c) None of them can be left out. Checks this for the
/// operand and for everything that is named below it.
fn node(bench: &Bench, of: &Node, rng: &mut Rng) -> Result<(), String> {
    reasons(bench, &of.write.cause, rng)?;
    for idle in &of.idle {
        match &idle.because {
            Hindrance::Stopped(_, next) => followed(bench, next, rng)?,
            Hindrance::Legs(legs) => {
                legs.iter().try_for_each(|leg| check_leg(bench, leg, rng))?;
            }
        }
    }
    Ok(())
}

fn reasons(bench: &Bench, of: &Cause, rng: &mut Rng) -> Result<(), String> {
    match of {
        Cause::Instruction { legs, operands, .. } => {
            for leg in legs {
                check_leg(bench, leg, rng)?;
            }
            operands.iter().try_for_each(|read| followed(bench, &read.followed, rng))?;
        }
        Cause::Pass { stop: Stop::Bit(of), .. } | Cause::Turn { running: Some(of), .. } => {
            node(bench, of, rng)?;
        }
        Cause::Pass { stop: Stop::Again(_, Some(of)), .. }
        | Cause::Turn { restart: Some(of), .. } => {
            of.legs.iter().try_for_each(|leg| check_leg(bench, leg, rng))?;
        }
        _ => {}
    }
    Ok(())
}

fn followed(bench: &Bench, of: &Followed, rng: &mut Rng) -> Result<(), String> {
    match of {
        Followed::Node(of) => node(bench, of, rng),
        Followed::Cut(_) => Ok(()),
    }
}

fn contact(bench: &Bench, of: &ContactSeen, rng: &mut Rng) -> Result<(), String> {
    match &of.detail {
        ContactDetail::Bit(_, next) => followed(bench, next, rng),
        ContactDetail::Element { bit, index } => {
            bit.iter().try_for_each(|(_, next)| followed(bench, next, rng))?;
            followed(bench, &index.followed, rng)
        }
        ContactDetail::Compare { sides, .. } => {
            sides.iter().try_for_each(|side| followed(bench, &side.followed, rng))
        }
        ContactDetail::Computed { operands, .. } => {
            operands.iter().try_for_each(|read| followed(bench, &read.followed, rng))
        }
        ContactDetail::Edge { inner, .. } => {
            inner.iter().try_for_each(|one| contact(bench, one, rng))
        }
    }
}

fn check_leg(bench: &Bench, leg: &LegSeen, rng: &mut Rng) -> Result<(), String> {
    let mut reader = Reader::new(&bench.text, &bench.subject);
    let series = leg.series.iter();
    let tree = series.map(|place| reader.read(place.start as usize, place.end as usize));
    let tree = Tree::All(tree.collect());
    let leaves = reader.leaves;
    let mut named = BTreeMap::new();
    for of in &leg.contacts {
        let leaf = leaves.iter().find(|leaf| leaf.start == of.place.start as usize);
        let leaf = leaf.ok_or_else(|| format!("`{}` is no contact of the leg", of.place.text))?;
        named.insert(leaf.key.clone(), of.on);
    }
    let mut free: Vec<&String> = leaves.iter().map(|leaf| &leaf.key).collect();
    free.sort();
    free.dedup();
    free.retain(|key| !named.contains_key(*key));
    let power = |named: &BTreeMap<String, bool>, rest: u64| {
        let on = |at: usize| {
            let key = &leaves[at].key;
            let place = || free.iter().position(|free| *free == key).unwrap_or(0);
            named.get(key).copied().unwrap_or_else(|| rest >> (place() % 64) & 1 == 1)
        };
        tree.is_on(&on)
    };
    for _ in 0..TRIES {
        if power(&named, rng.next()) != leg.on {
            return Err(format!("{named:?} do not decide the leg {:?}", texts(leg)));
        }
    }
    for key in named.keys() {
        let mut other = named.clone();
        other.entry(key.clone()).and_modify(|on| *on = !*on);
        let exhaustive = free.len() <= 12;
        let tries = if exhaustive { 1u64 << free.len() } else { 4096 };
        let flips = (0..tries)
            .any(|rest| power(&other, if exhaustive { rest } else { rng.next() }) != leg.on);
        if !flips {
            return Err(format!("{key} of {named:?} can be left out of {:?}", texts(leg)));
        }
    }
    let all = leg.contacts.iter().chain(&leg.also_off);
    all.into_iter().try_for_each(|of| contact(bench, of, rng))
}

fn texts(leg: &LegSeen) -> Vec<&str> {
    leg.series.iter().map(|place| place.text.as_str()).collect()
}

/// (d) The proposed change changes the value, and no single input that would do so was missed.
fn change(bench: &Bench, cell: Cell, trace: &Trace, found: &Remedy) -> Result<(), String> {
    let mut engine = Engine::new(lower(&bench.program).0);
    let value = trace.state.value(cell);
    let mut turns_over = |edits: &[Edit]| {
        assert!(engine.resume(&trace.state), "it is the same program");
        let period_ns = bench.case.period as u64 * 1_000_000;
        let now_ns = match trace.scan {
            Some(0) | None => trace.state.now_ns() + 10_000_000,
            Some(_) => trace.state.now_ns() + period_ns,
        };
        engine.apply(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
        for edit in edits {
            match edit {
                Edit::Write { operand, value } => {
                    engine.apply(EngineCall::Write(operand.cell, *value));
                }
                Edit::Run { block } => {
                    let at = bench.program.blocks.iter().position(|of| of.name == block.name);
                    engine.try_run(rungd_engine::isa::BlockId(at.expect("a block") as u32));
                }
            }
        }
        engine.apply(EngineCall::Execute);
        content(engine.image(), cell) != value
    };
    match found {
        Remedy::Release if trace.forced => return Ok(()),
        Remedy::Release => return Err("it is not forced".to_owned()),
        Remedy::NoScan if !trace.runs => return Ok(()),
        Remedy::NoScan => return Err("it scans".to_owned()),
        Remedy::Itself if turns_over(&[]) => return Ok(()),
        Remedy::Itself => return Err("it does not turn over by itself".to_owned()),
        Remedy::Edits(edits) if !turns_over(edits) => {
            return Err(format!("it does not turn over: {edits:?}"));
        }
        Remedy::Edits(edits) if edits.len() == 1 => return Ok(()),
        Remedy::Edits(_) => {}
        Remedy::None(end) if !end.every_single => return Ok(()),
        Remedy::None(_) => {}
    }
    for input in ["X0", "X1", "X2", "X3"] {
        let at = bench.cell(input).expect("an input");
        let operand = rungd_history::observe::OperandName {
            cell: at,
            name: input.to_owned(),
            address: None,
            doc: None,
            is_bit: true,
            is_real: false,
            texts: None,
            is_time: false,
        };
        let edit = Edit::Write { operand, value: 1 - trace.state.value(at) };
        if turns_over(&[edit]) {
            return Err(format!("{input} alone turns it over, and {found:?} was proposed"));
        }
    }
    Ok(())
}
