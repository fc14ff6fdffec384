//! A disk in memory whose power fails, whose calls fail, and which forgets what was not synced.
//!
//! Sectors are written whole or not at all, in any order, until a sync returns. A sync that fails
//! drops what it could not write and calls it clean, as Linux does: reads go on showing it, later
//! syncs succeed, and whether it is on the disk nobody knows.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{self, Error};
use std::rc::Rc;

use rungd::retain::Storage;

/// What the n-th call comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The errno.
    Errno(i32),
    /// Less is written or read than was asked for; of a sync, an error.
    Short,
}

pub struct Disk {
    pub sector: usize,
    /// What is on the disk for sure.
    pub durable: Vec<u8>,
    /// What reads show.
    pub cache: Vec<u8>,
    /// Sectors of which nobody knows: each content that may be on the disk instead.
    pub unsure: BTreeMap<usize, Vec<Vec<u8>>>,
    /// Written since the last sync.
    dirty: Vec<usize>,
    /// At most so many bytes are taken at a time.
    pub most: usize,
    /// Which calls fail, from when on and for how many calls.
    pub fault: Option<(Fault, u64, u64)>,
    pub calls: u64,
    pub syncs_failed: u64,
    /// Called at every step in which a cut is worth a look.
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
    /// Every content that a power cut may leave, one after the other, in place; false from `look`
    /// ends it. At most `most` of them; gives how many there were.
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

    /// How many contents a power cut may leave.
    pub fn cut_count(&self) -> u64 {
        self.unsure.values().fold(1_u64, |all, v| all.saturating_mul(v.len() as u64 + 1))
    }

    /// The power fails: each sector that is unsure is what `choose` says (0: as before).
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
