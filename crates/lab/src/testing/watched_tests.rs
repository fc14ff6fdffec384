//! Lines of `[[watch]]`, on the memory of an engine scan by scan.

use super::watched::WatchedLines;
use rungd_base::calendar::LocalTime;
use rungd_config::load::{Loaded, recorded_files};
use rungd_engine::{Cell, Engine, EngineCall, ScanTimes};
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::source::span::SourceFile;

const LADDER: &str = r#"
[tags]
a = { at = "X0" }
b = { at = "X1" }
level = { type = "int" }
up = { at = "Y0" }
[[program]]
name = "Main"
rung = [{ when = ["a"], do = ["OUT up"] }]
"#;

fn load(watches: &str) -> Loaded {
    let controller = format!("ladder = [\"a.toml\"]\n{watches}");
    let file = |name: &str, text: &str| SourceFile { name: name.into(), text: text.into() };
    recorded_files(&[file("rungd.toml", &controller), file("a.toml", LADDER)])
}

fn watch(name: &str, always: &str) -> String {
    format!("[[watch]]\nname = \"{name}\"\nalways = \"{always}\"\n")
}

fn messages(watches: &str) -> Vec<String> {
    load(watches).findings.into_iter().map(|finding| finding.message).collect()
}

/// A running ladder with its lines.
struct Watched {
    engine: Engine,
    program: Program,
    lines: WatchedLines,
    scans: u64,
}

impl Watched {
    fn new(line: &str) -> Watched {
        let loaded = load(&watch("line", line));
        let program = loaded.program.expect("no errors");
        let (code, symbols) = lower(&program);
        let lines = WatchedLines::new(&loaded.controller.expect("no errors").watches, &symbols);
        // The daemon executes only what the lines read.
        let slice = code.slice(lines.cells());
        let mut engine = Engine::new(slice.program);
        engine.start(0);
        let mut watched = Watched { engine, program, lines, scans: 0 };
        watched.lines.begins_run(watched.engine.image());
        watched
    }

    /// A scan with these values of `a`, `b` and `level`; the new state of the line, if it changes.
    fn scan(&mut self, a: i32, b: i32, level: i32) -> Option<bool> {
        self.engine.begin_scan(
            self.scans * 10_000_000,
            &ScanTimes::default(),
            &LocalTime::default(),
        );
        self.scans += 1;
        for (name, value) in [("a", a), ("b", b), ("level", level)] {
            let cell = self.cell(name);
            self.engine.apply(EngineCall::Write(cell, value));
        }
        self.engine.execute();
        let held = self.lines.holding().next();
        self.lines.scanned(self.engine.image());
        self.lines.holding().next().filter(|holds| Some(*holds) != held)
    }

    fn cell(&self, name: &str) -> Cell {
        let address = self.program.scope().address(name).expect("a tag");
        self.engine.program().layout.cell(address).expect("a cell")
    }

    fn deciding(&self) -> Vec<String> {
        let all = self.lines.deciding(0, self.engine.image()).into_iter();
        all.map(|one| format!("{} {}", one.name, one.value)).collect()
    }
}

#[test]
fn a_line_is_judged_at_the_end_of_each_scan() {
    let mut watched = Watched::new("!(up & b)");
    assert_eq!(watched.scan(1, 0, 0), None);
    assert_eq!(watched.scan(1, 1, 0), Some(false));
    assert_eq!(watched.deciding(), ["up ON", "b ON"]);
    assert_eq!(watched.scan(1, 1, 0), None);
    assert_eq!(watched.scan(0, 1, 0), Some(true));
}

#[test]
fn edges_are_those_since_the_scan_before() {
    let mut watched = Watched::new("!rise(b)");
    assert_eq!(watched.scan(0, 1, 0), Some(false), "OFF before the first scan");
    assert_eq!(watched.scan(0, 1, 0), Some(true));
    watched.lines.joins(watched.engine.image());
    assert_eq!(watched.scan(0, 1, 0), None, "after a gap the memory there is the scan before");
}

#[test]
fn was_is_the_value_at_the_end_of_the_scan_before() {
    let mut watched = Watched::new("level >= was(level)");
    assert_eq!(watched.scan(0, 0, 5), None);
    assert_eq!(watched.scan(0, 0, 5), None);
    assert_eq!(watched.scan(0, 0, 4), Some(false));
    assert_eq!(watched.deciding(), ["level 4", "was(level) 5"]);
    assert_eq!(watched.scan(0, 0, 4), Some(true));
}

#[test]
fn a_mistake_in_a_line_is_found_where_it_is() {
    assert_eq!(messages(&watch("line", "!(up & b & level > 0)")), Vec::<String>::new());
    for (watches, message) in [
        (watch("line", "!(up & c)"), "nothing is called `c`"),
        (watch("line", "was(up"), "`was` takes one place"),
        (watch("up", "!b"), "`up` is a name of the ladder"),
        (watch("line", "!b") + &watch("line", "!a"), "a second watch `line`"),
        (watch(" ", "!b"), "a watch has a name, which its alarm shows"),
        (watch("line", "!b") + "priority = \"urgent\"", "`urgent` is no value of `priority`"),
        (watch("line", "!b") + "group = \" \"", "the `group` of `line` is no name"),
        (watch("line", "!b") + "ack = \"$On\"", "no acknowledgement can turn `$On` ON"),
        (watch("line", "!b") + "ack = \"quit\"", "nothing is called `quit`"),
        (watch("line", "!b") + "delay = \"soon\"", "duration"),
        ("[[watch]]\nalways = \"!b\"\n".to_owned(), "a line that is watched has no `name`"),
    ] {
        let found = messages(&watches);
        assert!(found.iter().any(|found| found.contains(message)), "{watches}: {found:?}");
    }
}
