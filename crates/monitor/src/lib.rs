//! `rungd monitor`: a page in a terminal that shows a running controller, and lets its user force
//! and write. A separate process and a client of the operator's socket: the daemon does not need
//! it.
//!
//! Called by `cli`. Three threads: `keys` reads the keyboard, `asker` sends requests to the
//! controller, and [`run`] passes the keys and the answers to `update`, a pure function of the
//! state; `paint` then draws the state. No file is loaded here: the ladder comes from the
//! controller's scan log.

mod asker;
mod dialog;
mod keys;
mod ladder_view;
mod message;
mod paint;
mod power_of;
mod rows;
mod screen;
mod state;
#[cfg(test)]
mod tests;
mod update;
mod watch_list;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;
use crossbeam_channel::{Receiver, RecvError, Sender, select};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};

use keys::TerminalInput;
use message::{MonitorAction, MonitorEvent, MonitorNews, ThreadOrder};
use screen::Screen;
use state::MonitorState;
use update::update;

use rungd_base::faults::{self, FaultPoint};

/// The longest time until a signal takes effect, and until a time on the screen advances.
const TICK: Duration = Duration::from_millis(100);

/// The settings of the monitor.
#[derive(Clone, Debug)]
pub struct MonitorSetup {
    /// The controller's socket.
    pub socket: PathBuf,
    /// The first operands of the watch list.
    pub operands: Vec<String>,
    /// Whether to use colours beside words and marks.
    pub has_colours: bool,
}

/// Shows the page until the user or a signal ends it.
///
/// # Errors
/// The terminal cannot be taken over or written.
pub fn run(setup: MonitorSetup) -> Result<()> {
    let is_ended = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGHUP, SIGINT, SIGQUIT] {
        signal_hook::flag::register(signal, Arc::clone(&is_ended))?;
    }
    let mut screen = Screen::take()?;
    faults::listen();
    let (orders, news) = asker::start(setup.socket)?;
    let channels = Channels { orders, news, keys: keys::start()? };
    let mut state = MonitorState::watching(setup.operands);
    let began = Instant::now();
    let mut is_drawn = false;
    while !is_ended.load(Ordering::Relaxed) {
        if !is_drawn {
            screen.0.draw(|frame| paint::paint(frame, &state, setup.has_colours))?;
        }
        faults::point(FaultPoint::Page);
        let Some(waited) = channels.next() else { return Ok(()) };
        let tick = u64::try_from(began.elapsed().as_millis()).unwrap_or(u64::MAX);
        if let WaitEvent::DrawAgain = waited {
            screen.0.clear()?;
        }
        // If nothing has happened, only the duration of a silence changes on the screen.
        is_drawn = matches!(waited, WaitEvent::Nothing) && state.silence.is_none();
        let mut wishes = update(&mut state, MonitorEvent::Tick(tick));
        if let WaitEvent::Event(event) = waited {
            wishes.extend(update(&mut state, event));
        }
        for wish in wishes {
            match wish {
                MonitorAction::Quit => return Ok(()),
                // If the thread has ended, `next` reports it.
                MonitorAction::Ask(order) => drop(channels.orders.send(order)),
            }
        }
    }
    Ok(())
}

/// The channels to and from the other threads.
struct Channels {
    orders: Sender<ThreadOrder>,
    news: Receiver<MonitorNews>,
    keys: Receiver<TerminalInput>,
}

/// The event that ended a wait of `run`.
enum WaitEvent {
    Event(MonitorEvent),
    /// Only time has passed.
    Nothing,
    /// The size of the window has changed.
    Resized,
    /// Another program may have written on the screen.
    DrawAgain,
}

impl Channels {
    /// Waits for the next event, at most for `TICK`; `None`: the terminal is gone.
    fn next(&self) -> Option<WaitEvent> {
        select! {
            recv(self.keys) -> input => match input {
                Ok(TerminalInput::Key(press)) => Some(WaitEvent::Event(MonitorEvent::Press(press))),
                Ok(TerminalInput::Resized) => Some(WaitEvent::Resized),
                Ok(TerminalInput::DrawAgain) => Some(WaitEvent::DrawAgain),
                Err(RecvError) => None,
            },
            recv(self.news) -> news => {
                // The thread ends only if the sender of orders is dropped, or by a panic.
                let news = news.expect("the thread that asks the controller has ended");
                Some(WaitEvent::Event(MonitorEvent::News(news)))
            },
            default(TICK) => Some(WaitEvent::Nothing),
        }
    }
}
