//! Reloads of tags with a `type`: values follow the name, even if the place changes.

use crate::reload::reloaded::{Reloaded, plc};

/// A ladder with these tags and rungs.
fn ladder(tags: &str, rungs: &str) -> String {
    format!("[tags]\n{tags}\n[[program]]\nname = \"Main\"\nrung = [\n{rungs}\n]\n")
}

const TAGS: &str = r#"
hours = { type = "timer" }
parts = { type = "counter" }
drum = { type = "sensaphone" }
size = { type = "int", initial = 12 }
code = { type = "word" }
level = { type = "real", initial = 0.5 }
jam = { type = "bit" }
seen = { type = "bit" }
"#;

const RUNGS: &str = r#"
{ leg.up = ["X0"], leg.rst = ["X1"], do = ["CNT parts preset=size"] },
{ when = ["X0"], do = ["TMR hours preset=1h", "CTU drum preset=9", "PONOFF seen"] },
{ when = ["rise(jam)"], do = ["ADD code 1 to=code"] },
{ when = ["X2"], do = ["SET jam", "MATH level = level * 2", "MOVE 40 to=size"] },
"#;

/// A tag of each type whose place comes before the others, and one that comes after them.
const MORE: &str = r#"
a1 = { type = "timer", spare = true }
a2 = { type = "counter", spare = true }
a3 = { type = "sensaphone", spare = true }
a4 = { type = "int", initial = 7, spare = true }
a5 = { type = "word", spare = true }
a6 = { type = "real", spare = true }
a7 = { type = "bit", initial = true, spare = true }
z = { type = "int", spare = true }
"#;

fn run() -> Reloaded {
    plc(&ladder(TAGS, RUNGS))
        .scan(&[("X0", 1)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1), ("X2", 1)])
        .scan(&[])
}

const HOLDS: [(&str, i64); 9] = [
    ("hours.Acc", 10),
    ("hours.Timing", 1),
    ("parts.Acc", 2),
    ("drum.ACC", 2),
    ("drum.PRE", 9),
    ("size", 40),
    ("code", 1),
    ("jam", 1),
    ("seen", 0),
];

#[test]
fn an_inserted_tag_moves_others_without_changing_their_values() {
    let more = format!("{TAGS}{MORE}");
    let place = |of: &Reloaded, name: &str| of.plc.cell(name);
    let (was, is) = (run(), run().reload(&ladder(&more, RUNGS)));
    for name in ["hours.Acc", "parts.Done", "drum.PRE", "size", "code", "level", "jam"] {
        assert_ne!(place(&was, name), place(&is, name), "{name} has moved");
    }
    is.holds(HOLDS)
        .holds([("a4", 7), ("a7", 1), ("a1.Acc", 0), ("z", 0)])
        // The legs and contacts are still ON: no edge.
        .scan(&[])
        .holds([("hours.Acc", 20), ("parts.Acc", 2), ("drum.ACC", 2), ("code", 1), ("seen", 0)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("parts.Acc", 3), ("drum.ACC", 3), ("seen", 1)])
        .reload(&ladder(TAGS, RUNGS))
        .says("tag a1 is gone, and its value with it")
        .holds([("parts.Acc", 3), ("drum.ACC", 3), ("seen", 1), ("size", 40)]);
}

#[test]
fn forces_follow_the_names_of_their_tags() {
    let more = format!("{TAGS}{MORE}");
    let forced = run().force("size", 3).force("jam", 0).force("parts.Done", 1);
    let after = forced.reload(&ladder(&more, RUNGS)).scan(&[]);
    assert_eq!(after.forces, ["size", "jam", "parts.Done"].map(|name| after.plc.cell(name)));
    after.holds([("size", 3), ("jam", 0), ("parts.Done", 1)]);
}

#[test]
fn a_force_of_a_removed_tag_ends() {
    let less = TAGS.replace("code = { type = \"word\" }\n", "");
    let rungs = RUNGS.replace("ADD code 1 to=code", "OUT C1");
    let after = run().force("code", 900).reload(&ladder(&less, &rungs));
    assert!(after.forces.is_empty());
    after
        .says("tag code is gone, and its value with it; its force ends")
        .reload(&ladder(TAGS, RUNGS))
        .holds([("code", 0), ("size", 40)]);
}

#[test]
fn a_tag_with_a_changed_type_starts_again() {
    let other = TAGS.replace("code = { type = \"word\" }", "code = { type = \"int\" }");
    run()
        .force("code", 900)
        .reload(&ladder(&other, RUNGS))
        .says("tag code changed from `word` to `int`: it starts again; its force ends")
        .holds([("code", 0), ("size", 40), ("parts.Acc", 2)]);
}

#[test]
fn a_structure_with_a_changed_owner_starts_again() {
    let rungs = RUNGS.replace("CTU drum preset=9", "CTD drum preset=9");
    run().reload(&ladder(TAGS, &rungs)).holds([("drum.ACC", 0), ("parts.Acc", 2)]);
}

/// The same tags with addresses.
fn addressed() -> String {
    let mut tags = TAGS.to_owned();
    for (kind, at) in [("timer", "T3"), ("counter", "CT4"), ("sensaphone", "N5"), ("int", "D6")] {
        tags = tags.replace(&format!("type = \"{kind}\""), &format!("at = \"{at}\""));
    }
    for (kind, at) in [("word", "V7"), ("real", "R8"), ("bit", "C9")] {
        tags = tags.replacen(&format!("type = \"{kind}\""), &format!("at = \"{at}\""), 1);
    }
    tags.replace("type = \"bit\"", "at = \"C10\"")
}

#[test]
fn a_tag_keeps_its_state_when_its_address_becomes_a_type_and_back() {
    let forced = plc(&ladder(&addressed(), RUNGS))
        .scan(&[("X0", 1)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1), ("X2", 1)])
        .scan(&[])
        .holds(HOLDS)
        .force("code", 5);
    let typed = forced.reload(&ladder(TAGS, RUNGS));
    assert_eq!(typed.forces, [typed.plc.cell("code")]);
    let back = typed
        .says("tag size has the type `int` instead of the address D6")
        .holds([("hours.Acc", 10), ("parts.Acc", 2), ("drum.ACC", 2), ("size", 40), ("code", 5)])
        .scan(&[])
        .holds([("hours.Acc", 20), ("parts.Acc", 2), ("drum.ACC", 2), ("seen", 0)])
        .reload(&ladder(&addressed(), RUNGS));
    assert_eq!(back.forces, [back.plc.cell("code")]);
    back.says("tag size has the address D6 now, which takes over its value").scan(&[]).holds([
        ("hours.Acc", 30),
        ("parts.Acc", 2),
        ("drum.ACC", 2),
        ("size", 40),
        ("D6", 40),
    ]);
}

#[test]
fn an_address_that_is_still_used_keeps_its_force() {
    let old = "size = { at = \"D6\" }";
    let rungs = "{ when = [\"X0\"], do = [\"MOVE size to=D7\"] },";
    let both = "{ when = [\"X0\"], do = [\"MOVE size to=D7\", \"MOVE D6 to=D8\"] },";
    let after = plc(&ladder(old, rungs))
        .scan(&[("X0", 1), ("size", 31)])
        .force("size", 32)
        .reload(&ladder("size = { type = \"int\" }", both));
    assert_eq!(after.forces, [after.plc.cell("D6")]);
    after
        .says("tag size has the type `int` instead of the address D6; the force stays on D6")
        .holds([("size", 32), ("D6", 32)]);
}

#[test]
fn an_address_that_was_already_used_keeps_its_value() {
    let both = "{ when = [\"X0\"], do = [\"MOVE size to=D7\", \"MOVE D6 to=D8\"] },";
    plc(&ladder("size = { type = \"int\" }", both))
        .scan(&[("X0", 1), ("size", 31), ("D6", 99)])
        .reload(&ladder("size = { at = \"D6\" }", both))
        .says("tag size has the address D6 now, and its value is gone")
        .holds([("size", 99)]);
}

#[test]
fn a_cell_that_changes_between_an_address_and_a_placed_tag_starts_again() {
    let rungs = "{ when = [\"X0\"], do = [\"MOVE size to=D7\"] },";
    let named = "{ when = [\"X0\"], do = [\"MOVE size to=D7\", \"MOVE D4095 to=D8\"] },";
    let after = plc(&ladder("size = { type = \"int\" }", named))
        .scan(&[("size", 31), ("D4095", 99)])
        .force("D4095", 98)
        .reload(&ladder("size = { type = \"int\" }", rungs));
    assert!(after.forces.is_empty());
    after
        .says("D4095 is not named any more: its force ends")
        .holds([("size", 31)])
        .reload(&ladder("size = { type = \"int\" }", named))
        .holds([("size", 31), ("D4095", 0)]);
}

#[test]
fn a_moved_preset_tag_is_not_reported_as_a_changed_preset() {
    let more = format!("{TAGS}{MORE}");
    let report = run().reload(&ladder(&more, RUNGS)).report;
    assert!(!report.iter().any(|line| line.contains("preset")), "{report:#?}");
    let report = run().reload(&ladder(TAGS, &RUNGS.replace("preset=size", "preset=code"))).report;
    assert!(report.contains(&"preset of parts size → code".to_owned()), "{report:#?}");
}

#[test]
fn a_typed_tag_with_a_new_name_starts_again() {
    let (tags, rungs) = (TAGS.replace("size", "volume"), RUNGS.replace("size", "volume"));
    run()
        .reload(&ladder(&tags, &rungs))
        .says("tag size is gone, and its value with it")
        .holds([("volume", 12)]);
}

#[test]
fn a_moved_typed_array_keeps_its_values_without_a_report_line() {
    let tags = "bits = { type = \"bit\", count = 4 }\n\
                recipe = { type = \"int\", count = 3, initial = [100, 7, 3] }";
    let more =
        format!("aa = {{ type = \"bit\", initial = true }}\nab = {{ type = \"int\" }}\n{tags}");
    let rungs = "{ when = [\"bits[D1]\"], do = [\"MOVE recipe[D2] to=D3\"] },";
    let rungs_more = format!("{rungs}{{ when = [\"aa\"], do = [\"MOVE ab to=D4\"] }},");
    let after = plc(&ladder(tags, rungs))
        .scan(&[("recipe[0]", 55)])
        .force("bits[2]", 1)
        .reload(&ladder(&more, &rungs_more))
        .says("aa is new: ON")
        .holds([("recipe[0]", 55), ("recipe[2]", 3), ("bits[2]", 1)]);
    assert_eq!(after.forces, [after.plc.cell("bits[2]")]);
    let about = |line: &&String| line.contains("bits") || line.contains("recipe");
    assert_eq!(after.report.iter().find(about), None, "{:#?}", after.report);
    let back = after.reload(&ladder(tags, rungs)).holds([("recipe[0]", 55), ("bits[2]", 1)]);
    assert_eq!(back.report.iter().find(about), None, "{:#?}", back.report);
}

#[test]
fn an_array_that_changes_between_address_and_type_has_one_report_line() {
    let at = "tot = { at = \"D100\", count = 3 }";
    let typed = "tot = { type = \"int\", count = 3 }";
    let rungs = "{ when = [\"X0\"], do = [\"MOVE tot[D1] to=D3\"] },";
    let lines = |of: &Reloaded| of.report.iter().filter(|line| line.contains("tot")).count();
    let there = plc(&ladder(at, rungs)).scan(&[("tot[1]", 7)]).reload(&ladder(typed, rungs));
    assert_eq!(lines(&there), 1, "{:#?}", there.report);
    let back = there
        .says("tag tot has the type `int` instead of the address D100")
        .holds([("tot[1]", 7)])
        .reload(&ladder(at, rungs));
    assert_eq!(lines(&back), 1, "{:#?}", back.report);
    back.says("tag tot has the address D100 now, which takes over its value")
        .holds([("tot[1]", 7)]);
}

#[test]
fn an_array_with_new_elements_has_one_report_line() {
    let array = |count: u32| format!("recipe = {{ type = \"int\", count = {count}, initial = 9 }}");
    let rungs = "{ when = [\"X0\"], do = [\"MOVE recipe[D2] to=D3\"] },";
    let about = |of: &Reloaded| -> Vec<String> {
        of.report.iter().filter(|line| line.contains("recipe")).cloned().collect()
    };
    let new = plc(&ladder("", "")).force("D4095", 5).reload(&ladder(&array(4), rungs));
    assert_eq!(about(&new), ["recipe: 4 elements are new, with their `initial`"]);
    let more = new.scan(&[("recipe[1]", 7)]).reload(&ladder(&array(6), rungs));
    assert_eq!(
        about(&more),
        ["tag recipe has 6 elements instead of 4; new: recipe[4] to recipe[5]"]
    );
    let less = more.holds([("recipe[1]", 7), ("recipe[5]", 9)]).reload(&ladder(&array(2), rungs));
    assert_eq!(
        about(&less),
        ["tag recipe has 2 elements instead of 6; removed, with their values: recipe[2] to \
          recipe[5]"]
    );
    less.holds([("recipe[1]", 7)]);
}
