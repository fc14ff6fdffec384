//! Named cases: what a ladder of PLCopen becomes, and what it does.

use rungd_import::model::{Fate, ForeignProject};
use rungd_import::plcopen;

use super::file;
use crate::plant;

fn contact(id: u32, name: &str, from: u32) -> String {
    format!(
        "<contact localId=\"{id}\"><position x=\"{}\" y=\"10\"/><connectionPointIn><connection \
         refLocalId=\"{from}\"/></connectionPointIn><variable>{name}</variable></contact>",
        id * 30
    )
}

fn coil(id: u32, name: &str, from: &[u32]) -> String {
    let lines: String =
        from.iter().map(|from| format!("<connection refLocalId=\"{from}\"/>")).collect();
    format!(
        "<coil localId=\"{id}\"><position x=\"{}\" y=\"10\"/><connectionPointIn>{lines}\
         </connectionPointIn><variable>{name}</variable></coil>",
        id * 30
    )
}

fn bits(names: &[&str]) -> String {
    let one = |name: &&str| format!("<variable name=\"{name}\"><type><BOOL/></type></variable>");
    names.iter().map(one).collect()
}

fn made(variables: &str, ladder: &str) -> ForeignProject {
    plcopen::read(&file(variables, ladder)).unwrap()
}

fn fate(variables: &str, ladder: &str) -> Fate {
    made(variables, ladder).outcome.rungs[0].fate.clone()
}

#[test]
fn a_bridge_of_contacts_is_kept_whatever_form_it_has() {
    // a - b and c - d, with e from behind a to before d: neither series nor parallel.
    let ladder = [
        contact(2, "a", 1),
        contact(3, "c", 1),
        contact(4, "e", 2),
        contact(5, "b", 2),
        "<contact localId=\"6\"><position x=\"200\" y=\"40\"/><connectionPointIn><connection \
         refLocalId=\"3\"/><connection refLocalId=\"4\"/></connectionPointIn><variable>d</variable>\
         </contact>"
            .to_owned(),
        coil(7, "out", &[5, 6]),
    ]
    .concat();
    let project = made(&bits(&["a", "b", "c", "d", "e", "out"]), &ladder);
    assert_eq!(project.outcome.rungs[0].fate, Fate::Exact);
    let mut plc = plant::started(&project);
    for scan in 0..32_u64 {
        let on = |at: u64| i32::from(scan >> at & 1 == 1);
        let names = ["a", "b", "c", "d", "e"];
        let values: Vec<(String, i32)> =
            (0..5).map(|at| (names[at as usize].to_owned(), on(at))).collect();
        plant::scan(&mut plc, scan * 10, &values);
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|at| on(at) == 1);
        let wanted = (a && b) || ((c || (a && e)) && d);
        assert_eq!(plc.value("out"), i64::from(wanted), "{scan:b}");
    }
}

#[test]
fn many_stages_of_branches_do_not_blow_up() {
    let mut ladder = String::new();
    let mut before = vec![1];
    for stage in 0..40 {
        let lines: String =
            before.iter().map(|from| format!("<connection refLocalId=\"{from}\"/>")).collect();
        let ids = [10 + stage * 2, 11 + stage * 2];
        for id in ids {
            ladder += &format!(
                "<contact localId=\"{id}\"><position x=\"{id}\" \
                y=\"10\"/><connectionPointIn>{lines}\
                 </connectionPointIn><variable>{}</variable></contact>",
                ["a", "b"][(id % 2) as usize]
            );
        }
        before = ids.to_vec();
    }
    ladder += &coil(900, "out", &before);
    let project = made(&bits(&["a", "b", "out"]), &ladder);
    assert_eq!(project.outcome.rungs[0].fate, Fate::Exact);
    assert!(plant::texts(&project).len() < 20_000);
    assert_eq!(plant::errors(&project), "");
}

#[test]
fn what_cannot_be_translated_gets_a_stub_with_its_reason() {
    let variables = bits(&["a", "out"]) + "<variable name=\"s\"><type><string/></type></variable>";
    let variable = |text: &str| {
        format!(
            "<inVariable localId=\"2\"><position x=\"0\" y=\"10\"/><expression>{text}</expression>\
             </inVariable>{}",
            coil(3, "out", &[2])
        )
    };
    for (ladder, wanted) in [
        (variable("a AND b"), "`a AND b`"),
        (variable("s"), "`s`: the type STRING"),
        (variable("5"), "the number `5` where power is wanted"),
        (coil(3, "out", &[99]), "the element 99, which does not exist"),
        (contact(2, "a", 2) + &coil(3, "out", &[2]), "a loop of connections"),
        (
            "<jump localId=\"3\" label=\"x\"><position x=\"1\" y=\"10\"/><connectionPointIn>\
             <connection refLocalId=\"1\"/></connectionPointIn></jump>"
                .to_owned(),
            "the element `jump`",
        ),
    ] {
        match fate(&variables, &ladder) {
            Fate::Todo(why) => assert!(why.contains(wanted), "{why}"),
            other => panic!("{wanted}: {other:?}"),
        }
    }
    let project = made(&variables, &variable("s"));
    assert!(plant::errors(&project).contains("imported-todo"));
}

#[test]
fn a_bit_that_the_file_does_not_declare_is_a_named_difference() {
    let found = fate(&bits(&["out"]), &(contact(2, "a", 1) + &coil(3, "out", &[2])));
    assert_eq!(found, Fate::Different(vec!["`a` is not declared: taken as a BOOL".to_owned()]));
}

/// A block with one input or several; `outputs` are those that it has.
fn block(id: u32, kind: &str, inputs: &[(&str, &str)], outputs: &[&str]) -> String {
    let input = |(name, connection): &(&str, &str)| {
        format!(
            "<variable formalParameter=\"{name}\"><connectionPointIn><connection {connection}/>\
             </connectionPointIn></variable>"
        )
    };
    let output = |name: &&str| format!("<variable formalParameter=\"{name}\"/>");
    let (inputs, outputs): (String, String) =
        (inputs.iter().map(input).collect(), outputs.iter().map(output).collect());
    let instance = if kind == "TON" { "instanceName=\"delay\"" } else { "" };
    format!(
        "<block localId=\"{id}\" typeName=\"{kind}\" {instance}><position x=\"50\" y=\"10\"/>\
         <inputVariables>{inputs}</inputVariables><inOutVariables/><outputVariables>{outputs}\
         </outputVariables></block>"
    )
}

fn literal(id: u32, text: &str) -> String {
    format!(
        "<inVariable localId=\"{id}\"><position x=\"0\" y=\"60\"/><expression>{text}</expression>\
         </inVariable>"
    )
}

#[test]
fn a_not_that_leads_over_a_timer_to_itself_gives_the_timer_its_value_of_the_last_scan() {
    let delay = [("IN", "refLocalId=\"2\" formalParameter=\"OUT\""), ("PT", "refLocalId=\"4\"")];
    let ladder = block(2, "NOT", &[("IN", "refLocalId=\"3\" formalParameter=\"Q\"")], &["OUT"])
        + &block(3, "TON", &delay, &["Q", "ET"])
        + &literal(4, "T#20ms")
        + &coil(5, "out", &[2]);
    let variables =
        bits(&["out"]) + "<variable name=\"delay\"><type><derived name=\"TON\"/></type></variable>";
    let project = made(&variables, &ladder);
    assert_eq!(project.outcome.rungs[0].fate, Fate::Exact);
    let mut plc = plant::started(&project);
    let mut shown = String::new();
    for scan in 0..8 {
        plant::scan(&mut plc, scan * 10, &[]);
        shown.push(if plc.value("out") == 1 { '#' } else { '.' });
    }
    assert_eq!(shown, "###.###.");
}

#[test]
fn a_whole_number_beside_a_real_in_a_compare_is_a_named_difference() {
    let inputs = [("IN1", "refLocalId=\"4\""), ("IN2", "refLocalId=\"5\"")];
    let ladder = block(2, "GT", &inputs, &["OUT"])
        + &literal(4, "n")
        + &literal(5, "144.3")
        + &coil(3, "out", &[2]);
    let project =
        made(&(bits(&["out"]) + "<variable name=\"n\"><type><INT/></type></variable>"), &ladder);
    let why = "a whole number is compared with a REAL, which MatIEC refuses".to_owned();
    assert_eq!(project.outcome.rungs[0].fate, Fate::Different(vec![why]));
    let mut plc = plant::started(&project);
    for (n, wanted) in [(144, 0), (145, 1), (-145, 0)] {
        plant::scan(&mut plc, 0, &[("n".to_owned(), n)]);
        assert_eq!(plc.value("out"), wanted, "{n}");
    }
}

#[test]
fn programs_in_other_languages_are_named_and_open() {
    let text = "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><pous><pou \
                name=\"calc\" pouType=\"program\"><interface/><body><ST><p>a := 1;\nb := \
                2;</p></ST>\
                </body></pou></pous></types></project>";
    let project = plcopen::read(text).unwrap();
    assert_eq!(project.outcome.left_out, ["the program calc is in ST, 2 lines"]);
    assert_eq!(project.outcome.open.len(), 1);
    assert_eq!(plant::errors(&project), "");
}

#[test]
fn rungs_of_two_networks_never_get_one_name() {
    // The second rung of `stop` would be `stop-2`, as the coil's network is called.
    let variables =
        bits(&["a", "stop", "stop_2"]) + "<variable name=\"n\"><type><DINT/></type></variable>";
    let value = |id: u32, text: &str| {
        format!(
            "<inVariable localId=\"{id}\"><position x=\"0\" y=\"60\"/><expression>{text}\
             </expression></inVariable>"
        )
    };
    let second = contact(2, "a", 1) + &coil(3, "stop_2", &[2]);
    let first = value(4, "n")
        + "<block localId=\"5\" typeName=\"ABS\"><position x=\"50\" y=\"60\"/><inputVariables>\
           <variable formalParameter=\"IN\"><connectionPointIn><connection refLocalId=\"4\"/>\
           </connectionPointIn></variable></inputVariables><inOutVariables/><outputVariables>\
           <variable formalParameter=\"OUT\"><connectionPointOut/></variable></outputVariables>\
           </block><block localId=\"6\" typeName=\"GT\"><position x=\"90\" y=\"60\"/>\
           <inputVariables><variable formalParameter=\"IN1\"><connectionPointIn><connection \
           refLocalId=\"5\" formalParameter=\"OUT\"/></connectionPointIn></variable><variable \
           formalParameter=\"IN2\"><connectionPointIn><connection refLocalId=\"7\"/>\
           </connectionPointIn></variable></inputVariables><inOutVariables/><outputVariables>\
           <variable formalParameter=\"OUT\"><connectionPointOut/></variable></outputVariables>\
           </block>"
        + &value(7, "5")
        + "<coil localId=\"8\"><position x=\"150\" y=\"60\"/><connectionPointIn><connection \
           refLocalId=\"6\" formalParameter=\"OUT\"/></connectionPointIn><variable>stop</variable>\
           </coil>";
    let project = made(&variables, &(second + &first));
    assert_eq!(plant::errors(&project), "");
}
