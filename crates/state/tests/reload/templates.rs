//! A reload keeps everything in the uses of templates that has a name, whatever is added before it
//! or edited around it.

use crate::reload::reloaded::*;

/// A ladder with this template and these uses, each with its input.
fn station(template: &str, uses: &[(&str, &str)]) -> String {
    let of = |(name, input): &(&str, &str)| {
        format!("  {{ use = \"Pump\", name = \"{name}\", with = {{ wanted = \"{input}\" }} }},\n")
    };
    let uses: String = uses.iter().map(of).collect();
    format!("{template}\n[[program]]\nname = \"Main\"\nrung = [\n{uses}]\n")
}

const PUMP: &str = r#"
[[template]]
name = "Pump"
[template.parameters]
wanted = { type = "contact" }
[template.tags]
starts = { type = "int" }
failed = { type = "bit" }
hours  = { type = "timer" }
done   = { type = "counter" }
[[template.rung]]
name = "starts"
when = ["rise(wanted)"]
do   = ["ADD starts 1 to=starts", "SET failed"]
[[template.rung]]
name    = "hours"
leg.en  = ["wanted"]
leg.rst = ["$Off"]
do      = ["TMRA hours preset=1h"]
[[template.rung]]
name    = "done"
leg.up  = ["wanted"]
leg.rst = ["$Off"]
do      = ["CNT done preset=9"]
"#;

/// Two pumps; the second one runs.
fn running() -> Reloaded {
    plc(&station(PUMP, &[("p1", "X0"), ("p3", "X2")])).scan(&[("X2", 1)]).scans(2).holds([
        ("p3.starts", 1),
        ("p3.failed", 1),
        ("p3.hours.Acc", 20),
        ("p3.done.Acc", 1),
    ])
}

#[test]
fn a_use_added_in_the_middle_keeps_the_state_of_other_uses() {
    running()
        .reload(&station(PUMP, &[("p1", "X0"), ("p2", "X1"), ("p3", "X2")]))
        .holds([("p3.starts", 1), ("p3.failed", 1), ("p3.hours.Acc", 20), ("p3.done.Acc", 1)])
        .holds([("p2.starts", 0), ("p2.failed", 0), ("p2.hours.Acc", 0), ("p2.done.Acc", 0)])
        // The input was ON all the time: no edge, no count.
        .scan(&[])
        .holds([("p3.starts", 1), ("p3.hours.Acc", 30), ("p3.done.Acc", 1)])
        .scan(&[("X1", 1)])
        .holds([("p2.starts", 1), ("p2.done.Acc", 1)]);
}

#[test]
fn an_edited_template_keeps_the_state_of_named_elements() {
    let edited = PUMP.replace("preset=9", "preset=5").replace(
        "[[template.rung]]\nname = \"starts\"",
        "aaa = { type = \"timer\" }\n[[template.rung]]\nwhen = [\"!wanted\"]\n\
         do = [\"TMR aaa preset=1s\"]\n[[template.rung]]\nname = \"starts\"",
    );
    running()
        .reload(&station(&edited, &[("p1", "X0"), ("p3", "X2")]))
        .holds([("p3.starts", 1), ("p3.failed", 1), ("p3.hours.Acc", 20), ("p3.done.Acc", 1)])
        .scan(&[])
        .holds([("p3.starts", 1), ("p3.hours.Acc", 30), ("p3.done.Acc", 1), ("p1.aaa.Acc", 0)])
        .scan(&[])
        .holds([("p1.aaa.Acc", 10)]);
}

#[test]
fn a_removed_use_loses_its_state() {
    running()
        .reload(&station(PUMP, &[("p3", "X2")]))
        .holds([("p3.starts", 1), ("p3.hours.Acc", 20)])
        .reload(&station(PUMP, &[("p1", "X0")]))
        .holds([("p1.starts", 0), ("p1.failed", 0), ("p1.hours.Acc", 0)])
        .reload(&station(PUMP, &[("p1", "X0"), ("p3", "X2")]))
        .holds([("p3.starts", 0), ("p3.failed", 0), ("p3.hours.Acc", 0), ("p3.done.Acc", 0)]);
}

#[test]
fn a_force_follows_the_name_of_a_tag_of_a_use() {
    running()
        .force("p3.failed", 0)
        .scan(&[])
        .holds([("p3.failed", 0)])
        .reload(&station(PUMP, &[("p1", "X0"), ("p2", "X1"), ("p3", "X2")]))
        .scan(&[("X2", 0)])
        .scan(&[("X2", 1)])
        .holds([("p3.failed", 0), ("p3.starts", 2)]);
}
