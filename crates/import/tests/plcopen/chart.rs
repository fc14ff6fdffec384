//! Sequential function charts, executed: own reading of the XML, and the rules of IEC 61131-3 with
//! the tables of steps and actions that MatIEC's code keeps.
//!
//! A selection is exclusive, as in the standard: by priority, then from left to right.

use std::collections::{HashMap, HashSet};

use roxmltree::Node;

use super::chart_reading::{ActionUse, ChartUnit, Condition, Text, chart_unit};
use super::interpreter::{Instance, Run, SensedAt, member};
use super::reading::{Element, Line, Part, Unit};
use super::values::Value;

/// What MatIEC keeps of a step.
#[derive(Clone, Debug, Default)]
struct StepState {
    active: bool,
    before: bool,
    time: i64,
}

/// What MatIEC keeps of an action.
#[derive(Clone, Debug, Default)]
struct ActionState {
    state: bool,
    stored: bool,
    set: bool,
    reset: bool,
    set_rest: i64,
    reset_rest: i64,
}

pub struct Chart {
    unit: ChartUnit,
    steps: Vec<StepState>,
    actions: HashMap<String, ActionState>,
    /// The edges of conditions, as the last scan left them.
    edges: HashMap<SensedAt, bool>,
    last_ms: Option<i64>,
}

/// The action that executes what conditions need.
const COMPUTE: &str = "compute blocks";

impl Chart {
    pub fn of(pou: Node<'_, '_>) -> Option<Chart> {
        let unit = chart_unit(pou)?;
        let steps = unit
            .steps
            .iter()
            .map(|step| StepState { active: step.is_initial, ..StepState::default() });
        let steps = steps.collect();
        let (actions, edges) = (HashMap::new(), HashMap::new());
        Some(Chart { unit, steps, actions, edges, last_ms: None })
    }

    /// Shows the steps to ladders: `S1.X`, `S1.T`.
    pub fn show(&self, program: &mut Instance) {
        for (step, state) in self.unit.steps.iter().zip(&self.steps) {
            program.values.insert(format!("{}.X", step.name), Value::Bool(state.active));
            program.values.insert(format!("{}.T", step.name), Value::Whole(state.time));
        }
    }

    pub fn scan(&mut self, units: &[Unit], program: &mut Instance, now_ms: i64) {
        let elapsed = now_ms - self.last_ms.unwrap_or(now_ms);
        self.last_ms = Some(now_ms);
        for step in &mut self.steps {
            step.before = step.active;
            step.time += if step.active { elapsed } else { 0 };
        }
        for action in self.actions.values_mut() {
            (action.state, action.set, action.reset) = (false, false, false);
            if action.set_rest > 0 {
                action.set_rest = (action.set_rest - elapsed).max(0);
                action.set = action.set_rest == 0;
            }
            if action.reset_rest > 0 {
                action.reset_rest = (action.reset_rest - elapsed).max(0);
                action.reset = action.reset_rest == 0;
            }
        }
        self.show(program);
        self.fire(units, program, now_ms);
        self.show(program);
        let text = self.unit.text_order();
        self.associate(program, &text);
        self.execute(units, program, now_ms);
    }

    /// Judges all transitions by the state at the begin, then moves.
    fn fire(&mut self, units: &[Unit], program: &mut Instance, now_ms: i64) {
        let unit = self.unit.clone();
        let mut turns: Vec<usize> = (0..unit.transitions.len()).collect();
        turns.sort_by_key(|at| (unit.transitions[*at].priority, unit.transitions[*at].x));
        turns.retain(|at| unit.transitions[*at].from.iter().all(|at| self.steps[*at].active));
        turns.retain(|at| self.condition(units, program, [*at as i64, now_ms]));
        let mut left = vec![false; self.steps.len()];
        let mut fired = Vec::new();
        for at in turns {
            let from = &unit.transitions[at].from;
            if from.iter().all(|step| !left[*step]) {
                from.iter().for_each(|step| left[*step] = true);
                fired.push(at);
            }
        }
        for (step, is_left) in self.steps.iter_mut().zip(left) {
            step.active &= !is_left;
        }
        for step in fired.iter().flat_map(|at| &unit.transitions[*at].to) {
            (self.steps[*step].active, self.steps[*step].time) = (true, 0);
        }
    }

    fn condition(
        &mut self,
        units: &[Unit],
        program: &mut Instance,
        [at, now_ms]: [i64; 2],
    ) -> bool {
        let transition = self.unit.transitions[at as usize].clone();
        match &transition.condition {
            Condition::Text(text) => said(program, text),
            Condition::Lines { elements, lines, key } => {
                begin(elements, lines, program);
                let mut run = Run::over(units, program, elements, now_ms);
                run.sensed.clone_from(&self.edges);
                for contact in edges(elements, lines) {
                    run.sensed.entry(SensedAt { acts: *key, element: contact }).or_insert(false);
                }
                run.power(lines, *key)
            }
        }
    }

    /// What the active steps do to their actions, step by step of the text.
    fn associate(&mut self, program: &mut Instance, text: &[usize]) {
        for (number, at) in text.iter().enumerate() {
            for used in self.unit.steps[*at].actions.clone() {
                self.qualify(program, *at, &used);
            }
            if number == 0 {
                let active = self.steps[*at].active;
                self.actions.entry(COMPUTE.to_owned()).or_default().set |= active;
            }
        }
        for (name, action) in &mut self.actions {
            if action.set {
                (action.set_rest, action.stored) = (0, true);
            }
            if action.reset {
                (action.reset_rest, action.stored) = (0, false);
            }
            action.state |= action.stored;
            if !self.unit.bodies.contains_key(name) && name != COMPUTE {
                match (action.reset, action.set) {
                    (true, _) => drop(program.values.insert(name.clone(), Value::Bool(false))),
                    (false, true) => drop(program.values.insert(name.clone(), Value::Bool(true))),
                    _ => {}
                }
            }
        }
    }

    fn qualify(&mut self, program: &mut Instance, step: usize, used: &ActionUse) {
        let state = self.steps[step].clone();
        let began = state.active && !state.before;
        let ended = !state.active && state.before;
        let duration_ms = duration_ms(program, &used.duration);
        let in_time = state.time >= duration_ms;
        let is_body = self.unit.bodies.contains_key(&used.name);
        let action = self.actions.entry(used.name.clone()).or_default();
        let mut put = |value: bool| match is_body {
            true => action.state = value,
            false => drop(program.values.insert(used.name.clone(), Value::Bool(value))),
        };
        match used.qualifier.as_str() {
            "N" if state.active => put(true),
            "N" if ended => put(false),
            "L" if state.active && !in_time => put(true),
            "L" if state.active || ended => put(false),
            "D" if state.active && in_time => put(true),
            "D" if ended => put(false),
            "P" | "P1" => put(began),
            "P0" => put(ended),
            "S" => action.set |= state.active,
            "R" => action.reset |= state.active,
            "SL" if began => (action.set, action.reset_rest) = (true, duration_ms),
            "SD" | "DS" if began => action.set_rest = duration_ms,
            "DS" if ended => action.set_rest = 0,
            _ => {}
        }
    }

    /// The bodies of the actions that are active, in the order of the text.
    fn execute(&mut self, units: &[Unit], program: &mut Instance, now_ms: i64) {
        for name in self.unit.body_order(COMPUTE) {
            if !self.actions.get(&name).is_some_and(|action| action.state) {
                continue;
            }
            match self.unit.bodies.get(&name) {
                Some(elements) => Run::over(units, program, elements, now_ms).execute(),
                None => self.compute(units, program, now_ms),
            }
        }
    }

    /// The blocks and edges that lead to transitions.
    fn compute(&mut self, units: &[Unit], program: &mut Instance, now_ms: i64) {
        let mut done: HashSet<u64> = HashSet::new();
        let mut sensed: HashMap<SensedAt, bool> = HashMap::new();
        for at in self.unit.compute_order() {
            let Condition::Lines { elements, lines, key } =
                self.unit.transitions[at].condition.clone()
            else {
                continue;
            };
            let mut run = Run::over(units, program, &elements, now_ms);
            (run.done, run.sensed) = (done, sensed);
            run.prepare(&lines, key);
            (done, sensed) = (run.done, run.sensed);
        }
        self.edges.extend(sensed);
    }
}

/// A duration as it is before any body of the scan.
fn duration_ms(program: &Instance, text: &str) -> i64 {
    match text.strip_prefix("T#").and_then(|text| text.strip_suffix("ms")) {
        Some(ms) => ms.parse().unwrap(),
        None => member(program, text).whole(),
    }
}

/// The contacts on edges from which lines come.
fn edges(elements: &[Element], lines: &[Line]) -> Vec<u64> {
    let mut found = Vec::new();
    for line in lines {
        let element = elements.iter().find(|one| one.id == line.id).unwrap();
        if let Part::Contact { lines, edge, .. } = &element.part {
            if !edge.is_empty() && edge != "none" {
                found.push(line.id);
            }
            found.extend(edges(elements, lines));
        }
    }
    found
}

/// Gives the functions that were never executed a result.
fn begin(elements: &[Element], lines: &[Line], program: &mut Instance) {
    for line in lines {
        match &elements.iter().find(|one| one.id == line.id).unwrap().part {
            Part::Contact { lines, .. } => begin(elements, lines, program),
            Part::Block { instance, .. } if instance.is_empty() => {
                let key = (line.id, line.pin.clone());
                program.results.entry(key).or_insert(Value::Bool(false));
            }
            _ => {}
        }
    }
}

/// What a condition in ST says.
fn said(program: &Instance, text: &Text) -> bool {
    match text {
        Text::Bit(name) => match name.as_str() {
            "TRUE" => true,
            "FALSE" => false,
            name => member(program, name).is_on(),
        },
        Text::Not(inner) => !said(program, inner),
        Text::All(parts) => parts.iter().all(|part| said(program, part)),
        Text::Any(parts) => parts.iter().any(|part| said(program, part)),
        Text::AtLeast(name, least) => member(program, name).whole() >= *least,
    }
}
