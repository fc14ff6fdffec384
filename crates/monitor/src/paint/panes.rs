//! The first page: the panes with their rows. The watch list and the blocks share the left half,
//! the other panes the right half.

use ratatui_core::layout::Rect;

use super::pen::{Accent, ScreenPen, visible};
use crate::rows::PaneRow;
use crate::state::{MonitorPane, MonitorState};

/// Draws the panes.
pub(super) fn panes(pen: &mut ScreenPen, area: Rect, state: &MonitorState) {
    let half = area.width / 2;
    let left = Rect { width: half.saturating_sub(1), ..area };
    let right = Rect { x: area.x + half, width: area.width - half, ..area };
    let split = |area: Rect, panes: &[usize]| {
        let wanted = panes.iter().map(|at| state.rows(MonitorPane::ALL[*at]).len().max(1) + 1);
        let heights = shares(area.height, &wanted.collect::<Vec<_>>());
        let mut y = area.y;
        let mut areas = Vec::new();
        for (at, height) in panes.iter().zip(heights) {
            areas.push((*at, Rect { y, height, ..area }));
            y += height;
        }
        areas
    };
    for (at, area) in split(left, &[0, 1]).into_iter().chain(split(right, &[2, 3, 4])) {
        pane(pen, area, state, at);
    }
}

/// Divides the rows. Each pane gets the rows that it wants if there is room for all; otherwise the
/// panes that want more than their share are shortened. The last pane gets the remaining rows.
fn shares(height: u16, wanted: &[usize]) -> Vec<u16> {
    let mut left = usize::from(height);
    let mut heights = vec![0; wanted.len()];
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by_key(|at| wanted[*at]);
    for (done, at) in order.into_iter().enumerate() {
        let share = left / (wanted.len() - done);
        heights[at] = wanted[at].min(share);
        left -= heights[at];
    }
    if let Some(last) = heights.last_mut() {
        *last += left;
    }
    heights.into_iter().map(|height| u16::try_from(height).unwrap_or(u16::MAX)).collect()
}

fn pane(pen: &mut ScreenPen, area: Rect, state: &MonitorState, at: usize) {
    let pane = MonitorPane::ALL[at];
    let has_keys = state.focus() == pane;
    let rows = state.rows(pane);
    let chosen = state.chosen_row(at);
    let count = rows.len();
    heading(pen, area, &PaneHeading { text: pane.heading(), has_keys, chosen, count });
    let body = Rect { y: area.y + 1, height: area.height.saturating_sub(1), ..area };
    if rows.is_empty() {
        pen.put(body, 0, empty(pane), Accent::Plain);
        return;
    }
    let top = (chosen + 1).saturating_sub(usize::from(body.height));
    for (n, row) in rows.iter().enumerate().skip(top).take(usize::from(body.height)) {
        let line = u16::try_from(n - top).unwrap_or(u16::MAX);
        let line = Rect { y: body.y + line, height: 1, ..body };
        draw_row(pen, line, state, row);
        if has_keys && n == chosen {
            pen.mark(line, Accent::Chosen);
        }
    }
}

/// The heading of a pane.
struct PaneHeading<'a> {
    text: &'a str,
    /// Whether the pane has the focus.
    has_keys: bool,
    /// The index of the chosen row.
    chosen: usize,
    /// The number of rows.
    count: usize,
}

/// Draws `━▶ Alarms 2 of 7 ━━━`, with a heavy line if the pane has the focus.
fn heading(pen: &mut ScreenPen, area: Rect, pane_heading: &PaneHeading) {
    let PaneHeading { text, has_keys, chosen, count } = *pane_heading;
    let count = match count {
        0 | 1 => String::new(),
        _ => format!(" {} of {count}", chosen + 1),
    };
    let (line, sign, accent) = match has_keys {
        true => ("━", "▶", Accent::Strong),
        false => ("─", " ", Accent::Plain),
    };
    let text = format!("{line}{sign}{text}{count} ");
    let rest = usize::from(area.width).saturating_sub(text.chars().count());
    pen.put(area, 0, &format!("{text}{}", line.repeat(rest)), accent);
}

fn empty(pane: MonitorPane) -> &'static str {
    match pane {
        MonitorPane::Watch => "nothing yet: a adds an operand",
        MonitorPane::Blocks | MonitorPane::Devices | MonitorPane::Forces => "none",
        MonitorPane::Alarms => "none stands",
    }
}

/// Draws a row of a pane into a line of the screen.
fn draw_row(pen: &mut ScreenPen, line: Rect, state: &MonitorState, row: &PaneRow) {
    let accent = if row.is_marked { Accent::Strong } else { Accent::Plain };
    pen.put(line, 0, &row.text, accent);
    if let Some(watched) = row.watched.and_then(|at| state.watch.rows.get(at)) {
        let room = usize::from(line.width).saturating_sub(visible(&row.text).chars().count() + 2);
        pen.put_right(line, 0, &watched.trend.line(room.min(24)));
    }
}

#[cfg(test)]
mod tests {
    use super::shares;

    #[test]
    fn a_pane_is_hidden_only_without_space() {
        assert_eq!(shares(20, &[2, 3, 4]), [2, 3, 15]);
        assert_eq!(shares(19, &[30, 4]), [15, 4]);
        assert_eq!(shares(10, &[30, 40]), [5, 5]);
        assert_eq!(shares(2, &[3, 3, 3]), [0, 1, 1]);
    }
}
