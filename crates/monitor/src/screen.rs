//! The terminal: taken over at the start, written to, and given back at the end in every case.
//!
//! `run` draws with it. After a panic of any thread, the terminal is given back before the message
//! is printed.

use std::io::{self, BufWriter, Stdout, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use crossterm::terminal::{disable_raw_mode, enable_raw_mode, size};
use ratatui_core::backend::{Backend, ClearType, WindowSize};
use ratatui_core::buffer::Cell;
use ratatui_core::layout::{Position, Size};
use ratatui_core::style::{Color, Modifier};
use ratatui_core::terminal::Terminal;

use rungd_language::source::wording::is_obeyed;

/// The alternate screen, without a cursor.
const ENTER: &str = "\x1b[?1049h\x1b[2J\x1b[?25l";

/// The original screen, with a cursor and without emphasis.
const LEAVE: &str = "\x1b[0m\x1b[?25h\x1b[?1049l";

/// Whether the terminal is taken over.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// The terminal while it is taken over. Dropping this value gives it back.
pub(super) struct Screen(pub Terminal<TerminalWriter>);

/// Writes to the terminal.
pub(super) struct TerminalWriter(BufWriter<Stdout>);

impl Screen {
    /// Takes the terminal over.
    ///
    /// # Errors
    /// The standard output is not a terminal, or the terminal does not obey.
    pub fn take() -> io::Result<Screen> {
        give_back_after_a_panic();
        IS_TAKEN.store(true, Ordering::SeqCst);
        let taken = enable_raw_mode().and_then(|()| {
            let mut out = io::stdout();
            out.write_all(ENTER.as_bytes())?;
            out.flush()?;
            Terminal::new(TerminalWriter(BufWriter::new(out)))
        });
        taken.map(Screen).inspect_err(|_| give_back())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
    }
}

/// Gives the terminal back, once. Errors are ignored, since the terminal may be gone.
fn give_back() {
    if IS_TAKEN.swap(false, Ordering::SeqCst) {
        let mut out = io::stdout();
        let _ = out.write_all(LEAVE.as_bytes());
        let _ = out.flush();
        let _ = disable_raw_mode();
    }
}

fn give_back_after_a_panic() {
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        give_back();
        before(panic);
    }));
}

impl Backend for TerminalWriter {
    type Error = io::Error;

    fn draw<'a, I>(&mut self, content: I) -> io::Result<()>
    where
        I: Iterator<Item = (u16, u16, &'a Cell)>,
    {
        // Nothing is drawn on a screen that was given back after a panic.
        if !IS_TAKEN.load(Ordering::SeqCst) {
            return Ok(());
        }
        let mut last = None;
        // The position of the cursor after a character with the same width on every terminal.
        let mut cursor = None;
        for (x, y, cell) in content {
            let look = (cell.fg, cell.modifier);
            if last != Some(look) {
                write!(self.0, "\x1b[{}m", attributes(cell.fg, cell.modifier))?;
                last = Some(look);
            }
            // `pen` already replaces such characters; this is the last check.
            let symbol = if cell.symbol().contains(is_obeyed) { "?" } else { cell.symbol() };
            if cursor != Some((x, y)) {
                write!(self.0, "\x1b[{};{}H", y + 1, x + 1)?;
            }
            write!(self.0, "{symbol}")?;
            cursor = symbol.is_ascii().then_some((x + 1, y));
        }
        self.0.write_all(b"\x1b[0m")
    }

    fn hide_cursor(&mut self) -> io::Result<()> {
        self.0.write_all(b"\x1b[?25l")
    }

    fn show_cursor(&mut self) -> io::Result<()> {
        self.0.write_all(b"\x1b[?25h")
    }

    /// Not used: the cursor is hidden, and its position is set before each write.
    fn get_cursor_position(&mut self) -> io::Result<Position> {
        Ok(Position::ORIGIN)
    }

    fn set_cursor_position<P: Into<Position>>(&mut self, position: P) -> io::Result<()> {
        let Position { x, y } = position.into();
        write!(self.0, "\x1b[{};{}H", y + 1, x + 1)
    }

    fn clear(&mut self) -> io::Result<()> {
        self.0.write_all(b"\x1b[2J")
    }

    fn clear_region(&mut self, _part: ClearType) -> io::Result<()> {
        self.clear()
    }

    fn size(&self) -> io::Result<Size> {
        size().map(|(width, height)| Size { width, height })
    }

    fn window_size(&mut self) -> io::Result<WindowSize> {
        Ok(WindowSize { columns_rows: self.size()?, pixels: Size::ZERO })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// The numbers of the sequence that removes all emphasis and sets the given one.
fn attributes(colour: Color, modifier: Modifier) -> String {
    let mut numbers = String::from("0");
    for (attribute, number) in [(Modifier::BOLD, ";1"), (Modifier::REVERSED, ";7")] {
        if modifier.contains(attribute) {
            numbers += number;
        }
    }
    for (foreground, number) in [(Color::Red, ";31"), (Color::Green, ";32")] {
        if colour == foreground {
            numbers += number;
        }
    }
    numbers
}
