//! Checks whether a PDU answers a request, and finds the data in it.
//!
//! The functions are pure, and accept any received bytes: they do not panic or allocate. For a PDU
//! that is not an answer they return [`AnswerFault`]. Its clause for the log is the same each time,
//! so that lasting trouble is one line.

use std::fmt;

/// The reason why a PDU is not an answer to its request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnswerFault {
    /// It is a refusal with this exception.
    Exception(u8),
    /// It has no bytes.
    Empty,
    /// Its function is not the request's, but this one.
    Function(u8),
    /// Its length does not match its byte count or function.
    Length,
    /// Its number of data bytes is not the requested number.
    Count {
        /// The received number.
        came: u8,
        /// The requested number.
        asked: u8,
    },
    /// It does not repeat the write of the request.
    Echo,
}

/// The exceptions of a gateway whose unit does not answer.
const GATEWAY: [u8; 2] = [10, 11];

/// The data of the answer to a request: the bits or registers of a read, nothing for a write.
///
/// # Errors
/// The PDU is not an answer to this request.
pub fn check<'a>(request: &[u8], answer: &'a [u8]) -> Result<&'a [u8], AnswerFault> {
    let (&asked, body) = request.split_first().ok_or(AnswerFault::Empty)?;
    let (&function, rest) = answer.split_first().ok_or(AnswerFault::Empty)?;
    if function == asked | 0x80 {
        return match rest {
            [exception] => Err(AnswerFault::Exception(*exception)),
            _ => Err(AnswerFault::Length),
        };
    }
    if function != asked {
        return Err(AnswerFault::Function(function));
    }
    let Some(bytes) = data_bytes(request) else {
        return match rest.len() {
            4 if body.starts_with(rest) => Ok(&[]),
            4 => Err(AnswerFault::Echo),
            _ => Err(AnswerFault::Length),
        };
    };
    match rest.split_first() {
        Some((&came, data)) if usize::from(came) == data.len() => match came == bytes {
            true => Ok(data),
            false => Err(AnswerFault::Count { came, asked: bytes }),
        },
        _ => Err(AnswerFault::Length),
    }
}

/// The number of data bytes in the answer to a read; `None` for a write.
fn data_bytes(request: &[u8]) -> Option<u8> {
    let [function, _, _, high, low, ..] = *request else { return None };
    let count = u16::from_be_bytes([high, low]);
    match function {
        1 | 2 => u8::try_from(count.div_ceil(8)).ok(),
        3 | 4 => u8::try_from(count.checked_mul(2)?).ok(),
        _ => None,
    }
}

/// The length of the answer's PDU in bytes, if the answer is not an exception.
pub(crate) fn expected_bytes(request: &[u8]) -> usize {
    data_bytes(request).map_or(5, |bytes| 2 + usize::from(bytes))
}

impl AnswerFault {
    /// Whether a gateway reports that its unit does not answer.
    pub(crate) fn is_absence(self) -> bool {
        matches!(self, AnswerFault::Exception(code) if GATEWAY.contains(&code))
    }
}

impl fmt::Display for AnswerFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            AnswerFault::Exception(code) => match exception(code) {
                Some(name) => write!(f, "exception {code} ({name})"),
                None => write!(f, "exception {code}, which Modbus does not have"),
            },
            AnswerFault::Empty => f.write_str("the answer is empty"),
            AnswerFault::Function(code) => write!(f, "the answer is of function {code}"),
            AnswerFault::Length => f.write_str("the answer has a wrong length"),
            AnswerFault::Count { came, asked } => {
                write!(f, "{came} bytes of data instead of {asked}")
            }
            AnswerFault::Echo => f.write_str("the answer confirms a different write"),
        }
    }
}

fn exception(code: u8) -> Option<&'static str> {
    match code {
        1 => Some("illegal function"),
        2 => Some("illegal data address"),
        3 => Some("illegal data value"),
        4 => Some("device failure"),
        5 => Some("acknowledge: the request takes longer"),
        6 => Some("device busy"),
        8 => Some("memory parity error"),
        10 => Some("gateway path unavailable"),
        11 => Some("the gateway's device does not answer"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const READ_3: [u8; 5] = [3, 0, 9, 0, 2];
    const WRITE_6: [u8; 5] = [6, 0, 1, 0, 3];
    const WRITE_16: [u8; 10] = [16, 0, 1, 0, 2, 4, 0, 10, 1, 2];

    fn wrong(request: &[u8], answer: &[u8]) -> String {
        check(request, answer).unwrap_err().to_string()
    }

    #[test]
    fn correct_answers_are_accepted() {
        assert_eq!(check(&READ_3, &[3, 4, 1, 2, 3, 4]), Ok(&[1, 2, 3, 4][..]));
        assert_eq!(check(&[1, 0, 0, 0, 9], &[1, 2, 0xff, 1]), Ok(&[0xff, 1][..]));
        assert_eq!(check(&WRITE_6, &WRITE_6), Ok(&[][..]));
        assert_eq!(check(&WRITE_16, &WRITE_16[..5]), Ok(&[][..]));
    }

    #[test]
    fn every_mismatch_of_an_answer_has_its_own_message() {
        let cases: [(&[u8], &[u8], &str); 13] = [
            (&READ_3, &[0x83, 2], "exception 2 (illegal data address)"),
            (&READ_3, &[0x83, 99], "exception 99, which Modbus does not have"),
            (&READ_3, &[0x83], "the answer has a wrong length"),
            (&READ_3, &[0x83, 2, 0], "the answer has a wrong length"),
            (&READ_3, &[0x84, 2], "the answer is of function 132"),
            (&READ_3, &[4, 4, 1, 2, 3, 4], "the answer is of function 4"),
            (&READ_3, &[3, 2, 1, 2], "2 bytes of data instead of 4"),
            (&READ_3, &[3, 6, 1, 2, 3, 4, 5, 6], "6 bytes of data instead of 4"),
            (&READ_3, &[3, 4, 1, 2, 3], "the answer has a wrong length"),
            (&READ_3, &[3], "the answer has a wrong length"),
            (&READ_3, &[], "the answer is empty"),
            (&WRITE_6, &[6, 0, 1, 0, 4], "the answer confirms a different write"),
            (&WRITE_16, &WRITE_16, "the answer has a wrong length"),
        ];
        for (request, answer, words) in cases {
            assert_eq!(wrong(request, answer), words, "{answer:?}");
        }
    }

    proptest! {
        #[test]
        fn checking_any_answer_does_not_panic(
            request in prop::collection::vec(any::<u8>(), 0..12),
            answer in prop::collection::vec(any::<u8>(), 0..300),
        ) {
            let _ = expected_bytes(&request);
            if let Ok(data) = check(&request, &answer) {
                prop_assert!(data.len() <= 250 || request[0] > 4 || data.len() <= 255);
            }
        }

        #[test]
        fn an_answer_is_accepted_only_with_the_requested_length(
            function in 1u8..5,
            count in 1u16..=125,
            data in prop::collection::vec(any::<u8>(), 0..=255),
        ) {
            let [high, low] = count.to_be_bytes();
            let request = [function, 0, 0, high, low];
            let answer = [&[function, data.len() as u8], &data[..]].concat();
            let wanted = expected_bytes(&request) - 2;
            prop_assert_eq!(check(&request, &answer).is_ok(), data.len() == wanted);
        }
    }
}
