//! The latest image of a device's inputs: one thread writes it as a whole, a second thread reads it
//! as a whole, and neither waits.
//!
//! Three buffers: one belongs to the writer, one to the reader, and the third is between them. A
//! writer that has finished exchanges its own buffer for the third by one atomic swap; so does a
//! reader that requests the newest image. So each buffer belongs to one side at any time, and an
//! image that is not read in time is overwritten by a newer one. The values in the buffers are
//! atomics only because safe Rust requires it. Nothing is allocated after the start.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU8, AtomicU64, Ordering};

/// An input as it was read last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LatestInput {
    /// Its value.
    pub value: i32,
    /// The time at which it was read (CLOCK_MONOTONIC); 0: never.
    pub read_ns: u64,
}

/// A flag beside the number of the third buffer: the buffer is newer than the reader's.
const NEW: u8 = 4;
const NUMBER: u8 = 3;

#[derive(Default)]
struct InputSlot {
    value: AtomicI32,
    read_ns: AtomicU64,
}

struct InputBuffers {
    inputs: [Box<[InputSlot]>; 3],
    between: AtomicU8,
}

/// The writing side.
pub(super) struct InputWriter {
    buffers: Arc<InputBuffers>,
    own: u8,
}

/// The reading side.
pub(super) struct InputReader {
    buffers: Arc<InputBuffers>,
    own: u8,
}

/// Both sides of an image of `count` inputs, none of them read yet.
pub(super) fn latest(count: usize) -> (InputWriter, InputReader) {
    let unread = || (0..count).map(|_| InputSlot::default()).collect();
    let buffers =
        Arc::new(InputBuffers { inputs: [unread(), unread(), unread()], between: 1.into() });
    (InputWriter { buffers: Arc::clone(&buffers), own: 0 }, InputReader { buffers, own: 2 })
}

impl InputWriter {
    /// Publishes these inputs as the latest ones, as a whole.
    pub fn write(&mut self, inputs: &[LatestInput]) {
        for (slot, input) in self.buffers.inputs[self.own as usize].iter().zip(inputs) {
            slot.value.store(input.value, Ordering::Relaxed);
            slot.read_ns.store(input.read_ns, Ordering::Relaxed);
        }
        let before = self.buffers.between.swap(self.own | NEW, Ordering::AcqRel);
        self.own = before & NUMBER;
    }
}

impl InputReader {
    /// Takes the newest image, if one was written since the last call.
    pub fn refresh(&mut self) {
        if self.buffers.between.load(Ordering::Relaxed) & NEW != 0 {
            let before = self.buffers.between.swap(self.own, Ordering::AcqRel);
            self.own = before & NUMBER;
        }
    }

    /// The inputs of the image that was taken last.
    pub fn inputs(&self) -> impl Iterator<Item = LatestInput> + '_ {
        self.buffers.inputs[self.own as usize].iter().map(|slot| LatestInput {
            value: slot.value.load(Ordering::Relaxed),
            read_ns: slot.read_ns.load(Ordering::Relaxed),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reader_sees_and_keeps_the_newest_image() {
        let (mut writer, mut reader) = latest(2);
        let image =
            |n: i32| [n, -n].map(|value| LatestInput { value, read_ns: n.unsigned_abs().into() });
        let seen = |reader: &mut InputReader| {
            reader.refresh();
            reader.inputs().collect::<Vec<_>>()
        };
        assert_eq!(seen(&mut reader), image(0));
        writer.write(&image(1));
        assert_eq!(seen(&mut reader), image(1));
        assert_eq!(seen(&mut reader), image(1));
        for n in 2..10 {
            writer.write(&image(n));
        }
        assert_eq!(seen(&mut reader), image(9));
        writer.write(&image(10));
        assert_eq!(reader.inputs().collect::<Vec<_>>(), image(9), "until it asks");
    }
}
