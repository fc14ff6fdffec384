//! A proof for other programs: the question as AIGER, the invariant as clauses over named cells,
//! and three formulas in DIMACS, which any solver finds to have no solution.
//!
//! Called by `rungd prove --certificate`, which writes the files. The gates are those of `encode`
//! before any other step, so nothing but the encoding has to be believed.

use std::collections::HashSet;
use std::fmt::Write as _;

use crate::aig::Literal;
use crate::aig::aiger::{self, NamedLatch, NamedLiteral};
use crate::deduce::system::{KeptBit, ScanSystem};
use crate::deduce::{Patience, invariant};
use crate::encode::encode;
use crate::gates::{Gates, Held, InputOf};
use crate::question::Questions;
use rungd_engine::isa::{Address, BlockId, StageId};
use rungd_engine::{BitCell, Cell, Layout, WordCell};

/// A file of a certificate.
#[derive(Clone, Debug)]
pub struct CertificateFile {
    /// Its name in the folder.
    pub name: String,
    /// Its content.
    pub content: Vec<u8>,
}

/// The files of a certificate about all lines. `patience`: for the invariant of one line, made anew
/// for each.
pub fn certificate(questions: &Questions, patience: impl Fn() -> Patience) -> Vec<CertificateFile> {
    let gates = encode(&questions.model);
    let names = Names { questions, layout: &questions.model.code.layout };
    let mut files = names.question(&gates);
    let mut told = String::new();
    for (number, line) in (1..).zip(&questions.lines) {
        if let Some(cause) = &line.outside {
            let _ = writeln!(told, "{number}. {}\n   {cause}", line.text);
            continue;
        }
        let at = questions.model.judged.iter().position(|bit| *bit == line.target.bit);
        let at = at.unwrap_or_default();
        let part = gates.reduced(&[at]);
        let system = ScanSystem::of(&part, part.judged[at].inverted_if(!line.target.value));
        let _ = write!(told, "{number}. {}\n   ", line.text);
        match invariant(&system, &patience()) {
            Some(cubes) => {
                let _ = writeln!(told, "proved: invariant-{number}.txt, {} clauses", cubes.len());
                files.extend(names.proof(number, &part, &system, &cubes));
            }
            None => told += "no invariant was found in its time: only the question is here\n",
        }
    }
    files.push(file("README", readme(&told)));
    files
}

fn file(name: &str, content: String) -> CertificateFile {
    CertificateFile { name: name.to_owned(), content: content.into_bytes() }
}

fn readme(told: &str) -> String {
    format!(
        "A question of `rungd prove`, for other programs.\n\n\
         question.aag, question.aig: the gates of one scan, AIGER 1.9. Each bad output is one line \
         that is broken; constraints are the assumptions. Symbols are tags or addresses.\n\
         invariant-N.txt: what holds in every scan, if line N is proved: clauses over named bits.\n\
         start-N.cnf: a cold start without the invariant.\n\
         kept-N.cnf: a scan that begins with the invariant and ends without it.\n\
         implies-N.cnf: a scan with the invariant that breaks the line.\n\
         Each of the three has no solution: `minisat start-1.cnf` says UNSATISFIABLE. Then line N \
         is never broken.\n\n{told}"
    )
}

/// The names of cells.
struct Names<'q> {
    questions: &'q Questions,
    layout: &'q Layout,
}

impl Names<'_> {
    fn question(&self, gates: &Gates) -> Vec<CertificateFile> {
        let input = |part: InputOf| match part {
            InputOf::Free(at, bit) => {
                let named = self.questions.inputs.get(at as usize);
                let late = self.questions.model.late_place();
                let other = if late == Some(at as usize) {
                    "periods since the last scan"
                } else {
                    "what happens behind the scan"
                };
                let name = named.map_or(other, |named| &named.name);
                match gates.free[at as usize].len() {
                    1 => name.to_owned(),
                    _ => format!("{name}.{bit}"),
                }
            }
            InputOf::Cut(at, bit) => {
                format!("any value of {}.{bit}", self.cell(gates.cuts[at as usize].cell))
            }
        };
        let mut distinct = DistinctNames::default();
        let latches = gates.latches.iter().map(|latch| NamedLatch {
            literal: latch.literal,
            next: latch.next,
            initial: latch.initial,
            name: distinct.name(self.held(latch.holds), "held"),
        });
        let latches = latches.collect();
        let inputs = gates.inputs.iter().map(|one| NamedLiteral {
            literal: one.literal,
            name: distinct.name(input(one.of), "given"),
        });
        let inputs = inputs.collect();
        let lines = self.questions.lines.iter().filter(|line| line.outside.is_none());
        let bad = lines.map(|line| {
            let judged = &self.questions.model.judged;
            let at = judged.iter().position(|bit| *bit == line.target.bit).unwrap_or_default();
            let literal = gates.judged[at].inverted_if(!line.target.value);
            NamedLiteral { literal, name: distinct.name(one_line(&line.text), "line") }
        });
        let constraints = gates.constraints.iter().enumerate();
        let system = aiger::AigerSystem {
            graph: &gates.graph,
            inputs,
            latches,
            bad: bad.collect(),
            constraints: constraints
                .map(|(at, literal)| NamedLiteral {
                    literal: *literal,
                    name: format!("assumption {}", at + 1),
                })
                .collect(),
            comment: format!("rungd prove {}", self.questions.suite.name),
        };
        let binary = CertificateFile { name: "question.aig".to_owned(), content: system.binary() };
        vec![file("question.aag", system.ascii()), binary]
    }

    /// The files of the proof of a line.
    fn proof(
        &self,
        number: usize,
        gates: &Gates,
        system: &ScanSystem,
        cubes: &[Vec<Literal>],
    ) -> Vec<CertificateFile> {
        let mut text = String::new();
        for cube in cubes {
            let one = |literal: &Literal| {
                let latch = gates.latches.iter().find(|one| one.literal.node() == literal.node());
                let name = latch.map_or(String::new(), |latch| self.held(latch.holds));
                if literal.is_inverted() { name } else { format!("!{name}") }
            };
            let _ = writeln!(text, "{}", cube.iter().map(one).collect::<Vec<_>>().join(" | "));
        }
        vec![
            file(&format!("invariant-{number}.txt"), text),
            file(&format!("start-{number}.cnf"), ClauseFormula::start(system, cubes).dimacs()),
            file(&format!("kept-{number}.cnf"), ClauseFormula::kept(system, cubes).dimacs()),
            file(&format!("implies-{number}.cnf"), ClauseFormula::implies(system, cubes).dimacs()),
        ]
    }

    fn held(&self, held: Held) -> String {
        match held {
            Held::Bit(bit) => self.cell(Cell::Bit(bit)),
            Held::WordBit(word, bit) => format!("{}.{bit}", self.cell(Cell::Word(word))),
            Held::TimerScans(word, bit) => {
                format!("{} in scans.{bit}", self.cell(Cell::Word(word)))
            }
            Held::PassDue(block) => format!("{}: pass due", self.block(block)),
            Held::FirstTurn(block) => format!("{}: first turn", self.block(block)),
            Held::Executed(block) => format!("{}: executed", self.block(block)),
            Held::Recurrent(block) => format!("{}: recurrent", self.block(block)),
            Held::Interval(block, bit) => format!("{}: interval.{bit}", self.block(block)),
            Held::Phase(block, bit) => format!("{}: phase.{bit}", self.block(block)),
            Held::Age(block, bit) => format!("{}: scans since.{bit}", self.block(block)),
            Held::StagePassDue(stage) => format!("{}: pass due", self.stage(stage)),
            Held::StageExecuted(stage) => format!("{}: executed", self.stage(stage)),
            Held::StageAge(stage, bit) => format!("{}: scans since.{bit}", self.stage(stage)),
            Held::Caller(subroutine, element) => format!("subroutine {subroutine}: of {element:?}"),
            Held::FirstScan => "first scan".to_owned(),
            Held::LastScan => "last scan".to_owned(),
            Held::Stopped => "stopped".to_owned(),
            Held::Beginning => "beginning".to_owned(),
            Held::ImageBit(bit) => format!("image of {}", self.cell(Cell::Bit(bit))),
            Held::ImageWordBit(word, bit) => {
                format!("image of {}.{bit}", self.cell(Cell::Word(word)))
            }
            Held::ImageIsFinal => "image with passes".to_owned(),
            Held::Clock(bit, part) => format!("{}: time.{part}", self.cell(Cell::Bit(bit))),
        }
    }

    /// The name of a block; the judges and the observer have none of the ladder's.
    fn block(&self, id: BlockId) -> String {
        let program = &self.questions.suite.programs[0].program;
        let block = program.blocks.get(id.0 as usize);
        block.map_or_else(|| format!("judge {}", id.0), |block| block.name.clone())
    }

    fn stage(&self, id: StageId) -> String {
        let program = &self.questions.suite.programs[0].program;
        let known = (id.0 as usize) < program.stages.len();
        if known { program.names.stage(id).to_owned() } else { format!("stage {}", id.0) }
    }

    fn cell(&self, cell: Cell) -> String {
        let names = &self.questions.suite.programs[0].program.names;
        let address: Option<Address> = self.layout.address(cell);
        match (address, cell) {
            (Some(address), _) => names.name(address),
            (None, Cell::Bit(BitCell(at))) => format!("bit {at}"),
            (None, Cell::Word(WordCell(at))) => format!("word {at}"),
            (None, Cell::WordBit(bit)) => format!("word {}", bit.word.0),
        }
    }
}

/// The names in the symbol table of a question. ABC refuses a file with a name twice.
#[derive(Default)]
struct DistinctNames(HashSet<String>);

impl DistinctNames {
    /// A name that nothing has yet: `ready`, then `ready (line)`.
    fn name(&mut self, name: String, what: &str) -> String {
        let others = (2..).map(|number| format!("{name} ({what} {number})"));
        let mut all = [name.clone(), format!("{name} ({what})")].into_iter().chain(others);
        let free = all.find(|name| !self.0.contains(name)).unwrap_or_default();
        self.0.insert(free.clone());
        free
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A formula in conjunctive form; a variable is 1 more than the number of its bit.
struct ClauseFormula {
    variables: usize,
    clauses: Vec<Vec<i64>>,
}

fn variable(literal: Literal) -> i64 {
    let variable = i64::from(literal.node()) + 1;
    if literal.is_inverted() { -variable } else { variable }
}

impl ClauseFormula {
    /// A cold start without the invariant.
    fn start(system: &ScanSystem, cubes: &[Vec<Literal>]) -> ClauseFormula {
        let mut formula = ClauseFormula { variables: system.bits, clauses: Vec::new() };
        for KeptBit { bit, init, .. } in &system.kept {
            if let Some(init) = init {
                formula.clauses.push(vec![variable(Literal::of_node(*bit).inverted_if(!init))]);
            }
        }
        formula.one_cube(cubes, |literal| literal);
        formula
    }

    /// A scan that begins with the invariant and ends without it.
    fn kept(system: &ScanSystem, cubes: &[Vec<Literal>]) -> ClauseFormula {
        let mut formula = ClauseFormula::scan(system, cubes);
        let next = |literal: Literal| {
            let kept = system.kept.iter().find(|kept| kept.bit == literal.node());
            kept.map_or(literal, |kept| kept.next.inverted_if(literal.is_inverted()))
        };
        formula.one_cube(cubes, next);
        formula
    }

    /// A scan with the invariant in which the target is met.
    fn implies(system: &ScanSystem, cubes: &[Vec<Literal>]) -> ClauseFormula {
        let mut formula = ClauseFormula::scan(system, cubes);
        formula.clauses.push(vec![variable(system.found)]);
        formula
    }

    /// A scan that is allowed and begins with the invariant.
    fn scan(system: &ScanSystem, cubes: &[Vec<Literal>]) -> ClauseFormula {
        let mut clauses = vec![vec![variable(Literal::TRUE)], vec![variable(system.allowed)]];
        for gate in &system.gates {
            let (both, [a, b]) = (variable(Literal::of_node(gate.bit)), gate.reads.map(variable));
            clauses.extend([vec![-both, a], vec![-both, b], vec![both, -a, -b]]);
        }
        let outside = |cube: &Vec<Literal>| cube.iter().map(|bit| -variable(*bit)).collect();
        clauses.extend(cubes.iter().map(outside));
        ClauseFormula { variables: system.bits, clauses }
    }

    /// Adds that all bits of one of the cubes are ON.
    fn one_cube(&mut self, cubes: &[Vec<Literal>], bit: impl Fn(Literal) -> Literal) {
        let first = self.variables as i64 + 1;
        self.clauses.push((first..first + cubes.len() as i64).collect());
        for (chosen, cube) in (first..).zip(cubes) {
            let bits = cube.iter().map(|literal| vec![-chosen, variable(bit(*literal))]);
            self.clauses.extend(bits);
        }
        self.variables += cubes.len();
    }

    fn dimacs(&self) -> String {
        let mut text = format!("p cnf {} {}\n", self.variables, self.clauses.len());
        for clause in &self.clauses {
            clause.iter().for_each(|literal| text += &format!("{literal} "));
            text += "0\n";
        }
        text
    }
}
