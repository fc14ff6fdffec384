//! `[retain]`, resolved but for its ranges: a path, what a start without memory does.
//!
//! Called by `controller`. Whether the file can be made shows at run time.

use crate::source::finding::{Code, Finding};
use crate::source::retain as written;

/// How retentive memory is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Retention {
    /// Its file, relative to the controller file; else the daemon puts it where it belongs.
    pub file: Option<String>,
    /// It is written at most so often, ms; at least 1.
    pub interval_ms: u32,
    /// Whether the controller runs where nothing was found to be restored.
    pub runs_cold: bool,
    /// More MB a day than this are worth a warning.
    pub budget_mb: u32,
}

pub(super) fn resolve(written: &written::Retain, findings: &mut Vec<Finding>) -> Retention {
    if let Some(file) = &written.file
        && (file.text.is_empty() || file.text.ends_with('/') || file.text.contains('\0'))
    {
        let finding = Finding::new(Code::Controller, file.span, "memory is kept in a file");
        findings.push(finding.help("write `file = \"/var/lib/rungd/memory\"`"));
    }
    let runs_cold = match written.cold_start.as_ref().map(|text| (text.text.as_str(), text.span)) {
        None | Some(("stop", _)) => false,
        Some(("run", _)) => true,
        Some((other, span)) => {
            let message = format!("`{other}` is not what a cold start can be");
            let finding = Finding::new(Code::Controller, span, message);
            findings.push(finding.help("write `cold-start = \"stop\"` or `\"run\"`"));
            false
        }
    };
    Retention {
        file: written.file.as_ref().map(|file| file.text.clone()),
        interval_ms: written.interval_ms.value.max(1).unsigned_abs(),
        runs_cold,
        budget_mb: written.budget_mb,
    }
}
