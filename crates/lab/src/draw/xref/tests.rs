//! Compares the cross-reference of every shipped ladder with the engine.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use rungd_config::load;
use rungd_engine::isa::OperandRole;
use rungd_engine::{BitCell, Cell, Stretches, WordCell};
use rungd_history::observe::Subject;
use rungd_language::lower::sites::OperationSite;

fn subject(path: &Path) -> Option<Subject> {
    let loaded = match load::is_controller_file(path).expect("readable") {
        true => load::controller_file(path).expect("readable"),
        false => load::ladder_files(&[path.to_owned()]).expect("readable"),
    };
    let program = loaded.program?;
    Some(Subject::new(Arc::new(program), loaded.files))
}

#[test]
fn the_cross_reference_lists_every_reader_of_the_shipped_ladders() {
    let config = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config");
    let mut compared = 0;
    for folder in [config.clone(), config.join("programs"), config.join("lib")] {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|of| of == "toml")
                && let Some(subject) = subject(&path)
            {
                compared += compare(&subject, &path.display().to_string());
            }
        }
    }
    assert!(compared > 800, "{compared} places compared");
}

fn cells(of: &Stretches) -> impl Iterator<Item = Cell> + '_ {
    let bits = of.bits.iter().flat_map(|(first, count)| *first..first + count);
    let words = of.words.iter().flat_map(|(first, count)| *first..first + count);
    bits.map(|at| Cell::Bit(BitCell(at))).chain(words.map(|at| Cell::Word(WordCell(at))))
}

/// Compares, for each named cell, the parts of rungs whose operations read it with the listed
/// parts. Two kinds of reads are no uses: an operation may read the cell that it writes, to keep
/// its value, and a reset reads the preset of its counter.
fn compare(subject: &Subject, name: &str) -> usize {
    let uses = subject.uses();
    let read = subject.code().read_by_batches();
    let mut compared = 0;
    for named in subject.program().named(usize::MAX) {
        // Operations read `$On` and `$Off` in place of a missing leg.
        let Ok(cell) = subject.cell(&named.name()) else { continue };
        if matches!(&*named.name(), "$On" | "$Off") {
            continue;
        }
        let listed: BTreeSet<u32> = uses.reading_parts(cell).into_iter().collect();
        let mut by_engine = BTreeSet::new();
        for (at, (read, written)) in read.iter().zip(&subject.batches).enumerate() {
            let OperationSite { part, instruction } = subject.sites.batches[at];
            let instruction = instruction.and_then(|number| subject.instruction(part, number));
            let is_reset =
                instruction.is_some_and(|of| of.acting_role() == Some(OperandRole::Resets));
            if cells(read).any(|of| of == cell) && !written.has(cell) && !is_reset {
                by_engine.insert(part);
            }
        }
        let missing: Vec<&u32> = by_engine.difference(&listed).collect();
        assert!(missing.is_empty(), "{name}: {}: parts {missing:?} read it, too", named.name());
        compared += by_engine.len();
    }
    compared
}
