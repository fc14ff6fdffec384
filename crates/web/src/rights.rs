//! What the user of a session may do at present: by the role in the controller file, and by how
//! long nobody has acted.
//!
//! Called by `route` for each path, and by `api` for what a page offers. The controller judges each
//! write again, by its own running program.

use std::time::{Duration, Instant};

use hyper::StatusCode;

use super::reply::WebFailure;
use super::sessions::WebSession;
use rungd_client::live::LiveProgram;
use rungd_config::controller::user::WebRole;
use rungd_config::controller::web::WebSettings;

/// The settings of pages, of the program's controller file.
pub(super) fn settings(program: &LiveProgram) -> Option<&WebSettings> {
    program.controller.as_ref().map(|controller| &controller.web)
}

/// The time without an act after which a user is signed out.
pub(super) fn idle_max(settings: &WebSettings) -> Option<Duration> {
    settings.sign_out_ms.map(|ms| Duration::from_millis(ms.into()))
}

/// The rights of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SessionRights {
    /// The role that counts at present.
    pub role: WebRole,
    /// Whether the user is signed out because nobody has acted, and may look until the next
    /// sign-in.
    pub is_signed_out: bool,
}

impl SessionRights {
    /// The rights of a session under these settings. Without a user it looks.
    pub fn of(session: &WebSession, settings: Option<&WebSettings>, now: Instant) -> SessionRights {
        let looks = SessionRights { role: WebRole::View, is_signed_out: false };
        let (Some(user), Some(settings)) = (&session.user, settings) else { return looks };
        let is_idle = idle_max(settings).is_some_and(|idle_max| session.idle(now) >= idle_max);
        if session.is_signed_out || is_idle {
            return SessionRights { is_signed_out: true, ..looks };
        }
        SessionRights { role: settings.users.role_of(&user.name), is_signed_out: false }
    }

    /// Judges a request.
    ///
    /// # Errors
    /// It needs a higher role: why, and what helps.
    pub fn judge(self, session: &WebSession, needed: WebRole) -> Result<(), WebFailure> {
        if self.role >= needed {
            return Ok(());
        }
        let why = match &session.user {
            None => "only users who have signed in may change something: see `rungd web passwd`"
                .to_owned(),
            Some(_) if self.is_signed_out => {
                "nobody has acted for a while, and you are signed out: sign in again".to_owned()
            }
            Some(user) => format!(
                "this needs the role `{}`, and {} has `{}`: see `[[user]]` of the controller file",
                needed.word(),
                user.name,
                self.role.word()
            ),
        };
        Err(WebFailure(StatusCode::FORBIDDEN, why))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sessions::{SignedIn, WebSessions};

    #[test]
    fn who_does_nothing_for_the_time_may_only_look_until_the_next_sign_in() {
        let (mut sessions, begun) = (WebSessions::default(), Instant::now());
        let user = SignedIn { name: "anna".to_owned(), hash: "hash".to_owned() };
        let cookie = sessions.begin(Some(user.clone()), begun);
        let mut settings = WebSettings::default();
        settings.sign_out_ms = Some(300_000);
        let minutes = |count: u64| begun + Duration::from_secs(60 * count);
        let rights = |sessions: &WebSessions, at: Instant| {
            let session = sessions.peek(&cookie, at).expect("it goes on");
            let rights = SessionRights::of(&session, Some(&settings), at);
            (rights.role, rights.judge(&session, WebRole::Operate).is_ok())
        };
        assert_eq!(rights(&sessions, minutes(4)), (WebRole::Operate, true));
        sessions.act(&cookie, minutes(4));
        assert_eq!(rights(&sessions, minutes(8)), (WebRole::Operate, true));
        assert_eq!(rights(&sessions, minutes(9)), (WebRole::View, false));
        // A question of the page itself is no act of a person.
        sessions.session(&cookie, minutes(9));
        assert_eq!(rights(&sessions, minutes(10)), (WebRole::View, false));
    }

    #[test]
    fn who_is_signed_out_stays_so_whatever_the_settings_become_until_the_next_sign_in() {
        let (mut sessions, begun) = (WebSessions::default(), Instant::now());
        let user = SignedIn { name: "anna".to_owned(), hash: "hash".to_owned() };
        let [left, watched] = [(); 2].map(|()| sessions.begin(Some(user.clone()), begun));
        let minutes = |count: u64| begun + Duration::from_secs(60 * count);
        let role = |sessions: &WebSessions, cookie: &str| {
            let session = sessions.peek(cookie, minutes(10)).expect("it goes on");
            SessionRights::of(&session, Some(&WebSettings::default()), minutes(10)).role
        };
        assert_eq!(role(&sessions, &left), WebRole::Operate, "without `sign-out`");
        let five_minutes = Duration::from_secs(300);
        sessions.sign_out_idle(&left, five_minutes, minutes(5));
        sessions.sign_out_idle(&watched, five_minutes, minutes(4));
        sessions.act(&left, minutes(6));
        sessions.act(&watched, minutes(6));
        assert_eq!(role(&sessions, &left), WebRole::View);
        assert_eq!(role(&sessions, &watched), WebRole::Operate);
    }

    #[test]
    fn a_session_without_a_user_looks_whatever_the_settings_are() {
        let (mut sessions, now) = (WebSessions::default(), Instant::now());
        let cookie = sessions.begin(None, now);
        let session = sessions.session(&cookie, now).expect("it has begun");
        let rights = SessionRights::of(&session, Some(&WebSettings::default()), now);
        assert_eq!(rights, SessionRights { role: WebRole::View, is_signed_out: false });
        let WebFailure(status, why) = rights.judge(&session, WebRole::Operate).unwrap_err();
        assert!(status == StatusCode::FORBIDDEN && why.contains("rungd web passwd"), "{why}");
    }
}
