//! The look of the pages, in 80 columns and 24 rows.

use std::sync::Arc;

use expect_test::{Expect, expect};

use super::{Bench, SomeConduct, bit, status, word};
use crate::message::{KeyPress, MonitorNews};
use rungd_client::operator::protocol::OfferedName;

fn check(bench: &Bench, expect: Expect) {
    expect.assert_eq(&bench.shown());
}

/// Checks that the user's page `docs/monitor.md` shows the drawn page.
fn check_page(bench: &Bench) {
    let page = include_str!("../../../../docs/monitor.md");
    let shown = bench.shown();
    assert!(page.contains(&format!("```text\n{shown}```")), "docs/monitor.md lacks\n{shown}");
}

#[test]
fn the_first_page_shows_its_states_in_words() {
    let mut bench = Bench::start();
    bench.news(MonitorNews::Found(Ok(vec![bit("motor", "Y0", false), word("D0", 0)])));
    for n in 0..12 {
        bench.look(status(), vec![bit("motor", "Y0", n % 4 > 1), word("D0", n * n)]);
    }
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            ━▶Watch 2 of 2 ━━━━━━━━━━━━━━━━━━━━━━━━ ─ Alarms 1 of 2 ────────────────────────
            motor  ON                  ▁▁██▁▁██▁▁██ ● jam: The belt is jammed
            D0     121                 ▁▁▁▂▂▂▃▄▅▆▇█   high, NOT ACKNOWLEDGED, 1m05s, 3 a day
            ─ Blocks 1 of 4 ─────────────────────── ─ Forces ───────────────────────────────
            ● Program Main: running                 stop (X1): OFF
            ● Program Filler: running               ─ Devices 1 of 3 ───────────────────────
                ● Stage Fill: ON                    ● Modbus server at 127.0.0.1:1502: 1 of
                ○ Stage Drain: OFF                  ○ io (modbus, 10.0.0.9:502): STALE
                                                        connect: refused











            Tab pane  a add  d remove  w why  f force  u release  s write  l ladder  ?  q
        "#]],
    );
    check_page(&bench);
}

#[test]
fn the_count_of_alarms_is_that_of_standing_ones_without_shelved_ones() {
    let mut bench = Bench::start();
    let mut shelved = status();
    shelved["alarms"][0]["shelved"] = super::shelf();
    bench.look(status(), Vec::new());
    assert!(bench.shown().contains("alarms: 1  forces: 1"), "{}", bench.shown());
    bench.look(shelved, Vec::new());
    assert!(bench.shown().contains("alarms: 0  forces: 1"), "{}", bench.shown());
}

#[test]
fn the_ladder_shows_power_without_colours() {
    let mut bench = Bench::start();
    bench.keys("l");
    bench.news(MonitorNews::Power(Ok(Arc::new(SomeConduct(&[(1, 1), (1, 2)])))));
    bench.press(KeyPress::Right);
    bench.look(status(), vec![bit("motor", "Y0", true)]);
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            Main (Program, always runs), 1 of 2                                  rung 1 of 2
            motor is ON; conducts, and power reaches it (scan 120)
            ▶1. run  a.toml:11
             ┃ start   stop                                                      motor     │
             ┣━━] [━━┳━]●/[━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━(●)──────┤
             ┃  X0   ┃  X1                                                         Y0      │
             ┃ motor ┃                                                                     │
             ┣━━]●[━━┛                                                                     │
             ┃  Y0                                                                         │

             2.  a.toml:16
             ┃                                                                    jam      │
             ┣━[ D0 > 500]─┬──────────────────────────────────────────────────────( S)─────┤
             ┃             │                                                       C0      │
             ┃             │                                                               │
             ┃             └───────────────────────────────────────────────[ MOVE 0 to=D0]─┤




            arrows  Tab next  w why  f force  u release  s write  a watch  Esc back  ?  q
        "#]],
    );
    check_page(&bench);
}

#[test]
fn a_ladder_without_power_shows_the_reason() {
    let mut bench = Bench::start();
    bench.size = (60, 16);
    bench.keys("l");
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                   scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns
            alarms: 1  forces: 1  devices in trouble: 1
            Main (Program, always runs), 1 of 2              rung 1 of 2
            start; no power is shown yet
            ▶1. run  a.toml:11
             │ start   stop                                  motor     │
             ├──] [──┬─] /[───────────────────────────────────( )──────┤
             │  X0   │  X1                                     Y0      │
             │ motor │                                                 │
             ├──] [──┘                                                 │
             │  Y0                                                     │

             2.  a.toml:16

            arrows  Tab next  w why  f force  u release  s write  a watc
        "#]],
    );
    bench.news(MonitorNews::Power(Err("the scan log has no room".into())));
    assert!(bench.shown().contains("start; no power is shown: the scan log has no room"));
    bench.news(MonitorNews::Power(Ok(Arc::new(SomeConduct(&[])))));
    bench.press(KeyPress::Tab);
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                   scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns
            alarms: 1  forces: 1  devices in trouble: 1
            Stage Filler.Fill, 2 of 2                        rung 1 of 1
            $On; its rung is not executed (scan 120)
            ▶1.  a.toml:27  not executed
             │ $On                                             Y1      │
             ├─] [────────────────────────────────────────────( )──────┤







            arrows  Tab next  w why  f force  u release  s write  a watc
        "#]],
    );
}

#[test]
fn names_are_offered_while_a_name_is_typed() {
    let mut bench = Bench::start();
    bench.keys("am");
    let name = |name: &str, about: &str| OfferedName { name: name.into(), about: about.into() };
    bench.news(MonitorNews::Names("m".into(), vec![name("motor", "Y0"), name("M\u{1b}[2J", "")]));
    bench.press(KeyPress::Down);
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            ━▶Watch ━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━ ─ Alarms 1 of 2 ────────────────────────
            nothing yet: a adds an operand          ● jam: The belt is jammed
            ─ Blocks 1 of 4 ───────────────────────   high, NOT ACKNOWLEDGED, 1m05s, 3 a day
            ● Program Main: running                 ─ Forces ───────────────────────────────
            ● Program Filler: running               stop (X1): OFF
                ● Stage Fill: ON                    ─ Devices 1 of 3 ───────────────────────
                ○ St┏━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┓2: 1 of
                    ┃ Watch which operand? motor_                                  ┃LE
                    ┃ ▶ motor  Y0                                                  ┃
                    ┃   M?[2J                                                      ┃
                    ┃ arrows: choose, Enter: watch it, Esc: cancel                 ┃
                    ┗━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┛








            Enter: accept  Esc: cancel
        "#]],
    );
}

#[test]
fn a_change_is_confirmed_with_both_values() {
    let mut bench = Bench::start();
    bench.news(MonitorNews::Found(Ok(vec![word("D0", 12)])));
    bench.keys("f75");
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            ━▶Watch ━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━ ─ Alarms 1 of 2 ────────────────────────
            D0  12                                  ● jam: The belt is jammed
            ─ Blocks 1 of 4 ───────────────────────   high, NOT ACKNOWLEDGED, 1m05s, 3 a day
            ● Program Main: running                 ─ Forces ───────────────────────────────
            ● Program Filler: running               stop (X1): OFF
                ● Stage Fill: ON                    ─ Devices 1 of 3 ───────────────────────
                ○ St┏━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┓2: 1 of
                    ┃ Force D0                                                     ┃LE
                    ┃ present value: 12                                            ┃
                    ┃                                                              ┃
                    ┃ new value: 75_                                               ┃
                    ┃ ON, OFF, 12, 0x1F, 2.5 or 1m30s; Enter: accept, Esc: cancel  ┃
                    ┗━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┛







            Enter: accept  Esc: cancel
        "#]],
    );
    bench.press(KeyPress::Enter);
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            ━▶Watch ━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━ ─ Alarms 1 of 2 ────────────────────────
            D0  12                                  ● jam: The belt is jammed
            ─ Blocks 1 of 4 ───────────────────────   high, NOT ACKNOWLEDGED, 1m05s, 3 a day
            ● Program Main: running                 ─ Forces ───────────────────────────────
            ● Program Filler: running               stop (X1): OFF
                ● Stage Fill: ON                    ─ Devices 1 of 3 ───────────────────────
                ○ St┏━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┓2: 1 of
                    ┃ Force D0?                                                    ┃LE
                    ┃ present value: 12                                            ┃
                    ┃ new value: 75, forced until it is released                   ┃
                    ┃                                                              ┃
                    ┃ y: yes, do it   n: no                                        ┃
                    ┗━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━┛







            Enter: accept  Esc: cancel
        "#]],
    );
}

#[test]
fn a_silent_controller_is_reported() {
    let mut bench = Bench::silent();
    bench.tick(1000);
    bench.news(MonitorNews::Silent("no rungd answers at /run/s: is it running?".into()));
    bench.tick(4000);
    check(
        &bench,
        expect![[r#"


        NO ANSWER for 3s: no rungd answers at /run/s: is it running?

        no rungd answers at /run/s: is it running?

        The page continues by itself when the controller answers.
















        Tab pane  a add  d remove  w why  f force  u release  s write  l ladder  ?  q
    "#]],
    );
    bench.look(status(), vec![]);
    assert!(!bench.shown().contains("NO ANSWER"), "{}", bench.shown());
    bench.news(MonitorNews::Silent("it ended".into()));
    let shown = bench.shown();
    assert!(shown.contains("NO ANSWER for 0ms; the values shown are old: it ended"), "{shown}");
}

#[test]
fn the_help_and_an_answer_fit_the_window() {
    let mut bench = Bench::start();
    bench.keys("?");
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            Keys
            Everywhere   q ends, ? shows this, Esc goes back. Nothing is changed in a
                         controller without a question that names the operand and values.
            Panes        Tab, left, right: the next pane; up, down: its rows
              a          watch an operand: type its beginning, choose with the arrows
              d          remove the operand from the watch list
              w, Enter   explain the operand's value
              f, u, s    force it; release the force; write it
              k, h       acknowledge the alarm; shelve it, or bring it back
              l          the ladder; Enter on a block or Stage: its rungs
            Ladder       up, down: the rungs; left, right: contacts and instructions
              Tab        the next block or Stage
              w, f, u, s, a   as above, for the marked operand in the ladder

            In the ladder, heavy lines have power, and ● stands in a contact that
            conducts and in an instruction that has power. Thin lines have none.
            In the panes ● is ON, ○ is OFF; words say it too. A trend has five values
            a second, between the least and the greatest of those that are shown.


            arrows scroll  Esc back  q quit
        "#]],
    );
    bench.press(KeyPress::Escape);
    bench.press(KeyPress::BackTab);
    bench.press(KeyPress::Down);
    bench.keys("w");
    bench.news(MonitorNews::Why("io.Ok".into(), Ok("io.Ok is OFF\n  it is stale\n".into())));
    check(
        &bench,
        expect![[r#"
            belt  RUN for 1m                                                       scan 6000
            every 10ms  last 12.5 us  p99 31.0 us  max 44.0 us  overruns 2
            alarms: 1  forces: 1  devices in trouble: 1
            Why: io.Ok
            io.Ok is OFF
              it is stale

















            arrows scroll  Esc back  q quit
        "#]],
    );
}

#[test]
fn pages_are_drawn_in_windows_of_any_size() {
    let mut bench = Bench::start();
    bench.news(MonitorNews::Found(Ok((0..60).map(|n| word(&format!("D{n}"), n)).collect())));
    bench.news(MonitorNews::Power(Ok(Arc::new(SomeConduct(&[])))));
    let pages = ["", "l", "?", "lw", "a", "f"];
    for keys in pages {
        bench.keys(keys);
        for size in [(1, 1), (7, 3), (39, 12), (40, 12), (41, 13), (80, 24), (300, 100)] {
            bench.size = size;
            let shown = bench.shown();
            assert!(!shown.contains(|c: char| c.is_control() && c != '\n'), "{shown}");
        }
        bench.press(KeyPress::Escape);
        bench.press(KeyPress::Escape);
    }
}

#[test]
fn control_characters_in_names_of_the_controller_are_removed() {
    let mut bench = Bench::start();
    let mut status = status();
    let bad = "a\u{1b}]0;x\u{7}\u{9b}\u{202e}b";
    for place in ["/ladder/name", "/reason", "/alarms/0/text", "/blocks/0/name"] {
        *status.pointer_mut(place).expect("a place") = bad.into();
    }
    for place in ["/devices/field/0/trouble", "/forces/0/address", "/blocks/1/stages/0"] {
        *status.pointer_mut(place).expect("a place") = bad.into();
    }
    bench.look(status, vec![bit(bad, "Y0", true)]);
    bench.news(MonitorNews::Changed(Err(bad.into())));
    let shown = bench.shown();
    assert!(shown.contains("a?]0;x???b"), "{shown}");
    assert!(!shown.contains(['\u{1b}', '\u{7}', '\u{9b}', '\u{202e}']), "{shown}");
}

#[test]
fn a_chosen_compare_is_shown_with_the_values_of_both_sides() {
    let mut bench = Bench::start();
    bench.keys("l");
    bench.news(MonitorNews::Power(Ok(Arc::new(SomeConduct(&[(2, 0)])))));
    bench.press(KeyPress::Down);
    let shown = bench.shown();
    let line = shown.lines().find(|line| line.contains("scan 120")).expect("a line");
    assert_eq!(line.trim_end(), "D0 > 500: 612 > 500; conducts, and power reaches it (scan 120)");
}
