//! What a test file asks of a proof, with its names resolved.
//!
//! Called by `reading`; `rungd-prove` makes its questions of it. Nothing is proved here.

use super::device_names::{DeviceNames, OutsideProof, outside};
use super::names::TestTarget;
use super::programs::Programs;
use super::suite::{FreeOperand, ProgramId, ProofSettings};
use super::written_prove::WrittenProve;
use crate::traces::stimulus::StimulusTarget;
use rungd_engine::Cell;
use rungd_language::source::condition::WrittenCondition;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::reader::Text;
use rungd_language::source::span::Span;

/// The conditions of `[prove]`, as written.
pub(super) struct ProofConditions {
    pub assume: Vec<(Span, WrittenCondition)>,
    pub can: Vec<(Span, WrittenCondition)>,
    /// The own ladders of field devices: no proof is about their memory.
    ladders: Vec<DeviceNames>,
    /// Of each line of `always`, why no proof is about it.
    outside: Vec<Option<String>>,
}

impl ProofConditions {
    /// The conditions, without field devices.
    pub fn new(
        assume: Vec<(Span, WrittenCondition)>,
        can: Vec<(Span, WrittenCondition)>,
    ) -> ProofConditions {
        ProofConditions { assume, can, ladders: Vec::new(), outside: Vec::new() }
    }

    /// Takes the own ladders of field devices, about whose memory there is no proof.
    pub fn know_devices(&mut self, always: &[(Span, WrittenCondition)], ladders: Vec<DeviceNames>) {
        let outside = always.iter().map(|(_, line)| {
            let outside = OutsideProof::of(line, &ladders)?;
            let OutsideProof { message, help, .. } = outside;
            Some(format!("{message}; {help}"))
        });
        self.outside = outside.collect();
        self.ladders = ladders;
    }
}

/// Resolves `[prove]`. Adds findings about it.
pub(super) fn settings(
    programs: &mut Programs<'_>,
    written: &WrittenProve,
    conditions: &ProofConditions,
    findings: &mut Vec<Finding>,
) -> ProofSettings {
    let mut resolved = |all: &[(Span, WrittenCondition)]| {
        let mut found = Vec::new();
        for (_, condition) in all {
            if let Some(OutsideProof { span, message, help }) =
                OutsideProof::of(condition, &conditions.ladders)
            {
                findings.push(Finding::new(Code::TestFile, span, message).help(help));
                continue;
            }
            match programs.names[0].condition(condition) {
                Ok(condition) => found.push(condition),
                Err(mistakes) => findings.extend(mistakes),
            }
        }
        found
    };
    let (assume, can) = (resolved(&conditions.assume), resolved(&conditions.can));
    let mut operands = |names: &[Text]| free(programs, names, findings);
    ProofSettings {
        inputs: written.inputs.as_deref().map(&mut operands),
        assume,
        can,
        outside: conditions.outside.clone(),
        late_max: written.late_max,
        from_retained: written.from_retained,
        events: written.events.clone(),
        writable: operands(&written.writable),
        any: operands(&written.any),
        states: written.states,
        depth: written.depth,
        time_ms: written.time_ms,
    }
}

/// Operands with their limits.
fn free(programs: &Programs<'_>, names: &[Text], findings: &mut Vec<Finding>) -> Vec<FreeOperand> {
    let mut all: Vec<FreeOperand> = Vec::new();
    for name in names {
        let target = programs.written(ProgramId(0), &name.text, name.span);
        match target.and_then(|target| limited(target, &name.text, name.span)) {
            Ok(one) => all.push(one),
            Err(finding) => findings.push(finding),
        }
    }
    all
}

/// An operand with the limits of its values.
pub(super) fn limited(target: TestTarget, name: &str, span: Span) -> Result<FreeOperand, Finding> {
    let refused = |message: String| Finding::new(Code::TestFile, span, message).or_omit();
    let TestTarget { operand, takes } = target;
    if operand.device.is_some() {
        return Err(refused(outside(name)));
    }
    let (low, high) = match takes {
        StimulusTarget::Input(_) | StimulusTarget::Bit(Cell::Bit(_)) => (0, 1),
        StimulusTarget::Bit(Cell::Word(_) | Cell::WordBit(_)) => {
            let message = format!("`{name}` is a bit of a word: name the word");
            return Err(refused(message));
        }
        StimulusTarget::Word(_, (low, high)) => (low, high),
        StimulusTarget::Real(_, (low, high)) => (low.cell(), high.cell()),
    };
    Ok(FreeOperand { operand, low, high })
}
