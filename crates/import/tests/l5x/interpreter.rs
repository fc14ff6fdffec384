//! Rungs of Logix, executed: the descriptions of the instructions in Rockwell's general
//! instructions manual, written down apart from the importer.

use std::collections::HashMap;

use super::rung_text::{Part, read};
use super::values::{Value, Values, arithmetic, negated};

/// Which way a counter counts.
struct Way {
    bit: &'static str,
    step: i64,
}

const UP: Way = Way { bit: "CU", step: 1 };
const DOWN: Way = Way { bit: "CD", step: -1 };

/// A controller: routines, memory, time.
pub struct Machine {
    pub values: Values,
    main: Vec<Vec<Part>>,
    sub: Vec<Vec<Part>>,
    now_ms: i64,
    last: HashMap<String, i64>,
    was_prescanned: bool,
    /// Where a jump goes, while one is taken.
    jump: Option<String>,
    returns: bool,
}

impl Machine {
    pub fn new(main: &[String], sub: &[String]) -> Machine {
        let read = |rungs: &[String]| rungs.iter().map(|text| read(text)).collect();
        Machine {
            values: Values::default(),
            main: read(main),
            sub: read(sub),
            now_ms: 0,
            last: HashMap::new(),
            was_prescanned: false,
            jump: None,
            returns: false,
        }
    }

    pub fn scan(&mut self, now_ms: u64) {
        self.now_ms = now_ms as i64;
        if !self.was_prescanned {
            self.was_prescanned = true;
            for rung in [self.main.clone(), self.sub.clone()].concat() {
                self.prescan(&rung);
            }
        }
        let main = self.main.clone();
        self.routine(&main);
    }

    fn prescan(&mut self, parts: &[Part]) {
        for part in parts {
            match part {
                Part::Branches(branches) => branches.iter().for_each(|branch| self.prescan(branch)),
                Part::Instruction(name, operands) => self.prescan_one(name, operands),
            }
        }
    }

    fn prescan_one(&mut self, name: &str, operands: &[String]) {
        let one = operands.first().cloned().unwrap_or_default();
        let bits = |machine: &mut Machine, names: &[&str], is_on: bool| {
            names.iter().for_each(|bit| machine.values.set_bit(&format!("{one}.{bit}"), is_on));
        };
        match name {
            // A coil of an element with a moving index is not part of the trials.
            "OTE" => self.values.set_bit(&one, false),
            "ONS" => self.values.set_bit(&one, true),
            "OSR" => {
                self.values.set_bit(&one, true);
                self.values.set_bit(&operands[1], false);
            }
            "OSF" => {
                self.values.set_bit(&one, false);
                self.values.set_bit(&operands[1], false);
            }
            "TON" => {
                bits(self, &["EN", "TT", "DN"], false);
                self.values.store(&format!("{one}.ACC"), Value::Whole(0));
            }
            "TOF" => {
                bits(self, &["EN", "TT", "DN"], false);
                let preset = self.values.value(&format!("{one}.PRE"));
                self.values.store(&format!("{one}.ACC"), preset);
            }
            "RTO" => bits(self, &["EN", "TT"], false),
            "CTU" => bits(self, &["CU"], true),
            "CTD" => bits(self, &["CD"], true),
            "FFL" => self.values.set_bit(&format!("{}.EN", operands[2]), true),
            "FFU" => self.values.set_bit(&format!("{}.EU", operands[2]), true),
            "BSL" | "BSR" => {
                let control = &operands[1];
                self.values.set_bit(&format!("{control}.EN"), false);
                self.values.set_bit(&format!("{control}.DN"), false);
                self.values.store(&format!("{control}.POS"), Value::Whole(0));
            }
            _ => {}
        }
    }

    fn routine(&mut self, rungs: &[Vec<Part>]) {
        let mut zone: Option<bool> = None;
        for rung in rungs {
            if let Some(label) = self.jump.clone() {
                let is_it = |part: &Part| match part {
                    Part::Instruction(name, operands) => name == "LBL" && operands[0] == label,
                    Part::Branches(_) => false,
                };
                if !rung.first().is_some_and(is_it) {
                    continue;
                }
                self.jump = None;
            }
            if matches!(rung.last(), Some(Part::Instruction(name, _)) if name == "MCR") {
                zone = match zone {
                    Some(_) => None,
                    None => Some(self.series(&rung[..rung.len() - 1], true)),
                };
                continue;
            }
            self.series(rung, zone.unwrap_or(true));
            if self.returns {
                break;
            }
        }
        self.returns = false;
    }

    fn series(&mut self, parts: &[Part], mut power: bool) -> bool {
        for part in parts {
            if self.jump.is_some() || self.returns {
                return power;
            }
            power = match part {
                Part::Branches(branches) => {
                    let mut any = false;
                    for branch in branches {
                        any |= self.series(branch, power);
                    }
                    any
                }
                Part::Instruction(name, operands) => self.instruction(name, operands, power),
            };
        }
        power
    }

    fn instruction(&mut self, name: &str, operands: &[String], power: bool) -> bool {
        if let Some(holds) = self.contact(name, operands) {
            return power && holds;
        }
        match name {
            "ONS" => {
                let was = self.values.bit(&operands[0]);
                self.values.set_bit(&operands[0], power);
                return power && !was;
            }
            "OTE" => self.values.set_bit(&operands[0], power),
            "OTL" if power => self.values.set_bit(&operands[0], true),
            "OTU" if power => self.values.set_bit(&operands[0], false),
            "OSR" => {
                let was = self.values.bit(&operands[0]);
                self.values.set_bit(&operands[0], power);
                self.values.set_bit(&operands[1], power && !was);
            }
            "OSF" => {
                let was = self.values.bit(&operands[0]);
                self.values.set_bit(&operands[0], power);
                self.values.set_bit(&operands[1], !power && was);
            }
            "TON" | "RTO" => self.on_delay(&operands[0], power, name == "RTO"),
            "TOF" => self.off_delay(&operands[0], power),
            "CTU" => self.counter(&operands[0], power, &UP),
            "CTD" => self.counter(&operands[0], power, &DOWN),
            "RES" if power => self.reset(&operands[0]),
            "JSR" if power => {
                let sub = self.sub.clone();
                self.routine(&sub);
            }
            "RET" if power => self.returns = true,
            "JMP" if power => self.jump = Some(operands[0].clone()),
            "FFL" | "FFU" | "BSL" | "BSR" => self.on_edge(name, operands, power),
            _ if power => self.compute(name, operands),
            _ => {}
        }
        power
    }

    fn contact(&self, name: &str, operands: &[String]) -> Option<bool> {
        let value = |at: usize| self.values.value(&operands[at]);
        let whole = |at: usize| match value(at) {
            Value::Whole(value) => value,
            Value::Real(_) => panic!("a REAL"),
        };
        let order = |at: usize, other: usize| match (value(at), value(other)) {
            (Value::Whole(one), Value::Whole(other)) => one.partial_cmp(&other),
            (one, other) => one.real().partial_cmp(&other.real()),
        };
        use std::cmp::Ordering::{Equal, Greater, Less};
        Some(match name {
            "XIC" => self.values.bit(&operands[0]),
            "XIO" => !self.values.bit(&operands[0]),
            "AFI" => false,
            "EQU" => order(0, 1) == Some(Equal),
            "NEQ" => order(0, 1) != Some(Equal),
            "LES" => order(0, 1) == Some(Less),
            "LEQ" => order(0, 1) != Some(Greater),
            "GRT" => order(0, 1) == Some(Greater),
            "GEQ" => order(0, 1) != Some(Less),
            "LIM" => {
                let (low, test, high) = (whole(0), whole(1), whole(2));
                match low <= high {
                    true => low <= test && test <= high,
                    false => test >= low || test <= high,
                }
            }
            "MEQ" => whole(0) & whole(1) == whole(2) & whole(1),
            _ => return None,
        })
    }

    fn number(&self, text: &str) -> i64 {
        match self.values.value(text) {
            Value::Whole(value) => value,
            Value::Real(_) => panic!("{text} is a REAL"),
        }
    }

    fn flag(&self, structure: &str, bit: &str) -> bool {
        self.values.bit(&format!("{structure}.{bit}"))
    }

    fn set_flag(&mut self, structure: &str, bit: &str, is_on: bool) {
        self.values.set_bit(&format!("{structure}.{bit}"), is_on);
    }

    /// Adds the time since the last execution.
    fn advance(&mut self, timer: &str) {
        let elapsed = self.now_ms - self.last.get(timer).copied().unwrap_or(0);
        let acc = self.number(&format!("{timer}.ACC"));
        let acc = (acc + elapsed).min(2_147_483_647);
        self.values.store(&format!("{timer}.ACC"), Value::Whole(acc));
        self.last.insert(timer.to_owned(), self.now_ms);
    }

    fn is_over(&self, timer: &str) -> bool {
        self.number(&format!("{timer}.ACC")) >= self.number(&format!("{timer}.PRE"))
    }

    fn on_delay(&mut self, timer: &str, power: bool, retains: bool) {
        if !power {
            self.set_flag(timer, "EN", false);
            self.set_flag(timer, "TT", false);
            if !retains {
                self.set_flag(timer, "DN", false);
                self.values.store(&format!("{timer}.ACC"), Value::Whole(0));
            }
            return;
        }
        if self.flag(timer, "DN") {
            return;
        }
        if self.flag(timer, "EN") {
            self.advance(timer);
        } else {
            self.set_flag(timer, "EN", true);
            self.last.insert(timer.to_owned(), self.now_ms);
        }
        self.set_flag(timer, "TT", true);
        if self.is_over(timer) {
            self.set_flag(timer, "DN", true);
            self.set_flag(timer, "TT", false);
        }
    }

    fn off_delay(&mut self, timer: &str, power: bool) {
        if power {
            self.set_flag(timer, "EN", true);
            self.set_flag(timer, "TT", false);
            self.set_flag(timer, "DN", true);
            self.values.store(&format!("{timer}.ACC"), Value::Whole(0));
            return;
        }
        if !self.flag(timer, "DN") {
            self.set_flag(timer, "EN", false);
            self.set_flag(timer, "TT", false);
            return;
        }
        if self.flag(timer, "EN") {
            self.set_flag(timer, "EN", false);
            self.last.insert(timer.to_owned(), self.now_ms);
        } else {
            self.advance(timer);
        }
        self.set_flag(timer, "TT", true);
        if self.is_over(timer) {
            self.set_flag(timer, "DN", false);
            self.set_flag(timer, "TT", false);
        }
    }

    fn counter(&mut self, counter: &str, power: bool, way: &Way) {
        if !power {
            self.set_flag(counter, way.bit, false);
            return;
        }
        if !self.flag(counter, way.bit) {
            self.set_flag(counter, way.bit, true);
            let acc = self.number(&format!("{counter}.ACC"));
            let next = acc + way.step;
            if next > 2_147_483_647 {
                let was_under = self.flag(counter, "UN");
                self.set_flag(counter, if was_under { "UN" } else { "OV" }, !was_under);
            }
            if next < -2_147_483_648 {
                let was_over = self.flag(counter, "OV");
                self.set_flag(counter, if was_over { "OV" } else { "UN" }, !was_over);
            }
            self.values.store(&format!("{counter}.ACC"), Value::Whole(next));
        }
        let done = self.is_over(counter);
        self.set_flag(counter, "DN", done);
    }

    fn reset(&mut self, structure: &str) {
        let bits: &[&str] = match structure.starts_with("tmr") {
            true => &["EN", "TT", "DN"],
            false => &["CU", "CD", "DN", "OV", "UN"],
        };
        bits.iter().for_each(|bit| self.set_flag(structure, bit, false));
        self.values.store(&format!("{structure}.ACC"), Value::Whole(0));
    }

    fn on_edge(&mut self, name: &str, operands: &[String], power: bool) {
        let control = match name {
            "FFL" | "FFU" => operands[2].clone(),
            _ => operands[1].clone(),
        };
        let bit = if name == "FFU" { "EU" } else { "EN" };
        let is_edge = power && !self.flag(&control, bit);
        self.set_flag(&control, bit, power);
        let length = self.number(&operands[3]);
        let pos = self.number(&format!("{control}.POS"));
        let store = |machine: &mut Machine, pos: i64| {
            machine.values.store(&format!("{control}.POS"), Value::Whole(pos));
        };
        match name {
            "FFL" => {
                if is_edge && pos < length {
                    let value = self.values.value(&operands[0]);
                    let place = format!("{}[{pos}]", operands[1].split('[').next().unwrap());
                    self.values.store(&place, value);
                    store(self, pos + 1);
                }
            }
            "FFU" if is_edge => {
                let array = operands[0].split('[').next().unwrap().to_owned();
                if pos <= 0 {
                    self.values.store(&operands[1], Value::Whole(0));
                } else {
                    let first = self.values.value(&format!("{array}[0]"));
                    self.values.store(&operands[1], first);
                    for at in 0..length {
                        let next = match at + 1 < length {
                            true => self.values.value(&format!("{array}[{}]", at + 1)),
                            false => Value::Whole(0),
                        };
                        self.values.store(&format!("{array}[{at}]"), next);
                    }
                    store(self, pos - 1);
                }
            }
            "FFU" => {}
            _ => {
                if is_edge {
                    self.shift(operands, length, name == "BSL");
                    store(self, length);
                }
                self.set_flag(&control, "DN", power);
                if !power {
                    store(self, 0);
                }
            }
        }
        if power && name.starts_with('F') {
            let pos = self.number(&format!("{control}.POS"));
            self.set_flag(&control, "DN", pos >= length);
            self.set_flag(&control, "EM", pos <= 0);
        }
    }

    /// Moves the bits of an array of words by one.
    fn shift(&mut self, operands: &[String], length: i64, is_left: bool) {
        let (control, source) = (&operands[1], &operands[2]);
        let array = operands[0].split('[').next().unwrap().to_owned();
        let name = |at: i64| format!("{array}[{}].{}", at / 32, at % 32);
        let comes_in = self.values.bit(source);
        let old: Vec<bool> = (0..length).map(|at| self.values.bit(&name(at))).collect();
        let goes_out = if is_left { old[length as usize - 1] } else { old[0] };
        self.set_flag(control, "UL", goes_out);
        for at in 0..length {
            let from = if is_left { at - 1 } else { at + 1 };
            let is_on = match usize::try_from(from).ok().and_then(|from| old.get(from)) {
                Some(bit) => *bit,
                None => comes_in,
            };
            self.values.set_bit(&name(at), is_on);
        }
    }

    fn compute(&mut self, name: &str, operands: &[String]) {
        let value = |at: usize| self.values.value(&operands[at]);
        let bits = |at: usize| self.number(&operands[at]) as i32;
        let result = match name {
            "MOV" => (1, value(0)),
            "CLR" => (0, Value::Whole(0)),
            "ADD" | "SUB" | "MUL" | "DIV" | "MOD" => {
                (2, arithmetic(name, [value(0), value(1)], operands[2].starts_with("real")))
            }
            "AND" => (2, Value::Whole((bits(0) & bits(1)).into())),
            "OR" => (2, Value::Whole((bits(0) | bits(1)).into())),
            "XOR" => (2, Value::Whole((bits(0) ^ bits(1)).into())),
            "NOT" => (1, Value::Whole((!bits(0)).into())),
            "NEG" => (1, negated(value(0))),
            "ABS" => match value(0) {
                Value::Whole(value) => (1, Value::Whole(value.abs())),
                Value::Real(value) => (1, Value::Real(value.abs())),
            },
            "SQR" => match value(0) {
                Value::Whole(value) => {
                    (1, Value::Whole((value.abs() as f64).sqrt().trunc() as i64))
                }
                Value::Real(value) => (1, Value::Real(value.abs().sqrt())),
            },
            "MVM" => {
                let (source, mask, old) = (bits(0), bits(1), bits(2));
                (2, Value::Whole(((source & mask) | (old & !mask)).into()))
            }
            "BTD" => {
                let (from, to, length) = (bits(1), bits(3), bits(4));
                let mut word = bits(2);
                for at in 0..length.min(32 - from).min(32 - to) {
                    let bit = (bits(0) >> (from + at)) & 1;
                    word = (word & !(1 << (to + at))) | (bit << (to + at));
                }
                (2, Value::Whole(word.into()))
            }
            "COP" | "FLL" => return self.fill(name, operands),
            "NOP" | "LBL" | "OTL" | "OTU" | "SBR" => return,
            name => panic!("the interpreter has no {name}"),
        };
        self.values.store(&operands[result.0], result.1);
    }

    fn fill(&mut self, name: &str, operands: &[String]) {
        let split = |text: &str| {
            let (array, rest) = text.split_once('[').unwrap();
            (array.to_owned(), rest.trim_end_matches(']').parse::<i64>().unwrap())
        };
        let length = self.number(&operands[2]);
        let (to, begin) = split(&operands[1]);
        let values: Vec<Value> = (0..length)
            .map(|at| match name {
                "FLL" => self.values.value(&operands[0]),
                _ => {
                    let (from, first) = split(&operands[0]);
                    self.values.value(&format!("{from}[{}]", first + at))
                }
            })
            .collect();
        for (at, value) in values.into_iter().enumerate() {
            self.values.store(&format!("{to}[{}]", begin + at as i64), value);
        }
    }
}
