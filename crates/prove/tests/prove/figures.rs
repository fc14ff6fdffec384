//! How fast exploring is: figures for a reader, no test of the machine.
//!
//! `cargo test --release -p rungd-prove figures -- --ignored --nocapture`

use super::bench::{Asked, model};
use rungd_prove::cone::cone;
use rungd_prove::explore::{ExploreLimits, Explored, explore};
use rungd_prove::model::Target;
use std::time::{Duration, Instant};

fn show(name: &str, asked: Asked) {
    let model = model(asked);
    for threads in [1, 2] {
        let limits = ExploreLimits {
            memory: 2 << 30,
            combinations: 1 << 12,
            threads,
            deadline: Some(Instant::now() + Duration::from_secs(4)),
            stop: &|| false,
            states: None,
            scans: None,
            depth: None,
        };
        let target = Target { bit: model.judged[0], value: false };
        let (started, cone) = (Instant::now(), cone(&model, &model.judged));
        let cone_s = started.elapsed().as_secs_f64();
        let explored = explore(&model, target, &limits);
        let s = started.elapsed().as_secs_f64() - cone_s;
        let text = match &explored {
            Explored::Found(path) => format!("found after {} scans", path.scans.len()),
            Explored::All { states, depth } => {
                let rate = *states as f64 / s;
                format!("all {states} states, depth {depth}, {rate:.0} states a second")
            }
            Explored::Stopped { .. } => format!("{explored:?}"),
        };
        println!(
            "{name}: {threads} threads: {text}, {s:.3} s; cone {:?} {:?} {cone_s:.3} s",
            cone.operations, cone.inputs
        );
    }
}

/// Three buttons, of which one stops; rungs that have nothing to do with it.
fn interlock(rungs: usize) -> String {
    let mut ladder = String::from(
        r#"
[[program]]
name = "Main"
[[program.rung]]
when = ["X0 | Y0", "!X2", "!Y1"]
do   = ["OUT Y0"]
[[program.rung]]
when = ["X1 | Y1", "!X2", "!Y0"]
do   = ["OUT Y1"]
"#,
    );
    for rung in 0..rungs {
        let (a, b, c) = (10 + rung % 50, rung % 40, 100 + rung);
        ladder.push_str(&format!(
            "[[program.rung]]\nwhen = [\"X{a}\", \"!C{b}\"]\ndo = [\"OUT C{c}\"]\n"
        ));
    }
    ladder
}

/// Two timers of 2 s that never time together, says their author.
fn timers(rungs: usize) -> String {
    let ladder = interlock(rungs);
    format!(
        r#"{ladder}
[[program.rung]]
when = ["X3"]
do   = ["TMR T0 preset=2s"]
[[program.rung]]
when = ["X4", "!T0.Timing | T0.Done"]
do   = ["TMR T1 preset=2s"]
"#
    )
}

#[test]
#[ignore = "prints figures"]
fn figures() {
    let show = |name: &str, ladder: &str, judged: &str| {
        let inputs = &["X0", "X1", "X2", "X3", "X4"];
        show(name, Asked { ladder, inputs, assume: &[], judged: &[judged] });
    };
    show("interlock", &interlock(0), "!(Y0 & Y1)");
    show("interlock among 1,000 rungs", &interlock(1_000), "!(Y0 & Y1)");
    show("two timers among 300 rungs", &timers(300), "!(T0.Done & T1.Done)");
    let light = std::fs::read_to_string("../../config/programs/traffic-light.toml");
    let light = light.expect("the shipped program");
    show("traffic light", &light, "!conflict");
    show("traffic light", &light, "!(ns_green & ew_green)");
}

/// The strings of `always` in a test file.
fn always(text: &str) -> Vec<String> {
    let Some(from) = text.find("always = [") else { return Vec::new() };
    let lines = text[from..].lines().skip(1).take_while(|line| !line.starts_with(']'));
    let quoted = lines.filter_map(|line| line.trim().strip_prefix('"')?.split('"').next());
    quoted.map(str::to_string).collect()
}

#[test]
#[ignore = "prints figures"]
fn shipped_lines() {
    let names = std::fs::read_dir("../../config/programs").expect("the shipped programs");
    let mut names: Vec<String> = names
        .map(|entry| entry.expect("a file").file_name().into_string().expect("text"))
        .collect();
    names.sort();
    let inputs: Vec<String> = (0..64).map(|n| format!("X{n}")).collect();
    let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
    for name in names {
        let name = name.trim_end_matches(".toml");
        let read = |path: String| std::fs::read_to_string(path).unwrap_or_default();
        let ladder = read(format!("../../config/programs/{name}.toml"));
        for line in always(&read(format!("../../config/tests/{name}.test.toml"))) {
            let asked = Asked { ladder: &ladder, inputs: &inputs, assume: &[], judged: &[&line] };
            let shown = std::panic::catch_unwind(|| show(&format!("{name}: {line}"), asked));
            if shown.is_err() {
                println!("{name}: {line}: not loaded");
            }
        }
    }
}
