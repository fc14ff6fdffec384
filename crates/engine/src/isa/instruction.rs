//! The instruction table, and the questions that other modules ask of it. Its rows are in
//! `instruction_table`, their columns in `columns` and `role`.
//!
//! The resolver checks operands against the table, the checks use it for termination and ownership,
//! `observe` for what an execution reads and writes, and `rungd explain` prints it. It does not
//! contain the behaviour of an instruction: `docs/semantics.md` specifies it, and the engine
//! executes it.

pub use super::columns::OperandKind;
pub use super::columns::{LegName, OperandSpec, Termination};
pub use super::instruction_table::{Mnemonic, Spec, TABLE};
use super::role::OperandRole;

impl Mnemonic {
    /// The table row.
    pub fn spec(self) -> &'static Spec {
        &TABLE[self as usize]
    }

    /// The instruction with this name, in upper case as in the table.
    pub fn from_name(name: &str) -> Option<Mnemonic> {
        // Every name ends with a capital letter. Most words that are looked up are operands.
        let may_be_one = name.ends_with(|last: char| last.is_ascii_uppercase());
        let row = if may_be_one { TABLE.iter().find(|spec| spec.name == name) } else { None };
        row.map(|spec| spec.mnemonic)
    }

    /// Whether it owns the structure that it names. A structure has one owner in a program.
    pub fn owns_structure(self) -> bool {
        self.spec().owned().is_some()
    }
}

impl Spec {
    /// The operand with this name.
    pub fn operand(&self, name: &str) -> Option<&'static OperandSpec> {
        self.operands.iter().find(|o| o.name == name)
    }

    /// The structure that it owns.
    pub fn owned(&self) -> Option<&'static OperandSpec> {
        self.operands.iter().find(|operand| operand.role == OperandRole::Owns)
    }

    /// The operand with this key; without a key, the one at this position among those without.
    pub fn row(&self, key: Option<&str>, number: usize) -> Option<&'static OperandSpec> {
        match key {
            Some(_) => self.operands.iter().find(|operand| operand.key == key),
            None => self.positional(number),
        }
    }

    /// The operand without a key at a position; several Stages share the last operand.
    pub fn positional(&self, number: usize) -> Option<&'static OperandSpec> {
        let mut all = self.operands.iter().filter(|operand| operand.key.is_none());
        let last = all.clone().next_back()?;
        all.nth(number).or((last.kind == OperandKind::Stages).then_some(last))
    }

    /// The form in one line, as in the language reference: `CNT ct preset=n`.
    pub fn form(&self) -> String {
        let mut text = self.name.to_owned();
        for operand in self.operands {
            let value = operand.kind.placeholder();
            let item = match operand.key {
                Some(key) => format!("{key}={value}"),
                None => value.to_owned(),
            };
            text.push(' ');
            text.push_str(&if operand.optional { format!("[{item}]") } else { item });
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::Space;

    #[test]
    fn the_table_finds_each_instruction_by_its_mnemonic() {
        for spec in TABLE {
            assert_eq!(spec.mnemonic.spec().name, spec.name);
            assert_eq!(Mnemonic::from_name(spec.name), Some(spec.mnemonic));
        }
    }

    #[test]
    fn every_instruction_has_a_page() {
        for spec in TABLE {
            let head = format!("# {}: {}\n", spec.name, spec.title);
            assert!(spec.page.starts_with(&head), "{head}");
        }
    }

    #[test]
    fn the_role_of_an_operand_fits_its_kind() {
        for spec in TABLE {
            for OperandSpec { name, role, kind, .. } in spec.operands {
                let is_written = matches!(
                    kind,
                    OperandKind::WritableBit
                        | OperandKind::WritableWord
                        | OperandKind::Target
                        | OperandKind::WritableArray
                        | OperandKind::WritableBits
                        | OperandKind::Shifted
                );
                let spaces = [Space::Counter, Space::Timer, Space::Sensaphone];
                let is_structure = spaces.into_iter().any(|space| kind.is_structure_of(space));
                let has_structure = matches!(role, OperandRole::Owns | OperandRole::Resets);
                let moves_stages = matches!(role, OperandRole::Enters | OperandRole::Awaits);
                assert_eq!(role.writes(), is_written, "{}: {name}", spec.name);
                assert_eq!(has_structure, is_structure, "{}: {name}", spec.name);
                assert!(!moves_stages || kind.is_stage(), "{}: {name}", spec.name);
            }
        }
    }

    #[test]
    fn the_table_gives_the_syntax_shown_in_the_reference() {
        assert_eq!(Mnemonic::Cnt.spec().form(), "CNT ct preset=v");
        assert_eq!(Mnemonic::Udc.spec().form(), "UDC ct [up-preset=v] [dn-preset=v]");
        assert_eq!(Mnemonic::Sgconvrg.spec().form(), "SGCONVRG s … to=s");
        assert_eq!(Mnemonic::Exit.spec().form(), "EXIT");
        assert_eq!(Mnemonic::Math.spec().form(), "MATH target = expression");
    }

    #[test]
    fn counters_and_timers_own_their_structures() {
        let owners: Vec<&str> =
            TABLE.iter().filter(|s| s.mnemonic.owns_structure()).map(|s| s.name).collect();
        assert_eq!(
            owners,
            [
                "CNT", "CNTDN", "UDC", "UDCG", "ONDTMR", "OFFDTMR", "TMR", "TMRDOWN", "TMRA",
                "TMRADOWN", "TMRAG", "CTU", "CTD"
            ]
        );
    }
}
