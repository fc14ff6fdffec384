//! The refusals of changes, and the line of the log about one.
//!
//! Used by `desk`, `write` and `session`.

use super::peer::Peer;
use super::status::reason;
use rungd_client::operator::protocol::{Refusal, RefusalKind};
use rungd_runtime::command::Denial;
use rungd_runtime::exchange::{Mode, Port, Refused};
use rungd_runtime::say::say;

/// A page may not write an operand.
pub(super) fn not_for_pages(operand: &str) -> Refusal {
    let message = format!("`{operand}` cannot be written here: `[web] write` does not list it");
    Refusal::new(RefusalKind::NotPermitted, message)
}

/// A reload came between a page's write and its scan, and the new list may be a different one.
pub(super) fn not_after_reload(operand: &str) -> Refusal {
    let message = format!(
        "`{operand}` is not written: the program was reloaded before a scan took the write; write \
         it again if it is still right"
    );
    Refusal::new(RefusalKind::Refused, message)
}

/// A batch of writes was not taken.
pub(super) fn not_taken(why: Refused, port: &Port) -> Refusal {
    let message = match why {
        Refused::NotRunning => format!(
            "the controller is in {}: what is written would not be scanned (`rungd mode run` \
             runs it; a force is accepted in any mode)",
            in_words(port.latest().mode)
        ),
        Refused::QueueFull | Refused::TooLarge => {
            "too many writes wait for the next scan".to_owned()
        }
        Refused::Overtaken => Denial::Gone.to_string(),
        Refused::Late => return denied(Denial::Late),
    };
    Refusal::new(RefusalKind::Refused, message)
}

/// A command was denied.
pub(super) fn denied(why: Denial) -> Refusal {
    let kind = match why {
        Denial::Late => RefusalKind::TooLate,
        Denial::QueueFull
        | Denial::ScanThreadStuck
        | Denial::EngineBroken
        | Denial::Ending
        | Denial::Faulted
        | Denial::TooManyForces
        | Denial::NoProgram
        | Denial::Gone => RefusalKind::Refused,
    };
    Refusal::new(kind, why.to_string())
}

/// The scan thread has not answered in time.
pub(super) fn no_answer() -> Refusal {
    let message = "no scan has processed it in time, and no later scan begins it; a scan that \
                   hangs may have begun it";
    Refusal::new(RefusalKind::NoAnswer, message)
}

/// A mode with its reason.
pub(super) fn in_words(mode: Mode) -> String {
    match reason(mode) {
        None => mode.name().to_owned(),
        Some(why) => format!("{} ({why})", mode.name()),
    }
}

/// Logs a change that was refused. `how`: behind "operator's command refused".
pub(super) fn tell_refused(peer: &Peer, what: &str, how: &str) {
    say!(
        OPERATOR_REFUSED,
        who = %peer.name,
        uid = peer.uid,
        pid = peer.pid,
        what,
        "operator's command refused{how}"
    );
}
