//! Addresses: what every bit, word and structure is called, and how a text becomes one.
//!
//! `X0`, `D12`, `CT3.Acc`, `N19.ACC`, `N,19,6`, `$FirstScan`. Stage bits and the `.Running` and
//! `.Done` bits of blocks are addresses too, but their names belong to a program: the resolver
//! makes those. Numbers are decimal, and the four Modbus spaces begin at 1. Nothing here knows
//! where in memory an address lies: that is the engine's layout.

use std::fmt;

use super::status;

/// A block (Program or Task), numbered in file order over all ladder files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub u32);

/// A Stage, numbered in file order over all Programs of all ladder files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StageId(pub u32);

/// The spaces of plain bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BitSpace {
    /// Inputs.
    X,
    /// Outputs.
    Y,
    /// Internal bits.
    C,
    /// Coils that a Modbus client reads and writes; from 1.
    Mc,
    /// Discrete inputs that a Modbus client reads; from 1.
    Mi,
    /// Status bits, read-only.
    St,
}

/// The spaces of plain words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum WordSpace {
    /// Unsigned 16-bit data.
    V,
    /// Signed 32-bit data.
    D,
    /// Holding registers, u16; from 1.
    Mhr,
    /// Input registers, u16; from 1.
    Mir,
    /// Status words, i32, read-only.
    Dst,
}

/// A structure: a counter `CTn`, a timer `Tn` or a Sensaphone counter `Nn`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Structure {
    /// `CTn`, owned by one CNT, CNTDN, UDC or UDCG.
    Counter(u32),
    /// `Tn`, owned by one timer instruction.
    Timer(u32),
    /// `Nn`, shared by one CTU and one CTD.
    Sensaphone(u32),
}

/// A bit member of a structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Flag {
    Done,
    Reset,
    Zero,
    DnDone,
    Timing,
    Cu,
    Cd,
    Dn,
    Ov,
    Un,
}

/// One bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bit {
    /// A plain bit: space and number as written.
    Space(BitSpace, u32),
    /// A flag of a structure.
    Flag(Structure, Flag),
    /// Whether a Stage is ON.
    Stage(StageId),
    /// `.Running` of a block.
    Running(BlockId),
    /// `.Done` of a Task.
    Done(BlockId),
}

/// One word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Word {
    /// A plain word: space and number as written.
    Space(WordSpace, u32),
    /// `.Acc` (`.ACC`) of a structure.
    Acc(Structure),
    /// `.PRE` of a Sensaphone counter.
    Pre(u32),
}

/// Anything that an address can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum Address {
    Bit(Bit),
    Word(Word),
    Structure(Structure),
}

/// How many elements each space has.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct MemorySizes {
    pub x: u32,
    pub y: u32,
    pub c: u32,
    pub mc: u32,
    pub mi: u32,
    pub v: u32,
    pub d: u32,
    pub mhr: u32,
    pub mir: u32,
    pub ct: u32,
    pub t: u32,
}

impl Default for MemorySizes {
    /// The sizes of `docs/semantics.md`, section 7.
    fn default() -> Self {
        MemorySizes {
            x: 2048,
            y: 2048,
            c: 2048,
            mc: 1024,
            mi: 1024,
            v: 4096,
            d: 4096,
            mhr: 2048,
            mir: 2048,
            ct: 256,
            t: 256,
        }
    }
}

/// How many Sensaphone counters there are: `N0`..`N63`.
pub const SENSAPHONE_COUNT: u32 = 64;

/// Why a text is not an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AddressError {
    /// It does not have the form of an address (it may be a tag).
    NotAnAddress,
    /// It would be one in the case given.
    Case(String),
    /// Its number lies outside `first..=last` of its space.
    BeyondMemory {
        /// The space's name, as `X` or `CT`.
        space: &'static str,
        /// The first number.
        first: u32,
        /// The last number.
        last: u32,
    },
    /// The structure has no such member; it has these.
    UnknownMember(&'static [&'static str]),
    /// `$…` that is no status nickname.
    UnknownNickname,
    /// An element number of `N,n,e` outside 0..6.
    SensaphoneElement,
}

impl BitSpace {
    /// The space's prefix as written.
    pub fn name(self) -> &'static str {
        match self {
            BitSpace::X => "X",
            BitSpace::Y => "Y",
            BitSpace::C => "C",
            BitSpace::Mc => "MC",
            BitSpace::Mi => "MI",
            BitSpace::St => "ST",
        }
    }

    /// The first number: 1 in the Modbus spaces, else 0.
    pub fn first(self) -> u32 {
        u32::from(matches!(self, BitSpace::Mc | BitSpace::Mi))
    }

    /// How many elements the space has.
    pub fn count(self, sizes: &MemorySizes) -> u32 {
        match self {
            BitSpace::X => sizes.x,
            BitSpace::Y => sizes.y,
            BitSpace::C => sizes.c,
            BitSpace::Mc => sizes.mc,
            BitSpace::Mi => sizes.mi,
            BitSpace::St => status::ST_COUNT,
        }
    }
}

impl WordSpace {
    /// The space's prefix as written.
    pub fn name(self) -> &'static str {
        match self {
            WordSpace::V => "V",
            WordSpace::D => "D",
            WordSpace::Mhr => "MHR",
            WordSpace::Mir => "MIR",
            WordSpace::Dst => "DST",
        }
    }

    /// The first number: 1 in the Modbus spaces, else 0.
    pub fn first(self) -> u32 {
        u32::from(matches!(self, WordSpace::Mhr | WordSpace::Mir))
    }

    /// How many elements the space has.
    pub fn count(self, sizes: &MemorySizes) -> u32 {
        match self {
            WordSpace::V => sizes.v,
            WordSpace::D => sizes.d,
            WordSpace::Mhr => sizes.mhr,
            WordSpace::Mir => sizes.mir,
            WordSpace::Dst => status::DST_COUNT,
        }
    }

    /// The values an element can hold.
    pub fn range(self) -> (i32, i32) {
        match self {
            WordSpace::V | WordSpace::Mhr | WordSpace::Mir => (0, 65_535),
            WordSpace::D | WordSpace::Dst => (i32::MIN, i32::MAX),
        }
    }
}

impl Structure {
    /// The prefix as written.
    pub fn space_name(self) -> &'static str {
        match self {
            Structure::Counter(_) => "CT",
            Structure::Timer(_) => "T",
            Structure::Sensaphone(_) => "N",
        }
    }

    /// The number.
    pub fn number(self) -> u32 {
        match self {
            Structure::Counter(n) | Structure::Timer(n) | Structure::Sensaphone(n) => n,
        }
    }

    /// The members' names, in the order of the texts; for `N`, by element number.
    pub fn members(self) -> &'static [&'static str] {
        match self {
            Structure::Counter(_) => &["Acc", "Done", "Reset", "Zero", "DnDone"],
            Structure::Timer(_) => &["Acc", "Done", "Reset", "Zero", "Timing"],
            Structure::Sensaphone(_) => &["CU", "CD", "DN", "OV", "UN", "PRE", "ACC"],
        }
    }

    /// The member of a name in [`Structure::members`].
    pub fn member(self, name: &str) -> Option<Address> {
        let flag = |flag| Some(Address::Bit(Bit::Flag(self, flag)));
        let sensaphone = matches!(self, Structure::Sensaphone(_));
        if !self.members().contains(&name) {
            return None;
        }
        match name {
            "Acc" | "ACC" => Some(Address::Word(Word::Acc(self))),
            "PRE" if sensaphone => Some(Address::Word(Word::Pre(self.number()))),
            _ => flag(Flag::from_name(name)?),
        }
    }

    /// All members, as addresses.
    pub fn member_addresses(self) -> impl Iterator<Item = Address> {
        self.members().iter().filter_map(move |name| self.member(name))
    }
}

impl Flag {
    const NAMES: [(&'static str, Flag); 10] = [
        ("Done", Flag::Done),
        ("Reset", Flag::Reset),
        ("Zero", Flag::Zero),
        ("DnDone", Flag::DnDone),
        ("Timing", Flag::Timing),
        ("CU", Flag::Cu),
        ("CD", Flag::Cd),
        ("DN", Flag::Dn),
        ("OV", Flag::Ov),
        ("UN", Flag::Un),
    ];

    fn from_name(name: &str) -> Option<Flag> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|(_, flag)| *flag)
    }

    /// The flag's name as written behind the dot.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

impl Bit {
    /// Whether a program's instruction may write it: Y, C, MC and MI.
    pub fn writable_by_ladder(self) -> bool {
        matches!(self, Bit::Space(BitSpace::Y | BitSpace::C | BitSpace::Mc | BitSpace::Mi, _))
    }
}

impl Word {
    /// Whether a program's instruction, or a queued write, may write it: all but the status words.
    pub fn writable(self) -> bool {
        !matches!(self, Word::Space(WordSpace::Dst, _))
    }

    /// The values it can hold.
    pub fn range(self) -> (i32, i32) {
        match self {
            Word::Space(space, _) => space.range(),
            Word::Acc(Structure::Sensaphone(_)) | Word::Pre(_) => {
                (i32::from(i16::MIN), i32::from(i16::MAX))
            }
            Word::Acc(_) => (i32::MIN, i32::MAX),
        }
    }
}

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.space_name(), self.number())
    }
}

impl fmt::Display for Bit {
    /// The address as written; Stage and block bits, which have no address, by their number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bit::Space(space, n) => write!(f, "{}{n}", space.name()),
            Bit::Flag(structure, flag) => write!(f, "{structure}.{}", flag.name()),
            Bit::Stage(id) => write!(f, "stage {}", id.0),
            Bit::Running(id) => write!(f, "block {}.Running", id.0),
            Bit::Done(id) => write!(f, "block {}.Done", id.0),
        }
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Word::Space(space, n) => write!(f, "{}{n}", space.name()),
            Word::Acc(s @ Structure::Sensaphone(_)) => write!(f, "{s}.ACC"),
            Word::Acc(structure) => write!(f, "{structure}.Acc"),
            Word::Pre(n) => write!(f, "N{n}.PRE"),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Bit(bit) => bit.fmt(f),
            Address::Word(word) => word.fmt(f),
            Address::Structure(structure) => structure.fmt(f),
        }
    }
}

/// Parses an address: plain, member, Sensaphone element or status nickname.
///
/// # Errors
/// [`AddressError::NotAnAddress`] when the text does not read as one (it may be a tag); the other
/// kinds when it does, and is wrong.
pub fn parse(text: &str, sizes: &MemorySizes) -> Result<Address, AddressError> {
    if text.starts_with('$') {
        return parse_nickname(text);
    }
    if text.contains(',') {
        return parse_sensaphone_element(text);
    }
    let (base, member) = match text.split_once('.') {
        Some((base, member)) => (base, Some(member)),
        None => (text, None),
    };
    let (prefix, digits) = split_base(base).ok_or(AddressError::NotAnAddress)?;
    let upper = prefix.to_ascii_uppercase();
    if !PREFIXES.contains(&upper.as_str()) {
        return Err(AddressError::NotAnAddress);
    }
    if upper != prefix {
        return Err(AddressError::Case(text.replacen(prefix, &upper, 1)));
    }
    let number = digits.parse::<u32>().unwrap_or(u32::MAX);
    let base = parse_base(prefix, number, sizes)?;
    match (base, member) {
        (_, None) => Ok(base),
        (Address::Structure(structure), Some(member)) => parse_member(structure, member),
        (_, Some(_)) => Err(AddressError::UnknownMember(&[])),
    }
}

/// Whether a name would read as an address in any case: such names are forbidden for tags,
/// blocks and stages.
pub fn reads_as_address(name: &str) -> bool {
    split_base(name)
        .is_some_and(|(prefix, _)| PREFIXES.contains(&prefix.to_ascii_uppercase().as_str()))
}

const PREFIXES: [&str; 14] =
    ["X", "Y", "C", "MC", "MI", "ST", "V", "D", "MHR", "MIR", "DST", "CT", "T", "N"];

/// Splits `CT12` into `CT` and `12`: letters, then digits, nothing else.
fn split_base(base: &str) -> Option<(&str, &str)> {
    let at = base.find(|c: char| c.is_ascii_digit())?;
    let (prefix, digits) = base.split_at(at);
    let ok = !prefix.is_empty()
        && prefix.bytes().all(|b| b.is_ascii_alphabetic())
        && digits.bytes().all(|b| b.is_ascii_digit());
    ok.then_some((prefix, digits))
}

fn parse_base(prefix: &str, n: u32, sizes: &MemorySizes) -> Result<Address, AddressError> {
    let bits = [BitSpace::X, BitSpace::Y, BitSpace::C, BitSpace::Mc, BitSpace::Mi, BitSpace::St];
    let words = [WordSpace::V, WordSpace::D, WordSpace::Mhr, WordSpace::Mir, WordSpace::Dst];
    if let Some(space) = bits.into_iter().find(|s| s.name() == prefix) {
        in_range(space.name(), n, space.first(), space.count(sizes))?;
        return Ok(Address::Bit(Bit::Space(space, n)));
    }
    if let Some(space) = words.into_iter().find(|s| s.name() == prefix) {
        in_range(space.name(), n, space.first(), space.count(sizes))?;
        return Ok(Address::Word(Word::Space(space, n)));
    }
    let (structure, count) = match prefix {
        "CT" => (Structure::Counter(n), sizes.ct),
        "T" => (Structure::Timer(n), sizes.t),
        _ => (Structure::Sensaphone(n), SENSAPHONE_COUNT),
    };
    in_range(structure.space_name(), n, 0, count)?;
    Ok(Address::Structure(structure))
}

fn in_range(space: &'static str, n: u32, first: u32, count: u32) -> Result<(), AddressError> {
    if n >= first && n - first < count {
        return Ok(());
    }
    Err(AddressError::BeyondMemory { space, first, last: (first + count).saturating_sub(1) })
}

fn parse_member(structure: Structure, member: &str) -> Result<Address, AddressError> {
    if let Some(address) = structure.member(member) {
        return Ok(address);
    }
    let near = structure.members().iter().find(|m| m.eq_ignore_ascii_case(member));
    match near {
        Some(right) => Err(AddressError::Case(format!("{structure}.{right}"))),
        None => Err(AddressError::UnknownMember(structure.members())),
    }
}

fn parse_nickname(text: &str) -> Result<Address, AddressError> {
    let find = |names: &[&str]| names.iter().position(|n| *n == text).map(|at| at as u32);
    if let Some(n) = find(&status::BIT_NICKNAMES) {
        return Ok(Address::Bit(Bit::Space(BitSpace::St, n)));
    }
    if let Some(n) = find(&status::WORD_NICKNAMES) {
        return Ok(Address::Word(Word::Space(WordSpace::Dst, n)));
    }
    let all = status::BIT_NICKNAMES.iter().chain(&status::WORD_NICKNAMES);
    match all.into_iter().find(|n| n.eq_ignore_ascii_case(text)) {
        Some(right) => Err(AddressError::Case((*right).to_owned())),
        None => Err(AddressError::UnknownNickname),
    }
}

/// `N,19,6`: the Sensaphone manual's way to name an element.
fn parse_sensaphone_element(text: &str) -> Result<Address, AddressError> {
    let mut parts = text.split(',').map(str::trim);
    let (Some(n), Some(counter), Some(element), None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return Err(AddressError::NotAnAddress);
    };
    let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
    if !n.eq_ignore_ascii_case("N") || !digits(counter) || !digits(element) {
        return Err(AddressError::NotAnAddress);
    }
    if n != "N" {
        return Err(AddressError::Case(format!("N,{counter},{element}")));
    }
    let counter = counter.parse::<u32>().unwrap_or(u32::MAX);
    in_range("N", counter, 0, SENSAPHONE_COUNT)?;
    let structure = Structure::Sensaphone(counter);
    let element = element.parse::<usize>().unwrap_or(usize::MAX);
    let name = structure.members().get(element).ok_or(AddressError::SensaphoneElement)?;
    structure.member(name).ok_or(AddressError::SensaphoneElement)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: &str) {
        let found = match parse(text, &MemorySizes::default()) {
            Ok(address) => address.to_string(),
            Err(error) => format!("{error:?}"),
        };
        assert_eq!(found, expected, "{text}");
    }

    #[test]
    fn addresses_print_as_they_are_written() {
        for text in [
            "X0",
            "Y2047",
            "C17",
            "MC1",
            "MI1024",
            "ST9",
            "V4095",
            "D0",
            "MHR1",
            "MIR2048",
            "DST4",
            "CT255",
            "T0",
            "N63",
            "CT0.Acc",
            "CT0.DnDone",
            "T1.Timing",
            "N0.ACC",
            "N19.PRE",
            "N2.UN",
        ] {
            check(text, text);
        }
    }

    #[test]
    fn other_names_of_the_same_element() {
        check("N,19,6", "N19.ACC");
        check("N, 0, 5", "N0.PRE");
        check("$On", "ST1");
        check("$100ms", "ST5");
        check("$MaxScanTime", "DST3");
    }

    #[test]
    fn mistakes_are_told_apart() {
        check("part_seen", "NotAnAddress");
        check("x0", "Case(\"X0\")");
        check("CT0.done", "Case(\"CT0.Done\")");
        check("$on", "Case(\"$On\")");
        check("$Nope", "UnknownNickname");
        check("MC0", "BeyondMemory { space: \"MC\", first: 1, last: 1024 }");
        check("X2048", "BeyondMemory { space: \"X\", first: 0, last: 2047 }");
        check("CT99999999999", "BeyondMemory { space: \"CT\", first: 0, last: 255 }");
        check("N,19,7", "SensaphoneElement");
        check("N64.ACC", "BeyondMemory { space: \"N\", first: 0, last: 63 }");
        check("CT0.Timing", "UnknownMember([\"Acc\", \"Done\", \"Reset\", \"Zero\", \"DnDone\"])");
        check("X0.Done", "UnknownMember([])");
    }

    #[test]
    fn names_that_read_as_addresses_in_any_case() {
        assert!(reads_as_address("T1") && reads_as_address("x0") && reads_as_address("mhr7"));
        assert!(!reads_as_address("tank1") && !reads_as_address("T1a") && !reads_as_address("T"));
    }
}
