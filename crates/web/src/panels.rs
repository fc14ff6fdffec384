//! The panels of the controller file, for the page that draws them.
//!
//! Called by `api`, and by `recipe` for what a panel shows. The values of a panel come with the
//! events of every page; here is what stays the same while a program runs: labels, units, decimal
//! places, and the values that a tag takes.

use std::collections::HashMap;
use std::path::Path;

use serde_json::{Value, json};

use super::mimic::{self, Mimic};
use super::query::Query;
use super::reply::{WebFailure, bad};
use super::rights::settings;
use rungd_client::live::{LiveProgram, LiveTag};
use rungd_config::controller::panel::{LampColor, Panel, Widget, WidgetKind};
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
    let is_recipe = widget.kind == WidgetKind::Recipe;
    json!({
        "kind": widget.kind.key(),
        "operand": widget.operand,
        "text": widget.text,
        "limits": widget.limits,
        "confirm": widget.confirm,
        "unit": widget.unit.as_deref().or(unit),
        "decimals": widget.decimals,
        "color": widget.color.map(LampColor::word),
        "real": word.is_some_and(Word::is_real),
        "takes": word.map(|word| takes(program, word)),
        "reason": widget.reason,
        "minutes": widget.span_minutes,
        "write": is_recipe.then(|| is_listed(program, &widget.operand)),
    })
}

/// Whether `[web] write` lists what a recipe shows, or a part of it.
fn is_listed(program: &LiveProgram, recipe: &str) -> bool {
    settings(program)
        .is_some_and(|web| web.write.iter().any(|operand| is_part_of(&operand.name, recipe)))
}

/// The word that an operand names; `None`: it names a bit.
pub(super) fn word(program: &LiveProgram, operand: &str) -> Option<Word> {
    let subject = &program.subject;
    match subject.symbols().layout.address(subject.cell(operand).ok()?)? {
        Address::Word(word) => Some(word),
        Address::Bit(_) | Address::Structure(_) => None,
    }
}

/// The least and the greatest value that may be written into a word.
pub(super) fn takes(program: &LiveProgram, word: Word) -> [Value; 2] {
    let (min, max) = program.subject.symbols().limits(word);
    [min, max].map(|content| json!(word.number(content)))
}

/// A drawing of a panel, made safe, with the tags that the program does not have. Reads a file of
/// the folder of drawings.
pub(super) fn drawing(
    folder: Option<&Path>,
    program: &LiveProgram,
    query: &Query,
) -> Result<Value, WebFailure> {
    let name = query.get("operand").unwrap_or_default();
    if !shows(program, WidgetKind::Mimic, name) {
        return Err(bad("no panel shows this drawing"));
    }
    let folder = folder.ok_or_else(|| bad("start `rungd web` with `--mimics FOLDER`"))?;
    let Mimic { svg, left_out, tags } = mimic::read(folder, name).map_err(bad)?;
    let unknown = tags.iter().filter(|tag| program.subject.cell(tag).is_err());
    let unknown: Vec<&String> = unknown.take(20).collect();
    Ok(json!({ "svg": svg, "left_out": left_out, "unknown": unknown }))
}

/// Whether a panel has a part of a kind that shows an operand.
pub(super) fn shows(program: &LiveProgram, kind: WidgetKind, operand: &str) -> bool {
    let panels = settings(program).map_or(&[][..], |web| &web.panels);
    let mut parts = panels.iter().flat_map(|panel| &panel.show);
    parts.any(|part| part.kind == kind && part.operand == operand)
}

/// Whether a name is that of a part of a recipe: of a field or an element.
pub(super) fn is_part_of(name: &str, recipe: &str) -> bool {
    name.strip_prefix(recipe).is_some_and(|rest| rest.starts_with(['.', '[']))
}
