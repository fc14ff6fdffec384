//! Controller files: their settings, and the defaults of absent keys.

use std::path::{Path, PathBuf};

use rungd_base::scan_period::ScanPeriod;
use rungd_config::controller::Controller;
use rungd_config::controller::log::LogSettings;
use rungd_config::load::controller_file;
use rungd_engine::isa::{Bit, BitSpace};
use rungd_io::plant::settings::{Delays, InputRule, PartSettings};
use rungd_language::source::render::{Style, render};
use rungd_runtime::{Policy, Posture};

const LADDER: &str = r#"
[tags]
eye  = { at = "X3" }
gate = { at = "Y1" }

[[program]]
name = "Main"
rung = [{ when = ["eye"], do = ["OUT gate"] }]
"#;

fn controller(name: &str, text: &str) -> Controller {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(folder.join("programs")).unwrap();
    std::fs::write(folder.join("programs/bottling.toml"), LADDER).unwrap();
    std::fs::write(folder.join("controller.toml"), text).unwrap();
    let loaded = controller_file(Path::new(&folder.join("controller.toml"))).unwrap();
    let said = render(&loaded.findings, &loaded.files, Style::default());
    loaded.controller.unwrap_or_else(|| panic!("{said}"))
}

fn names(ranges: &[rungd_language::resolve::range::Range]) -> Vec<String> {
    ranges.iter().map(ToString::to_string).collect()
}

#[test]
fn everything_but_the_ladder_has_a_default() {
    let controller = controller("defaults", "ladder = [\"programs/bottling.toml\"]\n");
    assert_eq!((controller.period, controller.watchdog_ms), (ScanPeriod::of_ms(10), 200));
    assert_eq!(controller.log, LogSettings::default());
    assert!(controller.modbus.is_none() && controller.rules.is_empty());
    assert!(controller.outputs_on.is_empty() && controller.retain.is_empty());
    assert_eq!(controller.realtime, Posture::default());
}

/// Every section with keys that are not the defaults.
const SAID: &str = r#"
ladder = ["programs/bottling.toml"]
order  = ["Main"]

[scan]
period   = "2ms"
watchdog = "50ms"

[realtime]
policy      = "fifo"
priority    = 80
cpus        = [3, 1, 3]
lock-memory = true
cpu-latency = "0us"
spin        = "60us"
strict      = true

[memory]
X = 16

[outputs]
on   = ["Y7", "gate"]
hold = ["Y8..Y9"]

[retain]
ranges = ["CT8..CT15", "D100..D199"]

[modbus-server]
listen   = "127.0.0.1:1502"
writable = ["MC1..MC32", "MHR10..MHR19"]
connections = 2
frame-timeout = "1s"

[modbus-server.image]
inputs  = { from = "MC1..MC8", to = "X8..X15" }
outputs = { from = "Y0..Y7", to = "MI1..MI8" }

[[simulated-device]]
input = "eye"
pulse = "200ms"
every = "1s"
while = "gate"

[[simulated-device]]
input   = "X4"
follows = "gate"
after   = "30ms"
invert  = true

[log]
statistics = "0s"
"#;

#[test]
fn written_settings_are_used() {
    let controller = controller("said", SAID);
    assert_eq!((controller.period, controller.watchdog_ms), (ScanPeriod::of_ms(2), 50));
    let realtime = Posture {
        policy: Policy::Fifo(80),
        cpus: vec![1, 3],
        lock_memory: true,
        cpu_latency_us: Some(0),
        spin_us: 60,
        strict: true,
    };
    assert_eq!(controller.realtime, realtime);
    assert_eq!(names(&controller.outputs_on), ["Y7", "Y1"]);
    assert_eq!(names(&controller.outputs_hold), ["Y8..Y9"]);
    assert_eq!(names(&controller.retain), ["CT8..CT15", "D100..D199"]);
    let modbus = controller.modbus.unwrap();
    assert_eq!(modbus.listen.to_string(), "127.0.0.1:1502");
    assert_eq!((modbus.connections, modbus.frame_timeout_ms), (2, 1_000));
    assert_eq!(modbus.idle_timeout_ms, 60_000);
    let (from, to) = modbus.outputs.unwrap();
    assert_eq!((from.to_string(), to.to_string()), ("Y0..Y7".into(), "MI1..MI8".into()));
    let gate = Bit::Space(BitSpace::Y, 1);
    let [eye, behind] = &controller.rules[..] else { panic!("two rules") };
    let bits = |rule: &InputRule| -> Vec<_> {
        rule.commands.iter().map(|command| command.map(|command| command.bit)).collect()
    };
    assert_eq!((eye.input, bits(eye)), (3, vec![Some(gate)]));
    let [width_ms, every_ms, offset_ms] = [200, 1_000, 0];
    let pulse = PartSettings::Pulse { width_ms, every_ms, offset_ms, invert: false };
    assert_eq!(eye.part, pulse);
    let delays = Delays { after_ms: 30, release_ms: 30 };
    assert_eq!((behind.input, bits(behind)), (4, vec![Some(gate), None]));
    assert_eq!(behind.part, PartSettings::Delay { delays, invert: true });
    assert_eq!(controller.log.statistics_ms, 0);
}
