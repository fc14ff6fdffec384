//! Local devices: lines that the scan thread itself reads and writes, within a time budget.
//!
//! A [`Local`] answers at once (a few system calls that the kernel serves from registers). The
//! world opens it and hands it in through a ring. If it fails, or exceeds its budget several times
//! in a row, the scan returns it, and the world opens it again. The world keeps a reference of its
//! own: the scan thread never closes a device, and the world can write safe values if a scan never
//! ends.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use rtrb::{Consumer, Producer, RingBuffer};

use super::exchange::Snapshot;
use super::image::SafeState;
use super::machine::ImageCells;
use super::sys::monotonic_ns;
use super::wiring::{OutputSource, Wiring, last_words};
use rungd_base::locked::locked;

/// The scan returns a device after this number of late reads, or late writes, in a row.
const LATE_MAX: u32 = 3;
/// The places of the counts of late reads and late writes.
const READ: usize = 0;
const WRITE: usize = 1;
/// The greatest number of local devices that wait for the scan.
const HANDED_MAX: usize = 4;

/// Lines that answer at once. The scan thread calls it, so it must not allocate, lock or wait.
pub trait Local: Send + Sync {
    /// Reads all inputs, one value per point.
    ///
    /// # Errors
    /// The system's error number.
    fn read(&self, inputs: &mut [i32]) -> Result<(), i32>;
    /// Writes all outputs, one value per point.
    ///
    /// # Errors
    /// The system's error number.
    fn write(&self, outputs: &[i32]) -> Result<(), i32>;
}

/// Why the scan returned a local device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalFailure {
    /// A system call failed with this error number.
    System(i32),
    /// Exchanges took too long.
    Late {
        /// The time that the last of them took, in microseconds.
        took_us: u32,
    },
}

/// The state that the two ends share.
#[derive(Default)]
struct LocalState {
    /// The encoded reason for the last return of the device, until it is read; else 0.
    failure: AtomicU64,
    /// The number of exchanges that succeeded.
    exchanges: AtomicU64,
    /// The duration of the last one.
    last_ns: AtomicU64,
    /// The duration of the slowest one.
    slowest_ns: AtomicU64,
}

/// The exchanges with a local device since the start, across all its openings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExchangeCounts {
    /// The number of reads and writes that succeeded.
    pub count: u64,
    /// The duration of the last one, in nanoseconds.
    pub last_ns: u64,
    /// The duration of the slowest one, in nanoseconds.
    pub slowest_ns: u64,
}

/// The scan's side.
pub(super) struct LocalSide {
    handed: Consumer<Arc<dyn Local>>,
    returned: Producer<Arc<dyn Local>>,
    device: Option<Arc<dyn Local>>,
    /// The inputs of the last good read, and the buffer that a read fills: a failed read changes no
    /// input.
    inputs: Vec<i32>,
    reading: Vec<i32>,
    outputs: Vec<OutputSource>,
    /// The values to write, and the values that were written last.
    values: Vec<i32>,
    written: Vec<i32>,
    is_written: bool,
    budget_ns: u64,
    /// The numbers of late reads and of late writes in a row. They are counted apart: punctual
    /// writes do not excuse reads that are late in every scan.
    late: [u32; 2],
    word: Arc<LocalState>,
}

/// The world's side.
pub struct LocalEnd {
    handed: Producer<Arc<dyn Local>>,
    returned: Consumer<Arc<dyn Local>>,
    word: Arc<LocalState>,
    rescue: OutputRescue,
}

/// Makes a local device's outputs safe from outside the scan thread. Cheap to clone.
#[derive(Clone, Default)]
pub struct OutputRescue {
    device: Arc<Mutex<Option<Arc<dyn Local>>>>,
    outputs: Arc<[OutputSource]>,
}

pub(super) fn local(wiring: &Wiring, budget_ns: u64) -> (LocalSide, LocalEnd) {
    let (handed_in, handed) = RingBuffer::new(HANDED_MAX);
    let (returned_in, returned) = RingBuffer::new(2 * HANDED_MAX);
    let word = Arc::new(LocalState::default());
    let side = LocalSide {
        handed,
        returned: returned_in,
        device: None,
        inputs: vec![0; wiring.inputs.len()],
        reading: vec![0; wiring.inputs.len()],
        values: vec![0; wiring.outputs.len()],
        written: vec![0; wiring.outputs.len()],
        is_written: false,
        outputs: wiring.outputs.clone(),
        budget_ns,
        late: [0; 2],
        word: Arc::clone(&word),
    };
    let rescue = OutputRescue { device: Arc::default(), outputs: wiring.outputs.clone().into() };
    (side, LocalEnd { handed: handed_in, returned, word, rescue })
}

impl LocalEnd {
    /// Hands in an opened device; false if the scan has not taken the earlier ones yet.
    pub fn hand_in(&mut self, device: Arc<dyn Local>) -> bool {
        while self.returned.pop().is_ok() {}
        if self.handed.is_full() {
            return false;
        }
        self.word.failure.store(0, Ordering::Release);
        *self.rescue.lock() = Some(Arc::clone(&device));
        self.handed.push(device).is_ok()
    }

    /// The reason why the scan has returned the device, once; closes the device.
    pub fn failure(&mut self) -> Option<LocalFailure> {
        let failure = LocalFailure::decode(self.word.failure.swap(0, Ordering::AcqRel))?;
        while self.returned.pop().is_ok() {}
        *self.rescue.lock() = None;
        Some(failure)
    }

    /// The first values of the outputs: the safe values.
    pub fn safe_values(&self, image: &Snapshot) -> Vec<i32> {
        let mut values = vec![0; self.rescue.outputs.len()];
        last_words(&self.rescue.outputs, image, &mut values);
        values
    }

    /// Whether the device has outputs.
    pub fn has_outputs(&self) -> bool {
        !self.rescue.outputs.is_empty()
    }

    /// The exchanges since the start.
    pub fn exchanged(&self) -> ExchangeCounts {
        let LocalState { exchanges, last_ns, slowest_ns, .. } = &*self.word;
        let [count, last_ns, slowest_ns] =
            [exchanges, last_ns, slowest_ns].map(|word| word.load(Ordering::Relaxed));
        ExchangeCounts { count, last_ns, slowest_ns }
    }

    /// A handle that makes its outputs safe from outside the scan thread.
    pub fn rescue(&self) -> OutputRescue {
        self.rescue.clone()
    }
}

impl OutputRescue {
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Arc<dyn Local>>> {
        locked(&self.device)
    }

    /// Writes the safe values; `None` if no device is open.
    pub fn make_safe(&self, image: &Snapshot) -> Option<Result<(), i32>> {
        let device = self.lock().clone()?;
        let mut values = vec![0; self.outputs.len()];
        last_words(&self.outputs, image, &mut values);
        Some(device.write(&values))
    }
}

impl LocalFailure {
    fn encode(self) -> u64 {
        match self {
            LocalFailure::System(errno) => 1 << 32 | u64::from(errno.unsigned_abs()),
            LocalFailure::Late { took_us } => 2 << 32 | u64::from(took_us),
        }
    }

    fn decode(code: u64) -> Option<LocalFailure> {
        match code >> 32 {
            0 => None,
            1 => Some(LocalFailure::System(code as u32 as i32)),
            _ => Some(LocalFailure::Late { took_us: code as u32 }),
        }
    }
}

impl std::fmt::Display for LocalFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            LocalFailure::System(errno) => std::io::Error::from_raw_os_error(*errno).fmt(f),
            LocalFailure::Late { took_us } => {
                write!(f, "an exchange took {took_us} us, longer than its budget")
            }
        }
    }
}

impl LocalSide {
    /// Takes a device that was handed in; returns whether there was one.
    pub(crate) fn arrive(&mut self) -> bool {
        let mut any = false;
        while let Ok(device) = self.handed.pop() {
            self.let_go();
            (self.device, self.is_written, self.late) = (Some(device), false, [0; 2]);
            any = true;
        }
        any
    }

    /// Reads all inputs or none; false if that fails or there is no device.
    pub(crate) fn read(&mut self) -> bool {
        self.arrive();
        let Some(device) = self.device.as_deref() else { return false };
        let begin_ns = monotonic_ns();
        let done = device.read(&mut self.reading);
        let is_good = self.judge(READ, done, begin_ns);
        if is_good {
            self.inputs.copy_from_slice(&self.reading);
        }
        is_good
    }

    /// The inputs of the last good read.
    pub(crate) fn inputs(&self) -> &[i32] {
        &self.inputs
    }

    /// Writes the outputs of a complete scan, if they changed.
    pub(crate) fn write_image(&mut self, image: ImageCells<'_>, first_output: usize) -> bool {
        for (value, source) in self.values.iter_mut().zip(&self.outputs) {
            *value = value_in(*source, image, first_output);
        }
        self.write()
    }

    /// Writes the safe values. Outputs with `hold` get the image's value, or stay as they are
    /// without an image.
    pub(crate) fn write_safe(
        &mut self,
        safe: &[SafeState],
        image: Option<ImageCells<'_>>,
        first_output: usize,
    ) -> bool {
        for (at, source) in self.outputs.iter().enumerate() {
            let held = match image {
                Some(image) => value_in(*source, image, first_output),
                None => self.written[at],
            };
            self.values[at] = match *source {
                OutputSource::Output(y) => safe[y as usize].driven(held != 0).into(),
                OutputSource::Cell(_, fixed) => fixed.unwrap_or(held),
            };
        }
        // Safe values are written even if they equal the values that were written last.
        self.is_written = false;
        self.write()
    }

    fn write(&mut self) -> bool {
        let Some(device) = self.device.as_deref() else { return self.outputs.is_empty() };
        if self.outputs.is_empty() || (self.is_written && self.values == self.written) {
            return true;
        }
        let begin_ns = monotonic_ns();
        let done = device.write(&self.values);
        if self.judge(WRITE, done, begin_ns) {
            self.written.copy_from_slice(&self.values);
            self.is_written = true;
            return true;
        }
        false
    }

    /// Whether an exchange was good. After a bad one the device is returned to the world.
    fn judge(&mut self, what: usize, done: Result<(), i32>, begin_ns: u64) -> bool {
        let took_ns = monotonic_ns().saturating_sub(begin_ns);
        self.word.slowest_ns.fetch_max(took_ns, Ordering::Relaxed);
        self.late[what] = if took_ns > self.budget_ns { self.late[what] + 1 } else { 0 };
        let failure = match done {
            Err(errno) => LocalFailure::System(errno),
            Ok(()) if self.late[what] >= LATE_MAX => {
                LocalFailure::Late { took_us: u32::try_from(took_ns / 1000).unwrap_or(u32::MAX) }
            }
            Ok(()) => {
                self.word.last_ns.store(took_ns, Ordering::Relaxed);
                self.word.exchanges.fetch_add(1, Ordering::Relaxed);
                return true;
            }
        };
        self.let_go();
        self.word.failure.store(failure.encode(), Ordering::Release);
        false
    }

    fn let_go(&mut self) {
        let Some(device) = self.device.take() else { return };
        if let Err(rtrb::PushError::Full(kept)) = self.returned.push(device) {
            // Dropping it here could close it, which is a system call. The world has a reference.
            std::mem::forget(kept);
        }
    }
}

fn value_in(source: OutputSource, image: ImageCells<'_>, first_output: usize) -> i32 {
    match source {
        OutputSource::Output(y) => i32::from(image.bits[first_output + y as usize]),
        OutputSource::Cell(cell, _) => image.value(cell),
    }
}
