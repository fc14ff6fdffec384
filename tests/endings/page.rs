//! The table of `docs/endings.md`.

use std::fmt::Write as _;
use std::path::Path;

use crate::run::{Outputs, Story};
use crate::ways::Way;

const BEGIN: &str = "<!-- made by tests/endings: begin -->\n";
const END: &str = "<!-- made by tests/endings: end -->\n";

/// One row: what each output of the two devices did, with the median and the maximum of when.
pub fn row(way: Way, stories: &[Story]) -> String {
    let mut row = format!("| {} |", way.name());
    for device in [0, 1] {
        for at in 0..4 {
            let _ = write!(row, " {} |", cell(way, device, at, stories));
        }
    }
    let backs: Vec<&[f64; 2]> = stories.iter().filter_map(|s| Some(&s.back.as_ref()?.0)).collect();
    let time = |device: usize| times(backs.iter().map(|back| back[device]).collect());
    let back = match backs.is_empty() {
        true => "".to_owned(),
        false => format!("{}; {}", time(0), time(1)),
    };
    let _ = write!(row, " {back} |");
    row
}

fn cell(way: Way, device: usize, at: usize, stories: &[Story]) -> String {
    let of = |story: &Story| story.outputs[device].0[at].clone();
    let first = of(&stories[0]);
    if first.is_empty() {
        return "as it was".to_owned();
    }
    let text = |step: usize| {
        let change = &first[step];
        let value = match (at, change.value) {
            (3, value) => value.to_string(),
            (_, 0) => "OFF".to_owned(),
            _ => "ON".to_owned(),
        };
        let dog = if change.by_watchdog { "**dog** " } else { "" };
        format!("{dog}{value} {}", times(stories.iter().map(|story| of(story)[step].ms).collect()))
    };
    let _ = (way, Outputs::values);
    (0..first.len()).map(text).collect::<Vec<_>>().join(", ")
}

/// Median and maximum, ms.
fn times(mut ms: Vec<f64>) -> String {
    ms.sort_by(f64::total_cmp);
    let round = |ms: f64| if ms < 99.5 { format!("{ms:.1}") } else { format!("{ms:.0}") };
    format!("{} / {}", round(ms[ms.len() / 2]), round(ms[ms.len() - 1]))
}

/// Puts the rows into the page.
pub fn write(rows: &[String], rounds: u32) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/endings.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("the page has its marks");
    let (_, after) = rest.split_once(END).expect("both of them");
    let mut table = format!("Each way {rounds} times; median / maximum, ms.\n\n");
    table += "| way | OFF outside RUN | ON outside RUN | held | word, `safe = 17` \
         | with own watchdog: OFF | ON | held | word | as in RUN again: without; with |\n";
    table += "|---|---|---|---|---|---|---|---|---|---|\n";
    for row in rows {
        table += row;
        table += "\n";
    }
    std::fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
}
