//! Observers of test files in the editor: their names mean what they mean in rungs, and are known
//! in their own file only. Also the ladders of a device's own side.

use serde_json::Value;

use crate::editor::client::{Editor, place_of};
use crate::editor::completion::{Case, check, items};
use crate::editor::project::{LADDER, TEST, folder};
use crate::editor::renames::{TextPlace, edited, rename};
use rungd_test_support::folder::TestFolder;

const OBSERVED: &str = r#"controller = "rungd.toml"
always = ["!waits.Done | opened < 3", "was(opened) < opened + 1"]

[observer.tags]
waits = { type = "timer", doc = "The tank waits" }
opened = { type = "int", initial = 0 }

[[observer.rung]]
name = "wait"
when = ["start", "level > 3", "!valve"]
do = ["TMR waits preset=5s"]

[[observer.rung]]
use = "Pump"
name = "p2"
with = { wanted = "valve & start", motor = "own_motor" }

[[observer.rung]]
when = ["rise(valve)", "!p2.failed"]
do = ["MATH opened = opened + 1"]

[[scenario]]
name = "it opens"
steps = ["run 2 scans", "expect: opened == 0 & !waits.Done & !own_motor"]

[observer.tags.own_motor]
type = "bit"
"#;

/// The project with an observer in its test, and another test with an observer.
fn opened() -> (TestFolder, Editor) {
    let folder = folder();
    std::fs::write(folder.path().join(TEST), OBSERVED).unwrap();
    let other = "controller = \"rungd.toml\"\n\n[observer.tags]\nopened = { type = \"bit\" }\n\n\
                 [[observer.rung]]\nwhen = [\"valve\"]\ndo = [\"OUT opened\"]\n\n[[scenario]]\n\
                 name = \"s\"\nsteps = [\"run 2 scans\", \"expect: !opened\"]\n";
    std::fs::write(folder.path().join("other.test.toml"), other).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(TEST);
    editor.open("other.test.toml");
    (folder, editor)
}

/// The answer at a place, which `^` marks in `wanted`.
fn ask(editor: &mut Editor, method: &str, name: &str, wanted: &str) -> Value {
    let text = editor.disk(name);
    let within = wanted.find('^').expect("a mark");
    let (line, column) = place_of(&text, &wanted.replacen('^', "", 1));
    editor.ask_at(&format!("textDocument/{method}"), name, line, column + within)
}

fn renamed(editor: &mut Editor, name: &str, wanted: &str, new: &str) -> Vec<(String, String)> {
    let within = wanted.find('^').expect("a mark");
    let (line, column) = place_of(&editor.disk(name), &wanted.replacen('^', "", 1));
    let edits = rename(editor, TextPlace { name, line, column: column + within }, new).unwrap();
    let files = edits.iter().map(|(uri, edits)| {
        let name = uri.rsplit('/').next().unwrap_or_default().to_owned();
        let text = edited(&editor.disk(&name), edits);
        (name, text)
    });
    files.collect()
}

#[test]
fn a_name_in_an_observer_leads_to_its_declaration() {
    let (_folder, mut editor) = opened();
    let mut leads = |wanted: &str| {
        let location = ask(&mut editor, "definition", TEST, wanted);
        let file =
            location["uri"].as_str().unwrap_or_default().rsplit('/').next().map(str::to_owned);
        let line = location["range"]["start"]["line"].as_u64();
        (file.unwrap_or_default(), line.map(|line| line as usize))
    };
    let line = |name: &str, text: &str, editor: &Editor| place_of(&editor.disk(name), text).0;
    let ours =
        |text: &str| (TEST.to_owned(), OBSERVED.lines().position(|line| line.contains(text)));
    assert_eq!(leads("TMR ^waits"), ours("waits = {"));
    assert_eq!(leads("!^waits.Done | opened"), ours("waits = {"));
    assert_eq!(leads("was(^opened)"), ours("opened = {"));
    assert_eq!(leads("MATH ^opened"), ours("opened = {"));
    assert_eq!(leads("!^p2.failed"), ours("name = \"p2\""));
    assert_eq!(leads("motor = \"^own_motor"), ours("tags.own_motor"));
    let at = |wanted: &str, text: &str, editor: &mut Editor| {
        let location = ask(editor, "definition", TEST, wanted);
        assert!(location["uri"].as_str().unwrap().ends_with(LADDER), "{location}");
        let found = location["range"]["start"]["line"].as_u64().unwrap() as usize;
        assert_eq!(found, line(LADDER, text, editor), "{wanted}");
    };
    at("\"^start\", \"level", "start = {", &mut editor);
    at("\"level > 3\", \"!^valve", "valve = {", &mut editor);
    at("use = \"^Pump", "name = \"Pump", &mut editor);
    at("{ ^wanted = ", "wanted = {", &mut editor);
    at("p2.^failed", "failed = { type", &mut editor);
}

#[test]
fn hovering_a_tag_of_an_observer_shows_its_rungs() {
    let (_folder, mut editor) = opened();
    let answer = ask(&mut editor, "hover", TEST, "TMR ^waits");
    expect_test::expect![[r#"
        **waits**: tag of the observer

        The tank waits

        `type = "timer"`

        Written by:

        - `TMR waits preset=5s` observer/wait plant.test.toml:11

        Tests name it 2 times.
    "#]]
    .assert_eq(answer["contents"]["value"].as_str().unwrap());
    let answer = ask(&mut editor, "hover", TEST, "^TMR waits");
    assert!(answer["contents"]["value"].as_str().unwrap().contains("preset"), "{answer}");
    let answer = ask(&mut editor, "hover", TEST, "MATH opened = ^opened");
    let text = answer["contents"]["value"].as_str().unwrap();
    assert!(!text.contains("OUT opened") && text.contains("Tests name it 4 times"), "{text}");
}

#[test]
fn a_rename_of_a_tag_of_an_observer_stays_in_its_file() {
    let (_folder, mut editor) = opened();
    let own = OBSERVED.replace("opened ", "times ").replace("(opened)", "(times)");
    for place in ["MATH ^opened", "^opened = {", "was(^opened)", "expect: ^opened"] {
        let found = renamed(&mut editor, TEST, place, "times");
        assert_eq!(found, [(TEST.to_owned(), own.clone())], "{place}");
    }
    let found = renamed(&mut editor, TEST, "!^p2.failed", "spare");
    assert_eq!(found, [(TEST.to_owned(), OBSERVED.replace("p2", "spare"))]);
    let other = renamed(&mut editor, "other.test.toml", "OUT ^opened", "times");
    assert_eq!(other.len(), 1);
    assert_eq!(other[0].1.matches("times").count(), 3, "{other:?}");
}

#[test]
fn a_rename_of_a_name_of_the_ladder_reaches_observers() {
    let (_folder, mut editor) = opened();
    let found = renamed(&mut editor, LADDER, "OUT ^valve", "outlet");
    let of = |name: &str| &found.iter().find(|(file, _)| file == name).expect("edits").1;
    assert_eq!(of(TEST), &OBSERVED.replace("valve", "outlet"));
    assert!(of("other.test.toml").contains("when = [\"outlet\"]"));
    let found = renamed(&mut editor, TEST, "p2.^failed", "broken");
    let of = |name: &str| &found.iter().find(|(file, _)| file == name).expect("edits").1;
    assert!(of(TEST).contains("!p2.broken") && of(LADDER).contains("p1.broken"), "{found:?}");
    let (line, column) = place_of(&editor.disk(LADDER), "OUT valve");
    let place = TextPlace { name: LADDER, line, column: column + 4 };
    let why = rename(&mut editor, place, "opened").unwrap_err();
    assert!(why.contains("opened"), "{why}");
}

#[test]
fn names_and_keys_are_offered_in_observers() {
    let head = "controller = \"rungd.toml\"\n[observer.tags]\nwaits = { type = \"timer\" }\n\
                own = { type = \"bit\" }\ncount = { type = \"int\" }\n";
    let cases: &[Case] = &[
        ("more = { type = \"¦\" }", &["bit", "timer", "real"], &["sensaphone"]),
        ("[[observer.rung]]\n¦", &["when", "leg.up", "do", "use", "name"], &["steps"]),
        ("[[observer.rung]]\nwhen = [\"¦\"]", &["valve", "waits", "own", "p1", "rise"], &["was"]),
        ("[[observer.rung]]\nwhen = [\"waits.¦\"]", &["Done", "Acc"], &[]),
        ("[[observer.rung]]\ndo = [\"OUT ¦\"]", &["own"], &["valve", "failed_lamp", "waits.Done"]),
        ("[[observer.rung]]\ndo = [\"TMR ¦\"]", &["waits"], &["late"]),
        ("[[observer.rung]]\ndo = [\"MOVE level to=¦\"]", &["count"], &["level"]),
        (
            "[[observer.rung]]\ndo = [\"¦\"]",
            &["OUT", "TMR", "MATH"],
            &["RUN", "JMP", "EXIT", "CALL"],
        ),
        ("[[observer.rung]]\nuse = \"¦\"", &["Pump"], &[]),
        ("[[observer.rung]]\nuse = \"Pump\"\nwith = { ¦ }", &["wanted", "motor"], &[]),
        ("[[scenario]]\nsteps = [\"expect: ¦\"]", &["own", "waits"], &[]),
        ("always = [\"¦\"]", &[], &[]),
        ("¦", &["[[observer.rung]]"], &[]),
    ];
    check(TEST, head, cases);
    let before = "[[program.rung]]\n";
    check(LADDER, before, &[("when = [\"¦\"]", &[], &["own", "waits"])]);
}

/// A device's own side is no part of the program under test: its names are its own.
#[test]
fn the_ladder_of_a_device_is_offered_and_found_and_does_not_hinder_renames() {
    let (folder, editor) = opened();
    let device = "\n[[device]]\nname = \"drive\"\ndriver = \"modbus-tcp\"\n\
                  address = \"127.0.0.1:1502\"\n\
                  map = [{ from = \"holding 0\", to = \"D9\" }]\n";
    let controller = editor.disk("rungd.toml") + device;
    std::fs::write(folder.path().join("rungd.toml"), controller).unwrap();
    let side = "[tags]\nvalve = { at = \"MHR1\" }\n\n[[program]]\nname = \"Main\"\n\
                rung = [{ when = [\"$On\"], do = [\"MOVE 3 to=valve\"] }]\n";
    std::fs::write(folder.path().join("side.toml"), side).unwrap();
    let test = "controller = \"rungd.toml\"\n\n[[simulated]]\ndevice = \"drive\"\n\
                ladder = [\"side.toml\"]\n\n[[scenario]]\nname = \"s\"\n\
                steps = [\"run 2 scans\", \"expect: !valve & drive.Ok\"]\n";
    std::fs::write(folder.path().join("side.test.toml"), test).unwrap();
    let mut editor = Editor::new(folder.path());
    editor.open(LADDER);
    editor.open("side.test.toml");
    let file = ask(&mut editor, "definition", "side.test.toml", "^side.toml");
    assert!(file["uri"].as_str().unwrap().ends_with("/side.toml"), "{file}");
    let found = renamed(&mut editor, LADDER, "OUT ^valve", "outlet");
    let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    assert!(names.contains(&"side.test.toml") && !names.contains(&"side.toml"), "{names:?}");
    let text = test.replace("side.toml", "¦");
    let items = items(&mut editor, "side.test.toml", &text);
    let labels: Vec<&str> = items.iter().filter_map(|item| item["label"].as_str()).collect();
    assert!(labels.contains(&"side.toml") && !labels.contains(&"rungd.toml"), "{labels:?}");
}
