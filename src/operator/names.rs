//! What an operator's words stand for: tags, addresses and values, by the names of the ladder.
//!
//! Made once from the program; the server keeps it as long as it runs. It decides what may be
//! written and forced (`docs/operator.md`), not who may.

use std::collections::{BTreeMap, HashMap};

use super::protocol::{Given, Held, Name, OPERANDS_MAX, Refusal, RefusalKind, Value};
use crate::engine::Cell;
use crate::isa::{Address, Bit, BitSpace, Health, Word, WordSpace};
use crate::lower::Symbols;
use crate::resolve::program::{Program, TagMeaning};
use crate::resolve::range::{is_range, resolve_range};
use crate::resolve::scope::{Found, Scope, Thing};
use crate::runtime::exchange::Snapshot;
use crate::source::atom::{Atom, AtomKind};
use crate::source::reader::Text;
use crate::source::span::Span;

/// The most names that one question is answered with.
const NAMES_MAX: usize = 1000;

/// All names of a program.
#[derive(Debug)]
pub struct Names {
    scope: Scope,
    symbols: Symbols,
    /// The first tag of each address; of structures, with their members.
    tags: HashMap<Address, String>,
    /// What completion offers, and what it is.
    offered: BTreeMap<String, String>,
}

/// A bit or word, and what it is called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operand {
    /// As it was asked for.
    pub operand: String,
    /// Its tag.
    pub tag: Option<String>,
    /// Its address, or a Stage's or block's name.
    pub address: String,
    /// What it is.
    pub what: Address,
    /// Where it lies.
    pub cell: Cell,
}

impl Names {
    /// The names of a program.
    pub fn new(program: &Program, symbols: &Symbols) -> Names {
        let mut names = Names {
            scope: Scope::of(program),
            symbols: symbols.clone(),
            tags: HashMap::new(),
            offered: BTreeMap::new(),
        };
        for tag in &program.tags {
            if let TagMeaning::Address(address) = tag.meaning {
                names.tag(&tag.name, address, tag.doc.as_deref());
            }
        }
        for block in &program.blocks {
            names.offer(format!("{}.Running", block.name), "a block");
            for stage in &block.stages {
                names.offer(format!("{}.{}", block.name, stage.name), "a Stage");
            }
        }
        for device in &program.devices {
            for health in Health::ALL {
                names.offer(format!("{}.{}", device.name, health.name()), "a field device");
            }
        }
        for operand in &program.operands {
            names.offer(operand.name.clone(), "named in the ladder");
        }
        names
    }

    fn tag(&mut self, name: &str, address: Address, doc: Option<&str>) {
        let about = doc.map_or_else(|| address.to_string(), |doc| format!("{address}: {doc}"));
        self.offer(name.to_owned(), &about);
        self.tags.entry(address).or_insert_with(|| name.to_owned());
        let Address::Structure(structure) = address else { return };
        for (member, at) in structure.members().iter().zip(structure.member_addresses()) {
            let name = format!("{name}.{member}");
            self.offer(name.clone(), &at.to_string());
            self.tags.entry(at).or_insert(name);
        }
    }

    fn offer(&mut self, name: String, about: &str) {
        self.offered
            .entry(name)
            .or_insert_with(|| about.split_whitespace().collect::<Vec<_>>().join(" "));
    }

    /// What a text names; all of a range, a structure's every member.
    ///
    /// # Errors
    /// It names nothing, or more than one request reads.
    pub fn find(&self, text: &str) -> Result<Vec<Operand>, Refusal> {
        let text = text.trim();
        if !is_range(text) {
            return self.members(text, self.look_up(text)?);
        }
        let written = Text { text: text.to_owned(), span: Span::default(), exact: false };
        let range = resolve_range(&self.scope, &written).map_err(|finding| {
            Refusal::new(
                RefusalKind::BadOperand,
                words(&finding.message, finding.help_text().as_deref()),
            )
        })?;
        let mut found = Vec::new();
        for what in range.addresses() {
            found.extend(self.members(&self.address(what), what)?);
            if found.len() > OPERANDS_MAX {
                let message = format!(
                    "`{text}` has more than {OPERANDS_MAX} operands, and one request reads at most \
                     {OPERANDS_MAX}"
                );
                return Err(Refusal::new(RefusalKind::BadRequest, message));
            }
        }
        Ok(found)
    }

    fn members(&self, text: &str, what: Address) -> Result<Vec<Operand>, Refusal> {
        let Address::Structure(structure) = what else {
            return Ok(vec![self.operand(text, what)?]);
        };
        let members = structure.members().iter().zip(structure.member_addresses());
        members.map(|(member, what)| self.operand(&format!("{text}.{member}"), what)).collect()
    }

    /// The one bit or word that a text names.
    ///
    /// # Errors
    /// It names nothing, or a structure.
    pub fn find_one(&self, text: &str) -> Result<Operand, Refusal> {
        let text = text.trim();
        if is_range(text) {
            let message = format!("`{text}` is a range: name one of it");
            return Err(Refusal::new(RefusalKind::BadOperand, message));
        }
        self.operand(text, self.look_up(text)?)
    }

    fn look_up(&self, text: &str) -> Result<Address, Refusal> {
        let message = match self.scope.look_up(text) {
            Ok(Found { thing: Thing::Address(address), .. }) => return Ok(address),
            Ok(Found { thing: Thing::Constant(value, _), .. }) => {
                format!("`{text}` is a constant, {value}: no memory holds it")
            }
            Ok(Found { thing: Thing::Block(_), .. }) => {
                format!("`{text}` is a block: `{text}.Running` is its bit")
            }
            Ok(Found { thing: Thing::Device(_), .. }) => {
                format!("`{text}` is a device: `{text}.Ok` and `{text}.Stale` are its bits")
            }
            Err(mistake) => mistake.sentence(text),
        };
        Err(Refusal::new(RefusalKind::BadOperand, message))
    }

    fn operand(&self, text: &str, what: Address) -> Result<Operand, Refusal> {
        let Some(cell) = self.symbols.layout.cell(what) else {
            let message = format!("`{text}` is a structure: name a member, as `{text}.Acc`");
            return Err(Refusal::new(RefusalKind::BadOperand, message));
        };
        let tag = self.tags.get(&what).cloned();
        Ok(Operand { operand: text.to_owned(), tag, address: self.address(what), what, cell })
    }

    fn address(&self, what: Address) -> String {
        match what {
            Address::Bit(Bit::Stage(id)) => self.symbols.stage(id).to_owned(),
            Address::Bit(Bit::Running(id)) => format!("{}.Running", self.symbols.block(id)),
            Address::Bit(Bit::Done(id)) => format!("{}.Done", self.symbols.block(id)),
            Address::Bit(Bit::Device(id, health)) => {
                format!("{}.{}", self.symbols.device(id), health.name())
            }
            other => other.to_string(),
        }
    }

    /// The names that begin so; without a prefix, and behind a dot, all that fit.
    pub fn beginning(&self, prefix: &str) -> Vec<Name> {
        let members = prefix.contains('.');
        let from = self.offered.range(prefix.to_owned()..);
        let fits = from.take_while(|(name, _)| name.starts_with(prefix));
        let wanted = fits.filter(|(name, _)| members || !name.contains('.'));
        let named = wanted.map(|(name, about)| Name { name: name.clone(), about: about.clone() });
        let mut names: Vec<Name> = named.take(NAMES_MAX).collect();
        if names.is_empty() && !members {
            // A structure's or a block's name is whole: what is behind its dot.
            names = self.beginning(&format!("{prefix}."));
        }
        names
    }

    /// Whether an operand may be written, and if not why.
    ///
    /// # Errors
    /// It is read-only.
    pub fn may_write(&self, operand: &Operand) -> Result<(), Refusal> {
        let writable = match operand.what {
            Address::Bit(Bit::Space(BitSpace::X, _)) => true,
            Address::Bit(bit) => bit.writable_from_outside(),
            Address::Word(word) => word.writable(),
            Address::Structure(_) => false,
        };
        if writable { Ok(()) } else { Err(read_only(operand, "written")) }
    }

    /// Whether an operand may be forced, and if not why. Flags of structures may, too.
    ///
    /// # Errors
    /// It says how the controller or a block is.
    pub fn may_force(&self, operand: &Operand) -> Result<(), Refusal> {
        let forcible = match operand.what {
            Address::Bit(Bit::Space(space, _)) => space != BitSpace::St,
            Address::Bit(Bit::Flag(..) | Bit::Device(..)) => true,
            Address::Bit(_) | Address::Structure(_) => false,
            Address::Word(word) => word.writable(),
        };
        if forcible { Ok(()) } else { Err(read_only(operand, "forced")) }
    }

    /// A value for an operand: a bit is 0 or 1, a word lies within the limits of its tags.
    ///
    /// # Errors
    /// It does not fit.
    pub fn value(&self, operand: &Operand, given: &Given) -> Result<i32, Refusal> {
        match operand.what {
            Address::Bit(_) => bit_value(given).ok_or_else(|| {
                let message = format!("`{}` is a bit: it takes ON or OFF", operand.operand);
                Refusal::new(RefusalKind::BadValue, message)
            }),
            Address::Word(word) => self.word_value(operand, word, given),
            Address::Structure(_) => Err(read_only(operand, "written")),
        }
    }

    fn word_value(&self, operand: &Operand, word: Word, given: &Given) -> Result<i32, Refusal> {
        let bad = |message: String| Refusal::new(RefusalKind::BadValue, message);
        let number = match given {
            Given::Bit(_) => None,
            Given::Number(number) => Some(*number),
            Given::Text(text) => match Atom::parse(text.trim(), Span::default()).map(|a| a.kind) {
                Ok(AtomKind::Integer(n) | AtomKind::Duration(n)) => Some(i64::from(n)),
                Ok(AtomKind::Name(_)) => None,
                Err(finding) => return Err(bad(finding.message)),
            },
        };
        let Some(number) = number else {
            let message = "takes a number, as 12, 0x1F or 1m30s";
            return Err(bad(format!("`{}` is a word: it {message}", operand.operand)));
        };
        let (min, max) = self.symbols.limits(word);
        let fits = i32::try_from(number).ok().filter(|n| (min..=max).contains(n));
        fits.ok_or_else(|| bad(format!("`{}` takes {min} to {max}, not {number}", operand.operand)))
    }
}

/// What is wrong, and what helps. What helps an author who can declare a tag does not help here.
fn words(message: &str, help: Option<&str>) -> String {
    let help = help.filter(|help| !help.starts_with("declare"));
    help.map_or_else(|| message.to_owned(), |help| format!("{message} ({help})"))
}

fn bit_value(given: &Given) -> Option<i32> {
    match given {
        Given::Bit(on) => Some(i32::from(*on)),
        Given::Number(n @ (0 | 1)) => Some(*n as i32),
        Given::Number(_) => None,
        Given::Text(text) => match text.trim().to_ascii_lowercase().as_str() {
            "on" | "true" | "1" => Some(1),
            "off" | "false" | "0" => Some(0),
            _ => None,
        },
    }
}

fn read_only(operand: &Operand, done: &str) -> Refusal {
    let name = &operand.operand;
    let why = match operand.what {
        Address::Bit(Bit::Space(BitSpace::St, _))
        | Address::Word(Word::Space(WordSpace::Dst, _)) => "it says how the controller is",
        Address::Bit(Bit::Stage(_)) => "a Stage is switched by the ladder",
        Address::Bit(Bit::Running(_) | Bit::Done(_)) => {
            "a block is started and stopped by the ladder"
        }
        Address::Bit(Bit::Device(..)) => "it says how the device is; it can be forced",
        Address::Bit(Bit::Flag(..)) => {
            "its instruction writes it at every execution; it can be forced"
        }
        _ => "name a member of it",
    };
    Refusal::new(RefusalKind::BadOperand, format!("`{name}` cannot be {done}: {why}"))
}

impl Operand {
    /// What it holds in an image.
    pub fn held(&self, value: i32) -> Held {
        match self.cell {
            Cell::Bit(_) => Held::Bit(value != 0),
            Cell::Word(_) => Held::Word(value),
        }
    }

    /// As an image shows it.
    pub fn seen(&self, image: &Snapshot) -> Value {
        Value {
            operand: self.operand.clone(),
            tag: self.tag.clone(),
            address: self.address.clone(),
            value: self.held(image.value(self.cell)),
            forced: image.forces.has(self.cell),
        }
    }

    /// The number of an X.
    pub fn input(&self) -> Option<u32> {
        match self.what {
            Address::Bit(Bit::Space(BitSpace::X, n)) => Some(n),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lower::lower;
    use crate::resolve::{LoadOptions, load_ladders};
    use crate::source::span::SourceFile;

    const LADDER: &str = r#"
[tags]
eye = { at = "X0", doc = "Photo eye" }
parts = { at = "CT0" }
size = { at = "D1", min = 1, max = 500 }
five = { value = 5 }
[[program]]
name = "Main"
rung = [ { leg.up = ["eye"], leg.rst = ["X1"], do = ["CNT parts preset=size"] } ]
[[program]]
name = "Side"
autostart = true
[[program.stage]]
name = "Open"
rung = [ { when = ["$On"], do = ["OUT Y0"] } ]
"#;

    fn names() -> Names {
        let file = SourceFile { name: "ladder.toml".into(), text: LADDER.into() };
        let (program, findings) = load_ladders(&[file], &LoadOptions::default());
        let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
        Names::new(&program, &lower(&program).1)
    }

    #[test]
    fn by_tag_and_by_address_it_is_the_same() {
        let names = names();
        let by_tag = names.find_one("parts.Acc").unwrap();
        let by_address = names.find_one("CT0.Acc").unwrap();
        assert_eq!((&by_tag.cell, &by_tag.address), (&by_address.cell, &by_address.address));
        assert_eq!(by_address.tag.as_deref(), Some("parts.Acc"));
        let members: Vec<_> =
            names.find("parts").unwrap().into_iter().map(|member| member.operand).collect();
        let all = ["parts.Acc", "parts.Done", "parts.Reset", "parts.Zero", "parts.DnDone"];
        assert_eq!(members, all);
        assert_eq!(names.find_one("Side.Open").unwrap().address, "Side.Open");
        for (wrong, words) in [
            ("parts", "name a member"),
            ("prats.Acc", "did you mean"),
            ("nothing_like_it", "nothing is called"),
            ("five", "constant, 5"),
            ("Main", "Main.Running"),
            ("X99999", "beyond memory"),
            ("", "nothing is called"),
        ] {
            let message = names.find_one(wrong).unwrap_err().message;
            assert!(message.contains(words) && !message.contains("declare"), "{wrong}: {message}");
        }
    }

    #[test]
    fn what_may_be_written_and_forced() {
        let names = names();
        for (name, write, force) in [
            ("eye", true, true),
            ("Y0", true, true),
            ("C5", true, true),
            ("MC1", true, true),
            ("MI1", true, true),
            ("size", true, true),
            ("MIR1", true, true),
            ("parts.Acc", true, true),
            ("N0.PRE", true, true),
            ("parts.Done", false, true),
            ("$FirstScan", false, false),
            ("DST0", false, false),
            ("Side.Open", false, false),
            ("Side.Running", false, false),
        ] {
            let operand = names.find_one(name).unwrap();
            let may = (names.may_write(&operand).is_ok(), names.may_force(&operand).is_ok());
            assert_eq!(may, (write, force), "{name}");
        }
    }

    #[test]
    fn values_as_people_write_them() {
        let names = names();
        let value = |name: &str, given: &str| {
            let operand = names.find_one(name).unwrap();
            names.value(&operand, &Given::Text(given.into())).map_err(|refusal| refusal.message)
        };
        assert_eq!(
            [value("Y0", "ON"), value("Y0", "off"), value("Y0", "1")],
            [Ok(1), Ok(0), Ok(1)]
        );
        assert_eq!([value("size", "12"), value("size", "0x1F")], [Ok(12), Ok(31)]);
        assert_eq!([value("T0.Acc", "1m30s"), value("D5", "-7")], [Ok(90_000), Ok(-7)]);
        for (name, given, words) in [
            ("Y0", "2", "takes ON or OFF"),
            ("size", "0", "takes 1 to 500, not 0"),
            ("V0", "65536", "takes 0 to 65535"),
            ("D5", "99999999999", "outside"),
            ("D5", "ON", "takes a number"),
            ("D5", "12x", "`12x`"),
        ] {
            let message = value(name, given).unwrap_err();
            assert!(message.contains(words), "{message}");
        }
        let size = names.find_one("size").unwrap();
        assert!(names.value(&size, &Given::Number(i64::MAX)).is_err());
        assert!(names.value(&size, &Given::Bit(true)).is_err());
    }

    #[test]
    fn completion_goes_up_to_the_dot_and_then_behind_it() {
        let names = names();
        let offered = |prefix: &str| {
            let names = names.beginning(prefix).into_iter();
            names.map(|name| name.name).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(offered("p"), "parts");
        assert_eq!(offered("parts."), "parts.Acc parts.DnDone parts.Done parts.Reset parts.Zero");
        assert_eq!(offered("Side"), "Side.Open Side.Running");
        assert_eq!(offered("nothing"), "");
        assert_eq!(names.beginning("eye")[0].about, "X0: Photo eye");
    }
}
