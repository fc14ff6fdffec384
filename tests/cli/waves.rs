//! `rungd sim --trace x.vcd`: a reader of IEEE 1364 reads traces of random programs, and finds the
//! values of the CSV of the same run.
//!
//! `RUNGD_WAVES` (20) programs from seed 1 on.

use rungd_test_support::model::generate::generate;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The variables of a VCD in order, and their changes.
struct Waves {
    /// Type, short name, name.
    variables: Vec<[String; 3]>,
    /// The time in µs, and the changes by short names.
    changes: Vec<(u64, HashMap<String, String>)>,
}

fn read(vcd: &str) -> Waves {
    let mut tokens = vcd.split_whitespace();
    let mut waves = Waves { variables: Vec::new(), changes: Vec::new() };
    while let Some(token) = tokens.next() {
        let body: Vec<&str> = tokens.by_ref().take_while(|token| *token != "$end").collect();
        match token {
            "$version" | "$comment" | "$upscope" => {}
            "$timescale" => assert_eq!(body, ["1", "us"]),
            "$scope" => assert_eq!(body, ["module", "rungd"]),
            "$var" => {
                let [kind, bits, code, name] = body[..] else { panic!("{body:?}") };
                let bits_of = [("wire", "1"), ("integer", "32"), ("real", "64")];
                assert!(bits_of.contains(&(kind, bits)), "{kind} {bits}");
                let rest = |c: char| c.is_ascii_alphanumeric() || c == '_';
                assert!(name.chars().all(rest) && !name.starts_with(|c: char| c.is_numeric()));
                waves.variables.push([kind, code, name].map(str::to_owned));
            }
            "$enddefinitions" => break,
            other => panic!("{other}"),
        }
    }
    while let Some(token) = tokens.next() {
        let (first, rest) = token.split_at(1);
        let mut change = |code: &str, value: String| {
            let (_, changes) = waves.changes.last_mut().unwrap();
            assert!(changes.insert(code.to_owned(), value).is_none(), "{code} twice at a time");
        };
        match first {
            "#" => {
                let time_us = rest.parse().unwrap();
                let last = waves.changes.last().map(|(time_us, _)| *time_us);
                assert!(last.is_none_or(|last| last < time_us));
                waves.changes.push((time_us, HashMap::new()));
            }
            "$" => assert!(matches!(rest, "dumpvars" | "end"), "{rest}"),
            "0" | "1" => change(rest, first.to_owned()),
            "b" => {
                let word = u32::from_str_radix(rest, 2).unwrap().cast_signed();
                change(tokens.next().unwrap(), word.to_string());
            }
            "r" => change(tokens.next().unwrap(), rest.to_owned()),
            other => panic!("{other}"),
        }
    }
    waves
}

/// A CSV made of the waves, with the rows of `csv`.
fn as_csv(waves: &Waves, csv: &str) -> String {
    let mut lines = csv.lines();
    let mut text = format!("{}\n", lines.next().unwrap());
    let mut values: HashMap<&str, &str> = HashMap::new();
    let mut next = 0;
    let mut stops = "0";
    for line in lines {
        let cells: Vec<&str> = line.split(',').take(2).collect();
        let (ms, fraction) = cells[1].split_once('.').unwrap_or((cells[1], ""));
        let us =
            ms.parse::<u64>().unwrap() * 1000 + format!("{fraction:0<3}").parse::<u64>().unwrap();
        // The row `stop` has the time of the last scan in the CSV, and is 1 µs later in the waves.
        let us = us + u64::from(cells[0] == "stop");
        while let Some((_, changes)) = waves.changes.get(next).filter(|(time, _)| *time <= us) {
            for (code, value) in changes {
                let old = values.insert(code, value);
                assert_ne!(old, Some(value.as_str()), "{code} does not change");
            }
            next += 1;
        }
        let (stop, operands) = waves.variables.split_last().unwrap();
        let shown = operands.iter().map(|[_, code, _]| format!(",{}", values[code.as_str()]));
        text.push_str(&format!("{},{}{}\n", cells[0], cells[1], shown.collect::<String>()));
        stops = values[stop[1].as_str()];
        assert_eq!(stops == "1", cells[0] == "stop");
    }
    assert_eq!(next, waves.changes.len());
    assert!(["0", "1"].contains(&stops));
    text
}

#[test]
fn a_vcd_trace_contains_the_values_of_the_csv_trace() {
    let count = std::env::var("RUNGD_WAVES").ok().and_then(|text| text.parse().ok()).unwrap_or(20);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("waves");
    std::fs::create_dir_all(&folder).unwrap();
    let (mut reals, mut stops) = (0, 0);
    for seed in 1..=count {
        let case = generate(seed);
        let written = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        written("ladder.toml", &case.ladder());
        written("stimulus.csv", &case.stimulus());
        let trace = |to: &str| {
            run(&folder, &["--trace", to], &case.arguments(&case.watch()));
            std::fs::read_to_string(folder.join(to)).unwrap()
        };
        let (csv, vcd) = (trace("trace.csv"), trace("trace.vcd"));
        let waves = read(&vcd);
        reals += waves.variables.iter().filter(|[kind, ..]| kind == "real").count();
        stops += usize::from(csv.contains("\nstop,"));
        assert_eq!(as_csv(&waves, &csv), csv, "seed {seed}");
    }
    assert!(reals > 0 && stops > 0, "{reals} reals, {stops} stops");
}

fn run(folder: &Path, trace: &[&str], arguments: &[String]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.current_dir(folder).args(["sim", "ladder.toml", "--stimulus", "stimulus.csv"]);
    let output = command.args(trace).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
