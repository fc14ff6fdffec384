//! Findings → text, in the manner of rustc: each with its place, the source line, and a help.
//!
//! Called by the commands at the edge, with the files in the order of their numbers. Nothing here
//! decides what is printed where; without `color` there is no escape code in the text.

use std::ops::Range;

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet};

use super::finding::{Finding, Severity};
use super::span::{FileId, SourceFile, Span};

/// How findings are shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    /// With the escape codes of a terminal.
    pub color: bool,
    /// Warnings count as errors.
    pub deny_warnings: bool,
}

/// All findings in the order given, and a last line that counts them.
pub fn render(findings: &[Finding], files: &[SourceFile], style: Style) -> String {
    let renderer = if style.color { Renderer::styled() } else { Renderer::plain() };
    let lines: Vec<Lines> = files.iter().map(|file| Lines::of(&file.text)).collect();
    let mut text = String::new();
    for finding in findings {
        text.push_str(&renderer.render(&[group(finding, files, &lines, style)]));
        text.push_str("\n\n");
    }
    text.push_str(&count(findings, style));
    text.push('\n');
    text
}

/// Whether findings refuse what was asked for.
pub fn refuses(findings: &[Finding], style: Style) -> bool {
    findings.iter().any(|finding| severity(finding, style) == Severity::Error)
}

/// `3 errors, 1 warning`.
pub fn count(findings: &[Finding], style: Style) -> String {
    let errors = findings.iter().filter(|f| severity(f, style) == Severity::Error).count();
    let warnings = findings.len() - errors;
    format!("{}, {}", plural(errors, "error"), plural(warnings, "warning"))
}

fn severity(finding: &Finding, style: Style) -> Severity {
    if style.deny_warnings { Severity::Error } else { finding.severity() }
}

fn plural(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// Where the lines of a file begin: many findings are printed, and each wants its number.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Lines {
        let behind = text.match_indices('\n').map(|(at, _)| at + 1);
        Lines(std::iter::once(0).chain(behind).collect())
    }

    /// The number, from 1, of the line that a byte stands in.
    fn number(&self, at: usize) -> usize {
        self.0.partition_point(|start| *start <= at)
    }
}

fn group<'a>(
    finding: &'a Finding,
    files: &'a [SourceFile],
    lines: &[Lines],
    style: Style,
) -> Group<'a> {
    let level = match severity(finding, style) {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut group =
        Group::with_title(level.primary_title(finding.message.as_str()).id(finding.code.name()));
    for snippet in snippets(finding, files, lines) {
        group = group.element(snippet);
    }
    if let Some(help) = &finding.help {
        group = group.element(Level::HELP.message(help.as_str()));
    }
    group
}

/// How far from a finding's place another of the same file has a snippet of its own.
const FAR_BYTES: u32 = 4_096;

/// One snippet a file: the finding's own first, then those of related places elsewhere.
fn snippets<'a>(
    finding: &'a Finding,
    files: &'a [SourceFile],
    lines: &[Lines],
) -> Vec<Snippet<'a, Annotation<'a>>> {
    // The drawing looks at all lines between the places of a snippet: far ones go apart.
    let own = finding.span;
    let key = |span: Span| {
        (span.file, span.file == own.file && span.start.abs_diff(own.start) > FAR_BYTES)
    };
    let mut order: Vec<(FileId, bool)> = vec![(own.file, false)];
    for (span, _) in &finding.related {
        if !order.contains(&key(*span)) {
            order.push(key(*span));
        }
    }
    let places = |part: (FileId, bool)| {
        let own = (finding.span, finding.label.as_str(), AnnotationKind::Primary);
        let related = finding.related.iter();
        let related = related.map(|(span, label)| (*span, label.as_str(), AnnotationKind::Context));
        [own].into_iter().chain(related).filter(move |(span, ..)| key(*span) == part)
    };
    let snippet = |part: (FileId, bool)| {
        let file = part.0;
        let source = files.get(file.0 as usize)?;
        let spans: Vec<Range<usize>> =
            places(part).map(|(span, ..)| clamp(span, &source.text)).collect();
        let window = window(&spans, &source.text);
        let first_line = lines.get(file.0 as usize)?.number(window.start);
        let mut snippet = Snippet::source(&source.text[window.clone()])
            .line_start(first_line)
            .path(source.name.as_str());
        for ((_, label, kind), span) in places(part).zip(spans) {
            let span = span.start - window.start..span.end - window.start;
            let label = (!label.is_empty()).then_some(label);
            snippet = snippet.annotation(kind.span(span).label(label));
        }
        Some(snippet)
    };
    order.into_iter().filter_map(snippet).collect()
}

/// A place as a range of whole characters within the text; one character wide if it was empty.
fn clamp(span: Span, text: &str) -> Range<usize> {
    let boundary = |at: usize| {
        let at = at.min(text.len());
        (0..=at).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0)
    };
    let start = boundary(span.start as usize);
    let end = boundary(span.end as usize).max(start);
    if end > start {
        return start..end;
    }
    let next = text[start..].chars().next().filter(|c| *c != '\n' && *c != '\r');
    start..start + next.map_or(0, char::len_utf8)
}

/// The whole lines that the places touch: the rest of a large file need not be looked at.
fn window(spans: &[Range<usize>], text: &str) -> Range<usize> {
    let start = spans.iter().map(|s| s.start).min().unwrap_or(0);
    let end = spans.iter().map(|s| s.end).max().unwrap_or(0);
    let start = text[..start].rfind('\n').map_or(0, |at| at + 1);
    let end = text[end..].find('\n').map_or(text.len(), |at| end + at);
    start..end
}
