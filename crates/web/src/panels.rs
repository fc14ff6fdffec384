//! The panels of the controller file, for the page that draws them.
//!
//! Called by `api`. The values of a panel come with the events of every page; here is what stays
//! the same while a program runs: labels, units, decimal places, and the values that a tag takes.

use std::collections::HashMap;

use serde_json::{Value, json};

use super::views::settings;
use rungd_client::live::{LiveProgram, LiveTag};
use rungd_config::controller::panel::{Panel, Widget};
use rungd_engine::isa::{Address, Word};

/// The panels of a program.
pub(super) fn panels(program: &LiveProgram) -> Value {
    let tags: HashMap<&str, LiveTag<'_>> = program.tags().map(|tag| (tag.name, tag)).collect();
    let panel = |panel: &Panel| {
        let unit = |widget: &Widget| tags.get(widget.operand.as_str()).and_then(|tag| tag.unit);
        let show = panel.show.iter().map(|shown| widget(program, shown, unit(shown)));
        json!({ "name": panel.name, "show": show.collect::<Vec<_>>() })
    };
    let all = settings(program).map_or(&[][..], |web| &web.panels);
    json!({ "panels": all.iter().map(panel).collect::<Vec<_>>() })
}

/// A part of a panel; `unit` is that of its tag.
fn widget(program: &LiveProgram, widget: &Widget, unit: Option<&str>) -> Value {
    let word = word(program, &widget.operand);
    json!({
        "kind": widget.kind.key(),
        "operand": widget.operand,
        "text": widget.text,
        "limits": widget.limits,
        "confirm": widget.confirm,
        "unit": widget.unit.as_deref().or(unit),
        "decimals": widget.decimals,
        "real": word.is_some_and(Word::is_real),
        "takes": word.map(|word| takes(program, word)),
    })
}

/// The word that an operand names; `None`: it names a bit.
fn word(program: &LiveProgram, operand: &str) -> Option<Word> {
    let subject = &program.subject;
    match subject.symbols().layout.address(subject.cell(operand).ok()?)? {
        Address::Word(word) => Some(word),
        Address::Bit(_) | Address::Structure(_) => None,
    }
}

/// The least and the greatest value that may be written into a word.
fn takes(program: &LiveProgram, word: Word) -> [Value; 2] {
    let (min, max) = program.subject.symbols().limits(word);
    [min, max].map(|content| json!(word.number(content)))
}
