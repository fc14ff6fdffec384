//! Random programs with memory in different places: with addresses, with tags of these addresses,
//! with tags that have a `type`, and with additional such tags. All variants behave the same, also
//! across a reload from one variant to another.
//!
//! Tests `RUNGD_PROPERTY_PROGRAMS` (30) programs from the seed `RUNGD_PROPERTY_SEED` (1) on.

use crate::reload::properties::seeds;
use rungd_base::calendar::LocalTime;
use rungd_engine::{Cell, Engine, EngineCall, EngineProgram, ScanTimes};
use rungd_lab::traces::stimulus::{Stimulus, StimulusChange};
use rungd_language::lower::{Symbols, lower};
use rungd_state::reload::{LoweredProgram, ReloadPlan};
use rungd_test_support::model::case::Case;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::run::{cell, load, target, value};

/// The address spaces and their types.
const SPACES: [(&str, &str); 6] = [
    ("C", "bit"),
    ("V", "word"),
    ("D", "int"),
    ("CT", "counter"),
    ("T", "timer"),
    ("N", "sensaphone"),
];

/// How the memory of a program is named.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Naming {
    Addresses,
    Tags,
    Types,
    MoreTypes,
}

const NAMINGS: [Naming; 4] = [Naming::Addresses, Naming::Tags, Naming::Types, Naming::MoreTypes];

/// The type of an address that may be replaced by a name.
fn kind(word: &str, fixed: &[String]) -> Option<&'static str> {
    let digits = word.find(|c: char| c.is_ascii_digit())?;
    let (letters, number) = word.split_at(digits);
    number.parse::<u32>().ok()?;
    let (_, kind) = SPACES.iter().find(|(space, _)| *space == letters)?;
    (!fixed.contains(&word.to_owned())).then_some(*kind)
}

/// Replaces each address in a text by a name, and adds the names to `names`.
fn named(text: &str, fixed: &[String], names: &mut Vec<(String, &'static str)>) -> String {
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let (mut said, mut rest) = (String::new(), text);
    while !rest.is_empty() {
        let (word, behind) = rest.split_at(rest.find(|c| !letter(c)).unwrap_or(rest.len()));
        match kind(word, fixed) {
            Some(kind) => {
                said.push_str(&format!("m_{word}"));
                if !names.contains(&(word.to_owned(), kind)) {
                    names.push((word.to_owned(), kind));
                }
            }
            None => said.push_str(word),
        }
        let end = behind.find(letter).unwrap_or(behind.len());
        said.push_str(&behind[..end]);
        rest = &behind[end..];
    }
    said
}

/// A program, and the operands that are compared.
struct Loaded {
    naming: Naming,
    program: EngineProgram,
    symbols: Symbols,
    stimulus: Stimulus,
    watch: Vec<Cell>,
}

impl Loaded {
    fn side(&self) -> LoweredProgram<'_> {
        LoweredProgram { program: &self.program, symbols: &self.symbols }
    }
}

/// The letters and the number of an address: `D12` is 12 in D.
fn number(address: &str) -> Option<(&str, usize)> {
    let (letters, digits) = address.split_at(address.find(|c: char| c.is_ascii_digit())?);
    Some((letters, digits.parse().ok()?))
}

/// The addresses in ranges and arrays, which must stay neighbours.
fn neighbours(case: &Case, ladder: &str) -> Vec<String> {
    let words = ladder.split(|c: char| !(c.is_ascii_alphanumeric() || c == '.'));
    let ranges = words.filter_map(|word| {
        let (low, high) = word.split_once("..")?;
        let ((letters, a), (_, b)) = (number(low)?, number(high)?);
        Some((letters, a.min(b), a.max(b)))
    });
    let arrays = case.tags.iter().filter_map(|tag| {
        let (at, count) = tag.body.strip_prefix("at = \"")?.split_once("\", count = ")?;
        let (letters, first) = number(at)?;
        Some((letters, first, first + count.parse::<usize>().ok()? - 1))
    });
    let runs = ranges.chain(arrays);
    runs.flat_map(|(letters, a, b)| (a..=b).map(move |n| format!("{letters}{n}"))).collect()
}

/// The addresses that must stay: those of tags, neighbours, and all of N if the ladder has `N,`.
fn fixed(case: &Case, ladder: &str) -> Vec<String> {
    let strings = case.tags.iter().flat_map(|tag| tag.body.split('"'));
    let bases = strings.filter_map(|text| text.split('.').next());
    let mut fixed: Vec<String> = bases.map(str::to_owned).collect();
    fixed.extend(neighbours(case, ladder));
    if ladder.contains("N,") {
        fixed.extend((0..64).map(|n| format!("N{n}")));
    }
    fixed
}

fn loaded(case: &Case, naming: Naming) -> Loaded {
    let (mut ladder, mut stimulus) = (case.ladder(), case.stimulus());
    let mut watch = case.watch();
    if naming != Naming::Addresses {
        let fixed = fixed(case, &ladder);
        let mut names = Vec::new();
        ladder = named(&ladder, &fixed, &mut names);
        stimulus = named(&stimulus, &fixed, &mut names);
        watch = watch.iter().map(|name| named(name, &fixed, &mut names)).collect();
        let mut tags: String = names
            .iter()
            .map(|(address, kind)| match naming {
                Naming::Tags => format!("m_{address} = {{ at = \"{address}\" }}\n"),
                _ => format!("m_{address} = {{ type = \"{kind}\" }}\n"),
            })
            .collect();
        if naming == Naming::MoreTypes {
            for (n, (_, kind)) in (0..3).flat_map(|n| SPACES.iter().map(move |space| (n, space))) {
                tags.push_str(&format!("a{n}_{kind} = {{ type = \"{kind}\" }}\n"));
                tags.push_str(&format!("m_C{n}_{kind} = {{ type = \"{kind}\" }}\n"));
            }
        }
        match ladder.find("[tags]\n") {
            Some(at) => ladder.insert_str(at + "[tags]\n".len(), &tags),
            None => {
                let at = ladder.find("\n[[").unwrap();
                ladder.insert_str(at, &format!("\n[tags]\n{tags}"));
            }
        }
    }
    let refused = |e: String| -> ! { panic!("seed {}, {naming:?}: {e}\n{ladder}", case.seed) };
    let program = load(&ladder).unwrap_or_else(|e| refused(e));
    let (code, symbols) = lower(&program);
    let stimulus = Stimulus::parse(&stimulus, &|name| target(&program, &symbols, name));
    let stimulus = stimulus.unwrap_or_else(|e| refused(e.message));
    let watch = watch
        .iter()
        .map(|name| cell(&program, &symbols, name).unwrap_or_else(|error| refused(error)));
    let watch = watch.collect();
    Loaded { naming, program: code, symbols, stimulus, watch }
}

/// A reload: the scan before which it happens, and the new program.
#[derive(Clone, Copy)]
struct TracedReload<'a> {
    scan: u64,
    to: &'a Loaded,
}

/// The values at the end of every scan, with a reload before one of them.
fn trace(case: &Case, of: &Loaded, reload: Option<TracedReload>) -> Vec<Vec<i64>> {
    let mut engine = Engine::new(of.program.clone());
    engine.start(0);
    let (mut rows, mut next, mut now) = (Vec::new(), 0, of);
    for scan in 0..case.scans as u64 {
        if case.stop && scan + 1 == case.scans as u64 {
            engine.request_stop();
        }
        if let Some(TracedReload { to, .. }) = reload.filter(|reload| reload.scan == scan) {
            let plan = ReloadPlan::new(now.side(), to.side());
            let mut successor = Engine::new(to.program.clone());
            successor.adopt(&mut engine, &plan.transfer, true, &[]);
            (engine, now) = (successor, to);
        }
        let now_ns = scan * case.period as u64 * 1_000_000;
        engine.begin_scan(now_ns, &ScanTimes::default(), &LocalTime::default());
        for change in now.stimulus.of_scan(scan, &mut next) {
            match change {
                StimulusChange::Input(n, on) => engine.set_input(n, on),
                StimulusChange::Bit(cell, on) => engine.apply(EngineCall::Write(cell, on.into())),
                StimulusChange::Word(cell, value) => engine.write_word(cell, value),
            }
        }
        let last = engine.execute().last;
        let values =
            |engine: &Engine| now.watch.iter().map(|c| value(engine.image(), *c)).collect();
        rows.push(values(&engine));
        if last {
            engine.terminate();
            rows.push(values(&engine));
            break;
        }
    }
    rows
}

#[track_caller]
fn same(case: &Case, expected: &[Vec<i64>], found: &[Vec<i64>], how: &str) {
    let Some(scan) = expected.iter().zip(found).position(|(a, b)| a != b) else {
        return assert_eq!(expected.len(), found.len(), "seed {}, {how}", case.seed);
    };
    let names = case.watch();
    let values = names.iter().zip(expected[scan].iter().zip(&found[scan]));
    let differ: Vec<_> = values.filter(|(_, (a, b))| a != b).collect();
    panic!("seed {}, {how}: scan {scan}: {differ:?}\n{}", case.seed, case.ladder());
}

#[test]
fn the_trace_of_a_program_does_not_depend_on_memory_addresses() {
    for seed in seeds() {
        let case = generate(seed);
        let expected = trace(&case, &loaded(&case, Naming::Addresses), None);
        for naming in &NAMINGS[1..] {
            let found = trace(&case, &loaded(&case, *naming), None);
            same(&case, &expected, &found, &format!("{naming:?}"));
        }
    }
}

#[test]
fn a_reload_that_moves_memory_does_not_change_the_trace() {
    for seed in seeds() {
        let (case, mut rng) = (generate(seed), Rng::new(seed ^ 0x7e1d));
        let all = NAMINGS[1..].iter().map(|naming| loaded(&case, *naming)).collect::<Vec<_>>();
        let expected = trace(&case, &all[0], None);
        for (from, to) in [(0, 1), (1, 2), (2, 1), (1, 0), (0, 2), (2, 0)] {
            let at = rng.below(case.scans as usize) as u64;
            let found = trace(&case, &all[from], Some(TracedReload { scan: at, to: &all[to] }));
            let (from, to) = (all[from].naming, all[to].naming);
            same(&case, &expected, &found, &format!("{from:?} to {to:?} at {at}"));
        }
    }
}
