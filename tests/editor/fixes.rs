//! Code actions: the actions that the helps of `tests/ui` offer. Each must repair or silence its
//! finding and make no new error. The repair of a warning must change no trace.
//!
//! `fixes.txt` has the titles of each finding's actions, `fixes_pages.txt` those of the wrong
//! examples of `docs/findings`, with the kinds of findings that an action brings.
//! `UPDATE_EXPECT=1` updates them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::editor::client::Editor;
use crate::editor::findings::shipped;
use crate::editor::project::empty;

fn editor(folder: &Path) -> Editor {
    let literals = json!({ "codeActionKind": { "valueSet": ["quickfix"] } });
    let wants =
        json!({ "textDocument": { "codeAction": { "codeActionLiteralSupport": literals } } });
    Editor::with(folder, wants)
}

/// The actions for a diagnostic.
fn actions(editor: &mut Editor, name: &str, diagnostic: &Value) -> Vec<Value> {
    let params = json!({
        "textDocument": { "uri": editor.uri(name) },
        "range": diagnostic["range"],
        "context": { "diagnostics": [diagnostic] },
    });
    let all = editor.ask("textDocument/codeAction", params);
    let all = all.as_array().cloned().unwrap_or_default();
    let is_own = |action: &Value| action["diagnostics"][0] == *diagnostic;
    all.into_iter().filter(is_own).collect()
}

/// A text with the edits of an action.
fn applied(text: &str, action: &Value) -> String {
    let edits = action["edit"]["changes"].as_object().unwrap().values().next().unwrap();
    let offset = |place: &Value| {
        let line = place["line"].as_u64().unwrap() as usize;
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
        let start = starts.into_iter().nth(line).unwrap();
        let wanted = place["character"].as_u64().unwrap() as usize;
        let mut units = 0;
        let rest = text[start..].char_indices();
        let within = rest
            .take_while(|(_, char)| {
                units += char.len_utf16();
                units <= wanted
            })
            .last();
        start + within.map_or(0, |(at, char)| at + char.len_utf8())
    };
    let mut edits: Vec<(usize, usize, &str)> = edits
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            (offset(&range["start"]), offset(&range["end"]), edit["newText"].as_str().unwrap())
        })
        .collect();
    edits.sort_unstable();
    let mut changed = text.to_owned();
    for (start, end, new) in edits.into_iter().rev() {
        changed.replace_range(start..end, new);
    }
    changed
}

/// The trace of `rungd sim` for a single ladder file, column by column; `None` if it cannot be
/// simulated.
fn columns(text: &str) -> Option<BTreeMap<String, Vec<String>>> {
    let folder = empty();
    let (ladder, stimulus) = (folder.path().join("a.toml"), folder.path().join("s.csv"));
    std::fs::write(&ladder, text).unwrap();
    let mut rows = "scan,X0,X1,X2,X3\n".to_owned();
    let mut state = 1_u32;
    for scan in 0..200 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let bit = |at: u32| (state >> (20 + at)) & 1;
        let _ = writeln!(rows, "{scan},{},{},{},{}", bit(0), bit(1), bit(2), bit(3));
    }
    std::fs::write(&stimulus, rows).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("sim").arg(&ladder).arg("--stimulus").arg(&stimulus);
    let out = command.args(["--scans", "200", "--trace", "-"]).output().unwrap();
    let text = out.status.success().then(|| String::from_utf8(out.stdout).unwrap())?;
    let mut rows = text.lines().map(|row| row.split(','));
    let names: Vec<String> = rows.next()?.map(str::to_owned).collect();
    let mut columns = vec![Vec::new(); names.len()];
    for row in rows {
        row.zip(&mut columns).for_each(|(value, column)| column.push(value.to_owned()));
    }
    Some(names.into_iter().zip(columns).collect())
}

/// Checks that every operand of both traces has the same values in both.
fn same_traces(before: &str, after: &str, title: &str) {
    let Some(before) = columns(before) else { return };
    let after = columns(after).expect("a repaired ladder can be simulated");
    for (name, values) in &after {
        let same = before.get(name).is_none_or(|before| before == values);
        assert!(same, "{title}: {name} changes");
    }
}

/// The recorded helps that show a text to write and have no action, and all without an action.
const SHOWN_MAX: usize = 58;
const WITHOUT_MAX: usize = 584;

type Counted = BTreeMap<(String, String), usize>;

/// The number of findings by name and message, without helps; `errors`: errors only.
fn counted(diagnostics: &[Value], errors: bool) -> Counted {
    let mut counted = Counted::new();
    for diagnostic in diagnostics.iter().filter(|of| !errors || of["severity"] == 1) {
        *counted.entry(name(diagnostic)).or_default() += 1;
    }
    counted
}

fn name(diagnostic: &Value) -> (String, String) {
    let message = diagnostic["message"].as_str().unwrap();
    let message = message.split("\nhelp: ").next().unwrap();
    (diagnostic["code"].as_str().unwrap_or("-").to_owned(), message.to_owned())
}

/// Whether a help proposes the nearest name, which may lead to a new error.
fn is_nearest(help: &str) -> bool {
    ["did you mean", "there is", "nearest is", "write `Y0"].iter().any(|words| help.contains(words))
}

/// Tries all actions of a file; returns their titles, by finding.
fn tried(editor: &mut Editor, name_of: &str, text: &str) -> String {
    editor.open_with(name_of, text);
    let mut told = String::new();
    let diagnostics = editor.diagnostics(name_of);
    let (all, errors) = (counted(&diagnostics, false), counted(&diagnostics, true));
    // All actions are asked for before the first edit.
    let mut offers: Vec<(&Value, Vec<Value>)> = Vec::new();
    for diagnostic in &diagnostics {
        if offers.iter().all(|(seen, _)| *seen != diagnostic) {
            offers.push((diagnostic, actions(editor, name_of, diagnostic)));
        }
    }
    for (diagnostic, offered) in offers {
        let own = name(diagnostic);
        let line = diagnostic["range"]["start"]["line"].as_u64().unwrap() + 1;
        let _ = writeln!(told, "{name_of}:{line} {}", own.0);
        let help = diagnostic["message"].as_str().unwrap().split_once("\nhelp: ");
        let repairs = |of: &Value| !of["title"].as_str().unwrap().starts_with("Allow");
        if let Some((_, help)) = help.filter(|_| !offered.iter().any(repairs)) {
            let _ = writeln!(told, "  no repair: {}", help.lines().next().unwrap());
        }
        for action in offered {
            let title = action["title"].as_str().unwrap();
            let mark = if action["isPreferred"] == true { "*" } else { "-" };
            let _ = writeln!(told, "  {mark} {title}");
            editor.replace(name_of, &applied(text, &action));
            let after = editor.diagnostics(name_of);
            let repairs = !title.starts_with("Allow");
            if repairs && diagnostic["severity"] == 2 && errors.is_empty() {
                same_traces(text, &applied(text, &action), title);
            }
            let count = |of: &Counted| of.get(&own).copied().unwrap_or(0);
            assert!(count(&counted(&after, false)) < count(&all), "{name_of}: {title} repairs");
            told.push_str(&warned(&all, &counted(&after, false), repairs));
            let is_first = mark == "-" && help.is_some_and(|(_, help)| is_nearest(help));
            for (error, count) in counted(&after, true).into_iter().filter(|_| !is_first) {
                let before = errors.get(&error).copied().unwrap_or(0);
                assert!(count <= before, "{name_of}:{line}: {title} makes {error:?}");
            }
        }
    }
    editor.close(name_of);
    told
}

/// The kinds of warnings and errors that only the repaired text has, each on a line.
fn warned(before: &Counted, after: &Counted, repairs: bool) -> String {
    let mut brought: Vec<&str> = after.keys().map(|(kind, _)| kind.as_str()).collect();
    brought.retain(|kind| repairs && before.keys().all(|(known, _)| known != kind));
    brought.dedup();
    brought.into_iter().map(|kind| format!("    brings {kind}\n")).collect()
}

/// Each help that shows a text to write is followed by an action, but for those counted here: the
/// number may only fall. A help without a repair stands in `fixes.txt`.
#[test]
fn few_helps_that_show_a_text_have_no_action() {
    let recorded = include_str!("fixes.txt");
    let shows = |help: &str| {
        let words = ["write", "write it as", "declare it under [tags]:", "add", "give it", "use"];
        words.iter().any(|words| help.contains(&format!("{words} `")))
    };
    let without: Vec<&str> =
        recorded.lines().filter_map(|line| line.strip_prefix("  no repair: ")).collect();
    let shown: Vec<&str> = without.iter().copied().filter(|help| shows(help)).collect();
    assert!(shown.len() <= SHOWN_MAX, "{} show a text: {shown:#?}", shown.len());
    assert!(without.len() <= WITHOUT_MAX, "{} without a repair", without.len());
}

/// The wrong example of each page of `docs/findings`: every action of its helps repairs.
#[test]
fn the_helps_of_the_pages_become_actions_that_repair() {
    let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/findings");
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("other.toml"), LADDER).unwrap();
    let mut told = String::new();
    let mut paths: Vec<_> =
        std::fs::read_dir(pages).unwrap().map(|of| of.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let page = std::fs::read_to_string(&path).unwrap();
        let Some((_, wrong)) = page.split_once("<!-- wrong -->") else { continue };
        let wrong = wrong.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
        if !wrong.contains("ladder =") {
            let name = format!("{}.toml", path.file_stem().unwrap().to_str().unwrap());
            std::fs::write(folder.path().join(&name), wrong).unwrap();
            told.push_str(&tried(&mut editor, &name, wrong));
            std::fs::remove_file(folder.path().join(&name)).unwrap();
        }
    }
    expect_test::expect_file!["fixes_pages.txt"].assert_eq(&told);
}

#[test]
fn helps_become_actions_that_repair() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ui");
    let mut editor = editor(&folder);
    let mut told = String::new();
    for name in shipped(&folder) {
        if let Ok(text) = std::fs::read_to_string(folder.join(&name)) {
            told.push_str(&tried(&mut editor, &name, &text));
        }
    }
    // A help may name the file by its whole path.
    let told = told.replace(concat!(env!("CARGO_MANIFEST_DIR"), "/"), "");
    expect_test::expect_file!["fixes.txt"].assert_eq(&told);
}

const WARNED: &str = r#"[tags]
auto = { at = "X0" }
late = { at = "T0" }
idle = { at = "D9" }
level = { at = "D0" }

[[program]]
name = "Main"

[[program.rung]]
when = ["auto | X1 & X2"]
do   = ["TMR late preset=20"]

[[program.rung]]
when = ["late.Done"]
do   = ["MOVE 70000 to=V0", "MOVE 1.5 to=level"]

[[program.rung]]
when = ["late.Acc > 5"]
do   = ["SET Y0", "OUT Y1"]
"#;

#[test]
fn a_repaired_warning_leaves_the_program_as_it_was() {
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("a.toml"), WARNED).unwrap();
    let told = tried(&mut editor, "a.toml", WARNED);
    expect_test::expect![[r#"
        a.toml:4 unused-tag
          - Write `idle = { at = "D9", spare = true }`
          - Delete `idle = { at = "D9" }`
          - Allow `unused-tag` in this file
        a.toml:11 mixed-and-or
          * Write `auto | (X1 & X2)`
          - Allow `mixed-and-or` in this rung
          - Allow `mixed-and-or` in this file
        a.toml:12 bare-timer-value
          * Write `preset=20ms`
          - Allow `bare-timer-value` in this rung
          - Allow `bare-timer-value` in this file
        a.toml:16 constant-saturates
          - Write `MOVE 65535 to=V0`
          - Allow `constant-saturates` in this rung
          - Allow `constant-saturates` in this file
        a.toml:16 lost-fraction
          - Write `1`
          - Allow `lost-fraction` in this rung
          - Allow `lost-fraction` in this file
        a.toml:19 bare-timer-value
          * Write `late.Acc > 5ms`
          - Allow `bare-timer-value` in this rung
          - Allow `bare-timer-value` in this file
        a.toml:20 set-never-reset
          no repair: `RST Y0` in a rung with its condition, or `OUT Y0` if the bit is to follow this rung
          - Allow `set-never-reset` in this rung
          - Allow `set-never-reset` in this file
    "#]].assert_eq(&told);
}

/// The text after the action with this title, for the finding with this message.
fn repaired(name: &str, text: &str, (message, title): (&str, &str)) -> String {
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("a.toml"), LADDER).unwrap();
    editor.open_with(name, text);
    let all = editor.diagnostics(name);
    let has = |of: &&Value| of["message"].as_str().unwrap().contains(message);
    let own = all.iter().find(has).unwrap_or_else(|| panic!("{all:#?}"));
    let offered = actions(&mut editor, name, own);
    let is_meant = |of: &&Value| of["title"] == title;
    applied(text, offered.iter().find(is_meant).unwrap_or_else(|| panic!("{offered:#?}")))
}

const LADDER: &str = "[[program]]\nname = \"Main\"\n\
                      rung = [{ when = [\"X0\"], do = [\"OUT Y0\"] }]\n";

/// The steps are written into the scenario that lacks them.
#[test]
fn a_key_is_written_into_the_table_that_lacks_it() {
    let text = "ladder = [\"a.toml\"]\n\n[[scenario]]\nname = \"one\"\nset = { X0 = true }\n\n\
                [[scenario]]\nname = \"two\"\n\n[[scenario]]\nname = \"three\"\n\
                steps = [\"run 1s\", \"expect: !Y0\"]\n";
    let wanted = text.replacen("name = \"two\"\n", "name = \"two\"\nsteps = [\"run 1s\"]\n", 1);
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("a.toml"), LADDER).unwrap();
    editor.open_with("a.test.toml", text);
    let all = editor.diagnostics("a.test.toml");
    let own = all.iter().find(|of| of["range"]["start"]["line"] == 6).unwrap();
    let offered = actions(&mut editor, "a.test.toml", own);
    let changed: Vec<String> = offered.iter().map(|action| applied(text, action)).collect();
    assert_eq!(changed, [wanted], "{own:#?}");
}

/// A correction of a controller file: it makes no new finding, and it is not marked as preferred.
#[test]
fn a_warning_about_a_setting_is_corrected() {
    let text = "ladder = [\"a.toml\"]\n\n[scan]\nperiod = \"10s\"\nwatchdog = \"30s\"\n";
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("a.toml"), LADDER).unwrap();
    std::fs::write(folder.path().join("c.toml"), text).unwrap();
    let told = tried(&mut editor, "c.toml", text);
    expect_test::expect![[r#"
        c.toml:4 long-period
          - Write `period = "10ms"`
    "#]]
    .assert_eq(&told);
}

#[test]
fn a_sum_in_contacts_gets_a_rung_and_a_tag() {
    let text = "[[program]]\nname = \"Main\"\n\n[[program.rung]]\nwhen = [\"X1\", \
                \"D0 / 2 == 1\"]\ndo = [\"OUT Y0\", \"MOVE 4 to=D0\"]\n";
    let title = "Declare `result = { type = \"int\" }` and write `result == 1`";
    expect_test::expect![[r#"
        [tags]
        result = { type = "int" }

        [[program]]
        name = "Main"

        [[program.rung]]
        when = ["$On"]
        do   = ["MATH result = D0 / 2"]

        [[program.rung]]
        when = ["X1", "result == 1"]
        do = ["OUT Y0", "MOVE 4 to=D0"]
    "#]]
    .assert_eq(&repaired("b.toml", text, ("in a contact", title)));
}

#[test]
fn an_editor_that_knows_only_commands_is_offered_nothing() {
    let folder = empty();
    let mut editor = Editor::new(folder.path());
    editor.open_with("a.toml", WARNED);
    let diagnostics = editor.diagnostics("a.toml");
    assert_eq!(actions(&mut editor, "a.toml", &diagnostics[0]), Vec::<Value>::new());
}
