//! A tape for tests: an engine in virtual time, and all calls that were made to it.

use std::sync::Arc;

use expect_test::Expect;

use crate::observe::{Explanation, Limits, QuestionTime, Subject};
use rungd_engine::{Cell, Engine, EngineCall, EngineState, ScanTimes};
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::exchange::Mode;
use rungd_runtime::{Origin, SectionStart, TapeEntry, TapeSection};

/// The scans of a section.
const SECTION_SCANS: u64 = 10;

pub struct Tape {
    pub subject: Subject,
    engine: Engine,
    pub sections: Vec<Arc<TapeSection>>,
    now: TapeSection,
    pub number: u64,
    pub now_ns: u64,
}

/// A started controller. `main`: the rungs of Main, and the rest of the file.
pub fn tape(main: &str) -> Tape {
    let mut tape = ladder(&format!("[[program]]\nname = \"Main\"\n{main}\n"));
    tape.call(EngineCall::Start { now_ns: 0 });
    tape
}

/// A controller that is not started yet.
pub fn ladder(text: &str) -> Tape {
    let file = SourceFile { name: "a.toml".into(), text: text.into() };
    let (program, findings) = load_ladders(std::slice::from_ref(&file), &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:?}"));
    let subject = Subject::new(Arc::new(program), vec![file]);
    let engine = Engine::new(subject.seen.clone());
    let now = section(&engine, 0);
    Tape { subject, engine, sections: Vec::new(), now, number: 0, now_ns: 0 }
}

fn section(engine: &Engine, number: u64) -> TapeSection {
    TapeSection {
        start: SectionStart {
            generation: 1,
            number,
            mode: Mode::Run,
            unix_offset_ns: 0,
            lost: 0,
            follows: number > 0,
        },
        state: EngineState::of(engine),
        entries: Vec::new(),
        who: Vec::new(),
    }
}

impl Tape {
    pub fn call(&mut self, call: EngineCall) {
        self.engine.apply(call);
        self.now.entries.push(TapeEntry::Call(call));
    }

    pub fn entry(&mut self, entry: TapeEntry) {
        self.now.entries.push(entry);
    }

    pub fn from(&mut self, origin: Origin, who: &str) {
        self.now.entries.push(TapeEntry::Origin(origin));
        self.now.who.push((origin, who.to_owned()));
    }

    pub fn cell(&self, name: &str) -> Cell {
        self.subject.cell(name).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn begin(&mut self) {
        if self.number.is_multiple_of(SECTION_SCANS) && self.number > 0 {
            self.cut();
        }
        let now_ns = self.now_ns;
        self.call(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
        self.now_ns += 10_000_000;
        self.number += 1;
    }

    /// One scan with these inputs and queued writes.
    pub fn scan(&mut self, writes: &[(&str, i32)]) {
        self.begin();
        for (name, value) in writes {
            let cell = self.cell(name);
            self.call(EngineCall::Write(cell, *value));
        }
        self.call(EngineCall::Execute);
    }

    pub fn scans(&mut self, count: u32) {
        (0..count).for_each(|_| self.scan(&[]));
    }

    /// A new section begins.
    pub fn cut(&mut self) {
        let next = section(&self.engine, self.number);
        self.sections.push(Arc::new(std::mem::replace(&mut self.now, next)));
    }

    pub fn answer(&self, name: &str, at: QuestionTime) -> Explanation {
        self.asked(name, at, Limits::default())
    }

    /// The answer for the current time, with limits.
    pub fn limited(&self, name: &str, limits: Limits) -> Explanation {
        self.asked(name, QuestionTime::Now, limits)
    }

    fn asked(&self, name: &str, at: QuestionTime, limits: Limits) -> Explanation {
        let mut past = self.sections.clone();
        past.push(Arc::new(self.now.clone()));
        let answer = self.subject.why(&mut past, self.cell(name), at, limits);
        answer.unwrap_or_else(|refusal| panic!("{refusal:?}"))
    }

    /// The answer for the current time, as text.
    pub fn why(&self, name: &str) -> String {
        self.answer(name, QuestionTime::Now).text()
    }

    pub fn write(&mut self, cell: Cell, value: i32) {
        self.call(EngineCall::Write(cell, value));
    }

    pub fn execute(&mut self) {
        self.call(EngineCall::Execute);
    }

    pub fn force(&mut self, name: &str, value: i32, who: &str) {
        self.from(Origin::Command(rungd_runtime::command::CommandId(1)), who);
        let cell = self.cell(name);
        self.call(EngineCall::Force(cell, value));
    }

    pub fn release(&mut self, name: &str) {
        let cell = self.cell(name);
        self.call(EngineCall::Release(cell));
    }
}

/// Checks the answer for the current time, as text.
pub fn check(plc: &Tape, name: &str, expected: Expect) {
    expected.assert_eq(&plc.why(name));
}
