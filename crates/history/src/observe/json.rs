//! An answer as JSON. `docs/why.md` describes the fields.

use serde_json::{Value, json};

use super::answer::{
    About, BlockPlace, Cause, ContactDetail, ContactSeen, Cut, Edit, Explanation, Followed,
    Hindrance, Idle, LastChange, LegSeen, Node, OperandName, Place, Remedy, Restart, RungName,
    Since, Stop, TapeEnd, When, Write,
};
use rungd_config::controller::OutputState;
use rungd_engine::isa::Real;
use rungd_runtime::Origin;

impl Explanation {
    /// The answer as JSON.
    pub fn json(&self) -> Value {
        json!({
            "at": when(self.at),
            "operand": node(&self.root),
            "changed": self.changed.as_ref().map(|of| changed(of, &self.root.operand)),
            "change": self.change.as_ref().map(|of| change(of, self)),
            "deeper": self.deeper,
            "output": output(self.output),
        })
    }
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
        "since": since(of.since),
        "from": of.before.map(|before| value(operand, before)),
        "cause": of.cause.as_ref().map(cause),
    })
}

fn when(at: When) -> Value {
    json!({ "scan": at.scan, "unix_ns": at.unix_ns })
}

fn since(of: Since) -> Value {
    match of {
        Since::At(at) => json!({ "scan": at.scan, "unix_ns": at.unix_ns, "before": false }),
        Since::Before(at) => json!({ "scan": at.scan, "unix_ns": at.unix_ns, "before": true }),
    }
}

fn value(operand: &OperandName, value: i32) -> Value {
    if operand.is_bit { json!(value != 0) } else { number(value, operand.is_real) }
}

fn number(value: i32, real: bool) -> Value {
    if real { json!(f64::from(Real::of_cell(value))) } else { json!(value) }
}

fn operand(of: &OperandName) -> Value {
    json!({ "name": of.name, "address": of.address, "doc": of.doc })
}

fn place(of: &Place) -> Value {
    let Place { file, line, start, end, text } = of;
    json!({ "file": file, "line": line, "start": start, "end": end, "text": text })
}

fn block(of: &BlockPlace) -> Value {
    json!({ "name": of.name, "place": place(&of.place) })
}

fn rung(of: &RungName) -> Value {
    json!({
        "in": of.element.name,
        "name": of.name,
        "number": of.number,
        "branch": of.branch,
    })
}

fn node(of: &Node) -> Value {
    json!({
        "name": of.operand.name,
        "address": of.operand.address,
        "doc": of.operand.doc,
        "value": value(&of.operand, of.value),
        "write": write(&of.write, &of.operand),
        "state": of.about.as_ref().map(about),
        "idle": of.idle.iter().map(idle).collect::<Vec<_>>(),
        "earlier": of.earlier.as_ref().map(|of| json!({
            "operand": node(&of.root),
            "changed": of.changed.as_ref().map(|then| changed(then, &of.root.operand)),
        })),
    })
}

fn write(of: &Write, operand: &OperandName) -> Value {
    json!({
        "since": since(of.since),
        "from": of.before.map(|before| value(operand, before)),
        "in_last_scan": of.in_last_scan,
        "cause": cause(&of.cause),
    })
}

fn cause(of: &Cause) -> Value {
    match of {
        Cause::Instruction { rung: of, place: at, legs, operands, zeros } => json!({
            "kind": "instruction",
            "rung": rung(of),
            "place": place(at),
            "legs": legs.iter().map(leg).collect::<Vec<_>>(),
            "operands": operands.iter().map(operand_read).collect::<Vec<_>>(),
            "zeros": zeros,
        }),
        Cause::Pass { rung: of, place: at, stop: by } => json!({
            "kind": "pass", "rung": rung(of), "place": place(at), "stop": stop(by),
        }),
        Cause::Turn { block: of, running, restart: by } => json!({
            "kind": "turn",
            "block": block(of),
            "running": running.as_ref().map(|of| node(of)),
            "restart": by.as_ref().map(|of| restart(of)),
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
        Cause::Older(end) => json!({ "kind": "older", "end": tape_end(*end) }),
    }
}

fn tape_end(end: TapeEnd) -> &'static str {
    match end {
        TapeEnd::Oldest => "oldest",
        TapeEnd::Swapped => "swapped",
        TapeEnd::Lost => "lost",
        TapeEnd::Restarted => "restarted",
        TapeEnd::Searched => "searched",
        TapeEnd::Unreadable => "unreadable",
    }
}

fn stop(of: &Stop) -> Value {
    match of {
        Stop::Controller => json!({ "kind": "controller" }),
        Stop::Bit(of) => json!({ "kind": "bit", "bit": node(of) }),
        Stop::Again(of, by) => json!({
            "kind": "again", "block": block(of), "restart": by.as_ref().map(|of| restart(of)),
        }),
    }
}

fn restart(of: &Restart) -> Value {
    json!({
        "at": when(of.at),
        "rung": rung(&of.rung),
        "place": place(&of.place),
        "legs": of.legs.iter().map(leg).collect::<Vec<_>>(),
    })
}

fn operand_read((of, content, next): &(OperandName, i32, Followed)) -> Value {
    json!({ "operand": operand(of), "value": value(of, *content), "why": followed(next) })
}

fn followed(of: &Followed) -> Value {
    match of {
        Followed::Node(of) => node(of),
        Followed::Cut(cut) => json!({
            "cut": match cut {
                Cut::Depth => "depth",
                Cut::Shown => "shown",
                Cut::Length => "length",
                Cut::Constant => "constant",
            },
        }),
    }
}

fn leg(of: &LegSeen) -> Value {
    json!({
        "name": of.name,
        "on": of.on,
        "series": of.series.iter().map(place).collect::<Vec<_>>(),
        "contacts": of.contacts.iter().map(contact).collect::<Vec<_>>(),
        "also_off": of.also_off.iter().map(contact).collect::<Vec<_>>(),
    })
}

fn contact(of: &ContactSeen) -> Value {
    let detail = match &of.detail {
        ContactDetail::Bit(of, next) => {
            json!({ "kind": "bit", "operand": operand(of), "why": followed(next) })
        }
        ContactDetail::Element { bit, index } => json!({
            "kind": "element",
            "bit": bit.as_ref().map(|(of, next)| json!({
                "operand": operand(of), "why": followed(next),
            })),
            "index": operand_read(index),
        }),
        ContactDetail::Compare { sides, real } => {
            let side = |at: usize| {
                let (content, of, next) = &sides[at];
                json!({
                    "value": number(*content, real[at]),
                    "operand": of.as_ref().map(operand),
                    "why": followed(next),
                })
            };
            json!({ "kind": "compare", "left": side(0), "right": side(1) })
        }
        ContactDetail::Edge { last, inner_on, inner } => json!({
            "kind": "edge",
            "last": since(*last),
            "of_on": inner_on,
            "of": inner.iter().map(contact).collect::<Vec<_>>(),
        }),
    };
    json!({ "place": place(&of.place), "on": of.on, "is": detail })
}

fn about(of: &About) -> Value {
    match of {
        About::Timer { acc_ms, preset_ms, timing, since: at, done } => json!({
            "kind": "timer",
            "acc_ms": acc_ms,
            "preset_ms": preset_ms,
            "timing": timing,
            "since": since(*at),
            "done": done.map(since),
        }),
        About::Counter { acc, presets, counted, reset } => json!({
            "kind": "counter",
            "acc": acc,
            "presets": presets,
            "counted": since(*counted),
            "reset": since(*reset),
        }),
    }
}

fn idle(of: &Idle) -> Value {
    let because = match &of.because {
        Hindrance::Stopped(bit, next) => {
            json!({ "kind": "stopped", "operand": operand(bit), "why": followed(next) })
        }
        Hindrance::Legs(legs) => {
            json!({ "kind": "legs", "legs": legs.iter().map(leg).collect::<Vec<_>>() })
        }
    };
    json!({ "rung": rung(&of.rung), "place": place(&of.place), "because": because })
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
            let mode = answer.mode.map(|(mode, at)| {
                json!({
                    "name": mode.name(),
                    "since": since(at),
                })
            });
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
            json!({ "write": operand(of), "value": value(of, *content) })
        }
        Edit::Run { block: of } => json!({ "run": block(of) }),
    }
}
