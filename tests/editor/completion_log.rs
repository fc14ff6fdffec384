//! Completion in `[log]` of a controller file: its keys and their values, the names of events, and
//! the levels that an event can have.

use crate::editor::completion::check;
use crate::editor::project::CONTROLLER;

#[test]
fn keys_and_levels_are_offered_in_log_settings() {
    check(
        CONTROLLER,
        "ladder = [\"plant.toml\"]\n",
        &[
            ("[log]\n¦", &["statistics", "blocks", "time", "[log.events]"], &["ladder"]),
            ("[log]\nblocks = \"¦\"", &["all", "programs", "none"], &["utc", "off"]),
            ("[log]\ntime = \"¦\"", &["utc", "local"], &["all"]),
            ("[log.events]\n¦", &["stage-on", "tag-value", "mode-fault"], &["blocks"]),
            ("[log.events]\nstage-on = \"off\"\nst¦", &["stage-off"], &["stage-on"]),
            ("[log.events]\nstage-on = \"¦\"", &["off", "error", "debug", "trace"], &["all"]),
            ("[log.events]\nmode-fault = \"¦\"", &["error", "warn", "info"], &["off", "debug"]),
            ("[log]\nevents = { tag-value = \"¦\" }", &["off", "debug"], &[]),
        ],
    );
}
