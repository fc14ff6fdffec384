//! A drawing that is read back gives the same rung, for every shipped ladder, as text and as SVG.
//! Its power agrees with the logic of the rung too.

use std::path::Path;

use super::circuit::{ContactSymbol, RungCircuit};
use super::grid::RungGrid;
use super::live_svg;
use super::power_tests::hold_against_the_rung;
use super::read_back::{compare, of_svg, of_text};
use super::svg::{self, Decoration};
use super::text::{self, WireStyle};
use super::wording::Wording;
use rungd_config::load;
use rungd_language::resolve::program::Program;

/// No additions.
struct Plain;

impl Decoration for Plain {
    fn link(&self, _: &str) -> Option<String> {
        None
    }

    fn mark(&self, _: &ContactSymbol) -> Option<(&'static str, &'static str)> {
        None
    }
}

/// Draws every rung of a program and reads it back. Returns the number of rungs.
fn drawn_and_read(program: &Program) -> usize {
    let wording = Wording::of(program);
    let rungs: Vec<_> = program.parts().flat_map(|part| part.rungs).collect();
    for rung in &rungs {
        let grid = RungGrid::of(&RungCircuit::of(rung, &wording));
        let lines = text::lines(&grid, WireStyle::Lines);
        compare(&of_text(&lines), rung, &wording, &lines.join("\n"));
        let body = svg::rung(&grid, &Plain).body;
        compare(&of_svg(&body), rung, &wording, &body);
        hold_against_the_rung(&grid, rung, &wording);
        // The number of elements that can be lit is the length of the power string.
        let live = live_svg::drawing(&grid, "a rung", 0);
        let power = live_svg::power(&grid, &|contact| contact.leaf % 2 == 0);
        assert_eq!(live.matches(" data-p").count(), power.len(), "{live}");
    }
    rungs.len()
}

#[test]
fn the_drawing_of_every_shipped_rung_equals_the_rung() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut rungs = 0;
    for folder in
        ["config", "config/lib", "tests/ui", "tests/ladder_tests", "docs/instructions/diagrams"]
    {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.to_string_lossy();
            if !name.ends_with(".toml") || name.ends_with(".test.toml") {
                continue;
            }
            let loaded = match load::is_controller_file(&path).expect("readable") {
                true => load::controller_file(&path).expect("readable"),
                false => load::ladder_files(std::slice::from_ref(&path)).expect("readable"),
            };
            rungs += loaded.program.as_ref().map_or(0, drawn_and_read);
        }
    }
    assert!(rungs > 350, "{rungs} rungs");
}

#[test]
fn the_drawing_of_nested_branches_equals_the_rung() {
    let contacts = [
        "(X0 | (X1 & (X2 | !(X3 & X4)))) & (X5 | ((X6 | X7) & X8))",
        "!((X0 | X1) & (X2 | rise(X3)))",
        "X0 & ((X1 & (X2 | X3)) | ((X4 | X5) & X6)) & X7",
        "!(D0 > 3) | (rise(X0 | X1) & !fall(X2) & !rise(X0 & X3))",
        "((X0 | X1) & (X2 | X3)) | ((X4 | X5) & (X6 | X7))",
        "!(!X1 | !(X2 & !X3))",
    ];
    let rung = |(at, text): (usize, &&str)| {
        let bit = |n: usize| format!("C{}", at * 10 + n);
        format!(
            "[[program.rung]]\nwhen = [\"{text}\", \"X9 | X10\"]\n\
             do = [\"OUT {}\", \"MOVE 1 to=D1\"]\n\
             [[program.rung.branch]]\nwhen = [\"X11 | (X12 & (X13 | X14))\"]\n\
             do = [\"SET {}\", \"RST {}\"]\n\
             [[program.rung.branch]]\nwhen = [\"!X15\"]\ndo = [\"PD {}\"]\n",
            bit(1),
            bit(2),
            bit(3),
            bit(4)
        )
    };
    let rungs: String = contacts.iter().enumerate().map(rung).collect();
    let folder = std::env::temp_dir().join(format!("rungd-draw-{}", std::process::id()));
    std::fs::write(&folder, format!("[[program]]\nname = \"Main\"\n{rungs}")).expect("written");
    let loaded = load::ladder_files(std::slice::from_ref(&folder)).expect("readable");
    let _ = std::fs::remove_file(&folder);
    let program = loaded.program.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    assert_eq!(drawn_and_read(&program), contacts.len());
}
