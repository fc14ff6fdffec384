//! The Stages of a Program as a small graph: one below the other, with the ways between them.

use std::fmt::Write as _;

use super::ladder::BlockPicture;
use super::listing::way;
use super::svg::escaped;

/// The height of a Stage and of the gap below it, in pixels.
const HEIGHT: usize = 26;
const GAP: usize = 14;
/// The width of a character.
const CHAR: usize = 8;
/// From one way at the side to the next.
const LANE: usize = 10;

/// The graph of a block.
pub(super) fn flow(block: &BlockPicture) -> String {
    let names: Vec<&str> = block.stages.iter().map(|stage| stage.name.as_str()).collect();
    let widest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let width = widest * CHAR + 24;
    let y = |at: usize| 8 + at * (HEIGHT + GAP);
    let (mut body, mut lanes) = (String::new(), 0);
    for (at, name) in names.iter().enumerate() {
        let whole = escaped(&format!("{}.{name}", block.name));
        let stroke = if at == 0 { 3 } else { 1 };
        let _ = writeln!(
            body,
            "<a href=\"#b-{whole}\"><rect class=\"stage\" x=\"8\" y=\"{}\" width=\"{width}\" \
             height=\"{HEIGHT}\" rx=\"4\" stroke-width=\"{stroke}\"/>\
             <text class=\"name\" x=\"{}\" y=\"{}\">{}</text></a>",
            y(at),
            8 + width / 2,
            y(at) + 18,
            escaped(name)
        );
    }
    for jump in &block.jumps {
        let from = match jump.waits_for.is_empty() {
            true => jump.from.iter().collect::<Vec<_>>(),
            false => jump.waits_for.iter().collect(),
        };
        let place = |name: &String| names.iter().position(|of| of == name);
        for (from, to) in from.into_iter().flat_map(|from| jump.to.iter().map(move |to| (from, to)))
        {
            let (Some(from), Some(to)) = (place(from), place(to)) else { continue };
            let told = escaped(&way(jump));
            let path = match to == from + 1 {
                true => format!("M{x} {}V{}", y(from) + HEIGHT, y(to), x = 8 + width / 2),
                false => {
                    lanes += 1;
                    let (right, side) = (8 + width, 8 + width + lanes * LANE);
                    let (start, end) = (y(from) + HEIGHT / 2, y(to) + HEIGHT / 2);
                    format!("M{right} {start}H{side}V{end}H{right}")
                }
            };
            let (x, tip) = match to == from + 1 {
                true => (8 + width / 2, format!("m-4 -6l4 6l4 -6z")),
                false => (8 + width, "m6 -4l-6 4l6 4z".to_owned()),
            };
            let end = if to == from + 1 { y(to) } else { y(to) + HEIGHT / 2 };
            let _ = writeln!(
                body,
                "<g><title>{told}</title><path class=\"way\" d=\"{path}\"/>\
                 <path class=\"tip\" d=\"M{x} {end}{tip}\"/></g>"
            );
        }
    }
    let (wide, high) = (24 + width + (lanes + 1) * LANE, y(names.len()));
    let name = escaped(&block.name);
    format!(
        "<svg role=\"img\" aria-label=\"Stages of {name}\" width=\"{wide}\" height=\"{high}\">\n\
         {body}</svg>"
    )
}
