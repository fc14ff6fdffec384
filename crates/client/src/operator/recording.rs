//! The answer to a request for the last part of the scan log.
//!
//! Part of the [`super::protocol`]. The bytes are a recording as files have it; nothing here reads
//! them.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde::{Deserialize, Serialize};

use super::present::PresentOutputs;

/// The most bytes of a recording in an answer; the answer contains them as base64.
pub const RECORDING_BYTES_MAX: usize = 45 << 20;

/// The last minute of the scan log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingBytes {
    /// The bytes of a recording (`docs/record-format.md`), in base64.
    pub base64: String,
    /// What the controller does at present; `None` from an earlier version of rungd.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub present: Option<PresentOutputs>,
}

impl RecordingBytes {
    /// The recording; `None`: the answer is not base64.
    pub fn bytes(&self) -> Option<Vec<u8>> {
        BASE64_STANDARD.decode(&self.base64).ok()
    }
}
