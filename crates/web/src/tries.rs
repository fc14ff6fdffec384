//! The limit of wrong passwords: for `sessions` and for other programs that let in the users of the
//! same file. Each program counts by itself. Time is an argument.

use std::time::{Duration, Instant};

/// The most wrong passwords of one user, and of all users, within [`TRIES_OVER`]. Then no more are
/// tried until that time is over.
const WRONG_MAX: usize = 5;
const WRONG_OF_ALL_MAX: usize = 30;
/// How long a try counts.
pub(super) const TRIES_OVER: Duration = Duration::from_secs(60);

/// The wrong passwords of the last minute.
#[derive(Debug, Default)]
pub struct PasswordTries {
    /// The time and the user name of each.
    wrong: Vec<(Instant, String)>,
}

impl PasswordTries {
    /// Whether a password for this user may be tried.
    ///
    /// # Errors
    /// Why not.
    pub fn may_try(&mut self, user: &str, now: Instant) -> Result<(), &'static str> {
        self.wrong.retain(|(at, _)| now.duration_since(*at) < TRIES_OVER);
        let own = self.wrong.iter().filter(|(_, name)| name == user).count();
        if own >= WRONG_MAX || self.wrong.len() >= WRONG_OF_ALL_MAX {
            return Err("too many wrong passwords: wait a minute");
        }
        Ok(())
    }

    /// Notes a wrong password.
    pub fn note_wrong(&mut self, user: &str, now: Instant) {
        self.wrong.push((now, user.to_owned()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_attempts_wait_after_several_wrong_passwords() {
        let (mut tries, now) = (PasswordTries::default(), Instant::now());
        for _ in 0..WRONG_MAX {
            assert!(tries.may_try("anna", now).is_ok());
            tries.note_wrong("anna", now);
        }
        assert!(tries.may_try("anna", now).is_err() && tries.may_try("ben", now).is_ok());
        assert!(tries.may_try("anna", now + TRIES_OVER).is_ok());
        for user in 0..WRONG_OF_ALL_MAX {
            tries.note_wrong(&format!("user{user}"), now + TRIES_OVER);
        }
        assert!(tries.may_try("ben", now + TRIES_OVER).is_err(), "all of them together");
    }
}
