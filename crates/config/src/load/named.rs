//! Reads the files that a file names.
//!
//! Called by `load`, which knows what the files are for.

use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::loaded::Loaded;
use super::{files, library};
use rungd_base::progress::LoadStep;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, possible};
use rungd_language::source::reader::Text;
use rungd_language::source::span::Span;

impl Loaded {
    /// Reads the ladder files that the file `naming` of this kind names. Returns true if all could
    /// be read.
    pub(super) fn named_files(&mut self, naming: &Path, kind: &str, names: &[Text]) -> bool {
        let mut seen: HashMap<PathBuf, Span> = HashMap::new();
        let (mut whole, own) = (true, files::identity(naming));
        for name in names {
            if self.progress.is_over() {
                return false;
            }
            if let Some(file) = library::named(&name.text) {
                let text = file.map(|file| file.text);
                whole &= self.add_library(name, text, &mut seen);
                continue;
            }
            let path = naming.parent().unwrap_or(Path::new("")).join(&name.text);
            self.progress.begin(LoadStep::Reading(path.display().to_string()));
            let real = files::identity(&path);
            if real == own {
                let message = format!("the {kind} names itself as its ladder");
                let finding = Finding::new(Code::Controller, name.span, message);
                self.findings.push(finding.help("name a file with `[[program]]`").or_omit());
                whole = false;
                continue;
            }
            if let Some(first) = seen.get(&real) {
                let message = format!("`{}` is named twice", name.text);
                let finding = Finding::new(Code::Controller, name.span, message);
                let finding = finding.related(*first, "the same file");
                let finding = finding.help("remove one of the two").fix(possible(FixEdit::Delete));
                self.findings.push(finding);
                whole = false;
                continue;
            }
            seen.insert(real, name.span);
            match self.texts.read(&path) {
                Ok(bytes) => {
                    self.add(path.display().to_string(), &bytes);
                }
                Err(error) => {
                    let message = format!("cannot read `{}`: {error}", path.display());
                    let finding = Finding::new(Code::Controller, name.span, message);
                    let help = if error.kind() == ErrorKind::InvalidInput {
                        "name a ladder file".to_owned()
                    } else if error.kind() == ErrorKind::PermissionDenied {
                        "give the user that runs rungd the right to read it and its folders"
                            .to_owned()
                    } else {
                        format!("paths are relative to the {kind}")
                    };
                    self.findings.push(finding.help(help));
                    whole = false;
                }
            }
        }
        whole && !names.is_empty()
    }

    /// Adds a file of the library that a controller file names. Returns true if the library has it
    /// and it is not named twice.
    fn add_library(
        &mut self,
        name: &Text,
        text: Result<&str, (String, Help)>,
        seen: &mut HashMap<PathBuf, Span>,
    ) -> bool {
        let finding = |message| Finding::new(Code::Controller, name.span, message);
        let finding = match (text, seen.insert(PathBuf::from(&name.text), name.span)) {
            (Err((message, help)), _) => finding(message).help(help),
            (Ok(_), Some(first)) => finding(format!("`{}` is named twice", name.text))
                .related(first, "the same file")
                .help("remove one of the two")
                .fix(possible(FixEdit::Delete)),
            (Ok(text), None) => {
                self.add(name.text.clone(), text.as_bytes());
                return true;
            }
        };
        self.findings.push(finding);
        false
    }
}
