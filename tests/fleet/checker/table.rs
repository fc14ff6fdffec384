//! Compares the list of all normative statements in `docs/sparkplug.md` with the rules: a `checked`
//! statement has a rule, a `held` statement names a test that exists, and no statement is listed
//! twice.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::{edge_rules, host_rules};

/// A row of the list.
struct StatementRow {
    id: String,
    /// `edge`, `host`, `both` or `other`.
    who: String,
    how: String,
    what: String,
}

/// The least number of statements in Sparkplug 3.0.0.
const STATEMENTS_LEAST: usize = 280;

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/sparkplug.md");
    fs::read_to_string(path).expect("the page is readable")
}

fn rows() -> Vec<StatementRow> {
    let page = page();
    let lines = page.lines().filter(|line| line.starts_with("| `"));
    let cells = lines.map(|line| line.split('|').map(str::trim).collect::<Vec<&str>>());
    let rows = cells.filter(|cells| cells.len() == 6 && cells[1].contains('-'));
    rows.map(|cells| StatementRow {
        id: cells[1].trim_matches('`').to_owned(),
        who: cells[2].to_owned(),
        how: cells[3].to_owned(),
        what: cells[4].to_owned(),
    })
    .collect()
}

#[test]
fn each_statement_of_the_specification_is_listed_once() {
    let rows = rows();
    let ids: BTreeSet<&str> = rows.iter().map(|row| row.id.as_str()).collect();
    assert_eq!(ids.len(), rows.len(), "a statement stands there twice");
    assert!(rows.len() >= STATEMENTS_LEAST, "{} statements", rows.len());
    for StatementRow { id, who, how, what } in &rows {
        assert!(["edge", "host", "both", "other"].contains(&who.as_str()), "{id}: {who}");
        assert!(["checked", "held", "no", "not followed"].contains(&how.as_str()), "{id}: {how}");
        assert!(what.len() > 10, "{id} has no words");
    }
}

#[test]
fn each_checked_statement_has_a_rule() {
    let of = |whose: &[&str]| -> BTreeSet<String> {
        let rows = rows().into_iter().filter(|row| row.how == "checked");
        rows.filter(|row| whose.contains(&row.who.as_str())).map(|row| row.id).collect()
    };
    let ruled = |rules: Vec<&'static super::Rule>| -> BTreeSet<String> {
        rules.iter().flat_map(|(ids, _)| ids.iter().map(|id| (*id).to_owned())).collect()
    };
    assert_eq!(of(&["edge", "both"]), ruled(edge_rules()));
    assert_eq!(of(&["host", "both"]), ruled(host_rules()));
}

/// A `held` statement names its test, for example `crates/fleet/src/fleet/tests/nodes.rs: name_of_a_test`.
#[test]
fn each_held_statement_names_an_existing_test() {
    for row in rows().into_iter().filter(|row| row.how == "held") {
        let place = row.what.split('`').rev().nth(1).unwrap_or_default().to_owned();
        let (file, name) = place.split_once(": ").unwrap_or_else(|| panic!("{}: {place}", row.id));
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let text = fs::read_to_string(&path).unwrap_or_else(|_| panic!("{}: {file}", row.id));
        assert!(text.contains(&format!("fn {name}()")), "{}: {place}", row.id);
    }
}
