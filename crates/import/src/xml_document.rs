//! The XML of a foreign file, within limits of memory and time.
//!
//! Called by the readers of L5X and PLCopen XML. A document type is refused, so that entities
//! cannot grow. What the elements mean is the readers' affair.

use roxmltree::{Document, ParsingOptions};

/// Most nodes of a file: a file of 200 MB has some ten million.
const NODES_MAX: u32 = 20_000_000;
/// Most rungs and tags, or elements of ladders, of a file; large plants have some ten thousand.
const PARTS_MAX: usize = 100_000;
/// Most opening parentheses of a file: every instruction in the text of a rung has one.
const CALLS_MAX: usize = 2_000_000;

/// The document of a text, in which elements with one of these names are counted.
///
/// # Errors
/// The text is no XML, or has more of something than any program; the reason names it.
pub(crate) fn parsed<'t>(text: &'t str, parts: &[&str]) -> Result<Document<'t>, String> {
    let options = ParsingOptions { nodes_limit: NODES_MAX, ..ParsingOptions::default() };
    let calls = text.bytes().filter(|byte| *byte == b'(').count();
    if calls > CALLS_MAX {
        return Err(format!("{calls} opening parentheses; a program has at most {CALLS_MAX}"));
    }
    let document = Document::parse_with_options(text, options).map_err(|why| why.to_string())?;
    let is_part = |name: &str| parts.contains(&name);
    let elements = document.descendants().filter(|node| is_part(node.tag_name().name()));
    let count = elements.count();
    if count > PARTS_MAX {
        let names = parts.join(", ");
        return Err(format!(
            "{count} elements ({names}); at most {PARTS_MAX} are read: export the programs one by \
             one"
        ));
    }
    Ok(document)
}
