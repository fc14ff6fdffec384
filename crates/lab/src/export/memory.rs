//! The variables of an exported program: one for each bit and word that its rungs name.
//!
//! A variable is declared when it is first asked for. Inputs and outputs have their addresses; all
//! others have none. What rungd gives a ladder from outside, the time of day and whether a device
//! answers, is a variable that the other controller has to write: the list of them is part of the
//! result.

use std::collections::HashMap;

use super::library::LibraryBlock;
use super::literals::CallLiteral;
use super::names::IecNames;
use super::project::{ExportedVariable, VariableRole};
use rungd_engine::isa::{Address, Bit, BitSpace, Real, Structure, Word, WordSpace, status};
use rungd_language::resolve::program::{Program, Tag, TagMeaning};

/// The variables of a program.
pub(super) struct ExportMemory<'p> {
    program: &'p Program,
    /// The name of the program in the file.
    pub(super) program_name: String,
    names: IecNames,
    by_address: HashMap<Address, String>,
    /// The bits and words of the ladder with their variables, in order of first use.
    pub(super) of_addresses: Vec<VariableOfAddress>,
    /// Variables of the export itself, by what they are for.
    own: HashMap<&'static str, String>,
    pending: HashMap<Structure, String>,
    /// The function blocks of the library that are used.
    pub(super) blocks: Vec<LibraryBlock>,
    pub(super) variables: Vec<ExportedVariable>,
    /// The names in the ladder of what comes from outside.
    pub(super) outside: Vec<OutsideValue>,
    /// The tags of each address.
    tags: HashMap<Address, Vec<&'p Tag>>,
}

/// A value that the other controller has to provide.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutsideValue {
    /// The variable.
    pub variable: String,
    /// Its name in the ladder: `$Hour`, `plant.Ok`.
    pub source: String,
}

/// The variable of a bit or word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VariableOfAddress {
    /// The bit or word.
    pub address: Address,
    /// The variable.
    pub variable: String,
}

impl<'p> ExportMemory<'p> {
    pub(super) fn of(program: &'p Program) -> ExportMemory<'p> {
        let mut tags: HashMap<Address, Vec<&Tag>> = HashMap::new();
        for tag in &program.tags {
            if let TagMeaning::Address(address) = tag.meaning {
                tags.entry(address).or_default().push(tag);
            }
        }
        let mut names = IecNames::default();
        LibraryBlock::ALL.iter().for_each(|block| drop(names.take(block.name())));
        let program_name = names.take(&program.name);
        ExportMemory {
            program,
            program_name,
            names,
            by_address: HashMap::new(),
            of_addresses: Vec::new(),
            own: HashMap::new(),
            pending: HashMap::new(),
            blocks: Vec::new(),
            variables: Vec::new(),
            outside: Vec::new(),
            tags,
        }
    }

    /// The variable of an instance of a block of the library.
    pub(super) fn instance(&mut self, wish: &str, block: LibraryBlock) -> String {
        if !self.blocks.contains(&block) {
            self.blocks.push(block);
        }
        self.fresh(wish, block.name())
    }

    /// The bit of a reset that waits for the block of a timer or counter.
    pub(super) fn pending(&mut self, structure: Structure) -> String {
        if let Some(name) = self.pending.get(&structure) {
            return name.clone();
        }
        let owner = self.program.names.name(Address::Structure(structure));
        let name = self.fresh(&format!("{owner}_pending"), "BOOL");
        self.pending.insert(structure, name.clone());
        name
    }

    /// The variable of a bit or word.
    pub(super) fn variable(&mut self, address: Address) -> String {
        if let Some(name) = self.by_address.get(&address) {
            return name.clone();
        }
        let original = self.program.names.name(address);
        let name = self.names.take(&original);
        self.by_address.insert(address, name.clone());
        self.of_addresses.push(VariableOfAddress { address, variable: name.clone() });
        if is_from_outside(address) {
            let source = original.clone();
            self.outside.push(OutsideValue { variable: name.clone(), source });
        }
        let variable = ExportedVariable {
            name: name.clone(),
            type_name: type_name(address).to_owned(),
            usage: VariableRole::Local,
            address: located(address),
            initial: self.initial(address),
            doc: self.doc(address, &original),
        };
        self.variables.push(variable);
        name
    }

    /// A variable of the export itself, near a name.
    pub(super) fn fresh(&mut self, wish: &str, type_name: &str) -> String {
        let name = self.names.take(wish);
        self.variables.push(ExportedVariable {
            name: name.clone(),
            type_name: type_name.to_owned(),
            usage: VariableRole::Local,
            address: None,
            initial: None,
            doc: String::new(),
        });
        name
    }

    /// The one variable of the export for a purpose.
    pub(super) fn shared(&mut self, wish: &'static str, type_name: &str) -> String {
        if let Some(name) = self.own.get(wish) {
            return name.clone();
        }
        let name = self.fresh(wish, type_name);
        self.own.insert(wish, name.clone());
        name
    }

    /// Whether a variable of the export was asked for.
    pub(super) fn has_shared(&self, wish: &str) -> bool {
        self.own.contains_key(wish)
    }

    /// Gives a variable a first value.
    pub(super) fn begin_with(&mut self, name: &str, initial: &str) {
        let found = self.variables.iter_mut().find(|variable| variable.name == name);
        if let Some(variable) = found {
            variable.initial = Some(initial.to_owned());
        }
    }

    /// The first value of a cell, if it is not 0.
    fn initial(&self, address: Address) -> Option<String> {
        let tags = self.tags.get(&address)?;
        let (cell, _) = tags.iter().find_map(|tag| tag.initial)?;
        match address {
            _ if cell == 0 => None,
            Address::Bit(_) => Some("TRUE".to_owned()),
            Address::Word(word) if word.is_real() => {
                Some(CallLiteral::Real(Real::of_cell(cell)).text())
            }
            Address::Word(_) | Address::Structure(_) => Some(cell.to_string()),
        }
    }

    fn doc(&self, address: Address, original: &str) -> String {
        let tags = self.tags.get(&address);
        let docs = tags.into_iter().flatten().filter_map(|tag| tag.doc.clone());
        let renamed = self.by_address.get(&address).filter(|name| *name != original);
        let renamed = renamed.map(|_| format!("`{original}` in the ladder"));
        docs.chain(renamed).collect::<Vec<_>>().join("; ")
    }
}

/// Whether rungd gives a value to the ladder, and no rung and no input does.
fn is_from_outside(address: Address) -> bool {
    match address {
        Address::Bit(bit) => matches!(bit, Bit::Device(..)),
        Address::Word(Word::Space(WordSpace::Dst, number)) => status::dst::is_of_clock(number),
        Address::Word(_) | Address::Structure(_) => false,
    }
}

/// The type of a variable.
fn type_name(address: Address) -> &'static str {
    match address {
        Address::Bit(_) => "BOOL",
        Address::Word(word) if word.is_real() => "REAL",
        Address::Word(_) | Address::Structure(_) => "DINT",
    }
}

/// The address of an input or output.
fn located(address: Address) -> Option<String> {
    let Address::Bit(Bit::Space(space, number)) = address else { return None };
    let area = match space {
        BitSpace::X => 'I',
        BitSpace::Y => 'Q',
        BitSpace::C | BitSpace::Mc | BitSpace::Mi | BitSpace::St => return None,
    };
    Some(format!("%{area}X{}.{}", number / 8, number % 8))
}
