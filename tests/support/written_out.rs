//! Random ladders with templates, and the same ladders written out by hand.
//!
//! [`Case::with_templates`] is the text with templates; [`Case::written_out`] is the text without.
//! The expander here replaces words in texts, with parentheses around given contacts, and shares no
//! code with rungd's. An own tag is named `p1.lamp.seen` in the text with templates, and
//! `p1_lamp_seen` in the text without.

use std::collections::HashMap;
use std::fmt::Write as _;

/// A generator: the same seed gives the same numbers (splitmix64).
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn of<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

/// The arguments of a use: parameter and text.
type Arguments = Vec<(String, String)>;

#[derive(Clone)]
enum Entry {
    Rung { name: Option<String>, legs: Vec<(&'static str, Vec<String>)>, body: Vec<String> },
    Use { of: usize, name: String, with: Arguments },
}

#[derive(Clone, Default)]
struct Template {
    /// Name, type and default of each parameter.
    parameters: Vec<(String, &'static str, Option<String>)>,
    tags: Vec<(String, &'static str)>,
    rungs: Vec<Entry>,
    stages: Vec<(String, Vec<Entry>)>,
}

/// A ladder.
#[derive(Clone)]
pub struct Case {
    /// Lines with tags that precede the other tags.
    more_tags: String,
    templates: Vec<Template>,
    main: Vec<Entry>,
    /// Programs that are templates: name, template, arguments.
    bodies: Vec<(String, usize, Arguments)>,
    /// The stimulus.
    pub stimulus: String,
}

/// The names that contacts and instructions at a place can use.
#[derive(Clone, Default)]
struct Names {
    contacts: Vec<String>,
    bits: Vec<String>,
    numbers: Vec<String>,
    outputs: Vec<String>,
    words: Vec<String>,
}

/// The tags of the ladder. Some have names that templates use too.
const TAGS: [(&str, &str); 9] = [
    ("x", "{ at = \"X0\" }"),
    ("seen", "{ at = \"X1\" }"),
    ("y", "{ at = \"X2\" }"),
    ("g0", "{ type = \"bit\", initial = true }"),
    ("g1", "{ type = \"bit\" }"),
    ("late", "{ type = \"bit\" }"),
    ("n", "{ type = \"int\", initial = 3 }"),
    ("m", "{ type = \"int\" }"),
    ("gt", "{ type = \"timer\" }"),
];

fn of_ladder() -> Names {
    let all = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    Names {
        contacts: Vec::new(),
        bits: all(&["x", "seen", "y", "X3", "g0", "g1", "late", "gt.Done", "$FirstScan", "C5"]),
        numbers: all(&["n", "m", "gt.Acc", "4", "30ms", "D5"]),
        outputs: all(&["g0", "g1", "late", "C5", "Y3"]),
        words: all(&["n", "m", "D5"]),
    }
}

fn contact(rng: &mut Rng, names: &Names, depth: u32) -> String {
    let inner = |rng: &mut Rng| contact(rng, names, depth + 1);
    match rng.below(if depth < 3 { 10 } else { 4 }) {
        0 | 1 if !names.contacts.is_empty() => rng.of(&names.contacts).clone(),
        2 => {
            let sign = *rng.of(&["==", "!=", "<", "<=", ">", ">="]);
            format!("({} {sign} {})", rng.of(&names.numbers).clone(), rng.of(&names.numbers))
        }
        4 => format!("!({})", inner(rng)),
        5 => format!("rise({})", inner(rng)),
        6 => format!("fall({})", inner(rng)),
        7 => format!("({} & {})", inner(rng), inner(rng)),
        8 => format!("({} | {})", inner(rng), inner(rng)),
        _ => rng.of(&names.bits).clone(),
    }
}

/// An argument: contacts without parentheses around them.
fn given_contact(rng: &mut Rng, names: &Names) -> String {
    match rng.below(3) {
        0 => format!("{} | {}", contact(rng, names, 1), contact(rng, names, 1)),
        1 => format!("{} & {}", contact(rng, names, 1), contact(rng, names, 1)),
        _ => contact(rng, names, 1),
    }
}

fn instruction(rng: &mut Rng, names: &Names) -> String {
    let output = rng.of(&names.outputs).clone();
    let (word, number) = (rng.of(&names.words).clone(), rng.of(&names.numbers).clone());
    match rng.below(7) {
        0 => format!("SET {output}"),
        1 => format!("RST {output}"),
        2 => format!("PONOFF {output}"),
        3 => format!("MOVE {number} to={word}"),
        4 => format!("ADD {number} 1 to={word}"),
        5 => format!("MATH {word} = ({number} + {} * 2) % 1000", rng.of(&names.bits)),
        _ => format!("SUB {word} {number} to={word}"),
    }
}

fn rung(rng: &mut Rng, names: &Names, at: usize) -> Entry {
    let count = 1 + rng.below(3);
    let when = (0..count).map(|_| contact(rng, names, 0)).collect();
    let count = 1 + rng.below(2);
    let body = (0..count).map(|_| instruction(rng, names)).collect();
    let name = (rng.below(2) == 0).then(|| format!("rung-{at}"));
    Entry::Rung { name, legs: vec![("when", when)], body }
}

fn arguments(rng: &mut Rng, of: &Template, names: &Names) -> Arguments {
    let mut with = Vec::new();
    for (name, kind, default) in &of.parameters {
        if default.is_some() && rng.below(2) == 0 {
            continue;
        }
        let text = match *kind {
            "contact" => given_contact(rng, names),
            "bit" => rng.of(&names.bits).clone(),
            "int" => rng.of(&names.numbers).clone(),
            "output" => rng.of(&names.outputs).clone(),
            _ => rng.of(&names.words).clone(),
        };
        with.push((name.clone(), text));
    }
    with
}

fn template(rng: &mut Rng, at: usize, before: &[Template], stages: bool) -> Template {
    let mut of = Template::default();
    let mut names = of_ladder();
    let hide = |names: &mut Names, own: &str| {
        for all in [&mut names.bits, &mut names.numbers, &mut names.outputs, &mut names.words] {
            all.retain(|name| name.split('.').next() != Some(own));
        }
    };
    let kinds = ["contact", "contact", "bit", "int", "output", "int-out"];
    let all = [("on", 0), ("x", 1), ("y", 2), ("n", 3), ("lamp", 4), ("into", 5)];
    for (name, kind) in all.iter().filter(|_| rng.below(3) > 0).collect::<Vec<_>>() {
        hide(&mut names, name);
        let default = match kinds[*kind] {
            "int" => Some("7".to_owned()),
            "bit" => Some("$Off".to_owned()),
            _ => None,
        };
        let own = (*name).to_owned();
        match kinds[*kind] {
            "contact" => names.contacts.push(own.clone()),
            "bit" => names.bits.push(own.clone()),
            "int" => names.numbers.push(own.clone()),
            "output" => {
                names.bits.push(own.clone());
                names.outputs.push(own.clone());
            }
            _ => {
                names.numbers.push(own.clone());
                names.words.push(own.clone());
            }
        }
        of.parameters.push((own, kinds[*kind], default));
    }
    for (name, kind) in [("seen", "bit"), ("late", "timer"), ("count", "int")] {
        hide(&mut names, name);
        of.tags.push((name.to_owned(), kind));
    }
    names.bits.extend(["seen".to_owned(), "late.Done".to_owned(), "late.Timing".to_owned()]);
    names.outputs.push("seen".to_owned());
    names.numbers.extend(["count".to_owned(), "late.Acc".to_owned()]);
    names.words.push("count".to_owned());
    let when = vec![contact(rng, &names, 0)];
    let body = vec![format!("TMR late preset={}", rng.of(&["20ms", "50ms"]))];
    of.rungs.push(Entry::Rung { name: None, legs: vec![("when", when)], body });
    for n in 0..1 + rng.below(4) {
        of.rungs.push(entry(rng, &names, before, EntryNumber { at, n }));
    }
    if stages {
        for (i, (stage, to)) in [("Open", "Shut"), ("Shut", "Open")].into_iter().enumerate() {
            let jump = Entry::Rung {
                name: None,
                legs: vec![("when", vec![contact(rng, &names, 0)])],
                body: vec![format!("JMP {to}")],
            };
            let rungs =
                (10..12).map(|n| entry(rng, &names, before, EntryNumber { at: 1000 * (i + 1), n }));
            let rungs: Vec<Entry> = rungs.collect();
            of.stages.push((stage.to_owned(), rungs.into_iter().chain([jump]).collect()));
        }
    }
    of
}

/// The number of an entry: that of its template or part, and its own there.
struct EntryNumber {
    at: usize,
    n: usize,
}

fn entry(rng: &mut Rng, names: &Names, before: &[Template], number: EntryNumber) -> Entry {
    let EntryNumber { at, n } = number;
    if before.is_empty() || rng.below(3) > 0 {
        let mut entry = rung(rng, names, n);
        if let Entry::Rung { name: Some(name), .. } = &mut entry {
            *name = format!("{name}-{at}");
        }
        return entry;
    }
    let of = rng.below(before.len());
    let with = arguments(rng, &before[of], names);
    Entry::Use { of, name: format!("u{at}_{n}"), with }
}

/// A text to which rungs are added.
struct WrittenRungs<'t> {
    /// The header of a rung.
    header: &'static str,
    text: &'t mut String,
}

impl Case {
    /// Generates the case of a seed.
    pub fn of(seed: u64) -> Case {
        let mut rng = Rng(seed);
        let mut templates: Vec<Template> = Vec::new();
        for at in 0..1 + rng.below(4) {
            let of = template(&mut rng, at, &templates, false);
            templates.push(of);
        }
        let names = of_ladder();
        let mut main: Vec<Entry> = Vec::new();
        for n in 0..2 + rng.below(5) {
            main.push(entry(&mut rng, &names, &templates, EntryNumber { at: 99, n }));
        }
        let body = template(&mut rng, 50, &templates, true);
        let with = arguments(&mut rng, &body, &names);
        templates.push(body);
        let bodies = vec![("Flush".to_owned(), templates.len() - 1, with)];
        let mut stimulus = "scan,X0,X1,X2,X3\n".to_owned();
        for scan in 0..60 {
            let bit = |rng: &mut Rng| if rng.below(3) == 0 { "1" } else { "0" };
            let row: Vec<&str> = (0..4).map(|_| bit(&mut rng)).collect();
            let _ = writeln!(stimulus, "{scan},{}", row.join(","));
        }
        Case { more_tags: String::new(), templates, main, bodies, stimulus }
    }

    /// The same case with additions: tags with a `type`, rungs in the templates, and uses of a
    /// further template among the rungs. The additions write only to operands that are new too.
    pub fn edited(&self, seed: u64) -> Case {
        let (mut rng, mut case) = (Rng(seed), self.clone());
        for n in 0..1 + rng.below(4) {
            let kind = *rng.of(&["bit", "int", "timer"]);
            let _ = writeln!(case.more_tags, "a{n} = {{ type = \"{kind}\" }}");
        }
        let names =
            Names { outputs: vec!["more".into()], words: vec!["many".into()], ..of_ladder() };
        let mut more = Template::default();
        let extra = rung(&mut rng, &names, 900);
        more.rungs.push(extra);
        more.tags.extend([("more".to_owned(), "bit"), ("many".to_owned(), "int")]);
        let of = case.templates.len();
        for (at, template) in case.templates.iter_mut().enumerate() {
            if rng.below(2) == 0 {
                continue;
            }
            template.tags.extend([("more".to_owned(), "bit"), ("many".to_owned(), "int")]);
            // A template may hide names of the ladder, so the added rung reads only inputs.
            let own = Names { bits: vec!["X3".into()], numbers: vec!["4".into()], ..names.clone() };
            let place = rng.below(template.rungs.len() + 1);
            template.rungs.insert(place, rung(&mut rng, &own, 901));
            let with_uses = Entry::Use { of, name: format!("more{at}"), with: Vec::new() };
            template.rungs.insert(rng.below(template.rungs.len() + 1), with_uses);
        }
        for n in 0..1 + rng.below(3) {
            let of_more = Entry::Use { of, name: format!("also{n}"), with: Vec::new() };
            case.main.insert(rng.below(case.main.len() + 1), of_more);
        }
        case.templates.push(more);
        case
    }

    /// The ladder's text, with templates.
    pub fn with_templates(&self) -> String {
        let mut text = head(&[]).replace("[tags]\n", &format!("[tags]\n{}", self.more_tags));
        for (at, of) in self.templates.iter().enumerate() {
            let _ = write!(text, "\n[[template]]\nname = \"T{at}\"\n[template.parameters]\n");
            for (name, kind, default) in &of.parameters {
                let default = default.as_ref().map(|text| format!(", default = \"{text}\""));
                let default = default.unwrap_or_default();
                let _ = writeln!(text, "{name} = {{ type = \"{kind}\"{default} }}");
            }
            text.push_str("[template.tags]\n");
            for (name, kind) in &of.tags {
                let _ = writeln!(text, "{name} = {{ type = \"{kind}\" }}");
            }
            of.rungs.iter().for_each(|entry| write_entry(&mut text, "template.rung", entry));
            for (name, rungs) in &of.stages {
                let _ = write!(text, "\n[[template.stage]]\nname = \"{name}\"\n");
                rungs.iter().for_each(|entry| write_entry(&mut text, "template.stage.rung", entry));
            }
        }
        text.push_str("\n[[program]]\nname = \"Main\"\n");
        text.push_str(GLOBAL_TIMER);
        self.main.iter().for_each(|entry| write_entry(&mut text, "program.rung", entry));
        for (name, of, with) in &self.bodies {
            let with = written_with(with);
            let _ = write!(
                text,
                "\n[[program]]\nname = \"{name}\"\nautostart = true\nuse = \"T{of}\"\n{with}"
            );
        }
        text
    }

    /// The ladder's text without templates, and the names to watch: each in the text with templates
    /// and in this one.
    pub fn written_out(&self) -> (String, Vec<(String, String)>) {
        let mut out = Out::default();
        let mut text = "\n[[program]]\nname = \"Main\"\n".to_owned();
        text.push_str(GLOBAL_TIMER);
        let root = Scope::default();
        let mut rungs = WrittenRungs { header: "program.rung", text: &mut text };
        self.entries(&self.main, &root, &mut rungs, &mut out);
        for (name, of, with) in &self.bodies {
            let _ = write!(text, "\n[[program]]\nname = \"{name}\"\nautostart = true\n");
            let scope = self.scope(*of, name, with, &root, &mut out);
            let template = &self.templates[*of];
            let mut rungs = WrittenRungs { header: "program.rung", text: &mut text };
            self.entries(&template.rungs, &scope, &mut rungs, &mut out);
            for (stage, entries) in &template.stages {
                let _ = write!(text, "\n[[program.stage]]\nname = \"{stage}\"\n");
                let mut rungs = WrittenRungs { header: "program.stage.rung", text: &mut text };
                self.entries(entries, &scope, &mut rungs, &mut out);
            }
        }
        let mut watch: Vec<(String, String)> = Vec::new();
        for name in ["g0", "g1", "late", "n", "m", "gt.Acc", "C5", "Y3", "D5", "Flush.Open"] {
            watch.push((name.to_owned(), name.to_owned()));
        }
        for (name, kind) in &out.tags {
            let member = if *kind == "timer" { ".Acc" } else { "" };
            let plain = name.replace('.', "_");
            watch.push((format!("{name}{member}"), format!("{plain}{member}")));
        }
        (head(&out.tags) + &text, watch)
    }

    fn entries(&self, entries: &[Entry], scope: &Scope, rungs: &mut WrittenRungs, out: &mut Out) {
        for entry in entries {
            match entry {
                Entry::Rung { legs, body, .. } => {
                    let words = |texts: &[String]| texts.iter().map(|t| scope.words(t)).collect();
                    let legs = legs.iter().map(|(leg, texts)| (*leg, words(texts))).collect();
                    let rung = Entry::Rung { name: None, legs, body: words(body) };
                    write_entry(rungs.text, rungs.header, &rung);
                }
                Entry::Use { of, name, with } => {
                    let whole = match scope.prefix.is_empty() {
                        true => name.clone(),
                        false => format!("{}.{name}", scope.prefix),
                    };
                    let inner = self.scope(*of, &whole, with, scope, out);
                    self.entries(&self.templates[*of].rungs, &inner, rungs, out);
                }
            }
        }
    }

    fn scope(
        &self,
        of: usize,
        name: &str,
        with: &[(String, String)],
        giver: &Scope,
        out: &mut Out,
    ) -> Scope {
        let template = &self.templates[of];
        let mut scope = Scope { prefix: name.to_owned(), ..Scope::default() };
        for (tag, kind) in &template.tags {
            out.tags.push((format!("{name}.{tag}"), kind));
            scope.stands.insert(tag.clone(), format!("{name}.{tag}").replace('.', "_"));
        }
        for (parameter, kind, default) in &template.parameters {
            let given = with.iter().find(|(name, _)| name == parameter).map(|(_, text)| text);
            let text = match (given, default) {
                (Some(text), _) => giver.words(text),
                (None, Some(text)) => text.clone(),
                (None, None) => unreachable!("every parameter without a default is given"),
            };
            let text = if *kind == "contact" { format!("({text})") } else { text };
            scope.stands.insert(parameter.clone(), text);
        }
        scope
    }
}

/// A timer of the ladder, which templates read.
const GLOBAL_TIMER: &str = "\n[[program.rung]]\nwhen = [\"X0\"]\ndo = [\"TMR gt preset=40ms\"]\n";

#[derive(Default)]
struct Out {
    tags: Vec<(String, &'static str)>,
}

/// The replacements for the words of a text.
#[derive(Default)]
struct Scope {
    prefix: String,
    stands: HashMap<String, String>,
}

impl Scope {
    fn words(&self, text: &str) -> String {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
        let (mut written, mut rest, mut behind_dot) = (String::new(), text, false);
        while let Some(first) = rest.chars().next() {
            let end = match letter(first) {
                true => rest.find(|c| !letter(c)).unwrap_or(rest.len()),
                false => first.len_utf8(),
            };
            let (word, behind) = rest.split_at(end);
            let is_key = behind.starts_with('=') && !behind.starts_with("==");
            match self.stands.get(word).filter(|_| !behind_dot && !is_key) {
                Some(stands) => written.push_str(stands),
                None => written.push_str(word),
            }
            (behind_dot, rest) = (word == ".", behind);
        }
        written
    }
}

fn head(own: &[(String, &'static str)]) -> String {
    let mut text = "[ladder]\nallow = []\n\n[tags]\n".to_owned();
    for (name, tag) in TAGS {
        let _ = writeln!(text, "{name} = {tag}");
    }
    for (name, kind) in own {
        let _ = writeln!(text, "{} = {{ type = \"{kind}\" }}", name.replace('.', "_"));
    }
    text
}

fn written_with(with: &[(String, String)]) -> String {
    let all = with.iter().map(|(name, text)| format!("{name} = \"{text}\""));
    format!("with = {{ {} }}\n", all.collect::<Vec<_>>().join(", "))
}

fn write_entry(text: &mut String, header: &str, entry: &Entry) {
    let _ = write!(text, "\n[[{header}]]\n");
    match entry {
        Entry::Use { of, name, with } => {
            let _ = write!(text, "use = \"T{of}\"\nname = \"{name}\"\n{}", written_with(with));
        }
        Entry::Rung { name, legs, body } => {
            if let Some(name) = name {
                let _ = writeln!(text, "name = \"{name}\"");
            }
            for (leg, contacts) in legs {
                let _ = writeln!(text, "{leg} = {contacts:?}");
            }
            let _ = writeln!(text, "do = {body:?}");
        }
    }
}
