//! Tasks of a PLCopen file: which program is executed when.

use super::document::{PlcopenFile, ProgramInstance};
use super::literals::{IecLiteral, literal};

/// The scan period of a file that names none, in ms.
const PERIOD_MS: i64 = 20;

/// An instance of a program, as it is executed here.
#[derive(Debug)]
pub(super) struct TimedProgram {
    pub(super) name: String,
    /// Its program in the file.
    pub(super) unit: usize,
    pub(super) turn: ProgramPace,
}

/// When a program is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ProgramPace {
    Scan,
    /// In ms.
    Every(i64),
    Never,
}

/// Which programs are executed when.
#[derive(Debug, Default)]
pub(super) struct TaskPlan {
    pub(super) programs: Vec<TimedProgram>,
    pub(super) period_ms: u32,
    pub(super) differences: Vec<String>,
    pub(super) open: Vec<String>,
}

/// The programs of a file in the order of their execution.
pub(super) fn plan(file: &PlcopenFile) -> TaskPlan {
    let mut plan = TaskPlan::default();
    let mut intervals: Vec<i64> = Vec::new();
    let mut found: Vec<(ProgramInstance, Option<i64>)> = Vec::new();
    for task in &file.tasks {
        let interval = task.interval.as_deref().and_then(interval_ms).filter(|ms| *ms > 0);
        if interval.is_none() && task.single.is_some() {
            plan.open.push(format!(
                "the task {} is started by a variable: its programs run in every scan here",
                task.name
            ));
        }
        intervals.extend(interval);
        found.extend(task.instances.iter().map(|instance| (instance.clone(), interval)));
    }
    found.extend(file.free.iter().map(|instance| (instance.clone(), None)));
    let is_program = |unit: &super::document::ProgramUnit| unit.kind == "program";
    if found.is_empty() {
        let names = file.units.iter().filter(|unit| is_program(unit)).map(|unit| &unit.name);
        let one = |name: &String| ProgramInstance { name: name.clone(), unit: name.clone() };
        found = names.map(|name| (one(name), None)).collect();
    }
    let period = intervals.iter().copied().reduce(divisor).unwrap_or_else(|| {
        plan.differences.push(format!("the file names no interval: the scan has {PERIOD_MS} ms"));
        PERIOD_MS
    });
    plan.period_ms = u32::try_from(period.clamp(1, 60_000)).unwrap_or(1);
    let mut was_slow = false;
    for (instance, interval) in found {
        let named = |unit: &super::document::ProgramUnit| {
            is_program(unit) && unit.name.eq_ignore_ascii_case(&instance.unit)
        };
        let Some(unit) = file.units.iter().position(named) else {
            plan.open.push(format!("the program {} is not in the file", instance.unit));
            continue;
        };
        let turn = match interval.filter(|ms| *ms > period) {
            Some(ms) => ProgramPace::Every(ms),
            None => ProgramPace::Scan,
        };
        if was_slow && turn == ProgramPace::Scan {
            let text = "programs of slower tasks are executed behind the others of a scan";
            if !plan.differences.iter().any(|one| one == text) {
                plan.differences.push(text.to_owned());
            }
        }
        was_slow |= turn != ProgramPace::Scan;
        plan.programs.push(TimedProgram { name: instance.name.clone(), unit, turn });
    }
    for (at, unit) in file.units.iter().enumerate().filter(|(_, unit)| is_program(unit)) {
        if plan.programs.iter().all(|planned| planned.unit != at) {
            let name = unit.name.clone();
            plan.programs.push(TimedProgram { name, unit: at, turn: ProgramPace::Never });
        }
    }
    plan
}

fn divisor(one: i64, other: i64) -> i64 {
    if other == 0 { one } else { divisor(other, one % other) }
}

/// An interval in ms: `T#20ms`, `PT0.02S`, or seconds.
fn interval_ms(text: &str) -> Option<i64> {
    let text = text.trim().to_uppercase();
    if let Some(IecLiteral::Time { ms, .. }) = literal(&text) {
        return Some(ms);
    }
    if let Some(rest) = text.strip_prefix("PT")
        && let Some(IecLiteral::Time { ms, .. }) = literal(&format!("T#{rest}"))
    {
        return Some(ms);
    }
    text.parse::<f64>().ok().filter(|s| s.abs() < 1e6).map(|s| (s * 1000.0).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_a_literal_or_that_of_xml() {
        assert_eq!(interval_ms("T#20ms"), Some(20));
        assert_eq!(interval_ms("PT0.02S"), Some(20));
        assert_eq!(interval_ms("PT1M2S"), Some(62_000));
        assert_eq!(interval_ms("0.1"), Some(100));
        assert_eq!(interval_ms("soon"), None);
    }
}
