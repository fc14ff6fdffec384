//! A file as an editor sees it: its tables, keys and values with their places, even if the text is
//! not valid TOML.
//!
//! `outline_reader` makes it from the text's tree, in which an incomplete value hides nothing after
//! its own line. `words` finds the names in the values; `complete` finds the place of the cursor.
//! It validates nothing; `load` does that.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher, Hash, Hasher, RandomState};
use std::ops::Range;

/// The maximum number of pairs of an object that are searched one by one for a key.
const FEW_PAIRS: usize = 16;

/// The contents of a file, in the order of the text.
#[derive(Debug, Default)]
pub(super) struct Outline {
    /// The root, the tables of arrays of tables, and inline tables within arrays.
    pub objects: Vec<TableObject>,
    /// All pairs of key and value, those of inline tables too.
    pub pairs: Vec<KeyPair>,
    /// All values that are neither arrays nor tables.
    pub values: Vec<OutlineValue>,
    /// All headers.
    pub headers: Vec<TableHeader>,
    /// The numbers of the pairs of each object.
    pub pairs_of: Vec<Vec<usize>>,
    /// The number of the first value of each pair.
    pub value_of: Vec<Option<usize>>,
    /// The first pair of each path of keys, in objects with many pairs.
    paths: PairPaths,
}

/// Pairs by their object and the hash of their keys.
#[derive(Debug, Default)]
struct PairPaths {
    first: HashMap<(usize, u64), usize>,
    hasher: RandomState,
}

/// A table that may occur several times.
#[derive(Debug)]
pub(super) struct TableObject {
    /// Its path, such as `program.rung`; empty for the root.
    pub kind: String,
    /// The number of the object that it belongs to; the root is its own parent.
    pub parent: usize,
    /// From its header, or its `{`, to the end of its last line, or its `}`.
    pub extent: Range<usize>,
    /// The pair whose array it is an element of, if it is an inline table.
    pub around: Option<usize>,
}

/// A header.
#[derive(Debug)]
pub(super) struct TableHeader {
    /// Its path as written, without quotes.
    pub path: String,
    /// From `[` to `]`, or to the end of its line.
    pub span: Range<usize>,
    /// Whether it is the header of an element of an array of tables.
    pub is_array: bool,
    /// The object that the keys below it belong to.
    pub object: usize,
    /// The keys that it puts before the keys below it.
    pub keys: Vec<KeyPart>,
}

/// A key, or a part of a dotted key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct KeyPart {
    /// Without quotes.
    pub text: String,
    /// Without quotes.
    pub span: Range<usize>,
}

/// A key and its value.
#[derive(Debug)]
pub(super) struct KeyPair {
    /// The object that it belongs to.
    pub object: usize,
    /// Its path from the object on, the keys of a `[table]` header included: `tags`, `eye`, `at`.
    pub keys: Vec<KeyPart>,
    /// How many of `keys` are in the header, or before the braces around the pair.
    pub outer: usize,
    /// The place of its value; empty if there is none.
    pub value: Range<usize>,
}

/// A value.
#[derive(Debug)]
pub(super) struct OutlineValue {
    /// The pair that it belongs to.
    pub pair: usize,
    /// The whole value, with its quotes.
    pub span: Range<usize>,
    /// The place between the quotes; for a value without quotes, the same as `span`.
    pub inner: Range<usize>,
    /// Whether it is a string.
    pub is_string: bool,
}

impl Outline {
    /// Builds the indexes of an outline.
    pub fn indexed(mut self) -> Outline {
        self.pairs_of = vec![Vec::new(); self.objects.len()];
        self.value_of = vec![None; self.pairs.len()];
        for (number, pair) in self.pairs.iter().enumerate() {
            self.pairs_of[pair.object].push(number);
        }
        for (number, value) in self.values.iter().enumerate().rev() {
            self.value_of[value.pair] = Some(number);
        }
        for (number, pair) in self.pairs.iter().enumerate() {
            if self.pairs_of[pair.object].len() > FEW_PAIRS {
                let hash = self.paths.hash(pair.keys.iter().map(|key| key.text.as_str()));
                self.paths.first.entry((pair.object, hash)).or_insert(number);
            }
        }
        self
    }

    /// The pairs of an object.
    pub fn pairs_in(&self, object: usize) -> impl Iterator<Item = &KeyPair> {
        self.pairs_of[object].iter().map(|number| &self.pairs[*number])
    }

    /// The keys of the root.
    pub fn root_keys(&self) -> HashSet<&str> {
        let first = |path: &'_ str| path.split('.').next().unwrap_or_default().len();
        let headers = self.headers.iter().map(|header| &header.path[..first(&header.path)]);
        let pairs = self.pairs_in(0).map(|pair| pair.keys[0].text.as_str());
        headers.chain(pairs).collect()
    }

    /// The path of a pair from the root on: `program.rung.when`.
    pub fn path(&self, pair: &KeyPair) -> String {
        let mut path = self.objects[pair.object].kind.clone();
        for key in &pair.keys {
            if !path.is_empty() {
                path.push('.');
            }
            path.push_str(&key.text);
        }
        path
    }

    /// The nearest object of one of these kinds: the object itself, or an object that encloses it.
    pub fn enclosing(&self, object: usize, kinds: &[&str]) -> Option<usize> {
        let mut at = object;
        loop {
            let table = &self.objects[at];
            if kinds.contains(&table.kind.as_str()) {
                return Some(at);
            }
            if at == table.parent {
                return None;
            }
            at = table.parent;
        }
    }

    /// The number of the pair with this path in an object.
    pub fn pair(&self, object: usize, keys: &[&str]) -> Option<usize> {
        let has = |number: &&usize| {
            let path = self.pairs[**number].keys.iter().map(|key| key.text.as_str());
            path.eq(keys.iter().copied())
        };
        let all = &self.pairs_of[object];
        if all.len() > FEW_PAIRS {
            let hash = self.paths.hash(keys.iter().copied());
            let first = self.paths.first.get(&(object, hash))?;
            if has(&first) {
                return Some(*first);
            }
        }
        all.iter().find(has).copied()
    }

    /// The first value of a key below a pair, in an inline table or in the table of a header.
    pub fn value_below(&self, pair: usize, key: &str) -> Option<&OutlineValue> {
        let key_pair = &self.pairs[pair];
        let is_below = |number: &usize| {
            let at = &self.pairs[*number];
            let names =
                at.keys.iter().zip(&key_pair.keys).all(|(own, other)| own.text == other.text);
            at.object == key_pair.object && at.keys.len() > key_pair.keys.len() && names
        };
        let mut below = (pair + 1..self.pairs.len()).take_while(is_below);
        let at = below.find(|number| {
            let keys = &self.pairs[*number].keys;
            keys.len() == key_pair.keys.len() + 1 && self.pairs[*number].key().text == key
        })?;
        self.value_of[at].map(|value| &self.values[value])
    }

    /// The header above a byte, or around it.
    pub fn header_at(&self, at: usize) -> Option<&TableHeader> {
        let behind = self.headers.partition_point(|header| header.span.start <= at);
        behind.checked_sub(1).map(|last| &self.headers[last])
    }

    /// The value around a place.
    pub fn value_at(&self, place: &Range<usize>) -> Option<&OutlineValue> {
        let behind = self.values.partition_point(|value| value.span.start <= place.start);
        let value = behind.checked_sub(1).map(|last| &self.values[last]);
        value.filter(|value| place.end <= value.span.end)
    }

    /// The values of the pair with this path in an object.
    pub fn values_of(&self, object: usize, keys: &[&str]) -> impl Iterator<Item = &OutlineValue> {
        let pair = self.pair(object, keys);
        let first = pair.and_then(|pair| self.value_of[pair]).unwrap_or(self.values.len());
        self.values[first..].iter().take_while(move |value| Some(value.pair) == pair)
    }

    /// The first value of the pair with this path in an object.
    pub fn value(&self, object: usize, keys: &[&str]) -> Option<&OutlineValue> {
        self.value_of[self.pair(object, keys)?].map(|value| &self.values[value])
    }
}

impl PairPaths {
    fn hash<'k>(&self, keys: impl Iterator<Item = &'k str>) -> u64 {
        let mut hasher = self.hasher.build_hasher();
        keys.for_each(|key| key.hash(&mut hasher));
        hasher.finish()
    }
}

impl KeyPair {
    /// The keys of its path.
    pub fn names(&self) -> Vec<&str> {
        self.keys.iter().map(|key| key.text.as_str()).collect()
    }

    /// The key behind these keys, if its path begins with them and is longer.
    pub fn key_below(&self, keys: &[&str]) -> Option<&KeyPart> {
        let is_same = self.keys.iter().zip(keys).all(|(own, key)| own.text == *key);
        self.keys.get(keys.len()).filter(|_| is_same)
    }

    /// The last key of its path.
    pub fn key(&self) -> &KeyPart {
        &self.keys[self.keys.len() - 1]
    }

    /// The end of its last key.
    pub fn end(&self) -> usize {
        self.key().span.end
    }

    /// From its first key after the `outer` keys to the end of its value.
    pub fn extent(&self) -> Range<usize> {
        let first = self.keys.get(self.outer).unwrap_or_else(|| self.key());
        first.span.start..self.value.end.max(self.end())
    }
}
