//! Lines of a chip in memory: requests, reads, writes and refusals.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::chip::CONSUMER;
use super::*;
use crate::gpio::settings::{Bias, ChipId as ChipName, LineDrive};

/// A chip in memory; its clones share one state.
#[derive(Clone, Default)]
struct Fake(Arc<Mutex<ChipState>>);

#[derive(Default)]
struct ChipState {
    /// The names of the lines, one per line, by number.
    names: Vec<&'static str>,
    levels: BTreeMap<u32, bool>,
    holders: BTreeMap<u32, String>,
    /// The requests: lines, setting, first values.
    asked: Vec<(Vec<u32>, LineSetting, Option<u64>)>,
    gone: bool,
    /// A line that makes every read of its request fail.
    broken: Option<u32>,
}

struct FakeLines {
    chip: Fake,
    offsets: Vec<u32>,
    active_low: bool,
}

impl Fake {
    fn of(lines: usize) -> Fake {
        let fake = Fake::default();
        fake.state().names = vec![""; lines];
        fake
    }

    fn state(&self) -> std::sync::MutexGuard<'_, ChipState> {
        self.0.lock().unwrap()
    }
}

impl ChipSource for Fake {
    fn open(&self, _: &ChipName) -> io::Result<Box<dyn GpioChip>> {
        if self.state().gone {
            return Err(io::Error::from_raw_os_error(libc::ENOENT));
        }
        Ok(Box::new(self.clone()))
    }
}

impl GpioChip for Fake {
    fn lines(&self) -> io::Result<u32> {
        Ok(self.state().names.len() as u32)
    }

    fn line(&self, offset: u32) -> io::Result<LineFacts> {
        let state = self.state();
        let name = state.names[offset as usize].to_owned();
        Ok(LineFacts { name, holder: state.holders.get(&offset).cloned() })
    }

    fn request(&self, request: &LineRequest<'_>) -> io::Result<Box<dyn TakenLines>> {
        let mut state = self.state();
        if request.offsets.iter().any(|offset| state.holders.contains_key(offset)) {
            return Err(io::Error::from_raw_os_error(libc::EBUSY));
        }
        if request.setting.bias == Bias::PullDown {
            return Err(io::Error::from_raw_os_error(libc::EINVAL));
        }
        let offsets = request.offsets.to_vec();
        state.asked.push((offsets.clone(), request.setting, request.values));
        for offset in &offsets {
            state.holders.insert(*offset, CONSUMER.to_owned());
        }
        drop(state);
        let active_low = request.setting.active_low;
        let taken = FakeLines { chip: self.clone(), offsets, active_low };
        if let Some(values) = request.values {
            taken.set(values).unwrap();
        }
        Ok(Box::new(taken))
    }
}

impl TakenLines for FakeLines {
    fn get(&self) -> Result<u64, i32> {
        let state = self.chip.state();
        if state.gone || state.broken.is_some_and(|line| self.offsets.contains(&line)) {
            return Err(libc::ENODEV);
        }
        let level = |offset| state.levels.get(offset).copied().unwrap_or(false);
        let bits = self.offsets.iter().enumerate();
        Ok(bits.fold(0, |bits, (n, at)| bits | u64::from(level(at) != self.active_low) << n))
    }

    fn set(&self, values: u64) -> Result<(), i32> {
        let mut state = self.chip.state();
        if state.gone {
            return Err(libc::ENODEV);
        }
        for (n, offset) in self.offsets.iter().enumerate() {
            state.levels.insert(*offset, (values >> n & 1 == 1) != self.active_low);
        }
        Ok(())
    }
}

impl Drop for FakeLines {
    fn drop(&mut self) {
        let mut state = self.chip.state();
        self.offsets.iter().for_each(|offset| drop(state.holders.remove(offset)));
    }
}

fn plain(offset: u32) -> GpioLine {
    GpioLine { at: LineId::Offset(offset), setting: LineSetting::default() }
}

fn with(offset: u32, setting: LineSetting) -> GpioLine {
    GpioLine { at: LineId::Offset(offset), setting }
}

fn device(chip: &Fake, inputs: Vec<GpioLine>, outputs: Vec<GpioLine>) -> GpioOpener<Fake> {
    let wanted = ChipName::Path("/dev/gpiochip0".into());
    GpioOpener::new(&Settings { chip: wanted, budget_us: 200, inputs, outputs }, chip.clone())
}

fn why(device: &GpioOpener<Fake>, outputs: &[i32]) -> String {
    device.open(outputs).err().expect("it is refused").to_string()
}

#[test]
fn lines_with_equal_settings_share_a_request_and_outputs_have_their_first_values() {
    let chip = Fake::of(16);
    let low = LineSetting { active_low: true, ..LineSetting::default() };
    let slow = LineSetting { debounce_ms: 5, bias: Bias::PullUp, ..LineSetting::default() };
    let open = LineSetting { drive: LineDrive::OpenDrain, ..LineSetting::default() };
    let inputs = vec![plain(4), with(5, slow), plain(2), with(6, low)];
    let outputs = vec![plain(7), with(9, open), plain(8)];
    let _opened = device(&chip, inputs, outputs).open(&[1, 1, 0]).unwrap();
    let asked = chip.state().asked.clone();
    assert_eq!(
        asked,
        [
            (vec![7, 8], LineSetting::default(), Some(0b01)),
            (vec![9], open, Some(1)),
            (vec![4, 2], LineSetting::default(), None),
            (vec![5], slow, None),
            (vec![6], low, None),
        ]
    );
}

#[test]
fn each_point_reads_and_writes_its_own_line() {
    let chip = Fake::of(16);
    let low = LineSetting { active_low: true, ..LineSetting::default() };
    let inputs = vec![plain(4), with(5, low), plain(2)];
    let outputs = vec![with(7, low), plain(8)];
    let opened = device(&chip, inputs, outputs).open(&[0, 0]).unwrap();
    // OFF is a high level at line 7, from the first moment on.
    assert_eq!(chip.state().levels, [(7, true), (8, false)].into());
    let mut read = [9; 3];
    opened.read(&mut read).unwrap();
    assert_eq!(read, [0, 1, 0]);
    chip.state().levels.extend([(2, true), (5, true)]);
    opened.read(&mut read).unwrap();
    assert_eq!(read, [0, 0, 1]);
    opened.write(&[1, 1]).unwrap();
    assert_eq!(chip.state().levels, [(2, true), (5, true), (7, false), (8, true)].into());
}

#[test]
fn more_than_64_lines_are_split_into_several_requests() {
    let chip = Fake::of(200);
    let opened = device(&chip, (0..150).map(plain).collect(), vec![]).open(&[]).unwrap();
    let counts: Vec<usize> = chip.state().asked.iter().map(|(lines, ..)| lines.len()).collect();
    assert_eq!(counts, [64, 64, 22]);
    chip.state().levels.extend((0..150).map(|n| (n, n % 3 == 0)));
    let mut read = [0; 150];
    opened.read(&mut read).unwrap();
    assert!((0..150).all(|n| read[n] == i32::from(n % 3 == 0)));
}

#[test]
fn a_line_in_use_is_refused_with_its_holder() {
    let chip = Fake::of(32);
    chip.state().holders.insert(17, "spi0 CS0".into());
    let device = device(&chip, vec![plain(3), plain(17)], vec![plain(4)]);
    assert_eq!(why(&device, &[0]), "line 17 is in use by spi0 CS0");
    // The lines that were taken before the failure are released again.
    assert_eq!(chip.state().holders.len(), 1);
    chip.state().holders.insert(17, String::new());
    assert_eq!(why(&device, &[0]), "line 17 is in use");
    chip.state().holders.clear();
    assert!(device.open(&[0]).is_ok());
}

#[test]
fn lines_can_be_requested_by_name() {
    let chip = Fake::of(4);
    chip.state().names = vec!["SDA", "SCL", "GPIO17", ""];
    let named =
        |name: &str| GpioLine { at: LineId::Name(name.into()), setting: LineSetting::default() };
    let _opened = device(&chip, vec![named("GPIO17")], vec![]).open(&[]).unwrap();
    assert_eq!(chip.state().asked[0].0, [2]);
    let unknown = device(&chip, vec![named("GPIO18")], vec![]);
    assert_eq!(why(&unknown, &[]), "the chip has no line GPIO18");
    let twice = device(&chip, vec![plain(1)], vec![named("SCL")]);
    assert_eq!(why(&twice, &[0]), "line SCL is line 1, which is in two rows");
}

#[test]
fn lines_and_settings_that_the_chip_lacks_are_refused() {
    let chip = Fake::of(8);
    assert_eq!(why(&device(&chip, vec![plain(8)], vec![]), &[]), "line 8: the chip has 8 lines");
    let down = LineSetting { bias: Bias::PullDown, ..LineSetting::default() };
    let said = why(&device(&chip, vec![with(2, down), with(3, down)], vec![]), &[]);
    assert_eq!(said, "lines 2, 3: Invalid argument (os error 22)");
    chip.state().gone = true;
    let said = why(&device(&chip, vec![plain(1)], vec![]), &[]);
    assert_eq!(said, "/dev/gpiochip0: No such file or directory (os error 2)");
}

#[test]
fn an_unplugged_chip_returns_its_error_number() {
    let chip = Fake::of(8);
    let opened = device(&chip, vec![plain(1)], vec![plain(2)]).open(&[0]).unwrap();
    chip.state().gone = true;
    assert_eq!(opened.read(&mut [0]), Err(libc::ENODEV));
    assert_eq!(opened.write(&[1]), Err(libc::ENODEV));
}

#[test]
fn a_partly_failed_read_changes_no_input() {
    let chip = Fake::of(8);
    let low = LineSetting { active_low: true, ..LineSetting::default() };
    let inputs = vec![plain(1), with(2, low)];
    let opened = device(&chip, inputs, vec![]).open(&[]).unwrap();
    let mut read = [0, 0];
    chip.state().levels.insert(1, true);
    chip.state().broken = Some(2);
    assert_eq!(opened.read(&mut read), Err(libc::ENODEV));
    assert_eq!(read, [0, 0]);
    chip.state().broken = None;
    opened.read(&mut read).unwrap();
    assert_eq!(read, [1, 1]);
}
