//! Tests of the stimulus: its header, its rows and its cells.

use super::*;
use rungd_base::scan_period::ScanPeriod;
use rungd_engine::BitCell;

fn lookup(name: &str) -> Result<StimulusTarget, String> {
    match name {
        "X0" => Ok(StimulusTarget::Input(0)),
        "C0" | "jam" => Ok(StimulusTarget::Bit(Cell::Bit(BitCell(5)))),
        "D0" => Ok(StimulusTarget::Word(WordCell(7), (-5, 5))),
        _ => Err(format!("`{name}` cannot be written")),
    }
}

fn error(text: &str) -> String {
    let error = Stimulus::parse_timed(text, ScanPeriod::DEFAULT, &lookup).unwrap_err();
    format!("{}: {}", error.line, error.message)
}

#[test]
fn each_row_becomes_the_changes_of_its_scan() {
    let text = "scan,X0,C0,D0\r\n0,1,,-5\r\n\r\n3,0,1,\r\n";
    let stimulus = Stimulus::parse_timed(text, ScanPeriod::DEFAULT, &lookup).unwrap();
    let mut from = 0;
    let of: Vec<Vec<StimulusChange>> =
        (0..4).map(|scan| stimulus.of_scan(scan, &mut from).collect()).collect();
    let first = vec![StimulusChange::Input(0, true), StimulusChange::Word(WordCell(7), -5)];
    let last =
        vec![StimulusChange::Input(0, false), StimulusChange::Bit(Cell::Bit(BitCell(5)), true)];
    assert_eq!(of, [first, vec![], vec![], last]);
}

#[test]
fn cells_in_quotes_are_read() {
    let plain = "scan,X0,C0\n0,1,\n3,0,1\n";
    let quoted = "\u{feff}\"scan\",\"X0\",\"C0\"\r\n\"0\",\"1\",\"\"\r\n\"3\",0,\"1\"\r\n";
    let read = |text: &str| Stimulus::parse_timed(text, ScanPeriod::DEFAULT, &lookup).unwrap();
    assert_eq!(read(quoted), read(plain));
    assert_eq!(
        error("scan,X0\n0,\"1\n"),
        "2: a cell begins with a quote and ends without one: close it"
    );
    let time = error("time,X0\n\"0,35s\",1\n");
    assert_eq!(time, "2: `0,35s` has a decimal comma: write `350ms`");
}

#[test]
fn a_word_accepts_the_integer_notations_of_a_ladder() {
    let change = |cell: &str| {
        let text = format!("scan,D0\n0,{cell}\n");
        let stimulus = Stimulus::parse_timed(&text, ScanPeriod::DEFAULT, &lookup).unwrap();
        stimulus.of_scan(0, &mut 0).collect::<Vec<_>>()
    };
    assert_eq!(change("0x5"), [StimulusChange::Word(WordCell(7), 5)]);
    assert_eq!(change("-0x5"), [StimulusChange::Word(WordCell(7), -5)]);
    assert_eq!(change("5ms"), [StimulusChange::Word(WordCell(7), 5)]);
    let wanted = "`D0` is a word: it takes a whole number, as 12, 0x1F or 1m30s";
    for (cell, why) in [
        ("16#5", format!("{wanted}, not `16#5`: write `0x5`")),
        ("1.5", format!("{wanted}, not `1.5`")),
        ("five", format!("{wanted}, not `five`")),
        ("5 5", format!("{wanted}, not `5 5`")),
        ("0x10", "`D0` takes -5 to 5, not 16".to_owned()),
    ] {
        assert_eq!(error(&format!("scan,D0\n0,{cell}\n")), format!("2: {why}"));
    }
    let beyond = error("scan,D0\n0,0xFFFFFFFF\n");
    assert!(beyond.ends_with("the same bits are `-1`"), "{beyond}");
}

#[test]
fn a_time_selects_the_first_scan_at_or_after_it() {
    let scans = |text: &str| {
        let stimulus = Stimulus::parse_timed(text, ScanPeriod::DEFAULT, &lookup).unwrap();
        stimulus.rows.0.iter().map(|(scan, _)| *scan).collect::<Vec<_>>()
    };
    let text = "time,X0\n0s,1\n0.005s,0\n0.02s,1\n0.020001s,0\n350ms,1\n1m30s,0\n";
    assert_eq!(scans(text), [0, 1, 2, 3, 35, 9000]);
    let wrong = |time: &str| error(&format!("time,X0\n0.1s,1\n{time},0\n"));
    assert!(wrong("0.05s").contains("rows ascend by time"));
    assert!(wrong("0.095s").contains("falls into scan 10, which has a row already"));
    for time in ["5", ".5s", "1.s", "0.1234567s", "-1s", "1.5", "x", ""] {
        assert!(wrong(time).contains("write it as 0.35s"), "{time}");
    }
}

#[test]
fn a_row_that_is_never_reached_is_reported() {
    let text = "scan,X0\n0,1\n9,0\n10,1\n12,0\n";
    let mut stimulus = Stimulus::parse(text, &lookup).unwrap();
    let rows = stimulus.take_rows();
    let left_out = |executed, planned| {
        let StimulusError { line, message } = rows.left_out(executed, planned)?;
        Some(format!("{line}: {message}"))
    };
    let short = "the simulation has 10 scans, from 0 on (2 rows are left out)";
    assert_eq!(left_out(10, 10), Some(format!("4: scan 10 is not executed: {short}")));
    let stopped = "a STOP instruction ended the simulation after scan 10 (1 row is left out)";
    assert_eq!(left_out(11, 50), Some(format!("5: scan 12 is not executed: {stopped}")));
    let none = "the simulation has 0 scans, from 0 on (4 rows are left out)";
    assert_eq!(left_out(0, 0), Some(format!("2: scan 0 is not executed: {none}")));
    assert_eq!((left_out(13, 13), left_out(13, 50)), (None, None));
}

#[test]
fn an_element_written_with_commas_is_reported_with_its_name() {
    let told = |text: &str| split_element(text.split(','));
    let said = "commas separate operands here: instead of";
    assert_eq!(told("X0,N,3,6"), Some(format!("{said} `N,3,6` write `N3.ACC`")));
    assert_eq!(told("n,3"), Some(format!("{said} `N,3` write `N3.ACC`")));
    assert_eq!(told("N,3,0,X1"), Some(format!("{said} `N,3,0` write `N3.CU`")));
    assert_eq!(told("N,03"), Some(format!("{said} `N,03` write `N3.ACC`")));
    assert_eq!((told("N3.ACC,X1"), told("N,X1")), (None, None));
    let beyond = |text: &str| Some(format!("`{text}` lies beyond memory: N0..N63"));
    for text in ["N,64", "N,99,1", "N,99999999999,9"] {
        assert_eq!(told(text), beyond(text));
    }
    let elements = "a Sensaphone counter has the elements 0 to 6";
    assert_eq!(
        told("N,3,9"),
        Some(format!("`N,3,9` has no meaning: {elements} (the current value is `N3.ACC`)"))
    );
    assert!(error("scan,N,3,6").contains("write `N3.ACC`"));
}

#[test]
fn errors_name_their_line() {
    assert_eq!(error(""), "1: the header is `scan,` or `time,` and operands, as `scan,X0,D1`");
    assert_eq!(error("scan,CT0.Done"), "1: `CT0.Done` cannot be written");
    assert_eq!(error("scan,C0,jam"), "1: `jam` and `C0` are the same operand");
    assert_eq!(error("scan,X0\n5,1\n4,1"), "3: scan 4 comes after scan 5: rows ascend by scan");
    assert_eq!(
        error("scan,X0\n5,1\n5,0"),
        "3: scan 5 has a row already: one row holds all changes of a scan"
    );
    assert_eq!(error("scan,X0\n0,2"), "2: `X0` is a bit: it takes 0 or 1, not `2`");
    assert_eq!(error("scan,D0\n0,6"), "2: `D0` takes -5 to 5, not 6");
    assert_eq!(
        error("scan,D0\n0,1,2"),
        "2: the row has 2 cells after the first, the header names 1 operands"
    );
    assert_eq!(error("scan,D0\n-1,1"), "2: `-1` is not a scan: a number from 0 is wanted");
}
