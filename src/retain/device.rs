//! The device below the slots: bytes that are read, written and made durable.
//!
//! A trait, so that a test can be a disk whose power fails, whose calls fail, and which forgets
//! what it never made durable. `file` has the real one.

use std::io;

/// A block device or a file, as far as slots need it.
pub trait Storage {
    /// Its length in bytes.
    ///
    /// # Errors
    /// The system's.
    fn size(&mut self) -> io::Result<u64>;

    /// Reads from an offset; returns the number of bytes read, which may be fewer than wanted.
    ///
    /// # Errors
    /// The system's.
    fn read_at(&mut self, at: u64, into: &mut [u8]) -> io::Result<usize>;

    /// Writes from an offset; returns the number of bytes written, which may be fewer than given.
    ///
    /// # Errors
    /// The system's.
    fn write_at(&mut self, at: u64, from: &[u8]) -> io::Result<usize>;

    /// Returns once all bytes that were written are durable. After an error the bytes written since
    /// the last success may be lost, even if a later call succeeds.
    ///
    /// # Errors
    /// The system's.
    fn sync(&mut self) -> io::Result<()>;

    /// Makes durable as much as it can, and empties the cache as far as the system permits, so that
    /// reads come from the medium.
    fn settle(&mut self);

    /// Whether its name still leads other processes to this device.
    ///
    /// # Errors
    /// `NotFound`: it is not; else the system's.
    fn in_place(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Closes the device and opens it again, after an error.
    ///
    /// # Errors
    /// The system's.
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

/// Writes all of it.
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
