//! The example of `docs/why.md` is made by the program. To update it after a change:
//! `UPDATE_PAGES=1 cargo test -p rungd-engine engine::why::page`.

use super::bench::Recorder;
use rungd_engine::{Engine, EngineCall, ScanTimes};
use rungd_history::observe::{Limits, QuestionTime, Subject};
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use std::path::Path;
use std::sync::Arc;
use std::{env, fs};

/// The text between two marks.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = text.split_once(from).expect("the page has the mark");
    rest.split_once(to).expect("the page has the other mark").0
}

#[test]
fn the_example_of_the_page_equals_the_output_of_why() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("docs/why.md");
    let page = fs::read_to_string(&path).expect("the page");
    let text = between(&page, "```toml\n", "```").to_owned();
    let file = SourceFile { name: "bottling.toml".into(), text };
    let (program, findings) = load_ladders(std::slice::from_ref(&file), &LoadOptions::default());
    let program = Arc::new(program.unwrap_or_else(|| panic!("{findings:?}")));
    let subject = Subject::new(Arc::clone(&program), vec![file]);
    let mut recorder = Recorder::new(Engine::new(lower(&program).0));
    recorder.call(EngineCall::Start { now_ns: 0 });
    for scan in 0..400u64 {
        let now_ns = scan * 10_000_000;
        recorder.call(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
        let eye = subject.cell("eye").expect("a tag");
        if scan < 300 {
            recorder.call(EngineCall::Write(eye, i32::from(scan % 100 < 20)));
        }
        recorder.call(EngineCall::Execute);
    }
    let mut past: Vec<_> = recorder.sections.into_iter().map(Arc::new).collect();
    let cell = subject.cell("pusher").expect("a tag");
    let answer =
        subject.why(&mut past, cell, QuestionTime::Now, Limits::default()).expect("an answer");
    let told = between(&page, "```text\n", "```");
    if env::var_os("UPDATE_PAGES").is_some() {
        let new =
            page.replace(&format!("```text\n{told}```"), &format!("```text\n{}```", answer.text()));
        fs::write(&path, new).expect("the page can be written");
    } else {
        assert_eq!(told, answer.text());
    }
}
