//! The templates of `config/lib/`, embedded in the program. `lib:pid` is written in place of a
//! ladder file's path. `rungd explain lib:pid` prints a file of the library with its page,
//! `docs/lib/pid.md`.

use rungd_language::source::file_kind::LIBRARY;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, one_of};
use rungd_language::source::nearest::{did_you_mean, nearest};
use rungd_language::source::span::{SourceFile, Span};
use rungd_language::source::wording::shell_word;

/// A file of the library.
pub struct LibraryFile {
    /// Its name, without `lib:`.
    pub name: &'static str,
    /// The text of the file.
    pub text: &'static str,
    /// The text of its page.
    pub(crate) page: &'static str,
}

macro_rules! files {
    ($($name:literal)*) => {
        /// The files by name.
        pub static FILES: &[LibraryFile] = &[$(LibraryFile {
            name: $name,
            text: include_str!(concat!("../../../../config/lib/", $name, ".toml")),
            page: include_str!(concat!("../../../../docs/lib/", $name, ".md")),
        }),*];
    };
}

files! {
    "alternate"
    "debounce"
    "drive"
    "duty"
    "first-out"
    "flasher"
    "hour-meter"
    "hysteresis"
    "iec"
    "lead-lag"
    "pid"
    "plant-belt"
    "plant-drive"
    "plant-lag"
    "plant-motor"
    "plant-tank"
    "plant-valve"
    "pulse"
    "ramp"
    "ramp-soak"
    "scaling"
    "sequence"
    "short-cycle"
    "tick"
    "totalizer"
    "valve"
    "vote"
    "week"
}

impl LibraryFile {
    /// The comment at the beginning of the file, as one or more sentences, and the text after it.
    pub fn head(&self) -> (String, &'static str) {
        let is_comment = |line: &&str| line.starts_with("# ");
        let lines = self.text.split_inclusive('\n').take_while(is_comment);
        let bytes = lines.clone().map(str::len).sum();
        let words: Vec<&str> = lines.map(|line| line[2..].trim_end()).collect();
        (words.join(" "), &self.text[bytes..])
    }

    /// The names of its templates, in order.
    pub fn templates(&self) -> impl Iterator<Item = &'static str> {
        let names = self.text.split("[[template]]\nname = \"").skip(1);
        names.filter_map(|rest| rest.split('"').next())
    }
}

/// The file that `lib:NAME` names; `None` if the name is a path.
///
/// # Errors
/// The library has no such file. The texts are the message and the help.
pub fn named(path: &str) -> Option<Result<&'static LibraryFile, (String, Help)>> {
    let name = path.strip_prefix(LIBRARY)?;
    let found = FILES.iter().find(|file| file.name == name);
    Some(found.ok_or_else(|| {
        let names = || FILES.iter().map(|file| file.name);
        let all = || one_of("there is", names().map(|name| format!("{LIBRARY}{name}")));
        let help = did_you_mean(name, names()).unwrap_or_else(all);
        (format!("the library has no `{name}`"), help)
    }))
}

/// The file that declares a template.
pub fn of_template(name: &str) -> Option<&'static LibraryFile> {
    FILES.iter().find(|file| file.templates().any(|template_name| template_name == name))
}

/// Adds the library's files to the help texts of findings about templates that are in the library.
/// Each help text names all missing files.
pub(crate) fn offered(
    findings: Vec<Finding>,
    files: &[SourceFile],
    has_controller: bool,
) -> Vec<Finding> {
    let wanted: Vec<Option<WantedLibrary>> =
        findings.iter().map(|finding| WantedLibrary::of(finding, files)).collect();
    let mut lacking: Vec<String> = Vec::new();
    for file in wanted.iter().flatten().map(|wanted| format!("{LIBRARY}{}", wanted.file.name)) {
        if !lacking.contains(&file) && files.iter().all(|given| given.name != file) {
            lacking.push(file);
        }
    }
    let how = how(&lacking, files, has_controller);
    let with_help = |(finding, wanted): (Finding, Option<WantedLibrary>)| match wanted {
        Some(wanted) => finding.near_any(None).help(wanted.help(&how)),
        None => no_file(finding, files),
    };
    findings.into_iter().zip(wanted).map(with_help).collect()
}

/// The file of the library that a `use` needs.
struct WantedLibrary {
    file: &'static LibraryFile,
    /// If the `use` names the file, or a name near it, instead of a template: the template to name.
    template: Option<&'static str>,
}

impl WantedLibrary {
    fn of(finding: &Finding, files: &[SourceFile]) -> Option<WantedLibrary> {
        let name = unknown_template(finding, files)?;
        let Some(name) = name.strip_prefix(LIBRARY) else {
            return Some(WantedLibrary { file: of_template(name)?, template: None });
        };
        let near = || nearest(name, FILES.iter().map(|file| file.name));
        let of_file = |name: &str| FILES.iter().find(|file| file.name == name);
        let file = of_file(name).or_else(|| of_template(name)).or_else(|| of_file(near()?))?;
        let own = file
            .templates()
            .find(|template_name| *template_name == name)
            .or_else(|| file.templates().next());
        Some(WantedLibrary { file, template: Some(own.unwrap_or_default()) })
    }

    fn help(&self, how: &str) -> String {
        let Some(first) = self.template else { return how.to_owned() };
        let names: Vec<String> =
            self.file.templates().map(|template_name| format!("`{template_name}`")).collect();
        let what = names.join(", ");
        let verb = if names.len() == 1 { "template is" } else { "templates are" };
        let file = self.file.name;
        let use_it = format!("`{LIBRARY}{file}` is a file, its {verb} {what}: `use = \"{first}\"`");
        if how.is_empty() { use_it } else { format!("{use_it}\n{how}") }
    }
}

/// The unknown name in a `use`, if the finding is about such a name.
fn unknown_template<'f>(finding: &Finding, files: &'f [SourceFile]) -> Option<&'f str> {
    let Span { file, start, end } = finding.span;
    let text = &files.get(file.0 as usize).filter(|_| finding.code == Code::UnknownTemplate)?.text;
    Some(text.get(start as usize..end as usize)?.trim_matches(['"', '\'']))
}

/// Adds the list of the library's files to a finding about `use = "lib:NAME"` if there is no such
/// file. Other findings do not change.
fn no_file(finding: Finding, files: &[SourceFile]) -> Finding {
    let Some(name) = unknown_template(&finding, files) else { return finding };
    let Some(Err((message, _))) = named(name) else { return finding };
    let list = FILES.iter().map(|file| format!("`{LIBRARY}{}`", file.name)).collect::<Vec<_>>();
    let help = format!("{message}; a use names a template of a file, of {}", list.join(", "));
    finding.near_any(None).help(help)
}

/// The help text about adding files of the library; empty if none is missing.
fn how(lacking: &[String], files: &[SourceFile], has_controller: bool) -> String {
    if lacking.is_empty() {
        return String::new();
    }
    let list = lacking.iter().map(|file| format!("\"{file}\"")).collect::<Vec<_>>().join(", ");
    if has_controller {
        return format!("it is in the library: add it to `ladder = [{list}, …]`");
    }
    let given = files.iter().map(|file| shell_word(&file.name));
    let words: Vec<String> = lacking.iter().cloned().chain(given).collect();
    format!(
        "it is in the library: `rungd check {}`; in a controller file `ladder = [{list}, …]`",
        words.join(" ")
    )
}
