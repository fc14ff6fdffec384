//! An answer as JSON. `docs/why.md` describes the fields.
//!
//! The types of `answer` that are written as they are derive `Serialize`. Here are the others: a
//! value is written by the type of its operand, and a variant has a `kind`.

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::answer::{
    CallPlace, Cause, ContactDetail, Edit, ExplainedOperand, ExplainedValue, Explanation, Followed,
    Hindrance, LastChange, ModeSince, Node, OperandName, Remedy, Since, Stop, Write,
};
use rungd_config::controller::OutputState;
use rungd_engine::isa::Real;
use rungd_language::lower::formula_value::FormulaNumber;
use rungd_runtime::Origin;

impl Explanation {
    /// The answer as JSON.
    pub fn json(&self) -> Value {
        json!({
            "at": self.at,
            "operand": self.root,
            "changed": self.changed.as_ref().map(|last| changed(last, &self.root.operand)),
            "change": self.change.as_ref().map(|remedy| change(remedy, self)),
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

fn output(state: OutputState) -> Value {
    match state {
        OutputState::AsMemory => Value::Null,
        OutputState::Safe(on) => json!({ "known": true, "on": on }),
        OutputState::Unknown(last) => json!({ "known": false, "last": last }),
    }
}

fn changed(last_change: &LastChange, operand: &OperandName) -> Value {
    json!({
        "since": last_change.since,
        "from": last_change.before.map(|before| value(operand, before)),
        "cause": last_change.cause,
    })
}

fn since(time: &Since) -> Value {
    let (at, before) = match time {
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

fn node(explained: &Node) -> Value {
    let json = json!({
        "name": explained.operand.name,
        "address": explained.operand.address,
        "doc": explained.operand.doc,
        "value": value(&explained.operand, explained.value),
        "write": write(&explained.write, &explained.operand),
        "state": explained.about,
        "idle": explained.idle,
        "earlier": explained.earlier.as_ref().map(|earlier| json!({
            "operand": earlier.root,
            "changed": earlier.changed.as_ref().map(|then| changed(then, &earlier.root.operand)),
        })),
    });
    with_text(json, &explained.operand, explained.value)
}

/// Adds the text of the value, if its tag gives one.
fn with_text(mut json: Value, operand: &OperandName, value: i32) -> Value {
    if let Some(text) = operand.text(value) {
        json["text"] = text.into();
    }
    json
}

fn write(decided: &Write, operand: &OperandName) -> Value {
    json!({
        "since": decided.since,
        "from": decided.before.map(|before| value(operand, before)),
        "in_last_scan": decided.in_last_scan,
        "cause": decided.cause,
    })
}

fn cause(write_cause: &Cause) -> Value {
    match write_cause {
        Cause::Instruction { rung: rung_name, place: at, legs, operands, zeros, calls } => {
            let mut cause = json!({
                "kind": "instruction",
                "rung": rung_name,
                "place": at,
                "legs": legs,
                "operands": operands.iter().map(operand_read).collect::<Vec<_>>(),
                "zeros": zeros,
            });
            let call = |call: &CallPlace| json!({ "rung": call.rung, "place": call.place });
            if !calls.is_empty() {
                cause["calls"] = calls.iter().map(call).collect();
            }
            cause
        }
        Cause::Pass { rung: rung_name, place: at, stop: by } => json!({
            "kind": "pass", "rung": rung_name, "place": at, "stop": by,
        }),
        Cause::Turn { block: name, running, restart: by } => json!({
            "kind": "turn",
            "block": name,
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
        Cause::Resumed => json!({ "kind": "resumed" }),
        Cause::Initial => json!({ "kind": "initial" }),
        Cause::Restored => json!({ "kind": "restored" }),
        Cause::Older(end) => json!({ "kind": "older", "end": end }),
    }
}

fn stop(termination: &Stop) -> Value {
    match termination {
        Stop::Controller => json!({ "kind": "controller" }),
        Stop::Bit(bit) => json!({ "kind": "bit", "bit": bit }),
        Stop::Again(block, by) => json!({ "kind": "again", "block": block, "restart": by }),
    }
}

fn operand_read(
    ExplainedOperand { operand, value: content, followed }: &ExplainedOperand,
) -> Value {
    let json = json!({ "operand": operand, "value": value(operand, *content), "why": followed });
    with_text(json, operand, *content)
}

fn followed(reasons: &Followed) -> Value {
    match reasons {
        Followed::Node(explained) => node(explained),
        Followed::Cut(cut) => json!({ "cut": cut }),
    }
}

fn contact_detail(detail: &ContactDetail) -> Value {
    match detail {
        ContactDetail::Bit(bit, next) => json!({ "kind": "bit", "operand": bit, "why": next }),
        ContactDetail::Element { bit, index } => json!({
            "kind": "element",
            "bit": bit.as_ref().map(|(bit, next)| json!({ "operand": bit, "why": next })),
            "index": operand_read(index),
        }),
        ContactDetail::Compare { sides, real } => {
            let side = |at: usize| {
                let ExplainedValue { value, operand, followed } = &sides[at];
                let value = number(*value, real[at]);
                json!({ "value": value, "operand": operand, "why": followed })
            };
            json!({ "kind": "compare", "left": side(0), "right": side(1) })
        }
        ContactDetail::Computed { sides, operands, is_time: _ } => {
            let side = |at: usize| sides.get(at).map(computed_number);
            let operands: Vec<Value> = operands.iter().map(operand_read).collect();
            json!({
                "kind": "computed",
                "left": side(0),
                "right": side(1),
                "operands": operands,
            })
        }
        ContactDetail::Edge { last, inner_on, inner } => {
            json!({ "kind": "edge", "last": last, "of_on": inner_on, "of": inner })
        }
    }
}

fn computed_number(number: &FormulaNumber) -> Value {
    match number {
        FormulaNumber::Integer(number) => json!(number),
        FormulaNumber::Real(number) => json!(number),
    }
}

fn hindrance(obstacle: &Hindrance) -> Value {
    match obstacle {
        Hindrance::Stopped(bit, next) => json!({ "kind": "stopped", "operand": bit, "why": next }),
        Hindrance::Legs(legs) => json!({ "kind": "legs", "legs": legs }),
    }
}

fn change(remedy: &Remedy, answer: &Explanation) -> Value {
    match remedy {
        Remedy::Edits(edits) => json!({
            "kind": "edits",
            "edits": edits.iter().map(edit).collect::<Vec<_>>(),
        }),
        Remedy::Itself => json!({ "kind": "itself" }),
        Remedy::Release => json!({ "kind": "release" }),
        Remedy::NoScan => {
            let mode = answer
                .mode
                .map(|ModeSince { mode, since }| json!({ "name": mode.name(), "since": since }));
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

fn edit(memory_edit: &Edit) -> Value {
    match memory_edit {
        Edit::Write { operand: name, value: content } => {
            json!({ "write": name, "value": value(name, *content) })
        }
        Edit::Run { block: name } => json!({ "run": name }),
    }
}
