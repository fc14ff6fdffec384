//! The judge's own trace of a cell: every step that changed it or wrote it again. The judge
//! executes the tape operation by operation, and reads from the generated text which cells an
//! instruction writes.

use super::bench::Bench;
use rungd_engine::{BitCell, Cell, Engine, EngineCall, EngineState, Image, ScanObserver, ScanStep};
use rungd_history::observe::QuestionTime;
use rungd_language::lower::lower_seen;
use rungd_language::lower::sites::Sites;
use rungd_runtime::TapeEntry;
use rungd_test_support::model::case::{Expr, Rung};
use std::collections::HashMap;

/// An instruction of the generated ladder.
#[derive(Clone)]
pub struct Instruction {
    pub element: String,
    pub rung: u32,
    pub branch: Option<u32>,
    pub text: String,
    source: Rung,
}

/// The cause of a write to the cell.
#[derive(Clone, Debug, PartialEq)]
pub enum By {
    Instruction(u32),
    Pass(u32),
    Turn(u32),
    Write,
    Force,
    Controller,
}

#[derive(Clone, Debug)]
pub struct Step {
    pub by: By,
    pub scan: Option<u64>,
    pub changed: bool,
}

/// The history of the cell from the start to the moment of the question.
pub struct Trace {
    pub steps: Vec<Step>,
    /// The number of the scan that began last.
    pub scan: Option<u64>,
    pub forced: bool,
    /// Whether the controller still scans.
    pub runs: bool,
    pub state: EngineState,
    pub instructions: Vec<Instruction>,
}

/// All instructions in file order.
pub fn instructions(bench: &Bench) -> Vec<Instruction> {
    let mut all = Vec::new();
    for block in &bench.case.blocks {
        let own = (block.name.clone(), &block.rungs);
        let stages = block.stages.iter();
        let stages = stages.map(|stage| (format!("{}.{}", block.name, stage.name), &stage.rungs));
        for (element, rungs) in [own].into_iter().chain(stages) {
            for (number, rung) in (1..).zip(rungs) {
                let mut add = |branch: Option<u32>, text: &String| {
                    all.push(Instruction {
                        element: element.clone(),
                        rung: number,
                        branch,
                        text: text.clone(),
                        source: rung.clone(),
                    });
                };
                rung.instrs.iter().for_each(|text| add(None, text));
                for (at, branch) in (1..).zip(&rung.branches) {
                    branch.instrs.iter().for_each(|text| add(Some(at), text));
                }
            }
        }
    }
    all
}

struct Brute<'b> {
    bench: &'b Bench,
    sites: &'b Sites,
    instructions: &'b [Instruction],
    cell: Cell,
    last: i32,
    turn: Option<u32>,
    found: Vec<(By, bool)>,
    states: HashMap<u32, Vec<bool>>,
}

pub fn content(image: &Image, cell: Cell) -> i32 {
    image.value(cell)
}

impl Brute<'_> {
    fn note(&mut self, by: By, image: &Image) -> bool {
        let now = content(image, self.cell);
        let changed = std::mem::replace(&mut self.last, now) != now;
        if changed {
            self.found.push((by, true));
        }
        changed
    }

    fn around(&self) -> By {
        self.turn.map_or(By::Controller, By::Turn)
    }

    /// Whether an execution of the instruction writes the cell, even if the value stays the same.
    fn puts(&self, part: u32, number: u32, in_pass: bool) -> bool {
        let instruction = &self.instructions[number as usize];
        let words: Vec<&str> = instruction.text.split_whitespace().collect();
        let named = |name: &str| self.bench.cell(name).is_some_and(|cell| cell.overlaps(self.cell));
        let key = |key: &str| words.iter().find_map(|word| word.strip_prefix(key));
        let member = |of: &[&str]| of.iter().any(|of| named(&format!("{}.{of}", words[1])));
        let counter = || member(&["Acc", "Done", "Reset", "Zero", "DnDone"]);
        let timer = || member(&["Acc", "Done", "Reset", "Zero", "Timing"]);
        let on = || self.power(part, instruction);
        match words[0] {
            "OUT" | "PD" | "ND" => named(words[1]),
            "CNT" | "CNTDN" | "UDC" => counter(),
            "UDCG" => !in_pass && counter(),
            "TMR" | "TMRDOWN" | "TMRA" | "TMRADOWN" => timer(),
            "TMRAG" => !in_pass && timer(),
            "ONDTMR" | "OFFDTMR" => timer() || key("output=").is_some_and(named),
            "CTU" if in_pass => member(&["CU"]),
            "CTD" if in_pass => member(&["CD"]),
            "CTU" | "CTD" => {
                let enabled = if words[0] == "CTU" { "CU" } else { "CD" };
                let is_word =
                    key("preset=").is_some_and(|preset| self.bench.cell(preset).is_some());
                member(&["DN", enabled]) || is_word && member(&["PRE"])
            }
            _ if in_pass => false,
            "SET" | "RST" => named(words[1]) && on(),
            "MOVE" | "ADD" | "SUB" | "PACK" => key("to=").is_some_and(named) && on(),
            "MATH" => named(words[1]) && on(),
            "RSTCT" => counter() && on(),
            "RSTT" => timer() && on(),
            "RES" => member(&["ACC", "CU", "CD", "DN", "OV", "UN"]) && on(),
            _ => false,
        }
    }

    fn power(&self, part: u32, of: &Instruction) -> bool {
        let all = |series: &[Expr], states: &[bool], at: &mut usize| {
            values(series, states, at).iter().all(|on| *on)
        };
        let none = Vec::new();
        let states = |part: u32| self.states.get(&part).unwrap_or(&none);
        let Some(branch) = of.branch else {
            return all(&of.source.legs[0].1, states(part), &mut 0);
        };
        let outer = (0..part).rev().find(|at| self.sites.parts[*at as usize].branch.is_none());
        let outer = states(outer.expect("a branch follows its rung"));
        all(&of.source.legs[0].1, outer, &mut 0)
            && all(&of.source.branches[branch as usize - 1].when, states(part), &mut 0)
    }
}

/// The value of contacts, computed from the states of their leaves, from left to right.
fn value(expr: &Expr, states: &[bool], at: &mut usize) -> bool {
    let mut next = || {
        *at += 1;
        states.get(*at - 1).copied().unwrap_or_default()
    };
    match expr {
        Expr::Leaf(text) if text.starts_with("rise(") || text.starts_with("fall(") => {
            next();
            next()
        }
        Expr::Leaf(_) | Expr::Compare(_) => next(),
        Expr::Not(inner) => !value(inner, states, at),
        Expr::Group(inner) => value(inner, states, at),
        Expr::Edge(_, inner) => {
            value(inner, states, at);
            *at += 1;
            states.get(*at - 1).copied().unwrap_or_default()
        }
        Expr::All(all) => values(all, states, at).iter().all(|on| *on),
        Expr::Any(any) => values(any, states, at).iter().any(|on| *on),
    }
}

/// The values of all expressions; each takes the states of its leaves.
fn values(all: &[Expr], states: &[bool], at: &mut usize) -> Vec<bool> {
    all.iter().map(|one| value(one, states, at)).collect()
}

impl ScanObserver for Brute<'_> {
    fn before(&mut self, deed: ScanStep, image: &Image) {
        let around = self.around();
        self.note(around, image);
        match deed {
            ScanStep::Turn(block) => self.turn = Some(block.0),
            ScanStep::Batch(batch) => {
                for (number, part) in (0..).zip(&self.sites.parts) {
                    if part.ready == batch {
                        let leaves = part.leaves.start as usize..part.leaves.end as usize;
                        let is_on = |power: &rungd_engine::Power| {
                            image.bit(BitCell(power.cell())) != power.is_opposite()
                        };
                        let states = self.sites.leaves[leaves].iter().map(is_on).collect();
                        self.states.insert(number, states);
                    }
                }
            }
            ScanStep::Element(_) | ScanStep::Pass(_) => {}
        }
    }

    fn after(&mut self, deed: ScanStep, image: &Image) {
        let (site, in_pass) = match deed {
            ScanStep::Batch(at) => (self.sites.batches[at as usize], false),
            ScanStep::Pass(at) => (self.sites.passes[at as usize], true),
            ScanStep::Turn(_) | ScanStep::Element(_) => {
                let around = self.around();
                self.note(around, image);
                if let ScanStep::Turn(_) = deed {
                    self.turn = None;
                }
                return;
            }
        };
        let Some(number) = site.instruction else { return };
        let by = if in_pass { By::Pass(number) } else { By::Instruction(number) };
        // A pass may have two steps for one instruction.
        let is_told = in_pass && self.found.last().is_some_and(|(last, _)| *last == by);
        if !self.note(by.clone(), image) && !is_told && self.puts(site.part, number, in_pass) {
            self.found.push((by, false));
        }
    }
}

/// Executes the tape to the moment of the question.
pub fn trace(bench: &Bench, cell: Cell, at: QuestionTime) -> Trace {
    let (code, _, sites) = lower_seen(&bench.program);
    let mut engine = Engine::new(code);
    let instructions = instructions(bench);
    let mut brute = Brute {
        bench,
        sites: &sites,
        instructions: &instructions,
        cell,
        last: content(engine.image(), cell),
        turn: None,
        found: Vec::new(),
        states: HashMap::new(),
    };
    let (mut steps, mut scan, mut next) = (Vec::new(), None, 0);
    let (mut forced, mut runs) = (false, false);
    let entries = bench.sections.iter().flat_map(|section| &section.entries);
    for entry in entries {
        let TapeEntry::Call(call) = entry else { continue };
        if let EngineCall::Begin { .. } = call {
            (scan, next) = (Some(next), next + 1);
        }
        engine.apply_seen(*call, &mut brute);
        let by = match call {
            EngineCall::Write(..) => By::Write,
            EngineCall::Force(..) => By::Force,
            _ => By::Controller,
        };
        brute.note(by, engine.image());
        match call {
            EngineCall::Force(of, _) if *of == cell.whole() => forced = true,
            EngineCall::Release(of) if *of == cell.whole() => forced = false,
            EngineCall::Start { .. } => runs = true,
            EngineCall::Terminate => runs = false,
            _ => {}
        }
        let found = brute.found.drain(..);
        steps.extend(found.map(|(by, changed)| Step { by, scan, changed }));
        if *call == EngineCall::Execute && matches!(at, QuestionTime::Scan(of) if Some(of) == scan)
        {
            break;
        }
    }
    let state = EngineState::of(&engine);
    Trace { steps, scan, forced, runs, state, instructions }
}

impl Trace {
    /// The write that decided the value: the last write in the last scan, or, if there is none, the
    /// last write that changed the value.
    pub fn expected(&self) -> Option<&Step> {
        let last = self.steps.iter().rfind(|step| step.scan == self.scan);
        last.or_else(|| self.steps.iter().rfind(|step| step.changed))
    }
}
