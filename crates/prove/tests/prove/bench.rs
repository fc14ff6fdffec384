//! Models of ladders in text.

use rungd_base::scan_period::ScanPeriod;
use rungd_engine::Cell;
use rungd_language::lower::judged::{Judges, lower_judged};
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::condition::ConditionNames;
use rungd_language::resolve::program::{Contact, Program};
use rungd_language::source::condition::condition;
use rungd_language::source::span::Span;
use rungd_prove::events::ModelEvents;
use rungd_prove::model::{FreeInput, ProofModel, ProofStart};
use rungd_test_support::run::{cell, load};

/// The period of these models, ms.
pub const PERIOD_MS: u32 = 10;

/// A ladder with conditions about it.
#[derive(Clone, Copy, Default)]
pub struct Asked<'a> {
    pub ladder: &'a str,
    /// Bits that may change before each scan, by their names.
    pub inputs: &'a [&'a str],
    pub assume: &'a [&'a str],
    /// The conditions of [`ProofModel::judged`].
    pub judged: &'a [&'a str],
}

/// The model of a ladder.
pub fn model(asked: Asked) -> ProofModel {
    let program = load(asked.ladder).unwrap_or_else(|e| panic!("{}: {e}", asked.ladder));
    model_of(&program, asked)
}

/// The same of a program that is loaded already.
pub fn model_of(program: &Program, asked: Asked) -> ProofModel {
    let contacts = |texts: &[&str]| texts.iter().map(|text| contact(program, text)).collect();
    let (before, behind): (Vec<Contact>, Vec<Contact>) =
        (contacts(asked.assume), contacts(asked.judged));
    let lowered =
        lower_judged(program, Judges { before: &before, behind: &behind, ..Judges::default() });
    let (_, symbols) = rungd_language::lower::lower(program);
    let input = |name: &&str| {
        let Ok(Cell::Bit(bit)) = cell(program, &symbols, name) else { panic!("{name} is no bit") };
        // The judges' blocks move the cells of the program's own bits, not those of addresses.
        let address = symbols.layout.address(Cell::Bit(bit)).expect("an address");
        let cell = lowered.code.layout.cell(address).expect("a cell");
        FreeInput { cell, low: 0, high: 1, cold: None }
    };
    ProofModel {
        period: ScanPeriod::of_ms(PERIOD_MS),
        late_max: 1,
        start: ProofStart::Cold(Vec::new()),
        inputs: asked.inputs.iter().map(input).collect(),
        assumed: lowered.before,
        judged: lowered.behind,
        code: lowered.code,
        events: ModelEvents::default(),
        stage_starts: Vec::new(),
    }
}

fn contact(program: &Program, text: &str) -> Contact {
    let written = condition(text, Span::default());
    let written = written.unwrap_or_else(|found| panic!("{text}: {}", found.message));
    let options = LoadOptions::default();
    let mut names = ConditionNames::of(program, &options);
    match names.resolve(&written) {
        Ok(resolved) => resolved.contact,
        Err(found) => panic!("{text}: {}", found[0].message),
    }
}
