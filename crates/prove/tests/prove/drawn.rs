//! Random models: a program of the reference model's generator, with random inputs and conditions.

use rungd_engine::{Cell, Engine, EngineProgram, Transfer};
use rungd_language::lower::judged::{Judges, lower_judged};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::condition::ConditionNames;
use rungd_language::resolve::program::{Contact, Program};
use rungd_language::source::condition::condition;
use rungd_language::source::span::Span;
use rungd_prove::any::{AnyProgram, any_in};
use rungd_prove::model::{Choice, FreeInput, ProofModel, ProofStart};
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::run::{cell, load};

/// A model and the texts that it is made of.
pub struct Drawn {
    pub model: ProofModel,
    pub text: String,
    /// The program without judges, and the transfer from it to the model's.
    pub plain: EngineProgram,
    pub transfer: Transfer,
}

/// The numbers of conditions of a random model.
const JUDGED: usize = 4;

/// The model of a seed.
pub fn drawn(seed: u64) -> Drawn {
    drawn_with(seed, true)
}

/// The same, without cells that have any value.
pub fn drawn_without_any(seed: u64) -> Drawn {
    drawn_with(seed, false)
}

fn drawn_with(seed: u64, has_any: bool) -> Drawn {
    let case = generate(seed);
    let ladder = case.ladder();
    let program = load(&ladder).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
    let (plain, symbols) = lower(&program);
    let rng = Rng::new(seed ^ 0x5EED);
    let mut draw = Draw { rng, program: &program, symbols, names: case.watch() };
    let judged: Vec<(String, Contact)> = (0..JUDGED).map(|_| draw.condition()).collect();
    let assumed = draw.rng.below(3) / 2;
    let assumed: Vec<(String, Contact)> = (0..assumed).map(|_| draw.assumption()).collect();
    let contacts = |all: &[(String, Contact)]| all.iter().map(|(_, c)| c.clone()).collect();
    let (before, behind): (Vec<Contact>, Vec<Contact>) = (contacts(&assumed), contacts(&judged));
    let lowered =
        lower_judged(&program, Judges { before: &before, behind: &behind, ..Judges::default() });
    let mut inputs = Vec::new();
    for name in draw.inputs() {
        let address = program.scope().address(name).expect("an address");
        let cell = lowered.code.layout.cell(address).expect("a cell");
        let high = if cell.is_bit() { 1 } else { draw.rng.range(1, 2) as i32 };
        inputs.push(FreeInput { cell, low: 0, high, cold: None });
    }
    let any = if has_any { draw.any(&lowered.code, &inputs) } else { Vec::new() };
    let AnyProgram { code, inputs: values } = any_in(&lowered.code, &any);
    inputs.extend(values.iter().map(|value| value.input));
    let start = if has_any { draw.any(&lowered.code, &inputs) } else { Vec::new() };
    let start = start.into_iter().map(|input| {
        let cold = Engine::new(lowered.code.clone()).image().value(input.cell);
        let low = if input.cell.is_bit() { 0 } else { cold };
        FreeInput { low, high: low.saturating_add(1), cold: Some(cold), ..input }
    });
    inputs.extend(start);
    let late_max = if has_any && draw.rng.chance(30) { draw.rng.range(2, 3) as u32 } else { 1 };
    let texts = |all: &[(String, Contact)]| all.iter().map(|(text, _)| text.clone()).collect();
    let (assumed, judged): (Vec<String>, Vec<String>) = (texts(&assumed), texts(&judged));
    Drawn {
        transfer: lowered.judges.transfer(&plain, &lowered.code),
        plain,
        text: format!(
            "# seed {seed}\n{ladder}\n# assume {assumed:?}, judged {judged:?}, any {any:?}, late {late_max}, inputs {inputs:?}"
        ),
        model: ProofModel {
            period_ms: case.period as u32,
            late_max,
            start: ProofStart::Cold(Vec::new()),
            inputs,
            assumed: lowered.before,
            judged: lowered.behind,
            code,
        },
    }
}

struct Draw<'p> {
    rng: Rng,
    program: &'p Program,
    symbols: Symbols,
    /// All operands of the program.
    names: Vec<String>,
}

impl Draw<'_> {
    /// Three inputs; sometimes also a bit or a word that the ladder writes too.
    fn inputs(&mut self) -> Vec<&'static str> {
        let mut inputs = vec!["X0", "X1", "X2"];
        let others = ["D1", "C2", "V1", "MC2"];
        if self.rng.chance(25) {
            inputs.push(others[self.rng.below(others.len())]);
        }
        inputs
    }

    /// Sometimes a bit or word that has any value: always, or before the first scan.
    fn any(&mut self, code: &EngineProgram, inputs: &[FreeInput]) -> Vec<FreeInput> {
        let name = &self.names[self.rng.below(self.names.len())];
        let cell = cell(self.program, &self.symbols, name).expect("a cell");
        let address = self.symbols.layout.address(cell);
        let cell = address.and_then(|address| code.layout.cell(address));
        let cell = cell.filter(|cell| !inputs.iter().any(|input| input.cell == *cell));
        let is_plain = |cell: &Cell| !matches!(cell, Cell::WordBit(_));
        let any = cell.filter(is_plain).filter(|_| self.rng.chance(25));
        any.into_iter().map(|cell| FreeInput { cell, low: 0, high: 1, cold: None }).collect()
    }

    fn condition(&mut self) -> (String, Contact) {
        loop {
            let mut text = self.leaf();
            for _ in 0..self.rng.weighted(&[60, 30, 10]) {
                let sign = if self.rng.chance(50) { "&" } else { "|" };
                text = format!("{text} {sign} {}", self.leaf());
            }
            if let Some(contact) = self.contact(&text) {
                return (text, contact);
            }
        }
    }

    /// Contacts that are ON often.
    fn assumption(&mut self) -> (String, Contact) {
        let inputs = ["!(X0 & X1)", "X0 | X1", "!X2", "!(X1 & Y0)", "!X0 | !C0", "!X0 | C1 | X1"];
        let text = inputs[self.rng.below(inputs.len())];
        (text.to_string(), self.contact(text).expect("a condition"))
    }

    fn leaf(&mut self) -> String {
        let name = self.names[self.rng.below(self.names.len())].clone();
        let cell = cell(self.program, &self.symbols, &name).expect("a cell");
        let not = if self.rng.chance(40) { "!" } else { "" };
        match cell {
            Cell::Word(_) => {
                let sign = ["==", "!=", "<", ">="][self.rng.below(4)];
                format!("{name} {sign} {}", self.rng.range(-2, 6))
            }
            Cell::Bit(_) | Cell::WordBit(_) if self.rng.chance(12) => format!("rise({not}{name})"),
            Cell::Bit(_) | Cell::WordBit(_) => format!("{not}{name}"),
        }
    }

    fn contact(&self, text: &str) -> Option<Contact> {
        let written = condition(text, Span::default()).ok()?;
        let options = LoadOptions::default();
        let mut names = ConditionNames::of(self.program, &options);
        Some(names.resolve(&written).ok()?.contact)
    }
}

impl Drawn {
    /// Random values of the inputs: each keeps its value in most scans.
    pub fn inputs(&self, rng: &mut Rng, before: &[i32]) -> Vec<i32> {
        let draw = |(at, choice): (usize, &Choice)| match before.get(at) {
            Some(before) if rng.chance(60) => *before,
            _ => rng.range(choice.low.into(), choice.high.into()) as i32,
        };
        self.model.choices().iter().enumerate().map(draw).collect()
    }
}
