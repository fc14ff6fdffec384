//! The keeper: reads the file at the start, and writes images while the controller runs.
//!
//! The daemon's thread of retentive memory owns the keeper, and passes it images and the time. The
//! keeper never writes over an unusable file: it renames the file, or leaves it alone. After a
//! failure the next save opens the file again, or makes a new file if it is gone.

use std::io;
use std::path::{Path, PathBuf};

use super::content;
use super::file::{Access, FileDevice, FileMetadata, keep_aside, rename_aside};
use super::format::{BadSlot, FLAG_FINAL, Geometry, ImageStamp};
use super::plan::{Restoration, RetainPlan};
use super::slots::{FoundImage, SlotSurvey, Slots, UnusableReason, survey};

/// Keeps one controller's memory in one file.
pub struct Keeper {
    path: PathBuf,
    plan: RetainPlan,
    slots: Option<Slots<FileDevice>>,
    gathered: Vec<u8>,
    /// The numbers of the durable image.
    kept: Option<StoredImage>,
    kept_content: Vec<u8>,
    /// The file's metadata at the last check that the file holds that image.
    trace: Option<FileMetadata>,
    /// The error, if a different process owns the file.
    busy: Option<io::Error>,
}

/// An image that is durable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredImage {
    /// Its numbers.
    pub stamp: ImageStamp,
    /// The number of bytes written for it.
    pub bytes: usize,
}

/// The result of the start.
pub struct StartResult {
    /// The image and its restoration, or the reason why there is none.
    pub image: Result<(ImageStamp, Restoration), String>,
    /// Further news for the log.
    pub news: Vec<FileNews>,
}

/// News of the file for the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileNews {
    /// A slot that should hold an image does not.
    Slot(usize, BadSlot),
    /// The file at the path was unusable; it was renamed to this path.
    Aside(PathBuf),
    /// A new file was made, of this size.
    Made(Geometry),
    /// The file cannot be written.
    NotWritable(String),
}

/// The image of one scan, to be saved.
#[derive(Clone, Copy, Debug)]
pub struct ScanImage<'a> {
    /// The number of complete scans of the process.
    pub scan: u64,
    /// All public bits.
    pub bits: &'a [u8],
    /// All public words.
    pub words: &'a [i32],
    /// Whether the termination passes have run.
    pub is_final: bool,
    /// The time of day, ms since 1970.
    pub now_ms: u64,
    /// The time of the scan, ms since 1970.
    pub scanned_ms: u64,
}

/// A file that the keeper is to make.
#[derive(Clone, Copy)]
struct NewFile<'a> {
    id: u64,
    /// The image that the file begins with.
    first: Option<&'a FoundImage>,
    /// Whether it replaces a file that this process owns.
    replaces: bool,
}

impl NewFile<'_> {
    /// A file without an image, at a path that has no file.
    fn empty(id: u64) -> Self {
        NewFile { id, first: None, replaces: false }
    }
}

impl Keeper {
    /// Opens the file and reads its newest image; makes a new file if the file is unusable. If that
    /// fails, every save tries again.
    ///
    /// # Errors
    /// A different process owns the file.
    pub fn open(path: &Path, plan: RetainPlan, id: u64) -> io::Result<(Keeper, StartResult)> {
        let mut keeper = Keeper {
            path: path.to_owned(),
            plan,
            slots: None,
            gathered: Vec::new(),
            kept: None,
            kept_content: Vec::new(),
            trace: None,
            busy: None,
        };
        let mut news = Vec::new();
        let image = match FileDevice::open(path, Access::Own) {
            Err(busy) if busy.kind() == io::ErrorKind::ResourceBusy => return Err(busy),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                keeper.make(NewFile::empty(id), &mut news);
                Err("there is no file yet".to_owned())
            }
            Err(error) => {
                news.push(FileNews::NotWritable(error.to_string()));
                keeper.read_only(&mut news)
            }
            Ok(device) => keeper.take_over(device, id, &mut news),
        };
        match keeper.busy.take() {
            Some(busy) => Err(busy),
            None => Ok((keeper, StartResult { image, news })),
        }
    }

    /// The plan of the elements that are retained.
    pub fn plan(&self) -> &RetainPlan {
        &self.plan
    }

    /// Sets the plan of a new program. The next save makes a longer file if needed.
    pub fn set_plan(&mut self, plan: RetainPlan) {
        self.plan = plan;
    }

    /// The last durable image of this process.
    pub fn kept(&self) -> Option<StoredImage> {
        self.kept
    }

    fn take_over(
        &mut self,
        device: FileDevice,
        id: u64,
        news: &mut Vec<FileNews>,
    ) -> Result<(ImageStamp, Restoration), String> {
        let seen = device.identity();
        let (slots, survey) = match Slots::open(device) {
            Ok(opened) => opened,
            Err(UnusableReason::Io(error)) => {
                news.push(FileNews::NotWritable(error.to_string()));
                return Err(format!("it cannot be read: {error}"));
            }
            Err(UnusableReason::Header(bad)) => {
                let aside = seen.and_then(|seen| keep_aside(&self.path, seen));
                self.put_aside(id, aside, news);
                return Err(bad.to_string());
            }
        };
        let image = self.judge(&survey, news);
        if image.is_err() && survey.newest.is_some() {
            let aside = rename_aside(&self.path);
            drop(slots);
            self.put_aside(id, aside, news);
            return image;
        }
        if survey.whole && slots.geometry().fits(self.plan.content_bytes()) {
            self.slots = Some(slots);
            return image;
        }
        // Longer slots are needed, or the file was shortened: a new file gets the image. This
        // process owns the old file until the new one is in place.
        let new = NewFile { id, first: survey.newest.as_ref(), replaces: true };
        self.make(new, news);
        // If no new file could be made, the old file stays in use, with its lock.
        self.slots.get_or_insert(slots);
        image
    }

    /// The newest image of a survey and its restoration; damaged slots become news.
    fn judge(
        &self,
        survey: &SlotSurvey,
        news: &mut Vec<FileNews>,
    ) -> Result<(ImageStamp, Restoration), String> {
        for (at, slot) in survey.slots.iter().enumerate() {
            if let Err(bad) = slot
                && *bad != BadSlot::Empty
            {
                news.push(FileNews::Slot(at, *bad));
            }
        }
        let newest = survey.newest.as_ref().ok_or("no slot of it holds a whole image")?;
        let content = content::read(&newest.content)
            .ok_or("its newest image is whole, but its content is invalid")?;
        let is_final = newest.stamp.flags & FLAG_FINAL != 0;
        Ok((newest.stamp, self.plan.restore(&content, is_final)))
    }

    /// Restores from a file that can be read but not written.
    fn read_only(&mut self, news: &mut Vec<FileNews>) -> Result<(ImageStamp, Restoration), String> {
        let opened = FileDevice::open(&self.path, Access::Read);
        let mut device = opened.map_err(|error| format!("it cannot be opened: {error}"))?;
        match survey(&mut device) {
            Ok(survey) => self.judge(&survey, news),
            Err(UnusableReason::Header(bad)) => Err(bad.to_string()),
            Err(UnusableReason::Io(error)) => Err(format!("it cannot be read: {error}")),
        }
    }

    fn put_aside(&mut self, id: u64, aside: io::Result<PathBuf>, news: &mut Vec<FileNews>) {
        match aside {
            Ok(aside) => {
                news.push(FileNews::Aside(aside));
                self.make(NewFile::empty(id), news);
            }
            Err(error) if error.kind() == io::ErrorKind::ResourceBusy => self.busy = Some(error),
            // A different process has renamed the file since it was opened.
            Err(error) if error.kind() == io::ErrorKind::NotFound => self.busy = Some(error),
            Err(error) => {
                news.push(FileNews::NotWritable(format!("it cannot be renamed: {error}")));
            }
        }
    }

    /// Makes a file and keeps it open; a failure becomes news.
    fn make(&mut self, new: NewFile<'_>, news: &mut Vec<FileNews>) {
        match self.try_make(new) {
            Ok(slots) => {
                news.push(FileNews::Made(*slots.geometry()));
                self.slots = Some(slots);
            }
            Err(error) if error.kind() == io::ErrorKind::ResourceBusy => self.busy = Some(error),
            Err(error) => {
                news.push(FileNews::NotWritable(format!("a new file cannot be made: {error}")));
            }
        }
    }

    /// Makes a file under a temporary name, and renames it when all of it is durable.
    fn try_make(&self, new: NewFile<'_>) -> io::Result<Slots<FileDevice>> {
        let NewFile { id, first, replaces } = new;
        let longest = first.map_or(0, |first| first.content.len()).max(self.plan.content_bytes());
        let device = FileDevice::create_beside(&self.path)?;
        let made = Slots::format(device, Geometry::for_content(longest, id));
        let whole = made.and_then(|mut slots| {
            if let Some(first) = first {
                // The image keeps its number. After the last number, a new file begins at 1.
                if first.stamp.sequence < u64::MAX {
                    slots.continue_from(first.stamp.sequence - 1);
                }
                slots.save(first.stamp, &first.content)?;
            }
            slots.device_mut().put_in_place(&self.path, replaces)?;
            Ok(slots)
        });
        if whole.is_err() {
            // On a full disk, a partial file would take the space that the next try needs.
            FileDevice::discard_beside(&self.path);
        }
        whole
    }

    /// Whether a different process has changed the file since the last check. Compares metadata.
    /// Called while the image does not change.
    pub fn is_disturbed(&self) -> bool {
        self.kept.is_some() && self.trace_now() != self.trace
    }

    fn trace_now(&self) -> Option<FileMetadata> {
        self.slots.as_ref().and_then(|slots| slots.device().trace())
    }

    /// Writes an image, unless the file already holds the same content, of a scan that is near
    /// enough for `$DownSeconds`. Returns after the image is
    /// durable; `None` if it was durable before.
    ///
    /// # Errors
    /// The error of the system. The previous image stays durable, except after `NotFound`: then the
    /// file is gone, or its bytes were changed. The next save repairs the file, and may be called
    /// at once.
    pub fn save(&mut self, image: ScanImage<'_>) -> io::Result<Option<StoredImage>> {
        self.plan.gather(image.bits, image.words, &mut self.gathered);
        let flags = if image.is_final { FLAG_FINAL } else { 0 };
        let is_current = |kept: StoredImage| {
            let age_ms = image.scanned_ms.saturating_sub(kept.stamp.scanned_ms);
            kept.stamp.flags == flags && !self.plan.outdates(age_ms, image.is_final)
        };
        if self.kept.is_some_and(is_current)
            && self.kept_content == self.gathered
            && self.is_there()?
        {
            return Ok(None);
        }
        let stamp = ImageStamp {
            sequence: 0,
            scan: image.scan,
            saved_ms: image.now_ms,
            flags,
            scanned_ms: image.scanned_ms,
        };
        let mut slots = match self.slots.take() {
            Some(slots) if slots.takes(self.gathered.len()) => slots,
            Some(slots) => self.grow(slots, image.now_ms)?,
            None => self.attach(image.now_ms)?,
        };
        match slots.save(stamp, &self.gathered) {
            Ok((stamp, bytes)) => {
                self.slots = Some(slots);
                self.kept = Some(StoredImage { stamp, bytes });
                self.kept_content.clone_from(&self.gathered);
                self.trace = self.trace_now();
                Ok(self.kept)
            }
            Err(error) => {
                // After `NotFound`, the next save opens the path again. After other errors, the
                // slots reopen their file.
                if error.kind() != io::ErrorKind::NotFound {
                    self.slots = Some(slots);
                }
                Err(error)
            }
        }
    }

    /// Whether the kept image is still in the file. If it is not, this clears `kept`.
    fn is_there(&mut self) -> io::Result<bool> {
        let Some((kept, slots)) = self.kept.zip(self.slots.as_mut()) else { return Ok(false) };
        if slots.is_doubted() {
            return Ok(false);
        }
        let looked = slots.has(&kept.stamp, &self.kept_content);
        match &looked {
            Ok(true) => {
                self.trace = self.trace_now();
                return looked;
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => self.slots = None,
            _ => {}
        }
        self.kept = None;
        let other = || io::Error::new(io::ErrorKind::NotFound, "its last image is not there");
        looked.and(Err(other()))
    }

    /// Makes a new file in place of a file that is too short or has used up its sequence numbers.
    /// This process owns the old file until the new file is complete.
    fn grow(&mut self, mut slots: Slots<FileDevice>, id: u64) -> io::Result<Slots<FileDevice>> {
        let newest = slots.newest();
        let made = newest.and_then(|newest| {
            self.try_make(NewFile { id, first: newest.as_ref(), replaces: true })
        });
        if let Err(error) = &made
            && error.kind() != io::ErrorKind::NotFound
        {
            self.slots = Some(slots);
        }
        made
    }

    /// Opens the file at the path if it is usable; makes one if there is none.
    fn attach(&mut self, id: u64) -> io::Result<Slots<FileDevice>> {
        let device = match FileDevice::open(&self.path, Access::Own) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return self.try_make(NewFile::empty(id));
            }
            other => other?,
        };
        let seen = device.identity()?;
        match Slots::open(device) {
            Ok((slots, survey)) if survey.whole && slots.takes(self.plan.content_bytes()) => {
                Ok(slots)
            }
            Ok((slots, _)) => self.grow(slots, id),
            Err(UnusableReason::Io(error)) => Err(error),
            Err(UnusableReason::Header(_)) => {
                keep_aside(&self.path, seen)?;
                self.try_make(NewFile::empty(id))
            }
        }
    }
}
