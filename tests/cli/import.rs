//! `rungd import` and foreign files as a user runs them: what `--pin` writes passes at once, is the
//! same each time, and fails after a change; `check`, `draw` and `xref` of a foreign file.

use std::fs;

use super::fmt::{rungd, said};
use rungd_test_support::folder::TestFolder;

/// An L5X file with these tags, each `NAME: TYPE`, and these rungs.
fn l5x(tags: &[&str], rungs: &[&str]) -> String {
    let tag = |text: &&str| {
        let (name, kind) = text.split_once(": ").unwrap();
        format!("<Tag Name=\"{name}\" TagType=\"Base\" DataType=\"{kind}\"/>")
    };
    let rung = |text: &&str| format!("<Rung Type=\"N\"><Text><![CDATA[{text}]]></Text></Rung>");
    let (tags, rungs): (String, String) =
        (tags.iter().map(tag).collect(), rungs.iter().map(rung).collect());
    format!(
        "<RSLogix5000Content TargetName=\"Belt\" TargetType=\"Controller\"><Controller \
         Name=\"Belt\"><Tags>{tags}</Tags><Programs><Program Name=\"Belt\" \
         MainRoutineName=\"Run\"><Routines><Routine Name=\"Run\" Type=\"RLL\"><RLLContent>{rungs}\
         </RLLContent></Routine></Routines></Program></Programs></Controller></RSLogix5000Content>"
    )
}

const TAGS: [&str; 7] =
    ["start: BOOL", "stop: BOOL", "motor: BOOL", "t: TIMER", "n: DINT", "level: REAL", "hot: BOOL"];
const RUNGS: [&str; 5] = [
    "[XIC(start) ,XIC(motor) ]XIC(stop)OTE(motor);",
    "MOV(500,t.PRE);",
    "XIC(motor)TON(t,?,?);",
    "XIC(t.DN)ADD(n,1,n);",
    "GRT(level,2.5)OTE(hot);",
];

#[test]
fn what_an_import_pins_passes_and_a_changed_rung_fails() {
    let folder = TestFolder::new("pin");
    let folder = folder.path();
    fs::write(folder.join("belt.L5X"), l5x(&TAGS, &RUNGS)).unwrap();
    let made = rungd(&["import", "belt.L5X", "-o", "belt", "--pin", "4000"], folder);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made.stderr));
    assert!(said(&made.stdout).ends_with("belt/pinned.test.toml\n"), "{}", said(&made.stdout));
    let passed = rungd(&["test", "belt/pinned.test.toml"], folder);
    assert_eq!(
        said(&passed.stdout),
        "belt/pinned.test.toml: 2 passed\n",
        "{}",
        said(&passed.stderr)
    );
    let laid_out = rungd(&["fmt", "--check", "belt/pinned.test.toml"], folder);
    assert_eq!(laid_out.status.code(), Some(0), "{}", said(&laid_out.stdout));
    let ladder = folder.join("belt/programs/belt.toml");
    let text = fs::read_to_string(&ladder).unwrap();
    for (was, now) in [
        ("\"stop\"]", "\"!stop\"]"),
        ("MOVE 500 to", "MOVE 600 to"),
        ("level > 2.5", "level >= 2.5"),
    ] {
        assert!(text.contains(was), "{was}: {text}");
        fs::write(&ladder, text.replacen(was, now, 1)).unwrap();
        let failed = rungd(&["test", "belt/pinned.test.toml"], folder);
        assert_eq!(failed.status.code(), Some(1), "{now}: {}", said(&failed.stdout));
    }
}

#[test]
fn one_seed_pins_the_same_and_another_one_something_else() {
    let folder = TestFolder::new("pin-seed");
    let folder = folder.path();
    fs::write(folder.join("belt.L5X"), l5x(&TAGS, &RUNGS)).unwrap();
    let pinned = |name: &str, seed: &str| {
        let args = ["import", "belt.L5X", "-o", name, "--pin", "300", "--seed", seed];
        assert_eq!(rungd(&args, folder).status.code(), Some(0));
        let text = fs::read_to_string(folder.join(name).join("pinned.test.toml")).unwrap();
        text.split_once("[[scenario]]").unwrap().1.to_owned()
    };
    assert_eq!(pinned("a", "1"), pinned("b", "1"));
    assert_ne!(pinned("c", "1"), pinned("d", "2"));
}

#[test]
fn a_program_with_a_stub_is_not_pinned() {
    let folder = TestFolder::new("pin-stub");
    let folder = folder.path();
    fs::write(folder.join("belt.L5X"), l5x(&TAGS, &["XIC(start)MSG(m);"])).unwrap();
    let made = rungd(&["import", "belt.L5X", "-o", "belt", "--pin", "10"], folder);
    assert_eq!(made.status.code(), Some(1));
    assert!(said(&made.stderr).contains("nothing is pinned"), "{}", said(&made.stderr));
    assert!(!folder.join("belt/pinned.test.toml").exists());
}

#[test]
fn a_foreign_file_is_drawn_checked_and_looked_up_without_an_import() {
    let folder = TestFolder::new("foreign");
    let folder = folder.path();
    let rungs = ["[XIC(start) ,XIC(motor) ]XIC(stop)OTE(motor);", "XIC(start)MSG(m);"];
    fs::write(folder.join("belt.L5X"), format!("\u{feff}\n{}", l5x(&TAGS, &rungs))).unwrap();
    let drawn = rungd(&["draw", "belt.L5X"], folder);
    assert_eq!(drawn.status.code(), Some(0), "{}", said(&drawn.stderr));
    let text = said(&drawn.stdout);
    let blank = " ".repeat(68);
    let rung = format!(
        "1. r0  belt.L5X/programs/belt.toml:8\n│ start   stop{}motor     │\n\
         ├──] [──┬─] [{}( )──────┤\n│ motor │{blank}│\n├──] [──┘{blank}│\n",
        " ".repeat(53),
        "─".repeat(55)
    );
    assert!(text.contains(&rung), "{text}");
    let stub = "NOT TRANSLATED: the instruction MSG\nThe original: XIC(start)MSG(m);\n";
    assert!(text.contains(stub), "{text}");
    let found = rungd(&["xref", "--in", "belt.L5X", "motor"], folder);
    assert_eq!(found.status.code(), Some(0), "{}", said(&found.stderr));
    assert!(said(&found.stdout).contains("OUT motor"), "{}", said(&found.stdout));
    let checked = rungd(&["check", "belt.L5X"], folder);
    assert_eq!(checked.status.code(), Some(78), "{}", said(&checked.stderr));
    let errors = said(&checked.stderr);
    assert!(errors.contains("error[imported-todo]"), "{errors}");
    assert!(errors.contains("belt.L5X/programs/belt.toml:"), "{errors}");
    let refused = rungd(&["check", "--fix", "belt.L5X"], folder);
    assert!(said(&refused.stderr).contains("--fix corrects files of rungd only"));
    let beside = rungd(&["draw", "belt.L5X", "belt.L5X"], folder);
    assert!(said(&beside.stderr).contains("stands alone"), "{}", said(&beside.stderr));
    let made: Vec<_> = fs::read_dir(folder).unwrap().collect();
    assert_eq!(made.len(), 1);
}

#[test]
fn several_files_become_projects_beside_each_other() {
    let folder = TestFolder::new("several");
    let folder = folder.path();
    fs::write(folder.join("one.L5X"), l5x(&TAGS, &RUNGS)).unwrap();
    fs::write(folder.join("two.L5X"), l5x(&TAGS, &["XIC(start)MSG(m);"])).unwrap();
    let made = rungd(&["import", "one.L5X", "two.L5X", "-o", "all"], folder);
    assert_eq!(made.status.code(), Some(1), "{}", said(&made.stderr));
    assert!(folder.join("all/one/controller.toml").exists());
    assert!(folder.join("all/two/import-report.md").exists());
    let refused = rungd(&["import", "one.L5X", "./one.L5X", "-o", "more"], folder);
    assert!(said(&refused.stderr).contains("two files would be imported into more/one"));
    assert!(!folder.join("more").exists());
}

#[test]
fn two_versions_are_drawn_as_the_rungs_that_differ() {
    let folder = TestFolder::new("difference");
    let folder = folder.path();
    let edited = ["XIC(hot)OTE(stop);", "[XIC(start) ,XIC(motor) ]OTE(motor);", RUNGS[4]];
    let old = ["XIC(hot)OTL(start);", RUNGS[0], RUNGS[4]];
    fs::write(folder.join("old.L5X"), l5x(&TAGS, &old[1..])).unwrap();
    fs::write(folder.join("new.L5X"), l5x(&TAGS, &edited)).unwrap();
    let diff = |args: &[&str]| {
        let output = rungd(&[&["draw", "--diff"], args].concat(), folder);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output.stderr));
        said(&output.stdout)
    };
    let text = diff(&["old.L5X", "new.L5X"]);
    for part in [
        "+ ├─] [─────────",
        "- ├──] [──┬─] [──────",
        "+ ├──] [──┬──────────",
        "\n1 rung edited, 1 new, 0 gone\n",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("level"), "{text}");
    assert_eq!(diff(&["old.L5X", "old.L5X"]), "no rung differs\n");
    let ladder = "[[program]]\nname = \"Main\"\n[[program.rung]]\nname = \"a\"\nwhen = [\"X0\"]\ndo = \
                  [\"OUT Y0\"]\n";
    fs::write(folder.join("old.toml"), ladder).unwrap();
    fs::write(folder.join("new.toml"), ladder.replace("X0", "!X0")).unwrap();
    let text = diff(&["old.toml", "new.toml"]);
    assert!(text.contains("Main, rung a is edited  new.toml:3\n- │ X0  "), "{text}");
    assert!(text.ends_with("1 rung edited, 0 new, 0 gone\n"), "{text}");
}
