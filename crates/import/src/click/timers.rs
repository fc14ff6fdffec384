//! Timers and counters of CLICK.
//!
//! A timer adds the time since the last scan in every scan in which it runs, the first one too, and
//! its current value goes on to 32767. A counter counts in every scan in which its row has power;
//! programs put an edge contact before it.

use super::operand::{ClickOperand, ClickType};
use super::work::{PoweredCall, RungWork};
use crate::condition::RungCondition;

/// The tag with the time since the last scan, in ms.
pub(super) const SCAN_MS: &str = "click_ms";

/// The parts of a timer or counter.
struct Counted {
    done: String,
    current: ClickOperand,
    preset: ClickOperand,
    /// The rest of a unit, in ms, and the ms of a unit; ms have none.
    rest: Option<UnitRest>,
}

/// What a timer keeps of a unit that is not over.
struct UnitRest {
    name: String,
    ms: u32,
}

impl Counted {
    /// The compare of the current value with the preset.
    fn compare(&self, operator: &str) -> RungCondition {
        let places = [&self.current.place, &self.preset.place];
        let reads = places.into_iter().flatten().cloned().collect();
        RungCondition::compare(&self.current.text, operator, &self.preset.text, reads)
    }
}

impl RungWork<'_> {
    /// The operands of a timer or counter.
    fn counted(&mut self, powered: &PoweredCall, kind: ClickType) -> Result<Counted, String> {
        let call = &powered.call;
        let done = self.memory.address(call.at(0)?)?;
        let current = self.target(call.at(1)?)?;
        if done.kind != ClickType::Bit || current.kind != kind {
            return Err(format!("operands that {} has not", call.name));
        }
        let preset = call.option("preset").ok_or("no preset")?;
        let preset = self.memory.number(preset)?;
        let ms = match call.option("unit").unwrap_or("Tms") {
            "Tms" => 1,
            "Ts" => 1000,
            "Tm" => 60_000,
            "Th" => 3_600_000,
            unit => return Err(format!("the unit {unit}")),
        };
        let rest = (ms > 1).then(|| {
            let wish = format!("{}_rest", current.text);
            UnitRest { name: self.memory.own(&wish, "The rest of a unit of a timer, in ms"), ms }
        });
        Ok(Counted { done: done.text, current, preset, rest })
    }

    /// Adds the time since the last scan.
    fn add_time(&mut self, timer: &Counted, when: &[RungCondition]) {
        let when = || when.iter().map(RungWork::early).collect::<Vec<_>>();
        let current = &timer.current.text;
        let Some(UnitRest { name, ms }) = &timer.rest else {
            let text = format!("MATH {current} = min(32767, {current} + {SCAN_MS})");
            return self.push(when(), text, current);
        };
        self.push(when(), format!("MATH {name} = {name} + {SCAN_MS}"), name);
        let text = format!("MATH {current} = min(32767, {current} + {name} / {ms})");
        self.push(when(), text, current);
        self.push(when(), format!("MATH {name} = {name} % {ms}"), name);
    }

    /// Sets the current value to 0.
    fn clear(&mut self, timer: &Counted, when: &RungCondition) {
        let current = &timer.current.text;
        self.push(vec![RungWork::early(when)], format!("MOVE 0 to={current}"), current);
        if let Some(UnitRest { name, .. }) = &timer.rest {
            self.push(vec![RungWork::early(when)], format!("MOVE 0 to={name}"), name);
        }
    }

    /// `on_delay(T1,TD1,preset=100,unit=Tms)`; with `.reset()` it keeps its time.
    pub(super) fn on_delay(&mut self, powered: &PoweredCall) -> Result<(), String> {
        let timer = self.counted(powered, ClickType::Short)?;
        let power = &powered.power;
        let Some(reset) = &powered.reset else {
            self.add_time(&timer, std::slice::from_ref(power));
            self.clear(&timer, &power.clone().opposite());
            let done = self.now(timer.compare(">="));
            self.drive(&timer.done, vec![RungWork::early(power), done]);
            return Ok(());
        };
        let runs = [reset.clone().opposite(), power.clone()];
        self.add_time(&timer, &runs);
        self.clear(&timer, reset);
        for (operator, action) in [(">=", "SET"), ("<", "RST")] {
            let mut when: Vec<_> = runs.iter().map(RungWork::early).collect();
            when.push(self.now(timer.compare(operator)));
            self.push(when, format!("{action} {}", timer.done), &timer.done);
        }
        let text = format!("RST {}", timer.done);
        self.push(vec![RungWork::early(reset)], text, &timer.done);
        Ok(())
    }

    /// `off_delay(T1,TD1,preset=100,unit=Tms)`.
    pub(super) fn off_delay(&mut self, powered: &PoweredCall) -> Result<(), String> {
        let timer = self.counted(powered, ClickType::Short)?;
        let (power, current) = (&powered.power, &timer.current);
        let reads = current.place.iter().cloned().collect();
        let has_run = RungCondition::any([
            RungCondition::bit(&timer.done),
            RungCondition::compare(&current.text, "!=", "0", reads),
        ]);
        let times = RungCondition::all([power.clone().opposite(), has_run]);
        self.add_time(&timer, std::slice::from_ref(&times));
        self.clear(&timer, power);
        for (operator, action) in [("<", "SET"), (">=", "RST")] {
            let when = vec![RungWork::early(&times), self.now(timer.compare(operator))];
            self.push(when, format!("{action} {}", timer.done), &timer.done);
        }
        let text = format!("SET {}", timer.done);
        self.push(vec![RungWork::early(power)], text, &timer.done);
        Ok(())
    }

    /// `count_up(CT1,CTD1,preset=3)`, `count_down(…)`, with `.reset()` and `.down()`.
    pub(super) fn count(&mut self, powered: &PoweredCall) -> Result<(), String> {
        let mut counter = self.counted(powered, ClickType::Long)?;
        let off = RungCondition::Constant(false);
        let reset = powered.reset.clone().unwrap_or(off.clone());
        let down = powered.down.clone().unwrap_or(off);
        let (up, down, operator) = match powered.call.name.as_str() {
            "count_up" => (powered.power.clone(), down, ">="),
            _ => {
                let preset = &counter.preset.text;
                counter.preset.text = match preset.strip_prefix('-') {
                    Some(positive) => positive.to_owned(),
                    None if counter.preset.place.is_none() => format!("-{preset}"),
                    None => format!("0 - {preset}"),
                };
                (RungCondition::Constant(false), powered.power.clone(), "<=")
            }
        };
        let current = counter.current.text.clone();
        if powered.reset.is_some() {
            self.clear(&counter, &reset);
        }
        let not_reset = reset.opposite();
        for (on, off, sign) in [(&up, &down, "+"), (&down, &up, "-")] {
            if *on == RungCondition::Constant(false) {
                continue;
            }
            let parts = [on.clone(), off.clone().opposite(), not_reset.clone()];
            let when = parts.iter().map(RungWork::early).collect();
            self.push(when, format!("MATH {current} = {current} {sign} 1"), &current);
        }
        let compare = self.now(counter.compare(operator));
        self.drive(&counter.done, vec![RungWork::early(&not_reset), compare]);
        Ok(())
    }
}
