//! A test with real lines: `RUNGD_GPIO_CHIP=/dev/gpiochip0 RUNGD_GPIO_OUT=27 RUNGD_GPIO_IN=17 cargo
//! test --test controller io::gpio_hardware -- --nocapture`, with a wire between the two lines. A simulated
//! chip (`modprobe gpio-sim`) also works. Without the variables, the test prints that it is
//! skipped.

use rungd_test_support::running::live;
use std::time::{Duration, Instant};

use rungd_io::device::Opener;
use rungd_io::gpio::settings::{ChipId, GpioLine, GpioSettings as Settings, LineId, LineSetting};
use rungd_io::gpio::{GpioOpener, KernelChips};

fn wanted(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

#[test]
fn an_output_is_read_back_through_a_wire() {
    let (Some(chip), Some(out)) = (wanted("RUNGD_GPIO_CHIP"), wanted("RUNGD_GPIO_OUT")) else {
        eprintln!("skipped: no lines were named by RUNGD_GPIO_CHIP and RUNGD_GPIO_OUT");
        return;
    };
    let line = |offset: &str, setting| {
        let at = offset.parse().map_or_else(|_| LineId::Name(offset.into()), LineId::Offset);
        GpioLine { at, setting }
    };
    let input = wanted("RUNGD_GPIO_IN");
    let inputs = input.iter().map(|offset| line(offset, LineSetting::default())).collect();
    let outputs = vec![line(&out, LineSetting::default())];
    let settings = Settings { chip: ChipId::Path(chip), budget_us: 200, inputs, outputs };
    let gpio = GpioOpener::new(&settings, KernelChips);
    let opened = gpio.open(&[1]).expect("the lines are free");
    let second = gpio.open(&[1]).err().expect("the lines are taken").to_string();
    assert!(second.ends_with("is in use by rungd"), "{second}");
    for value in [1, 0, 1, 0] {
        opened.write(&[value]).expect("written");
        let deadline = Instant::now() + Duration::from_secs(1);
        let mut read = vec![value; settings.inputs.len()];
        loop {
            opened.read(&mut read).expect("read");
            if read.iter().all(|level| *level == value) {
                break;
            }
            assert!(Instant::now() < deadline, "{value} is not read: is there a wire?");
        }
    }
    let begin = Instant::now();
    let mut read = vec![0; settings.inputs.len()];
    for _ in 0..1000 {
        opened.read(&mut read).expect("read");
        opened.write(&[0]).expect("written");
    }
    eprintln!("an exchange takes {} ns", begin.elapsed().as_nanos() / 1000);
}

#[test]
fn a_missing_chip_is_reported_and_the_controller_runs_without_it() {
    let ladder = r#"
[[program]]
name = "Main"
rung = [{ when = ["panel.Stale"], do = ["OUT C0"] }]
"#;
    let controller = r#"
[[device]]
name       = "panel"
driver     = "gpio"
chip       = "/dev/no-such-chip"
loss-after = "100ms"
map        = [{ from = "line 1", to = "X0" }, { from = "Y0", to = "line 2" }]
"#;
    let mut live = live::Live::start(ladder, controller, &[]);
    live.await_values("panel.Ok panel.Stale C0", "OFF ON ON");
    let status = live.ok("status");
    let told = "/dev/no-such-chip: No such file or directory (os error 2)";
    assert!(
        status.contains(told) && status.contains("panel (gpio, /dev/no-such-chip)"),
        "{status}"
    );
    live.end();
}
