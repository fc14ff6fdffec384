//! Reads the keyboard, on a thread of its own, and makes keys of what the terminal sends.
//!
//! `run` takes them. The thread waits in `read` and ends with the process.

use std::thread;

use crossbeam_channel::{Receiver, bounded};
use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, read};

use super::message::Press;

/// Keys that wait to be taken.
const KEYS_MAX: usize = 64;

/// What the terminal sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TerminalInput {
    Key(Press),
    /// The window has another size.
    Resized,
}

/// Starts the thread. The channel is closed when the terminal is gone.
pub(super) fn start() -> Receiver<TerminalInput> {
    let (send, received) = bounded(KEYS_MAX);
    let builder = thread::Builder::new().name("keys".to_owned());
    // Without the thread the channel is closed.
    let _ = builder.spawn(move || {
        while let Ok(event) = read() {
            if input(&event).is_some_and(|input| send.send(input).is_err()) {
                return;
            }
        }
    });
    received
}

fn input(event: &Event) -> Option<TerminalInput> {
    if let Event::Resize(..) = event {
        return Some(TerminalInput::Resized);
    }
    let Event::Key(key) = event else { return None };
    press(key).map(TerminalInput::Key)
}

fn press(key: &KeyEvent) -> Option<Press> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    if let KeyCode::Char(c) = key.code {
        let is_control = key.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT);
        return match (is_control, c) {
            (false, c) => Some(Press::Char(c)),
            (true, 'c') => Some(Press::Interrupt),
            (true, _) => None,
        };
    }
    let keys = [
        (KeyCode::Enter, Press::Enter),
        (KeyCode::Esc, Press::Escape),
        (KeyCode::Tab, Press::Tab),
        (KeyCode::BackTab, Press::BackTab),
        (KeyCode::Up, Press::Up),
        (KeyCode::Down, Press::Down),
        (KeyCode::Left, Press::Left),
        (KeyCode::Right, Press::Right),
        (KeyCode::PageUp, Press::PageUp),
        (KeyCode::PageDown, Press::PageDown),
        (KeyCode::Home, Press::Home),
        (KeyCode::End, Press::End),
        (KeyCode::Backspace, Press::Backspace),
        (KeyCode::Delete, Press::Delete),
    ];
    keys.into_iter().find(|(code, _)| *code == key.code).map(|(_, press)| press)
}
