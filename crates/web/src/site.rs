//! The state that all requests share: the settings, the followed controller, sessions and users,
//! and the limits of simultaneous requests.

use std::collections::VecDeque;
use std::os::unix::fs::MetadataExt as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Instant, SystemTime};

use tokio::sync::Semaphore;

use super::follow::FollowThread;
use super::guard::RequestGuard;
use super::hasher::Hasher;
use super::journal::say;
use super::rights::{idle_max, settings};
use super::sessions::{SignedIn, WebSession, WebSessions};
use super::trend_store::TrendStore;
use super::users::{UserFailure, Users};
use rungd_base::locked::locked;
use rungd_client::live::LiveView;

/// The most viewers that receive events at a time.
pub(super) const STREAMS_MAX: usize = 64;
/// The most minutes that are held. A new one replaces the oldest.
const HELD_MAX: usize = 8;
/// The most questions, and the most passwords, that are processed at a time.
const QUESTIONS_MAX: usize = 2;
const PASSWORDS_MAX: usize = 1;
/// The most requests of buttons that are held, at a time.
const PRESSES_MAX: usize = 16;

/// The state that all requests share.
pub(super) struct WebSite {
    pub follow: FollowThread,
    pub guard: RequestGuard,
    /// Whether browsers speak TLS. If so, cookies are sent over TLS only.
    pub is_tls: bool,
    /// The part of a link before its path.
    pub address: String,
    /// The folder with the drawings of panels.
    pub mimics: Option<PathBuf>,
    pub trends: TrendStore,
    pub streams: Arc<Semaphore>,
    pub questions: Arc<Semaphore>,
    pub presses: Arc<Semaphore>,
    #[cfg(feature = "prove")]
    pub searches: Arc<Semaphore>,
    pub passwords: Arc<Semaphore>,
    pub hasher: Arc<Hasher>,
    sessions: Mutex<WebSessions>,
    /// The views held for people who step through the last minute, each with its number, the newest
    /// last.
    held: Mutex<VecDeque<(u64, LiveView)>>,
    users: Option<UserFile>,
}

/// The time of a file's last change, and its inode.
type FileState = (SystemTime, u64);

struct UserFile {
    path: PathBuf,
    /// The last users that were read, and the state of the file at that time.
    known: Mutex<Option<(FileState, Arc<Users>)>>,
}

/// The parts of a [`WebSite`].
pub(super) struct WebSiteParts {
    pub follow: FollowThread,
    pub guard: RequestGuard,
    pub is_tls: bool,
    pub address: String,
    pub users: Option<PathBuf>,
    pub mimics: Option<PathBuf>,
}

impl WebSite {
    pub fn new(parts: WebSiteParts) -> WebSite {
        let WebSiteParts { follow, guard, is_tls, address, users, mimics } = parts;
        WebSite {
            follow,
            guard,
            is_tls,
            address,
            mimics,
            trends: TrendStore::default(),
            streams: Arc::new(Semaphore::new(STREAMS_MAX)),
            questions: Arc::new(Semaphore::new(QUESTIONS_MAX)),
            presses: Arc::new(Semaphore::new(PRESSES_MAX)),
            #[cfg(feature = "prove")]
            searches: Arc::new(Semaphore::new(1)),
            passwords: Arc::new(Semaphore::new(PASSWORDS_MAX)),
            hasher: Arc::default(),
            sessions: Mutex::default(),
            held: Mutex::default(),
            users: users.map(|path| UserFile { path, known: Mutex::default() }),
        }
    }

    /// The sessions.
    pub fn sessions(&self) -> MutexGuard<'_, WebSessions> {
        locked(&self.sessions)
    }

    /// Holds a view while a person steps through it. Returns its number.
    pub fn hold(&self, view: LiveView) -> u64 {
        let mut held = locked(&self.held);
        let number = held.back().map_or(1, |(number, _)| number + 1);
        held.push_back((number, view));
        if held.len() > HELD_MAX {
            held.pop_front();
        }
        number
    }

    /// The held view with a number.
    pub fn held(&self, number: u64) -> Option<LiveView> {
        let held = locked(&self.held);
        held.iter().find(|(shown_number, _)| *shown_number == number).map(|(_, view)| view.clone())
    }

    /// Whether users sign in. Otherwise a one-time link admits a visitor.
    pub fn has_users(&self) -> bool {
        self.users.is_some()
    }

    /// The users in the present file.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn users(&self) -> Result<Arc<Users>, UserFailure> {
        let Some(file) = &self.users else { return Ok(Arc::default()) };
        let failed = |error| UserFailure::File(file.path.clone(), error);
        let facts = std::fs::metadata(&file.path).map_err(failed)?;
        // The inode too, because a new file may be written within the same tick of the clock.
        let changed = (facts.modified().map_err(failed)?, facts.ino());
        let mut known = locked(&file.known);
        if let Some((at, users)) = &*known
            && *at == changed
        {
            return Ok(Arc::clone(users));
        }
        let users = Arc::new(Users::read(&file.path)?);
        *known = Some((changed, Arc::clone(&users)));
        Ok(users)
    }

    /// The session of the cookie of a request. Ends the session if its user was removed or has a
    /// new password.
    pub fn session(&self, cookie: &str) -> Option<WebSession> {
        let now = Instant::now();
        self.sign_out_idle(cookie, now);
        let session = self.sessions().session(cookie, now)?;
        let stays = self.has_its_user(&session);
        if !stays {
            self.sessions().end(cookie);
        }
        stays.then_some(session)
    }

    /// Whether the session of a page that stays open continues.
    pub fn is_session_open(&self, cookie: &str) -> bool {
        let now = Instant::now();
        self.sign_out_idle(cookie, now);
        let session = self.sessions().peek(cookie, now);
        session.is_some_and(|session| self.has_its_user(&session))
    }

    /// Notes that a person has done something. While the controller is away nothing is noted,
    /// because nobody knows whether the user is signed out.
    pub fn act(&self, cookie: &str) {
        let now = Instant::now();
        if self.sign_out_idle(cookie, now) {
            self.sessions().act(cookie, now);
        }
    }

    /// Signs the user of a session out if nobody has acted for the time that the controller file
    /// says; false if the controller is away, so that nobody knows this time.
    fn sign_out_idle(&self, cookie: &str, now: Instant) -> bool {
        let seen = self.follow.latest();
        let Some(settings) = seen.view.as_ref().ok().and_then(|view| settings(&view.program))
        else {
            return false;
        };
        if let Some(idle_max) = idle_max(settings) {
            self.sessions().sign_out_idle(cookie, idle_max, now);
        }
        true
    }

    fn has_its_user(&self, session: &WebSession) -> bool {
        let Some(SignedIn { name, hash }) = &session.user else { return true };
        let users = self.users().inspect_err(|failure| say(&failure.to_string()));
        users.is_ok_and(|users| users.hash_of(name) == Some(hash.as_str()))
    }

    /// Prints a new one-time link for the person who started the process.
    pub fn tell_link(&self) {
        let secret = self.sessions().new_link();
        say(&format!("open {}/in?key={secret} (it is valid once)", self.address));
    }
}
