//! The users: a file with a name and an argon2id hash in each line. Only the file's owner and its
//! group may read it.

use std::fmt;
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use argon2::password_hash::SaltString;
use argon2::password_hash::rand_core::OsRng;
use argon2::{Argon2, PasswordHash, PasswordHasher as _, PasswordVerifier as _};

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
    /// More than the owner and the group may read the file, or the group may write it.
    Open(PathBuf),
    /// A line of the file is not a user.
    Line(PathBuf, usize),
    /// Why a name or password is refused.
    Refused(String),
}

impl fmt::Display for UserFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UserFailure::File(path, error) => write!(f, "{}: {error}", path.display()),
            UserFailure::Open(path) => write!(
                f,
                "{0}: others may read the users' hashes: `chmod o=,g-wx {0}` ends that",
                path.display()
            ),
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
}

impl Users {
    /// Reads a file.
    ///
    /// # Errors
    /// [`UserFailure`].
    pub fn read(path: &Path) -> Result<Users, UserFailure> {
        let failed = |error| UserFailure::File(path.to_owned(), error);
        let facts = fs::metadata(path).map_err(failed)?;
        // The group may read the file, so that a service can read a file of root.
        if facts.mode() & 0o037 != 0 {
            return Err(UserFailure::Open(path.to_owned()));
        }
        if facts.len() > FILE_BYTES_MAX {
            return Err(failed(io::Error::other("it is too large for a file of users")));
        }
        let text = fs::read_to_string(path).map_err(failed)?;
        let mut users = Users::default();
        for (number, line) in (1..).zip(text.lines()) {
            if line.trim().is_empty() || line.starts_with('#') {
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
/// `None` removes the user.
///
/// # Errors
/// [`UserFailure`]; the file is not changed.
pub fn set_password(path: &Path, name: &str, password: Option<&str>) -> Result<(), UserFailure> {
    let is_odd = |c: char| c == ':' || c == '#' || c.is_control() || c.is_whitespace();
    if name.is_empty() || name.len() > NAME_BYTES_MAX || name.contains(is_odd) {
        return Err(UserFailure::Refused(format!(
            "a user's name has no spaces, no `:` and no `#`, and at most {NAME_BYTES_MAX} bytes"
        )));
    }
    let mut users = match Users::read(path) {
        Err(UserFailure::File(_, error)) if error.kind() == io::ErrorKind::NotFound => {
            Users::default()
        }
        users => users?,
    };
    let known = users.all.iter().position(|(known, _)| known == name);
    match (password, known) {
        (Some(password), known) => {
            let hash = hashed(password)?;
            match known {
                Some(at) => users.all[at].1 = hash,
                None => users.all.push((name.to_owned(), hash)),
            }
        }
        (None, Some(at)) => drop(users.all.remove(at)),
        (None, None) => return Err(UserFailure::Refused(format!("there is no user `{name}`"))),
    }
    write(path, &users).map_err(|error| UserFailure::File(path.to_owned(), error))
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

/// Writes a new file beside the old one, and replaces the old one with it.
fn write(path: &Path, users: &Users) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}", std::process::id()));
    let beside = path.with_file_name(name);
    let mut options = OpenOptions::new();
    let mut file = options.write(true).create_new(true).mode(0o600).open(&beside)?;
    let text: String = users.all.iter().map(|(name, hash)| format!("{name}:{hash}\n")).collect();
    let done = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
    let done = done.and_then(|()| match fs::metadata(path) {
        // The new file keeps the owner, the group and the permissions of the old one.
        Ok(old) => {
            std::os::unix::fs::chown(&beside, Some(old.uid()), Some(old.gid()))?;
            fs::set_permissions(&beside, old.permissions())
        }
        Err(_) => Ok(()),
    });
    let done = done.and_then(|()| fs::rename(&beside, path));
    if done.is_err() {
        let _ = fs::remove_file(&beside);
    }
    done
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
        assert!(refused("dora", Some("short")).to_string().contains("8 to 1024"));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).expect("changed");
        assert!(Users::read(&path).unwrap_err().to_string().contains("chmod o="));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).expect("changed");
        fs::write(&path, "# users\nanna\n").expect("written");
        assert!(Users::read(&path).unwrap_err().to_string().contains(":2: a line is NAME:HASH"));
        let _ = fs::remove_file(&path);
    }

    #[test]
    fn the_hash_of_nobody_is_a_hash() {
        assert!(PasswordHash::new(NOBODY).is_ok());
    }
}
