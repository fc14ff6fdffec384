//! The templates of `config/lib/`, embedded in the program: `lib:pid` in the place of a ladder
//! file's path. `rungd explain lib:pid` prints one.

use crate::source::file_kind::LIBRARY;
use crate::source::finding::{Code, Finding};
use crate::source::nearest::did_you_mean;
use crate::source::span::{SourceFile, Span};

/// The files, each with its name and text.
pub(crate) const FILES: [(&str, &str); 10] = [
    ("alternate", include_str!("../../config/lib/alternate.toml")),
    ("debounce", include_str!("../../config/lib/debounce.toml")),
    ("first-out", include_str!("../../config/lib/first-out.toml")),
    ("flasher", include_str!("../../config/lib/flasher.toml")),
    ("hour-meter", include_str!("../../config/lib/hour-meter.toml")),
    ("hysteresis", include_str!("../../config/lib/hysteresis.toml")),
    ("lead-lag", include_str!("../../config/lib/lead-lag.toml")),
    ("pid", include_str!("../../config/lib/pid.toml")),
    ("ramp", include_str!("../../config/lib/ramp.toml")),
    ("scaling", include_str!("../../config/lib/scaling.toml")),
];

/// The finding, with the library's file in its help if it is about a template that the library has.
pub(crate) fn offered(finding: Finding, files: &[SourceFile], has_controller: bool) -> Finding {
    let Span { file, start, end } = finding.span;
    let Some(file) = files.get(file.0 as usize) else { return finding };
    let place = file.text.get(start as usize..end as usize).unwrap_or_default();
    let name = place.trim_matches(['"', '\'']);
    let header = format!("[[template]]\nname = \"{name}\"\n");
    let found = FILES.iter().find(|(_, text)| text.contains(&header));
    let Some((of, _)) = found.filter(|_| finding.code == Code::UnknownTemplate) else {
        return finding;
    };
    let (whole, path) = (format!("{LIBRARY}{of}"), &file.name);
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

/// The text of `lib:NAME`; `None`: the name is a path.
///
/// # Errors
/// There is no such file: the sentence, and the help.
pub(crate) fn text(path: &str) -> Option<Result<&'static str, (String, String)>> {
    let name = path.strip_prefix(LIBRARY)?;
    let found = FILES.iter().find(|(of, _)| *of == name).map(|(_, text)| *text);
    Some(found.ok_or_else(|| {
        let names = || FILES.iter().map(|(of, _)| *of);
        let list = names().map(|of| format!("`{LIBRARY}{of}`")).collect::<Vec<_>>().join(", ");
        let help = did_you_mean(name, names()).unwrap_or_else(|| format!("there is {list}"));
        (format!("the library has no `{name}`"), help)
    }))
}
