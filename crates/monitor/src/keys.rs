//! Reads the keyboard on its own thread, and converts the terminal's events to keys.
//!
//! `run` takes the keys. The thread waits in `read`, and ends with the process.

use std::{io, thread};

use crossbeam_channel::{Receiver, bounded};
use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, read};

use super::message::KeyPress;

/// The most keys that wait to be taken.
const KEYS_MAX: usize = 64;

/// An input from the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TerminalInput {
    Key(KeyPress),
    /// The size of the window has changed.
    Resized,
    /// Ctrl-L: draws the whole page again, over the output of another program.
    DrawAgain,
}

/// Starts the thread. The channel is closed when the terminal is gone.
///
/// # Errors
/// The system cannot start a thread.
pub(super) fn start() -> io::Result<Receiver<TerminalInput>> {
    let (send, received) = bounded(KEYS_MAX);
    let builder = thread::Builder::new().name("keys".to_owned());
    builder.spawn(move || {
        while let Ok(event) = read() {
            if input(&event).is_some_and(|input| send.send(input).is_err()) {
                return;
            }
        }
    })?;
    Ok(received)
}

fn input(event: &Event) -> Option<TerminalInput> {
    if let Event::Resize(..) = event {
        return Some(TerminalInput::Resized);
    }
    let Event::Key(key) = event else { return None };
    if key.code == KeyCode::Char('l') && key.modifiers.contains(KeyModifiers::CONTROL) {
        return Some(TerminalInput::DrawAgain);
    }
    press(key).map(TerminalInput::Key)
}

fn press(key: &KeyEvent) -> Option<KeyPress> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    if let KeyCode::Char(c) = key.code {
        let is_control = key.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT);
        return match (is_control, c) {
            (false, c) => Some(KeyPress::Char(c)),
            (true, 'c') => Some(KeyPress::Interrupt),
            (true, _) => None,
        };
    }
    let keys = [
        (KeyCode::Enter, KeyPress::Enter),
        (KeyCode::Esc, KeyPress::Escape),
        (KeyCode::Tab, KeyPress::Tab),
        (KeyCode::BackTab, KeyPress::BackTab),
        (KeyCode::Up, KeyPress::Up),
        (KeyCode::Down, KeyPress::Down),
        (KeyCode::Left, KeyPress::Left),
        (KeyCode::Right, KeyPress::Right),
        (KeyCode::PageUp, KeyPress::PageUp),
        (KeyCode::PageDown, KeyPress::PageDown),
        (KeyCode::Home, KeyPress::Home),
        (KeyCode::End, KeyPress::End),
        (KeyCode::Backspace, KeyPress::Backspace),
        (KeyCode::Delete, KeyPress::Delete),
    ];
    keys.into_iter().find(|(code, _)| *code == key.code).map(|(_, press)| press)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_with_a_modifier_are_not_letters() {
        let key_input = |code, modifiers| input(&Event::Key(KeyEvent::new(code, modifiers)));
        let plain = KeyModifiers::NONE;
        assert_eq!(
            key_input(KeyCode::Char('Y'), KeyModifiers::SHIFT),
            Some(TerminalInput::Key(KeyPress::Char('Y')))
        );
        assert_eq!(key_input(KeyCode::Enter, plain), Some(TerminalInput::Key(KeyPress::Enter)));
        assert_eq!(key_input(KeyCode::F(1), plain), None);
        assert_eq!(key_input(KeyCode::Char('y'), KeyModifiers::ALT), None);
        let control = |c| key_input(KeyCode::Char(c), KeyModifiers::CONTROL);
        assert_eq!(control('c'), Some(TerminalInput::Key(KeyPress::Interrupt)));
        assert_eq!((control('l'), control('y')), (Some(TerminalInput::DrawAgain), None));
        assert_eq!(input(&Event::Resize(9, 9)), Some(TerminalInput::Resized));
    }
}
