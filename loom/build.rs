//! Copies of the modules that threads share without locks, on loom's atomics; and of each copy its
//! mutants: the same text with one memory order weaker, or one step divided.
//!
//! The sources stay as they are: only the paths of atomics and `Arc` are exchanged in the copies.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs};

/// A module, and its mutants: a name, the text that is exchanged, and the text for it.
struct Module {
    name: &'static str,
    mutants: &'static [(&'static str, &'static str, &'static str)],
}

const MODULES: &[Module] = &[
    Module {
        name: "latest",
        mutants: &[
            (
                "writer_relaxed",
                "swap(self.own | NEW, Ordering::AcqRel)",
                "swap(self.own | NEW, Ordering::Relaxed)",
            ),
            (
                "writer_without_release",
                "swap(self.own | NEW, Ordering::AcqRel)",
                "swap(self.own | NEW, Ordering::Acquire)",
            ),
            (
                "reader_relaxed",
                "swap(self.own, Ordering::AcqRel)",
                "swap(self.own, Ordering::Relaxed)",
            ),
            (
                "reader_without_acquire",
                "swap(self.own, Ordering::AcqRel)",
                "swap(self.own, Ordering::Release)",
            ),
            (
                "reader_keeps_its_buffer",
                "self.own = before & NUMBER;\n        }\n    }\n\n    /// The inputs",
                "let _ = before;\n        }\n    }\n\n    /// The inputs",
            ),
        ],
    },
    Module {
        name: "beat",
        mutants: &[
            (
                "end_in_two_steps",
                "self.scan_since_ns.swap(IDLE, Ordering::AcqRel) != TRIPPED",
                "{ let was = self.scan_since_ns.load(Ordering::Acquire); \
                 self.scan_since_ns.store(IDLE, Ordering::Release); was != TRIPPED }",
            ),
            (
                "arrive_in_two_steps",
                "self.due_ns.swap(IDLE, Ordering::AcqRel) != TRIPPED",
                "{ let was = self.due_ns.load(Ordering::Acquire); \
                 self.due_ns.store(IDLE, Ordering::Release); was != TRIPPED }",
            ),
            (
                "life_without_release",
                "self.life.store(life as u8, Ordering::Release)",
                "self.life.store(life as u8, Ordering::Relaxed)",
            ),
            (
                "life_without_acquire",
                "self.life.load(Ordering::Acquire)",
                "self.life.load(Ordering::Relaxed)",
            ),
        ],
    },
];

fn main() {
    let sources = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("../crates/runtime/src");
    let out = env::var("OUT_DIR").unwrap();
    let mut all = String::new();
    for Module { name, mutants } in MODULES {
        let path = sources.join(format!("{name}.rs"));
        println!("cargo::rerun-if-changed={}", path.display());
        let text = on_loom(&fs::read_to_string(&path).unwrap());
        write_module(&out, &mut all, name, &text);
        for (mutant, from, to) in *mutants {
            assert_eq!(text.matches(from).count(), 1, "{name}: {mutant}: {from}");
            write_module(&out, &mut all, &format!("{name}_{mutant}"), &text.replace(from, to));
        }
    }
    fs::write(Path::new(&out).join("modules.rs"), all).unwrap();
}

/// The text without its own tests, with loom's atomics.
fn on_loom(text: &str) -> String {
    let text = text.split("\n#[cfg(test)]\n").next().unwrap();
    text.replace("std::sync::", "loom::sync::")
}

fn write_module(out: &str, all: &mut String, name: &str, text: &str) {
    let path = Path::new(out).join(format!("{name}.rs"));
    fs::write(&path, text).unwrap();
    writeln!(all, "#[path = {path:?}]\nmod {name};").unwrap();
}
