//! Templates by themselves: their names, parameters and own tags, and the uses in them.
//!
//! Called before any use is expanded. A mistake of a template that does not depend on the arguments
//! of its uses is found here, once.

use std::collections::{HashMap, HashSet};

use super::kind::{KINDS, ParameterKind};
use super::parameter::{NamedParameter, TypedParameter};
use super::{given, texts};
use crate::resolve::mistake::LISTED_MAX;
use crate::resolve::mistake::declared_table;
use crate::resolve::names::{NAME_MAX, NameRole, forbidden, kept};
use crate::source::file_kind::LIBRARY;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Fix, FixEdit, Help, pair, possible, propose};
use crate::source::ladder::{Entry, Parameter, Template, Use};
use crate::source::nearest::{KnownNames, did_you_mean};
use crate::source::reader::Text;
use crate::source::record::Records;
use crate::source::renaming;
use crate::source::span::Span;
use rungd_engine::isa::BlockBit;

/// A template, with the data that its uses need.
pub(super) struct Declared<'t> {
    pub template: &'t Template,
    /// The parameters with a known type.
    parameters: HashMap<&'t str, TypedParameter<'t>>,
    /// Their names, for the help about an unknown parameter.
    typed: KnownNames,
    /// The names of all parameters.
    named: HashSet<&'t str>,
    /// The parameters with a known type and without a default, in file order.
    required: Vec<TypedParameter<'t>>,
    /// The parameters with a known type and with a default, in file order.
    optional: Vec<(TypedParameter<'t>, &'t Text)>,
    /// The names of its own tags and inner uses.
    pub own: HashSet<&'t str>,
    /// The names in `own`, and those of the parameters.
    pub known: KnownNames,
    /// Whether it can be expanded.
    pub is_usable: bool,
}

/// All templates, by their names.
pub(super) struct Templates<'t> {
    pub all: Vec<Declared<'t>>,
    by_name: HashMap<&'t str, usize>,
    pub known: KnownNames,
}

impl<'t> Declared<'t> {
    fn new(template: &'t Template, records: &'t Records) -> Declared<'t> {
        let of_type = |written: &'t Parameter| {
            let name = &written.kind.as_ref()?.text;
            let kind = ParameterKind::of(name, records)?;
            let record = records.get(name).filter(|_| kind == ParameterKind::Record);
            Some(TypedParameter { written, kind, record })
        };
        let all = || template.parameters.iter();
        let typed = || all().filter_map(of_type);
        let parameters = typed().map(|parameter| (parameter.name(), parameter)).collect();
        let required = typed().filter(|parameter| parameter.written.default.is_none()).collect();
        let default =
            |parameter: TypedParameter<'t>| Some((parameter, parameter.written.default.as_ref()?));
        let optional = typed().filter_map(default).collect();
        let named: HashSet<&str> = all().map(|parameter| &*parameter.name.text).collect();
        let tags = template.tags.iter().map(|tag| &*tag.name.text);
        let uses =
            uses(template).filter_map(|template_use| Some(&*template_use.name.as_ref()?.text));
        let own: HashSet<&str> = tags.chain(uses).collect();
        let known = KnownNames::new(own.iter().copied().chain(named.iter().copied()));
        let typed = KnownNames::new(typed().map(|parameter| parameter.name()));
        // A parameter without a type is already reported; no argument can be read for it.
        let is_usable = all().all(|parameter| parameter.kind.is_some());
        Declared { template, parameters, typed, named, required, optional, own, known, is_usable }
    }

    /// Its name, cut to [`NAME_MAX`] characters.
    pub fn name(&self) -> &'t str {
        let name = self.template.name.as_ref().map_or("", |name| &name.text);
        name.char_indices().nth(NAME_MAX).map_or(name, |(end, _)| &name[..end])
    }

    /// The parameter that a name begins with.
    pub fn parameter<'n>(&self, name: &'n str) -> Option<NamedParameter<'t, 'n>> {
        let (own, behind) = base(name);
        Some(self.parameters.get(own)?.named(name, behind))
    }

    /// Whether a name begins with a parameter whose type is unknown, which is already reported.
    pub fn is_untyped(&self, name: &str) -> bool {
        let own = base(name).0;
        self.named.contains(own) && !self.parameters.contains_key(own)
    }

    /// The parameters in file order, with known types.
    pub fn parameters(&self) -> impl Iterator<Item = TypedParameter<'t>> {
        let parameters = self.template.parameters.iter();
        parameters.filter_map(|p| self.parameter_of(&p.name.text))
    }

    /// The parameter of this name, if its type is a known one.
    pub fn parameter_of(&self, name: &str) -> Option<TypedParameter<'t>> {
        self.parameters.get(name).copied()
    }

    /// The parameters with a default, in file order.
    pub fn optional(&self) -> impl Iterator<Item = (TypedParameter<'t>, &'t Text)> {
        self.optional.iter().copied()
    }

    /// The mistakes in the arguments of a use. Of the missing arguments, only the first are
    /// reported.
    pub fn misfits(&self, template_use: &Use) -> Vec<Finding> {
        let mut findings = Vec::new();
        for (name, text) in &template_use.arguments {
            match (self.parameters.get(&*name.text), text) {
                (Some(parameter), Some(text)) => {
                    let read = given::read(parameter.kind, text, text.span.file);
                    findings.extend(read.err().map(|finding| *finding));
                }
                (Some(_), None) => {}
                (None, _) if self.named.contains(&*name.text) => {}
                (None, _) => findings.push(self.unknown_argument(name)),
            }
        }
        let given: HashSet<&str> =
            template_use.arguments.iter().map(|(name, _)| &*name.text).collect();
        let missing = self.required.iter().filter(|parameter| !given.contains(parameter.name()));
        for parameter in missing.take(LISTED_MAX) {
            let name = kept(parameter.name());
            let span =
                template_use.template.as_ref().map_or(template_use.span, |template| template.span);
            let message = format!("`{}` needs `{name}`, {}", self.name(), parameter.words());
            let finding = Finding::new(Code::TemplateArgument, span, message);
            let argument = format!("{name} = \"{}\"", parameter.kind.example());
            let help = format!("give it in `with`: `{argument}`");
            let declared = parameter.written.name.span;
            let finding = finding.related(declared, "declared here").help(help);
            findings.push(finding.fix(pair(format!("with = {{ {argument} }}")).possible()));
        }
        findings
    }

    fn unknown_argument(&self, name: &Text) -> Finding {
        let template = self.name();
        let message = format!("`{template}` has no parameter `{}`", name.text);
        let first = self.parameters().take(LISTED_MAX).map(|parameter| parameter.name());
        let list = first.collect::<Vec<_>>().join("`, `");
        let help = match (self.typed.iter().len(), self.typed.iter().len().checked_sub(LISTED_MAX))
        {
            (0, _) => "it has no parameters".to_owned(),
            (_, None | Some(0)) => format!("its parameters are `{list}`"),
            (_, Some(more)) => format!("its parameters are `{list}`, and {more} more"),
        };
        let finding = Finding::new(Code::TemplateArgument, name.span, message).help(help);
        finding.or_omit().near(&name.text, &self.typed)
    }
}

impl<'t> Templates<'t> {
    /// All templates, with the findings about them.
    pub fn new(
        templates: impl Iterator<Item = &'t Template>,
        records: &'t Records,
    ) -> (Templates<'t>, Vec<Finding>) {
        let all: Vec<Declared<'t>> =
            templates.map(|template| Declared::new(template, records)).collect();
        let mut findings = Vec::new();
        let mut by_name: HashMap<&str, usize> = HashMap::new();
        for (at, declared) in all.iter().enumerate() {
            let Some(name) = &declared.template.name else { continue };
            findings.extend(forbidden(name, NameRole::Template));
            if let Some(first) = by_name.get(&*name.text) {
                let message = format!("there is a template `{}` already", name.text);
                let finding = Finding::new(Code::DuplicateName, name.span, message);
                let first = all[*first].template.name.as_ref().map_or(name.span, |name| name.span);
                let fix = renaming::another(&name.text, '_', |name| by_name.contains_key(name));
                findings.push(finding.label("again here").related(first, "first here").fix(fix));
                continue;
            }
            by_name.insert(&name.text, at);
        }
        let known = KnownNames::new(by_name.keys().copied());
        let templates = Templates { all, by_name, known };
        for declared in &templates.all {
            names(declared, &mut findings);
            parameters(declared, records, &mut findings);
            tags(declared, &mut findings);
            uses(declared.template)
                .for_each(|template_use| findings.extend(templates.misuses(template_use, false)));
        }
        (templates, findings)
    }

    /// The index of the template of a use.
    pub fn position(&self, template_use: &Use) -> Option<usize> {
        self.by_name.get(&*template_use.template.as_ref()?.text).copied()
    }

    /// The warnings about the templates that nothing uses.
    pub fn unused(&self, used: &[bool]) -> Vec<Finding> {
        let unused = self.by_name.values().filter(|at| !used[**at] && self.all[**at].is_usable);
        let finding = |at: &usize| {
            let name = self.all[*at].template.name.as_ref()?;
            let message = format!("nothing uses the template `{}`", name.text);
            let finding = Finding::new(Code::UnusedTemplate, name.span, message).label("unused");
            let help =
                format!("delete it, or use it in the place of a rung: `use = \"{}\"`", name.text);
            Some(finding.help(help).fix(Fix::from(FixEdit::Delete).same()))
        };
        unused.filter_map(finding).collect()
    }

    /// The mistakes of a use by itself; `is_body` is whether it is a Program's body.
    pub fn misuses(&self, template_use: &Use, is_body: bool) -> Vec<Finding> {
        let Some(name) = &template_use.template else { return Vec::new() };
        let Some(at) = self.position(template_use) else {
            let message = format!("there is no template `{}`", name.text);
            let finding = Finding::new(Code::UnknownTemplate, name.span, message);
            if name.text.starts_with(LIBRARY) {
                return vec![finding.help(format!(
                    "`{0}` is a file: put it among the ladders, and name a template of it \
                     (`rungd explain {0}` shows them)",
                    name.text
                ))];
            }
            let help = declared_table("[[template]]", &name.text);
            return vec![finding.help(help).near(&name.text, &self.known)];
        };
        let declared = &self.all[at];
        let mut findings = declared.misfits(template_use);
        if let (false, Some(stage)) = (is_body, declared.template.stages.first()) {
            let message = format!("`{}` has stages: it is the body of a program", name.text);
            let finding = Finding::new(Code::TemplateRule, name.span, message);
            let own = template_use.name.as_ref().map_or("Flush", |name| &name.text);
            findings.push(
                finding
                    .related(stage.span, "a stage of it")
                    .help(format!("[[program]]\nname = \"{own}\"\nuse = \"{}\"", name.text)),
            );
        }
        findings
    }
}

/// The first part of a name, and the rest, from the dot on.
pub(super) fn base(name: &str) -> (&str, &str) {
    name.split_at(name.find('.').unwrap_or(name.len()))
}

/// The uses in a template.
pub(super) fn uses(template: &Template) -> impl Iterator<Item = &Use> {
    let of_stages = template.stages.iter().flat_map(|stage| &stage.rungs);
    template.rungs.iter().chain(of_stages).filter_map(|entry| match entry {
        Entry::Use(template_use) => Some(template_use),
        Entry::Rung(_) => None,
    })
}

/// Checks the names of the parameters, own tags and uses of a template, also against its stages.
fn names(declared: &Declared, findings: &mut Vec<Finding>) {
    let template = declared.template;
    let mut seen: HashMap<&str, Span> = HashMap::new();
    let parameters = template.parameters.iter().map(|p| (&p.name, NameRole::Parameter));
    let tags = template.tags.iter().map(|tag| (&tag.name, NameRole::Tag));
    let uses = uses(template)
        .filter_map(|template_use| Some((template_use.name.as_ref()?, NameRole::Use)));
    for (name, role) in parameters.chain(tags).chain(uses) {
        findings.extend(forbidden(name, role));
        if role == NameRole::Parameter && name.text == "name" {
            let message = "`name` cannot be the name of a parameter";
            let finding = Finding::new(Code::ForbiddenName, name.span, message);
            let finding = finding.help("in a text `{name}` is the name of the use");
            findings.push(finding.fix(possible("name_2")));
        }
        if let Some(first) = seen.insert(&name.text, name.span) {
            let message = format!("this template has a name `{}` already", name.text);
            let finding = Finding::new(Code::DuplicateName, name.span, message);
            let help = "its parameters, tags and uses share one set of names";
            let fix = renaming::another(&name.text, '_', |name| seen.contains_key(name));
            let finding = finding.label("again here").related(first, "first here");
            findings.push(finding.help(help).fix(fix));
        }
    }
    if template.stages.is_empty() {
        return;
    }
    let stages = template.stages.iter().filter_map(|stage| stage.name.as_ref());
    for stage in stages {
        if let Some(own) = seen.remove(&*stage.text) {
            let message = format!("`{}` is a stage of this template too", stage.text);
            let finding = Finding::new(Code::DuplicateName, own, message);
            let fix = renaming::another(&stage.text, '_', |name| seen.contains_key(name));
            findings.push(finding.related(stage.span, "the stage").fix(fix));
        }
    }
    for name in BlockBit::ALL.map(BlockBit::name) {
        if let Some(own) = seen.get(name) {
            let message = format!("`.{name}` is a bit of the program that this template is for");
            let finding = Finding::new(Code::ForbiddenName, *own, message);
            findings.push(finding.fix(possible(format!("is_{}", name.to_lowercase()))));
        }
    }
}

/// Checks the types and defaults of the parameters.
fn parameters(declared: &Declared, records: &Records, findings: &mut Vec<Finding>) {
    for parameter in &declared.template.parameters {
        let Some(kind) = &parameter.kind else { continue };
        let Some(own_kind) = ParameterKind::of(&kind.text, records) else {
            let message = format!("a parameter has no type `{}`", kind.text);
            let names = || {
                let records = records.keys().map(String::as_str);
                KINDS.iter().map(|(name, _)| *name).chain(records)
            };
            let help = did_you_mean(&kind.text, names()).unwrap_or_else(|| {
                Help::from(format!("the types are `{}`", names().collect::<Vec<_>>().join("`, `")))
            });
            findings.push(Finding::new(Code::TemplateParameter, kind.span, message).help(help));
            continue;
        };
        let Some(default) = &parameter.default else { continue };
        if let Err(mut finding) = given::read(own_kind, default, default.span.file) {
            finding.code = Code::TemplateParameter;
            findings.push(*finding);
        }
    }
}

/// Checks the own tags.
fn tags(declared: &Declared, findings: &mut Vec<Finding>) {
    let words = KnownNames::new(declared.typed.iter().chain(["name"]));
    for tag in &declared.template.tags {
        if let Some(at) = &tag.at {
            let name = &tag.name.text;
            let message = format!("own tag `{name}` has an address: all uses would share it");
            let finding = Finding::new(Code::TemplateRule, at.span, message);
            let own = propose(pair(format!("{name} = {{ type = \"bit\" }}")));
            let help = own.and(": each use has its own; or name a tag of the ladder");
            findings.push(finding.help(help).fix(pair("type = \"bit\"")));
        }
        let alarm = tag.alarm.as_ref().map(|alarm| (&*alarm.text, alarm.span));
        let group = tag.group.as_ref().map(|group| (&*group.text, group.span));
        let doc = tag.doc.as_deref().map(|doc| (doc, tag.name.span));
        for (text, span) in alarm.into_iter().chain(group).chain(doc) {
            findings.extend(texts::check(text, span, &words));
        }
    }
}
