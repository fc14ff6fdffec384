//! `restart` and `power-cut` of a test file agree with the real binary that is ended or killed, and
//! started again: the same inputs give the same memory afterwards.
//!
//! The real controller runs first. Its memory after each start becomes an `expect:` of a test file,
//! which `rungd test` must pass. The ladder does not depend on time: each input lasts for at least
//! one scan, and further scans of the same inputs change nothing. `RUNGD_RIG_RUNS` and
//! `RUNGD_RIG_SEED` set the number of runs and the first seed of a long run.

use std::fmt::Write as _;
use std::fs;
use std::process::Command;

use crate::retain::memory::{Plant, Running, ask};
use rungd_test_support::setting::setting;

const LADDER: &str = r#"
[tags]
inc = { at = "X0" }
dec = { at = "X1" }
rst = { at = "X2" }
set = { at = "X3" }
count = { at = "CT0" }
down = { at = "CT1" }
both = { at = "CT2" }
group = { at = "CT3" }
sens = { at = "N0" }
latch = { at = "C0" }
seal = { at = "C1" }
toggle = { at = "C2" }
bits = { at = "C10", count = 4 }
total = { at = "D0" }
starts = { at = "D1" }
ends = { at = "D2" }
[[program]]
name = "Main"
rung = [
  { leg.up = ["inc"], leg.rst = ["rst"], do = ["CNT count preset=3"] },
  { leg.dn = ["dec"], leg.rst = ["rst"], do = ["CNTDN down preset=5"] },
  { leg.up = ["inc"], leg.dn = ["dec"], leg.rst = ["rst"], do = ["UDC both up-preset=2 dn-preset=-2"] },
  { leg.up = ["inc"], leg.dn = ["dec"], do = ["UDCG group up-preset=4 dn-preset=-1"] },
  { when = ["inc"], do = ["CTU sens preset=2"] },
  { when = ["dec"], do = ["CTD sens preset=2"] },
  { when = ["set"], do = ["SET latch"] },
  { when = ["rst"], do = ["RST latch"] },
  { when = ["set | seal", "!rst"], do = ["OUT seal"] },
  { when = ["dec"], do = ["PONOFF toggle"] },
  { leg.data = ["set | latch"], leg.clk = ["inc"], leg.rst = ["$Off"], do = ["SR bits"] },
  { when = ["rise(inc)"], do = ["ADD total 1 to=total"] },
]
[[task]]
name = "FirstScan"
rung = [{ when = ["$On"], do = ["ADD starts 1 to=starts"] }]
[[task]]
name = "LastScan"
rung = [{ when = ["$On"], do = ["ADD ends 1 to=ends"] }]
"#;

/// The memory that can be retained, as `[retain] ranges` writes it.
const RANGES: [&str; 12] =
    ["CT0", "CT1", "CT2", "CT3", "N0", "C0", "C1", "C2", "C10..C13", "D0", "D1", "D2"];

/// The operands that are compared.
const OPERANDS: [&str; 26] = [
    "count.Acc",
    "count.Done",
    "count.Zero",
    "count.Reset",
    "down.Acc",
    "down.Done",
    "both.Acc",
    "both.Done",
    "both.DnDone",
    "group.Acc",
    "group.Done",
    "group.DnDone",
    "N0.ACC",
    "N0.DN",
    "N0.CU",
    "N0.OV",
    "latch",
    "seal",
    "toggle",
    "C10",
    "C11",
    "C12",
    "C13",
    "total",
    "starts",
    "ends",
];

const INPUTS: [&str; 4] = ["inc", "dec", "rst", "set"];

/// Numbers from a seed (SplitMix64).
struct Draw(u64);

impl Draw {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % limit
    }
}

/// Every operand with its value, as a condition.
fn expected(plant: &Plant) -> String {
    let conditions = OPERANDS.map(|operand| {
        let said = ask(plant, &["read", operand]);
        let value = said.split_whitespace().last().expect("a value");
        match value {
            "ON" => operand.to_owned(),
            "OFF" => format!("!{operand}"),
            number => format!("{operand} == {number}"),
        }
    });
    conditions.join(" & ")
}

fn start(plant: &Plant) -> Running {
    let running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    running
}

#[test]
fn simulated_restarts_and_power_cuts_match_the_real_process() {
    let (runs, seed) = (setting("RUNGD_RIG_RUNS", 3), setting("RUNGD_RIG_SEED", 1));
    for run in 0..runs {
        story(seed + run);
    }
}

/// Makes some inputs and starts a new process, three times.
fn story(seed: u64) {
    let mut draw = Draw(seed);
    let ranges: Vec<&str> = RANGES.into_iter().filter(|_| draw.below(3) > 0).collect();
    let keeps = format!("ranges = {ranges:?}\ninterval = \"10ms\"\ncold-start = \"run\"\n");
    let controller = format!(
        "scan.period = \"10ms\"\nscan.watchdog = \"20s\"\n[retain]\n{keeps}file = \"memory\"\n\
         [operator]\nsocket = \"op\"\n"
    );
    let plant = Plant::new(LADDER, &controller);
    let mut steps = String::from("    \"run 1 scans\",\n");
    let mut running = start(&plant);
    for _ in 0..3 {
        for _ in 0..2 + draw.below(8) {
            let input = INPUTS[draw.below(4) as usize];
            for value in ["1", "0"] {
                ask(&plant, &["write", input, value]);
                let _ = writeln!(steps, "    \"set {input} {value}\",\n    \"run 2 scans\",");
            }
        }
        let is_cut = draw.below(2) == 0;
        match is_cut {
            true => {
                ask(&plant, &["retain", "save"]);
                running.kill();
                steps += "    \"power-cut\",\n";
            }
            false => {
                running.stop();
                steps += "    \"restart\",\n";
            }
        }
        running = start(&plant);
        let _ = writeln!(steps, "    \"run 2 scans\",\n    \"expect: {}\",", expected(&plant));
    }
    running.stop();
    let test = format!(
        "ladder = [\"ladder.toml\"]\n[retain]\n{keeps}\n[[scenario]]\nname = \"seed {seed}\"\n\
         steps = [\n{steps}]\n"
    );
    let path = plant.0.join("rig.test.toml");
    fs::write(&path, &test).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_rungd")).arg("test").arg(&path).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = format!("{}{}", text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "seed {seed}:\n{said}\n{test}");
}

/// A preset that a later rung terminates, and a Sensaphone counter that only counts up.
const PRESETS: &str = "[[program]]\nname = \"Main\"\nrung = [\n\
    { leg.dn = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNTDN CT0 preset=CT1.Acc\"] },\n\
    { leg.up = [\"X2\"], leg.rst = [\"$Off\"], do = [\"CNT CT1 preset=100\"] },\n\
    { when = [\"X3\"], do = [\"CTU N0 preset=9\"] },\n]\n";

#[test]
fn a_power_cut_and_a_restart_give_equal_presets_and_enable_bits() {
    let plant = Plant::new(PRESETS, "");
    let steps = |end: &str| {
        format!(
            "[[scenario]]\nname = \"{end}\"\nsteps = [\"run 1 scans\",\n\
             \"set X2 ON\", \"run 1 scans\", \"set X2 OFF\", \"run 1 scans\", \"set X2 ON\",\n\
             \"set X3 ON\", \"force N0.CD ON\", \"run 1 scans\", \"unforce N0.CD\", \"run 2s\",\n\
             \"expect: CT1.Acc == 2 & N0.CD & N0.CU\", \"{end}\", \"set X3 OFF\",\n\
             \"expect: CT0.Acc == 2 & CT1.Acc == 0 & N0.CD & !N0.CU & N0.ACC == 1\"]\n"
        )
    };
    let test = format!(
        "ladder = [\"ladder.toml\"]\n[retain]\nranges = [\"CT0\", \"CT1\", \"N0\"]\n{}{}",
        steps("restart"),
        steps("power-cut")
    );
    let path = plant.0.join("presets.test.toml");
    fs::write(&path, &test).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_rungd")).arg("test").arg(&path).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    assert!(output.status.success(), "{}\n{test}", String::from_utf8_lossy(&said));
}
