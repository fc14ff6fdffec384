//! Local devices: lines that the scan thread itself reads and writes, within a time budget.
//!
//! A [`Local`] answers at once (a few system calls that the kernel serves from registers). It is
//! opened by the world and handed in by a ring; when it fails, or takes longer than its budget
//! several times running, the scan lets go of it, and the world opens another. The world keeps a
//! reference of its own, so nothing is closed by the scan thread, and so that outputs can be made
//! safe from outside when a scan never ends.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rtrb::{Consumer, Producer, RingBuffer};

use super::exchange::Snapshot;
use super::image::Safe;
use super::sys::monotonic_ns;
use super::wiring::{Source, Wiring, last_words};
use crate::engine::Cell;

/// The scan lets go of a device when this number of reads running, or of writes, were late.
const LATE_MAX: u32 = 3;
/// Reads and writes are counted apart: the places of their counts.
const READ: usize = 0;
const WRITE: usize = 1;
/// Local devices on their way to the scan, at most.
const HANDED_MAX: usize = 4;

/// Lines that answer at once. Called by the scan thread: it must not allocate, lock or wait.
pub trait Local: Send + Sync {
    /// Reads all inputs, one a point.
    ///
    /// # Errors
    /// The system's error number.
    fn read(&self, inputs: &mut [i32]) -> Result<(), i32>;
    /// Writes all outputs, one a point.
    ///
    /// # Errors
    /// The system's error number.
    fn write(&self, outputs: &[i32]) -> Result<(), i32>;
}

/// Why the scan let go of a local device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalFailure {
    /// A call failed, with this number.
    System(i32),
    /// Exchanges took too long.
    Late {
        /// The time that the last of them took, in microseconds.
        took_us: u32,
    },
}

/// The state that the two ends share.
#[derive(Default)]
struct Word {
    /// 0: in use, or none was given, or it was told; else why it was let go of.
    failure: AtomicU64,
    /// How many exchanges succeeded so far.
    exchanges: AtomicU64,
    /// How long the last one took, ns.
    last_ns: AtomicU64,
    /// The slowest exchange so far, ns.
    slowest_ns: AtomicU64,
}

/// What the scan has exchanged with a local device so far, be it opened anew in between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exchanged {
    /// How many reads and writes succeeded.
    pub count: u64,
    /// How long the last one took, in nanoseconds.
    pub last_ns: u64,
    /// How long the slowest one took, in nanoseconds.
    pub slowest_ns: u64,
}

/// The scan's side.
pub(super) struct LocalSide {
    handed: Consumer<Arc<dyn Local>>,
    returned: Producer<Arc<dyn Local>>,
    device: Option<Arc<dyn Local>>,
    /// As the last good read found them, and what a read fills: a failed one changes nothing.
    inputs: Vec<i32>,
    reading: Vec<i32>,
    outputs: Vec<Source>,
    /// The values that are to go out, and those that went out last.
    values: Vec<i32>,
    written: Vec<i32>,
    is_written: bool,
    budget_ns: u64,
    /// How many reads, and how many writes, were late running. Apart: writes in time do not excuse
    /// reads that are late in every scan.
    late: [u32; 2],
    word: Arc<Word>,
}

/// The world's side.
pub struct LocalEnd {
    handed: Producer<Arc<dyn Local>>,
    returned: Consumer<Arc<dyn Local>>,
    word: Arc<Word>,
    rescue: Rescue,
}

/// Makes a local device's outputs safe from outside the scan thread. Cheap to clone.
#[derive(Clone, Default)]
pub struct Rescue {
    device: Arc<Mutex<Option<Arc<dyn Local>>>>,
    outputs: Arc<[Source]>,
}

pub(super) fn local(wiring: &Wiring, budget_ns: u64) -> (LocalSide, LocalEnd) {
    let (handed_in, handed) = RingBuffer::new(HANDED_MAX);
    let (returned_in, returned) = RingBuffer::new(2 * HANDED_MAX);
    let word = Arc::new(Word::default());
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
    let rescue = Rescue { device: Arc::default(), outputs: wiring.outputs.clone().into() };
    (side, LocalEnd { handed: handed_in, returned, word, rescue })
}

impl LocalEnd {
    /// Hands an opened device in; false where those before it were not taken.
    pub fn hand_in(&mut self, device: Arc<dyn Local>) -> bool {
        while self.returned.pop().is_ok() {}
        if self.handed.is_full() {
            return false;
        }
        self.word.failure.store(0, Ordering::Release);
        *self.rescue.lock() = Some(Arc::clone(&device));
        self.handed.push(device).is_ok()
    }

    /// Why the scan has let go of the device, told once; the device is closed then.
    pub fn failure(&mut self) -> Option<LocalFailure> {
        let failure = LocalFailure::decode(self.word.failure.swap(0, Ordering::AcqRel))?;
        while self.returned.pop().is_ok() {}
        *self.rescue.lock() = None;
        Some(failure)
    }

    /// The outputs' first values: the safe ones.
    pub fn safe_values(&self, image: &Snapshot) -> Vec<i32> {
        let mut values = vec![0; self.rescue.outputs.len()];
        last_words(&self.rescue.outputs, image, &mut values);
        values
    }

    /// Whether anything goes out to it.
    pub fn has_outputs(&self) -> bool {
        !self.rescue.outputs.is_empty()
    }

    /// The exchanges so far.
    pub fn exchanged(&self) -> Exchanged {
        let Word { exchanges, last_ns, slowest_ns, .. } = &*self.word;
        let [count, last_ns, slowest_ns] =
            [exchanges, last_ns, slowest_ns].map(|word| word.load(Ordering::Relaxed));
        Exchanged { count, last_ns, slowest_ns }
    }

    /// The means to make its outputs safe from outside.
    pub fn rescue(&self) -> Rescue {
        self.rescue.clone()
    }
}

impl Rescue {
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Arc<dyn Local>>> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes the safe values; `None` where no device is open.
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
    /// Takes a device that was handed in; true if one was.
    pub fn arrive(&mut self) -> bool {
        let mut any = false;
        while let Ok(device) = self.handed.pop() {
            self.let_go();
            (self.device, self.is_written, self.late) = (Some(device), false, [0; 2]);
            any = true;
        }
        any
    }

    /// Reads the inputs, all or none; false where that fails, or there is no device at present.
    pub fn read(&mut self) -> bool {
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

    /// As the last good read found them.
    pub fn inputs(&self) -> &[i32] {
        &self.inputs
    }

    /// Writes a complete scan's outputs, where they changed.
    pub fn write_image(&mut self, image: (&[u8], &[i32]), first_output: usize) -> bool {
        for (value, source) in self.values.iter_mut().zip(&self.outputs) {
            *value = value_in(*source, image, first_output);
        }
        self.write()
    }

    /// Writes the safe values; those that hold are the image's, or stay as they are.
    pub fn write_safe(
        &mut self,
        safe: &[Safe],
        image: Option<(&[u8], &[i32])>,
        first_output: usize,
    ) -> bool {
        for (at, source) in self.outputs.iter().enumerate() {
            let held = match image {
                Some(image) => value_in(*source, image, first_output),
                None => self.written[at],
            };
            self.values[at] = match *source {
                Source::Output(y) => match safe[y as usize] {
                    Safe::Off => 0,
                    Safe::On => 1,
                    Safe::Hold => held,
                },
                Source::Cell(_, fixed) => fixed.unwrap_or(held),
            };
        }
        // Whatever went wrong: they are written, also where they should be so already.
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

    /// Whether an exchange was good. One that was not loses the device.
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
            // Closing it here would be a system call more; the world has a reference anyway.
            std::mem::forget(kept);
        }
    }
}

fn value_in(source: Source, image: (&[u8], &[i32]), first_output: usize) -> i32 {
    match source {
        Source::Output(y) => i32::from(image.0[first_output + y as usize]),
        Source::Cell(Cell::Bit(cell), _) => i32::from(image.0[cell.0 as usize]),
        Source::Cell(Cell::Word(cell), _) => image.1[cell.0 as usize],
    }
}
