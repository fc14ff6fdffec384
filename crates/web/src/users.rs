//! The users: a file with a name and an argon2id hash in each line. Only the file's owner and its
//! group may read it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use argon2::password_hash::SaltString;
use argon2::password_hash::rand_core::OsRng;
use argon2::{Argon2, PasswordHash, PasswordHasher as _};

use super::hasher::Hasher;
use rungd_base::regular_file::read_small_text;
use rungd_base::whole_file::{self, FileRights, FolderLock, judge_secret};
use rungd_language::source::wording::is_unseen;

/// The longest name, the shortest and longest password, and PIN, in bytes.
const NAME_BYTES_MAX: usize = 32;
const PASSWORD_BYTES: (usize, usize) = (8, 1024);
const PIN_DIGITS: (usize, usize) = (6, 12);

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
        let text = read_small_text(path).map_err(failed)?;
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
    pub fn verified(&self, hasher: &Hasher, name: &str, password: &str) -> Option<String> {
        let known = self.hash_of(name);
        let hash = PasswordHash::new(known.unwrap_or(NOBODY)).ok()?;
        let is_right = hasher.is_right(password, &hash);
        known.filter(|_| is_right).map(str::to_owned)
    }
}

/// The users of a file, for a program that lets people in by name and password.
#[derive(Debug)]
pub struct UserDirectory {
    path: PathBuf,
    hasher: Hasher,
}

impl UserDirectory {
    /// The users of the file with this path. It is read for each password.
    pub fn new(path: PathBuf) -> UserDirectory {
        UserDirectory { path, hasher: Hasher::default() }
    }

    /// Whether a password is that of a user. For an unknown user it takes the same time. Blocks
    /// while a hash is made.
    ///
    /// # Errors
    /// [`UserFailure`]: the file cannot be read.
    pub fn admits(&self, name: &str, password: &str) -> Result<bool, UserFailure> {
        let users = Users::read(&self.path)?;
        Ok(users.verified(&self.hasher, name, password).is_some())
    }
}

/// What a user signs in with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Secret<'a> {
    /// A password of at least 8 bytes.
    Password(&'a str),
    /// A PIN of 6 to 12 digits, for the keys of a panel.
    Pin(&'a str),
}

/// Writes the password or PIN of a user into a file. Makes the file if it does not exist. The
/// secret `None` removes the user. If several processes do it at the same time, each one's change
/// stays.
///
/// # Errors
/// [`UserFailure`]; the file is not changed.
pub fn set_password(
    path: &Path,
    name: &str,
    secret: Option<Secret<'_>>,
) -> Result<(), UserFailure> {
    // A user with an impossible name, from a file that was written by hand, can be removed.
    let hash = secret.map(|secret| judge_name(name).and_then(|()| hashed(secret)));
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
    // A file that was written by hand may have several lines of the user: none of them stays.
    users.all.retain(|(known, _)| known != name);
    match (hash, known) {
        (Some(hash), at) => {
            let at = at.unwrap_or(users.all.len());
            users.all.insert(at, (name.to_owned(), hash));
        }
        (None, Some(_)) => {}
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

fn hashed(secret: Secret<'_>) -> Result<String, UserFailure> {
    let fits = |text: &str, (least, most): (usize, usize)| (least..=most).contains(&text.len());
    let (password, wrong) = match secret {
        Secret::Password(password) if fits(password, PASSWORD_BYTES) => (password, None),
        Secret::Password(password) => (password, Some(("a password", PASSWORD_BYTES, "bytes"))),
        Secret::Pin(pin) => {
            let is_pin = pin.bytes().all(|byte| byte.is_ascii_digit()) && fits(pin, PIN_DIGITS);
            (pin, (!is_pin).then_some(("a PIN", PIN_DIGITS, "digits")))
        }
    };
    if let Some((what, (least, most), unit)) = wrong {
        let why = format!("{what} must have {least} to {most} {unit}");
        return Err(UserFailure::Refused(why));
    }
    let salt = SaltString::generate(&mut OsRng);
    let hash = Argon2::default().hash_password(password.as_bytes(), &salt);
    hash.map(|hash| hash.to_string()).map_err(|error| UserFailure::Refused(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    #[test]
    fn a_password_admits_only_its_user() {
        let path = std::env::temp_dir().join(format!("rungd-users-{}", std::process::id()));
        let _ = fs::remove_file(&path);
        set_password(&path, "anna", Some(Secret::Password("correct horse"))).expect("written");
        set_password(&path, "ben", Some(Secret::Password("battery staple"))).expect("written");
        let users = Users::read(&path).expect("read");
        let hasher = Hasher::default();
        let is_in =
            |users: &Users, name, password| users.verified(&hasher, name, password).is_some();
        assert!(is_in(&users, "anna", "correct horse"));
        assert!(!is_in(&users, "anna", "battery staple"));
        assert!(!is_in(&users, "carl", "correct horse"));
        assert!(!is_in(&users, "", ""));
        set_password(&path, "anna", None).expect("removed");
        assert!(!is_in(&Users::read(&path).expect("read"), "anna", "correct horse"));
        let refused = |name, password: Option<&str>| {
            set_password(&path, name, password.map(Secret::Password)).unwrap_err()
        };
        assert!(refused("anna", None).to_string().contains("no user"));
        assert!(refused("a:b", Some("long enough")).to_string().contains("no `:`"));
        for name in ["anna\u{202e}", "an\u{200b}na", "\u{feff}anna", "a\u{ad}nna", "\u{3164}"] {
            assert!(refused(name, Some("long enough")).to_string().contains("invisible"), "{name}");
        }
        assert!(refused("dora", Some("short")).to_string().contains("8 to 1024"));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).expect("changed");
        assert!(Users::read(&path).unwrap_err().to_string().contains("chmod o="));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).expect("changed");
        let hash = hashed(Secret::Password("long enough")).expect("a hash");
        fs::write(&path, format!("# users\ndora:{hash}\n")).expect("written");
        set_password(&path, "anna", Some(Secret::Password("long enough"))).expect("written");
        let text = fs::read_to_string(&path).expect("read");
        assert!(text.starts_with("# users\ndora:$") && text.contains("\nanna:$"), "{text}");
        let lines = |name: &str| {
            let text = fs::read_to_string(&path).expect("read");
            text.lines().filter(|line| line.starts_with(name)).count()
        };
        let twice = format!("anna:{hash}\ndora:{hash}\nanna:{hash}\nanna:{hash}\n");
        fs::write(&path, &twice).expect("written");
        set_password(&path, "anna", Some(Secret::Password("battery staple"))).expect("written");
        assert_eq!((lines("anna:"), lines("dora:")), (1, 1), "the old password is in no line");
        fs::write(&path, &twice).expect("written");
        set_password(&path, "anna", None).expect("removed");
        assert_eq!((lines("anna:"), lines("dora:")), (0, 1));
        fs::write(&path, "# users\nanna\n").expect("written");
        assert!(Users::read(&path).unwrap_err().to_string().contains(":2: a line is NAME:HASH"));
        let _ = fs::remove_file(&path);
    }

    #[test]
    fn a_pin_has_six_to_twelve_digits() {
        assert!(hashed(Secret::Pin("004711")).is_ok());
        for wrong in ["", "12345", "1234567890123", "12345x", "１２３４５６"] {
            let refused = hashed(Secret::Pin(wrong)).unwrap_err().to_string();
            assert_eq!(refused, "a PIN must have 6 to 12 digits", "{wrong}");
        }
    }

    #[test]
    fn the_hash_for_unknown_users_is_valid() {
        assert!(PasswordHash::new(NOBODY).is_ok());
    }
}
