//! Tasks of Logix, which interrupt each other, in the one scan of rungd.

use std::collections::HashSet;

use super::document::{L5xFile, TaskDefinition};

/// The scan period where the file gives none, in ms.
const PERIOD_MS: u32 = 10;

/// When a program is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProgramTurn {
    /// In every scan.
    Scan,
    /// Each time an interval is over, in ms.
    Every(u32),
    /// Never: its task waits for an event, or there is none.
    Never,
}

/// The scan and the programs in it.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) period_ms: u32,
    /// The indices of the programs in the file, in scan order, with their turns.
    pub(crate) programs: Vec<TaskProgram>,
    pub(crate) differences: Vec<String>,
    pub(crate) open: Vec<String>,
}

/// A program with its turn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TaskProgram {
    pub(crate) index: usize,
    pub(crate) turn: ProgramTurn,
}

/// The plan of a file's tasks.
pub(crate) fn plan(file: &L5xFile) -> Plan {
    let mut plan = Plan {
        period_ms: PERIOD_MS,
        programs: Vec::new(),
        differences: Vec::new(),
        open: Vec::new(),
    };
    let mut tasks: Vec<&TaskDefinition> = file.tasks.iter().collect();
    tasks.sort_by_key(|task| (task.kind == "CONTINUOUS", task.priority));
    let is_periodic = |task: &&&TaskDefinition| task.kind == "PERIODIC" && !task.is_inhibited;
    let rates = tasks.iter().filter(is_periodic).map(|task| rate_ms(task));
    let has_continuous = tasks.iter().any(|task| task.kind == "CONTINUOUS");
    if let Some(fastest) = rates.min() {
        plan.period_ms = if has_continuous { fastest.min(PERIOD_MS) } else { fastest };
    }
    for task in &tasks {
        let turn = turn(task, &mut plan);
        for name in &task.programs {
            let is_it = |program: &super::document::ProgramDefinition| {
                program.name.eq_ignore_ascii_case(name)
            };
            let Some(index) = file.programs.iter().position(is_it) else { continue };
            let turn = if file.programs[index].is_disabled { ProgramTurn::Never } else { turn };
            plan.programs.push(TaskProgram { index, turn });
        }
    }
    if tasks.len() > 1 {
        plan.differences.push(
            "Logix' tasks interrupt each other; here all programs share one scan, in the order of \
             their tasks' priorities, and what is slower than the scan is a Task that runs \
             when its interval is over."
                .to_owned(),
        );
    }
    unplanned(file, &mut plan);
    plan
}

/// The tasks that have programs in the file, in small letters.
pub(crate) fn filled_tasks(file: &L5xFile) -> HashSet<String> {
    let is_here =
        |name: &String| file.programs.iter().any(|program| program.name.eq_ignore_ascii_case(name));
    let filled = file.tasks.iter().filter(|task| task.programs.iter().any(is_here));
    filled.map(|task| task.name.to_lowercase()).collect()
}

/// The programs that no task names.
fn unplanned(file: &L5xFile, plan: &mut Plan) {
    let has_tasks = file.tasks.iter().any(|task| !task.programs.is_empty());
    for (index, program) in file.programs.iter().enumerate() {
        if plan.programs.iter().any(|planned| planned.index == index) {
            continue;
        }
        let is_whole = file.target.eq_ignore_ascii_case("Controller") && has_tasks;
        if is_whole {
            plan.differences.push(format!(
                "No task executes the program {}: nothing starts it here either.",
                program.name
            ));
        }
        let turn = if is_whole { ProgramTurn::Never } else { ProgramTurn::Scan };
        plan.programs.push(TaskProgram { index, turn });
    }
}

fn rate_ms(task: &TaskDefinition) -> u32 {
    task.rate.round().clamp(1.0, 3_600_000.0) as u32
}

fn turn(task: &TaskDefinition, plan: &mut Plan) -> ProgramTurn {
    if task.is_inhibited {
        plan.differences.push(format!("The task {} is inhibited: nothing starts it.", task.name));
        return ProgramTurn::Never;
    }
    match task.kind.as_str() {
        "CONTINUOUS" => ProgramTurn::Scan,
        "PERIODIC" if rate_ms(task) <= plan.period_ms => ProgramTurn::Scan,
        "PERIODIC" => ProgramTurn::Every(rate_ms(task)),
        _ => {
            plan.open.push(format!(
                "The task {} waits for an event: something has to start its programs (RUN).",
                task.name
            ));
            ProgramTurn::Never
        }
    }
}
