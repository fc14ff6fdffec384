//! Two out of three, and the median, of all combinations.

use super::{Bench, bench};

fn vote() -> Bench {
    let uses = "{ use = \"Vote\", name = \"v\", with = { call1 = \"X1\", call2 = \"X2\", call3 = \
                \"X3\", bad1 = \"X4\", bad2 = \"X5\", bad3 = \"X6\", patience = \"0ms\" } },";
    bench("vote", "", uses)
}

#[test]
fn two_of_three_sensors_switch_the_output_and_a_broken_one_counts_as_calling() {
    let mut v = vote();
    for states in 0..64 {
        for input in 0..6 {
            v.set(&format!("X{}", input + 1), states >> input & 1);
        }
        v.scan();
        let (calls, bad) = (states & 7, states >> 3);
        assert_eq!(v.on("v.on"), (calls | bad).count_ones() >= 2, "{states:b}");
        assert_eq!(v.on("v.broken"), bad != 0, "{states:b}");
        let good = calls & !bad;
        let differ = good != 0 && good != !bad & 7;
        assert_eq!(v.on("v.differ"), differ, "{states:b}");
        let odd = match good {
            0b001 | 0b110 => 1,
            0b010 | 0b101 => 2,
            0b100 | 0b011 => 3,
            _ => 0,
        };
        assert_eq!(v.int("v.odd"), if bad == 0 { odd } else { 0 }, "{states:b}");
    }
}

fn median() -> Bench {
    let uses = "{ use = \"Median\", name = \"m\", with = { value1 = \"R1\", value2 = \"R2\", \
                value3 = \"R3\", bad1 = \"X4\", bad2 = \"X5\", bad3 = \"X6\", deviation = 2.0, \
                patience = \"0ms\" } },";
    bench("vote", "", uses)
}

#[test]
fn the_median_is_the_middle_value_of_the_good_sensors() {
    let mut m = median();
    let numbers = [-3.5, 0.1, 0.3, 2.2, 7.0_f32];
    for at in 0..125 {
        let values = [numbers[at % 5], numbers[at / 5 % 5], numbers[at / 25]];
        for bad in 0..8 {
            for (sensor, value) in values.into_iter().enumerate() {
                m.put(&format!("R{}", sensor + 1), value);
                m.set(&format!("X{}", sensor + 4), bad >> sensor & 1);
            }
            let before = m.real("m.value");
            m.scan();
            let mut good: Vec<f32> = (0..3)
                .filter(|sensor| bad >> sensor & 1 == 0)
                .map(|sensor| values[sensor])
                .collect();
            good.sort_by(f32::total_cmp);
            let (value, spread) = match good[..] {
                [low, middle, high] => (middle, (middle - low).max(high - middle)),
                [low, high] => (f32::midpoint(low, high), high - low),
                [only] => (only, 0.0),
                _ => (before, 0.0),
            };
            assert_eq!(m.real("m.value"), value, "{values:?}, bad {bad:b}");
            assert_eq!(m.on("m.valid"), !good.is_empty());
            assert_eq!(m.on("m.differ"), spread > 2.0, "{values:?}, bad {bad:b}");
            let odd = m.int("m.odd");
            assert_eq!(odd > 0, bad == 0 && spread > 2.0, "{values:?}, bad {bad:b}");
            if let Some(index) = usize::try_from(odd).expect("not below 0").checked_sub(1) {
                assert!((values[index] - value).abs() >= spread, "{values:?}: {odd}");
            }
        }
    }
}
