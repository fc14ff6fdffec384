//! The scan log: writes the inputs of every scan as bytes, in memory and on disk, and reads them
//! back.
//!
//! The daemon's thread reads the tape and passes its entries to a [`Recorder`]. It passes each
//! block of the recorder to [`Recent`] and to the store. `cli` opens recordings; `playback`
//! executes them again. `docs/record-format.md` describes the format. Deliberately absent: threads,
//! clocks (times are arguments), the log, and any knowledge of ladders.

mod block;
mod codes;
mod file_name;
mod folder;
mod foretold;
mod passed;
mod program;
mod program_read;
mod quiet;
mod recent;
mod recorder;
mod recording;
mod section;
mod section_read;
mod segment;
mod segment_read;
mod store;
mod stored_files;
mod stretches;
mod summary;
mod who;
mod zip;

pub use block::{BlockHead, RecordBlock, StateHash, state_hash};
pub use codes::ENTRIES_MAX;
pub use file_name::EXTENSION;
pub use folder::{FolderOnDisk, RecordFolder};
pub use program::{RecordedFile, RecordedProgram};
pub use program_read::read_program;
pub use recent::Recent;
pub use recorder::{Recorder, TapeClock};
pub use recording::{ReadSection, RecordedFolder, Recording};
pub use section::SectionBody;
pub use segment::{SegmentStart, VERSION};
pub use segment_read::{FileIndex, Flaw, IndexedBlock, LastProgram, index, passed_ns};
pub use store::{Store, StoreNews, StoreSettings, StoreStatus};
pub use stretches::{RecordedGap, RecordedStretch};
pub use summary::{RecordingSummary, SummaryChange, SummaryGap, SummaryProgram};
