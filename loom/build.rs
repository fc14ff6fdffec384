//! Copies of the modules that threads share without locks, on loom's atomics; and of each copy its
//! mutants: the same text with one memory order weaker, or one step divided.
//!
//! The sources stay as they are: only the paths of atomics and `Arc` are exchanged in the copies.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs};

/// A module, its folder, and its mutants: a name, the text that is exchanged, and the text for it.
struct Module {
    folder: &'static str,
    name: &'static str,
    mutants: &'static [(&'static str, &'static str, &'static str)],
}

const RUNTIME: &str = "../crates/runtime/src";
const DAEMON: &str = "../src/daemon";

const MODULES: &[Module] = &[
    Module {
        folder: RUNTIME,
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
        folder: RUNTIME,
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
    Module {
        folder: RUNTIME,
        name: "gate",
        mutants: &[
            (
                "hear_without_release",
                "self.stuck.swap(false, Ordering::Release)",
                "self.stuck.swap(false, Ordering::Relaxed)",
            ),
            (
                "stuck_without_acquire",
                "self.stuck.load(Ordering::Acquire)",
                "self.stuck.load(Ordering::Relaxed)",
            ),
            (
                "mode_read_first",
                "!self.is_stuck() && self.running.load(Ordering::Relaxed)",
                "self.running.load(Ordering::Relaxed) && !self.is_stuck()",
            ),
            (
                "monitor_writes_the_mode",
                "self.stuck.store(true, Ordering::Relaxed);",
                "self.running.store(false, Ordering::Relaxed); \
                 self.stuck.store(true, Ordering::Relaxed);",
            ),
            (
                "reserve_in_two_steps",
                "self.waiting_writes.fetch_add(writes, Ordering::Relaxed);",
                "let before = self.waiting_writes.load(Ordering::Relaxed); \
                 self.waiting_writes.store(before + writes, Ordering::Relaxed);",
            ),
            (
                "release_in_two_steps",
                "self.waiting_writes.fetch_sub(writes, Ordering::Relaxed);",
                "let before = self.waiting_writes.load(Ordering::Relaxed); \
                 self.waiting_writes.store(before - writes, Ordering::Relaxed);",
            ),
            (
                "input_on_in_two_steps",
                "word.fetch_or(bit, Ordering::Relaxed);",
                "word.store(word.load(Ordering::Relaxed) | bit, Ordering::Relaxed);",
            ),
            (
                "input_off_in_two_steps",
                "word.fetch_and(!bit, Ordering::Relaxed);",
                "word.store(word.load(Ordering::Relaxed) & !bit, Ordering::Relaxed);",
            ),
        ],
    },
    Module {
        folder: DAEMON,
        name: "log_channel",
        mutants: &[
            (
                "counted_after_it_is_sent",
                "self.counts.waiting.fetch_add(1, Ordering::Relaxed);\n        \
                 let is_sent = !is_crowded && self.sender.try_send(LogItem::Line(line)).is_ok();",
                "let is_sent = !is_crowded && self.sender.try_send(LogItem::Line(line)).is_ok(); \
                 self.counts.waiting.fetch_add(1, Ordering::Relaxed);",
            ),
            (
                "sent_in_two_steps",
                "self.counts.waiting.fetch_add(1, Ordering::Relaxed);",
                "let before = self.counts.waiting.load(Ordering::Relaxed); \
                 self.counts.waiting.store(before + 1, Ordering::Relaxed);",
            ),
            (
                "dropped_in_two_steps",
                "self.counts.dropped.fetch_add(1, Ordering::Relaxed);",
                "let before = self.counts.dropped.load(Ordering::Relaxed); \
                 self.counts.dropped.store(before + 1, Ordering::Relaxed);",
            ),
            (
                "told_in_two_steps",
                "self.counts.dropped.swap(0, Ordering::Relaxed)",
                "{ let lines = self.counts.dropped.load(Ordering::Relaxed); \
                 self.counts.dropped.store(0, Ordering::Relaxed); lines }",
            ),
            (
                "told_again_in_two_steps",
                "self.counts.dropped.fetch_add(lines, Ordering::Relaxed);",
                "let before = self.counts.dropped.load(Ordering::Relaxed); \
                 self.counts.dropped.store(before + lines, Ordering::Relaxed);",
            ),
        ],
    },
];

fn main() {
    let here = env::var("CARGO_MANIFEST_DIR").unwrap();
    let out = env::var("OUT_DIR").unwrap();
    let mut all = String::new();
    for Module { folder, name, mutants } in MODULES {
        let path = Path::new(&here).join(folder).join(format!("{name}.rs"));
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

/// The text without its own tests, with loom's atomics, and with a channel on loom's lock.
fn on_loom(text: &str) -> String {
    let text = text.split("\n#[cfg(test)]\n").next().unwrap();
    text.replace("std::sync::mpsc::", "crate::mpsc::").replace("std::sync::", "loom::sync::")
}

fn write_module(out: &str, all: &mut String, name: &str, text: &str) {
    let path = Path::new(out).join(format!("{name}.rs"));
    fs::write(&path, text).unwrap();
    writeln!(all, "#[path = {path:?}]\nmod {name};").unwrap();
}
