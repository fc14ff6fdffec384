//! The users: a file with a name and an argon2id hash in each line. Only the file's owner and its
//! group may read it.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use argon2::password_hash::SaltString;
use argon2::password_hash::rand_core::OsRng;
use argon2::{Argon2, PasswordHash, PasswordHasher as _, PasswordVerifier as _};

use crate::source::wording::is_unseen;
use crate::whole_file::{self, FileRights, FolderLock, judge_secret};

/// The longest name, and the shortest and longest password, in bytes.
const NAME_BYTES_MAX: usize = 32;
const PASSWORD_BYTES: (usize, usize) = (8, 1024);

/// The largest file.
const FILE_BYTES_MAX: u64 = 1 << 20;

/// A hash that no password matches. It is verified for an unknown user, so that the time is the
/// same as for a known user.
const NOBODY: &str = "$argon2id$v=19$m=19456,t=2,p=1$AAAAAAAAAAAAAAAAAAAAAA\
                      $AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA";

/// Why users cannot be read or written.
#[derive(Debug)]
pub enum UserFailure {
    /// The file cannot be read or written.
    File(PathBuf, io::Error),
    /// A line of the file is not a user.
    Line(PathBuf, usize),
    /// Why a name or password is refused.
    Refused(String),
}

impl fmt::Display for UserFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UserFailure::File(path, error) => write!(f, "{}: {error}", path.display()),
            UserFailure::Line(path, line) => write!(
                f,
                "{}:{line}: a line is NAME:HASH, as `rungd web passwd` writes it",
                path.display()
            ),
            UserFailure::Refused(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for UserFailure {}

/// The users of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Users {
    /// Names and hashes, in the order of the file.
    all: Vec<(String, String)>,
    /// The lines that begin with `#`, with their ends.
    remarks: Vec<String>,
}

impl Users {
    /// Reads a file.
    ///
    /// # Errors
    /// [`UserFailure`].
    pub fn read(path: &Path) -> Result<Users, UserFailure> {
        let failed = |error| UserFailure::File(path.to_owned(), error);
        judge_secret(path, "the users' hashes").map_err(failed)?;
        if fs::metadata(path).map_err(failed)?.len() > FILE_BYTES_MAX {
            return Err(failed(io::Error::other("it is too large for a file of users")));
        }
        let text = fs::read_to_string(path).map_err(failed)?;
        let mut users = Users::default();
        for (number, line) in (1..).zip(text.lines()) {
            if line.starts_with('#') {
                users.remarks.push(format!("{line}\n"));
                continue;
            }
            if line.trim().is_empty() {
                continue;
            }
            let user = line.split_once(':').filter(|(_, hash)| PasswordHash::new(hash).is_ok());
            let (name, hash) = user.ok_or_else(|| UserFailure::Line(path.to_owned(), number))?;
            users.all.push((name.to_owned(), hash.to_owned()));
        }
        Ok(users)
    }

    /// The hash of a user.
    pub fn hash_of(&self, name: &str) -> Option<&str> {
        self.all.iter().find(|(known, _)| known == name).map(|(_, hash)| hash.as_str())
    }

    /// The hash of a user, if the password is right. For an unknown user it takes the same time.
    pub fn verified(&self, name: &str, password: &str) -> Option<String> {
        let known = self.hash_of(name);
        let hash = PasswordHash::new(known.unwrap_or(NOBODY)).ok()?;
        let is_right = Argon2::default().verify_password(password.as_bytes(), &hash).is_ok();
        known.filter(|_| is_right).map(str::to_owned)
    }
}

/// Writes the password of a user into a file. Makes the file if it does not exist. The password
/// `None` removes the user. If several processes do it at the same time, each one's change stays.
///
/// # Errors
/// [`UserFailure`]; the file is not changed.
pub fn set_password(path: &Path, name: &str, password: Option<&str>) -> Result<(), UserFailure> {
    // A user with an impossible name, from a file that was written by hand, can be removed.
    let hash = password.map(|password| judge_name(name).and_then(|()| hashed(password)));
    let hash = hash.transpose()?;
    // A link to the file stays a link.
    let path = whole_file::followed(path);
    let failed = |error| UserFailure::File(path.clone(), error);
    let _lock = FolderLock::of(&path).map_err(failed)?;
    let mut users = match Users::read(&path) {
        Err(UserFailure::File(_, error)) if error.kind() == io::ErrorKind::NotFound => {
            Users::default()
        }
        users => users?,
    };
    let known = users.all.iter().position(|(known, _)| known == name);
    match (hash, known) {
        (Some(hash), Some(at)) => users.all[at].1 = hash,
        (Some(hash), None) => users.all.push((name.to_owned(), hash)),
        (None, Some(at)) => drop(users.all.remove(at)),
        (None, None) => return Err(UserFailure::Refused(format!("there is no user `{name}`"))),
    }
    let line = |(name, hash): &(String, String)| format!("{name}:{hash}\n");
    let text: String = users.remarks.iter().cloned().chain(users.all.iter().map(line)).collect();
    whole_file::replace(&path, text.as_bytes(), FileRights::Kept(0o600)).map_err(failed)
}

fn judge_name(name: &str) -> Result<(), UserFailure> {
    let is_odd = |c: char| c == ':' || c == '#' || c.is_whitespace() || is_unseen(c);
    if !name.is_empty() && name.len() <= NAME_BYTES_MAX && !name.contains(is_odd) {
        return Ok(());
    }
    Err(UserFailure::Refused(format!(
        "a user's name has no spaces, no `:`, no `#` and no invisible characters, and at most \
         {NAME_BYTES_MAX} bytes"
    )))
}

fn hashed(password: &str) -> Result<String, UserFailure> {
    let (least, most) = PASSWORD_BYTES;
    if !(least..=most).contains(&password.len()) {
        let why = format!("a password must have {least} to {most} bytes");
        return Err(UserFailure::Refused(why));
    }
    let salt = SaltString::generate(&mut OsRng);
    let hash = Argon2::default().hash_password(password.as_bytes(), &salt);
    hash.map(|hash| hash.to_string()).map_err(|error| UserFailure::Refused(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn a_password_lets_its_user_in_and_nobody_else() {
        let path = std::env::temp_dir().join(format!("rungd-users-{}", std::process::id()));
        let _ = fs::remove_file(&path);
        set_password(&path, "anna", Some("correct horse")).expect("written");
        set_password(&path, "ben", Some("battery staple")).expect("written");
        let users = Users::read(&path).expect("read");
        assert!(users.verified("anna", "correct horse").is_some());
        assert!(users.verified("anna", "battery staple").is_none());
        assert!(users.verified("carl", "correct horse").is_none());
        assert!(users.verified("", "").is_none());
        set_password(&path, "anna", None).expect("removed");
        assert!(Users::read(&path).expect("read").verified("anna", "correct horse").is_none());
        let refused = |name, password| set_password(&path, name, password).unwrap_err();
        assert!(refused("anna", None).to_string().contains("no user"));
        assert!(refused("a:b", Some("long enough")).to_string().contains("no `:`"));
        for name in ["anna\u{202e}", "an\u{200b}na", "\u{feff}anna", "a\u{ad}nna", "\u{3164}"] {
            assert!(refused(name, Some("long enough")).to_string().contains("invisible"), "{name}");
        }
        assert!(refused("dora", Some("short")).to_string().contains("8 to 1024"));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).expect("changed");
        assert!(Users::read(&path).unwrap_err().to_string().contains("chmod o="));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).expect("changed");
        let hash = hashed("long enough").expect("a hash");
        fs::write(&path, format!("# users\ndora:{hash}\n")).expect("written");
        set_password(&path, "anna", Some("long enough")).expect("written");
        let text = fs::read_to_string(&path).expect("read");
        assert!(text.starts_with("# users\ndora:$") && text.contains("\nanna:$"), "{text}");
        fs::write(&path, "# users\nanna\n").expect("written");
        assert!(Users::read(&path).unwrap_err().to_string().contains(":2: a line is NAME:HASH"));
        let _ = fs::remove_file(&path);
    }

    #[test]
    fn the_hash_of_nobody_is_a_hash() {
        assert!(PasswordHash::new(NOBODY).is_ok());
    }
}
