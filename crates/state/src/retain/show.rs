//! A file of retentive memory as text for people: its slots and its newest image.
//!
//! Called by `rungd retain show`. Reads through a [`Storage`] and writes nothing.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::content::{self, RetainedContent, RetainedElement, RetainedValue, address};
use super::device::Storage;
use super::format::{BadSlot, FLAG_FINAL, ImageStamp};
use super::slots::{UnusableReason, survey};
use super::stages::RetainedProgram;
use rungd_base::calendar::Utc;
use rungd_engine::isa::Space;
use rungd_language::resolve::places::type_of;
use rungd_language::resolve::value_texts::with_text;

/// The text of a value of a tag, by the tag's name and the content of its cell. The file has no
/// texts: they are those of a program that the caller has read.
pub type TextOfValue<'t> = &'t dyn Fn(&str, i32) -> Option<String>;

/// The lines that describe the file.
///
/// # Errors
/// The reason why the file cannot be shown.
pub fn show<D: Storage>(device: &mut D, texts: TextOfValue<'_>) -> Result<String, String> {
    let survey = survey(device).map_err(|why| match why {
        UnusableReason::Header(bad) => bad.to_string(),
        UnusableReason::Io(error) => error.to_string(),
    })?;
    let geometry = survey.geometry;
    let mut text = format!(
        "version 1, id {:016x}, {} slots of {} bytes{}\n",
        geometry.id,
        geometry.slots,
        geometry.slot_bytes,
        if survey.whole { "" } else { "; the file is cut short" }
    );
    let newest = survey.newest.as_ref();
    for (at, slot) in survey.slots.iter().enumerate() {
        let mark = if newest.is_some_and(|newest| newest.slot == at) { ", the newest" } else { "" };
        let _ = writeln!(text, "  slot {at}  {}{mark}", slot_text(slot));
    }
    let Some(newest) = newest else {
        text.push_str("no slot holds a whole image\n");
        return Ok(text);
    };
    match content::read(&newest.content) {
        None => text.push_str("the newest image is whole, but its content is invalid\n"),
        Some(content) => values(&mut text, &content, texts),
    }
    Ok(text)
}

fn slot_text(slot: &Result<ImageStamp, BadSlot>) -> String {
    match slot {
        Err(bad) => bad.to_string(),
        Ok(stamp) => {
            let end = if stamp.flags & FLAG_FINAL != 0 {
                "after an orderly stop"
            } else {
                "without an orderly stop"
            };
            let (sequence, scan) = (stamp.sequence, stamp.scan);
            format!("image {sequence} of scan {scan}, {end}, {}", utc(stamp.saved_ms))
        }
    }
}

fn values(text: &mut String, content: &RetainedContent, texts: TextOfValue<'_>) {
    let mut tags: HashMap<RetainedElement, Vec<&str>> = HashMap::new();
    for tag in &content.tags {
        tags.entry(tag.element).or_default().push(&tag.text);
    }
    let mut zeros = 0;
    for (element, value) in &content.elements {
        let names = tags.get(element).map(|names| names.join(" "));
        if names.is_none() && *value == (RetainedValue { word: 0, preset: 0, record: [0; 8] }) {
            zeros += 1;
            continue;
        }
        let owner = content.owners.get(element).map_or("", |owner| owner);
        let said = tags
            .get(element)
            .and_then(|names| names.iter().find_map(|name| texts(name, value.word)));
        let held = held(element.space, value);
        let held = with_text(held, said.as_deref());
        let at = match content.placed.contains(element) {
            true => type_of(element.space).unwrap_or_default().to_owned(),
            false => address(*element),
        };
        let line = format!("  {at:8} {:24} {held:28} {owner}", names.unwrap_or_default());
        let _ = writeln!(text, "{}", line.trim_end());
    }
    for RetainedProgram { name, runs, begins, on } in &content.programs {
        let held = match (runs, begins) {
            (false, _) => "does not run".to_owned(),
            (true, true) => "runs, its first turn is due".to_owned(),
            (true, false) if on.is_empty() => "runs, no Stage is ON".to_owned(),
            (true, false) => format!("runs, ON: {}", on.join(" ")),
        };
        let _ = writeln!(text, "  Stages   {name:24} {held}");
    }
    if zeros > 0 {
        let _ = writeln!(text, "  and {zeros} elements without a tag that are 0 or OFF");
    }
}

fn held(space: Space, value: &RetainedValue) -> String {
    let flags: &[&str] = match space {
        Space::Bit(_) => {
            return if value.word != 0 { "ON" } else { "OFF" }.to_owned();
        }
        Space::Word(_) => return content::text(space, value.word),
        Space::Counter => &["Done", "Reset", "Zero", "DnDone"],
        Space::Timer => &["Done", "Reset", "Zero", "Timing"],
        Space::Sensaphone => &["CU", "CD", "DN", "OV", "UN"],
    };
    let on = flags.iter().zip(value.record).filter(|(_, on)| *on != 0).map(|(flag, _)| *flag);
    let mut text = value.word.to_string();
    if space == Space::Sensaphone {
        let _ = write!(text, " of {}", value.preset);
    }
    on.for_each(|flag| {
        let _ = write!(text, " {flag}");
    });
    text
}

/// A time of day as text: `2026-03-01 12:00:00 UTC`.
pub fn utc(ms: u64) -> String {
    let utc = Utc::of(ms / 1000);
    format!("{utc} {} UTC", utc.time())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_shown_with_or_without_an_orderly_stop() {
        let stamp = ImageStamp { sequence: 3, scan: 9, saved_ms: 0, flags: 0, scanned_ms: 0 };
        let said = |flags| slot_text(&Ok(ImageStamp { flags, ..stamp }));
        let when = "1970-01-01 00:00:00 UTC";
        assert_eq!(said(0), format!("image 3 of scan 9, without an orderly stop, {when}"));
        assert_eq!(said(FLAG_FINAL), format!("image 3 of scan 9, after an orderly stop, {when}"));
    }

    #[test]
    fn times_are_shown_in_utc() {
        assert_eq!(utc(0), "1970-01-01 00:00:00 UTC");
        assert_eq!(utc(951_782_400_000), "2000-02-29 00:00:00 UTC");
        assert_eq!(utc(1_795_305_599_999), "2026-11-21 23:59:59 UTC");
    }
}
