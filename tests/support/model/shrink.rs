//! Makes a case with different traces as small as possible, as long as its traces still differ.

use super::case::{Case, Expr, Rung};

/// An edit that makes a case smaller. Blocks and elements are given by number; a rung by its block,
/// its element (0: the own rungs) and its number; a list of a rung by number. The lists of contacts
/// are those of the legs, then of the branches. The lists of instructions are the rung's, then
/// those of the branches.
#[derive(Clone, Debug)]
enum Edit {
    Scans(i64),
    NoStop,
    NoOrder,
    NoAutostart(usize),
    Block(usize),
    Stage(usize, usize),
    Rung(usize, usize, usize),
    Branch(usize, usize, usize, usize),
    Instr(usize, usize, usize, usize, usize),
    Contact(usize, usize, usize, usize, usize),
    Simplify(usize, usize, usize, usize, usize),
    Tag(usize),
    Record(usize),
    Column(usize),
    Row(usize),
    Cell(usize, usize),
}

/// Shrinks a case; `differs` judges a candidate. At most `budget` candidates are judged.
pub fn shrink(case: &Case, budget: usize, differs: &mut dyn FnMut(&Case) -> bool) -> Case {
    let mut best = case.clone();
    let mut left = budget;
    loop {
        let mut better = false;
        for edit in edits(&best) {
            let Some(candidate) = apply(&best, &edit) else {
                continue;
            };
            if left == 0 {
                return best;
            }
            left -= 1;
            if differs(&candidate) {
                best = candidate;
                better = true;
            }
        }
        if !better {
            return best;
        }
    }
}

/// All edits: coarse edits first, later places before earlier places.
fn edits(case: &Case) -> Vec<Edit> {
    let mut all = vec![Edit::Scans(case.scans / 2), Edit::NoStop, Edit::NoOrder];
    all.extend((1..=8).rev().map(|less| Edit::Scans(case.scans - less)));
    let mut fine = Vec::new();
    for (b, block) in case.blocks.iter().enumerate().rev() {
        all.push(Edit::Block(b));
        all.push(Edit::NoAutostart(b));
        all.extend((0..block.stages.len()).rev().map(|stage| Edit::Stage(b, stage)));
        let stages = block.stages.iter().map(|stage| &stage.rungs);
        for (e, rungs) in std::iter::once(&block.rungs).chain(stages).enumerate() {
            for (r, rung) in rungs.iter().enumerate().rev() {
                all.push(Edit::Rung(b, e, r));
                rung_edits(b, e, r, rung, &mut fine);
            }
        }
    }
    all.append(&mut fine);
    all.extend((0..case.columns.len()).rev().map(Edit::Column));
    for (r, (_, cells)) in case.rows.iter().enumerate().rev() {
        all.push(Edit::Row(r));
        all.extend((0..cells.len()).rev().map(|cell| Edit::Cell(r, cell)));
    }
    all.extend((0..case.tags.len()).rev().map(Edit::Tag));
    all.extend((0..case.records.len()).rev().map(Edit::Record));
    all
}

fn rung_edits(b: usize, e: usize, r: usize, rung: &Rung, all: &mut Vec<Edit>) {
    all.extend((0..rung.branches.len()).rev().map(|n| Edit::Branch(b, e, r, n)));
    let branches = rung.branches.iter();
    let lists = std::iter::once(&rung.instrs).chain(branches.clone().map(|n| &n.instrs));
    for (l, list) in lists.enumerate() {
        all.extend((0..list.len()).rev().map(|n| Edit::Instr(b, e, r, l, n)));
    }
    let legs = rung.legs.iter().map(|(_, contacts)| contacts);
    for (l, list) in legs.chain(branches.map(|branch| &branch.when)).enumerate() {
        all.extend((0..list.len()).rev().map(|n| Edit::Contact(b, e, r, l, n)));
        for n in 0..list.len() {
            all.extend((0..12).map(|way| Edit::Simplify(b, e, r, l, n * 12 + way)));
        }
    }
}

/// The case after the edit; `None` if the edit is not possible.
fn apply(case: &Case, edit: &Edit) -> Option<Case> {
    let mut case = case.clone();
    match *edit {
        Edit::Scans(scans) if scans > 0 && scans < case.scans => {
            case.scans = scans;
            case.rows.retain(|(scan, _)| *scan < scans);
        }
        Edit::Scans(_) => return None,
        Edit::NoStop => case.stop.then_some(())?,
        Edit::NoOrder => case.order.take().map(|_| ())?,
        Edit::NoAutostart(b) => case.blocks.get(b)?.autostart.then_some(())?,
        Edit::Block(b) => remove_block(&mut case, b)?,
        Edit::Stage(b, s) => remove(&mut case.blocks.get_mut(b)?.stages, s)?,
        Edit::Tag(t) => remove(&mut case.tags, t)?,
        Edit::Record(r) => remove(&mut case.records, r)?,
        Edit::Row(r) => remove(&mut case.rows, r)?,
        Edit::Cell(r, c) => {
            case.rows.get_mut(r)?.1.get_mut(c)?.take()?;
        }
        Edit::Column(c) => {
            remove(&mut case.columns, c)?;
            for (_, cells) in &mut case.rows {
                remove(cells, c)?;
            }
        }
        Edit::Rung(b, e, r) => remove(element(&mut case, b, e)?, r)?,
        Edit::Branch(b, e, r, n) => {
            remove(&mut element(&mut case, b, e)?.get_mut(r)?.branches, n)?;
        }
        Edit::Instr(b, e, r, l, n) => {
            let rung = element(&mut case, b, e)?.get_mut(r)?;
            let list = match l {
                0 => &mut rung.instrs,
                _ => &mut rung.branches.get_mut(l - 1)?.instrs,
            };
            remove(list, n)?;
        }
        Edit::Contact(b, e, r, l, n) => {
            let list = contacts(element(&mut case, b, e)?.get_mut(r)?, l)?;
            remove(list, n)?;
            if list.is_empty() {
                list.push(Expr::Leaf("$On".to_string()));
            }
        }
        Edit::Simplify(b, e, r, l, n) => {
            let list = contacts(element(&mut case, b, e)?.get_mut(r)?, l)?;
            let contact = list.get_mut(n / 12)?;
            *contact = simpler(contact, n % 12)?;
        }
    }
    match *edit {
        Edit::NoStop => case.stop = false,
        Edit::NoAutostart(b) => case.blocks.get_mut(b)?.autostart = false,
        _ => {}
    }
    Some(case)
}

fn remove<T>(list: &mut Vec<T>, at: usize) -> Option<()> {
    (at < list.len()).then(|| list.remove(at)).map(|_| ())
}

fn remove_block(case: &mut Case, b: usize) -> Option<()> {
    let name = case.blocks.get(b).map(|block| block.name.clone())?;
    if let Some(order) = &mut case.order {
        order.retain(|other| *other != name);
    }
    (name != "Main").then_some(())?;
    remove(&mut case.blocks, b)
}

fn element(case: &mut Case, b: usize, e: usize) -> Option<&mut Vec<Rung>> {
    let block = case.blocks.get_mut(b)?;
    match e {
        0 => Some(&mut block.rungs),
        stage => block.stages.get_mut(stage - 1).map(|stage| &mut stage.rungs),
    }
}

fn contacts(rung: &mut Rung, l: usize) -> Option<&mut Vec<Expr>> {
    let legs = rung.legs.len();
    match l < legs {
        true => rung.legs.get_mut(l).map(|(_, contacts)| contacts),
        false => rung.branches.get_mut(l - legs).map(|branch| &mut branch.when),
    }
}

/// The simpler form of a contact with number `way`: `$On`, `$Off`, a part of the contact, the
/// contact with a simpler part.
fn simpler(expr: &Expr, way: usize) -> Option<Expr> {
    match (way, expr) {
        (0 | 1, Expr::Leaf(text)) if text == "$On" || text == "$Off" => return None,
        (0, _) => return Some(Expr::Leaf("$On".to_string())),
        (1, _) => return Some(Expr::Leaf("$Off".to_string())),
        _ => {}
    }
    match expr {
        Expr::Leaf(text) => {
            let inner = text.strip_prefix("rise(").or_else(|| text.strip_prefix("fall("))?;
            let inner = inner.strip_suffix(')')?;
            (way == 2).then(|| Expr::Leaf(inner.to_string()))
        }
        Expr::Compare(_) => None,
        Expr::Not(inner) | Expr::Group(inner) | Expr::Edge(_, inner) if way == 2 => {
            Some((**inner).clone())
        }
        Expr::Edge(word, inner) => {
            simpler(inner, way - 1).map(|part| Expr::Edge(word, Box::new(part)))
        }
        Expr::Not(inner) => simpler(inner, way - 1).map(|part| Expr::Not(Box::new(part))),
        Expr::Group(inner) => simpler(inner, way - 1).map(|part| Expr::Group(Box::new(part))),
        Expr::All(items) | Expr::Any(items) if way < 6 => items.get(way - 2).cloned(),
        Expr::All(items) | Expr::Any(items) => {
            let mut items = items.clone();
            let count = items.len();
            let item = items.get_mut(way % count)?;
            *item = simpler(item, 2 + (way - 6) / count)?;
            Some(match expr {
                Expr::All(_) => Expr::All(items),
                _ => Expr::Any(items),
            })
        }
    }
}
