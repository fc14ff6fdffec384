//! Measures the load of 1,000 uses of a template of ten rungs: reading, expansion, resolving, the
//! rules, and lowering.
//!
//! `cargo bench --bench templates` prints the times of a load; `-- N` sets the number of uses.
//! `docs/speed.md` has a result.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use rungd_engine::isa::MemorySizes;
use rungd_language::check::{CheckInputs, check};
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;

const ROUNDS: usize = 20;

fn main() {
    let uses = std::env::args().skip(1).find_map(|text| text.parse().ok()).unwrap_or(1000);
    let file = SourceFile { name: "templates.toml".into(), text: ladder(uses) };
    let files = [file];
    let sizes = MemorySizes { t: 8192, c: 8192, d: 8192, ..MemorySizes::default() };
    let options = LoadOptions { sizes, ..LoadOptions::default() };
    let mut times: Vec<f64> = Vec::new();
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        let (program, findings) = load_ladders(&files, &options);
        let program = program.unwrap_or_else(|| panic!("{:?}", findings.first()));
        let findings = check(&program, CheckInputs::of(&[]));
        black_box(lower(&program));
        times.push(begin.elapsed().as_secs_f64() * 1e3);
        assert!(findings.is_empty(), "{:?}", findings.first());
    }
    times.sort_by(f64::total_cmp);
    let (p50, max) = (times[ROUNDS / 2], times[ROUNDS - 1]);
    println!("{uses} uses of ten rungs: p50 {p50:.1} ms, max {max:.1} ms");
}

fn ladder(uses: usize) -> String {
    let mut text = TEMPLATE.to_owned();
    for n in 0..uses {
        let (x, level, mc) = (n % 256, n % 4000, n + 1);
        let _ = write!(
            text,
            "\n[[program.rung]]\nuse = \"Pump\"\nname = \"p{n}\"\n\
             with = {{ wanted = \"auto & lead == {n}\", feedback = \"X{x}\", motor = \"MC{mc}\", \
             level = \"levels[{level}]\" }}\n",
        );
    }
    text
}

const TEMPLATE: &str = r#"
[tags]
auto = { at = "X0" }
lead = { at = "D0", initial = 0 }
levels = { at = "D1", count = 4000, initial = 0 }

[[template]]
name = "Pump"

[template.parameters]
wanted   = { type = "contact" }
feedback = { type = "bit" }
motor    = { type = "output" }
level    = { type = "int" }
patience = { type = "duration", default = "3s" }

[template.tags]
failed = { type = "bit", alarm = "{name}: no feedback for {patience}" }
late   = { type = "timer" }
hours  = { type = "timer" }
starts = { type = "int" }
high   = { type = "bit" }
worst  = { type = "int" }

[[template.rung]]
name = "start"
when = ["wanted", "!failed"]
do   = ["OUT motor"]

[[template.rung]]
when = ["motor", "!feedback"]
do   = ["TMR late preset=patience"]

[[template.rung]]
when = ["late.Done"]
do   = ["SET failed"]

[[template.rung]]
when = ["!wanted"]
do   = ["RST failed"]

[[template.rung]]
leg.en  = ["motor"]
leg.rst = ["$Off"]
do      = ["TMRA hours preset=500h"]

[[template.rung]]
when = ["rise(motor)"]
do   = ["ADD starts 1 to=starts"]

[[template.rung]]
when = ["level > 90 | (high & level > 80)"]
do   = ["OUT high"]

[[template.rung]]
when = ["level > worst"]
do   = ["MOVE level to=worst"]

[[template.rung]]
when = ["high & !motor", "wanted"]
do   = ["MATH worst = worst + 1"]

[[template.rung]]
when = ["hours.Done"]
do   = ["MOVE 0 to=starts"]

[[program]]
name = "Main"
"#;
