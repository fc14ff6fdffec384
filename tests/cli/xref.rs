//! `rungd xref`: the list for each kind of operand, the files that are searched, the refusals.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use expect_test::{Expect, expect};
use serde_json::Value;

const CONTROLLER: &str = r#"ladder = ["plant.toml"]

[retain]
tags = ["recipe"]

[outputs]
on = ["valve"]

[modbus-server]
listen = "127.0.0.1:1502"
writable = ["level"]
map = [{ operand = "level", table = "holding", address = 4000, type = "u32" }]

[modbus-server.image]
inputs = { from = "MC1..MC8", to = "X8..X15" }

[[simulated-device]]
input = "X1"
follows = "valve"
"#;

const LADDER: &str = r#"[tags]
start  = { at = "X8", doc = "The green button" }
full   = { at = "X1" }
valve  = { at = "Y0", doc = "Opens the tank" }
level  = { at = "D0", min = 0, max = 100 }
recipe = { at = "D10", count = 4 }
step   = { at = "D1" }
parts  = { at = "CT0" }
late   = { value = "3s" }

[[template]]
name = "Pump"

[template.parameters]
wanted = { type = "contact" }
motor  = { type = "output" }

[template.tags]
failed = { type = "bit" }

[[template.rung]]
when = ["wanted", "!failed"]
do   = ["OUT motor", "SET failed"]

[[program]]
name = "Main"

[[program.rung]]
name = "fill"
when = ["start", "!(full | level >= 90)", "recipe[step] > 3"]
do   = ["OUT valve", "RUN Drain"]

[[program.rung]]
name = "p1"
use  = "Pump"
with = { wanted = "rise(start) & valve", motor = "Y1" }

[[program.rung]]
leg.up  = ["full"]
leg.rst = ["Drain.Close"]
do      = ["CNT parts preset=level"]

[[program]]
name = "Drain"

[[program.stage]]
name = "Open"

[[program.stage.rung]]
when = ["$On"]
do   = ["MATH recipe[step] = level + parts.Acc", "ONDTMR T1 preset=late output=Y2", "JMP Close"]

[[program.stage]]
name = "Close"

[[program.stage.rung]]
when = ["parts.Done"]
do   = ["EXIT"]
"#;

const TEST: &str = r#"controller = "rungd.toml"
always = ["level <= 100"]

[[scenario]]
name  = "it opens"
set   = { level = 5 }
steps = ["set start 1", "run 2 scans", "expect: recipe[step] == 0 & !valve"]
"#;

/// Makes a folder with the project.
fn project(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("tests")).expect("a folder");
    let test = TEST.replace("\"rungd.toml\"", "\"../rungd.toml\"");
    for (name, text) in
        [("rungd.toml", CONTROLLER), ("plant.toml", LADDER), ("tests/a.test.toml", &test)]
    {
        fs::write(folder.join(name), text).expect("written");
    }
    folder
}

fn xref(args: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("xref").args(args).current_dir(folder).output().expect("rungd runs")
}

#[track_caller]
fn check(args: &[&str], expected: Expect) {
    let folder = project(&format!("xref-{}", args.join("-").replace(['.', '[', ']'], "_")));
    let output = xref(args, &folder);
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
    assert_eq!(text(&output.stderr), "");
    expected.assert_eq(&text(&output.stdout));
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn the_cross_reference_of_a_subroutine_lists_its_calls() {
    let ladder = "[[program]]\nname = \"Main\"\nrung = [\n  { when = [\"X0\"], do = [\"CALL Fill\"] },\n]\n\
                  [[subroutine]]\nname = \"Fill\"\ndoc = \"Fills the tank\"\n\
                  rung = [ { when = [\"X1\"], do = [\"OUT Y0\"] } ]\n";
    let folder = project("xref-subroutine");
    fs::write(folder.join("calls.toml"), ladder).expect("written");
    let output = xref(&["--in", "calls.toml", "Fill"], &folder);
    expect![[r#"
        Fill: Fills the tank
          declared at calls.toml:7
        called by
          CALL Fill  Main, rung 1  calls.toml:4
    "#]]
    .assert_eq(&String::from_utf8(output.stdout).expect("text"));
}

#[test]
fn the_cross_reference_lists_the_uses_of_outputs_and_inputs() {
    check(
        &["valve", "start"],
        expect![[r#"
            valve (Y0): Opens the tank
              declared at plant.toml:4
            written by
              OUT valve  Main, rung fill  plant.toml:31
            read by
              valve  Main, rung 2 (p1)  plant.toml:36
            controller file
              X1 is simulated by it    rungd.toml:19
              outside of RUN it is ON  rungd.toml:7
            tests
              tests/a.test.toml:7  it opens

            start (X8): The green button
              declared at plant.toml:2
            read by
              start        Main, rung fill    plant.toml:30
              rise(start)  Main, rung 2 (p1)  plant.toml:36
            controller file
              Modbus clients read and write it: coil 0
            tests
              tests/a.test.toml:7  it opens
        "#]],
    );
}

#[test]
fn the_cross_reference_lists_the_uses_and_modbus_addresses_of_a_word() {
    check(
        &["level"],
        expect![[r#"
        level (D0)
          declared at plant.toml:5
        read by
          level >= 90                            Main, rung fill     plant.toml:30
          CNT parts preset=level                 Main, rung 3        plant.toml:41
          MATH recipe[step] = level + parts.Acc  Drain.Open, rung 1  plant.toml:51
        controller file
          Modbus clients read and write it: holding 4000..4001  rungd.toml:12
        tests
          tests/a.test.toml:2  always
          tests/a.test.toml:4  it opens
    "#]],
    );
}

#[test]
fn the_cross_reference_lists_the_uses_of_an_array_and_of_an_element() {
    check(
        &["recipe", "recipe[2]"],
        expect![[r#"
        recipe (D10..D13)
          declared at plant.toml:6
        written by
          MATH recipe[step] = level + parts.Acc  Drain.Open, rung 1  plant.toml:51
        read by
          recipe[step] > 3  Main, rung fill  plant.toml:30
        retentive memory keeps it
        tests
          tests/a.test.toml:7  it opens

        recipe[2] (D12)
          declared at plant.toml:6
        written by
          MATH recipe[step] = level + parts.Acc  Drain.Open, rung 1  plant.toml:51
        read by
          recipe[step] > 3  Main, rung fill  plant.toml:30
        retentive memory keeps it
        tests
          tests/a.test.toml:7  it opens
    "#]],
    );
}

#[test]
fn the_cross_reference_of_a_structure_lists_the_uses_of_its_members() {
    check(
        &["parts", "CT0.Done"],
        expect![[r#"
        parts (CT0)
          declared at plant.toml:8
        written by
          CNT parts preset=level  Main, rung 3  plant.toml:41
        read by
          MATH recipe[step] = level + parts.Acc  Drain.Open, rung 1   plant.toml:51
          parts.Done                             Drain.Close, rung 1  plant.toml:57

        CT0.Done
        written by
          CNT parts preset=level  Main, rung 3  plant.toml:41
        read by
          parts.Done  Drain.Close, rung 1  plant.toml:57
    "#]],
    );
}

/// Retentive memory keeps a structure with all its members.
#[test]
fn a_member_of_a_retained_counter_is_listed_as_retained() {
    let folder = project("xref-retained");
    let text = CONTROLLER.replace("tags = [\"recipe\"]", "ranges = [\"CT0..CT3\"]");
    fs::write(folder.join("rungd.toml"), text).expect("written");
    for operand in ["parts", "parts.Acc", "CT0.Done"] {
        let said = String::from_utf8(xref(&[operand], &folder).stdout).expect("text");
        assert!(said.contains("retentive memory keeps it"), "{operand}: {said}");
    }
    let said = String::from_utf8(xref(&["level"], &folder).stdout).expect("text");
    assert!(!said.contains("retentive memory"), "{said}");
}

#[test]
fn the_cross_reference_lists_the_readers_of_a_constant() {
    check(
        &["late"],
        expect![[r#"
        late (3000)
          declared at plant.toml:9
        read by
          plant.toml:51
    "#]],
    );
}

#[test]
fn the_cross_reference_lists_the_uses_of_a_block_and_a_stage() {
    check(
        &["Drain", "Drain.Close", "Y2"],
        expect![[r#"
        Drain
          declared at plant.toml:44
        written by
          RUN Drain  Main, rung fill      plant.toml:31
          JMP Close  Drain.Open, rung 1   plant.toml:51
          EXIT       Drain.Close, rung 1  plant.toml:58
          Drain itself, as it starts and ends
        read by
          Drain.Close  Main, rung 3  plant.toml:40

        Drain.Close
          declared at plant.toml:54
        written by
          JMP Close  Drain.Open, rung 1  plant.toml:51
          Drain itself, as it starts and ends
        read by
          Drain.Close  Main, rung 3  plant.toml:40

        Y2
        written by
          ONDTMR T1 preset=late output=Y2  Drain.Open, rung 1  plant.toml:51; the end of Drain.Open resets it
    "#]],
    );
}

#[test]
fn the_cross_reference_of_a_template_use_lists_the_uses_of_its_tags() {
    check(
        &["p1", "p1.failed"],
        expect![[r#"
            p1
            written by
              SET failed  Main, rung 2 (p1)  plant.toml:23
            read by
              !failed  Main, rung 2 (p1)  plant.toml:22

            p1.failed
              declared at plant.toml:19
            written by
              SET failed  Main, rung 2 (p1)  plant.toml:23
            read by
              !failed  Main, rung 2 (p1)  plant.toml:22
        "#]],
    );
}

#[test]
fn the_whole_cross_reference_is_printed_as_json() {
    let folder = project("xref-all");
    let output = xref(&["--all", "--json"], &folder);
    let all: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let all = all.as_array().expect("an array");
    let names: Vec<&str> = all.iter().map(|of| of["name"].as_str().expect("a name")).collect();
    let tags = ["start", "full", "valve", "level", "recipe", "step", "parts", "late"];
    assert_eq!(names[..8], tags, "{names:?}");
    for name in ["p1.failed", "Y1", "Drain.Close", "Main", "Drain"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    let valve = &all[2];
    assert_eq!(valve["written"][0]["text"], "OUT valve");
    assert_eq!(valve["written"][0]["rung"], "Main, rung fill");
    assert_eq!(
        (&valve["written"][0]["file"], &valve["written"][0]["line"]),
        (&"plant.toml".into(), &31.into())
    );
}

#[test]
fn unknown_operands_are_refused() {
    let folder = project("xref-refused");
    let check = |args: &[&str], code: i32, why: &str| {
        let output = xref(args, &folder);
        let said = String::from_utf8(output.stderr).expect("text");
        assert!(said.contains(why), "{said}");
        assert_eq!(output.status.code(), Some(code), "{said}");
    };
    check(&["valv"], 2, "did you mean `valve`?");
    check(&[], 2, "required");
    check(&["valve", "--all"], 2, "cannot be used");
    check(&["valve", "--in", "none.toml"], 74, "none.toml: No such file");
    fs::write(folder.join("second.toml"), CONTROLLER).expect("written");
    fs::rename(folder.join("rungd.toml"), folder.join("first.toml")).expect("renamed");
    check(&["valve"], 2, "first.toml, second.toml are controller files in this folder");
    fs::write(folder.join("plant.toml"), LADDER.replace("OUT valve", "OUT valv")).expect("written");
    check(&["valve", "--in", "plant.toml"], 78, "error[unknown-name]");
}
