//! A whole ladder as text: headings, doc texts, rungs.

use std::fmt::Write as _;

use super::coverage::{CoverageMarks, PartKey};
use super::ladder::{BlockPicture, Picture, RungPicture};
use super::text::{self, WireStyle};

/// The text of a ladder. `coverage`: the coverage of its contacts by tests.
pub fn listing(picture: &Picture, style: WireStyle, coverage: Option<&CoverageMarks>) -> String {
    let mut list = Listing { style, coverage, text: String::new() };
    list.head('=', &format!("Ladder {}", picture.name), picture.doc.as_deref());
    picture.blocks.iter().for_each(|block| list.block(block));
    list.text
}

struct Listing<'a> {
    style: WireStyle,
    coverage: Option<&'a CoverageMarks>,
    text: String,
}

impl Listing<'_> {
    fn head(&mut self, line: char, title: &str, doc: Option<&str>) {
        let under: String = title.chars().map(|_| line).collect();
        let _ = writeln!(self.text, "{title}\n{under}");
        self.doc(doc);
        self.text.push('\n');
    }

    fn doc(&mut self, doc: Option<&str>) {
        for line in doc.unwrap_or_default().lines() {
            let _ = writeln!(self.text, "{line}");
        }
    }

    fn block(&mut self, block: &BlockPicture) {
        self.head('-', &format!("{} ({})", block.name, block.kind), block.doc.as_deref());
        self.rungs(&block.name, &block.rungs);
        if !block.stages.is_empty() {
            let names: Vec<&str> = block.stages.iter().map(|stage| stage.name.as_str()).collect();
            let _ = writeln!(self.text, "Stages of {}: {}", block.name, names.join(", "));
            for jump in &block.jumps {
                let _ = writeln!(self.text, "  {}", jump.text());
            }
            self.text.push('\n');
        }
        for stage in &block.stages {
            let title = format!("Stage {}.{}", block.name, stage.name);
            self.head('-', &title, stage.doc.as_deref());
            self.rungs(&format!("{}.{}", block.name, stage.name), &stage.rungs);
        }
    }

    fn rungs(&mut self, element: &str, rungs: &[RungPicture]) {
        let mut last_use = None;
        for rung in rungs {
            if rung.of_use != last_use
                && let Some(template_use) = &rung.of_use
            {
                let (file, line) = &template_use.place;
                let _ = writeln!(self.text, "Use {}, {file}:{line}\n", template_use.name);
            }
            last_use.clone_from(&rung.of_use);
            self.rung(element, rung);
        }
    }

    fn rung(&mut self, element: &str, rung: &RungPicture) {
        let _ = writeln!(self.text, "{}", rung.title());
        self.doc(rung.doc.as_deref());
        for line in text::lines(&rung.grid, self.style) {
            let _ = writeln!(self.text, "{line}");
        }
        for contact in &rung.grid.contacts {
            let symbol = &contact.symbol;
            let (element, number) = (element.to_owned(), rung.number as u32);
            let part = PartKey { element, rung: number, branch: symbol.branch };
            let mark = self.coverage.and_then(|coverage| coverage.mark(&part, symbol.leaf));
            if let Some((_, said)) = mark {
                let _ = writeln!(self.text, "  tests: {} {said}", symbol.label.name);
            }
        }
        self.text.push('\n');
    }
}
