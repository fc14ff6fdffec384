//! Draws the state: a head with the mode and the scan, the open page, a line with the result of the
//! last command, and the keys.
//!
//! `run` calls [`paint`] after each event. Pure: the same state gives the same picture.

mod dialogs;
mod head;
mod ladder;
mod panes;
pub(super) mod pen;
mod texts;

use ratatui_core::layout::Rect;
use ratatui_core::terminal::Frame;

use self::pen::{Accent, ScreenPen, wrapped};
use super::state::{MonitorPage, MonitorState};

/// The rows of the head, and of the foot.
const HEAD: u16 = 3;
const FOOT: u16 = 2;

/// The most rows for the result of the last command.
const SAID_MAX: u16 = 5;

/// The smallest window, in columns and rows, in which a page is drawn.
const LEAST: (u16, u16) = (40, 12);

/// Draws everything.
pub(super) fn paint(frame: &mut Frame, state: &MonitorState, has_colours: bool) {
    let area = frame.area();
    let mut pen = ScreenPen { buffer: frame.buffer_mut(), has_colours };
    if area.width < LEAST.0 || area.height < LEAST.1 {
        let (wide, high) = LEAST;
        pen.put(area, 0, &format!("the window is smaller than {wide}x{high}"), Accent::Plain);
        return;
    }
    head::head(&mut pen, Rect { height: HEAD, ..area }, state);
    let body = Rect { y: area.y + HEAD, height: area.height - HEAD - FOOT, ..area };
    match state.page() {
        MonitorPage::Panes if state.status.is_none() => texts::silence(&mut pen, body, state),
        MonitorPage::Panes => panes::panes(&mut pen, body, state),
        MonitorPage::Ladder => ladder::ladder(&mut pen, body, state),
        MonitorPage::Why => texts::why(&mut pen, body, state),
        MonitorPage::Help => texts::help(&mut pen, body),
    }
    let foot = Rect { y: area.y + area.height - FOOT, height: FOOT, ..area };
    said(&mut pen, Rect { height: area.height - 1, ..area }, &state.said);
    pen.row(foot, 1, keys(state), Accent::Chosen);
    if let Some(dialog) = &state.dialog {
        dialogs::dialog(&mut pen, body, state, dialog);
    }
}

/// Draws the result of the last command in the last row of an area, or in several rows if it is
/// long.
fn said(pen: &mut ScreenPen, area: Rect, text: &str) {
    let lines = wrapped(text, usize::from(area.width));
    let height = u16::try_from(lines.len()).unwrap_or(SAID_MAX).min(SAID_MAX);
    let below = Rect { y: area.y + area.height - height, height, ..area };
    for (row, line) in (0..height).zip(&lines) {
        pen.row(below, row, line, Accent::Strong);
    }
}

/// The most important keys.
fn keys(state: &MonitorState) -> &'static str {
    if state.dialog.is_some() {
        return "Enter: accept  Esc: cancel";
    }
    match state.page() {
        MonitorPage::Panes => {
            "Tab pane  a add  d remove  w why  f force  u release  s write  l ladder  ?  q"
        }
        MonitorPage::Ladder => {
            "arrows  Tab next  w why  f force  u release  s write  a watch  Esc back  ?  q"
        }
        MonitorPage::Why | MonitorPage::Help => "arrows scroll  Esc back  q quit",
    }
}
