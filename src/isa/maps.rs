//! Maps and sets by addresses and other small numbers.
//!
//! A load looks up some hundred thousand addresses; with the standard library's hash function that
//! took a fifth of its time. That function withstands keys that an attacker has chosen, which takes
//! time; these keys come from the files of the machine's owner. Maps by names keep it.

use rustc_hash::{FxHashMap, FxHashSet};

/// A map by addresses or numbers.
pub(crate) type NumberMap<K, V> = FxHashMap<K, V>;

/// A set of addresses or numbers.
pub(crate) type NumberSet<K> = FxHashSet<K>;
