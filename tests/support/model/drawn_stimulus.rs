//! The random stimulus of a case: inputs, and writes of words and bits. Called by `generate`.

use super::names::split_bit;
use super::pool::Pool;

pub type Rows = Vec<(i64, Vec<Option<i64>>)>;

/// The columns of the stimulus and its rows.
pub fn stimulus(pool: &mut Pool, scans: i64) -> (Vec<String>, Rows) {
    let mut places: Vec<String> = (0..4).map(|n| format!("X{n}")).collect();
    for _ in 0..pool.rng.below(8) {
        let mut place = match pool.rng.weighted(&[30, 60, 10]) {
            0 => pool.written_bit(),
            1 => pool.written_word(),
            _ => pool.indexed("R"),
        };
        if pool.rng.chance(35)
            && let Some(structure) = pool.owned.last()
        {
            place = structure.accumulator();
        }
        if !places.contains(&place) {
            places.push(place);
        }
    }
    let busy = *pool.rng.pick(&[25, 50, 80]);
    let mut rows = Vec::new();
    for scan in 0..scans {
        if !pool.rng.chance(busy) {
            continue;
        }
        let cells = places.iter().map(|place| {
            let percent = if place.starts_with('X') { 40 } else { 12 };
            pool.rng.chance(percent).then(|| written_value(pool, place))
        });
        rows.push((scan, cells.collect()));
    }
    let columns = places.iter().map(|place| match pool.tags.get(place) {
        Some(tag) => tag.clone(),
        None => place.clone(),
    });
    (columns.collect(), rows)
}

/// A value that the place can hold.
fn written_value(pool: &mut Pool, place: &str) -> i64 {
    if split_bit(place).is_some() {
        return pool.rng.range(0, 1);
    }
    let typed = pool.typed.iter().find(|(name, _)| name == place).map(|(_, area)| *area);
    let owned = pool.owned.iter().find(|owned| owned.accumulator() == place);
    let address = place.split(|c: char| c.is_ascii_digit()).next().unwrap_or_default();
    let letters = typed.or(owned.map(|owned| owned.area)).unwrap_or(address);
    let (low, high) = match letters {
        "V" | "MHR" | "MIR" => (0, 65_535),
        "D" | "CT" | "T" | "R" => (i64::from(i32::MIN), i64::from(i32::MAX)),
        "N" => (-32_768, 32_767),
        _ => return pool.rng.range(0, 1),
    };
    if letters == "N" && pool.rng.chance(70) {
        return *pool.rng.pick(&[32_766, 32_767, 32_767, -32_767, -32_768, -32_768]);
    }
    let value = pool.number().clamp(low, high);
    let (least, most) = pool.limits.get(place).copied().unwrap_or((low, high));
    value.max(least).min(most)
}
