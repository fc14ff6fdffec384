//! The tags of a ladder as element documentation.

use std::fmt::Write;

use super::form::{BEGIN, END, FLAGS, other_element, plain_name};
use rungd_engine::isa::Address;
use rungd_language::resolve::program::{Program, Tag, TagMeaning};

/// Longest nickname of Do-more Designer.
const NICKNAME_MAX: usize = 16;

/// Element documentation, as Do-more Designer imports it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ElementDocumentation {
    /// The text of the file.
    pub text: String,
    /// How many elements it has.
    pub elements: usize,
    /// What is not in it as it is in the ladder, with the reason.
    pub left_out: Vec<String>,
}

/// The element documentation of the tags that have an address.
pub fn documentation(program: &Program) -> ElementDocumentation {
    let mut made = ElementDocumentation { text: format!("{BEGIN}\r\n"), ..Default::default() };
    let mut without_address = 0;
    for tag in &program.tags {
        let TagMeaning::Address(address) = tag.meaning else { continue };
        if program.names.second_name(address) != Some(&tag.name) {
            without_address += 1;
            continue;
        }
        element(&mut made, tag, address, &program.names.address(address));
    }
    if without_address > 0 {
        made.left_out.push(format!(
            "{without_address} tags have a type and no address, or share one: they are no elements"
        ));
    }
    let _ = write!(made.text, "{END}\r\n");
    made
}

fn element(made: &mut ElementDocumentation, tag: &Tag, address: Address, at: &str) {
    if other_element(address).is_some() {
        made.left_out.push(format!("`{}`: {at} is another element in a Do-more", tag.name));
        return;
    }
    let doc = tag.doc.as_deref().unwrap_or_default();
    let end = doc.strip_suffix(']').and_then(|rest| rest.rsplit_once('['));
    let (description, mut extra) = end.map_or((doc, ""), |(text, extra)| (text.trim(), extra));
    let name = tag.name.trim_end_matches(']').replace(['[', '.', ']'], "_");
    let nickname = match name.len() <= NICKNAME_MAX {
        _ if name == plain_name(at) => "",
        true => name.as_str(),
        false => {
            made.left_out.push(format!(
                "`{}` has more than {NICKNAME_MAX} letters: it is Extra Info of {at}",
                tag.name
            ));
            extra = &tag.name;
            ""
        }
    };
    // Designer's own value for a new element; structures are no tags of Sparkplug.
    let flags = match address {
        Address::Structure(_) => "REST_READONLY OPCUA_DISABLED",
        Address::Bit(_) | Address::Word(_) => "REST_READONLY SPARK_DISABLED OPCUA_DISABLED",
    };
    let (element, flags) = (bit_text(at), format!("{FLAGS} = {flags}"));
    let columns = [&*element, &*flags, nickname, extra, description].map(quoted);
    let _ = write!(made.text, "{}\r\n", columns.join(","));
    made.elements += 1;
}

/// A bit of a word as a Do-more writes it: `D0:3`.
fn bit_text(at: &str) -> String {
    match at.rsplit_once('.') {
        Some((word, bit)) if bit.bytes().all(|byte| byte.is_ascii_digit()) => {
            format!("{word}:{bit}")
        }
        _ => at.to_owned(),
    }
}

fn quoted(text: &str) -> String {
    let line: Vec<&str> = text.split_whitespace().collect();
    format!("\"{}\"", line.join(" ").replace('"', "\"\""))
}
