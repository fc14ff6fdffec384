//! Random valid programs with a stimulus; each seed gives a case.

use super::calls;
use super::case::{BUILTIN, Block, Branch, Case, Expr, Rung, Stage, Tag};
use super::clock::{BEGIN, Clock};
use super::drawn_records;
use super::drawn_stimulus::stimulus;
use super::drawn_templates::add_templates;
use super::menu::{COUNTERS, Spot, TIMERS, Targets, is_drastic, is_reset};
use super::pool::{DrawnArray, Owned, Pool, STRUCTURES};
use super::rng::Rng;
use std::collections::{BTreeMap, BTreeSet};

/// An instruction that must occur in the program.
enum Forced {
    Single(String),
    Counter(&'static str, String),
    Timer(&'static str, String),
    Shift(String),
}

/// A place for rungs: the block, and 0 for its own rungs or the number of a Stage.
type Element = (usize, usize);

/// A program without templates.
pub fn generate(seed: u64) -> Case {
    drawn(seed, false)
}

/// A program in which some rungs are those of templates.
pub fn with_templates(seed: u64) -> Case {
    drawn(seed, true)
}

fn drawn(seed: u64, has_templates: bool) -> Case {
    let mut rng = Rng::new(seed);
    let period = *rng.pick(&[1, 7, 10, 10, 10, 35, 500]);
    let lively = *rng.pick(&[35, 55, 55, 75]);
    let mut pool = Pool {
        rng,
        period,
        lively,
        owned: Vec::new(),
        tags: BTreeMap::new(),
        constants: Vec::new(),
        limits: BTreeMap::new(),
        arrays: Vec::new(),
        typed: Vec::new(),
        structures: Vec::new(),
        records: Vec::new(),
        block_bits: Vec::new(),
        in_contact: false,
    };
    let mut tags = tags(&mut pool);
    let records = drawn_records::add(&mut pool, &mut tags);
    let mut blocks = plan_blocks(&mut pool);
    let mut targets = Targets {
        programs: Vec::new(),
        haltable: Vec::new(),
        counters: Vec::new(),
        timers: Vec::new(),
        sensaphones: Vec::new(),
    };
    for block in &blocks {
        if block.name != "Main" && !block.task {
            targets.programs.push(block.name.clone());
        }
        if block.name != "Main" && !BUILTIN.contains(&block.name.as_str()) {
            targets.haltable.push(block.name.clone());
        }
    }
    let elements: Vec<Element> = blocks
        .iter()
        .enumerate()
        .flat_map(|(b, block)| (0..=block.stages.len()).map(move |e| (b, e)))
        .collect();
    let forced = forced(&mut pool, &blocks, &elements, &mut targets);
    fill(&mut pool, &mut blocks, &elements, forced, &targets);
    let scans = *pool.rng.pick(&[15, 30, 45, 60, 90]);
    let (columns, rows) = stimulus(&mut pool, scans);
    let mut names: Vec<String> = blocks.iter().map(|block| block.name.clone()).collect();
    names.retain(|name| !BUILTIN.contains(&name.as_str()));
    pool.rng.shuffle(&mut names);
    let order = pool.rng.chance(40).then_some(names);
    let stop = pool.rng.chance(35);
    let clock = clock(&mut pool);
    calls::add_subroutines(&mut pool, &mut blocks);
    let templates = has_templates.then(|| add_templates(&mut pool, &mut blocks));
    Case {
        seed,
        period,
        scans,
        stop,
        clock,
        order,
        tags,
        records,
        templates: templates.unwrap_or_default(),
        blocks,
        columns,
        rows,
    }
}

/// The local time of the first scan: mostly shortly before the end of a minute, a day, a February
/// or a year.
fn clock(pool: &mut Pool) -> Clock {
    let rng = &mut pool.rng;
    let [year, month, day] = *rng.pick(&[
        [2001, 1, 1],
        [2024, 2, 28],
        [2023, 2, 28],
        [2000, 2, 29],
        [2100, 2, 28],
        [1999, 12, 31],
        [2026, 11, 30],
        [1969, 12, 31],
    ]);
    let near = rng.range(30, 59);
    match rng.weighted(&[20, 50, 30]) {
        0 => BEGIN,
        1 => [year, month, day, 23, 59, near],
        _ => [year, month, day, rng.range(0, 23), rng.range(0, 59), near],
    }
}

fn tags(pool: &mut Pool) -> Vec<Tag> {
    let places = [
        ("eye", "X0"),
        ("door_x", "X2"),
        ("lamp", "Y1"),
        ("jam", "C1"),
        ("coil", "MC1"),
        ("size_1", "D0"),
        ("Level", "D2"),
        ("speed", "V0"),
        ("flow", "R1"),
        ("hold_reg", "MHR1"),
        ("parts", "CT0"),
        ("wait_a", "T0"),
        ("wait_acc", "T2.Acc"),
        ("sensa", "N0"),
    ];
    let mut tags = Vec::new();
    for (name, at) in places {
        if pool.rng.chance(45) {
            let body = format!("at = \"{at}\"{}", tag_details(pool, at));
            let operand = !["CT0", "T0", "N0"].contains(&at);
            let watched = operand.then(|| name.to_string()).into_iter().collect();
            tags.push(Tag { name: name.to_string(), body, watched });
            pool.tags.insert(at.to_string(), name.to_string());
        }
    }
    for (name, area, count) in
        [("row", "D", 3), ("regs", "V", 2), ("bits", "C", 3), ("ins", "X", 4), ("flows", "R", 3)]
    {
        if pool.rng.chance(45) {
            let body = format!("at = \"{area}0\", count = {count}");
            tags.push(Tag { name: name.to_string(), body, watched: Vec::new() });
            pool.arrays.push(DrawnArray { name, field: "", area, count, placed: false });
        }
    }
    typed_tags(pool, &mut tags);
    if pool.rng.chance(40) {
        let ms = pool.milliseconds();
        let body = match pool.rng.chance(60) {
            true => format!("value = \"{ms}ms\""),
            false => format!("value = {}", pool.rng.range(-4, 9)),
        };
        tags.push(Tag { name: "limit_c".to_string(), body, watched: Vec::new() });
        pool.constants.push("limit_c".to_string());
    }
    tags
}

/// Adds tags with a `type`: their names occur in place of addresses.
fn typed_tags(pool: &mut Pool, tags: &mut Vec<Tag>) {
    for (name, kind, area) in [
        ("t_bit", "bit", "C"),
        ("t_int", "int", "D"),
        ("t_word", "word", "V"),
        ("t_real", "real", "R"),
    ] {
        if pool.rng.chance(30) {
            let details = if area == "C" { String::new() } else { word_details(pool, name) };
            let body = format!("type = \"{kind}\"{details}");
            tags.push(Tag { name: name.to_string(), body, watched: vec![name.to_string()] });
            pool.typed.push((name.to_string(), area));
        }
    }
    for (name, kind, area, count) in
        [("t_row", "int", "D", 3), ("t_bits", "bit", "C", 4), ("t_flows", "real", "R", 2)]
    {
        if pool.rng.chance(30) {
            let body = format!("type = \"{kind}\", count = {count}");
            let array = DrawnArray { name, field: "", area, count, placed: true };
            let watched = (0..count).map(|at| array.at(&at.to_string())).collect();
            tags.push(Tag { name: name.to_string(), body, watched });
            pool.arrays.push(array);
        }
    }
}

fn tag_details(pool: &mut Pool, at: &str) -> String {
    match at.chars().next() {
        Some('Y' | 'C' | 'M') if !at.starts_with("CT") && !at.starts_with("MHR") => {
            match pool.rng.below(4) {
                0 => ", initial = true".to_string(),
                1 => ", alarm = \"Something is ON\"".to_string(),
                2 => ", log = \"change\", doc = \"A bit\"".to_string(),
                _ => String::new(),
            }
        }
        Some('D' | 'V' | 'M' | 'R') => word_details(pool, at),
        _ => String::new(),
    }
}

pub fn word_details(pool: &mut Pool, at: &str) -> String {
    let lowest =
        if ["D", "R", "t_int", "t_real"].iter().any(|of| at.starts_with(of)) { -6 } else { 0 };
    let low = pool.rng.range(lowest, 4);
    let high = low + pool.rng.range(0, 12 * pool.period + 4);
    let initial = pool.rng.range(low, high);
    match pool.rng.below(5) {
        0 => format!(", initial = {initial}"),
        1 => {
            pool.limits.insert(at.to_string(), (low, high));
            format!(", initial = {initial}, min = {low}, max = {high}")
        }
        2 => {
            pool.limits.insert(at.to_string(), (i64::MIN, high));
            format!(", initial = {initial}, max = {high}")
        }
        3 => {
            pool.limits.insert(at.to_string(), (low, i64::MAX));
            format!(", min = {low}, initial = {initial}")
        }
        _ => String::new(),
    }
}

fn plan_blocks(pool: &mut Pool) -> Vec<Block> {
    let mut names = vec![("Main", false)];
    names.extend(["Alpha", "Beta-2", "Gamma_x"].map(|name| (name, false)));
    names.truncate(1 + pool.rng.weighted(&[25, 45, 24, 6]));
    let mut tasks = vec![("House", true), ("Keep-up", true), ("Poll", true)];
    tasks.truncate(pool.rng.weighted(&[35, 38, 20, 7]));
    names.extend(tasks);
    names.extend(BUILTIN.map(|name| (name, true)).iter().filter(|_| pool.rng.chance(18)));
    let mut blocks = Vec::new();
    for (name, task) in names {
        let staged = !task && pool.rng.chance(if name == "Main" { 45 } else { 65 });
        let mut stages = ["Open", "Fill", "Close-2", "Drain", "Rest_x"].to_vec();
        pool.rng.shuffle(&mut stages);
        stages.truncate(if staged { 1 + pool.rng.below(4) } else { 0 });
        let bits = stages.iter().map(|stage| format!("{name}.{stage}"));
        pool.block_bits.extend(bits);
        pool.block_bits.push(format!("{name}.Running"));
        if task {
            pool.block_bits.push(format!("{name}.Done"));
        }
        let stages = stages.into_iter();
        blocks.push(Block {
            name: name.to_string(),
            task,
            subroutine: false,
            autostart: !task && name != "Main" && pool.rng.chance(60),
            short: pool.rng.chance(25),
            rungs: Vec::new(),
            stages: stages.map(|s| Stage { name: s.to_string(), rungs: Vec::new() }).collect(),
        });
    }
    blocks
}

fn forced(
    pool: &mut Pool,
    blocks: &[Block],
    elements: &[Element],
    targets: &mut Targets,
) -> Vec<(Element, Forced)> {
    let mut all = Vec::new();
    for name in structures(pool, "CT") {
        targets.counters.push(name.clone());
        let mnemonic = *pool.rng.pick(&COUNTERS);
        all.push((home(pool, elements), Forced::Counter(mnemonic, name)));
    }
    for name in structures(pool, "T") {
        targets.timers.push(name.clone());
        let mnemonic = *pool.rng.pick(&TIMERS);
        all.push((home(pool, elements), Forced::Timer(mnemonic, name)));
    }
    for name in structures(pool, "N") {
        targets.sensaphones.push(name.clone());
        let preset = match pool.rng.chance(55) {
            true => pool.rng.range(-3, 4).to_string(),
            false => pool.word(),
        };
        let (first, second) = *pool.rng.pick(&[("CTU", "CTD"), ("CTD", "CTU")]);
        let text = pool.sensaphone(first, &name, Some(&preset));
        all.push((home(pool, elements), Forced::Single(text)));
        if pool.rng.chance(70) {
            let preset = pool.rng.chance(40).then_some(preset);
            let text = pool.sensaphone(second, &name, preset.as_deref());
            all.push((home(pool, elements), Forced::Single(text)));
        }
    }
    for _ in 0..pool.rng.weighted(&[60, 30, 10]) {
        let text = format!("SR {}", pool.shifted());
        all.push((home(pool, elements), Forced::Shift(text)));
    }
    for (number, block) in blocks.iter().enumerate() {
        for text in starters(pool, block) {
            let mut at = home(pool, elements);
            if pool.rng.chance(if at.0 == number { 80 } else { 50 }) {
                at = (0, 0);
            }
            all.push((at, Forced::Single(text)));
        }
    }
    if pool.rng.chance(12) {
        all.push((home(pool, elements), Forced::Single("STOP".to_string())));
    }
    all
}

/// The structures of the area that shall have an owner.
fn structures(pool: &mut Pool, area: &'static str) -> Vec<String> {
    let found = STRUCTURES.iter().find(|(name, _, _)| *name == area);
    let count = found.map_or(0, |(_, count, _)| *count);
    let mut names: Vec<String> = (0..count).map(|n| format!("{area}{n}")).collect();
    names.extend(pool.structure_names(area));
    names.retain(|_| pool.rng.chance(if area == "N" { 45 } else { 60 }));
    pool.owned.extend(names.iter().map(|name| Owned { name: name.clone(), area }));
    names
}

/// A random element, often one that is sure to execute.
fn home(pool: &mut Pool, elements: &[Element]) -> Element {
    match pool.rng.weighted(&[25, 20, 55]) {
        0 => (0, 0),
        1 => *pool.rng.pick(&elements[..elements.len().min(2)]),
        _ => *pool.rng.pick(elements),
    }
}

/// Instructions that start a block.
fn starters(pool: &mut Pool, block: &Block) -> Vec<String> {
    let name = &block.name;
    if name == "Main" || BUILTIN.contains(&name.as_str()) {
        return Vec::new();
    }
    if !block.task {
        let run = format!("RUN {name}");
        return vec![run; usize::from(!block.autostart && pool.rng.chance(85))];
    }
    match pool.rng.weighted(&[50, 45, 5]) {
        0 => vec![format!("ENTASK {name}"); 1 + pool.rng.below(3)],
        1 => vec![format!("ENTASK {name} every={}", pool.interval())],
        _ => Vec::new(),
    }
}

fn fill(
    pool: &mut Pool,
    blocks: &mut [Block],
    elements: &[Element],
    mut forced: Vec<(Element, Forced)>,
    targets: &Targets,
) {
    for (b, e) in elements.iter().copied() {
        let block = &blocks[b];
        let name = block.name.clone();
        let builtin = BUILTIN.contains(&name.as_str());
        let stages: Vec<String> = block.stages.iter().map(|s| s.name.clone()).collect();
        let mut driven = BTreeSet::new();
        let mut spot = Spot {
            program: (!block.task).then_some(&name),
            own: (name != "Main" && !builtin).then_some(&name),
            in_stage: e > 0,
            stages: &stages,
            driven: &mut driven,
        };
        let (here, rest) = forced.into_iter().partition::<Vec<_>, _>(|(at, _)| *at == (b, e));
        forced = rest;
        let mut rungs = Vec::new();
        for (_, forced) in here {
            rungs.push(forced_rung(pool, forced, &mut spot, targets));
        }
        let most = if e == 0 && !stages.is_empty() { 4 } else { 5 };
        for _ in 0..pool.rng.below(most) + usize::from(b == 0) {
            rungs.push(free_rung(pool, None, &mut spot, targets));
        }
        if rungs.is_empty() && pool.rng.chance(80) {
            rungs.push(free_rung(pool, None, &mut spot, targets));
        }
        pool.rng.shuffle(&mut rungs);
        match e {
            0 => blocks[b].rungs = rungs,
            stage => blocks[b].stages[stage - 1].rungs = rungs,
        }
    }
}

fn forced_rung(pool: &mut Pool, forced: Forced, spot: &mut Spot, targets: &Targets) -> Rung {
    let (text, legs): (String, &[&str]) = match forced {
        Forced::Single(text) => return free_rung(pool, Some(text), spot, targets),
        Forced::Counter(mnemonic, n) => {
            let legs: &[&str] = match mnemonic {
                "CNT" => &["up", "rst"],
                "CNTDN" => &["dn", "rst"],
                "UDC" => &["rst", "up", "dn"],
                _ => &["up", "dn"],
            };
            (pool.counter(mnemonic, &n), legs)
        }
        Forced::Shift(text) => (text, &["data", "clk", "rst"]),
        Forced::Timer(mnemonic, n) => {
            let text = pool.timer(mnemonic, &n, spot.driven);
            if mnemonic != "TMRA" && mnemonic != "TMRADOWN" {
                return free_rung(pool, Some(text), spot, targets);
            }
            (text, &["en", "rst"])
        }
    };
    let legs = legs.iter().map(|leg| {
        let contacts = match (*leg, pool.rng.below(10)) {
            ("rst", 0..=3) => vec![Expr::Leaf("$Off".to_string())],
            ("rst", 4..=7) => pool.rare_series(),
            _ => pool.series(),
        };
        (leg.to_string(), contacts)
    });
    Rung { legs: legs.collect(), instrs: vec![text], branches: Vec::new() }
}

/// A rung with `when`, sometimes with branches, that contains the given instruction.
fn free_rung(pool: &mut Pool, given: Option<String>, spot: &mut Spot, targets: &Targets) -> Rung {
    let branches = pool.rng.weighted(&[72, 20, 8]);
    let mut lists: Vec<Vec<String>> = Vec::new();
    for list in 0..=branches {
        let least = usize::from(list > 0 || branches == 0 && given.is_none());
        let count = least + pool.rng.weighted(&[60, 30, 10]);
        lists.push((0..count).map(|_| pool.instr(spot, targets)).collect());
    }
    if let Some(text) = given {
        let list = pool.rng.below(lists.len());
        let at = pool.rng.below(lists[list].len() + 1);
        lists[list].insert(at, text);
    }
    let mut lists = lists.into_iter().map(|instrs| (when(pool, &instrs), instrs));
    let (when, instrs) = lists.next().unwrap_or_default();
    let branches = lists.map(|(when, instrs)| Branch { when, instrs }).collect();
    Rung { legs: vec![("when".to_string(), when)], instrs, branches }
}

/// Contacts suitable for these instructions.
fn when(pool: &mut Pool, instrs: &[String]) -> Vec<Expr> {
    let has = |what: fn(&str) -> bool| instrs.iter().any(|instr| what(instr));
    let rare = if has(is_drastic) { 85 } else { 60 * usize::from(has(is_reset)) };
    if pool.rng.chance(rare) {
        return pool.rare_series();
    }
    if has(|instr| instr.contains(" every=")) && pool.rng.chance(40) {
        return vec![Expr::Leaf("$On".to_string())];
    }
    let counts = has(|instr| instr.starts_with("CTU") || instr.starts_with("CTD"));
    if counts && pool.rng.chance(60) {
        return vec![Expr::Leaf(format!("X{}", pool.rng.below(4)))];
    }
    pool.series()
}
