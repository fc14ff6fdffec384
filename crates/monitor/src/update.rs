//! Applies an event to the state, and returns the wishes that follow. Pure.
//!
//! `run` calls it for each key, each piece of news and each tick.

use super::dialog::{ChangeWanted, Dialog, Typed, edit};
use super::message::{MonitorEvent, MonitorNews, MonitorOrder, MonitorWish, Press};
use super::state::{LongText, MonitorPage, MonitorPane, MonitorState};
pub use rungd_client::operator::protocol::{Held, ShownValue};

/// The time until the next request for a ladder that does not arrive.
const LADDER_AGAIN_MS: u64 = 3000;

/// The number of rows for PgUp and PgDn.
const PAGE_ROWS: isize = 10;

/// Applies an event.
pub(super) fn update(state: &mut MonitorState, event: MonitorEvent) -> Vec<MonitorWish> {
    let mut wishes = match event {
        MonitorEvent::Press(press) => pressed(state, press),
        MonitorEvent::News(news) => told(state, news),
        MonitorEvent::Tick(now_ms) => {
            state.now_ms = now_ms;
            Vec::new()
        }
    };
    wishes.extend(state.standing_orders());
    wishes
}

fn ask(order: MonitorOrder) -> Vec<MonitorWish> {
    vec![MonitorWish::Ask(order)]
}

/// Applies news from the controller.
fn told(state: &mut MonitorState, news: MonitorNews) -> Vec<MonitorWish> {
    match news {
        MonitorNews::Look(look) => {
            state.look(*look);
            propose(state);
            let found = std::mem::take(&mut state.at_start).into_iter().map(MonitorOrder::Find);
            let mut wishes: Vec<MonitorWish> = found.map(MonitorWish::Ask).collect();
            wishes.extend(ladder_wanted(state));
            return wishes;
        }
        MonitorNews::Silent(why) => state.miss(why),
        MonitorNews::Ladder(sha256, found) => state.ladder.take(sha256, found),
        MonitorNews::Power(Ok(power)) => {
            (state.ladder.power, state.ladder.no_power) = (Some(power), None);
        }
        MonitorNews::Power(Err(why)) => {
            (state.ladder.power, state.ladder.no_power) = (None, Some(why));
        }
        MonitorNews::Names(prefix, names) => {
            if let Some(Dialog::Add(typed)) = &mut state.dialog {
                typed.take(&prefix, names);
            }
        }
        MonitorNews::Found(Ok(values)) => {
            let last = values.last().map(|of| of.operand.clone());
            if !state.watch.add(values) {
                state.said = "the watch list is full: remove an operand with d".to_owned();
            }
            let at = state.watch.rows.iter().position(|row| Some(&row.operand) == last.as_ref());
            state.chosen[0] = at.unwrap_or(state.chosen[0]);
        }
        MonitorNews::Why(operand, answer) => {
            let (heading, text) = match answer {
                Ok(text) => (format!("Why: {operand}"), text),
                Err(why) => (format!("Why: {operand}"), format!("no answer: {why}")),
            };
            state.why = LongText { heading, text, top: 0 };
        }
        // Several operands of the command line may be refused at once.
        MonitorNews::Found(Err(said)) if !state.said.is_empty() && state.said.len() < 400 => {
            state.said = format!("{}\n{said}", state.said);
        }
        MonitorNews::Found(Err(said)) | MonitorNews::Changed(Ok(said) | Err(said)) => {
            state.said = said;
        }
    }
    Vec::new()
}

/// The order for the ladder, if the running program differs from the drawn one.
fn ladder_wanted(state: &mut MonitorState) -> Option<MonitorWish> {
    let running = &state.status.as_ref()?.ladder.sha256;
    let is_there = *running == state.ladder.sha256 && state.ladder.program.is_some();
    let waits = |asked: u64| state.now_ms < asked.saturating_add(LADDER_AGAIN_MS);
    if is_there || state.ladder_asked_ms.is_some_and(waits) {
        return None;
    }
    state.ladder_asked_ms = Some(state.now_ms);
    Some(MonitorWish::Ask(MonitorOrder::Ladder))
}

fn pressed(state: &mut MonitorState, press: Press) -> Vec<MonitorWish> {
    state.said.clear();
    if press == Press::Interrupt {
        return vec![MonitorWish::Quit];
    }
    if let Some(dialog) = state.dialog.take() {
        return answered(state, dialog, press);
    }
    if press == Press::Char('q') {
        return vec![MonitorWish::Quit];
    }
    if press == Press::Char('?') {
        open(state, MonitorPage::Help);
        return Vec::new();
    }
    match state.page() {
        MonitorPage::Panes => in_panes(state, press),
        MonitorPage::Ladder => in_ladder(state, press),
        MonitorPage::Why | MonitorPage::Help => in_text(state, press),
    }
}

fn open(state: &mut MonitorState, page: MonitorPage) {
    state.pages.retain(|of| *of != page);
    state.pages.push(page);
}

/// The keys of the first page.
fn in_panes(state: &mut MonitorState, press: Press) -> Vec<MonitorWish> {
    let panes = MonitorPane::ALL.len();
    let row = state.row();
    if let Some(step) = rows_of(press) {
        let count = state.rows(state.focus()).len();
        let at = state.chosen_row(state.pane).saturating_add_signed(step);
        state.chosen[state.pane] = at.min(count.saturating_sub(1));
    } else if matches!(press, Press::Tab | Press::Right) {
        state.pane = (state.pane + 1) % panes;
    } else if matches!(press, Press::BackTab | Press::Left) {
        state.pane = (state.pane + panes - 1) % panes;
    } else if press == Press::Char('a') {
        state.dialog = Some(Dialog::Add(Typed::default()));
        return ask(MonitorOrder::Names(String::new()));
    } else if matches!(press, Press::Char('d') | Press::Delete) {
        let watched = row.and_then(|row| row.watched);
        watched.into_iter().for_each(|at| drop(state.watch.rows.remove(at)));
    } else if press == Press::Char('l')
        || press == Press::Enter && state.focus() == MonitorPane::Blocks
    {
        row.and_then(|row| row.element).iter().for_each(|of| state.ladder.open(of));
        open(state, MonitorPage::Ladder);
    } else {
        let press = if press == Press::Enter { Press::Char('w') } else { press };
        return about(state, row.and_then(|row| row.operand), press);
    }
    Vec::new()
}

/// The rows by which a key moves down; a negative number moves up.
fn rows_of(press: Press) -> Option<isize> {
    match press {
        Press::Up => Some(-1),
        Press::Down => Some(1),
        Press::PageUp => Some(-PAGE_ROWS),
        Press::PageDown => Some(PAGE_ROWS),
        Press::Home => Some(isize::MIN),
        Press::End => Some(isize::MAX),
        Press::Char(_)
        | Press::Enter
        | Press::Escape
        | Press::Tab
        | Press::BackTab
        | Press::Left
        | Press::Right
        | Press::Backspace
        | Press::Delete
        | Press::Interrupt => None,
    }
}

/// The keys of the ladder.
fn in_ladder(state: &mut MonitorState, press: Press) -> Vec<MonitorWish> {
    if let Some(step) = rows_of(press) {
        state.ladder.go_down(step);
    } else if matches!(press, Press::Left | Press::Right) {
        state.ladder.go_right(if press == Press::Right { 1 } else { -1 });
    } else if matches!(press, Press::Tab | Press::BackTab) {
        state.ladder.turn(press == Press::Tab);
    } else if matches!(press, Press::Escape | Press::Backspace | Press::Char('l')) {
        state.pages.pop();
    } else if press == Press::Char('a') {
        let operand = state.ladder.operand();
        return operand.map_or(Vec::new(), |of| ask(MonitorOrder::Find(of)));
    } else {
        let press = if press == Press::Enter { Press::Char('w') } else { press };
        return about(state, state.ladder.operand(), press);
    }
    Vec::new()
}

/// The keys of a long text.
fn in_text(state: &mut MonitorState, press: Press) -> Vec<MonitorWish> {
    if let Some(step) = rows_of(press) {
        let lines = state.why.text.lines().count();
        let top = state.why.top.saturating_add_signed(step);
        state.why.top = top.min(lines.saturating_sub(1));
    } else if matches!(press, Press::Escape | Press::Backspace | Press::Enter) {
        state.pages.pop();
    }
    Vec::new()
}

/// The keys for an operand: `why`, and changes, which open a dialog first.
fn about(state: &mut MonitorState, operand: Option<String>, press: Press) -> Vec<MonitorWish> {
    let keys = [
        ('f', ChangeWanted::Force),
        ('s', ChangeWanted::Write),
        ('u', ChangeWanted::Release),
        ('k', ChangeWanted::Acknowledge),
    ];
    let wanted = keys.into_iter().find(|(key, _)| press == Press::Char(*key)).map(|(_, of)| of);
    if wanted.is_none() && press != Press::Char('w') {
        return Vec::new();
    }
    let Some(operand) = operand else {
        state.said = "no operand is chosen: choose one with the arrows".to_owned();
        return Vec::new();
    };
    let Some(wanted) = wanted else {
        let (heading, text) = (format!("Why: {operand}"), "waiting for the controller".to_owned());
        state.why = LongText { heading, text, top: 0 };
        open(state, MonitorPage::Why);
        return ask(MonitorOrder::Why(operand));
    };
    let text = String::new();
    state.dialog = Some(match wanted {
        ChangeWanted::Release | ChangeWanted::Acknowledge => {
            Dialog::Confirm { wanted, operand, text }
        }
        ChangeWanted::Force | ChangeWanted::Write => {
            Dialog::NewValue { wanted, operand, text, is_typed: false }
        }
    });
    propose(state);
    Vec::new()
}

/// Proposes a new value as soon as the present one is known, until the user types.
fn propose(state: &mut MonitorState) {
    let Some(Dialog::NewValue { operand, is_typed: false, .. }) = &state.dialog else { return };
    let proposal = state.value(operand).map(proposed).unwrap_or_default();
    if let Some(Dialog::NewValue { text, .. }) = &mut state.dialog {
        *text = proposal;
    }
}

/// The proposal for a bit is the opposite value; there is none for a word.
fn proposed(shown: &ShownValue) -> String {
    match shown.value {
        Held::Bit(true) => "OFF".to_owned(),
        Held::Bit(false) => "ON".to_owned(),
        Held::Word(_) | Held::Real(_) => String::new(),
    }
}

/// Handles a key while a dialog is open.
fn answered(state: &mut MonitorState, dialog: Dialog, press: Press) -> Vec<MonitorWish> {
    if press == Press::Escape {
        return Vec::new();
    }
    match dialog {
        Dialog::Add(mut typed) => {
            if press == Press::Enter {
                let operand = typed.shown().trim().to_owned();
                return match operand.is_empty() {
                    true => Vec::new(),
                    false => ask(MonitorOrder::Find(operand)),
                };
            }
            let is_new = typed.press(press);
            let prefix = typed.text.clone();
            state.dialog = Some(Dialog::Add(typed));
            if is_new { ask(MonitorOrder::Names(prefix)) } else { Vec::new() }
        }
        Dialog::NewValue { wanted, operand, mut text, is_typed } => {
            let is_done = press == Press::Enter && !text.trim().is_empty();
            if !is_typed && matches!(press, Press::Char(_)) {
                // The first typed character replaces the proposal.
                text.clear();
            }
            let is_typed = edit(&mut text, press) || is_typed;
            state.dialog = Some(match is_done {
                true => Dialog::Confirm { wanted, operand, text: text.trim().to_owned() },
                false => Dialog::NewValue { wanted, operand, text, is_typed },
            });
            Vec::new()
        }
        Dialog::Confirm { wanted, operand, text } => {
            if matches!(press, Press::Char('y' | 'Y')) {
                return ask(MonitorOrder::Change(wanted.request(operand, text)));
            }
            // A key pressed once too often must neither change anything nor close the dialog.
            if !matches!(press, Press::Char('n' | 'N')) {
                state.dialog = Some(Dialog::Confirm { wanted, operand, text });
            }
            Vec::new()
        }
    }
}
