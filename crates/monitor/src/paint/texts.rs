//! Pages of text: the answer to `why`, the help, and why no controller answers.

use ratatui_core::layout::Rect;

use super::pen::{Accent, ScreenPen, wrapped};
use crate::state::MonitorState;

/// The help. Its lines fit in 80 columns, and on one page of 24 rows.
const HELP: &str = "\
Everywhere   q ends, ? shows this, Esc goes back. Nothing is changed in a
             controller without a question that names the operand and values.
Panes        Tab, left, right: the next pane; up, down: its rows
  a          watch an operand: type its beginning, choose with the arrows
  d          remove the operand from the watch list
  w, Enter   explain the operand's value
  f, u, s    force it; release the force; write it
  k, h       acknowledge the alarm; shelve it, or bring it back
  l          the ladder; Enter on a block or Stage: its rungs
Ladder       up, down: the rungs; left, right: contacts and instructions
  Tab        the next block or Stage
  w, f, u, s, a   as above, for the marked operand in the ladder

In the ladder, heavy lines have power, and ● stands in a contact that
conducts and in an instruction that has power. Thin lines have none.
In the panes ● is ON, ○ is OFF; words say it too. A trend has five values
a second, between the least and the greatest of those that are shown.";

/// Draws the help.
pub(super) fn help(pen: &mut ScreenPen, area: Rect) {
    pen.put(area, 0, "Keys", Accent::Strong);
    for (row, line) in (1..).zip(HELP.lines()) {
        pen.put(area, row, line, Accent::Plain);
    }
}

/// Draws the answer to `why`.
pub(super) fn why(pen: &mut ScreenPen, area: Rect, state: &MonitorState) {
    pen.put(area, 0, &state.why.heading, Accent::Strong);
    let lines = wrapped(&state.why.text, usize::from(area.width));
    for (row, line) in (1..area.height).zip(lines.iter().skip(state.why.top)) {
        pen.put(area, row, line, Accent::Plain);
    }
}

/// Draws the reason why no controller has answered yet.
pub fn silence(pen: &mut ScreenPen, area: Rect, state: &MonitorState) {
    let Some(silence) = &state.silence else { return };
    let hint = "The page continues by itself when the controller answers.";
    let text = format!("{}\n\n{hint}", silence.why);
    for (row, line) in (1..area.height).zip(wrapped(&text, usize::from(area.width))) {
        pen.put(area, row, &line, Accent::Plain);
    }
}
