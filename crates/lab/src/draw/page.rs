//! A whole ladder as one HTML file: contents, rungs, Stages, search, and the cross-reference. The
//! file loads nothing from outside, and shows everything without its script too.

use std::collections::HashSet;
use std::fmt::Write as _;

use super::circuit::ContactSymbol;
use super::coverage::{CoverageMarks, PartKey};
use super::flow_drawing;
use super::ladder::{BlockPicture, Picture, RungPicture};
use super::svg::{self, Decoration};
use super::xref::answer::CrossReference;
use crate::svg::{SvgWriter, escaped, in_page};

/// The page of a ladder. `references`: all its operands. `coverage`: the coverage of its contacts
/// by tests.
pub fn page(
    picture: &Picture,
    references: &[CrossReference],
    coverage: Option<&CoverageMarks>,
) -> String {
    let names = references.iter().map(|reference| reference.name.as_str()).collect();
    let mut page = PageMaker { names, coverage, text: String::new() };
    page.head(picture);
    page.contents(picture);
    page.text.push_str("<main>\n");
    picture.blocks.iter().for_each(|block| page.block(block));
    page.references(references);
    page.text.push_str("</main>\n<script>\n");
    page.text.push_str(include_str!("page/script.js"));
    page.text.push_str("</script>\n</body>\n</html>\n");
    page.text
}

/// The ladder as one picture, without links.
pub fn picture(picture: &Picture, coverage: Option<&CoverageMarks>) -> String {
    let (mut body, mut width, mut y) = (SvgWriter::default(), 400, 30);
    let mut title = |body: &mut SvgWriter, y: &mut usize, text: &str| {
        body.label("", [12, *y], text);
        body.end_line();
        *y += 12;
        width = width.max(24 + text.chars().count() * 8);
    };
    title(&mut body, &mut y, &format!("Ladder {}", picture.name));
    let mut widest = 0;
    for (element, heading, rungs) in picture.elements() {
        y += 24;
        title(&mut body, &mut y, &heading);
        for rung in rungs {
            y += 14;
            title(&mut body, &mut y, &rung.title());
            let marks = RungMarks { names: None, coverage, element: &element, rung };
            let drawing = svg::rung(&rung.grid, &marks);
            let elements = drawing.body;
            let _ = writeln!(body.text, "<g transform=\"translate(0 {y})\">\n{elements}</g>");
            y += drawing.size[1];
            widest = widest.max(drawing.size[0]);
        }
    }
    let style = include_str!("page/style.css");
    let style = format!("\n{style}svg {{ background: var(--paper); }}\n");
    body.picture([width.max(widest), y + 20], &style)
}

struct PageMaker<'a> {
    /// The operands with a row in the cross-reference.
    names: HashSet<&'a str>,
    coverage: Option<&'a CoverageMarks>,
    text: String,
}

/// The links and marks of a rung.
struct RungMarks<'a> {
    names: Option<&'a HashSet<&'a str>>,
    coverage: Option<&'a CoverageMarks>,
    element: &'a str,
    rung: &'a RungPicture,
}

impl Decoration for RungMarks<'_> {
    fn link(&self, name: &str) -> Option<String> {
        let known = |names: &HashSet<&str>| names.contains(name).then(|| name.to_owned());
        let names = self.names?;
        // A member is linked to its structure.
        let base = name.rsplit_once('.').map_or(name, |(base, _)| base);
        let found = known(names).or_else(|| names.contains(base).then(|| base.to_owned()))?;
        Some(format!("#x-{found}"))
    }

    fn mark(&self, contact: &ContactSymbol) -> Option<(&'static str, &'static str)> {
        let element = self.element.to_owned();
        let part = PartKey { element, rung: self.rung.number as u32, branch: contact.branch };
        self.coverage?.mark(&part, contact.leaf)
    }
}

impl PageMaker<'_> {
    fn head(&mut self, picture: &Picture) {
        let name = escaped(&picture.name);
        let _ = write!(
            self.text,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{name}</title>\n<style>\n{}</style>\n</head>\n<body>\n\
             <header><h1>{name}</h1>\n",
            include_str!("page/style.css")
        );
        self.doc(picture.doc.as_deref());
        self.text.push_str(
            "</header>\n<div class=\"search\"><label>Search <input id=\"search\" type=\"search\" \
             autocomplete=\"off\"></label> <span id=\"found\" role=\"status\"></span></div>\n",
        );
    }

    fn doc(&mut self, doc: Option<&str>) {
        if let Some(doc) = doc {
            let _ = writeln!(self.text, "<p>{}</p>", escaped(doc));
        }
    }

    fn contents(&mut self, picture: &Picture) {
        self.text.push_str("<nav aria-label=\"Contents\"><ul>\n");
        for block in &picture.blocks {
            let name = escaped(&block.name);
            let _ = write!(self.text, "<li><a href=\"#b-{name}\">{name}</a>");
            if !block.stages.is_empty() {
                self.text.push_str("<ul>");
                for stage in &block.stages {
                    let stage = escaped(&stage.name);
                    let _ = write!(self.text, "<li><a href=\"#b-{name}.{stage}\">{stage}</a></li>");
                }
                self.text.push_str("</ul>");
            }
            self.text.push_str("</li>\n");
        }
        self.text.push_str("<li><a href=\"#names\">Cross-reference</a></li>\n</ul></nav>\n");
    }

    fn block(&mut self, block: &BlockPicture) {
        let name = escaped(&block.name);
        let kind = block.kind;
        let _ = writeln!(self.text, "<h2 id=\"b-{name}\">{name} <small>({kind})</small></h2>");
        self.doc(block.doc.as_deref());
        if !block.stages.is_empty() {
            let flow = flow_drawing::flow(block);
            let _ = writeln!(self.text, "<div class=\"scroll\">{flow}</div>");
            self.text.push_str("<details><summary>The ways between the Stages</summary><ul>\n");
            for jump in &block.jumps {
                let _ = writeln!(self.text, "<li>{}</li>", escaped(&jump.text()));
            }
            self.text.push_str("</ul></details>\n");
        }
        self.rungs(&block.name, &block.rungs);
        for stage in &block.stages {
            let whole = format!("{}.{}", block.name, stage.name);
            let shown = escaped(&whole);
            let _ = writeln!(self.text, "<h3 id=\"b-{shown}\">Stage {shown}</h3>");
            self.doc(stage.doc.as_deref());
            self.rungs(&whole, &stage.rungs);
        }
    }

    /// Writes rungs. The rungs of one use of a template unfold together.
    fn rungs(&mut self, element: &str, rungs: &[RungPicture]) {
        for of_use in rungs.chunk_by(|a, b| a.of_use == b.of_use) {
            let template_use = of_use.first().and_then(|rung| rung.of_use.as_ref());
            if let Some(template_use) = template_use {
                let (name, (file, line)) = (escaped(&template_use.name), &template_use.place);
                let file = escaped(file);
                let _ = writeln!(
                    self.text,
                    "<details class=\"use\" open><summary>Use <b>{name}</b> of a template, \
                     {file}:{line}</summary>"
                );
            }
            of_use.iter().for_each(|rung| self.rung(element, rung));
            if template_use.is_some() {
                self.text.push_str("</details>\n");
            }
        }
    }

    fn rung(&mut self, element: &str, rung: &RungPicture) {
        let names = Some(&self.names);
        let marks = RungMarks { names, coverage: self.coverage, element, rung };
        let drawing = svg::rung(&rung.grid, &marks);
        let id = escaped(&format!("{element}-{}", rung.number));
        let (file, line) = &rung.place;
        let name = rung.name.as_ref().map(|name| format!(" <b>{}</b>", escaped(name)));
        let _ = writeln!(
            self.text,
            "<div class=\"rung\" id=\"r-{id}\" data-words=\"{id}\">\
             <p class=\"head\">{}.{} {}:{line}</p>",
            rung.number,
            name.unwrap_or_default(),
            escaped(file)
        );
        self.doc(rung.doc.as_deref());
        let label = format!("Rung {element}-{}", rung.number);
        let picture = in_page(&label, drawing.size, &drawing.body);
        let _ = writeln!(self.text, "<div class=\"scroll\">{picture}</div></div>");
    }

    fn references(&mut self, references: &[CrossReference]) {
        self.text.push_str(
            "<h2 id=\"names\">Cross-reference</h2>\n<div class=\"scroll\">\
             <table id=\"rows\"><thead><tr><th>Name</th><th>Address</th><th>Meaning</th>\
             <th>Written by</th><th>Read by</th><th>Outside</th></tr></thead><tbody>\n",
        );
        references.iter().for_each(|reference| self.reference(reference));
        self.text.push_str("</tbody></table></div>\n");
    }

    fn reference(&mut self, reference: &CrossReference) {
        let name = escaped(&reference.name);
        let address = reference.address.as_deref().map(escaped).unwrap_or_default();
        let doc = reference.doc.as_deref().map(escaped).unwrap_or_default();
        let mut outside: Vec<String> =
            reference.outside.iter().map(|outside_use| escaped(&outside_use.text)).collect();
        outside.extend(reference.retained.then(|| "retained".to_owned()));
        let written = links(
            reference.written.iter().map(|place| (place.anchor.as_str(), place.text.as_str())),
        );
        let read =
            links(reference.read.iter().map(|place| (place.anchor.as_str(), place.text.as_str())));
        let _ = writeln!(
            self.text,
            "<tr id=\"x-{name}\" data-words=\"\"><td class=\"name\">{name}</td><td>{address}</td>\
             <td>{doc}</td><td>{written}</td><td>{read}</td><td>{}</td></tr>",
            outside.join("<br>")
        );
    }
}

/// Links to rungs, each once, with the text of the place as title.
fn links<'a>(uses: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let mut seen = HashSet::new();
    let link = |(anchor, text): (&str, &str)| {
        let (anchor, text) = (escaped(anchor), escaped(text));
        format!("<a href=\"#r-{anchor}\" title=\"{text}\">{anchor}</a>")
    };
    let links: Vec<String> = uses.filter(|(anchor, _)| seen.insert(*anchor)).map(link).collect();
    links.join(", ")
}
