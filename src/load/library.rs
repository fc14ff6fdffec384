//! The templates of `config/lib/`, embedded in the program: `lib:pid` in the place of a ladder
//! file's path. `rungd explain lib:pid` prints one with its page, `docs/lib/pid.md`.

use crate::source::file_kind::LIBRARY;
use crate::source::finding::{Code, Finding};
use crate::source::nearest::did_you_mean;
use crate::source::span::{SourceFile, Span};

/// A file of the library.
pub(crate) struct LibraryFile {
    /// Its name behind `lib:`.
    pub(crate) name: &'static str,
    /// The file: templates.
    pub(crate) text: &'static str,
    /// Its page.
    pub(crate) page: &'static str,
}

macro_rules! files {
    ($($name:literal)*) => {
        /// The files by name.
        pub(crate) const FILES: &[LibraryFile] = &[$(LibraryFile {
            name: $name,
            text: include_str!(concat!("../../config/lib/", $name, ".toml")),
            page: include_str!(concat!("../../docs/lib/", $name, ".md")),
        }),*];
    };
}

files! {
    "alternate"
    "debounce"
    "first-out"
    "flasher"
    "hour-meter"
    "hysteresis"
    "lead-lag"
    "pid"
    "ramp"
    "scaling"
}

impl LibraryFile {
    /// The comment that begins the file, as one sentence or more; and the file behind it.
    pub(crate) fn head(&self) -> (String, &'static str) {
        let is_comment = |line: &&str| line.starts_with("# ");
        let lines = self.text.split_inclusive('\n').take_while(is_comment);
        let bytes = lines.clone().map(str::len).sum();
        let words: Vec<&str> = lines.map(|line| line[2..].trim_end()).collect();
        (words.join(" "), &self.text[bytes..])
    }
}

/// The file that `lib:NAME` names; `None`: the name is a path.
///
/// # Errors
/// There is no such file: the sentence, and the help.
pub(crate) fn named(path: &str) -> Option<Result<&'static LibraryFile, (String, String)>> {
    let name = path.strip_prefix(LIBRARY)?;
    let found = FILES.iter().find(|file| file.name == name);
    Some(found.ok_or_else(|| {
        let names = || FILES.iter().map(|file| file.name);
        let list = names().map(|of| format!("`{LIBRARY}{of}`")).collect::<Vec<_>>().join(", ");
        let help = did_you_mean(name, names()).unwrap_or_else(|| format!("there is {list}"));
        (format!("the library has no `{name}`"), help)
    }))
}

/// The file that declares a template.
pub(crate) fn of_template(name: &str) -> Option<&'static LibraryFile> {
    let header = format!("[[template]]\nname = \"{name}\"\n");
    FILES.iter().find(|file| file.text.contains(&header))
}

/// The finding, with the library's file in its help if it is about a template that the library has.
pub(crate) fn offered(finding: Finding, files: &[SourceFile], has_controller: bool) -> Finding {
    let Span { file, start, end } = finding.span;
    let Some(file) = files.get(file.0 as usize) else { return finding };
    let place = file.text.get(start as usize..end as usize).unwrap_or_default();
    let name = place.trim_matches(['"', '\'']);
    let Some(of) = of_template(name).filter(|_| finding.code == Code::UnknownTemplate) else {
        return finding;
    };
    let (whole, path) = (format!("{LIBRARY}{}", of.name), &file.name);
    let help = if has_controller {
        format!("it is in the library: add it to `ladder = [\"{whole}\", …]`")
    } else {
        format!(
            "it is in the library: `rungd check {whole} {path}`; in a controller file \
                 `ladder = [\"{whole}\", …]`"
        )
    };
    finding.near_any(None).help(help)
}
