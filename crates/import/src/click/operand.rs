//! The addresses of a CLICK, and the tags that they become.

use std::collections::BTreeMap;

use super::address::bank_and_number;
use super::nicknames::ClickNicknames;
use crate::condition::{RungCondition, TouchedPlace};
use crate::model::{ProjectTag, Renamed};
use crate::names::GivenNames;

/// What an address holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClickType {
    Bit,
    /// 16 bits with a sign.
    Short,
    /// 32 bits with a sign.
    Long,
}

/// A bank of addresses.
struct Bank {
    name: &'static str,
    kind: ClickType,
    last: u32,
}

const BANKS: [Bank; 9] = [
    Bank { name: "X", kind: ClickType::Bit, last: 816 },
    Bank { name: "Y", kind: ClickType::Bit, last: 816 },
    Bank { name: "C", kind: ClickType::Bit, last: 2000 },
    Bank { name: "T", kind: ClickType::Bit, last: 500 },
    Bank { name: "CT", kind: ClickType::Bit, last: 250 },
    Bank { name: "DS", kind: ClickType::Short, last: 4500 },
    Bank { name: "DD", kind: ClickType::Long, last: 1000 },
    Bank { name: "TD", kind: ClickType::Short, last: 500 },
    Bank { name: "CTD", kind: ClickType::Long, last: 250 },
];

/// A value that an instruction reads or writes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ClickOperand {
    /// As rungd writes it.
    pub(super) text: String,
    pub(super) kind: ClickType,
    /// The place, of what is no constant.
    pub(super) place: Option<TouchedPlace>,
}

/// The tags of a program.
#[derive(Debug, Default)]
pub(super) struct ClickMemory {
    pub(super) names: GivenNames,
    nicknames: ClickNicknames,
    tags: BTreeMap<(usize, u32), ProjectTag>,
    /// The tags whose addresses are retentive.
    pub(super) retentive: Vec<String>,
    /// Whether a tag has an initial value.
    pub(super) has_initial: bool,
    /// How many addresses have their nicknames.
    pub(super) named: usize,
    pub(super) own: Vec<ProjectTag>,
}

impl ClickMemory {
    pub(super) fn with(nicknames: ClickNicknames) -> ClickMemory {
        ClickMemory { nicknames, ..ClickMemory::default() }
    }

    /// How many nicknames belong to addresses that the ladder does not name.
    pub(super) fn unused(&self) -> usize {
        self.nicknames.count() - self.named
    }

    /// The tag of an address that the ladder names for the first time.
    fn declared(&mut self, bank: &Bank, number: u32) -> ProjectTag {
        let Bank { name, kind, .. } = bank;
        let known = self.nicknames.nickname(name, number).cloned().unwrap_or_default();
        let address = format!("{name}{number}");
        let wish = match known.nickname.is_empty() {
            true => format!("{}_{number}", name.to_lowercase()),
            false => known.nickname.clone(),
        };
        let tag = self.names.fresh(&wish);
        self.named += usize::from(!known.nickname.is_empty());
        if known.is_retentive && !known.nickname.is_empty() {
            self.retentive.push(tag.clone());
        }
        let initial = known.initial.parse::<i32>().ok().filter(|value| *value != 0);
        self.has_initial |= initial.is_some();
        let initial = initial.map(|value| match kind {
            ClickType::Bit => "true".to_owned(),
            ClickType::Short | ClickType::Long => value.to_string(),
        });
        ProjectTag {
            name: tag,
            kind: if *kind == ClickType::Bit { "bit" } else { "int" }.to_owned(),
            at: matches!(*name, "X" | "Y" | "C").then(|| address.clone()),
            initial,
            doc: match known.comment.is_empty() {
                true => address,
                false => format!("{address}: {}", known.comment),
            },
            ..ProjectTag::default()
        }
    }

    /// All tags, by their addresses.
    pub(super) fn all(self) -> Vec<ProjectTag> {
        self.own.into_iter().chain(self.tags.into_values()).collect()
    }

    /// The names in the original.
    pub(super) fn renamed(&self) -> Vec<Renamed> {
        let tags = self.tags.iter();
        let names = tags.map(|((bank, number), tag)| Renamed {
            from: format!("{}{number}", BANKS[*bank].name),
            to: tag.name.clone(),
        });
        names.collect()
    }

    /// A tag of the import's own.
    pub(super) fn own(&mut self, wish: &str, doc: &str) -> String {
        let name = self.names.fresh(wish);
        self.own.push(ProjectTag {
            name: name.clone(),
            kind: "int".to_owned(),
            doc: doc.to_owned(),
            is_own: true,
            ..ProjectTag::default()
        });
        name
    }

    /// The tag of an address.
    ///
    /// # Errors
    /// It is none, or of a bank that is not translated.
    pub(super) fn address(&mut self, text: &str) -> Result<ClickOperand, String> {
        let text = text.trim();
        let (name, number) = bank_and_number(text)?;
        let bank = BANKS.iter().position(|bank| bank.name == name);
        let bank = bank.ok_or_else(|| format!("the operand `{text}`"))?;
        let all = &BANKS[bank];
        if !(1..=all.last).contains(&number) {
            return Err(format!("the address `{text}`, which no CLICK has"));
        }
        if !self.tags.contains_key(&(bank, number)) {
            let tag = self.declared(all, number);
            self.tags.insert((bank, number), tag);
        }
        let name = self.tags[&(bank, number)].name.clone();
        let place = Some(TouchedPlace::of(&name));
        Ok(ClickOperand { text: name, kind: all.kind, place })
    }

    /// A number: an address or a constant.
    ///
    /// # Errors
    /// It is neither.
    pub(super) fn number(&mut self, text: &str) -> Result<ClickOperand, String> {
        if let Ok(value) = text.trim().parse::<i32>() {
            let kind = match i16::try_from(value) {
                Ok(_) => ClickType::Short,
                Err(_) => ClickType::Long,
            };
            return Ok(ClickOperand { text: value.to_string(), kind, place: None });
        }
        let found = self.address(text)?;
        match found.kind {
            ClickType::Bit => Err(format!("the bit `{}` where a number is wanted", text.trim())),
            ClickType::Short | ClickType::Long => Ok(found),
        }
    }

    /// A bit.
    ///
    /// # Errors
    /// It is none.
    pub(super) fn bit(&mut self, text: &str) -> Result<RungCondition, String> {
        match text.trim() {
            "SC1" => return Ok(RungCondition::Constant(true)),
            "SC2" => return Ok(RungCondition::bit("$FirstScan")),
            _ => {}
        }
        let found = self.address(text)?;
        match found.kind {
            ClickType::Bit => Ok(RungCondition::bit(found.text)),
            ClickType::Short | ClickType::Long => {
                Err(format!("the number `{}` where a bit is wanted", text.trim()))
            }
        }
    }

    /// What a contact says.
    ///
    /// # Errors
    /// It says nothing that rungd can say.
    pub(super) fn contact(&mut self, text: &str) -> Result<RungCondition, String> {
        for operator in ["==", "!=", "<=", ">=", "<", ">"] {
            let Some((left, right)) = text.split_once(operator) else { continue };
            let (left, right) = (self.number(left)?, self.number(right)?);
            let reads = [left.place, right.place].into_iter().flatten().collect();
            return Ok(RungCondition::compare(&left.text, operator, &right.text, reads));
        }
        if let Some(inner) = text.strip_prefix('~') {
            return Ok(self.contact(inner)?.opposite());
        }
        for edge in ["rise", "fall"] {
            let inner = text.strip_prefix(edge).and_then(|rest| rest.strip_prefix('('));
            let Some(inner) = inner.and_then(|rest| rest.strip_suffix(')')) else { continue };
            let RungCondition::Bit { text, reads } = self.bit(inner)? else {
                return Err(format!("an edge of `{inner}`"));
            };
            return Ok(RungCondition::Bit { text: format!("{edge}({text})"), reads });
        }
        if text.contains("immediate") {
            return Err("an immediate contact".to_owned());
        }
        self.bit(text)
    }
}
