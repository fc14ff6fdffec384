//! The order of keys in the tables of a ladder: first the name of a part, then its purpose, then
//! its function.
//!
//! Called by `format` between reading and writing. Tables of other kinds and the list of tags keep
//! the order of their author. A key moves together with the comments above it and behind it, and
//! never across a blank line.

use crate::source::toml_tree::{Content, Piece, TextSlice, TomlPair, TomlRow};

/// A kind of table. Its keys have an order, or it contains such tables, or it is a different table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeyOrder {
    /// The file itself.
    Root,
    Program,
    Task,
    Template,
    Stage,
    Rung,
    Branch,
    Legs,
    /// A table of tags or of parameters; its own keys keep their order.
    Tags,
    Tag,
    /// Any other table.
    Other,
}

impl KeyOrder {
    /// The keys in their order. Keys that are not in this list come after them.
    fn order(self) -> &'static [&'static str] {
        match self {
            KeyOrder::Root | KeyOrder::Tags | KeyOrder::Other => &[],
            KeyOrder::Program => {
                &["name", "doc", "allow", "autostart", "use", "with", "rung", "stage"]
            }
            KeyOrder::Task | KeyOrder::Stage => &["name", "doc", "allow", "rung"],
            KeyOrder::Template => &["name", "doc", "allow", "parameters", "tags", "rung", "stage"],
            KeyOrder::Rung => &[
                "use", "name", "doc", "allow", "with", "todo", "was", "when", "leg", "do", "branch",
            ],
            KeyOrder::Branch => &["doc", "allow", "when", "do"],
            KeyOrder::Legs => &["up", "dn", "en", "data", "clk", "rst"],
            KeyOrder::Tag => &[
                "at",
                "type",
                "value",
                "count",
                "default",
                "initial",
                "min",
                "max",
                "unit",
                "texts",
                "doc",
                "log",
                "alarm",
                "priority",
                "delay",
                "off-delay",
                "group",
                "ack",
                "metric",
                "spare",
            ],
        }
    }

    /// The kind of the table at a key, or of the tables of the array at the key.
    fn below(self, key: &TextSlice<'_>) -> KeyOrder {
        match (self, key.unquoted().text()) {
            (KeyOrder::Root, "program") => KeyOrder::Program,
            (KeyOrder::Root, "task" | "subroutine") => KeyOrder::Task,
            (KeyOrder::Root, "template") => KeyOrder::Template,
            (KeyOrder::Program | KeyOrder::Template, "stage") => KeyOrder::Stage,
            (KeyOrder::Program | KeyOrder::Template | KeyOrder::Task | KeyOrder::Stage, "rung") => {
                KeyOrder::Rung
            }
            (KeyOrder::Rung, "branch") => KeyOrder::Branch,
            (KeyOrder::Rung, "leg") => KeyOrder::Legs,
            (KeyOrder::Root | KeyOrder::Template, "tags") | (KeyOrder::Template, "parameters") => {
                KeyOrder::Tags
            }
            (KeyOrder::Tags, _) => KeyOrder::Tag,
            (_, _) => KeyOrder::Other,
        }
    }

    /// The kind of the table that a header with this name begins.
    pub(super) fn of(path: &[TextSlice<'_>]) -> KeyOrder {
        KeyOrder::Root.below_all(path)
    }

    /// The kind of the table at a dotted key.
    fn below_all(self, key: &[TextSlice<'_>]) -> KeyOrder {
        key.iter().fold(self, |keys, key| keys.below(key))
    }

    /// Whether blank lines between its keys have no meaning.
    pub(super) fn is_close(self) -> bool {
        match self {
            KeyOrder::Root | KeyOrder::Tags | KeyOrder::Other => false,
            KeyOrder::Program
            | KeyOrder::Task
            | KeyOrder::Template
            | KeyOrder::Stage
            | KeyOrder::Rung
            | KeyOrder::Branch
            | KeyOrder::Legs
            | KeyOrder::Tag => true,
        }
    }

    fn rank(self, key: &[TextSlice<'_>]) -> (usize, usize) {
        let rank = |keys: KeyOrder, key: Option<&TextSlice<'_>>| {
            let order = keys.order();
            let place = |key: &TextSlice<'_>| {
                order.iter().position(|ordered_key| *ordered_key == key.unquoted().text())
            };
            key.and_then(place).unwrap_or(order.len())
        };
        let below = key.first().map_or(KeyOrder::Other, |key| self.below(key));
        (rank(self, key.first()), rank(below, key.get(1)))
    }
}

/// Puts the keys of all tables in order.
pub(super) fn order(pieces: Vec<Piece<'_>>) -> Vec<Piece<'_>> {
    let mut ordered = Vec::with_capacity(pieces.len());
    let (mut keys, mut run) = (KeyOrder::Root, Vec::new());
    for mut piece in pieces {
        if let Piece::Pair(pair) = &mut piece {
            order_value(keys.below_all(&pair.key), &mut pair.value);
        }
        match piece {
            Piece::Remark(_) | Piece::Pair(_) => run.push(piece),
            Piece::Blank => {
                close(keys, &mut run, &mut ordered, true);
                ordered.push(piece);
            }
            Piece::Head(head) => {
                // A comment directly above a header belongs to the header.
                close(keys, &mut run, &mut ordered, false);
                keys = KeyOrder::of(&head.path);
                ordered.push(Piece::Head(head));
            }
        }
    }
    close(keys, &mut run, &mut ordered, true);
    ordered
}

/// Ends a run of keys and comments without a blank line. A comment below the last key could be
/// about that key, so the order of such a run does not change.
fn close<'a>(keys: KeyOrder, run: &mut Vec<Piece<'a>>, to: &mut Vec<Piece<'a>>, is_end: bool) {
    let rest = match run.iter().rposition(|piece| matches!(piece, Piece::Pair(_))) {
        Some(last) => run.split_off(last + 1),
        None => Vec::new(),
    };
    if keys.order().is_empty() || (is_end && !rest.is_empty()) {
        to.append(run);
    } else {
        sort(keys, run, to);
    }
    to.extend(rest);
}

fn sort<'a>(keys: KeyOrder, run: &mut Vec<Piece<'a>>, to: &mut Vec<Piece<'a>>) {
    let ranks = run.iter().filter_map(|piece| match piece {
        Piece::Pair(pair) => Some(keys.rank(&pair.key)),
        Piece::Blank | Piece::Remark(_) | Piece::Head(_) => None,
    });
    if ranks.is_sorted() {
        to.append(run);
        return;
    }
    let mut items: Vec<((usize, usize), Vec<Piece<'a>>)> = Vec::new();
    let mut item = Vec::new();
    for piece in run.drain(..) {
        let rank = match &piece {
            Piece::Pair(pair) => Some(keys.rank(&pair.key)),
            Piece::Blank | Piece::Remark(_) | Piece::Head(_) => None,
        };
        item.push(piece);
        if let Some(rank) = rank {
            items.push((rank, std::mem::take(&mut item)));
        }
    }
    items.sort_by_key(|(rank, _)| *rank);
    to.extend(items.into_iter().flat_map(|(_, pieces)| pieces));
    to.append(&mut item);
}

fn order_value(keys: KeyOrder, value: &mut Content<'_>) {
    match value {
        Content::Scalar(_) => {}
        Content::Table(table) => order_pairs(keys, &mut table.pairs),
        Content::Array(array) => {
            for row in &mut array.rows {
                if let TomlRow::Element(value, _) = row {
                    order_value(keys, value);
                }
            }
        }
    }
}

fn order_pairs(keys: KeyOrder, pairs: &mut [TomlPair<'_>]) {
    for pair in pairs.iter_mut() {
        order_value(keys.below_all(&pair.key), &mut pair.value);
    }
    pairs.sort_by_key(|pair| keys.rank(&pair.key));
}
