//! The simulated plant by itself, in virtual time: the behaviour of each kind of part and the
//! effects of faults. The same commands at the same times give the same plant, whatever the steps
//! are.

use std::collections::HashMap;

use proptest::prelude::*;
use rungd_config::controller::device::DriverSettings;
use rungd_config::controller::read;
use rungd_config::controller::resolve_controller;
use rungd_io::plant::{Lost, Model};
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::{FileId, SourceFile};

const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [{ when = ["X0"], do = ["OUT C0"] }]
"#;

/// A plant with access to its points by name: `told` points are inputs, `driven` points are
/// outputs.
pub struct Bench {
    model: Model,
    told: Vec<String>,
    driven: Vec<String>,
    outputs: Vec<i32>,
    inputs: Vec<i32>,
    /// The changes of each input: the time and the new value.
    changes: HashMap<String, Vec<(u64, i32)>>,
}

/// Makes a plant. The names of words begin with `#`, the names of bits do not.
pub fn bench(parts: &str, driven: &[&str], told: &[&str]) -> Bench {
    let is_word = |point: &str| point.starts_with('#');
    let bare = |point: &str| point.trim_start_matches('#').to_owned();
    let mut rows = Vec::new();
    for (at, point) in driven.iter().enumerate() {
        let from = if is_word(point) { format!("D{}", 500 + at) } else { format!("Y{at}") };
        rows.push(format!("{{ from = \"{from}\", to = \"{}\" }}", bare(point)));
    }
    for (at, point) in told.iter().enumerate() {
        let to = if is_word(point) { format!("D{at}") } else { format!("X{at}") };
        rows.push(format!("{{ from = \"{}\", to = \"{to}\" }}", bare(point)));
    }
    // TOML requires an inline table on one line; here it may continue in indented lines.
    let parts = parts.replace("\n    ", " ");
    let text = format!(
        "ladder = [\"a.toml\"]\n[[device]]\nname = \"plant\"\ndriver = \"simulated\"\n\
         map = [{}]\n{parts}",
        rows.join(",")
    );
    Bench {
        model: model(&text),
        told: told.iter().map(|point| bare(point)).collect(),
        driven: driven.iter().map(|point| bare(point)).collect(),
        outputs: vec![0; driven.len()],
        inputs: vec![-1; told.len()],
        changes: HashMap::new(),
    }
}

pub fn model(text: &str) -> Model {
    let source = SourceFile { name: "a.toml".into(), text: LADDER.into() };
    let (program, findings) = load_ladders(&[source], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:#?}"));
    let (written, findings) = read(text, FileId(1));
    assert!(findings.is_empty(), "{findings:#?}");
    let (controller, findings) = resolve_controller(&written.expect("TOML"), &program);
    match controller.devices.first().map(|device| &device.driver) {
        Some(DriverSettings::Simulated(plant)) => Model::new(plant),
        other => panic!("{other:?}: {findings:#?}"),
    }
}

impl Bench {
    pub fn step(&mut self, now_ms: u64) -> Result<(), Lost> {
        let before = self.inputs.clone();
        self.model.step(now_ms, &self.outputs, &mut self.inputs)?;
        for ((name, old), new) in self.told.iter().zip(&before).zip(&self.inputs) {
            if old != new {
                self.changes.entry(name.clone()).or_default().push((now_ms, *new));
            }
        }
        Ok(())
    }

    pub fn drive(&mut self, point: &str, value: i32) {
        let at = self.driven.iter().position(|name| name == point).expect("it is driven");
        self.outputs[at] = value;
    }

    /// Steps each millisecond, with commands at their times.
    pub fn run(&mut self, until_ms: u64, script: &[(u64, &str, i32)]) {
        for now_ms in 0..=until_ms {
            for (_, point, value) in script.iter().filter(|(at_ms, ..)| *at_ms == now_ms) {
                self.drive(point, *value);
            }
            self.step(now_ms).expect("it is not lost");
        }
    }

    pub fn changes_of(&self, point: &str) -> Vec<(u64, i32)> {
        self.changes.get(point).cloned().unwrap_or_default()
    }

    pub fn now(&self, point: &str) -> i32 {
        let at = self.told.iter().position(|name| name == point).expect("it is told");
        self.inputs[at]
    }
}

#[test]
fn a_delay_ignores_inputs_shorter_than_its_time() {
    let parts = r#"part = [{ name = "door", kind = "delay", after = "30ms", release = "10ms" }]"#;
    let mut bench = bench(parts, &["door.in"], &["door.out"]);
    let on_for = |from, to| [(from, "door.in", 1), (to, "door.in", 0)];
    bench.run(300, &[on_for(5, 34), on_for(50, 80), on_for(100, 200)].concat());
    // An input of 29 ms has no effect. Neither has one of 30 ms, because it ends with the delay.
    assert_eq!(bench.changes_of("door.out"), [(0, 0), (130, 1), (210, 0)]);
}

#[test]
fn a_motor_answers_and_trips_until_it_is_reset() {
    let parts = r#"part = [{ name = "m", kind = "motor", after = "60ms", release = "40ms" }]"#;
    let mut bench = bench(parts, &["m.run", "m.trip", "m.reset"], &["m.running", "m.tripped"]);
    let trip = [(500, "m.trip", 1), (510, "m.trip", 0)];
    let reset = [(800, "m.reset", 1), (810, "m.reset", 0)];
    bench.run(1000, &[&[(100, "m.run", 1)][..], &trip, &reset].concat());
    assert_eq!(bench.changes_of("m.running"), [(0, 0), (160, 1), (540, 0), (860, 1)]);
    assert_eq!(bench.changes_of("m.tripped"), [(0, 0), (500, 1), (800, 0)]);
}

#[test]
fn a_motor_without_a_reset_input_recovers_after_a_trip() {
    let parts = r#"part = [{ name = "m", kind = "motor" }]"#;
    let mut bench = bench(parts, &["m.run", "m.trip"], &["m.running"]);
    bench.run(50, &[(1, "m.run", 1), (10, "m.trip", 1), (20, "m.trip", 0)]);
    assert_eq!(bench.changes_of("m.running"), [(0, 0), (1, 1), (10, 0), (20, 1)]);
}

const BELT: &str = r#"part = [{ name = "belt", kind = "conveyor", length = 1000, speed = 500,
    every = "1s", part-length = 100, eyes = { eye = 500, exit = 990 } }]"#;

#[test]
fn parts_pass_the_eyes_of_a_belt() {
    let mut bench = bench(BELT, &["belt.run"], &["belt.eye", "belt.exit", "#belt.parts"]);
    // From 10 ms on, the belt moves half a millimetre per tick. The first part is laid on in the
    // first tick.
    bench.run(3200, &[(10, "belt.run", 1)]);
    let eye = [(0, 0), (1010, 1), (1210, 0), (2010, 1), (2210, 0), (3010, 1)];
    assert_eq!(bench.changes_of("belt.eye"), eye);
    // 990 mm take 1980 ticks; the part leaves at the end of the belt.
    assert_eq!(bench.changes_of("belt.exit"), [(0, 0), (1990, 1), (2010, 0), (2990, 1), (3010, 0)]);
    assert_eq!(bench.changes_of("belt.parts"), [(0, 0), (10, 1), (1010, 2)]);
}

#[test]
fn a_part_stops_where_the_belt_stops() {
    let mut bench = bench(BELT, &["belt.run"], &["belt.eye"]);
    let script = [(0, "belt.run", 1), (1100, "belt.run", 0), (5000, "belt.run", 1)];
    bench.run(5200, &script);
    assert_eq!(bench.changes_of("belt.eye"), [(0, 0), (1000, 1), (5100, 0)]);
}

#[test]
fn a_belt_at_half_speed_takes_twice_as_long() {
    let mut bench = bench(BELT, &["#belt.run"], &["belt.eye"]);
    bench.run(2000, &[(0, "belt.run", 500)]);
    assert_eq!(bench.changes_of("belt.eye"), [(0, 0), (2000, 1)]);
}

#[test]
fn a_jam_holds_the_parts_while_the_belt_runs() {
    let mut bench = bench(BELT, &["belt.run", "belt.jam"], &["belt.eye"]);
    let script = [(0, "belt.run", 1), (1100, "belt.jam", 1), (9000, "belt.jam", 0)];
    bench.run(9300, &script);
    assert_eq!(bench.changes_of("belt.eye"), [(0, 0), (1000, 1), (9100, 0)]);
}

#[test]
fn a_part_that_leaves_a_belt_enters_the_next_belt() {
    let parts = r#"part = [
        { name = "a", kind = "conveyor", length = 100, speed = 1000, part-length = 20 },
        { name = "b", kind = "conveyor", length = 100, speed = 1000, part-length = 20,
          feed = "a.out", run = "a.run", eyes = { eye = 50 } }]"#;
    let mut bench = bench(parts, &["a.run", "a.feed"], &["b.eye", "#a.parts", "#b.parts"]);
    let fed = |at| [(at, "a.feed", 1), (at + 5, "a.feed", 0)];
    // The second part would lie on the first one, so it is left out.
    bench.run(400, &[&[(0, "a.run", 1)][..], &fed(10), &fed(20), &fed(50)].concat());
    assert_eq!(bench.changes_of("a.parts"), [(0, 0), (10, 1), (50, 2), (110, 1), (150, 0)]);
    assert_eq!(bench.changes_of("b.parts"), [(0, 0), (111, 1), (151, 2), (211, 1), (251, 0)]);
    assert_eq!(bench.changes_of("b.eye"), [(0, 0), (161, 1), (181, 0), (201, 1), (221, 0)]);
}

const TANK: &str = r#"part = [{ name = "tank", kind = "tank", capacity = 100, initial = 10,
    fill-rate = 40, drain-rate = 20, switches = { low = 20, high = 80 } }]"#;

#[test]
fn a_tank_fills_drains_and_overflows() {
    let told = ["#tank.level", "tank.low", "tank.high", "tank.overflow", "tank.empty"];
    let mut bench = bench(TANK, &["tank.fill", "tank.drain"], &told);
    let script = [
        (1, "tank.fill", 1),
        (3001, "tank.drain", 1),
        (4001, "tank.fill", 0),
        (12_001, "tank.drain", 0),
    ];
    bench.run(13_000, &script);
    // From 10 to 20 at 40 per second takes 250 ticks: until the tick at 250 ms.
    assert_eq!(bench.changes_of("tank.low"), [(0, 0), (250, 1), (8001, 0)]);
    assert_eq!(bench.changes_of("tank.high"), [(0, 0), (1750, 1), (5001, 0)]);
    // The tank overflows while more flows in than out.
    assert_eq!(bench.changes_of("tank.overflow"), [(0, 0), (2251, 1), (4001, 0)]);
    assert_eq!(bench.changes_of("tank.empty"), [(0, 0), (9000, 1)]);
    let levels = bench.changes_of("tank.level");
    assert_eq!(levels[..3], [(0, 10), (25, 11), (50, 12)]);
    assert!(levels.contains(&(2250, 100)) && bench.now("tank.level") == 0);
}

#[test]
fn liquid_that_leaves_a_tank_enters_the_next_tank() {
    let parts = r#"part = [
        { name = "a", kind = "tank", capacity = 100, initial = 60, drain-rate = 50 },
        { name = "b", kind = "tank", capacity = 100, fill-rate = 50, fill = "a.outflow" }]"#;
    let mut bench = bench(parts, &["#a.drain"], &["#a.level", "#b.level", "#a.outflow"]);
    bench.run(5000, &[(1, "a.drain", 500), (1001, "a.drain", 2000)]);
    assert_eq!((bench.now("a.level"), bench.now("b.level")), (0, 60));
    // Half open, fully open (a larger command opens no further), empty.
    assert_eq!(bench.changes_of("a.outflow"), [(0, 0), (1, 500), (1001, 1000), (1701, 0)]);
}

#[test]
fn several_pumps_share_the_rate_of_their_tank_equally() {
    let parts = r#"part = [
        { name = "p1", kind = "motor" },
        { name = "p2", kind = "motor" },
        { name = "p3", kind = "motor" },
        { name = "flow", kind = "sensor", of = "well.level", range = [0, 1], raw = [0, 5000] },
        { name = "well", kind = "tank", capacity = 900, initial = 900, drain-rate = 300,
          fill-rate = 100, drain = ["p1.running", "p2.running", "p3.running"],
          fill = ["p3.running", "flow.value"] }]"#;
    let mut bench =
        bench(parts, &["p1.run", "p2.run", "p3.run"], &["#well.level", "#well.outflow"]);
    let open = [(1, "p1.run", 1), (1001, "p2.run", 1), (2001, "p3.run", 1)];
    bench.run(4000, &open);
    let levels = bench.changes_of("well.level");
    let at = |ms: u64| levels.iter().rev().find(|(at, _)| *at <= ms).expect("a level").1;
    // The inflow is 50 per second, from a signal beyond fully open, and 100 with the third pump.
    // The outflow is 100 per pump, in whole thousandths. A motor's answer reaches the tank a
    // millisecond later.
    assert_eq!([1, 1001, 2001, 3001].map(at), [900, 850, 700, 500]);
    let flows = [(0, 0), (2, 333), (1002, 666), (2002, 1000)];
    assert_eq!(bench.changes_of("well.outflow"), flows);
}

#[test]
fn a_sensor_has_thresholds_delays_and_a_signal() {
    let parts = format!(
        "{},{}",
        TANK.trim_end_matches(']'),
        r#"{ name = "float", kind = "sensor", of = "tank.level", on-at = 50, off-at = 40,
             after = "100ms", range = [0, 100], raw = [4000, 20000] },
           { name = "dry", kind = "sensor", of = "tank.level", on-at = 15, invert = true }]"#
    );
    let told = ["float.out", "#float.value", "dry.out"];
    let mut bench = bench(&parts, &["tank.fill", "tank.drain"], &told);
    bench.run(4000, &[(1, "tank.fill", 1), (1501, "tank.fill", 0), (1501, "tank.drain", 1)]);
    // The level is 50 at 1000 ms, measured a tick later; 70 at 1500 ms; below 40 after 3000 ms.
    assert_eq!(bench.changes_of("float.out"), [(0, 0), (1101, 1), (3102, 0)]);
    assert_eq!(bench.changes_of("dry.out"), [(0, 1), (126, 0)]);
    assert_eq!(bench.changes_of("float.value")[..3], [(0, 5600), (26, 5760), (51, 5920)]);
}

#[test]
fn sensors_measure_initial_values_in_the_first_step() {
    let sensor = r#"{ name = "gauge", kind = "sensor", of = "tank.level", on-at = 5 }]"#;
    let parts = format!("{},{sensor}", TANK.trim_end_matches(']'));
    let mut bench = bench(&parts, &[], &["#gauge.value", "gauge.out"]);
    bench.run(5, &[]);
    assert_eq!(
        (bench.changes_of("gauge.value"), bench.changes_of("gauge.out")),
        (vec![(0, 10)], vec![(0, 1)])
    );
}

#[test]
fn pulses_occur_only_while_enabled() {
    let parts = r#"part = [
        { name = "meter", kind = "pulse", pulse = "20ms", every = "50ms", offset = "10ms" },
        { name = "always", kind = "pulse", pulse = "1ms", every = "100ms" }]"#;
    let mut bench = bench(parts, &["meter.run"], &["meter.out", "always.out"]);
    bench.run(205, &[(100, "meter.run", 1), (165, "meter.run", 0)]);
    assert_eq!(bench.changes_of("meter.out"), [(0, 0), (110, 1), (130, 0), (160, 1), (165, 0)]);
    assert_eq!(
        bench.changes_of("always.out"),
        [(0, 1), (1, 0), (100, 1), (101, 0), (200, 1), (201, 0)]
    );
}

fn with_fault(parts: &str, fault: &str) -> String {
    format!("{parts}\nfault = [{fault}]")
}

#[test]
fn a_stuck_eye_stays_on_off_or_unchanged() {
    // The eye detects a part from 1000 to 1200 ms; the fault begins at 900 or 1100 ms and lasts 400
    // ms.
    for (kind, from_ms, changes) in [
        ("stuck-on", 900, vec![(0, 0), (900, 1), (1300, 0)]),
        ("stuck-off", 1100, vec![(0, 0), (1000, 1), (1100, 0)]),
        ("stuck", 900, vec![(0, 0)]),
        ("stuck", 1100, vec![(0, 0), (1000, 1), (1500, 0)]),
    ] {
        let fault = format!("{{ name = \"eye\", point = \"belt.eye\", kind = \"{kind}\" }}");
        let parts = with_fault(BELT, &fault);
        let mut bench = bench(&parts, &["belt.run", "fault.eye"], &["belt.eye"]);
        let fault = [(from_ms, "fault.eye", 1), (from_ms + 400, "fault.eye", 0)];
        bench.run(1900, &[&[(0, "belt.run", 1)][..], &fault].concat());
        assert_eq!(bench.changes_of("belt.eye"), changes, "{kind} from {from_ms} on");
    }
}

#[test]
fn a_stuck_word_stays_at_the_value_of_its_fault() {
    let fault = r#"{ name = "wire", point = "tank.level", kind = "stuck", value = -1 }"#;
    let mut bench = bench(&with_fault(TANK, fault), &["fault.wire"], &["#tank.level"]);
    bench.run(30, &[(10, "fault.wire", 1), (20, "fault.wire", 0)]);
    assert_eq!(bench.changes_of("tank.level"), [(0, 10), (10, -1), (20, 10)]);
}

#[test]
fn a_stuck_valve_stays_shut_or_open() {
    for (kind, level) in [("stuck-on", 50), ("stuck-off", 10)] {
        let fault = format!("{{ name = \"valve\", point = \"tank.fill\", kind = \"{kind}\" }}");
        let parts = with_fault(TANK, &fault);
        let mut bench = bench(&parts, &["tank.fill", "fault.valve"], &["#tank.level"]);
        let wanted = i32::from(kind == "stuck-off");
        bench.run(1000, &[(1, "tank.fill", wanted), (1, "fault.valve", 1)]);
        assert_eq!(bench.now("tank.level"), level, "{kind}");
    }
}

#[test]
fn a_delayed_sensor_shows_earlier_values() {
    let fault = r#"{ name = "late", point = "belt.eye", kind = "late", by = "70ms" }"#;
    let mut bench = bench(&with_fault(BELT, fault), &["belt.run", "fault.late"], &["belt.eye"]);
    bench.run(1500, &[(0, "belt.run", 1), (300, "fault.late", 1)]);
    assert_eq!(bench.changes_of("belt.eye"), [(0, 0), (1070, 1), (1270, 0)]);
}

#[test]
fn noise_stays_within_its_amplitude_and_follows_its_seed() {
    let fault = r#"{ name = "noise", point = "tank.level", kind = "noisy", amplitude = 3,
        every = "10ms" }"#;
    let noise = |seed: &str| {
        let parts = format!("{}\n{seed}", with_fault(TANK, fault));
        let mut bench = bench(&parts, &["fault.noise"], &["#tank.level"]);
        bench.run(2000, &[(0, "fault.noise", 1), (1990, "fault.noise", 0)]);
        bench.changes_of("tank.level")
    };
    let levels = noise("seed = 7");
    assert!(levels.iter().all(|(at_ms, level)| (7..=13).contains(level) && at_ms % 10 == 0));
    assert!(levels.len() > 100 && levels.last() == Some(&(1990, 10)), "{levels:?}");
    assert_eq!(noise("seed = 7"), levels);
    assert_ne!(noise("seed = 8"), levels);
}

#[test]
fn a_bouncing_contact_is_on_about_half_the_time() {
    let fault = r#"{ name = "loose", point = "belt.eye", kind = "noisy", every = "5ms" }"#;
    let mut bench = bench(&with_fault(BELT, fault), &["belt.run", "fault.loose"], &["belt.eye"]);
    bench.run(4999, &[(0, "fault.loose", 1)]);
    let changes = bench.changes_of("belt.eye").len();
    assert!((400..600).contains(&changes), "{changes} of 1000");
}

#[test]
fn a_lost_device_exchanges_nothing_until_its_fault_ends() {
    let fault = r#"{ name = "cable", kind = "lost" }"#;
    let driven = ["tank.fill", "fault.cable"];
    let mut bench = bench(&with_fault(TANK, fault), &driven, &["#tank.level"]);
    bench.step(0).expect("well");
    bench.drive("fault.cable", 1);
    assert_eq!(bench.step(1), Err(Lost));
    bench.drive("tank.fill", 1);
    assert_eq!(bench.step(500), Err(Lost));
    bench.drive("fault.cable", 0);
    bench.step(1000).expect("well again");
    assert_eq!(bench.now("tank.level"), 10, "it was not filled");
    bench.step(1001).expect("well");
    bench.step(1101).expect("well");
    assert_eq!(bench.now("tank.level"), 14);
}

#[test]
fn a_part_of_the_plant_can_trigger_a_fault() {
    let parts = r#"part = [
        { name = "wear", kind = "pulse", pulse = "1s", every = "5s", offset = "2s" },
        { name = "lamp", kind = "delay" }]
fault = [{ name = "lamp", point = "lamp.out", kind = "stuck-off", when = "wear.out" }]"#;
    let mut bench = bench(parts, &["lamp.in"], &["lamp.out"]);
    bench.run(4000, &[(0, "lamp.in", 1)]);
    assert_eq!(bench.changes_of("lamp.out"), [(0, 1), (2001, 0), (3001, 1)]);
}

#[test]
fn a_long_pause_advances_the_plant_by_at_most_one_second() {
    let mut bench = bench(TANK, &["tank.fill"], &["#tank.level"]);
    bench.drive("tank.fill", 1);
    bench.step(0).expect("well");
    bench.step(3_600_000).expect("well");
    assert_eq!(bench.now("tank.level"), 50, "a second's worth");
}

/// A plant with all kinds of parts, for property tests.
fn everything() -> Bench {
    let parts = r#"part = [
            { name = "m", kind = "motor", after = "7ms", release = "3ms" },
            { name = "belt", kind = "conveyor", length = 60, speed = 900, every = "40ms",
              part-length = 15, eyes = { eye = 30 }, run = "m.running" },
            { name = "a", kind = "tank", capacity = 9, initial = 4, fill-rate = 70,
              drain-rate = 33, switches = { high = 6 } },
            { name = "b", kind = "tank", capacity = 5, fill-rate = 33, fill = "a.outflow" },
            { name = "s", kind = "sensor", of = "a.level", on-at = 5, off-at = 3, after = "4ms",
              range = [0, 9], raw = [-2147483648, 2147483647] },
            { name = "p", kind = "pulse", pulse = "3ms", every = "11ms", run = "belt.eye" },
            { name = "d", kind = "delay", in = "p.out", after = "1ms", invert = true },
            { name = "t", kind = "lag", gain = 3000, time-constant = "30ms", in = "a.outflow" }]
fault = [
            { name = "stuck", point = "belt.eye", kind = "stuck", when = "s.out" },
            { name = "noisy", point = "a.level", kind = "noisy", amplitude = 2147483647 },
            { name = "late", point = "s.value", kind = "late", by = "9ms", when = "d.out" }]"#;
    let driven = ["m.run", "m.trip", "#a.fill", "a.drain", "fault.noisy"];
    let told =
        ["belt.eye", "#belt.parts", "#a.level", "#b.level", "s.out", "#s.value", "d.out", "#t.out"];
    bench(parts, &driven, &told)
}

proptest! {
    #[test]
    fn the_step_size_does_not_change_the_simulation(
        commands in proptest::collection::vec((0u64..400, 0usize..5, -5i32..1500), 0..20),
        steps in proptest::collection::vec(1u64..90, 1..20),
    ) {
        let (mut fine, mut coarse) = (everything(), everything());
        // Commands come only at times at which both plants step.
        let mut grid = vec![0];
        for step in steps {
            grid.push(grid.last().unwrap() + step);
        }
        let script = |bench: &mut Bench, from: u64, to: u64| {
            let due = commands.iter().filter(|(at_ms, ..)| (from..to).contains(at_ms));
            for (_, at, value) in due {
                bench.outputs[*at] = *value;
            }
        };
        for pair in grid.windows(2) {
            script(&mut fine, pair[0], pair[1]);
            script(&mut coarse, pair[0], pair[1]);
            for now_ms in pair[0]..pair[1] {
                fine.step(now_ms).unwrap();
            }
            coarse.step(pair[0]).unwrap();
            if pair[1] == pair[0] + 1 {
                prop_assert_eq!(&fine.inputs, &coarse.inputs);
            }
        }
        let end = *grid.last().unwrap();
        fine.step(end).unwrap();
        coarse.step(end).unwrap();
        prop_assert_eq!(fine.inputs, coarse.inputs);
    }

    #[test]
    fn no_plant_panics_at_any_time(
        mut nows in proptest::collection::vec(any::<u64>(), 0..12),
        values in proptest::collection::vec(any::<[i32; 5]>(), 12),
    ) {
        nows.sort_unstable();
        let mut bench = everything();
        for (now_ms, values) in nows.into_iter().zip(values) {
            bench.outputs.copy_from_slice(&values);
            bench.step(now_ms).unwrap();
        }
        // A step back in time is allowed too.
        bench.step(0).unwrap();
    }
}
