//! The paths that a session may use, and the role that each needs.
//!
//! `route` looks a request up here, `rights` judges it, and `api` and `changes` match what is
//! found. A path without a role does not compile. The static pages, signing in and the one-time
//! link are not here: they need no session.

use rungd_base::variants::all_variants;
use rungd_config::controller::user::WebRole;

/// A question: a GET that changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PageQuestion {
    Status,
    Session,
    Hold,
    Ladder,
    Mimic,
    Panels,
    Recipe,
    Tags,
    Events,
    Rungs,
    Scan,
    Why,
    How,
    Trend,
    /// The last changes of the program.
    Deploys,
    /// The events of a viewer, as a stream.
    Stream,
}

/// A POST of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PageChange {
    Write,
    Press,
    Recipe,
    /// Reads a file of a recipe; writes nothing.
    ReadRecipe,
    Ack,
    /// Shelves an alarm for a time.
    Shelve,
    /// Takes an alarm out of service.
    OutOfService,
    /// Brings an alarm back; one that is out of service needs the role for that.
    Unshelve,
    /// Somebody is at the page: the session is not idle.
    Stay,
    Logout,
}

impl PageQuestion {
    /// All questions.
    pub const ALL: [PageQuestion; 16] = all_variants![
        PageQuestion::Status,
        PageQuestion::Session,
        PageQuestion::Hold,
        PageQuestion::Ladder,
        PageQuestion::Mimic,
        PageQuestion::Panels,
        PageQuestion::Recipe,
        PageQuestion::Tags,
        PageQuestion::Events,
        PageQuestion::Rungs,
        PageQuestion::Scan,
        PageQuestion::Why,
        PageQuestion::How,
        PageQuestion::Trend,
        PageQuestion::Deploys,
        PageQuestion::Stream,
    ];

    /// The question at a path.
    pub(super) fn at(path: &str) -> Option<PageQuestion> {
        PageQuestion::ALL.into_iter().find(|question| question.path() == path)
    }

    /// Its path.
    pub fn path(self) -> &'static str {
        match self {
            PageQuestion::Status => "/api/status",
            PageQuestion::Session => "/api/session",
            PageQuestion::Hold => "/api/hold",
            PageQuestion::Ladder => "/api/ladder",
            PageQuestion::Mimic => "/api/mimic",
            PageQuestion::Panels => "/api/panels",
            PageQuestion::Recipe => "/api/recipe",
            PageQuestion::Tags => "/api/tags",
            PageQuestion::Events => "/api/events",
            PageQuestion::Rungs => "/api/rungs",
            PageQuestion::Scan => "/api/scan",
            PageQuestion::Why => "/api/why",
            PageQuestion::How => "/api/how",
            PageQuestion::Trend => "/api/trend",
            PageQuestion::Deploys => "/api/deploys",
            PageQuestion::Stream => "/events",
        }
    }

    /// The role that it needs.
    pub fn needs(self) -> WebRole {
        match self {
            PageQuestion::Status
            | PageQuestion::Session
            | PageQuestion::Hold
            | PageQuestion::Ladder
            | PageQuestion::Mimic
            | PageQuestion::Panels
            | PageQuestion::Recipe
            | PageQuestion::Tags
            | PageQuestion::Events
            | PageQuestion::Rungs
            | PageQuestion::Scan
            | PageQuestion::Why
            | PageQuestion::How
            | PageQuestion::Trend
            | PageQuestion::Deploys
            | PageQuestion::Stream => WebRole::View,
        }
    }
}

impl PageChange {
    /// All changes.
    pub const ALL: [PageChange; 10] = all_variants![
        PageChange::Write,
        PageChange::Press,
        PageChange::Recipe,
        PageChange::ReadRecipe,
        PageChange::Ack,
        PageChange::Shelve,
        PageChange::OutOfService,
        PageChange::Unshelve,
        PageChange::Stay,
        PageChange::Logout,
    ];

    /// The change at a path.
    pub(super) fn at(path: &str) -> Option<PageChange> {
        PageChange::ALL.into_iter().find(|change| change.path() == path)
    }

    /// Its path.
    pub fn path(self) -> &'static str {
        match self {
            PageChange::Write => "/api/write",
            PageChange::Press => "/api/press",
            PageChange::Recipe => "/api/recipe",
            PageChange::ReadRecipe => "/api/recipe/read",
            PageChange::Ack => "/api/ack",
            PageChange::Shelve => "/api/shelve",
            PageChange::OutOfService => "/api/out-of-service",
            PageChange::Unshelve => "/api/unshelve",
            PageChange::Stay => "/api/stay",
            PageChange::Logout => "/api/logout",
        }
    }

    /// The least role that it needs; an operand may need a higher one.
    pub fn needs(self) -> WebRole {
        match self {
            PageChange::Write
            | PageChange::Press
            | PageChange::Recipe
            | PageChange::ReadRecipe
            | PageChange::Ack
            | PageChange::Shelve
            | PageChange::Unshelve => WebRole::Operate,
            PageChange::OutOfService => WebRole::Service,
            PageChange::Stay | PageChange::Logout => WebRole::View,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_questions_and_no_two_changes_have_one_path() {
        for question in PageQuestion::ALL {
            assert_eq!(PageQuestion::at(question.path()), Some(question));
        }
        for change in PageChange::ALL {
            assert_eq!(PageChange::at(change.path()), Some(change));
        }
        assert_eq!(PageChange::at("/api/login"), None);
    }
}
