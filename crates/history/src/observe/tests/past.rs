//! The tape: its end, its gaps, and the scan of a question.

use std::sync::Arc;

use super::tape::tape;
use crate::observe::answer::Cause;
use crate::observe::{Limits, Past, QuestionTime, Since, TapeEnd, WhyRefusal};
use rungd_engine::{Cell, EngineCall, WordCell};
use rungd_runtime::{TapeEntry, TapeSection};

const RUNG: &str = "[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"SET C0\"]\n";

/// The cause of C0, after some change of the sections.
fn cause(edit: impl Fn(&mut Vec<TapeSection>)) -> Result<Cause, WhyRefusal> {
    let mut plc = tape(RUNG);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    plc.scans(40);
    plc.cut();
    let mut sections: Vec<TapeSection> = plc.sections.iter().map(|of| (**of).clone()).collect();
    edit(&mut sections);
    let mut past: Vec<Arc<TapeSection>> = sections.into_iter().map(Arc::new).collect();
    let (cell, limits) = (plc.cell("C0"), Limits::default());
    let answer = plc.subject.why(&mut past, cell, QuestionTime::Now, limits);
    answer.map(|answer| answer.root.write.cause)
}

#[test]
fn the_search_ends_at_a_gap_of_the_recording() {
    assert!(matches!(cause(|_| {}), Ok(Cause::Instruction { .. })));
    let ends = [
        (TapeEnd::Lost, (false, 4, 1)),
        (TapeEnd::Restarted, (false, 0, 1)),
        (TapeEnd::Swapped, (true, 0, 2)),
    ];
    for (end, (follows, lost, generation)) in ends {
        let found = cause(|sections| {
            for section in &mut sections[2..] {
                section.start.generation = generation;
            }
            (sections[2].start.follows, sections[2].start.lost) = (follows, lost);
        });
        assert_eq!(found, Ok(Cause::Older(end)));
    }
    let oldest = cause(|sections| drop(sections.drain(..2)));
    assert_eq!(oldest, Ok(Cause::Older(TapeEnd::Oldest)));
}

#[test]
fn the_first_scan_of_a_process_has_the_number_one() {
    let mut plc = tape(RUNG);
    plc.scans(3);
    plc.cut();
    let cause = |follows: bool| {
        let mut first = (*plc.sections[0]).clone();
        (first.start.number, first.start.follows) = (1, follows);
        let mut past = vec![Arc::new(first)];
        let (cell, limits) = (plc.cell("C0"), Limits::default());
        let answer = plc.subject.why(&mut past, cell, QuestionTime::Now, limits);
        answer.map(|answer| answer.root.write.cause)
    };
    assert_eq!(cause(false), Ok(Cause::Initial));
    // The memory has dropped the older sections.
    assert_eq!(cause(true), Ok(Cause::Older(TapeEnd::Oldest)));
}

#[test]
fn the_search_ends_at_a_section_with_another_memory_layout() {
    let mut other = tape("[[program.rung]]\nwhen = [\"rise(X0)\"]\ndo = [\"SET C0\"]\n");
    other.scan(&[]);
    other.cut();
    let shape = other.sections[0].state.clone();
    let found = cause(|sections| sections[1].state = shape.clone());
    assert_eq!(found, Ok(Cause::Older(TapeEnd::Unreadable)));
    let wild = TapeEntry::Call(EngineCall::Write(Cell::Word(WordCell(u32::MAX)), 1));
    let found = cause(|sections| sections[1].entries.push(wild));
    assert_eq!(found, Ok(Cause::Older(TapeEnd::Unreadable)));
    let found = cause(|sections| sections.last_mut().expect("a section").entries.push(wild));
    assert_eq!(found, Err(WhyRefusal::NoPast));
    assert_eq!(cause(Vec::clear), Err(WhyRefusal::NoPast));
}

#[test]
fn a_recording_with_calls_out_of_order_does_not_panic() {
    let scrambled = cause(|sections| {
        for section in sections.iter_mut() {
            section.entries.reverse();
        }
    });
    assert!(scrambled.is_ok());
    let torn = cause(|sections| sections.iter_mut().for_each(|of| of.entries.truncate(5)));
    assert!(torn.is_ok());
}

#[test]
fn a_scan_is_found_by_its_number() {
    let mut plc = tape(RUNG);
    plc.scans(25);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("X0", 0)]);
    let before = plc.answer("C0", QuestionTime::Scan(24));
    assert_eq!((before.root.value, before.at.scan), (0, Some(24)));
    let after = plc.answer("C0", QuestionTime::Scan(25));
    assert_eq!((after.root.value, after.at.now_ns), (1, 250_000_000));
    assert!(matches!(after.root.write.since, Since::At(when) if when.scan == Some(25)));
    let mut past = plc.sections.clone();
    assert_eq!(past.count(), 2);
    let cell = plc.cell("C0");
    let asked = plc.subject.why(&mut past, cell, QuestionTime::Scan(70), Limits::default());
    assert_eq!(asked, Err(WhyRefusal::NoSuchScan { first: 0, last: 19 }));
}
