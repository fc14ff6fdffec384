//! `[[panel]]`: the parts of a page for people at the machine, as written.
//!
//! `web` reads panels with it and decides whether each operand fits its part; `rungd web` draws
//! them. This module resolves no operand. Which keys a kind of part takes stands in one place,
//! [`WidgetKind::takes`].

use std::ops::RangeInclusive;

use rungd_base::variants::all_variants;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Fix, FixEdit, Help, possible};
use rungd_language::source::key::{NOT_EMPTY, key};
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::slot::Slot;
use rungd_language::source::span::Span;
use rungd_language::source::value_kind::{KeyWords, WrongWord};

/// `[[panel]]`.
#[derive(Clone, Debug)]
pub(super) struct WrittenPanel {
    pub span: Span,
    pub name: Option<Text>,
    /// Its valid widgets, each with its operand as written.
    pub show: Vec<(Widget, Text)>,
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
    /// The name in the file of the operand that it shows; of alarms, their group or [`ALL_ALARMS`];
    /// of a mimic, its file.
    pub operand: String,
    /// Its label; if not given, the operand.
    pub text: Option<String>,
    /// The values at the ends of a bar or a trend.
    pub limits: Option<(i32, i32)>,
    /// The question before a button's command is sent.
    pub confirm: Option<String>,
    /// The unit of its number; if not given, the tag's.
    pub unit: Option<String>,
    /// The decimal places of its number: a whole number 235 with one is shown as 23.5.
    pub decimals: Option<u8>,
    /// The colour of a lamp that is ON.
    pub color: Option<LampColor>,
    /// Whether a write asks for a reason, which is logged.
    pub reason: bool,
    /// The time that a trend shows first, minutes; if not given, one.
    pub span_minutes: Option<u32>,
}

/// The colour of a lamp that is ON: green if none is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LampColor {
    /// It runs, it is open.
    Green,
    /// A person must act.
    Red,
    /// Something is unusual.
    Amber,
    /// A person is asked for something.
    Blue,
    /// A state without a judgement.
    Gray,
}

impl LampColor {
    /// Its word in a controller file, and for pages.
    pub fn word(self) -> &'static str {
        COLORS.word(self)
    }
}

const COLORS: KeyWords<LampColor> = KeyWords::new(&[
    ("green", LampColor::Green),
    ("red", LampColor::Red),
    ("amber", LampColor::Amber),
    ("blue", LampColor::Blue),
    ("gray", LampColor::Gray),
])
.refused_as(WrongWord::NoValue);

/// The kinds of widgets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WidgetKind {
    /// A bit: ON or OFF.
    Lamp,
    /// Writes ON to a bit, once per press. The ladder resets it.
    Button,
    /// Holds a bit ON as long as it is pressed.
    Hold,
    /// A value; with a field for a new value if the operand may be written.
    Value,
    /// A word as the length of a bar.
    Bar,
    /// A value over the last minute, or over hours.
    Trend,
    /// The alarms of a group.
    Alarms,
    /// A record, an array of records or an array, as a table.
    Recipe,
    /// A drawing of the machine.
    Mimic,
}

/// Whether a text is the name of a drawing: an SVG file, without a folder.
pub fn is_drawing_name(name: &str) -> bool {
    let fits = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ' ');
    name.ends_with(".svg") && !name.starts_with('.') && name.len() <= 200 && name.chars().all(fits)
}

/// In place of a group: all alarms.
pub const ALL_ALARMS: &str = "*";

/// Whether a kind of part has `min` and `max`.
#[derive(Clone, Copy)]
enum EndsOfKind {
    Needed,
    Possible,
    None,
}

impl WidgetKind {
    /// All kinds.
    pub const ALL: [WidgetKind; 9] = all_variants![
        WidgetKind::Lamp,
        WidgetKind::Button,
        WidgetKind::Hold,
        WidgetKind::Value,
        WidgetKind::Bar,
        WidgetKind::Trend,
        WidgetKind::Alarms,
        WidgetKind::Recipe,
        WidgetKind::Mimic,
    ];

    /// Its key in a controller file.
    pub fn key(self) -> &'static str {
        match self {
            WidgetKind::Lamp => "lamp",
            WidgetKind::Button => "button",
            WidgetKind::Hold => "hold",
            WidgetKind::Value => "value",
            WidgetKind::Bar => "bar",
            WidgetKind::Trend => "trend",
            WidgetKind::Alarms => "alarms",
            WidgetKind::Recipe => "recipe",
            WidgetKind::Mimic => "mimic",
        }
    }

    /// A part of this kind, in a message.
    fn noun(self) -> String {
        match self {
            WidgetKind::Alarms => "a list of alarms".to_owned(),
            WidgetKind::Lamp
            | WidgetKind::Button
            | WidgetKind::Hold
            | WidgetKind::Value
            | WidgetKind::Bar
            | WidgetKind::Trend
            | WidgetKind::Recipe
            | WidgetKind::Mimic => format!("a {}", self.key()),
        }
    }

    /// The explanation of the key.
    fn doc(self) -> &'static str {
        match self {
            WidgetKind::Lamp => "A bit, shown as a lamp.",
            WidgetKind::Button => {
                "A bit that a press writes ON, once; the ladder resets it. `[web] write` lists it."
            }
            WidgetKind::Hold => {
                "A bit that is ON while its button is pressed, and OFF 500 ms after the browser is \
                 gone. `[web] write` lists it."
            }
            WidgetKind::Value => "A value; with a field for a new one if `[web] write` lists it.",
            WidgetKind::Bar => "A word, shown as a bar from `min` to `max`.",
            WidgetKind::Trend => "A value over the last minute, or over hours.",
            WidgetKind::Alarms => "The alarms of this group; of all groups: `*`.",
            WidgetKind::Mimic => "A drawing: an SVG file in the folder of `rungd web --mimics`.",
            WidgetKind::Recipe => {
                "An array of records as a table, to edit if `[web] write` lists it; also a record \
                 or an array."
            }
        }
    }

    /// What the text of the key stands for.
    fn shown(self) -> Slot {
        match self {
            WidgetKind::Alarms | WidgetKind::Mimic => Slot::Other,
            WidgetKind::Lamp
            | WidgetKind::Button
            | WidgetKind::Hold
            | WidgetKind::Value
            | WidgetKind::Bar
            | WidgetKind::Trend
            | WidgetKind::Recipe => Slot::Operand,
        }
    }

    /// Whether it has `min` and `max`.
    fn ends(self) -> EndsOfKind {
        match self {
            WidgetKind::Bar => EndsOfKind::Needed,
            WidgetKind::Trend => EndsOfKind::Possible,
            WidgetKind::Lamp
            | WidgetKind::Button
            | WidgetKind::Hold
            | WidgetKind::Value
            | WidgetKind::Alarms
            | WidgetKind::Recipe
            | WidgetKind::Mimic => EndsOfKind::None,
        }
    }

    /// Whether its parts may have a key of [`EXTRAS`].
    fn takes(self, extra: &str) -> bool {
        match self {
            WidgetKind::Alarms | WidgetKind::Mimic => false,
            WidgetKind::Hold | WidgetKind::Recipe => extra == REASON,
            WidgetKind::Lamp => extra == COLOR,
            WidgetKind::Button => extra == CONFIRM || extra == REASON,
            WidgetKind::Value => extra == UNIT || extra == DECIMALS || extra == REASON,
            WidgetKind::Bar => extra == UNIT || extra == DECIMALS,
            WidgetKind::Trend => extra == UNIT || extra == DECIMALS || extra == SPAN,
        }
    }
}

/// The keys of a part that some kinds take alone.
const EXTRAS: [&str; 6] = [COLOR, CONFIRM, UNIT, DECIMALS, REASON, SPAN];
const COLOR: &str = "color";
const CONFIRM: &str = "confirm";
const UNIT: &str = "unit";
const DECIMALS: &str = "decimals";
const REASON: &str = "reason";
const SPAN: &str = "span";

/// The times that a trend shows, by word, in minutes.
const SPANS: KeyWords<u32> = KeyWords::new(&[("1m", 1), ("10m", 10), ("1h", 60), ("8h", 480)])
    .refused_as(WrongWord::NoValue);

/// The schema's condition on a widget: one kind, and the ends of a bar.
const ONE_KIND: &str = r#"{"oneOf":[{"required":["lamp"]},{"required":["button"]},
            {"required":["hold"]},{"required":["value"]},
            {"required":["bar","min","max"]},{"required":["trend"]},{"required":["alarms"]},
            {"required":["recipe"]},{"required":["mimic"]}]}"#;

/// The least and the greatest value for an end of a bar.
const ENDS: RangeInclusive<i64> = i32::MIN as i64..=i32::MAX as i64;
/// The decimal places of a number.
const DECIMALS_RANGE: RangeInclusive<i64> = 0..=6;

/// Reads a `[[panel]]`.
pub(super) fn read_panel(mut table: Table<'_>) -> WrittenPanel {
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
    let shows = shows.filter_map(|kind| {
        Some((kind, table.string(key(kind.key(), kind.doc()).holds(kind.shown()))?))
    });
    let shows: Vec<(WidgetKind, Text)> = shows.collect();
    let text = table.string(key("text", "Its label; the operand if not given."));
    let question = key(CONFIRM, "The question of a button before it sends its command.");
    let confirm = table.string(question).map(|question| question.text);
    let unit = table.string(key(UNIT, "The unit of the number; the tag's if not given."));
    let decimals = "The decimal places of the number: of a whole number 235, one shows 23.5.";
    let decimals = table.whole(key(DECIMALS, decimals), DECIMALS_RANGE);
    let color = table.value_of(key(COLOR, "The colour of a lamp that is ON."), &COLORS);
    let reason = "Whether a write asks for a reason, which the log has; false if not given.";
    let reason = table.boolean(key(REASON, reason)).is_some_and(|given| given.value);
    let span = "The time that a trend shows first; a minute if not given.";
    let span_minutes = table.value_of(key(SPAN, span), &SPANS);
    let ends = read_ends(&mut table);
    let judged = the_kind(&table, &shows).and_then(|(kind, shown)| {
        refuse_extras(&table, kind)?;
        Some((kind, shown, limits(&table, kind, ends)?))
    });
    table.finish();
    let (kind, shown, limits) = judged?;
    let widget = Widget {
        kind,
        operand: shown.text.trim().to_owned(),
        text: text.map(|text| text.text),
        limits,
        confirm,
        unit: unit.map(|unit| unit.text),
        decimals: decimals.map(|decimals| decimals.value),
        color,
        reason,
        span_minutes,
    };
    Some((widget, shown))
}

/// `min` and `max`, if both are given.
fn read_ends(table: &mut Table<'_>) -> Option<[i32; 2]> {
    let min = table.whole(key("min", "The value at the left end of a bar."), ENDS);
    let max = table.whole(key("max", "The value at the right end of a bar."), ENDS);
    Some([min?.value, max?.value])
}

/// Adds a finding about a part, which is left out.
fn refuse<T>(table: &Table<'_>, span: Span, message: String, help: Help) -> Option<T> {
    table.find(Finding::new(Code::Controller, span, message).help(help));
    None
}

/// The one kind of a part, with its operand.
fn the_kind(table: &Table<'_>, shows: &[(WidgetKind, Text)]) -> Option<(WidgetKind, Text)> {
    match shows {
        [one] => Some(one.clone()),
        [] => {
            let help = "write `lamp`, `button`, `hold`, `value`, `bar` or `trend` with an operand";
            let help = Help::from(help).with(possible(FixEdit::DeleteRow));
            refuse(table, table.span(), "this part shows nothing".into(), help)
        }
        [_, second, ..] => {
            let help = "write two parts: `{ lamp = \"a\" }, { value = \"b\" }`";
            let help = Help::from(help).with(possible(FixEdit::Remove(second.0.key())));
            refuse(table, second.1.span, "a part shows one operand".into(), help)
        }
    }
}

/// Makes a finding for a key that is for other kinds of parts.
fn refuse_extras(table: &Table<'_>, kind: WidgetKind) -> Option<()> {
    let Some(extra) = EXTRAS.into_iter().find(|extra| table.has(extra) && !kind.takes(extra))
    else {
        return Some(());
    };
    let message = format!("{} has no `{extra}`", kind.noun());
    let help = Help::from("leave it out").with(possible(FixEdit::Remove(extra)));
    refuse(table, table.key_span(extra).unwrap_or(table.span()), message, help)
}

/// The ends of a bar or a trend. `None`: they are wrong for the kind.
fn limits(
    table: &Table<'_>,
    kind: WidgetKind,
    ends: Option<[i32; 2]>,
) -> Option<Option<(i32, i32)>> {
    let has_end = table.has("min") || table.has("max");
    match (kind.ends(), ends) {
        (EndsOfKind::None, _) if has_end => {
            let message = format!("{} has no `min` and `max`", kind.noun());
            let without = Fix::from(FixEdit::Remove("min")).after(FixEdit::Remove("max"));
            let help = Help::from("leave them out, or write a `bar`");
            refuse(table, table.span(), message, help.with(without.possible()))
        }
        (EndsOfKind::None, _) => Some(None),
        (EndsOfKind::Possible, _) if !has_end => Some(None),
        (EndsOfKind::Possible | EndsOfKind::Needed, Some([min, max])) if min < max => {
            Some(Some((min, max)))
        }
        (EndsOfKind::Possible | EndsOfKind::Needed, _) => {
            let message = format!("a {} goes from `min` to a greater `max`", kind.key());
            let lines = "min = 0\nmax = 100".to_owned();
            let ends = Fix::from(FixEdit::Lines { lines, instead: None }).possible();
            let help = Help::from("write `min = 0, max = 100`").with(ends);
            refuse(table, table.span(), message, help)
        }
    }
}
