//! What an answer says of the events that a test file asks for, and what no proof can tell of them.
//!
//! `decide` calls it.

use crate::answer::EventsTold;
use crate::any::readers;
use crate::asked_events::has_older_images;
use crate::cone::Cone;
use crate::explore::effects::EffectCells;
use crate::question::Questions;
use rungd_engine::Cell;
use rungd_engine::isa::{Word, WordSpace, status};
use rungd_lab::testing::ProofEvent;

impl Questions {
    /// What may happen to the controller, for people.
    pub(crate) fn events_told(&self) -> EventsTold {
        let events = &self.suite.proof.events;
        let sentence = match () {
            () if !events.contains(&ProofEvent::PowerCut) => None,
            () if !self.model.events.has_image => {
                Some("a power cut finds nothing: nothing is retained".to_owned())
            }
            () if has_older_images(&self.suite) => {
                let interval_ms = self.suite.programs[0].controller.retention.interval_ms;
                Some(format!(
                    "a power cut finds the retained values of the last scan or of any earlier one: \
                     images are {interval_ms} ms apart"
                ))
            }
            () => Some("a power cut finds the retained values of the last scan".to_owned()),
        };
        EventsTold {
            words: events.iter().map(|event| event.word()).collect(),
            sentences: sentence.into_iter().collect(),
        }
    }

    /// Why there is no proof if the time without a process is read.
    pub(crate) fn down_seconds(&self, cone: &Cone) -> Option<String> {
        let code = &cone.model.code;
        let begins = self.model.events.kinds.iter().any(|event| event.begins_process());
        let word = code.layout.word(Word::Space(WordSpace::Dst, status::dst::DOWN_SECONDS));
        let number = EffectCells { bits: code.bit_count }.of(Cell::Word(word));
        let is_read = begins && readers(code).contains_key(&number);
        is_read.then(|| "`events`: the time without a process is read: `$DownSeconds`".to_owned())
    }
}
