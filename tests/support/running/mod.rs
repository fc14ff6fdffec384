//! The program itself in a test: started as a process, asked through its socket.

use std::path::{Path, PathBuf};

pub mod live;
pub mod operator;
pub mod process;

/// The program that Cargo built with this test: `target/PROFILE/rungd` beside the folder of
/// `target/PROFILE/deps/TEST-…`.
pub fn program() -> PathBuf {
    profile_folder().join("rungd")
}

/// Cargo's folder for what tests write, `target/tmp`.
pub fn scratch_folder() -> PathBuf {
    profile_folder().parent().expect("the target folder").join("tmp")
}

fn profile_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test");
    test.ancestors().nth(2).map(Path::to_owned).expect("the profile's folder")
}
