//! Turns ON the bits by which the ladder sees acknowledgements (`ack` of an alarm).
//!
//! Called by `alarms` once the acknowledgements are entered: they say that somebody knows of the
//! alarms, and stay entered if a bit cannot be written. The bits are written as those of
//! `write-set`; what is refused is told in the answer and in the log.

use std::collections::{HashMap, HashSet};

use super::page_rights::WriteTerms;
use super::peer::PeerRequest;
use super::refused::tell_refused;
use super::service::OperatorService;
use crate::daemon::alarm_book::Acknowledgement;
use rungd_client::operator::protocol::{
    AckedAlarm, GivenValue, GivenWrite, RequestRefusal, WRITES_MAX,
};
use rungd_engine::isa::Bit;
use rungd_language::resolve::alarm_terms::AckBit;

/// The bits that are not written: each with its name, and with the reason.
type RefusedBits = HashMap<Bit, (String, String)>;

impl OperatorService {
    /// Turns the bits of acknowledged alarms ON. Returns the alarms, each with what became of its
    /// bit.
    pub(super) async fn tell_ladder(
        &self,
        asker: &PeerRequest,
        acknowledged: Vec<Acknowledgement>,
    ) -> Vec<AckedAlarm> {
        let mut seen = HashSet::new();
        let bits = acknowledged.iter().filter_map(Acknowledgement::written);
        let bits: Vec<AckBit> = bits.filter(|ack| seen.insert(ack.bit)).cloned().collect();
        let refused = self.turn_on(asker, bits).await;
        let alarm = |one: Acknowledgement| {
            let (bit, why) = match one.written() {
                Some(ack) => {
                    (Some(ack.name.clone()), refused.get(&ack.bit).map(|(_, why)| why.clone()))
                }
                None => (None, None),
            };
            AckedAlarm { bit, bit_refused: why, ..one.alarm }
        };
        acknowledged.into_iter().map(alarm).collect()
    }

    /// Writes the bits, in as few changes as possible: a bit that is refused keeps no other from
    /// being written.
    async fn turn_on(&self, asker: &PeerRequest, bits: Vec<AckBit>) -> RefusedBits {
        let (mut left, mut refused) = (bits, RefusedBits::new());
        while !left.is_empty() {
            let more = left.split_off(left.len().min(WRITES_MAX));
            let writes: Vec<GivenWrite> = left.iter().map(turned_on).collect();
            if let Err(refusal) = self.write_set(asker, &writes, WriteTerms::default()).await {
                left = without_refused(left, &refusal, &mut refused);
            } else {
                left.clear();
            }
            left.extend(more);
        }
        for (name, why) in refused.values() {
            let how = format!(", the ladder does not see the acknowledgement: {why}");
            tell_refused(&asker.peer, name, &how);
        }
        refused
    }
}

fn turned_on(ack: &AckBit) -> GivenWrite {
    GivenWrite { operand: ack.name.clone(), value: GivenValue::Bit(true) }
}

/// The bits that a refusal does not name. If it names none, all are refused.
fn without_refused(
    bits: Vec<AckBit>,
    refusal: &RequestRefusal,
    refused: &mut RefusedBits,
) -> Vec<AckBit> {
    let named: HashMap<&str, &str> = refusal
        .mistakes
        .iter()
        .map(|mistake| (mistake.operand.as_str(), mistake.refusal.message.as_str()))
        .collect();
    let is_named = bits.iter().any(|ack| named.contains_key(ack.name.as_str()));
    let (mut left, whole) = (Vec::new(), refusal.message.as_str());
    for AckBit { name, bit } in bits {
        match named.get(name.as_str()).copied().or((!is_named).then_some(whole)) {
            Some(why) => {
                refused.insert(bit, (name, why.to_owned()));
            }
            None => left.push(AckBit { name, bit }),
        }
    }
    left
}
