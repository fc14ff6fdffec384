//! Looks up names with an index or a slice: `recipe[3]`, `recipe[step]`, `recipe[0..6]`.
//!
//! Part of the scope. A constant index gives a plain address. A word as index gives an element
//! whose number is read at run time.

use super::array::{Array, ArrayElement};
use super::mistake::{Mistake, bit_of_block, bits_of_device, mistake};
use super::program::TagMeaning;
use super::scope::{LookUp, NamedThing, Scope};
use crate::source::finding::Code;
use crate::source::fix::{Help, advise, possible, propose, proposed, write};
use rungd_engine::isa::{Address, Space, address_text};

/// An index: a constant, or the name of a word.
enum ArrayIndex<'n> {
    Constant(u32, Option<&'n str>),
    Word(&'n str),
}

/// An array of which a slice is named.
struct SlicedArray<'n> {
    /// Its name.
    base: &'n str,
    /// The index of the tag of its element 0.
    first: usize,
    array: Array,
}

impl Scope {
    /// Looks up a name that has a `[`.
    pub(super) fn indexed(&self, name: &str) -> Result<LookUp, Mistake> {
        // A template's argument may be a slice, and then a name in the template is
        // `recipe[2..4][0]`.
        let of_slice = name.rsplit_once("][").map(|(slice, _)| (slice.len() + 1, slice.len() + 2));
        let (end, begin) = match (of_slice, name.find('[')) {
            (Some(of_slice), _) => of_slice,
            (None, Some(at)) => (at, at + 1),
            (None, None) => (name.len(), name.len()),
        };
        let (base, rest) = (name[..end].trim_end(), &name[begin..]);
        let (first, array) = self.array(base)?;
        let Some(index) = rest.trim_end().strip_suffix(']') else {
            let message = format!("`{name}` does not end with its index");
            let help = format!("one element is `{base}[0]`; elements have no members");
            return Err(mistake(Code::UnknownName, message, help));
        };
        if let Some((low, high)) = index.split_once("..") {
            let array = SlicedArray { base, first, array };
            return self.slice(array, low.trim(), high.trim());
        }
        Ok(match self.index(base, array, index.trim())? {
            ArrayIndex::Constant(at, named) => LookUp {
                thing: NamedThing::Address(array.element(at)),
                tag: Some(first + at as usize),
                index: named.map(str::to_owned),
            },
            ArrayIndex::Word(word) => LookUp {
                thing: NamedThing::Element(self.selected(array, word)?),
                tag: Some(first),
                index: Some(word.to_owned()),
            },
        })
    }

    /// The array with this name, and the index of the tag of its element 0.
    fn array(&self, base: &str) -> Result<(usize, Array), Mistake> {
        if let Some((index, meaning)) = self.tag(base) {
            let meaning = meaning.ok_or(Mistake::Reported)?;
            if let TagMeaning::Array(array) = meaning {
                return Ok((index, array));
            }
        }
        // An unknown name has a finding of its own.
        let found = self.look_up(base)?;
        if let LookUp { thing: NamedThing::Array(array), tag: Some(tag), .. } = found {
            return Ok((tag, array));
        }
        let message = format!("`{base}` is no array: it has no elements");
        let help = match found.thing {
            NamedThing::Address(Address::Structure(structure)) => {
                let each = structure.members().iter();
                let members = structure.members().join("`, `.");
                Help::from(format!(
                    "name a member of it, `.{members}`, or declare a tag with `count`"
                ))
                .with_all(each.map(|member| possible(format!("{base}.{member}"))))
            }
            NamedThing::Block(_) => bit_of_block(base).and("; an array is a tag with `count`"),
            NamedThing::Device(_) => advise("its bits are `{}` and `{}`", bits_of_device(base))
                .and("; an array is a tag with `count`"),
            NamedThing::Address(Address::Bit(_) | Address::Word(_))
            | NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Array(_)
            | NamedThing::Element(_) => propose(base).and(", or declare a tag with `count`"),
        };
        Err(mistake(Code::OperandType, message, help))
    }

    /// The name of an element without its slice: `recipe[2]` for `recipe[2..4][0]`. `None` if the
    /// name has no slice.
    pub(super) fn element_name(&self, name: &str, element: Address) -> Option<String> {
        let (base, _) = name.split_once('[').filter(|_| name.contains("]["))?;
        let (_, array) = self.array(base).ok()?;
        let (_, number) =
            Space::of(element.without_bit()).filter(|(space, _)| *space == array.space)?;
        let at = number.checked_sub(array.first).filter(|at| *at < array.count)?;
        let bit = address_text::split_bit(name).filter(|(element, _)| element.ends_with(']'));
        let bit = bit.map_or(String::new(), |(_, number)| format!(".{number}"));
        Some(format!("{base}[{at}]{bit}"))
    }

    fn slice(
        &self,
        SlicedArray { base, first, array }: SlicedArray<'_>,
        low: &str,
        high: &str,
    ) -> Result<LookUp, Mistake> {
        let mut ends = [0; 2];
        for (end, text) in ends.iter_mut().zip([low, high]) {
            let last = array.count - 1;
            let beyond = |beyond| match beyond {
                Mistake::New { code: Code::OutOfRange, message, .. } => {
                    let help =
                        advise("the longest is `{}`", [proposed(format!("{base}[0..{last}]"))]);
                    mistake(Code::OutOfRange, message, help)
                }
                other @ (Mistake::New { .. } | Mistake::Reported) => other,
            };
            let ArrayIndex::Constant(at, _) = self.index(base, array, text).map_err(beyond)? else {
                let message = format!("the ends of a slice are constants, not `{text}`");
                let help = propose(format!("{base}[0..{last}]"));
                return Err(mistake(Code::OperandType, message, help));
            };
            *end = at;
        }
        let [from, to] = ends;
        if from > to {
            let message = "a slice goes from low to high".to_owned();
            let help = write(format!("{base}[{high}..{low}]"));
            return Err(mistake(Code::OutOfRange, message, help));
        }
        let thing = NamedThing::Array(array.slice(from, to));
        Ok(LookUp { thing, tag: Some(first + from as usize), index: None })
    }

    fn index<'n>(
        &self,
        base: &str,
        array: Array,
        text: &'n str,
    ) -> Result<ArrayIndex<'n>, Mistake> {
        let last = array.count - 1;
        if text.is_empty() {
            let message = format!("the index of `{base}` is missing");
            let help = Help::from(format!("it has the elements 0 to {last}"));
            let first = possible(format!("{base}[0]"));
            return Err(mistake(Code::OperandType, message, help.with(first)));
        }
        let digits = text.strip_prefix('-').unwrap_or(text);
        let (number, named) = if digits.starts_with(|c: char| c.is_ascii_digit()) {
            (whole(text).ok_or_else(|| no_index(text, Some(base)))?, None)
        } else if text.contains(|c: char| !is_of_name(c)) {
            return Err(no_index(text, Some(base)));
        } else {
            match self.look_up(text)?.thing {
                NamedThing::Constant(value, _) => (i64::from(value), Some(text)),
                NamedThing::Address(Address::Word(word)) if !word.is_real() => {
                    return Ok(ArrayIndex::Word(text));
                }
                NamedThing::Address(_)
                | NamedThing::Element(_)
                | NamedThing::Array(_)
                | NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_) => return Err(no_index(text, Some(base))),
            }
        };
        match u32::try_from(number).ok().filter(|at| *at <= last) {
            Some(at) => Ok(ArrayIndex::Constant(at, named)),
            None => {
                let message = format!("`{base}` has the elements 0 to {last}, not {number}");
                let help = match base.contains('[') {
                    true => format!("the last one is number {last} of the slice").into(),
                    false => advise("the last one is `{}`", [proposed(format!("{base}[{last}]"))]),
                };
                Err(mistake(Code::OutOfRange, message, help))
            }
        }
    }

    fn selected(&self, array: Array, word: &str) -> Result<ArrayElement, Mistake> {
        match self.look_up(word)?.thing {
            NamedThing::Address(Address::Word(index)) => Ok(ArrayElement { array, index }),
            NamedThing::Address(_)
            | NamedThing::Element(_)
            | NamedThing::Array(_)
            | NamedThing::Constant(..)
            | NamedThing::Real(_)
            | NamedThing::Block(_)
            | NamedThing::Device(_) => Err(no_index(word, None)),
        }
    }
}

/// Whether a name may have the character. The names of the trial of a template have a `?`.
fn is_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_.$?".contains(c)
}

fn whole(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

fn no_index(text: &str, base: Option<&str>) -> Mistake {
    let message = format!("`{text}` is no index");
    let help = "an index is a whole number or a word of whole numbers: `{}`, `recipe[step]`; MATH \
                computes one: `MATH step = …`";
    let help = advise(help, [possible("recipe[3]")]);
    let first = base.map(|base| possible(format!("{base}[0]")));
    mistake(Code::OperandType, message, help.with_all(first))
}
