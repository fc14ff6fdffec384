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

/// The findings, with the library's files in the helps about templates that the library has. Each
/// help names the files of all of them: a load lacks the rest otherwise.
pub(crate) fn offered(
    findings: Vec<Finding>,
    files: &[SourceFile],
    has_controller: bool,
) -> Vec<Finding> {
    let names: Vec<Option<&str>> = findings.iter().map(|of| unknown_template(of, files)).collect();
    let missing = |file: &&LibraryFile| {
        names.iter().flatten().any(|name| of_template(name).is_some_and(|of| of.name == file.name))
    };
    let missing: Vec<String> =
        FILES.iter().filter(missing).map(|file| format!("{LIBRARY}{}", file.name)).collect();
    let listed = missing.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let told = |(finding, name): (Finding, Option<&str>)| {
        let Some(name) = name else { return finding };
        if let Some(Err((message, help))) = named(name) {
            return no_file(finding, name, &message, help);
        }
        let Some(of) = of_template(name) else { return finding };
        let of = format!("{LIBRARY}{}", of.name);
        let help = if has_controller {
            format!("it is in the library's `{of}`: `ladder = [{listed}, …]`")
        } else {
            let given = missing.iter().map(String::as_str).chain(files.iter().map(|f| &*f.name));
            let command = given.collect::<Vec<_>>().join(" ");
            format!(
                "it is in the library's `{of}`: `rungd check {command}`; in a controller file \
                 `ladder = [{listed}, …]`"
            )
        };
        finding.near_any(None).help(help)
    };
    findings.into_iter().zip(&names).map(|(finding, name)| told((finding, *name))).collect()
}

/// The name of an unknown template that a finding is about.
fn unknown_template<'f>(finding: &Finding, files: &'f [SourceFile]) -> Option<&'f str> {
    let Span { file, start, end } = finding.span;
    let place = files.get(file.0 as usize)?.text.get(start as usize..end as usize)?;
    (finding.code == Code::UnknownTemplate).then(|| place.trim_matches(['"', '\'']))
}

/// The finding for `use = "lib:NAME"` without such a file.
fn no_file(finding: Finding, name: &str, message: &str, help: String) -> Finding {
    let template = name.strip_prefix(LIBRARY).unwrap_or(name);
    let help = match of_template(template) {
        Some(of) => format!(
            "name the template: `use = \"{template}\"`; it is in the library's `{LIBRARY}{}`",
            of.name
        ),
        None => format!("{message} ({help}); a use names a template of such a file"),
    };
    finding.near_any(None).help(help)
}
