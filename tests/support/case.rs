//! The cases of `tests/semantics/*.toml`: reads them and names their tests.
//!
//! A file may state `main` and `tags` before its cases. They apply to each case that does not state
//! them.

use std::path::{Path, PathBuf};

use rungd_base::calendar::{LocalTime, parse_seconds};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::table::Table;

/// One case of a file.
#[derive(Clone, Debug)]
pub struct Case {
    /// In kebab-case, and unique over all files.
    pub name: String,
    /// The sentence that the case demonstrates.
    pub says: String,
    /// The file of the case.
    pub file: String,
    /// The ladder's text.
    pub ladder: String,
    pub period_ms: u32,
    /// The local time of the first scan, as seconds since 1970.
    pub clock_s: i64,
    /// Whether the last scan of the table is the last scan of an orderly stop.
    pub stop: bool,
    /// The one warning that the load must give, in addition to the expected values.
    pub warned: Option<String>,
    pub expects: Expects,
}

/// The expected result of a case.
#[derive(Clone, Debug)]
pub enum Expects {
    Values(Table),
    /// The load is refused, with an error of this name.
    Refused(String),
}

const KEYS: [&str; 11] = [
    "name", "says", "tags", "main", "ladder", "period", "clock", "stop", "table", "refused",
    "warned",
];

impl Case {
    /// The names of the tests that the case makes. Each compared cell of a labelled row is a
    /// separate test; all other compared cells together are one test.
    pub fn tests(&self) -> Vec<String> {
        let Expects::Values(table) = &self.expects else { return vec![self.name.clone()] };
        let mut names = Vec::new();
        for row in &table.rows {
            for (column, expected) in table.columns.iter().zip(&row.expected) {
                if expected.is_some() {
                    let name = self.test_of(row.label.as_deref(), &column.alias);
                    if !names.contains(&name) {
                        names.push(name);
                    }
                }
            }
        }
        names
    }

    /// The test of a cell; all cells without a label belong to one test.
    pub fn test_of(&self, label: Option<&str>, alias: &str) -> String {
        match label {
            Some(label) => format!("{}-{label}-{alias}", self.name),
            None if self.name.contains('-') => self.name.clone(),
            None => format!("{}-between", self.name),
        }
    }

    fn new(table: &DeTable, file: &str, defaults: &Defaults) -> Result<Case, String> {
        let name = string(table, "name").ok_or_else(|| format!("{file}: a case has no name"))?;
        let fail = |what: String| format!("{file}: {name}: {what}");
        for key in table.keys() {
            if !KEYS.contains(&key.get_ref().as_ref()) {
                return Err(fail(format!("unknown key `{}`", key.get_ref())));
            }
        }
        let kebab = |c: char| c == '-' || c.is_ascii_lowercase() || c.is_ascii_digit();
        if !name.chars().all(kebab) {
            return Err(fail("a name is kebab-case".to_owned()));
        }
        let period = string(table, "period").unwrap_or_else(|| "10ms".to_owned());
        let period_ms = period.strip_suffix("ms").and_then(|n| n.parse().ok());
        let clock_s = match string(table, "clock") {
            Some(text) => parse_seconds(&text).ok_or_else(|| fail(format!("no time: `{text}`")))?,
            None => LocalTime::SIMULATED_S,
        };
        let expects = match (string(table, "table"), string(table, "refused")) {
            (Some(text), None) => Expects::Values(Table::parse(&text).map_err(fail)?),
            (None, Some(code)) => Expects::Refused(code),
            _ => return Err(fail("either `table` or `refused`".to_owned())),
        };
        Ok(Case {
            says: string(table, "says").ok_or_else(|| fail("`says` is missing".to_owned()))?,
            file: file.to_owned(),
            ladder: ladder(table, defaults).ok_or_else(|| fail("no `main`".to_owned()))?,
            period_ms: period_ms.ok_or_else(|| fail("period is `10ms`".to_owned()))?,
            clock_s,
            stop: boolean(table, "stop"),
            warned: string(table, "warned"),
            name,
            expects,
        })
    }
}

/// The keys that a file states before its cases.
#[derive(Default)]
struct Defaults {
    main: Option<String>,
    tags: Option<String>,
}

fn ladder(table: &DeTable, defaults: &Defaults) -> Option<String> {
    if let Some(ladder) = string(table, "ladder") {
        return Some(ladder);
    }
    let main = string(table, "main").or_else(|| defaults.main.clone())?;
    let tags = string(table, "tags").or_else(|| defaults.tags.clone()).unwrap_or_default();
    Some(format!("[tags]\n{tags}\n[[program]]\nname = \"Main\"\n{main}\n"))
}

fn value<'a>(table: &'a DeTable, key: &str) -> Option<&'a DeValue<'a>> {
    table.get(key).map(Spanned::get_ref)
}

fn string(table: &DeTable, key: &str) -> Option<String> {
    match value(table, key)? {
        DeValue::String(text) => Some(text.to_string()),
        _ => None,
    }
}

fn boolean(table: &DeTable, key: &str) -> bool {
    matches!(value(table, key), Some(DeValue::Boolean(true)))
}

/// All cases of all files, in the order of the file names.
pub fn all() -> Result<Vec<Case>, String> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/semantics");
    let listed = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<PathBuf> = listed.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "toml"));
    files.sort();
    let mut cases = Vec::new();
    for file in &files {
        cases.extend(read(file)?);
    }
    let mut names: Vec<String> = cases.iter().flat_map(Case::tests).collect();
    names.sort();
    if let Some(short) = names.iter().find(|name| !name.contains('-')) {
        return Err(format!("`{short}`: a test's name has two words at least"));
    }
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("two tests are called {}", twice[0]));
    }
    Ok(cases)
}

fn read(file: &Path) -> Result<Vec<Case>, String> {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(file).map_err(|e| format!("{name}: {e}"))?;
    let table = DeTable::parse(&text).map_err(|e| format!("{name}: {e}"))?;
    let table = table.get_ref();
    let defaults = Defaults { main: string(table, "main"), tags: string(table, "tags") };
    let Some(DeValue::Array(cases)) = value(table, "case") else {
        return Err(format!("{name}: no [[case]]"));
    };
    let tables = cases.iter().filter_map(|case| match case.get_ref() {
        DeValue::Table(table) => Some(table),
        _ => None,
    });
    tables.map(|table| Case::new(table, &name, &defaults)).collect()
}
