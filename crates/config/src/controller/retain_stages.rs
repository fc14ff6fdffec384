//! `[retain] stages`: the Programs that the patterns name.
//!
//! Called by [`super`], beside the tags. In a pattern `*` stands for any part of a name. A use of a
//! template as the body of a Program has the name of that Program.
//!
//! ```toml
//! # passes: a Program with Stages by its name, and all that begin with `Flush`
//! [retain]
//! stages = ["Batch", "Flush*"]      # fails with "Main": it has no Stages
//! ```

use super::retain_tags::NamePattern;
use rungd_engine::isa::BlockId;
use rungd_language::resolve::program::{Block, Program};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{FixEdit, Help, possible};
use rungd_language::source::nearest::KnownNames;
use rungd_language::source::reader::Text;
use rungd_language::source::span::{Located, Span};

/// The Programs that the patterns name, in file order, each once, at the first of its patterns.
pub(super) fn resolve(
    patterns: &[Text],
    program: &Program,
    findings: &mut Vec<Finding>,
) -> Vec<Located<BlockId>> {
    let mut places: Vec<Option<Span>> = vec![None; program.blocks.len()];
    for pattern in patterns {
        let fitting = NamePattern::of(&pattern.text);
        let named = || program.blocks.iter().filter(|block| fitting.fits(&block.name));
        let with_stages = || named().filter(|block| !block.stages.is_empty());
        match named().next() {
            None => findings.push(nothing(pattern, program)),
            Some(block) if with_stages().next().is_none() => {
                findings.push(without_stages(pattern, block));
            }
            Some(_) => {
                for block in with_stages() {
                    places[block.id.0 as usize].get_or_insert(pattern.span);
                }
            }
        }
    }
    let named = program.blocks.iter().map(|block| (block.id, places[block.id.0 as usize]));
    named.filter_map(|(value, span)| Some(Located { value, span: span? })).collect()
}

fn nothing(pattern: &Text, program: &Program) -> Finding {
    let text = &pattern.text;
    let message = match text.contains('*') {
        true => format!("no Program has a name like `{text}`"),
        false => format!("no Program is called `{text}`"),
    };
    let with_stages = program.blocks.iter().filter(|block| !block.stages.is_empty());
    let known = KnownNames::new(with_stages.map(|block| block.name.as_str()));
    let help = Help::from("name Programs with Stages here").with(possible(FixEdit::Omit));
    Finding::new(Code::UnknownName, pattern.span, message).help(help).near(text, &known)
}

fn without_stages(pattern: &Text, block: &Block) -> Finding {
    let message = format!("`{}` has no Stages to retain", block.name);
    let help = "name Programs with Stages here; data belongs in `tags` and `ranges`";
    Finding::new(Code::RetainRange, pattern.span, message).help(help).or_omit()
}
