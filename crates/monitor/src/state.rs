//! The state of the monitor: the last look at the controller, the watch list, the ladder, and the
//! user's position.
//!
//! `update` changes the state, `rows` and `paint` show it. No clock, no thread, no terminal: the
//! time is received as an event.

use super::dialog::Dialog;
use super::ladder_view::LadderView;
use super::message::{ControllerLook, MonitorAction, ThreadOrder};
use super::watch_list::WatchList;
use rungd_base::variants::all_variants;
pub use rungd_client::operator::protocol::{ControllerStatus, ShownValue};

/// The panes of the first page, in the order of Tab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MonitorPane {
    Watch,
    Blocks,
    Alarms,
    Forces,
    Devices,
}

/// The pages. Each is shown over the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MonitorPage {
    Panes,
    Ladder,
    Why,
    Help,
}

/// Why the controller does not answer, and since when.
#[derive(Clone, Debug)]
pub(super) struct ControllerSilence {
    pub why: String,
    pub since_ms: u64,
}

/// A text that is longer than the page.
#[derive(Clone, Debug, Default)]
pub(super) struct LongText {
    pub heading: String,
    pub text: String,
    /// The first line that is shown.
    pub top: usize,
}

/// Everything that is shown.
#[derive(Clone, Debug, Default)]
pub(super) struct MonitorState {
    pub now_ms: u64,
    /// The state of the controller at the last look; `None` before the first one.
    pub status: Option<ControllerStatus>,
    /// The values of the last look.
    pub values: Vec<ShownValue>,
    pub silence: Option<ControllerSilence>,
    pub watch: WatchList,
    /// The operands of the command line, until the first look at a controller.
    pub at_start: Vec<String>,
    /// The open pages, the last one on top. If none is open, the panes are shown.
    pub pages: Vec<MonitorPage>,
    /// The pane with the focus, as an index of `MonitorPane::ALL`.
    pub pane: usize,
    /// The chosen row of each pane.
    pub chosen: [usize; 5],
    pub ladder: LadderView,
    /// The time of the last request for the ladder.
    pub ladder_asked_ms: Option<u64>,
    pub why: LongText,
    pub dialog: Option<Dialog>,
    /// The result of the last command.
    pub said: String,
    /// The operands ordered last.
    pub reads: Vec<String>,
    pub follows: bool,
}

impl MonitorPane {
    pub const ALL: [MonitorPane; 5] = all_variants![
        MonitorPane::Watch,
        MonitorPane::Blocks,
        MonitorPane::Alarms,
        MonitorPane::Forces,
        MonitorPane::Devices,
    ];

    /// The heading of the pane.
    pub fn heading(self) -> &'static str {
        match self {
            MonitorPane::Watch => "Watch",
            MonitorPane::Blocks => "Blocks",
            MonitorPane::Alarms => "Alarms",
            MonitorPane::Forces => "Forces",
            MonitorPane::Devices => "Devices",
        }
    }
}

impl MonitorState {
    /// The state before the first look.
    pub fn watching(operands: Vec<String>) -> MonitorState {
        MonitorState { at_start: operands, ..MonitorState::default() }
    }

    /// The page on top.
    pub fn page(&self) -> MonitorPage {
        self.pages.last().copied().unwrap_or(MonitorPage::Panes)
    }

    /// The pane with the focus.
    pub fn focus(&self) -> MonitorPane {
        MonitorPane::ALL[self.pane % MonitorPane::ALL.len()]
    }

    /// The value of an operand at the last look.
    pub fn value(&self, operand: &str) -> Option<&ShownValue> {
        let watched = self.watch.rows.iter().filter_map(|row| row.shown.as_ref());
        let forced = self.status.iter().flat_map(|status| &status.forces);
        let is_it =
            |value: &&ShownValue| value.operand == operand || value.tag.as_deref() == Some(operand);
        self.values.iter().chain(watched).chain(forced).find(is_it)
    }

    /// Takes the result of a look.
    pub fn look(&mut self, look: ControllerLook) {
        self.watch.take(&look.values, &look.unknown);
        (self.status, self.values, self.silence) = (Some(look.status), look.values, None);
    }

    /// Notes that the controller does not answer.
    pub fn miss(&mut self, why: String) {
        let since_ms = self.silence.as_ref().map_or(self.now_ms, |silence| silence.since_ms);
        self.silence = Some(ControllerSilence { why, since_ms });
        self.ladder.power = None;
        self.watch.miss();
    }

    /// The orders that the shown page requires: the operands to read, and whether to follow the
    /// power. Empty if nothing has changed.
    pub fn standing_orders(&mut self) -> Vec<MonitorAction> {
        let mut reads: Vec<String> =
            self.watch.rows.iter().map(|row| row.operand.clone()).collect();
        let of_dialog = self.dialog.as_ref().and_then(Dialog::operand).map(str::to_owned);
        let of_ladder = || self.ladder.operand();
        let shows_ladder = self.page() == MonitorPage::Ladder;
        reads.extend(of_dialog.or_else(|| shows_ladder.then(of_ladder).flatten()));
        reads.sort_unstable();
        reads.dedup();
        let mut wishes = Vec::new();
        if reads != self.reads {
            self.reads.clone_from(&reads);
            wishes.push(MonitorAction::Ask(ThreadOrder::Read(reads)));
        }
        let follows = self.pages.contains(&MonitorPage::Ladder);
        if follows != self.follows {
            self.follows = follows;
            wishes.push(MonitorAction::Ask(ThreadOrder::Follow(follows)));
        }
        wishes
    }
}
