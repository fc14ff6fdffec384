//! Reads the values that a set can write back.
//!
//! Called by `service`. Which operands these are is decided by `operator::writable`; this module
//! gives their values in the latest image.

use super::service::OperatorService;
use rungd_client::operator::protocol::{OperandValues, RequestResult, WritableValues};
use rungd_client::operator::writable::WritableFilter;

impl OperatorService {
    /// The values of operands that can be written, without operands of all tags.
    pub(super) fn read_set(&self, operands: &[String]) -> RequestResult<WritableValues> {
        let (latest, view) = self.seen();
        let is_moved = |what| view.about.driver_of(what).is_some();
        let content = |cell| latest.value(cell);
        let filter = WritableFilter { content: &content, is_moved: &is_moved };
        let set = view.names.writable(operands, &filter)?;
        let OperandValues { mode, scans, values, .. } = view.sight(&latest).values(&set.operands);
        let structures = set.structures.len();
        let (read_only, records) = (set.read_only, set.records);
        Ok(WritableValues { mode, scans, values, structures, read_only, records })
    }
}
