//! The nesting of templates: none uses itself, and none is nested too deeply.
//!
//! Works in loops without recursion: files may nest ten thousand templates.

use super::declared::{Templates, uses};
use crate::source::finding::{Code, Finding};
use crate::source::fix::FixEdit;
use crate::source::ladder::Use;

/// Maximum nesting depth of templates.
const DEPTH_MAX: usize = 32;
/// Maximum number of templates that a finding about a circle names.
const NAMED_MAX: usize = 8;

/// Reports circles, and nesting that is too deep; such templates are not usable.
pub(super) fn check(templates: &mut Templates, findings: &mut Vec<Finding>) {
    let inner: Vec<Vec<(usize, &Use)>> = templates
        .all
        .iter()
        .map(|declared| {
            uses(declared.template)
                .filter_map(|template_use| Some((templates.position(template_use)?, template_use)))
                .collect()
        })
        .collect();
    let depths = depths(&inner);
    circles(templates, &inner, &depths, findings);
    for (at, depth) in depths.iter().enumerate() {
        let Some(depth) = *depth else { continue };
        if depth == DEPTH_MAX + 1
            && let Some((_, template_use)) =
                inner[at].iter().find(|(to, _)| depths[*to] == Some(DEPTH_MAX))
        {
            let message = format!("templates are nested more than {DEPTH_MAX} levels deep");
            let finding = Finding::new(Code::TemplateSize, template_use.span, message);
            findings.push(finding.help("write the rungs of some of them without templates"));
        }
    }
    for (declared, depth) in templates.all.iter_mut().zip(depths) {
        declared.is_usable &= depth.is_some_and(|depth| depth <= DEPTH_MAX);
    }
}

/// The nesting depth of each template, itself included; `None` if it is in a circle, or uses a
/// template that is.
fn depths(inner: &[Vec<(usize, &Use)>]) -> Vec<Option<usize>> {
    let mut outer = vec![Vec::new(); inner.len()];
    let mut waiting: Vec<usize> = inner.iter().map(Vec::len).collect();
    for (at, uses) in inner.iter().enumerate() {
        uses.iter().for_each(|(to, _)| outer[*to].push(at));
    }
    let mut depths = vec![None; inner.len()];
    let mut ready: Vec<usize> = (0..inner.len()).filter(|at| waiting[*at] == 0).collect();
    while let Some(at) = ready.pop() {
        let deepest = inner[at].iter().filter_map(|(to, _)| depths[*to]).max();
        depths[at] = Some(deepest.unwrap_or(0) + 1);
        for &of in &outer[at] {
            waiting[of] -= 1;
            if waiting[of] == 0 {
                ready.push(of);
            }
        }
    }
    depths
}

/// Goes from each template without a depth to its first inner template without a depth, and so on:
/// this ends in a circle.
fn circles(
    templates: &Templates,
    inner: &[Vec<(usize, &Use)>],
    depths: &[Option<usize>],
    findings: &mut Vec<Finding>,
) {
    let mut seen = vec![0; inner.len()];
    for begin in 0..inner.len() {
        let (mut at, mut path) = (begin, Vec::new());
        while depths[at].is_none() && seen[at] == 0 {
            seen[at] = begin + 1;
            let Some(next) = inner[at].iter().find(|(to, _)| depths[*to].is_none()) else { break };
            path.push((at, next.1));
            at = next.0;
        }
        if depths[at].is_some() || seen[at] != begin + 1 {
            continue;
        }
        let Some(first) = path.iter().position(|(template, _)| *template == at) else { continue };
        let names = path[first..].iter().map(|(template, _)| templates.all[*template].name());
        let mut names: Vec<&str> = names.chain([templates.all[at].name()]).collect();
        if names.len() > NAMED_MAX {
            names.splice(NAMED_MAX / 2..names.len() - NAMED_MAX / 2, ["…"]);
        }
        let Some((_, last)) = path.last() else { continue };
        let message = format!("a template cannot use itself: {}", names.join(" → "));
        let finding = Finding::new(Code::TemplateRecursion, last.span, message);
        findings.push(finding.label("this use").help("take this use away").fix(FixEdit::Delete));
    }
}
