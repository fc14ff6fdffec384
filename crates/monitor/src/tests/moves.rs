//! Moves through the panes, the watch list and the ladder by keys, and the requests that they
//! cause.

use super::{Bench, bit, program, status, word};
use crate::message::{KeyPress, MonitorNews};
use crate::state::{MonitorPage, MonitorPane};
use rungd_client::operator::protocol::OfferedName;

#[test]
fn the_tab_key_cycles_through_the_panes() {
    let mut bench = Bench::start();
    let mut seen = Vec::new();
    for _ in 0..6 {
        seen.push(bench.state.focus());
        bench.press(KeyPress::Tab);
    }
    assert_eq!(seen[..5], MonitorPane::ALL);
    assert_eq!(seen[5], MonitorPane::Watch);
    bench.press(KeyPress::BackTab);
    assert_eq!(bench.state.focus(), MonitorPane::Watch);
}

#[test]
fn an_operand_is_added_by_the_beginning_of_its_name_and_removed() {
    let mut bench = Bench::start();
    bench.orders();
    bench.keys("amo");
    let names = |prefix: &str| format!("Names({prefix:?})");
    assert_eq!(bench.orders(), [names(""), names("m"), names("mo")]);
    let motor = OfferedName { name: "motor".into(), about: String::new() };
    bench.news(MonitorNews::Names("m".into(), vec![]));
    bench.news(MonitorNews::Names("mo".into(), vec![motor]));
    bench.press(KeyPress::Tab);
    bench.press(KeyPress::Enter);
    assert_eq!(bench.orders(), [r#"Find("motor")"#]);
    bench.news(MonitorNews::Found(Ok(vec![bit("motor", "Y0", true)])));
    assert_eq!(bench.orders(), [r#"Read(["motor"])"#]);
    bench.keys("d");
    assert_eq!(bench.orders(), ["Read([])"]);
    bench.news(MonitorNews::Found(Err("`moter` names nothing".into())));
    assert!(bench.shown().contains("`moter` names nothing"));
}

#[test]
fn operands_of_the_command_line_are_requested_once_the_controller_answers() {
    let mut bench = Bench::silent();
    bench.state.at_start = vec!["motor".to_owned()];
    bench.news(MonitorNews::Silent("none answers".into()));
    assert_eq!(bench.orders(), [""; 0]);
    bench.look(status(), vec![]);
    assert_eq!(bench.orders(), [r#"Find("motor")"#, "Ladder"]);
}

#[test]
fn the_ladder_is_requested_once_for_each_program() {
    let mut bench = Bench::start();
    bench.orders();
    let mut other = status();
    other["ladder"]["sha256"] = "def".into();
    for (ms, asked) in [(0, 0), (2000, 0), (3000, 1), (3200, 0), (7000, 1)] {
        bench.tick(ms);
        bench.look(other.clone(), vec![]);
        assert_eq!(bench.orders().len(), asked, "at {ms} ms");
    }
    bench.news(MonitorNews::Ladder("def".into(), Ok(program())));
    bench.tick(60_000);
    bench.look(other, vec![]);
    assert_eq!(bench.orders(), [""; 0]);
}

#[test]
fn enter_on_a_stage_opens_its_rungs() {
    let mut bench = Bench::start();
    bench.press(KeyPress::Tab);
    [KeyPress::Down, KeyPress::Down].into_iter().for_each(|press| bench.press(press));
    bench.press(KeyPress::Enter);
    assert_eq!(bench.state.page(), MonitorPage::Ladder);
    let shown = bench.shown();
    assert!(shown.contains("Stage Filler.Fill, 2 of 2"), "{shown}");
    assert_eq!(bench.orders().last().map(String::as_str), Some("Follow(true)"));
    bench.press(KeyPress::Escape);
    assert_eq!(bench.orders().last().map(String::as_str), Some("Follow(false)"));
}

#[test]
fn the_mark_in_the_ladder_selects_an_operand() {
    let mut bench = Bench::start();
    bench.keys("l");
    let mut operands = Vec::new();
    for _ in 0..5 {
        operands.push(bench.state.ladder.operand().unwrap_or_default());
        bench.press(KeyPress::Right);
    }
    assert_eq!(operands, ["start", "motor", "stop", "motor", "motor"]);
    bench.press(KeyPress::Down);
    assert_eq!(bench.state.ladder.operand().as_deref(), Some("D0"));
    bench.orders();
    bench.press(KeyPress::Enter);
    assert_eq!(bench.orders(), [r#"Why("D0")"#, "Read([])"]);
    bench.press(KeyPress::Escape);
    assert_eq!(bench.state.page(), MonitorPage::Ladder, "back to where it was asked");
    bench.keys("a");
    assert_eq!(bench.orders(), [r#"Read(["D0"])"#, r#"Find("D0")"#]);
}

#[test]
fn a_new_program_keeps_the_place_in_the_ladder() {
    let mut bench = Bench::start();
    bench.keys("l");
    bench.press(KeyPress::Down);
    bench.news(MonitorNews::Ladder("def".into(), Ok(program())));
    assert_eq!((bench.state.ladder.element, bench.state.ladder.rung), (0, 1));
    bench.news(MonitorNews::Ladder("ghi".into(), Err("it cannot be loaded".into())));
    assert!(bench.shown().contains("it cannot be loaded"));
}

#[test]
fn the_length_of_the_watch_list_is_limited() {
    let mut bench = Bench::start();
    let words: Vec<_> = (0..99).map(|n| word(&format!("D{n}"), n)).collect();
    bench.news(MonitorNews::Found(Ok(words)));
    assert!(bench.shown().contains("the watch list is full"));
}

#[test]
fn q_and_ctrl_c_end_the_monitor() {
    for press in [KeyPress::Char('q'), KeyPress::Interrupt] {
        let mut bench = Bench::start();
        bench.orders();
        bench.press(press);
        assert_eq!(bench.orders(), ["quit"]);
    }
    let mut bench = Bench::start();
    bench.keys("aq");
    assert!(!bench.orders().contains(&"quit".to_owned()), "q is a letter while one types");
}
