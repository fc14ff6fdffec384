//! A folder in memory whose power fails, whose calls fail, and which fills up.
//!
//! After a power cut, the bytes appended since the last sync may be there in whole, in part or not:
//! their beginning, or some of their sectors with zeros between them. A deleted file may be back.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, Error};
use std::rc::Rc;

use rungd_history::record::{RecordFolder, passed_ns};

/// The bytes of a sector of this disk: few, so that a block has several sectors.
pub const SECTOR: usize = 128;

#[derive(Clone, Debug, Default)]
pub struct MemoryFile {
    pub bytes: Vec<u8>,
    /// The number of bytes that are durable.
    pub synced: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    Errno(i32),
    /// A write writes fewer bytes than given; other calls return an error.
    Short,
}

/// Calls that fail one after the other.
#[derive(Clone, Copy, Debug)]
pub struct FailingCalls {
    pub fault: Fault,
    /// The number of the first such call, from 1.
    pub first: u64,
    /// The count of such calls.
    pub count: u64,
}

#[derive(Default)]
pub struct Disk {
    pub files: BTreeMap<String, MemoryFile>,
    pub open: Option<String>,
    /// The size of the disk in bytes.
    pub room: usize,
    /// The calls that fail.
    pub fault: Option<FailingCalls>,
    pub calls: u64,
    pub syncs: u64,
    /// The order of the files, as the store noted it.
    pub order: Vec<i64>,
    /// Called after every call.
    pub watch: Option<Watch>,
}

pub type Watch = Rc<dyn Fn(&Disk)>;

#[derive(Clone)]
pub struct Handle(pub Rc<RefCell<Disk>>);

impl Handle {
    pub fn new() -> Handle {
        Handle(Rc::new(RefCell::new(Disk { room: usize::MAX, ..Disk::default() })))
    }

    fn call(&self) -> Result<bool, Error> {
        let mut disk = self.0.borrow_mut();
        disk.calls += 1;
        let at = disk.calls;
        let hit = |fails: &FailingCalls| (fails.first..fails.first + fails.count).contains(&at);
        match disk.fault.filter(hit).map(|fails| fails.fault) {
            None => Ok(false),
            Some(Fault::Errno(errno)) => Err(Error::from_raw_os_error(errno)),
            Some(Fault::Short) => Ok(true),
        }
    }

    fn seen(&self) {
        let watch = self.0.borrow().watch.clone();
        if let Some(watch) = watch {
            watch(&self.0.borrow());
        }
    }

    /// The power fails. `keep` chooses how many bytes without a sync remain.
    pub fn cut(&self, mut keep: impl FnMut(usize) -> usize) {
        let mut disk = self.0.borrow_mut();
        disk.open = None;
        disk.fault = None;
        for file in disk.files.values_mut() {
            let rest = file.bytes.len() - file.synced;
            file.bytes.truncate(file.synced + keep(rest + 1));
            file.synced = file.bytes.len();
        }
    }
}

impl Disk {
    pub fn used(&self) -> usize {
        self.files.values().map(|file| file.bytes.len()).sum()
    }

    /// Calls `look` with every content of the open file that a power cut may leave.
    pub fn cuts(&self, mut look: impl FnMut(&[u8])) -> u64 {
        let Some(file) = self.open.as_ref().and_then(|name| self.files.get(name)) else { return 0 };
        let mut count = 0;
        for length in file.synced..=file.bytes.len() {
            look(&file.bytes[..length]);
            count += 1;
        }
        let (first, last) = (file.synced / SECTOR, file.bytes.len().div_ceil(SECTOR));
        let sectors = (last - first).min(8);
        for subset in 0..1_u32 << sectors {
            let mut bytes = file.bytes.clone();
            for sector in (0..sectors).filter(|sector| subset >> sector & 1 == 0) {
                let begin = ((first + sector) * SECTOR).max(file.synced);
                let end = ((first + sector + 1) * SECTOR).min(bytes.len());
                bytes[begin..end].fill(0);
            }
            look(&bytes);
            count += 1;
        }
        count
    }
}

impl RecordFolder for Handle {
    fn own(&mut self, _: &str) -> io::Result<()> {
        Ok(())
    }

    fn order(&mut self) -> Vec<i64> {
        self.0.borrow().order.clone()
    }

    fn note_order(&mut self, begun_ns: &[i64]) {
        self.0.borrow_mut().order = begun_ns.to_vec();
    }

    fn list(&mut self) -> io::Result<Vec<(String, u64)>> {
        if self.call()? {
            return Err(Error::from_raw_os_error(5));
        }
        let disk = self.0.borrow();
        Ok(disk.files.iter().map(|(name, file)| (name.clone(), file.bytes.len() as u64)).collect())
    }

    fn create(&mut self, name: &str) -> io::Result<()> {
        self.0.borrow_mut().open = None;
        let half = self.call()?;
        {
            let mut disk = self.0.borrow_mut();
            if disk.files.contains_key(name) {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
            disk.files.insert(name.to_owned(), MemoryFile::default());
            disk.open = Some(name.to_owned());
        }
        self.seen();
        // The file exists, but its name is not durable.
        if half { Err(Error::from_raw_os_error(5)) } else { Ok(()) }
    }

    fn append(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let short = self.call()?;
        let count = {
            let mut disk = self.0.borrow_mut();
            let room = disk.room.saturating_sub(disk.used());
            let count = if short { bytes.len() / 2 } else { bytes.len() }.min(room);
            if count == 0 {
                return Err(Error::from_raw_os_error(28));
            }
            let name = disk.open.clone().expect("a file is open");
            // A file that was removed takes bytes that nobody finds.
            if let Some(file) = disk.files.get_mut(&name) {
                file.bytes.extend_from_slice(&bytes[..count]);
            }
            count
        };
        self.seen();
        Ok(count)
    }

    fn sync(&mut self) -> io::Result<()> {
        if self.call()? {
            return Err(Error::from_raw_os_error(5));
        }
        {
            let mut disk = self.0.borrow_mut();
            disk.syncs += 1;
            let name = disk.open.clone().expect("a file is open");
            if let Some(file) = disk.files.get_mut(&name) {
                file.synced = file.bytes.len();
            }
        }
        self.seen();
        Ok(())
    }

    fn is_there(&mut self, name: &str) -> bool {
        self.0.borrow().files.contains_key(name)
    }

    fn passed_ns(&mut self, name: &str) -> io::Result<u64> {
        let disk = self.0.borrow();
        let file = disk.files.get(name).ok_or(io::ErrorKind::NotFound)?;
        passed_ns(&mut io::Cursor::new(&file.bytes))
    }

    fn close(&mut self) {
        self.0.borrow_mut().open = None;
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        if self.call()? {
            return Err(Error::from_raw_os_error(5));
        }
        let gone = self.0.borrow_mut().files.remove(name);
        self.seen();
        gone.map(|_| ()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}
