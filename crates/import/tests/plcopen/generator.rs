//! Random ladders of PLCopen: graphs of contacts, blocks and functions, as XML.

use rungd_base::random::SplitMix64;

use super::functions::{Callee, function};
use super::kinds::{KINDS, declared};
use crate::numbers::below;

/// A random project.
pub struct RandomProject {
    pub xml: String,
    /// The variables of the program, with their types; and the outputs of blocks.
    pub watched: Vec<Watched>,
}

/// A place that both executions have.
#[derive(Clone)]
pub struct Watched {
    pub name: String,
    pub kind: &'static str,
}

/// Makes a project.
pub fn project(random: &mut SplitMix64) -> RandomProject {
    let mut functions = vec![function(random, "Calc", &[])];
    functions.push(function(random, "Chain", &functions));
    let mut body = Body::new(random, false);
    body.functions = functions.clone();
    let inner = body.written(2);
    let mut body = Body::new(random, true);
    body.has_unit = true;
    body.functions = functions.clone();
    let outer = body.written(3);
    let mut watched = outer.watched.clone();
    for kind in &KINDS {
        for at in 0..kind.count {
            watched.push(Watched { name: format!("{}{at}", kind.prefix), kind: kind.kind });
        }
    }
    let inputs = "<inputVars><variable name=\"bit0\"><type><BOOL/></type></variable><variable \
                  name=\"num0\"><type><INT/></type></variable></inputVars>";
    let outputs = "<outputVars><variable name=\"bit1\"><type><BOOL/></type></variable><variable \
                   name=\"num1\"><type><INT/></type></variable></outputVars>";
    let xml = format!(
        "<?xml version=\"1.0\"?><project xmlns=\"http://www.plcopen.org/xml/tc6_0201\">\
         <fileHeader productName=\"test\" productVersion=\"1\"/><contentHeader name=\"random\"/>\
         <types><dataTypes/><pous>{}{}<pou name=\"Inner\" pouType=\"functionBlock\"><interface>\
         {inputs}\
         {outputs}<localVars>{}</localVars></interface><body><LD>{}</LD></body></pou><pou \
         name=\"prog\" pouType=\"program\"><interface><localVars>{}{}</localVars></interface><body>\
         <LD>{}</LD></body></pou></pous></types><instances><configurations><configuration \
         name=\"c\"><resource name=\"r\"><task name=\"t\" interval=\"T#10ms\"><pouInstance \
         name=\"i\" typeName=\"prog\"/></task></resource></configuration></configurations>\
         </instances></project>",
        functions[0].xml,
        functions[1].xml,
        declared(&["bit0", "bit1", "num0", "num1"]) + &inner.declared,
        inner.elements,
        declared(&[]),
        outer.declared,
        outer.elements
    );
    RandomProject { xml, watched }
}

pub struct Written {
    pub elements: String,
    pub declared: String,
    pub watched: Vec<Watched>,
}

/// A body that is being made.
pub struct Body<'r> {
    pub random: &'r mut SplitMix64,
    pub xml: String,
    pub declared: String,
    pub watched: Vec<Watched>,
    id: u64,
    pub y: u64,
    pub blocks: u64,
    pub is_program: bool,
    has_unit: bool,
    /// The functions that it calls.
    pub functions: Vec<Callee>,
    /// Of a function: its name, and the type of its result.
    pub result: Option<[&'static str; 2]>,
}

/// A point with power: an element, and the pin of a block.
#[derive(Clone)]
pub struct Point {
    pub id: u64,
    pub pin: Option<String>,
}

impl<'r> Body<'r> {
    pub fn new(random: &'r mut SplitMix64, is_program: bool) -> Body<'r> {
        Body {
            random,
            xml: "<leftPowerRail localId=\"1\"><position x=\"0\" y=\"0\"/><connectionPointOut/>\
                  </leftPowerRail>"
                .to_owned(),
            declared: String::new(),
            watched: Vec::new(),
            id: 1,
            y: 0,
            blocks: 0,
            is_program,
            has_unit: false,
            functions: Vec::new(),
            result: None,
        }
    }

    /// Some networks more; none, if at least 0 are wanted.
    pub fn written(mut self, least: u64) -> Written {
        let count = if least == 0 { 0 } else { least + self.below(4) };
        for _ in 0..count {
            self.y += 100;
            self.network();
        }
        Written { elements: self.xml, declared: self.declared, watched: self.watched }
    }

    pub fn below(&mut self, limit: u64) -> u64 {
        below(self.random, limit)
    }

    pub fn one_of(&mut self, texts: &[&'static str]) -> &'static str {
        texts[self.below(texts.len() as u64) as usize]
    }

    pub fn variable(&mut self, kind: &str) -> String {
        if let Some([name, own]) = self.result
            && own == kind
            && self.below(3) == 0
        {
            return name.to_owned();
        }
        let found = KINDS.iter().find(|one| one.kind == kind).unwrap();
        // The first ones are inputs for the most part.
        let at = self.below(found.count);
        format!("{}{at}", found.prefix)
    }

    pub fn next(&mut self) -> u64 {
        self.id += 1;
        self.id
    }

    pub fn place(&mut self, x: u64) -> String {
        let y = self.y + self.below(6) * 15;
        format!("<position x=\"{x}\" y=\"{y}\"/>")
    }

    pub fn lines(&self, points: &[Point]) -> String {
        let line = |point: &Point| match &point.pin {
            Some(pin) => {
                format!("<connection refLocalId=\"{}\" formalParameter=\"{pin}\"/>", point.id)
            }
            None => format!("<connection refLocalId=\"{}\"/>", point.id),
        };
        let lines: String = points.iter().map(line).collect();
        format!("<connectionPointIn>{lines}</connectionPointIn>")
    }

    /// Some of the points before: a graph of any form.
    pub fn sources(&mut self, points: &[Point]) -> Vec<Point> {
        let count = 1 + self.below(3).min(self.id % 3);
        let mut chosen: Vec<Point> = Vec::new();
        for _ in 0..count {
            let from = points.len().saturating_sub(5);
            let at = from + self.below((points.len() - from) as u64) as usize;
            let point = points[at].clone();
            if chosen.iter().all(|one| one.id != point.id || one.pin != point.pin) {
                chosen.push(point);
            }
        }
        chosen
    }

    pub fn contact(&mut self, x: u64, sources: &[Point]) -> Point {
        let id = self.next();
        let attributes = match self.below(8) {
            0 | 1 => "negated=\"true\"",
            2 | 3 if self.result.is_some() => "",
            2 => "edge=\"rising\"",
            3 => "edge=\"falling\"",
            _ => "negated=\"false\" storage=\"none\" edge=\"none\"",
        };
        let variable = match (self.watched.is_empty(), self.below(5)) {
            (false, 0) => {
                let at = self.below(self.watched.len() as u64) as usize;
                let watched = self.watched[at].clone();
                if watched.kind == "BOOL" { watched.name } else { self.variable("BOOL") }
            }
            _ => self.variable("BOOL"),
        };
        let (place, lines) = (self.place(x), self.lines(sources));
        self.xml += &format!(
            "<contact localId=\"{id}\" {attributes}>{place}{lines}<connectionPointOut/><variable>\
             {variable}</variable></contact>"
        );
        Point { id, pin: None }
    }

    pub fn coil(&mut self, x: u64, sources: &[Point]) -> Point {
        let id = self.next();
        let attributes = match self.below(10) {
            0 => "negated=\"true\"",
            1 | 2 => "storage=\"set\"",
            3 | 4 => "storage=\"reset\"",
            5 | 6 if self.result.is_some() => "",
            5 => "edge=\"rising\"",
            6 => "edge=\"falling\"",
            _ => "",
        };
        let variable = self.variable("BOOL");
        let (place, lines) = (self.place(x), self.lines(sources));
        self.xml += &format!(
            "<coil localId=\"{id}\" {attributes}>{place}{lines}<connectionPointOut/><variable>\
             {variable}</variable></coil>"
        );
        Point { id, pin: None }
    }

    /// A variable or a literal at the beginning of a line.
    pub fn input(&mut self, kind: &str) -> Point {
        let text = match (kind, self.below(3)) {
            ("BOOL", 0) => ["TRUE", "FALSE"][self.below(2) as usize].to_owned(),
            ("INT", 0) => (self.below(40) as i64 - 10).to_string(),
            ("DINT", 0) => (self.below(4_000_000_000) as i64 - 2_000_000_000).to_string(),
            ("UINT", 0) => (self.below(65_536)).to_string(),
            ("REAL", 0) => format!("{}.25", self.below(9)),
            ("TIME", 0) => format!("T#{}ms", self.below(90)),
            _ => self.variable(kind),
        };
        self.named_input(&text)
    }

    pub fn output(&mut self, kind: &str, source: Point) {
        let variable = self.variable(kind);
        let id = self.next();
        let place = self.place(600);
        let lines = self.lines(&[source]);
        self.xml += &format!(
            "<outVariable localId=\"{id}\">{place}{lines}<expression>{variable}</expression>\
             </outVariable>"
        );
    }

    pub fn block(
        &mut self,
        kind: &str,
        instance: Option<&str>,
        pins: &[Pin<'_>],
        outputs: &[&str],
    ) -> u64 {
        let id = self.next();
        let place = self.place(300);
        let mut inputs = String::new();
        for pin in pins {
            let lines = self.lines(&pin.points);
            let negated = if pin.is_negated { " negated=\"true\"" } else { "" };
            inputs +=
                &format!("<variable formalParameter=\"{}\"{negated}>{lines}</variable>", pin.name);
        }
        let outputs: String = outputs
            .iter()
            .map(|name| {
                format!("<variable formalParameter=\"{name}\"><connectionPointOut/></variable>")
            })
            .collect();
        let instance = instance.map_or(String::new(), |name| format!(" instanceName=\"{name}\""));
        self.xml += &format!(
            "<block localId=\"{id}\" typeName=\"{kind}\"{instance}>{place}<inputVariables>{inputs}\
             </inputVariables><inOutVariables/><outputVariables>{outputs}</outputVariables></block>"
        );
        id
    }

    /// A function block of the standard.
    pub fn standard(&mut self, points: &[Point]) -> Point {
        let kind = self
            .one_of(&["TON", "TOF", "TP", "CTU", "CTD", "CTUD", "R_TRIG", "F_TRIG", "SR", "RS"]);
        let (powers, number, outputs): (&[&str], Option<(&str, &str)>, &[&'static str]) = match kind
        {
            "TON" | "TOF" | "TP" => (&["IN"], Some(("PT", "TIME")), &["Q", "ET"]),
            "CTU" => (&["CU", "R"], Some(("PV", "INT")), &["Q", "CV"]),
            "CTD" => (&["CD", "LD"], Some(("PV", "INT")), &["Q", "CV"]),
            "CTUD" => (&["CU", "CD", "R", "LD"], Some(("PV", "INT")), &["QU", "QD", "CV"]),
            "SR" => (&["S1", "R"], None, &["Q1"]),
            "RS" => (&["S", "R1"], None, &["Q1"]),
            _ => (&["CLK"], None, &["Q"]),
        };
        self.blocks += 1;
        let name = format!("fb{}", self.blocks);
        let mut pins = Vec::new();
        let mut outs: Vec<&str> = outputs.to_vec();
        if self.is_program && self.below(5) == 0 {
            pins.push(Pin { name: "EN", points: self.sources(points), is_negated: false });
            outs.insert(0, "ENO");
        }
        for power in powers {
            let points = self.sources(points);
            let is_negated = self.below(8) == 0;
            pins.push(Pin { name: power, points, is_negated });
        }
        if let Some((pin, kind)) = number {
            let point = self.input(kind);
            pins.push(Pin { name: pin, points: vec![point], is_negated: false });
        }
        let id = self.block(kind, Some(&name), &pins, &outs);
        self.declared += &format!(
            "<variable name=\"{name}\"><type><derived name=\"{kind}\"/></type></variable>"
        );
        for output in outputs {
            let kind = match *output {
                "ET" => "TIME",
                "CV" => "INT",
                _ => "BOOL",
            };
            self.watched.push(Watched { name: format!("{name}.{output}"), kind });
            if kind != "BOOL" && self.below(2) == 0 {
                self.output(kind, Point { id, pin: Some((*output).to_owned()) });
            }
        }
        Point { id, pin: Some(outputs[0].to_owned()) }
    }

    /// An instance of the function block of the file.
    fn unit(&mut self, points: &[Point]) -> Point {
        self.blocks += 1;
        let name = format!("fb{}", self.blocks);
        let power = Pin { name: "bit0", points: self.sources(points), is_negated: false };
        let number = Pin { name: "num0", points: vec![self.input("INT")], is_negated: false };
        let id = self.block("Inner", Some(&name), &[power, number], &["bit1", "num1"]);
        self.declared +=
            &format!("<variable name=\"{name}\"><type><derived name=\"Inner\"/></type></variable>");
        self.watched.push(Watched { name: format!("{name}.bit1"), kind: "BOOL" });
        self.watched.push(Watched { name: format!("{name}.num1"), kind: "INT" });
        Point { id, pin: Some("bit1".to_owned()) }
    }

    /// A function that gives power.
    pub fn compare(&mut self, points: &[Point]) -> Point {
        let kind = self.one_of(&["INT", "DINT", "UINT", "REAL", "TIME"]);
        let name = self.one_of(&["GT", "GE", "EQ", "NE", "LE", "LT"]);
        let variable = {
            let text = self.variable(kind);
            self.named_input(&text)
        };
        let other = self.input(kind);
        self.function(name, &[variable, other], points)
    }

    pub fn named_input(&mut self, text: &str) -> Point {
        let id = self.next();
        let place = self.place(20);
        self.xml += &format!(
            "<inVariable localId=\"{id}\">{place}<connectionPointOut/><expression>{text}\
             </expression></inVariable>"
        );
        Point { id, pin: None }
    }

    pub fn function(&mut self, name: &str, inputs: &[Point], points: &[Point]) -> Point {
        let names: &[&str] = match name {
            "LIMIT" => &["MN", "IN", "MX"],
            "SEL" => &["G", "IN0", "IN1"],
            "MOVE" | "ABS" | "NOT" => &["IN"],
            name if name.contains("_TO_") => &["IN"],
            _ => &["IN1", "IN2", "IN3"],
        };
        let mut pins = Vec::new();
        let mut outputs = vec!["OUT"];
        if self.below(3) == 0 {
            pins.push(Pin { name: "EN", points: self.sources(points), is_negated: false });
            outputs.insert(0, "ENO");
        }
        for (point, name) in inputs.iter().zip(names) {
            pins.push(Pin { name, points: vec![point.clone()], is_negated: false });
        }
        let id = self.block(name, None, &pins, &outputs);
        Point { id, pin: Some("OUT".to_owned()) }
    }

    /// A function that gives a number, whose result goes into a variable; its ENO.
    fn calculation(&mut self, points: &[Point]) -> Option<Point> {
        let kind = self.one_of(&["INT", "DINT", "UINT", "REAL", "TIME"]);
        let name = match kind {
            "TIME" => self.one_of(&["ADD", "SUB", "MOVE", "SEL", "MAX"]),
            "REAL" => {
                self.one_of(&["ADD", "SUB", "MUL", "DIV", "MOVE", "SEL", "LIMIT", "MIN", "ABS"])
            }
            "UINT" => self.one_of(&[
                "ADD", "SUB", "MUL", "DIV", "MOD", "MOVE", "SEL", "LIMIT", "MAX", "AND", "OR",
                "XOR", "NOT",
            ]),
            _ => self
                .one_of(&["ADD", "SUB", "MUL", "DIV", "MOD", "MOVE", "SEL", "LIMIT", "MIN", "ABS"]),
        };
        let variable = {
            let text = self.variable(kind);
            self.named_input(&text)
        };
        let inputs = match name {
            "LIMIT" => vec![self.input(kind), variable, self.input(kind)],
            "SEL" => vec![self.sources(points)[0].clone(), variable, self.input(kind)],
            "MOVE" | "ABS" | "NOT" => vec![variable],
            "ADD" | "MUL" if self.below(3) == 0 => {
                vec![variable, self.input(kind), self.input(kind)]
            }
            _ => vec![variable, self.input(kind)],
        };
        let point = self.function(name, &inputs, points);
        let is_enabled = self.xml.ends_with(
            "<variable formalParameter=\"ENO\"><connectionPointOut/></variable><variable \
             formalParameter=\"OUT\"><connectionPointOut/></variable></outputVariables></block>",
        );
        if self.below(6) == 0 {
            // A chain: the result is the input of another function.
            let other = self.input(kind);
            let next = self.function("MAX", &[point.clone(), other], points);
            self.output(kind, next);
        } else {
            self.output(kind, point.clone());
        }
        if self.below(5) == 0 {
            self.output(kind, point.clone());
        }
        is_enabled.then(|| Point { id: point.id, pin: Some("ENO".to_owned()) })
    }

    fn network(&mut self) {
        let rail = Point { id: 1, pin: None };
        let mut points = vec![rail.clone()];
        let count = 1 + self.below(7);
        for at in 0..count {
            let x = 50 + at * 40;
            let is_function = self.result.is_some();
            let point = match self.below(16) {
                0 | 1 if points.len() > 1 && !is_function => self.standard(&points[1..]),
                2 if points.len() > 1 && self.has_unit => self.unit(&points[1..]),
                3 => self.compare(&points.clone()),
                4 => match self.calculation(&points.clone()) {
                    Some(point) => point,
                    None => continue,
                },
                15 => {
                    self.conversion();
                    continue;
                }
                14 if !self.functions.is_empty() => match self.call(&points.clone()) {
                    Some(point) => point,
                    None => continue,
                },
                5 => {
                    let name = self.one_of(&["AND", "OR", "XOR"]);
                    let inputs: Vec<Point> =
                        (0..2).map(|_| self.sources(&points)[0].clone()).collect();
                    self.function(name, &inputs, &points.clone())
                }
                _ => {
                    let sources = if at == 0 { vec![rail.clone()] } else { self.sources(&points) };
                    self.contact(x, &sources)
                }
            };
            points.push(point);
        }
        let coils = 1 + self.below(3);
        for at in 0..coils {
            let sources = self.sources(&points);
            let coil = self.coil(500 + at * 30, &sources);
            if self.below(6) == 0 {
                points.push(coil);
            }
        }
    }
}

pub struct Pin<'p> {
    pub name: &'p str,
    pub points: Vec<Point>,
    pub is_negated: bool,
}
