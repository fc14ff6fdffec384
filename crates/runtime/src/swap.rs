//! Swaps programs: the new one goes to the scan thread, and the old one comes back.
//!
//! An ordinary thread makes a [`Package`]: the machine with its memory as after a cold start, the
//! transfer of the old state, snapshots of the new shape. It goes in through a ring with a
//! [`ScanCommand::Swap`], and the scan thread swaps between two scans. The package comes back with
//! the old machine, which is dropped outside the scan thread. Readers keep their data about
//! programs by generation ([`Generations`]): every snapshot has its generation, and
//! [`Generations::latest`] returns both together, so no image is read with the layout of a
//! different program.

use std::sync::{Arc, Mutex};

use rtrb::{Consumer, Producer, RingBuffer};

use super::command::{CommandDenial, CommandId, ScanCommand};
use super::exchange::{Mode, Port, Snapshot, Tempo};
use super::image::SafeState;
use super::link::SPARES;
use super::machine::ScannedMachine;
use super::record::{CarriedWatches, WatchedCells, Watches};
use rungd_base::locked::locked;
use rungd_engine::{Cell, Transfer};

/// The greatest number of packages under way.
const PACKAGES_MAX: usize = 4;
/// The number of no program. A [`ScanCommand::Swap`] with it returns abandoned packages.
pub(super) const NO_PROGRAM: u32 = u32::MAX;

/// A program with all that the scan thread needs for it.
pub struct Package<M> {
    /// The new machine; after the swap, the old one.
    pub machine: M,
    /// The cells that are taken over from the old machine.
    pub(crate) transfer: Transfer,
    /// Its number: one more than that of any program before it.
    pub generation: u32,
    /// Its tempo.
    pub(crate) tempo: Tempo,
    /// Cells of the old machine, for the report of the swap, with their values before it.
    pub asked: Vec<(Cell, i32)>,
    /// The facts of the swap, once it is done.
    pub swapped: Option<Swapped>,
    pub(super) watches: Watches,
    /// For each watch, the watch of the old program that it continues.
    pub(super) carried: CarriedWatches,
    /// The safe state of each Y, outside RUN.
    pub(super) safe: Vec<SafeState>,
    /// Snapshots of its shape.
    pub(super) fresh: Vec<Arc<Snapshot>>,
}

/// The facts of a swap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Swapped {
    /// The duration of the swap.
    pub took_ns: u64,
    /// The mode before the swap.
    pub mode: Mode,
}

/// The parts of a package beside its machine.
#[derive(Clone, Debug)]
pub struct PackageParts {
    /// The cells that are taken over.
    pub transfer: Transfer,
    /// Its number.
    pub generation: u32,
    /// Its tempo.
    pub tempo: Tempo,
    /// Cells of the old machine whose values the report needs.
    pub asked: Vec<Cell>,
    /// The cells whose changes the log reports.
    pub watched: WatchedCells,
    /// For each watch, the watch of the old program that it continues.
    pub carried: CarriedWatches,
    /// Public bits of its image.
    pub bits: usize,
    /// Public words.
    pub words: usize,
    /// The safe state of each Y, outside RUN.
    pub safe: Vec<SafeState>,
}

impl<M: ScannedMachine> Package<M> {
    /// Stores the present values of the cells in `asked`. Nothing is allocated.
    pub(super) fn note(&mut self, old: &M) {
        let image = old.image();
        for (cell, value) in &mut self.asked {
            *value = image.value(*cell);
        }
    }
}

impl<M> Package<M> {
    /// A package; its snapshots take the data from `latest` that are not part of the program.
    pub fn new(machine: M, contents: PackageParts, latest: &Snapshot) -> Package<M> {
        let PackageParts {
            transfer,
            generation,
            tempo,
            asked,
            watched,
            carried,
            bits,
            words,
            safe,
        } = contents;
        let asked = asked.into_iter().map(|cell| (cell, 0)).collect();
        let shown: Arc<[SafeState]> = safe.clone().into();
        let fresh = |_| {
            Arc::new(Snapshot {
                generation,
                bits: vec![0; bits].into(),
                words: vec![0; words].into(),
                safe: Arc::clone(&shown),
                ..latest.clone()
            })
        };
        let fresh = (0..SPARES).map(fresh).collect();
        let watches = Watches::new(&watched, &vec![0; words], 0);
        Package {
            machine,
            transfer,
            generation,
            tempo,
            asked,
            swapped: None,
            watches,
            carried,
            safe,
            fresh,
        }
    }
}

/// The world's end: hands in packages, and takes them back.
pub struct Reloader<M> {
    out: Producer<Box<Package<M>>>,
    back: Consumer<Box<Package<M>>>,
    port: Port,
}

/// The scan thread's end.
pub(super) struct Swaps<M> {
    incoming: Consumer<Box<Package<M>>>,
    back: Producer<Box<Package<M>>>,
}

pub(super) fn swaps<M>(port: Port) -> (Reloader<M>, Swaps<M>) {
    let (out, incoming) = RingBuffer::new(PACKAGES_MAX);
    // Room for every package that can be under way, and for the one that is being swapped.
    let (back_in, back) = RingBuffer::new(2 * PACKAGES_MAX);
    (Reloader { out, back, port }, Swaps { incoming, back: back_in })
}

impl<M> Reloader<M> {
    /// Hands a package in; the port answers the command. `resume`: a swap in FAULT continues RUN.
    ///
    /// # Errors
    /// The package is refused at once, and nothing is swapped.
    pub fn hand_in(
        &mut self,
        package: Package<M>,
        resume: bool,
    ) -> Result<CommandId, CommandDenial> {
        let generation = package.generation;
        if self.port.is_stuck() {
            return Err(CommandDenial::ScanThreadStuck);
        }
        if self.out.is_full() {
            // The commands of the packages in the ring were refused. A swap to no program returns
            // them.
            self.port.command(ScanCommand::Swap { generation: NO_PROGRAM, resume: true })?;
        }
        self.out.push(Box::new(package)).map_err(|_| CommandDenial::QueueFull)?;
        self.port.command(ScanCommand::Swap { generation, resume })
    }

    /// A package that has come back; after a swap it contains the old machine.
    pub fn returned(&mut self) -> Option<Box<Package<M>>> {
        self.back.pop().ok()
    }
}

impl<M> Swaps<M> {
    /// The package of this generation. Earlier packages were abandoned; they are returned.
    pub fn take(&mut self, generation: u32) -> Option<Box<Package<M>>> {
        while let Ok(package) = self.incoming.pop() {
            if package.generation == generation {
                return Some(package);
            }
            self.give_back(package);
        }
        None
    }

    pub fn give_back(&mut self, package: Box<Package<M>>) {
        if let Err(rtrb::PushError::Full(kept)) = self.back.push(package) {
            // Never reached: the world takes packages back before it hands in the next one. The
            // memory is leaked, because the scan thread must not free.
            std::mem::forget(kept);
        }
    }
}

/// Data for each program that a snapshot may still belong to.
#[derive(Debug)]
pub struct Generations<T>(Arc<Mutex<GenerationList<T>>>);

/// The data by generation.
type GenerationList<T> = Vec<(u32, Arc<T>)>;

impl<T> Clone for Generations<T> {
    fn clone(&self) -> Self {
        Generations(Arc::clone(&self.0))
    }
}

impl<T> Generations<T> {
    /// Begins with the data of the first program, number 0.
    pub fn new(first: T) -> Generations<T> {
        Generations(Arc::new(Mutex::new(vec![(0, Arc::new(first))])))
    }

    /// Adds the data of a program, before the program is handed in.
    pub fn insert(&self, generation: u32, data: T) {
        self.locked(|list| list.push((generation, Arc::new(data))));
    }

    /// The latest image, and the data of its program.
    pub fn latest(&self, port: &Port) -> (Arc<Snapshot>, Arc<T>) {
        loop {
            let image = port.latest();
            // A program's data are removed only after an image of a later program was published: if
            // they are gone, the next look finds that image.
            if let Some(data) = self.find(image.generation) {
                return (image, data);
            }
        }
    }

    /// The data of a program; if the program is no longer in the list, the data of the last one.
    pub fn of_generation(&self, generation: u32) -> Arc<T> {
        let last = || self.locked(|list| list.last().map(|(_, data)| Arc::clone(data)));
        let found = self.find(generation).or_else(last);
        found.expect("there is one from the beginning, and one stays")
    }

    fn find(&self, generation: u32) -> Option<Arc<T>> {
        self.locked(|list| {
            let (_, data) =
                list.iter().find(|(listed_generation, _)| *listed_generation == generation)?;
            Some(Arc::clone(data))
        })
    }

    /// Removes the data of all programs before this one. The latest image must not be of one of
    /// them.
    pub fn forget_before(&self, generation: u32) {
        self.locked(|list| list.retain(|(listed_generation, _)| *listed_generation >= generation));
    }

    /// Removes the data of a program that was not swapped in.
    pub fn remove(&self, generation: u32) {
        self.locked(|list| list.retain(|(listed_generation, _)| *listed_generation != generation));
    }

    fn locked<R>(&self, with: impl FnOnce(&mut GenerationList<T>) -> R) -> R {
        with(&mut locked(&self.0))
    }
}
