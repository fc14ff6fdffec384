//! Converts a ladder file to a program: tags, blocks, Stages, rungs, the scan order.

use super::contact::contact;
use super::instruction::{instruction, legs_of};
use super::names::Names;
use super::place::{Area, Loc, Member};
use super::program::{Array, Block, Branch, Contact, Instr, Kind, Op, Program, Rung, Value};
use super::records;
use super::templates;
use super::tree::{Table, Tree, parse};

pub struct Loaded {
    pub program: Program,
    pub names: Names,
}

pub fn load(text: &str) -> Result<Loaded, String> {
    let mut file = parse(text)?;
    templates::write_out(&mut file)?;
    let mut names = Names::default();
    let mut program = Program::default();
    let mut sources = Vec::new();
    for key in ["program", "task", "subroutine"] {
        for table in tables(&file, key)? {
            let stages = tables(table, "stage")?;
            let stage_names = stages.iter().map(|stage| string(stage, "name"));
            let stage_names = stage_names.collect::<Result<Vec<String>, String>>()?;
            let name = string(table, "name")?;
            names.blocks.push((name.clone(), stage_names));
            let autostart = matches!(table.get("autostart"), Some(Tree::Bool(true)));
            let kind = kind(&name, key);
            program.blocks.push(Block { name, kind, autostart, elements: Vec::new() });
            sources.push((table, stages));
        }
    }
    tags(&file, &mut names, &mut program)?;
    for (block, (table, stages)) in sources.into_iter().enumerate() {
        for element in std::iter::once(table).chain(stages) {
            let mut rungs = Vec::new();
            for source in tables(element, "rung")? {
                rungs.push(rung(source, block, &names, &mut program)?);
            }
            program.blocks[block].elements.push(rungs);
        }
    }
    program.order = order(&file, &names, &program)?;
    check(&mut program)?;
    Ok(Loaded { program, names })
}

pub fn tables<'a>(table: &'a Table, key: &str) -> Result<Vec<&'a Table>, String> {
    let Some(value) = table.get(key) else {
        return Ok(Vec::new());
    };
    let items = value.as_list().ok_or_else(|| format!("`{key}` is no array"))?;
    let items = items.iter().map(|item| item.as_table());
    items.collect::<Option<Vec<_>>>().ok_or_else(|| format!("`{key}` holds no tables"))
}

pub fn string(table: &Table, key: &str) -> Result<String, String> {
    let found = table.get(key).and_then(Tree::as_text);
    found.map(str::to_string).ok_or_else(|| format!("`{key}` is missing"))
}

fn strings(value: &Tree) -> Result<Vec<&str>, String> {
    let items = value.as_list().map(|items| items.iter().map(Tree::as_text).collect());
    items.flatten().ok_or_else(|| "an array of strings is missing".to_string())
}

fn kind(name: &str, key: &str) -> Kind {
    match name {
        _ if key == "program" => Kind::Program,
        _ if key == "subroutine" => Kind::Subroutine,
        "FirstScan" => Kind::FirstScan,
        "TopOfScan" => Kind::TopOfScan,
        "BottomOfScan" => Kind::BottomOfScan,
        "LastScan" => Kind::LastScan,
        _ => Kind::Task,
    }
}

fn number(value: &Tree, names: &Names) -> Result<i64, String> {
    let found = match value {
        Tree::Number(number) => Some(*number),
        Tree::Bool(on) => Some(i64::from(*on)),
        Tree::Text(text) => match names.value(text)? {
            Value::Const(number) => Some(number),
            Value::Real(_) | Value::At(_) | Value::Element(..) => None,
        },
        _ => None,
    };
    found.ok_or_else(|| format!("{value:?} is no number"))
}

fn tags(file: &Table, names: &mut Names, program: &mut Program) -> Result<(), String> {
    let Some(Tree::Table(tags)) = file.get("tags") else {
        return Ok(());
    };
    for (name, source) in tags {
        let source = source.as_table().ok_or_else(|| format!("tag `{name}` is no table"))?;
        let kind = source.get("type").and_then(Tree::as_text).unwrap_or_default();
        match records::fields(file, kind)? {
            Some(fields) => records::enter(name, source, fields, names, program)?,
            None => tag(name, source, names, program)?,
        }
    }
    Ok(())
}

/// Enters a tag of one place or of an array, or a constant.
pub fn tag(
    name: &str,
    tag: &Table,
    names: &mut Names,
    program: &mut Program,
) -> Result<(), String> {
    if let Some(value) = tag.get("value") {
        let constant = number(value, names)?;
        names.constants.insert(name.to_string(), constant);
        return Ok(());
    }
    let loc = match tag.get("type").and_then(Tree::as_text) {
        Some(kind) => placed(kind, tag, names)?,
        None => names.place(&string(tag, "at")?)?,
    };
    if let Some(Tree::Number(count)) = tag.get("count") {
        return array(name, tag, Array { first: loc, count: *count as usize }, names, program);
    }
    names.places.insert(name.to_string(), loc);
    limit(loc, tag, names, program)?;
    if let Some(initial) = tag.get("initial") {
        program.initial.push((loc, number(initial, names)?));
    }
    Ok(())
}

/// Enters the limits of a place: those of its tag, else those of its range.
fn limit(loc: Loc, tag: &Table, names: &Names, program: &mut Program) -> Result<(), String> {
    let (low, high) = match loc.area {
        Area::R => (i64::MIN, i64::MAX),
        _ => loc.range(),
    };
    let low = tag.get("min").map_or(Ok(low), |min| number(min, names))?;
    let high = tag.get("max").map_or(Ok(high), |max| number(max, names))?;
    program.limits.push((loc, low, high));
    Ok(())
}

/// The first place of a tag with a `type`, beyond all addresses.
fn placed(kind: &str, tag: &Table, names: &mut Names) -> Result<Loc, String> {
    let area = match kind {
        "bit" => Area::C,
        "int" => Area::D,
        "word" => Area::V,
        "real" => Area::R,
        "timer" => Area::T,
        "counter" => Area::Ct,
        "sensaphone" => Area::N,
        kind => return Err(format!("`type = {kind:?}` is not known")),
    };
    let loc = Loc::whole(area, 1_000_000 + names.placed);
    let count = tag.get("count").map_or(Ok(1), |count| number(count, names))?;
    names.placed += count as usize;
    Ok(loc)
}

/// Enters an array. Its elements are at consecutive places.
fn array(
    name: &str,
    tag: &Table,
    array: Array,
    names: &mut Names,
    program: &mut Program,
) -> Result<(), String> {
    names.arrays.insert(name.to_string(), array);
    for at in 0..array.count {
        let loc = Loc::whole(array.first.area, array.first.index + at);
        if tag.contains_key("min") || tag.contains_key("max") {
            limit(loc, tag, names, program)?;
        }
        let initial = match tag.get("initial") {
            Some(Tree::List(list)) => list.get(at),
            other => other,
        };
        if let Some(initial) = initial {
            program.initial.push((loc, number(initial, names)?));
        }
    }
    Ok(())
}

fn series(value: &Tree, names: &Names, histories: &mut usize) -> Result<Contact, String> {
    let items = strings(value)?;
    if items.is_empty() {
        return Err("an empty leg".to_string());
    }
    let items = items.into_iter().map(|text| contact(text, names, histories));
    Ok(Contact::All(items.collect::<Result<Vec<_>, String>>()?))
}

fn instrs(
    table: &Table,
    block: usize,
    names: &Names,
    program: &mut Program,
) -> Result<Vec<Instr>, String> {
    let Some(value) = table.get("do") else {
        return Ok(Vec::new());
    };
    let items = strings(value)?;
    items.into_iter().map(|text| instruction(text, block, names, program)).collect()
}

fn rung(table: &Table, block: usize, names: &Names, program: &mut Program) -> Result<Rung, String> {
    let mut legs = Vec::new();
    if let Some(when) = table.get("when") {
        legs.push(series(when, names, &mut program.histories)?);
    }
    if let Some(given) = table.get("leg").and_then(Tree::as_table) {
        let first = table.get("do").map(strings).transpose()?.unwrap_or_default();
        let mnemonic = first.first().and_then(|text| text.split_whitespace().next());
        for name in legs_of(mnemonic.unwrap_or_default()) {
            let leg = given.get(*name).ok_or_else(|| format!("leg.{name} is missing"))?;
            legs.push(series(leg, names, &mut program.histories)?);
        }
    }
    if legs.is_empty() {
        return Err("a rung without a leg".to_string());
    }
    let instrs_of_rung = instrs(table, block, names, program)?;
    let mut branches = Vec::new();
    for branch in tables(table, "branch")? {
        let when = branch.get("when").ok_or("a branch without `when`")?;
        let when = series(when, names, &mut program.histories)?;
        branches.push(Branch { when, instrs: instrs(branch, block, names, program)? });
    }
    if instrs_of_rung.is_empty() && branches.iter().all(|branch| branch.instrs.is_empty()) {
        return Err("a rung without an instruction".to_string());
    }
    Ok(Rung { legs, instrs: instrs_of_rung, branches })
}

fn order(file: &Table, names: &Names, program: &Program) -> Result<Vec<usize>, String> {
    let ordinary = |n: &usize| matches!(program.blocks[*n].kind, Kind::Program | Kind::Task);
    let given = file.get("ladder").and_then(Tree::as_table).and_then(|t| t.get("order"));
    match given {
        None => Ok((0..program.blocks.len()).filter(ordinary).collect()),
        Some(order) => strings(order)?.into_iter().map(|name| names.block(name)).collect(),
    }
}

/// Sets constant presets of Sensaphone counters, and refuses resets of structures without an owner.
fn check(program: &mut Program) -> Result<(), String> {
    let mut owned = Vec::new();
    let mut reset = Vec::new();
    let rungs = program.blocks.iter().flat_map(|b| b.elements.iter().flatten());
    let instrs = rungs.flat_map(|rung| {
        rung.instrs.iter().chain(rung.branches.iter().flat_map(|b| b.instrs.iter()))
    });
    for instr in instrs {
        match &instr.op {
            Op::Ctu(n, preset) | Op::Ctd(n, preset) => {
                if let Some(Value::Const(preset)) = preset {
                    program.initial.push((Loc::of(Area::N, *n, Member::Pre), *preset));
                }
                owned.push((Area::N, *n));
            }
            Op::Res(n) => reset.push((Area::N, *n)),
            Op::Rstct(ct) => reset.push((Area::Ct, *ct)),
            Op::Rstt(t) => reset.push((Area::T, *t)),
            _ => {}
        }
    }
    owned.extend(program.counters.keys().map(|ct| (Area::Ct, *ct)));
    owned.extend(program.timers.keys().map(|t| (Area::T, *t)));
    match reset.into_iter().find(|structure| !owned.contains(structure)) {
        None => Ok(()),
        Some((area, n)) => Err(format!("{area:?} {n} is reset and has no owner")),
    }
}
