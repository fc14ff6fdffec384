//! The table of `docs/modbus-devices.md` with the notations of manuals and other programs: each of
//! them gives a finding whose help has the page's rows, and each of these rows gives no finding.

use std::fmt::Write as _;

use rungd_config::load;
use rungd_language::source::render::{Style, render};
use rungd_test_support::folder::TestFolder;
use rungd_test_support::page;

/// A row of the table: the notations, and the rows of a map to write instead.
struct TableRow {
    notations: Vec<String>,
    rows: Vec<String>,
}

/// The texts in backticks.
fn codes(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn table() -> Vec<TableRow> {
    let page = page::text("modbus-devices.md");
    let (_, behind) = page.split_once("### Numbers in manuals").expect("the section");
    let section = behind.split("\n##").next().unwrap_or_default();
    let lines = section.lines().filter(|line| line.starts_with("| `"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').collect();
        TableRow { notations: codes(cells[0]), rows: codes(cells[2]) }
    };
    lines.map(row).collect()
}

/// Memory for the points of a row: as many bits or words, from a free number on.
fn memory(points: &str, free: &mut u32) -> String {
    let (table, rest) = points.split_once(' ').expect("a table and its elements");
    let number = |text: &str| match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).unwrap(),
        None => text.parse().unwrap(),
    };
    let count = rest.split_once("..").map_or(1, |(low, high)| number(high) - number(low) + 1);
    let is_bit = rest.replace("..", "").contains('.') || matches!(table, "coil" | "discrete");
    let first = *free;
    *free += count;
    let space = if is_bit { "C" } else { "D" };
    match count {
        1 => format!("{space}{first}"),
        _ => format!("{space}{first}..{space}{}", first + count - 1),
    }
}

/// The findings about a map with these rows, each from points to memory, as they are printed.
fn findings(rows: &[(&str, String)]) -> String {
    let folder = TestFolder::new("modbus-notations");
    let mut controller = "ladder = [\"ladder.toml\"]\n[[device]]\nname = \"line1\"\n\
         driver = \"modbus-tcp\"\naddress = \"127.0.0.1\"\nmap = [\n"
        .to_owned();
    for (from, to) in rows {
        writeln!(controller, "{{ from = \"{from}\", to = \"{to}\" }},").unwrap();
    }
    let ladder =
        "[[program]]\nname = \"Main\"\nrung = [{ when = [\"$On\"], do = [\"OUT C999\"] }]\n";
    let path = folder.path().join("controller.toml");
    std::fs::write(&path, controller + "]\n").unwrap();
    std::fs::write(folder.path().join("ladder.toml"), ladder).unwrap();
    let loaded = load::controller_file(&path).unwrap();
    render(&loaded.findings, &loaded.files, Style::default())
}

#[test]
fn the_finding_for_every_notation_of_the_page_shows_valid_rows() {
    let table = table();
    assert!(table.len() > 10, "the table is read");
    let (mut free, mut right) = (0, Vec::new());
    for TableRow { notations, rows } in &table {
        assert!(!notations.is_empty() && !rows.is_empty());
        for notation in notations {
            let told = findings(&[(notation, memory(&rows[0], &mut free))]);
            assert!(told.contains("\n\n1 error") || told.contains("[vendor-number]"), "{told}");
            let (_, help) = told.split_once("help: ").unwrap_or_else(|| panic!("{told}"));
            for row in rows {
                assert!(help.contains(&format!("`{row}`")), "{notation}: no `{row}` in {told}");
            }
        }
        for row in rows {
            right.push((row.as_str(), memory(row, &mut free)));
        }
    }
    let told = findings(&right);
    assert!(!told.contains("error[") && !told.contains("warning["), "{told}");
}
