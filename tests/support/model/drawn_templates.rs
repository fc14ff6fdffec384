//! Random templates: rungs of a finished program move into them, and uses take their places.
//!
//! The words that become parameters are plain addresses of the moved rungs, and contacts of their
//! legs. A use is a [`Rung`] whose legs are the parts of the use: `use`, `name`, then an argument
//! for each parameter.

use super::calls::{may_move, rungs_of};
use super::case::{Block, Expr, Rung};
use super::pool::Pool;

/// A template.
#[derive(Clone, Debug)]
pub struct DrawnTemplate {
    pub name: String,
    pub parameters: Vec<DrawnParameter>,
    /// The names of its own bits.
    pub bits: Vec<String>,
    pub rungs: Vec<Rung>,
}

/// A parameter, with its type.
#[derive(Clone, Debug)]
pub struct DrawnParameter {
    pub name: String,
    pub kind: &'static str,
}

/// The instructions of which several may write the same place.
const SHARED: [&str; 11] =
    ["SET", "RST", "MOVE", "ADD", "SUB", "MATH", "COPY", "FILL", "RSTCT", "RSTT", "RES"];

/// The instructions that take no parameter of the type `bit` or `output`.
const PLAIN_BITS: [&str; 5] = ["COPY", "FILL", "PACK", "UNPACK", "SR"];

/// Moves rungs into up to three templates, which are used in their place and perhaps at others.
pub fn add_templates(pool: &mut Pool, blocks: &mut [Block]) -> Vec<DrawnTemplate> {
    let mut templates = Vec::new();
    for number in 0..pool.rng.weighted(&[40, 32, 18, 10]) {
        let mut all = Vec::new();
        for (at, block) in blocks.iter().enumerate() {
            all.push((at, None));
            all.extend((0..block.stages.len()).map(|stage| (at, Some(stage))));
        }
        let from = *pool.rng.pick(&all);
        let rungs = rungs_of(blocks, from);
        let first = pool.rng.below(rungs.len());
        let most = 1 + pool.rng.below(3);
        let fits = |rung: &&Rung| may_move(rung) && rung.legs[0].0 != "use";
        let count = rungs.iter().skip(first).take(most).take_while(fits).count();
        if count == 0 {
            continue;
        }
        let mut moved: Vec<Rung> = rungs.splice(first..first + count, []).collect();
        let mut template = DrawnTemplate {
            name: format!("Step_{number}"),
            parameters: Vec::new(),
            bits: Vec::new(),
            rungs: Vec::new(),
        };
        let arguments = parameters(pool, &mut moved, &mut template.parameters);
        template.rungs = moved;
        own_bit(pool, &mut template);
        rungs.insert(first, use_of(&template, &format!("u{number}"), arguments.clone()));
        // Not in subroutines: a template may call one of them.
        all.retain(|(block, _)| !blocks[*block].subroutine);
        if is_shared(&template) {
            for more in 0..pool.rng.weighted(&[25, 50, 25]) {
                let arguments = others(pool, &template, &arguments);
                let use_of = use_of(&template, &format!("u{number}_{more}"), arguments);
                let at = *pool.rng.pick(&all);
                let rungs = rungs_of(blocks, at);
                rungs.insert(pool.rng.below(rungs.len() + 1), use_of);
            }
        }
        templates.push(template);
    }
    templates
}

fn use_of(template: &DrawnTemplate, name: &str, arguments: Vec<Expr>) -> Rung {
    let part = |key: &str, value: Expr| (key.to_string(), vec![value]);
    let mut legs = vec![
        part("use", Expr::Leaf(template.name.clone())),
        part("name", Expr::Leaf(name.to_string())),
    ];
    let parameters = template.parameters.iter().zip(arguments);
    legs.extend(parameters.map(|(parameter, value)| part(&parameter.name, value)));
    Rung { legs, instrs: Vec::new(), branches: Vec::new() }
}

/// The names of the own bits of a use; none for another rung.
pub fn own_bits(rung: &Rung, templates: &[DrawnTemplate]) -> Vec<String> {
    let [(key, used), (_, name), ..] = rung.legs.as_slice() else { return Vec::new() };
    let (Some(used), Some(name)) = (used.first(), name.first()) else { return Vec::new() };
    let template = templates.iter().find(|one| key == "use" && one.name == used.text());
    let bits = template.map_or(&[][..], |template| &template.bits);
    bits.iter().map(|bit| format!("{}.{bit}", name.text())).collect()
}

/// Whether several uses may stand for its rungs.
fn is_shared(template: &DrawnTemplate) -> bool {
    let mut all = template.rungs.iter().flat_map(texts);
    let own = |text: &str| template.bits.iter().any(|bit| text == format!("OUT {bit}"));
    all.all(|(text, is_contact)| {
        let mnemonic = text.split(' ').next().unwrap_or_default();
        is_contact || SHARED.contains(&mnemonic) || own(&text)
    })
}

/// Arguments for another use.
fn others(pool: &mut Pool, template: &DrawnTemplate, first: &[Expr]) -> Vec<Expr> {
    let drawn =
        template.parameters.iter().zip(first).map(|(parameter, first)| match parameter.kind {
            "bit" => Expr::Leaf(format!("X{}", pool.rng.below(4))),
            "contact" => pool.series().remove(0),
            _ => first.clone(),
        });
    drawn.collect()
}

/// Adds a bit of the template's own, which a rung of it writes and another one may read.
fn own_bit(pool: &mut Pool, template: &mut DrawnTemplate) {
    if !pool.rng.chance(50) {
        return;
    }
    let when = pool.series();
    let instrs = vec!["OUT seen".to_string()];
    let rung = Rung { legs: vec![("when".to_string(), when)], instrs, branches: Vec::new() };
    let reader = pool.rng.below(template.rungs.len());
    let seen = Expr::Leaf("seen".to_string());
    let seen = if pool.rng.chance(50) { seen } else { Expr::Not(Box::new(seen)) };
    template.rungs[reader].legs[0].1.push(seen);
    template.rungs.insert(pool.rng.below(template.rungs.len() + 1), rung);
    template.bits.push("seen".to_string());
}

/// Makes parameters of some words and contacts of rungs. Returns the argument of each.
fn parameters(
    pool: &mut Pool,
    rungs: &mut [Rung],
    parameters: &mut Vec<DrawnParameter>,
) -> Vec<Expr> {
    let mut arguments = Vec::new();
    let all: Vec<(String, bool)> = rungs.iter().flat_map(texts).collect();
    let mut words: Vec<String> = all.iter().flat_map(|(text, _)| addresses(text)).collect();
    words.sort();
    words.dedup();
    pool.rng.shuffle(&mut words);
    words.truncate(pool.rng.below(4));
    for word in words {
        let kind = kind_of(&word);
        if !all.iter().all(|(text, is_contact)| may_be_given(text, &word, *is_contact)) {
            continue;
        }
        let name = format!("p{}", parameters.len());
        rungs.iter_mut().for_each(|rung| in_rung(rung, &word, &name));
        parameters.push(DrawnParameter { name, kind });
        arguments.push(Expr::Leaf(word));
    }
    if pool.rng.chance(40) {
        let at = pool.rng.below(rungs.len());
        let (_, contacts) = &mut rungs[at].legs[0];
        if let Some(contact) = contacts.first_mut() {
            let name = format!("p{}", parameters.len());
            let leaf = Expr::Leaf(name.clone());
            let given = std::mem::replace(contact, leaf);
            // The argument is read where it is given: it names no parameter.
            let is_plain = parameters.iter().all(|one| !has_word(&given.text(), &one.name));
            match is_plain {
                true => {
                    parameters.push(DrawnParameter { name, kind: "contact" });
                    arguments.push(given);
                }
                false => *contact = given,
            }
        }
    }
    arguments
}

/// The texts of a rung, each with whether it is a contact.
fn texts(rung: &Rung) -> Vec<(String, bool)> {
    let legs = rung.legs.iter().flat_map(|(_, contacts)| contacts);
    let branches = rung.branches.iter();
    let contacts = legs.chain(branches.clone().flat_map(|branch| &branch.when));
    let instrs = rung.instrs.iter().chain(branches.flat_map(|branch| &branch.instrs));
    let contacts = contacts.map(|contact| (contact.text(), true));
    contacts.chain(instrs.map(|text| (text.clone(), false))).collect()
}

fn kind_of(word: &str) -> &'static str {
    match word.trim_end_matches(|c: char| c.is_ascii_digit()) {
        "X" => "bit",
        "Y" | "C" | "MC" => "output",
        "D" | "V" | "MHR" => "int-out",
        "R" => "real-out",
        "T" => "timer",
        _ => "counter",
    }
}

fn is_letter(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '$'
}

/// The plain addresses in a text.
fn addresses(text: &str) -> Vec<String> {
    let words = text.split(|c| !is_letter(c));
    let is_address = |word: &&str| {
        let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
        let known = ["X", "Y", "C", "MC", "D", "V", "MHR", "R", "T", "CT"];
        letters.len() < word.len() && known.contains(&letters)
    };
    words.filter(is_address).map(str::to_string).collect()
}

/// The places of a word in a text.
fn places(text: &str, word: &str) -> Vec<usize> {
    let ends = |at: usize| !text[at + word.len()..].starts_with(is_letter);
    let begins = |at: usize| !text[..at].ends_with(is_letter);
    let found = text.match_indices(word).map(|(at, _)| at);
    found.filter(|at| begins(*at) && ends(*at)).collect()
}

fn has_word(text: &str, word: &str) -> bool {
    !places(text, word).is_empty()
}

/// Whether a parameter may stand for the word in a text: not in a range, in brackets, before an
/// index or the number of a bit.
fn may_be_given(text: &str, word: &str, is_contact: bool) -> bool {
    let kind = kind_of(word);
    let mnemonic = text.split(' ').next().unwrap_or_default();
    let is_structure = matches!(kind, "timer" | "counter");
    places(text, word).into_iter().all(|at| {
        let (before, behind) = (&text[..at], &text[at + word.len()..]);
        let is_within = before.matches('[').count() > before.matches(']').count();
        let is_part = before.ends_with('.') || behind.starts_with('[') || is_within;
        let is_member = behind.starts_with('.');
        let is_range = behind.starts_with("..");
        let takes_bit = is_contact
            || match kind {
                "bit" => mnemonic == "MATH",
                "output" => !PLAIN_BITS.contains(&mnemonic),
                _ => true,
            };
        !is_part && !is_range && (!is_member || is_structure) && takes_bit
    })
}

/// A rung with a word replaced.
fn in_rung(rung: &mut Rung, word: &str, by: &str) {
    let swap = |text: &mut String| {
        for at in places(text, word).into_iter().rev() {
            text.replace_range(at..at + word.len(), by);
        }
    };
    let legs = rung.legs.iter_mut().flat_map(|(_, contacts)| contacts);
    legs.for_each(|contact| in_contact(contact, &swap));
    rung.instrs.iter_mut().for_each(swap);
    for branch in &mut rung.branches {
        branch.when.iter_mut().for_each(|contact| in_contact(contact, &swap));
        branch.instrs.iter_mut().for_each(swap);
    }
}

fn in_contact(contact: &mut Expr, swap: &dyn Fn(&mut String)) {
    match contact {
        Expr::Leaf(text) | Expr::Compare(text) => swap(text),
        Expr::Not(inner) | Expr::Edge(_, inner) | Expr::Group(inner) => in_contact(inner, swap),
        Expr::All(items) | Expr::Any(items) => {
            items.iter_mut().for_each(|item| in_contact(item, swap));
        }
    }
}
