//! PID: what the equations of Rockwell's manual give, worked out here, and what gets a stub.
//!
//! The expected values are those of the manual's formulas, written down in [`Loop`] a second time
//! and for steps that can be computed by hand as numbers.

use rungd_base::random::SplitMix64;
use rungd_engine::isa::Real;
use rungd_import::l5x;
use rungd_import::model::{Fate, ForeignProject};
use rungd_test_support::plc::Plc;
use rungd_test_support::setting::setting;

use super::file;
use crate::numbers::below;
use crate::plant;

/// A PID with these members besides a scale of 0 to 100 for everything, in a rung with the bit
/// `on`.
fn read(members: &[(&str, f64)], rung: &str, tags: &[&str]) -> ForeignProject {
    let ranges = ["MAXS", "MAXI", "MAXCV", "MAXTIE", "MAXO"];
    let whole = ranges.map(|name| (name, 100.0)).into_iter().chain([("UPD", 1.0)]);
    let all = whole.filter(|(name, _)| !members.iter().any(|(own, _)| own == name));
    let value = |(name, value): (&str, f64)| {
        let is_bit = BITS.contains(&name);
        let kind = if is_bit { "BOOL" } else { "REAL" };
        let text = if is_bit { format!("{value}") } else { format!("{value:?}") };
        format!("<DataValueMember Name=\"{name}\" DataType=\"{kind}\" Value=\"{text}\"/>")
    };
    let values: String = all.chain(members.iter().copied()).map(value).collect();
    let data = format!(
        "DataType=\"PID\"><Data Format=\"Decorated\"><Structure DataType=\"PID\">{values}\
         </Structure></Data></Tag>"
    );
    let own = ["loop: PID", "on: BOOL", "pv: REAL", "tie: REAL", "cv: REAL"];
    let tags: Vec<String> = own.iter().chain(tags).map(|tag| (*tag).to_owned()).collect();
    let text = file(&tags, &[rung.to_owned()], &[]);
    l5x::read(&text.replace("DataType=\"PID\"/>", &data)).unwrap()
}

const BITS: [&str; 9] = ["CA", "DOE", "PE", "NDF", "NOBC", "NOZC", "PVT", "SWM", "MO"];
const RUNG: &str = "XIC(on)PID(loop,pv,tie,cv,0,0,0);";

fn number(plc: &Plc, name: &str) -> f64 {
    f64::from(Real::of_cell(plc.value(name) as i32).number())
}

fn cell(value: f64) -> i32 {
    Real::finite(value as f32).unwrap().cell()
}

/// The values of a tag after each scan, with changes before it: `pv=20; on=0; ` are two scans.
fn trace(members: &[(&str, f64)], scans: &str, tag: &str) -> Vec<f64> {
    let mut plc = plant::started(&read(members, RUNG, &[]));
    plant::scan(&mut plc, 0, &[]);
    let mut values = Vec::new();
    for (at, changes) in scans.split(';').enumerate() {
        let changes = changes.split_whitespace().map(|change| {
            let (name, value) = change.split_once('=').unwrap();
            let is_bit = name == "on" || BITS.iter().any(|bit| name.to_uppercase().ends_with(bit));
            let value: f64 = value.parse().unwrap();
            (name.to_owned(), if is_bit { value as i32 } else { cell(value) })
        });
        plant::scan(&mut plc, 10 * (at as u64 + 1), &changes.collect::<Vec<_>>());
        values.push((number(&plc, tag) * 1000.0).round() / 1000.0);
    }
    values
}

#[test]
fn a_step_of_the_setpoint_gives_the_proportional_part_and_a_growing_integral() {
    // E = 10 %: P = 2 * 10, and the integral grows by 0.5 * 10 a step of 1 s.
    let outputs = trace(&[("KP", 2.0), ("KI", 0.5), ("SP", 10.0)], "on=1;;;", "cv");
    assert_eq!(outputs, [25.0, 30.0, 35.0, 40.0]);
}

#[test]
fn dependent_gains_take_the_reset_time_in_minutes_a_repeat() {
    // Kc = 2, Ti = 0.5 minutes: each second repeats 1/30 of P = 20.
    let outputs = trace(&[("PE", 1.0), ("KP", 2.0), ("KI", 0.5), ("SP", 10.0)], "on=1;;", "cv");
    assert_eq!(outputs, [20.667, 21.333, 22.0]);
    // Td = 0.01 minutes: Kc * 0.6 s * -10 %/s, without the smoothing.
    let members = [("PE", 1.0), ("KP", 2.0), ("KD", 0.01), ("NDF", 1.0), ("BIAS", 50.0)];
    assert_eq!(trace(&members, "on=1; pv=10;", "cv"), [50.0, 18.0, 30.0]);
}

#[test]
fn the_derivative_is_that_of_the_process_variable_or_of_the_error() {
    let of_pv = [("KD", 2.0), ("NDF", 1.0), ("BIAS", 50.0)];
    // -2 s * 10 %/s for the process variable, nothing for the setpoint.
    assert_eq!(trace(&of_pv, "on=1; pv=10; loop.sp=20;", "cv"), [50.0, 30.0, 50.0, 50.0]);
    let of_error = [("KD", 2.0), ("NDF", 1.0), ("BIAS", 50.0), ("DOE", 1.0)];
    assert_eq!(trace(&of_error, "on=1; pv=10; loop.sp=20;", "cv"), [50.0, 30.0, 90.0, 50.0]);
    // The smoothing: a filter with a time constant of KD / 16 = 1 s, halved by each step of 1 s.
    let smooth = [("KD", 16.0), ("BIAS", 50.0), ("MINO", -100.0)];
    assert_eq!(trace(&smooth, "on=1; pv=5;;", "cv"), [50.0, 10.0, 30.0, 40.0]);
}

#[test]
fn the_process_variable_and_the_output_are_scaled() {
    let members = [
        ("MINI", 4.0),
        ("MAXI", 20.0),
        ("MAXS", 200.0),
        ("SP", 120.0),
        ("KP", 2.0),
        ("MINCV", 100.0),
        ("MAXCV", 500.0),
    ];
    // 12 mA is 100 of 200: E = 20 is 10 %, the output 20 %, of 400 above 100.
    assert_eq!(trace(&members, "on=1 pv=12", "loop.pv"), [100.0]);
    assert_eq!(trace(&members, "on=1 pv=12", "loop.err"), [20.0]);
    assert_eq!(trace(&members, "on=1 pv=12", "cv"), [180.0]);
    // The other control action.
    let cooling = [members.as_slice(), &[("CA", 1.0), ("BIAS", 50.0)]].concat();
    assert_eq!(trace(&cooling, "on=1 pv=12", "cv"), [220.0]);
}

#[test]
fn the_integral_stands_still_at_a_limit_of_the_output() {
    let members = [("KI", 5.0), ("SP", 10.0), ("MAXO", 120.0), ("MINO", 0.0)];
    let outputs = trace(&members, "on=1;; pv=20; loop.sp=0;", "cv");
    assert_eq!(outputs, [50.0, 100.0, 50.0, 50.0, 50.0]);
    let limited = [("KI", 4.0), ("SP", 10.0), ("MAXO", 90.0), ("BIAS", 20.0)];
    // 60, then 100 would be beyond 90: the integral stays 40, and goes down from there.
    assert_eq!(trace(&limited, "on=1;; pv=15", "cv"), [60.0, 60.0, 40.0]);
    // Equal limits are those by default.
    let equal = [("KP", 20.0), ("SP", 10.0), ("MAXO", 0.0)];
    assert_eq!(trace(&equal, "on=1", "cv"), [100.0]);
}

#[test]
fn the_output_does_not_jump_from_either_manual_mode_to_automatic() {
    let members = [("KP", 2.0), ("KI", 0.5), ("SP", 10.0)];
    // By hand 40; then the integral that gives 40 with P = 20, and its next step of 5.
    let scans = "on=1 loop.swm=1 loop.so=40; loop.swm=0; ";
    assert_eq!(trace(&members, scans, "cv"), [40.0, 45.0, 50.0]);
    let scans = "on=1 loop.mo=1 loop.swm=1 loop.so=40 tie=70; loop.mo=0; loop.swm=0";
    assert_eq!(trace(&members, scans, "cv"), [70.0, 70.0, 75.0]);
    // Without an integral part the bias is changed, or with NOBC nothing.
    let scans = "on=1 loop.swm=1 loop.so=40; loop.swm=0; pv=10";
    let without = [("KP", 2.0), ("SP", 10.0)];
    assert_eq!(trace(&without, scans, "cv"), [40.0, 40.0, 20.0]);
    let never = [("KP", 2.0), ("SP", 10.0), ("NOBC", 1.0)];
    assert_eq!(trace(&never, scans, "cv"), [40.0, 20.0, 0.0]);
    // In automatic the set output follows the output; the limits hold by hand too.
    assert_eq!(trace(&members, "on=1;", "loop.so"), [25.0, 30.0]);
    assert_eq!(trace(&members, "on=1 loop.swm=1 loop.so=140", "cv"), [100.0]);
}

#[test]
fn the_process_variable_is_tracked_by_hand_and_a_setpoint_out_of_range_does_not_count() {
    let tracking = [("KP", 2.0), ("SP", 10.0), ("PVT", 1.0)];
    assert_eq!(trace(&tracking, "on=1 pv=30; loop.swm=1; pv=35", "loop.sp"), [10.0, 30.0, 35.0]);
    let members = [("KP", 2.0), ("SP", 10.0)];
    assert_eq!(trace(&members, "on=1; loop.sp=120; loop.sp=15", "cv"), [20.0, 20.0, 30.0]);
}

#[test]
fn in_the_deadband_the_output_stays_once_the_error_has_crossed_zero() {
    let zero_crossing = [("KP", 2.0), ("BIAS", 50.0), ("DB", 3.0), ("SP", 20.0)];
    // Errors of 5, 2 (within, not crossed), -1 (crossed), 2 (within), 5.
    let scans = "on=1 pv=15; pv=18; pv=21; pv=18; pv=15";
    assert_eq!(trace(&zero_crossing, scans, "cv"), [60.0, 54.0, 54.0, 54.0, 60.0]);
    let without = [zero_crossing.as_slice(), &[("NOZC", 1.0)]].concat();
    assert_eq!(trace(&without, scans, "cv"), [60.0, 60.0, 60.0, 60.0, 60.0]);
}

#[test]
fn without_power_and_without_an_update_time_nothing_is_computed() {
    let members = [("KP", 2.0), ("KI", 0.5), ("SP", 10.0)];
    assert_eq!(trace(&members, "on=1; on=0; ; on=1", "cv"), [25.0, 25.0, 25.0, 30.0]);
    let stopped = [("KP", 2.0), ("SP", 10.0), ("UPD", 0.0)];
    assert_eq!(trace(&stopped, "on=1;", "cv"), [0.0, 0.0]);
}

#[test]
fn alarms_have_their_deadbands_and_whole_control_variables_are_rounded() {
    let members = [("PVH", 80.0), ("PVDB", 5.0), ("DVP", 10.0), ("DVN", 10.0), ("SP", 50.0)];
    let rung = "XIC(on)PID(loop,whole,0,valve,0,0,0);";
    let own = ["whole: INT", "valve: DINT"];
    let members = [members.as_slice(), &[("KP", 0.333)]].concat();
    let mut plc = plant::started(&read(&members, rung, &own));
    let mut lines = Vec::new();
    for (at, pv) in [79, 80, 76, 75, 40, 60].into_iter().enumerate() {
        let changes = [("on".to_owned(), 1), ("whole".to_owned(), pv)];
        plant::scan(&mut plc, 10 * at as u64, &changes);
        let names = ["loop.pvha", "loop.dvpa", "loop.dvna", "valve"];
        lines.push(names.map(|name| plc.value(name).to_string()).join(" "));
    }
    assert_eq!(lines, ["0 0 1 0", "1 0 1 0", "1 0 1 0", "0 0 1 0", "0 1 0 3", "0 0 1 0"]);
}

#[test]
fn a_whole_control_variable_is_zero_while_the_deadband_holds_the_output() {
    let members = [("KP", 2.0), ("BIAS", 50.0), ("DB", 3.0), ("SP", 20.0), ("NOZC", 1.0)];
    let rung = "XIC(on)PID(loop,pv,0,valve,0,0,0);";
    let mut plc = plant::started(&read(&members, rung, &["valve: DINT"]));
    let mut values = Vec::new();
    for (at, pv) in [15.0, 18.0, 15.0].into_iter().enumerate() {
        let changes = [("on".to_owned(), 1), ("pv".to_owned(), cell(pv))];
        plant::scan(&mut plc, 10 * at as u64, &changes);
        values.push((plc.value("valve"), number(&plc, "loop.out")));
    }
    assert_eq!(values, [(60, 60.0), (0, 60.0), (60, 60.0)]);
}

#[test]
fn a_cascade_and_an_output_that_a_module_holds_get_stubs() {
    for (rung, reason) in [
        ("PID(loop,pv,0,cv,other,0,0);", "PID of a cascade"),
        ("PID(loop,pv,0,cv,0,on,tie);", "PID that takes over the output that a module holds"),
        ("PID(loop,pv,cv,1.0);", "PID with 4 operands"),
        ("PID(pv,pv,0,cv,0,0,0);", "`pv` is no PID"),
    ] {
        let project = read(&[], rung, &["other: PID"]);
        assert_eq!(project.outcome.rungs[0].fate, Fate::Todo(reason.to_owned()), "{rung}");
    }
    for (rung, differences) in [(RUNG, 1), ("MOV(loop.CTL,n);", 1), ("MOV(loop.OUT,pv);", 0)] {
        let project = read(&[], rung, &["n: DINT"]);
        let found = match &project.outcome.rungs[0].fate {
            Fate::Different(texts) => texts.len(),
            Fate::Exact => 0,
            Fate::Todo(why) => panic!("{rung}: {why}"),
        };
        assert_eq!(found, differences, "{rung}");
    }
}

/// The equations of the manual, for a scale of 0 to 100 and an update time of 1 s.
#[derive(Default)]
struct Loop {
    members: Vec<(&'static str, f64)>,
    integral: f64,
    filter: f64,
    level: f64,
    error: f64,
    out: f64,
    bias: f64,
    is_begun: bool,
    is_held: bool,
}

impl Loop {
    fn value(&self, name: &str) -> f64 {
        self.members.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, value)| *value)
    }

    fn is(&self, name: &str) -> bool {
        self.value(name) != 0.0
    }

    /// The output behind a step with a process variable; `by_hand`: the set output.
    fn step(&mut self, pv: f64, by_hand: Option<f64>) -> f64 {
        let (kp, mut ki, mut kd) = (self.value("KP"), self.value("KI"), self.value("KD"));
        if self.is("PE") {
            ki = if ki > 0.0 { kp / (60.0 * ki) } else { 0.0 };
            kd *= kp * 60.0;
        }
        let sign = if self.is("CA") { -1.0 } else { 1.0 };
        let error = sign * (self.value("SP") - pv);
        let level = if self.is("DOE") { error } else { -sign * pv };
        if !self.is_begun {
            (self.filter, self.level, self.error) = (level, level, error);
        }
        let derivative = match self.is("NDF") {
            true => kd * (level - self.level),
            false => {
                let time = kd / 16.0;
                let filtered = (time * self.filter + level) / (time + 1.0);
                kd * (filtered - self.filter)
            }
        };
        self.filter = if self.is("NDF") { level } else { level - derivative / 16.0 };
        let is_within =
            self.value("DB") > 0.0 && error.abs() <= self.value("DB") && by_hand.is_none();
        let is_crossed = error * self.error <= 0.0;
        self.is_held = is_within && (self.is("NOZC") || self.is_held || is_crossed);
        let rest = kp * error + derivative;
        if let Some(out) = by_hand {
            self.out = out;
            if ki != 0.0 {
                self.integral = out - rest - self.bias;
            } else if !self.is("NOBC") {
                self.bias = out - rest - self.integral;
            }
        } else if !self.is_held {
            let next = self.integral + ki * error;
            if (0.0..=100.0).contains(&(rest + next + self.bias)) {
                self.integral = next;
            }
            self.out = rest + self.integral + self.bias;
        }
        self.out = self.out.clamp(0.0, 100.0);
        (self.level, self.error, self.is_begun) = (level, error, true);
        self.out
    }
}

#[test]
fn random_loops_follow_the_equations_of_the_manual() {
    let mut random = SplitMix64(3);
    for _ in 0..setting("RUNGD_PID_LOOPS", 12) {
        let mut members = vec![("SP", 45.0), ("BIAS", 20.0)];
        let gains = [("KP", 1.25), ("KI", 0.25), ("KD", 0.75), ("DB", 4.0)];
        let bits = ["CA", "DOE", "PE", "NDF", "NOBC", "NOZC"].map(|name| (name, 1.0));
        members.extend(gains.into_iter().filter(|_| below(&mut random, 4) > 0));
        members.extend(bits.into_iter().filter(|_| below(&mut random, 2) == 0));
        let mut model = Loop { bias: 20.0, members: members.clone(), ..Loop::default() };
        let mut plc = plant::started(&read(&members, RUNG, &[]));
        let (mut pv, mut by_hand) = (40.0, None);
        for scan in 0..200_u64 {
            pv = f64::clamp(pv + below(&mut random, 41) as f64 / 8.0 - 2.5, 0.0, 100.0);
            if below(&mut random, 12) == 0 {
                let out = below(&mut random, 201) as f64 / 2.0;
                by_hand = if by_hand.is_none() { Some(out) } else { None };
            }
            let changes = [
                ("on".to_owned(), 1),
                ("pv".to_owned(), cell(pv)),
                ("loop.swm".to_owned(), i32::from(by_hand.is_some())),
                ("loop.so".to_owned(), cell(by_hand.unwrap_or(0.0))),
            ];
            plant::scan(&mut plc, 10 * scan, &changes);
            let (wanted, found) = (model.step(pv, by_hand), number(&plc, "cv"));
            assert!((wanted - found).abs() < 0.01, "{members:?} {scan}: {wanted} {found}");
        }
    }
}
