//! `[[user]]`: what the users of `rungd web` may do. Their passwords are elsewhere: in the file of
//! `rungd web passwd`.
//!
//! `web` reads it. The daemon and `rungd web` both judge a write by it: neither alone gives that
//! right. An acknowledgement has no operand: `rungd web` alone judges it.

use std::collections::HashMap;

use rungd_base::variants::all_variants;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::renaming;
use rungd_language::source::span::Span;
use rungd_language::source::value_kind::{KeyWords, WrongWord};

/// What a user of `rungd web` may do; each may do what those before it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum WebRole {
    /// To look.
    View,
    /// To acknowledge alarms, and to write what `[web] write` lists.
    Operate,
    /// To write what `[web] write-service` lists, too.
    Service,
}

impl WebRole {
    /// All roles.
    pub const ALL: [WebRole; 3] = all_variants![WebRole::View, WebRole::Operate, WebRole::Service];

    /// Its word in a controller file.
    pub fn word(self) -> &'static str {
        ROLES.word(self)
    }
}

const ROLES: KeyWords<WebRole> = KeyWords::new(&[
    ("view", WebRole::View),
    ("operate", WebRole::Operate),
    ("service", WebRole::Service),
])
.refused_as(WrongWord::NoValue);

/// `[[user]]` as written.
#[derive(Clone, Debug)]
pub(super) struct WrittenUser {
    name: Option<Text>,
    role: Option<WebRole>,
}

impl WrittenUser {
    /// Whether its role may be the highest one: a wrong role may be meant so.
    pub(super) fn may_serve(&self) -> bool {
        self.role.is_none_or(|role| role == WebRole::Service)
    }
}

/// The roles of users.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WebUsers(HashMap<String, WebRole>);

impl WebUsers {
    /// The role of a user. Without any `[[user]]` everybody operates; else who is not listed looks.
    pub fn role_of(&self, name: &str) -> WebRole {
        let unlisted = if self.0.is_empty() { WebRole::Operate } else { WebRole::View };
        self.0.get(name).copied().unwrap_or(unlisted)
    }

    /// The users whose roles are new, or others than before, each with both.
    pub fn changes<'a>(&'a self, before: &'a WebUsers) -> Vec<(&'a str, WebRole, WebRole)> {
        let mut names: Vec<&str> =
            self.0.keys().chain(before.0.keys()).map(String::as_str).collect();
        names.sort_unstable();
        names.dedup();
        let both = names.into_iter().map(|name| (name, before.role_of(name), self.role_of(name)));
        both.filter(|(_, was, is)| was != is).collect()
    }
}

/// Reads all `[[user]]`.
pub(super) fn read_in(root: &mut Table<'_>) -> Vec<WrittenUser> {
    let explained = key("user", "What a user of `rungd web` may do.");
    root.tables(explained, "a user").into_iter().map(read_user).collect()
}

fn read_user(mut table: Table<'_>) -> WrittenUser {
    table.require("role", "\"operate\"");
    let role = "`view`: to look; `operate`: to acknowledge alarms, and to write what `[web] write` \
                lists; `service`: what `write-service` lists, too.";
    let user = WrittenUser {
        name: table.required_string(key("name", "The name in the file of `rungd web passwd`.")),
        role: table.value_of(key("role", role), &ROLES),
    };
    table.finish();
    user
}

/// The roles, with a finding for each user that is listed twice.
pub(super) fn resolve(written: &[WrittenUser], findings: &mut Vec<Finding>) -> WebUsers {
    let (mut users, mut firsts) = (WebUsers::default(), HashMap::<&str, Span>::new());
    for user in written {
        let Some(name) = &user.name else { continue };
        let text = name.text.trim();
        if let Some(first) = firsts.get(text) {
            let message = format!("a second user `{text}`");
            let finding = Finding::new(Code::Controller, name.span, message);
            let fix = renaming::another(text, '-', |name| firsts.contains_key(name));
            findings.push(finding.related(*first, "the first one").fix(fix));
            continue;
        }
        firsts.insert(text, name.span);
        users.0.extend(user.role.map(|role| (text.to_owned(), role)));
    }
    users
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_list_everybody_operates_and_with_one_who_is_not_listed_looks() {
        let none = WebUsers::default();
        assert_eq!(none.role_of("anna"), WebRole::Operate);
        let some = WebUsers(HashMap::from([("anna".to_owned(), WebRole::Service)]));
        assert_eq!((some.role_of("anna"), some.role_of("ben")), (WebRole::Service, WebRole::View));
        assert_eq!(some.changes(&none), [("anna", WebRole::Operate, WebRole::Service)]);
        assert!(WebRole::View < WebRole::Operate && WebRole::Operate < WebRole::Service);
    }
}
