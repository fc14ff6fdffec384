//! The past of a live view: the sections of the running program, and those of the programs that ran
//! before it while somebody looked.
//!
//! Made by the follower, for the questions of `why`.

use std::sync::Arc;

use rungd_history::observe::{EarlierPast, Past, Subject, TapeEnd};
use rungd_runtime::TapeSection;

/// The maximum number of earlier programs that are kept.
const EARLIER_MAX: u32 = 3;

/// The sections of one program, and the program before it.
#[derive(Clone, Debug, Default)]
pub(super) struct LivePast {
    /// The sections, in order.
    pub sections: Vec<Arc<TapeSection>>,
    /// The program that ran right before the first section.
    pub earlier: Option<Arc<EarlierProgram>>,
}

/// A program that no longer runs.
#[derive(Debug)]
pub(super) struct EarlierProgram {
    pub subject: Arc<Subject>,
    pub past: LivePast,
}

impl EarlierProgram {
    /// A program with its past, of which the oldest programs are forgotten.
    pub fn new(subject: Arc<Subject>, past: LivePast) -> EarlierProgram {
        EarlierProgram { subject, past: past.limited(EARLIER_MAX - 1) }
    }
}

impl LivePast {
    fn limited(self, programs: u32) -> LivePast {
        let earlier = self.earlier.filter(|_| programs > 0).map(|earlier_program| {
            let EarlierProgram { subject, past } = &*earlier_program;
            let past = past.clone().limited(programs - 1);
            Arc::new(EarlierProgram { subject: Arc::clone(subject), past })
        });
        LivePast { earlier, ..self }
    }
}

impl Past for LivePast {
    fn count(&self) -> usize {
        self.sections.len()
    }

    fn section(&mut self, at: usize) -> Option<Arc<TapeSection>> {
        self.sections.get(at).cloned()
    }

    fn begins(&self) -> TapeEnd {
        if self.earlier.is_some() { TapeEnd::Swapped } else { TapeEnd::Oldest }
    }

    fn earlier(&mut self, _: &[&str]) -> Option<EarlierPast> {
        let earlier = self.earlier.as_ref()?;
        Some(EarlierPast {
            subject: Arc::clone(&earlier.subject),
            past: Box::new(earlier.past.clone()),
        })
    }
}
