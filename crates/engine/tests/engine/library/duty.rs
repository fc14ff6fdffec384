//! Machines by their hours, over weeks and with failures.

use super::{Bench, bench};

fn duty(swap: &str) -> Bench {
    let uses = format!(
        "{{ use = \"Duty\", name = \"d\", with = {{ need = \"need\", ready1 = \"X1\", ready2 = \
         \"X2\", ready3 = \"X3\", ready4 = \"X4\", stagger = \"2s\", swap = \"{swap}\" }} }},"
    );
    let mut duty = bench("duty", "need = { type = \"int\", initial = 0 }", &uses);
    for machine in 1..=4 {
        duty.set(&format!("X{machine}"), 1);
    }
    duty
}

fn running(duty: &Bench) -> String {
    duty.bits(&["d.run1", "d.run2", "d.run3", "d.run4"])
}

fn hours(duty: &Bench) -> [i64; 4] {
    ["d.ran1", "d.ran2", "d.ran3", "d.ran4"].map(|name| duty.int(name) / 3_600)
}

#[test]
fn all_machines_age_alike_at_a_constant_need() {
    for need in 1..=4 {
        let mut duty = duty("8h").period(20_000);
        duty.set("need", need).run(40 * 24 * 3_600_000);
        let hours = hours(&duty);
        let (least, most) = (hours.iter().min(), hours.iter().max());
        assert!(most.unwrap() - least.unwrap() <= 9, "{need} of 4: {hours:?} h");
        let all: i64 = hours.iter().sum();
        assert!((all - i64::from(need) * 960).abs() <= 5, "{need} of 4: {hours:?} h");
    }
}

#[test]
fn as_many_ready_machines_run_as_are_needed() {
    let mut duty = duty("1h").period(500);
    let mut random: u32 = 1;
    let mut next = |below: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 16) % below
    };
    for _ in 0..2_000 {
        let (need, ready) = (next(5), next(16));
        duty.set("need", need.cast_signed());
        for machine in 0..4 {
            duty.set(&format!("X{}", machine + 1), (ready >> machine & 1).cast_signed());
        }
        duty.scan();
        let wrong = (0..4)
            .any(|machine| ready >> machine & 1 == 0 && duty.on(&format!("d.run{}", machine + 1)));
        assert!(!wrong, "not ready: {ready:04b}, but {}", running(&duty));
        duty.run(10_000);
        let on = running(&duty).matches('1').count();
        let wanted = need.min(ready.count_ones()) as usize;
        assert_eq!(on, wanted, "{need} of {ready:04b}: {}", running(&duty));
        assert_eq!(duty.on("d.short"), need > ready.count_ones());
    }
}

#[test]
fn starts_are_staggered_after_a_restart_of_the_controller_too() {
    let mut duty = duty("24h");
    duty.set("need", 4);
    for _ in 0..2 {
        for (ms, wanted) in [(2_000, "0000"), (10, "1000"), (1_990, "1000"), (10, "1100")] {
            duty.run(ms);
            assert_eq!(running(&duty), wanted);
        }
        duty.run(10_000);
        assert_eq!(running(&duty), "1111");
        duty.restart();
        for machine in 1..=4 {
            duty.set(&format!("d.ran{machine}"), 0);
        }
    }
}
