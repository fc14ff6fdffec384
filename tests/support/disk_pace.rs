//! Measures how long this machine's disk takes to store what is written: a control for tests that
//! depend on a process's disk thread.

use std::fs::{File, remove_file};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

const BETWEEN: Duration = Duration::from_millis(50);
const BYTES: usize = 16 * 1024;

/// A thread that appends to a file and waits until the disk has stored it, again and again.
pub struct DiskPace {
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<Duration>,
}

impl DiskPace {
    /// Starts with a file of its own in a folder.
    pub fn start(folder: &Path) -> DiskPace {
        let (is_over, path) = (Arc::new(AtomicBool::new(false)), folder.join("disk-pace"));
        let mut file = File::create(&path).expect("the folder is writable");
        let end = Arc::clone(&is_over);
        let thread = spawn(move || {
            let mut slowest = Duration::ZERO;
            while !end.load(Ordering::Relaxed) {
                let begin = Instant::now();
                file.write_all(&[0; BYTES]).expect("the disk has room");
                file.sync_data().expect("the disk works");
                slowest = slowest.max(begin.elapsed());
                sleep(BETWEEN);
            }
            remove_file(&path).expect("the file is still there");
            slowest
        });
        DiskPace { is_over, thread }
    }

    /// Ends, and returns the longest time that the disk took.
    pub fn slowest(self) -> Duration {
        self.is_over.store(true, Ordering::Relaxed);
        self.thread.join().expect("the thread does not panic")
    }
}
