//! Compares the answers of `why` with an independent judge: random ladders, random questions.
//!
//! The judge executes the tape again operation by operation and observes the cell (`trace`). It
//! reads the contacts that an answer names from the ladder's text, with its own reader
//! (`contacts`). It tries the proposed change (`verdict`). `RUNGD_WHY_QUESTIONS` (160) is the
//! number of questions, `RUNGD_WHY_SEED` (1) the first seed.

mod bench;
mod contacts;
mod page;
mod pictures;
mod speed;
mod trace;
mod verdict;

use bench::Bench;
use rungd_history::observe::{Cause, Limits, QuestionTime};
use rungd_test_support::model::rng::Rng;
use rungd_test_support::setting::setting;
use std::collections::BTreeMap;

/// The number of questions about one ladder.
const OF_ONE: u64 = 20;

#[test]
fn why_agrees_with_an_independent_judge() {
    let questions = setting("RUNGD_WHY_QUESTIONS", 160);
    let first = setting("RUNGD_WHY_SEED", 1);
    let mut count = 0;
    let mut kinds: BTreeMap<&str, u64> = BTreeMap::new();
    for seed in first.. {
        let bench = Bench::new(seed);
        let mut rng = Rng::new(seed ^ 0x7768_7920);
        for _ in 0..OF_ONE {
            if count == questions {
                println!("{count} questions: {kinds:?}");
                return;
            }
            let is_lively = rng.chance(70) && !bench.lively.is_empty();
            let of = if is_lively { &bench.lively } else { &bench.operands };
            let name = rng.pick(of).clone();
            let at = match rng.chance(50) {
                true => QuestionTime::Now,
                false => QuestionTime::Scan(rng.below(bench.scans as usize) as u64),
            };
            let mut past = bench.sections.clone();
            let cell = bench.cell(&name).expect("it is an operand");
            let limits = Limits { depth: 2, ..Limits::default() };
            let answer = bench.subject.why(&mut past, cell, at, limits);
            let answer = answer.unwrap_or_else(|refusal| panic!("seed {seed}: {refusal:?}"));
            *kinds.entry(kind(&answer.root.write.cause)).or_default() += 1;
            if let Err(wrong) = verdict::judge(&bench, cell, at, &answer, &mut rng) {
                panic!(
                    "seed {seed}, why {name} at {at:?}: {wrong}\n{}\n{}\n{}",
                    answer.text(),
                    bench.case.ladder(),
                    bench.case.stimulus(),
                );
            }
            let _ = answer.json();
            count += 1;
        }
    }
}

fn kind(cause: &Cause) -> &'static str {
    match cause {
        Cause::Instruction { .. } => "instruction",
        Cause::Pass { .. } => "pass",
        Cause::Turn { .. } => "turn",
        Cause::Force { .. } => "force",
        Cause::Outside { .. } => "outside",
        Cause::Status => "status",
        Cause::Controller => "controller",
        Cause::Resumed => "resumed",
        Cause::Initial => "initial",
        Cause::Restored => "restored",
        Cause::Older(_) => "older",
    }
}
