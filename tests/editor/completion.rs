//! Completion: the items that are offered at each kind of place, those that are not, and the text
//! that an item writes.

use serde_json::{Value, json};

use crate::editor::client::Editor;
use crate::editor::project::{self, CONTROLLER, LADDER, TEST};
use rungd_test_support::folder::TestFolder;

/// A ladder with a name of every kind.
pub const RICH: &str = r#"[ladder]
name = "rich"
devices = ["remote"]

[tags]
start = { at = "X0", doc = "The green button" }
valve = { at = "Y0" }
level = { at = "D0", min = 0, max = 100 }
ratio = { type = "real" }
limit = { value = 80 }
late = { at = "T0" }
parts = { type = "counter" }
recipe = { type = "int", count = 10 }
lamps = { at = "C10", count = 4 }
odd = { at = "N3" }

[[template]]
name = "Pump"
doc = "One pump."

[template.parameters]
wanted = { type = "contact", doc = "When it shall run" }
motor = { type = "output" }
patience = { type = "duration", default = "3s" }

[template.tags]
failed = { type = "bit" }
hours = { type = "timer" }

[[template.rung]]
when = ["wanted"]
do = ["OUT motor"]

[[template]]
name = "Flush"

[template.tags]
amount = { type = "int" }

[[template.stage]]
name = "Rinse"

[[template.stage]]
name = "Empty"

[[program]]
name = "Main"

[[program.rung]]
use = "Pump"
name = "p1"
with = { wanted = "start", motor = "Y1" }

[[task]]
name = "Hourly"

[[subroutine]]
name = "Dose"

[[program]]
name = "Flush1"
use = "Flush"

[[program]]
name = "drain-pump"

[[program.stage]]
name = "Open"

[[program.stage]]
name = "Close"
"#;

/// An editor with the project open.
pub fn editor(capabilities: Value) -> (TestFolder, Editor) {
    let folder = project::folder();
    let mut editor = Editor::with(folder.path(), capabilities);
    for name in [CONTROLLER, LADDER, TEST] {
        editor.open(name);
    }
    (folder, editor)
}

/// The items at the `¦` of a text.
pub fn items(editor: &mut Editor, name: &str, text: &str) -> Vec<Value> {
    let before = text.split('¦').next().expect("a cursor");
    let line = before.matches('\n').count();
    let column = before.rsplit('\n').next().unwrap_or_default().encode_utf16().count();
    editor.replace(name, &text.replacen('¦', "", 1));
    let document = json!({ "uri": editor.uri(name) });
    let position = json!({ "line": line, "character": column });
    let params = json!({ "textDocument": document, "position": position });
    let answer = editor.ask("textDocument/completion", params);
    answer["items"].as_array().cloned().unwrap_or_default()
}

fn labels(items: &[Value]) -> Vec<&str> {
    items.iter().map(|item| item["label"].as_str().expect("a label")).collect()
}

/// A place, items that are offered there, and items that are not.
pub type Case<'c> = (&'c str, &'c [&'c str], &'c [&'c str]);

/// Checks cases; the text of each place follows `before`.
pub fn check(name: &str, before: &str, cases: &[Case]) {
    let (_folder, mut editor) = editor(json!({}));
    let mut wrong = Vec::new();
    for (text, wanted, unwanted) in cases {
        let found = items(&mut editor, name, &format!("{before}{text}"));
        let found = labels(&found);
        let lacks = wanted.iter().filter(|label| !found.contains(*label));
        wrong.extend(lacks.map(|label| format!("`{label}` at {text}: {found:?}")));
        let stray = unwanted.iter().filter(|label| found.contains(*label));
        wrong.extend(stray.map(|label| format!("no `{label}` at {text}: {found:?}")));
        if wanted.is_empty() && unwanted.is_empty() && !found.is_empty() {
            wrong.push(format!("nothing at {text}: {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn bits_and_numbers_are_offered_in_contacts() {
    let before = format!("{RICH}\n[[program.stage.rung]]\n");
    let all = ["start", "level", "late", "p1", "Flush1", "drain-pump", "Hourly", "remote", "$On"];
    check(
        LADDER,
        &before,
        &[
            ("when = [\"¦\"]", &all, &["wanted", "failed", "Rinse", "Pump", "X0"]),
            ("when = [\"¦", &["rise", "fall", "start"], &[]),
            ("when = [\"st¦\"]", &["start"], &["valve", "level"]),
            ("when = [\"!(start | va¦)\"]", &["valve"], &["start"]),
            ("when = [\"rise(¦)\"]", &["start"], &[]),
            ("when = [\"start ¦\"]", &[], &[]),
            (
                "when = [\"level > ¦\"]",
                &["ratio", "limit", "level", "late", "recipe", "$Hour"],
                &["start", "valve", "rise", "$On", "Hourly"],
            ),
            ("when = [\"level > 3¦\"]", &[], &[]),
            ("when = [\"level > ma¦\"]", &["max"], &["rise"]),
            ("when = [\"level + ¦\"]", &["abs", "level", "start"], &["rise"]),
            ("when = [\"max(level, ¦\"]", &["min", "level"], &[]),
            ("when = [\"recipe[level + ¦\"]", &["level", "abs"], &["rise"]),
            ("when = [\"recipe[¦\"]", &["level"], &["start"]),
            ("when = [\"late.¦\"]", &["Acc", "Done", "Timing"], &["DnDone", "start"]),
            ("when = [\"3 < parts.¦\"]", &["Acc"], &["Done"]),
            ("when = [\"parts.D¦\"]", &["Done", "DnDone"], &["Timing"]),
            ("when = [\"odd.¦\"]", &["CU", "ACC", "PRE"], &["Done"]),
            ("when = [\"T7.¦\"]", &["Acc", "Done"], &[]),
            ("when = [\"drain-pump.¦\"]", &["Open", "Close", "Running"], &["Done", "Rinse"]),
            ("when = [\"drain-p¦\"]", &["drain-pump"], &[]),
            ("when = [\"Hourly.¦\"]", &["Running", "Done"], &[]),
            ("when = [\"Flush1.¦\"]", &["Rinse", "Empty", "amount", "Running"], &["Open"]),
            ("when = [\"p1.¦\"]", &["failed", "hours"], &["wanted", "motor", "amount"]),
            ("when = [\"p1.hours.¦\"]", &["Acc", "Done"], &["failed"]),
            ("when = [\"remote.¦\"]", &["Ok", "Stale"], &[]),
            ("when = [\"$F¦\"]", &["$FirstScan", "$Off"], &["start", "$Hour"]),
            ("when = [\"X¦\"]", &["X0", "X1"], &["X2", "Y0"]),
            ("when = [\"C1¦\"]", &["C10", "C13"], &["C14", "C0"]),
        ],
    );
}

#[test]
fn parameters_and_own_tags_are_offered_in_contacts_of_a_template() {
    let before = RICH.split("[[template]]\nname = \"Flush\"").next().expect("a part").to_owned();
    let wanted: &[&str] = &["wanted", "motor", "failed", "start"];
    check(
        LADDER,
        &before,
        &[
            ("[[template.rung]]\nwhen = [\"¦\"]\n[[program]]\nname = \"Main\"\n", wanted, &[]),
            (
                "[[template.rung]]\ndo = [\"OUT ¦\"]",
                &["motor", "failed", "valve"],
                &["wanted", "start"],
            ),
            ("[[template.rung]]\ndo = [\"TMR ¦\"]", &["hours", "late"], &["parts", "motor"]),
            (
                "[[template.rung]]\ndo = [\"TMR hours preset=¦\"]",
                &["patience", "level"],
                &["motor"],
            ),
            ("[[template.rung]]\nuse = \"¦\"", &[], &["Pump"]),
        ],
    );
}

#[test]
fn mnemonics_and_operands_are_offered_in_instructions() {
    let before = format!("{RICH}\n[[program.stage.rung]]\nwhen = [\"start\"]\n");
    check(
        LADDER,
        &before,
        &[
            ("do = [\"¦\"]", &["OUT", "TMR", "JMP", "STOP", "MATH"], &["CNT", "SR", "TMRA"]),
            ("do = [\"O¦", &["OUT", "ONDTMR"], &["JMP"]),
            (
                "do = [\"OUT ¦\"]",
                &["valve", "p1", "lamps", "Flush1"],
                &["start", "level", "late", "Hourly"],
            ),
            ("do = [\"OUT Y¦\"]", &["Y0", "Y1", "Y2"], &["X0"]),
            ("do = [\"TMR ¦\"]", &["late", "p1"], &["parts", "valve", "preset="]),
            ("do = [\"TMR late ¦\"]", &["preset="], &["late", "valve"]),
            ("do = [\"TMR late preset=¦\"]", &["level", "limit"], &["valve"]),
            ("do = [\"ONDTMR late preset=3s ¦\"]", &["output="], &["preset="]),
            ("do = [\"ONDTMR late preset=3s output=¦\"]", &["valve"], &["start", "level"]),
            ("do = [\"UDCG ¦\"]", &["parts"], &["late"]),
            ("do = [\"MOVE ¦\"]", &["level", "limit", "ratio", "recipe"], &["valve"]),
            (
                "do = [\"MOVE level to=¦\"]",
                &["level", "ratio", "late", "recipe"],
                &["valve", "limit", "$Hour"],
            ),
            ("do = [\"MOVE level to=parts.¦\"]", &["Acc"], &["Done"]),
            ("do = [\"RUN ¦\"]", &["Flush1", "drain-pump"], &["Main", "Hourly"]),
            ("do = [\"HALT ¦\"]", &["Flush1", "Hourly"], &["Main", "Dose"]),
            ("do = [\"CALL ¦\"]", &["Dose"], &["Flush1", "Hourly"]),
            ("do = [\"ENTASK ¦\"]", &["Hourly"], &["Flush1"]),
            ("do = [\"JMP ¦\"]", &["Open", "Close"], &["Rinse", "Main"]),
            ("do = [\"SGDIVRG Open ¦\"]", &["Close"], &[]),
            ("do = [\"SGCONVRG Open Close to=¦\"]", &["Open"], &[]),
            ("do = [\"COPY ¦\"]", &["recipe", "lamps"], &["late"]),
            ("do = [\"MATH ¦\"]", &["level", "valve"], &["limit", "start"]),
            ("do = [\"MATH level = ¦\"]", &["sqrt", "limit", "recipe", "start"], &["rise"]),
            ("do = [\"MATH level = 2 * (li¦\"]", &["limit"], &["level"]),
            ("do = [\"MATH level = limit-le¦\"]", &["level"], &[]),
            ("do = [\"WHAT ¦\"]", &[], &[]),
            ("do = [\"OUT valve\", \"SE¦\"]", &["SET"], &["OUT"]),
        ],
    );
}

#[test]
fn keys_and_names_are_offered_in_uses_tags_and_headers() {
    check(
        LADDER,
        RICH,
        &[
            ("[[program.rung]]\nuse = \"¦\"", &["Pump", "Flush"], &[]),
            ("[[program.rung]]\nuse = ¦", &["Pump"], &[]),
            (
                "[[program.rung]]\nuse = \"Pump\"\nwith = { ¦ }",
                &["wanted", "motor", "patience"],
                &["failed", "amount"],
            ),
            (
                "[[program.rung]]\nuse = \"Pump\"\nwith = { wanted = \"start\", ¦",
                &["motor"],
                &["wanted"],
            ),
            ("[[program.rung]]\nuse = \"Pump\"\nwith = { wanted = \"¦\" }", &["start", "p1"], &[]),
            (
                "[[program.rung]]\nuse = \"Pump\"\nwith = { motor = \"¦\" }",
                &["valve"],
                &["start", "level"],
            ),
            (
                "[[program.rung]]\nuse = \"Pump\"\nwith = { patience = \"¦\" }",
                &["level"],
                &["valve"],
            ),
            ("[[program.rung]]\nallow = [\"¦\"]", &["unused-tag"], &["unknown-key"]),
            ("[[program.rung]]\nallow = [\"unused-tag\", \"¦\"]", &[], &["unused-tag"]),
        ],
    );
    check(
        LADDER,
        "",
        &[
            ("tags.a = { type = \"¦\" }", &["bit", "timer", "sensaphone"], &["contact"]),
            ("tags.a = { type = ¦ }", &["bit"], &[]),
            ("tags.a = { at = \"¦\" }", &["X0", "D0", "MC1", "T0"], &["ST0", "bit"]),
            ("tags.a = { at = \"X0\" }\ntags.b = { at = \"X¦\" }", &["X0", "X1"], &["D0"]),
            ("tags.a = { at = \"CT0.¦\" }", &["Acc", "Done"], &[]),
            ("tags.a = { ¦ }", &["at", "type", "value", "doc", "spare"], &[]),
            ("tags.a = { at = \"X0\", ¦ }", &["doc", "count"], &["at"]),
            ("tags.a = { spare = ¦ }", &["true", "false"], &[]),
            ("tags.a = { at = \"X0\", log = \"¦\" }", &["change"], &[]),
            ("tags.a = { at = \"C0\", priority = \"¦\" }", &["critical", "medium"], &["change"]),
            (
                "[[template]]\n[template.parameters]\nx = { type = \"¦\" }",
                &["contact", "int-out"],
                &["word"],
            ),
            (
                "[ladder]\norder = [\"¦\"]\n[[program]]\nname = \"Main\"\n[[task]]\nname = \"T\"\n",
                &["Main", "T"],
                &[],
            ),
            (
                "[ladder]\norder = [\"Main\", \"¦\"]\n[[program]]\nname = \"Main\"\n[[task]]\n\
              name = \"T\"\n",
                &["T"],
                &["Main"],
            ),
        ],
    );
}

#[test]
fn missing_keys_and_headers_are_offered() {
    let rung = "[[program]]\nname = \"Main\"\n[[program.rung]]\n";
    check(
        LADDER,
        rung,
        &[
            ("¦", &["when", "do", "use", "leg.up", "[[program.rung]]"], &["leg", "branch"]),
            ("wh¦", &["when"], &["do"]),
            ("when = [\"$On\"]\n¦", &["do", "doc"], &["when", "leg.up"]),
            (
                "do = [\"CNT CT0 preset=3\"]\nleg.up = [\"X0\"]\n¦",
                &["leg.rst"],
                &["leg.up", "leg.dn", "do"],
            ),
            ("do = [\"CNT CT0 preset=3\"]\nleg.¦", &["up", "rst"], &["when", "clk"]),
            (
                "[¦",
                &["[[program.rung]]", "[[program.stage]]", "[[program]]", "[tags]"],
                &["[[program.stage.rung]]", "[[template.rung]]"],
            ),
            ("[[pro¦", &["[[program]]", "[[program.rung.branch]]"], &["[tags]"]),
            ("when = [\"$On\"] # ¦", &[], &[]),
            ("[[program]]¦", &[], &[]),
        ],
    );
    check(
        LADDER,
        "[tags]\n",
        &[("a = 1\n[¦", &["[ladder]", "[[program]]"], &["[tags]", "[[program.rung]]"])],
    );
    check(
        CONTROLLER,
        "ladder = [\"plant.toml\"]\n",
        &[
            ("[¦", &["[scan]", "[outputs]", "[[device]]"], &["[tags]"]),
            ("sc¦", &["[scan]"], &["[outputs]"]),
            ("[scan]\n¦", &["period", "watchdog"], &["ladder"]),
            ("[scan]\n¦", &["[outputs]"], &[]),
            ("[scan]\n¦\nperiod = \"10ms\"\n", &["watchdog"], &["period", "[outputs]"]),
            ("[scan]\nperiod = \"10ms\"\n¦", &["watchdog"], &["period"]),
            ("[[device]]\n¦", &["name", "driver", "map"], &[]),
            ("[[watch]]\n¦", &["name", "always", "priority"], &["driver"]),
            ("[[watch]]\nalways = \"!¦\"", &["start", "valve"], &[]),
            ("[[watch]]\npriority = \"¦\"", &["critical", "low"], &["valve"]),
            ("[[device]]\ndriver = \"¦\"", &["simulated", "modbus-tcp"], &["start"]),
            ("[[device]]\nmap = [\n    { ¦", &["from", "to"], &["driver"]),
            ("[[device]]\nmap = [\n    { from = \"¦", &["start", "level"], &[]),
            ("[outputs]\non = [\"¦\"]", &["valve"], &[]),
            ("[memory]\n¦", &["X", "D"], &[]),
            ("[retain]\ntags = [\"¦\"]", &["level"], &[]),
        ],
    );
}

#[test]
fn steps_and_names_are_offered_in_test_files() {
    let head = "controller = \"rungd.toml\"\n[[scenario]]\nname = \"n\"\n";
    check(
        TEST,
        head,
        &[
            ("¦", &["set", "steps"], &["name"]),
            ("steps = [\"¦\"]", &["set", "expect", "within", "power-cut"], &["start "]),
            ("steps = [\"set ¦\"]", &["start", "level", "p1"], &[]),
            ("steps = [\"set start ¦\"]", &["0", "1"], &[]),
            ("steps = [\"expect: ¦\"]", &["valve", "start", "rise"], &[]),
            ("steps = [\"expect ¦\"]", &[], &[]),
            ("steps = [\"within 2s: valve & le¦\"]", &["level"], &["start"]),
            ("steps = [\"hold 1s: level + 1 > ¦\"]", &["level", "valve"], &["rise"]),
            ("steps = [\"hold 1s: Drain.¦\"]", &["Open", "Close", "Running"], &[]),
            ("steps = [\"run 2 ¦\"]", &["scans"], &[]),
            ("steps = [\"pulse start 1s ¦\"]", &["every"], &[]),
            ("steps = [\"reload ¦\"]", &["plant.toml"], &["rungd.toml"]),
            ("set = { ¦ }", &["start", "level"], &["steps"]),
            ("set = { \"p1.¦\" = true }", &["failed"], &[]),
            ("set = { start = ¦ }", &["true", "false"], &[]),
            ("set = { level = 1, ¦ }", &["start"], &["level"]),
        ],
    );
    check(
        TEST,
        "",
        &[
            ("ladder = [\"¦\"]", &["plant.toml", "lib:pid"], &["rungd.toml", "plant.test.toml"]),
            ("controller = \"¦\"", &["rungd.toml"], &["plant.toml"]),
            ("controller = ¦", &["rungd.toml"], &[]),
            ("ladder = ¦", &["plant.toml"], &[]),
            ("ladder = [\"plant.toml\"]\nalways = [\"¦\"]", &["valve"], &[]),
            (
                "ladder = [\"plant.toml\"]\n[¦",
                &["[[scenario]]", "[[random]]", "[retain]", "[prove]"],
                &["[scenario]"],
            ),
            ("ladder = [\"plant.toml\"]\n[prove]\nassume = [\"!¦\"]", &["valve"], &[]),
            ("ladder = [\"plant.toml\"]\n[prove]\ninputs = [\"¦\"]", &["start"], &[]),
        ],
    );
}

#[test]
fn broken_text_around_the_cursor_does_not_hide_items() {
    for broken in ["[[program.rung]\nwhen = [\"a\"\n", "x = \nwhen [\n", "do = [\"OUT\n", "'''\n"] {
        let text = format!("{RICH}\n[[program.rung]]\nwhen = [\"st¦\n[[program.rung]]\n{broken}");
        check(LADDER, "", &[(text.as_str(), &["start"], &["valve"])]);
    }
    check(
        LADDER,
        RICH,
        &[
            ("[[program.rung]]\nwhen = [\"start\",\ndo = [\"OUT va¦\"]", &["valve"], &[]),
            ("[[program.rung]]\nwhen = [\"start\ndo = [\"OUT va¦\"]", &["valve"], &[]),
            ("[[program.rung]]\nwhen =\nd¦", &["do"], &["start"]),
            ("[[program.rung]]\nwhen = [\"start\",\nd¦", &["do"], &["start"]),
        ],
    );
}

#[test]
fn an_item_replaces_the_typed_word_and_describes_its_name() {
    let (_folder, mut editor) = editor(json!({}));
    let text = format!("{RICH}[[program.rung]]\nwhen = [\"!\u{1F600} & st¦xx | valve\"]");
    let line = text.matches('\n').count();
    let found = items(&mut editor, LADDER, &text);
    let start = &found[0];
    assert_eq!(start["label"], "start");
    assert_eq!(start["detail"], "X0");
    assert_eq!(start["documentation"]["value"], "The green button");
    assert_eq!(start["documentation"]["kind"], "plaintext");
    let place = json!({
        "start": { "line": line, "character": 15 },
        "end": { "line": line, "character": 19 },
    });
    assert_eq!(start["textEdit"], json!({ "range": place, "newText": "start" }));
    let found = items(&mut editor, LADDER, &format!("{RICH}[[program.rung]]\nwhen = [\"lev¦\"]"));
    assert_eq!(found[0]["documentation"]["value"], "From 0 to 100.");
    let found = items(&mut editor, LADDER, &format!("{RICH}[[program.rung]]\nwhen = ¦"));
    let start = found.iter().find(|item| item["label"] == "start").expect("it is offered");
    assert_eq!(start["textEdit"]["newText"], "[\"start\"]");
}

#[test]
fn snippets_are_sent_only_to_editors_that_support_them() {
    let text = "[[program]]\nname = \"Main\"\n[[program.rung]]\ndo = [\"TM¦\"]";
    let written = |found: &[Value]| {
        let of = found.iter().find(|item| item["label"] == "TMR").expect("it is offered");
        (of["textEdit"]["newText"].clone(), of["insertTextFormat"].clone())
    };
    let (_folder, mut plain) = editor(json!({}));
    let found = items(&mut plain, LADDER, text);
    assert_eq!(written(&found), (json!("TMR "), Value::Null));
    let item = json!({ "snippetSupport": true, "documentationFormat": ["markdown"] });
    let can = json!({ "textDocument": { "completion": { "completionItem": item } } });
    let (_folder, mut rich) = editor(can);
    let found = items(&mut rich, LADDER, text);
    assert_eq!(written(&found), (json!("TMR ${1:t} preset=${2:preset}"), json!(2)));
    assert_eq!(found[0]["documentation"]["kind"], "markdown");
    let found = items(&mut rich, LADDER, &text.replace("TM¦", "TM¦ T0 preset=3s"));
    assert_eq!(written(&found).0, "TMR");
    let found = items(&mut rich, LADDER, "[[program]]\nna¦");
    assert_eq!(found[0]["textEdit"]["newText"], "name = \"$1\"");
    let found = items(&mut rich, LADDER, "[[program]]\nna¦ = \"x\"");
    assert_eq!(found[0]["textEdit"]["newText"], "name");
}

#[test]
fn the_best_fitting_items_are_first() {
    let (_folder, mut editor) = editor(json!({}));
    let rung = "[[program]]\nname = \"Main\"\n[[program.rung]]\n";
    let text = format!("{rung}leg.up = [\"X0\"]\nleg.rst = [\"X1\"]\ndo = [\"¦\"]");
    let found = items(&mut editor, LADDER, &text);
    assert_eq!(labels(&found)[..2], ["CNT", "UDC"]);
    let text = format!("{rung}do = [\"SR C0..C3\"]\n¦");
    let found = items(&mut editor, LADDER, &text);
    assert_eq!(labels(&found)[..3], ["leg.rst", "leg.data", "leg.clk"]);
}
