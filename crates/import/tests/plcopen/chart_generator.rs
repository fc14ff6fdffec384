//! Random charts: sequences, selections and parallel branches within each other, with jumps to any
//! step, conditions of every form and actions with every qualifier.

use std::collections::BTreeSet;

use rungd_base::random::SplitMix64;

use super::generator::{Body, Point, RandomProject, Watched, Written};
use super::kinds::{KINDS, declared};

/// Makes a program with a chart.
pub fn chart_project(random: &mut SplitMix64) -> RandomProject {
    let mut chart = RandomChart {
        body: Body::new(random, true),
        chart: String::new(),
        steps: Vec::new(),
        timed: BTreeSet::new(),
        actions: String::new(),
        transitions: String::new(),
        named: Vec::new(),
        parts: Parts::default(),
        x: 0,
    };
    let start = chart.step(None);
    let mut last = start;
    for _ in 0..1 + chart.body.below(3) {
        last = chart.part(last, 2);
    }
    let end = chart.transition(last);
    let target = chart.any_step();
    chart.jump(end, &target);
    chart.finished()
}

/// What the bodies of a chart declare.
#[derive(Default)]
struct Parts {
    declared: String,
    watched: Vec<Watched>,
    blocks: u64,
}

struct RandomChart<'r> {
    /// The ladder of the chart itself, with the numbers of all elements.
    body: Body<'r>,
    chart: String,
    steps: Vec<String>,
    /// The steps whose time something asks for.
    timed: BTreeSet<String>,
    actions: String,
    transitions: String,
    named: Vec<String>,
    parts: Parts,
    x: u64,
}

fn input(from: &[u64]) -> String {
    let lines = from.iter().map(|id| {
        format!("<connectionPointIn><connection refLocalId=\"{id}\"/></connectionPointIn>")
    });
    lines.collect()
}

impl RandomChart<'_> {
    fn finished(self) -> RandomProject {
        let mut watched = [self.body.watched, self.parts.watched].concat();
        for kind in &KINDS {
            for at in 0..kind.count {
                watched.push(Watched { name: format!("{}{at}", kind.prefix), kind: kind.kind });
            }
        }
        let place = |name: String, kind| Watched { name, kind };
        watched.extend(self.steps.iter().map(|name| place(format!("{name}.X"), "BOOL")));
        watched.extend(self.timed.iter().map(|name| place(format!("{name}.T"), "TIME")));
        let variables = declared(&[]) + &self.body.declared + &self.parts.declared;
        let xml = format!(
            "<?xml version=\"1.0\"?><project xmlns=\"http://www.plcopen.org/xml/tc6_0201\">\
             <fileHeader productName=\"test\" productVersion=\"1\"/><types><pous><pou \
             name=\"prog\" pouType=\"program\"><interface><localVars>{variables}</localVars>\
             </interface><actions>{}</actions><transitions>{}</transitions><body><SFC>{}{}</SFC>\
             </body></pou></pous></types></project>",
            self.actions, self.transitions, self.chart, self.body.xml
        );
        RandomProject { xml, watched }
    }

    fn element(&mut self, kind: &str, more: &str, inner: &str) -> u64 {
        let id = self.body.next();
        self.x += 10;
        let x = self.x;
        self.chart += &format!(
            "<{kind} localId=\"{id}\" {more}><position x=\"{x}\" y=\"10\"/>{inner}</{kind}>"
        );
        id
    }

    /// A step behind a transition or a link; with its actions.
    fn step(&mut self, from: Option<u64>) -> u64 {
        let name = format!("S{}", self.steps.len() + 1);
        let more = format!("name=\"{name}\" initialStep=\"{}\"", from.is_none());
        let inner = from.map_or_else(String::new, |id| input(&[id]));
        let id = self.element("step", &more, &inner);
        self.steps.push(name.clone());
        for _ in 0..self.body.below(3) {
            self.action_block(id, &name);
        }
        id
    }

    fn any_step(&mut self) -> String {
        let at = self.body.below(self.steps.len() as u64) as usize;
        self.steps[at].clone()
    }

    fn jump(&mut self, from: u64, target: &str) {
        self.element("jumpStep", &format!("targetName=\"{target}\""), &input(&[from]));
    }

    /// Something behind a step, or behind branches that end together; what is behind it.
    fn part(&mut self, from: u64, depth: u64) -> u64 {
        match self.body.below(if depth == 0 { 1 } else { 5 }) {
            1 | 2 => self.selection(from, depth - 1),
            3 => self.parallel(from, depth - 1),
            _ => {
                let transition = self.transition(from);
                self.step(Some(transition))
            }
        }
    }

    fn selection(&mut self, from: u64, depth: u64) -> u64 {
        let from = match self.body.below(3) {
            0 => from,
            _ => self.element("selectionDivergence", "", &input(&[from])),
        };
        let branches = 2 + self.body.below(2);
        let mut ends = Vec::new();
        for branch in 0..branches {
            let begin = self.transition(from);
            let mut last = self.step(Some(begin));
            if self.body.below(3) == 0 {
                last = self.part(last, depth);
            }
            let end = self.transition(last);
            if branch > 0 && self.body.below(4) == 0 {
                let target = self.any_step();
                self.jump(end, &target);
            } else {
                ends.push(end);
            }
        }
        let end = self.element("selectionConvergence", "", &input(&ends));
        self.step(Some(end))
    }

    fn parallel(&mut self, from: u64, depth: u64) -> u64 {
        let begin = self.transition(from);
        let fork = self.element("simultaneousDivergence", "", &input(&[begin]));
        let mut ends = Vec::new();
        for _ in 0..2 + self.body.below(2) {
            let mut last = self.step(Some(fork));
            if self.body.below(2) == 0 {
                last = self.part(last, depth);
            }
            ends.push(last);
        }
        self.element("simultaneousConvergence", "", &input(&ends))
    }

    fn transition(&mut self, from: u64) -> u64 {
        let condition = self.condition();
        let priority = match self.body.below(3) {
            0 => format!("priority=\"{}\"", self.body.below(4)),
            _ => String::new(),
        };
        let inner = input(&[from]) + "<condition>" + &condition + "</condition>";
        self.element("transition", &priority, &inner)
    }

    fn condition(&mut self) -> String {
        match self.body.below(8) {
            0 => {
                let name = format!("go{}", self.body.next());
                format!("<inline name=\"{name}\"><LD>{}</LD></inline>", self.coil_ladder(&name))
            }
            1 if !self.named.is_empty() && self.body.below(2) == 0 => {
                let at = self.body.below(self.named.len() as u64) as usize;
                format!("<reference name=\"{}\"/>", self.named[at])
            }
            1 => {
                let name = format!("go{}", self.body.next());
                let ladder = self.coil_ladder(&name);
                self.transitions += &format!(
                    "<transition name=\"{name}\"><body><LD>{ladder}</LD></body></transition>"
                );
                self.named.push(name.clone());
                format!("<reference name=\"{name}\"/>")
            }
            2 | 3 => {
                self.body.y += 100;
                self.body.blocks = self.parts.blocks.max(self.body.blocks);
                let points = network(&mut self.body);
                self.parts.blocks = self.body.blocks;
                self.body.lines(&points)
            }
            _ => format!("<inline name=\"\"><ST><p>{}</p></ST></inline>", self.text()),
        }
    }

    fn text(&mut self) -> String {
        let bit = self.body.variable("BOOL");
        let other = self.body.variable("BOOL");
        match self.body.below(9) {
            0 | 1 => bit,
            2 => format!("NOT {bit}"),
            3 => format!("{bit} AND NOT {other}"),
            4 => format!("NOT {bit} OR {other}"),
            5 => format!("{} >= {}", self.body.variable("INT"), self.body.below(4)),
            6 if !self.steps.is_empty() => format!("{}.X OR {bit}", self.any_step()),
            7 if !self.steps.is_empty() => {
                let step = self.any_step();
                self.timed.insert(step.clone());
                format!("{step}.T >= T#{}ms", self.body.below(90))
            }
            _ => "TRUE".to_owned(),
        }
    }

    /// A ladder of a body of its own whose coil has a name.
    fn coil_ladder(&mut self, name: &str) -> String {
        let mut body = Body::new(self.body.random, true);
        body.blocks = self.parts.blocks;
        let points = network(&mut body);
        let id = body.next();
        let lines = body.lines(&points);
        body.xml += &format!(
            "<coil localId=\"{id}\"><position x=\"900\" y=\"10\"/>{lines}<variable>{name}\
             </variable></coil>"
        );
        let written = body.written(0);
        self.keep(written)
    }

    /// A ladder of an action.
    fn ladder(&mut self) -> String {
        let mut body = Body::new(self.body.random, true);
        body.blocks = self.parts.blocks;
        let written = body.written(1);
        self.keep(written)
    }

    fn keep(&mut self, written: Written) -> String {
        self.parts.blocks += written.declared.matches("<variable").count() as u64;
        self.parts.declared += &written.declared;
        self.parts.watched.extend(written.watched);
        written.elements
    }

    fn action_block(&mut self, step: u64, name: &str) {
        let mut inner = input(&[step]);
        for _ in 0..1 + self.body.below(2) {
            let qualifier = self.body.one_of(&[
                "N", "N", "N", "N", "S", "R", "P", "P1", "P0", "L", "D", "SD", "DS", "SL",
            ]);
            if matches!(qualifier, "L" | "D") {
                self.timed.insert(name.to_owned());
            }
            let duration = match qualifier {
                "L" | "D" | "SD" | "DS" | "SL" => match self.body.below(3) {
                    0 => format!(" duration=\"{}\"", self.body.variable("TIME")),
                    _ => format!(" duration=\"T#{}ms\"", self.body.below(80)),
                },
                _ => String::new(),
            };
            let body = self.action();
            inner += &format!("<action qualifier=\"{qualifier}\"{duration}>{body}</action>");
        }
        self.element("actionBlock", "", &inner);
    }

    fn action(&mut self) -> String {
        let known = self.actions.matches("<action ").count() as u64;
        match self.body.below(6) {
            0 if known > 0 && self.body.below(2) == 0 => {
                format!("<reference name=\"do{}\"/>", 1 + self.body.below(known))
            }
            0 => {
                let ladder = self.ladder();
                let name = format!("do{}", known + 1);
                self.actions +=
                    &format!("<action name=\"{name}\"><body><LD>{ladder}</LD></body></action>");
                format!("<reference name=\"{name}\"/>")
            }
            1 => format!("<inline><LD>{}</LD></inline>", self.ladder()),
            _ => format!("<reference name=\"{}\"/>", self.body.variable("BOOL")),
        }
    }
}

/// Contacts, compares and blocks that lead to a transition; their ends.
fn network(body: &mut Body<'_>) -> Vec<Point> {
    let mut points = vec![Point { id: 1, pin: None }];
    for at in 0..1 + body.below(3) {
        let sources = body.sources(&points);
        let point = match body.below(6) {
            0 => body.compare(&points.clone()),
            1 if points.len() > 1 => body.standard(&points[1..]),
            _ => body.contact(50 + at * 40, &sources),
        };
        points.push(point);
    }
    // A block that leads to nothing is not executed.
    points.split_off(1)
}
