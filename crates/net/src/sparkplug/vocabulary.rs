//! The names of metrics that rungd's edge nodes publish beside their tags, and names of the
//! specification.
//!
//! `edge` writes them, `fleet` reads them; `docs/sparkplug.md` describes them.

/// The number of a birth, which is also in its NDEATH.
pub const BD_SEQ: &str = "bdSeq";
/// A command: send the birth again.
pub const REBIRTH: &str = "Node Control/Rebirth";

/// rungd's version (String). No tag has a name with `/`.
pub const VERSION: &str = "rungd/version";
/// Whether the controller answers the edge node (Boolean).
pub const CONTROLLER: &str = "rungd/controller";
/// `RUN`, `STOP` or `FAULT` (String).
pub const MODE: &str = "rungd/mode";
/// The reason for the mode, outside RUN (String).
pub const MODE_REASON: &str = "rungd/mode/reason";
/// The ladder's name (String).
pub const LADDER: &str = "rungd/ladder/name";
/// The hash of the ladder's files, as in the log (String).
pub const LADDER_SHA256: &str = "rungd/ladder/sha256";
/// The number of forced operands (Int64).
pub const FORCES: &str = "rungd/forces";
/// The number of scans that ended after the next grid point, since RUN began (Int64).
pub const OVERRUNS: &str = "rungd/overruns";
/// The number of alarms that are ON (Int64).
pub const ALARMS: &str = "rungd/alarms";
/// The number of alarms that wait for an acknowledgement (Int64).
pub const ALARMS_UNACKNOWLEDGED: &str = "rungd/alarms/unacknowledged";
/// The number of alarms that are shelved or out of service (Int64).
pub const ALARMS_SHELVED: &str = "rungd/alarms/shelved";
/// The alarm book as JSON, in the format of `rungd alarms --json`; at most 100 alarms (String).
pub const ALARM_LIST: &str = "rungd/alarm-list";
/// The last scan whose changes are published (Int64).
pub const SCAN: &str = "rungd/scan";
/// The number of scans whose changes could not be published, since the node's first birth (Int64).
pub const HISTORY_LOST: &str = "rungd/history/lost";
/// Whether values of the past are being sent (Boolean).
pub const HISTORY_REPLAYING: &str = "rungd/history/replaying";
