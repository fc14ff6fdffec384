//! The Stages of a Program as a small graph: one below another, with the ways between them.

use std::fmt::Write as _;

use super::ladder::BlockPicture;
use crate::svg::{self, SvgWriter, escaped};

/// The height of a Stage and of the gap below it, in pixels.
const HEIGHT: usize = 26;
const GAP: usize = 14;
/// The width of a character.
const CHAR: usize = 8;
/// The distance between two ways at the side.
const LANE: usize = 10;

/// The graph of a block.
pub(super) fn flow(block: &BlockPicture) -> String {
    let names: Vec<&str> = block.stages.iter().map(|stage| stage.name.as_str()).collect();
    let widest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut graph = Graph { width: widest * CHAR + 24, lanes: 0, svg: SvgWriter::default() };
    for (at, name) in names.iter().enumerate() {
        graph.stage(at, name, &format!("{}.{name}", block.name));
    }
    let place = |name: &String| names.iter().position(|known_name| known_name == name);
    for jump in &block.jumps {
        let from = match jump.waits_for.is_empty() {
            true => jump.from.as_slice(),
            false => &jump.waits_for,
        };
        let ways = from.iter().flat_map(|from| jump.to.iter().map(move |to| (from, to)));
        for (from, to) in ways {
            if let (Some(from), Some(to)) = (place(from), place(to)) {
                graph.way(from, to, &jump.text());
            }
        }
    }
    let size = [24 + graph.width + (graph.lanes + 1) * LANE, top(names.len())];
    svg::in_page(&format!("Stages of {}", block.name), size, &graph.svg.text)
}

struct Graph {
    /// The width of a Stage.
    width: usize,
    /// The number of ways at the side.
    lanes: usize,
    svg: SvgWriter,
}

impl Graph {
    /// Draws a Stage. The first one, which is the initial Stage, has a thicker edge.
    fn stage(&mut self, at: usize, name: &str, whole: &str) {
        let (whole, width) = (escaped(whole), self.width);
        let (stroke, y) = (if at == 0 { 3 } else { 1 }, top(at));
        let _ = write!(
            self.svg.text,
            "<a href=\"#b-{whole}\"><rect class=\"stage\" x=\"8\" y=\"{y}\" width=\"{width}\" \
             height=\"{HEIGHT}\" rx=\"4\" stroke-width=\"{stroke}\"/>"
        );
        self.svg.label("name", [8 + width / 2, y + 18], name);
        self.svg.text.push_str("</a>\n");
    }

    /// Draws a way between two Stages, given by their numbers: straight down to the next Stage, or
    /// at the side to any other.
    fn way(&mut self, from: usize, to: usize, title: &str) {
        let (path, x, end, tip) = if to == from + 1 {
            let x = 8 + self.width / 2;
            (format!("M{x} {}V{}", top(from) + HEIGHT, top(to)), x, top(to), "m-4 -6l4 6l4 -6z")
        } else {
            self.lanes += 1;
            let (right, side) = (8 + self.width, 8 + self.width + self.lanes * LANE);
            let (start, end) = (top(from) + HEIGHT / 2, top(to) + HEIGHT / 2);
            (format!("M{right} {start}H{side}V{end}H{right}"), right, end, "m6 -4l-6 4l6 4z")
        };
        self.svg.text.push_str("<g>");
        self.svg.title(title);
        self.svg.path("way", path);
        self.svg.path("tip", format_args!("M{x} {end}{tip}"));
        self.svg.text.push_str("</g>\n");
    }
}

/// The position of the upper edge of a Stage.
fn top(at: usize) -> usize {
    8 + at * (HEIGHT + GAP)
}
