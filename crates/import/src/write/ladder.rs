//! The text of a ladder file.

use std::fmt::Write;

use super::text::{array, comment, literal, quoted, quoted_line};
use crate::model::{
    ForeignProject, LadderFile, ProjectBlock, ProjectBlockKind, ProjectRung, ProjectTag,
    ProjectTemplate, RungBody,
};

/// The size of a space of memory.
pub(super) struct SpaceSize {
    pub(super) space: &'static str,
    pub(super) count: u32,
}

/// The spaces that need more than they have by default.
pub(super) fn memory(project: &ForeignProject) -> Vec<SpaceSize> {
    let spaces = [("bit", "C", 2048), ("int", "D", 4096), ("word", "V", 4096), ("real", "R", 1024)];
    let mut sizes = Vec::new();
    for (kind, space, default) in spaces {
        let wanted: u32 = project.files.iter().map(|file| wanted(project, file, kind)).sum();
        // A tenth more, for uses of templates and for what a person adds.
        let wanted = (wanted + wanted / 10 + 256).next_multiple_of(256);
        if wanted > default {
            sizes.push(SpaceSize { space, count: wanted.min(65536) });
        }
    }
    sizes
}

/// How many elements of a kind the tags of a file need.
fn wanted(project: &ForeignProject, file: &LadderFile, kind: &str) -> u32 {
    let fields = |name: &str| {
        let record = project.files.iter().flat_map(|file| &file.records);
        let record = record.into_iter().find(|record| record.name == name);
        let own = record.map(|record| record.fields.iter().filter(|f| f.kind == kind).count());
        own.map_or_else(|| fields_of_part(name, kind), |count| count as u32)
    };
    let of_tag = |tag: &ProjectTag| {
        let is_plain = ["bit", "int", "word", "real"].contains(&tag.kind.as_str());
        let each = match is_plain || tag.at.is_some() {
            true => u32::from(tag.kind == kind),
            false => fields(&tag.kind),
        };
        each.saturating_mul(tag.count.unwrap_or(1))
    };
    file.tags.iter().map(of_tag).fold(0, u32::saturating_add)
}

/// At most how many fields of a kind a record of a part of the project has, with the tags of its
/// template.
fn fields_of_part(record: &str, kind: &str) -> u32 {
    match (record, kind) {
        ("LogixPid", "bit") => 24,
        ("LogixPid", "real") => 44,
        (_, "bit") => 8,
        _ => 3,
    }
}

/// The text of a ladder file.
pub(super) fn text(file: &LadderFile) -> String {
    let mut text = String::new();
    let mut head = String::new();
    if !file.doc.is_empty() {
        head += &format!("doc = {}\n", quoted(&file.doc));
    }
    if !file.allow.is_empty() {
        let names: Vec<String> = file.allow.iter().map(|name| literal(name)).collect();
        head += &format!("allow = [{}]\n", names.join(", "));
    }
    if !head.is_empty() {
        text += &format!("[ladder]\n{head}\n");
    }
    for record in &file.records {
        let _ = writeln!(text, "[[record]]\nname = {}", literal(&record.name));
        doc(&mut text, &record.doc);
        text += "\n[record.fields]\n";
        record.fields.iter().for_each(|field| tag(&mut text, field));
        text.push('\n');
    }
    if !file.tags.is_empty() {
        text += "[tags]\n";
        file.tags.iter().for_each(|one| tag(&mut text, one));
        text.push('\n');
    }
    file.templates.iter().for_each(|one| template(&mut text, one));
    file.blocks.iter().for_each(|one| block(&mut text, one));
    text
}

fn doc(text: &mut String, doc: &str) {
    if !doc.trim().is_empty() {
        *text += &format!("doc = {}\n", quoted(doc));
    }
}

fn tag(text: &mut String, tag: &ProjectTag) {
    let mut keys = Vec::new();
    match &tag.at {
        Some(at) => keys.push(format!("at = {}", literal(at))),
        None => keys.push(format!("type = {}", literal(&tag.kind))),
    }
    keys.extend(tag.count.map(|count| format!("count = {count}")));
    keys.extend(tag.initial.as_ref().map(|initial| format!("initial = {initial}")));
    keys.extend(tag.more.iter().cloned());
    if !tag.doc.trim().is_empty() {
        keys.push(format!("doc = {}", quoted_line(&tag.doc)));
    }
    let _ = writeln!(text, "{} = {{ {} }}", tag.name, keys.join(", "));
}

fn template(text: &mut String, template: &ProjectTemplate) {
    let _ = writeln!(text, "[[template]]\nname = {}", literal(&template.name));
    doc(text, &template.doc);
    text.push_str("\n[template.parameters]\n");
    for parameter in &template.parameters {
        let mut keys = vec![format!("type = {}", literal(&parameter.kind))];
        keys.extend(parameter.initial.as_ref().map(|default| format!("default = {default}")));
        if !parameter.doc.trim().is_empty() {
            keys.push(format!("doc = {}", quoted_line(&parameter.doc)));
        }
        let _ = writeln!(text, "{} = {{ {} }}", parameter.name, keys.join(", "));
    }
    if !template.tags.is_empty() {
        text.push_str("\n[template.tags]\n");
        template.tags.iter().for_each(|own| tag(text, own));
    }
    text.push('\n');
    rungs(text, &template.rungs, "template");
}

fn block(text: &mut String, block: &ProjectBlock) {
    let (header, more) = match block.kind {
        ProjectBlockKind::Program if block.name == "Main" => ("program", ""),
        ProjectBlockKind::Program => ("program", "autostart = true\n"),
        ProjectBlockKind::StartedProgram => ("program", ""),
        ProjectBlockKind::Task => ("task", ""),
        ProjectBlockKind::Subroutine => ("subroutine", ""),
    };
    let _ = writeln!(text, "[[{header}]]\nname = {}", literal(&block.name));
    doc(text, &block.doc);
    *text += more;
    text.push('\n');
    rungs(text, &block.rungs, header);
    for stage in &block.stages {
        let _ = writeln!(text, "[[{header}.stage]]\nname = {}", literal(&stage.name));
        doc(text, &stage.doc);
        text.push('\n');
        rungs(text, &stage.rungs, &format!("{header}.stage"));
    }
}

fn rungs(text: &mut String, rungs: &[ProjectRung], parent: &str) {
    rungs.iter().for_each(|one| rung(text, one, parent));
}

fn rung(text: &mut String, rung: &ProjectRung, parent: &str) {
    if rung.body == RungBody::Comment {
        *text += &format!("{}\n", comment(&rung.doc));
        return;
    }
    let _ = writeln!(text, "[[{parent}.rung]]");
    if let Some(name) = &rung.name {
        let _ = writeln!(text, "name = {}", literal(name));
    }
    doc(text, &rung.doc);
    match &rung.body {
        RungBody::Ladder { when, body, branches } => {
            let _ = writeln!(text, "when = {}", array(when));
            if !body.is_empty() {
                let _ = writeln!(text, "do = {}", array(body));
            }
            for branch in branches {
                let (when, body) = (array(&branch.when), array(&branch.body));
                let _ = writeln!(text, "\n[[{parent}.rung.branch]]\nwhen = {when}\ndo = {body}");
            }
        }
        RungBody::Legs { legs, instruction } => {
            for leg in legs {
                let _ = writeln!(text, "leg.{} = {}", leg.name, array(&leg.contacts));
            }
            let _ = writeln!(text, "do = [{}]", literal(instruction));
        }
        RungBody::Use { template, arguments } => {
            let _ = writeln!(text, "use = {}", literal(template));
            let given = |argument: &crate::model::UseArgument| {
                format!("{} = {}", argument.name, literal(&argument.value))
            };
            let given: Vec<String> = arguments.iter().map(given).collect();
            let _ = writeln!(text, "with = {{ {} }}", given.join(", "));
        }
        RungBody::Todo { reason, was } => {
            let (reason, was) = (quoted_line(reason), quoted_line(was));
            let _ = writeln!(text, "todo = {reason}\nwas = {was}");
        }
        RungBody::Comment => {}
    }
    text.push('\n');
}
