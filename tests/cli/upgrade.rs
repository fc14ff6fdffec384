//! `rungd fmt --upgrade`: random `[[simulated-device]]` tables and the parts that they become give
//! a ladder the same inputs, scan by scan; the files that the command writes.

use std::fs;
use std::sync::Arc;

use super::fmt::{folder, rungd};
use proptest::prelude::*;
use proptest::sample::select;
use rungd_config::load;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_lab::rig::{Rig, RigProgram, RigSetup};
use rungd_language::format::upgraded;
use rungd_language::source::span::SourceFile;

/// A ladder whose bits depend on its inputs, in RUN and at the end of it.
const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["X0 | X3"], do = ["OUT Y0"] },
  { when = ["X1"], do = ["SET Y1"] },
  { when = ["X2"], do = ["RST Y1"] },
  { when = ["X3", "!T0.Done"], do = ["TMR T0 preset=30ms"] },
  { when = ["T0.Done | rise(X4)"], do = ["OUT C0", "OUT Y2"] },
  { when = ["C0"], do = ["RUN Work"] },
]

[[program]]
name = "Work"
autostart = false
[[program.stage]]
name = "First"
rung = [{ when = ["X5"], do = ["JMP Second"] }]
[[program.stage]]
name = "Second"
rung = [{ when = ["!X0"], do = ["EXIT"] }]
"#;

const INPUTS: u32 = 6;
const BITS: [&str; 11] = [
    "Y0",
    "Y1",
    "Y2",
    "C0",
    "T0.Done",
    "$Off",
    "$On",
    "$100ms",
    "X3",
    "Work.Running",
    "Work.Second",
];

/// The keys of a table for an input.
fn rule() -> impl Strategy<Value = String> {
    let ms = || 0..40_u32;
    let bit = || select(&BITS);
    let pulse = (1..30_u32, 1..50_u32, ms()).prop_map(|(on, off, first)| {
        format!("pulse = \"{on}ms\"\nevery = \"{}ms\"\noffset = \"{first}ms\"\n", on + off)
    });
    let follow = (bit(), ms(), proptest::option::of(ms())).prop_map(|(bit, after, release)| {
        let release = release.map(|ms| format!("release = \"{ms}ms\"\n")).unwrap_or_default();
        format!("follows = \"{bit}\"\nafter = \"{after}ms\"\n{release}")
    });
    let keys = prop_oneof![pulse, follow];
    (keys, proptest::option::of(bit()), any::<bool>()).prop_map(|(keys, bit, invert)| {
        let bit = bit.map(|bit| format!("while = \"{bit}\"\n")).unwrap_or_default();
        format!("{keys}{bit}invert = {invert}\n")
    })
}

fn loaded(controller: &str) -> Rig {
    let file = |name: &str, text: &str| SourceFile { name: name.into(), text: text.into() };
    let loaded = load::recorded_files(&[file("c.toml", controller), file("a.toml", LADDER)]);
    let (Some(program), Some(settings)) = (loaded.program, loaded.controller) else {
        panic!("{:#?}\n{controller}", loaded.findings)
    };
    let program = RigProgram::new(&program, &Arc::new(settings));
    Rig::new(&Arc::new(program), &RigSetup::default())
}

/// The memory that both forms share, after a scan.
fn bits(rig: &Rig) -> Vec<bool> {
    let layout = &rig.program().symbols.layout;
    let spaces = [BitSpace::X, BitSpace::Y, BitSpace::C];
    let bit = |space, n| rig.image().bit(layout.bit(Bit::Space(space, n)));
    spaces.into_iter().flat_map(|space| (0..INPUTS).map(move |n| bit(space, n))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn the_old_and_the_upgraded_form_move_the_same_inputs(
        rules in proptest::collection::vec(rule(), 1..=INPUTS as usize),
        period in 1..20_u32,
        stop in 20..120_usize,
        safe in select(&["on = [\"Y0\"]", "hold = [\"Y1\"]", ""]),
    ) {
        let head = format!(
            "ladder = [\"a.toml\"]\n[scan]\nperiod = \"{period}ms\"\n[outputs]\n{safe}\n"
        );
        let table = |(x, rule)| format!("[[simulated-device]]\ninput = \"X{x}\"\n{rule}");
        let old = head + &rules.iter().enumerate().map(table).collect::<String>();
        let new = upgraded(&old).expect("TOML");
        prop_assert!(!new.text.contains("simulated-device"), "{:?}", new.notes);
        let (mut old, mut new) = (loaded(&old), loaded(&new.text));
        for scan in 0..200 {
            for rig in [&mut old, &mut new] {
                if scan == stop {
                    rig.request_stop();
                }
                if (stop + 1..stop + 5).contains(&scan) {
                    rig.tick();
                    continue;
                }
                if scan == stop + 5 {
                    rig.start();
                }
                let is_last = rig.scan();
                rig.end_scan(is_last);
            }
            prop_assert_eq!(bits(&old), bits(&new), "scan {}", scan);
        }
    }
}

const OLD: &str = "\
ladder = [\"a.toml\"]

[[simulated-device]]  # a part
input   = \"X0\"
follows = \"Y0\"
after   = \"20ms\"
";
const NEW: &str = "\
ladder = [\"a.toml\"]

[[device]]
name   = \"simulated\"
driver = \"simulated\"
poll   = \"1ms\"

[[device.part]]       # a part
name  = \"X0\"
kind  = \"delay\"
to    = \"X0\"
in    = \"Y0\"
after = \"20ms\"
";
const NOTE: &str = "1 table `[[simulated-device]]` → `[[device.part]]` of `simulated`";

#[test]
fn an_upgrade_rewrites_a_file_once_and_reports_it() {
    let folder = folder("fmt-upgrade");
    let controller = folder.join("c.toml");
    fs::write(&controller, OLD).expect("written");
    let ladder = "[[program]]\nname = \"Main\"\nrung = [{ when = [\"!X0\"], do = [\"OUT Y0\"] }]\n";
    fs::write(folder.join("a.toml"), ladder).expect("written");
    let said = |args: &[&str], code: i32| {
        let output = rungd(args, &folder);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{text}{error}");
        (text, error)
    };
    assert_eq!(said(&["fmt", "--check", "."], 0).0, "", "the older form is in the layout");
    let (shown, _) = said(&["fmt", "--upgrade", "--check", "."], 1);
    assert!(shown.starts_with(&format!("c.toml: {NOTE}\n")), "{shown}");
    assert_eq!(fs::read_to_string(&controller).expect("readable"), OLD);
    let traced = ["sim", "c.toml", "--scans", "20"];
    let before = said(&traced, 0);
    assert_eq!(said(&["fmt", "--upgrade", "."], 0).0, format!("c.toml: {NOTE}\nc.toml\n"));
    assert_eq!(fs::read_to_string(&controller).expect("readable"), NEW);
    assert_eq!(said(&traced, 0), before);
    assert_eq!(said(&["fmt", "--upgrade", "."], 0).0, "");
    assert!(before.0.contains("X0") && before.1.is_empty(), "{before:?}");
}

/// A file that loads must load afterwards, and one that does not must not begin to.
#[test]
fn no_upgrade_changes_whether_a_file_loads() {
    let folder = folder("fmt-upgrade-loads");
    let controller = folder.join("c.toml");
    let upgraded = |ladder: &str, text: &str| {
        fs::write(folder.join("a.toml"), ladder).expect("written");
        fs::write(&controller, format!("ladder = [\"a.toml\"]\n{text}")).expect("written");
        let before = rungd(&["check", "c.toml"], &folder).status.code();
        let output = rungd(&["fmt", "--upgrade", "c.toml"], &folder);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let checked = rungd(&["check", "c.toml"], &folder);
        assert_eq!(checked.status.code(), before, "{}", String::from_utf8_lossy(&checked.stderr));
        let text = fs::read_to_string(&controller).expect("readable");
        (String::from_utf8_lossy(&output.stdout).into_owned(), text)
    };
    let rule =
        |input: &str| format!("[[simulated-device]]\ninput = \"{input}\"\nfollows = \"Y0\"\n");
    let main = "[[program]]\nname = \"Main\"\nrung = [{ when = [\"!X0\"], do = [\"OUT Y0\"] }]\n";
    // A table between two others: the second part needs a device of its own.
    let between = format!("{}[scan]\nperiod = \"5ms\"\n{}", rule("X0"), rule("X1"));
    let (said, text) = upgraded(main, &between);
    assert!(!text.contains("simulated-device"), "{said}{text}");
    // The name of the plant is a tag of the ladder.
    let tag = format!("[tags]\nsimulated = {{ at = \"C5\", doc = \"spare\" }}\n{main}");
    let (said, text) = upgraded(&tag, &rule("X0"));
    assert!(said.contains("the newer one would not load: the name `simulated`"), "{said}");
    assert!(text.contains("[[simulated-device]]"), "{text}");
    // An error of the older form is none of the newer one.
    let (said, text) = upgraded(main, &rule("C5"));
    assert!(said.contains("correct the file first"), "{said}");
    assert!(text.contains("[[simulated-device]]"), "{text}");
    let (said, _) = upgraded(main, &format!("[device]\nname = \"x\"\n{}", rule("X0")));
    assert!(said.contains("correct the file first"), "{said}");
}
