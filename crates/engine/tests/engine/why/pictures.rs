//! Two pictures of `README.md`, made by the program from the shipped parts bin: rungs with the power
//! of the scan in which the bin is full, and an answer of `why`. After a change:
//! `UPDATE_PAGES=1 cargo test -p rungd-engine engine::why::pictures`. The third picture is made by
//! `tests/browser.py`.

use super::bench::Recorder;
use rungd_engine::{Engine, EngineCall, ScanTimes};
use rungd_history::observe::{Limits, PowerRun, QuestionTime, ScanPower, Subject};
use rungd_lab::draw::circuit::ContactSymbol;
use rungd_lab::draw::ladder::{Picture, RungPicture};
use rungd_lab::draw::live_svg;
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::TapeSection;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::{env, fs};

const LADDER: &str = include_str!("../../../../../config/programs/parts-bin.toml");
/// The colours of `rungd web`.
const STYLE: &str = include_str!("../../../../web/src/page/style.css");
/// The width of the picture of the rungs.
const WIDTH: usize = 660;
/// The rungs in the picture.
const SHOWN: [&str; 3] = ["count-parts", "full", "feed"];
/// Every 400 ms a part passes the eye for 100 ms; the twelfth fills the bin.
const EVERY: u64 = 40;
const FULL: u64 = 50 + 11 * EVERY;

/// The parts bin, until the scan in which it is full.
fn filled() -> (Arc<Subject>, Vec<Arc<TapeSection>>) {
    let file = SourceFile { name: "parts-bin.toml".into(), text: LADDER.to_owned() };
    let (program, findings) = load_ladders(std::slice::from_ref(&file), &LoadOptions::default());
    let program = Arc::new(program.unwrap_or_else(|| panic!("{findings:?}")));
    let subject = Arc::new(Subject::new(Arc::clone(&program), vec![file]));
    let [eye, bin] = ["part_eye", "bin_present"].map(|name| subject.cell(name).expect("a tag"));
    let mut recorder = Recorder::new(Engine::new(lower(&program).0));
    recorder.call(EngineCall::Start { now_ns: 0 });
    for scan in 0..=FULL {
        let now_ns = scan * 10_000_000;
        recorder.call(EngineCall::Begin { now_ns, times: ScanTimes::default(), local_s: 0 });
        let is_part = scan >= 50 && (scan - 50) % EVERY < 10;
        recorder.call(EngineCall::Write(eye, i32::from(is_part)));
        recorder.call(EngineCall::Write(bin, 1));
        recorder.call(EngineCall::Execute);
    }
    (subject, recorder.sections.into_iter().map(Arc::new).collect())
}

/// Compares a picture with its file, or writes it.
fn fresh(name: &str, picture: &str) {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("docs/pictures").join(name);
    if env::var_os("UPDATE_PAGES").is_some() {
        fs::write(&path, picture).expect("the picture can be written");
    }
    let stored = fs::read_to_string(&path).unwrap_or_default();
    assert!(stored == picture, "{name} is not what the program draws: UPDATE_PAGES=1 writes it");
}

/// The part of the style that a picture needs: the colours, and the rules for SVG. A lit element has
/// `data-p="1"`, where the page's script sets the class `on`.
fn style() -> String {
    let colours = STYLE.find(":root").expect("colours")..STYLE.find("* {").expect("their end");
    let rules = STYLE.lines().map(|line| line.strip_prefix(".rung ").unwrap_or(line));
    let rules = rules.filter(|line| line.starts_with("svg ") && !line.contains(":focus"));
    let rules = rules.map(|line| line.replace(".on ", "[data-p=\"1\"] ") + "\n");
    STYLE[colours].to_owned() + &rules.collect::<String>()
}

/// A whole SVG file. The style has `<` and `&` nowhere.
fn svg([width, height]: [usize; 2], title: &str, body: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{title}\" \
         width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n<style>\n{}\
         .paper {{ fill: var(--paper); }}\n.doc {{ fill: var(--soft); }}\n</style>\n\
         <rect class=\"paper\" width=\"{width}\" height=\"{height}\" rx=\"6\"/>\n{body}</svg>\n",
        style()
    )
}

/// The drawing of a rung with the power of a scan, and its size.
fn lit(rung: &RungPicture, subject: &Subject, power: &ScanPower) -> (String, [usize; 2]) {
    let conducts = |contact: &ContactSymbol| {
        let mut parts = subject.contacts();
        let number = rung.number as u32;
        let of = |part: &rungd_history::observe::PartContacts| {
            part.element == "Main" && part.rung == number && part.branch == contact.branch
        };
        let first = parts.find(of).expect("the contact's part").first;
        let on = power.contact(first + contact.leaf as u32).expect("the rung is executed");
        contact.form.conducts(on)
    };
    let mut drawn = live_svg::drawing(&rung.grid, &rung.title(), WIDTH);
    for state in live_svg::power(&rung.grid, &conducts).chars() {
        drawn = drawn.replacen("data-p=\"\"", &format!("data-p=\"{state}\""), 1);
    }
    assert!(!drawn.contains("data-p=\"\""), "each element has its state");
    let size = ["width", "height"].map(|of| {
        let (_, rest) = drawn.split_once(&format!("{of}=\"")).expect("a size");
        rest.split('"').next().and_then(|size| size.parse().ok()).expect("a number")
    });
    (drawn, size)
}

#[test]
fn the_ladder_is_drawn_with_the_power_of_the_scan_that_fills_the_bin() {
    let (subject, sections) = filled();
    let mut run = PowerRun::new(Arc::clone(&subject));
    let power = run.of_scan(&sections[0], FULL).expect("the scan");
    let value = |name: &str| power.value(subject.cell(name).expect("a tag"));
    assert_eq!(["parts.Acc", "bin_full", "feeder"].map(value), [12, 1, 0]);
    let picture = Picture::of(&subject);
    let main = picture.blocks.iter().find(|block| block.name == "Main").expect("Main");
    let (mut body, mut y, mut width) = (String::new(), 0, 0);
    for name in SHOWN {
        let is_it = |rung: &&RungPicture| rung.name.as_deref() == Some(name);
        let rung = main.rungs.iter().find(is_it).expect("a rung");
        let (drawn, [wide, high]) = lit(rung, &subject, &power);
        let title = rung.title();
        let _ = writeln!(body, "<text class=\"doc\" x=\"12\" y=\"{}\">{title}</text>", y + 24);
        let _ = writeln!(body, "<g transform=\"translate(0 {})\">\n{drawn}</g>", y + 34);
        (y, width) = (y + 34 + high, width.max(wide).max(title.len() * 8 + 24));
    }
    let counts = format!("parts.Acc = {}, bin_size = {}", value("parts.Acc"), value("bin_size"));
    let _ = writeln!(body, "<text class=\"doc\" x=\"12\" y=\"{}\">{counts}</text>", y + 24);
    fresh("ladder.svg", &svg([width, y + 40], "Three rungs with their power", &body));
}

#[test]
fn the_answer_of_why_is_drawn_as_a_terminal_shows_it() {
    let (subject, mut sections) = filled();
    let feeder = subject.cell("feeder").expect("a tag");
    let answer = subject.why(
        &mut sections,
        feeder,
        QuestionTime::Now,
        Limits { depth: 2, ..Limits::default() },
    );
    let text = answer.expect("an answer").text();
    assert!(text.starts_with("feeder (Y0) is OFF") && text.contains("12 of 12"), "{text}");
    let lines: Vec<&str> =
        ["$ rungd why feeder --depth 2"].into_iter().chain(text.lines()).collect();
    let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or_default();
    let mut body = String::new();
    for (y, line) in (1..).map(|at| 8 + at * 18).zip(&lines) {
        let line = line.replace('&', "&amp;").replace('<', "&lt;");
        let _ = writeln!(body, "<text xml:space=\"preserve\" x=\"12\" y=\"{y}\">{line}</text>");
    }
    let size = [longest * 8 + 24, lines.len() * 18 + 22];
    fresh("why.svg", &svg(size, "The answer of rungd why feeder", &body));
}
