//! Prints findings as rustc does: each with its place, the source line, and a help.
//!
//! Called by the commands, with the files in the order of their numbers. It returns text and prints
//! nothing itself; without `color` the text has no escape codes.
//!
//! A generated file may be one line of megabytes with a finding at every place. Therefore at most
//! `SHOWN_MAX` findings are drawn, and only an excerpt of a long line.

use std::borrow::Cow;
use std::ops::Range;

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet};

use super::finding::{Finding, Severity};
use super::span::{FileId, SourceFile, Span};
use super::wording::{is_obeyed, shown_name};
use rungd_base::progress::{Progress, UNASKED};

/// How findings are printed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    /// With the escape codes of a terminal.
    pub color: bool,
    /// Warnings count as errors.
    pub deny_warnings: bool,
}

/// Maximum number of findings shown: a person corrects no more at a time.
const SHOWN_MAX: usize = 100;
/// Number of bytes of a long line that are kept on each side of the places in it. This is more than
/// any excerpt of the drawing library, so that the library sets the ellipsis.
const AROUND_BYTES: usize = 600;
/// Number of bytes of a long place that are drawn.
const PLACE_BYTES: usize = 600;
/// Marks the end of a file's name. The drawing library adds the place within the excerpt after it;
/// this wrong place is removed.
const EXCERPT: char = '\u{1}';

/// The findings in the order given, and a last line with their count. If there are more than
/// `SHOWN_MAX`, only the first ones are shown, and warnings only if there is room after all errors.
pub fn render(findings: &[Finding], files: &[SourceFile], style: Style) -> String {
    render_within(findings, files, style, &UNASKED)
}

/// As [`render`], for a load that its caller may end. If the load must end, findings are missing.
pub fn render_within(
    findings: &[Finding],
    files: &[SourceFile],
    style: Style,
    progress: &Progress,
) -> String {
    let renderer = if style.color { Renderer::styled() } else { Renderer::plain() };
    let mut ends = vec![0; files.len()];
    let own = findings.iter().map(|finding| finding.span);
    let related = findings.iter().flat_map(|finding| finding.related.iter().map(|(span, _)| *span));
    for span in own.chain(related) {
        if let Some(end) = ends.get_mut(span.file.0 as usize) {
            *end = span.end.max(*end);
        }
    }
    let lines: Vec<LineStarts> = files
        .iter()
        .zip(ends)
        .map(|(file, end)| LineStarts::of(&file.text, end as usize))
        .collect();
    let is_error = |finding: &&Finding| severity(finding, style) == Severity::Error;
    let errors = findings.iter().filter(is_error).count();
    let mut room = [SHOWN_MAX.min(errors), SHOWN_MAX.saturating_sub(errors)];
    let (mut text, mut left_out) = (String::new(), Vec::new());
    for finding in progress.during(findings) {
        let room = &mut room[usize::from(!is_error(&finding))];
        if *room == 0 {
            left_out.push(finding);
            continue;
        }
        *room -= 1;
        let drawn = renderer.render(&[group(finding, files, &lines, style)]);
        text.push_str(&without_places_of_excerpts(drawn));
        text.push_str("\n\n");
    }
    text.push_str(&more(&left_out, style));
    text.push_str(&count(findings, style));
    text.push('\n');
    text
}

/// `and 12 more errors`, on a line of its own.
fn more(left_out: &[&Finding], style: Style) -> String {
    let errors = left_out.iter().filter(|f| severity(f, style) == Severity::Error).count();
    let counts = [(errors, "error"), (left_out.len() - errors, "warning")];
    let some = counts.iter().filter(|(n, _)| *n > 0);
    let words: Vec<String> = some.map(|(n, what)| plural(*n, &format!("more {what}"))).collect();
    if words.is_empty() { String::new() } else { format!("and {}\n\n", words.join(", ")) }
}

fn without_places_of_excerpts(mut drawn: String) -> String {
    while let Some(at) = drawn.find(EXCERPT) {
        let behind = drawn[at + 1..].find(|c: char| c != ':' && !c.is_ascii_digit());
        let end = behind.map_or(drawn.len(), |behind| at + 1 + behind);
        drawn.replace_range(at..end, "");
    }
    drawn
}

/// Whether the findings cause the command to refuse: an error, or a warning with `--deny warnings`.
pub fn refuses(findings: &[Finding], style: Style) -> bool {
    findings.iter().any(|finding| severity(finding, style) == Severity::Error)
}

/// `3 errors, 1 warning`.
pub(crate) fn count(findings: &[Finding], style: Style) -> String {
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

/// The starts of a file's lines, computed once: many findings are printed, each with its line
/// number.
struct LineStarts(Vec<usize>);

impl LineStarts {
    /// The starts up to the line with the place `end`.
    fn of(text: &str, end: usize) -> LineStarts {
        let rest = text.as_bytes().get(end..).unwrap_or_default();
        let length = rest.iter().position(|byte| *byte == b'\n').map_or(rest.len(), |at| at + 1);
        let behind = text.bytes().take(end + length).enumerate();
        let behind = behind.filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        LineStarts(std::iter::once(0).chain(behind).collect())
    }

    /// The number, from 1, of the line of a byte.
    fn number(&self, at: usize) -> usize {
        self.0.partition_point(|start| *start <= at)
    }

    /// The range of the line of a byte, without its line end.
    fn bounds(&self, at: usize, text: &str) -> Range<usize> {
        let number = self.number(at);
        let end = self.0.get(number).map_or(text.len(), |next| next - 1);
        self.0[number - 1]..end
    }
}

fn group<'a>(
    finding: &'a Finding,
    files: &'a [SourceFile],
    lines: &[LineStarts],
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
    if let Some(help) = finding.help_text() {
        group = group.element(Level::HELP.message(help));
    }
    group
}

/// A related place of the same file that is farther than this from the finding's place has its own
/// snippet.
const FAR_BYTES: u32 = 4_096;

/// The snippets of a finding: first that of its place with near related places, then one for each
/// other file, and one for distant related places of its own file.
fn snippets<'a>(
    finding: &'a Finding,
    files: &'a [SourceFile],
    lines: &[LineStarts],
) -> Vec<Snippet<'a, Annotation<'a>>> {
    // The drawing library reads all lines between the places of a snippet, so distant places get
    // their own.
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
        let (text, lines) = (&source.text, lines.get(file.0 as usize)?);
        let spans: Vec<Range<usize>> =
            places(part).map(|(span, ..)| clamp(span, text, lines)).collect();
        let ExcerptLines { range: window, is_cut } = window(&spans, text, lines);
        let excerpt = &text[window.clone()];
        let mut snippet = Snippet::source(shown_excerpt(excerpt))
            .line_start(lines.number(window.start))
            .path(if is_cut {
                excerpt_title(source, lines, &spans)
            } else {
                shown_name(&source.name)
            });
        for ((_, label, kind), span) in places(part).zip(spans) {
            let at = |byte: usize| shown_place(excerpt, byte - window.start);
            let span = at(span.start)..at(span.end);
            let label = (!label.is_empty()).then_some(label);
            snippet = snippet.annotation(kind.span(span).label(label));
        }
        Some(snippet)
    };
    order.into_iter().filter_map(snippet).collect()
}

/// An excerpt without the `\r` of Windows line ends, which would be drawn at the end of each line,
/// and with U+FFFD in the place of every other character that a terminal obeys. The drawing library
/// replaces those of ASCII itself.
fn shown_excerpt(excerpt: &str) -> Cow<'_, str> {
    let excerpt = match excerpt.contains('\r') {
        true => {
            let excerpt = excerpt.replace("\r\n", "\n");
            Cow::Owned(excerpt.strip_suffix('\r').map(str::to_owned).unwrap_or(excerpt))
        }
        false => Cow::Borrowed(excerpt),
    };
    match excerpt.contains(is_replaced) {
        true => Cow::Owned(excerpt.replace(is_replaced, "\u{fffd}")),
        false => excerpt,
    }
}

fn is_replaced(c: char) -> bool {
    is_obeyed(c) && !c.is_ascii()
}

/// The place in the result of [`shown_excerpt`] for a place in the excerpt.
fn shown_place(excerpt: &str, at: usize) -> usize {
    let before = excerpt.match_indices('\r').take_while(|(place, _)| *place < at);
    let gone = |place: usize| matches!(excerpt.as_bytes().get(place + 1), Some(b'\n') | None);
    let returns = before.filter(|(place, _)| gone(*place)).count();
    let replaced = excerpt.get(..at).unwrap_or(excerpt).matches(is_replaced);
    let grown: usize = replaced.map(|c| '\u{fffd}'.len_utf8() - c.len()).sum();
    at - returns + grown
}

/// A place as a range of whole characters within the text: one character wide if the place is
/// empty, and at most `PLACE_BYTES` long within one line.
fn clamp(span: Span, text: &str, lines: &LineStarts) -> Range<usize> {
    let start = boundary(span.start as usize, text);
    let end = boundary(span.end as usize, text).max(start);
    if end > start + PLACE_BYTES && lines.number(start) == lines.number(end) {
        return start..boundary(start + PLACE_BYTES, text);
    }
    if end > start {
        return start..end;
    }
    let next = text[start..].chars().next().filter(|c| *c != '\n' && *c != '\r');
    start..start + next.map_or(0, char::len_utf8)
}

/// The start of the character that a byte belongs to; the end of the text for a byte beyond it.
fn boundary(at: usize, text: &str) -> usize {
    let at = at.min(text.len());
    (0..=at).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0)
}

/// The lines with the places of a finding.
struct ExcerptLines {
    range: Range<usize>,
    /// Whether the front of the first line was cut off.
    is_cut: bool,
}

/// The lines with the places; of a long line, only the text around the places. So the drawing
/// library need not read the rest of a large file.
fn window(spans: &[Range<usize>], text: &str, lines: &LineStarts) -> ExcerptLines {
    let start = spans.iter().map(|s| s.start).min().unwrap_or(0);
    let end = spans.iter().map(|s| s.end).max().unwrap_or(0);
    let (first, last) = (lines.bounds(start, text), lines.bounds(end, text));
    let from = first.start.max(boundary(start.saturating_sub(AROUND_BYTES), text));
    let to = last.end.min(boundary(end + AROUND_BYTES, text));
    ExcerptLines { range: from..to, is_cut: from > first.start }
}

/// A file's name with the finding's place in the whole file. The drawing library has only the
/// excerpt; the place that it prints is removed.
fn excerpt_title(source: &SourceFile, lines: &LineStarts, spans: &[Range<usize>]) -> String {
    let start = spans.first().map_or(0, |span| span.start);
    let line = lines.bounds(start, &source.text).start;
    let column = source.text[line..start].chars().count() + 1;
    format!("{}:{}:{column}{EXCERPT}", shown_name(&source.name), lines.number(start))
}
