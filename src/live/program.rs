//! The program of a controller that runs, made of the files in its recording.

use std::collections::HashMap;
use std::sync::Arc;

use crate::controller::Controller;
use crate::draw::ladder::Picture;
use crate::load::recorded::loaded;
use crate::observe::Subject;
use crate::record::RecordedProgram;

/// A program that can be looked at.
#[derive(Debug)]
pub struct LiveProgram {
    /// As it was recorded: its process, its number in it, its files.
    pub recorded: Arc<RecordedProgram>,
    /// The program, to be observed.
    pub subject: Arc<Subject>,
    /// Its ladder, to be drawn.
    pub picture: Picture,
    /// The settings of its controller file.
    pub controller: Option<Controller>,
    /// By block or Stage, rung and branch: the number of the first contact.
    contacts: HashMap<(String, u32, Option<u32>), u32>,
}

impl LiveProgram {
    /// Makes a program of its files.
    ///
    /// # Errors
    /// This version of rungd cannot load them.
    pub fn of(recorded: Arc<RecordedProgram>) -> Result<LiveProgram, String> {
        let (program, loaded) = loaded(&recorded)?;
        let controller = loaded.controller;
        let subject = Arc::new(Subject::new(Arc::new(program), loaded.files));
        let picture = Picture::of(&subject);
        let parts = subject.contacts();
        let contacts =
            parts.map(|part| ((part.element, part.rung, part.branch), part.first)).collect();
        Ok(LiveProgram { recorded, subject, picture, controller, contacts })
    }

    /// The number of the first contact of a rung or branch, among those of the program.
    pub fn first_contact(&self, element: &str, rung: u32, branch: Option<u32>) -> Option<u32> {
        self.contacts.get(&(element.to_owned(), rung, branch)).copied()
    }
}
