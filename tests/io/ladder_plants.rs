//! Plants that are ladders: the same in a test, in a simulation and under `rungd run`, by random
//! pairs of controller and plant; and the same as a plant of parts, for what both can say.
//! `RUNGD_LADDER_PAIRS` is the number of pairs.
//!
//! Within virtual time whole traces are compared. Under `rungd run` an exchange takes some time, so
//! the pairs pass values to and fro by a handshake, whose result does not depend on it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use rungd_base::random::SplitMix64;
use rungd_test_support::folder::TestFolder;
use rungd_test_support::running::live::{self, Live};

/// The rounds of a handshake.
const ROUNDS: u32 = 12;

fn below(random: &mut SplitMix64, count: u32) -> u32 {
    (random.next() % u64::from(count)) as u32
}

fn one_of<'t>(random: &mut SplitMix64, all: &[&'t str]) -> &'t str {
    all[below(random, all.len() as u32) as usize]
}

/// A random formula of operands: `max((a + 3) * b % 997, -5)`.
fn formula(random: &mut SplitMix64, operands: &[&str]) -> String {
    let mut text = one_of(random, operands).to_owned();
    for _ in 0..1 + below(random, 4) {
        let (number, other) = (below(random, 40) + 1, one_of(random, operands));
        text = match below(random, 6) {
            0 => format!("({text} + {other})"),
            1 => format!("({text} * {number} % 997)"),
            2 => format!("max({text}, {other} - {number})"),
            3 => format!("({text} - {other} / {number})"),
            4 => format!("if({other} > {number}, {text}, {number} - {text})"),
            _ => format!("min({text}, {number} + {other})"),
        };
    }
    format!("{text} % 100000")
}

/// A ladder that answers: when `when` holds, it computes its outputs, and then does `then`. `own`:
/// what only it has.
fn side(random: &mut SplitMix64, when: &str, then: &str) -> String {
    let operands = ["in1", "in2", "state", "bit1", "bit2", "round", "real_in"];
    let mut rung = String::new();
    for target in ["out1", "out2", "state"] {
        let _ = write!(rung, "\"MATH {target} = {}\", ", formula(random, &operands));
    }
    let real = formula(random, &operands);
    let _ = write!(
        rung,
        "\"MATH real_out = ({real} + real_in + in1 + in2) / 8.0 % 1000.0\", \"{then}\""
    );
    let first = below(random, 5) + 2;
    format!(
        "[tags]\nround = {{ at = \"D0\" }}\nanswered = {{ at = \"D1\" }}\nin1 = {{ at = \"D2\" }}\n\
         in2 = {{ at = \"D3\" }}\nout1 = {{ at = \"D4\" }}\nout2 = {{ at = \"D5\" }}\n\
         state = {{ at = \"D6\", initial = {first} }}\nreal_in = {{ at = \"R0\" }}\n\
         real_out = {{ at = \"R1\" }}\nbit1 = {{ at = \"X0\" }}\nbit2 = {{ at = \"X1\" }}\n\
         free = {{ at = \"D9\" }}\n\
         [[program]]\nname = \"Main\"\nrung = [\n{{ when = [{when}], do = [{rung}] }},\n\
         {{ when = [\"out1 % 2 == 1\"], do = [\"OUT Y0\"] }},\n\
         {{ when = [\"out2 > {first}\"], do = [\"OUT Y1\"] }},\n{}]\n",
        free_rungs(random)
    )
}

/// Rungs that do not depend on the handshake: timers, counters, edges.
fn free_rungs(random: &mut SplitMix64) -> String {
    let mut text = "{ when = [\"bit1 | bit2\"], do = [\"ADD free 1 to=free\"] },\n".to_owned();
    for at in 0..1 + below(random, 3) {
        let preset = 1 + below(random, 60);
        let contact = one_of(random, &["bit1", "!bit2", "$On", "free > 3", "T0.Done"]);
        let row = match below(random, 3) {
            0 => format!(
                "{{ when = [\"{contact}\", \"!T{at}.Done\"], do = [\"TMR T{at} preset={preset}ms\"] }},"
            ),
            1 => {
                format!("{{ when = [\"rise(bit1)\"], do = [\"ADD D1{at} {preset} to=D1{at}\"] }},")
            }
            _ => format!(
                "{{ when = [\"{contact}\"], do = [\"MATH free = (free * 5 + {preset}) % 8191\"] }},"
            ),
        };
        let _ = writeln!(text, "{row}");
    }
    text
}

/// A controller, its plant, and the rest of the controller file.
struct Pair {
    ladder: String,
    plant: String,
    controller: String,
}

impl Pair {
    fn draw(random: &mut SplitMix64) -> Pair {
        let begins = format!("\"round == answered\", \"round < {ROUNDS}\"");
        let ladder = side(random, &begins, "ADD round 1 to=round");
        let plant = side(random, "\"round != answered\"", "MOVE round to=answered");
        let ms = ["1ms", "2ms", "3ms", "5ms", "7ms"];
        let (period, own, poll) = (one_of(random, &ms), one_of(random, &ms), one_of(random, &ms));
        let controller = format!(
            "[scan]\nperiod = \"{period}\"\n\
             [[device]]\nname = \"plant\"\ndriver = \"ladder\"\nladder = [\"plant.toml\"]\n\
             period = \"{own}\"\npoll = \"{poll}\"\nmap = [\n\
             {{ from = \"round\", to = \"plant.round\" }},\n\
             {{ from = \"plant.answered\", to = \"answered\" }},\n\
             {{ from = \"out1\", to = \"plant.in1\" }},\n\
             {{ from = \"out2\", to = \"plant.in2\" }},\n\
             {{ from = \"plant.out1\", to = \"in1\" }},\n\
             {{ from = \"plant.out2\", to = \"in2\", offset = 3 }},\n\
             {{ from = \"real_out\", to = \"plant.real_in\" }},\n\
             {{ from = \"plant.real_out\", to = \"real_in\" }},\n\
             {{ from = \"Y0..Y1\", to = \"plant.X0..X1\" }},\n\
             {{ from = \"plant.Y0..Y1\", to = \"bit1..bit2\" }},\n]\n"
        );
        Pair { ladder, plant, controller }
    }

    /// A folder with the files.
    fn folder(&self) -> PathBuf {
        let folder = live::folder(&self.ladder, &self.controller);
        std::fs::write(folder.join("plant.toml"), &self.plant).expect("writable");
        folder
    }
}

fn rungd(folder: &Path, args: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.args(args).current_dir(folder).output().expect("rungd runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = text(&output.stderr);
    assert!(output.status.success(), "{args:?}: {said}{}", text(&output.stdout));
    text(&output.stdout)
}

/// What a trace shows: its rows, each without its first two columns.
fn rows(csv: &str) -> Vec<String> {
    let cells = |line: &str| line.splitn(3, ',').nth(2).unwrap_or_default().to_owned();
    csv.lines().skip(1).map(cells).collect()
}

const SCANS: &str = "900";
const WATCHED: &str =
    "round,answered,in1,in2,out1,out2,state,real_in,real_out,bit1,bit2,free,Y0,Y1";

/// The trace of a simulation, and the values at its end.
fn simulated(folder: &Path) -> Vec<String> {
    let args = ["sim", "controller.toml", "--scans", SCANS, "--watch", WATCHED];
    rows(&rungd(folder, &args))
}

/// The trace of a test.
fn tested(folder: &Path) -> Vec<String> {
    let text = format!(
        "controller = \"controller.toml\"\n[[scenario]]\nname = \"pair\"\nsteps = [\n\
         \"run {SCANS} scans\"]\n"
    );
    std::fs::write(folder.join("pair.test.toml"), text).expect("writable");
    rungd(folder, &["test", "pair.test.toml", "--trace", "traces"]);
    let traces = std::fs::read_dir(folder.join("traces")).expect("traces");
    let path = traces.map(|entry| entry.expect("a trace").path()).next().expect("one");
    let csv = std::fs::read_to_string(path).expect("text");
    columns(&csv)
}

/// The rows of a trace with the watched columns, in their order.
fn columns(csv: &str) -> Vec<String> {
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let at = |name: &str| header.iter().position(|known| *known == name);
    let wanted: Vec<usize> = WATCHED
        .split(',')
        .map(|name| at(name).unwrap_or_else(|| panic!("{name}: {header:?}")))
        .collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        wanted.iter().map(|at| cells[*at]).collect::<Vec<_>>().join(",")
    };
    lines.map(row).collect()
}

/// The values behind the handshake, without what goes on by itself.
fn result(row: &str) -> (String, String) {
    let cells: Vec<&str> = row.split(',').collect();
    let names: Vec<&str> = WATCHED.split(',').collect();
    let kept = names.iter().zip(&cells).filter(|(name, _)| **name != "free");
    let on_off = |(name, cell): (&&str, &&str)| match (*name, *cell) {
        ("bit1" | "bit2" | "Y0" | "Y1", "1") => "ON".to_owned(),
        ("bit1" | "bit2" | "Y0" | "Y1", _) => "OFF".to_owned(),
        (_, value) => value.to_owned(),
    };
    let names = kept.clone().map(|(name, _)| *name).collect::<Vec<_>>().join(" ");
    (names, kept.map(on_off).collect::<Vec<_>>().join(" "))
}

#[test]
fn random_pairs_of_ladders_do_the_same_in_test_sim_and_run() {
    let pairs = std::env::var("RUNGD_LADDER_PAIRS").ok().and_then(|text| text.parse().ok());
    let mut random = SplitMix64(46);
    let mut moved = 0;
    for number in 0..pairs.unwrap_or(4) {
        let pair = Pair::draw(&mut random);
        let folder = pair.folder();
        let simulated = simulated(&folder);
        let about = format!("pair {number}: {}", folder.display());
        assert_eq!(tested(&folder), simulated, "{about}");
        let last = simulated.last().expect("rows");
        assert!(last.starts_with(&format!("{ROUNDS},{ROUNDS},")), "{about}: {last}");
        let live = Live::of(folder.clone(), live::run(&folder, &[]));
        let (names, values) = result(last);
        live.await_values(&names, &values);
        moved += simulated.windows(2).filter(|rows| rows[0] != rows[1]).count();
        drop(live);
        let _ = std::fs::remove_dir_all(folder);
    }
    assert!(moved > 40, "{moved} changes");
}

/// A motor, a lamp and a tank, as parts that move every millisecond.
const PARTS: &str = r#"
driver = "simulated"
map = [
  { from = "Y0", to = "motor.run" }, { from = "Y1", to = "motor.trip" }, { from = "Y2", to = "motor.reset" },
  { from = "D0", to = "tank.fill" }, { from = "Y3", to = "tank.drain" }, { from = "Y4", to = "lamp.in" },
  { from = "motor.running", to = "X0" }, { from = "motor.tripped", to = "X1" }, { from = "tank.level", to = "D1" },
  { from = "tank.high", to = "X2" }, { from = "lamp.out", to = "X3" }, { from = "clock.out", to = "X4" },
]
[[device.part]]
name = "motor"
kind = "motor"
after = "60ms"
release = "40ms"
[[device.part]]
name = "tank"
kind = "tank"
capacity = 1000
initial = 300
fill-rate = 150
drain-rate = 90
switches = { high = 700 }
[[device.part]]
name = "lamp"
kind = "delay"
after = "35ms"
invert = true
[[device.part]]
name = "clock"
kind = "pulse"
pulse = "130ms"
every = "310ms"
offset = "50ms"
"#;

/// The same as a ladder of a millisecond.
const AS_LADDER: &str = r#"
driver = "ladder"
ladder = ["plant.toml"]
period = "1ms"
map = [
  { from = "Y0..Y4", to = "plant.X0..X4" }, { from = "D0", to = "plant.opening" },
  { from = "plant.running", to = "X0" }, { from = "plant.tripped", to = "X1" }, { from = "plant.level", to = "D1" },
  { from = "plant.Y2..Y4", to = "X2..X4" },
]
"#;

const PLANT_LADDER: &str = r#"
[tags]
run      = { at = "X0" }
trip     = { at = "X1" }
reset    = { at = "X2" }
drain    = { at = "X3" }
lamp     = { at = "X4" }
opening  = { at = "D0" }
running  = { at = "C0" }
tripped  = { at = "C1" }
runs     = { at = "C2" }
content  = { at = "D1", initial = 300000000, doc = "Millionths" }
level    = { at = "D2" }
shines   = { at = "C3" }
on       = { type = "timer" }
off      = { type = "timer" }
lit      = { type = "timer" }
dark     = { type = "timer" }
ms       = { at = "D3", initial = -51 }
[[program]]
name = "Main"
rung = [
  { when = ["trip | (tripped & !reset)"], do = ["OUT tripped"] },
  { when = ["run", "!tripped"], do = ["OUT runs"] },
  { when = ["runs", "!running"], do = ["TMR on preset=60ms"] },
  { when = ["!runs", "running"], do = ["TMR off preset=40ms"] },
  { when = ["on.Done"], do = ["SET running"] },
  { when = ["off.Done"], do = ["RST running"] },
  { when = ["$On"], do = ["MATH content = min(max(content + max(min(opening, 1000), 0) * 150 - drain * 90000, 0), 1000000000)",
      "MATH level = content / 1000000"] },
  { when = ["content >= 700000000"], do = ["OUT Y2"] },
  { when = ["lamp", "!shines"], do = ["TMR lit preset=35ms"] },
  { when = ["!lamp", "shines"], do = ["TMR dark preset=35ms"] },
  { when = ["lit.Done"], do = ["SET shines"] },
  { when = ["dark.Done"], do = ["RST shines"] },
  { when = ["!shines"], do = ["OUT Y3"] },
  { when = ["$On"], do = ["ADD ms 1 to=ms"] },
  { when = ["ms == 310"], do = ["MOVE 0 to=ms"] },
  { when = ["ms >= 0 & ms < 130"], do = ["OUT Y4"] },
]
"#;

/// A controller that moves all commands of the plant, in a loop with it.
const MOVER: &str = r#"
[ladder]
devices = ["plant"]
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["MATH D9 = (D9 * 1103 + 12345 + D1) % 65536", "ADD D8 1 to=D8"] },
  { when = ["D9 % 1000 < 40"], do = ["MATH D0 = D9 % 1500 - 200"] },
  { when = ["D8 % 37 < 22", "!X1"], do = ["OUT Y0"] },
  { when = ["D9 % 211 == 3"], do = ["OUT Y1"] },
  { when = ["D8 % 50 == 0"], do = ["OUT Y2"] },
  { when = ["X2 | (Y3 & D1 > 350)"], do = ["OUT Y3"] },
  { when = ["X4", "D9 % 16 < 13"], do = ["OUT Y4"] },
  { when = ["X0 & X3"], do = ["ADD D7 1 to=D7"] },
]
"#;

#[test]
fn a_plant_as_a_ladder_moves_as_the_same_plant_of_parts() {
    let folder = TestFolder::new("ladder-and-parts");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("writable");
    };
    write("main.toml", MOVER);
    write("plant.toml", PLANT_LADDER);
    for (poll, period) in [("10ms", "10ms"), ("1ms", "10ms"), ("7ms", "3ms"), ("20ms", "25ms")] {
        let traces = [PARTS, AS_LADDER].map(|rest| {
            let head = format!(
                "ladder = [\"main.toml\"]\n[scan]\nperiod = \"{period}\"\n\
                 [[device]]\nname = \"plant\"\npoll = \"{poll}\"\n"
            );
            write("controller.toml", &(head + rest));
            let watched = "X0,X1,X2,X3,X4,D0,D1,D7,D8,D9,Y0,Y1,Y2,Y3,Y4,plant.Ok";
            rows(&rungd(
                folder.path(),
                &["sim", "controller.toml", "--scans", "3000", "--watch", watched],
            ))
        });
        let [parts, ladder] = &traces;
        for column in 0..5 {
            let on = |row: &&String| row.split(',').nth(column) == Some("1");
            let times = parts.iter().filter(on).count();
            assert!(times > 10 && times < 2990, "input {column} is ON {times} times");
        }
        for (scan, (parts, ladder)) in parts.iter().zip(ladder).enumerate() {
            assert_eq!(parts, ladder, "poll {poll}, period {period}, scan {scan}");
        }
    }
}
