//! Random rungs of Logix.

use rungd_base::random::SplitMix64;

use crate::numbers::below;

/// Random routines, and the tags that they name.
pub struct Routines {
    pub tags: Vec<String>,
    pub main: Vec<String>,
    pub sub: Vec<String>,
    /// The number of bits that bit shifts move; what lies behind them is undefined in Logix.
    pub shifted: i64,
}

pub const BITS: usize = 8;
pub const WORDS: usize = 3;

/// Makes routines.
pub fn routines(random: &mut SplitMix64) -> Routines {
    let shifted = [5, 32, 40, 96][below(random, 4) as usize];
    let controls = Vec::new();
    let mut generator =
        Generator { random, storages: 0, controls, timers: 0, counters: 0, shifted };
    let mut main = Vec::new();
    let count = 2 + generator.below(6);
    let jumps = generator.below(4) == 0;
    let zones = !jumps && generator.below(4) == 0;
    for at in 0..count {
        if jumps && at == 1 {
            main.push(format!("{}JMP(over);", generator.contacts(1)));
        }
        if zones && at == 2 {
            main.push(format!("{}MCR();", generator.contacts(1)));
        }
        main.push(format!("{};", generator.rung(true)));
        if zones && at == 3 {
            main.push("MCR();".to_owned());
        }
    }
    if jumps {
        main.push(format!("LBL(over){};", generator.rung(true)));
    }
    let mut sub = vec![format!("{};", generator.rung(false))];
    if generator.below(2) == 0 {
        sub.push(format!("{}RET();", generator.contacts(1)));
    }
    sub.push(format!("{};", generator.rung(false)));
    let tags = generator.tags();
    Routines { tags, main, sub, shifted }
}

struct Generator<'r> {
    random: &'r mut SplitMix64,
    storages: usize,
    controls: Vec<String>,
    timers: usize,
    counters: usize,
    shifted: i64,
}

impl Generator<'_> {
    fn below(&mut self, limit: usize) -> usize {
        below(self.random, limit as u64) as usize
    }

    fn one<'t>(&mut self, of: &[&'t str]) -> &'t str {
        let at = self.below(of.len());
        of[at]
    }

    fn tags(&self) -> Vec<String> {
        let mut tags = Vec::new();
        (0..BITS).for_each(|at| tags.push(format!("bit{at}: BOOL")));
        for at in 0..WORDS {
            tags.push(format!("num{at}: DINT"));
            tags.push(format!("shrt{at}: INT"));
            tags.push(format!("tiny{at}: SINT"));
            tags.push(format!("real{at}: REAL"));
        }
        (0..2).for_each(|at| tags.push(format!("tmr{at}: TIMER")));
        (0..2).for_each(|at| tags.push(format!("cnt{at}: COUNTER")));
        (0..self.storages).for_each(|at| tags.push(format!("store{at}: BOOL")));
        tags.push("arr: DINT[8]".to_owned());
        tags.push("fifo: DINT[6]".to_owned());
        tags.push("shift: DINT[3]".to_owned());
        tags.push("flags: BOOL[32]".to_owned());
        tags.push("idx: DINT".to_owned());
        tags.extend(self.controls.iter().map(|name| format!("{name}: CONTROL")));
        tags
    }

    fn bit(&mut self) -> String {
        let at = self.below(BITS);
        let word = self.below(WORDS);
        match self.below(12) {
            0 => format!("num{word}.{}", self.below(32)),
            1 => format!("shrt{word}.{}", self.below(16)),
            2 => format!("tiny{word}.{}", self.below(8)),
            3 => format!("flags[{}]", self.below(8)),
            4 => "flags[idx]".to_owned(),
            5 => format!("arr[{}].{}", self.below(8), self.below(32)),
            _ => format!("bit{at}"),
        }
    }

    /// A bit that a coil drives: not with a moving index, whose prescan is another.
    fn coil(&mut self) -> String {
        loop {
            let bit = self.bit();
            if !bit.contains("idx") {
                return bit;
            }
        }
    }

    fn member(&mut self) -> String {
        let at = self.below(2);
        match self.below(2) {
            0 => format!("tmr{at}.{}", self.one(&["EN", "TT", "DN"])),
            _ => format!("cnt{at}.{}", self.one(&["CU", "CD", "DN", "OV", "UN"])),
        }
    }

    fn word(&mut self) -> String {
        let at = self.below(WORDS);
        match self.below(9) {
            0 => format!("arr[{}]", self.below(8)),
            1 => "arr[idx]".to_owned(),
            2 => "arr[idx+1]".to_owned(),
            3 | 4 => format!("shrt{at}"),
            5 => format!("tiny{at}"),
            _ => format!("num{at}"),
        }
    }

    fn constant(&mut self) -> String {
        match self.below(4) {
            0 => self.one(&["2147483647", "-2147483648", "32767", "-32768", "65535"]).to_owned(),
            _ => (self.below(20) as i64 - 6).to_string(),
        }
    }

    fn source(&mut self) -> String {
        match self.below(8) {
            0..3 => self.constant(),
            3 => format!("tmr{}.ACC", self.below(2)),
            4 => format!("cnt{}.ACC", self.below(2)),
            _ => self.word(),
        }
    }

    fn contact(&mut self) -> String {
        match self.below(12) {
            0 => {
                let name = self.one(&["EQU", "NEQ", "LES", "LEQ", "GRT", "GEQ"]);
                format!("{name}({},{})", self.word(), self.source())
            }
            1 => format!("LIM({},{},{})", self.source(), self.word(), self.source()),
            2 => format!("MEQ({},{},{})", self.word(), self.source(), self.word()),
            3 => {
                let name = self.one(&["XIC", "XIO"]);
                format!("{name}({})", self.member())
            }
            4 if self.below(3) == 0 => "AFI()".to_owned(),
            5 => format!("LES(real{},{})", self.below(WORDS), self.below(9)),
            _ => {
                let name = self.one(&["XIC", "XIO"]);
                format!("{name}({})", self.bit())
            }
        }
    }

    fn contacts(&mut self, depth: usize) -> String {
        let mut text = String::new();
        for _ in 0..1 + self.below(2) {
            if depth > 0 && self.below(3) == 0 {
                let (one, other) = (self.contacts(depth - 1), self.contacts(depth - 1));
                text += &format!("[{one} ,{other} ]");
            } else {
                text += &self.contact();
            }
        }
        text
    }

    fn rung(&mut self, may_call: bool) -> String {
        let mut text = if self.below(6) == 0 { String::new() } else { self.contacts(2) };
        if self.below(5) == 0 {
            text += &self.one_shot();
        }
        text + &self.outputs(2, may_call)
    }

    fn one_shot(&mut self) -> String {
        self.storages += 1;
        format!("ONS(store{})", self.storages - 1)
    }

    fn outputs(&mut self, depth: usize, may_call: bool) -> String {
        match self.below(6) {
            0 | 1 if depth > 0 => {
                let mut branches = Vec::new();
                for _ in 0..2 + self.below(2) {
                    let before = if self.below(2) == 0 { self.contacts(1) } else { String::new() };
                    branches.push(format!("{before}{}", self.outputs(depth - 1, may_call)));
                }
                let behind = if self.below(4) == 0 {
                    format!("{}{}", self.contact(), self.output(may_call))
                } else {
                    String::new()
                };
                format!("[{} ]{behind}", branches.join(" ,"))
            }
            2 => format!("{}{}{}", self.output(may_call), self.contact(), self.output(may_call)),
            _ => self.output(may_call),
        }
    }

    fn output(&mut self, may_call: bool) -> String {
        match self.below(20) {
            0..6 => {
                let name = self.one(&["OTE", "OTE", "OTL", "OTU"]);
                let bit = if name == "OTE" { self.coil() } else { self.bit() };
                format!("{name}({bit})")
            }
            6 if may_call && self.timers < 2 => {
                self.timers += 1;
                let name = self.one(&["TON", "TOF", "RTO"]);
                format!("{name}(tmr{},?,?)", self.timers - 1)
            }
            7 if may_call && self.counters < 2 => {
                self.counters += 1;
                let name = self.one(&["CTU", "CTD"]);
                format!("{name}(cnt{},?,?)", self.counters - 1)
            }
            8 => {
                let name = self.one(&["tmr", "cnt"]);
                format!("RES({name}{})", self.below(2))
            }
            9 => {
                self.storages += 1;
                let name = self.one(&["OSR", "OSF"]);
                format!("{name}(store{},{})", self.storages - 1, self.coil())
            }
            10 if may_call => "JSR(Sub,0)".to_owned(),
            11 => self.on_array(),
            12 => self.real(),
            13 => format!("MOV({},idx)", self.below(7)),
            _ => self.number(),
        }
    }

    fn real(&mut self) -> String {
        let (at, to) = (self.below(WORDS), self.below(WORDS));
        match self.below(6) {
            0 => format!("ADD(real{at},{}.5,real{to})", self.below(9)),
            1 => format!("DIV(real{at},3.0,real{to})"),
            2 => format!("MOV(shrt{at},real{to})"),
            3 => format!("MOV(real{at},num{to})"),
            4 => format!("DIV(shrt{at},4,real{to})"),
            _ => format!("SUB(real{at},shrt{at},real{to})"),
        }
    }

    fn number(&mut self) -> String {
        let to = self.word();
        let one = self.source();
        match self.below(12) {
            0 | 1 => format!("MOV({one},{to})"),
            2 => {
                let name = self.one(&["ADD", "SUB", "MUL", "AND", "OR", "XOR"]);
                format!("{name}({one},{},{to})", self.source())
            }
            3 => {
                let name = self.one(&["DIV", "MOD"]);
                let by = [2, 3, 7, -5][self.below(4)];
                format!("{name}({one},{by},{to})")
            }
            4 => format!("{}({one},{to})", self.one(&["NOT", "NEG", "ABS"])),
            5 => format!("MVM({one},{},{to})", self.constant()),
            6 => {
                let (from, at) = (self.below(16), self.below(16));
                format!("BTD({one},{from},num{},{at},{})", self.below(WORDS), 1 + self.below(12))
            }
            7 => format!("CLR({to})"),
            8 => format!("SQR({one},{to})"),
            _ => format!("ADD({to},1,{to})"),
        }
    }

    fn on_array(&mut self) -> String {
        let name = format!("ctl{}", self.controls.len());
        match self.below(6) {
            0 => format!("COP(arr[{}],fifo[{}],3)", self.below(5), self.below(3)),
            1 => format!("FLL({},arr[{}],4)", self.below(50), self.below(4)),
            2 => {
                self.controls.push(name.clone());
                format!("FFL(num{},fifo[0],{name},5,0)", self.below(WORDS))
            }
            3 => {
                // The same control as a load, if there is one.
                let name = match self.controls.first() {
                    Some(first) => first.clone(),
                    None => {
                        self.controls.push(name.clone());
                        name
                    }
                };
                format!("FFU(fifo[0],num{},{name},5,0)", self.below(WORDS))
            }
            _ => {
                self.controls.push(name.clone());
                let kind = self.one(&["BSL", "BSR"]);
                let bit = self.below(BITS);
                format!("{kind}(shift[0],{name},bit{bit},{})", self.shifted)
            }
        }
    }
}
