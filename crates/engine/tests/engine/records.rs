//! Arrays of records, compared with the arrays that are their columns; arrays of structures,
//! compared with structures that have a name each.

use proptest::prelude::*;
use rungd_test_support::plc::{Plc, plc};

/// Rungs over columns: `@kind[i]` is an element, `@kind` a whole column.
const RUNGS: [&str; 14] = [
    r#"{ when = ["@on[i]"], do = ["OUT Y0", "MOVE @kind[j] to=@kind[i]"] }"#,
    r#"{ when = ["@kind[i] > @kind[2] | @on[1]"], do = ["SET @on[j]", "ADD @kind[i] 3 to=@kind[0]"] }"#,
    r#"{ when = ["@level[i + 1] < 2.5", "X0"], do = ["MATH @level[j] = @level[i] * 1.5 + @kind[i]"] }"#,
    r#"{ when = ["rise(@on[i - 1])"], do = ["RST @on[i]", "OUT @on[3]"] }"#,
    r#"{ when = ["X1"], do = ["COPY @kind[0..2] to=@kind[1..3]", "FILL @kind[i] to=@word"] }"#,
    r#"{ when = ["!X1"], do = ["MATH D0 = sum(@kind) + max(@word[1..2])", "MOVE @word[i] to=i"] }"#,
    r#"{ when = ["@level[0] > @level[j]"], do = ["MOVE @level[i] to=@word[j]", "PONOFF @on[2]"] }"#,
    r#"{ when = ["$IndexError"], do = ["OUT Y1", "MOVE 1 to=j"] }"#,
    r#"{ when = ["$On"], do = ["SUB @word[1] i to=@word[2]", "MATH i = (i + 1) % 5", "MATH @kind[i] = i * 2"] }"#,
    r#"{ leg.data = ["X0"], leg.clk = ["X1"], leg.rst = ["$Off"], do = ["SR @on"] }"#,
    r#"{ when = ["X0"], do = ["TMR @late[0] preset=20ms", "TMR @late[1] preset=@late[0].Acc"] }"#,
    r#"{ when = ["@late[0].Done | @late[1].Acc > 10ms"], do = ["OUT Y2"] }"#,
    r#"{ leg.up = ["@on[0]"], leg.rst = ["X1"], do = ["CNT @parts[0] preset=2"] }"#,
    r#"{ when = ["X0"], do = ["RSTCT @parts[0]", "MOVE @parts[0].Acc to=@kind[j]"] }"#,
];

const FIELDS: [&str; 4] = ["kind", "word", "level", "on"];

/// A rung with the names of a form: `element` has the field and the index.
fn named(rung: &str, element: &dyn Fn(&str, Option<&str>) -> String) -> String {
    let mut pieces = rung.split('@');
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let end = piece.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(piece.len());
        let (field, rest) = piece.split_at(end);
        let index = rest.strip_prefix('[').and_then(|inner| inner.split_once(']'));
        text += &element(field, index.map(|(index, _)| index));
        text += index.map_or(rest, |(_, behind)| behind);
    }
    text
}

/// A record with a field of every kind. It ends with its fields.
pub(super) const STEP: &str = r#"
[[record]]
name = "Step"
[record.fields]
kind = { type = "int", max = 40 }
word = { type = "word" }
level = { type = "real", initial = 1.5 }
on = { type = "bit" }
late = { type = "timer" }
parts = { type = "counter" }
"#;

const RECORD: &str = r#"
[tags]
recipe = { type = "Step", count = 4, initial = [{ kind = 3 }, { on = true }] }
i = { type = "int" }
j = { type = "int" }
"#;

const COLUMNS: &str = r#"
[tags]
recipe_kind = { type = "int", count = 4, initial = [3, 0, 0, 0], max = 40 }
recipe_word = { type = "word", count = 4 }
recipe_level = { type = "real", count = 4, initial = 1.5 }
recipe_on = { type = "bit", count = 4, initial = [false, true, false, false] }
recipe_late_0 = { type = "timer" }
recipe_late_1 = { type = "timer", spare = true }
recipe_parts_0 = { type = "counter" }
i = { type = "int" }
j = { type = "int" }
"#;

/// The values of all columns, and of what the rungs write besides.
fn values(plc: &Plc, element: &dyn Fn(&str, Option<&str>) -> String) -> Vec<i64> {
    let cells = FIELDS.iter().flat_map(|field| (0..4).map(move |at| (*field, at.to_string())));
    let cells = cells.map(|(field, at)| plc.value(&element(field, Some(&at))));
    let others = ["i", "j", "D0", "Y0", "Y1", "Y2"].into_iter().map(|name| plc.value(name));
    let acc = ["late", "parts"].map(|field| element(field, Some("0")) + ".Acc");
    cells.chain(others).chain(acc.iter().map(|name| plc.value(name))).collect()
}

proptest! {
    #[test]
    fn an_array_of_records_is_its_columns(
        rungs in proptest::sample::subsequence(&RUNGS[..], 1..=14).prop_shuffle(),
        scans in proptest::collection::vec((any::<[bool; 2]>(), -1..5_i32, -1..5_i32), 1..12),
    ) {
        let record = |field: &str, at: Option<&str>| match at {
            Some(at) => format!("recipe[{at}].{field}"),
            None => format!("recipe.{field}"),
        };
        let column = |field: &str, at: Option<&str>| match at {
            Some(at) if matches!(field, "late" | "parts") => format!("recipe_{field}_{at}"),
            Some(at) => format!("recipe_{field}[{at}]"),
            None => format!("recipe_{field}"),
        };
        let ladder = |tags: &str, element: &dyn Fn(&str, Option<&str>) -> String| {
            // The rungs of the structures are always there: a reset needs its owner.
            let own = [RUNGS[10], RUNGS[12]].into_iter();
            let others = rungs.iter().copied().filter(|rung| ![RUNGS[10], RUNGS[12]].contains(rung));
            let all: Vec<String> = own.chain(others).map(|rung| named(rung, element)).collect();
            format!("rung = [\n{}\n]\n{tags}", all.join(",\n"))
        };
        let mut by_record = plc(&ladder(&format!("{RECORD}{STEP}"), &record));
        let mut by_column = plc(&ladder(COLUMNS, &column));
        for (bits, i, j) in scans {
            let changes =
                [("X0", bits[0].into()), ("X1", bits[1].into()), ("i", i), ("j", j)];
            by_record.scan(&changes);
            by_column.scan(&changes);
            prop_assert_eq!(values(&by_record, &record), values(&by_column, &column));
        }
    }
}

/// A copy of a record, and the rung that copies its fields one by one while both indexes are inside.
fn copies(from: &str, to: &str) -> [String; 2] {
    let fields = ["kind", "word", "level"]
        .map(|field| format!("\"MOVE {from}.{field} to={to}.{field}\""))
        .join(", ");
    let inside = [from, to].map(|record| match record.split_once('[') {
        Some((_, index)) => format!("{0} >= 0 & {0} < 4", index.trim_end_matches(']')),
        None => "$On".to_owned(),
    });
    let inside = inside.join("\", \"");
    let copy = format!("{{ when = [\"X0\"], do = [\"COPY {from} to={to}\"] }}");
    let each = format!(
        "{{ when = [\"X0\", \"{inside}\"], do = [{fields}, \"MATH {to}.on = {from}.on\"] }}"
    );
    [copy, each]
}

proptest! {
    #[test]
    fn a_copy_of_a_record_is_the_moves_of_its_fields(
        from in proptest::sample::select(vec!["recipe[i]", "recipe[2]", "one", "recipe[one.kind]"]),
        to in proptest::sample::select(vec!["recipe[j]", "recipe[0]", "two"]),
        scans in proptest::collection::vec((any::<bool>(), -1..5_i32, -1..5_i32, -9..50_i32), 1..12),
    ) {
        let tags = format!("{RECORD}{STEP}\n[record.fields.more]\ntype = \"int\"\n");
        let tags = tags.replace("i = {", "one = { type = \"Step\" }\ntwo = { type = \"Step\" }\ni = {");
        let other = "{ when = [\"$On\"], do = [\"MATH recipe[1].level = D1 / 2.0\", \"MOVE D1 to=recipe[2].kind\", \"TMR two.late preset=1s\"] }";
        let [mut whole, mut each] = copies(from, to)
            .map(|rung| plc(&format!("rung = [\n{other},\n{rung},\n{{ when = [\"recipe[1].level > 3.0\"], do = [\"OUT recipe[1].on\"] }}\n]\n{tags}")));
        for (on, i, j, level) in scans {
            let changes = [("X0", on.into()), ("i", i), ("j", j), ("D1", level)];
            whole.scan(&changes);
            each.scan(&changes);
            let element = |field: &str, at: Option<&str>| format!("recipe[{}].{field}", at.unwrap_or_default());
            let singles = ["one", "two"].into_iter().flat_map(|tag| FIELDS.map(|field| format!("{tag}.{field}")));
            let singles: Vec<String> = singles.chain(["two.late.Acc".to_owned()]).collect();
            let all = |plc: &Plc| -> Vec<i64> {
                values(plc, &element).into_iter().chain(singles.iter().map(|name| plc.value(name))).collect()
            };
            prop_assert_eq!(all(&whole), all(&each));
            let outside = |record: &str| match record {
                "recipe[i]" => !(0..4).contains(&i),
                "recipe[j]" => !(0..4).contains(&j),
                _ => false,
            };
            prop_assert_eq!(whole.value("$IndexError"), i64::from(on && (outside(from) || outside(to))));
        }
    }
}

#[test]
fn members_of_structures_are_read_at_their_places() {
    let rungs: Vec<String> = (0..5)
        .map(|at| format!("{{ when = [\"X{at}\"], do = [\"TMR lanes[{at}] preset=20ms\"] }}"))
        .collect();
    let mut plc = plc(&format!(
        "rung = [ {}, {{ when = [\"lanes[i].Done\"], do = [\"OUT Y0\"] }},\n\
         {{ when = [\"$On\"], do = [\"MATH D0 = lanes[i].Acc\", \"MATH D1 = lanes[i].Timing\", \
         \"MATH D2 = lanes[i + 1].Done * 2 + lanes[i].Zero\"] }} ]\n\
         [tags]\nlanes = {{ type = \"timer\", count = 5 }}\ni = {{ type = \"int\" }}\n",
        rungs.join(", ")
    ));
    for scan in 0..40 {
        let inputs =
            [("X0", 1), ("X1", scan % 2), ("X2", 0), ("X3", i32::from(scan > 3)), ("X4", 1)];
        let index = [("i", scan % 7 - 1)];
        plc.scan(&inputs.into_iter().chain(index).collect::<Vec<_>>());
        let at = scan % 7 - 1;
        let member = |at: i32, member: &str| match at {
            0..5 => plc.value(&format!("lanes[{at}].{member}")),
            _ => 0,
        };
        let computed = member(at + 1, "Done") * 2 + member(at, "Zero");
        let expected = [member(at, "Done"), member(at, "Acc"), member(at, "Timing"), computed];
        assert_eq!(plc.values(["Y0", "D0", "D1", "D2"]), expected, "scan {scan}");
    }
}
