//! Applies an event to the state, and returns the wishes that follow. Pure.
//!
//! `run` calls it for each key, each piece of news and each tick.

use super::dialog::{Dialog, TypedName, TypedShelf, WantedChange, edit};
use super::message::{KeyPress, MonitorAction, MonitorEvent, MonitorNews, ThreadOrder};
use super::state::{LongText, MonitorPage, MonitorPane, MonitorState};
pub use rungd_client::operator::protocol::{AlarmStatus, BitOrNumber, ShownValue};

/// The time until the next request for a ladder that does not arrive.
const LADDER_AGAIN_MS: u64 = 3000;

/// The number of rows for PgUp and PgDn.
const PAGE_ROWS: isize = 10;

/// Applies an event.
pub(super) fn update(state: &mut MonitorState, event: MonitorEvent) -> Vec<MonitorAction> {
    let mut wishes = match event {
        MonitorEvent::Press(press) => pressed(state, press),
        MonitorEvent::News(news) => apply_news(state, news),
        MonitorEvent::Tick(now_ms) => {
            state.now_ms = now_ms;
            Vec::new()
        }
    };
    wishes.extend(state.standing_orders());
    wishes
}

/// Why the line of a watch does not hold, which its alarm says; empty for anything else.
fn of_watch(state: &MonitorState, name: &str) -> Vec<String> {
    let mut alarms = state.status.iter().flat_map(|status| &status.alarms);
    alarms.find(|alarm| alarm.tag == name).map_or_else(Vec::new, AlarmStatus::watch_lines)
}

fn ask(order: ThreadOrder) -> Vec<MonitorAction> {
    vec![MonitorAction::Ask(order)]
}

/// Applies news from the controller.
fn apply_news(state: &mut MonitorState, news: MonitorNews) -> Vec<MonitorAction> {
    match news {
        MonitorNews::Look(look) => {
            state.look(*look);
            propose(state);
            let found = std::mem::take(&mut state.at_start).into_iter().map(ThreadOrder::Find);
            let mut wishes: Vec<MonitorAction> = found.map(MonitorAction::Ask).collect();
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
            let last = values.last().map(|value| value.operand.clone());
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
fn ladder_wanted(state: &mut MonitorState) -> Option<MonitorAction> {
    let running = &state.status.as_ref()?.ladder.sha256;
    let is_there = *running == state.ladder.sha256 && state.ladder.program.is_some();
    let waits = |asked: u64| state.now_ms < asked.saturating_add(LADDER_AGAIN_MS);
    if is_there || state.ladder_asked_ms.is_some_and(waits) {
        return None;
    }
    state.ladder_asked_ms = Some(state.now_ms);
    Some(MonitorAction::Ask(ThreadOrder::Ladder))
}

fn pressed(state: &mut MonitorState, press: KeyPress) -> Vec<MonitorAction> {
    state.said.clear();
    if press == KeyPress::Interrupt {
        return vec![MonitorAction::Quit];
    }
    if let Some(dialog) = state.dialog.take() {
        return answered(state, dialog, press);
    }
    if press == KeyPress::Char('q') {
        return vec![MonitorAction::Quit];
    }
    if press == KeyPress::Char('?') {
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
    state.pages.retain(|open_page| *open_page != page);
    state.pages.push(page);
}

/// The keys of the first page.
fn in_panes(state: &mut MonitorState, press: KeyPress) -> Vec<MonitorAction> {
    let panes = MonitorPane::ALL.len();
    let row = state.row();
    if let Some(step) = rows_of(press) {
        let count = state.rows(state.focus()).len();
        let at = state.chosen_row(state.pane).saturating_add_signed(step);
        state.chosen[state.pane] = at.min(count.saturating_sub(1));
    } else if matches!(press, KeyPress::Tab | KeyPress::Right) {
        state.pane = (state.pane + 1) % panes;
    } else if matches!(press, KeyPress::BackTab | KeyPress::Left) {
        state.pane = (state.pane + panes - 1) % panes;
    } else if press == KeyPress::Char('a') {
        state.dialog = Some(Dialog::Add(TypedName::default()));
        return ask(ThreadOrder::Names(String::new()));
    } else if matches!(press, KeyPress::Char('d') | KeyPress::Delete) {
        let watched = row.and_then(|row| row.watched);
        watched.into_iter().for_each(|at| drop(state.watch.rows.remove(at)));
    } else if press == KeyPress::Char('l')
        || press == KeyPress::Enter && state.focus() == MonitorPane::Blocks
    {
        row.and_then(|row| row.element).iter().for_each(|element| state.ladder.open(element));
        open(state, MonitorPage::Ladder);
    } else {
        let press = if press == KeyPress::Enter { KeyPress::Char('w') } else { press };
        return about(state, row.and_then(|row| row.operand), press);
    }
    Vec::new()
}

/// The rows by which a key moves down; a negative number moves up.
fn rows_of(press: KeyPress) -> Option<isize> {
    match press {
        KeyPress::Up => Some(-1),
        KeyPress::Down => Some(1),
        KeyPress::PageUp => Some(-PAGE_ROWS),
        KeyPress::PageDown => Some(PAGE_ROWS),
        KeyPress::Home => Some(isize::MIN),
        KeyPress::End => Some(isize::MAX),
        KeyPress::Char(_)
        | KeyPress::Enter
        | KeyPress::Escape
        | KeyPress::Tab
        | KeyPress::BackTab
        | KeyPress::Left
        | KeyPress::Right
        | KeyPress::Backspace
        | KeyPress::Delete
        | KeyPress::Interrupt => None,
    }
}

/// The keys of the ladder.
fn in_ladder(state: &mut MonitorState, press: KeyPress) -> Vec<MonitorAction> {
    if let Some(step) = rows_of(press) {
        state.ladder.go_down(step);
    } else if matches!(press, KeyPress::Left | KeyPress::Right) {
        state.ladder.go_right(if press == KeyPress::Right { 1 } else { -1 });
    } else if matches!(press, KeyPress::Tab | KeyPress::BackTab) {
        state.ladder.turn(press == KeyPress::Tab);
    } else if matches!(press, KeyPress::Escape | KeyPress::Backspace | KeyPress::Char('l')) {
        state.pages.pop();
    } else if press == KeyPress::Char('a') {
        let operand = state.ladder.operand();
        return operand.map_or(Vec::new(), |operand| ask(ThreadOrder::Find(operand)));
    } else {
        let press = if press == KeyPress::Enter { KeyPress::Char('w') } else { press };
        return about(state, state.ladder.operand(), press);
    }
    Vec::new()
}

/// The keys of a long text.
fn in_text(state: &mut MonitorState, press: KeyPress) -> Vec<MonitorAction> {
    if let Some(step) = rows_of(press) {
        let lines = state.why.text.lines().count();
        let top = state.why.top.saturating_add_signed(step);
        state.why.top = top.min(lines.saturating_sub(1));
    } else if matches!(press, KeyPress::Escape | KeyPress::Backspace | KeyPress::Enter) {
        state.pages.pop();
    }
    Vec::new()
}

/// The keys for an operand: `why`, and changes, which open a dialog first.
fn about(state: &mut MonitorState, operand: Option<String>, press: KeyPress) -> Vec<MonitorAction> {
    let keys = [
        ('f', WantedChange::Force),
        ('s', WantedChange::Write),
        ('u', WantedChange::Release),
        ('k', WantedChange::Acknowledge),
    ];
    let wanted =
        keys.into_iter().find(|(key, _)| press == KeyPress::Char(*key)).map(|(_, page)| page);
    if wanted.is_none() && !matches!(press, KeyPress::Char('w' | 'h')) {
        return Vec::new();
    }
    let Some(operand) = operand else {
        state.said = "no operand is chosen: choose one with the arrows".to_owned();
        return Vec::new();
    };
    if press == KeyPress::Char('h') {
        shelve(state, operand);
        return Vec::new();
    }
    let Some(wanted) = wanted else {
        let (heading, known) = (format!("Why: {operand}"), of_watch(state, &operand));
        let orders = if known.is_empty() { ask(ThreadOrder::Why(operand)) } else { Vec::new() };
        let waits = || "waiting for the controller".to_owned();
        let text = if known.is_empty() { waits() } else { known.join("\n") };
        state.why = LongText { heading, text, top: 0 };
        open(state, MonitorPage::Why);
        return orders;
    };
    let text = String::new();
    state.dialog = Some(match wanted {
        WantedChange::Release | WantedChange::Acknowledge | WantedChange::Unshelve => {
            Dialog::Confirm { wanted, operand, text }
        }
        WantedChange::Force | WantedChange::Write => {
            Dialog::NewValue { wanted, operand, text, is_typed: false }
        }
    });
    propose(state);
    Vec::new()
}

/// Opens the dialog that shelves an alarm, or brings it back.
fn shelve(state: &mut MonitorState, operand: String) {
    let mut alarms = state.status.iter().flat_map(|status| &status.alarms);
    let Some(alarm) = alarms.find(|alarm| alarm.tag == operand) else {
        state.said = format!("{operand} is no alarm of the list");
        return;
    };
    state.dialog = Some(match alarm.shelved {
        None => Dialog::Shelve(TypedShelf::new(operand)),
        Some(_) => {
            let (wanted, text) = (WantedChange::Unshelve, String::new());
            Dialog::Confirm { wanted, operand, text }
        }
    });
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
        BitOrNumber::Bit(true) => "OFF".to_owned(),
        BitOrNumber::Bit(false) => "ON".to_owned(),
        BitOrNumber::Word(_) | BitOrNumber::Real(_) => String::new(),
    }
}

/// Handles a key while a dialog is open.
fn answered(state: &mut MonitorState, dialog: Dialog, press: KeyPress) -> Vec<MonitorAction> {
    if press == KeyPress::Escape {
        return Vec::new();
    }
    match dialog {
        Dialog::Add(mut typed) => {
            if press == KeyPress::Enter {
                let operand = typed.shown().trim().to_owned();
                return match operand.is_empty() {
                    true => Vec::new(),
                    false => ask(ThreadOrder::Find(operand)),
                };
            }
            let is_new = typed.press(press);
            let prefix = typed.text.clone();
            state.dialog = Some(Dialog::Add(typed));
            if is_new { ask(ThreadOrder::Names(prefix)) } else { Vec::new() }
        }
        Dialog::Shelve(mut typed) => match typed.press(press) {
            Ok(Some(request)) => ask(ThreadOrder::Change(request)),
            Ok(None) => {
                state.dialog = Some(Dialog::Shelve(typed));
                Vec::new()
            }
            Err(why) => {
                (state.said, state.dialog) = (why, Some(Dialog::Shelve(typed)));
                Vec::new()
            }
        },
        Dialog::NewValue { wanted, operand, mut text, is_typed } => {
            let is_done = press == KeyPress::Enter && !text.trim().is_empty();
            if !is_typed && matches!(press, KeyPress::Char(_)) {
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
            if matches!(press, KeyPress::Char('y' | 'Y')) {
                return ask(ThreadOrder::Change(wanted.request(operand, text)));
            }
            // A key pressed once too often must neither change anything nor close the dialog.
            if !matches!(press, KeyPress::Char('n' | 'N')) {
                state.dialog = Some(Dialog::Confirm { wanted, operand, text });
            }
            Vec::new()
        }
    }
}
