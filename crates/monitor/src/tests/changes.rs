//! Nothing is changed in a controller without a dialog that is confirmed by `y`.

use super::{Bench, bit, word};
use crate::message::{KeyPress, MonitorNews};
use rungd_base::random::SplitMix64;

/// A monitor that watches two operands; the first one is chosen.
fn watching() -> Bench {
    let mut bench = Bench::start();
    bench.news(MonitorNews::Found(Ok(vec![word("D0", 12), bit("motor", "Y0", true)])));
    bench.press(KeyPress::Home);
    bench.orders();
    bench
}

#[test]
fn a_typed_force_is_sent_after_confirmation() {
    let mut bench = watching();
    bench.keys("f75");
    bench.press(KeyPress::Enter);
    assert_eq!(bench.orders(), [""; 0], "nothing before the answer");
    bench.keys("y");
    assert_eq!(bench.orders(), [r#"{"do":"force","operand":"D0","value":"75"}"#]);
    bench.news(MonitorNews::Changed(Ok("D0: 75, forced, was 12".into())));
    assert!(bench.shown().contains("D0: 75, forced, was 12"));
}

#[test]
fn the_other_value_of_a_bit_is_proposed() {
    let mut bench = watching();
    bench.press(KeyPress::Down);
    bench.keys("s");
    bench.press(KeyPress::Enter);
    bench.keys("y");
    assert_eq!(bench.orders(), [r#"{"do":"write","operand":"motor","value":"OFF"}"#]);
}

#[test]
fn the_present_value_is_proposed_until_a_key_is_typed() {
    let mut bench = Bench::start();
    [KeyPress::Tab, KeyPress::Tab].into_iter().for_each(|press| bench.press(press));
    bench.keys("f");
    assert!(bench.orders().contains(&r#"Read(["jam"])"#.to_owned()), "its value is asked for");
    assert!(bench.shown().contains("present value: not known yet"));
    bench.look(super::status(), vec![bit("jam", "C0", true)]);
    assert!(bench.shown().contains("new value: OFF_"), "{}", bench.shown());
    bench.keys("ON");
    assert!(bench.shown().contains("new value: ON_"), "{}", bench.shown());
    [KeyPress::Backspace; 2].into_iter().for_each(|press| bench.press(press));
    bench.look(super::status(), vec![bit("jam", "C0", true)]);
    assert!(bench.shown().contains("new value: _"), "{}", bench.shown());
}

#[test]
fn a_force_is_released_after_confirmation() {
    let mut bench = watching();
    [KeyPress::Tab; 3].into_iter().for_each(|press| bench.press(press));
    bench.keys("u");
    let shown = bench.shown();
    assert!(shown.contains("Release the force of stop?"), "{shown}");
    assert!(shown.contains("present value: OFF, forced"), "{shown}");
    bench.keys("y");
    let orders = bench.orders();
    assert!(orders.contains(&r#"{"do":"unforce","operand":"stop"}"#.to_owned()), "{orders:?}");
}

#[test]
fn an_alarm_is_acknowledged_after_confirmation() {
    let mut bench = Bench::start();
    [KeyPress::Tab; 2].into_iter().for_each(|press| bench.press(press));
    bench.keys("k");
    assert!(bench.shown().contains("Acknowledge jam?"), "{}", bench.shown());
    bench.orders();
    bench.keys("y");
    let orders = bench.orders();
    assert!(orders.contains(&r#"{"do":"ack","alarms":["jam"]}"#.to_owned()), "{orders:?}");
}

/// The page of alarms, with `jam` chosen and the keys pressed.
fn at_alarms(shelved: bool, keys: &str) -> Bench {
    let mut bench = Bench::start();
    if shelved {
        let mut status = super::status();
        status["alarms"][0]["shelved"] = super::shelf();
        bench.look(status, Vec::new());
    }
    [KeyPress::Tab; 2].into_iter().for_each(|press| bench.press(press));
    bench.orders();
    bench.keys(keys);
    bench
}

#[test]
fn an_alarm_is_shelved_for_a_typed_time_with_a_reason() {
    let mut bench = at_alarms(false, "h");
    let shown = bench.shown();
    assert!(shown.contains("Shelve jam") && shown.contains("for how long: 8h_"), "{shown}");
    [KeyPress::Backspace; 2].into_iter().for_each(|press| bench.press(press));
    bench.keys("half");
    bench.press(KeyPress::Enter);
    let shown = bench.shown();
    assert!(shown.contains("for how long: half_") && shown.contains("30m, 8h, 168h"), "{shown}");
    [KeyPress::Backspace; 4].into_iter().for_each(|press| bench.press(press));
    bench.keys("30m");
    bench.press(KeyPress::Enter);
    assert!(bench.shown().contains("why: _"), "{}", bench.shown());
    bench.press(KeyPress::Enter);
    assert_eq!(sent(&mut bench), [""; 0], "nothing without a reason");
    bench.keys("the eye is dirty ");
    bench.press(KeyPress::Enter);
    let order = r#"{"do":"shelve","alarms":["jam"],"for_ms":1800000,"why":"the eye is dirty"}"#;
    assert_eq!(sent(&mut bench), [order]);
    assert!(bench.state.dialog.is_none());
}

#[test]
fn an_alarm_without_a_time_is_out_of_service() {
    let mut bench = at_alarms(false, "h");
    [KeyPress::Backspace; 2].into_iter().for_each(|press| bench.press(press));
    bench.press(KeyPress::Enter);
    assert!(bench.shown().contains("for how long: out of service"), "{}", bench.shown());
    bench.keys("rebuilt");
    bench.press(KeyPress::Enter);
    assert_eq!(sent(&mut bench), [r#"{"do":"shelve","alarms":["jam"],"why":"rebuilt"}"#]);
}

#[test]
fn a_shelved_alarm_is_brought_back_after_confirmation() {
    let mut bench = at_alarms(true, "h");
    assert!(bench.shown().contains("Bring back jam?"), "{}", bench.shown());
    assert_eq!(sent(&mut bench), [""; 0], "nothing before the answer");
    bench.keys("y");
    assert_eq!(sent(&mut bench), [r#"{"do":"unshelve","alarms":["jam"]}"#]);
}

#[test]
fn escape_and_what_is_no_alarm_shelve_nothing() {
    let mut bench = at_alarms(false, "h");
    bench.press(KeyPress::Enter);
    bench.keys("a reason");
    bench.press(KeyPress::Escape);
    assert!(bench.state.dialog.is_none());
    let mut watching = watching();
    watching.keys("h");
    assert!(watching.shown().contains("D0 is no alarm of the list"), "{}", watching.shown());
    assert_eq!((sent(&mut bench), sent(&mut watching)), (vec![], vec![]));
}

/// The changes that are sent since the last call of `orders`.
fn sent(bench: &mut Bench) -> Vec<String> {
    let mut orders = bench.orders();
    orders.retain(|order| order.starts_with("{\"do\""));
    orders
}

#[test]
fn every_key_but_y_cancels_a_change() {
    for leave in [KeyPress::Escape, KeyPress::Char('n'), KeyPress::Interrupt] {
        let mut bench = watching();
        bench.keys("f75");
        bench.press(KeyPress::Enter);
        [KeyPress::Enter, KeyPress::Tab, KeyPress::Down]
            .into_iter()
            .for_each(|press| bench.press(press));
        bench.press(leave);
        let orders = bench.orders();
        assert!(orders.iter().all(|order| order == "quit"), "{orders:?}");
        assert!(bench.state.dialog.is_none() || leave == KeyPress::Interrupt);
    }
    let mut bench = watching();
    bench.keys("s");
    bench.press(KeyPress::Enter);
    bench.keys("y");
    assert_eq!(bench.orders(), [""; 0], "an empty value is not confirmed");
}

/// For any keys and news, in any order and any window size: no panic, and no change without `y`.
#[test]
fn no_random_keys_cause_a_change_without_confirmation() {
    let presses = [
        KeyPress::Enter,
        KeyPress::Escape,
        KeyPress::Tab,
        KeyPress::BackTab,
        KeyPress::Up,
        KeyPress::Down,
        KeyPress::Left,
        KeyPress::Right,
        KeyPress::PageUp,
        KeyPress::PageDown,
        KeyPress::Home,
        KeyPress::End,
        KeyPress::Backspace,
        KeyPress::Delete,
    ];
    let letters: Vec<char> = "adwfuskl?1x\u{1b}é".chars().collect();
    let mut random = SplitMix64(3);
    let mut bench = watching();
    for step in 0..4000 {
        let at = |count: usize, by: u64| usize::try_from(by % count as u64).unwrap_or(0);
        let by = random.next();
        match by % 8 {
            0 => bench.tick(step * 50),
            1 => bench.news(MonitorNews::Found(Ok(vec![word("D0", step as i32)]))),
            2 if by.is_multiple_of(3) => bench.news(MonitorNews::Silent("gone".into())),
            2 => bench.look(super::status(), vec![word("D0", 4)]),
            3..6 => bench.press(presses[at(presses.len(), random.next())]),
            _ => bench.press(KeyPress::Char(letters[at(letters.len(), random.next())])),
        }
        if step % 16 == 0 {
            bench.size = (at(120, random.next()) as u16 + 1, at(40, random.next()) as u16 + 1);
            bench.shown();
        }
        let orders = bench.orders();
        assert!(!orders.iter().any(|order| order.starts_with("{\"do\"")), "{orders:?}");
        assert!(bench.state.pages.len() <= 3, "{:?}", bench.state.pages);
    }
}
