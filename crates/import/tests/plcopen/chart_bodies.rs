//! Bodies of actions and transitions in charts: when they are executed, and what is said of them.

use rungd_import::model::{Fate, ForeignProject};
use rungd_import::plcopen;

use super::chart_cases::{
    action, chart_file, coil_ladder, fate, link, made, named, step, transition, waiting,
};
use super::interpreter::Machine;
use super::values::Value;
use crate::plant;

/// A list of `actions` or `transitions` with names and ladders.
fn list(kind: &str, bodies: &[(&str, &str)]) -> String {
    let body = |(name, ladder): &(&str, &str)| {
        format!("<{kind} name=\"{name}\"><body>{ladder}</body></{kind}>")
    };
    format!("<{kind}s>{}</{kind}s>", bodies.iter().map(body).collect::<String>())
}

/// A coil behind a contact, in a ladder.
fn contact_ladder(contact: &str, coil: &str) -> String {
    coil_ladder(coil).replace("refLocalId=\"1\"", "refLocalId=\"3\"").replace(
        "<coil",
        &format!(
            "<contact localId=\"3\"><position x=\"5\" y=\"0\"/><connectionPointIn>\
                 <connection refLocalId=\"1\"/></connectionPointIn><variable>{contact}</variable>\
                 </contact><coil"
        ),
    )
}

/// A block that writes a literal to a variable, in a ladder.
fn move_ladder(literal: &str, variable: &str) -> String {
    format!(
        "<LD><inVariable localId=\"1\"><position x=\"0\" y=\"0\"/><expression>{literal}\
         </expression></inVariable><block localId=\"2\" typeName=\"MOVE\"><position x=\"5\" \
         y=\"0\"/><inputVariables><variable formalParameter=\"IN\"><connectionPointIn><connection \
         refLocalId=\"1\"/></connectionPointIn></variable></inputVariables><inOutVariables/>\
         <outputVariables><variable formalParameter=\"OUT\"><connectionPointOut/></variable>\
         </outputVariables></block><outVariable localId=\"4\"><position x=\"9\" y=\"0\"/>\
         <connectionPointIn><connection refLocalId=\"2\" formalParameter=\"OUT\"/>\
         </connectionPointIn><expression>{variable}</expression></outVariable></LD>"
    )
}

/// The value that a variable has before a scan.
struct Change(u64, &'static str, i32);

/// Executes a file here and by the interpreter, in scans of 10 ms: nothing differs. The values of
/// the first bit: `#` is ON.
fn alike(text: &str, bits: &[&str], changes: &[Change]) -> String {
    let project = plcopen::read(text).unwrap();
    let (mut plc, mut machine) = (plant::started(&project), Machine::new(text));
    let mut shown = String::new();
    for scan in 0..8 {
        let mut here = Vec::new();
        for Change(_, name, value) in changes.iter().filter(|change| change.0 == scan) {
            let is_bit = !name.starts_with("delay");
            machine.set(
                name,
                match is_bit {
                    true => Value::Bool(*value == 1),
                    false => Value::Whole((*value).into()),
                },
            );
            here.push(((*name).to_owned(), *value));
        }
        plant::scan(&mut plc, scan * 10, &here);
        machine.scan(scan as i64 * 10);
        for bit in bits {
            let is_on = plc.value(bit) == 1;
            let place = format!("{bit} in scan {scan}\n{}", plant::texts(&project));
            assert_eq!(is_on, machine.value(bit).is_on(), "{place}");
        }
        shown.push(if plc.value(bits[0]) == 1 { '#' } else { '.' });
    }
    shown
}

/// A chart whose step `Run` executes a body that changes a duration, and then another body.
fn changed_duration(literal: &str, qualifier: &str) -> String {
    let ladder = move_ladder(literal, "delay");
    let bodies = list("action", &[("change", &ladder), ("work", &coil_ladder("ran"))]);
    let more = format!("qualifier=\"{qualifier}\" duration=\"delay\"");
    let chart = [
        step(1, "Start", &[]),
        transition(2, "go", &[1]),
        step(3, "Run", &[2]),
        action(20, 3, "", &named("change")),
        action(21, 3, &more, &named("work")),
        transition(4, "NOT go", &[3]),
        step(5, "End", &[4]),
    ];
    let text = chart_file(&["go", "ran", "delay"], &bodies, &chart.concat());
    text.replace("\"delay\"><type><BOOL/>", "\"delay\"><type><TIME/>")
}

#[test]
fn what_is_executed_is_known_before_the_first_body_changes_a_duration() {
    let limited = changed_duration("T#0ms", "L");
    let changes = [Change(0, "delay", 1000), Change(2, "go", 1)];
    assert_eq!(alike(&limited, &["ran", "Run.X"], &changes), "..######");
    // The body makes the time short; the next scan is the first one that sees it.
    let delayed = changed_duration("T#0ms", "D");
    assert_eq!(alike(&delayed, &["ran", "Run.X"], &changes), "...#####");
}

#[test]
fn a_body_of_several_steps_follows_the_order_of_the_text() {
    let bodies = list("action", &[("work", &contact_ladder("go", "ran"))]);
    for qualifiers in [["N", "N"], ["P", "N"], ["N", "P0"], ["P0", "P1"], ["N", "S"], ["S", "R"]] {
        let block = |id, step, at: usize| {
            action(id, step, &format!("qualifier=\"{}\"", qualifiers[at]), &named("work"))
        };
        let chart = [
            step(1, "One", &[]),
            block(20, 1, 0),
            transition(2, "back", &[1]),
            step(3, "Two", &[2]),
            block(21, 3, 1),
            transition(4, "NOT back", &[3]),
            "<jumpStep localId=\"5\" targetName=\"One\"><position x=\"5\" y=\"10\"/>\
             <connectionPointIn><connection refLocalId=\"4\"/></connectionPointIn></jumpStep>"
                .to_owned(),
        ];
        let text = chart_file(&["go", "ran", "back"], &bodies, &chart.concat());
        // What the body writes shows whether it was executed.
        let mut changes: Vec<Change> = (0..8).map(|at| Change(at, "go", (at % 2) as i32)).collect();
        changes.extend([Change(2, "back", 1), Change(4, "back", 0), Change(6, "back", 1)]);
        alike(&text, &["ran", "One.X", "Two.X"], &changes);
    }
}

#[test]
fn a_ladder_that_reads_steps_beside_a_priority_is_named() {
    let ladder = contact_ladder("One.X", "go");
    let lists = list("transition", &[("go", &ladder)]);
    let inline = format!("<inline name=\"go\">{ladder}</inline>");
    for condition in [inline, named("go")] {
        let chart = [
            step(1, "Start", &[]),
            transition(2, "begin", &[1]),
            link("simultaneousDivergence", 3, &[2]),
            step(4, "One", &[3]),
            step(5, "Three", &[3]),
            waiting(6, "priority=\"1\"", "<inline name=\"\"><ST>TRUE</ST></inline>", &[4]),
            waiting(7, "priority=\"2\"", &condition, &[5]),
            step(8, "Two", &[6]),
            step(9, "Four", &[7]),
        ];
        let text = chart_file(&["begin"], &lists, &chart.concat());
        let project = plcopen::read(&text).unwrap();
        let Fate::Different(why) = fate(&project, "transition Three to Four") else {
            panic!("MatIEC shows One as left: {:?}", project.outcome.rungs);
        };
        assert!(why[0].starts_with("a condition reads which steps were active"), "{why:?}");
        assert_eq!(fate(&project, "transition One to Two"), Fate::Exact);
        let changes = [Change(2, "begin", 1)];
        assert_eq!(alike(&text, &["Four.X", "Two.X", "One.X"], &changes), "...#####");
    }
}

/// A chart with a body for `named` that only `more` names.
fn with_body(kind: &str, more: &str) -> ForeignProject {
    let lists = list(kind, &[("idle", &coil_ladder("shown"))]);
    let chart =
        [step(1, "Start", &[]), transition(2, "a", &[1]), step(3, "Run", &[2]), more.to_owned()];
    made(&["a", "shown"], &lists, &chart.concat())
}

#[test]
fn a_body_that_is_never_executed_has_the_fate_of_what_names_it() {
    let lost = step(8, "Lost", &[9]) + &transition(9, "a", &[8]);
    let never = action(20, 8, "", &named("Idle"));
    let refused = action(21, 99, "", &named("idle"));
    let waiting = |id, from: &[u32]| waiting(id, "", &named("idle"), from);
    for (kind, more, is_stub, wanted) in [
        ("action", lost.clone() + &never, false, "no way leads to its step"),
        ("action", refused.clone(), true, "the element 99"),
        ("action", lost + &refused + &never, true, "the element 99"),
        ("action", String::new(), false, "nothing in the chart names it"),
        ("transition", waiting(30, &[]), true, "behind no step"),
        ("transition", String::new(), false, "nothing in the chart names it"),
    ] {
        let project = with_body(kind, &more);
        let (is_todo, why) = match fate(&project, "coil shown") {
            Fate::Todo(why) => (true, why),
            Fate::Different(all) => (false, all.join("; ")),
            Fate::Exact => panic!("{wanted}"),
        };
        assert!(why.contains(wanted), "{wanted}: {why}");
        assert_eq!(is_todo, is_stub, "{wanted}");
    }
}

#[test]
fn a_ladder_that_is_called_as_a_variable_is_in_the_report() {
    let lists = list("action", &[("a", &coil_ladder("shown"))]);
    let chart = step(1, "Start", &[]) + &action(20, 1, "", &named("a"));
    let project = made(&["a", "shown"], &lists, &chart);
    let why = Fate::Todo("`a` is an action and a variable".to_owned());
    assert_eq!(fate(&project, "action N a of Start"), why);
    assert_eq!(fate(&project, "coil shown"), why);
}
