//! Named cases: what `laddercodec` and `pyrung` make of CLICK's instructions, and what gets a stub.

use rungd_import::click;
use rungd_import::model::Fate;

use super::ladder;
use crate::plant;

/// Executes a ladder, and compares a tag after each scan: `0; x_1=1 10` is a scan that leaves 0,
/// and one that leaves 10, with a change before it.
fn shows(rows: &[&[&str]], tag: &str, scans: &str) {
    let project = click::read(&ladder(rows)).unwrap();
    let mut plc = plant::started(&project);
    for (at, scan) in scans.split(';').enumerate() {
        let (changes, wanted) = scan.trim().rsplit_once(' ').unwrap_or(("", scan.trim()));
        let changes = changes.split_whitespace().map(|change| {
            let (name, value) = change.split_once('=').unwrap();
            (name.to_owned(), value.parse().unwrap())
        });
        plant::scan(&mut plc, 10 * at as u64, &changes.collect::<Vec<_>>());
        let wanted: i64 = wanted.parse().unwrap();
        assert_eq!(plc.value(tag), wanted, "scan {at}\n{}", plant::texts(&project));
    }
}

#[test]
fn an_on_delay_is_done_when_its_time_is_over_and_goes_on() {
    let rung: &[&str] = &["R", "X001", "on_delay(T1,TD1,preset=20,unit=Tms)"];
    shows(&[rung], "td_1", "0; x_1=1 10; 20; 30; x_1=0 0");
    shows(&[rung], "t_1", "0; x_1=1 0; 1; 1; x_1=0 0");
}

#[test]
fn a_retained_timer_keeps_its_time_until_its_reset() {
    let rows: &[&[&str]] =
        &[&["R", "X001", "on_delay(T1,TD1,preset=20,unit=Tms)"], &["", "X002", ".reset()"]];
    shows(rows, "td_1", "0; x_1=1 10; x_1=0 10; x_1=1 20; x_2=1 0");
}

#[test]
fn a_timer_in_seconds_keeps_the_rest_of_a_second() {
    let rung: &[&str] = &["R", "X001", "on_delay(T1,TD1,preset=2,unit=Ts)"];
    let scans = format!("x_1=1 0{}; 1", "; 0".repeat(98));
    shows(&[rung], "td_1", &scans);
}

#[test]
fn a_counter_counts_every_scan_with_power_and_its_reset_wins() {
    let rows: &[&[&str]] =
        &[&["R", "X001", "count_up(CT1,CTD1,preset=2)"], &["", "X002", ".reset()"]];
    shows(rows, "ct_1", "0; x_1=1 0; 1; x_2=1 0");
}

#[test]
fn math_is_cut_to_sixteen_bits_and_copy_is_limited() {
    let rows: &[&[&str]] =
        &[&["R", "SC1", "math(DS1 + 1,DS2,mode=decimal)"], &["R", "SC1", "copy(DD1,DS3)"]];
    shows(rows, "ds_2", "ds_1=32767 -32768");
    shows(rows, "ds_3", "dd_1=40000 32767");
}

#[test]
fn the_contacts_of_a_rung_are_those_of_its_beginning() {
    let rows: &[&[&str]] =
        &[&["R", "~C1", "T", "latch(C1)"], &["", "", "-", "-", "-", "-", "-", "latch(C2)"]];
    let project = click::read(&ladder(rows)).unwrap();
    assert_eq!(project.outcome.rungs.len(), 1);
    shows(rows, "c_1", "1");
    shows(rows, "c_2", "1");
}

#[test]
fn what_is_not_translated_gets_a_stub_with_the_reason() {
    for (call, reason) in [
        ("shift(C1..C8)", "the instruction shift"),
        ("copy(DS1,TXT1)", "the operand `TXT1`"),
        ("copy(DS1,DS2,convert=ascii)", "copy that converts"),
        ("fill(DS1,DS2..DS3,convert=ascii)", "fill that converts"),
        ("blockcopy(DS1..DS2,DS3..DS4,convert=ascii)", "blockcopy that converts"),
        ("out(C1,oneshot=1)", "out as a one-shot"),
        ("out(immediate(Y001))", "an immediate coil"),
        ("math(DS1 / 2,DS2,mode=decimal)", "`/` in math"),
        ("math(DS1,DH1,mode=hex)", "math in hexadecimal numbers"),
        ("out(Y999)", "the address `Y999`, which no CLICK has"),
        ("nonsense", "the instruction `nonsense`"),
        ("call(\"\"Sub\"\")", "the instruction call"),
    ] {
        let project = click::read(&ladder(&[&["R", "X001", call]])).unwrap();
        let fate = &project.outcome.rungs[0].fate;
        assert_eq!(*fate, Fate::Todo(reason.to_owned()), "{call}");
    }
}

#[test]
fn a_damaged_file_is_refused_with_its_line() {
    let good = ladder(&[&["R", "X001", "out(Y001)"]]);
    for (text, why) in [
        (good.replace("R,", "Q,"), "line 2: `Q` begins no rung; `R` does"),
        (good.replace("out(Y001)", "out(Y001)\",\"x"), "line 2: 34 columns; a row has 33"),
        (good.replace(")\"", ")"), "line 2: a quotation mark is missing"),
    ] {
        assert_eq!(click::read(&text).unwrap_err(), why);
    }
}

#[test]
fn large_and_tangled_grids_end() {
    let mut rows: Vec<Vec<&str>> = Vec::new();
    for at in 0..900 {
        let mut row = vec![if at == 0 { "R" } else { "" }];
        row.resize(32, "T:X001");
        row.push("out(C1)");
        rows.push(row);
    }
    let rows: Vec<&[&str]> = rows.iter().map(Vec::as_slice).collect();
    let project = click::read(&ladder(&rows)).unwrap();
    assert_eq!(project.outcome.rungs.len(), 1);
}

#[test]
fn a_nickname_file_gives_tags_their_names_comments_and_initial_values() {
    let nicknames = "Address,Data Type,Nickname,Initial Value,Retentive,Address Comment\n\
                     X001,BIT,\"Start\",0,No,\"Start button, NO\"\nDS1,INT,\"Speed\",25,Yes,\"\"\n\
                     C5,BIT,\"Unused\",0,No,\"\"\nDS2,INT,\"\",0,No,\"No name\"\n";
    let rows: &[&[&str]] = &[&["R", "X001", "copy(DS1,DS2)"]];
    let project = click::read_named(&ladder(rows), nicknames).unwrap();
    let tags = project.files[0].tags.iter().filter(|tag| !tag.is_own);
    let tags: Vec<String> = tags
        .map(|tag| {
            let initial = tag.initial.as_deref().unwrap_or("0");
            format!("{} {initial} {}", tag.name, tag.doc)
        })
        .collect();
    assert_eq!(tags, ["Start 0 X1: Start button, NO", "Speed 25 DS1", "ds_2 0 DS2: No name"]);
    let outcome = &project.outcome;
    assert!(outcome.differences.iter().any(|text| text.contains("[retain]")), "{outcome:?}");
    assert_eq!(outcome.left_out, ["1 nicknames of addresses that the ladder never names"]);
    let mut plc = plant::started(&project);
    plant::scan(&mut plc, 0, &[("Start".to_owned(), 1)]);
    assert_eq!(plc.value("ds_2"), 25);
    let why = click::read_named(&ladder(rows), "Address,Nickname\n").unwrap_err();
    assert!(why.contains("no column `Initial Value`"), "{why}");
}
