//! Random subroutines: rungs of a finished program move into them, and CALLs take their places.

use super::case::{Block, Expr, Rung};
use super::pool::Pool;

/// The instructions that do not stand in a subroutine.
const NEVER: [&str; 6] = ["JMP", "SGSET", "SGRST", "SGDIVRG", "SGCONVRG", "EXIT"];

/// A block and, for a Stage, its number.
type Element = (usize, Option<usize>);

/// Moves rungs into up to three subroutines, which are called in their place and at other places.
/// A subroutine is called by later ones only, so none calls itself.
pub fn add_subroutines(pool: &mut Pool, blocks: &mut Vec<Block>) {
    for number in 0..pool.rng.weighted(&[40, 30, 20, 10]) {
        let name = format!("Sub-{number}");
        let mut all: Vec<Element> = Vec::new();
        for (at, block) in blocks.iter().enumerate() {
            all.push((at, None));
            all.extend((0..block.stages.len()).map(|stage| (at, Some(stage))));
        }
        let from = *pool.rng.pick(&all);
        let rungs = rungs_of(blocks, from);
        if rungs.is_empty() {
            continue;
        }
        let first = pool.rng.below(rungs.len());
        let most = 1 + pool.rng.below(rungs.len() - first);
        let fits = rungs[first..].iter().take(most).take_while(|rung| may_move(rung)).count();
        let mut moved: Vec<Rung> = rungs.splice(first..first + fits, []).collect();
        rungs.insert(first, call(pool, &name));
        returns(pool, &mut moved);
        // Not in the subroutines before it, which it may call.
        let programs: Vec<Element> =
            all.into_iter().filter(|(block, _)| !blocks[*block].subroutine).collect();
        for _ in 0..pool.rng.weighted(&[55, 30, 15]) {
            let more = call(pool, &name);
            let at = *pool.rng.pick(&programs);
            let rungs = rungs_of(blocks, at);
            rungs.insert(pool.rng.below(rungs.len() + 1), more);
        }
        let short = pool.rng.chance(25);
        blocks.push(Block {
            name,
            task: false,
            subroutine: true,
            autostart: false,
            short,
            rungs: moved,
            stages: Vec::new(),
        });
    }
}

pub fn rungs_of(blocks: &mut [Block], (block, stage): Element) -> &mut Vec<Rung> {
    let block = &mut blocks[block];
    match stage {
        None => &mut block.rungs,
        Some(stage) => &mut block.stages[stage].rungs,
    }
}

/// Whether a rung may stand in a subroutine.
pub fn may_move(rung: &Rung) -> bool {
    let branches = rung.branches.iter().flat_map(|branch| &branch.instrs);
    let mut words = rung.instrs.iter().chain(branches).filter_map(|text| text.split(' ').next());
    words.all(|word| !NEVER.contains(&word))
}

fn call(pool: &mut Pool, name: &str) -> Rung {
    let contacts = match pool.rng.chance(40) {
        true => vec![Expr::Leaf("$On".to_string())],
        false => pool.series(),
    };
    let mut instrs = vec![format!("CALL {name}")];
    if pool.rng.chance(15) {
        instrs.push(format!("CALL {name}"));
    }
    Rung { legs: vec![("when".to_string(), contacts)], instrs, branches: Vec::new() }
}

/// Puts RETURNs among the rungs of a subroutine.
fn returns(pool: &mut Pool, rungs: &mut Vec<Rung>) {
    for _ in 0..pool.rng.weighted(&[45, 40, 15]) {
        let at = pool.rng.below(rungs.len() + 1);
        let own = rungs.get(at).filter(|rung| rung.legs[0].0 == "when" && !rung.instrs.is_empty());
        if own.is_some() && pool.rng.chance(35) {
            let list = &mut rungs[at].instrs;
            list.insert(pool.rng.below(list.len() + 1), "RETURN".to_string());
            continue;
        }
        let when = if pool.rng.chance(50) { pool.rare_series() } else { pool.series() };
        let instrs = vec!["RETURN".to_string()];
        rungs.insert(at, Rung { legs: vec![("when".to_string(), when)], instrs, branches: vec![] });
    }
}
