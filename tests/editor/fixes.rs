//! The helps of the cases of `tests/ui` and of the wrong examples of `docs/findings`, tried: each
//! that shows text to write is followed, by a code action or by a repair made by hand.
//!
//! `fixes.txt` and `fixes_pages.txt` have what was tried for each finding: the titles of the
//! actions, the helps followed by hand (`*.repairs` beside the cases), and the helps that only
//! name something. `UPDATE_EXPECT=1` updates them.

use std::path::Path;

use serde_json::Value;

use crate::editor::client::Editor;
use crate::editor::findings::shipped;
use crate::editor::help_trials::{HelpTrials, actions, applied, editor};
use crate::editor::project::empty;
use rungd_test_support::helps::Repairs;
use rungd_test_support::shares::{Share, in_shares};

/// The wrong example of each page of `docs/findings`, in a file or, if it has several, a folder.
#[test]
fn the_fixes_of_the_example_pages_remove_their_findings() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let pages = root.join("docs/findings");
    let folder = empty();
    let mut editor = editor(folder.path());
    let repairs = Repairs::of(&root.join("tests/editor"));
    let mut trials = HelpTrials::new(&mut editor, repairs);
    let mut paths: Vec<_> =
        std::fs::read_dir(pages).unwrap().map(|of| of.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let page = std::fs::read_to_string(&path).unwrap();
        let page_name = path.file_stem().unwrap().to_str().unwrap();
        let files = wrong_example(&page, page_name);
        for (name, text) in &files {
            let at = folder.path().join(name);
            std::fs::create_dir_all(at.parent().unwrap()).unwrap();
            std::fs::write(at, text).unwrap();
        }
        for (name, text) in &files {
            trials.file(name, text);
        }
        for (name, _) in files {
            std::fs::remove_file(folder.path().join(name)).unwrap();
        }
    }
    expect_test::expect_file!["fixes_pages.txt"].assert_eq(&trials.end());
}

/// The files of the wrong example of a page, with their names.
fn wrong_example(page: &str, page_name: &str) -> Vec<(String, String)> {
    let Some((_, behind)) = page.split_once("<!-- wrong -->") else { return Vec::new() };
    let part = behind.split("<!--").next().unwrap();
    let blocks = part.split("```toml\n").skip(1).map(|of| of.split("```").next().unwrap());
    let named = blocks.map(|text| {
        let title = text.lines().next().and_then(|line| line.strip_prefix("# "));
        match title.filter(|title| title.ends_with(".toml")) {
            Some(title) => (format!("{page_name}/{title}"), text.to_owned()),
            None => (format!("{page_name}.toml"), text.to_owned()),
        }
    });
    named.collect()
}

#[test]
fn code_actions_remove_their_findings() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ui");
    let names = shipped(&folder);
    let done = in_shares(|share| try_files(&folder, &names, share));
    let mut told: Vec<&(usize, String)> = done.iter().flat_map(|(told, _)| told).collect();
    told.sort_by_key(|(at, _)| *at);
    let told: String = told.iter().map(|(_, told)| told.as_str()).collect();
    // A help may name the file by its whole path.
    let told = told.replace(concat!(env!("CARGO_MANIFEST_DIR"), "/"), "");
    expect_test::expect_file!["fixes.txt"].assert_eq(&told);
    let is_unused = |repair: &&String| done.iter().all(|(_, unused)| unused.contains(*repair));
    let unused: Vec<&String> = done[0].1.iter().filter(is_unused).collect();
    assert!(unused.is_empty(), "repairs that no finding needs:\n{unused:#?}");
}

/// Tries the files of a share in an editor of its own. Returns what was tried, by the numbers of
/// the files, and the repairs that none of them needs.
fn try_files(folder: &Path, names: &[String], share: Share) -> (Vec<(usize, String)>, Vec<String>) {
    let mut editor = editor(folder);
    let (mut told, mut unused) = (Vec::new(), Repairs::of(folder).unused());
    for (at, name) in names.iter().enumerate().filter(|(at, _)| share.has(*at)) {
        let Ok(text) = std::fs::read_to_string(folder.join(name)) else { continue };
        let mut trials = HelpTrials::new(&mut editor, Repairs::of(folder));
        trials.file(name, &text);
        let left = trials.unused();
        unused.retain(|repair| left.contains(repair));
        told.push((at, trials.told()));
    }
    (told, unused)
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
fn fixing_a_warning_does_not_change_the_program() {
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("a.toml"), WARNED).unwrap();
    let repair = "@ a.toml `RST Y0` in a rung with its condition, or `OUT Y0` if the bit is to \
                  follow this rung\n- SET Y0\n+ OUT Y0\n";
    let mut trials = HelpTrials::new(&mut editor, Repairs::read(repair));
    trials.file("a.toml", WARNED);
    let told = trials.end();
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
          - Allow `set-never-reset` in this rung
          - Allow `set-never-reset` in this file
          by hand: `RST Y0` in a rung with its condition, or `OUT Y0` if the bit is to follow this rung
    "#]].assert_eq(&told);
}

/// The text after the action with this title, for the finding with this message.
fn repaired(name: &str, text: &str, message: &str, title: &str) -> String {
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
fn a_missing_key_is_inserted_into_its_table() {
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
fn a_warning_about_a_setting_has_a_fix() {
    let text = "ladder = [\"a.toml\"]\n\n[scan]\nperiod = \"10s\"\nwatchdog = \"30s\"\n";
    let folder = empty();
    let mut editor = editor(folder.path());
    std::fs::write(folder.path().join("a.toml"), LADDER).unwrap();
    std::fs::write(folder.path().join("c.toml"), text).unwrap();
    let mut trials = HelpTrials::new(&mut editor, Repairs::default());
    trials.file("c.toml", text);
    let told = trials.end();
    expect_test::expect![[r#"
        c.toml:4 long-period
          - Write `period = "10ms"`
    "#]]
    .assert_eq(&told);
}

#[test]
fn an_operator_on_bits_in_a_contact_is_moved_to_its_own_rung_and_tag() {
    let text = "[[program]]\nname = \"Main\"\n\n[[program.rung]]\nwhen = [\"X1\", \
                \"(D0 & 2) == 1\"]\ndo = [\"OUT Y0\", \"MOVE 4 to=D0\"]\n";
    let title = "Declare `result = { type = \"int\" }` and write `result == 1`";
    expect_test::expect![[r#"
        [tags]
        result = { type = "int" }

        [[program]]
        name = "Main"

        [[program.rung]]
        when = ["$On"]
        do   = ["MATH result = D0 & 2"]

        [[program.rung]]
        when = ["X1", "result == 1"]
        do = ["OUT Y0", "MOVE 4 to=D0"]
    "#]]
    .assert_eq(&repaired("b.toml", text, "of a contact", title));
}

#[test]
fn an_editor_without_code_action_literals_is_offered_no_fix() {
    let folder = empty();
    let mut editor = Editor::new(folder.path());
    editor.open_with("a.toml", WARNED);
    let diagnostics = editor.diagnostics("a.toml");
    assert_eq!(actions(&mut editor, "a.toml", &diagnostics[0]), Vec::<Value>::new());
}
