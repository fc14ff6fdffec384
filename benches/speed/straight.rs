//! Writes a workload as straight-line Rust, as if written by hand for these rungs.
//!
//! One byte for each bit, one `i32` for each accumulator, no unused flags, branches only around
//! Stages; every offset is a constant. The state of a rung is stored together: with the histories
//! of W′ packed byte by byte, the code took several times as long. Each function has [`RUNGS`]
//! rungs, so that it compiles fast.

use std::fmt::Write;

use super::workload::{
    Bit, BitContact, Contact, INPUTS, Kind, Rung, STAGED_COILS, STAGES, Shape, Stage, WORDS,
    Workload,
};

/// Number of rungs in a function.
const RUNGS: usize = 256;

pub fn source(workload: &Workload) -> String {
    let mut parts = Vec::new();
    let mut start = String::new();
    match &workload.shape {
        Shape::Flat(rungs) => {
            for (part, rungs) in rungs.chunks(RUNGS).enumerate() {
                let mut body = String::new();
                for (at, rung) in rungs.iter().enumerate() {
                    flat_rung(&mut body, part * RUNGS + at, rung);
                }
                parts.push(body);
            }
            for (at, rung) in rungs.iter().enumerate() {
                if rung.kind == Kind::CountDown {
                    writeln!(start, "m.r[{at}].a = {};", rung.preset).unwrap();
                }
            }
        }
        Shape::Staged(programs) => {
            for (program, stages) in programs.iter().enumerate() {
                let mut body = String::new();
                for (at, stage) in stages.iter().enumerate() {
                    staged_rungs(&mut body, program, at, stage);
                }
                parts.push(body);
                writeln!(start, "m.on[{}] = 1;", program * STAGES).unwrap();
            }
        }
    }
    whole(workload, &parts, &start)
}

fn whole(workload: &Workload, parts: &[String], start: &str) -> String {
    let (coils, structures) = (workload.coils(), workload.structures());
    let mut text = format!(
        "#![allow(unused_parens, unused_variables)]\n\
         #[repr(C)] pub struct R {{ a: i32, w: u8, e: u8 }}\n\
         #[repr(C)] pub struct M {{\n\
         x: [u8; {INPUTS}], d: [i32; {WORDS}], c: [u8; {coils}],\n\
         r: [R; {structures}],\n\
         on: [u8; {structures}], due: [u8; {structures}] }}\n\
         #[unsafe(no_mangle)] pub extern \"C\" fn size() -> usize {{ size_of::<M>() }}\n\
         #[unsafe(no_mangle)] pub extern \"C\" fn start(m: &mut M) {{\n{start}}}\n"
    );
    for (part, body) in parts.iter().enumerate() {
        write!(text, "#[inline(never)] fn part{part}(m: &mut M, dt: i32) {{\n{body}}}\n").unwrap();
    }
    text.push_str("#[unsafe(no_mangle)] pub extern \"C\" fn scan(m: &mut M, dt: i32) {\n");
    for part in 0..parts.len() {
        writeln!(text, "part{part}(m, dt);").unwrap();
    }
    text.push_str("}\n");
    text
}

fn flat_rung(body: &mut String, at: usize, rung: &Rung) {
    let leg = leg(body, at, &rung.leg);
    let (preset, [c, d]) = (rung.preset, rung.reset.map(bit));
    let counts =
        format!("let r = {c} & {d}; let n = (l & (m.r[{at}].w ^ 1)) as i32; m.r[{at}].w = l;");
    let text = match rung.kind {
        Kind::CountUp => format!(
            "{counts} let a = m.r[{at}].a.wrapping_add(n) & (r as i32 - 1);\n\
             m.r[{at}].a = a; m.c[{at}] = (a >= {preset}) as u8;"
        ),
        Kind::CountDown => format!(
            "{counts} let a = m.r[{at}].a.wrapping_sub(n);\n\
             let a = if r != 0 {{ {preset} }} else {{ a }};\n\
             m.r[{at}].a = a; m.c[{at}] = (a <= 0) as u8;"
        ),
        Kind::OnDelay => on_delay(at, at, preset),
        Kind::OffDelay => format!(
            "let left = m.r[{at}].a.wrapping_sub(dt).max(0);\n\
             let a = if l | m.r[{at}].w != 0 {{ {preset} }} else {{ left }};\n\
             m.r[{at}].w = l; m.r[{at}].a = a; m.c[{at}] = l | (a > 0) as u8;"
        ),
    };
    write!(body, "{{ let l = {leg};\n{text} }}\n").unwrap();
}

fn on_delay(at: usize, coil: usize, preset: i32) -> String {
    format!(
        "let k = l & m.r[{at}].w; m.r[{at}].w = l;\n\
         let a = m.r[{at}].a.wrapping_add(dt) & -(k as i32);\n\
         m.r[{at}].a = a; m.c[{coil}] = l & (a >= {preset}) as u8;"
    )
}

/// A Stage: its pass if one is due, then its rungs if it is ON.
fn staged_rungs(body: &mut String, program: usize, at: usize, stage: &Stage) {
    let (coil, id) = (program * STAGED_COILS, program * STAGES + at);
    let next = program * STAGES + (at + 1) % STAGES;
    let (own, timed) = (coil + 1 + at, coil + 1 + STAGES + at);
    write!(
        body,
        "if m.due[{id}] != 0 {{ m.due[{id}] = 0; m.c[{coil}] = 0; m.c[{own}] = 0;\n\
         m.c[{timed}] = 0; m.r[{id}].a = 0; m.r[{id}].w = 0; }}\n\
         if m.on[{id}] != 0 {{\n"
    )
    .unwrap();
    let shared = leg(body, id, &stage.shared);
    writeln!(body, "m.c[{coil}] = {shared};").unwrap();
    let own_leg = leg(body, id, &stage.own);
    writeln!(body, "m.c[{own}] = {own_leg};").unwrap();
    let timer = leg(body, id, &[stage.timer]);
    let leave = leg(body, id, &[stage.leave]);
    write!(
        body,
        "let l = {timer};\n{}\n\
         if m.c[{timed}] & {leave} != 0 {{ m.on[{id}] = 0; m.due[{id}] = 1; m.on[{next}] = 1; }}\n\
         }}\n",
        on_delay(id, timed, stage.preset)
    )
    .unwrap();
}

/// The expression of a leg; adds the statements that it needs to `body`.
fn leg(body: &mut String, at: usize, contacts: &[Contact]) -> String {
    let mut terms = Vec::new();
    for contact in contacts {
        terms.push(match contact {
            Contact::Bit(bit) => bit_contact(bit),
            Contact::Or(a, b) => format!("({} | {})", bit_contact(a), bit_contact(b)),
            Contact::Less(word, than) => format!("((m.d[{word}] < {than}) as u8)"),
            Contact::NotRise(x) => {
                writeln!(body, "let e{at} = (m.x[{x}] ^ 1) | m.r[{at}].e; m.r[{at}].e = m.x[{x}];")
                    .unwrap();
                format!("e{at}")
            }
        });
    }
    format!("({})", terms.join(" & "))
}

fn bit_contact(contact: &BitContact) -> String {
    let bit = bit(contact.bit);
    match contact.opposite {
        false => bit,
        true => format!("({bit} ^ 1)"),
    }
}

fn bit(bit: Bit) -> String {
    match bit {
        Bit::Input(x) => format!("m.x[{x}]"),
        Bit::Coil(rung) => format!("m.c[{rung}]"),
    }
}
