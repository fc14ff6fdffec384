//! What becomes of a request: a reply at once, a refusal, or a batch whose scan is waited for.
//!
//! All of a request's judgement but the wait, without a socket and without a clock: the connection
//! calls [`answer`], hands the batch in, and calls [`written`] once a complete scan has seen it.
//! The order in which a request is judged is that of `docs/modbus.md`.

use super::map::{Asker, Map, Read};
use super::pdu::{self, Exception, Request, Table};
use super::refusal::Refusal;
use crate::runtime::exchange::{Snapshot, Write};

/// What becomes of a request.
#[derive(Debug, PartialEq, Eq)]
pub enum Answer<'a> {
    /// The reply's PDU.
    Reply(Vec<u8>),
    /// Well-formed, and not done; [`refused`] makes the reply.
    Refused(Request<'a>, Refusal),
    /// To be handed in; [`written`] makes the reply.
    Write(Request<'a>, Vec<Write>),
}

/// Judges a request's PDU before the last complete scan.
pub fn answer<'a>(map: &Map, asker: Asker, pdu: &'a [u8], latest: &Snapshot) -> Answer<'a> {
    if !map.answers(asker.unit) {
        return Answer::Reply(exception(pdu, Exception::NoSuchUnit));
    }
    let request = match pdu::parse(pdu) {
        Ok(request) => request,
        Err(found) => return Answer::Reply(exception(pdu, found)),
    };
    // Of function 23 too: what cannot be read is not to be found out behind the write.
    let mut reply = Vec::new();
    if let Some(read) = read_of(pdu, &request)
        && let Err(refusal) = map.read(asker.unit, read, latest, &mut reply)
    {
        return Answer::Refused(request, refusal);
    }
    if let Request::Read { .. } = request {
        return Answer::Reply(reply);
    }
    match map.writes(asker, &request) {
        Ok(batch) => Answer::Write(request, batch),
        Err(refusal) => Answer::Refused(request, refusal),
    }
}

/// The reply to a write, from the scan that has seen it.
///
/// # Errors
/// When the map has become another one, and what is to be read is not in it.
pub fn written(
    map: &Map,
    unit: u8,
    (pdu, request): (&[u8], &Request<'_>),
    latest: &Snapshot,
) -> Result<Vec<u8>, Refusal> {
    let mut reply = Vec::new();
    match read_of(pdu, request) {
        Some(read) => map.read(unit, read, latest, &mut reply)?,
        None => pdu::push_written(&mut reply, pdu),
    }
    Ok(reply)
}

/// The reply that refuses.
pub fn refused(pdu: &[u8], refusal: Refusal) -> Vec<u8> {
    exception(pdu, refusal.exception())
}

fn exception(pdu: &[u8], exception: Exception) -> Vec<u8> {
    let mut reply = Vec::new();
    pdu::push_exception(&mut reply, pdu.first().copied().unwrap_or(0), exception);
    reply
}

/// What a request reads.
fn read_of(pdu: &[u8], request: &Request<'_>) -> Option<Read> {
    let (table, first, count) = match *request {
        Request::Read { table, first, count } => (table, first, count),
        Request::ReadWrite { read_first, read_count, .. } => {
            (Table::HoldingRegisters, read_first, read_count)
        }
        _ => return None,
    };
    Some(Read { function: *pdu.first()?, table, first, count })
}
