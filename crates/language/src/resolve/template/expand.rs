//! Expands uses, depth first in file order.
//!
//! A use with a mistake is left out, with a finding. Its own tags are declared nevertheless, so
//! that their names cause no further findings elsewhere.

use std::collections::{HashMap, HashSet};

use super::declared::{Declared, Templates};
use super::given::{self, Given};
use super::kind::{ParameterKind, WantedOperand};
use super::parameter::TypedParameter;
use super::pending::{Argument, UnusedTemplate};
use super::rewrite::{Instance, Rewrite};
use super::room::ExpansionRoom;
use super::texts;
use crate::resolve::layers::{Layers, UsePlace};
use crate::resolve::names::{NAME_MAX, kept};
use crate::resolve::tags::TEXT_MAX;
use crate::source::atom::{Atom, AtomKind};
use crate::source::contact::WrittenContact;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, proposed};
use crate::source::ladder::{
    BlockForm, Entry, Ladder, Use, WrittenBlock, WrittenBranch, WrittenLeg, WrittenRung,
    WrittenStage, WrittenTag,
};
use crate::source::reader::Text;
use crate::source::span::{Located, Span};

/// Maximum number of characters of the whole name of a use. Each of its rungs and operands may
/// contain it.
const WHOLE_NAME_MAX: usize = 4 * NAME_MAX;
/// Number of bytes of a text that take as much room as a contact.
const TEXT_FREE: usize = 16;
/// Number of names in the `allow` of a use that take as much room as a contact in each of its
/// rungs.
const ALLOWED_FREE: usize = 2;

/// The results so far of expanding the uses of all ladders.
pub(super) struct Expansion<'t> {
    templates: &'t Templates<'t>,
    pub layers: Layers,
    pub findings: Vec<Finding>,
    /// The arguments of the uses, to be checked once all names are declared.
    pub arguments: Vec<Argument>,
    /// The names of the uses in rungs of ladders.
    pub names: Vec<Text>,
    /// The whole names of all uses in rungs.
    pub uses: Vec<String>,
    /// The whole names of the uses whose template is unknown, so that their tags are unknown too.
    pub unknown: Vec<String>,
    /// For each template, by its index: whether one of its uses was expanded.
    pub written: Vec<bool>,
    /// The names of the uses in ladders so far.
    named: HashSet<String>,
    room: ExpansionRoom,
    tags: Vec<WrittenTag>,
    trial: bool,
    /// Whether the lack of room is already reported.
    is_told: bool,
}

/// The use that contains a use, if the template is used in a template; `None` for a ladder.
type Giver<'g, 't> = Option<&'g Instance<'t>>;

impl<'t> Expansion<'t> {
    pub fn new(templates: &'t Templates<'t>) -> Self {
        Expansion {
            templates,
            layers: Layers::default(),
            findings: Vec::new(),
            arguments: Vec::new(),
            names: Vec::new(),
            uses: Vec::new(),
            unknown: Vec::new(),
            written: vec![false; templates.all.len()],
            named: HashSet::new(),
            room: ExpansionRoom::new(),
            tags: Vec::new(),
            trial: false,
            is_told: false,
        }
    }

    /// The ladder with rungs only, and with the own tags of its uses. Marks the used templates.
    pub fn ladder(&mut self, ladder: Ladder<Entry>, used: &mut [bool]) -> Ladder {
        let Ladder { mut tags, blocks, .. } = ladder;
        let blocks = blocks.into_iter().map(|block| self.block(block, used)).collect();
        tags.append(&mut self.tags);
        let Ladder { name, doc, allow, devices, order, records, templates, lost, .. } = ladder;
        Ladder { name, doc, allow, devices, order, records, tags, blocks, templates, lost }
    }

    fn block(&mut self, block: WrittenBlock<Entry>, used: &mut [bool]) -> WrittenBlock {
        let WrittenBlock { form, span, name, doc, autostart, body, rungs, stages } = block;
        let mut rungs = self.entries(rungs, used);
        let mut stages: Vec<WrittenStage> = stages
            .into_iter()
            .map(|stage| {
                let rungs = self.entries(stage.rungs, used);
                WrittenStage { span: stage.span, name: stage.name, doc: stage.doc, rungs }
            })
            .collect();
        if let Some(usage) = &body {
            self.hyphen(usage);
            let instance = self.of_ladder(usage, true, used);
            if let Some(instance) = instance {
                (rungs, stages) = self.body(&instance);
            }
            self.end_if_over(usage);
        }
        WrittenBlock { form, span, name, doc, autostart, body: None, rungs, stages }
    }

    /// Reports a `-` in the name of a Program with a template as its body: it is also the name of a
    /// use.
    fn hyphen(&mut self, usage: &Use) {
        let Some(name) = usage.name.as_ref().filter(|name| name.text.contains('-')) else { return };
        let message = format!("`{}` cannot be the name of a use", name.text);
        let finding = Finding::new(Code::ForbiddenName, name.span, message);
        let help = advise("a use's name has no `-`: `{}`", [proposed(name.text.replace('-', "_"))]);
        self.findings.push(finding.help(help));
    }

    fn entries(&mut self, entries: Vec<Entry>, used: &mut [bool]) -> Vec<WrittenRung> {
        let mut rungs = Vec::with_capacity(entries.len());
        for entry in entries {
            match entry {
                Entry::Rung(rung) => rungs.push(rung),
                Entry::Use(of) => {
                    self.names.extend(of.name.clone());
                    if let Some(instance) = self.of_ladder(&of, false, used) {
                        self.rungs(&instance.declared.template.rungs, &instance, &mut rungs);
                    }
                    self.end_if_over(&of);
                }
            }
        }
        rungs
    }

    /// Reads a use in a ladder.
    fn of_ladder(&mut self, usage: &Use, is_body: bool, used: &mut [bool]) -> Option<Instance<'t>> {
        if let Some(at) = self.templates.position(usage) {
            used[at] = true;
        }
        self.findings.extend(self.templates.misuses(usage, is_body));
        // The rungs of a second use with the same name would only cause more findings about taken
        // names.
        let name = usage.name.as_ref()?;
        if !self.named.insert(name.text.clone()) {
            return None;
        }
        self.instance(usage, None, is_body)
    }

    /// Whether the expansion has exceeded its limit.
    pub fn is_over(&self) -> bool {
        self.room.is_over()
    }

    /// Reports once that the expansion has exceeded its limit, at the use that exceeded it: also if
    /// the limit left nothing of that use.
    fn end_if_over(&mut self, usage: &Use) {
        if self.room.is_over() && !std::mem::replace(&mut self.is_told, true) {
            let span = usage.template.as_ref().map_or(usage.span, |name| name.span);
            let parts = super::room::PARTS_MAX;
            let message =
                format!("the uses of templates expand to more than {parts} contacts and operands");
            let finding = Finding::new(Code::TemplateSize, span, message);
            self.findings.push(finding.label("the limit is reached here"));
        }
    }

    /// Reads a use with its arguments. Adds its own tags.
    fn instance(
        &mut self,
        usage: &Use,
        giver: Giver<'_, 't>,
        is_body: bool,
    ) -> Option<Instance<'t>> {
        let usable = |number: &usize| self.templates.all[*number].is_usable;
        let Some(number) = self.templates.position(usage).filter(usable) else {
            self.unknown.extend(usage.name.as_ref().map(|name| match giver {
                Some(giver) => format!("{}.{}", giver.name, name.text),
                None => name.text.clone(),
            }));
            return None;
        };
        let declared = &self.templates.all[number];
        let name = usage.name.as_ref()?;
        if self.room.is_over() || self.has_long_name(name, giver) {
            return None;
        }
        let by = giver.map_or(name.span.file, |giver| giver.layer);
        let at = usage.template.as_ref().map_or(usage.span, |template| template.span);
        let at = Span { file: by, ..at };
        let (whole, path) = match giver {
            Some(giver) => {
                (format!("{}.{}", giver.name, name.text), format!("{}{}/", giver.path, name.text))
            }
            None if is_body => (name.text.clone(), String::new()),
            None => (name.text.clone(), format!("{}/", name.text)),
        };
        if !is_body {
            self.uses.push(whole.clone());
        }
        let own = declared.known.clone();
        let place = UsePlace { name: whole.clone(), at, is_trial: self.trial, own };
        let layer = self.layers.add_use(declared.template.span.file, place);
        let allowed = giver.map_or(0, |giver| giver.allow.len()) + usage.allow.len();
        self.room.take(allowed / ALLOWED_FREE)?;
        let mut allow = giver.map_or(Vec::new(), |giver| giver.allow.clone());
        allow.extend(usage.allow.iter().cloned());
        let given = HashMap::new();
        let mut instance = Instance { declared, layer, name: whole, path, given, allow };
        let is_whole = self.give(&mut instance, usage, giver);
        let written = if giver.is_none() { &usage.arguments[..] } else { &[] };
        self.own_tags(&instance, written);
        let is_right = declared.template.stages.is_empty() || is_body;
        if !is_whole || !is_right || self.room.take(1).is_none() {
            return None;
        }
        self.written[number] = true;
        Some(instance)
    }

    /// Whether a use's name is too long, or its whole name is. The latter is reported here.
    fn has_long_name(&mut self, name: &Text, giver: Giver<'_, 't>) -> bool {
        let length = name.text.len() + giver.map_or(0, |giver| giver.name.len() + 1);
        if name.text.len() <= NAME_MAX && length > WHOLE_NAME_MAX {
            let file = giver.map_or(name.span.file, |giver| giver.layer);
            let span = Span { file, ..name.span };
            let message = format!("the whole name of this use has {length} characters");
            let finding = Finding::new(Code::TemplateSize, span, message);
            let help = format!("a whole name has at most {WHOLE_NAME_MAX}: take shorter names");
            self.findings.push(finding.help(help));
        }
        length > WHOLE_NAME_MAX || name.text.len() > NAME_MAX
    }

    /// Reads the arguments and defaults of a use; returns whether none is missing or wrong.
    fn give(&mut self, instance: &mut Instance<'t>, usage: &Use, giver: Giver<'_, 't>) -> bool {
        let declared = instance.declared;
        let mut whole = declared.misfits(usage).is_empty();
        let mut all = HashMap::new();
        let known = usage
            .arguments
            .iter()
            .filter_map(|(name, text)| Some((declared.parameter_of(&name.text)?, text)));
        for (parameter, text) in known {
            let given = text.as_ref().and_then(|text| {
                self.room.take(1 + text.text.len() / TEXT_FREE)?;
                match giver {
                    Some(giver) => self.given(parameter, text, giver),
                    None => given::read(parameter.kind, text, text.span.file).ok(),
                }
            });
            whole &= given.is_some();
            let Some(given) = given else { continue };
            self.note_argument(declared, parameter, &given);
            all.insert(parameter.name(), given);
        }
        // `given` is still empty, so a name in a default cannot be a parameter.
        for (parameter, text) in declared.optional() {
            if all.contains_key(parameter.name()) {
                continue;
            }
            let room = self.room.take(1 + text.text.len() / TEXT_FREE);
            let given = room.and_then(|()| self.given(parameter, text, instance));
            whole &= given.is_some();
            let Some(given) = given else { continue };
            self.note_argument(declared, parameter, &given);
            all.insert(parameter.name(), given);
        }
        instance.given = all;
        whole
    }

    /// Reads an argument in the text of a template.
    fn given(
        &mut self,
        parameter: TypedParameter<'t>,
        text: &Text,
        giver: &Instance<'t>,
    ) -> Option<Given> {
        let given = given::read(parameter.kind, text, giver.layer).ok()?;
        let mut rewrite = self.rewrite(giver);
        match given {
            Given::Contacts(contact, _) => {
                let contact = rewrite.contact(&contact, 0)?;
                Some(Given::contacts(contact))
            }
            Given::Atom(atom) => rewrite.passed(&atom, parameter).map(Given::Atom),
        }
    }

    fn note_argument(&mut self, declared: &Declared, parameter: TypedParameter, given: &Given) {
        // An argument that an outer use passed on is checked at the outer use.
        if !self.layers.is_given(given.span().file) {
            self.arguments.push(Argument {
                template: declared.name().to_owned(),
                parameter: kept(parameter.name()),
                kind: parameter.kind,
                type_name: parameter.type_name().to_owned(),
                given: given.clone(),
            });
        }
    }

    fn rewrite<'r>(&'r mut self, instance: &'r Instance<'t>) -> Rewrite<'r, 't> {
        Rewrite {
            instance,
            layers: &mut self.layers,
            room: &mut self.room,
            findings: &mut self.findings,
        }
    }

    /// Expands a template of which no use was expanded, with arguments that fit.
    pub fn trial(&mut self, declared: &'t Declared<'t>) -> Option<UnusedTemplate> {
        let template = declared.template;
        let name = template.name.as_ref().filter(|_| declared.is_usable)?;
        if declared.parameters().any(|parameter| parameter.trial_type().is_none()) {
            return None;
        }
        self.trial = true;
        let of_ladders = std::mem::take(&mut self.arguments);
        // No name in a ladder has a `?`.
        let whole = format!("?{}", name.text);
        let (at, own) = (name.span, declared.known.clone());
        let place = UsePlace { name: whole.clone(), at, is_trial: true, own };
        let layer = self.layers.add_use(template.span.file, place);
        let span = Span { file: layer, ..name.span };
        let mut given = HashMap::new();
        for parameter in declared.parameters() {
            let text = format!("{whole}.?{}", parameter.name());
            let Some(value) = parameter.trial_type() else { continue };
            self.tags
                .push(WrittenTag::of_type(Text { text: text.clone(), span, exact: true }, value));
            let stands = if parameter.kind == ParameterKind::Contact {
                Given::contacts(WrittenContact::Bit(Located { value: text, span }))
            } else {
                Given::Atom(Atom { kind: AtomKind::Name(text), span })
            };
            given.insert(parameter.name(), stands);
        }
        let (path, allow) = (String::new(), Vec::new());
        let instance = Instance { declared, layer, name: whole.clone(), path, given, allow };
        self.own_tags(&instance, &[]);
        let (rungs, stages) = self.body(&instance);
        self.trial = false;
        let name = Some(Text { text: whole, span, exact: true });
        let (form, autostart, doc) = (BlockForm::Program, None, None);
        let block = WrittenBlock { form, span, name, doc, autostart, body: None, rungs, stages };
        let arguments = std::mem::replace(&mut self.arguments, of_ladders);
        Some(UnusedTemplate { block, tags: std::mem::take(&mut self.tags), arguments })
    }

    /// The rungs and stages of a Program with a template as its body.
    fn body(&mut self, instance: &Instance<'t>) -> (Vec<WrittenRung>, Vec<WrittenStage>) {
        let template = instance.declared.template;
        let mut rungs = Vec::new();
        self.rungs(&template.rungs, instance, &mut rungs);
        let stages = template.stages.iter().map(|stage| {
            let mut rungs = Vec::new();
            self.rungs(&stage.rungs, instance, &mut rungs);
            let place = |span: Span| Span { file: instance.layer, ..span };
            let name = stage.name.as_ref();
            let name = name.map(|name| Text { span: place(name.span), ..name.clone() });
            WrittenStage { span: place(stage.span), name, doc: stage.doc.clone(), rungs }
        });
        let stages = stages.collect();
        (rungs, stages)
    }

    /// Expands rungs and uses of a template.
    fn rungs(&mut self, entries: &'t [Entry], instance: &Instance<'t>, out: &mut Vec<WrittenRung>) {
        for entry in entries {
            if self.room.is_over() {
                return;
            }
            match entry {
                Entry::Rung(rung) => out.push(self.rung(rung, instance)),
                Entry::Use(of) => {
                    if let Some(inner) = self.instance(of, Some(instance), false) {
                        self.rungs(&inner.declared.template.rungs, &inner, out);
                    }
                }
            }
        }
    }

    fn rung(&mut self, rung: &WrittenRung, instance: &Instance<'t>) -> WrittenRung {
        let mut rewrite = self.rewrite(instance);
        let place = |span: Span| Span { file: instance.layer, ..span };
        let _ = rewrite.room.take(1 + instance.allow.len() / ALLOWED_FREE);
        let name = rung.name.as_ref().map(|name| Text {
            text: format!("{}{}", instance.path, name.text),
            span: place(name.span),
            exact: name.exact,
        });
        let moved = |text: &Text| Text { span: place(text.span), ..text.clone() };
        let mut leg = |leg: &WrittenLeg| WrittenLeg {
            key: moved(&leg.key),
            span: place(leg.span),
            contacts: rewrite.contacts(&leg.contacts),
        };
        let (when, legs) = (rung.when.as_ref().map(&mut leg), rung.legs.iter().map(leg).collect());
        let mut body = |body: &[crate::source::instruction::WrittenInstruction]| {
            body.iter().filter_map(|text| rewrite.instruction(text)).collect()
        };
        let own = body(&rung.body);
        let branches = rung.branches.iter().map(|branch| WrittenBranch {
            span: place(branch.span),
            contacts: rewrite.contacts(&branch.contacts),
            body: branch.body.iter().filter_map(|text| rewrite.instruction(text)).collect(),
        });
        let branches = branches.collect();
        let allow = rung.allow.iter().map(moved).chain(instance.allow.iter().cloned()).collect();
        let (extent, doc) = (place(rung.extent), rung.doc.clone());
        WrittenRung { extent, name, doc, allow, when, legs, body: own, branches }
    }

    /// The bit that the `ack` of an own tag names in a use; `None` after a finding, or if its
    /// argument has a mistake.
    fn ack(&mut self, ack: &Text, instance: &Instance<'t>) -> Option<Text> {
        let parameter = instance.declared.parameter(&ack.text);
        if parameter.is_some_and(|named| !instance.given.contains_key(named.parameter.name())) {
            return None;
        }
        let atom = Atom { kind: AtomKind::Name(ack.text.clone()), span: ack.span };
        let named = self.rewrite(instance).atom(&atom, WantedOperand::Bit)?;
        Some(Text { text: named.to_string(), span: named.span, exact: ack.exact })
    }

    /// Adds the own tags of a use, with the words in braces in their texts replaced. `written` are
    /// the arguments as the ladder has them.
    fn own_tags(&mut self, instance: &Instance<'t>, written: &[(Text, Option<Text>)]) {
        let written: HashMap<&str, &Text> =
            written.iter().filter_map(|(name, text)| Some((&*name.text, text.as_ref()?))).collect();
        for tag in &instance.declared.template.tags {
            if self.room.is_over() {
                return;
            }
            let stands = |word: &str| match word {
                "name" => Some(instance.name.clone()),
                word => {
                    let written = written.get(word).map(|text| text.text.clone());
                    written.or_else(|| instance.given.get(word).map(Given::to_string))
                }
            };
            let filled = |text: &str| texts::filled(text, stands);
            let name = format!("{}.{}", instance.name, tag.name.text);
            let layer = instance.layer;
            if name.len() > NAME_MAX {
                let span = Span { file: layer, ..tag.name.span };
                let message = format!("the name `{name}` has {} characters", name.len());
                let finding = Finding::new(Code::ForbiddenName, span, message);
                self.findings.push(finding.help(format!("a name has at most {NAME_MAX}")));
            }
            let filled_in = |written: &Option<Text>| {
                let text = written.as_ref()?;
                Some(Text { text: filled(&text.text), ..text.clone() })
            };
            let (alarm, group) = (filled_in(&tag.alarm), filled_in(&tag.group));
            let doc = tag.doc.as_ref().map(|doc| filled(doc));
            let texts = [
                ("alarm", alarm.as_ref().map(|v| (&v.text, v.span))),
                ("doc", doc.as_ref().map(|text| (text, tag.name.span))),
            ];
            for (key, (text, span)) in
                texts.iter().filter_map(|(key, argument)| Some((key, (*argument)?)))
            {
                self.findings.extend(too_long(key, &name, text, Span { file: layer, ..span }));
            }
            let long = alarm.as_ref().map_or(0, |alarm| alarm.text.len());
            let _ = self.room.take(1 + (long + doc.as_ref().map_or(0, String::len)) / 16);
            let own = WrittenTag { alarm, group, doc, ..tag.clone() }.moved(name, layer);
            let ack = tag.ack.as_ref().and_then(|ack| self.ack(ack, instance));
            self.tags.push(WrittenTag { ack, ..own });
        }
    }
}

fn too_long(key: &str, tag: &str, text: &str, span: Span) -> Option<Finding> {
    let count = text.chars().count();
    let tag: String = tag.chars().take(NAME_MAX).collect();
    let finding = || {
        let message = format!("the `{key}` of `{tag}` has {count} characters with its arguments");
        let help = format!("a text has at most {TEXT_MAX}: leave out a long argument in braces");
        Finding::new(Code::TagKey, span, message).help(help)
    };
    (count > TEXT_MAX).then(finding)
}
