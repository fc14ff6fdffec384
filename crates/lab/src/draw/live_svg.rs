//! A rung as SVG in which each wire can be lit, for a page that shows the power of each scan.
//!
//! The drawing is made once. The power of a scan is a string with a character for each element that
//! can be lit (`data-p`), in the order of the drawing: `1` for power or for a conducting contact,
//! otherwise `0`. A rung that was not executed has no string. For each scan, the page only sets a
//! class.

use super::circuit::ContactSymbol;
use super::grid::RungGrid;
use super::power::flow_of_power;
use super::svg::{self, Decoration};
use crate::svg::escaped;

struct LivePen {
    room: usize,
}

impl Decoration for LivePen {
    fn link(&self, _: &str) -> Option<String> {
        None
    }

    fn is_live(&self) -> bool {
        true
    }

    fn room(&self) -> usize {
        self.room
    }

    fn mark(&self, _: &ContactSymbol) -> Option<(&'static str, &'static str)> {
        None
    }
}

/// The drawing of a rung, an `svg` element. `title`: its description for screen readers. `room`:
/// its width, unless the rung is wider; with 0 the page moves the right rail to where it has room.
pub fn drawing(grid: &RungGrid, title: &str, room: usize) -> String {
    let drawing = svg::rung(grid, &LivePen { room });
    let ([width, height], title) = (drawing.size, escaped(title));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{title}\" \
         width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n{}</svg>",
        drawing.body
    )
}

/// The power of an executed rung: a character for each element that can be lit.
pub fn power(grid: &RungGrid, conducts: &dyn Fn(&ContactSymbol) -> bool) -> String {
    let flow = flow_of_power(grid, conducts);
    let mut all: Vec<bool> = [flow.along, flow.down].concat();
    for contact in flow.contacts {
        all.extend([contact.conducts, contact.before, contact.behind]);
    }
    for legs in flow.outlets {
        all.push(legs.contains(&true));
        all.extend(legs);
    }
    all.into_iter().map(|on| if on { '1' } else { '0' }).collect()
}
