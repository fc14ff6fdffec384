//! Unit tests of names: the operands of a text, the permitted changes, and the names for
//! completion.

use super::*;
use rungd_engine::isa::Real;
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::nearest::counted;
use rungd_language::source::span::SourceFile;

/// The names of a ladder.
fn names_of(text: &str) -> OperandNames {
    let file = SourceFile { name: "ladder.toml".into(), text: text.to_owned() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    OperandNames::new(&program, &lower(&program).1)
}

/// The names of a ladder with `count` tags and `count` Stages.
fn many(count: usize) -> OperandNames {
    let tags = (0..count).map(|n| format!("tag_{n} = {{ at = \"C{n}\", spare = true }}\n"));
    let stage = |n| format!("[[program.stage]]\nname = \"Stage_{n}\"\nrung = []\n");
    let stages = (0..count).map(stage).collect::<String>();
    let tags = tags.collect::<String>();
    names_of(&format!("[tags]\n{tags}[[program]]\nname = \"Main\"\n{stages}"))
}

#[test]
fn a_wrong_name_is_compared_with_few_candidates() {
    let [few, many] = [40, 2000].map(many);
    for wrong in ["tga_1", "tga_1..tga_2", "Main.Satge_1", "tag_1..tga_2"] {
        counted::take_candidates();
        let message = few.find(wrong).unwrap_err().message;
        assert!(message.contains("did you mean"), "{message}");
        assert!((1..=2 * 50).contains(&counted::take_candidates()), "{wrong}");
        many.find(wrong).unwrap_err();
        assert!((1..=2 * SEARCHED_MAX).contains(&counted::take_candidates()), "{wrong}");
        many.find_one(wrong).unwrap_err();
        assert!(counted::take_candidates() <= 2 * SEARCHED_MAX, "{wrong}");
    }
    // A slip after the beginning of a name is still corrected.
    for (wrong, near) in [("tag_1x99", "tag_1"), ("Main.Stage_19999", "Main.Stage_1999")] {
        let message = many.find(wrong).unwrap_err().message;
        assert!(message.contains(&format!("did you mean `{near}")), "{message}");
    }
}

const LADDER: &str = r#"
[tags]
eye = { at = "X0", doc = "Photo eye" }
parts = { at = "CT0" }
size = { at = "D1", min = 1, max = 500 }
five = { value = 5 }
[[program]]
name = "Main"
rung = [ { leg.up = ["eye"], leg.rst = ["X1"], do = ["CNT parts preset=size"] } ]
[[program]]
name = "Side"
autostart = true
[[program.stage]]
name = "Open"
rung = [ { when = ["$On"], do = ["OUT Y0"] } ]
"#;

fn names() -> OperandNames {
    names_of(LADDER)
}

#[test]
fn a_tag_and_its_address_find_the_same_operand() {
    let names = names();
    let by_tag = names.find_one("parts.Acc").unwrap();
    let by_address = names.find_one("CT0.Acc").unwrap();
    assert_eq!((&by_tag.cell, &by_tag.address), (&by_address.cell, &by_address.address));
    assert_eq!(by_address.tag.as_deref(), Some("parts.Acc"));
    let members: Vec<_> =
        names.find("parts").unwrap().into_iter().map(|member| member.operand).collect();
    let all = ["parts.Acc", "parts.Done", "parts.Reset", "parts.Zero", "parts.DnDone"];
    assert_eq!(members, all);
    assert_eq!(names.find_one("Side.Open").unwrap().address, "Side.Open");
    for (wrong, words) in [
        ("parts", "name a member"),
        ("prats.Acc", "did you mean"),
        ("nothing_like_it", "nothing is called `nothing_like_it` (tags are under [tags]"),
        ("five", "constant, 5"),
        ("Main", "Main.Running"),
        ("X99999", "beyond memory"),
        ("", "a name is missing"),
    ] {
        let message = names.find_one(wrong).unwrap_err().message;
        assert!(message.contains(words) && !message.contains("declare"), "{wrong}: {message}");
    }
}

#[test]
fn each_kind_of_operand_permits_or_refuses_writes_and_forces() {
    let names = names();
    for (name, write, force) in [
        ("eye", true, true),
        ("Y0", true, true),
        ("C5", true, true),
        ("MC1", true, true),
        ("MI1", true, true),
        ("size", true, true),
        ("MIR1", true, true),
        ("parts.Acc", true, true),
        ("N0.PRE", true, true),
        ("parts.Done", false, true),
        ("$FirstScan", false, false),
        ("DST0", false, false),
        ("Side.Open", false, false),
        ("Side.Running", false, false),
    ] {
        let operand = names.find_one(name).unwrap();
        let may = (operand.may_write().is_ok(), operand.may_force().is_ok());
        assert_eq!(may, (write, force), "{name}");
    }
}

#[test]
fn values_are_read_in_every_accepted_notation() {
    let names = names();
    let value = |name: &str, given: &str| {
        let operand = names.find_one(name).unwrap();
        names.number(&operand, &GivenValue::Text(given.into())).map_err(|refusal| refusal.message)
    };
    assert_eq!([value("Y0", "ON"), value("Y0", "off"), value("Y0", "1")], [Ok(1), Ok(0), Ok(1)]);
    assert_eq!([value("size", "12"), value("size", "0x1F")], [Ok(12), Ok(31)]);
    assert_eq!([value("T0.Acc", "1m30s"), value("D5", "-7")], [Ok(90_000), Ok(-7)]);
    let real = |text: &str| value("R1", text).map(|cell| Real::of_cell(cell).to_string());
    assert_eq!(
        [real("12.5"), real("-7"), real("2e-3")].map(Result::unwrap),
        ["12.5", "-7.0", "0.002"]
    );
    for (name, given, words) in [
        ("Y0", "2", "takes ON or OFF"),
        ("size", "0", "takes 1 to 500, not 0"),
        ("V0", "65536", "takes 0 to 65535"),
        ("D5", "99999999999", "takes -2147483648 to 2147483647, not 99999999999"),
        ("size", "99999999999", "takes 1 to 500, not 99999999999"),
        ("size", "1e99", "takes a whole number"),
        ("size", "0xFFFFFFFFFF", "takes 1 to 500, not 0xFFFFFFFFFF"),
        ("D5", "ON", "takes a whole number"),
        ("D5", "1.5", "takes a whole number"),
        ("R1", "ON", "takes a number, as 12.5"),
        ("R1", "1e39", "takes -3.4028235e38 to 3.4028235e38, not 1e39"),
        ("R1", "-99999999999999999999999999999999999999999", "to 3.4028235e38, not -9999"),
        ("D5", "12x", "`12x`"),
        ("D5", "1,5", "takes a whole number"),
        ("T0.Acc", "1,5s", "write `1s500ms`"),
        ("T0.Acc", "1.5s", "write `1s500ms`"),
        ("R1", "1,5", "a decimal comma in a number: write `1.5`"),
        ("R1", "-0,25", "write `-0.25`"),
    ] {
        let message = value(name, given).unwrap_err();
        assert!(message.contains(words), "{message}");
    }
    let size = names.find_one("size").unwrap();
    assert!(names.number(&size, &GivenValue::Number(i64::MAX)).is_err());
    assert!(names.number(&size, &GivenValue::Bit(true)).is_err());
}

#[test]
fn completion_offers_names_up_to_the_dot_and_then_members() {
    let names = names();
    let offered = |prefix: &str| {
        let names = names.beginning(prefix).into_iter();
        names.map(|name| name.name).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(offered("p"), "parts");
    assert_eq!(offered("parts."), "parts.Acc parts.DnDone parts.Done parts.Reset parts.Zero");
    assert_eq!(offered("S"), "Side");
    assert_eq!(offered("Side"), "Side Side.Open Side.Running");
    assert_eq!(offered("nothing"), "");
    assert_eq!(names.beginning("eye")[0].about, "X0: Photo eye");
}

#[test]
fn a_typed_tag_is_found_only_by_its_name() {
    let text = "[tags]\nhours = { type = \"timer\" }\n\
                size = { type = \"int\", doc = \"Of a bin\" }\n[[program]]\nname = \"Main\"\n\
                rung = [ { when = [\"size > 3\"], do = [\"TMR hours preset=1s\"] } ]\n";
    let names = names_of(text);
    let found = names.find("hours").unwrap();
    let said: Vec<_> = found.iter().map(|operand| operand.address.as_str()).collect();
    assert_eq!(said, ["hours.Acc", "hours.Done", "hours.Reset", "hours.Zero", "hours.Timing"]);
    for operand in &found {
        assert_eq!(names.at(operand.cell).unwrap().operand, operand.address);
    }
    for (address, name) in [("T255.Acc", "hours.Acc"), ("D4095", "size"), ("T255", "hours")] {
        let message = names.find_one(address).unwrap_err().message;
        assert!(message.contains(&format!("write `{name}`")), "{message}");
    }
    for range in ["D4090..D4095", "T255..T255", "size..size"] {
        let message = names.find(range).unwrap_err().message;
        assert!(message.contains("can be used only by its name"), "{range}: {message}");
    }
    assert_eq!(names.find("D4090..D4094").unwrap().len(), 5);
    let offered = names.beginning("size");
    assert_eq!(offered.iter().map(|name| &*name.about).collect::<Vec<_>>(), ["int: Of a bin"]);
    assert!(names.beginning("hours.").iter().all(|name| !name.about.contains("T255")));
}

/// A program may have more Stages than one request reads.
#[test]
fn a_block_stands_for_all_its_members_up_to_a_limit() {
    let names = names();
    let found = |text: &str| {
        let found = names.find(text).map_err(|refusal| refusal.message)?;
        Ok::<_, String>(found.into_iter().map(|of| of.operand).collect::<Vec<_>>().join(" "))
    };
    assert_eq!(found("Side"), Ok("Side.Running Side.Open".to_owned()));
    assert_eq!(found(" Main "), Ok("Main.Running".to_owned()));
    assert!(found("Sid").is_err_and(|message| message.contains("nothing is called `Sid`")));
    assert!(names.find_one("Side").is_err());
    let refusal = many(OPERANDS_MAX).find("Main").unwrap_err();
    assert!(refusal.message.starts_with("`Main` has more than 256 operands"), "{refusal:?}");
    assert_eq!(many(OPERANDS_MAX - 1).find("Main").map(|found| found.len()), Ok(OPERANDS_MAX));
}

#[test]
fn metrics_are_bits_words_elements_and_members_and_units_follow_the_address() {
    let text = r#"
[tags]
level = { at = "R0", unit = "m", metric = true }
tank = { at = "R0", spare = true }
pump = { type = "bit", metric = true }
shift = { at = "D10", count = 2, metric = true, unit = "t" }
parts = { type = "counter", metric = true }
plain = { at = "D1", metric = false, unit = "bar", spare = true }
[[program]]
name = "Main"
rung = []
"#;
    let file = SourceFile { name: "ladder.toml".into(), text: text.into() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    assert!(findings.is_empty(), "{findings:#?}");
    let names = OperandNames::new(&program, &lower(&program).1);
    let list = names.metrics();
    assert_eq!(list.operands[..4], ["level", "pump", "shift[0]", "shift[1]"]);
    assert!(list.operands[4..].contains(&"parts.Acc".to_owned()) && list.left_out == 0);
    list.operands.iter().for_each(|operand| assert!(names.find_one(operand).is_ok(), "{operand}"));
    let unit = |operand: &str| names.find_one(operand).expect("it is named").unit;
    assert_eq!(unit("tank").as_deref(), Some("m"), "of the location, by any name");
    assert_eq!(unit("shift[1]").as_deref(), Some("t"));
    assert_eq!((unit("D1").as_deref(), unit("pump")), (Some("bar"), None));
}

#[test]
fn an_operand_follows_its_element_over_a_reload() {
    let with = |tags: [String; 4]| {
        names_of(&format!("[tags]\n{}[[program]]\nname = \"Main\"\nrung = []\n", tags.concat()))
    };
    let size = |at: &str| format!("size = {{ at = \"{at}\", spare = true }}\n");
    let typed = |name: &str| format!("{name} = {{ type = \"int\", spare = true }}\n");
    let old = with([size("D1"), typed("b0"), typed("own"), typed("gone")]);
    let new = with([size("D2"), typed("a0"), typed("own"), String::new()]);
    let [of_tag, own, gone] = ["size", "own", "gone"].map(|name| old.find_one(name).unwrap());
    let moved = new.again(&own).unwrap();
    assert_eq!((&*moved.operand, &*moved.address), ("own", "own"));
    assert_ne!(moved.cell, own.cell, "the tag before it has moved it");
    assert_eq!(moved.cell, new.find_one("own").unwrap().cell);
    // A write to `size` went to D1, and `size` is D2 now.
    let left = new.again(&of_tag).unwrap();
    assert_eq!((&*left.operand, &*left.address, left.tag), ("D1", "D1", None));
    assert_eq!(new.again(&gone), None);
    assert_eq!(old.again(&of_tag), Some(of_tag), "the same program, the same words");
}

#[test]
fn a_set_has_what_can_be_written_back_once_under_its_first_name() {
    use crate::operator::writable::WritableFilter;
    let names = names_of(
        r#"
[tags]
size = { at = "D1", min = 1, max = 500, initial = 12 }
again = { at = "D1" }
low = { at = "D2", min = 5, spare = true }
level = { type = "real" }
recipe = { type = "int", count = 3 }
parts = { at = "CT0" }
eye = { at = "X0" }
hand = { at = "X1" }
five = { value = 5 }
[[program]]
name = "Main"
rung = [
  { leg.up = ["eye", "hand"], leg.rst = ["X2"], do = ["CNT parts preset=size"] },
  { when = ["again > five", "level > 0.0", "recipe[0] > 1"], do = ["OUT Y0"] },
]
"#,
    );
    let size = names.find_one("size").unwrap().cell;
    let content = |cell| if cell == size { 12 } else { 0 };
    let is_moved = |what| names.find_one("eye").unwrap().what == what;
    let filter = WritableFilter { content: &content, is_moved: &is_moved };
    let set = |texts: &[&str]| {
        let texts: Vec<String> = texts.iter().map(|text| (*text).to_owned()).collect();
        let set = names.writable(&texts, &filter)?;
        let operands: Vec<String> = set.operands.into_iter().map(|one| one.operand).collect();
        Ok::<_, RequestRefusal>((operands.join(" "), set.structures.len(), set.read_only))
    };
    // `low` is 0, below its least value: it could not be written back.
    let all = "size level recipe[0] recipe[1] recipe[2] hand";
    assert_eq!(set(&[]).unwrap(), (all.to_owned(), 1, 2));
    let named = set(&["D1", "again", "eye", "parts.Acc", "parts", "$FirstScan"]).unwrap();
    assert_eq!(named, ("size eye parts.Acc".to_owned(), 1, 1));
    assert_eq!(set(&["X0..X1", "recipe"]).unwrap().0, "hand recipe[0] recipe[1] recipe[2]");
    assert!(set(&["siez"]).unwrap_err().message.contains("did you mean `size`"));
    let beyond = set(&["V0..V4095", "C0"]).unwrap_err().message;
    assert!(beyond.contains("more than 4096 values"), "{beyond}");
}

#[test]
fn a_record_stands_for_its_fields() {
    let names = names_of(
        r#"
        [[record]]
        name = "Step"
        fields = { kind = { type = "int" }, late = { type = "timer" } }
        [tags]
        recipe = { type = "Step", count = 2 }
        current = { type = "Step" }
        [[program]]
        name = "Main"
        rung = [ { when = ["recipe[0].kind > current.kind"], do = ["TMR current.late preset=1s"] } ]
        "#,
    );
    let found = |text: &str| -> String {
        let found = names.find(text).unwrap_or_else(|refusal| panic!("{}", refusal.message));
        found.iter().map(|variable| variable.operand.as_str()).collect::<Vec<_>>().join(" ")
    };
    let late = |record: &str| {
        ["Acc", "Done", "Reset", "Zero", "Timing"].map(|m| format!("{record}.late.{m}")).join(" ")
    };
    assert_eq!(found("recipe.kind"), "recipe[0].kind recipe[1].kind");
    assert_eq!(found("recipe[1..1].kind"), "recipe[1].kind");
    assert_eq!(found("recipe[1]"), format!("recipe[1].kind {}", late("recipe[1]")));
    assert_eq!(found("current"), format!("current.kind {}", late("current")));
    assert_eq!(found("recipe"), format!("{} {}", found("recipe[0]"), found("recipe[1]")));
    let refused = names.find_one("recipe[1]").unwrap_err().message;
    assert_eq!(refused, "`recipe[1]` is a record: name a field, `recipe[1].kind`");
}

#[test]
fn a_bit_that_the_ladder_resets_may_be_taken_and_one_that_a_coil_drives_may_not() {
    let names = names_of(
        r#"
[tags]
start = { at = "C0" }
held = { at = "C1" }
driven = { at = "C2" }
read = { at = "C3" }
moved = { at = "C4" }
[[program]]
name = "Main"
rung = [
  { when = ["start"], do = ["RST start", "SET held"] },
  { when = ["read"], do = ["OUT driven"] },
  { when = ["read"], do = ["RST driven", "MATH moved = 0"] },
]
"#,
    );
    let may_take = |name: &str| names.may_take(names.find_one(name).unwrap().what);
    assert_eq!(
        ["start", "moved", "held", "driven", "read"].map(may_take),
        [true, true, false, false, false]
    );
}
