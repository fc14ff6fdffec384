//! The chips of Linux: the character device's uAPI, version 2 (since Linux 5.10).

use std::fs::{self, File};
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use gpiocdev_uapi::v2::{self, LineFlags, LineValues};
use gpiocdev_uapi::{Error, Name};

use super::chip::{CONSUMER, ChipSource, GpioChip, LineFacts, LineRequest, TakenLines};
use super::settings::{Bias, ChipId as ChipName, LineDrive};

/// The chips of this machine.
pub struct KernelChips;

struct OpenChip(File);

/// Lines that were taken; `mask` has one bit for each.
struct KernelLines {
    file: File,
    mask: u64,
}

impl ChipSource for KernelChips {
    fn open(&self, chip: &ChipName) -> io::Result<Box<dyn GpioChip>> {
        let path = match chip {
            ChipName::Path(path) => PathBuf::from(path),
            ChipName::Label(label) => labelled(label)?,
        };
        Ok(Box::new(OpenChip(open(&path)?)))
    }
}

fn open(path: &Path) -> io::Result<File> {
    File::options().read(true).write(true).open(path)
}

/// The chip with this label, if exactly one has it.
fn labelled(label: &str) -> io::Result<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir("/dev")? {
        let entry = entry?;
        if !entry.file_name().as_bytes().starts_with(b"gpiochip") {
            continue;
        }
        // Skip a chip that may not be opened: it belongs to other programs.
        let info = open(&entry.path()).and_then(|file| v2::get_chip_info(&file).map_err(system));
        if info.is_ok_and(|info| text(&info.label) == label) {
            found.push(entry.path());
        }
    }
    match found.as_slice() {
        [path] => Ok(path.clone()),
        [] => Err(io::Error::new(io::ErrorKind::NotFound, "no chip with this label may be opened")),
        _ => Err(io::Error::new(io::ErrorKind::InvalidInput, "several chips have this label")),
    }
}

impl GpioChip for OpenChip {
    fn lines(&self) -> io::Result<u32> {
        Ok(v2::get_chip_info(&self.0).map_err(system)?.num_lines)
    }

    fn line(&self, offset: u32) -> io::Result<LineFacts> {
        let info = v2::get_line_info(&self.0, offset).map_err(system)?;
        let is_used = info.flags.contains(LineFlags::USED);
        Ok(LineFacts { name: text(&info.name), holder: is_used.then(|| text(&info.consumer)) })
    }

    fn request(&self, request: &LineRequest<'_>) -> io::Result<Box<dyn TakenLines>> {
        let many = request.offsets.len();
        let mask = u64::MAX >> (64 - many.clamp(1, 64));
        let mut asked = v2::LineRequest {
            offsets: v2::Offsets::from_slice(request.offsets),
            consumer: Name::from_bytes(CONSUMER.as_bytes()),
            num_lines: many as u32,
            ..Default::default()
        };
        asked.config.flags = flags(request);
        if let Some(bits) = request.values {
            asked.config.add_values(&LineValues { bits, mask });
        }
        if request.setting.debounce_ms > 0 {
            let period_us = request.setting.debounce_ms.saturating_mul(1000);
            asked.config.add_debounce(period_us, mask);
        }
        let file = v2::get_line(&self.0, asked).map_err(system)?;
        Ok(Box::new(KernelLines { file, mask }))
    }
}

fn flags(request: &LineRequest<'_>) -> LineFlags {
    let setting = request.setting;
    let mut flags = match (request.values, setting.drive) {
        (None, _) => LineFlags::INPUT,
        (Some(_), LineDrive::PushPull) => LineFlags::OUTPUT,
        (Some(_), LineDrive::OpenDrain) => LineFlags::OUTPUT | LineFlags::OPEN_DRAIN,
        (Some(_), LineDrive::OpenSource) => LineFlags::OUTPUT | LineFlags::OPEN_SOURCE,
    };
    flags |= match setting.bias {
        Bias::AsIs => LineFlags::empty(),
        Bias::PullUp => LineFlags::BIAS_PULL_UP,
        Bias::PullDown => LineFlags::BIAS_PULL_DOWN,
        Bias::Disabled => LineFlags::BIAS_DISABLED,
    };
    if setting.active_low {
        flags |= LineFlags::ACTIVE_LOW;
    }
    flags
}

impl TakenLines for KernelLines {
    fn get(&self) -> Result<u64, i32> {
        let mut values = LineValues { bits: 0, mask: self.mask };
        v2::get_line_values(&self.file, &mut values).map_err(number)?;
        Ok(values.bits)
    }

    fn set(&self, bits: u64) -> Result<(), i32> {
        v2::set_line_values(&self.file, &LineValues { bits, mask: self.mask }).map_err(number)
    }
}

fn number(error: Error) -> i32 {
    match error {
        Error::Os(errno) => errno.0,
        Error::UnderRead(_) => libc::EIO,
    }
}

fn system(error: Error) -> io::Error {
    io::Error::from_raw_os_error(number(error))
}

fn text(name: &Name) -> String {
    name.as_os_str().to_string_lossy().into_owned()
}
