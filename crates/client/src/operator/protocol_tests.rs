//! Unit tests of the protocol's lines, as shown in `docs/operator.md`.

use super::protocol::*;
use rungd_runtime::events::Level;

#[test]
fn the_requests_of_the_page_are_parsed_and_printed_unchanged() {
    for line in [
        r#"{"do":"status"}"#,
        r#"{"do":"read","operands":["jam","CT0"]}"#,
        r#"{"do":"read","operands":["jam","CT0"],"each":true}"#,
        r#"{"do":"write","operand":"bin_size","value":12}"#,
        r#"{"do":"write-set","writes":[{"operand":"bin_size","value":24}]}"#,
        r#"{"do":"read-set","operands":["bin_size"]}"#,
        r#"{"do":"force","operand":"Y1","value":true}"#,
        r#"{"do":"force","operand":"T0.Acc","value":"1m30s"}"#,
        r#"{"do":"unforce","operand":"Y1"}"#,
        r#"{"do":"unforce-all"}"#,
        r#"{"do":"mode","to":"run"}"#,
        r#"{"do":"reload","dry_run":true}"#,
        r#"{"do":"rollback"}"#,
        r#"{"do":"log-level","level":"debug"}"#,
        r#"{"do":"retain-save"}"#,
        r#"{"do":"names","prefix":"b"}"#,
    ] {
        let request: Request = serde_json::from_str(line).expect(line);
        assert_eq!(serde_json::to_string(&request).unwrap(), line);
    }
    let all = serde_json::from_str(r#"{"do":"read-set"}"#);
    assert!(matches!(all, Ok(Request::ReadSet { operands }) if operands.is_empty()));
    for line in ["", "{}", "[]", r#"{"do":"dance"}"#, r#"{"do":"read","operand":"X0"}"#] {
        assert!(serde_json::from_str::<Request>(line).is_err(), "{line}");
    }
    // A request that names an operand must not end all forces.
    for line in [r#"{"do":"unforce-all","operand":"Y1"}"#, r#"{"do":"status","to":"run"}"#] {
        let error = serde_json::from_str::<Request>(line).expect_err(line).to_string();
        assert!(error.contains("unknown field"), "{line}: {error}");
    }
    for value in ["null", "[1]"] {
        let line = format!(r#"{{"do":"write","operand":"D1","value":{value}}}"#);
        let error = serde_json::from_str::<Request>(&line).expect_err(&line).to_string();
        assert!(error.contains("a value is true or false, a number"), "{error}");
    }
}

/// A number is read exactly as written, to its last bit: for a real, the neighbouring number would
/// be a different value.
#[test]
fn a_number_is_read_exactly_to_its_last_bit() {
    for number in ["199919999919.42652713", "0.1", "1.7976931348623157e308", "2.5e-7"] {
        let line = format!(r#"{{"do":"write","operand":"R0","value":{number}}}"#);
        let Ok(Request::Write { value: GivenValue::Real(read), .. }) = serde_json::from_str(&line)
        else {
            panic!("{line}");
        };
        assert_eq!(read.to_bits(), number.parse::<f64>().unwrap().to_bits(), "{number}");
    }
}

#[test]
fn replies_are_parsed_as_ok_or_error() {
    let ok: Reply<LevelChange> =
        serde_json::from_str(r#"{"ok":{"before":"info","after":"debug"}}"#).unwrap();
    assert_eq!(ok, Reply::Ok(LevelChange { before: Level::Info, after: Level::Debug }));
    let line = r#"{"error":{"kind":"not-permitted","message":"no"}}"#;
    let error: Reply<LevelChange> = serde_json::from_str(line).unwrap();
    assert_eq!(serde_json::to_string(&error).unwrap(), line);
}
