//! `[web]` and `[[panel]]`: the operands that a signed-in user of `rungd web` may write, and the
//! panels that the owner of the controller lays out. The daemon does not use them: `rungd web`
//! reads them from the controller file of the running program.

use std::ops::RangeInclusive;

use std::collections::{HashMap, HashSet};

use super::resolver::SettingsResolver;
use rungd_base::variants::all_variants;
use rungd_engine::isa::{Address, Bit, BitSpace};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Fix, FixEdit, Help, advise, pair, possible};
use rungd_language::source::key::{NOT_EMPTY, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::renaming;
use rungd_language::source::span::Span;

/// `[web]` and `[[panel]]` as written.
#[derive(Clone, Debug, Default)]
pub struct WrittenWeb {
    /// `[web] write`.
    write: Vec<Text>,
    /// `[[panel]]`, in file order.
    panels: Vec<WrittenPanel>,
}

/// `[[panel]]`.
#[derive(Clone, Debug)]
struct WrittenPanel {
    span: Span,
    name: Option<Text>,
    /// Its valid widgets, each with its operand as written.
    show: Vec<(Widget, Text)>,
}

/// The operands that `rungd web` may write, and its panels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WebSettings {
    /// The operands that a signed-in user may write: the name in the file, and the address.
    pub write: Vec<(String, Address)>,
    /// The panels, in file order.
    pub panels: Vec<Panel>,
}

/// A page for a tablet at the machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panel {
    /// Its name; no two panels have the same name.
    pub name: String,
    /// Its widgets, in order.
    pub show: Vec<Widget>,
}

/// A part of a panel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Widget {
    /// Its kind.
    pub kind: WidgetKind,
    /// The name in the file of the operand that it shows.
    pub operand: String,
    /// Its label; if not given, the operand.
    pub text: Option<String>,
    /// The values at the ends of a bar or a trend.
    pub limits: Option<(i32, i32)>,
}

/// The kinds of widgets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WidgetKind {
    /// A bit: ON or OFF.
    Lamp,
    /// Writes ON to a bit, once per press. The ladder resets it.
    Button,
    /// A value; with a field for a new value if the operand may be written.
    Value,
    /// A word as the length of a bar.
    Bar,
    /// A value over the last minute.
    Trend,
}

impl WidgetKind {
    /// All kinds.
    pub const ALL: [WidgetKind; 5] = all_variants![
        WidgetKind::Lamp,
        WidgetKind::Button,
        WidgetKind::Value,
        WidgetKind::Bar,
        WidgetKind::Trend,
    ];

    /// Its key in a controller file.
    pub fn key(self) -> &'static str {
        match self {
            WidgetKind::Lamp => "lamp",
            WidgetKind::Button => "button",
            WidgetKind::Value => "value",
            WidgetKind::Bar => "bar",
            WidgetKind::Trend => "trend",
        }
    }

    /// The explanation of the key.
    fn doc(self) -> &'static str {
        match self {
            WidgetKind::Lamp => "A bit, shown as a lamp.",
            WidgetKind::Button => {
                "A bit that a press writes ON, once; the ladder resets it. `[web] write` lists it."
            }
            WidgetKind::Value => "A value; with a field for a new one if `[web] write` lists it.",
            WidgetKind::Bar => "A word, shown as a bar from `min` to `max`.",
            WidgetKind::Trend => "A value over the last minute.",
        }
    }
}

/// The schema's condition on a widget: one kind, and the ends of a bar.
const ONE_KIND: &str = r#"{"oneOf":[{"required":["lamp"]},{"required":["button"]},
            {"required":["value"]},{"required":["bar","min","max"]},{"required":["trend"]}]}"#;

/// The least and the greatest value for an end of a bar.
const ENDS: RangeInclusive<i64> = i32::MIN as i64..=i32::MAX as i64;

/// Reads `[web]` and all `[[panel]]`.
pub(super) fn read_in(root: &mut Table<'_>) -> WrittenWeb {
    let mut web = WrittenWeb::default();
    let explained = key("web", "What people at `rungd web` may do.");
    if let Some(mut table) = root.table(explained, "`[web]`") {
        web.write =
            table.texts(key("write", "The bits and words that a signed-in user may write."));
        table.finish();
    }
    let explained = key("panel", "A page of `rungd web` for people at the machine.");
    web.panels = root.tables(explained, "a panel").into_iter().map(read_panel).collect();
    web
}

fn read_panel(mut table: Table<'_>) -> WrittenPanel {
    let span = table.span();
    let name = table.required_string(key("name", "Its name."));
    let explained = key("show", "Its lamps, buttons, values, bars and trends, in order.");
    let widgets = table.tables(explained.limited(NOT_EMPTY), "a part of a panel");
    let show = widgets.into_iter().filter_map(read_widget).collect();
    table.finish();
    WrittenPanel { span, name, show }
}

fn read_widget(mut table: Table<'_>) -> Option<(Widget, Text)> {
    table.together(ONE_KIND);
    let shows = WidgetKind::ALL.into_iter();
    let shows = shows.filter_map(|kind| Some((kind, table.string(key(kind.key(), kind.doc()))?)));
    let shows: Vec<(WidgetKind, Text)> = shows.collect();
    let text = table.string(key("text", "Its label; the operand if not given."));
    let min = table.whole(key("min", "The value at the left end of a bar."), ENDS);
    let max = table.whole(key("max", "The value at the right end of a bar."), ENDS);
    let ends = min.map(|min| min.value).zip(max.as_ref().map(|max| max.value));
    let has_end = table.has("min") || table.has("max");
    let (span, doc) = (table.span(), table.doc());
    table.finish();
    let wrong = |span: Span, message: String, help: Help| {
        doc.find(Finding::new(Code::Controller, span, message).help(help));
        None
    };
    let (kind, shown) = match shows.as_slice() {
        [one] => one.clone(),
        [] => {
            let help = "write `lamp`, `button`, `value`, `bar` or `trend` with an operand";
            let help = Help::from(help).with(possible(FixEdit::DeleteRow));
            return wrong(span, "this part shows nothing".into(), help);
        }
        [_, second, ..] => {
            let help = "write two parts: `{ lamp = \"a\" }, { value = \"b\" }`";
            let help = Help::from(help).with(possible(FixEdit::Remove(second.0.key())));
            return wrong(second.1.span, "a part shows one operand".into(), help);
        }
    };
    let limits = match (kind, ends, has_end) {
        (WidgetKind::Bar | WidgetKind::Trend, Some((min, max)), _) if min < max => Some((min, max)),
        (
            WidgetKind::Trend | WidgetKind::Lamp | WidgetKind::Button | WidgetKind::Value,
            _,
            false,
        ) => None,
        (WidgetKind::Bar | WidgetKind::Trend, ..) => {
            let message = format!("a {} goes from `min` to a greater `max`", kind.key());
            let lines = "min = 0\nmax = 100".to_owned();
            let ends = Fix::from(FixEdit::Lines { lines, instead: None }).possible();
            return wrong(span, message, Help::from("write `min = 0, max = 100`").with(ends));
        }
        (WidgetKind::Lamp | WidgetKind::Button | WidgetKind::Value, ..) => {
            let message = format!("a {} has no `min` and `max`", kind.key());
            let without = Fix::from(FixEdit::Remove("min")).after(FixEdit::Remove("max"));
            let help = Help::from("leave them out, or write a `bar`");
            return wrong(span, message, help.with(without.possible()));
        }
    };
    let operand = shown.text.trim().to_owned();
    Some((Widget { kind, operand, text: text.map(|text| text.text), limits }, shown))
}

/// Makes the settings from the keys, with a finding for each wrong value.
pub(super) fn resolve(written: &WrittenWeb, resolver: &mut SettingsResolver<'_>) -> WebSettings {
    let mut web = WebSettings::default();
    let progress = resolver.progress;
    for text in progress.during(&written.write) {
        let Some(address) = operand(text, resolver) else { continue };
        if may_write(address) {
            web.write.push((text.text.trim().to_owned(), address));
        } else {
            let message = format!("`{}` cannot be written from outside", text.text.trim());
            let finding = Finding::new(Code::Controller, text.span, message);
            let help = "list inputs, data, relays, presets and accumulators: see docs/operator.md";
            resolver.findings.push(finding.help(help).or_omit());
        }
    }
    let writable: HashSet<Address> = web.write.iter().map(|(_, address)| *address).collect();
    let mut firsts: HashMap<&str, Span> = HashMap::new();
    for panel in progress.during(&written.panels) {
        let Some(name) = &panel.name else { continue };
        if let Some(first) = firsts.get(name.text.as_str()) {
            let message = format!("a second panel `{}`", name.text);
            let finding = Finding::new(Code::Controller, name.span, message);
            let fix = renaming::another(&name.text, ' ', |name| firsts.contains_key(name));
            resolver.findings.push(finding.related(*first, "the first one").fix(fix));
            continue;
        }
        firsts.insert(&name.text, panel.span);
        let widgets = progress.during(&panel.show);
        let show = widgets.filter_map(|(shown, text)| widget(shown, text, &writable, resolver));
        let show = show.collect();
        web.panels.push(Panel { name: name.text.clone(), show });
    }
    web
}

/// Whether an address may be written; an operator may write the same addresses
/// (`operator::operand`).
fn may_write(address: Address) -> bool {
    match address {
        Address::Bit(Bit::Space(BitSpace::X, _)) => true,
        Address::Bit(bit) => bit.writable_from_outside(),
        Address::Word(word) => word.writable(),
        Address::Structure(_) => false,
    }
}

/// The bit or word of a name.
fn operand(text: &Text, resolver: &mut SettingsResolver<'_>) -> Option<Address> {
    let name = text.text.trim();
    let finding = match resolver.address(name, text.span)? {
        Ok(Address::Structure(_)) => {
            let message = format!("`{name}` is a structure");
            let finding = Finding::new(Code::Controller, text.span, message);
            finding.help(advise("name a member, as `{}`", [possible(format!("{name}.Acc"))]))
        }
        Ok(address @ (Address::Bit(_) | Address::Word(_))) => return Some(address),
        Err(message) => Finding::new(Code::Controller, text.span, message),
    };
    resolver.findings.push(finding);
    None
}

/// The widget, if its operand is of a kind that it can show.
fn widget(
    widget: &Widget,
    text: &Text,
    writable: &HashSet<Address>,
    resolver: &mut SettingsResolver<'_>,
) -> Option<Widget> {
    let address = operand(text, resolver)?;
    let name = &widget.operand;
    let is_bit = matches!(address, Address::Bit(_));
    let (message, help) = match widget.kind {
        WidgetKind::Lamp | WidgetKind::Button if !is_bit => {
            let value = pair(format!("value = \"{name}\"")).possible();
            let help = Help::from("write a `value` or a `bar`").with(value);
            (format!("`{name}` is not a bit"), help)
        }
        WidgetKind::Bar if is_bit => {
            let lamp = pair(format!("lamp = \"{name}\"")).possible();
            let lamp = lamp.after(FixEdit::Remove("min")).after(FixEdit::Remove("max"));
            (format!("`{name}` is a bit"), Help::from("write a `lamp`").with(lamp))
        }
        WidgetKind::Button if !writable.contains(&address) => (
            format!("nobody may write `{name}`: this button would do nothing"),
            Help::from(format!("list it: `[web]` with `write = [\"{name}\"]`")).with(possible(
                FixEdit::Under { table: "web", pair: format!("write = [\"{name}\"]") },
            )),
        ),
        WidgetKind::Lamp
        | WidgetKind::Button
        | WidgetKind::Bar
        | WidgetKind::Value
        | WidgetKind::Trend => return Some(widget.clone()),
    };
    let finding = Finding::new(Code::Controller, text.span, message);
    resolver.findings.push(finding.help(help));
    None
}
