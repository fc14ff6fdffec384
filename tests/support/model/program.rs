//! A ladder program as the model runs it: everything is resolved to places and numbers.

use super::math::Expr;
use super::place::Loc;
use super::records::RecordAt;
use std::collections::BTreeMap;

#[derive(Clone, Copy, Debug)]
pub enum Value {
    Const(i64),
    Real(f64),
    At(Loc),
    /// The word or bit of an array that a word selects.
    Element(Array, Loc),
}

/// Consecutive places of one area.
#[derive(Clone, Copy, Debug)]
pub struct Array {
    pub first: Loc,
    pub count: usize,
}

/// The target of an instruction.
#[derive(Clone, Copy, Debug)]
pub enum To {
    At(Loc),
    Element(Array, Loc),
}

/// The target of a MATH.
#[derive(Clone, Debug)]
pub enum Target {
    At(Loc),
    Element(Array, Expr),
}

#[derive(Clone, Copy, Debug)]
pub enum Compare {
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

#[derive(Clone, Debug)]
pub enum Contact {
    Bit(Loc),
    /// The bit of an array that a word selects.
    Element(Array, Loc),
    /// `history` is the number of this contact's own edge history.
    Edge {
        rising: bool,
        of: Box<Contact>,
        history: usize,
    },
    Compare(Value, Compare, Value),
    /// A compare that computes, or a bit whose index does: ON unless it is 0.
    Computed(Box<Expr>),
    Not(Box<Contact>),
    All(Vec<Contact>),
    Any(Vec<Contact>),
}

#[derive(Clone, Debug)]
pub enum Op {
    Out(Loc),
    Set(To),
    Rst(To),
    Pd(Loc),
    Nd(Loc),
    Ponoff(Loc),
    Counter(usize),
    Timer(usize),
    Rstct(usize),
    Rstt(usize),
    Ctu(usize, Option<Value>),
    Ctd(usize, Option<Value>),
    Res(usize),
    Move(Value, To),
    Add(Value, Value, To),
    Sub(Value, Value, To),
    Copy(Array, Array),
    CopyRecord(RecordAt, RecordAt),
    Fill(Value, Array),
    Pack(Array, To),
    Unpack(Value, Array),
    Sr(Vec<Loc>),
    Math(Target, Expr),
    Run(usize),
    Restart(usize),
    Halt(usize),
    Exit,
    Entask(usize, Option<Value>),
    /// JMP and SGDIVRG.
    Jump(Vec<usize>),
    Sgset(usize),
    Sgrst(usize),
    Sgconvrg(Vec<usize>, usize),
    Stop,
    Call(usize),
    Return,
}

#[derive(Clone, Debug)]
pub struct Instr {
    pub op: Op,
    /// Two edge histories: of the rung or the first edge-triggered leg, and of the second
    /// edge-triggered leg.
    pub history: [usize; 2],
}

#[derive(Clone, Debug)]
pub struct Branch {
    pub when: Contact,
    pub instrs: Vec<Instr>,
}

#[derive(Clone, Debug)]
pub struct Rung {
    /// One leg (`when`), or the legs of the instruction in the order of the language's table.
    pub legs: Vec<Contact>,
    pub instrs: Vec<Instr>,
    pub branches: Vec<Branch>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Program,
    Task,
    FirstScan,
    TopOfScan,
    BottomOfScan,
    LastScan,
    Subroutine,
}

#[derive(Clone, Debug)]
pub struct Block {
    pub name: String,
    pub kind: Kind,
    pub autostart: bool,
    /// Element 0 has the block's own rungs; the others are the Stages in file order.
    pub elements: Vec<Vec<Rung>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CounterKind {
    Cnt,
    Cntdn,
    Udc,
    Udcg,
}

#[derive(Clone, Debug)]
pub struct CounterDef {
    pub kind: CounterKind,
    /// The preset of CNT and CNTDN, the Up Preset of UDC and UDCG.
    pub up: Option<Value>,
    pub down: Option<Value>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerKind {
    Ondtmr,
    Offdtmr,
    Tmr,
    Tmrdown,
    Tmra,
    Tmradown,
    Tmrag,
}

#[derive(Clone, Debug)]
pub struct TimerDef {
    pub kind: TimerKind,
    pub preset: Value,
    pub output: Option<Loc>,
}

#[derive(Clone, Debug, Default)]
pub struct Program {
    pub blocks: Vec<Block>,
    pub order: Vec<usize>,
    pub counters: BTreeMap<usize, CounterDef>,
    pub timers: BTreeMap<usize, TimerDef>,
    pub histories: usize,
    /// The values that a cold start writes to memory.
    pub initial: Vec<(Loc, i64)>,
    pub limits: Vec<(Loc, i64, i64)>,
}
