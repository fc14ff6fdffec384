//! The ladder's page: the rungs of a block or Stage around the chosen rung, with their power.
//!
//! Only the rungs on the screen are drawn, so that a block with thousands of rungs is drawn as fast
//! as a small one.

use std::ops::Range;

use ratatui_core::layout::Rect;

use super::pen::{Accent, ScreenPen};
use crate::ladder_view::{LadderView, RungView};
use crate::rows::value_text;
use crate::state::MonitorState;
use rungd_lab::draw::ladder::RungPicture;

/// A line of the page.
struct PageLine {
    text: String,
    accent: Accent,
    /// The columns of the chosen symbol in the drawing, which begins at the second column.
    chosen: Option<Range<usize>>,
}

impl PageLine {
    /// A line without the chosen symbol.
    fn new(text: String, accent: Accent) -> PageLine {
        PageLine { text, accent, chosen: None }
    }
}

/// Draws the page.
pub(super) fn ladder(pen: &mut ScreenPen, area: Rect, state: &MonitorState) {
    let view = &state.ladder;
    let Some((element, heading, rungs)) = view.shown() else {
        let why = view.trouble.as_deref().unwrap_or("loading the ladder");
        pen.put(area, 0, why, Accent::Plain);
        return;
    };
    let count = view.elements().len();
    let title = format!("{heading}, {} of {count}", view.element + 1);
    pen.put(area, 0, &title, Accent::Strong);
    pen.put_right(area, 0, &format!("rung {} of {}", view.rung + 1, rungs.len()));
    let body = Rect { y: area.y + 2, height: area.height.saturating_sub(2), ..area };
    let (lines, said) = lines(view, &element, rungs, body);
    let compared = rungs.get(view.rung).and_then(|rung| view.compared(&element, rung));
    pen.put(area, 1, &what_is_chosen(state, compared, &said), Accent::Plain);
    let wanted = lines.iter().find_map(|line| line.chosen.as_ref()).map_or(0, |chosen| chosen.end);
    let skipped = (wanted + 2).saturating_sub(usize::from(body.width));
    for (row, line) in (0..body.height).zip(&lines) {
        draw_line(pen, Rect { y: body.y + row, height: 1, ..body }, line, skipped);
    }
}

/// The operand of the marked symbol with its value, of a compare both sides with their values, and
/// the power at the symbol, in words.
fn what_is_chosen(state: &MonitorState, compared: Option<String>, said: &str) -> String {
    let operand = match state.ladder.operand() {
        _ if compared.is_some() => compared.map_or(String::new(), |text| format!("{text}; ")),
        Some(operand) => match value(state, &operand) {
            Some(value) => format!("{operand} is {value}; "),
            None => format!("{operand}; "),
        },
        None => String::new(),
    };
    let power = match (&state.ladder.power, &state.ladder.no_power) {
        (Some(power), _) => format!("{said} (scan {})", power.scan()),
        (None, Some(why)) => format!("no power is shown: {why}"),
        (None, None) => "no power is shown yet".to_owned(),
    };
    format!("{operand}{power}")
}

/// The value of an operand: in the scan whose power is shown, or else at the last look.
fn value(state: &MonitorState, operand: &str) -> Option<String> {
    let looked = state.value(operand);
    let Some(power) = &state.ladder.power else { return looked.map(value_text) };
    let forced = if looked.is_some_and(|shown| shown.forced) { ", forced" } else { "" };
    power.value(operand).map(|value| format!("{value}{forced}"))
}

/// The lines of the rungs around the chosen one, and the state of its marked symbol in words.
/// `body`: the part of the page for them.
fn lines(
    view: &LadderView,
    element: &str,
    rungs: &[RungPicture],
    body: Rect,
) -> (Vec<PageLine>, String) {
    // The drawing is one column to the right.
    let (columns, height) = (usize::from(body.width.saturating_sub(1)), usize::from(body.height));
    let Some(chosen) = rungs.get(view.rung) else { return (Vec::new(), String::new()) };
    let seen = view.rung_view(element, chosen, columns);
    let said = said(&seen, view.symbol).to_owned();
    let mut before: Vec<Vec<PageLine>> = Vec::new();
    let mut room = height / 3;
    for rung in rungs[..view.rung].iter().rev() {
        let lines = rung_lines(rung, &view.rung_view(element, rung, columns), None);
        let Some(left) = room.checked_sub(lines.len()) else { break };
        room = left;
        before.push(lines);
    }
    let mut lines: Vec<PageLine> = before.into_iter().rev().flatten().collect();
    lines.extend(rung_lines(chosen, &seen, Some(view.symbol)));
    for rung in &rungs[view.rung + 1..] {
        if lines.len() >= height * 2 {
            break;
        }
        lines.extend(rung_lines(rung, &view.rung_view(element, rung, columns), None));
    }
    // If a rung is higher than the page, the part with the symbol is shown.
    let marked = lines.iter().position(|line| line.chosen.is_some()).unwrap_or(0);
    let skipped = (marked + 3).saturating_sub(height);
    lines.drain(..skipped.min(lines.len()));
    (lines, said)
}

/// The title and the drawing of a rung, and an empty line.
fn rung_lines(rung: &RungPicture, seen: &RungView, symbol: Option<usize>) -> Vec<PageLine> {
    let idle = if seen.executes == Some(false) { "  not executed" } else { "" };
    let sign = if symbol.is_some() { "▶" } else { " " };
    let accent = if symbol.is_some() { Accent::Strong } else { Accent::Plain };
    let mut lines = vec![PageLine::new(format!("{sign}{}{idle}", rung.title()), accent)];
    let place = symbol.and_then(|at| seen.text.symbols.get(at));
    for (at, line) in seen.text.lines.iter().enumerate() {
        let chosen = place
            .filter(|symbol_place| symbol_place.line == at)
            .map(|symbol_place| symbol_place.columns.clone());
        lines.push(PageLine { text: format!(" {line}"), accent: Accent::Plain, chosen });
    }
    lines.push(PageLine::new(String::new(), Accent::Plain));
    lines
}

/// The state of a contact or instruction, in words.
fn said(seen: &RungView, symbol: usize) -> &'static str {
    let Some(flow) = &seen.flow else { return "its rung is not executed" };
    match flow.contacts.get(symbol) {
        Some(contact) => match (contact.conducts, contact.before) {
            (true, true) => "conducts, and power reaches it",
            (true, false) => "conducts, but no power reaches it",
            (false, true) => "does not conduct; power reaches it",
            (false, false) => "does not conduct, and no power reaches it",
        },
        None => match flow.outlets.get(symbol - flow.contacts.len()) {
            Some(legs) if legs.iter().all(|on| *on) => "has power",
            Some(legs) if legs.iter().any(|on| *on) => "has power on some legs",
            Some(_) | None => "has no power",
        },
    }
}

/// Draws a line into a row of the page, without its first `skipped` columns, and marks the edges
/// that it exceeds.
fn draw_line(pen: &mut ScreenPen, area: Rect, line: &PageLine, skipped: usize) {
    let rest: String = line.text.chars().skip(skipped).collect();
    pen.put(area, 0, &rest, line.accent);
    let wide = usize::from(area.width);
    if skipped > 0 && !line.text.is_empty() {
        pen.put(area, 0, "‹", Accent::Plain);
    }
    if rest.chars().count() > wide {
        let last = Rect { x: area.x + area.width - 1, width: 1, ..area };
        pen.put(last, 0, "›", Accent::Plain);
    }
    let Some(chosen) = &line.chosen else { return };
    // The drawing is one column to the right.
    let at = |column: usize| u16::try_from((column + 1).saturating_sub(skipped)).unwrap_or(0);
    let (from, to) = (at(chosen.start), at(chosen.end).min(area.width));
    let width = to.saturating_sub(from);
    pen.mark(Rect { x: area.x + from, width, ..area }, Accent::Chosen);
}
