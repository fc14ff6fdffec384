//! The stimulus, the watch list and the trace of one simulation.

use super::clock::{Clock, words};
use super::exec::Sim;
use super::names::Names;
use super::parse::load;
use super::place::{Area, Loc};

pub struct Options<'a> {
    pub period: i64,
    pub scans: i64,
    pub stop: bool,
    pub clock: Clock,
    pub watch: &'a [String],
    pub stimulus: &'a str,
}

struct Row {
    scan: i64,
    inputs: Vec<(Loc, i64)>,
    writes: Vec<(Loc, i64)>,
}

fn stimulus(text: &str, names: &Names) -> Result<Vec<Row>, String> {
    let mut lines = text.lines();
    let header = lines.next().unwrap_or("scan");
    let columns = header.split(',').skip(1).map(|name| names.place(name));
    let columns = columns.collect::<Result<Vec<Loc>, String>>()?;
    let mut rows = Vec::new();
    for line in lines {
        let mut cells = line.split(',');
        let scan = cells.next().and_then(|cell| cell.parse().ok());
        let scan = scan.ok_or_else(|| format!("no scan in `{line}`"))?;
        let mut row = Row { scan, inputs: Vec::new(), writes: Vec::new() };
        for (loc, cell) in columns.iter().zip(cells).filter(|(_, cell)| !cell.is_empty()) {
            let value = cell.parse().map_err(|error| format!("`{cell}`: {error}"))?;
            let list = if loc.area == Area::X { &mut row.inputs } else { &mut row.writes };
            list.push((*loc, value));
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Runs a ladder and returns its trace as CSV.
pub fn simulate(ladder: &str, options: &Options) -> Result<String, String> {
    let loaded = load(ladder)?;
    let rows = stimulus(options.stimulus, &loaded.names)?;
    let watched = options.watch.iter().map(|name| loaded.names.place(name));
    let watched = watched.collect::<Result<Vec<Loc>, String>>()?;
    let mut sim = Sim::new(&loaded.program);
    let mut trace = format!("scan,time_ms,{}\n", options.watch.join(","));
    for scan in 0..options.scans {
        let now = scan * options.period;
        let last = sim.stop_asked || (options.stop && scan == options.scans - 1);
        let (mut inputs, mut writes) = (Vec::new(), Vec::new());
        for row in rows.iter().filter(|row| row.scan == scan) {
            inputs.extend(&row.inputs);
            writes.extend(&row.writes);
        }
        sim.local = words(options.clock, now);
        sim.scan(scan, now, last, &inputs, &writes);
        trace.push_str(&line(&scan.to_string(), now, &sim, &watched));
        if last {
            sim.stop();
            trace.push_str(&line("stop", now, &sim, &watched));
            break;
        }
    }
    Ok(trace)
}

fn line(scan: &str, now: i64, sim: &Sim, watched: &[Loc]) -> String {
    let values = watched.iter().map(|loc| sim.memory.text(*loc));
    format!("{scan},{now},{}\n", values.collect::<Vec<String>>().join(","))
}
