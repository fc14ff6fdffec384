//! Rungs with two contacts and an OUT, of plain bits or of bits of words.
//!
//! `benches/word_bits.sh` counts the instructions of each kind. There is no native side: the question
//! is what a bit of a word costs beside a bit.

use std::fmt::Write;

use clap::ValueEnum;
use rungd_engine::isa::MemorySizes;

use super::scanned::Scanned;

/// The number of bits, and of words, that the contacts read.
const READ: usize = 64;

/// The bits that are bits of words.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BitKind {
    /// None.
    Plain,
    /// Those of the contacts; each is read by many rungs.
    Contacts,
    /// Those of the contacts; each is read by one rung.
    Once,
    /// Those of the OUTs.
    Outs,
}

/// Executes scans of a ladder with this number of rungs.
///
/// # Errors
/// The ladder is refused.
pub fn run(kind: BitKind, rungs: usize, scans: usize) -> anyhow::Result<()> {
    let count = u32::try_from(READ + rungs)?;
    let sizes = MemorySizes { c: count, d: count, ..MemorySizes::default() };
    let mut engine = Scanned::load(&text(kind, rungs), sizes, READ + rungs)?;
    (0..scans).for_each(|_| engine.scan());
    Ok(())
}

fn text(kind: BitKind, rungs: usize) -> String {
    let mut text = "[[program]]\nname = \"Main\"\nrung = [\n".to_owned();
    let of_word = |at: usize| format!("D{at}.{}", at * 7 % 32);
    for rung in 0..rungs {
        let read = |step: usize| match kind {
            BitKind::Contacts => of_word((rung * step + step) % READ),
            BitKind::Once => {
                let bit = 2 * rung + usize::from(step == 13);
                format!("D{}.{}", bit / 32, bit % 32)
            }
            BitKind::Plain | BitKind::Outs => format!("C{}", (rung * step + step) % READ),
        };
        let out = match kind {
            BitKind::Outs => of_word(READ + rung),
            BitKind::Plain | BitKind::Contacts | BitKind::Once => format!("C{}", READ + rung),
        };
        let [a, b] = [read(7), read(13)];
        let _ = writeln!(text, "  {{ when = [\"{a}\", \"!{b}\"], do = [\"OUT {out}\"] }},");
    }
    text + "]\n"
}
