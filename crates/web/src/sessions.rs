//! The sessions: their cookies, the one-time link, and the limit of sign-ins. Time is an argument.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use argon2::password_hash::rand_core::{OsRng, RngCore as _};
use base64::Engine as _;
use base64::prelude::BASE64_URL_SAFE_NO_PAD;

use super::tries::{PasswordTries, TRIES_OVER};

/// A session ends after `IDLE_MAX` without requests, and in any case after `AGE_MAX`.
const IDLE_MAX: Duration = Duration::from_secs(8 * 3600);
const AGE_MAX: Duration = Duration::from_secs(24 * 3600);

/// The most sessions, and the most of one user. A new session then ends the one that has been idle
/// for the longest time.
const SESSIONS_MAX: usize = 256;
const SESSIONS_OF_USER_MAX: usize = 64;

/// The most sign-ins of one user within a minute. Then none is taken until the minute is over.
const RIGHT_MAX: usize = 30;

/// The name of a session's cookie.
pub(super) const COOKIE: &str = "rungd_session";

/// The SHA-256 of a secret. Only the hash of a cookie or link is kept.
type SecretHash = [u8; 32];

/// The sessions of the process.
#[derive(Debug, Default)]
pub(super) struct WebSessions {
    all: HashMap<SecretHash, WebSession>,
    /// The hash of the secret in the one-time link.
    link: Option<SecretHash>,
    wrong: PasswordTries,
    /// The sign-ins: the time and the user name of each.
    right: Vec<(Instant, String)>,
}

/// A user who has signed in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SignedIn {
    /// The user's name.
    pub name: String,
    /// The hash of the password at sign-in.
    pub hash: String,
}

/// A session.
#[derive(Clone, Debug)]
pub(super) struct WebSession {
    /// The user; `None`: signed in by the one-time link.
    pub user: Option<SignedIn>,
    /// The token that a change must contain.
    pub csrf: String,
    /// Whether the user was signed out because nobody had acted. Only a sign-in ends that.
    pub is_signed_out: bool,
    began: Instant,
    last: Instant,
    /// When a person last did something: signed in, pressed, changed.
    acted: Instant,
}

/// A secret of 256 bits.
fn secret() -> String {
    let mut bytes = [0; 32];
    OsRng.fill_bytes(&mut bytes);
    BASE64_URL_SAFE_NO_PAD.encode(bytes)
}

fn hash_of(secret: &str) -> SecretHash {
    hmac_sha256::Hash::hash(secret.as_bytes())
}

impl WebSessions {
    /// Makes a new one-time link. The previous link is no longer valid.
    pub fn new_link(&mut self) -> String {
        let secret = secret();
        self.link = Some(hash_of(&secret));
        secret
    }

    /// Uses the one-time link.
    pub fn use_link(&mut self, said: &str) -> bool {
        // Compares hashes, so that the duration of the comparison reveals nothing about the secret.
        let fits = self.link == Some(hash_of(said));
        if fits {
            self.link = None;
        }
        fits
    }

    /// Begins a session. Returns the value of its cookie.
    pub fn begin(&mut self, user: Option<SignedIn>, now: Instant) -> String {
        self.all.retain(|_, session| session.is_alive(now));
        if let Some(user) = &user {
            self.right.push((now, user.name.clone()));
        }
        let is_own = |session: &WebSession| user.is_some() && session.user == user;
        let own = self.all.values().filter(|session| is_own(session)).count();
        let is_full = self.all.len() >= SESSIONS_MAX;
        if is_full || own >= SESSIONS_OF_USER_MAX {
            let over = self.all.iter().filter(|(_, session)| is_full || is_own(session));
            let oldest = over.min_by_key(|(_, session)| session.last);
            if let Some(hash) = oldest.map(|(hash, _)| *hash) {
                self.all.remove(&hash);
            }
        }
        let cookie = secret();
        let (csrf, is_signed_out) = (secret(), false);
        let session = WebSession { user, csrf, is_signed_out, began: now, last: now, acted: now };
        self.all.insert(hash_of(&cookie), session);
        cookie
    }

    /// The session of the cookie of a request. Notes the time of the request.
    pub fn session(&mut self, cookie: &str, now: Instant) -> Option<WebSession> {
        let session = self.all.get_mut(&hash_of(cookie)).filter(|session| session.is_alive(now))?;
        session.last = now;
        Some(session.clone())
    }

    /// Notes that a person has done something, unless the user is signed out.
    pub fn act(&mut self, cookie: &str, now: Instant) {
        let session = self.all.get_mut(&hash_of(cookie));
        if let Some(session) = session.filter(|session| !session.is_signed_out) {
            session.acted = now;
        }
    }

    /// Signs the user of a session out if nobody has acted for a time.
    pub fn sign_out_idle(&mut self, cookie: &str, idle_max: Duration, now: Instant) {
        if let Some(session) = self.all.get_mut(&hash_of(cookie)) {
            session.is_signed_out |= session.user.is_some() && session.idle(now) >= idle_max;
        }
    }

    /// The session of a cookie, for a page that stays open. This does not count as a request.
    pub fn peek(&self, cookie: &str, now: Instant) -> Option<WebSession> {
        self.all.get(&hash_of(cookie)).filter(|session| session.is_alive(now)).cloned()
    }

    /// Ends a session.
    pub fn end(&mut self, cookie: &str) {
        self.all.remove(&hash_of(cookie));
    }

    /// Whether a password for this user may be tried.
    ///
    /// # Errors
    /// Why not.
    pub fn may_try(&mut self, user: &str, now: Instant) -> Result<(), &'static str> {
        self.wrong.may_try(user, now)?;
        self.right.retain(|(at, _)| now.duration_since(*at) < TRIES_OVER);
        if self.right.iter().filter(|(_, name)| name == user).count() >= RIGHT_MAX {
            return Err("this user has signed in too often: wait a minute");
        }
        Ok(())
    }

    /// Notes a wrong password.
    pub fn note_wrong(&mut self, user: &str, now: Instant) {
        self.wrong.note_wrong(user, now);
    }
}

impl WebSession {
    fn is_alive(&self, now: Instant) -> bool {
        now.duration_since(self.last) < IDLE_MAX && now.duration_since(self.began) < AGE_MAX
    }

    /// How long no person has done anything.
    pub fn idle(&self, now: Instant) -> Duration {
        now.duration_since(self.acted)
    }

    /// Whether the token of a change is the one of this session.
    pub fn has_token(&self, said: &str) -> bool {
        hash_of(said) == hash_of(&self.csrf)
    }
}

/// Finds the cookie of a session in the `Cookie` header of a request.
pub(super) fn cookie_of(header: &str) -> Option<&str> {
    let mut cookies = header.split(';').filter_map(|cookie| cookie.trim().split_once('='));
    cookies.find(|(name, _)| *name == COOKIE).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_end_when_idle_when_too_old_or_on_request() {
        let (mut sessions, now) = (WebSessions::default(), Instant::now());
        let cookie = sessions.begin(None, now);
        let known = sessions.session(&cookie, now).expect("it has begun");
        assert!(known.has_token(&known.csrf) && !known.has_token("") && !known.has_token(&cookie));
        assert!(
            sessions.session("", now).is_none() && sessions.session(&known.csrf, now).is_none()
        );
        assert!(sessions.session(&cookie, now + IDLE_MAX).is_none(), "without requests");
        let cookie = sessions.begin(None, now);
        let mut at = now;
        while at < now + AGE_MAX - IDLE_MAX / 2 {
            assert!(sessions.session(&cookie, at).is_some());
            at += IDLE_MAX / 2;
        }
        assert!(sessions.session(&cookie, now + AGE_MAX).is_none(), "with requests");
        let cookie = sessions.begin(None, now);
        sessions.end(&cookie);
        assert!(sessions.session(&cookie, now).is_none());
    }

    #[test]
    fn a_sign_in_link_works_once() {
        let mut sessions = WebSessions::default();
        assert!(!sessions.use_link(""), "there is none");
        let (old, new) = (sessions.new_link(), sessions.new_link());
        assert!(!sessions.use_link(&old) && sessions.use_link(&new) && !sessions.use_link(&new));
    }

    #[test]
    fn repeated_sign_ins_are_delayed_and_end_no_session_of_other_users() {
        let (mut sessions, mut now) = (WebSessions::default(), Instant::now());
        let user = |name: &str| Some(SignedIn { name: name.to_owned(), hash: "hash".to_owned() });
        let ben = sessions.begin(user("ben"), now);
        for _ in 0..10 {
            for _ in 0..RIGHT_MAX {
                assert_eq!(sessions.may_try("anna", now), Ok(()));
                sessions.begin(user("anna"), now);
            }
            let refused = sessions.may_try("anna", now).unwrap_err();
            assert!(refused.contains("too often"), "{refused}");
            assert_eq!(sessions.may_try("ben", now), Ok(()));
            now += TRIES_OVER;
        }
        assert!(sessions.session(&ben, now).is_some());
        assert_eq!(sessions.all.len(), SESSIONS_OF_USER_MAX + 1);
    }

    #[test]
    fn the_number_of_sessions_is_limited() {
        let (mut sessions, now) = (WebSessions::default(), Instant::now());
        let first = sessions.begin(None, now);
        for second in 0..SESSIONS_MAX as u64 {
            sessions.begin(None, now + Duration::from_secs(second + 1));
        }
        assert!(sessions.session(&first, now).is_none() && sessions.all.len() == SESSIONS_MAX);
    }

    #[test]
    fn the_session_cookie_is_found_among_others() {
        assert_eq!(cookie_of("a=b; rungd_session=xyz; c=d"), Some("xyz"));
        assert_eq!(cookie_of("rungd_session="), Some(""));
        assert_eq!(cookie_of("xrungd_session=1"), None);
        assert_eq!(cookie_of(""), None);
    }
}
