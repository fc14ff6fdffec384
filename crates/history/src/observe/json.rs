//! An answer as JSON. `docs/why.md` describes the fields.
//!
//! The types of `answer` that are written as they are derive `Serialize`. Here are the others: a
//! value is written by the type of its operand, and a variant has a `kind`.

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::answer::{
    Cause, ContactDetail, Edit, Explanation, Followed, Hindrance, LastChange, Node, OperandName,
    Remedy, Since, Stop, Write,
};
use rungd_config::controller::OutputState;
use rungd_engine::isa::Real;
use rungd_runtime::Origin;

impl Explanation {
    /// The answer as JSON.
    pub fn json(&self) -> Value {
        json!({
            "at": self.at,
            "operand": self.root,
            "changed": self.changed.as_ref().map(|of| changed(of, &self.root.operand)),
            "change": self.change.as_ref().map(|of| change(of, self)),
            "deeper": self.deeper,
            "output": output(self.output),
        })
    }
}

macro_rules! serialize_by {
    ($($part:ty => $json:path),* $(,)?) => {
        $(impl Serialize for $part {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                $json(self).serialize(to)
            }
        })*
    };
}

serialize_by! {
    Since => since,
    Node => node,
    Cause => cause,
    Stop => stop,
    Followed => followed,
    ContactDetail => contact_detail,
    Hindrance => hindrance,
}

fn output(of: OutputState) -> Value {
    match of {
        OutputState::AsMemory => Value::Null,
        OutputState::Safe(on) => json!({ "known": true, "on": on }),
        OutputState::Unknown(last) => json!({ "known": false, "last": last }),
    }
}

fn changed(of: &LastChange, operand: &OperandName) -> Value {
    json!({
        "since": of.since,
        "from": of.before.map(|before| value(operand, before)),
        "cause": of.cause,
    })
}

fn since(of: &Since) -> Value {
    let (at, before) = match of {
        Since::At(at) => (at, false),
        Since::Before(at) => (at, true),
    };
    json!({ "scan": at.scan, "unix_ns": at.unix_ns, "before": before })
}

fn value(operand: &OperandName, value: i32) -> Value {
    if operand.is_bit { json!(value != 0) } else { number(value, operand.is_real) }
}

fn number(value: i32, real: bool) -> Value {
    if real { json!(f64::from(Real::of_cell(value))) } else { json!(value) }
}

fn node(of: &Node) -> Value {
    json!({
        "name": of.operand.name,
        "address": of.operand.address,
        "doc": of.operand.doc,
        "value": value(&of.operand, of.value),
        "write": write(&of.write, &of.operand),
        "state": of.about,
        "idle": of.idle,
        "earlier": of.earlier.as_ref().map(|of| json!({
            "operand": of.root,
            "changed": of.changed.as_ref().map(|then| changed(then, &of.root.operand)),
        })),
    })
}

fn write(of: &Write, operand: &OperandName) -> Value {
    json!({
        "since": of.since,
        "from": of.before.map(|before| value(operand, before)),
        "in_last_scan": of.in_last_scan,
        "cause": of.cause,
    })
}

fn cause(of: &Cause) -> Value {
    match of {
        Cause::Instruction { rung: of, place: at, legs, operands, zeros } => json!({
            "kind": "instruction",
            "rung": of,
            "place": at,
            "legs": legs,
            "operands": operands.iter().map(operand_read).collect::<Vec<_>>(),
            "zeros": zeros,
        }),
        Cause::Pass { rung: of, place: at, stop: by } => json!({
            "kind": "pass", "rung": of, "place": at, "stop": by,
        }),
        Cause::Turn { block: of, running, restart: by } => json!({
            "kind": "turn",
            "block": of,
            "running": running,
            "restart": by,
        }),
        Cause::Force { who } => json!({ "kind": "force", "who": who }),
        Cause::Outside { origin, who } => {
            let kind = match origin {
                Origin::Inputs => "input",
                Origin::Device(_) => "device",
                Origin::Batch(_) => "queued-write",
                Origin::Command(_) => "command",
            };
            json!({ "kind": kind, "who": who })
        }
        Cause::Status => json!({ "kind": "status" }),
        Cause::Controller => json!({ "kind": "controller" }),
        Cause::Initial => json!({ "kind": "initial" }),
        Cause::Restored => json!({ "kind": "restored" }),
        Cause::Older(end) => json!({ "kind": "older", "end": end }),
    }
}

fn stop(of: &Stop) -> Value {
    match of {
        Stop::Controller => json!({ "kind": "controller" }),
        Stop::Bit(bit) => json!({ "kind": "bit", "bit": bit }),
        Stop::Again(block, by) => json!({ "kind": "again", "block": block, "restart": by }),
    }
}

fn operand_read((of, content, next): &(OperandName, i32, Followed)) -> Value {
    json!({ "operand": of, "value": value(of, *content), "why": next })
}

fn followed(of: &Followed) -> Value {
    match of {
        Followed::Node(of) => node(of),
        Followed::Cut(cut) => json!({ "cut": cut }),
    }
}

fn contact_detail(of: &ContactDetail) -> Value {
    match of {
        ContactDetail::Bit(bit, next) => json!({ "kind": "bit", "operand": bit, "why": next }),
        ContactDetail::Element { bit, index } => json!({
            "kind": "element",
            "bit": bit.as_ref().map(|(bit, next)| json!({ "operand": bit, "why": next })),
            "index": operand_read(index),
        }),
        ContactDetail::Compare { sides, real } => {
            let side = |at: usize| {
                let (content, operand, next) = &sides[at];
                let value = number(*content, real[at]);
                json!({ "value": value, "operand": operand, "why": next })
            };
            json!({ "kind": "compare", "left": side(0), "right": side(1) })
        }
        ContactDetail::Edge { last, inner_on, inner } => {
            json!({ "kind": "edge", "last": last, "of_on": inner_on, "of": inner })
        }
    }
}

fn hindrance(of: &Hindrance) -> Value {
    match of {
        Hindrance::Stopped(bit, next) => json!({ "kind": "stopped", "operand": bit, "why": next }),
        Hindrance::Legs(legs) => json!({ "kind": "legs", "legs": legs }),
    }
}

fn change(of: &Remedy, answer: &Explanation) -> Value {
    match of {
        Remedy::Edits(edits) => json!({
            "kind": "edits",
            "edits": edits.iter().map(edit).collect::<Vec<_>>(),
        }),
        Remedy::Itself => json!({ "kind": "itself" }),
        Remedy::Release => json!({ "kind": "release" }),
        Remedy::NoScan => {
            let mode = answer.mode.map(|(mode, at)| json!({ "name": mode.name(), "since": at }));
            json!({ "kind": "no-scan", "mode": mode })
        }
        Remedy::None(end) => json!({
            "kind": "none",
            "every_single": end.every_single,
            "tried": end.tried,
            "combined": answer.combined,
        }),
    }
}

fn edit(of: &Edit) -> Value {
    match of {
        Edit::Write { operand: of, value: content } => {
            json!({ "write": of, "value": value(of, *content) })
        }
        Edit::Run { block: of } => json!({ "run": of }),
    }
}
