//! Random instructions: the owners of structures, and all others.

use super::pool::Pool;
use std::collections::BTreeSet;

/// The place of an instruction.
pub struct Spot<'a> {
    /// The Program's name; `None` in a Task.
    pub program: Option<&'a str>,
    /// The block's name, for a HALT of itself; `None` if that is not allowed.
    pub own: Option<&'a str>,
    pub in_stage: bool,
    pub stages: &'a [String],
    /// The bits that OUT, PD, ND and timers drive in this element. Each bit has one driver.
    pub driven: &'a mut BTreeSet<String>,
}

/// The blocks and structures that instructions can name.
pub struct Targets {
    /// The Programs without `Main`.
    pub programs: Vec<String>,
    /// The Programs without `Main`, and the Tasks without the built-in ones.
    pub haltable: Vec<String>,
    pub counters: Vec<String>,
    pub timers: Vec<String>,
    pub sensaphones: Vec<String>,
}

pub const COUNTERS: [&str; 4] = ["CNT", "CNTDN", "UDC", "UDCG"];
pub const TIMERS: [&str; 7] = ["ONDTMR", "OFFDTMR", "TMR", "TMRDOWN", "TMRA", "TMRADOWN", "TMRAG"];

impl Pool {
    pub fn counter(&mut self, mnemonic: &str, structure: &str) -> String {
        let name = self.name(structure);
        if mnemonic.starts_with("CNT") {
            let preset = match self.rng.weighted(&[55, 42, 3]) {
                0 => self.rng.range(0, 5).to_string(),
                1 => self.word(),
                _ => i32::MAX.to_string(),
            };
            return format!("{mnemonic} {name} preset={preset}");
        }
        let mut text = format!("{mnemonic} {name}");
        for key in ["up-preset", "dn-preset"] {
            if self.rng.chance(75) {
                let preset = match self.rng.chance(60) {
                    true => self.rng.range(-4, 4).to_string(),
                    false => self.value(),
                };
                text.push_str(&format!(" {key}={preset}"));
            }
        }
        text
    }

    pub fn timer(
        &mut self,
        mnemonic: &str,
        structure: &str,
        driven: &mut BTreeSet<String>,
    ) -> String {
        let name = self.name(structure);
        let preset = match self.rng.weighted(&[66, 30, 4]) {
            0 => {
                let ms = self.milliseconds();
                self.duration_text(ms)
            }
            1 => self.word(),
            _ => "596h31m23s647ms".to_string(),
        };
        let mut text = format!("{mnemonic} {name} preset={preset}");
        if mnemonic == "ONDTMR" || mnemonic == "OFFDTMR" {
            let bit = self.driven_bit(driven).unwrap_or_else(|| {
                let timers = self.owned.iter().position(|owned| owned.name == structure);
                format!("C{}", 100 + timers.unwrap_or(0))
            });
            text.push_str(&format!(" output={}", self.name(&bit)));
        }
        text
    }

    /// A CTU or CTD; `preset`: the preset that it must state.
    pub fn sensaphone(&mut self, mnemonic: &str, structure: &str, preset: Option<&str>) -> String {
        let name = self.name(structure);
        match preset {
            Some(preset) => format!("{mnemonic} {name} preset={preset}"),
            None => format!("{mnemonic} {name}"),
        }
    }

    pub fn interval(&mut self) -> String {
        match self.rng.weighted(&[70, 22, 8]) {
            0 => {
                let ms = self.rng.range(0, 5 * self.period);
                self.duration_text(ms)
            }
            1 => self.word(),
            _ => "0".to_string(),
        }
    }

    /// A bit that nothing else drives in this element; `None` if eight random bits are all driven.
    fn driven_bit(&mut self, driven: &mut BTreeSet<String>) -> Option<String> {
        let mut tries = (0..8).map(|_| self.written_bit());
        let bit = tries.find(|bit| !driven.contains(bit))?;
        driven.insert(bit.clone());
        Some(bit)
    }

    /// One instruction that has a single leg and owns no structure.
    pub fn instr(&mut self, spot: &mut Spot, targets: &Targets) -> String {
        let stages = spot.stages.len();
        let weights = [
            14,
            8,
            8,
            4,
            4,
            4,
            5 * usize::from(!targets.counters.is_empty()),
            5 * usize::from(!targets.timers.is_empty()),
            3 * usize::from(!targets.sensaphones.is_empty()),
            12,
            7 * usize::from(!targets.haltable.is_empty()),
            6 * usize::from(spot.own.is_some()),
            16 * usize::from(spot.in_stage),
            12 * usize::from(stages > 0),
        ];
        match self.rng.weighted(&weights) {
            kind @ (0 | 3 | 4) => {
                let mnemonic = ["OUT", "", "", "PD", "ND"][kind];
                match self.driven_bit(spot.driven) {
                    Some(bit) => format!("{mnemonic} {}", self.name(&bit)),
                    None => format!("SET {}", self.written_bit()),
                }
            }
            kind @ (1 | 2 | 5) => {
                let mnemonic = ["", "SET", "RST", "", "", "PONOFF"][kind];
                if kind != 5
                    && self.rng.chance(15)
                    && let Some(element) = self.element(true, true)
                {
                    return format!("{mnemonic} {element}");
                }
                if kind != 5
                    && self.rng.chance(8)
                    && let Some(element) = self.written_element_bit()
                {
                    return format!("{mnemonic} {element}");
                }
                let bit = self.written_bit();
                format!("{mnemonic} {}", self.name(&bit))
            }
            6 => {
                let name = self.rng.pick(&targets.counters).clone();
                format!("RSTCT {}", self.name(&name))
            }
            7 => {
                let name = self.rng.pick(&targets.timers).clone();
                format!("RSTT {}", self.name(&name))
            }
            8 => {
                let name = self.rng.pick(&targets.sensaphones).clone();
                format!("RES {}", self.name(&name))
            }
            10 => self.control(targets),
            11 => self.own_end(spot),
            12 => self.leave_stage(spot.stages),
            13 => self.stage_bits(spot.stages),
            _ => self.arithmetic(),
        }
    }

    fn arithmetic(&mut self) -> String {
        if self.rng.chance(45) {
            return self.math();
        }
        if self.rng.chance(10)
            && let Some(copy) = self.record_copy()
        {
            return copy;
        }
        if self.rng.chance(16) {
            return self.whole_arrays();
        }
        if self.rng.chance(25) {
            return self.packing();
        }
        let is_real = self.rng.chance(20);
        let target = if is_real { self.indexed("R") } else { self.written_word() };
        let target = self.name(&target);
        let element = if is_real { self.real_element() } else { self.element(false, true) };
        let target = element.filter(|_| self.rng.chance(12)).unwrap_or(target);
        let value = self.any_value();
        match self.rng.weighted(&[45, 35, 20]) {
            0 => format!("MOVE {value} to={target}"),
            1 => {
                let other = if self.rng.chance(60) { target.clone() } else { self.any_value() };
                format!("ADD {other} {value} to={target}")
            }
            _ => {
                let other = if self.rng.chance(50) { target.clone() } else { self.any_value() };
                format!("SUB {other} {value} to={target}")
            }
        }
    }

    fn control(&mut self, targets: &Targets) -> String {
        if targets.programs.is_empty() || self.rng.chance(40) {
            return format!("HALT {}", self.rng.pick(&targets.haltable));
        }
        let program = self.rng.pick(&targets.programs).clone();
        let mnemonic = self.rng.pick(&["RUN", "RESTART"]);
        format!("{mnemonic} {program}")
    }

    fn own_end(&mut self, spot: &Spot) -> String {
        let own = spot.own.unwrap_or_default();
        match spot.program {
            Some(_) if self.rng.chance(40) => "EXIT".to_string(),
            Some(_) if self.rng.chance(50) => format!("RESTART {own}"),
            _ => format!("HALT {own}"),
        }
    }

    fn some_stages(&mut self, stages: &[String]) -> Vec<String> {
        let mut all = stages.to_vec();
        self.rng.shuffle(&mut all);
        all.truncate(1 + self.rng.below(3));
        all
    }

    fn leave_stage(&mut self, stages: &[String]) -> String {
        if self.rng.chance(70) {
            return format!("JMP {}", self.rng.pick(stages));
        }
        format!("SGDIVRG {}", self.some_stages(stages).join(" "))
    }

    fn stage_bits(&mut self, stages: &[String]) -> String {
        let target = self.rng.pick(stages).clone();
        match self.rng.weighted(&[40, 25, 35]) {
            0 => format!("SGSET {target}"),
            1 => format!("SGRST {target}"),
            _ => format!("SGCONVRG {} to={target}", self.some_stages(stages).join(" ")),
        }
    }
}

/// Whether the instruction ends, stops or restarts a block or the controller, so that its rung
/// should seldom be ON.
pub fn is_drastic(instr: &str) -> bool {
    ["HALT", "EXIT", "RESTART", "STOP"].iter().any(|word| instr.starts_with(word))
}

/// Whether the instruction resets a structure, and holds it in reset while its rung is ON.
pub fn is_reset(instr: &str) -> bool {
    ["RSTCT", "RSTT", "RES "].iter().any(|word| instr.starts_with(word))
}
