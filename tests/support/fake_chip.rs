//! A chip of lines in memory, for tests that count allocations.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rungd_io::gpio::settings::ChipId as ChipName;
use rungd_io::gpio::{ChipSource, GpioChip, LineFacts, LineRequest, TakenLines};

/// A chip with its state in two atomics. While `is_gone` is set, its lines give an error.
#[derive(Clone, Default)]
pub struct FakeChip {
    pub levels: Arc<AtomicU64>,
    pub is_gone: Arc<AtomicBool>,
}

impl ChipSource for FakeChip {
    fn open(&self, _: &ChipName) -> std::io::Result<Box<dyn GpioChip>> {
        Ok(Box::new(self.clone()))
    }
}

impl GpioChip for FakeChip {
    fn lines(&self) -> std::io::Result<u32> {
        Ok(512)
    }

    fn line(&self, _: u32) -> std::io::Result<LineFacts> {
        Ok(LineFacts::default())
    }

    fn request(&self, _: &LineRequest<'_>) -> std::io::Result<Box<dyn TakenLines>> {
        Ok(Box::new(self.clone()))
    }
}

impl TakenLines for FakeChip {
    fn get(&self) -> Result<u64, i32> {
        if self.is_gone.load(Ordering::Relaxed) {
            return Err(19);
        }
        Ok(self.levels.fetch_add(0x1234_5678_9abc_def1, Ordering::Relaxed))
    }

    fn set(&self, _: u64) -> Result<(), i32> {
        if self.is_gone.load(Ordering::Relaxed) { Err(19) } else { Ok(()) }
    }
}
