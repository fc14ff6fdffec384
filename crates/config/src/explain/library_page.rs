//! `rungd explain lib:pid`: a file of the library, with its page above it.
//!
//! The page is written as comments, so the whole text is a ladder file. A user can save it under a
//! new name, change it, and use it in place of the library file.

use std::fmt::Write as _;

use super::page::{indented, section, wrapped};
use crate::load::library::{self, LibraryFile};
use rungd_language::source::file_kind::LIBRARY;
pub use rungd_language::source::ladder::{self, Parameter, Template, WrittenTag};
use rungd_language::source::room::LoadRoom;
use rungd_language::source::span::FileId;

/// The sections of a page that a terminal shows; it cannot show the timing diagram.
const SECTIONS: [&str; 2] = ["Behaviour", "Limits"];

/// The page as comments, followed by the file.
pub fn of_library(file: &LibraryFile) -> String {
    let (purpose, templates) = file.head();
    let name = file.name;
    let head = wrapped(&format!("{LIBRARY}{name}: {purpose}"), 78).join("\n");
    let mut page = format!("{head}\n\n{}\n\n{}\n", intro(file.page), indented(&of_file(file)));
    let _ = write!(page, "Example:\n\n{}\n", indented(example(file.page)));
    page.push_str(&SECTIONS.map(|title| section(file.page, title)).concat());
    let _ = write!(
        page,
        "With a timing diagram: docs/lib/{name}.md. This text is a ladder file: to change the\n\
         templates, save it, and name it in the place of `{LIBRARY}{name}`.\n"
    );
    let comment = |line: &str| format!("# {line}").trim_end().to_owned() + "\n";
    page.lines().map(comment).collect::<String>() + templates
}

/// The words between the title of a page and its first part.
fn intro(page: &str) -> &str {
    let (_, behind) = page.split_once('\n').unwrap_or_default();
    behind.split("<!--").next().unwrap_or_default().trim()
}

/// The example of a page: its last block of TOML.
fn example(page: &str) -> &str {
    let (_, behind) = page.rsplit_once("```toml\n").unwrap_or_default();
    behind.split("```").next().unwrap_or_default()
}

/// The parameters and tags of the templates in a file of the library, one per line. They are shown
/// here and in the file's page. Empty for a name that is not in the library.
pub fn facts(name: &str) -> String {
    library::FILES.iter().find(|file| file.name == name).map(of_file).unwrap_or_default()
}

fn of_file(file: &LibraryFile) -> String {
    let (ladder, _) = ladder::read(&mut LoadRoom::default(), file.text, FileId(0));
    let templates = ladder.map(|ladder| ladder.templates).unwrap_or_default();
    templates.iter().map(of_template).collect::<Vec<_>>().join("\n")
}

fn of_template(template: &Template) -> String {
    let name = template.name.as_ref().map_or("", |name| &name.text);
    let mut text = format!("{name}: {}\n\n", template.doc.as_deref().unwrap_or_default());
    let parameters = template.parameters.iter().map(of_parameter);
    let own = template.tags.iter().filter_map(of_tag);
    let rows: Vec<[String; 4]> = parameters.chain(own).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
    let widths = [width(0), width(1), width(2)];
    for [name, kind, default, doc] in &rows {
        let [a, b, c] = widths;
        let line = format!("{name:<a$}  {kind:<b$}  {default:<c$}  {doc}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

fn of_parameter(parameter: &Parameter) -> [String; 4] {
    let kind = parameter.kind.as_ref().map_or(String::new(), |kind| kind.text.clone());
    let default = parameter.default.as_ref().map(|default| format!("or {}", default.text));
    let doc = parameter.doc.clone().unwrap_or_default();
    [parameter.name.text.clone(), kind, default.unwrap_or_default(), doc]
}

/// An own tag, with the dot that follows the name of a use. `None` for a tag without an
/// explanation: such a tag is internal to the template.
fn of_tag(tag: &WrittenTag) -> Option<[String; 4]> {
    let kind = tag.kind.as_ref().map_or(String::new(), |kind| kind.text.clone());
    let alarm = || {
        let text = &tag.alarm.as_ref()?.text;
        Some(format!("Alarm: {}", text.trim_start_matches("{name}: ")))
    };
    let doc = tag.doc.clone().or_else(alarm)?;
    Some([format!(".{}", tag.name.text), kind, String::new(), doc])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_language::resolve::{LoadOptions, load_ladders};
    use rungd_language::source::finding::Severity;
    use rungd_language::source::span::SourceFile;

    #[test]
    fn the_printed_text_is_a_ladder_file_with_the_same_templates() {
        for file in library::FILES {
            let text = of_library(file);
            assert!(text.ends_with('\n') && !text.contains(" \n"), "{}", file.name);
            let long = text.lines().find(|line| line.chars().count() > 110);
            assert_eq!(long, None, "{}", file.name);
            let templates = |text: &str| text.matches("\n[[template]]\n").count();
            assert_eq!(templates(&text), templates(file.text), "{}", file.name);
            let main = "[[program]]\nname = \"Main\"\n".to_owned();
            let files = [("saved.toml", text), ("main.toml", main)];
            let files = files.map(|(name, text)| SourceFile { name: name.into(), text });
            let (_, findings) = load_ladders(&files, &LoadOptions::default());
            let error = findings.iter().find(|finding| finding.severity() == Severity::Error);
            assert!(error.is_none(), "{}: {error:?}", file.name);
        }
    }

    #[test]
    fn the_printed_file_begins_with_its_page() {
        let text = of_library(library::named("lib:debounce").unwrap().unwrap());
        assert!(text.starts_with("# lib:debounce: A contact without its bounces.\n#\n"));
        let (_, behind) = text.split_once("an off delay in one.\n").unwrap();
        let (facts, _) = behind.split_once("# Example:").unwrap();
        expect_test::expect![[r#"
            #
            #   Debounce: d.on follows raw, once raw has been ON for on_delay, or OFF for off_delay.
            #
            #   raw        contact            The contacts that bounce
            #   on_delay   duration  or 50ms  ON for this long: it is ON
            #   off_delay  duration  or 50ms  OFF for this long: it is OFF
            #   .on        bit                raw without its bounces
            #   .rising    timer              While on is OFF: how long raw has been ON
            #   .going     timer              While on is ON: how long raw has been OFF
            #
        "#]]
        .assert_eq(facts);
        for part in ["#   [tags]\n", "# ## Behaviour\n", "# ## Limits\n", "docs/lib/debounce.md"] {
            assert!(text.contains(part), "{part}");
        }
    }
}
