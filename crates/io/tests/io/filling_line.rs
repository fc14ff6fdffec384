//! `config/filling-line.toml`: its ladder with its simulated belt in virtual time.
//!
//! There is a bottle every 60 cm of belt. The belt stops for 1.5 s at the filler for each bottle:
//! one bottle in 4.6 s. The fourth bottle at the scale is too light, and every seventh bottle after
//! it.

use std::collections::VecDeque;
use std::path::Path;

use rungd_base::calendar::parse_seconds;
use rungd_config::load;
use rungd_test_support::bench::Plant;

const ALARMS: [&str; 3] = ["wrong", "misplaced", "many_bad"];

fn plant(clock: &str) -> Plant {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config/filling-line.toml");
    let mut plant = Plant::of(load::controller_file(&path).unwrap());
    plant.clock_s = parse_seconds(clock).expect("a time");
    plant
}

fn totals(plant: &Plant, name: &str) -> [i32; 3] {
    [0, 1, 2].map(|shift| plant.value(&format!("{name}[{shift}]")))
}

/// Follows each bottle from the scale to the pusher, independently of the ladder.
#[derive(Default)]
struct Witness {
    /// The bottles between scale and pusher: whether each is bad.
    between: VecDeque<bool>,
    /// The bottle in front of the pusher: whether it is bad, and whether it was pushed.
    there: Option<(bool, bool)>,
    weighed: Vec<bool>,
    passed: Vec<bool>,
    before: [bool; 2],
}

impl Witness {
    fn look(&mut self, plant: &Plant) {
        let [scale, pusher] = ["at_scale", "at_pusher"].map(|eye| plant.value(eye) != 0);
        if scale && !self.before[0] {
            let weight = plant.value("weight");
            let bad = !(490..=515).contains(&weight);
            let percent = f64::from(weight) / 5.0;
            assert!((plant.real("fill") - percent).abs() < 0.001, "{weight} g are {percent} %");
            self.between.push_back(bad);
            self.weighed.push(bad);
        }
        if pusher && !self.before[1] {
            self.there = Some((self.between.pop_front().expect("it was weighed"), false));
        }
        if plant.value("pusher") != 0 {
            let (bad, pushed) = self.there.as_mut().expect("a bottle is there");
            assert!(*bad, "at {} ms a good bottle is pushed off", plant.now_ms);
            *pushed = true;
        }
        if !pusher && let Some((bad, pushed)) = self.there.take_if(|_| self.before[1]) {
            assert_eq!(bad, pushed, "at {} ms a bad bottle has passed", plant.now_ms);
            self.passed.push(bad);
        }
        self.before = [scale, pusher];
    }
}

#[test]
fn only_the_bad_bottle_is_rejected() {
    let mut plant = plant("2026-11-22T09:00:00");
    let mut witness = Witness::default();
    plant.until(100_000, |plant| {
        witness.look(plant);
        assert_eq!(plant.on(&ALARMS), [""; 0], "at {} ms", plant.now_ms);
    });
    let bad = |bottles: &[bool]| bottles.iter().filter(|bad| **bad).count();
    assert!(witness.passed.len() >= 18, "{:?}", witness.passed);
    let at: Vec<usize> = (0..witness.passed.len()).filter(|at| witness.passed[*at]).collect();
    assert_eq!(at, [3, 10, 17]);
    let (all, bad) = (witness.weighed.len(), bad(&witness.weighed));
    let counted = (totals(&plant, "good"), totals(&plant, "rejects"));
    assert_eq!(counted, ([(all - bad) as i32, 0, 0], [bad as i32, 0, 0]));
    let percent = 100.0 * bad as f64 / all as f64;
    assert!((plant.real("rate") - percent).abs() < 0.001, "{percent} %");
}

#[test]
fn a_bad_bottle_is_rejected_even_if_the_belt_stopped_meanwhile() {
    let mut plant = plant("2026-11-22T09:00:00");
    let mut witness = Witness::default();
    // STOP is ON for a second at irregular times; START comes every 30 s.
    for end_ms in [19_370, 21_990, 50_010, 52_730, 54_440, 83_150, 120_000] {
        plant.until(end_ms, |plant| witness.look(plant));
        plant.force("C102", true);
        plant.until(end_ms + 1000, |plant| witness.look(plant));
        plant.force("C102", false);
        assert_eq!(plant.on(&ALARMS), [""; 0]);
    }
    assert!(witness.passed[3] && witness.passed[10], "{:?}", witness.passed);
}

#[test]
fn each_shift_has_its_own_count_and_earlier_totals_are_kept() {
    let mut plant = plant("2026-11-22T13:59:20");
    plant.until(39_990, |_| {});
    let (early, early_bad) = (plant.value("good[0]"), plant.value("rejects[0]"));
    assert!(early > 5 && early_bad == 1 && plant.value("counted") == 0);
    // 14:00:00: the late shift begins at 0.
    plant.until(40_020, |_| {});
    assert_eq!(plant.value("counted"), 1);
    assert!(plant.value("good[1]") <= 1);
    plant.until(60_000, |_| {});
    let late = plant.value("good[1]");
    assert!(late > 2);
    assert_eq!((plant.value("good[0]"), plant.value("rejects[0]")), (early, early_bad));
    // The night shift begins a second after 21:59:59, and continues after midnight.
    let at = |time: &str, plant: &Plant| {
        parse_seconds(time).expect("a time") - (plant.now_ms / 1000) as i64
    };
    plant.clock_s = at("2026-11-22T21:59:59", &plant);
    plant.until(80_000, |_| {});
    plant.clock_s = at("2026-11-23T00:00:30", &plant);
    plant.until(90_000, |_| {});
    assert_eq!(plant.value("counted"), 2);
    let night = totals(&plant, "good");
    assert!(night[0] == early && night[1] >= late && night[2] > 2, "{night:?}");
    // The early shift of the next day replaces its old total; the other totals stay.
    plant.clock_s = at("2026-11-23T06:00:00", &plant);
    plant.until(95_000, |_| {});
    let next = totals(&plant, "good");
    assert!(next[0] <= 2 && next[1..] == night[1..], "{next:?} after {night:?}");
}

#[test]
fn three_bad_bottles_in_a_row_stop_the_line_until_start() {
    let mut plant = plant("2026-11-22T09:00:00");
    plant.until(2_000, |_| {});
    plant.force("C100", true);
    plant.until(29_000, |_| {});
    assert_eq!(plant.on(&["wrong", "running", "belt", "lamp"]), ["wrong", "lamp"]);
    assert_eq!(totals(&plant, "rejects"), [3, 0, 0]);
    plant.force("C100", false);
    plant.until(32_000, |_| {});
    assert_eq!(plant.on(&["wrong", "running"]), ["running"]);
}

#[test]
fn a_blind_sensor_at_the_pusher_raises_its_alarm() {
    let mut plant = plant("2026-11-22T09:00:00");
    plant.force("C101", true);
    plant.until(29_000, |_| {});
    assert_eq!(plant.on(&ALARMS), ["misplaced"]);
}

#[test]
fn a_recipe_changes_the_filling_time_and_the_weight() {
    let mut plant = plant("2026-11-22T09:00:00");
    plant.write("product", 1);
    let (mut begin_ms, mut times) = (None, Vec::new());
    plant.until(20_000, |plant| match (plant.value("filler") != 0, begin_ms) {
        (true, None) => begin_ms = Some(plant.now_ms),
        (false, Some(begin)) => {
            times.push(plant.now_ms - begin);
            begin_ms = None;
        }
        (true, Some(_)) | (false, None) => {}
    });
    assert!(!times.is_empty() && times.iter().all(|ms| (2_200..2_230).contains(ms)), "{times:?}");
    // A bottle of 500 g is two thirds of one of 750 g.
    let fill = plant.real("fill");
    assert!((65.0..69.0).contains(&fill), "{fill}");
}
