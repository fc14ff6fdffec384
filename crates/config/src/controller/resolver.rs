//! The tools that resolve the tables of a controller file: the ladders' names, and the findings.

use rungd_base::progress::Progress;
use rungd_engine::isa::{Address, Bit, BitSpace, Space};
use rungd_language::resolve::range::{Range, resolve_range};
use rungd_language::resolve::scope::{LookUp, NamedThing, Scope};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::reader::Text;
use rungd_language::source::span::Span;

/// The spaces that a key's ranges may name.
pub struct AllowedSpaces<'a> {
    pub spaces: &'a [Space],
    pub words: &'static str,
    pub code: Code,
}

/// The names that resolving needs, the findings that it makes, and the progress of the load.
pub struct SettingsResolver<'a> {
    pub scope: &'a Scope,
    pub findings: Vec<Finding>,
    pub progress: &'a Progress,
}

impl SettingsResolver<'_> {
    pub fn ranges(&mut self, texts: &[Text], wanted: &AllowedSpaces<'_>) -> Vec<Range> {
        let progress = self.progress;
        progress.during(texts).filter_map(|text| self.range(text, wanted)).collect()
    }

    pub fn range(&mut self, text: &Text, wanted: &AllowedSpaces<'_>) -> Option<Range> {
        let range = match resolve_range(self.scope, text) {
            Ok(range) => range,
            Err(finding) => {
                let help =
                    || format!("no ladder declares it; this key accepts {}", wanted.words).into();
                self.findings.push(finding.declared_as(help));
                return None;
            }
        };
        if !wanted.spaces.contains(&range.space) {
            let (name, words) = (text.text.trim(), wanted.words);
            let message = format!("`{name}`: this key accepts only {words}");
            let finding = Finding::new(wanted.code, text.span, message);
            let finding = match wanted.spaces {
                [Space::Bit(BitSpace::Y)] => {
                    finding.help("name the output that it drives, as `Y0`, or a tag of it")
                }
                _ => finding,
            };
            self.findings.push(finding.or_omit());
            return None;
        }
        Some(range)
    }

    /// The address of a name, or the reason why it has none. `None` after a finding about the name.
    pub fn address(&mut self, name: &str, span: Span) -> Option<Result<Address, String>> {
        match self.scope.look_up(name) {
            Ok(LookUp { thing: NamedThing::Address(address), .. }) => Some(Ok(address)),
            Ok(_) => Some(self.scope.address(name)),
            Err(mistake) => {
                self.findings.extend(mistake.finding(span));
                None
            }
        }
    }

    pub fn bit(&mut self, name: Option<&Text>) -> Option<Bit> {
        let name = name?;
        let message = match self.address(&name.text, name.span)? {
            Ok(Address::Bit(bit)) => return Some(bit),
            Ok(_) => format!("`{}` is not a bit", name.text),
            Err(message) => message,
        };
        self.findings.push(Finding::new(Code::Controller, name.span, message));
        None
    }
}
