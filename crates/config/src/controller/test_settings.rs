//! The settings of a test's ladders: `ladder`, `period` and `[retain]` of a test file, and the
//! defaults of a controller file for everything else.
//!
//! Called by `testing` while it reads a test file, so that a test of ladder files and a test of a
//! controller file are loaded and resolved in the same way.

use super::retain;
use super::written::{self, WrittenController};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::FileId;

/// Reads the settings of a test file. `ladder` has its ladder files.
pub fn read(root: &mut Table<'_>, ladder: Vec<Text>, file: FileId) -> WrittenController {
    let mut bench = written::defaults(file);
    written::read_period(root, &mut bench.scan);
    bench.scan.in_virtual_time = true;
    bench.retain = retain::read_in_test(root);
    let texts = bench.retain.ranges.iter().chain(&bench.retain.tags);
    bench.strings = texts.map(|text| text.text.clone()).collect();
    bench.ladder = ladder;
    bench.lost = root.doc().lost();
    bench
}

impl WrittenController {
    /// These settings with different ladder files.
    pub fn with_ladder(self, names: &[String]) -> WrittenController {
        let span = self.scan.period.span;
        let name = |name: &String| Text { text: name.clone(), span, exact: true };
        WrittenController { ladder: names.iter().map(name).collect(), ..self }
    }

    /// The settings of this test file with different ladder files.
    pub fn of_test_with_ladder(&self, names: &[String]) -> WrittenController {
        let WrittenController { scan, retain, strings, .. } = self;
        let (scan, retain, strings) = (scan.clone(), retain.clone(), strings.clone());
        let defaults = written::defaults(scan.period.span.file);
        WrittenController { scan, retain, strings, ..defaults }.with_ladder(names)
    }
}
