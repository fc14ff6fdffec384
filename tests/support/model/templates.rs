//! Templates of the model: the rungs of each use are written out in the place of the use, as texts,
//! before anything is read. A given contact stands in parentheses; an own tag is a tag of the
//! ladder with the name of the use before its own.

use super::parse::{string, tables};
use super::tree::{Table, Tree};

/// Writes out all uses in a file. Uses within templates are not known.
pub fn write_out(file: &mut Table) -> Result<(), String> {
    let templates: Vec<Table> = tables(file, "template")?.into_iter().cloned().collect();
    let mut own = Table::new();
    for key in ["program", "task", "subroutine"] {
        for block in tables_mut(file.get_mut(key)) {
            rungs(block, &templates, &mut own)?;
            for stage in tables_mut(block.get_mut("stage")) {
                rungs(stage, &templates, &mut own)?;
            }
        }
    }
    if let Tree::Table(tags) =
        file.entry("tags".to_string()).or_insert_with(|| Tree::Table(Table::new()))
    {
        tags.append(&mut own);
    }
    Ok(())
}

fn tables_mut(list: Option<&mut Tree>) -> impl Iterator<Item = &mut Table> {
    let items = match list {
        Some(Tree::List(items)) => items.as_mut_slice(),
        Some(_) | None => &mut [],
    };
    items.iter_mut().filter_map(|item| match item {
        Tree::Table(table) => Some(table),
        _ => None,
    })
}

fn rungs(element: &mut Table, templates: &[Table], own: &mut Table) -> Result<(), String> {
    let Some(Tree::List(list)) = element.get_mut("rung") else { return Ok(()) };
    let mut all = Vec::new();
    for rung in std::mem::take(list) {
        match rung.as_table().filter(|table| table.contains_key("use")) {
            Some(place) => all.extend(written_out(place, templates, own)?),
            None => all.push(rung),
        }
    }
    *list = all;
    Ok(())
}

/// A word of a template, and the text that stands for it in a use.
struct Replaced {
    word: String,
    by: String,
}

/// The rungs of a use. Adds its own tags.
fn written_out(place: &Table, templates: &[Table], own: &mut Table) -> Result<Vec<Tree>, String> {
    let (used, name) = (string(place, "use")?, string(place, "name")?);
    let is_used = |template: &&Table| string(template, "name").as_ref() == Ok(&used);
    let template = templates.iter().find(is_used).ok_or_else(|| format!("no template `{used}`"))?;
    let inner = |table: &Table, key: &str| -> Table {
        table.get(key).and_then(Tree::as_table).cloned().unwrap_or_default()
    };
    let mut words = Vec::new();
    let with = inner(place, "with");
    for (word, parameter) in inner(template, "parameters") {
        let kind = parameter.as_table().map_or(Ok(String::new()), |table| string(table, "type"))?;
        let given = string(&with, &word)?;
        let by = if kind == "contact" { format!("({given})") } else { given };
        words.push(Replaced { word, by });
    }
    for (word, tag) in inner(template, "tags") {
        let by = format!("{name}.{word}");
        own.insert(by.clone(), tag);
        words.push(Replaced { word, by });
    }
    let rungs = tables(template, "rung")?.into_iter();
    Ok(rungs.map(|rung| replaced(&Tree::Table(rung.clone()), &words)).collect())
}

/// A tree with words of its texts replaced, all at once.
fn replaced(tree: &Tree, words: &[Replaced]) -> Tree {
    match tree {
        Tree::Text(text) => Tree::Text(in_text(text, words)),
        Tree::List(items) => Tree::List(items.iter().map(|item| replaced(item, words)).collect()),
        Tree::Table(table) => {
            let entries = table.iter().map(|(key, value)| (key.clone(), replaced(value, words)));
            Tree::Table(entries.collect())
        }
        Tree::Number(_) | Tree::Bool(_) => tree.clone(),
    }
}

fn in_text(text: &str, words: &[Replaced]) -> String {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
    let (mut out, mut rest) = (String::new(), text);
    while let Some(first) = rest.chars().next() {
        let length = match is_letter(first) {
            true => rest.find(|c| !is_letter(c)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        let (word, behind) = rest.split_at(length);
        let is_member = out.ends_with('.');
        let found = words.iter().find(|one| one.word == word && !is_member);
        out.push_str(found.map_or(word, |one| &one.by));
        rest = behind;
    }
    out
}
