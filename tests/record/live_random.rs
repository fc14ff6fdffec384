//! The real rungd runs random ladders with every kind of external event. Its recordings are
//! executed again: every hash and every value that an operator read must be the same.
//!
//! Tests `RUNGD_RECORD_PROGRAMS` (10) programs from the seed `RUNGD_RECORD_SEED` (1) on,
//! `RUNGD_RECORD_LANES` (4) at a time. `RUNGD_RECORD_KEEP` names a folder that keeps the
//! recordings. `RUNGD_RECORD_VERIFY` names a folder to verify: a release build replays the
//! recordings of a debug build.
//!
//! ```console
//! RUNGD_RECORD_PROGRAMS=1000 cargo test --release --test commands record::live_random -- --nocapture
//! RUNGD_RECORD_VERIFY=DIR cargo test --release --test commands record::live_random -- --ignored --nocapture
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

use serde_json::{Value, json};

use crate::record::live_rig::{
    Operator, engine, is_late, last_scan, loaded, logs, recorded, verified,
};
use rungd_engine::Cell;
use rungd_history::playback::{Playback, Verified};
use rungd_history::record::{RecordedProgram, Recording};
use rungd_language::lower::Symbols;
use rungd_test_support::modbus::Client;
use rungd_test_support::model::case::Case;
use rungd_test_support::model::generate::generate;
use rungd_test_support::model::rng::Rng;
use rungd_test_support::run::{cell, value};
use rungd_test_support::running::live::Live;
use rungd_test_support::running::process::until;
use rungd_test_support::setting::setting;

/// A plant that changes inputs, and is lost while C100 is ON.
const PLANT: &str = r#"
[[device]]
name = "plant"
driver = "simulated"
poll = "3ms"
map = [
  { from = "a.out", to = "X0" },
  { from = "b.out", to = "X1" },
  { from = "c.out", to = "X2" },
  { from = "oven.out", to = "D100" },
  { from = "Y0", to = "oven.in" },
  { from = "C100", to = "fault.gone" },
]
[[device.part]]
name = "a"
kind = "pulse"
pulse = "7ms"
every = "31ms"
[[device.part]]
name = "b"
kind = "pulse"
pulse = "20ms"
every = "90ms"
[[device.part]]
name = "c"
kind = "pulse"
pulse = "2ms"
every = "150ms"
[[device.part]]
name = "oven"
kind = "lag"
gain = 20000
time-constant = "200ms"
[[device.fault]]
name = "gone"
kind = "lost"
"#;

/// The most operands of one request.
const ASKED: usize = 256;

fn controller(rng: &mut Rng) -> String {
    let period = rng.pick(&["1ms", "2ms", "3ms", "5ms", "10ms"]);
    let plant = if rng.chance(60) { PLANT } else { "" };
    format!(
        "[scan]\nperiod = \"{period}\"\n[reload]\nprobation = \"50ms\"\n[modbus-server]\n\
         listen = \"127.0.0.1:0\"\nwritable = [\"MC1..MC2\", \"MHR1..MHR2\"]\n{plant}"
    )
}

/// The values of a scan that an operator read.
struct Sample {
    scan: u64,
    names: Vec<String>,
    values: Vec<Value>,
}

/// A run of the real rungd.
struct Story {
    seed: u64,
    rng: Rng,
    live: Live,
    operator: Operator,
    modbus: Client,
    case: Case,
    samples: Vec<Sample>,
    done: BTreeMap<&'static str, u64>,
}

impl Story {
    fn begin(seed: u64) -> (Story, PathBuf) {
        let (mut rng, case) = (Rng::new(seed), generate(seed));
        let (live, dir) = recorded(&case.ladder(), &controller(&mut rng));
        let mut operator = Operator::new(&live);
        let status = operator.status();
        let modbus = Client::connect(status["devices"]["modbus"]["address"].as_str().unwrap());
        let (samples, done) = (Vec::new(), BTreeMap::new());
        (Story { seed, rng, live, operator, modbus, case, samples, done }, dir)
    }

    /// Causes a random external event, and waits for a few scans.
    fn step(&mut self) {
        let (name, is_done) = match self.rng.weighted(&[30, 14, 14, 14, 5, 4, 4, 2, 5, 1]) {
            0 => ("writes", self.change("write")),
            1 => ("forces", self.change("force")),
            2 => ("releases", self.release()),
            3 => ("modbus", self.modbus()),
            4 => ("stops", self.stop()),
            5 => ("reloads", self.reload(0)),
            6 => ("other programs", self.reload(1)),
            7 => ("rollbacks", self.ask(json!({"do": "rollback"}))),
            8 => ("losses", self.lose()),
            _ => ("overruns", self.overrun()),
        };
        *self.done.entry(name).or_default() += u64::from(is_done);
        let status = self.operator.status();
        if status["mode"] == "STOP" {
            // The ladder may have stopped the controller.
            self.ask(json!({"do": "mode", "to": "run"}));
        } else if self.rng.chance(70) {
            let more = self.rng.below(12) as u64;
            let wanted = status["scans"].as_u64().unwrap() + more;
            let is_there = |status: &Value| status["scans"].as_u64().unwrap() >= wanted;
            self.operator.await_status(|status| is_there(status) || status["mode"] != "RUN");
        }
        self.look();
    }

    fn ask(&mut self, request: Value) -> bool {
        self.operator.ask(&request)["ok"].is_object()
    }

    fn name(&mut self) -> String {
        let names = self.case.watch();
        self.rng.pick(&names).clone()
    }

    /// Writes or forces an operand: first with a word's value, and if that fails with a bit's.
    fn change(&mut self, what: &str) -> bool {
        let operand = self.name();
        let number = match self.rng.below(3) {
            0 => self.rng.range(-40_000, 2_000_000),
            _ => self.rng.range(-3, 9),
        };
        let values = [json!(number), json!(self.rng.chance(50))];
        values.into_iter().any(|v| self.ask(json!({"do": what, "operand": operand, "value": v})))
    }

    fn release(&mut self) -> bool {
        if self.rng.chance(30) {
            return self.ask(json!({"do": "unforce-all"}));
        }
        let operand = self.name();
        self.ask(json!({"do": "unforce", "operand": operand}))
    }

    fn modbus(&mut self) -> bool {
        let [high, low] = (self.rng.next() as u16).to_be_bytes();
        let pdu = match self.rng.below(3) {
            0 => vec![5, 0, low & 1, if high > 99 { 0xff } else { 0 }, 0],
            1 => vec![6, 0, low & 1, high, low],
            _ => vec![16, 0, 0, 0, 2, 4, high, low, low, high],
        };
        self.modbus.try_ask(1, &pdu).is_some_and(|reply| reply[0] < 0x80)
    }

    fn stop(&mut self) -> bool {
        let stopped = self.ask(json!({"do": "mode", "to": "stop"}));
        if self.rng.chance(50) {
            self.change("force");
        }
        stopped && self.ask(json!({"do": "mode", "to": "run"}))
    }

    /// Reloads the ladder with one rung fewer, or a different ladder.
    fn reload(&mut self, other: u64) -> bool {
        let mut case = self.case.clone();
        if other == 1 {
            case = generate(self.seed + 1_000_000 * (1 + self.rng.below(3) as u64));
        } else {
            let at = self.rng.below(case.blocks.len());
            let rungs = &mut case.blocks[at].rungs;
            if !rungs.is_empty() {
                let rung = self.rng.below(rungs.len());
                rungs.remove(rung);
            }
        }
        fs::write(self.live.folder.join("ladder.toml"), case.ladder()).unwrap();
        let reloaded = self.ask(json!({"do": "reload"}));
        if reloaded {
            self.case = case;
        }
        reloaded
    }

    /// Loses the plant or brings it back.
    fn lose(&mut self) -> bool {
        let is_lost = self.rng.chance(50);
        self.ask(json!({"do": "write", "operand": "C100", "value": is_lost}))
    }

    /// Delays a scan by a second.
    fn overrun(&mut self) -> bool {
        let may = cfg!(debug_assertions) && !self.done.contains_key("overruns");
        if may {
            self.live.stall();
            let is_over = |status: &Value| status["scan"]["overruns"] != 0;
            self.operator.await_status(|status| is_over(status) || status["mode"] != "RUN");
        }
        may
    }

    /// Reads all values that the program names, in one scan.
    fn look(&mut self) {
        let mut names = self.case.watch();
        names.truncate(ASKED);
        let answer = self.operator.ask(&json!({"do": "read", "operands": names}));
        if answer["ok"]["mode"] != "RUN" {
            return;
        }
        let scan = answer["ok"]["scans"].as_u64().unwrap();
        let values = answer["ok"]["values"].as_array().unwrap();
        let values = values.iter().map(|value| value["value"].clone()).collect();
        self.samples.push(Sample { scan, names, values });
    }

    /// Ends the controller, in order or in FAULT.
    fn end(&mut self) {
        if cfg!(debug_assertions) && self.rng.chance(15) {
            fs::write(self.live.folder.join("faults"), "scan").unwrap();
            // The ladder may have stopped the controller, and nothing would be executed that fails.
            until(|| {
                let status = self.operator.status();
                let stopped = status["mode"] == "STOP";
                if stopped {
                    self.ask(json!({"do": "mode", "to": "run"}));
                }
                status["mode"] == "FAULT"
            });
            self.done.insert("faults", 1);
            self.live.signal("TERM");
            self.live.child.wait().unwrap();
        } else {
            self.live.end();
        }
    }
}

/// Whether the value that an operator read is the engine's value.
fn as_read(content: i64, cell: Cell, symbols: &Symbols, read: &Value) -> bool {
    match read {
        Value::Bool(on) => content == i64::from(*on),
        Value::Number(number) => {
            let text = symbols.layout.text(cell, content as i32);
            let real = text.parse::<f64>().map(|real| real as f32);
            number.to_string() == text || number.as_f64().map(|read| read as f32) == real.ok()
        }
        // A real without a number, for example infinity.
        other => other.as_str() == Some(&symbols.layout.text(cell, content as i32)),
    }
}

/// Executes the recording again, and compares each sample with the memory of its scan. Returns the
/// number of compared values and of samples found.
fn assert_samples(recording: Recording, samples: &[Sample], seed: u64) -> (u64, usize) {
    let programs: Vec<_> = (0..recording.count()).map(|at| recording.program(at).clone()).collect();
    let mut symbols: Option<(std::sync::Arc<RecordedProgram>, _)> = None;
    let (count, mut compared, mut found) = (recording.count(), 0, 0);
    let mut replay = Playback::new(recording, engine);
    for at in 0..count {
        let visited = replay.scans(at..at + 1, |scan, engine| {
            let of_scan = samples.iter().filter(|sample| sample.scan == scan.number);
            for sample in of_scan {
                let program = &programs[scan.section];
                let known = symbols.take().filter(|(of, _)| of == program);
                let (_, (program, symbols, _)) = symbols
                    .insert(known.unwrap_or_else(|| (program.clone(), loaded(program).unwrap())));
                for (name, read) in sample.names.iter().zip(&sample.values) {
                    let cell = cell(program, symbols, name).unwrap();
                    let content = value(engine.image(), cell);
                    let is_same = as_read(content, cell, symbols, read);
                    assert!(is_same, "seed {seed}, {scan:?}: {name} was {read}, not {content}");
                    compared += 1;
                }
                found += 1;
            }
            ControlFlow::Continue(())
        });
        visited.unwrap();
    }
    (compared, found)
}

#[derive(Default)]
struct Sum {
    programs: u64,
    verified: Verified,
    values: u64,
    done: BTreeMap<&'static str, u64>,
}

impl Sum {
    fn add(&mut self, verified: &Verified, values: u64, done: BTreeMap<&'static str, u64>) {
        let sum = &mut self.verified;
        self.programs += 1;
        self.values += values;
        sum.scans += verified.scans;
        sum.sections += verified.sections;
        sum.compared += verified.compared;
        sum.gaps += verified.gaps;
        done.into_iter().for_each(|(name, count)| *self.done.entry(name).or_default() += count);
    }

    fn told(&self, begin: Instant) {
        let Verified { scans, sections, compared, gaps, .. } = self.verified;
        println!(
            "{} programs, {scans} scans, {sections} sections, {compared} hashes and {} values \
             that were read compared, {gaps} gaps, no difference; {:.0} s; {:?}",
            self.programs,
            self.values,
            begin.elapsed().as_secs_f64(),
            self.done
        );
    }
}

/// Runs, records and verifies one program.
fn one(seed: u64, sum: &Mutex<Sum>) {
    let (mut story, dir) = Story::begin(seed);
    for _ in 0..20 + story.rng.below(30) {
        story.step();
    }
    let scans = story.operator.scans();
    let asked = Instant::now();
    story.end();
    let is_late = is_late(asked);
    if let Some(keep) = std::env::var_os("RUNGD_RECORD_KEEP") {
        let keep = Path::new(&keep).join(seed.to_string());
        fs::create_dir_all(&keep).unwrap();
        for log in logs(&dir) {
            fs::copy(&log, keep.join(log.file_name().unwrap())).unwrap();
        }
    }
    let recording = Recording::open(&dir).unwrap();
    assert!(recording.flaws.is_empty(), "seed {seed}: {:?}", recording.flaws);
    let verified = verified(&dir, false);
    let (last, gaps) = (last_scan(&recording), verified.gaps);
    assert!(last >= scans || is_late, "seed {seed}: {last} of {scans}, {:?}", story.done);
    assert!(gaps > 0 || verified.scans == last, "seed {seed}: {verified:?} of {last}");
    let (values, found) = assert_samples(recording, &story.samples, seed);
    let is_whole = gaps == 0 && !is_late;
    assert!(found == story.samples.len() || !is_whole, "seed {seed}: a scan is not there");
    sum.lock().unwrap().add(&verified, values, std::mem::take(&mut story.done));
}

#[test]
fn a_recorded_run_replays_exactly() {
    let (first, begin) = (setting("RUNGD_RECORD_SEED", 1), Instant::now());
    let (next, end) = (AtomicU64::new(first), first + setting("RUNGD_RECORD_PROGRAMS", 10));
    let sum = Mutex::new(Sum::default());
    thread::scope(|scope| {
        for _ in 0..setting("RUNGD_RECORD_LANES", 4) {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= end {
                        return;
                    }
                    one(seed, &sum);
                }
            });
        }
    });
    let sum = sum.into_inner().unwrap();
    sum.told(begin);
    assert!(
        sum.programs < 10
            || ["writes", "forces", "stops", "modbus"].iter().all(|name| sum.done[name] > 0)
    );
}

/// Verifies recordings of a different build.
#[test]
#[ignore = "verifies the recordings of RUNGD_RECORD_VERIFY, a folder of folders"]
fn a_recorded_run_of_another_build_replays_exactly() {
    let Some(folder) = std::env::var_os("RUNGD_RECORD_VERIFY") else { return };
    let (mut sum, begin) = (Sum::default(), Instant::now());
    for entry in fs::read_dir(folder).unwrap() {
        sum.add(&verified(&entry.unwrap().path(), false), 0, BTreeMap::new());
    }
    assert!(sum.programs > 0);
    sum.told(begin);
}
