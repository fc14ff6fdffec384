//! Hover: names, instructions, keys and numbers are explained at their places.

use serde_json::{Value, json};

use crate::editor::client::{Editor, place_of};
use crate::editor::project::{CONTROLLER, LADDER, TEST, folder};
use rungd_test_support::folder::TestFolder;

/// The hover text at a place, which `^` marks in `wanted`.
fn shown(editor: &mut Editor, name: &str, wanted: &str) -> String {
    let text = editor.disk(name);
    let within = wanted.find('^').expect("a mark");
    let (line, column) = place_of(&text, &wanted.replacen('^', "", 1));
    let answer = editor.ask_at("textDocument/hover", name, line, column + within);
    answer["contents"]["value"].as_str().unwrap_or_default().to_owned()
}

fn opened() -> (TestFolder, Editor) {
    let folder = folder();
    let mut editor = Editor::new(folder.path());
    for name in [CONTROLLER, LADDER, TEST] {
        editor.open(name);
    }
    (folder, editor)
}

fn check(cases: &[(&str, &str, &[&str])]) {
    let (_folder, mut editor) = opened();
    for (name, place, wanted) in cases {
        let text = shown(&mut editor, name, place);
        for words in *wanted {
            assert!(text.contains(words), "{place}: {words:?} is not in\n{text}");
        }
    }
}

#[test]
fn hovering_a_tag_shows_its_declaration_writers_and_readers() {
    let (_folder, mut editor) = opened();
    expect_test::expect![[r#"
        **valve**: tag

        Opens the tank

        `at = "Y0"`

        Written by:

        - `OUT valve` Main/fill plant.toml:32

        Given to:

        - `start & valve` Main/p1 plant.toml:37

        Controller file:

        - `on = ["valve"]` rungd.toml:4

        Tests name it once.
    "#]]
    .assert_eq(&shown(&mut editor, LADDER, "OUT ^valve"));
}

#[test]
fn hovering_a_name_explains_it() {
    check(&[
        (
            LADDER,
            "RUN ^Drain",
            &["**Drain**: Program", "Stages: `Open`, `Close`", "`RUN Drain` Main/fill"],
        ),
        (LADDER, "JMP ^Close", &["**Close**: Stage of Drain", "`JMP Close` Drain.Open"]),
        (
            LADDER,
            "use = \"^Pump",
            &["**Pump**: template", "One pump.", "Parameters", "`motor` `type = \"output\"`"],
        ),
        (
            LADDER,
            "name = \"^p1",
            &["use of a template", "Pump: One pump.", "`with.motor = \"Y1\"`"],
        ),
        (LADDER, "{ ^wanted =", &["**wanted**: parameter of Pump", "When it shall run"]),
        (LADDER, "motor = \"^Y1", &["**Y1**", "Given to"]),
        (LADDER, "name = \"^fill", &["**fill**: rung of Main"]),
        (LADDER, "late.^Done", &["**.Done** of late", "`.Acc` is at or above the preset"]),
        (LADDER, "[\"^$On", &["always ON"]),
        (LADDER, "SET p1.^failed", &["**failed**: tag of Pump", "Written by", "SET p1.failed"]),
        (TEST, "set ^start", &["The green button", "Read by"]),
    ]);
}

#[test]
fn hovering_instructions_steps_keys_and_numbers_explains_them() {
    check(&[
        (LADDER, "^TMR late", &["**TMR**", "form         TMR t preset=d", "## Behaviour"]),
        (LADDER, "preset=^3s", &["`3s` is 3000 ms"]),
        (LADDER, "level > 3 ^| !start", &["Read as `level > 3 | !start`"]),
        (TEST, "\"^run 2", &["**run**", "Time passes"]),
        (TEST, "^steps", &["**steps**"]),
        (LADDER, "^when = ", &["**when**"]),
        (LADDER, "[[program.^rung]]", &["**rung**"]),
        (LADDER, "wanted = { ^type", &["**type**"]),
        (CONTROLLER, "[^outputs]", &["**outputs**"]),
    ]);
}

#[test]
fn hovering_contacts_numbers_and_warning_names_explains_them() {
    let (folder, mut editor) = opened();
    let text = "[ladder]\nallow = [\"unused-tag\"]\n[[program]]\nname = \"Main\"\n\
                [[program.rung]]\nwhen = [\"X0|X1 & X2\", \"D0 > 0x1F\", \"abs(D2) > 3\"]\n\
                do = [\"MATH D1 = sqrt(D0)\"]\n";
    std::fs::write(folder.path().join("own.toml"), text).unwrap();
    editor.open("own.toml");
    let mut shown = |wanted: &str| shown(&mut editor, "own.toml", wanted);
    assert_eq!(shown("X0^|X1"), "Read as `X0 | (X1 & X2)`\n");
    assert_eq!(shown("> ^0x1F"), "`0x1F` is 31\n");
    assert!(shown("= ^sqrt").contains("a function of MATH"));
    assert!(shown("^abs(D2)").contains("of contacts"));
    assert!(shown("^unused-tag").contains("unused-tag"));
}

#[test]
fn an_editor_without_markdown_gets_plain_text() {
    let folder = folder();
    let wants = json!({ "textDocument": { "hover": { "contentFormat": ["plaintext"] } } });
    let mut editor = Editor::with(folder.path(), wants);
    editor.open(LADDER);
    let text = shown(&mut editor, LADDER, "OUT ^valve");
    assert!(text.starts_with("valve: tag\n") && !text.contains('`'), "{text}");
}

#[test]
fn hovering_any_place_of_a_broken_file_is_answered() {
    let (_folder, mut editor) = opened();
    let whole = editor.disk(LADDER);
    for cut in (0..whole.len()).step_by(41) {
        editor.replace(LADDER, &whole[..cut]);
        let line = whole[..cut].matches('\n').count();
        for column in [0, 3, 9, 500] {
            let answer = editor.ask_at("textDocument/hover", LADDER, line, column);
            assert!(answer == Value::Null || answer["contents"]["kind"] == "markdown");
        }
    }
}
