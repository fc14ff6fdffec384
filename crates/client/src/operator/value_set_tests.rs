//! Unit tests of files of values: what stands for which operand, and what is no value.

use super::*;
use rungd_engine::isa::Real;

/// The writes of a file, each as `operand=value`; or the messages of its mistakes.
fn read(text: &str) -> Result<Vec<String>, Vec<String>> {
    let (writes, findings) = read_file(text);
    if !findings.is_empty() {
        return Err(findings.into_iter().map(|finding| finding.message).collect());
    }
    let shown = |found: FileWrite| {
        let GivenValue::Text(value) = found.write.value else { panic!("a file gives texts") };
        format!("{}={value}", found.write.operand)
    };
    Ok(writes.into_iter().map(shown).collect())
}

#[test]
fn lists_and_tables_stand_for_elements_and_members_in_file_order() {
    let text = "\
size = 0x1F
recipe = [1, 2, 3]
\"p1.limit\" = 1_000
p2.limit = -7
level = 1.5e-7
wait = \"1m30s\"
lamp = true
steps = [{ kind = 1, target = 20.0 }, { kind = 2 }]
[p3]
limit = 4
[[late]]
on = false
";
    let writes = read(text).unwrap();
    assert_eq!(
        writes.join(" "),
        "size=31 recipe[0]=1 recipe[1]=2 recipe[2]=3 p1.limit=1000 p2.limit=-7 level=1.5e-7 \
         wait=1m30s lamp=true steps[0].kind=1 steps[0].target=20.0 steps[1].kind=2 p3.limit=4 \
         late[0].on=false"
    );
}

#[test]
fn what_is_no_value_is_a_mistake_with_its_place() {
    for (text, message) in [
        ("size = nan", "`size` wants a number, true or false, a duration, or an array of these"),
        ("size = -inf", "not an infinite number or no number"),
        ("size = 2026-11-29", "not a date or time"),
        ("size = []", "not an empty array"),
        ("size = {}", "not an empty table"),
        ("a = [1, [2, {}]]", "`a[1][1]` wants"),
        ("\"\" = 1", "the name of a place has 1 to 512 bytes"),
        ("a = 1\na = 2", "duplicate key"),
        ("this is no TOML", "key with no value"),
    ] {
        let mistakes = read(text).expect_err(text);
        assert!(mistakes[0].contains(message), "{text}: {mistakes:?}");
    }
    let all = read("a = nan\nb = []\nc = 1").expect_err("two mistakes");
    assert_eq!(all.len(), 2, "{all:?}");
    let long = format!("{} = 1", "x".repeat(600));
    assert!(read(&long).is_err());
}

#[test]
fn one_more_value_than_a_change_may_have_is_a_mistake() {
    let list = |count: usize| format!("a = [{}]", vec!["1"; count].join(","));
    assert_eq!(read(&list(WRITES_MAX)).unwrap().len(), WRITES_MAX);
    for count in [WRITES_MAX + 1, 1_000_000] {
        let mistakes = read(&list(count)).unwrap_err();
        assert_eq!(mistakes, ["more than 4096 values, and one change has at most 4096"]);
    }
    let deep = format!("a = {}{}", "[".repeat(5000), "]".repeat(5000));
    assert!(read(&deep).is_err());
}

/// A value as an answer has it.
fn shown(operand: &str, value: BitOrNumber, unit: Option<&str>) -> ShownValue {
    ShownValue {
        operand: operand.to_owned(),
        tag: None,
        address: operand.to_owned(),
        value,
        unit: unit.map(str::to_owned),
        text: None,
        forced: false,
        driven: None,
        unknown: None,
    }
}

#[test]
fn a_file_reads_back_as_the_values_that_were_written_into_it() {
    let word = BitOrNumber::Word;
    let real = |number: f32| BitOrNumber::Real(Real::try_from(number).unwrap());
    let values = [
        shown("size", word(-12), Some("mm\n\u{1b}[2J")),
        shown("recipe[0]", word(1), None),
        shown("recipe[1]", word(2), None),
        shown("recipe[3]", word(4), None),
        shown("p1.limit", word(i32::MIN), None),
        shown("odd \"name\\\u{7}\n=", BitOrNumber::Bit(true), None),
        shown("level[0]", real(f32::MAX), Some("m")),
        shown("level[1]", real(0.1), Some("m")),
        shown("level[2]", real(1e-45), Some("m")),
        shown("drain-pump", BitOrNumber::Bit(false), None),
    ];
    let text = file_text(&values, &[]);
    assert!(text.contains("recipe = [1, 2]\n\"recipe[3]\" = 4\n\"p1.limit\" ="), "{text}");
    assert!(text.contains("size = -12  # mm\\u{a}\\u{1b}[2J\n"), "{text}");
    assert!(text.contains("drain-pump = false\n"), "{text}");
    let expected: Vec<String> = values
        .iter()
        .map(|value| match value.value {
            BitOrNumber::Bit(on) => format!("{}={on}", value.operand),
            number @ (BitOrNumber::Word(_) | BitOrNumber::Real(_)) => {
                format!("{}={number}", value.operand)
            }
        })
        .collect();
    assert_eq!(read(&text).unwrap(), expected);
}

#[test]
fn records_are_tables_and_arrays_of_records_are_lists_of_tables() {
    let word = BitOrNumber::Word;
    let values = [
        shown("recipe[0].kind", word(1), None),
        shown("recipe[1].kind", word(2), Some("mm")),
        shown("recipe[3].kind", word(4), None),
        shown("recipe[0].on", BitOrNumber::Bit(true), None),
        shown("recipe[3].over.Acc", word(30), None),
        shown("p1.step.kind", word(-7), None),
        shown("p1.step.on", BitOrNumber::Bit(false), None),
        shown("p1.limit", word(3), None),
        shown("recipes", word(5), None),
        shown("p1.step.late", word(9), None),
    ];
    let text = file_text(&values, &["p1.step".to_owned(), "recipe".to_owned()]);
    assert_eq!(
        text,
        "\
recipe = [
    { kind = 1, on = true },
    { kind = 2 },
]
\"recipe[3]\" = { kind = 4, over.Acc = 30 }
\"p1.step\" = { kind = -7, on = false, late = 9 }
\"p1.limit\" = 3
recipes = 5
"
    );
    let expected = "recipe[0].kind=1 recipe[0].on=true recipe[1].kind=2 recipe[3].kind=4 \
                    recipe[3].over.Acc=30 p1.step.kind=-7 p1.step.on=false p1.step.late=9 \
                    p1.limit=3 recipes=5";
    assert_eq!(read(&text).unwrap().join(" "), expected);
}
