//! A disk in memory whose power fails, whose calls fail, and which loses unsynced data.
//!
//! Until a sync returns, sectors are written in any order, each in whole or not. A failed sync
//! marks the unwritten sectors as clean, as Linux does: reads still return them, later syncs
//! succeed, and it is unknown whether they are on the disk.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, Error};
use std::rc::Rc;

use rungd_state::retain::Storage;

/// The failure of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An error with this errno.
    Errno(i32),
    /// Less is written or read than requested; a sync returns an error.
    Short,
}

pub struct Disk {
    pub sector: usize,
    /// The contents that are certainly on the disk.
    pub durable: Vec<u8>,
    /// The contents that reads return.
    pub cache: Vec<u8>,
    /// Sectors with unknown contents: the contents that may be on the disk instead.
    pub unsure: BTreeMap<usize, Vec<Vec<u8>>>,
    /// The sectors written since the last sync.
    dirty: Vec<usize>,
    /// The most bytes that one write accepts.
    pub most: usize,
    /// The fault, the number of the first call that fails, and the count of such calls.
    pub fault: Option<(Fault, u64, u64)>,
    pub calls: u64,
    pub syncs_failed: u64,
    /// Called after every step at which a power cut should be tested.
    pub watch: Option<Watch>,
}

pub type Watch = Rc<dyn Fn(&Disk)>;

#[derive(Clone)]
pub struct Handle(pub Rc<RefCell<Disk>>);

impl Handle {
    pub fn new(sector: usize, bytes: usize) -> Handle {
        let disk = Disk {
            sector,
            durable: vec![0xA5; bytes],
            cache: vec![0xA5; bytes],
            unsure: BTreeMap::new(),
            dirty: Vec::new(),
            most: usize::MAX,
            fault: None,
            calls: 0,
            syncs_failed: 0,
            watch: None,
        };
        Handle(Rc::new(RefCell::new(disk)))
    }

    fn seen(&self) {
        let watch = self.0.borrow().watch.clone();
        if let Some(watch) = watch {
            watch(&self.0.borrow());
        }
    }

    fn call(&self) -> Option<Fault> {
        let mut disk = self.0.borrow_mut();
        disk.calls += 1;
        let at = disk.calls;
        let hit = |(_, from, count): &(Fault, u64, u64)| (*from..*from + *count).contains(&at);
        disk.fault.filter(hit).map(|(fault, _, _)| fault)
    }
}

impl Disk {
    /// Calls `look` with every content that a power cut may leave, one after another. Returns their
    /// number.
    pub fn cuts(&self, mut look: impl FnMut(&[u8])) -> u64 {
        let mut state = self.durable.clone();
        let sectors: Vec<_> = self.unsure.iter().collect();
        let mut chosen = vec![0_usize; sectors.len()];
        let mut count = 0;
        loop {
            look(&state);
            count += 1;
            let mut at = 0;
            loop {
                let Some((sector, versions)) = sectors.get(at) else { return count };
                let begin = **sector * self.sector;
                let place = begin..begin + self.sector;
                chosen[at] += 1;
                if chosen[at] <= versions.len() {
                    state[place].copy_from_slice(&versions[chosen[at] - 1]);
                    break;
                }
                chosen[at] = 0;
                state[place.clone()].copy_from_slice(&self.durable[place]);
                at += 1;
            }
        }
    }

    /// The number of contents that a power cut may leave.
    pub fn cut_count(&self) -> u64 {
        self.unsure.values().fold(1_u64, |all, v| all.saturating_mul(v.len() as u64 + 1))
    }

    /// The power fails: `choose` selects the content of each unsure sector (0: the durable
    /// content).
    pub fn cut(&mut self, mut choose: impl FnMut(usize) -> usize) {
        for (sector, versions) in std::mem::take(&mut self.unsure) {
            let place = sector * self.sector..(sector + 1) * self.sector;
            if let Some(version) = choose(versions.len() + 1).checked_sub(1) {
                self.durable[place].copy_from_slice(&versions[version]);
            }
        }
        self.dirty.clear();
        self.cache = self.durable.clone();
        self.fault = None;
    }

    fn write(&mut self, at: usize, from: &[u8]) {
        self.cache[at..at + from.len()].copy_from_slice(from);
        for sector in at / self.sector..=(at + from.len() - 1) / self.sector {
            let now = self.cache[sector * self.sector..(sector + 1) * self.sector].to_vec();
            let before = &self.durable[sector * self.sector..(sector + 1) * self.sector];
            let versions = self.unsure.entry(sector).or_default();
            if before != now && !versions.contains(&now) {
                versions.push(now);
            }
            self.dirty.push(sector);
        }
    }

    fn sync(&mut self, fails: bool) {
        for sector in std::mem::take(&mut self.dirty) {
            if !fails {
                let place = sector * self.sector..(sector + 1) * self.sector;
                self.durable[place.clone()].copy_from_slice(&self.cache[place]);
                self.unsure.remove(&sector);
            }
        }
        self.syncs_failed += u64::from(fails);
    }
}

impl Storage for Handle {
    fn size(&mut self) -> io::Result<u64> {
        Ok(self.0.borrow().cache.len() as u64)
    }

    fn read_at(&mut self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        let fault = self.call();
        if let Some(Fault::Errno(errno)) = fault {
            return Err(Error::from_raw_os_error(errno));
        }
        let disk = self.0.borrow();
        let rest = disk.cache.get(at as usize..).unwrap_or(&[]);
        let mut count = into.len().min(rest.len());
        if fault.is_some() && count > 1 {
            count /= 2;
        }
        into[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }

    fn write_at(&mut self, at: u64, from: &[u8]) -> io::Result<usize> {
        let mut count = from.len().min(self.0.borrow().most);
        match self.call() {
            Some(Fault::Errno(errno)) => return Err(Error::from_raw_os_error(errno)),
            Some(Fault::Short) if count > 1 => count /= 2,
            _ => {}
        }
        self.0.borrow_mut().write(at as usize, &from[..count]);
        self.seen();
        Ok(count)
    }

    fn sync(&mut self) -> io::Result<()> {
        let errno = match self.call() {
            None => None,
            Some(Fault::Errno(errno)) => Some(errno),
            Some(Fault::Short) => Some(5),
        };
        self.0.borrow_mut().sync(errno.is_some());
        self.seen();
        errno.map_or(Ok(()), |errno| Err(Error::from_raw_os_error(errno)))
    }

    fn settle(&mut self) {
        let mut disk = self.0.borrow_mut();
        disk.sync(false);
    }

    fn reopen(&mut self) -> io::Result<()> {
        match self.call() {
            Some(Fault::Errno(errno)) => Err(Error::from_raw_os_error(errno)),
            _ => Ok(()),
        }
    }
}

/// Bytes that are only read.
pub struct Bytes<'a>(pub &'a [u8]);

impl Storage for Bytes<'_> {
    fn size(&mut self) -> io::Result<u64> {
        Ok(self.0.len() as u64)
    }

    fn read_at(&mut self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        let rest = self.0.get(at as usize..).unwrap_or(&[]);
        let count = into.len().min(rest.len());
        into[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }

    fn write_at(&mut self, _: u64, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::ReadOnlyFilesystem.into())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn settle(&mut self) {}

    fn reopen(&mut self) -> io::Result<()> {
        Ok(())
    }
}
