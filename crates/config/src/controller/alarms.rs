//! `[alarms]`: its keys, read into settings.

use rungd_language::source::key::key;
use rungd_language::source::reader::Table;

/// The settings of alarms.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AlarmSettings {
    /// Whether operators may shelve critical alarms.
    pub shelves_critical: bool,
}

/// Reads `[alarms]`; without it, the settings have their defaults.
pub(super) fn read_in(root: &mut Table<'_>) -> AlarmSettings {
    let explained = key("alarms", "Settings of alarms.");
    let Some(mut table) = root.table(explained, "`[alarms]`") else {
        return AlarmSettings::default();
    };
    let critical = key(
        "shelve-critical",
        "Whether alarms with priority critical may be shelved or taken out of service; false if \
         not given.",
    );
    let shelves_critical = table.boolean(critical).is_some_and(|given| given.value);
    table.finish();
    AlarmSettings { shelves_critical }
}
