//! Lines of a chip of this machine (Linux character devices), read and written by the scan itself.
//!
//! [`GpioOpener`] opens them: lines with the same setting form a group of 64 at most. The outputs
//! have their first values from the moment of opening, so no output glitches. An exchange is one
//! call of the kernel per group and allocates nothing. The kernel is reached through
//! [`ChipSource`], which tests implement with chips of their own; `kernel` is the only file that
//! uses the uAPI.

mod chip;
mod kernel;
pub mod settings;
#[cfg(test)]
mod tests;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::device::Opener;
use rungd_runtime::local::Local;

pub(crate) use chip::REQUEST_LINES_MAX;
pub use chip::{ChipSource, GpioChip, LineFacts, LineRequest, TakenLines};
pub use kernel::KernelChips;
use settings::{GpioLine, GpioSettings as Settings, LineId, LineSetting};

/// Opens the lines of a device.
pub struct GpioOpener<C> {
    settings: Settings,
    chips: C,
}

/// The lines of one request, with the number of each line's point.
struct LineGroup {
    lines: Box<dyn TakenLines>,
    points: Vec<usize>,
    /// The values of inputs that were read last; kept here so that the scan allocates nothing.
    bits: AtomicU64,
}

/// All lines of a device.
struct OpenLines {
    inputs: Vec<LineGroup>,
    outputs: Vec<LineGroup>,
}

impl<C: ChipSource> GpioOpener<C> {
    /// The lines of a device, not opened yet.
    pub fn new(settings: &Settings, chips: C) -> GpioOpener<C> {
        GpioOpener { settings: settings.clone(), chips }
    }
}

impl<C: ChipSource> Opener for GpioOpener<C> {
    fn open(&self, outputs: &[i32]) -> io::Result<Arc<dyn Local>> {
        let Settings { chip: wanted, inputs, outputs: driven, .. } = &self.settings;
        let chip =
            self.chips.open(wanted).map_err(|error| with_place(error, &wanted.to_string()))?;
        let found = LineNumbers::new(chip.as_ref(), inputs.iter().chain(driven))?;
        let (read, driven) = (&found.offsets[..inputs.len()], &found.offsets[inputs.len()..]);
        // Outputs are requested first: they have their safe values from then on.
        let outputs = groups(chip.as_ref(), &self.settings.outputs, driven, Some(outputs))?;
        let inputs = groups(chip.as_ref(), inputs, read, None)?;
        Ok(Arc::new(OpenLines { inputs, outputs }))
    }
}

/// Adds the place of the failure to an error. The error's kind stays; its number is in its text.
fn with_place(error: io::Error, at: &str) -> io::Error {
    io::Error::new(error.kind(), format!("{at}: {error}"))
}

/// The numbers of the lines, in the order of the settings.
struct LineNumbers {
    offsets: Vec<u32>,
}

impl LineNumbers {
    fn new<'a>(
        chip: &dyn GpioChip,
        lines: impl Iterator<Item = &'a GpioLine>,
    ) -> io::Result<LineNumbers> {
        let mut offsets = Vec::new();
        for line in lines {
            let offset = match &line.at {
                LineId::Offset(offset) => *offset,
                LineId::Name(name) => by_name(chip, name)?,
            };
            if offset >= chip.lines()? {
                let message = format!("{}: the chip has {} lines", line.at, chip.lines()?);
                return Err(io::Error::new(io::ErrorKind::NotFound, message));
            }
            if offsets.contains(&offset) {
                let message = format!("{} is line {offset}, which is in two rows", line.at);
                return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
            }
            offsets.push(offset);
        }
        Ok(LineNumbers { offsets })
    }
}

fn by_name(chip: &dyn GpioChip, name: &str) -> io::Result<u32> {
    for offset in 0..chip.lines()? {
        if chip.line(offset)?.name == name {
            return Ok(offset);
        }
    }
    Err(io::Error::new(io::ErrorKind::NotFound, format!("the chip has no line {name}")))
}

/// Requests lines with these numbers: those with the same setting in one request. `values`: the
/// first values of outputs.
fn groups(
    chip: &dyn GpioChip,
    lines: &[GpioLine],
    offsets: &[u32],
    values: Option<&[i32]>,
) -> io::Result<Vec<LineGroup>> {
    let mut alike: Vec<(LineSetting, Vec<usize>)> = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let room = |(setting, points): &&mut (LineSetting, Vec<usize>)| {
            *setting == line.setting && points.len() < REQUEST_LINES_MAX
        };
        match alike.iter_mut().find(room) {
            Some((_, points)) => points.push(at),
            None => alike.push((line.setting, vec![at])),
        }
    }
    let ask = |(setting, points): (LineSetting, Vec<usize>)| {
        let offsets: Vec<u32> = points.iter().map(|at| offsets[*at]).collect();
        let values = values.map(|values| packed(&points, values));
        let request = LineRequest { offsets: &offsets, setting, values };
        let lines = chip.request(&request).map_err(|error| refused(chip, &offsets, error))?;
        Ok(LineGroup { lines, points, bits: AtomicU64::new(0) })
    };
    alike.into_iter().map(ask).collect()
}

/// The error of a refused request; it names the holder if another program has one of the lines.
fn refused(chip: &dyn GpioChip, offsets: &[u32], error: io::Error) -> io::Error {
    let is_busy = error.raw_os_error() == Some(libc::EBUSY);
    let held = offsets.iter().filter(|_| is_busy).find_map(|offset| {
        let holder = chip.line(*offset).ok()?.holder?;
        Some((offset, holder))
    });
    match held {
        Some((offset, holder)) if holder.is_empty() => {
            io::Error::new(error.kind(), format!("line {offset} is in use"))
        }
        Some((offset, holder)) => {
            io::Error::new(error.kind(), format!("line {offset} is in use by {holder}"))
        }
        None => {
            let lines: Vec<_> = offsets.iter().map(u32::to_string).collect();
            with_place(error, &format!("lines {}", lines.join(", ")))
        }
    }
}

/// The points' values, one bit per point.
fn packed(points: &[usize], values: &[i32]) -> u64 {
    let bits = points.iter().enumerate();
    bits.fold(0, |bits, (bit, at)| bits | u64::from(values[*at] != 0) << bit)
}

impl Local for OpenLines {
    fn read(&self, inputs: &mut [i32]) -> Result<(), i32> {
        // Read all groups first: if one fails, the scan sees no new value of the others.
        for LineGroup { lines, bits, .. } in &self.inputs {
            bits.store(lines.get()?, Ordering::Relaxed);
        }
        for LineGroup { points, bits, .. } in &self.inputs {
            let bits = bits.load(Ordering::Relaxed);
            for (bit, at) in points.iter().enumerate() {
                inputs[*at] = (bits >> bit & 1) as i32;
            }
        }
        Ok(())
    }

    fn write(&self, outputs: &[i32]) -> Result<(), i32> {
        // Write all groups even if one fails: as many outputs as possible become safe.
        let set = |LineGroup { lines, points, .. }: &LineGroup| lines.set(packed(points, outputs));
        self.outputs.iter().map(set).fold(Ok(()), Result::and)
    }
}
