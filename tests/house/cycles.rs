//! Finds the files of the crates that use each other in a circle.
//!
//! A file uses a second file if it names an item of that file, in a `use` or in a path in its text.
//! A re-exported name (`pub use`) counts as a name of the file that defines it.
//!
//! A file also uses a file of the same crate if it calls a method (`.name(`) that no other file
//! defines, of whatever crate. If several files define a method of that name, the text does not
//! say which one is called, and the call is ignored. `Self::name(` is ignored, and `Type::name(`
//! counts only as a use of the file that defines the type. Inline modules, tests among them, are
//! ignored.

use std::collections::{BTreeMap, BTreeSet};

/// A module's path; its first word is the crate.
type Path = Vec<String>;

struct Module {
    text: String,
    /// The full path of each imported name.
    imports: BTreeMap<String, Path>,
    /// Modules of which everything is imported.
    globs: Vec<Path>,
}

/// Names of methods that one file defines, and that types of the standard library have too.
const OF_THE_STANDARD_LIBRARY: [&str; 4] = ["any", "clone", "iter", "spawn"];

pub struct Sources {
    modules: BTreeMap<Path, Module>,
    /// For each name of a method, the modules that define it.
    methods: BTreeMap<String, BTreeSet<Path>>,
}

/// `engine/isa/space.rs` is `engine::isa::space`, `engine/isa/mod.rs` is `engine::isa`, and
/// `engine/lib.rs` is `engine`.
fn path_of(file: &str) -> Path {
    let inside = file.trim_end_matches(".rs");
    let inside = inside.trim_end_matches("/mod").trim_end_matches("/lib");
    inside.split('/').map(str::to_owned).collect()
}

/// The code without comments and inline modules.
fn code(text: &str) -> String {
    let mut kept = String::new();
    let mut closing: Option<String> = None;
    for line in text.lines() {
        let trimmed = line.trim_start();
        if let Some(end) = &closing {
            if line == end {
                closing = None;
            }
        } else if trimmed.split_whitespace().any(|w| w == "mod") && line.ends_with('{') {
            closing = Some(format!("{}}}", &line[..line.len() - trimmed.len()]));
        } else if !trimmed.starts_with("//") {
            kept.push_str(line.split(" // ").next().unwrap_or(line));
            kept.push('\n');
        }
    }
    kept
}

/// The import statements, without their `use`, and the rest of the code.
fn statements(code: &str) -> (Vec<String>, String) {
    let (mut uses, mut rest, mut open) = (Vec::new(), String::new(), None::<String>);
    for line in code.lines() {
        let begins = line.split_whitespace().take(2).any(|word| word == "use");
        if let Some(open) = &mut open {
            open.push_str(line.trim());
        } else if begins {
            let tree = line.split_once("use ").map_or("", |(_, tree)| tree);
            open = Some(tree.to_owned());
        } else {
            rest.push_str(line);
            rest.push('\n');
        }
        if let Some(tree) = open.take_if(|tree| tree.ends_with(';')) {
            uses.push(tree.trim_end_matches(';').to_owned());
        }
    }
    (uses, rest)
}

/// The leaves of an import: the path and the imported name (`*` for all).
fn leaves(before: &str, tree: &str, found: &mut Vec<(String, String)>) {
    let tree = tree.trim();
    if let Some((head, group)) = tree.split_once('{') {
        let before = format!("{before}{head}");
        let (mut depth, mut begin) = (0, 0);
        let group = &group[..group.len() - 1];
        for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    leaves(&before, &group[begin..at], found);
                    begin = at + 1;
                }
                _ => {}
            }
        }
    } else if !tree.is_empty() {
        let (path, name) = tree.split_once(" as ").unwrap_or((tree, ""));
        let whole = format!("{before}{path}");
        let whole = whole.trim_end_matches("::self").to_owned();
        let last = whole.rsplit("::").next().unwrap_or_default();
        let name = if name.is_empty() { last } else { name }.to_owned();
        found.push((whole, name));
    }
}

impl Sources {
    /// Reads files, given by their names, whose first folder is the crate, and their texts.
    pub fn new(files: impl Iterator<Item = (String, String)>) -> Sources {
        let files = files.filter(|(name, _)| !name.ends_with("/main.rs"));
        let files: Vec<_> = files.map(|(name, text)| (path_of(&name), code(&text))).collect();
        let empty = |text| Module { text, imports: BTreeMap::new(), globs: Vec::new() };
        let mut all = Sources { modules: BTreeMap::new(), methods: BTreeMap::new() };
        let mut uses = Vec::new();
        for (path, text) in files {
            let (imports, rest) = statements(&text);
            uses.push((path.clone(), imports));
            for name in methods(&rest) {
                all.methods.entry(name.to_owned()).or_default().insert(path.clone());
            }
            all.modules.insert(path, empty(rest));
        }
        for (path, trees) in uses {
            let mut found = Vec::new();
            trees.iter().for_each(|tree| leaves("", tree, &mut found));
            for (target, name) in found {
                let Some(target) = all.absolute(&path, &target) else { continue };
                let module = all.modules.get_mut(&path).expect("it was put in");
                if name == "*" {
                    module.globs.push(target[..target.len() - 1].to_vec());
                } else {
                    module.imports.insert(name, target);
                }
            }
        }
        all
    }

    /// The path from the crate's root for a path written in a module; `None` for a path into a
    /// different crate.
    fn absolute(&self, module: &Path, path: &str) -> Option<Path> {
        let mut whole = module.clone();
        let mut words = path.split("::").peekable();
        let first = words.next()?;
        match first {
            "crate" => whole.truncate(1),
            "self" => {}
            "super" => {
                whole.pop();
                while words.next_if_eq(&"super").is_some() {
                    whole.pop();
                }
            }
            _ => {
                let imported = self.modules.get(module).and_then(|m| m.imports.get(first));
                whole.push(first.to_owned());
                if let Some(target) = imported {
                    whole.clone_from(target);
                } else if !self.modules.contains_key(&whole) {
                    return None;
                }
            }
        }
        whole.extend(words.map(str::to_owned));
        Some(whole)
    }

    /// The module that defines the item of a path; `None` if the path names a module, or nothing in
    /// this crate.
    fn maker(&self, path: &[String], patience: u32) -> Option<Path> {
        let mut module = Path::new();
        for (at, word) in path.iter().enumerate() {
            module.push(word.clone());
            if self.modules.contains_key(&module) {
                continue;
            }
            module.pop();
            let here = self.modules.get(&module)?;
            let imported = here.imports.get(word).filter(|_| patience > 0);
            if let Some(target) = imported {
                let whole: Path = target.iter().chain(&path[at + 1..]).cloned().collect();
                return self.maker(&whole, patience - 1);
            }
            let makes = |module: &Path| self.modules.get(module).is_some_and(|m| m.makes(word));
            let glob = here.globs.iter().find(|glob| makes(glob)).cloned();
            return glob.or(Some(module));
        }
        None
    }

    fn used_by(&self, path: &Path) -> BTreeSet<Path> {
        let module = &self.modules[path];
        let mut used: BTreeSet<Path> =
            module.imports.values().filter_map(|target| self.maker(target, 9)).collect();
        for written in paths(&module.text) {
            let target = self.absolute(path, written);
            used.extend(target.and_then(|target| self.maker(&target, 9)));
        }
        used.extend(called(&module.text).filter_map(|name| self.method(path, name)));
        used.remove(path);
        used
    }

    /// The module that defines a method called in a module, if only one can be meant.
    fn method(&self, path: &Path, name: &str) -> Option<Path> {
        let makers = self.methods.get(name)?;
        let maker = makers.first().filter(|_| makers.len() == 1)?;
        let is_meant = maker[0] == path[0] && !OF_THE_STANDARD_LIBRARY.contains(&name);
        is_meant.then(|| maker.clone())
    }

    /// The modules that are in a circle, each with the modules of its circles.
    pub fn in_circles(&self) -> BTreeMap<String, BTreeSet<String>> {
        let edges: BTreeMap<&Path, BTreeSet<Path>> =
            self.modules.keys().map(|path| (path, self.used_by(path))).collect();
        let reach: BTreeMap<&Path, BTreeSet<&Path>> =
            self.modules.keys().map(|path| (path, reached(path, &edges))).collect();
        let mut found = BTreeMap::new();
        for (path, from) in &reach {
            let together = from.iter().filter(|other| reach[**other].contains(*path));
            let together: BTreeSet<String> =
                together.filter(|o| **o != *path).map(|o| o.join("::")).collect();
            if !together.is_empty() {
                found.insert(path.join("::"), together);
            }
        }
        found
    }
}

impl Module {
    fn makes(&self, name: &str) -> bool {
        let kinds = ["fn ", "struct ", "enum ", "trait ", "type ", "const ", "static "];
        kinds.iter().any(|kind| {
            self.text.match_indices(&format!("{kind}{name}")).any(|(at, found)| {
                !self.text[at + found.len()..]
                    .starts_with(|c: char| c.is_alphanumeric() || c == '_')
            })
        })
    }
}

fn reached<'a>(from: &Path, edges: &'a BTreeMap<&'a Path, BTreeSet<Path>>) -> BTreeSet<&'a Path> {
    let mut seen = BTreeSet::new();
    let mut next: Vec<&Path> = edges[from].iter().collect();
    while let Some(path) = next.pop() {
        if seen.insert(path) {
            next.extend(edges.get(path).into_iter().flatten());
        }
    }
    seen
}

/// The names of the methods and associated functions that a text defines: rustfmt indents them.
fn methods(code: &str) -> impl Iterator<Item = &str> {
    let indented = code.lines().filter(|line| line.starts_with(' '));
    let functions = indented.filter_map(|line| line.split_once("fn "));
    functions.map(|(_, rest)| word(rest)).filter(|name| !name.is_empty())
}

/// The names of the methods that a text calls.
fn called(code: &str) -> impl Iterator<Item = &str> {
    code.split('.').skip(1).filter_map(|rest| {
        let name = word(rest);
        let behind = &rest[name.len()..];
        (behind.starts_with('(') || behind.starts_with("::<")).then_some(name)
    })
}

/// The word at the beginning of a text.
fn word(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// The words of a text that contain `::`.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == ':';
    let words = text.split(move |c| !part(c)).map(|word| word.trim_matches(':'));
    words.filter(|word| word.contains("::"))
}

/// The files in circles, of a crate with these files; `/d/c.rs` is a file of the crate `d`.
#[cfg(test)]
fn circles(files: &[(&str, &str)]) -> Vec<String> {
    let place = |name: &str| match name.strip_prefix('/') {
        Some(elsewhere) => elsewhere.to_owned(),
        None => format!("crate/{name}"),
    };
    let files = files.iter().map(|(name, text)| (place(name), (*text).to_owned()));
    let root = ("crate/lib.rs".to_owned(), String::new());
    let found = Sources::new(files.chain([root])).in_circles().into_keys();
    found.map(|path| path.trim_start_matches("crate::").to_owned()).collect()
}

#[test]
fn a_cycle_is_found_through_imports_paths_and_reexports() {
    let root = ("a/mod.rs", "mod b;\nmod c;\npub use b::B;\n");
    let b = ("a/b.rs", "use super::c::{C, other};\npub struct B(C);\n");
    let handed = ("a/c.rs", "pub struct C;\nfn f(_: &crate::a::B) {}\n");
    assert_eq!(circles(&[root, b, handed]), ["a::b", "a::c"]);
    let straight =
        ("a/c.rs", "//! `super::B`\npub struct C;\nmod tests {\n    use super::super::B;\n}\n");
    assert!(circles(&[root, b, straight]).is_empty());
    let glob = ("a/c.rs", "use crate::a::*;\nuse super::b;\npub struct C;\nfn f(_: b::B) {}\n");
    assert_eq!(circles(&[root, b, glob]), ["a::b", "a::c"]);
}

#[test]
fn a_cycle_is_found_through_methods() {
    let root = ("a/mod.rs", "mod b;\nmod c;\n");
    let own =
        ("a/b.rs", "pub struct B;\nimpl B {\n    fn one(&self) {\n        self.two();\n    }\n}\n");
    let other = ("a/c.rs", "use super::b::B;\nimpl B {\n    pub fn two(&self) {}\n}\n");
    assert_eq!(circles(&[root, own, other]), ["a::b", "a::c"]);
    let both = format!("{}impl C {{\n    fn two(&self) {{}}\n}}\n", other.1);
    assert_eq!(circles(&[root, own, ("a/c.rs", &both)]), ["a::b", "a::c"]);
    let third = ("a/d.rs", "trait D {\n    fn two(&self);\n}\n");
    assert!(circles(&[root, own, other, third]).is_empty());
    let far = ("/d/c.rs", "use rungd_crate::a::b::B;\nimpl B {\n    pub fn two(&self) {}\n}\n");
    assert!(circles(&[root, own, far]).is_empty());
}
