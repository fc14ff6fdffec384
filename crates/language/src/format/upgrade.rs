//! Rewrites an older form of the controller file: a `[[simulated-device]]` becomes a part of a
//! simulated plant, `[[device.part]]`.
//!
//! Called by [`super::upgraded`]. Works on the pieces of the layout, so every comment keeps its
//! place. A table that is wrong, or that has no present form, stays as it is: both forms load.

use std::collections::HashSet;

use crate::source::atom::{is_name_letter, is_plant_point};
use crate::source::toml_tree::{Content, Piece, TextSlice, TomlHead, TomlPair};

/// The name of the older table.
const OLD: &str = "simulated-device";
/// The name of the device that receives the parts.
const DEVICE: &str = "simulated";
/// The longest name of a part, in characters.
const NAME_CHARS_MAX: usize = 100;

/// The kind of a part, and the older names of its keys with the present ones.
#[derive(Clone, Copy)]
struct PartForm {
    kind: &'static str,
    keys: &'static [(&'static str, &'static str)],
}

const PULSE: PartForm = PartForm {
    kind: "\"pulse\"",
    keys: &[
        ("input", "to"),
        ("pulse", "pulse"),
        ("every", "every"),
        ("offset", "offset"),
        ("while", "run"),
        ("invert", "invert"),
    ],
};
const DELAY: PartForm = PartForm {
    kind: "\"delay\"",
    keys: &[
        ("input", "to"),
        ("follows", "in"),
        ("after", "after"),
        ("release", "release"),
        ("while", "enable"),
        ("invert", "invert"),
    ],
};

/// The names in the new text, which borrows them: with quotes.
#[derive(Debug, Default)]
pub(super) struct UpgradeNames {
    /// The name of a part for each older table, in file order.
    parts: Vec<String>,
    /// A name of a device for each older table.
    devices: Vec<String>,
}

impl UpgradeNames {
    pub(super) fn of(pieces: &[Piece<'_>]) -> UpgradeNames {
        let (mut inputs, mut taken, mut table) = (Vec::new(), HashSet::new(), "");
        for piece in pieces {
            match piece {
                Piece::Head(head) => {
                    table = if let [name] = &head.path[..] { name.unquoted().text() } else { "" };
                    inputs.extend((table == OLD).then_some(""));
                }
                Piece::Pair(pair) if table == "device" && is_called(pair, "name") => {
                    taken.insert(scalar(pair).to_owned());
                }
                Piece::Pair(pair) if table == OLD && is_called(pair, "input") => {
                    inputs.last_mut().into_iter().for_each(|input| *input = scalar(pair));
                }
                Piece::Pair(_) | Piece::Blank | Piece::Remark(_) => {}
            }
        }
        let devices = inputs.iter().map(|_| free_name(DEVICE, &mut taken)).collect();
        let mut taken = HashSet::from(["fault".to_owned()]);
        let parts = inputs.iter().map(|input| free_name(input, &mut taken)).collect();
        UpgradeNames { parts, devices }
    }
}

/// A name like a text that is not taken yet, with quotes.
fn free_name(text: &str, taken: &mut HashSet<String>) -> String {
    let letters = text.chars().map(|c| if is_name_letter(c) { c } else { '_' });
    let mut name: String = letters.take(NAME_CHARS_MAX).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.insert_str(0, "part");
    }
    let length = name.len();
    let mut number = 1;
    while taken.contains(&name) {
        number += 1;
        name.truncate(length);
        name += &number.to_string();
    }
    taken.insert(name.clone());
    format!("\"{name}\"")
}

fn is_called(pair: &TomlPair<'_>, key: &str) -> bool {
    is_path(&pair.key, key)
}

/// Whether the path of a key or header is this one name.
fn is_path(path: &[TextSlice<'_>], name: &str) -> bool {
    matches!(path, [part] if part.unquoted().text() == name)
}

/// Whether the path of a key or header begins with `device`.
fn is_in_device(path: &[TextSlice<'_>]) -> bool {
    path.first().is_some_and(|part| part.unquoted().text() == "device")
}

/// The value of a key, if it is no array and no table, without its quotes.
fn scalar<'a>(pair: &TomlPair<'a>) -> &'a str {
    if let Content::Scalar(text) = &pair.value { text.unquoted().text() } else { "" }
}

/// A table `[[simulated-device]]`: its header, and the pieces up to the next one.
struct OldTable<'a> {
    head: TomlHead<'a>,
    pieces: Vec<Piece<'a>>,
}

impl<'a> OldTable<'a> {
    fn pairs(&self) -> impl Iterator<Item = &TomlPair<'a>> {
        self.pieces.iter().filter_map(|piece| match piece {
            Piece::Pair(pair) => Some(pair),
            Piece::Blank | Piece::Remark(_) | Piece::Head(_) => None,
        })
    }

    fn value(&self, key: &str) -> Option<&'a str> {
        self.pairs().find(|pair| is_called(pair, key)).map(scalar)
    }

    /// The present form of the table.
    ///
    /// # Errors
    /// It has none: the reason.
    fn form(&self) -> Result<PartForm, String> {
        let form = match (self.value("follows"), self.value("pulse")) {
            (Some(_), None) => DELAY,
            (None, Some(_)) => PULSE,
            (_, _) => return Err("it needs either `pulse` or `follows`".to_owned()),
        };
        if self.value("input").is_none() {
            return Err("it has no `input`".to_owned());
        }
        let is_known = |pair: &&TomlPair<'_>| form.keys.iter().any(|(old, _)| is_called(pair, old));
        if let Some(wrong) = self.pairs().find(|pair| !is_known(pair)) {
            return Err(format!(
                "it cannot have the key `{}`",
                wrong.key.iter().map(TextSlice::text).collect::<Vec<_>>().join(".")
            ));
        }
        let read = ["follows", "while"].into_iter().filter_map(|key| self.value(key));
        match read.into_iter().find(|name| is_plant_point(name)) {
            Some(name) => Err(format!("`{name}` would name a point of the plant")),
            None => Ok(form),
        }
    }
}

/// The rewriting of a file.
struct Upgrade<'a> {
    names: &'a UpgradeNames,
    pieces: Vec<Piece<'a>>,
    /// The table that is being read.
    table: Option<OldTable<'a>>,
    /// The number of older tables that have been read.
    read: usize,
    /// The numbers of parts and of devices that have been written.
    parts: usize,
    devices: usize,
    /// Whether the table above is a part of one of those. A part behind any other table would be
    /// out of place.
    is_open: bool,
    /// Whether the file has its devices in one value, so that no `[[device]]` can follow.
    is_closed: bool,
    /// The tables that stay as they are.
    kept: Vec<String>,
}

/// Rewrites the pieces of a file, and returns them with the changes, and the tables that stay as
/// they are: a sentence each.
pub(super) fn rewritten<'a>(
    names: &'a UpgradeNames,
    pieces: Vec<Piece<'a>>,
) -> (Vec<Piece<'a>>, Vec<String>) {
    let mut upgrade = Upgrade::new(names, &pieces);
    pieces.into_iter().for_each(|piece| upgrade.piece(piece));
    upgrade.end_table();
    let notes = upgrade.notes();
    (upgrade.pieces, notes)
}

impl<'a> Upgrade<'a> {
    fn new(names: &'a UpgradeNames, pieces: &[Piece<'a>]) -> Upgrade<'a> {
        let root = pieces.iter().take_while(|piece| !matches!(piece, Piece::Head(_)));
        let mut root = root.filter_map(|piece| match piece {
            Piece::Pair(pair) => Some(&pair.key[..]),
            Piece::Blank | Piece::Remark(_) | Piece::Head(_) => None,
        });
        Upgrade {
            names,
            pieces: Vec::new(),
            table: None,
            read: 0,
            parts: 0,
            devices: 0,
            is_open: false,
            is_closed: root.any(is_in_device),
            kept: Vec::new(),
        }
    }

    fn piece(&mut self, piece: Piece<'a>) {
        match piece {
            Piece::Head(head) => {
                self.end_table();
                if head.is_array && is_path(&head.path, OLD) {
                    self.table = Some(OldTable { head, pieces: Vec::new() });
                    return;
                }
                self.is_open = false;
                self.pieces.push(Piece::Head(head));
            }
            Piece::Blank | Piece::Remark(_) | Piece::Pair(_) => match &mut self.table {
                Some(table) => table.pieces.push(piece),
                None => self.pieces.push(piece),
            },
        }
    }

    /// Writes the table that was read.
    fn end_table(&mut self) {
        let Some(table) = self.table.take() else { return };
        let name = &self.names.parts[self.read];
        self.read += 1;
        let form = match self.is_closed {
            true => Err("`device` is one value, not `[[device]]`".to_owned()),
            false => table.form(),
        };
        let form = match form {
            Ok(form) => form,
            Err(reason) => {
                let input = table.value("input").unwrap_or_default();
                self.kept.push(format!("`[[{OLD}]]` of `{input}` stays: {reason}"));
                self.is_open = false;
                self.pieces.push(Piece::Head(table.head));
                self.pieces.extend(table.pieces);
                return;
            }
        };
        if !self.is_open {
            self.device();
        }
        self.parts += 1;
        let head = TomlHead { path: vec![slice("device"), slice("part")], ..table.head };
        self.pieces.extend([Piece::Head(head), pair("name", name), pair("kind", form.kind)]);
        self.pieces.extend(table.pieces.into_iter().map(|piece| match piece {
            Piece::Pair(pair) => Piece::Pair(renamed(pair, form)),
            Piece::Blank | Piece::Remark(_) | Piece::Head(_) => piece,
        }));
    }

    /// Writes a device, above the comments that are directly above the present table.
    fn device(&mut self) {
        let is_remark = |piece: &&Piece<'_>| matches!(piece, Piece::Remark(_));
        let remarks = self.pieces.iter().rev().take_while(is_remark).count();
        let at = self.pieces.len() - remarks;
        let (path, span) = (vec![slice("device")], 0..0);
        let head = TomlHead { path, is_array: true, span, tail: None };
        let name = pair("name", &self.names.devices[self.devices]);
        let (driver, poll) = (pair("driver", "\"simulated\""), pair("poll", "\"1ms\""));
        self.pieces.splice(at..at, [Piece::Head(head), name, driver, poll]);
        self.devices += 1;
        self.is_open = true;
    }

    fn notes(&self) -> Vec<String> {
        let devices = &self.names.devices[..self.devices];
        let devices = devices.iter().map(|name| format!("`{}`", slice(name).unquoted().text()));
        let devices = devices.collect::<Vec<_>>().join(", ");
        let what = if self.parts == 1 { "table" } else { "tables" };
        let parts = self.parts;
        let done = format!("{parts} {what} `[[{OLD}]]` → `[[device.part]]` of {devices}");
        let done = (parts > 0).then_some(done);
        done.into_iter().chain(self.kept.iter().cloned()).collect()
    }
}

fn renamed<'a>(pair: TomlPair<'a>, form: PartForm) -> TomlPair<'a> {
    let present = form.keys.iter().find(|(old, _)| is_called(&pair, old));
    TomlPair { key: present.map_or(pair.key, |(_, present)| vec![slice(present)]), ..pair }
}

fn pair<'a>(key: &'a str, text: &'a str) -> Piece<'a> {
    let value = Content::Scalar(slice(text));
    Piece::Pair(TomlPair { key: vec![slice(key)], is_assigned: true, value, tail: None })
}

fn slice(text: &str) -> TextSlice<'_> {
    TextSlice::new(text, 0..text.len())
}
