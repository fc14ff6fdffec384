//! What an answer says of the events that a test file asks for.
//!
//! `decide` calls it.

use crate::answer::EventsTold;
use crate::asked_events::has_older_images;
use crate::question::Questions;
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
        let down = self.model.events.down.map(|_| "a new process finds any `$DownSeconds`");
        EventsTold {
            words: events.iter().map(|event| event.word()).collect(),
            sentences: sentence.into_iter().chain(down.map(str::to_owned)).collect(),
        }
    }
}
