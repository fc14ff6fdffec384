//! Many controllers: the Sparkplug B edge node ([`edge`]), the controllers behind a broker
//! ([`fleet`]), metrics for a time-series database ([`metrics`]), the file of the OPC UA server
//! ([`opcua`]).
//!
//! Each is a program of its own (a subcommand) and a client of the operator's socket or of a
//! broker; none is part of the daemon.
//!
//! # The way of a value to a broker
//!
//! ```text
//!  operator's socket ─► live::ChangeFollower ─► LogEvent ─► node ─► NodeAction ─► shell
//!  (recording from_section=N)   ▲  ChangeRun               (no I/O,    │ ▲           │
//!  recorded folder ─► live::ChangeHistory                   no clock)  │ │           ▼
//!                               └──────────── replay from there ◄──────┘ │         mqtt ─► broker
//!                                             (position in the log)      │           │
//!                                               cursor ◄─ all before it read ┴── Pong ───┘
//! ```
//!
//! The scan log is the only store. A `ChangeRun` executes the new part of the newest section and
//! returns each change of a chosen cell once, with its scan. If the log continues at a different
//! place, the `ChangeRun` reports it, and a `ChangeHistory` reads the part between, from memory and
//! from the folder. The node decides what is published: births, data, and which values are
//! historical. Over a broken link it keeps only a position in the log.
//!
//! # The way of a message to `rungd fleet`
//!
//! ```text
//!  broker ─► mqtt::MqttSession ─► fleet::listen ─► FleetView ─► NodeView ─► MetricTable
//!                   ▲                 │               │  births, seq,     names, aliases,
//!                   │                 │               │  deaths           types
//!                   └── STATE, NCMD ◄─┘               ▼
//!                      (on demand)      FleetChange (`watch`), FleetReport (`status`), alarms
//! ```
//!
//! All data from a broker are limited before they are kept. After a gap in a node's sequence
//! numbers a birth may be missing, so an alias could mean a different metric: values with an alias
//! are ignored until the next birth.

pub mod edge;
pub mod fleet;
pub mod journal;
pub mod metrics;
pub mod opcua;
pub mod settings_file;
