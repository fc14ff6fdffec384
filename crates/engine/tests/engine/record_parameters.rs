//! A use of a template with a record, compared with the same template with a parameter for each
//! field.

use proptest::prelude::*;
use rungd_test_support::plc::{Plc, plc};

use super::records::STEP;

/// Rungs of a template: `@kind` is a field of its record.
const RUNGS: [&str; 10] = [
    r#"{ when = ["@on"], do = ["OUT first", "ADD @kind 1 to=@kind"] }"#,
    r#"{ when = ["@kind + 1 > D0 | rise(@on)"], do = ["SET @on", "MOVE D0 to=@word"] }"#,
    r#"{ when = ["table[@kind] < @level * 2", "X0"], do = ["MATH @level = @level + table[@kind]"] }"#,
    r#"{ when = ["X1"], do = ["MOVE table[@kind] to=D1", "MATH table[@kind - 1] = @word"] }"#,
    r#"{ when = ["@word.1", "!@kind.0"], do = ["OUT @word.4", "RST @on"] }"#,
    r#"{ when = ["X0", "@on != mine"], do = ["TMR @late preset=20ms", "OUT mine"] }"#,
    r#"{ when = ["@late.Done | @late.Acc == 10ms"], do = ["OUT second", "PONOFF @on"] }"#,
    r#"{ leg.up = ["@on"], leg.rst = ["X1", "@parts.Done"], do = ["CNT @parts preset=2"] }"#,
    r#"{ use = "Inner", name = "in", with = { INNER } }"#,
    r#"{ when = ["X0"], do = ["MOVE @parts.Acc to=@word", "MATH @kind = (@kind + D0) % 4"] }"#,
];

/// Rungs of a template in it.
const INNER: [&str; 2] = [
    r#"{ when = ["@on", "X1"], do = ["SUB @kind 2 to=@kind"] }"#,
    r#"{ when = ["fall(@on)"], do = ["MATH @level = @kind / 2.0"] }"#,
];

const FIELDS: [(&str, &str); 6] = [
    ("kind", "int-out"),
    ("word", "int-out"),
    ("level", "real-out"),
    ("on", "output"),
    ("late", "timer"),
    ("parts", "counter"),
];

const TAGS: &str = r#"
[tags]
recipe = { type = "Step", count = 3, initial = [{ kind = 3 }, { on = true }] }
current = { type = "Step" }
table = { type = "int", count = 4, initial = [10, 20, 30, 40] }
"#;

/// The records of the uses.
const GIVEN: [&str; 3] = ["recipe[0]", "current", "recipe[2]"];

/// A ladder with these rungs in a template; by one parameter of the record, or one for each field.
fn ladder(rungs: &[&str], by_record: bool) -> String {
    let field = if by_record { "step." } else { "" };
    let with = |record: &str| match by_record {
        true => format!("step = \"{record}\""),
        false => {
            let prefix = if record.is_empty() { String::new() } else { format!("{record}.") };
            let all = FIELDS.map(|(field, _)| format!("{field} = \"{prefix}{field}\""));
            all.join(", ")
        }
    };
    let parameters = match by_record {
        true => "step = { type = \"Step\" }".to_owned(),
        false => {
            FIELDS.map(|(field, kind)| format!("{field} = {{ type = \"{kind}\" }}")).join(", ")
        }
    };
    let inner = if by_record { with("step") } else { with("") };
    let text = |rungs: &[&str]| rungs.join(",\n").replace('@', field).replace("INNER", &inner);
    let uses = GIVEN.iter().enumerate().map(|(at, record)| {
        format!("{{ use = \"T\", name = \"u{at}\", with = {{ {} }} }}", with(record))
    });
    let own = ["mine", "first", "second"].map(|tag| format!("{tag} = {{ type = \"bit\" }}"));
    let own = own.join(", ");
    format!(
        "rung = [\n{}\n]\n{TAGS}{STEP}\n[[template]]\nname = \"T\"\nparameters = {{ {parameters} }}\n\
         tags = {{ {own} }}\nrung = [\n{}\n]\n[[template]]\n\
         name = \"Inner\"\nparameters = {{ {parameters} }}\nrung = [\n{}\n]\n",
        uses.collect::<Vec<_>>().join(",\n"),
        text(rungs),
        text(&INNER),
    )
}

/// The values of all fields, and of what the rungs write besides.
fn values(plc: &Plc) -> Vec<i64> {
    let fields = ["kind", "word", "level", "on", "late.Acc", "parts.Acc", "parts.Done"];
    let records = GIVEN.iter().chain(&["recipe[1]"]);
    let cells = records.flat_map(|record| fields.map(|field| format!("{record}.{field}")));
    let others = ["D1", "u0.first", "u2.second", "u0.mine", "u2.mine", "table[0]", "table[3]"];
    cells.chain(others.map(str::to_owned)).map(|name| plc.value(&name)).collect()
}

proptest! {
    #[test]
    fn a_use_with_a_record_equals_one_with_its_fields(
        rungs in proptest::sample::subsequence(&RUNGS[..], 1..=10).prop_shuffle(),
        scans in proptest::collection::vec((any::<[bool; 2]>(), -1..5_i32), 1..12),
    ) {
        let mut by_record = plc(&ladder(&rungs, true));
        let mut by_field = plc(&ladder(&rungs, false));
        for (bits, number) in scans {
            let changes = [("X0", bits[0].into()), ("X1", bits[1].into()), ("D0", number)];
            by_record.scan(&changes);
            by_field.scan(&changes);
            prop_assert_eq!(values(&by_record), values(&by_field));
        }
    }
}
