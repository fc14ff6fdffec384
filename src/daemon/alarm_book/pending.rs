//! The acknowledgements of the process before, until their alarms rise again.

use std::collections::HashMap;

use super::entry::BookedAlarm;
use rungd_client::operator::protocol::AlarmAck;

/// How long after its first scan a program's alarms are those of the process before.
const SAME_NS: u64 = 10 * 1_000_000_000;

/// The acknowledgements of the process before, by the tags of alarms that have not risen yet.
#[derive(Debug, Default)]
pub(super) struct PendingAcks {
    pub acks: HashMap<String, AlarmAck>,
    /// The time of the first scan (CLOCK_MONOTONIC).
    pub began_ns: Option<u64>,
}

impl PendingAcks {
    /// Takes the acknowledgement of an alarm that rises at this time, if it is the same alarm.
    pub fn take(&mut self, alarm: &BookedAlarm, at_ns: u64) -> Option<AlarmAck> {
        let ack = self.acks.remove(&alarm.known.tag)?;
        Some(ack).filter(|_| self.is_same(alarm, at_ns))
    }

    /// Whether an alarm that rises at this time is that of the process before. A delay counts from
    /// the scan that turned the bit ON.
    pub fn is_same(&self, alarm: &BookedAlarm, at_ns: u64) -> bool {
        let delay_ns = alarm.known.delay().on_ns;
        let end_ns = self.began_ns.map(|ns| ns.saturating_add(SAME_NS).saturating_add(delay_ns));
        end_ns.is_none_or(|end_ns| at_ns <= end_ns)
    }
}
