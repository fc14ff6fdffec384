//! Maps and sets by addresses and other small numbers.
//!
//! A load looks up some hundred thousand addresses; with the standard library's hash function these
//! look-ups took a fifth of its time. The standard function is slow because it withstands keys that
//! an attacker has chosen. The keys here come from the files of the machine's owner. Maps by names
//! keep the standard function.

use rustc_hash::{FxHashMap, FxHashSet};

/// A map by addresses or numbers.
pub type NumberMap<K, V> = FxHashMap<K, V>;

/// A set of addresses or numbers.
pub type NumberSet<K> = FxHashSet<K>;
