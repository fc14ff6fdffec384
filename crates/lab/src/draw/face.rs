//! The texts at a contact, coil or box of a rung in text: name, symbol, address.
//!
//! `text` puts them on its canvas. No positions and no wires here.

use super::circuit::{ContactForm, ContactSymbol, InstructionSymbol};

/// The mark in a symbol that conducts or has power.
pub(super) const MARK: char = '●';

/// The texts at a contact, coil or box.
pub(super) struct Face {
    pub above: String,
    pub symbol: String,
    pub below: String,
}

impl Face {
    pub fn of_contact(symbol: &ContactSymbol) -> Face {
        let name = plain(&symbol.label.name);
        let below = symbol.label.address.clone().unwrap_or_default();
        let plain = |symbol: &str| Face { above: name.clone(), symbol: symbol.to_owned(), below };
        match symbol.form {
            ContactForm::Open => plain("] ["),
            ContactForm::Closed => plain("]/["),
            ContactForm::Rising => plain("]P["),
            ContactForm::Falling => plain("]N["),
            ContactForm::NotRising => plain("]/P["),
            ContactForm::NotFalling => plain("]/N["),
            ContactForm::Boxed => {
                Face { above: String::new(), symbol: format!("[{name}]"), below: String::new() }
            }
            ContactForm::NotBoxed => {
                Face { above: String::new(), symbol: format!("[!({name})]"), below: String::new() }
            }
        }
    }

    pub fn of_instruction(symbol: &InstructionSymbol) -> Face {
        match symbol.coil {
            Some(letter) => Face {
                above: plain(&symbol.label.name),
                symbol: format!("({})", if letter.is_empty() { " " } else { letter }),
                below: symbol.label.address.clone().unwrap_or_default(),
            },
            None => Face {
                above: String::new(),
                symbol: format!("[{}]", plain(&boxed(symbol))),
                below: String::new(),
            },
        }
    }

    /// Adds a mark after the bracket if the symbol has power, and a blank otherwise, so that a rung
    /// has the same width with and without power.
    pub fn marked(mut self, has_power: bool) -> Face {
        let mark = if has_power { MARK } else { ' ' };
        let mut chars = self.symbol.chars();
        let bracket = chars.next().unwrap_or(' ');
        let rest = chars.as_str();
        let rest = rest.strip_prefix(' ').unwrap_or(rest);
        self.symbol = format!("{bracket}{mark}{rest}");
        self
    }

    pub fn width(&self) -> usize {
        let widths = [&self.above, &self.symbol, &self.below].map(|text| text.chars().count());
        widths.into_iter().max().unwrap_or(0)
    }
}

/// Replaces the control characters of a name.
pub(super) fn plain(name: &str) -> String {
    name.replace(char::is_control, "?")
}

/// The text of a box: the mnemonic with its operands.
pub(super) fn boxed(symbol: &InstructionSymbol) -> String {
    let operands = symbol.operands.iter().map(String::as_str);
    std::iter::once(symbol.mnemonic).chain(operands).collect::<Vec<_>>().join(" ")
}
