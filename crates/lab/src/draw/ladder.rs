//! A whole ladder, ready to be drawn: blocks and Stages with their rungs, in file order.
//!
//! [`Picture::of`] makes it from a program; `listing` and `page` draw it.

use super::circuit::RungCircuit;
use super::flow::{StageJump, jumps};
use super::grid::RungGrid;
use super::wording::Wording;
use rungd_history::observe::Subject;
use rungd_language::resolve::program::{Block, BlockKind, Rung, Stage};
use rungd_language::source::span::Span;

/// A ladder.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Its name.
    pub name: String,
    /// Its `doc`.
    pub doc: Option<String>,
    /// Its Programs and Tasks.
    pub blocks: Vec<BlockPicture>,
}

/// A Program or Task.
#[derive(Clone, Debug)]
pub struct BlockPicture {
    /// Its name.
    pub name: String,
    /// `Program` or `Task`, and when it runs.
    pub kind: &'static str,
    /// Its `doc`.
    pub doc: Option<String>,
    /// Its own rungs.
    pub rungs: Vec<RungPicture>,
    /// Its Stages; the first is the initial one.
    pub stages: Vec<StagePicture>,
    /// The ways between its Stages.
    pub jumps: Vec<StageJump>,
}

/// A Stage.
#[derive(Clone, Debug)]
pub struct StagePicture {
    /// Its name.
    pub name: String,
    /// Its `doc`.
    pub doc: Option<String>,
    /// Its rungs.
    pub rungs: Vec<RungPicture>,
}

/// A rung.
#[derive(Clone, Debug)]
pub struct RungPicture {
    /// Its number in its block or Stage, from 1.
    pub number: usize,
    /// Its name.
    pub name: Option<String>,
    /// Its `doc`.
    pub doc: Option<String>,
    /// The file and line of the rung's text; for a rung of a template, in the template.
    pub place: (String, u32),
    /// The use of a template that makes the rung.
    pub of_use: Option<UseOfRung>,
    /// Its contacts and instructions with their positions.
    pub grid: RungGrid,
}

/// A use of a template.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UseOfRung {
    /// Its name.
    pub name: String,
    /// The file and line of the use.
    pub place: (String, u32),
}

impl Picture {
    /// The picture of an error-free program.
    pub fn of(subject: &Subject) -> Picture {
        let program = subject.program();
        let painter = Painter { subject, wording: Wording::of(program) };
        // Built-in Tasks without rungs are not in the file.
        let is_written = |block: &&Block| !block.rungs.is_empty() || block.span != Span::default();
        let blocks = program.blocks.iter().filter(is_written).map(|block| painter.block(block));
        Picture { name: program.name.clone(), doc: program.doc.clone(), blocks: blocks.collect() }
    }
}

impl Picture {
    /// The name, the heading and the rungs of each block and Stage with rungs.
    pub fn elements(&self) -> Vec<(String, String, &[RungPicture])> {
        let mut all = Vec::new();
        for block in &self.blocks {
            let heading = format!("{} ({})", block.name, block.kind);
            all.push((block.name.clone(), heading, &*block.rungs));
            for stage in &block.stages {
                let whole = format!("{}.{}", block.name, stage.name);
                all.push((whole.clone(), format!("Stage {whole}"), &*stage.rungs));
            }
        }
        all.retain(|(_, _, rungs)| !rungs.is_empty());
        all
    }
}

impl BlockPicture {
    /// The ways between its Stages, in words.
    pub fn ways(&self) -> Vec<String> {
        self.jumps.iter().map(StageJump::text).collect()
    }
}

impl RungPicture {
    /// `3. fill  plant.toml:12`.
    pub fn title(&self) -> String {
        let (file, line) = &self.place;
        let name = self.name.as_ref().map(|name| format!(" {name}")).unwrap_or_default();
        format!("{}.{name}  {file}:{line}", self.number)
    }
}

struct Painter<'p> {
    subject: &'p Subject,
    wording: Wording<'p>,
}

impl Painter<'_> {
    fn block(&self, block: &Block) -> BlockPicture {
        BlockPicture {
            name: block.name.clone(),
            kind: kind(block),
            doc: block.doc.clone(),
            rungs: self.rungs(&block.rungs),
            stages: block.stages.iter().map(|stage| self.stage(stage)).collect(),
            jumps: jumps(self.subject.program(), block),
        }
    }

    fn stage(&self, stage: &Stage) -> StagePicture {
        let (name, doc) = (stage.name.clone(), stage.doc.clone());
        StagePicture { name, doc, rungs: self.rungs(&stage.rungs) }
    }

    fn rungs(&self, rungs: &[Rung]) -> Vec<RungPicture> {
        (1..).zip(rungs).map(|(number, rung)| self.rung(number, rung)).collect()
    }

    fn rung(&self, number: usize, rung: &Rung) -> RungPicture {
        let of_use = self.subject.program().layers.outermost(rung.extent);
        let of_use =
            of_use.map(|(name, at)| UseOfRung { name: name.to_owned(), place: self.place(at) });
        RungPicture {
            number,
            name: rung.name.clone(),
            doc: rung.doc.clone(),
            place: self.place(rung.extent),
            of_use,
            grid: RungGrid::of(&RungCircuit::of(rung, &self.wording)),
        }
    }

    fn place(&self, span: Span) -> (String, u32) {
        let place = self.subject.place(span);
        (place.file, place.line)
    }
}

fn kind(block: &Block) -> &'static str {
    match block.kind {
        BlockKind::Program if block.is_main() => "Program, always runs",
        BlockKind::Program if block.autostart => "Program, runs from the first scan on",
        BlockKind::Program => "Program",
        BlockKind::Task => "Task",
        BlockKind::FirstScan => "Task of the first scan",
        BlockKind::TopOfScan => "Task at the top of each scan",
        BlockKind::BottomOfScan => "Task at the bottom of each scan",
        BlockKind::LastScan => "Task of the last scan",
        BlockKind::Subroutine => "Subroutine",
    }
}
