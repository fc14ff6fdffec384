//! Large files: each becomes a project, or is refused with a reason, in bounded memory.
//!
//! `RUNGD_IMPORT_MB=200 cargo test --release -p rungd-import large -- --nocapture --test-threads 1`
//! prints what 200 MB take.

use std::time::Instant;

use rungd_import::model::ForeignProject;
use rungd_import::write::files;
use rungd_import::{l5x, plcopen};
use rungd_test_support::setting::setting;

/// A reader of a form.
type Reader = fn(&str) -> Result<ForeignProject, String>;

/// A file of the wanted size, whose middle is made of parts.
struct LargeFile {
    what: &'static str,
    head: String,
    part: fn(usize) -> String,
    tail: &'static str,
    reader: Reader,
}

impl LargeFile {
    /// Reads it, says what it took, and gives what became of it.
    fn read(&self, bytes: usize) -> Result<ForeignProject, String> {
        let mut text = self.head.clone();
        let mut number = 0;
        while text.len() < bytes {
            text += &(self.part)(number);
            number += 1;
        }
        text += self.tail;
        let begin = Instant::now();
        let result = (self.reader)(&text);
        let became = match &result {
            Ok(project) => {
                let written: usize = files(project).iter().map(|file| file.text.len()).sum();
                format!("{} rungs, {written} bytes written", project.outcome.rungs.len())
            }
            Err(why) => why.chars().take(100).collect(),
        };
        let (size, took) = (text.len() / 1_000_000, begin.elapsed().as_secs_f64());
        println!("{}: {size} MB, {took:.1} s, {}: {became}", self.what, peak());
        result
    }
}

/// The most memory that the process has had.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or_else(String::new, |line| format!("peak {}", line.trim()))
}

/// The size of large files, in bytes.
fn size() -> usize {
    setting("RUNGD_IMPORT_MB", 1) as usize * 1_000_000
}

const LOGIX: &str = "<RSLogix5000Content TargetName=\"T\" TargetType=\"Controller\"><Controller \
                     Use=\"Target\" Name=\"T\"><Tags><Tag Name=\"a\" DataType=\"BOOL\"/><Tag \
                     Name=\"b\" DataType=\"BOOL\"/>";
const LOGIX_LOGIC: &str = "</Tags><Programs><Program Name=\"P\" MainRoutineName=\"R\"><Routines>\
                           <Routine Name=\"R\" Type=\"RLL\"><RLLContent>";
const LOGIX_END: &str =
    "</RLLContent></Routine></Routines></Program></Programs></Controller></RSLogix5000Content>";
const PLCOPEN: &str = "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><pous><pou \
                       name=\"m\" pouType=\"program\"><interface><localVars><variable name=\"a\">\
                       <type><BOOL/></type></variable></localVars></interface><body><LD>\
                       <leftPowerRail localId=\"0\"/>";

#[test]
fn many_rungs_become_a_project_or_are_refused() {
    let logix = LargeFile {
        what: "L5X, short rungs",
        head: format!("{LOGIX}{LOGIX_LOGIC}"),
        part: |_| "<Rung Type=\"N\"><Text>XIC(a)OTL(b);</Text></Rung>".to_owned(),
        tail: LOGIX_END,
        reader: l5x::read,
    };
    let long = LargeFile {
        what: "L5X, long rungs",
        head: logix.head.clone(),
        part: |_| format!("<Rung><Text>{}OTL(b);</Text></Rung>", "XIC(a)".repeat(30_000)),
        tail: LOGIX_END,
        reader: l5x::read,
    };
    let plcopen = LargeFile {
        what: "PLCopen, short networks",
        head: PLCOPEN.to_owned(),
        part: |at| {
            format!(
                "<coil localId=\"{}\" storage=\"set\"><position x=\"9\" y=\"{}\"/>\
                 <connectionPointIn><connection refLocalId=\"0\"/></connectionPointIn>\
                 <variable>a</variable></coil>",
                at + 1,
                at * 10
            )
        },
        tail: "</LD></body></pou></pous></types></project>",
        reader: plcopen::read,
    };
    for file in [&logix, &long, &plcopen] {
        match file.read(size()) {
            Ok(project) => assert!(!project.outcome.rungs.is_empty()),
            Err(why) => assert!(why.contains("at most"), "{why}"),
        }
    }
}

#[test]
fn many_tags_and_deep_elements_end() {
    let tags = LargeFile {
        what: "L5X, tags",
        head: LOGIX.to_owned(),
        part: |at| format!("<Tag Name=\"tag\" DataType=\"DINT\" Dimensions=\"{at}\"/>"),
        tail: "</Tags></Controller></RSLogix5000Content>",
        reader: l5x::read,
    };
    match tags.read(size()) {
        Ok(project) => assert!(project.outcome.rungs.is_empty()),
        Err(why) => assert!(why.contains("at most"), "{why}"),
    }
    for reader in [l5x::read as Reader, plcopen::read as Reader] {
        let part = |_: usize| "<deep>".to_owned();
        let deep = LargeFile { what: "deep elements", head: String::new(), part, tail: "", reader };
        assert!(deep.read(size()).is_err());
    }
}

#[test]
fn more_rungs_than_any_program_has_are_refused_with_a_remedy() {
    let rungs = "<Rung/>".repeat(100_001);
    let why = l5x::read(&format!("{LOGIX}{LOGIX_LOGIC}{rungs}{LOGIX_END}")).unwrap_err();
    assert_eq!(
        why,
        "100003 elements (Rung, Tag, LocalTag, Member); at most 100000 are read: export the programs \
         one by one"
    );
    let calls = "(".repeat(2_000_001);
    let why = plcopen::read(&calls).unwrap_err();
    assert_eq!(why, "2000001 opening parentheses; a program has at most 2000000");
}
