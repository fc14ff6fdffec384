//! The Programs whose Stages are retained, in the content of an image: whether each runs, and which
//! of its Stages are ON. The format is described in `docs/retain-format.md`, *Stages*.
//!
//! `plan` writes them behind the values and restores them; `content` reads them. An image without
//! them ends with its values, as it did before rungd had them.

use rungd_base::byte_source::ByteSource;
use rungd_engine::isa::StageId;
use rungd_engine::{BitCell, Cell, ResumeBits};
use rungd_language::lower::identity::Identity;

use super::restoration::{DroppedElement, Restoration};

/// Flags of a Program.
const HOLDS: u8 = 1;
const RUNS: u8 = 2;
const BEGINS: u8 = 4;
/// Flag of a Stage.
const ON: u8 = 1;

/// A Program as an image has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RetainedProgram {
    /// Its name.
    pub name: String,
    /// Whether it runs.
    pub runs: bool,
    /// Whether its first turn was still to come.
    pub begins: bool,
    /// The names of its Stages that are ON.
    pub on: Vec<String>,
}

/// The Programs of a program whose Stages are retained.
#[derive(Clone, Debug, Default)]
pub(super) struct RetainedStages(Vec<PlannedProgram>);

#[derive(Clone, Debug)]
struct PlannedProgram {
    name: String,
    stages: Vec<String>,
    kept: ResumeBits,
}

impl RetainedStages {
    pub fn new(identity: &Identity) -> RetainedStages {
        let names = &identity.names;
        let named = |kept: &ResumeBits| {
            let all = (0..).map(StageId).zip(&names.stages);
            let own = all.filter(|(_, stage)| stage.block == kept.program);
            PlannedProgram {
                name: names.block(kept.program).name.clone(),
                stages: own.map(|(_, stage)| stage.name.clone()).collect(),
                kept: *kept,
            }
        };
        RetainedStages(identity.kept.iter().map(named).collect())
    }

    /// The number of Programs.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The names of the Programs.
    pub fn names(&self) -> impl Iterator<Item = String> {
        self.0.iter().map(|program| format!("Stages of {}", program.name))
    }

    /// The number of bytes in a content.
    pub fn bytes(&self) -> usize {
        let mut bytes = Vec::new();
        self.gather(&[], &mut bytes);
        bytes.len()
    }

    /// Appends the Programs to a content, with their bits in an image; an empty image has them OFF.
    pub fn gather(&self, bits: &[u8], into: &mut Vec<u8>) {
        if self.0.is_empty() {
            return;
        }
        let is_on = |BitCell(cell): BitCell| bits.get(cell as usize).is_some_and(|bit| *bit != 0);
        into.extend_from_slice(&(self.0.len() as u32).to_le_bytes());
        for PlannedProgram { name, stages, kept } in &self.0 {
            let flags = [(kept.holds(), HOLDS), (kept.running(), RUNS), (kept.begins(), BEGINS)];
            let flags = flags.into_iter().filter(|(cell, _)| is_on(*cell));
            put_name(into, name, flags.fold(0, |flags, (_, flag)| flags | flag));
            into.extend_from_slice(&(stages.len() as u32).to_le_bytes());
            for (n, stage) in (0..).zip(stages) {
                put_name(into, stage, if is_on(kept.stage(n)) { ON } else { 0 });
            }
        }
    }

    /// Adds the restoration of the Programs of an image.
    pub fn restore(&self, found: &[RetainedProgram], to: &mut Restoration) {
        for PlannedProgram { name, stages, kept } in &self.0 {
            let Some(then) = found.iter().find(|then| then.name == *name) else {
                to.fresh += 1;
                continue;
            };
            to.restored += 1;
            let gone = then.on.iter().find(|on| !stages.contains(on));
            if let Some(gone) = gone.filter(|_| then.runs) {
                to.dropped.push(DroppedElement {
                    what: format!("Stage {name}.{gone}"),
                    why: format!("{name} has no such Stage now: it begins at its initial Stage"),
                });
            }
            let begins = then.begins || gone.is_some();
            let mut put = |cell, on| to.puts.push((Cell::Bit(cell), i32::from(on)));
            put(kept.holds(), true);
            put(kept.running(), then.runs);
            put(kept.begins(), then.runs && begins);
            for (n, stage) in (0..).zip(stages) {
                put(kept.stage(n), then.on.contains(stage));
            }
        }
        for then in found {
            if !self.0.iter().any(|program| program.name == then.name) {
                to.dropped.push(DroppedElement {
                    what: format!("Stages of {}", then.name),
                    why: "they are not retained any more".to_owned(),
                });
            }
        }
    }
}

fn put_name(into: &mut Vec<u8>, name: &str, flags: u8) {
    let length = u16::try_from(name.len()).expect("names are shorter than 64 KiB");
    into.extend_from_slice(&[flags, 0]);
    into.extend_from_slice(&length.to_le_bytes());
    into.extend_from_slice(name.as_bytes());
    into.resize(into.len() + name.len().next_multiple_of(4) - name.len(), 0);
}

/// A name with its flags.
struct FlaggedName {
    name: String,
    flags: u8,
}

fn take_name(bytes: &mut ByteSource<'_>) -> Option<FlaggedName> {
    let head = bytes.take(4)?;
    let (flags, length) = (head[0], usize::from(u16::from_le_bytes([head[2], head[3]])));
    let text = bytes.take(length.next_multiple_of(4))?;
    let name = std::str::from_utf8(&text[..length]).ok()?.to_owned();
    Some(FlaggedName { name, flags })
}

/// Reads the Programs behind the values of a content. An entry that does not hold is left out.
/// `None`: these bytes are no Programs.
pub(super) fn read(bytes: &mut ByteSource<'_>) -> Option<Vec<RetainedProgram>> {
    let mut programs = Vec::new();
    if bytes.0.is_empty() {
        return Some(programs);
    }
    for _ in 0..bytes.u32()? {
        let FlaggedName { name, flags } = take_name(bytes)?;
        let mut on = Vec::new();
        for _ in 0..bytes.u32()? {
            let stage = take_name(bytes)?;
            if stage.flags & ON != 0 {
                on.push(stage.name);
            }
        }
        let (runs, begins) = (flags & RUNS != 0, flags & BEGINS != 0);
        if flags & HOLDS != 0 {
            programs.push(RetainedProgram { name, runs, begins, on });
        }
    }
    Some(programs)
}
