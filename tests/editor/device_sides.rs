//! The names of plants that are ladders, and of the own sides of Modbus devices: completion, hover
//! and definition in the map of a device, and in the steps and conditions of a test.

use serde_json::json;

use crate::editor::client::{Editor, place_of};
use crate::editor::completion::items;
use crate::editor::project::empty;
use rungd_test_support::folder::TestFolder;

const FILES: [(&str, &str); 5] = [
    (
        "rungd.toml",
        r#"ladder = ["main.toml"]

[[device]]
name = "tank"
driver = "ladder"
ladder = ["lib:plant-motor", "tank-plant.toml"]
poll = "10ms"
map = [{ from = "pump", to = "tank.pump" }, { from = "tank.level", to = "D0" }]

[[device]]
name = "fan1"
driver = "modbus-tcp"
address = "127.0.0.1:502"
poll = "50ms"
map = [{ from = "input 0", to = "D2" }]

[[simulated]]
device = "fan1"
ladder = ["fan.toml"]
"#,
    ),
    (
        "main.toml",
        "[ladder]\ndevices = [\"tank\", \"fan1\"]\n[tags]\npump = { at = \"Y0\" }\n\
         [[program]]\nname = \"Main\"\n\
         rung = [{ when = [\"tank.Ok\", \"fan1.Ok\"], do = [\"OUT pump\"] }]\n",
    ),
    (
        "tank-plant.toml",
        "[tags]\npump = { at = \"X0\", doc = \"The contactor of the pump\" }\n\
         level = { type = \"real\", unit = \"l\", doc = \"What is in the tank\" }\n\
         full = { type = \"timer\" }\n[[program]]\nname = \"Main\"\nrung = [\n\
         { when = [\"pump\"], do = [\"MATH level = level + 1.0\", \"TMR full preset=1s\"] }]\n",
    ),
    (
        "fan.toml",
        "[tags]\nstatus = { at = \"MIR0\", doc = \"The status word\" }\n\
         fault = { type = \"bit\", doc = \"A fault\" }\n[[program]]\nname = \"Main\"\n\
         rung = [{ when = [\"fault\"], do = [\"MOVE 8 to=status\"] }]\n",
    ),
    (
        "main.test.toml",
        r#"controller = "rungd.toml"
always = ["tank.level < 900.0 | fan1.fault"]

[[scenario]]
name = "x"
set = { "tank.level" = 3.0 }
steps = ["set fan1.fault 1", "run 1 scans", "expect: was(tank.level) > 1.0 & tank.full.Acc > 0ms"]
"#,
    ),
];

fn opened() -> (TestFolder, Editor) {
    let folder = empty();
    for (name, text) in FILES {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let mut editor = Editor::new(folder.path());
    editor.open("rungd.toml");
    editor.open("main.test.toml");
    (folder, editor)
}

#[test]
fn a_name_of_a_plant_leads_to_its_declaration_in_the_plants_ladder() {
    let (_folder, mut editor) = opened();
    let cases = [
        ("rungd.toml", "tank.pump", 6, "tank-plant.toml:1", "The contactor of the pump"),
        ("rungd.toml", "tank.level", 9, "tank-plant.toml:2", "What is in the tank"),
        ("main.test.toml", "tank.level < 900", 6, "tank-plant.toml:2", "type = \"real\""),
        ("main.test.toml", "fan1.fault 1", 6, "fan.toml:2", "A fault"),
        ("main.test.toml", "fan1.fault\"", 6, "fan.toml:2", "A fault"),
        ("main.test.toml", "was(tank.level", 12, "tank-plant.toml:2", "What is in the tank"),
        ("main.test.toml", "tank.full.Acc", 6, "tank-plant.toml:3", "**full**: tag"),
        ("rungd.toml", "tank.pump", 1, "rungd.toml:3", "field device"),
    ];
    for (name, wanted, within, declared, told) in cases {
        let (line, column) = place_of(&editor.disk(name), wanted);
        let found = editor.ask_at("textDocument/definition", name, line, column + within);
        let uri = found["uri"].as_str().unwrap_or_default();
        let file = uri.rsplit('/').next().unwrap_or_default();
        let place = format!("{file}:{}", found["range"]["start"]["line"]);
        assert_eq!(place, declared, "{name}: {wanted}");
        let hover = editor.ask_at("textDocument/hover", name, line, column + within);
        let text = hover["contents"]["value"].as_str().unwrap_or_default();
        assert!(text.contains(told), "{name}: {wanted}: {text}");
    }
    // A bit of the device itself has no declaration in the plant.
    let found = editor.ask_at("textDocument/definition", "rungd.toml", 0, 0);
    assert_eq!(found, json!(null));
}

#[test]
fn the_names_of_a_plant_are_offered_in_its_map_and_in_tests() {
    let (_folder, mut editor) = opened();
    let controller = FILES[0].1;
    let test = FILES[4].1;
    let cases = [
        ("rungd.toml", controller.replace("\"tank.pump\"", "\"¦\""), "tank.level", "tank.Ok"),
        ("rungd.toml", controller.replace("\"tank.pump\"", "\"tank.¦\""), "tank.pump", "Main"),
        ("rungd.toml", controller.replace("\"tank.level\"", "\"tank.le¦\""), "tank.level", "pump"),
        ("main.test.toml", test.replace("fan1.fault 1", "fan1.¦ 1"), "fault", "level"),
        ("main.test.toml", test.replace("was(tank.level)", "was(tank.l¦)"), "level", "fault"),
        ("main.test.toml", test.replace("tank.level < 900", "tank.¦ < 900"), "level", "fault"),
        ("main.test.toml", test.replace("tank.full.Acc", "tank.full.¦"), "Acc", "level"),
        ("main.test.toml", test.replace("tank.full.Acc", "tank.¦"), "Stale", "D0"),
    ];
    for (name, text, wanted, unwanted) in cases {
        let found = items(&mut editor, name, &text);
        let labels: Vec<&str> = found.iter().filter_map(|item| item["label"].as_str()).collect();
        let line = text.lines().find(|line| line.contains('¦')).unwrap_or_default();
        assert!(labels.contains(&wanted), "{line}: {labels:?}");
        assert!(!labels.contains(&unwanted), "{line}: {labels:?}");
    }
}
