//! The latest image of a device: written whole by one thread, read whole by another, never waiting.
//!
//! Three buffers: one is the writer's, one the reader's, and the third lies between them. Who has
//! finished writing, or wants to see what is new, exchanges its own for that one, by one atomic
//! swap; so each buffer belongs to one side at any time, and what is not read in time is written
//! over by what is newer. The values are atomics for the compiler's sake alone. Nothing is
//! allocated after the start.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU8, Ordering};

/// Beside the number of the buffer in between: it is newer than the reader's.
const NEW: u8 = 4;
const NUMBER: u8 = 3;

struct Buffers {
    values: [Box<[AtomicI32]>; 3],
    between: AtomicU8,
}

/// The writing side.
pub(super) struct Writer {
    buffers: Arc<Buffers>,
    own: u8,
}

/// The reading side.
pub(super) struct Reader {
    buffers: Arc<Buffers>,
    own: u8,
}

/// Both sides of an image of so many values, all 0.
pub(super) fn latest(count: usize) -> (Writer, Reader) {
    let zeros = || (0..count).map(|_| AtomicI32::new(0)).collect();
    let buffers = Arc::new(Buffers { values: [zeros(), zeros(), zeros()], between: 1.into() });
    (Writer { buffers: Arc::clone(&buffers), own: 0 }, Reader { buffers, own: 2 })
}

impl Writer {
    /// Makes these the latest values, whole.
    pub fn write(&mut self, values: impl Iterator<Item = i32>) {
        for (cell, value) in self.buffers.values[self.own as usize].iter().zip(values) {
            cell.store(value, Ordering::Relaxed);
        }
        let before = self.buffers.between.swap(self.own | NEW, Ordering::AcqRel);
        self.own = before & NUMBER;
    }
}

impl Reader {
    /// Takes what was written since, if anything was.
    pub fn refresh(&mut self) {
        if self.buffers.between.load(Ordering::Relaxed) & NEW != 0 {
            let before = self.buffers.between.swap(self.own, Ordering::AcqRel);
            self.own = before & NUMBER;
        }
    }

    /// The values as they were taken last.
    pub fn values(&self) -> impl Iterator<Item = i32> + '_ {
        self.buffers.values[self.own as usize].iter().map(|cell| cell.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reader_sees_the_newest_and_keeps_it() {
        let (mut writer, mut reader) = latest(2);
        let seen = |reader: &mut Reader| {
            reader.refresh();
            reader.values().collect::<Vec<_>>()
        };
        assert_eq!(seen(&mut reader), [0, 0]);
        writer.write([1, -1].into_iter());
        assert_eq!(seen(&mut reader), [1, -1]);
        assert_eq!(seen(&mut reader), [1, -1]);
        for n in 2..10 {
            writer.write([n, -n].into_iter());
        }
        assert_eq!(seen(&mut reader), [9, -9]);
        writer.write([10, -10].into_iter());
        assert_eq!(reader.values().collect::<Vec<_>>(), [9, -9], "until it asks");
    }
}
