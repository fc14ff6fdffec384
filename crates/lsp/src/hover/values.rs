//! The reading of a value: a duration in ms, a number in decimal, contacts with all parentheses, a
//! step of a test with its form.

use std::ops::Range;

use super::super::outline::OutlineValue;
use super::super::slots::{Slot, of_value};
use super::super::workspace::Cursor;
use rungd_engine::isa::duration;
use rungd_lab::testing::{StepForm, step_form};
use rungd_language::source::contact_parser;
use rungd_language::source::contact_parser::parse_condition;
use rungd_language::source::name_reader::{ExpressionUse, TextWordKind, words_in};
use rungd_language::source::span::Span;

/// The reading of the value at the cursor.
pub(super) fn at(cursor: &Cursor) -> Option<(Range<usize>, String)> {
    let (file, at) = (cursor.file(), cursor.offset);
    let outline = &file.outline;
    let value = outline.value_at(&(at..at + 1))?;
    number(cursor, value).or_else(|| {
        match of_value(outline, file.kind, &outline.pairs[value.pair]) {
            Slot::Contacts | Slot::Argument => {
                let text = file.slice(value.inner.clone());
                let read = contact_parser::parse(text, Span::default()).ok()?;
                reading(value.inner.clone(), text, &read.to_string())
            }
            Slot::Condition => condition(cursor, value.inner.clone()),
            Slot::Step => step(cursor, value),
            Slot::Declares(_)
            | Slot::Instruction
            | Slot::Template
            | Slot::Allow
            | Slot::Block
            | Slot::File
            | Slot::DeviceLadder
            | Slot::Device
            | Slot::Address
            | Slot::Type
            | Slot::Operand
            | Slot::Point
            | Slot::Initial
            | Slot::Placeholders
            | Slot::Other => None,
        }
    })
}

/// The duration or number at the cursor.
fn number(cursor: &Cursor, value: &OutlineValue) -> Option<(Range<usize>, String)> {
    let (text, at) = (cursor.file().slice(value.inner.clone()), cursor.offset);
    let within = at.checked_sub(value.inner.start)?;
    let words = words_in(text, ExpressionUse::Contact).into_iter();
    let mut numbers = words.filter(|word| word.kind == TextWordKind::Number);
    let place = numbers.find(|word| word.place.contains(&within))?.place;
    let found = &text[place.clone()];
    let place = value.inner.start + place.start..value.inner.start + place.end;
    let radix = [("0x", 16), ("0o", 8), ("0b", 2)];
    for (prefix, radix) in radix {
        if let Some(digits) = found.strip_prefix(prefix) {
            let number = i64::from_str_radix(&digits.replace('_', ""), radix).ok()?;
            return Some((place, format!("`{found}` is {number}\n")));
        }
    }
    let is_bare = found.bytes().all(|byte| byte.is_ascii_digit());
    let ms = duration::parse(found).ok().filter(|_| !is_bare)?;
    Some((place, format!("`{found}` is {ms} ms\n")))
}

/// The reading of contacts, if it is not obvious.
fn reading(place: Range<usize>, text: &str, read: &str) -> Option<(Range<usize>, String)> {
    let is_mixed = text.contains(['&', '|']);
    is_mixed.then(|| (place, format!("Read as `{read}`\n")))
}

fn condition(cursor: &Cursor, place: Range<usize>) -> Option<(Range<usize>, String)> {
    let text = cursor.file().slice(place.clone());
    let read = parse_condition(text, Span::default()).ok()?;
    reading(place, text, &read.to_string())
}

/// The form of a step, if the cursor is at its verb; else the reading of its condition.
fn step(cursor: &Cursor, value: &OutlineValue) -> Option<(Range<usize>, String)> {
    let text = cursor.file().slice(value.inner.clone());
    let begin = text.len() - text.trim_start().len();
    let length = text[begin..].find([' ', ':']).unwrap_or(text.len() - begin);
    let verb = &text[begin..begin + length];
    let place = value.inner.start + begin..value.inner.start + begin + length;
    if cursor.offset < place.end {
        let StepForm { form, meaning, .. } = step_form(verb)?;
        return Some((place, format!("**{verb}**: {meaning}\n\n`{form}`\n")));
    }
    let colon = text.find(':')?;
    condition(cursor, value.inner.start + colon + 1..value.inner.end)
}
