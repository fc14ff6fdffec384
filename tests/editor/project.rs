//! A project for the tests of the editor: a controller file, a ladder with a template, a test.

use std::fs;

use rungd_test_support::folder::TestFolder;

pub const CONTROLLER: &str = "rungd.toml";
pub const LADDER: &str = "plant.toml";
pub const TEST: &str = "plant.test.toml";

const CONTROLLER_TEXT: &str = r#"ladder = ["plant.toml"]

[outputs]
on = ["valve"]
"#;

const LADDER_TEXT: &str = r#"[ladder]
name = "plant"

[tags]
start = { at = "X0", doc = "The green button" }
level = { at = "D0", min = 0, max = 100 }
valve = { at = "Y0", doc = "Opens the tank" }
failed_lamp = { at = "Y2" }
late = { at = "T0" }

[[template]]
name = "Pump"
doc = "One pump."

[template.parameters]
wanted = { type = "contact", doc = "When it shall run" }
motor = { type = "output" }

[template.tags]
failed = { type = "bit" }

[[template.rung]]
when = ["wanted", "!failed"]
do = ["OUT motor"]

[[program]]
name = "Main"

[[program.rung]]
name = "fill"
when = ["start", "level > 3 | !start", "!late.Done"]
do = ["OUT valve", "RUN Drain"]

[[program.rung]]
use = "Pump"
name = "p1"
with = { wanted = "start & valve", motor = "Y1" }

[[program.rung]]
when = ["p1.failed", "Drain.Close"]
do = ["SET failed_lamp", "RST p1.failed"]

[[program.rung]]
when = ["!start"]
do = ["RST failed_lamp", "TMR late preset=3s"]

[[program]]
name = "Drain"

[[program.stage]]
name = "Open"

[[program.stage.rung]]
when = ["$On"]
do = ["JMP Close", "SET p1.failed"]

[[program.stage]]
name = "Close"

[[program.stage.rung]]
when = ["$On"]
do = ["MOVE 1 to=level", "EXIT"]
"#;

const TEST_TEXT: &str = r#"controller = "rungd.toml"
always = ["level <= 100"]

[[scenario]]
name = "it opens"
set = { level = 5 }
steps = ["set start 1", "run 2 scans", "expect: valve"]
"#;

/// Makes an empty folder.
pub fn empty() -> TestFolder {
    TestFolder::new("editor")
}

/// Makes a folder with the project.
pub fn folder() -> TestFolder {
    let folder = empty();
    for (name, text) in [(CONTROLLER, CONTROLLER_TEXT), (LADDER, LADDER_TEXT), (TEST, TEST_TEXT)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}
