//! Measures MATH with four operators beside the same expressions in straight-line Rust.
//!
//! Each MATH is in a separate rung, with an input as its contact. The native side does everything
//! that the instruction does: it tests the contact, reads the operands from memory, computes in 64
//! bits with the same limits and tests for 0, limits the stored value, and notes mishaps. Both
//! sides must store the same values.

use std::fmt::Write;

use rungd_engine::isa::MemorySizes;

use super::native::{Formulas, thread_time_s};
use super::scanned::Scanned;
use super::workload::{INPUTS, Outside};

/// The number of words that the expressions read; the words after them are the targets.
const READ: usize = 64;
/// Number of MATHs executed in a round: the number of scans times the number of MATHs.
const MATHS_IN_A_ROUND: usize = 100_000;

/// A kind of expression.
struct ExpressionKind {
    name: &'static str,
    /// The expression of the MATH with a number, as written in a ladder and in Rust.
    expression: fn(usize) -> [String; 2],
}

const KINDS: [ExpressionKind; 3] = [
    ExpressionKind { name: "integers", expression: integers },
    ExpressionKind { name: "divisions", expression: divisions },
    ExpressionKind { name: "reals", expression: reals },
];

/// The four words that a MATH reads.
fn words(k: usize) -> [usize; 4] {
    [7, 13, 29, 53].map(|step| (k * step + step) % READ)
}

fn integers(k: usize) -> [String; 2] {
    let ([a, b, c, e], n) = (words(k), k % 90 + 3);
    match k % 3 {
        0 => [
            format!("(D{a} - {n}) * D{b} + D{c} * D{e}"),
            format!("add(mul(sub(d!({a}), {n}, m), d!({b}), m), mul(d!({c}), d!({e}), m), m)"),
        ],
        1 => [
            format!("D{a} + D{b} - D{c} * {n} + D{e}"),
            format!("add(sub(add(d!({a}), d!({b}), m), mul(d!({c}), {n}, m), m), d!({e}), m)"),
        ],
        _ => [
            format!("(D{a} + D{b}) * (D{c} - D{e}) - {n}"),
            format!("sub(mul(add(d!({a}), d!({b}), m), sub(d!({c}), d!({e}), m), m), {n}, m)"),
        ],
    }
}

fn divisions(k: usize) -> [String; 2] {
    let ([a, b, _, _], n) = (words(k), k % 90 + 3);
    let by = 25_600 + n;
    [
        format!("(D{a} - {n}) * 500 / {by} + D{b}"),
        format!("add(div(mul(sub(d!({a}), {n}, m), 500, m), {by}, m), d!({b}), m)"),
    ]
}

fn reals(k: usize) -> [String; 2] {
    let ([a, b, _, _], n) = (words(k), k % 90 + 3);
    [
        format!("(D{a} - {n}.0) * 0.5 / {n}.25 + D{b}"),
        format!("radd(rdiv(rmul(rsub(r!({a}), {n}.0, m), 0.5, m), {n}.25, m), r!({b}), m)"),
    ]
}

pub fn table(rounds: usize) -> anyhow::Result<()> {
    println!("MATH              n   native ns   engine ns   ratio   (quartiles)");
    for kind in &KINDS {
        for n in [100, 1000, 3000] {
            row(kind, n, rounds)?;
        }
    }
    Ok(())
}

fn row(kind: &ExpressionKind, n: usize, rounds: usize) -> anyhow::Result<()> {
    let ExpressionKind { name, expression } = kind;
    let (mut ladder, mut rust) =
        ("[[program]]\nname = \"Main\"\nrung = [\n".to_owned(), String::new());
    for k in 0..n {
        let [math, source] = expression(k);
        let to = READ + k;
        let x = k % INPUTS as usize;
        writeln!(ladder, "{{ when = [\"X{x}\"], do = [\"MATH D{to} = {math}\"] }},")?;
        let put = if *name == "reals" { "put_real" } else { "put" };
        let source = source.replace("d!(", "d!(memory ").replace("r!(", "r!(memory ");
        writeln!(rust, "math!(memory m {k} {x} {to} {put}({source}, m));")?;
    }
    ladder.push_str("]\n");
    let mut engine = Scanned::load(&ladder, MemorySizes::default(), 0)?;
    let mut native = Formulas::new(&rust, READ + n)?;
    engine.outside(&Outside { toggles: (0..INPUTS as u16).collect(), writes: Vec::new() });
    let scans = (MATHS_IN_A_ROUND / n).max(1);
    let mut both = Vec::new();
    for round in 0..rounds + 2 {
        for at in 0..READ {
            let value = ((round * 7919 + at * 104_729) % 30_000) as i32 - 5_000;
            engine.put_word(at, value);
            native.put_word(at, value);
        }
        let start_s = thread_time_s();
        (0..scans).for_each(|_| native.scan());
        let between_s = thread_time_s();
        (0..scans).for_each(|_| engine.scan());
        let end_s = thread_time_s();
        let noted = native.mishaps();
        anyhow::ensure!(engine.mishaps() == noted, "{name}: the mishaps differ: {noted:?}");
        anyhow::ensure!(engine.words(READ + n) == native.words(), "{name}: the sides differ");
        let of_one = 1e9 / (scans * n) as f64;
        both.push(((between_s - start_s) * of_one, (end_s - between_s) * of_one));
    }
    let middle = |mut values: Vec<f64>, part: usize| {
        values.sort_by(f64::total_cmp);
        values[values.len() * part / 4]
    };
    let both = &both[2..];
    let ratios: Vec<f64> = both.iter().map(|(native, engine)| engine / native).collect();
    println!(
        "{name:10} {n:8} {:11.2} {:11.2} {:7.2}   ({:.2} {:.2})",
        middle(both.iter().map(|b| b.0).collect(), 2),
        middle(both.iter().map(|b| b.1).collect(), 2),
        middle(ratios.clone(), 2),
        middle(ratios.clone(), 1),
        middle(ratios, 3),
    );
    Ok(())
}
