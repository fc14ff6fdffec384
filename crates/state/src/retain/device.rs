//! The device below the slots: reads and writes bytes, and makes them durable.
//!
//! It is a trait, so that a test can simulate a disk whose power fails, whose calls fail, and which
//! loses bytes that were not made durable. `file` implements it for a real file.

use std::io;

/// The operations of a block device or a file that the slots need.
pub trait Storage {
    /// Its length in bytes.
    ///
    /// # Errors
    /// The error of the system.
    fn size(&mut self) -> io::Result<u64>;

    /// Reads from an offset; returns the number of bytes read, which may be fewer than requested.
    ///
    /// # Errors
    /// The error of the system.
    fn read_at(&mut self, at: u64, into: &mut [u8]) -> io::Result<usize>;

    /// Writes from an offset; returns the number of bytes written, which may be fewer than passed.
    ///
    /// # Errors
    /// The error of the system.
    fn write_at(&mut self, at: u64, from: &[u8]) -> io::Result<usize>;

    /// Returns after all written bytes are durable. After an error, the bytes written since the
    /// last success may be lost, even if a later call succeeds.
    ///
    /// # Errors
    /// The error of the system.
    fn sync(&mut self) -> io::Result<()>;

    /// Makes as much durable as possible, and empties the cache as far as the system permits, so
    /// that later reads return the bytes on the medium.
    fn settle(&mut self);

    /// Checks that a process that opens the name of this device still gets this device.
    ///
    /// # Errors
    /// `NotFound` if it does not; else the error of the system.
    fn in_place(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Closes the device and opens it again, after an error.
    ///
    /// # Errors
    /// The error of the system.
    fn reopen(&mut self) -> io::Result<()>;
}

/// Reads until the buffer is full or the end is reached; returns the number of bytes read.
pub(super) fn read_all<D: Storage>(device: &mut D, at: u64, into: &mut [u8]) -> io::Result<usize> {
    let mut done = 0;
    while done < into.len() {
        match device.read_at(at + done as u64, &mut into[done..]) {
            Ok(0) => break,
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(done)
}

/// Writes all bytes of `from`.
pub(super) fn write_all<D: Storage>(device: &mut D, at: u64, from: &[u8]) -> io::Result<()> {
    let mut done = 0;
    while done < from.len() {
        match device.write_at(at + done as u64, &from[done..]) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
