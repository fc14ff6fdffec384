//! Stubs as rungs that can be drawn: what is not translated never acts, and shows its original.
//!
//! Called by the commands that show a foreign file. A project that is written keeps `todo`.

use crate::model::{ForeignProject, ProjectRung, RungBody};

/// Puts a rung that never acts in place of every stub.
pub fn draw_stubs(project: &mut ForeignProject) {
    for file in &mut project.files {
        let templates = file.templates.iter_mut().flat_map(|template| &mut template.rungs);
        templates.for_each(draw);
        for block in &mut file.blocks {
            block.rungs.iter_mut().for_each(draw);
            block.stages.iter_mut().flat_map(|stage| &mut stage.rungs).for_each(draw);
        }
    }
}

fn draw(rung: &mut ProjectRung) {
    let RungBody::Todo { reason, was } = &rung.body else { return };
    let comment = if rung.doc.is_empty() { String::new() } else { format!("{}\n", rung.doc) };
    rung.doc = format!("{comment}NOT TRANSLATED: {reason}\nThe original: {}", was.trim());
    rung.body = RungBody::Ladder {
        when: vec!["$Off".to_owned()],
        body: vec!["STOP".to_owned()],
        branches: Vec::new(),
    };
}
