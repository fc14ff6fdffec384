//! Random models: a program of the reference model's generator, with random inputs and conditions.

use rungd_base::scan_period::ScanPeriod;
use rungd_engine::isa::{Address, Word};
use rungd_engine::{BitCell, Cell, Engine, EngineProgram, ResumeBits, Transfer, WordCell};
use rungd_language::lower::judged::{Judges, lower_judged};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::condition::ConditionNames;
use rungd_language::resolve::program::{Contact, Program};
use rungd_language::source::condition::condition;
use rungd_language::source::span::Span;
use rungd_prove::any::{AnyProgram, any_in};
use rungd_prove::events::{KeptLimits, ModelEvents, RetainedCell, ScanEvent};
use rungd_prove::model::{Choice, FreeInput, ProofModel, ProofStart};
use rungd_prove::stage_start::StageStart;
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
    let mut program = load(&ladder).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
    if has_any && seed.is_multiple_of(3) {
        let staged = program.blocks.iter_mut().filter(|block| !block.stages.is_empty());
        staged.for_each(|block| block.retains_stages = true);
    }
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
    let mut code = code;
    let happens = has_any && draw.rng.chance(50);
    let events = if happens { draw.events(&mut code) } else { ModelEvents::default() };
    let texts = |all: &[(String, Contact)]| all.iter().map(|(text, _)| text.clone()).collect();
    let (assumed, judged): (Vec<String>, Vec<String>) = (texts(&assumed), texts(&judged));
    Drawn {
        transfer: lowered.judges.transfer(&plain, &lowered.code),
        plain,
        text: format!(
            "# seed {seed}\n{ladder}\n# assume {assumed:?}, judged {judged:?}, any {any:?}, late {late_max}, \
             inputs {inputs:?}, {events:?}"
        ),
        model: ProofModel {
            period: ScanPeriod::of_ms(case.period as u32),
            late_max,
            start: ProofStart::Cold(Vec::new()),
            inputs,
            assumed: lowered.before,
            judged: lowered.behind,
            code,
            events,
            stage_starts: Vec::new(),
        },
    }
}

/// The same model, in which Programs whose Stages are retained begin in any of them.
pub fn with_stages_at_start(mut model: ProofModel, rng: &mut Rng) -> ProofModel {
    for kept in model.code.kept.clone() {
        let start = StageStart::new(&mut model.code, kept.program, rng.chance(20));
        let is_stage = |input: &FreeInput| {
            (0..kept.stages).any(|n| input.cell == Cell::Bit(start.chosen.stage(n)))
        };
        let inputs = FreeInput::of_stages(&start, &model.code).into_iter();
        model.inputs.extend(inputs.filter(|input| !is_stage(input) || rng.chance(70)));
        model.stage_starts.push(start);
    }
    model
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

    /// Some events, and some cells that are retained.
    fn events(&mut self, code: &mut EngineProgram) -> ModelEvents {
        let all = [ScanEvent::Stop, ScanEvent::Restart, ScanEvent::PowerCut];
        let mut kinds: Vec<ScanEvent> = all.into_iter().filter(|_| self.rng.chance(50)).collect();
        let is_old = self.rng.chance(30);
        if is_old {
            kinds.extend([ScanEvent::KeepImage, ScanEvent::PowerCutBeforeImage]);
        }
        if kinds.is_empty() {
            return ModelEvents::default();
        }
        let mut retained: Vec<RetainedCell> = Vec::new();
        for cell in self.retained(code) {
            let is_known = retained.iter().any(|known| known.cell == cell);
            if is_known {
                continue;
            }
            let image = is_old.then(|| fresh(code, cell));
            let limits = matches!(cell, Cell::Word(_)) && self.rng.chance(20);
            let limits = limits.then(|| KeptLimits { low: -1, high: self.rng.range(0, 3) as i32 });
            retained.push(RetainedCell { cell, limits, image });
        }
        let has_image = !retained.is_empty();
        let image_is_final = is_old.then(|| fresh(code, Cell::Bit(BitCell(0))));
        let image_is_final = image_is_final.map(|cell| match cell {
            Cell::Bit(bit) => bit,
            Cell::Word(_) | Cell::WordBit(_) => unreachable!("a bit"),
        });
        ModelEvents { kinds, has_image, retained, image_is_final, ..ModelEvents::default() }
    }

    /// Some of the cells that the program names, of structures all, and what is kept of Stages.
    fn retained(&mut self, code: &EngineProgram) -> Vec<Cell> {
        let layout = &code.layout;
        let mut all = Vec::new();
        for name in self.names.clone() {
            if !self.rng.chance(30) {
                continue;
            }
            let own = cell(self.program, &self.symbols, &name).expect("a cell");
            let address = self.symbols.layout.address(own);
            let Some(cell) = address.and_then(|address| layout.cell(address)) else { continue };
            match address.and_then(Address::structure) {
                Some(at) => {
                    let bits = layout.record_bits(at).map(|bit| Cell::Bit(BitCell(bit)));
                    all.extend(bits);
                    all.push(Cell::Word(layout.word(Word::Acc(at))));
                }
                None if matches!(cell, Cell::WordBit(_)) => {}
                None if address.is_some_and(is_writable) => all.push(cell),
                None => {}
            }
        }
        let kept = code.kept.iter().flat_map(|kept| {
            (kept.first..kept.first + ResumeBits::bits(kept.stages))
                .map(|at| Cell::Bit(BitCell(at)))
        });
        all.extend(kept);
        all
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

fn is_writable(address: Address) -> bool {
    match address {
        Address::Bit(bit) => bit.forcible(),
        Address::Word(word) => word.writable(),
        Address::Structure(_) => false,
    }
}

/// A private cell of the same type.
pub fn fresh(code: &mut EngineProgram, cell: Cell) -> Cell {
    if matches!(cell, Cell::Word(_)) {
        code.word_count += 1;
        return Cell::Word(WordCell(code.word_count - 1));
    }
    code.bit_count += 1;
    Cell::Bit(BitCell(code.bit_count - 1))
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
