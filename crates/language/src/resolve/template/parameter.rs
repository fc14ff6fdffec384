//! Parameters with their types, and the fields of those whose type is a record.
//!
//! Made by `declared` from a template's text. `expand`, `rewrite` and `arguments` ask what a
//! parameter or a field of it accepts, and how people call it. A field is what a parameter of its
//! type would be: everything in a record is writable in a template.

use super::kind::{ParameterKind, WantedOperand};
use crate::resolve::mistake::Mistake;
use crate::resolve::record_names::no_field;
use crate::source::fix::{Help, possible};
use crate::source::ladder::{Parameter, WrittenRecord};

/// A parameter with a known type.
#[derive(Clone, Copy)]
pub(super) struct TypedParameter<'t> {
    pub written: &'t Parameter,
    pub kind: ParameterKind,
    /// The record that is its type.
    pub record: Option<&'t WrittenRecord>,
}

/// The parameter with which a name in a template begins.
#[derive(Clone, Copy)]
pub(super) struct NamedParameter<'t, 'n> {
    pub parameter: TypedParameter<'t>,
    /// The type of the parameter, or that of a parameter for the field.
    pub kind: ParameterKind,
    /// The name as far as the parameter or field: `step`, `step.over`.
    pub name: &'n str,
    /// The rest of the name behind the parameter, from its dot on: `.over.Done`.
    pub behind: &'n str,
    /// The rest of the name behind the parameter or field: `.Done`.
    pub member: &'n str,
}

impl<'t> TypedParameter<'t> {
    /// Its name.
    pub fn name(&self) -> &'t str {
        &self.written.name.text
    }

    /// Its type as it is written.
    pub fn type_name(&self) -> &'t str {
        self.written.kind.as_ref().map_or("", |kind| &kind.text)
    }

    /// Its type in words: `a bit to read`, ``a record `Step` ``.
    pub fn words(&self) -> String {
        type_words(self.kind, self.type_name())
    }

    /// The type of a tag that is a valid argument; `None` if there is no such type.
    pub fn trial_type(&self) -> Option<&'t str> {
        tag_type(self.kind, self.type_name())
    }

    /// What a name with this parameter names; `behind`: the rest of the name, from its dot on.
    pub fn named<'n>(self, name: &'n str, behind: &'n str) -> NamedParameter<'t, 'n> {
        let field = behind.strip_prefix('.').unwrap_or_default();
        let field = field.split_once('.').map_or(field, |(field, _)| field);
        let (kind, member) = match self.field(field) {
            Some(kind) => (kind, &behind[1 + field.len()..]),
            None => (self.kind, behind),
        };
        let name = &name[..name.len() - member.len()];
        NamedParameter { parameter: self, kind, name, behind, member }
    }

    /// The type that a parameter for a field of its record would have.
    fn field(&self, field: &str) -> Option<ParameterKind> {
        self.fields().find(|(name, _)| *name == field).map(|(_, kind)| kind)
    }

    /// The fields of its record, each with the type that a parameter for it would have.
    fn fields(&self) -> impl Iterator<Item = (&'t str, ParameterKind)> + use<'t> {
        let fields = self.record.into_iter().flat_map(|record| &record.fields);
        let kind = |kind: Option<&str>| ParameterKind::of_field(kind?);
        fields.filter_map(move |field| {
            let kind = kind(field.kind.as_ref().map(|kind| &*kind.text))?;
            Some((&*field.name.text, kind))
        })
    }
}

impl<'t> NamedParameter<'t, '_> {
    /// Whether it is a field of a record.
    pub fn is_field(&self) -> bool {
        self.parameter.kind == ParameterKind::Record && self.kind != ParameterKind::Record
    }

    /// The mistake in a field that the record does not have.
    pub fn no_field(&self) -> Option<Mistake> {
        let record = self.parameter.record.filter(|_| self.kind == ParameterKind::Record)?;
        let field = self.member.strip_prefix('.')?;
        let fields = record.fields.iter().map(|field| &*field.name.text).collect::<Vec<_>>();
        Some(no_field(self.name, self.parameter.type_name(), &fields, field))
    }

    /// What it is, in words: ``the field `step.target` is a real``.
    pub fn words(&self) -> String {
        match self.is_field() {
            true => format!("the field `{}` is {}", self.name, self.kind.field_words()),
            false => format!("the parameter `{}` is {}", self.name, self.parameter.words()),
        }
    }

    /// The help for a record, or a field of a different type, where a place wants an operand: the
    /// fields that it accepts.
    pub fn other_fields(&self, wanted: WantedOperand) -> Help {
        let own = self.parameter.name();
        let is_indexed = wanted == WantedOperand::Array;
        let fits = |kind: ParameterKind| is_indexed || kind.fits(wanted, false);
        let fields = self.parameter.fields().filter(|(_, kind)| fits(*kind));
        let fields: Vec<String> = fields.map(|(field, _)| format!("{own}.{field}")).collect();
        if fields.is_empty() {
            let record = self.parameter.type_name();
            return format!("no field of `{record}` is {}", wanted.words()).into();
        }
        let one = if is_indexed { "it is one record, without an index: " } else { "" };
        let words = format!("{one}name a field: `{}`", fields.join("`, `"));
        Help::from(words).with_all(fields.into_iter().map(possible))
    }
}

/// A record of a type, in words.
pub(super) fn record_words(name: &str) -> String {
    format!("a record `{name}`")
}

/// The type of a parameter, in words; `name`: its type as it is written.
pub(super) fn type_words(kind: ParameterKind, name: &str) -> String {
    if kind == ParameterKind::Record { record_words(name) } else { kind.words().to_owned() }
}

/// The type of a tag that is a valid argument; `name`: the parameter's type as it is written.
pub(super) fn tag_type(kind: ParameterKind, name: &str) -> Option<&str> {
    if kind == ParameterKind::Record { Some(name) } else { kind.trial_type() }
}
