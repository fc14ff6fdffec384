//! Values in the protocol: as a client gives them, and as an operand holds them.
//!
//! Part of [`super::protocol`], which says the rest.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A value as a client gives it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a value is true or false, a whole number, or a string")]
pub enum Given {
    /// `true`, `false`.
    Bit(bool),
    /// A number.
    Number(i64),
    /// As people write it: `ON`, `12`, `0x1F`, `1m30s`.
    Text(String),
}

/// What one operand holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Value {
    /// As it was asked for; of a structure that was asked for, with the member.
    pub operand: String,
    /// Its tag, if it has one; of a member, with it: `parts.Acc`.
    pub tag: Option<String>,
    /// Its address: `CT0.Acc`; of Stages and blocks, their name: `Drain.Open`.
    pub address: String,
    /// What it holds.
    pub value: Held,
    /// Whether it is forced.
    pub forced: bool,
}

/// A bit or a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)]
pub enum Held {
    Bit(bool),
    Word(i32),
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Held::Bit(true) => f.write_str("ON"),
            Held::Bit(false) => f.write_str("OFF"),
            Held::Word(value) => write!(f, "{value}"),
        }
    }
}

impl fmt::Display for Value {
    /// `parts.Acc (CT0.Acc)`, or the address alone.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.tag {
            Some(tag) => write!(f, "{tag} ({})", self.address),
            None => f.write_str(&self.address),
        }
    }
}
