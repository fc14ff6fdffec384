//! Decides the answer to a request: a reply at once, a refusal, or a batch that waits for a scan.
//!
//! This module has no socket and no clock. The connection calls [`answer`], hands the batch in,
//! waits until a complete scan has seen it, and calls [`written`]. `docs/modbus.md` has the order
//! of the checks.

use super::map::{ModbusMap, RequestSource, TableRead};
use super::pdu::{self, ElementRange, ModbusException, ModbusRequest, ModbusTable};
use super::refusal::ModbusRefusal;
use rungd_runtime::exchange::{OperandWrite, Snapshot};

/// The decision on a request.
#[derive(Debug, PartialEq, Eq)]
pub enum RequestDecision<'a> {
    /// The reply's PDU.
    Reply(Vec<u8>),
    /// The request is well-formed and refused; [`refused`] makes the reply.
    Refused(ModbusRequest<'a>, ModbusRefusal),
    /// The batch has to be handed in; [`written`] makes the reply.
    Write(ModbusRequest<'a>, Vec<OperandWrite>),
}

/// Judges a request's PDU against the last complete scan.
pub fn answer<'a>(
    map: &ModbusMap,
    asker: RequestSource,
    pdu: &'a [u8],
    latest: &Snapshot,
) -> RequestDecision<'a> {
    if !map.answers(asker.unit) {
        return RequestDecision::Reply(exception(pdu, ModbusException::NoSuchUnit));
    }
    let request = match pdu::parse(pdu) {
        Ok(request) => request,
        Err(found) => return RequestDecision::Reply(exception(pdu, found)),
    };
    // Function 23 reads here too: if its read fails, the request has to be refused before the
    // write.
    let mut reply = Vec::new();
    if let Some(read) = read_of(pdu, &request)
        && let Err(refusal) = map.read(asker.unit, read, latest, &mut reply)
    {
        return RequestDecision::Refused(request, refusal);
    }
    if let ModbusRequest::Read { .. } = request {
        return RequestDecision::Reply(reply);
    }
    match map.writes(asker, &request) {
        Ok(batch) => RequestDecision::Write(request, batch),
        Err(refusal) => RequestDecision::Refused(request, refusal),
    }
}

/// A request that gets a reply.
#[derive(Clone, Copy)]
pub struct AnsweredRequest<'a> {
    /// Its PDU.
    pub pdu: &'a [u8],
    /// What the PDU requests.
    pub request: &'a ModbusRequest<'a>,
}

/// The reply to a write, from the image of the scan that has seen the write.
///
/// # Errors
/// If the map has changed and does not have the elements to read.
pub fn written(
    map: &ModbusMap,
    unit: u8,
    AnsweredRequest { pdu, request }: AnsweredRequest<'_>,
    latest: &Snapshot,
) -> Result<Vec<u8>, ModbusRefusal> {
    let mut reply = Vec::new();
    match read_of(pdu, request) {
        Some(read) => map.read(unit, read, latest, &mut reply)?,
        None => pdu::push_written(&mut reply, pdu),
    }
    Ok(reply)
}

/// The reply of a refusal.
pub fn refused(pdu: &[u8], refusal: ModbusRefusal) -> Vec<u8> {
    exception(pdu, refusal.exception())
}

fn exception(pdu: &[u8], exception: ModbusException) -> Vec<u8> {
    let mut reply = Vec::new();
    pdu::push_exception(&mut reply, pdu.first().copied().unwrap_or(0), exception);
    reply
}

/// The read that a request contains, if any.
fn read_of(pdu: &[u8], request: &ModbusRequest<'_>) -> Option<TableRead> {
    let (table, first, count) = match *request {
        ModbusRequest::Read { table, first, count } => (table, first, count),
        ModbusRequest::ReadWrite { read_first, read_count, .. } => {
            (ModbusTable::HoldingRegisters, read_first, read_count)
        }
        ModbusRequest::WriteCoils { .. }
        | ModbusRequest::WriteRegisters { .. }
        | ModbusRequest::MaskWrite { .. } => {
            return None;
        }
    };
    Some(TableRead { function: *pdu.first()?, range: ElementRange { table, first, count } })
}
