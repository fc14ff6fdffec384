//! The mistakes in a name, each with a help, for a finding or an answer.
//!
//! Made by [`super::scope`] when a look-up fails. Looks nothing up itself.

use crate::source::finding::{Code, Finding};
use crate::source::fix::{
    Fix, FixEdit, Help, advise, certain, meant, one_of, possible, propose, proposed, write,
};
use crate::source::nearest::{KnownNames, UnknownName, did_you_mean, nearest};
use crate::source::span::Span;
use rungd_engine::isa::address_text::{self, AddressError};
use rungd_engine::isa::{Address, DeviceBit, Structure, Word};

/// The reason why a name has no meaning.
#[derive(Debug)]
pub enum Mistake {
    /// Its tag has a mistake, which is already reported.
    Reported,
    /// A mistake that is not yet reported.
    New {
        /// The code of the finding.
        code: Code,
        /// The mistake.
        message: String,
        /// What to write instead.
        help: Option<Help>,
        /// The known names; if one is near, it replaces the help.
        near: Option<Box<UnknownName>>,
    },
}

impl Mistake {
    /// The finding at a place; `None` if it is already reported.
    pub fn finding(self, span: Span) -> Option<Finding> {
        let Mistake::New { code, message, help, near } = self else { return None };
        let finding = Finding::new(code, span, message).near_any(near);
        Some(match help {
            Some(help) => finding.help(help),
            None => finding,
        })
    }
}

/// The help for a name in the notation of a different controller.
pub(super) fn habit(name: &str) -> Option<Help> {
    Some(write(match name.to_ascii_uppercase().as_str() {
        "AND" => "&",
        "OR" => "|",
        "NOT" => "!",
        "TRUE" | "ON" | "ALWAYS" => "$On",
        "FALSE" | "OFF" | "NEVER" => "$Off",
        "NAN" | "INF" | "INFINITY" => {
            let numbers = ["1.5", "-2.5e-7"].map(possible);
            return Some(advise("a constant is a finite number: `{}`, `{}`", numbers));
        }
        _ => return None,
    }))
}

/// The help for an unknown name that is not in a file. In a file, the help is to declare the name.
const WHERE_NAMES_ARE: &str = "tags are under [tags] of the ladder, and the shell completes them \
                               after `rungd completions`; an address reads `D0`";

/// A finding as a sentence, for a name that is not in a file.
pub fn sentence(finding: &Finding) -> String {
    let Some(help) = finding.help_text() else { return finding.message.clone() };
    let help = if help.starts_with("declare") { WHERE_NAMES_ARE } else { &*help };
    format!("{} ({help})", finding.message)
}

/// A mistake with a help.
pub(super) fn mistake(code: Code, message: String, help: impl Into<Help>) -> Mistake {
    Mistake::New { code, message, help: Some(help.into()), near: None }
}

/// The mistake in a text that has the form of an address but is not one.
pub(super) fn address_mistake(name: &str, error: AddressError) -> Mistake {
    let base = name.split('.').next().unwrap_or(name);
    match error {
        AddressError::NotAnAddress => {
            let help = "addresses read `X0`, `Y0`, `C0`, `D0`, `V0`, `MC1`, `MHR1`, `CT0`, `T0`";
            mistake(Code::UnknownName, format!("`{name}` is no address"), help)
        }
        AddressError::Case(right) => mistake(
            Code::WrongCase,
            format!("`{name}` is in the wrong case"),
            write(certain(right)),
        ),
        AddressError::LeadingZero(right) => mistake(
            Code::UnknownName,
            format!("`{base}` is no address: a number has no leading zeros"),
            write(right).and("; all numbers are decimal"),
        ),
        AddressError::BeyondMemory { space, first, last } => {
            let message = format!("`{base}` lies beyond memory: {space}{first}..{space}{last}");
            let words = match space {
                "N" | "ST" | "DST" => "",
                _ => "sizes are set under `[memory]` of the controller file",
            };
            let is_below = base[space.len()..].parse::<u32>().is_ok_and(|number| number < first);
            let nearest = if is_below { first } else { last };
            let nearest = format!("{space}{nearest}{}", &name[base.len()..]);
            mistake(Code::BeyondMemory, message, Help::from(words).with(possible(nearest)))
        }
        AddressError::UnknownMember(_) if name.contains("..") => a_range(name),
        AddressError::UnknownMember(&[]) => {
            let message = format!("`{base}` is a single value: it has no members");
            mistake(Code::UnknownMember, message, propose(base))
        }
        AddressError::UnknownMember(members) => unknown_member(name, members),
        AddressError::NoBits(address) => no_bits(name, address),
        AddressError::UnknownBit(word) => unknown_bit(name, word),
        AddressError::UnknownNickname => {
            let all: Vec<&str> = rungd_engine::isa::status::nicknames().collect();
            let help = did_you_mean(name, all.iter().copied());
            let help = help.unwrap_or_else(|| {
                let meant = habit(name.trim_start_matches('$')).unwrap_or_default();
                Help::from(format!("there are {}", all.join(", "))).with_all(meant.fixes)
            });
            mistake(Code::UnknownName, format!("no status is called `{name}`"), help)
        }
        AddressError::SensaphoneElement => {
            let counter = name.split(',').nth(1).unwrap_or("n").trim();
            let message = "a Sensaphone counter has the elements 0 to 6".to_owned();
            let elements =
                [format!("N,{counter},6"), format!("N{counter}.ACC"), format!("N{counter}.PRE")];
            let help = "the current value is `{}` or `{}` (element 7 in the manual's example is a \
                        misprint); the preset is `{}`";
            mistake(Code::UnknownMember, message, advise(help, elements.map(possible)))
        }
    }
}

/// The mistake for a bit of an address that has no bits with numbers.
fn no_bits(name: &str, address: Address) -> Mistake {
    let (base, digits) = address_text::split_bit(name).unwrap_or((name, ""));
    let (what, help) = match address {
        Address::Word(word) if word.is_real() => {
            let help = "a real has no bits with numbers: store it in a D word";
            ("a real".to_owned(), help.into())
        }
        Address::Word(_) => {
            let element = format!("{}.{digits}", address);
            ("an element by its number".to_owned(), write(element))
        }
        Address::Bit(_) => ("a bit".to_owned(), propose(base)),
        Address::Structure(structure) => {
            let what = format!("a {}", structure.kind_name());
            let element = digits.parse().ok().and_then(|at: usize| structure.members().get(at));
            let help = match (structure, element) {
                (Structure::Sensaphone(_), Some(member)) => {
                    let words = format!("its element {digits} is `{{}}`");
                    advise(&words, [possible(format!("{base}.{member}"))])
                }
                (Structure::Sensaphone(_), None) => {
                    advise("its word is `{}`", [possible(format!("{base}.ACC"))])
                }
                (Structure::Counter(_) | Structure::Timer(_), _) => {
                    let of_word = format!("{base}.{}.{digits}", structure.acc_name());
                    advise("a bit of its word is `{}`", [possible(of_word)])
                }
            };
            (what, help)
        }
    };
    let message = format!("`{base}` is {what}: it has no bit `.{digits}`");
    mistake(Code::UnknownMember, message, help)
}

/// The mistake for the number of a bit that the word does not have, or with leading zeros.
fn unknown_bit(name: &str, word: Word) -> Mistake {
    let (base, digits) = address_text::split_bit(name).unwrap_or((name, ""));
    let last = word.bit_count() - 1;
    let plain = digits.trim_start_matches('0');
    let plain = if plain.is_empty() { "0" } else { plain };
    if plain.parse().is_ok_and(|number: u8| number <= last) {
        let message = format!("`.{digits}` is no bit: a number has no leading zeros");
        return mistake(Code::UnknownMember, message, write(format!("{base}.{plain}")));
    }
    let message = format!("`{base}` has the bits 0 to {last}, not {plain}");
    let help = advise("the highest is `{}`", [proposed(format!("{base}.{last}"))]);
    mistake(Code::OutOfRange, message, help)
}

/// The mistake for a range of addresses in the place of one name.
fn a_range(name: &str) -> Mistake {
    let (low, high) = name.split_once("..").unwrap_or((name, ""));
    let letters = low.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = |end: &str| end.strip_prefix(letters)?.parse::<u32>().ok();
    let count = match (number(low), number(high)) {
        (Some(from), Some(to)) if from < to => (to - from).saturating_add(1).to_string(),
        (Some(_) | None, _) => "…".to_owned(),
    };
    let message = format!("`{name}` is a range, and one name belongs here");
    let help = format!("declare an array: a tag with `at = \"{low}\", count = {count}`");
    mistake(Code::UnknownName, message, help)
}

pub(super) fn unknown_member(name: &str, members: &[&str]) -> Mistake {
    let (base, member) = name.split_once('.').unwrap_or((name, ""));
    let list = members.iter().map(|m| format!("`.{m}`")).collect::<Vec<_>>().join(", ");
    let near = nearest(member, members.iter().copied());
    let help = near.map_or(Help::from(""), |near| meant(format!("{base}.{near}")).and(" "));
    let help = help.and(&format!("it has {list}"));
    let all = members.iter().map(|member| possible(format!("{base}.{member}")));
    let help = if near.is_none() { help.with_all(all) } else { help };
    mistake(Code::UnknownMember, format!("`{base}` has no member `.{member}`"), help)
}

pub(super) fn member_mistake(base: &str, structure: Structure, member: &str) -> Mistake {
    let members = structure.members();
    match members.iter().find(|right| right.eq_ignore_ascii_case(member)) {
        Some(right) => address_mistake(
            &format!("{base}.{member}"),
            AddressError::Case(format!("{base}.{right}")),
        ),
        None => unknown_member(&format!("{base}.{member}"), members),
    }
}

/// Maximum number of names in a help.
pub(super) const LISTED_MAX: usize = 12;

/// A help: the names that may follow a block's name and a dot.
pub(super) fn members_of(base: &str, known: &KnownNames) -> Help {
    let first = known.iter().take(LISTED_MAX).map(|name| format!("{base}.{name}"));
    let help = one_of("there is", first);
    match known.iter().len().saturating_sub(LISTED_MAX) {
        0 => help,
        more => help.and(&format!(", and {more} more")),
    }
}

/// The help for a block in the place of a value.
pub(super) fn bit_of_block(name: &str) -> Help {
    advise("its bit is `{}`", [proposed(format!("{name}.Running"))])
}

/// The bits of a device, each of which can be meant.
pub(super) fn bits_of_device(name: &str) -> [Fix; 2] {
    DeviceBit::ALL.map(|bit| possible(format!("{name}.{}", bit.name())))
}

/// The help to declare a tag of one of some types; `others`: all but the first, in words.
pub(super) fn declared(name: &str, types: &[&str], others: &str) -> Help {
    let tag = |kind: &&str| format!("{name} = {{ type = \"{kind}\" }}");
    let first = types.first().map_or(String::new(), tag);
    let help = Help::from(format!("declare it under [tags]: `{first}`{others}"));
    help.with_all(types.iter().map(tag).map(FixEdit::Declare))
}

/// The help to declare a block or a Stage.
pub(super) fn declared_table(header: &str, name: &str) -> Help {
    let line = format!("name = \"{name}\"");
    let words = format!("declare it: a `{header}` with `{line}`");
    Help::from(words).with(FixEdit::Table { header: header.to_owned(), line })
}
