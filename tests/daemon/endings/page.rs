//! The table of `docs/endings.md`.

use std::fmt::Write as _;
use std::path::Path;

use super::run::Story;
use super::ways::Way;

const BEGIN: &str = "<!-- made by tests/daemon/endings: begin -->\n";
const END: &str = "<!-- made by tests/daemon/endings: end -->\n";

/// One row: the values of each output of the first device, the action of the second one's watchdog,
/// and the time until both are as in RUN again; each time as median and maximum.
pub fn row(way: Way, stories: &[Story]) -> String {
    let mut row = format!("| {} |", way.name());
    for at in 0..4 {
        let _ = write!(row, " {} |", cell(at, stories));
    }
    let dropped = stories.iter().map(|story| story.outputs[1].0.iter().flatten());
    let dropped = dropped.filter_map(|mut all| Some(all.find(|change| change.by_watchdog)?.ms));
    let backs: Vec<&[f64; 2]> = stories.iter().filter_map(|s| Some(&s.back.as_ref()?.0)).collect();
    let time = |device: usize| times(backs.iter().map(|back| back[device]).collect());
    let back = match way.loses_one() {
        true => time(0),
        false => format!("{}; {}", time(0), time(1)),
    };
    let faulted = stories.iter().filter(|story| story.faulted).count();
    let also = format!(" ({faulted}: FAULT)");
    let back = back + if faulted > 0 { &also } else { "" };
    let back = if backs.is_empty() { String::new() } else { back };
    let _ = write!(row, " {} | {back} |", times(dropped.collect()));
    row
}

fn cell(at: usize, stories: &[Story]) -> String {
    let of = |story: &Story| story.outputs[0].0[at].clone();
    let first = of(&stories[0]);
    if first.is_empty() {
        return "as it was".to_owned();
    }
    let text = |step: usize| {
        let value = match (at, first[step].value) {
            (3, value) => value.to_string(),
            (_, 0) => "OFF".to_owned(),
            _ => "ON".to_owned(),
        };
        format!("{value} {}", times(stories.iter().map(|story| of(story)[step].ms).collect()))
    };
    (0..first.len()).map(text).collect::<Vec<_>>().join(", ")
}

/// Median and maximum, in ms; an empty text if there are no times.
fn times(mut ms: Vec<f64>) -> String {
    if ms.is_empty() {
        return String::new();
    }
    ms.sort_by(f64::total_cmp);
    let round = |ms: f64| if ms < 99.5 { format!("{ms:.1}") } else { format!("{ms:.0}") };
    format!("{} / {}", round(ms[(ms.len() - 1) / 2]), round(ms[ms.len() - 1]))
}

/// Puts the rows into the page.
pub fn write(rows: &[String], rounds: u32) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/endings.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("the page has its marks");
    let (_, after) = rest.split_once(END).expect("the page has its end mark");
    let mut table = format!("Each way {rounds} times; median / maximum, ms.\n\n");
    table += "| way | OFF outside RUN | ON outside RUN | held | word, `safe = 17` \
         | the other's own watchdog | as in RUN again: without; with |\n";
    table += "|---|---|---|---|---|---|---|\n";
    for row in rows {
        table += row;
        table += "\n";
    }
    std::fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
}
