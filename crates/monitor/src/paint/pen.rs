//! Puts text on the screen. All text passes through here, so that none acts as a control sequence.
//!
//! The other files of `paint` write with it. Colours only repeat the meaning of words and marks,
//! and are omitted if the user wants none.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::{Color, Modifier, Style};

use rungd_language::source::wording::is_obeyed;

/// The emphasis of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Accent {
    Plain,
    /// For texts that are ON, or have the focus.
    Strong,
    /// For the chosen row or symbol.
    Chosen,
    /// For texts about something wrong.
    Alarming,
}

/// A buffer, and whether to use colours.
pub(crate) struct ScreenPen<'b> {
    pub buffer: &'b mut Buffer,
    pub has_colours: bool,
}

/// Replaces the characters of a text that a terminal obeys.
pub(crate) fn visible(text: &str) -> String {
    text.replace(is_obeyed, "?")
}

impl ScreenPen<'_> {
    /// Writes a text into an area's row, as far as there is room. Returns the number of columns
    /// used.
    pub fn put(&mut self, area: Rect, row: u16, text: &str, accent: Accent) -> u16 {
        if row >= area.height {
            return 0;
        }
        let (text, style) = (visible(text), self.style(accent));
        let (from, width) = (area.x, usize::from(area.width));
        let (to, _) = self.buffer.set_stringn(from, area.y + row, text, width, style);
        to - from
    }

    /// Writes a text at the right end of a row.
    pub fn put_right(&mut self, area: Rect, row: u16, text: &str) {
        let wide = u16::try_from(visible(text).chars().count()).unwrap_or(u16::MAX);
        if wide < area.width {
            let at = Rect { x: area.x + area.width - wide, width: wide, ..area };
            self.put(at, row, text, Accent::Plain);
        }
    }

    /// Writes a text into a row, and fills the rest of the row with spaces.
    pub fn row(&mut self, area: Rect, row: u16, text: &str, accent: Accent) {
        let wide = usize::from(area.width);
        self.put(area, row, &format!("{text:wide$}"), accent);
    }

    /// Empties an area.
    pub fn clear(&mut self, area: Rect) {
        (0..area.height).for_each(|row| self.row(area, row, "", Accent::Plain));
    }

    /// Gives the characters already in an area an emphasis.
    pub fn mark(&mut self, area: Rect, accent: Accent) {
        let style = self.style(accent);
        self.buffer.set_style(area.intersection(self.buffer.area), style);
    }

    fn style(&self, accent: Accent) -> Style {
        let coloured = |colour: Color| match self.has_colours {
            true => Style::new().fg(colour),
            false => Style::new(),
        };
        match accent {
            Accent::Plain => Style::new(),
            Accent::Strong => coloured(Color::Green).add_modifier(Modifier::BOLD),
            Accent::Chosen => Style::new().add_modifier(Modifier::REVERSED),
            Accent::Alarming => coloured(Color::Red).add_modifier(Modifier::BOLD),
        }
    }
}

/// Wraps a text into lines of a width. Words that fit are kept whole, and each line keeps its
/// indent.
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines = Vec::new();
    for line in text.lines() {
        let indent = line.len() - line.trim_start_matches(' ').len();
        let indent = " ".repeat(indent.min(width / 2));
        let mut row = String::new();
        for word in line.split_inclusive(' ') {
            let room = width.saturating_sub(row.chars().count());
            if word.trim_end().chars().count() > room && !row.trim().is_empty() {
                lines.push(std::mem::replace(&mut row, indent.clone()).trim_end().to_owned());
            }
            for c in word.chars() {
                if row.chars().count() >= width && c != ' ' {
                    lines.push(std::mem::replace(&mut row, indent.clone()));
                }
                row.push(c);
            }
        }
        lines.push(row.trim_end().to_owned());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_wrapped_between_words() {
        assert_eq!(wrapped("  a bc def", 6), ["  a bc", "  def"]);
        assert_eq!(wrapped("abcdefgh", 3), ["abc", "def", "gh"]);
        assert_eq!(wrapped("a\n\nb", 3), ["a", "", "b"]);
        assert!(wrapped("  x y", 0).len() < 9);
    }

    #[test]
    fn control_characters_are_not_written_to_the_terminal() {
        let area = Rect::new(0, 0, 12, 1);
        let mut buffer = Buffer::empty(area);
        let mut pen = ScreenPen { buffer: &mut buffer, has_colours: true };
        pen.put(area, 0, "a\u{1b}[2Jb\u{202e}\u{9b}", Accent::Plain);
        pen.put(area, 1, "below", Accent::Plain);
        let text: String = buffer.content.iter().map(|cell| cell.symbol()).collect();
        assert_eq!(text, "a?[2Jb??    ");
    }
}
