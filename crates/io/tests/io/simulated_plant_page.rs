//! `docs/simulated-plant.md` and `docs/gpio.md`: their files pass the check, and the diagram shows
//! the behaviour of the plant and the ladder. After a change: `UPDATE_PAGES=1 cargo test -p rungd-io
//! io::simulated_plant_page`.

use rungd_test_support::page;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rungd_config::load::{self, Loaded};
use rungd_test_support::bench::Plant;

/// A page's ladder and controller file, loaded without a finding.
fn loaded(name: &str, ladder: &str, controller: &str) -> Loaded {
    let text = page::text(name);
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    for file in [ladder, controller] {
        std::fs::write(folder.join(file), page::file(&text, file)).unwrap();
    }
    let alone = load::ladder_files(&[folder.join(ladder)]).unwrap();
    assert!(alone.findings.is_empty(), "{:#?}", alone.findings);
    let loaded = load::controller_file(&folder.join(controller)).unwrap();
    assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
    loaded
}

#[test]
fn the_files_of_the_gpio_page_pass_the_check() {
    loaded("gpio.md", "panel.toml", "panel-controller.toml");
}

const COLUMN_MS: u64 = 50;
const END_MS: u64 = 4_500;

fn diagram() -> String {
    let loaded = loaded("simulated-plant.md", "dosing.toml", "dosing-controller.toml");
    let mut plant = Plant::of(loaded);
    let bits = ["motor", "answer", "eye", "valve", "empty"];
    let mut lines = bits.map(|name| format!("{name:8}"));
    let mut levels = format!("{:8}", "level");
    let mut ruler = format!("{:8}", "s");
    while plant.now_ms < END_MS {
        if plant.now_ms == 2_700 {
            plant.force("C100", true);
        }
        let column = plant.now_ms.is_multiple_of(COLUMN_MS);
        let second = plant.now_ms.is_multiple_of(1000);
        plant.scan();
        if !column {
            continue;
        }
        for (line, name) in lines.iter_mut().zip(bits) {
            line.push(if plant.value(name) == 0 { '_' } else { '#' });
        }
        if second {
            let at = (plant.now_ms / 1000).to_string();
            let _ = write!(ruler, "{at:20}");
            let _ = write!(levels, "{:<20}", plant.value("level"));
        }
    }
    let rows = [ruler].into_iter().chain(lines).chain([levels]);
    rows.map(|row| row.trim_end().to_owned() + "\n").collect()
}

#[test]
fn the_diagram_of_the_page_equals_the_simulation() {
    let text = page::text("simulated-plant.md");
    let (before, rest) = text.split_once("```text\n").expect("a diagram");
    let (shown, after) = rest.split_once("```").expect("its end");
    let drawn = diagram();
    if std::env::var_os("UPDATE_PAGES").is_some() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("docs/simulated-plant.md");
        std::fs::write(path, format!("{before}```text\n{drawn}```{after}")).unwrap();
        return;
    }
    assert_eq!(shown, drawn, "UPDATE_PAGES=1 draws it anew");
}

/// A proportional control alone does not reach 80 °C: 20 + 2 * power with power = 4 * (80 - T)
/// comes to rest at 660 / 9 degrees.
#[test]
fn the_oven_settles_at_the_temperature_of_proportional_control() {
    let mut plant = Plant::of(loaded("simulated-plant.md", "oven.toml", "oven-controller.toml"));
    while plant.now_ms < 120_000 {
        plant.scan();
    }
    let temperature = f32::from_bits(plant.value("temperature") as u32);
    assert!((temperature - 660.0 / 9.0).abs() < 0.1, "{temperature}");
}
