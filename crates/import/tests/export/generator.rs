//! Random ladders of what is exported.

use rungd_base::random::SplitMix64;

use crate::numbers::below;

/// A ladder that is being made.
struct Ladder<'r> {
    random: &'r mut SplitMix64,
    rungs: String,
    /// The numbers of the next output, timer and counter.
    outputs: u64,
    timers: u64,
    counters: u64,
}

/// The text of a ladder.
pub fn ladder(random: &mut SplitMix64) -> String {
    let mut ladder = Ladder { random, rungs: String::new(), outputs: 0, timers: 0, counters: 0 };
    let count = 4 + ladder.below(8);
    for _ in 0..count {
        ladder.rung();
    }
    // The resets are of structures that have an owner.
    for _ in 0..2 {
        ladder.reset();
    }
    let mut tags = String::new();
    for at in 0..6 {
        tags += &format!("in{at} = {{ at = \"X{at}\" }}\nbit{at} = {{ type = \"bit\" }}\n");
    }
    for at in 0..3 {
        tags += &format!("num{at} = {{ type = \"int\", initial = {at} }}\n");
        tags += &format!("rea{at} = {{ type = \"real\" }}\n");
    }
    tags += "small = { type = \"word\" }\nlevel = { type = \"int\", min = -20, max = 300 }\n";
    tags += "list = { type = \"int\", count = 3, min = -90, max = 90 }\n";
    tags += "flags = { type = \"bit\", count = 3 }\n";
    for at in 0..ladder.timers {
        tags += &format!("time{at} = {{ type = \"timer\" }}\n");
    }
    for at in 0..ladder.counters {
        tags += &format!("count{at} = {{ type = \"counter\" }}\n");
    }
    format!("[tags]\n{tags}\n[[program]]\nname = \"Main\"\n{}", ladder.rungs)
}

impl Ladder<'_> {
    fn below(&mut self, limit: u64) -> u64 {
        below(self.random, limit)
    }

    fn one_of(&mut self, texts: &[&str]) -> String {
        texts[self.below(texts.len() as u64) as usize].to_owned()
    }

    fn number(&mut self) -> String {
        match self.below(8) {
            0 if self.timers > 0 => format!("time{}.Acc", self.below(self.timers)),
            1 if self.counters > 0 => format!("count{}.Acc", self.below(self.counters)),
            2 => "small".to_owned(),
            3 => "level".to_owned(),
            _ => format!("num{}", self.below(3)),
        }
    }

    fn constant(&mut self) -> String {
        match self.below(6) {
            0 => (self.below(1 << 32) as u32 as i32).to_string(),
            _ => (self.below(60) as i64 - 20).to_string(),
        }
    }

    fn flag(&mut self) -> String {
        if self.timers > 0 && self.below(2) == 0 {
            let at = self.below(self.timers);
            let flag = self.one_of(&["Done", "Reset", "Zero", "Timing"]);
            return format!("time{at}.{flag}");
        }
        if self.counters > 0 && self.below(2) == 0 {
            let at = self.below(self.counters);
            let flag = self.one_of(&["Done", "Reset", "Zero", "DnDone"]);
            return format!("count{at}.{flag}");
        }
        format!("in{}", self.below(6))
    }

    fn contact(&mut self, depth: u64) -> String {
        let text = match self.below(if depth == 0 { 7 } else { 12 }) {
            0 | 1 => format!("in{}", self.below(6)),
            2 | 3 => format!("bit{}", self.below(6)),
            4 => self.flag(),
            5 => {
                let operator = self.one_of(&["==", "!=", "<", "<=", ">", ">="]);
                let (left, right) = (self.number(), self.constant());
                match self.below(5) {
                    0 => format!("rea{} {operator} {}.5", self.below(3), self.below(9)),
                    1 => format!("rea{} {operator} rea0", 1 + self.below(2)),
                    2 => format!("num0 {operator} {left}").replace("num0 == num0", "num0 == num1"),
                    _ => format!("{left} {operator} {right}"),
                }
            }
            6 => match self.below(6) {
                0 => format!("flags[num{}]", self.below(3)),
                1 => format!("list[num{}] > {}", self.below(3), self.below(9)),
                2 => format!("num0 + {} * 2 > {}", self.number(), self.number()),
                _ => self.one_of(&["$FirstScan", "$On", "$Off", "in0", "in1"]),
            },
            7 | 8 => format!("({} | {})", self.contact(depth - 1), self.contact(depth - 1)),
            9 => format!("({} & {})", self.contact(depth - 1), self.contact(depth - 1)),
            10 => format!("rise({})", self.contact(depth - 1)),
            _ => format!("fall({})", self.contact(depth - 1)),
        };
        let is_compare = text.contains(' ') && !text.starts_with('(') && !text.contains('(');
        match self.below(5) {
            0 if is_compare => format!("!({text})"),
            0 => format!("!{text}"),
            _ => text,
        }
    }

    fn contacts(&mut self) -> String {
        let count = 1 + self.below(3);
        let all: Vec<String> = (0..count).map(|_| format!("\"{}\"", self.contact(2))).collect();
        all.join(", ")
    }

    fn instruction(&mut self) -> String {
        let bit = format!("bit{}", self.below(6));
        match self.below(14) {
            11 | 12 => format!("MATH {}", self.calculation()),
            13 => {
                let (at, constant) = (self.below(3), self.constant());
                match self.below(3) {
                    0 => format!("MOVE {constant} to=list[num{at}]"),
                    1 => format!("ADD list[num{at}] 1 to=list[num{at}]"),
                    _ => format!("MOVE rea0 to=num{at}"),
                }
            }
            0..=2 => {
                self.outputs += 1;
                let name = self.one_of(&["OUT", "OUT", "PD", "ND", "PONOFF"]);
                format!("{name} Y{}", self.outputs)
            }
            3 => format!("SET {bit}"),
            4 => format!("RST {bit}"),
            5 => {
                let to = self.number();
                match self.below(3) {
                    0 => format!("MOVE {} to={to}", self.constant()),
                    1 => format!("MOVE rea0 to=rea{}", 1 + self.below(2)),
                    _ => format!("MOVE {} to={to}", self.number()),
                }
            }
            6 | 7 => {
                let name = self.one_of(&["ADD", "SUB"]);
                let to = self.number();
                match self.below(4) {
                    0 => format!("{name} {} {} to={to}", self.number(), self.constant()),
                    1 => format!("{name} {} {} to={to}", self.constant(), self.number()),
                    2 => format!("{name} rea0 1.5 to=rea{}", self.below(3)),
                    _ => format!("{name} {} {} to={to}", self.number(), self.number()),
                }
            }
            _ => self.timer(),
        }
    }

    /// A part of an expression.
    fn term(&mut self, depth: u64) -> String {
        match self.below(if depth == 0 { 5 } else { 12 }) {
            0 | 1 => self.number(),
            2 => self.below(50).to_string(),
            3 => format!("bit{}", self.below(6)),
            4 => match self.below(3) {
                0 => format!("list[num{}]", self.below(3)),
                1 => format!("flags[num{}]", self.below(3)),
                _ => format!("rea{}", self.below(3)),
            },
            5 => format!("-({})", self.term(depth - 1)),
            6 => format!("min({}, {}, 7)", self.term(depth - 1), self.term(depth - 1)),
            7 => format!("clamp({}, -5, {})", self.term(depth - 1), self.term(0)),
            8 => format!("if({} > 3, {}, {})", self.term(0), self.term(depth - 1), self.term(0)),
            9 => format!("abs({})", self.term(depth - 1)),
            _ => {
                let operator = self.one_of(&["+", "-", "*", "/"]);
                format!("({} {operator} {})", self.term(depth - 1), self.term(0))
            }
        }
    }

    fn calculation(&mut self) -> String {
        let value = self.term(2);
        match self.below(4) {
            0 => format!("bit{} = {value} > {} || in0", self.below(6), self.term(0)),
            1 => format!("rea{} = {value} * 0.3", self.below(3)),
            2 => format!("list[num{}] = {value}", self.below(3)),
            _ => format!("{} = {value}", self.number()),
        }
    }

    fn timer(&mut self) -> String {
        let at = self.timers;
        let name = self.one_of(&["TMR", "ONDTMR", "OFFDTMR", "TMRDOWN", "TMRAG"]);
        let preset = match self.below(3) {
            0 => "num1".to_owned(),
            _ => format!("{}ms", self.below(120)),
        };
        self.timers += 1;
        match name.as_str() {
            "ONDTMR" | "OFFDTMR" => {
                self.outputs += 1;
                format!("{name} time{at} preset={preset} output=Y{}", self.outputs)
            }
            _ => format!("{name} time{at} preset={preset}"),
        }
    }

    /// A rung with one leg, and one or two branches now and then.
    fn rung(&mut self) {
        if self.below(4) == 0 {
            return self.legs();
        }
        let when = self.contacts();
        let count = 1 + self.below(3);
        let body: Vec<String> = (0..count).map(|_| format!("\"{}\"", self.instruction())).collect();
        self.rungs += &format!("[[program.rung]]\nwhen = [{when}]\ndo = [{}]\n", body.join(", "));
        let branches = self.below(3).saturating_sub(1) * (1 + self.below(2));
        for _ in 0..branches {
            let when = self.contacts();
            let count = 1 + self.below(2);
            let body: Vec<String> =
                (0..count).map(|_| format!("\"{}\"", self.instruction())).collect();
            self.rungs +=
                &format!("[[program.rung.branch]]\nwhen = [{when}]\ndo = [{}]\n", body.join(", "));
        }
    }

    /// A rung of an instruction with several legs.
    fn legs(&mut self) {
        let (time, count, few) = (self.timers, self.counters, self.below(90));
        let (legs, text): (&[&str], String) = match self.below(6) {
            0 => (&["en", "rst"], format!("TMRA time{time} preset={few}ms")),
            1 => (&["en", "rst"], format!("TMRADOWN time{time} preset=num2")),
            2 => (&["up", "rst"], format!("CNT count{count} preset={}", few % 6)),
            3 => (&["dn", "rst"], format!("CNTDN count{count} preset=num0")),
            4 => {
                let presets = ["up-preset=3 dn-preset=-2", "up-preset=num1", "dn-preset=num2", ""];
                let presets = self.one_of(&presets);
                (&["up", "dn", "rst"], format!("UDC count{count} {presets}"))
            }
            _ => (&["up", "dn"], format!("UDCG count{count} up-preset=4")),
        };
        self.rungs += "[[program.rung]]\n";
        for leg in legs {
            let contacts = self.contacts();
            self.rungs += &format!("leg.{leg} = [{contacts}]\n");
        }
        match text.starts_with("TM") {
            true => self.timers += 1,
            false => self.counters += 1,
        }
        self.rungs += &format!("do = [\"{}\"]\n", text.trim_end());
    }

    fn reset(&mut self) {
        let text = match self.below(2) {
            0 if self.timers > 0 => format!("RSTT time{}", self.below(self.timers)),
            _ if self.counters > 0 => format!("RSTCT count{}", self.below(self.counters)),
            _ => return,
        };
        let when = self.contacts();
        let rung = format!("[[program.rung]]\nwhen = [{when}]\ndo = [\"{text}\", \"SET bit0\"]\n");
        // In front of the others, or behind them.
        self.rungs = match self.below(2) {
            0 => rung + &self.rungs,
            _ => std::mem::take(&mut self.rungs) + &rung,
        };
    }
}
