//! The list of this controller's files in the folder of the store: their order, and the files that
//! the limits of size and age no longer allow.
//!
//! `store` owns it, and deletes what it names. The age of a file is the time that was recorded
//! after its last scan, never a reading of the wall clock: a clock that jumps makes no file older.
//! For the same reason the files of this process keep the order in which they were begun, behind
//! those of earlier processes, which are in the order that those noted in the folder. A file that
//! is not in that order has the place of its name. If that is a later time than now, it is from a
//! clock that was ahead: its place is not known, so it proves no age of other files, and only time
//! of this process proves its own.

use std::collections::BTreeMap;

use super::block::BlockHead;
use super::folder::RecordFolder;
use super::passed::PassedTime;

/// The limits that the files must keep.
#[derive(Clone, Copy, Debug)]
pub(super) struct StoreLimits {
    /// A file is deleted when this much time was recorded after its last scan, ns.
    pub keep_ns: u64,
    /// The maximum number of bytes of all files.
    pub bytes_max: u64,
    /// The usual maximum time in one file, ns.
    pub file_ns: u64,
}

/// The files, the oldest first.
#[derive(Debug, Default)]
pub(super) struct StoredFiles(Vec<StoredFile>);

/// A file of the folder.
#[derive(Debug)]
pub(super) struct ListedFile {
    /// Its name.
    pub name: String,
    /// Its start time, as in its name, ns since 1970 (UTC).
    pub begun_ns: i64,
    /// Its size.
    pub bytes: u64,
}

#[derive(Debug)]
struct StoredFile {
    name: String,
    begun_ns: i64,
    bytes: u64,
    /// The time that is recorded in it, ns; `None`: its heads have not been read yet.
    passed_ns: Option<u64>,
    /// Whether it is of an earlier process with a clock that was ahead.
    is_ahead: bool,
    /// The time that is recorded in it, while it grows.
    growing: PassedTime,
}

impl StoredFiles {
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The bytes of all files.
    pub fn bytes(&self) -> u64 {
        self.0.iter().map(|file| file.bytes).sum()
    }

    /// Takes over a list of the folder. Known files keep their order; other files are older, and in
    /// the noted order. `unix_ns`: the time now.
    pub fn look(&mut self, listed: Vec<ListedFile>, order: &[i64], unix_ns: i64) {
        let mut listed: BTreeMap<String, ListedFile> =
            listed.into_iter().map(|file| (file.name.clone(), file)).collect();
        let mut known = std::mem::take(&mut self.0);
        known.retain_mut(|file| {
            listed.remove(&file.name).map(|listed| file.bytes = listed.bytes).is_some()
        });
        let other = |ListedFile { name, begun_ns, bytes }| StoredFile {
            name,
            begun_ns,
            bytes,
            passed_ns: None,
            is_ahead: begun_ns > unix_ns,
            growing: PassedTime::default(),
        };
        self.0 = listed.into_values().map(other).collect();
        self.0.sort_by_key(|file| file.begun_ns);
        self.put_in_order(order);
        self.0.append(&mut known);
    }

    /// Puts files, which are in the order of their names, into the order that was noted. A file
    /// that is not in it comes after the last one with an earlier start.
    fn put_in_order(&mut self, order: &[i64]) {
        let us = |ns: i64| ns / 1000;
        let places: BTreeMap<i64, usize> =
            order.iter().enumerate().map(|(at, ns)| (us(*ns), at)).collect();
        let mut last = None;
        let mut after = BTreeMap::new();
        for (begun_us, place) in &places {
            last = last.max(Some(*place));
            after.insert(*begun_us, last);
        }
        self.0.sort_by_cached_key(|file| {
            let begun_us = us(file.begun_ns);
            match places.get(&begun_us) {
                Some(place) => (Some(*place), false),
                None => (after.range(..begun_us).next_back().and_then(|(_, last)| *last), true),
            }
        });
        for file in &mut self.0 {
            file.is_ahead &= !places.contains_key(&us(file.begun_ns));
        }
    }

    /// The start times of the files, ns, the oldest file first.
    pub fn order(&self) -> Vec<i64> {
        self.0.iter().map(|file| file.begun_ns).collect()
    }

    /// The first start time from this one on that no file has, in whole microseconds.
    pub fn free_start_ns(&self, mut begun_ns: i64) -> i64 {
        while self.0.iter().any(|file| file.begun_ns / 1000 == begun_ns / 1000) {
            begun_ns += 1000;
        }
        begun_ns
    }

    /// Adds the newest file.
    pub fn begin(&mut self, name: String, begun_ns: i64) {
        let (passed_ns, growing) = (Some(0), PassedTime::default());
        let is_ahead = false;
        self.0.push(StoredFile { name, begun_ns, bytes: 0, passed_ns, is_ahead, growing });
    }

    /// Notes the new size of a file of this process, after a block.
    pub fn grow(&mut self, name: &str, bytes: u64, head: &BlockHead) {
        if let Some(file) = self.0.iter_mut().rev().find(|file| file.name == name) {
            file.bytes = bytes;
            file.growing.add(head);
            file.passed_ns = Some(file.growing.ns());
        }
    }

    /// Removes a file from the list.
    pub fn forget(&mut self, name: &str) {
        self.0.retain(|file| file.name != name);
    }

    /// The file to delete first, so that this number of additional bytes is within the limits.
    /// `open`: the file that is written, which stays.
    pub fn next_deleted(
        &mut self,
        bytes: u64,
        open: Option<&str>,
        limits: StoreLimits,
        folder: &mut impl RecordFolder,
    ) -> Option<String> {
        let oldest = self.0.iter().position(|file| Some(&*file.name) != open)?;
        let is_too_much = self.bytes().saturating_add(bytes) > limits.bytes_max;
        let is_due = is_too_much || self.is_old(oldest, limits, folder);
        is_due.then(|| self.0[oldest].name.clone())
    }

    /// Whether the time to keep was recorded after a file. Reads the heads of at most one file: the
    /// next call goes on.
    fn is_old(&mut self, at: usize, limits: StoreLimits, folder: &mut impl RecordFolder) -> bool {
        let later = &mut self.0[at + 1..];
        // As long as there are only a few later files, none of them needs to be read.
        if (later.len() as u64).saturating_mul(limits.file_ns.saturating_mul(2)) < limits.keep_ns {
            return false;
        }
        if let Some(unread) = later.iter_mut().find(|file| file.passed_ns.is_none()) {
            // A file that cannot be read proves no time.
            unread.passed_ns = Some(folder.passed_ns(&unread.name).unwrap_or(0));
        }
        if later.iter().any(|file| file.passed_ns.is_none()) {
            return false;
        }
        let proven = later.iter().filter(|file| !file.is_ahead);
        proven.filter_map(|file| file.passed_ns).sum::<u64>() > limits.keep_ns
    }
}
