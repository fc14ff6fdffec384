//! Named cases: functions of the file, called in ladders.

use rungd_import::model::{Fate, ForeignProject};
use rungd_import::plcopen;

use crate::plant;

/// A file with a function `Near` of these variables and this ladder, which a program calls with
/// `number`; the program shows the result in `out`, and sees EN in `enable`.
fn called(interface: &str, ladder: &str) -> ForeignProject {
    let int = |name: &str| format!("<variable name=\"{name}\"><type><INT/></type></variable>");
    let bit = |name: &str| format!("<variable name=\"{name}\"><type><BOOL/></type></variable>");
    let xml = format!(
        "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><pous><pou name=\"Near\" \
         pouType=\"function\"><interface><returnType><BOOL/></returnType><inputVars>{}{}\
         </inputVars>{interface}</interface><body><LD><leftPowerRail localId=\"1\"><position \
         x=\"0\" y=\"0\"/></leftPowerRail>{ladder}</LD></body></pou><pou name=\"prog\" \
         pouType=\"program\"><interface><localVars>{}{}{}</localVars></interface><body><LD>\
         <leftPowerRail localId=\"1\"><position x=\"0\" y=\"0\"/></leftPowerRail>{}<block \
         localId=\"4\" typeName=\"Near\"><position x=\"40\" y=\"10\"/><inputVariables>\
         <variable formalParameter=\"EN\">{}</variable><variable formalParameter=\"Value\">{}\
         </variable></inputVariables><inOutVariables/><outputVariables><variable \
         formalParameter=\"ENO\"/><variable formalParameter=\"OUT\"/></outputVariables></block>\
         <coil localId=\"5\"><position x=\"90\" y=\"10\"/><connectionPointIn><connection \
         refLocalId=\"4\" formalParameter=\"OUT\"/></connectionPointIn><variable>out</variable>\
         </coil></LD></body></pou></pous></types></project>",
        int("Value"),
        int("Limit"),
        int("number"),
        bit("enable"),
        bit("out"),
        input(2, "number") + &contact(3, "enable", 1),
        line(3),
        line(2),
    );
    plcopen::read(&xml).unwrap()
}

fn line(from: u32) -> String {
    format!("<connectionPointIn><connection refLocalId=\"{from}\"/></connectionPointIn>")
}

fn input(id: u32, text: &str) -> String {
    format!(
        "<inVariable localId=\"{id}\"><position x=\"0\" y=\"10\"/><expression>{text}</expression>\
         </inVariable>"
    )
}

fn contact(id: u32, name: &str, from: u32) -> String {
    format!(
        "<contact localId=\"{id}\"><position x=\"20\" y=\"10\"/>{}<variable>{name}</variable>\
         </contact>",
        line(from)
    )
}

fn coil(id: u32, attributes: &str, name: &str, from: u32) -> String {
    format!(
        "<coil localId=\"{id}\" {attributes}><position x=\"90\" y=\"10\"/>{}<variable>{name}\
         </variable></coil>",
        line(from)
    )
}

/// `Near := Value > Limit`, as a coil with these attributes.
fn greater(attributes: &str) -> String {
    let block = "<block localId=\"4\" typeName=\"GT\"><position x=\"40\" y=\"10\"/>\
                 <inputVariables><variable formalParameter=\"IN1\"><connectionPointIn><connection \
                 refLocalId=\"2\"/></connectionPointIn></variable><variable \
                 formalParameter=\"IN2\"><connectionPointIn><connection refLocalId=\"3\"/>\
                 </connectionPointIn></variable></inputVariables><inOutVariables/>\
                 <outputVariables><variable formalParameter=\"OUT\"/></outputVariables></block>";
    input(2, "Value") + &input(3, "Limit") + block + &coil(5, attributes, "Near", 4)
}

#[test]
fn a_function_is_a_template_that_each_call_uses_with_variables_of_its_own() {
    let project = called("", &greater(""));
    let fates = project.outcome.rungs.iter().map(|rung| rung.fate.clone());
    assert_eq!(fates.collect::<Vec<_>>(), [Fate::Exact, Fate::Exact]);
    let mut plc = plant::started(&project);
    for (scan, [enable, number, out]) in
        [[1, 5, 1], [1, 0, 0], [1, 5, 1], [0, 5, 0], [1, 1, 1]].into_iter().enumerate()
    {
        let values = [("enable".to_owned(), enable), ("number".to_owned(), number)];
        plant::scan(&mut plc, scan as u64 * 10, &values);
        assert_eq!(plc.value("out"), i64::from(out), "scan {scan}");
    }
}

#[test]
fn a_function_remembers_nothing_of_its_last_call() {
    // It is set where the limit is exceeded, and nothing resets it.
    let project = called("", &greater("storage=\"set\""));
    let mut plc = plant::started(&project);
    for (scan, [number, out]) in [[5, 1], [0, 0], [1, 1], [0, 0]].into_iter().enumerate() {
        let values = [("enable".to_owned(), 1), ("number".to_owned(), number)];
        plant::scan(&mut plc, scan as u64 * 10, &values);
        assert_eq!(plc.value("out"), i64::from(out), "scan {scan}");
    }
}

#[test]
fn what_a_function_cannot_have_is_the_reason_for_a_stub() {
    let array = "<localVars><variable name=\"all\"><type><array><dimension lower=\"0\" \
                 upper=\"3\"/><baseType><INT/></baseType></array></type></variable></localVars>";
    let itself = "<block localId=\"6\" typeName=\"Near\"><position x=\"40\" y=\"40\"/>\
                  <inputVariables/><inOutVariables/><outputVariables/></block>";
    let timer = "<block localId=\"6\" typeName=\"TON\" instanceName=\"t\"><position x=\"40\" \
                 y=\"40\"/><inputVariables/><inOutVariables/><outputVariables/></block>";
    let written = input(6, "5")
        + "<outVariable localId=\"7\"><position x=\"90\" y=\"40\"/><connectionPointIn><connection \
           refLocalId=\"6\"/></connectionPointIn><expression>Limit</expression></outVariable>";
    for (interface, ladder, wanted) in [
        ("", greater("edge=\"rising\""), "the function Near: an edge has no memory in it"),
        ("", greater("") + timer, "a function block has no memory in it"),
        ("", greater("") + itself, "the function Near: it uses itself, through others too"),
        ("", greater("") + &written, "the input Limit of Near, which it writes, is not connected"),
        ("", contact(2, "EN", 1) + &coil(3, "", "Near", 2), "it names its own EN or ENO"),
        (array, greater(""), "its variable all is no plain value"),
    ] {
        let project = called(interface, &ladder);
        match &project.outcome.rungs.last().unwrap().fate {
            Fate::Todo(why) => assert!(why.contains(wanted), "{why}"),
            other => panic!("{wanted}: {other:?}"),
        }
        assert!(plant::errors(&project).contains("imported-todo"));
    }
}
