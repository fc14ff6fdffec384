//! `rungd schema`, compared with every file that is shipped or shown on a page: the schema accepts
//! the files that `rungd check` accepts, and refuses unknown keys.
//!
//! Two validators do this: `tests/language/validator.rs`, which has only a few keywords, and, if it
//! is installed, Python's `jsonschema` (required if `RUNGD_REQUIRE` names `programs`).

use rungd_test_support::needs::{python_can, usable};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::language::validator::{json_of, wrong};
use rungd::cli::schema::{SchemaKind, of};
use rungd_config::load;
use rungd_fleet::edge::read_edge;
use rungd_fleet::opcua::read_opcua;
use rungd_lab::testing::read_suite;
use rungd_language::source::finding::Severity;
use serde_json::Value;

/// Folders with the files that a schema must accept, if `rungd check` finds no error in them.
const FOLDERS: [&str; 7] = [
    "config",
    "config/edge",
    "config/programs",
    "config/first",
    "config/first/programs",
    "tests/suites",
    "tests/ui",
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn kind(path: &Path) -> SchemaKind {
    if path.to_string_lossy().ends_with(".test.toml") {
        SchemaKind::Test
    } else if path.ends_with("edge.toml") {
        SchemaKind::Edge
    } else if path.ends_with("opcua.toml") {
        SchemaKind::Opcua
    } else if load::is_controller_file(path).expect("readable") {
        SchemaKind::Controller
    } else {
        SchemaKind::Ladder
    }
}

fn has_errors(path: &Path) -> bool {
    let findings = match kind(path) {
        SchemaKind::Controller => load::controller_file(path).expect("readable").findings,
        SchemaKind::Ladder => load::ladder_files(&[path.to_owned()]).expect("readable").findings,
        SchemaKind::Test => read_suite(path).expect("readable").findings,
        SchemaKind::Edge => read_edge(path, &fs::read(path).expect("readable")).findings,
        SchemaKind::Opcua => read_opcua(path, &fs::read(path).expect("readable")).findings,
    };
    findings.iter().any(|finding| finding.severity() == Severity::Error)
}

/// All files that the schemas must accept. They are collected only once, because the tests of this
/// file run at the same time.
fn good() -> &'static [PathBuf] {
    static GOOD: OnceLock<Vec<PathBuf>> = OnceLock::new();
    GOOD.get_or_init(find_good)
}

fn find_good() -> Vec<PathBuf> {
    let mut files = vec![root().join("tests/bottling.toml")];
    for folder in FOLDERS {
        for entry in fs::read_dir(root().join(folder)).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|e| e == "toml") && !has_errors(&path) {
                files.push(path);
            }
        }
    }
    files.extend(shown());
    files.sort();
    files
}

/// Writes the complete files that the pages show to disk; returns their paths.
fn shown() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("schema-shown");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    let mut files = Vec::new();
    let pages = ["language", "modbus", "running", "simulated-device"];
    for name in pages {
        let page = fs::read_to_string(root().join(format!("docs/{name}.md"))).expect("a page");
        for (at, block) in page.split("```toml\n").skip(1).enumerate() {
            let text = block.split("```").next().unwrap_or(block);
            let whole = ["\n[[program]]", "\nladder = ["].iter().any(|part| text.contains(part))
                || text.starts_with("ladder = [");
            if whole {
                let path = folder.join(format!("{name}-{at}.toml"));
                fs::write(&path, text).expect("a file");
                files.push(path);
            }
        }
    }
    assert!(files.len() >= 5, "{files:?}");
    files
}

fn read(path: &Path) -> Value {
    json_of(&fs::read_to_string(path).expect("a text"))
}

fn findings(kind: SchemaKind, value: &Value) -> Vec<String> {
    static LADDER: OnceLock<Value> = OnceLock::new();
    static CONTROLLER: OnceLock<Value> = OnceLock::new();
    static TEST: OnceLock<Value> = OnceLock::new();
    static EDGE: OnceLock<Value> = OnceLock::new();
    static OPCUA: OnceLock<Value> = OnceLock::new();
    let made = match kind {
        SchemaKind::Ladder => &LADDER,
        SchemaKind::Controller => &CONTROLLER,
        SchemaKind::Test => &TEST,
        SchemaKind::Edge => &EDGE,
        SchemaKind::Opcua => &OPCUA,
    };
    let schema = made.get_or_init(|| of(kind));
    wrong(schema, schema, value, "")
}

/// The paths to all tables of a file.
fn tables(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            found.push(path.to_owned());
            object.iter().for_each(|(key, value)| tables(value, &format!("{path}/{key}"), found));
        }
        Value::Array(items) => items
            .iter()
            .enumerate()
            .for_each(|(at, item)| tables(item, &format!("{path}/{at}"), found)),
        _ => {}
    }
}

#[test]
fn every_valid_example_matches_its_schema() {
    let files = good();
    assert!(files.len() >= 25, "{}", files.len());
    for path in files {
        let found = findings(kind(path), &read(path));
        assert!(found.is_empty(), "{}: {found:?}", path.display());
    }
}

/// Tries every table of each file of `config/`.
#[test]
fn an_unknown_key_is_refused_in_every_table() {
    let mut tried = 0;
    for path in good().iter().filter(|path| path.starts_with(root().join("config"))) {
        let (value, kind) = (read(path), kind(path));
        let mut places = Vec::new();
        tables(&value, "", &mut places);
        // The keys of `texts` are limited by a pattern, which only the other validator checks. Those
        // of a record's `initial` are its fields, and those of `with` parameters: the schema knows
        // neither.
        let is_open = ["/texts", "/with"];
        let is_closed = |place: &&String| {
            !is_open.iter().any(|end| place.ends_with(end)) && !place.contains("/initial")
        };
        for place in places.iter().filter(is_closed) {
            let mut wrong = value.clone();
            let table = wrong.pointer_mut(place).and_then(Value::as_object_mut).expect("a table");
            table.insert("preset".to_owned(), Value::from("2s"));
            let found = findings(kind, &wrong);
            assert!(!found.is_empty(), "{}: `preset` in {place}", path.display());
            tried += 1;
        }
    }
    assert!(tried > 300, "{tried}");
}

#[test]
fn the_schemas_refuse_ladder_syntax_that_the_reader_refuses() {
    let ladder = |text: &str| findings(SchemaKind::Ladder, &json_of(text)).is_empty();
    let rung = |rung: &str| ladder(&format!("[[program]]\nname = \"Main\"\nrung = [ {rung} ]"));
    assert!(rung(r#"{ when = ["X0"], do = ["OUT Y0"] }"#));
    assert!(!rung(r#"{ when = "X0", do = ["OUT Y0"] }"#), "a bare string");
    assert!(!rung(r#"{ do = ["OUT Y0"] }"#), "no contacts");
    assert!(!rung(r#"{ when = ["X0"] }"#), "no instruction");
    assert!(!rung(r#"{ when = ["X0"], leg.up = ["X0"], do = ["OUT Y0"] }"#), "both");
    assert!(!rung(r#"{ leg.down = ["X0"], do = ["OUT Y0"] }"#), "a leg");
    assert!(!ladder("[[task]]\nname = \"A\"\n[[task.stage]]\nname = \"B\""), "a stage in a task");
    assert!(!ladder("[[program]]\n"), "no name");
    assert!(!ladder("[tags]\na = { doc = \"neither\" }"), "a tag of nothing");
    assert!(!ladder("[tags]\na = { at = \"X0\", log = \"always\" }"), "log");
    let controller = |text: &str| findings(SchemaKind::Controller, &json_of(text)).is_empty();
    assert!(controller("ladder = [\"a.toml\"]"));
    assert!(!controller("ladder = []"), "no ladder");
    assert!(!controller("[scan]\nperiod = \"10ms\""), "no ladder key");
    assert!(!controller("ladder = [\"a.toml\"]\n[scan]\nperiod = 10"), "a number");
    assert!(!controller("ladder = [\"a.toml\"]\n[memory]\nX = 0"), "beyond its range");
}

#[test]
fn the_schema_refuses_test_file_syntax_that_the_reader_refuses() {
    let test = |text: &str| findings(SchemaKind::Test, &json_of(text)).is_empty();
    let scenario = |keys: &str| test(&format!("ladder = [\"a.toml\"]\n[[scenario]]\n{keys}"));
    let change = |of: &str| {
        test(&format!(
            "controller = \"a.toml\"\n[[random]]\nname = \"a\"\nruns = 1\nscans = 1\n\
             change = {{ X0 = {of} }}"
        ))
    };
    assert!(scenario("name = \"a\"\nsteps = [\"run 1s\"]\nset = { X0 = true, D0 = 3, R0 = 1.5 }"));
    assert!(!scenario("name = \"a\"\nsteps = \"run 1s\""), "a bare string");
    assert!(!scenario("steps = [\"run 1s\"]"), "no name");
    assert!(!scenario("name = \"a\""), "no steps");
    assert!(!scenario("name = \"a\"\nsteps = []\nset = { X0 = [1] }"), "a list");
    assert!(!test("[[scenario]]\nname = \"a\"\nsteps = [\"run 1s\"]"), "no ladder");
    assert!(!test("ladder = [\"a.toml\"]\ncontroller = \"a.toml\""), "both");
    assert!(!test("controller = \"a.toml\"\nperiod = \"10ms\""), "a period beside a controller");
    assert!(!test("ladder = [\"a.toml\"]\n[retain]\ntags = [\"a\"]\nfile = \"b\""), "a file");
    assert!(test("ladder = [\"a.toml\"]\n[prove]\nassume = [\"!(a & b)\"]\nstep = \"1..3\""));
    assert!(!test("ladder = [\"a.toml\"]\n[prove]\ninput = [\"a\"]"), "an unknown key");
    assert!(change("\"1%\""));
    assert!(change("{ walk = \"0..9\", step = 0.5, chance = \"1%\" }"));
    assert!(change("{ jump = \"0..9\", chance = \"1%\" }"));
    assert!(!change("5"), "a number");
    assert!(!change("{ walk = \"0..9\", chance = \"1%\" }"), "no step");
    assert!(!change("{ jump = \"0..9\", step = 1, chance = \"1%\" }"), "a step");
    assert!(!change("{ jump = \"0..9\", walk = \"0..9\", step = 1, chance = \"1%\" }"), "both");
    assert!(!change("{ jump = \"0..9\" }"), "no chance");
}

#[test]
fn the_schema_accepts_a_real_wherever_a_constant_is_permitted() {
    let ladder = |text: &str| findings(SchemaKind::Ladder, &json_of(text)).is_empty();
    for tag in ["value = 2.5", "at = \"R0\", initial = -0.5, min = -1e3, max = 20"] {
        assert!(ladder(&format!("[tags]\na = {{ {tag} }}")), "{tag}");
    }
    assert!(ladder("[tags]\na = { at = \"R0\", count = 2, initial = [2.5, 1] }"), "an array");
    assert!(!ladder("[tags]\na = { at = \"R0\", count = 0 }"), "an array without elements");
    assert!(!ladder("[tags]\na = { at = \"R0\", min = [2.5] }"), "a list of limits");
    let device = |driver: &str, row: &str| {
        let text = format!(
            "ladder = [\"a.toml\"]\n[memory]\nR = 64\n[[device]]\nname = \"d\"\n\
             driver = \"{driver}\"\nmap = [{{ {row} }}]"
        );
        findings(SchemaKind::Controller, &json_of(&text)).is_empty()
    };
    let row = "from = \"R0\", to = \"holding 0..1\", type = \"f32\", divide = 10, safe = 2.5";
    assert!(device("modbus-tcp", row));
    assert!(device("simulated", "from = \"tank.level\", to = \"R0\", multiply = 3, offset = -5"));
    assert!(!device("modbus-tcp", &row.replace("= 10", "= 2.5")), "a factor is a whole number");
}

#[test]
fn an_independent_validator_gives_the_same_results() {
    let script = root().join("tests/schema/check.py");
    let line = "import jsonschema, tomllib; jsonschema.Draft202012Validator";
    if !usable(python_can(Path::new("python3"), "Python with jsonschema and tomllib", line)) {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("schema-python");
    fs::create_dir_all(&folder).expect("a folder");
    let kinds = [
        (SchemaKind::Ladder, "ladder"),
        (SchemaKind::Controller, "controller"),
        (SchemaKind::Test, "test"),
        (SchemaKind::Edge, "edge"),
        (SchemaKind::Opcua, "opcua"),
    ];
    for (wanted, name) in kinds {
        let schema = folder.join(format!("{name}.json"));
        let printed = Command::new(env!("CARGO_BIN_EXE_rungd")).args(["schema", name]).output();
        fs::write(&schema, printed.expect("rungd runs").stdout).expect("a file");
        let bad = folder.join(format!("{name}-bad.toml"));
        let text = match wanted {
            SchemaKind::Ladder => "[tags]\na = { at = \"X0\", adress = \"X1\" }\n",
            SchemaKind::Controller => "ladder = [\"a.toml\"]\n[scan]\nperiode = \"10ms\"\n",
            SchemaKind::Test => "ladder = [\"a.toml\"]\nperiode = \"10ms\"\n",
            SchemaKind::Edge => "[node]\ngroup = \"g\"\nname = \"n\"\n[broker]\naddresses = []\n",
            SchemaKind::Opcua => "[server]\nname = \"press 3\"\n",
        };
        fs::write(&bad, text).expect("a file");
        let good = good().iter().filter(|path| kind(path) == wanted).cloned().collect();
        for (verdict, files) in [("good", good), ("bad", vec![bad])] {
            let mut python = Command::new("python3");
            python.arg(&script).arg(&schema).arg(verdict).args(files);
            let output = python.output().expect("python3 runs");
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            let errors = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{said}{errors}");
        }
    }
}
