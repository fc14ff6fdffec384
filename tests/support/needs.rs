//! The requirements of a test on the machine. If one is missing, the test prints the reason and
//! passes. If `RUNGD_REQUIRE` names the requirement, the test fails instead. `.ci/run` probes the
//! machine and sets this variable.

/// A property that not every machine has.
#[derive(Clone, Copy, Debug)]
pub enum Need {
    /// Programs and Python modules that `.ci/run` installs.
    Programs,
    /// Permission to make a mount namespace.
    MountNamespace,
    /// Permission to make a time namespace.
    TimeNamespace,
    /// An ext4 image on a loop device.
    Ext4,
    Root,
    /// The named points of `src/faults.rs`, which a release build lacks.
    Faults,
}

impl Need {
    fn word(self) -> &'static str {
        match self {
            Need::Programs => "programs",
            Need::MountNamespace => "mount-namespace",
            Need::TimeNamespace => "time-namespace",
            Need::Ext4 => "ext4",
            Need::Root => "root",
            Need::Faults => "faults",
        }
    }
}

/// Prints the reason why a test is skipped; fails if the need is required.
pub fn skip(need: Need, why: &str) {
    skip_under(&std::env::var("RUNGD_REQUIRE").unwrap_or_default(), need, why);
}

fn skip_under(required: &str, need: Need, why: &str) {
    let word = need.word();
    let is_required = required.split_whitespace().any(|required| required == word);
    assert!(!is_required, "{why}, and RUNGD_REQUIRE wants {word}");
    eprintln!("skipped: {why}");
}

/// Skips a test because a program is not installed.
pub fn not_installed(program: &str) {
    skip(Need::Programs, &format!("{program} is not installed"));
}

#[test]
fn what_is_not_required_is_skipped() {
    skip_under("", Need::Ext4, "no ext4");
    skip_under("programs root", Need::Ext4, "no ext4");
}

#[test]
#[should_panic = "no ext4, and RUNGD_REQUIRE wants ext4"]
fn what_is_required_is_never_skipped() {
    skip_under("programs ext4", Need::Ext4, "no ext4");
}
