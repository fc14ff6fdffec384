//! Measures `rungd test`: long scenarios, many scenarios, shrinking.
//!
//! `cargo bench --bench testing` writes test files and times the command as a whole, its start
//! included, five times each; `docs/speed.md` has the results. The bottling plant runs with its
//! controller file, so with its simulated device.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

const ROUNDS: usize = 5;

fn main() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench-testing");
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let plant = config.join("bottling-plant.toml");
    let ladder = config.join("programs/bottling-plant.toml");

    let long = format!(
        "controller = {plant:?}\n[[scenario]]\nname = \"an hour\"\nsteps = [\"run 360000 scans\"]\n"
    );
    time("360,000 scans of the bottling plant, closed loop", &write(&folder, "long", &long), 0);

    let mut many = format!("ladder = [{ladder:?}]\n");
    for at in 0..500 {
        let _ = writeln!(
            many,
            "[[scenario]]\nname = \"scenario {at}\"\nsteps = [\"run 2s\", \"expect: $On\"]"
        );
    }
    time("500 scenarios of 200 scans", &write(&folder, "many", &many), 0);

    let random = format!(
        "ladder = [{:?}]\nalways = [\"pressed < 1\"]\n[[random]]\nname = \"deep\"\nruns = 50\nscans = 5000\n\
         seed = 1\nchange = {{ a = \"2%\", b = \"2%\", c = \"2%\", d = \"2%\", e = \"2%\", f = \"2%\" }}\n",
        write_ladder(&folder)
    );
    time("a random run of 5,000 scans, found and shrunk", &write(&folder, "shrink", &random), 1);
    for rungs in [100, 1000] {
        let what = format!("100,000 random scans of {rungs} rungs with 256 inputs");
        time(&what, &write(&folder, "inputs", &random_inputs(&folder, rungs)), 0);
    }
}

/// A random test of a ladder with this many rungs, which moves 256 inputs.
fn random_inputs(folder: &Path, rungs: usize) -> String {
    let mut text = String::from("[[program]]\nname = \"Main\"\nrung = [\n");
    for at in 0..rungs {
        let inputs = [at % 256, (at * 7 + 1) % 256, (at * 3 + 2) % 256];
        let [a, b, c] = inputs;
        let _ = writeln!(text, "{{ when = [\"X{a}\", \"!X{b} | X{c}\"], do = [\"OUT C{at}\"] }},");
    }
    text += "]\n";
    let path = folder.join(format!("inputs{rungs}.toml"));
    std::fs::write(&path, text).expect("the folder can be written");
    let changes: Vec<String> = (0..256).map(|at| format!("X{at} = \"0.1%\"")).collect();
    format!(
        "ladder = [{path:?}]\nalways = [\"$On\"]\n[[random]]\nname = \"inputs\"\nruns = 20\n\
         scans = 5000\nseed = 1\nchange = {{ {} }}\n",
        changes.join(", ")
    )
}

/// Writes a ladder with a fault that needs four steps of inputs in order: each step needs the latch
/// of the previous step.
fn write_ladder(folder: &Path) -> PathBuf {
    let mut text = String::from("[tags]\n");
    for (at, name) in ["a", "b", "c", "d", "e", "f"].iter().enumerate() {
        let _ = writeln!(text, "{name} = {{ at = \"X{at}\" }}");
    }
    text += "pressed = { at = \"D8\" }\n[[program]]\nname = \"Main\"\nrung = [\n\
        { when = [\"a\", \"!b\"], do = [\"SET C0\"] },\n\
        { when = [\"C0\", \"rise(c)\", \"!a\"], do = [\"SET C1\"] },\n\
        { when = [\"C1\", \"d\", \"e\"], do = [\"SET C2\"] },\n\
        { when = [\"C2\", \"fall(f)\", \"!e\"], do = [\"ADD pressed 1 to=pressed\"] },\n\
        { when = [\"b & f & !c\"], do = [\"RST C0\", \"RST C1\"] },\n]\n";
    let path = folder.join("deep.toml");
    std::fs::write(&path, text).expect("the folder can be written");
    path
}

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(format!("{name}.test.toml"));
    std::fs::write(&path, text).expect("the folder can be written");
    path
}

fn time(what: &str, file: &Path, code: i32) {
    let mut times: Vec<Duration> = (0..ROUNDS).map(|_| once(file, code)).collect();
    times.sort_unstable();
    let ms = |time: Duration| time.as_secs_f64() * 1000.0;
    let (least, median, most) = (ms(times[0]), ms(times[ROUNDS / 2]), ms(times[ROUNDS - 1]));
    println!("{what}: {median:.0} ms (of {ROUNDS}: {least:.0} to {most:.0})");
}

fn once(file: &Path, code: i32) -> Duration {
    let begin = Instant::now();
    let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .arg("test")
        .arg(file)
        .output()
        .expect("rungd runs");
    let took = begin.elapsed();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(
        output.status.code(),
        Some(code),
        "{said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    took
}
