//! What the book keeps over a restart: shelves and acknowledgements.
//!
//! `alarm_file` writes it to a file, and reads it before the first scan. An alarm that was
//! acknowledged, and that rises within the first seconds of scans, is the same alarm: nobody has to
//! acknowledge it again. At an orderly stop the termination passes end alarms; an acknowledgement
//! of before the stop is kept nevertheless.

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};

use super::book::AlarmBook;
use super::entry::BookedAlarm;
use super::shelf::{BookedShelf, EndedShelf, ShelfEnd};
use super::time::BookTime;
use rungd_client::operator::protocol::{AlarmAck, AlarmShelf, AlarmState, SHELF_MS_MAX, is_reason};
use rungd_language::source::wording::is_obeyed;
use rungd_runtime::exchange::{Mode, Snapshot};

const SHELF_NS_MAX: u64 = SHELF_MS_MAX * 1_000_000;
/// The most bytes of a user's name.
const WHO_BYTES_MAX: usize = 256;
/// The version of the file.
const FORMAT: u32 = 1;

/// The content of the file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(in super::super) struct KeptAlarms {
    format: u32,
    shelved: Vec<KeptShelf>,
    acknowledged: Vec<KeptAck>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct KeptShelf {
    tag: String,
    #[serde(flatten)]
    shelf: AlarmShelf,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct KeptAck {
    tag: String,
    #[serde(flatten)]
    ack: AlarmAck,
}

impl KeptAlarms {
    /// Whether there is nothing to keep.
    pub fn is_empty(&self) -> bool {
        self.shelved.is_empty() && self.acknowledged.is_empty()
    }

    /// Reads the content of a file.
    ///
    /// # Errors
    /// Why it is not what rungd wrote.
    pub fn read(bytes: &[u8]) -> Result<KeptAlarms, String> {
        let kept: KeptAlarms = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        if kept.format != FORMAT {
            return Err(format!("its format is {}, and this rungd knows {FORMAT}", kept.format));
        }
        let names = kept.acknowledged.iter().map(|one| &one.ack.who);
        let names = names.chain(kept.shelved.iter().map(|one| &one.shelf.who));
        if !names.into_iter().all(|who| is_name(who))
            || !kept.shelved.iter().all(|one| is_reason(&one.shelf.why))
        {
            return Err("it has a name or a reason that no rungd writes".to_owned());
        }
        Ok(kept)
    }

    /// The bytes of the file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }
}

/// Whether a name can be shown in a line.
fn is_name(who: &str) -> bool {
    who.len() <= WHO_BYTES_MAX && !who.contains(is_obeyed)
}

impl AlarmBook {
    /// Notes the first scan.
    pub fn begin(&mut self, latest: &Snapshot) {
        if latest.scans > 0 {
            self.pending.began_ns.get_or_insert(latest.now_ns);
        }
    }

    /// Enters what the process before kept, before the first scan. A shelf whose alarm the program
    /// does not have ends. An alarm stays shelved for no longer than somebody shelved it, whatever
    /// the clock says now.
    pub fn restore(&mut self, kept: KeptAlarms, now: BookTime) {
        let numbers: HashMap<String, usize> =
            (0..).zip(&self.alarms).map(|(at, alarm)| (alarm.known.tag.clone(), at)).collect();
        for KeptShelf { tag, shelf } in kept.shelved {
            match numbers.get(&tag) {
                Some(number) => self.alarms[*number].shelf = Some(restored(shelf, now)),
                None => {
                    let (text, why) = (String::new(), ShelfEnd::Gone);
                    self.ended.push(EndedShelf { tag, text, shelf, why });
                }
            }
        }
        let acks = kept.acknowledged.into_iter().map(|one| (one.tag, one.ack));
        self.pending.acks = acks.filter(|(tag, _)| numbers.contains_key(tag)).collect();
    }

    /// What is to be kept now. `before`: what was kept last; if the mode is not RUN, its
    /// acknowledgements stay, because a stop has ended alarms.
    pub fn kept(&self, before: &KeptAlarms, latest: &Snapshot) -> KeptAlarms {
        let shelved = self.alarms.iter().filter_map(|alarm| {
            let shelf = alarm.shelf.as_ref()?.shown.clone();
            Some(KeptShelf { tag: alarm.known.tag.clone(), shelf })
        });
        let mut acknowledged: Vec<KeptAck> =
            self.alarms.iter().filter_map(|alarm| self.kept_ack(alarm, latest)).collect();
        if latest.mode != Mode::Run || latest.ending {
            let there: HashSet<&str> = acknowledged.iter().map(|one| one.tag.as_str()).collect();
            let off = self.alarms.iter().filter(|alarm| !alarm.state.is_active());
            let off: HashSet<&str> = off.map(|alarm| alarm.known.tag.as_str()).collect();
            let is_kept = |one: &&KeptAck| {
                off.contains(one.tag.as_str()) && !there.contains(one.tag.as_str())
            };
            let more: Vec<KeptAck> = before.acknowledged.iter().filter(is_kept).cloned().collect();
            acknowledged.extend(more);
        }
        let mut shelved: Vec<KeptShelf> = shelved.collect();
        // The order of a program's alarms is of no matter to the file.
        shelved.sort_by(|a, b| a.tag.cmp(&b.tag));
        acknowledged.sort_by(|a, b| a.tag.cmp(&b.tag));
        KeptAlarms { format: FORMAT, shelved, acknowledged }
    }

    fn kept_ack(&self, alarm: &BookedAlarm, latest: &Snapshot) -> Option<KeptAck> {
        let tag = &alarm.known.tag;
        let ack = match alarm.state {
            AlarmState::Acknowledged => alarm.acknowledged.as_ref()?,
            AlarmState::Normal => {
                self.pending.acks.get(tag).filter(|_| self.pending.is_same(alarm, latest.now_ns))?
            }
            AlarmState::Unacknowledged | AlarmState::Returned => return None,
        };
        Some(KeptAck { tag: tag.clone(), ack: ack.clone() })
    }
}

/// A shelf of the process before.
fn restored(shelf: AlarmShelf, now: BookTime) -> BookedShelf {
    let Some(until_ns) = shelf.until_ns else {
        return BookedShelf { shown: shelf, until_ns: None };
    };
    let whole_ns = until_ns.saturating_sub(shelf.since_ns).max(0).unsigned_abs();
    let left_ns = until_ns.saturating_sub(now.unix_ns).max(0).unsigned_abs();
    let left_ns = left_ns.min(whole_ns).min(SHELF_NS_MAX);
    let shown = Some(now.unix_ns.saturating_add_unsigned(left_ns));
    BookedShelf {
        shown: AlarmShelf { until_ns: shown, ..shelf },
        until_ns: Some(now.at_ns.saturating_add(left_ns)),
    }
}
