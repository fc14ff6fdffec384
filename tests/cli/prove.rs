//! `rungd prove` as a user runs it: answers, exit codes, JSON, kept answers, two ladders, and
//! certificates that another solver judges.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use rungd_test_support::folder::TestFolder;
use rungd_test_support::needs::not_installed;
use serde_json::Value;

/// Two directions that exclude each other, a timer, and a real that is computed.
const LADDER: &str = r#"[tags]
go_up   = { at = "X0" }
go_down = { at = "X1" }
stop    = { at = "X2" }
up      = { at = "Y0" }
down    = { at = "Y1" }
late    = { at = "Y2" }
level   = { type = "real" }
high    = { at = "Y3" }

[[program]]
name = "Main"
rung = [
  { when = ["go_up | up", "!stop", "!down"], do = ["OUT up"] },
  { when = ["go_down | down", "!stop", "!up"], do = ["OUT down"] },
  { when = ["up"], do = ["ONDTMR T0 preset=1s output=late"] },
  { when = ["up"], do = ["MATH level = level + 0.001"] },
  { when = ["level > 1000000.0"], do = ["OUT high"] },
]
"#;

const PROVED: &str = "ladder = [\"ladder.toml\"]\nalways = [\"!(up & down)\"]\n";

struct Files(TestFolder);

impl Files {
    fn new(name: &str, files: &[(&str, &str)]) -> Files {
        let folder = TestFolder::new(&format!("prove-{name}"));
        for (name, text) in [("ladder.toml", LADDER)].iter().chain(files) {
            fs::write(folder.path().join(name), text).expect("a file");
        }
        Files(folder)
    }

    /// Runs `rungd prove`.
    fn run(&self, args: &[&str]) -> Output {
        self.rungd(&[&["prove"], args].concat())
    }

    /// Runs `rungd`, with its sockets beside the files.
    fn rungd(&self, args: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        let command = command.args(args).current_dir(self.path());
        command.env("XDG_RUNTIME_DIR", self.path()).output().expect("rungd runs")
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("text")
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

fn lines(output: &Output) -> Vec<Value> {
    let lines = text(output);
    lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn each_line_has_one_answer_and_the_worst_is_the_exit_code() {
    let always = |lines: &str| format!("ladder = [\"ladder.toml\"]\nalways = [{lines}]\n");
    let files = Files::new(
        "codes",
        &[
            ("good.test.toml", PROVED),
            ("bad.test.toml", &always("\"!(up & down)\", \"!late\", \"!high\"")),
            ("open.test.toml", &always("\"!high | up\"")),
            ("wrong.test.toml", &always("\"!nothing\"")),
        ],
    );
    let good = files.run(&["good.test.toml"]);
    assert_eq!(code(&good), Some(0));
    assert!(text(&good).starts_with("proved: !(up & down)\n  by exploring"), "{}", text(&good));
    let bad = files.run(&["bad.test.toml", "--json", "--time", "2s"]);
    assert_eq!(code(&bad), Some(1));
    let answers: Vec<(String, Value)> = lines(&bad)
        .iter()
        .map(|line| (line["answer"].as_str().expect("a word").to_owned(), line["scan"].clone()))
        .collect();
    assert_eq!(answers[0], ("proved".to_owned(), Value::Null));
    assert_eq!(answers[1], ("violated".to_owned(), Value::from(101)));
    let open = files.run(&["open.test.toml", "--time", "1s"]);
    assert_eq!(code(&open), Some(2), "{}", text(&open));
    let told = "not decided: !high | up\n  stood in the way: ";
    assert!(text(&open).starts_with(told), "{}", text(&open));
    assert_eq!(code(&files.run(&["wrong.test.toml"])), Some(78));
}

#[test]
fn a_violation_fails_in_a_test_and_a_witness_passes() {
    let files = Files::new("paste", &[("good.test.toml", PROVED)]);
    let bad = "ladder = [\"ladder.toml\"]\nalways = [\"!late\"]\n";
    fs::write(files.path().join("bad.test.toml"), bad).expect("a file");
    let test = |name: &str, text: String| {
        fs::write(files.path().join(name), text).expect("a file");
        files.rungd(&["test", name])
    };
    let violated = &lines(&files.run(&["bad.test.toml", "--json"]))[0];
    let scenario = violated["scenario"].as_str().expect("a scenario");
    let failed = test("pasted.test.toml", format!("{bad}\n{scenario}"));
    assert_eq!(code(&failed), Some(1));
    assert!(text(&failed).contains("at scan 101 ("), "{}", text(&failed));
    let proved = &lines(&files.run(&["good.test.toml", "--json"]))[0];
    for witness in proved["witnesses"].as_array().expect("witnesses") {
        let scenario = witness["scenario"].as_str().expect("a scenario");
        assert_eq!(code(&test("pasted.test.toml", format!("{PROVED}\n{scenario}"))), Some(0));
    }
}

#[test]
fn what_has_not_changed_is_not_proved_again() {
    let files = Files::new("kept", &[("good.test.toml", PROVED)]);
    let kept = |args: &[&str]| lines(&files.run(args))[0]["kept"].clone();
    assert_eq!(kept(&["good.test.toml", "--json"]), Value::from(false));
    assert_eq!(kept(&["good.test.toml", "--json"]), Value::from(true));
    assert_eq!(kept(&["good.test.toml", "--json", "--again"]), Value::from(false));
    // A rung on which the line does not depend.
    let with = |from: &str, to: &str| {
        fs::write(files.path().join("ladder.toml"), LADDER.replace(from, to)).expect("a file");
    };
    with("preset=1s", "preset=2s");
    assert_eq!(kept(&["good.test.toml", "--json"]), Value::from(true));
    with("\"!stop\", \"!down\"", "\"!down\"");
    assert_eq!(kept(&["good.test.toml", "--json"]), Value::from(false));
    fs::write(files.path().join("good.proof.toml"), "nonsense = [").expect("a file");
    assert_eq!(kept(&["good.test.toml", "--json"]), Value::from(false));
}

#[test]
fn an_assumption_that_nothing_fulfils_and_a_side_that_can_never_be_are_told() {
    let vacuous = "ladder = [\"ladder.toml\"]\nalways = [\"!(up & X9)\"]\n\
                   [prove]\nassume = [\"!go_up\", \"!go_down\"]\n";
    let files = Files::new("vacuous", &[("vacuous.test.toml", vacuous)]);
    let told = &lines(&files.run(&["vacuous.test.toml", "--json"]))[0];
    assert_eq!(told["answer"], "proved");
    assert_eq!(told["vacuous"], "`up` can never be ON");
    let none = "ladder = [\"ladder.toml\"]\nalways = [\"!(up & down)\"]\n\
                [prove]\nassume = [\"go_up\", \"!go_up\"]\n";
    fs::write(files.path().join("none.test.toml"), none).expect("a file");
    let output = files.run(&["none.test.toml"]);
    assert_eq!(code(&output), Some(78), "{}", text(&output));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("no input satisfies"), "{said}");
}

#[test]
fn the_inputs_of_a_proof_are_those_that_it_names_also_with_an_observer() {
    let suite = "ladder = [\"ladder.toml\"]\nalways = [\"!up\", \"!long.Done\", \"!down\"]\n\
                 [observer.tags]\nseen = { type = \"bit\" }\nlong = { type = \"timer\" }\n\
                 [[observer.rung]]\nwhen = [\"up\"]\ndo = [\"SET seen\", \"TMR long preset=20ms\"]\n\
                 [prove]\ninputs = [\"go_up\", \"stop\"]\n";
    let files = Files::new("observer", &[("observer.test.toml", suite)]);
    let answers = lines(&files.run(&["observer.test.toml", "--json"]));
    let told = |at: usize| [answers[at]["answer"].clone(), answers[at]["scan"].clone()];
    assert_eq!(told(0), [Value::from("violated"), Value::from(1)]);
    assert_eq!(told(1), [Value::from("violated"), Value::from(3)]);
    assert_eq!(told(2)[0], "proved");
}

/// A ladder with a condition that turns a lamp ON, and the controller file of its drive.
fn lamp_ladder(contact: &str) -> String {
    format!(
        "[tags]\nlamp = {{ at = \"Y0\" }}\nstatus = {{ at = \"V0\" }}\nready = {{ at = \"C0\" }}\n\
         [[program]]\nname = \"Main\"\nrung = [{{ when = [\"{contact}\"], do = [\"OUT lamp\"] }}]\n"
    )
}

fn lamp_controller(ladder: &str) -> String {
    format!(
        "ladder = [\"{ladder}\"]\n[[device]]\nname = \"drive\"\ndriver = \"modbus-tcp\"\n\
         address = \"127.0.0.1:502\"\nmap = [{{ from = \"holding 0\", to = \"status\" }}, \
         {{ from = \"coil 0\", to = \"ready\" }}]\n"
    )
}

#[test]
fn what_devices_bring_and_the_time_of_day_may_change_in_a_comparison() {
    let cases = [
        ("status > 5", "status > 6", Some(1)),
        ("status.3", "status.4", Some(1)),
        ("ready", "$Off", Some(1)),
        ("drive.Ok & ready", "ready", Some(0)),
        ("status > 5", "status >= 6", Some(0)),
        ("$Hour > 5", "$Hour > 6", Some(1)),
        ("$MaxScanTime > 5", "$Off", Some(1)),
        ("$Hour > 5", "$Hour >= 6", Some(0)),
    ];
    for (old, new, expected) in cases {
        let (old_ladder, new_ladder) = (lamp_ladder(old), lamp_ladder(new));
        let [old_file, new_file] = ["old.toml", "new.toml"].map(lamp_controller);
        let files = Files::new(
            "equal-inputs",
            &[
                ("old.toml", &old_ladder),
                ("new.toml", &new_ladder),
                ("old-plc.toml", &old_file),
                ("new-plc.toml", &new_file),
            ],
        );
        let output = files.run(&["--equal", "old-plc.toml", "new-plc.toml"]);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(code(&output), expected, "{old}, {new}: {} {error}", text(&output));
    }
}

#[test]
fn two_ladders_are_equal_or_a_scenario_tells_them_apart() {
    let same = LADDER.replace(
        "{ when = [\"up\"], do = [\"ONDTMR T0 preset=1s output=late\"] }",
        "{ when = [\"up\"], do = [\"ONDTMR T9 preset=1s output=late\"] }",
    );
    let moved = LADDER.replace("\"X0\"", "\"X7\"").replace("\"Y0\"", "\"Y9\"");
    let other = LADDER.replace("preset=1s", "preset=900ms");
    let files = Files::new(
        "equal",
        &[("same.toml", &same), ("moved.toml", &moved), ("other.toml", &other)],
    );
    for new in ["same.toml", "moved.toml"] {
        let equal = files.run(&["--equal", "ladder.toml", new, "--except", "high"]);
        assert_eq!(code(&equal), Some(0), "{}", text(&equal));
    }
    let args = ["--equal", "ladder.toml", "other.toml", "--except", "high", "--json"];
    let output = files.run(&args);
    assert_eq!(code(&output), Some(1), "{}", text(&output));
    let different = &lines(&output)[0];
    assert_eq!(different["scan"], 91, "{different}");
    let expected = serde_json::json!([{ "name": "late", "old": "OFF", "new": "ON" }]);
    assert_eq!(different["outputs"], expected);
    let missing = LADDER.replace("late ", "late2").replace("output=late", "output=late2");
    fs::write(files.path().join("missing.toml"), missing).expect("a file");
    let refused = files.run(&["--equal", "ladder.toml", "missing.toml"]);
    assert_eq!(code(&refused), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--map late=NAME"));
    let mapped =
        ["--equal", "ladder.toml", "missing.toml", "--map", "late=late2", "--except", "high"];
    assert_eq!(code(&files.run(&mapped)), Some(0));
}

#[test]
fn another_solver_finds_that_the_formulas_of_a_certificate_have_no_solution() {
    let installed = Command::new("minisat").arg("--help").output();
    if installed.is_err() {
        return not_installed("minisat");
    }
    // Neither of the two follows from the scan alone.
    let latches = r#"
[[program]]
name = "Main"
rung = [
  { when = ["X0", "!C1"], do = ["SET C0"] },
  { when = ["X1", "!C0"], do = ["SET C1"] },
]
"#;
    let suite = "ladder = [\"latches.toml\"]\nalways = [\"!(C0 & C1)\"]\n";
    let files = Files::new("certificate", &[("latches.toml", latches), ("good.test.toml", suite)]);
    let output = files.run(&["good.test.toml", "--certificate", "out"]);
    assert_eq!(code(&output), Some(0), "{}", text(&output));
    let folder = files.path().join("out/good");
    for formula in ["start-1.cnf", "kept-1.cnf", "implies-1.cnf"] {
        let judged = Command::new("minisat").arg(folder.join(formula)).output().expect("minisat");
        assert_eq!(judged.status.code(), Some(20), "{formula} has a solution");
    }
    let question = fs::read_to_string(folder.join("question.aag")).expect("AIGER");
    assert!(question.starts_with("aag ") && question.contains("b0 !(C0 & C1)\n"), "{question}");
    assert!(fs::read(folder.join("question.aig")).expect("AIGER").starts_with(b"aig "));
    let invariant = fs::read_to_string(folder.join("invariant-1.txt")).expect("clauses");
    assert!(!invariant.is_empty() && fs::read(folder.join("README")).is_ok());
}

/// A fault that `ack` ends, unless it has come twice.
const FAULTS: &str = r#"[tags]
broken = { at = "X0" }
ack    = { at = "X1" }
fault  = { at = "Y0" }
locked = { at = "Y1" }

[[program]]
name = "Main"
rung = [
  { when = ["rise(broken)", "fault"], do = ["SET locked"] },
  { when = ["rise(broken)"], do = ["SET fault"] },
  { when = ["ack", "!locked"], do = ["RST fault"] },
]
"#;

#[test]
fn a_state_from_which_nothing_leads_home_is_found() {
    let suite = "ladder = [\"faults.toml\"]\n[prove]\ncan = [\"!fault\", \"fault\"]\n";
    let files = Files::new("can", &[("faults.toml", FAULTS), ("home.test.toml", suite)]);
    let output = files.run(&["home.test.toml"]);
    assert_eq!(code(&output), Some(1));
    let told = text(&output);
    assert!(told.starts_with("violated: !fault\n  after scan 3 ("), "{told}");
    assert!(told.contains("name  = \"from here never: !fault\""), "{told}");
    assert!(told.contains("\nproved: fault\n  by exploring: "), "{told}");
    let mended = FAULTS.replace("\"ack\", \"!locked\"", "\"ack\"");
    fs::write(files.path().join("faults.toml"), mended).expect("a file");
    let output = files.run(&["home.test.toml"]);
    assert_eq!(code(&output), Some(0), "{}", text(&output));
}

#[test]
fn how_a_condition_becomes_true_is_a_test_that_passes_or_a_proof() {
    let files = Files::new("how", &[]);
    let how = |args: &[&str]| files.rungd(&[&["how"], args, &["--cold", "ladder.toml"]].concat());
    let found = how(&["late & down", "--json"]);
    assert_eq!(code(&found), Some(1), "{}", text(&found));
    assert_eq!(lines(&found)[0]["answer"], "cannot be");
    let found = how(&["late & !go_up", "--json"]);
    assert_eq!(code(&found), Some(0), "{}", text(&found));
    let answer = &lines(&found)[0];
    assert_eq!((&answer["answer"], &answer["scan"]), (&Value::from("found"), &Value::from(101)));
    let scenario = answer["scenario"].as_str().expect("a scenario");
    let suite = format!("ladder = [\"ladder.toml\"]\n{scenario}");
    fs::write(files.path().join("how.test.toml"), suite).expect("a file");
    assert_eq!(code(&files.rungd(&["test", "how.test.toml"])), Some(0), "{scenario}");
    assert_eq!(code(&how(&["nothing"])), Some(78));
    // A test cannot set the times of scans; what they leave possible as they are is found.
    let open = how(&["$MinScanTime >= 4 & !go_up", "--json"]);
    assert_eq!(lines(&open)[0]["answer"], "not decided", "{}", text(&open));
    let found = how(&["$MaxScanTime < 4 & late & !go_up", "--json"]);
    assert_eq!(lines(&found)[0]["answer"], "found", "{}", text(&found));
}

#[test]
fn a_line_at_a_period_of_no_whole_milliseconds_is_not_decided() {
    let suite = PROVED.replace("always", "period = \"250us\"\nalways");
    let files = Files::new("below-a-millisecond", &[("a.test.toml", &suite)]);
    let answer = files.run(&["a.test.toml"]);
    assert_eq!(code(&answer), Some(2), "{}", text(&answer));
    let told = text(&answer);
    assert!(told.contains("not decided: !(up & down)"), "{told}");
    assert!(told.contains("the period is no whole number of them"), "{told}");
    assert!(told.contains("every scan comes exactly 250 us after the last one"), "{told}");
}

#[test]
fn how_begins_with_a_scan_of_a_recording() {
    let controller = "ladder = [\"ladder.toml\"]\n";
    let files = Files::new("how-recorded", &[("rungd.toml", controller)]);
    let ran = files.rungd(&["run", "rungd.toml", "--scans", "50", "--record", "record"]);
    assert_eq!(code(&ran), Some(0), "{ran:?}");
    let how = |args: &[&str]| files.rungd(&[&["how"], args, &["--recording", "record"]].concat());
    let found = how(&["late", "--at", "scan 40", "--json"]);
    assert_eq!(code(&found), Some(0), "{}", text(&found));
    let answer = &lines(&found)[0];
    assert_eq!(answer["from"]["scan"], 40);
    assert_eq!((&answer["answer"], &answer["scan"]), (&Value::from("found"), &Value::from(101)));
    assert_eq!(answer["text"], "turn go_up ON; 1 s later late is ON");
    let begins =
        "# It begins with the state behind scan 40, not with a cold start.\n[[scenario]]\n";
    assert!(answer["scenario"].as_str().expect("a scenario").starts_with(begins));
    let found = how(&["up", "--at", "scan 40"]);
    let told = text(&found);
    assert!(told.starts_with("from the end of scan 40, "), "{told}");
    assert!(told.contains(":\nturn go_up ON; up is ON in the same scan\n"), "{told}");
    let found = how(&["!up", "--at", "scan 40", "--json"]);
    assert_eq!((code(&found), &lines(&found)[0]["answer"]), (Some(0), &Value::from("holds")));
    let found = how(&["late & down", "--at", "scan 40"]);
    assert_eq!(code(&found), Some(1), "{}", text(&found));
    // Behind its last scan it is in STOP.
    let found = how(&["up"]);
    assert_eq!(code(&found), Some(2), "{}", text(&found));
    assert!(text(&found).contains("not in RUN"), "{}", text(&found));
    assert_eq!(code(&how(&["nothing"])), Some(78));
    assert_eq!(code(&how(&["up", "--at", "scan 400"])), Some(78));
}

#[test]
fn a_line_about_the_memory_of_a_plant_is_not_decided_and_the_other_lines_are() {
    let plant = "[tags]\nlevel = { type = \"real\" }\nmotor = { at = \"X0\" }\n\
                 [[program]]\nname = \"Main\"\nrung = [{ when = [\"motor\"], \
                 do = [\"MATH level = level + 1.0\"] }]\n";
    let controller = "ladder = [\"ladder.toml\"]\n[[device]]\nname = \"lift\"\n\
                      driver = \"ladder\"\nladder = [\"plant.toml\"]\npoll = \"10ms\"\n\
                      map = [{ from = \"up\", to = \"lift.motor\" }, \
                      { from = \"lift.level\", to = \"D9\" }]\n";
    let test = |rest: &str| format!("controller = \"controller.toml\"\n{rest}\n");
    let always = "always = [\"lift.level < 3.0 | up\", \"!(up & down)\", \"!lift.X1\", \
                  \"!was(lift.motor) | D9 > 3\"]";
    let files = Files::new(
        "plant",
        &[
            ("plant.toml", plant),
            ("controller.toml", controller),
            ("lift.test.toml", &test(always)),
            ("wrong.test.toml", &test("[prove]\nassume = [\"lift.level < 3.0\"]")),
        ],
    );
    let output = files.run(&["lift.test.toml", "--json", "--certificate", "for-others"]);
    assert_eq!(code(&output), Some(2), "{output:?}");
    let answers = lines(&output);
    let verdicts: Vec<&str> = answers.iter().filter_map(|one| one["answer"].as_str()).collect();
    assert_eq!(verdicts, ["not decided", "proved", "not decided", "not decided"]);
    let cause = |at: usize| answers[at]["cause"].as_str().unwrap_or_default().to_owned();
    assert_eq!(
        cause(0),
        "`lift.level` is memory of a field device: a proof has none; name the controller's side \
         of its row of the map: `D9`"
    );
    assert_eq!(
        cause(2),
        "`lift.X1` is memory of a field device: a proof has none; connect it with memory of the \
         controller by a row of the device's map, and name that"
    );
    assert!(cause(3).ends_with("of the map: `up`"), "{}", cause(3));
    let question = fs::read_to_string(files.path().join("for-others/lift/question.aag"));
    let question = question.expect("a question");
    assert_eq!(question.lines().filter(|line| line.starts_with('b')).count(), 1, "{question}");
    let refused = files.run(&["wrong.test.toml"]);
    assert_eq!(code(&refused), Some(78), "{refused:?}");
}
