//! Images on a device: finds them at the start, and writes them to the slots in turn.
//!
//! Called by `keeper` and `show`, and by tests with simulated disks. The last image that was
//! reported as durable is never overwritten.
//!
//! After a failed sync, a later success proves nothing. Linux drops the pages that it could not
//! write and marks them clean, so the next sync succeeds although the data is not on the disk.
//! Therefore, after an error, the bytes in that slot count as lost, the device is opened again, and
//! the whole image is written to a different slot.

use std::io;

use super::device::{Storage, read_all, write_all};
use super::format::{
    BLOCK_BYTES, BadHeader, BadSlot, Geometry, HEADER_COPIES, ImageStamp, header, put_slot,
    read_header, read_slot, slot_bytes,
};

const NOT_OURS: &str = "it is not what was written there";

/// A device with slots.
pub struct Slots<D> {
    device: D,
    geometry: Geometry,
    /// The sequence number of each slot's image; 0 for a slot without a whole image.
    held: Vec<u64>,
    /// The slot of the durable image, which is not overwritten.
    durable: Option<usize>,
    /// The last sequence number that was used.
    sequence: u64,
    /// A call failed: the device must be reopened before its next use.
    doubted: bool,
    buffer: Vec<u8>,
}

/// An image found on the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundImage {
    /// Its slot.
    pub slot: usize,
    /// Its numbers.
    pub stamp: ImageStamp,
    /// Its content.
    pub content: Vec<u8>,
}

/// The state of all slots.
#[derive(Clone, Debug)]
pub struct SlotSurvey {
    /// The division of the file into slots.
    pub geometry: Geometry,
    /// Whether the device has its full length.
    pub whole: bool,
    /// The stamp of each slot's image, or the reason why the slot has none.
    pub slots: Vec<Result<ImageStamp, BadSlot>>,
    /// The newest image.
    pub newest: Option<FoundImage>,
}

/// Why a device is unusable.
#[derive(Debug)]
pub enum UnusableReason {
    /// Its header is not the header of a retentive memory file.
    Header(BadHeader),
    /// It cannot be read.
    Io(io::Error),
}

impl<D: Storage> Slots<D> {
    /// Formats a device: writes every byte, so that no later write needs more disk space.
    ///
    /// # Errors
    /// The error of the device.
    pub fn format(mut device: D, geometry: Geometry) -> io::Result<Slots<D>> {
        let zeros = vec![0; geometry.slot_bytes as usize];
        for slot in 0..geometry.slots as usize {
            write_all(&mut device, geometry.slot_at(slot), &zeros)?;
        }
        device.sync()?;
        for copy in 0..HEADER_COPIES {
            write_all(&mut device, (copy * BLOCK_BYTES) as u64, &header(&geometry))?;
        }
        device.sync()?;
        Ok(Slots::new(device, geometry))
    }

    fn new(device: D, geometry: Geometry) -> Slots<D> {
        Slots {
            device,
            held: vec![0; geometry.slots as usize],
            geometry,
            durable: None,
            sequence: 0,
            doubted: false,
            buffer: Vec::new(),
        }
    }

    /// Opens a device and reads all its slots.
    ///
    /// # Errors
    /// [`UnusableReason`]; nothing was written.
    pub fn open(mut device: D) -> Result<(Slots<D>, SlotSurvey), UnusableReason> {
        device.settle();
        let survey = survey(&mut device)?;
        let mut slots = Slots::new(device, survey.geometry);
        for (held, found) in slots.held.iter_mut().zip(&survey.slots) {
            *held = found.map_or(0, |stamp| stamp.sequence);
        }
        slots.sequence = slots.held.iter().copied().max().unwrap_or(0);
        slots.durable = survey.newest.as_ref().map(|newest| newest.slot);
        Ok((slots, survey))
    }

    /// The division of the device into slots.
    pub(crate) fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Whether a further image with a content of this length can be saved here.
    pub(crate) fn takes(&self, content_bytes: usize) -> bool {
        self.geometry.fits(content_bytes) && self.sequence < u64::MAX
    }

    /// The device.
    pub fn device(&self) -> &D {
        &self.device
    }

    /// The device, for a rename.
    pub(crate) fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// Makes the next image get the number after `sequence`.
    pub(crate) fn continue_from(&mut self, sequence: u64) {
        self.sequence = self.sequence.max(sequence);
    }

    /// Writes an image, and sets its sequence number. Returns after the image is durable, with the
    /// number of bytes written.
    ///
    /// # Errors
    /// The error of the device, or the content is longer than a slot. The previous image stays
    /// durable.
    pub fn save(&mut self, stamp: ImageStamp, content: &[u8]) -> io::Result<(ImageStamp, usize)> {
        if !self.geometry.fits(content.len()) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "longer than a slot"));
        }
        if self.doubted {
            self.open_anew()?;
        } else if !self.has_own_header()? {
            // The file was emptied or overwritten: the next start would not find the image.
            return Err(io::Error::new(io::ErrorKind::NotFound, NOT_OURS));
        }
        let slot = self.next_slot();
        // The keeper makes a new file before this happens.
        let used_up = || io::Error::new(io::ErrorKind::InvalidData, "its numbers are used up");
        self.sequence = self.sequence.checked_add(1).ok_or_else(used_up)?;
        let stamp = ImageStamp { sequence: self.sequence, ..stamp };
        put_slot(&mut self.buffer, self.geometry.id, &stamp, content);
        self.held[slot] = 0;
        let at = self.geometry.slot_at(slot);
        let written = write_all(&mut self.device, at, &self.buffer);
        if let Err(error) = written.and_then(|()| self.device.sync()) {
            self.doubted = true;
            return Err(error);
        }
        self.held[slot] = stamp.sequence;
        self.durable = Some(slot);
        Ok((stamp, self.buffer.len()))
    }

    /// Whether the file at the path still holds a written image: the file has its full length, and
    /// the slot reads back.
    ///
    /// # Errors
    /// `NotFound` if the path has a different file or none, or if the file is too short; else the
    /// error of the device.
    pub fn has(&mut self, stamp: &ImageStamp, content: &[u8]) -> io::Result<bool> {
        let read = self.read_back(stamp, content);
        self.doubted |= read.is_err();
        read
    }

    fn read_back(&mut self, stamp: &ImageStamp, content: &[u8]) -> io::Result<bool> {
        self.device.in_place()?;
        let whole = self.device.size()? >= self.geometry.file_bytes();
        if !whole || !self.has_own_header()? {
            return Err(io::Error::new(io::ErrorKind::NotFound, NOT_OURS));
        }
        let Some(slot) = self.durable else { return Ok(false) };
        self.buffer.resize(slot_bytes(content.len()), 0);
        let at = self.geometry.slot_at(slot);
        let count = read_all(&mut self.device, at, &mut self.buffer)?;
        Ok(read_slot(&self.buffer[..count], self.geometry.id) == Ok((*stamp, content)))
    }

    /// Whether a write failed. After that, it is unknown which image a start would find.
    pub fn is_doubted(&self) -> bool {
        self.doubted
    }

    /// The newest image on the device.
    ///
    /// # Errors
    /// The error of the device; `NotFound` if the path has a different file or none.
    pub(crate) fn newest(&mut self) -> io::Result<Option<FoundImage>> {
        self.device.in_place()?;
        match survey(&mut self.device) {
            Ok(survey) => Ok(survey.newest),
            Err(UnusableReason::Io(error)) => Err(error),
            Err(UnusableReason::Header(_)) => {
                Err(io::Error::new(io::ErrorKind::NotFound, NOT_OURS))
            }
        }
    }

    /// The slot to write next: a slot without an image, else the slot with the oldest image.
    fn next_slot(&self) -> usize {
        let slots = (0..self.held.len()).filter(|slot| Some(*slot) != self.durable);
        slots.min_by_key(|slot| self.held[*slot]).unwrap_or(0)
    }

    fn open_anew(&mut self) -> io::Result<()> {
        self.device.reopen()?;
        if !self.has_own_header()? {
            let message = "a different file has its name now";
            return Err(io::Error::new(io::ErrorKind::NotFound, message));
        }
        self.doubted = false;
        Ok(())
    }

    /// Whether the file still has the header with which it was opened.
    fn has_own_header(&mut self) -> io::Result<bool> {
        match read_geometry(&mut self.device) {
            Ok(geometry) => Ok(geometry == self.geometry),
            Err(UnusableReason::Header(_)) => Ok(false),
            Err(UnusableReason::Io(error)) => Err(error),
        }
    }
}

/// Reads all slots of a device, and writes nothing.
///
/// # Errors
/// [`UnusableReason`].
pub fn survey<D: Storage>(device: &mut D) -> Result<SlotSurvey, UnusableReason> {
    let geometry = read_geometry(device)?;
    let size = device.size().map_err(UnusableReason::Io)?;
    let mut survey =
        SlotSurvey { geometry, whole: size >= geometry.file_bytes(), slots: vec![], newest: None };
    let mut bytes = vec![0; geometry.slot_bytes as usize];
    for slot in 0..geometry.slots as usize {
        let count = read_all(device, geometry.slot_at(slot), &mut bytes);
        let image = match &count {
            Ok(count) => read_slot(&bytes[..*count], geometry.id),
            Err(_) => Err(BadSlot::Unreadable),
        };
        survey.slots.push(image.map(|(stamp, _)| stamp));
        let newest = survey.newest.as_ref().map_or(0, |newest| newest.stamp.sequence);
        if let Ok((stamp, content)) = image
            && stamp.sequence > newest
        {
            survey.newest = Some(FoundImage { slot, stamp, content: content.to_vec() });
        }
    }
    Ok(survey)
}

fn read_geometry<D: Storage>(device: &mut D) -> Result<Geometry, UnusableReason> {
    let mut blocks = [0; HEADER_COPIES * BLOCK_BYTES];
    let count = match read_all(device, 0, &mut blocks) {
        Ok(count) => count,
        // One copy may be in a sector that cannot be read.
        Err(first) => {
            let (_, second) = blocks.split_at_mut(BLOCK_BYTES);
            let count = read_all(device, BLOCK_BYTES as u64, second);
            let count = count.map_err(|_| UnusableReason::Io(first))?;
            BLOCK_BYTES + count
        }
    };
    read_header(&blocks[..count]).map_err(UnusableReason::Header)
}
