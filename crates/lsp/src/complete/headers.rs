//! Proposals of headers at the cursor: headers of tables that are not there yet, and whose parent
//! table is around the cursor.

use lsp_types::CompletionItemKind;

use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use super::shapes::is_taken;
use rungd_language::source::shape::{TableShape, ValueForm};

/// A header that a file of this kind may have.
struct KnownHeader {
    path: Vec<&'static str>,
    is_array: bool,
    doc: &'static str,
    /// The array of tables around it: `program.stage`.
    around: String,
}

/// The headers that fit after the brackets at the cursor.
pub(super) fn offer(scene: &CompletionScene, typed: &str) -> Proposals {
    let mut found = Proposals::of(typed);
    found.signs = "_-.]";
    add(scene, 0, &mut found);
    found
}

/// Adds the headers that fit; `rank`: the rank of the first header.
pub(super) fn add(scene: &CompletionScene, rank: u8, into: &mut Proposals) {
    let mut known = Vec::new();
    collect(&scene.shape(), &OuterTable { path: &[], array: "" }, &mut known);
    let open = open(scene);
    for (order, header) in known.iter().enumerate() {
        let path = header.path.join(".");
        let depth = open.iter().position(|(_, kind)| *kind == header.around);
        let Some(depth) = depth else { continue };
        let object = open[depth].0;
        if !header.is_array && is_present(scene, object, header)
            || header.is_array && is_written_inline(scene, object, header)
        {
            continue;
        }
        let label = if header.is_array { format!("[[{path}]]") } else { format!("[{path}]") };
        // First a further table of the present kind, then the tables in the present table.
        let is_same = open[0].1 == path;
        let rank = rank + if is_same { 0 } else { 1 + u8::try_from(depth).unwrap_or(9) };
        let mut proposal = CompletionProposal::new(label, CompletionItemKind::MODULE, rank);
        proposal.order = order;
        into.add(proposal.doc(header.doc));
    }
}

/// The objects around the cursor, with their kinds; the root last.
fn open(scene: &CompletionScene) -> Vec<(usize, String)> {
    let objects = &scene.file.outline.objects;
    let mut open = Vec::new();
    let mut at = scene.site.object;
    loop {
        open.push((at, objects[at].kind.clone()));
        if objects[at].parent == at {
            return open;
        }
        at = objects[at].parent;
    }
}

/// Whether an object has this array of tables as a value in brackets; a header cannot extend it.
fn is_written_inline(scene: &CompletionScene, object: usize, header: &KnownHeader) -> bool {
    let depth = header.around.split('.').filter(|part| !part.is_empty()).count();
    scene.file.outline.pair(object, &header.path[depth..]).is_some()
}

/// Whether an object has the table of this header: there is such a header, or a key in the table.
fn is_present(scene: &CompletionScene, object: usize, header: &KnownHeader) -> bool {
    let outline = &scene.file.outline;
    let depth = header.around.split('.').filter(|part| !part.is_empty()).count();
    let own = &header.path[depth..];
    let path = header.path.join(".");
    let extent = &outline.objects[object].extent;
    let by_header = outline.headers.iter().any(|header| {
        let is_at_cursor = header.span.start <= scene.offset && scene.offset <= header.span.end;
        header.path == path && !is_at_cursor && (object == 0 || extent.contains(&header.span.start))
    });
    by_header || outline.pairs_in(object).any(|pair| pair.key_below(own).is_some())
}

/// The table below which headers are collected.
struct OuterTable<'a> {
    path: &'a [&'static str],
    /// The path of the array of tables around it, or of which it is an element.
    array: &'a str,
}

/// Collects the headers below a table.
fn collect(shape: &TableShape, outer: &OuterTable, found: &mut Vec<KnownHeader>) {
    let OuterTable { path: before, array: around } = *outer;
    for (key, form) in &shape.noted().keys {
        let is_array = matches!(form, ValueForm::Tables(_));
        let is_table = matches!(form, ValueForm::Table(_));
        // The tables of a rung are written in braces.
        let is_braced = is_table && before.last() == Some(&"rung");
        if !(is_array || is_table) || is_braced || !is_taken(key) {
            continue;
        }
        let path = [before, &[key.name]].concat();
        let Some(inner) = form.below() else { continue };
        let within = if is_array { path.join(".") } else { around.to_owned() };
        let around = around.to_owned();
        found.push(KnownHeader { path: path.clone(), is_array, doc: key.doc, around });
        collect(inner, &OuterTable { path: &path, array: &within }, found);
    }
}
