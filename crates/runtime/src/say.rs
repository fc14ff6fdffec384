//! `say!`: writes a log line, at the level in its event's row.
//!
//! ```text
//! say!(ALARM_ON, %tag, scan, "alarm ON: {text}");
//! say!(MODE_STOP at Warn, scan, "STOP: {why}");      at another level than the row's
//! say!(*event at Debug, block = name, "{name} …");   a row that is known at run time
//! ```
//!
//! The event is a constant of [`crate::events`]; fields and sentence are in the syntax of
//! `tracing`. `io`, `daemon` and `cli` use this macro; no other code logs. Besides this file, only
//! the daemon's log uses `tracing`: it turns these events into lines.

use crate::events;

/// Logs an event: its constant, fields, and the sentence.
#[macro_export]
macro_rules! say {
    (* $event:ident at $level:ident, $($rest:tt)+) => {
        $crate::say::tracing::event!(
            $crate::say::level($crate::events::Level::$level),
            event = $event.name,
            $($rest)+
        )
    };
    ($event:ident at $level:ident, $($rest:tt)+) => {
        $crate::say::tracing::event!(
            $crate::say::level($crate::events::Level::$level),
            event = $crate::events::$event.name,
            $($rest)+
        )
    };
    ($event:ident, $($rest:tt)+) => {
        $crate::say::tracing::event!(
            $crate::say::level($crate::events::$event.level),
            event = $crate::events::$event.name,
            $($rest)+
        )
    };
}

pub use say;
pub use tracing;

/// Converts a row's level to a `tracing` level.
pub const fn level(level: events::Level) -> tracing::Level {
    match level {
        events::Level::Error => tracing::Level::ERROR,
        events::Level::Warn => tracing::Level::WARN,
        events::Level::Info => tracing::Level::INFO,
        events::Level::Debug => tracing::Level::DEBUG,
        events::Level::Trace => tracing::Level::TRACE,
    }
}
