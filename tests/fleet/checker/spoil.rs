//! The spoilers' common form, and functions that spoil a part of a story.

use rungd_net::sparkplug::{MessageKind, Metric, Payload};

use super::story::{Published, Step, Story};

/// The identifiers of the statements that a change violates, and the change.
pub type Spoiler = (&'static [&'static str], fn(&mut Story));

/// The first message of a kind in the first connection.
pub fn first(story: &mut Story, kind: MessageKind) -> &mut Published {
    let steps = &mut story.connections[0].steps;
    let found = steps.iter_mut().filter_map(Step::sent_mut).find(|it| it.kind() == Some(kind));
    found.expect("the story has one")
}

/// Changes the payload of the first message of a kind.
pub fn change(story: &mut Story, kind: MessageKind, change: impl FnOnce(&mut Payload)) {
    first(story, kind).change(change);
}

/// Changes a metric of the first message of a kind.
pub fn metric(story: &mut Story, kind: MessageKind, at: usize, spoil: impl FnOnce(&mut Metric)) {
    change(story, kind, |payload| spoil(&mut payload.metrics[at]));
}

/// The will of the first connection.
pub fn will(story: &mut Story) -> &mut Published {
    story.connections[0].connect.will.as_mut().expect("the story has one")
}

/// Removes the steps that fit from all connections.
pub fn leave_out(story: &mut Story, fits: impl Fn(&Step) -> bool) {
    story.connections.iter_mut().for_each(|it| it.steps.retain(|step| !fits(step)));
}
