//! The values that a tag has in the file, as `initial` of rungd.

use super::data::Datum;
use super::path::whole;
use super::types::{Kind, LogixStructure};

/// The data of a part of a variable, element by element of all arrays on the way.
pub(super) fn values<'d>(data: Option<&'d Datum>, path: &str) -> Vec<&'d Datum> {
    let mut found: Vec<&Datum> = data.into_iter().collect();
    found = found.into_iter().flat_map(elements).collect();
    for name in path.split('.').filter(|name| !name.is_empty()) {
        let member = |datum: &'d Datum| match datum {
            Datum::Structure { members, .. } => members
                .iter()
                .find(|member| member.name.eq_ignore_ascii_case(name))
                .map_or(Vec::new(), |member| elements(&member.datum)),
            Datum::Value { .. } | Datum::Array { .. } => Vec::new(),
        };
        found = found.into_iter().flat_map(member).collect();
    }
    found
}

fn elements(datum: &Datum) -> Vec<&Datum> {
    match datum {
        Datum::Array { elements, .. } => elements.iter().collect(),
        Datum::Value { .. } | Datum::Structure { .. } => vec![datum],
    }
}

/// The text of `initial`; `None` where everything is 0.
pub(super) fn text(
    values: &[&Datum],
    kind: &Kind,
    structure: Option<&LogixStructure>,
    count: Option<u32>,
) -> Option<String> {
    let one = |datum: &&Datum| match structure {
        Some(structure) => table(datum, structure),
        None => plain(datum, kind),
    };
    let mut texts: Vec<Option<String>> = values.iter().map(one).collect();
    let Some(count) = count else { return texts.into_iter().next().flatten() };
    if texts.iter().all(Option::is_none) {
        return None;
    }
    texts.truncate(count as usize);
    if structure.is_some() {
        while texts.last().is_some_and(Option::is_none) {
            texts.pop();
        }
    } else {
        texts.resize(count as usize, None);
    }
    let zero = match (structure, kind) {
        (Some(_), _) => "{}",
        (None, Kind::Real) => "0.0",
        (None, _) => "0",
    };
    let texts = texts.into_iter().map(|text| text.unwrap_or_else(|| zero.to_owned()));
    Some(format!("[{}]", texts.collect::<Vec<_>>().join(", ")))
}

fn table(datum: &Datum, structure: &LogixStructure) -> Option<String> {
    let Datum::Structure { members, .. } = datum else { return None };
    let mut pairs = Vec::new();
    for member in structure.members.iter().filter(|member| member.is_field()) {
        let value = members.iter().find(|named| named.name.eq_ignore_ascii_case(&member.name));
        if let Some(text) = value.and_then(|value| plain(&value.datum, &member.kind)) {
            pairs.push(format!("{} = {text}", member.field));
        }
    }
    (!pairs.is_empty()).then(|| format!("{{ {} }}", pairs.join(", ")))
}

/// The text of a value that is not 0.
fn plain(datum: &Datum, kind: &Kind) -> Option<String> {
    let Datum::Value { text, .. } = datum else { return None };
    if *kind == Kind::Real {
        let value: f32 = text.trim().parse().ok()?;
        return (value != 0.0 && value.is_finite()).then(|| format!("{value:?}"));
    }
    let value = whole(text).or_else(|| character(text))?;
    let value = kind.bits().map_or(value, |bits| wrapped(value, bits, kind));
    (value != 0).then(|| value.to_string())
}

/// A value of the radix ASCII: `'$00$41'`, the first character highest.
fn character(text: &str) -> Option<i64> {
    let inner = text.trim().strip_prefix('\'')?.strip_suffix('\'')?;
    let mut value: i64 = 0;
    let mut letters = inner.chars();
    while let Some(letter) = letters.next() {
        let code = match letter {
            '$' => {
                let pair: String = letters.by_ref().take(2).collect();
                i64::from_str_radix(&pair, 16).ok()?
            }
            letter => i64::from(u32::from(letter)),
        };
        value = value.wrapping_mul(256).wrapping_add(code);
    }
    Some(i64::from(value as i32))
}

/// A pattern with a radix as a number of its type.
fn wrapped(value: i64, bits: u32, kind: &Kind) -> i64 {
    let shift = 64 - bits;
    match kind {
        Kind::Usint | Kind::Uint => ((value as u64) << shift >> shift) as i64,
        Kind::Bool
        | Kind::Sint
        | Kind::Int
        | Kind::Dint
        | Kind::Real
        | Kind::Struct(_)
        | Kind::Foreign(_) => value << shift >> shift,
    }
}
