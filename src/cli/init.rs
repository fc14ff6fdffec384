//! `rungd init`: writes a first project into an empty directory. The project runs without hardware.
//!
//! Its files are the files of `config/first/`, which the package also installs in `/etc/rungd`.
//! There the service's socket is in systemd's runtime folder; here it is beside the controller
//! file. A project that cannot be written whole, on a full disk for example, is removed again, so
//! that the same command works once there is room.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::exit::Exit;
use super::folders::has_text_path;
use super::terminal::{one_line, print};
use rungd_language::source::wording::shell_word;

/// Writes a first project: a controller file, a ladder with its tests, a simulated device
#[derive(Args, Debug)]
pub struct InitArgs {
    /// A directory that is empty or does not exist yet
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

/// The project's files: paths and contents.
static FILES: [(&str, &str); 4] = [
    ("controller.toml", include_str!("../../config/first/controller.toml")),
    ("programs/main.toml", include_str!("../../config/first/programs/main.toml")),
    ("tests/main.test.toml", include_str!("../../config/first/tests/main.test.toml")),
    ("README.md", include_str!("../../config/first/README.md")),
];

/// The operator's socket in the package's controller file, and in a first project.
const SOCKET_OFF: &str = "# [operator]\n# socket = ";
const SOCKET_ON: &str = "[operator]\nsocket = ";

/// Writes the project.
///
/// # Errors
/// The directory is not empty, or cannot be written.
pub fn init(args: &InitArgs) -> Result<Exit> {
    let directory = &args.directory;
    has_text_path(directory)?;
    refuse_what_is_there(directory)?;
    let mut made = MadePaths::default();
    for (name, text) in FILES {
        let path = directory.join(name);
        let text = text.replace(SOCKET_OFF, SOCKET_ON);
        if let Err(error) = made.write_new(&path, &text) {
            let rest = made.removed();
            return Err(error).with_context(|| format!("cannot write {}{rest}", path.display()));
        }
    }
    let mut text = String::new();
    for (name, _) in FILES {
        text += &format!("{}\n", one_line(&directory.join(name).display().to_string()));
    }
    let directory = shell_word(&directory.display().to_string());
    text += &format!(
        "\nRun it with `cd {directory} && rungd run controller.toml`; Ctrl-C stops it.\nIn a \
         second shell there, `rungd status` prints its state.\n`rungd test` runs the tests of its \
         ladder.\n"
    );
    print(&text)?;
    Ok(Exit::Ok)
}

/// Refuses a directory with files, to protect them. An empty repository is accepted.
pub(super) fn refuse_what_is_there(directory: &Path) -> Result<()> {
    let entries = match fs::read_dir(directory) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries.with_context(|| format!("cannot read {}", directory.display()))?,
    };
    for entry in entries {
        let name = entry?.file_name();
        if name != ".git" {
            let why =
                format!("it holds `{}`; give an empty directory, or a new one", name.display());
            return Err(io::Error::new(io::ErrorKind::DirectoryNotEmpty, why))
                .with_context(|| format!("nothing is written to {}", directory.display()));
        }
    }
    Ok(())
}

/// The folders and files that this command has made, in order.
#[derive(Default)]
pub(super) struct MadePaths(Vec<PathBuf>);

impl MadePaths {
    /// Writes a new file, and makes the folders above it.
    pub(super) fn write_new(&mut self, path: &Path, text: &str) -> io::Result<()> {
        let above: Vec<&Path> = path.ancestors().skip(1).collect();
        for folder in above.into_iter().rev().filter(|folder| !folder.as_os_str().is_empty()) {
            match fs::create_dir(folder) {
                Ok(()) => self.0.push(folder.to_owned()),
                Err(_) if folder.is_dir() => {}
                Err(error) => return Err(error),
            }
        }
        let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
        self.0.push(path.to_owned());
        file.write_all(text.as_bytes())?;
        // A disk may report only here that it is full.
        file.sync_all()
    }

    /// Removes everything again. Returns the words for what stays.
    pub(super) fn removed(self) -> &'static str {
        let gone = |path: &PathBuf| fs::remove_file(path).or_else(|_| fs::remove_dir(path)).is_ok();
        match self.0.iter().rev().filter(|path| !gone(path)).count() {
            0 => "; nothing is left of the project",
            _ => "; a part of the project is left: remove it",
        }
    }
}
