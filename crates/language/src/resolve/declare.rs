//! Declares the names of all tags, blocks, stages and devices, before rungs are resolved.
//!
//! Called by `plain`. Fills the scope, and the program's blocks and stages, still without rungs.

use std::collections::HashMap;

use super::Resolver;
use super::alarm_terms::WrittenAck;
use super::layers::Layers;
use super::names::{NameRole, forbidden, kept};
use super::program::{Block, BlockKind, Program, Stage};
use super::record::RecordTag;
use super::scope::BlockNames;
use super::tag_words::TagWords;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{FixEdit, Help, advise, meant, pair, possible};
use crate::source::ladder::{self, BlockForm, FieldOfTag, Ladder, WrittenTag};
use crate::source::nearest::{KnownNames, nearest};
use crate::source::reader::Text;
use crate::source::renaming;
use crate::source::span::{FileId, Span};
use rungd_engine::isa::{BlockId, DeviceId, StageId};

/// The built-in tasks: no instruction starts them.
pub(super) const BUILT_IN: [(&str, BlockKind); 4] = [
    ("FirstScan", BlockKind::FirstScan),
    ("TopOfScan", BlockKind::TopOfScan),
    ("BottomOfScan", BlockKind::BottomOfScan),
    ("LastScan", BlockKind::LastScan),
];

impl Resolver<'_> {
    /// Declares everything that has a name.
    pub(super) fn declare(&mut self, ladders: &[(FileId, Ladder)], program: &mut Program) {
        // Tags and blocks share one namespace over all files.
        let mut names: HashMap<String, Span> = Resolver::taken_names(program);
        self.declare_records(ladders, &mut names);
        self.place_typed(ladders);
        self.tag_words = TagWords::of(ladders, self.scope.places(), &self.options.sizes);
        let ladders = || ladders.iter().map(|(_, ladder)| ladder);
        let tags = ladders().flat_map(|ladder| &ladder.tags);
        for tag in self.options.progress.during(tags) {
            match &tag.field {
                Some(field) => self.declare_field(tag, field, &mut names),
                // The names of a use's own tags are checked in its template.
                None if !Layers::is_layered(tag.name.span) => {
                    self.declare_name(&tag.name, NameRole::Tag, &mut names);
                }
                None => {}
            }
            let (index, before) = (program.tags.len(), self.findings.len());
            let meaning = match &tag.count {
                Some(count) => self.array_tag(tag, count, program),
                None => self.tag(tag, program),
            };
            if let Some(ack) = tag.ack.as_ref().filter(|_| tag.count.is_none() && meaning.is_some())
            {
                self.acks.push(WrittenAck { tag: index, name: ack.clone() });
            }
            self.scope.add_tag(&tag.name.text, index, meaning);
            if let Some(field) = &tag.field {
                self.scope.add_field(&field.field, meaning.map(|_| index));
                self.drop_repeated(before);
            }
        }
        program.records = self.scope.records().to_vec();
        self.used = vec![false; program.tags.len()];
        for block in ladders().flat_map(|ladder| &ladder.blocks) {
            if let Some(name) = block.name.as_ref().filter(|n| !Layers::is_layered(n.span)) {
                self.declare_name(name, NameRole::Block(block.form), &mut names);
            }
            self.declare_block(block, program);
        }
        for name in std::mem::take(&mut self.use_names) {
            self.declare_name(&name, NameRole::Use, &mut names);
        }
        self.uses.iter().for_each(|name| self.scope.add_use(name.clone()));
        // The tags of these uses are unknown because their templates are, which is already
        // reported.
        self.unknown_uses.iter().for_each(|name| self.scope.add_unknown_use(name.clone()));
        self.declare_devices(ladders(), &mut names, program);
        self.check_aliases(program);
        self.check_units(program);
        self.check_texts(program);
        // A program without a name may be intended as `Main`.
        let has_main = |block: &Block| block.name == "Main" || block.name.is_empty();
        let programs = program.blocks.iter().any(|block| block.kind == BlockKind::Program);
        let lost = self.misread && !programs;
        if !lost && !program.blocks.iter().any(has_main) {
            let own = ladders().flat_map(|ladder| &ladder.templates);
            let templates: Vec<&Text> = own.filter_map(|template| template.name.as_ref()).collect();
            self.no_main(program, &templates);
        }
    }

    /// Declares the names of all records.
    fn declare_records(&mut self, ladders: &[(FileId, Ladder)], names: &mut HashMap<String, Span>) {
        let records = ladders.iter().flat_map(|(_, ladder)| &ladder.records);
        for name in records.filter_map(|record| record.name.as_ref()) {
            self.declare_name(name, NameRole::Record, names);
        }
    }

    /// Removes the findings from an index on that a field has already got for another tag.
    fn drop_repeated(&mut self, from: usize) {
        let new = self.findings.split_off(from);
        for finding in new {
            if self.field_findings.insert((finding.code, finding.span)) {
                self.findings.push(finding);
            }
        }
    }

    /// Declares a tag that stands for a field of a tag of records.
    fn declare_field(
        &mut self,
        tag: &WrittenTag,
        field: &FieldOfTag,
        names: &mut HashMap<String, Span>,
    ) {
        let is_first = self
            .scope
            .records()
            .last()
            .is_none_or(|last| (&last.name, last.span) != (&field.tag.text, field.tag.span));
        if is_first {
            if !Layers::is_layered(field.tag.span) {
                self.declare_name(&field.tag, NameRole::Tag, names);
            }
            self.scope.add_record(RecordTag {
                name: field.tag.text.clone(),
                record: field.record.clone(),
                span: field.tag.span,
                doc: field.doc.clone(),
                count: tag.count.as_ref().and_then(|count| u32::try_from(count.value).ok()),
                fields: Vec::new(),
            });
        }
    }

    /// Declares the devices of the controller file, then those that only a ladder file names.
    fn declare_devices<'l>(
        &mut self,
        ladders: impl Iterator<Item = &'l Ladder>,
        names: &mut HashMap<String, Span>,
        program: &mut Program,
    ) {
        let options = self.options;
        let known = KnownNames::new(options.devices.iter().map(|device| device.text.as_str()));
        let real = options.devices.iter().map(|name| (name, true));
        let said = ladders.flat_map(|ladder| &ladder.devices).map(|name| (name, false));
        for (name, real) in real.chain(said) {
            if !real && self.scope.has_device(&name.text) {
                continue;
            }
            self.declare_name(name, NameRole::Device, names);
            if !real && options.has_controller {
                let message = format!("the controller file has no device `{}`", name.text);
                let finding = Finding::new(Code::UnknownName, name.span, message)
                    .help(format!("add a `[[device]]` with `name = \"{}\"`", name.text));
                self.find(finding.near(&name.text, &known));
            }
            self.scope.add_device(&name.text, DeviceId(program.devices.len() as u32));
            program.devices.push(kept(&name.text));
        }
    }

    fn no_main(&mut self, program: &Program, templates: &[&Text]) {
        let find = |span| Finding::new(Code::NoMain, span, "no program is called `Main`");
        // The trial of a template has a block that is in no file.
        let blocks = || program.blocks.iter().filter(|block| !Layers::is_layered(block.span));
        if let Some(block) = blocks().find(|block| block.name.eq_ignore_ascii_case("Main")) {
            let name = [pair("name = \"Main\"").proposed()];
            let help = advise("write `{}`: names are case-sensitive", name);
            return self.find(find(block.span).help(help));
        }
        let near = nearest("Main", blocks().map(|block| &*block.name));
        if let Some(block) = blocks().find(|block| near == Some(&*block.name)) {
            return self.find(find(block.span).help(meant("Main")));
        }
        if let Some(name) = templates.iter().find(|name| name.text.eq_ignore_ascii_case("Main")) {
            let finding = find(name.span).label("this is a template");
            return self.find(finding.help(main_program(
                "a template runs where it is used. The program that always runs is:",
            )));
        }
        let start = Span { file: self.options.first_file, start: 0, end: 0 };
        self.find(
            find(start).help(main_program(
                "Main is the program that always runs; without it nothing runs:",
            )),
        );
    }

    fn declare_name(&mut self, name: &Text, role: NameRole, names: &mut HashMap<String, Span>) {
        if let Some(finding) = forbidden(name, role) {
            self.find(finding);
        }
        if let Some(first) = names.get(&name.text) {
            let message = format!("the name `{}` is taken", name.text);
            let finding = Finding::new(Code::DuplicateName, name.span, message)
                .label("again here")
                .related(*first, "first here")
                .help(match role {
                    NameRole::Device => {
                        "devices share one set of names with tags, programs and tasks"
                    }
                    NameRole::Tag
                    | NameRole::Block(_)
                    | NameRole::Stage
                    | NameRole::Template
                    | NameRole::Parameter
                    | NameRole::Record
                    | NameRole::Field => {
                        "tags, programs and tasks share one set of names, over all files"
                    }
                    NameRole::Use => {
                        "uses share one set of names with tags, programs and tasks, over all files"
                    }
                });
            let fix = renaming::another(&name.text, '_', |name| names.contains_key(name));
            self.find(finding.fix(fix));
            return;
        }
        names.insert(name.text.clone(), name.span);
    }

    fn declare_block(&mut self, block: &ladder::WrittenBlock, program: &mut Program) {
        let id = BlockId(program.blocks.len() as u32);
        let name = block.name.as_ref().map_or("", |name| &name.text);
        let kind = self.block_kind(block, name);
        let mut stages = Vec::new();
        let mut stage_names: HashMap<String, Span> = HashMap::new();
        let mut ids = HashMap::new();
        for stage in &block.stages {
            let stage_id = StageId(program.stages.len() as u32);
            program.stages.push((id, stages.len()));
            let (text, span) = match &stage.name {
                Some(name) => {
                    self.declare_stage(name, &mut stage_names);
                    ids.entry(name.text.clone()).or_insert(stage_id);
                    (kept(&name.text), name.span)
                }
                None => (String::new(), stage.span),
            };
            let doc = stage.doc.clone();
            stages.push(Stage { id: stage_id, name: text, doc, span, rungs: Vec::new() });
        }
        if block.name.is_some() {
            self.scope.add_block(name, BlockNames::new(id, kind, ids));
        }
        program.blocks.push(Block {
            id,
            name: kept(name),
            doc: block.doc.clone(),
            span: block.name.as_ref().map_or(block.span, |name| name.span),
            kind,
            autostart: self.autostart(block, name),
            retains_stages: false,
            rungs: Vec::new(),
            stages,
        });
    }

    fn declare_stage(&mut self, name: &Text, names: &mut HashMap<String, Span>) {
        if let Some(finding) = forbidden(name, NameRole::Stage) {
            self.find(finding);
        }
        if let Some(first) = names.get(&name.text) {
            let message = format!("this program has a stage `{}` already", name.text);
            let fix = renaming::another(&name.text, '_', |name| names.contains_key(name));
            let finding = Finding::new(Code::DuplicateName, name.span, message)
                .label("again here")
                .related(*first, "first here");
            self.find(finding.fix(fix));
            return;
        }
        names.insert(name.text.clone(), name.span);
    }

    fn block_kind(&mut self, block: &ladder::WrittenBlock, name: &str) -> BlockKind {
        let built_in = BUILT_IN.iter().find(|(built_in, _)| *built_in == name);
        let span = block.name.as_ref().map_or(block.span, |name| name.span);
        match (block.form, built_in) {
            (BlockForm::Task, Some((_, kind))) => return *kind,
            (BlockForm::Program | BlockForm::Subroutine, Some(_)) => {
                let message = format!("`{name}` is the name of a built-in task");
                let finding = Finding::new(Code::ForbiddenName, span, message);
                let finding = finding.help("write `[[task]]`, or take another name");
                self.find(finding.fix(possible(format!("{name}_2"))));
            }
            (BlockForm::Task | BlockForm::Subroutine, None) if name == "Main" => {
                let what = if block.form == BlockForm::Task { "task" } else { "subroutine" };
                let message = format!("`Main` is the program that always runs, not a {what}");
                let finding = Finding::new(Code::ForbiddenName, span, message);
                let finding = finding.help("write `[[program]]`, or take another name");
                self.find(finding.fix(possible("Main_2")));
            }
            _ => {}
        }
        match block.form {
            BlockForm::Program => BlockKind::Program,
            BlockForm::Task => BlockKind::Task,
            BlockForm::Subroutine => BlockKind::Subroutine,
        }
    }

    fn autostart(&mut self, block: &ladder::WrittenBlock, name: &str) -> bool {
        let main = name == "Main" && block.form == BlockForm::Program;
        if let Some(autostart) = &block.autostart
            && main
            && !autostart.value
        {
            let message = "`Main` always runs: it cannot be kept from starting";
            let finding = Finding::new(Code::BlockRule, autostart.span, message);
            let help = "take `autostart` away, or give the program another name";
            self.find(finding.help(help).fix(FixEdit::Remove("autostart")));
        }
        main || block.autostart.as_ref().is_some_and(|autostart| autostart.value)
    }
}

/// The help to add the program `Main`.
fn main_program(words: &str) -> Help {
    let lines = "[[program]]\nname = \"Main\"".to_owned();
    advise(&format!("{words}\n{{}}"), [FixEdit::Lines { lines, instead: None }])
}
