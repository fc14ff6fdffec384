//! The refusals of changes, and the line of the log about one.
//!
//! Used by `service`, `write` and `session`.

use super::peer::OperatorPeer;
use super::status::reason;
use rungd_client::operator::protocol::{RefusalKind, RequestRefusal};
use rungd_runtime::command::CommandDenial;
use rungd_runtime::exchange::{BatchRefusal, Mode, Port};
use rungd_runtime::hold_step::HOLDS_MAX;
use rungd_runtime::say::say;

/// No part of a panel holds an operand.
pub(super) fn not_for_holds(operand: &str) -> RequestRefusal {
    let message = format!("`{operand}` cannot be held: no panel has a `hold` of it");
    RequestRefusal::new(RefusalKind::NotPermitted, message)
}

/// A reload came between a page's write and its scan, and the new list may be a different one.
pub(super) fn not_after_reload(operand: &str) -> RequestRefusal {
    let message = format!(
        "`{operand}` is not written: the program was reloaded before a scan took the write; write \
         it again if it is still right"
    );
    RequestRefusal::new(RefusalKind::Refused, message)
}

/// A batch of writes was not taken.
pub(super) fn not_taken(why: BatchRefusal, port: &Port) -> RequestRefusal {
    let message = match why {
        BatchRefusal::NotRunning => format!(
            "the controller is in {}: what is written would not be scanned (`rungd mode run` \
             runs it; a force is accepted in any mode)",
            in_words(port.latest().mode)
        ),
        BatchRefusal::QueueFull | BatchRefusal::TooLarge => {
            "too many writes wait for the next scan".to_owned()
        }
        BatchRefusal::Overtaken => CommandDenial::Gone.to_string(),
        BatchRefusal::HoldEnded => "the hold has ended: press again".to_owned(),
        BatchRefusal::HoldsFull => {
            format!("{HOLDS_MAX} buttons are held already: release one, and press again")
        }
        BatchRefusal::NoHeldBit => "only one bit, turned ON, can be held".to_owned(),
        BatchRefusal::Late => return denied(CommandDenial::Late),
    };
    RequestRefusal::new(RefusalKind::Refused, message)
}

/// A command was denied.
pub(super) fn denied(why: CommandDenial) -> RequestRefusal {
    let kind = match why {
        CommandDenial::Late => RefusalKind::TooLate,
        CommandDenial::QueueFull
        | CommandDenial::ScanThreadStuck
        | CommandDenial::EngineBroken
        | CommandDenial::Ending
        | CommandDenial::Faulted
        | CommandDenial::TooManyForces
        | CommandDenial::NoProgram
        | CommandDenial::Gone => RefusalKind::Refused,
    };
    RequestRefusal::new(kind, why.to_string())
}

/// The scan thread has not answered in time.
pub(super) fn no_answer() -> RequestRefusal {
    let message = "no scan has processed it in time, and no later scan begins it; a scan that \
                   hangs may have begun it";
    RequestRefusal::new(RefusalKind::NoAnswer, message)
}

/// A mode with its reason.
pub(super) fn in_words(mode: Mode) -> String {
    match reason(mode) {
        None => mode.name().to_owned(),
        Some(why) => format!("{} ({why})", mode.name()),
    }
}

/// Logs a change that was refused. `how`: behind "operator's command refused".
pub(super) fn tell_refused(peer: &OperatorPeer, what: &str, how: &str) {
    say!(
        OPERATOR_REFUSED,
        who = %peer.name,
        uid = peer.uid,
        pid = peer.pid,
        what,
        "operator's command refused{how}"
    );
}
