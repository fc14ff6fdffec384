//! The time for an answer: 10,000 rungs, and a minute of tape at 10 ms.

use super::bench::Recorder;
use rungd_engine::isa::MemorySizes;
use rungd_engine::{Engine, EngineCall, ScanTimes};
use rungd_history::observe::{Limits, QuestionTime, Subject};
use rungd_language::lower::lower;
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::TapeSection;
use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

/// Ten thousand rungs of contacts, latches, timers and counters.
fn ladder() -> String {
    let mut text = String::from("[[program]]\nname = \"Main\"\n");
    for n in 0..10_000u32 {
        let (x, y, c, t) = (n % 1000, n % 2000, n % 2000, n % 200);
        let (when, act) = match n % 10 {
            0 if n < 2000 => (format!("\"X{x}\""), format!("TMR T{t} preset=5s")),
            1 if n < 4000 => (format!("\"X{x}\", \"!C{c}\""), format!("SET C{}", n % 500)),
            2 if n < 4000 => (format!("\"X{}\"", (x + 7) % 1000), format!("RST C{}", n % 500)),
            3 => (format!("\"D{x} >= 3\""), format!("MOVE D{x} to=D{}", 1000 + n % 1000)),
            _ => (
                format!("\"X{x}\", \"!C{c} | Y{y}\", \"T{t}.Done | C{}\"", c / 2),
                format!("SET MC{}", 1 + n % 1000),
            ),
        };
        let _ = write!(text, "[[program.rung]]\nwhen = [{when}]\ndo = [\"{act}\"]\n");
    }
    text += "[[program.rung]]\nwhen = [\"X5\", \"C9\", \"T0.Done\"]\ndo = [\"OUT Y1999\"]\n";
    text
}

/// Ten thousand rungs, each with the output of the previous rung as a contact; a latch at the end.
fn chain() -> String {
    let mut text = String::from("[tags]\n");
    for n in 0..10_000u32 {
        let _ = writeln!(text, "link_{n} = {{ type = \"bit\" }}");
    }
    text += "[[program]]\nname = \"Main\"\n";
    for n in 0..10_000u32 {
        let before = n.checked_sub(1).map_or("X0".to_owned(), |n| format!("link_{n}"));
        let x = n % 1000;
        let _ = write!(
            text,
            "[[program.rung]]\nwhen = [\"{before} | X{x}\"]\ndo = [\"OUT link_{n}\"]\n"
        );
    }
    text += "[[program.rung]]\nwhen = [\"!link_9999\", \"X999\"]\ndo = [\"SET Y0\"]\n";
    text
}

/// The tape of a minute at 10 ms, in which few inputs change.
fn minute(subject: &Subject, program: &Program) -> Vec<Arc<TapeSection>> {
    let mut recorder = Recorder::new(Engine::new(lower(program).0));
    recorder.call(EngineCall::Start { now_ns: 0 });
    for scan in 0..6000u64 {
        if scan > 0 && scan % 100 == 0 {
            recorder.cut(scan);
        }
        let now_ns = scan * 10_000_000;
        recorder.call(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
        let cell = |name: &str| subject.cell(name).expect("an operand");
        match scan {
            3000 => recorder.call(EngineCall::Write(cell("X11"), 1)),
            5700 => recorder.call(EngineCall::Write(cell("X5"), 1)),
            5701 => recorder.call(EngineCall::Write(cell("X21"), 1)),
            5702 => recorder.call(EngineCall::Write(cell("X21"), 0)),
            _ => {}
        }
        recorder.call(EngineCall::Execute);
    }
    recorder.sections.into_iter().map(Arc::new).collect()
}

#[test]
#[ignore = "prints times"]
fn print_times_of_a_large_ladder() {
    times(ladder(), &["Y1999", "X5", "X11", "C21", "C11", "T0.Done", "D1003"]);
}

#[test]
#[ignore = "prints times"]
fn print_times_of_a_ladder_with_one_long_dependency_chain() {
    times(chain(), &["link_9999", "link_5000", "link_10", "X11", "Y0"]);
}

fn times(text: String, names: &[&str]) {
    let file = SourceFile { name: "large.toml".into(), text };
    let begin = Instant::now();
    let sizes = MemorySizes { c: 10_000, ..MemorySizes::default() };
    let options = LoadOptions { sizes, ..LoadOptions::default() };
    let (program, findings) = load_ladders(std::slice::from_ref(&file), &options);
    let program = Arc::new(program.unwrap_or_else(|| panic!("{:?}", findings.first())));
    println!("the load: {:?}", begin.elapsed());
    let begin = Instant::now();
    let subject = Subject::new(Arc::clone(&program), vec![file]);
    println!("the subject: {:?}", begin.elapsed());
    let begin = Instant::now();
    let past = minute(&subject, &program);
    println!("6000 scans: {:?}", begin.elapsed());
    for name in names {
        let mut past = past.clone();
        let begin = Instant::now();
        let cell = subject.cell(name).expect("an operand");
        let answer =
            subject.why(&mut past, cell, QuestionTime::Now, Limits::default()).expect("an answer");
        println!("why {name}: {:?}\n{}", begin.elapsed(), answer.text());
    }
}
