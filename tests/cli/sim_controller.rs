//! `rungd sim CONTROLLER.toml`: a controller with its simulated plant, in a closed loop; and periods below a
//! millisecond.

use crate::cli::sim::{Place, scans, text};

/// A plant that answers 300 ms after its command, a device that does not answer, and a rule.
const LOOP: &str = r#"
ladder = ["loop.toml"]
scan.period = "50ms"
[[device]]
name = "plant"
driver = "simulated"
poll = "50ms"
map = [{ from = "motor.out", to = "X0" }, { from = "Y0", to = "motor.in" }]
[[device.part]]
name = "motor"
kind = "delay"
after = "300ms"
[[device]]
name = "line"
driver = "modbus-tcp"
address = "127.0.0.1:1502"
unit = 1
map = [{ from = "holding 0", to = "D0" }]
"#;

const LOOP_LADDER: &str = "[ladder]\ndevices = [\"plant\", \"line\"]\n[[program]]\nname = \"Main\"\n\
    rung = [{ when = [\"X1\"], do = [\"OUT Y0\"] }, { when = [\"line.Ok\"], do = [\"OUT Y1\"] }]\n";

#[test]
fn a_controller_is_simulated_with_its_plant_in_a_closed_loop() {
    let place = Place::new("loop");
    place.write("loop.toml", LOOP_LADDER);
    place.write("controller.toml", LOOP);
    place.write("in.csv", "time,X1,line.Ok,D0\n0.1s,1,,\n700ms,,,7\n1s,0,0,\n1.1s,,,9\n");
    let args = "controller.toml --for 1200ms --stimulus in.csv --watch X1,Y0,X0,Y1,D0 --changes";
    expect_test::expect![[r#"
        scan,time_ms,X1,Y0,X0,Y1,D0
        0,0,0,0,0,1,0
        2,100,1,1,0,1,0
        9,450,1,1,1,1,0
        14,700,1,1,1,1,7
        20,1000,0,0,1,0,7
    "#]]
    .assert_eq(&text(&place.sim(args).stdout));
}

#[test]
fn a_stimulus_cannot_write_inputs_of_the_simulated_plant() {
    let place = Place::new("loop-moved");
    place.write("loop.toml", LOOP_LADDER);
    place.write("controller.toml", LOOP);
    place.write("x0.csv", "scan,X0\n1,1\n");
    place.write("stale.csv", "scan,line.Stale\n1,1\n");
    let moved = "`X0` is moved by device `plant` at every scan";
    place.refused("controller.toml --stimulus x0.csv", 78, moved);
    place.refused("controller.toml --stimulus stale.csv", 78, "set the device's `.Ok`");
    place.refused("controller.toml --period 10ms", 2, "a controller file has its own");
    place.refused("controller.toml --changes --trace x.svg", 2, "--changes is for CSV");
}

#[test]
fn rows_of_a_stimulus_after_a_stop_give_a_warning() {
    let place = Place::new("loop-stop");
    place.write(
        "loop.toml",
        &LOOP_LADDER.replace("OUT Y1", "STOP").replace("\"line.Ok", "\"!line.Ok"),
    );
    place.write("controller.toml", LOOP);
    place.write("in.csv", "time,line.Ok\n0.1s,0\n2s,1\n");
    let output = place.sim("controller.toml --for 10s --stimulus in.csv --watch Y0");
    let why = "a STOP instruction ended the simulation after scan 3 (1 row is left out)";
    let said = format!("warning: in.csv:3: scan 40 is not executed: {why}\n");
    let errors = text(&output.stderr);
    assert!(errors.ends_with(&said), "{errors}");
    assert!(text(&output.stdout).ends_with("\n3,150,0\nstop,150,0\n"));
}

/// A tank that is a ladder, and a meter on Modbus whose own side is one.
const LADDERS: &str = r#"
ladder = ["main.toml"]
[[device]]
name = "tank"
driver = "ladder"
ladder = ["tank.toml"]
period = "20ms"
poll = "10ms"
map = [{ from = "Y0", to = "tank.X0" }, { from = "tank.D0", to = "D0" }]
[[device]]
name = "meter"
driver = "modbus-tcp"
address = "127.0.0.1:1502"
unit = 1
poll = "10ms"
map = [{ from = "holding 0", to = "D1" }, { from = "Y1", to = "coil 0" }]
[[simulated]]
device = "meter"
ladder = ["meter.toml"]
period = "40ms"
"#;

#[test]
fn a_plant_and_an_own_side_that_are_ladders_scan_at_their_own_periods() {
    let place = Place::new("ladders");
    let rungs = |rungs: &str| format!("[[program]]\nname = \"Main\"\nrung = [{rungs}]\n");
    let main = "{ when = [\"$On\"], do = [\"OUT Y0\", \"OUT Y1\"] }, \
                { when = [\"tank.Ok\", \"meter.Ok\", \"D0 + D1 > 99\"], do = [\"OUT C0\"] }";
    let devices = "[ladder]\ndevices = [\"tank\", \"meter\"]\n";
    place.write("main.toml", &(devices.to_owned() + &rungs(main)));
    place.write("tank.toml", &rungs("{ when = [\"X0\"], do = [\"ADD D0 1 to=D0\"] }"));
    place.write("meter.toml", &rungs("{ when = [\"MC1\"], do = [\"ADD MHR1 5 to=MHR1\"] }"));
    place.write("controller.toml", LADDERS);
    expect_test::expect![[r#"
        scan,time_ms,D0,D1,meter.Ok
        0,0,0,0,1
        1,10,0,0,1
        2,20,1,0,1
        3,30,1,0,1
        4,40,2,5,1
        5,50,2,5,1
        6,60,3,5,1
        7,70,3,5,1
        8,80,4,10,1
        9,90,4,10,1
        10,100,5,10,1
        11,110,5,10,1
        12,120,6,15,1
        13,130,6,15,1
    "#]]
    .assert_eq(&text(&place.sim("controller.toml --scans 14 --watch D0,D1,meter.Ok").stdout));
}

#[test]
fn timers_count_whole_milliseconds_at_a_period_below_one() {
    let place = Place::new("below-a-millisecond");
    let rung = "rung = [{ when = [\"$On\"], do = [\"ONDTMR T0 preset=2ms output=Y0\"] }]";
    place.write("short.toml", &format!("[[program]]\nname = \"Main\"\n{rung}\n"));
    let trace = place.trace("short.toml --period 400us --scans 8 --watch T0.Acc,Y0");
    let rows: Vec<&str> = trace.lines().skip(1).collect();
    let expected = ["0,0,0,0", "1,0.4,0,0", "2,0.8,0,0", "3,1.2,1,0", "4,1.6,1,0", "5,2,2,1"];
    assert_eq!(rows[..6], expected);
    assert_eq!(scans(&place.trace("short.toml --period 400us --for 3ms --watch Y0")).len(), 8);
    place.refused("short.toml --period 99us", 2, "a period is at least 100us");
}
