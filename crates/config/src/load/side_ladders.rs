//! The ladders beside the controller's: the plants of `driver = "ladder"`, and the own sides of
//! Modbus devices (`[[simulated]]`).
//!
//! Called by `load` for a controller file, and by `testing` for a test file. Each ladder is a
//! program of its own: its names, memory and rules have nothing to do with those of the controller.
//! Its files follow those of the controller's ladders.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::files::OpenTexts;
use super::library;
use super::loaded::{Loaded, has_error};
use super::sides::{LoadedSide, SideFiles};
use crate::controller::Controller;
use crate::controller::device::{Device, DriverSettings};
use crate::controller::side_ladder::{SidePrograms, WrittenSideLadder};
use crate::controller::written::WrittenController;
use rungd_engine::isa::{BitSpace, NumberRanges, Space, WordSpace};
use rungd_language::check::{
    CheckInputs, OutsideOperands, OutsideRead, check_partial, check_whole, silence,
};
use rungd_language::resolve::operands::numbers;
use rungd_language::resolve::program::{Program, TagMeaning};
use rungd_language::resolve::{LoadOptions, resolve_ladders};
use rungd_language::source::finding::Finding;
use rungd_language::source::span::{FileId, SourceFile};

/// The ladder of a test file's `[[simulated]]`, loaded.
pub struct TestSide {
    /// The test file, then the files of the ladder.
    pub files: Vec<SourceFile>,
    /// The findings, in order of place.
    pub findings: Vec<Finding>,
    /// The program, if no finding is an error.
    pub program: Option<Arc<Program>>,
}

/// Loads the ladder of a `[[simulated]]` table of the test file `naming`.
pub fn of_test(
    naming: &Path,
    file: SourceFile,
    side: &WrittenSideLadder,
    texts: &OpenTexts,
) -> TestSide {
    let mut loaded = Loaded { files: vec![file], texts: texts.clone(), ..Loaded::default() };
    let program = loaded.side_ladder(side, &mut SideFiles::Named(naming, "test file"));
    loaded.judge_sides(None);
    loaded.put_in_order();
    let program = program.filter(|_| !loaded.is_refused());
    TestSide { files: loaded.files, findings: loaded.findings, program }
}

impl Loaded {
    /// Loads the ladders beside the controller's.
    pub(super) fn side_ladders(
        &mut self,
        written: &WrittenController,
        mut files: SideFiles<'_>,
    ) -> SidePrograms {
        let mut programs = SidePrograms::default();
        for device in &written.devices {
            let side = device.side_ladder();
            let program = side.and_then(|side| self.side_ladder(&side, &mut files));
            programs.devices.push(program);
        }
        for simulated in &written.simulated {
            programs.simulated.push(self.side_ladder(&simulated.side, &mut files));
        }
        programs
    }

    /// Loads a ladder; `None` if its files cannot be read. Several devices of one kind have the
    /// same one.
    fn side_ladder(
        &mut self,
        side: &WrittenSideLadder,
        files: &mut SideFiles<'_>,
    ) -> Option<Arc<Program>> {
        if let Some(known) = self.sides.iter().find(|known| known.written.is_like(side)) {
            return Some(Arc::clone(&known.program));
        }
        let range = self.side_files(side, files)?;
        if self.progress.is_over() || self.has_finding_in(&range) {
            return None;
        }
        let options = LoadOptions {
            sizes: side.memory.clone(),
            addresses: side.addresses.clone(),
            first_file: FileId(range.start as u32),
            progress: self.progress.clone(),
            ..LoadOptions::default()
        };
        let (program, found) = resolve_ladders(&self.files[range.clone()], &options);
        let findings = library::offered(found, &self.files[range], true);
        let Some(program) = program else {
            self.findings.extend(findings);
            return None;
        };
        self.lost.add_all(&program.lost);
        let program = Arc::new(program);
        let written = side.clone();
        self.sides.push(LoadedSide { program: Arc::clone(&program), written, findings });
        Some(program)
    }

    /// The numbers of the files of a ladder.
    fn side_files(
        &mut self,
        side: &WrittenSideLadder,
        files: &mut SideFiles<'_>,
    ) -> Option<Range<usize>> {
        match files {
            SideFiles::Named(naming, kind) => {
                let first = self.files.len();
                let is_whole = self.named_files(naming, kind, &side.ladder);
                is_whole.then_some(first..self.files.len())
            }
            SideFiles::Given(next) => {
                let range = *next..(*next + side.ladder.len()).min(self.files.len());
                *next = range.end;
                (!range.is_empty()).then_some(range)
            }
        }
    }

    /// Applies the rules to the ladders beside the controller's.
    pub(super) fn judge_sides(&mut self, controller: Option<&Controller>) {
        for side in std::mem::take(&mut self.sides) {
            let LoadedSide { mut program, findings, .. } = side;
            let devices = controller.map_or(&[][..], |controller| &controller.devices);
            let outside = outside(&program, devices);
            mark_wired(Arc::make_mut(&mut program), &outside);
            let around =
                CheckInputs { retained: &[], outside: Some(&outside), progress: &self.progress };
            // A device with a mistake may write or read more of the ladder.
            let ruled = match self.has_error() || has_error(&findings) {
                true => check_partial(&program, around, false),
                false => check_whole(&program, around),
            };
            let findings = silence(&program, findings.into_iter().chain(ruled).collect(), None);
            self.findings.extend(program.layers.placed_findings(findings));
        }
    }
}

/// The bits and words of a ladder that something else writes or reads: the maps of the devices that
/// it is. An X, MC or MHR may also be written by a test, or by the driver of a Modbus device.
fn outside(program: &Arc<Program>, devices: &[Device]) -> OutsideOperands {
    let mut listed = NumberRanges::default();
    let open = [Space::Bit(BitSpace::X), Space::Bit(BitSpace::Mc), Space::Word(WordSpace::Mhr)];
    for space in open {
        let count = space.count(&program.sizes);
        if count > 0 {
            listed.add(numbers(space.address(space.first()), count), 0);
        }
    }
    let mut outside = OutsideOperands { listed, ..OutsideOperands::default() };
    let mut moved = Vec::new();
    for device in devices {
        let DriverSettings::Ladder(plant) = &device.driver else { continue };
        if !Arc::ptr_eq(&plant.program, program) {
            continue;
        }
        moved.extend(plant.outputs.iter().map(|point| point.address));
        for (point, input) in plant.inputs.iter().zip(&device.inputs) {
            match outside.reads.last_mut().filter(|read| read.span == input.span) {
                Some(read) => read.count += 1,
                None => {
                    let reader = format!("the map of `{}` reads it", device.name);
                    outside.reads.push(OutsideRead::new(point.address, 1, input.span, reader));
                }
            }
        }
    }
    outside.moved = moved.into_iter().collect();
    outside
}

/// Marks the tags that the map names as used.
fn mark_wired(program: &mut Program, outside: &OutsideOperands) {
    for tag in &mut program.tags {
        if let TagMeaning::Address(address) = tag.meaning {
            tag.used |= outside.moved.contains(&address)
                || outside.reads.iter().any(|read| read.holds(address));
        }
    }
}
