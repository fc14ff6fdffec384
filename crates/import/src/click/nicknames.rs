//! The nicknames of a CLICK project, as its software exports them and pip's `pyclickplc` writes
//! them: a header `Address,Data Type,Nickname,Initial Value,Retentive,Address Comment`.
//!
//! Called by `click::read_named`; `operand` gives the tags their names.

use std::collections::HashMap;

use super::address::bank_and_number;
use crate::csv::{CsvRecord, records};

/// The columns that are read.
const COLUMNS: [&str; 5] = ["Address", "Nickname", "Initial Value", "Retentive", "Address Comment"];

/// What a nickname file says of an address.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct ClickNickname {
    /// Empty: none.
    pub(super) nickname: String,
    pub(super) comment: String,
    /// Empty: 0.
    pub(super) initial: String,
    pub(super) is_retentive: bool,
}

/// The nicknames by bank and number.
#[derive(Debug, Default)]
pub(super) struct ClickNicknames {
    all: HashMap<String, ClickNickname>,
}

impl ClickNicknames {
    /// Reads a nickname file.
    ///
    /// # Errors
    /// It is none; the reason has the line.
    pub(super) fn read(text: &str) -> Result<ClickNicknames, String> {
        let mut rows = records(text.trim_start_matches('\u{feff}'))?.into_iter();
        let header = rows.next().ok_or("no nicknames: the file is empty")?;
        let column = |name: &str| {
            let found = header.fields.iter().position(|field| field.trim() == name);
            found.ok_or_else(|| format!("no nicknames: line 1 has no column `{name}`"))
        };
        let columns: Result<Vec<usize>, String> = COLUMNS.iter().map(|name| column(name)).collect();
        let columns = columns?;
        let mut nicknames = ClickNicknames::default();
        for CsvRecord { line, fields } in rows {
            let field = |at: usize| fields.get(columns[at]).map_or("", |field| field.trim());
            let (bank, number) = bank_and_number(field(0))
                .map_err(|_| format!("line {line}: `{}` is no address", field(0)))?;
            let nickname = ClickNickname {
                nickname: field(1).to_owned(),
                initial: field(2).to_owned(),
                is_retentive: field(3).eq_ignore_ascii_case("yes"),
                comment: field(4).to_owned(),
            };
            nicknames.all.insert(format!("{bank}{number}"), nickname);
        }
        Ok(nicknames)
    }

    /// What is said of an address.
    pub(super) fn nickname(&self, bank: &str, number: u32) -> Option<&ClickNickname> {
        self.all.get(&format!("{bank}{number}"))
    }

    /// How many addresses have one.
    pub(super) fn count(&self) -> usize {
        self.all.values().filter(|one| !one.nickname.is_empty()).count()
    }
}
