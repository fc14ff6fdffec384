//! Ladders of PLCopen, executed: own reading of the XML, and the tables of IEC 61131-3, with the
//! state machines of MatIEC's library where the standard leaves something open.

use std::collections::{HashMap, HashSet};

use roxmltree::Document;

use super::blocks::State;
use super::chart::Chart;
use super::reading::{Element, InputPin, Line, Part, Unit, unit};
use super::values::Value;

/// An element whose edge is sensed, for what acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SensedAt {
    pub acts: u64,
    pub element: u64,
}

/// What an instance keeps.
#[derive(Clone, Debug, Default)]
pub struct Instance {
    unit: usize,
    pub values: HashMap<String, Value>,
    states: HashMap<String, State>,
    inner: HashMap<String, Instance>,
    /// The memories of edges: of an element, for what acts.
    edges: HashMap<SensedAt, bool>,
    pub results: HashMap<(u64, String), Value>,
}

pub struct Machine {
    units: Vec<Unit>,
    program: Instance,
    chart: Option<Chart>,
}

impl Machine {
    pub fn new(xml: &str) -> Machine {
        let document = Document::parse(xml).unwrap();
        let units: Vec<Unit> = document
            .descendants()
            .filter(|node| node.tag_name().name() == "pou")
            .map(unit)
            .collect();
        let program = units.iter().position(|unit| unit.is_program).unwrap();
        let mut program = instance(&units, program);
        let pous = || document.descendants().filter(|node| node.tag_name().name() == "pou");
        let chart = pous().find_map(Chart::of);
        chart.iter().for_each(|chart| chart.show(&mut program));
        Machine { units, program, chart }
    }

    pub fn scan(&mut self, now_ms: i64) {
        match &mut self.chart {
            Some(chart) => chart.scan(&self.units, &mut self.program, now_ms),
            None => Run::of(&self.units, &mut self.program, now_ms).execute(),
        }
    }

    pub fn set(&mut self, name: &str, value: Value) {
        self.program.values.insert(name.to_owned(), value);
    }

    /// The value of a variable, or of an output of a block: `fb1.Q`.
    pub fn value(&self, name: &str) -> Value {
        member(&self.program, name)
    }
}

fn instance(units: &[Unit], unit: usize) -> Instance {
    let mut made = Instance { unit, ..Instance::default() };
    for variable in &units[unit].variables {
        let name = variable.name.clone();
        let value = match variable.kind.as_str() {
            "BOOL" => Value::Bool(variable.initial == "TRUE"),
            "REAL" | "LREAL" => Value::Real(variable.initial.parse().unwrap_or(0.0)),
            "INT" | "DINT" | "LINT" | "UINT" | "TIME" => {
                Value::Whole(variable.initial.parse().unwrap_or(0))
            }
            kind => {
                match units.iter().position(|unit| unit.name == kind) {
                    Some(inner) => drop(made.inner.insert(name, instance(units, inner))),
                    None => drop(made.states.insert(name, State::default())),
                }
                continue;
            }
        };
        made.values.insert(name, value);
    }
    if let Some(kind) = &units[unit].result {
        made.values.insert(units[unit].name.clone(), zero(kind));
    }
    made
}

fn zero(kind: &str) -> Value {
    match kind {
        "BOOL" => Value::Bool(false),
        "REAL" => Value::Real(0.0),
        _ => Value::Whole(0),
    }
}

pub fn member(instance: &Instance, name: &str) -> Value {
    if let Some(value) = instance.values.get(name) {
        return *value;
    }
    let Some((block, pin)) = name.split_once('.') else { return instance.values[name] };
    if let Some(inner) = instance.inner.get(block) {
        return member(inner, pin);
    }
    let state = &instance.states[block];
    match pin {
        "Q" | "Q1" | "QU" => Value::Bool(state.q),
        "QD" => Value::Bool(state.other_q),
        _ => Value::Whole(state.number),
    }
}

/// One execution of a body.
pub struct Run<'r> {
    units: &'r [Unit],
    instance: &'r mut Instance,
    elements: HashMap<u64, Element>,
    order: Vec<u64>,
    pub done: HashSet<u64>,
    /// The edges that were sensed, for what acts.
    pub sensed: HashMap<SensedAt, bool>,
    now_ms: i64,
}

impl<'r> Run<'r> {
    fn of(units: &'r [Unit], instance: &'r mut Instance, now_ms: i64) -> Run<'r> {
        let all = &units[instance.unit].elements;
        Run::over(units, instance, all, now_ms)
    }

    /// Elements that belong to an instance.
    pub fn over(
        units: &'r [Unit],
        instance: &'r mut Instance,
        all: &[Element],
        now_ms: i64,
    ) -> Run<'r> {
        let mut rows: Vec<&Element> = all.iter().collect();
        rows.sort_by_key(|element| element.y);
        let sorted = |is_block: bool| {
            let fits = |element: &&&Element| match element.part {
                Part::Coil { .. } | Part::Output { .. } => !is_block,
                Part::Block { .. } => is_block,
                _ => false,
            };
            let mut sorted: Vec<(i64, i64, u64)> = Vec::new();
            let mut top = i64::MIN / 2;
            for element in rows.iter().filter(fits) {
                if element.y >= top + 10 {
                    top = element.y;
                }
                sorted.push((top, element.x, element.id));
            }
            sorted.sort_by_key(|(top, x, id)| {
                (*top, *x, all.iter().position(|element| element.id == *id))
            });
            sorted.into_iter().map(|(_, _, id)| id).collect::<Vec<u64>>()
        };
        let order = [sorted(false), sorted(true)].concat();
        let elements = all.iter().map(|element| (element.id, element.clone())).collect();
        let (done, sensed) = (HashSet::new(), HashMap::new());
        Run { units, instance, elements, order, done, sensed, now_ms }
    }

    pub fn execute(&mut self) {
        for id in self.order.clone() {
            match self.elements[&id].part.clone() {
                Part::Coil { variable, negated, storage, edge, lines } => {
                    self.prepare(&lines, id);
                    let power = self.power(&lines, id);
                    let power = match (negated, edge.as_str()) {
                        (true, _) => !power,
                        (false, "rising") => {
                            self.trigger(SensedAt { acts: id, element: id }, power, true)
                        }
                        (false, "falling") => {
                            self.trigger(SensedAt { acts: id, element: id }, power, false)
                        }
                        _ => power,
                    };
                    match storage.as_str() {
                        "set" if power => self.set(&variable, Value::Bool(true)),
                        "reset" if power => self.set(&variable, Value::Bool(false)),
                        "set" | "reset" => {}
                        _ => self.set(&variable, Value::Bool(power)),
                    }
                }
                Part::Output { variable, lines } => {
                    self.prepare(&lines, id);
                    let value = self.value(&lines, id);
                    if self.is_enabled(&lines[0]) {
                        self.set(&variable, value);
                    }
                }
                Part::Block { .. } => self.call(id),
                _ => {}
            }
        }
    }

    fn set(&mut self, name: &str, value: Value) {
        self.instance.values.insert(name.to_owned(), value);
    }

    /// R_TRIG and F_TRIG: the latter begins as if its input had been ON.
    fn trigger(&mut self, key: SensedAt, clk: bool, rising: bool) -> bool {
        let clk = if rising { clk } else { !clk };
        let memory = self.instance.edges.entry(key).or_default();
        let q = clk && !*memory;
        *memory = clk;
        q
    }

    /// Whether the block at the beginning of a line has power at EN.
    fn is_enabled(&self, line: &Line) -> bool {
        let Part::Block { pins, .. } = &self.elements[&line.id].part else { return true };
        match pins.iter().any(|pin| pin.name == "EN") {
            true => self.instance.results[&(line.id, "ENO".to_owned())].is_on(),
            false => true,
        }
    }

    /// Follows lines back: blocks are executed, edges sensed.
    pub fn prepare(&mut self, lines: &[Line], acts: u64) {
        for line in lines {
            match self.elements[&line.id].part.clone() {
                Part::Contact { variable, edge, lines, .. } => {
                    let key = SensedAt { acts, element: line.id };
                    if !edge.is_empty() && edge != "none" && !self.sensed.contains_key(&key) {
                        let value = member(self.instance, &variable).is_on();
                        let q = self.trigger(key, value, edge == "rising");
                        self.sensed.insert(key, q);
                    }
                    self.prepare(&lines, acts);
                }
                Part::Coil { lines, .. } => self.prepare(&lines, acts),
                Part::Block { .. } => self.call(line.id),
                _ => {}
            }
        }
    }

    pub fn power(&self, lines: &[Line], acts: u64) -> bool {
        lines.iter().any(|line| match &self.elements[&line.id].part {
            Part::Rail => true,
            Part::Contact { variable, negated, edge, lines } => {
                let own = match self.sensed.get(&SensedAt { acts, element: line.id }) {
                    Some(q) if edge != "none" => *q,
                    _ => member(self.instance, variable).is_on() != *negated,
                };
                self.power(lines, acts) && own
            }
            Part::Coil { lines, .. } => self.power(lines, acts),
            _ => self.source(line).is_on(),
        })
    }

    /// The value of an element that is neither a contact nor a coil.
    fn source(&self, line: &Line) -> Value {
        match &self.elements[&line.id].part {
            Part::Input(text) => self.expression(text),
            Part::Block { instance, .. } if !instance.is_empty() && line.pin != "ENO" => {
                member(self.instance, &format!("{instance}.{}", line.pin))
            }
            Part::Block { .. } => {
                let key = (line.id, line.pin.clone());
                self.instance.results.get(&key).copied().unwrap_or(Value::Bool(true))
            }
            part => panic!("no value from {part:?}"),
        }
    }

    fn value(&self, lines: &[Line], acts: u64) -> Value {
        let is_power = lines.len() > 1
            || matches!(
                self.elements[&lines[0].id].part,
                Part::Rail | Part::Contact { .. } | Part::Coil { .. }
            );
        if is_power { Value::Bool(self.power(lines, acts)) } else { self.source(&lines[0]) }
    }

    fn expression(&self, text: &str) -> Value {
        if let Some(ms) = text.strip_prefix("T#") {
            return Value::Whole(ms.trim_end_matches("ms").parse().unwrap());
        }
        let text =
            ["DINT#", "LINT#"].iter().find_map(|kind| text.strip_prefix(kind)).unwrap_or(text);
        match text {
            "TRUE" => Value::Bool(true),
            "FALSE" => Value::Bool(false),
            text => match (text.parse(), text.parse()) {
                (Ok(value), _) => Value::Whole(value),
                (_, Ok(value)) if text.contains('.') => Value::Real(value),
                _ => member(self.instance, text),
            },
        }
    }

    fn call(&mut self, id: u64) {
        if !self.done.insert(id) {
            return;
        }
        let Part::Block { kind, instance, pins } = self.elements[&id].part.clone() else { return };
        pins.iter().for_each(|pin| self.prepare(&pin.lines, id));
        let given: HashMap<String, Value> = pins
            .iter()
            .map(|pin| {
                let value = self.value(&pin.lines, id);
                let value = if pin.is_negated { Value::Bool(!value.is_on()) } else { value };
                (pin.name.clone(), value)
            })
            .collect();
        let enabled = given.get("EN").is_none_or(|value| value.is_on());
        if let Some(unit) = self.units.iter().position(|unit| unit.name == kind)
            && instance.is_empty()
        {
            return self.call_function(id, unit, &given);
        }
        if instance.is_empty() {
            let result = super::tables::function(&kind, &self.types(&pins), &given);
            let eno = enabled && result.is_some();
            let zero = match super::tables::function(&kind, &self.types(&pins), &given) {
                Some(Value::Bool(_)) => Value::Bool(false),
                Some(Value::Real(_)) => Value::Real(0.0),
                Some(Value::Whole(_)) => Value::Whole(0),
                None if self.types(&pins).ends_with("REAL") => Value::Real(0.0),
                None => Value::Whole(0),
            };
            let value = result.filter(|_| enabled).unwrap_or(zero);
            self.instance.results.insert((id, "OUT".to_owned()), value);
            self.instance.results.insert((id, "ENO".to_owned()), Value::Bool(eno));
            return;
        }
        self.instance.results.insert((id, "ENO".to_owned()), Value::Bool(enabled));
        if let Some(inner) = self.instance.inner.get_mut(&instance) {
            for (name, value) in given.iter().filter(|(name, _)| *name != "EN") {
                inner.values.insert(name.clone(), *value);
            }
            if enabled {
                Run::of(self.units, inner, self.now_ms).execute();
            }
        } else if enabled {
            let now = self.now_ms;
            self.instance.states.get_mut(&instance).unwrap().execute(&kind, &given, now);
        }
    }

    /// A function of the file: its variables are new in each call. Without EN it is not executed,
    /// and its result is 0; outputs keep their values.
    fn call_function(&mut self, id: u64, unit: usize, given: &HashMap<String, Value>) {
        let mut inner = instance(self.units, unit);
        let enabled = given.get("EN").is_none_or(|value| value.is_on());
        let name = &self.units[unit].name;
        for variable in &self.units[unit].variables {
            let key = (id, variable.name.clone());
            self.instance.results.entry(key).or_insert(zero(&variable.kind));
        }
        if enabled {
            inner.values.extend(given.iter().map(|(name, value)| (name.clone(), *value)));
            Run::of(self.units, &mut inner, self.now_ms).execute();
            let outputs = self.units[unit].variables.iter();
            let outputs = outputs.map(|one| ((id, one.name.clone()), inner.values[&one.name]));
            self.instance.results.extend(outputs);
        }
        self.instance.results.insert((id, "OUT".to_owned()), inner.values[name]);
        self.instance.results.insert((id, "ENO".to_owned()), Value::Bool(enabled));
    }

    /// The type of the first number at the pins.
    fn types(&self, pins: &[InputPin]) -> String {
        self.found_type(pins).unwrap_or_else(|| "BOOL".to_owned())
    }

    fn found_type(&self, pins: &[InputPin]) -> Option<String> {
        let variables = &self.units[self.instance.unit].variables;
        let result = |kind: &String| {
            let unit = self.units.iter().find(|unit| unit.name == *kind);
            unit.and_then(|unit| unit.result.clone())
        };
        let of = |pin: &InputPin| match &self.elements[&pin.lines[0].id].part {
            // A function calls its result as itself.
            Part::Input(text) => result(text).or_else(|| {
                variables.iter().find(|one| one.name == *text).map(|one| one.kind.clone())
            }),
            Part::Block { kind, .. } if result(kind).is_some() => result(kind),
            Part::Block { kind, pins, instance } if instance.is_empty() => {
                match kind.split_once("_TO_") {
                    Some((_, to)) => Some(to.to_owned()),
                    None if kind == "TRUNC" => Some("DINT".to_owned()),
                    None => self.found_type(pins),
                }
            }
            _ => None,
        };
        pins.iter().filter(|pin| pin.name != "EN" && pin.name != "G").find_map(of)
    }
}
