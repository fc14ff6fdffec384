//! First-out: the alarm that came first, and the horn.

use super::{Bench, bench};

fn alarms(reset: &str) -> Bench {
    let uses = format!(
        "{{ use = \"FirstOut\", name = \"f\", with = {{ alarm1 = \"X1\", alarm2 = \"X2\", \
         alarm3 = \"X3\", alarm4 = \"X4\", ack = \"X0\"{reset} }} }},"
    );
    bench("first-out", "", &uses)
}

fn pressed(f: &mut Bench, button: &str) {
    f.set(button, 1).scan().set(button, 0).scan();
}

#[test]
fn the_first_of_several_alarms_is_held() {
    for first in 1..=4 {
        let mut f = alarms("");
        assert_eq!(f.scan().int("f.first"), 0);
        f.set(&format!("X{first}"), 1).scan();
        assert_eq!(f.int("f.first"), first, "in the scan in which it comes");
        for other in 1..=4 {
            f.set(&format!("X{other}"), 1).scan();
        }
        assert_eq!(f.int("f.first"), first);
        f.set(&format!("X{first}"), 0).run(1_000);
        assert_eq!((f.int("f.first"), f.on("f.any")), (first, true), "it is gone, others are not");
    }
}

#[test]
fn the_lowest_number_is_the_first_of_several_alarms_in_one_scan() {
    let mut f = alarms("");
    f.set("X4", 1).set("X3", 1).scan();
    assert_eq!(f.int("f.first"), 3);
}

#[test]
fn each_new_alarm_sounds_the_horn_until_it_is_acknowledged() {
    let mut f = alarms("");
    assert!(!f.scan().on("f.horn"));
    assert!(f.set("X2", 1).scan().on("f.horn"));
    pressed(&mut f, "X0");
    assert!(!f.run(1_000).on("f.horn"), "the alarm is still ON");
    assert!(f.set("X3", 1).scan().on("f.horn"), "the next alarm");
    pressed(&mut f, "X0");
    assert!(!f.on("f.horn"));
    assert!(f.set("X3", 0).scan().set("X3", 1).scan().on("f.horn"), "the same alarm again");
}

/// A jammed button must not silence later alarms.
#[test]
fn a_held_acknowledgement_does_not_silence_later_alarms() {
    let mut f = alarms("");
    assert!(!f.set("X0", 1).run(100).on("f.horn"));
    assert!(f.set("X1", 1).scan().on("f.horn"));
    assert!(f.run(100).on("f.horn"));
}

#[test]
fn an_alarm_in_the_scan_of_the_acknowledgement_sounds_the_horn() {
    let mut f = alarms("");
    f.set("X1", 1).scan();
    assert!(f.set("X0", 1).set("X2", 1).scan().on("f.horn"));
}

#[test]
fn the_first_alarm_is_cleared_once_all_alarms_are_gone_and_acknowledged() {
    let mut f = alarms("");
    f.set("X1", 1).scan().set("X1", 0).run(1_000);
    assert_eq!((f.int("f.first"), f.on("f.horn")), (1, true), "gone, and not acknowledged");
    pressed(&mut f, "X0");
    assert_eq!(f.int("f.first"), 0);

    f.set("X2", 1).scan();
    pressed(&mut f, "X0");
    assert_eq!(f.run(1_000).int("f.first"), 2, "acknowledged, and not gone");
    assert_eq!(f.set("X2", 0).scan().int("f.first"), 0);
    assert_eq!(f.set("X3", 1).scan().int("f.first"), 3, "the next trouble has its own first");
}

#[test]
fn the_first_alarm_is_held_until_the_reset_button_is_pressed() {
    let mut f = alarms(", reset = \"X5\"");
    f.set("X1", 1).scan();
    pressed(&mut f, "X5");
    assert_eq!((f.int("f.first"), f.on("f.horn")), (1, true), "it resets no alarm that is ON");
    pressed(&mut f, "X0");
    f.set("X1", 0).run(1_000).set("X2", 1).scan();
    assert_eq!(f.int("f.first"), 1, "held over the second alarm");
    f.set("X2", 0).run(1_000);
    pressed(&mut f, "X0");
    assert_eq!(f.int("f.first"), 1);
    pressed(&mut f, "X5");
    assert_eq!(f.int("f.first"), 0);
}
