//! A project as PLCopen XML (TC6 2.01): the file around its ladders. `ladder_xml` writes those.
//!
//! The same project gives the same file, byte for byte: it has no date of its own.

use rungd_base::scan_period::ScanPeriod;
use std::fmt::Write as _;

use super::ladder_xml;
use super::project::{ExportedProject, ExportedUnit, ExportedVariable, VariableRole};
use super::xml_text::paragraph;
use crate::svg::escaped;

/// The namespace of TC6 2.01.
const NAMESPACE: &str = "http://www.plcopen.org/xml/tc6_0201";
/// The date that the standard requires; the file's own date is that of its commit.
const DATE: &str = "1970-01-01T00:00:00";

/// The text of a file with a project, whose task has this interval.
pub(super) fn file(project: &ExportedProject, period: ScanPeriod) -> String {
    let name = escaped(&project.name);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<project xmlns=\"{NAMESPACE}\" \
         xmlns:xhtml=\"http://www.w3.org/1999/xhtml\">\n<fileHeader companyName=\"\" \
         productName=\"rungd\" productVersion=\"{}\" creationDateTime=\"{DATE}\"/>\n\
         <contentHeader name=\"{name}\" modificationDateTime=\"{DATE}\">\n<coordinateInfo>\n",
        env!("CARGO_PKG_VERSION")
    );
    for language in ["fbd", "ld", "sfc"] {
        let _ = writeln!(text, "<{language}><scaling x=\"10\" y=\"10\"/></{language}>");
    }
    text += "</coordinateInfo>\n</contentHeader>\n<types>\n<dataTypes/>\n<pous>\n";
    project.units.iter().for_each(|unit| text += &self::unit(unit));
    text += "</pous>\n</types>\n<instances>\n<configurations>\n<configuration name=\"config\">\n\
             <resource name=\"resource1\">\n";
    let _ =
        writeln!(text, "<task name=\"scan\" priority=\"0\" interval=\"T#{}\">", interval(period));
    for program in project.units.iter().filter(|unit| unit.is_program) {
        let name = &program.name;
        let _ = writeln!(text, "<pouInstance name=\"instance0\" typeName=\"{name}\"/>");
    }
    text += "</task>\n</resource>\n</configuration>\n</configurations>\n</instances>\n</project>\n";
    text
}

/// A program or function block.
fn unit(unit: &ExportedUnit) -> String {
    let kind = if unit.is_program { "program" } else { "functionBlock" };
    let mut text = format!("<pou name=\"{}\" pouType=\"{kind}\">\n<interface>\n", unit.name);
    let lists = [
        (VariableRole::Input, "inputVars"),
        (VariableRole::Output, "outputVars"),
        (VariableRole::Local, "localVars"),
    ];
    for (usage, list) in lists {
        let own: Vec<&ExportedVariable> =
            unit.variables.iter().filter(|variable| variable.usage == usage).collect();
        if own.is_empty() {
            continue;
        }
        let _ = writeln!(text, "<{list}>");
        own.into_iter().for_each(|own| text += &variable(own));
        let _ = writeln!(text, "</{list}>");
    }
    text += "</interface>\n<body>\n<LD>\n";
    text += &ladder_xml::ladder(&unit.networks);
    text += "</LD>\n</body>\n";
    text += &documentation(&unit.doc);
    text + "</pou>\n"
}

fn variable(variable: &ExportedVariable) -> String {
    let ExportedVariable { name, type_name, address, initial, doc, .. } = variable;
    let address = address.as_ref().map(|address| format!(" address=\"{address}\""));
    let is_elementary =
        ["BOOL", "DINT", "LINT", "REAL", "LREAL", "TIME"].contains(&type_name.as_str());
    let type_name = match is_elementary {
        true => format!("<{type_name}/>"),
        false => format!("<derived name=\"{type_name}\"/>"),
    };
    let initial = initial
        .as_ref()
        .map(|value| format!("<initialValue><simpleValue value=\"{value}\"/></initialValue>"));
    format!(
        "<variable name=\"{name}\"{}><type>{type_name}</type>{}{}</variable>\n",
        address.unwrap_or_default(),
        initial.unwrap_or_default(),
        documentation(doc).trim_end()
    )
}

/// A text about an element; nothing, if it is empty.
fn documentation(doc: &str) -> String {
    match doc.is_empty() {
        true => String::new(),
        false => format!("<documentation>{}</documentation>\n", paragraph(doc)),
    }
}

/// A period as a literal of IEC 61131-3, whose least unit was long the millisecond.
fn interval(period: ScanPeriod) -> String {
    match period.whole_ms() {
        Some(ms) => format!("{ms}ms"),
        None => {
            let ms = format!("{}.{:03}", period.us() / 1000, period.us() % 1000);
            format!("{}ms", ms.trim_end_matches('0'))
        }
    }
}
