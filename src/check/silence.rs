//! `allow`: which warnings their author silenced, and where.
//!
//! A rung's `allow` silences the warnings that begin in the rung, `[ladder] allow` those of its
//! file. A warning of several places is silenced at the one that it is reported at. Errors are
//! never silenced.

use crate::resolve::program::{Program, Rung};
use crate::source::finding::{Finding, Severity};
use crate::source::span::Span;

/// The findings without those that are allowed; the readers' warnings may be among them.
pub fn silence(program: &Program, findings: Vec<Finding>) -> Vec<Finding> {
    let silenced = |finding: &Finding| {
        let name = finding.code.name();
        let on_file = program
            .allow
            .iter()
            .any(|(allowed, span)| allowed == name && span.file == finding.span.file);
        on_file || allowing_rungs(program, name).any(|rung| begins_in(rung.extent, finding.span))
    };
    findings.into_iter().filter(|f| f.severity() == Severity::Error || !silenced(f)).collect()
}

fn allowing_rungs<'a>(program: &'a Program, name: &'a str) -> impl Iterator<Item = &'a Rung> {
    let rungs = program.blocks.iter().flat_map(|block| {
        block.rungs.iter().chain(block.stages.iter().flat_map(|stage| &stage.rungs))
    });
    rungs.filter(move |rung| rung.allow.iter().any(|(allowed, _)| allowed == name))
}

fn begins_in(extent: Span, span: Span) -> bool {
    extent.file == span.file && (extent.start..extent.end).contains(&span.start)
}
