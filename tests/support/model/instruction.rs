//! Instructions: `MNEMONIC operand … key=value …`.

use super::math_read;
use super::names::Names;
use super::place::{Area, Loc};
use super::program::{CounterDef, CounterKind, Instr, Op, Program, TimerDef, TimerKind, To, Value};
use std::collections::BTreeMap;

/// The words of one instruction.
struct Words<'a> {
    names: &'a Names,
    operands: Vec<&'a str>,
    keys: BTreeMap<&'a str, &'a str>,
}

/// The legs of a mnemonic in the order of the language's table. If the list is empty, there is only
/// the leg `when`.
pub fn legs_of(mnemonic: &str) -> &'static [&'static str] {
    match mnemonic {
        "CNT" => &["up", "rst"],
        "CNTDN" => &["dn", "rst"],
        "UDC" => &["up", "dn", "rst"],
        "UDCG" => &["up", "dn"],
        "TMRA" | "TMRADOWN" => &["en", "rst"],
        "SR" => &["data", "clk", "rst"],
        _ => &[],
    }
}

/// Reads one instruction of the block. An owner's structure is entered in the program.
pub fn instruction(
    text: &str,
    block: usize,
    names: &Names,
    program: &mut Program,
) -> Result<Instr, String> {
    let mut words = text.split_whitespace();
    let mnemonic = words.next().unwrap_or_default();
    let mut all = Words { names, operands: Vec::new(), keys: BTreeMap::new() };
    for word in words {
        match word.split_once('=') {
            Some((key, value)) => {
                all.keys.insert(key, value);
            }
            None => all.operands.push(word),
        }
    }
    let op = match text.trim_start().strip_prefix("MATH ") {
        Some(formula) => {
            let (target, expr) = math_read::read(formula, names)?;
            return Ok(with_histories(Op::Math(target, expr), program));
        }
        None => all.any(mnemonic, block, program)?,
    };
    Ok(with_histories(op, program))
}

fn with_histories(op: Op, program: &mut Program) -> Instr {
    let history = [program.histories, program.histories + 1];
    program.histories += 2;
    Instr { op, history }
}

impl Words<'_> {
    fn operand(&self, at: usize) -> Result<&str, String> {
        self.operands.get(at).copied().ok_or_else(|| format!("operand {at} is missing"))
    }

    fn place(&self, at: usize) -> Result<Loc, String> {
        self.names.place(self.operand(at)?)
    }

    fn value(&self, at: usize) -> Result<Value, String> {
        self.names.value(self.operand(at)?)
    }

    fn key(&self, key: &str) -> Result<&str, String> {
        self.keys.get(key).copied().ok_or_else(|| format!("`{key}=` is missing"))
    }

    fn target(&self) -> Result<To, String> {
        self.to(self.key("to")?)
    }

    fn to(&self, word: &str) -> Result<To, String> {
        match self.names.element(word) {
            Some((array, index)) => Ok(To::Element(array, index)),
            None => self.names.place(word).map(To::At),
        }
    }

    fn copied(&self, from: &str, to: &str) -> Result<Op, String> {
        match (self.names.record(from), self.names.record(to)) {
            (Some(from), Some(to)) => Ok(Op::CopyRecord(from, to)),
            _ => Ok(Op::Copy(self.names.array(from)?, self.names.array(to)?)),
        }
    }

    fn optional(&self, key: &str) -> Result<Option<Value>, String> {
        self.keys.get(key).map(|word| self.names.value(word)).transpose()
    }

    fn structure(&self, area: Area) -> Result<usize, String> {
        self.names.structure(area, self.operand(0)?)
    }

    fn any(&self, mnemonic: &str, block: usize, program: &mut Program) -> Result<Op, String> {
        if let Some(op) = self.owner(mnemonic, program)? {
            return Ok(op);
        }
        match self.blocks_and_stages(mnemonic, block)? {
            Some(op) => Ok(op),
            None => self.plain(mnemonic),
        }
    }

    /// Reads an owner of a structure: CNT to UDCG, and the timers.
    fn owner(&self, mnemonic: &str, program: &mut Program) -> Result<Option<Op>, String> {
        let counter = match mnemonic {
            "CNT" => Some(CounterKind::Cnt),
            "CNTDN" => Some(CounterKind::Cntdn),
            "UDC" => Some(CounterKind::Udc),
            "UDCG" => Some(CounterKind::Udcg),
            _ => None,
        };
        if let Some(kind) = counter {
            let number = self.structure(Area::Ct)?;
            let up = match self.optional("preset")? {
                Some(preset) => Some(preset),
                None => self.optional("up-preset")?,
            };
            let down = self.optional("dn-preset")?;
            if program.counters.insert(number, CounterDef { kind, up, down }).is_some() {
                return Err(format!("CT{number} has two owners"));
            }
            return Ok(Some(Op::Counter(number)));
        }
        let kind = match mnemonic {
            "ONDTMR" => TimerKind::Ondtmr,
            "OFFDTMR" => TimerKind::Offdtmr,
            "TMR" => TimerKind::Tmr,
            "TMRDOWN" => TimerKind::Tmrdown,
            "TMRA" => TimerKind::Tmra,
            "TMRADOWN" => TimerKind::Tmradown,
            "TMRAG" => TimerKind::Tmrag,
            _ => return Ok(None),
        };
        let number = self.structure(Area::T)?;
        let preset = self.names.value(self.key("preset")?)?;
        let output = self.keys.get("output").map(|word| self.names.place(word));
        let def = TimerDef { kind, preset, output: output.transpose()? };
        if program.timers.insert(number, def).is_some() {
            return Err(format!("T{number} has two owners"));
        }
        Ok(Some(Op::Timer(number)))
    }

    fn blocks_and_stages(&self, mnemonic: &str, block: usize) -> Result<Option<Op>, String> {
        let stages = || {
            let numbers = self.operands.iter().map(|name| self.names.stage(block, name));
            numbers.collect::<Result<Vec<usize>, String>>()
        };
        let stage = || self.names.stage(block, self.operand(0)?);
        let target = || self.names.block(self.operand(0)?);
        Ok(Some(match mnemonic {
            "RUN" => Op::Run(target()?),
            "RESTART" => Op::Restart(target()?),
            "HALT" => Op::Halt(target()?),
            "EXIT" => Op::Exit,
            "ENTASK" => Op::Entask(target()?, self.optional("every")?),
            "JMP" | "SGDIVRG" => Op::Jump(stages()?),
            "SGSET" => Op::Sgset(stage()?),
            "SGRST" => Op::Sgrst(stage()?),
            "SGCONVRG" => Op::Sgconvrg(stages()?, self.names.stage(block, self.key("to")?)?),
            "STOP" => Op::Stop,
            "CALL" => Op::Call(target()?),
            "RETURN" => Op::Return,
            _ => return Ok(None),
        }))
    }

    fn plain(&self, mnemonic: &str) -> Result<Op, String> {
        Ok(match mnemonic {
            "OUT" => Op::Out(self.place(0)?),
            "SET" => Op::Set(self.to(self.operand(0)?)?),
            "RST" => Op::Rst(self.to(self.operand(0)?)?),
            "COPY" => self.copied(self.operand(0)?, self.key("to")?)?,
            "FILL" => Op::Fill(self.value(0)?, self.names.array(self.key("to")?)?),
            "PACK" => Op::Pack(self.names.array(self.operand(0)?)?, self.target()?),
            "UNPACK" => Op::Unpack(self.value(0)?, self.names.array(self.key("to")?)?),
            "SR" => Op::Sr(self.names.run(self.operand(0)?)?),
            "PD" => Op::Pd(self.place(0)?),
            "ND" => Op::Nd(self.place(0)?),
            "PONOFF" => Op::Ponoff(self.place(0)?),
            "RSTCT" => Op::Rstct(self.structure(Area::Ct)?),
            "RSTT" => Op::Rstt(self.structure(Area::T)?),
            "CTU" => Op::Ctu(self.structure(Area::N)?, self.optional("preset")?),
            "CTD" => Op::Ctd(self.structure(Area::N)?, self.optional("preset")?),
            "RES" => Op::Res(self.structure(Area::N)?),
            "MOVE" => Op::Move(self.value(0)?, self.target()?),
            "ADD" => Op::Add(self.value(0)?, self.value(1)?, self.target()?),
            "SUB" => Op::Sub(self.value(0)?, self.value(1)?, self.target()?),
            _ => return Err(format!("`{mnemonic}` is no instruction")),
        })
    }
}
