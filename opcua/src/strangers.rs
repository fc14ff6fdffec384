//! What the bytes of strangers reach in this program, without a network and a controller: for the
//! fuzz target `opcua`.
//!
//! The first byte says where the others go. Every function is the one that the server calls.

use std::io::Cursor;

use opcua::crypto::X509;
use opcua::types::{
    BinaryDecodable, CallMethodRequest, ContextOwned, DateTime, ReadProcessedDetails,
    ReadRawModifiedDetails, StatusCode, Variant, WriteValue,
};
use rungd_client::live::TagType;
use rungd_client::operator::protocol::is_reason;
use rungd_language::source::wording::is_unseen;

use crate::aggregate::{Aggregate, PastInterval};
use crate::certificates::shown_name;
use crate::frames::{ClientRules, FrameKind, FrameRefusal, FrameScanner};
use crate::history::RawSpan;
use crate::manager::array_writes;
use crate::pages::{PastValue, WaitingElements};
use crate::reasons::ReasonedWrite;
use crate::shelving::{ShelvingMethod, WantedShelving};
use crate::tags::PlantVariable;
use crate::values::{given, unix_ns};

/// Takes the bytes to where the first of them says.
///
/// # Panics
/// If something does not hold that the server relies on.
pub fn take(bytes: &[u8]) {
    let [to, rest @ ..] = bytes else { return };
    match to % 6 {
        0 => frames(rest),
        1 => write(rest),
        2 => raw(rest),
        3 => processed(rest),
        4 => call(rest),
        _ => certificate(rest),
    }
}

/// A value of a service, as the server decodes it.
fn decoded<T: BinaryDecodable>(bytes: &[u8]) -> Option<T> {
    let context = ContextOwned::default();
    T::decode(&mut Cursor::new(bytes), &context.context()).ok()
}

/// The answer of the gate does not depend on the pieces in which the bytes come.
fn frames(bytes: &[u8]) {
    let [length, insecure, rest @ ..] = bytes else { return };
    let judged = |length: usize| -> Result<(), FrameRefusal> {
        let mut rules = ClientRules::new(insecure % 2 == 1);
        let mut scanner = FrameScanner::default();
        let mut pieces = rest.chunks(length.max(1));
        pieces.try_for_each(|piece| {
            scanner.take(piece, |frame| {
                rules.judge(frame)?;
                // The server opens what is asked for.
                let opens = frame.kind == FrameKind::Open;
                let trusts = |thumbprint: &[u8]| thumbprint.len() == 20;
                if opens { rules.opened(frame.body, trusts).map(|_| ()) } else { Ok(()) }
            })
        })
    };
    assert_eq!(judged(usize::from(*length)), judged(rest.len()));
}

fn write(bytes: &[u8]) {
    let Some(asked) = decoded::<WriteValue>(bytes) else { return };
    let Some(value) = &asked.value.value else { return };
    for tag_type in [TagType::Bit, TagType::Unsigned16, TagType::Signed32, TagType::Real] {
        let _ = given(tag_type, value);
        let cells: Vec<u32> = (0..10).collect();
        let variable = PlantVariable { cells, ..PlantVariable::array_of(tag_type) };
        if let Ok(writes) = array_writes("a", &variable, value, &asked.index_range) {
            let known: Vec<String> = (0..10).map(|at| format!("a[{at}]")).collect();
            assert!((1..=10).contains(&writes.len()));
            assert!(writes.iter().all(|write| known.contains(&write.operand)));
        }
    }
}

fn raw(bytes: &[u8]) {
    let [count, most, rest @ ..] = bytes else { return };
    let Some(details) = decoded::<ReadRawModifiedDetails>(rest) else { return };
    let _ = RawSpan::of(&details, DateTime::now());
    let value = |unix_ns| PastValue { unix_ns, value: Variant::from(1), status: StatusCode::Good };
    let values = (0..i64::from(*count)).map(value).collect();
    let waiting = WaitingElements::default();
    let (mut page, mut seen) = (waiting.first_page(values, usize::from(*most)), 0);
    while let Some(found) = page {
        seen += found.values.len();
        page = found.rest.map(|rest| rest.page(usize::from(*most)));
    }
    assert_eq!(seen, usize::from(*count));
}

fn processed(bytes: &[u8]) {
    let Some(details) = decoded::<ReadProcessedDetails>(bytes) else { return };
    let span =
        PastInterval { start_ns: unix_ns(&details.start_time), end_ns: unix_ns(&details.end_time) };
    let Some(intervals) = span.divided(details.processing_interval) else { return };
    assert!(!intervals.is_empty() && intervals.len() <= 10_000);
    let value = |unix_ns| PastValue { unix_ns, value: Variant::from(1), status: StatusCode::Good };
    let values: Vec<PastValue> = [i64::MIN, span.start_ns, 0, span.end_ns].map(value).into();
    for one in intervals.into_iter().take(20) {
        for aggregate in [Aggregate::Minimum, Aggregate::Maximum, Aggregate::Average] {
            aggregate.value(&values, one);
        }
    }
}

fn call(bytes: &[u8]) {
    let Some(asked) = decoded::<CallMethodRequest>(bytes) else { return };
    let arguments = asked.input_arguments.unwrap_or_default();
    for method in ShelvingMethod::of(&asked.method_id).into_iter().chain([ShelvingMethod::Timed]) {
        let _ = WantedShelving::of(method, &asked.object_id, &arguments);
    }
    if let Ok(wanted) = ReasonedWrite::of(&arguments) {
        assert!(is_reason(&wanted.reason));
    }
}

fn certificate(bytes: &[u8]) {
    if let Ok(certificate) = X509::from_der(bytes) {
        assert!(!shown_name(&certificate).contains(is_unseen));
    }
}
