//! Measures MATH with four operators beside the same expressions in straight-line Rust.
//!
//! Each MATH stands in a rung of its own with `$On`. The native side does the same arithmetic in 64
//! bits and limits what it stores; it notes no mishap. Both sides must store the same.

use std::fmt::Write;

use rungd::isa::MemorySizes;

use super::native::{Formulas, thread_time_s};
use super::scanned::Scanned;

/// Words that the expressions read; the words behind them are the targets.
const READ: usize = 64;
/// Number of scans in a round, over the number of MATHs.
const MATHS_IN_A_ROUND: usize = 100_000;

/// A kind of expression: of the MATH with this number, as written in a ladder and in Rust.
type Kind = (&'static str, fn(usize) -> [String; 2]);

const KINDS: [Kind; 3] = [("integers", integers), ("divisions", divisions), ("reals", reals)];

/// The four words that a MATH reads.
fn words(k: usize) -> [usize; 4] {
    [7, 13, 29, 53].map(|step| (k * step + step) % READ)
}

fn integers(k: usize) -> [String; 2] {
    let ([a, b, c, e], n) = (words(k), k % 90 + 3);
    let both = |w: &dyn Fn(usize) -> String| match k % 3 {
        0 => format!("({} - {n}) * {} + {} * {}", w(a), w(b), w(c), w(e)),
        1 => format!("{} + {} - {} * {n} + {}", w(a), w(b), w(c), w(e)),
        _ => format!("({} + {}) * ({} - {}) - {n}", w(a), w(b), w(c), w(e)),
    };
    let text = both(&|at| format!("D{at}"));
    [text, format!("put({})", both(&|at| format!("(*d.add({at}) as i64)")))]
}

fn divisions(k: usize) -> [String; 2] {
    let ([a, b, _, _], n) = (words(k), k % 90 + 3);
    let both =
        |w: &dyn Fn(usize) -> String| format!("({} - {n}) * 500 / {} + {}", w(a), 25_600 + n, w(b));
    let text = both(&|at| format!("D{at}"));
    [text, format!("put({})", both(&|at| format!("(*d.add({at}) as i64)")))]
}

fn reals(k: usize) -> [String; 2] {
    let ([a, b, _, _], n) = (words(k), k % 90 + 3);
    let both =
        |w: &dyn Fn(usize) -> String| format!("({} - {n}.0) * 0.5 / {n}.25 + {}", w(a), w(b));
    let text = both(&|at| format!("D{at}"));
    [text, format!("({}) as i32", both(&|at| format!("(*d.add({at}) as f64)")))]
}

pub fn table(rounds: usize) -> anyhow::Result<()> {
    println!("MATH              n   native ns   engine ns   ratio   (quartiles)");
    for (name, kind) in KINDS {
        for n in [100, 1000, 3000] {
            row(name, (kind, n), rounds)?;
        }
    }
    Ok(())
}

fn row(
    name: &str,
    (kind, n): (fn(usize) -> [String; 2], usize),
    rounds: usize,
) -> anyhow::Result<()> {
    let (mut ladder, mut rust) =
        ("[[program]]\nname = \"Main\"\nrung = [\n".to_owned(), String::new());
    for k in 0..n {
        let [math, source] = kind(k);
        let to = READ + k;
        writeln!(ladder, "{{ when = [\"$On\"], do = [\"MATH D{to} = {math}\"] }},")?;
        writeln!(rust, "*d.add({to}) = {source};")?;
    }
    ladder.push_str("]\n");
    let mut engine = Scanned::load(&ladder, MemorySizes::default(), 0)?;
    let mut native = Formulas::new(&rust, READ + n)?;
    let scans = (MATHS_IN_A_ROUND / n).max(1);
    let mut both = Vec::new();
    for round in 0..rounds + 2 {
        for at in 0..READ {
            let value = ((round * 7919 + at * 104_729) % 30_000) as i32 - 5_000;
            engine.put_word(at, value);
            native.words[at] = value;
        }
        let start_s = thread_time_s();
        (0..scans).for_each(|_| native.scan());
        let between_s = thread_time_s();
        (0..scans).for_each(|_| engine.scan());
        let end_s = thread_time_s();
        anyhow::ensure!(engine.words(READ + n) == native.words, "{name}: the sides differ");
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
