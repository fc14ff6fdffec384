//! SR in retentive memory, with the real binary: a clock that was ON before a restart and is ON
//! after it shifts nothing, if all bits of the shift register are retained.

use std::fs;

use crate::retain::memory::{Plant, Running, file, run};
use rungd_state::retain::content::{self, RetainedContent};
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::slots::survey;

/// A controller with these lines of `[retain]`, which runs after a cold start.
fn keeps(what: &str) -> String {
    format!(
        "scan.period = \"2ms\"\n[retain]\n{what}\nfile = \"memory\"\n\
         cold-start = \"run\"\n[operator]\nenabled = false\n"
    )
}

/// A block with an SR of these bits and this clock; DATA is ON.
fn shifts(block: &str, bits: &str, clk: &str) -> String {
    program(block, &sr(bits, clk))
}

fn program(block: &str, rungs: &str) -> String {
    format!(
        "[tags]\nbelt = {{ type = \"bit\", count = 4 }}\n\
         [[program]]\nname = \"Main\"\nrung = [ {{ when = [\"belt[0]\"], do = [\"OUT Y9\"] }} ]\n\
         [[program]]\nname = \"{block}\"\nautostart = true\nrung = [\n{rungs} ]\n"
    )
}

fn sr(bits: &str, clk: &str) -> String {
    format!(
        "{{ leg.data = [\"$On\"], leg.clk = [\"{clk}\"], leg.rst = [\"$Off\"], do = [\"SR {bits}\"] }},\n"
    )
}

fn write(plant: &Plant, ladder: &str, controller: &str) {
    fs::write(plant.0.join("ladder.toml"), ladder).unwrap();
    let controller = format!("ladder = [\"ladder.toml\"]\n{controller}");
    fs::write(plant.0.join("controller.toml"), controller).unwrap();
}

fn kept(plant: &Plant) -> RetainedContent {
    let mut device = FileDevice::open(&file(plant), Access::Read).unwrap();
    let newest = survey(&mut device).unwrap().newest.unwrap();
    content::read(&newest.content).unwrap()
}

/// Runs some scans; returns the kept bits, the lowest first.
fn bits(plant: &Plant) -> String {
    run(plant, "3");
    let content = kept(plant);
    let bits = content.elements.iter().map(|(_, value)| if value.word == 0 { '0' } else { '1' });
    bits.collect()
}

#[test]
fn a_part_at_the_sensor_is_not_shifted_in_again_after_a_restart() {
    let plant = Plant::new("", "");
    let four = keeps("ranges = [\"C0..C3\"]");
    write(&plant, &shifts("Line", "C0..C3", "$On"), &four);
    assert_eq!((bits(&plant), bits(&plant)), ("1000".into(), "1000".into()));
    // A clock that was OFF before a restart and is ON after it shifts.
    write(&plant, &shifts("Line", "C0..C3", "$Off"), &four);
    assert_eq!(bits(&plant), "1000");
    write(&plant, &shifts("Line", "C0..C3", "$On"), &four);
    assert_eq!((bits(&plant), bits(&plant)), ("1100".into(), "1100".into()));
    write(&plant, &shifts("Other", "C0..C3", "$On"), &four);
    assert_eq!(bits(&plant), "1110", "another block's eye is another eye");
    write(&plant, &shifts("Other", "C3..C0", "$On"), &four);
    assert_eq!(bits(&plant), "1101", "its first bit is another one");
    assert_eq!(bits(&plant), "1101");
}

#[test]
fn the_clock_history_is_retained_only_with_all_bits_of_the_sr() {
    let plant = Plant::new("", "");
    write(&plant, &shifts("Line", "C0..C3", "$On"), &keeps("ranges = [\"C0..C2\"]"));
    assert_eq!((bits(&plant), bits(&plant)), ("100".into(), "110".into()));
}

#[test]
fn two_sr_of_the_same_bits_in_one_block_have_separate_histories() {
    let plant = Plant::new("", "");
    let rungs = |first: &str, second: &str| {
        program("Line", &[sr("C0..C3", first), sr("C0..C3", second)].concat())
    };
    let four = keeps("ranges = [\"C0..C3\"]");
    write(&plant, &rungs("$On", "$Off"), &four);
    assert_eq!(bits(&plant), "1000");
    write(&plant, &rungs("$On", "$On"), &four);
    assert_eq!((bits(&plant), bits(&plant)), ("1100".into(), "1100".into()));
}

#[test]
fn the_clock_history_follows_an_array_without_an_address() {
    let plant = Plant::new("", "");
    let by_name = keeps("tags = [\"belt\"]");
    let ladder = shifts("Line", "belt", "$On");
    write(&plant, &ladder, &by_name);
    assert_eq!(bits(&plant), "1000");
    let more = "alpha = { type = \"bit\", count = 3, spare = true }\n[[program]]\nname = \"Main\"";
    write(&plant, &ladder.replace("[[program]]\nname = \"Main\"", more), &by_name);
    assert_eq!(bits(&plant), "1000");
    assert_ne!(kept(&plant).elements[0].0.number, 0, "it has moved");
}

#[test]
fn a_killed_process_keeps_the_clock_history_of_an_sr() {
    let plant = Plant::new("", "");
    let four = keeps("ranges = [\"C0..C3\"]\ninterval = \"10ms\"");
    write(&plant, &shifts("Line", "C0..C3", "$On"), &four);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    while survey_is_empty(&plant) {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    running.child.kill().unwrap();
    running.end();
    assert_eq!(bits(&plant), "1000");
}

fn survey_is_empty(plant: &Plant) -> bool {
    let device = FileDevice::open(&file(plant), Access::Read);
    device.is_ok_and(|mut device| survey(&mut device).is_ok_and(|s| s.newest.is_none()))
}
