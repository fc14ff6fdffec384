//! Random functions of the file: their bodies, and their calls.

use rungd_base::random::SplitMix64;

use super::generator::{Body, Pin, Point};
use super::kinds::declared;
use crate::numbers::below;

/// A function that random ladders call.
#[derive(Clone)]
pub struct Callee {
    pub name: &'static str,
    /// The type of its result.
    pub kind: &'static str,
    /// As an element of the file.
    pub xml: String,
}

/// The variables that a function has for its caller; its others are its own.
const INTERFACE: [&str; 4] = ["bit0", "bit1", "num0", "num1"];

/// A random function, which calls others.
pub fn function(random: &mut SplitMix64, name: &'static str, callees: &[Callee]) -> Callee {
    let kinds = ["BOOL", "INT", "DINT", "UINT", "REAL", "TIME"];
    let kind = kinds[below(random, kinds.len() as u64) as usize];
    let mut body = Body::new(random, false);
    body.functions = callees.to_vec();
    body.result = Some([name, kind]);
    let written = body.written(2);
    let locals = declared(&INTERFACE).replace(
        "name=\"num2\"><type><INT/></type>",
        "name=\"num2\"><type><INT/></type><initialValue><simpleValue value=\"7\"/></initialValue>",
    );
    let list = |list: &str, names: [&str; 2]| {
        let [bit, number] = names;
        format!(
            "<{list}><variable name=\"{bit}\"><type><BOOL/></type></variable><variable \
             name=\"{number}\"><type><INT/></type></variable></{list}>"
        )
    };
    let xml = format!(
        "<pou name=\"{name}\" pouType=\"function\"><interface><returnType><{kind}/></returnType>\
         {}{}<localVars>{locals}</localVars></interface><body><LD>{}</LD></body></pou>",
        list("inputVars", ["bit0", "num0"]),
        list("outputVars", ["bit1", "num1"]),
        written.elements
    );
    Callee { name, kind, xml }
}

impl Body<'_> {
    /// A conversion, whose result goes into a variable.
    pub fn conversion(&mut self) {
        let pairs = [
            ["INT", "DINT"],
            ["DINT", "INT"],
            ["DINT", "UINT"],
            ["INT", "REAL"],
            ["DINT", "REAL"],
            ["REAL", "INT"],
            ["REAL", "DINT"],
            ["REAL", "UINT"],
            ["TIME", "INT"],
            ["TIME", "DINT"],
            ["TIME", "REAL"],
            ["INT", "TIME"],
        ];
        let [from, to] = pairs[self.below(pairs.len() as u64) as usize];
        let text = self.variable(from);
        let points = vec![self.named_input(&text)];
        let pin = Pin { name: "IN", points, is_negated: false };
        let id = self.block(&format!("{from}_TO_{to}"), None, &[pin], &["OUT"]);
        self.output(to, Point { id, pin: Some("OUT".to_owned()) });
    }

    /// A call of a function of the file; a point with power, if it gives one.
    pub fn call(&mut self, points: &[Point]) -> Option<Point> {
        let at = self.below(self.functions.len() as u64) as usize;
        let callee = self.functions[at].clone();
        let mut pins = Vec::new();
        let mut outputs = vec!["OUT", "bit1", "num1"];
        let is_enabled = self.is_program && self.below(3) == 0;
        if is_enabled {
            pins.push(Pin { name: "EN", points: self.sources(points), is_negated: false });
            outputs.insert(0, "ENO");
        }
        let is_negated = self.below(6) == 0;
        pins.push(Pin { name: "bit0", points: self.sources(points), is_negated });
        pins.push(Pin { name: "num0", points: vec![self.input("INT")], is_negated: false });
        let id = self.block(callee.name, None, &pins, &outputs);
        let pin = |name: &str| Point { id, pin: Some(name.to_owned()) };
        if self.below(2) == 0 {
            self.output("INT", pin("num1"));
        }
        if callee.kind != "BOOL" {
            self.output(callee.kind, pin("OUT"));
        }
        match (callee.kind == "BOOL", self.below(3)) {
            (true, 1 | 2) => Some(pin("OUT")),
            (_, 0) if is_enabled => Some(pin("ENO")),
            (_, 1) => Some(pin("bit1")),
            _ => None,
        }
    }
}
