//! `[[interlock]]` of a test file: outputs of which no two may be ON together.
//!
//! Called by `written` and `reading`. Each pair becomes a condition like a line of `always`, so
//! `rungd test`, `rungd prove` and a survey judge it as one: nothing else knows interlocks.

use super::written_prove::plain;
use rungd_language::source::condition::{WrittenCondition, condition};
use rungd_language::source::contact::WrittenContact;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::Span;

/// The maximum number of outputs of an interlock.
const OUTPUTS_MAX: usize = 32;
/// A JSON Schema: two names or more.
const SEVERAL: &str = r#"{"minItems":2,"maxItems":32,"uniqueItems":true}"#;

/// Reads the interlocks: the outputs of each.
pub(super) fn read(root: &mut Table<'_>) -> Vec<Vec<Text>> {
    let explained = key("interlock", "Outputs of which no two may be ON together.");
    root.tables(explained, "an interlock").into_iter().map(read_one).collect()
}

fn read_one(mut table: Table<'_>) -> Vec<Text> {
    table.require("outputs", "[\"up\", \"down\"]");
    let explained =
        key("outputs", "Bits, by name: two or more.").limited(SEVERAL).holds(Slot::Operand);
    let Some(outputs) = table.strings(explained) else { return Vec::new() };
    let (count, place) = (outputs.value.len(), outputs.span);
    if !(2..=OUTPUTS_MAX).contains(&count) && !table.doc().has_finding_in(place) {
        let message = format!("an interlock of {count}: it has two to {OUTPUTS_MAX} outputs");
        let finding = Finding::new(Code::TestFile, place, message);
        table.find(finding.help("name the outputs that must not be ON together"));
    }
    let outputs = plain(&table, outputs.value, Code::ContactSyntax, "an output");
    table.finish();
    outputs
}

/// The conditions of interlocks, `!(a & b)` for each pair, and the findings about their names.
pub(super) fn conditions(
    interlocks: &[Vec<Text>],
    findings: &mut Vec<Finding>,
) -> Vec<(Span, WrittenCondition)> {
    let mut all = Vec::new();
    for outputs in interlocks {
        let mut names: Vec<(&Text, WrittenContact)> = Vec::new();
        for text in outputs {
            match bit(text) {
                Ok(_) if names.iter().any(|(other, _)| other.text == text.text) => {
                    let message = format!("`{}` is named twice", text.text);
                    let finding = Finding::new(Code::TestFile, text.span, message);
                    findings.push(finding.help("take one away"));
                }
                Ok(contact) => names.push((text, contact)),
                Err(finding) => findings.push(finding),
            }
        }
        for (at, (a, first)) in names.iter().enumerate() {
            for (b, second) in &names[at + 1..] {
                let span = Span { end: b.span.end, ..a.span };
                let both = vec![first.clone(), second.clone()];
                let both = Box::new(WrittenContact::All(both, span));
                let contact = WrittenContact::Not(both, span);
                let text = format!("!({} & {})", a.text, b.text);
                all.push((b.span, WrittenCondition { text, span, contact }));
            }
        }
    }
    all
}

/// The contact of a name.
fn bit(text: &Text) -> Result<WrittenContact, Finding> {
    let contact = condition(&text.text, text.span)?.contact;
    if matches!(contact, WrittenContact::Bit(_)) {
        return Ok(contact);
    }
    let message = format!("`{}` is no name of a bit", text.text);
    let finding = Finding::new(Code::TestFile, text.span, message);
    Err(finding.help("an interlock names bits; a condition belongs in `always`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn conditions_of(text: &str) -> String {
        let file = rungd_language::source::span::FileId(0);
        let (interlocks, mut findings) =
            rungd_language::source::reader::document(text, file, |mut root| read(&mut root));
        let all = conditions(&interlocks.unwrap_or_default(), &mut findings);
        let texts = all.iter().map(|(_, one)| one.text.clone());
        let findings = findings.iter().map(|finding| finding.message.clone());
        texts.chain(findings).collect::<Vec<_>>().join("; ")
    }

    #[test]
    fn each_pair_of_an_interlock_is_a_condition() {
        let text = "[[interlock]]\noutputs = [\"a\", \"b.y\", \"Y3\"]\n";
        assert_eq!(conditions_of(text), "!(a & b.y); !(a & Y3); !(b.y & Y3)");
    }

    #[test]
    fn an_interlock_of_one_output_or_of_a_condition_is_refused() {
        let one = "[[interlock]]\noutputs = [\"a\"]\n";
        assert_eq!(conditions_of(one), "an interlock of 1: it has two to 32 outputs");
        let twice = "[[interlock]]\noutputs = [\"a\", \"a\"]\n";
        assert_eq!(conditions_of(twice), "`a` is named twice");
        let condition = "[[interlock]]\noutputs = [\"a\", \"a & b\"]\n";
        assert_eq!(conditions_of(condition), "`a & b` is no name of a bit");
    }
}
