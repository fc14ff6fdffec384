//! Parses an address: `X0`, `D12`, `CT3.Acc`, `N19.ACC`, `N,19,6`, `$FirstScan`.
//!
//! Called by the resolver, for every name that is not a tag. Numbers are decimal; the four Modbus
//! spaces begin at 1. [`AddressError`] distinguishes a text without the form of an address (it may
//! be a tag) from an address with a mistake.

use super::address::{Address, Bit, Structure, Word};
use super::space::{BitSpace, MemorySizes, Space, WordSpace};
use super::status;

/// Why a text is not an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AddressError {
    /// It does not have the form of an address (it may be a tag).
    NotAnAddress,
    /// It is an address in the wrong case; this is the correct spelling.
    Case(String),
    /// Its number has leading zeros; this is the spelling without them.
    LeadingZero(String),
    /// Its number is outside `first..=last` of its space.
    BeyondMemory {
        /// The space's name, as `X` or `CT`.
        space: &'static str,
        /// The first number.
        first: u32,
        /// The last number.
        last: u32,
    },
    /// The structure has no member of this name; these are its members.
    UnknownMember(&'static [&'static str]),
    /// `$…`, but not a status nickname.
    UnknownNickname,
    /// The element number of `N,n,e` is outside 0..6.
    SensaphoneElement,
    /// What is before the number of a bit has no bits.
    NoBits(Address),
    /// The number of a bit is not one of the word's.
    UnknownBit(Word),
}

/// Splits a name that ends with the number of a bit: `D0.3` into `D0` and `3`.
pub fn split_bit(name: &str) -> Option<(&str, &str)> {
    // From its end: hardly any name that is looked up has a number behind a dot.
    let is_digit = |byte: &&u8| byte.is_ascii_digit();
    let count = name.as_bytes().iter().rev().take_while(is_digit).count();
    let (base, digits) = name.split_at(name.len() - count);
    let base = base.strip_suffix('.').filter(|_| count > 0)?;
    (!base.is_empty() && !base.ends_with('.')).then_some((base, digits))
}

/// The bit of an address that has these digits as its number.
///
/// # Errors
/// [`AddressError::NoBits`], [`AddressError::UnknownBit`].
pub fn bit_of(address: Address, digits: &str) -> Result<Bit, AddressError> {
    let Address::Word(word) = address else { return Err(AddressError::NoBits(address)) };
    if word.is_real() {
        return Err(AddressError::NoBits(address));
    }
    let is_plain = digits == "0" || !digits.starts_with('0');
    let number = digits.parse().ok().filter(|_| is_plain);
    number.and_then(|number| word.bit(number)).ok_or(AddressError::UnknownBit(word))
}

/// Parses an address: plain, member, Sensaphone element, status nickname or bit of a word.
///
/// # Errors
/// [`AddressError::NotAnAddress`] if the text does not have the form of an address (it may be a
/// tag); the other kinds if it has the form and a mistake.
pub fn parse(text: &str, sizes: &MemorySizes) -> Result<Address, AddressError> {
    if let Some((base, digits)) = split_bit(text) {
        return match parse(base, sizes) {
            // `N,0,6` is an element already.
            Ok(address) if base.contains(',') => Err(AddressError::NoBits(address)),
            Ok(address) => bit_of(address, digits).map(Address::Bit),
            Err(AddressError::Case(right)) => Err(AddressError::Case(format!("{right}.{digits}"))),
            Err(AddressError::LeadingZero(right)) => {
                Err(AddressError::LeadingZero(format!("{right}.{digits}")))
            }
            Err(error) => Err(error),
        };
    }
    if text.starts_with('$') {
        return parse_nickname(text);
    }
    if text.contains(',') {
        return parse_sensaphone(text);
    }
    let (base, member) = match text.split_once('.') {
        Some((base, member)) => (base, Some(member)),
        None => (text, None),
    };
    let (prefix, digits) = split_base(base).ok_or(AddressError::NotAnAddress)?;
    let Some(space) = Space::from_name(prefix) else {
        let upper = prefix.to_ascii_uppercase();
        if Space::from_name(&upper).is_none() {
            return Err(AddressError::NotAnAddress);
        }
        // The suggestion corrects the member's case and the number as well.
        let right = text.replacen(prefix, &upper, 1);
        return Err(match parse(&right, sizes) {
            Err(AddressError::Case(all) | AddressError::LeadingZero(all)) => {
                AddressError::Case(all)
            }
            _ => AddressError::Case(right),
        });
    };
    if digits.len() > 1 && digits.starts_with('0') {
        let number = digits.trim_start_matches('0');
        let number = if number.is_empty() { "0" } else { number };
        return Err(AddressError::LeadingZero(text.replacen(digits, number, 1)));
    }
    let number = digits.parse::<u32>().unwrap_or(u32::MAX);
    in_range(space, number, sizes)?;
    match (space.address(number), member) {
        (base, None) => Ok(base),
        (Address::Structure(structure), Some(member)) => parse_member(structure, member),
        (_, Some(_)) => Err(AddressError::UnknownMember(&[])),
    }
}

/// Whether a name has the form of an address, in upper or lower case. Tags, blocks and stages may
/// not have such a name.
pub fn reads_as_address(name: &str) -> bool {
    split_base(name)
        .is_some_and(|(prefix, _)| Space::from_name(&prefix.to_ascii_uppercase()).is_some())
}

/// Splits `CT12` into `CT` and `12`; `None` unless the text is letters, then digits.
fn split_base(base: &str) -> Option<(&str, &str)> {
    let at = base.find(|c: char| c.is_ascii_digit())?;
    let (prefix, digits) = base.split_at(at);
    let ok = !prefix.is_empty()
        && prefix.bytes().all(|b| b.is_ascii_alphabetic())
        && digits.bytes().all(|b| b.is_ascii_digit());
    ok.then_some((prefix, digits))
}

fn in_range(space: Space, n: u32, sizes: &MemorySizes) -> Result<(), AddressError> {
    let (first, count) = (space.first(), space.count(sizes));
    if n >= first && n - first < count {
        return Ok(());
    }
    let space = space.name();
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
    if let Some(n) = status::BIT_NICKNAMES.iter().position(|name| *name == text) {
        return Ok(Address::Bit(Bit::Space(BitSpace::St, n as u32)));
    }
    if let Some((_, n)) = status::WORD_NICKNAMES.iter().find(|(name, _)| *name == text) {
        return Ok(Address::Word(Word::Space(WordSpace::Dst, *n)));
    }
    match status::nicknames().find(|name| name.eq_ignore_ascii_case(text)) {
        Some(right) => Err(AddressError::Case(right.to_owned())),
        None => Err(AddressError::UnknownNickname),
    }
}

/// Parses `N,19` and `N,19,6`, the Sensaphone manual's names of a counter and its element.
fn parse_sensaphone(text: &str) -> Result<Address, AddressError> {
    let mut parts = text.splitn(4, ',').map(str::trim);
    let (Some(n), Some(counter), element, None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return Err(AddressError::NotAnAddress);
    };
    let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
    if !n.eq_ignore_ascii_case("N") || !digits(counter) || !element.is_none_or(digits) {
        return Err(AddressError::NotAnAddress);
    }
    if n != "N" {
        return Err(AddressError::Case(format!("N{}", &text[n.len()..])));
    }
    let counter = counter.parse::<u32>().unwrap_or(u32::MAX);
    in_range(Space::Sensaphone, counter, &MemorySizes::default())?;
    let structure = Structure::Sensaphone(counter);
    let Some(element) = element else { return Ok(Address::Structure(structure)) };
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
            "DST14",
            "CT255",
            "T0",
            "N63",
            "CT0.Acc",
            "CT0.DnDone",
            "T1.Timing",
            "N0.ACC",
            "N19.PRE",
            "N2.UN",
            "D0.31",
            "MHR1.15",
            "CT0.Acc.4",
            "N0.PRE.15",
        ] {
            check(text, text);
        }
    }

    #[test]
    fn aliases_print_as_the_address_of_the_same_element() {
        check("N,19,6", "N19.ACC");
        check("N, 0, 5", "N0.PRE");
        check("$On", "ST1");
        check("$100ms", "ST5");
        check("$MaxScanTime", "DST3");
        check("$Year", "DST5");
        check("$Second", "DST11");
        check("$DownSeconds", "DST12");
        check("$DayNumber", "DST13");
        check("$SecondOfDay", "DST14");
        check("$Second.0", "DST11.0");
    }

    #[test]
    fn each_wrong_address_gives_its_own_error() {
        check("part_seen", "NotAnAddress");
        check("x0", "Case(\"X0\")");
        check("CT0.done", "Case(\"CT0.Done\")");
        check("ct0.DONE", "Case(\"CT0.Done\")");
        check("ct0.what", "Case(\"CT0.what\")");
        check("Y007", "LeadingZero(\"Y7\")");
        check("CT00.Done", "LeadingZero(\"CT0.Done\")");
        check("y010", "Case(\"Y10\")");
        check("$on", "Case(\"$On\")");
        check("$hour", "Case(\"$Hour\")");
        check("$Nope", "UnknownNickname");
        check("DST15", "BeyondMemory { space: \"DST\", first: 0, last: 14 }");
        check("MC0", "BeyondMemory { space: \"MC\", first: 1, last: 1024 }");
        check("X2048", "BeyondMemory { space: \"X\", first: 0, last: 2047 }");
        check("CT99999999999", "BeyondMemory { space: \"CT\", first: 0, last: 255 }");
        check("N,19", "N19");
        check("n,19", "Case(\"N,19\")");
        check("N,64", "BeyondMemory { space: \"N\", first: 0, last: 63 }");
        check("N,", "NotAnAddress");
        check("N,19,7", "SensaphoneElement");
        check("N64.ACC", "BeyondMemory { space: \"N\", first: 0, last: 63 }");
        check("X0.3", "NoBits(Bit(Space(X, 0)))");
        check("N0.3", "NoBits(Structure(Sensaphone(0)))");
        check("R0.0", "NoBits(Word(Space(R, 0)))");
        check("D0.32", "UnknownBit(Space(D, 0))");
        check("D0.03", "UnknownBit(Space(D, 0))");
        check("V0.16", "UnknownBit(Space(V, 0))");
        check("N0.ACC.16", "UnknownBit(Acc(Sensaphone(0)))");
        check("d0.3", "Case(\"D0.3\")");
        check("D00.3", "LeadingZero(\"D0.3\")");
        check("D0.3.1", "NoBits(Bit(InWord(WordBit { word: Space(D, 0), number: 3 })))");
        check("CT0.Timing", "UnknownMember([\"Acc\", \"Done\", \"Reset\", \"Zero\", \"DnDone\"])");
        check("X0.Done", "UnknownMember([])");
    }

    #[test]
    fn a_name_reads_as_an_address_in_upper_and_lower_case() {
        assert!(reads_as_address("T1") && reads_as_address("x0") && reads_as_address("mhr7"));
        assert!(!reads_as_address("tank1") && !reads_as_address("T1a") && !reads_as_address("T"));
    }
}
