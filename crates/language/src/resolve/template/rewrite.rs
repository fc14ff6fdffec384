//! Rewrites the parts of a template for one of its uses: with arguments instead of parameters, and
//! with the whole names of its own tags.
//!
//! Works on parsed parts, never on text, so that an argument cannot merge with the text around it.
//! Every place gets the layer of the use; an argument gets a layer for each place of its parameter.
//! Called by `expand`.

use std::collections::HashMap;

use super::declared::{Declared, base};
use super::given::{Given, moved, moved_atom};
use super::kind::{ParameterKind, WantedOperand};
use super::parameter::{NamedParameter, TypedParameter};
use super::room::ExpansionRoom;
use crate::resolve::layers::Layers;
use crate::source::atom::{Atom, AtomKind};
use crate::source::contact::WrittenContact;
use crate::source::contact_side::{CompareSide, ContactExpression};
use crate::source::expression::{Expression, ExpressionPart, ExpressionPartKind, WrittenFormula};
use crate::source::finding::{Code, Finding};
use crate::source::fix::{Help, advise, possible, propose};
use crate::source::indexed::IndexedName;
use crate::source::instruction::{OperandText, WrittenInstruction};
use crate::source::span::{FileId, Located, Span};
use rungd_engine::isa::address_text;
pub use rungd_engine::isa::{Mnemonic, Spec};

/// A use while it is expanded.
pub(super) struct Instance<'t> {
    pub declared: &'t Declared<'t>,
    /// Its layer.
    pub layer: FileId,
    /// Its whole name: `p1.lamp`.
    pub name: String,
    /// The prefix of its rungs' names: `p1/lamp/`.
    pub path: String,
    /// The arguments, by the names of the parameters.
    pub given: HashMap<&'t str, Given>,
    /// Names of warnings that the use and the uses around it silence.
    pub allow: Vec<crate::source::reader::Text>,
}

/// Rewrites parts of a template for one use.
pub(super) struct Rewrite<'r, 't> {
    pub instance: &'r Instance<'t>,
    pub layers: &'r mut Layers,
    pub room: &'r mut ExpansionRoom,
    pub findings: &'r mut Vec<Finding>,
}

/// Maximum nesting depth of contacts with their arguments.
const DEPTH_MAX: u32 = 100;

impl<'t> Rewrite<'_, 't> {
    /// A place, in the layer of the use.
    pub fn place(&self, span: Span) -> Span {
        Span { file: self.instance.layer, ..span }
    }

    fn find(&mut self, code: Code, at: Span, message: String, help: impl Into<Help>) {
        self.findings.push(Finding::new(code, at, message).help(help));
    }

    /// The whole name of an own tag or of an inner use; any other name is unchanged.
    pub fn whole(&self, name: &str) -> String {
        match self.instance.declared.own.contains(base(name).0) {
            true => format!("{}.{name}", self.instance.name),
            false => name.to_owned(),
        }
    }

    /// If a name begins with a parameter: that parameter; `Err` if the name has a mistake, which
    /// is reported.
    fn argument<'n>(
        &mut self,
        name: &'n str,
        at: Span,
        wanted: WantedOperand,
    ) -> Option<Result<NamedParameter<'t, 'n>, ()>> {
        if self.instance.declared.is_untyped(name) {
            return Some(Err(()));
        }
        let named = self.instance.declared.parameter(name)?;
        let (own, kind) = (named.parameter.name(), named.kind);
        if !self.instance.given.contains_key(own) {
            // Only a default names a parameter before its argument is known.
            let message = format!("a default names the parameter `{own}`");
            let help = "a default is a constant, or a name of the ladder";
            self.find(Code::TemplateParameter, at, message, help);
            return Some(Err(()));
        }
        if let Some(mistake) = named.no_field() {
            self.findings.extend(mistake.finding(at));
            return Some(Err(()));
        }
        let has_member = !named.member.is_empty();
        let fits = kind == ParameterKind::Contact && wanted == WantedOperand::Bit && !has_member;
        let is_bit = address_text::split_bit(name).is_some_and(|(base, _)| base == named.name);
        let fits = fits || (is_bit && kind.fits_bit(wanted));
        if !fits && !kind.fits(wanted, has_member) {
            self.unfit(named, at, wanted);
            return Some(Err(()));
        }
        Some(Ok(named))
    }

    /// Rewrites an argument of an inner use, which may be a parameter of the outer one.
    pub fn passed(&mut self, atom: &Atom, inner: TypedParameter) -> Option<Atom> {
        let outer = atom.name().and_then(|name| self.instance.declared.parameter(name));
        let of_record = |outer: &NamedParameter| outer.kind == ParameterKind::Record;
        if let Some(outer) = outer.filter(of_record)
            && inner.kind == ParameterKind::Record
            && outer.parameter.type_name() != inner.type_name()
        {
            let message = format!("{}, not {}", outer.words(), inner.words());
            let record = inner.type_name();
            let help = format!("a parameter here needs `type = \"{record}\"`");
            let declared = outer.parameter.written.kind.as_ref();
            let retyped = declared.map(|kind| possible(record).at(kind.span));
            let help = Help::from(help).with_all(retyped);
            self.find(Code::TemplateParameter, self.place(atom.span), message, help);
            return None;
        }
        self.atom(atom, inner.kind.wanted())
    }

    /// Reports a parameter at a place that does not accept its type.
    fn unfit(&mut self, named: NamedParameter, at: Span, wanted: WantedOperand) {
        let (message, name) = (named.words(), named.name);
        let (message, help) = if !named.member.is_empty() {
            (format!("{message}: it has no members"), propose(name))
        } else {
            let written = named.parameter.written.kind.as_ref();
            let retyped = |help: Help, name: &str| {
                help.with_all(written.map(|kind| possible(name).at(kind.span)))
            };
            let help = match (named.kind, wanted.type_name()) {
                (ParameterKind::Contact, Some(name)) if wanted != WantedOperand::Bit => {
                    let help = format!(
                        "a parameter with contacts is accepted only in contacts; one here needs \
                         `type = \"{name}\"`"
                    );
                    retyped(help.into(), name)
                }
                (ParameterKind::Contact, _) => {
                    "a parameter with contacts is accepted only in contacts: OUT it to an own tag \
                     with `type = \"bit\"`, and name that tag"
                        .into()
                }
                (ParameterKind::Timer | ParameterKind::Counter | ParameterKind::Sensaphone, _)
                    if matches!(
                        wanted,
                        WantedOperand::Bit | WantedOperand::Number | WantedOperand::Operand
                    ) =>
                {
                    let members = [format!("{name}.Done"), format!("{name}.Acc")];
                    advise("name a member of it: `{}`, `{}`", members.map(possible))
                }
                _ if wanted == WantedOperand::Record => {
                    "give a parameter whose type is that record, or a tag of it".into()
                }
                _ if named.parameter.kind == ParameterKind::Record => named.other_fields(wanted),
                (_, Some(name)) => {
                    retyped(format!("a parameter here needs `type = \"{name}\"`").into(), name)
                }
                (_, None) => "a template names programs and tasks of the ladder".into(),
            };
            (format!("{message}, not {}", wanted.words()), help)
        };
        self.find(Code::TemplateParameter, at, message, help);
    }

    /// The argument, in a layer for the place of its parameter.
    fn atom_given(&mut self, named: NamedParameter, at: Span) -> Option<Atom> {
        let (own, behind) = (named.parameter.name(), named.behind);
        let Given::Atom(atom) = &self.instance.given[own] else { return None };
        if atom.name().is_none() && !behind.is_empty() {
            let message = format!("`{own}` is given as the constant `{atom}`, which has no bits");
            self.find(Code::TemplateParameter, at, message, "give a word for it in this use");
            return None;
        }
        let layer = self.layers.add_atom(atom.span.file, at);
        let mut atom = moved_atom(atom, &mut |span| Span { file: layer, ..span });
        if let AtomKind::Name(name) = &mut atom.kind
            && !behind.is_empty()
        {
            // `N,0` with a member is `N0.DN`.
            *name = format!("{}{behind}", name.replace(',', ""));
        }
        Some(atom)
    }

    /// Rewrites a name that must stay a name; `None` if it has a mistake, which is reported.
    fn name(&mut self, name: &Located<String>, wanted: WantedOperand) -> Option<Located<String>> {
        let at = self.place(name.span);
        if name.value.contains('[') {
            return Some(Located { value: self.indexed(&name.value, at)?, span: at });
        }
        let Some(argument) = self.argument(&name.value, at, wanted) else {
            return Some(Located { value: self.whole(&name.value), span: at });
        };
        let atom = self.atom_given(argument.ok()?, at)?;
        let AtomKind::Name(value) = atom.kind else { return None };
        Some(Located { value, span: atom.span })
    }

    /// Rewrites an element or slice: its array, and the index or ends in its brackets, may be
    /// parameters.
    fn indexed(&mut self, name: &str, at: Span) -> Option<String> {
        let IndexedName { base, index, behind } = IndexedName::of(name)?;
        let array = self.named(base, at, WantedOperand::Array)?;
        let mut ends = Vec::new();
        for end in index.split("..") {
            let is_name = end.starts_with(|c: char| !c.is_ascii_digit() && c != '-');
            ends.push(match is_name {
                true => self.named(end, at, WantedOperand::Whole)?,
                false => end.to_owned(),
            });
        }
        Some(format!("{array}[{}]{behind}", ends.join("..")))
    }

    /// A name, or its argument if it is a parameter, as a text.
    fn named(&mut self, name: &str, at: Span, wanted: WantedOperand) -> Option<String> {
        let Some(argument) = self.argument(name, at, wanted) else { return Some(self.whole(name)) };
        self.atom_given(argument.ok()?, at).map(|atom| atom.to_string())
    }

    pub fn atom(&mut self, atom: &Atom, wanted: WantedOperand) -> Option<Atom> {
        let at = self.place(atom.span);
        let AtomKind::Name(name) = &atom.kind else {
            return Some(Atom { kind: atom.kind.clone(), span: at });
        };
        if name.contains('[') {
            return Some(Atom { kind: AtomKind::Name(self.indexed(name, at)?), span: at });
        }
        match self.argument(name, at, wanted) {
            None => Some(Atom { kind: AtomKind::Name(self.whole(name)), span: at }),
            Some(argument) => self.atom_given(argument.ok()?, at),
        }
    }

    /// Rewrites contacts in series; contacts with mistakes are left out.
    pub fn contacts(&mut self, contacts: &[WrittenContact]) -> Vec<WrittenContact> {
        contacts.iter().filter_map(|contact| self.contact(contact, 0)).collect()
    }

    /// Rewrites contacts; `depth` is the nesting depth of their place.
    pub fn contact(&mut self, contact: &WrittenContact, depth: u32) -> Option<WrittenContact> {
        self.room.take(1)?;
        Some(match contact {
            WrittenContact::Bit(name) => return self.bit(name, depth),
            WrittenContact::Indexed(computed) => WrittenContact::Indexed(self.computed(computed)?),
            WrittenContact::Not(inner, span) => {
                WrittenContact::Not(Box::new(self.contact(inner, depth + 1)?), self.place(*span))
            }
            WrittenContact::Edge(edge, inner, span) => {
                let inner = Box::new(self.contact(inner, depth + 1)?);
                WrittenContact::Edge(*edge, inner, self.place(*span))
            }
            WrittenContact::All(items, span) => {
                WrittenContact::All(self.all(items, depth)?, self.place(*span))
            }
            WrittenContact::Any(items, span) => {
                WrittenContact::Any(self.all(items, depth)?, self.place(*span))
            }
            WrittenContact::Compare(a, comparison, b, span) => {
                let (a, b) = (self.side(a), self.side(b));
                WrittenContact::Compare(a?, *comparison, b?, self.place(*span))
            }
        })
    }

    /// A side of a compare.
    fn side(&mut self, side: &CompareSide) -> Option<CompareSide> {
        Some(match side {
            CompareSide::Atom(atom) => {
                // Two bits may be compared; the resolver refuses a bit beside a number.
                let parameter = atom.name().and_then(|name| self.instance.declared.parameter(name));
                let wanted = match parameter.map(|parameter| parameter.kind) {
                    Some(ParameterKind::Bit | ParameterKind::Output) => WantedOperand::Operand,
                    Some(_) | None => WantedOperand::Number,
                };
                CompareSide::Atom(self.atom(atom, wanted)?)
            }
            CompareSide::Computed(computed) => CompareSide::Computed(self.computed(computed)?),
        })
    }

    fn computed(&mut self, computed: &ContactExpression) -> Option<ContactExpression> {
        self.room.take(computed.expression.parts.len())?;
        let expression = self.expression(&computed.expression)?;
        Some(ContactExpression { expression, span: self.place(computed.span) })
    }

    fn all(&mut self, items: &[WrittenContact], depth: u32) -> Option<Vec<WrittenContact>> {
        let all: Vec<WrittenContact> =
            items.iter().filter_map(|item| self.contact(item, depth + 1)).collect();
        (all.len() == items.len()).then_some(all)
    }

    fn bit(&mut self, name: &Located<String>, depth: u32) -> Option<WrittenContact> {
        let at = self.place(name.span);
        let named = self.instance.declared.parameter(&name.value);
        if let Some(named) = named.filter(|named| named.kind == ParameterKind::Contact) {
            self.argument(&name.value, at, WantedOperand::Bit)?.ok()?;
            return self.contacts_given(named.parameter.name(), at, depth);
        }
        self.name(name, WantedOperand::Bit).map(WrittenContact::Bit)
    }

    /// The contacts of an argument, as if in parentheses.
    fn contacts_given(&mut self, own: &str, at: Span, depth: u32) -> Option<WrittenContact> {
        let Given::Contacts(contact, deep) = &self.instance.given[own] else { return None };
        if depth + deep > DEPTH_MAX {
            let message = format!("more than {DEPTH_MAX} levels of parentheses and `!`");
            let help = "give parts of it bits of their own, with OUT";
            self.find(Code::TemplateSize, at, message, help);
            return None;
        }
        let (layers, room) = (&mut *self.layers, &mut *self.room);
        let mut own_layers: HashMap<FileId, FileId> = HashMap::new();
        let mut whole = true;
        let mut place = |span: Span| {
            whole &= room.take(1).is_some();
            let layer = own_layers.entry(span.file);
            let layer = *layer.or_insert_with(|| layers.add_contacts(span.file, at));
            Span { file: layer, ..span }
        };
        let mut contact = moved(contact, &mut place);
        if let WrittenContact::All(_, span) | WrittenContact::Any(_, span) = &mut contact {
            // The quotes count as its parentheses.
            *span = Span { start: span.start - 1, end: span.end + 1, ..*span };
        }
        whole.then_some(contact)
    }

    /// Rewrites an instruction; `None` if it has a mistake, which is reported.
    pub fn instruction(&mut self, text: &WrittenInstruction) -> Option<WrittenInstruction> {
        self.room.take(1 + text.operands.len())?;
        let mnemonic =
            Located { value: text.mnemonic.value.clone(), span: self.place(text.mnemonic.span) };
        let spec = Mnemonic::from_name(&mnemonic.value).map(Mnemonic::spec);
        let mut positional = 0;
        let mut operands = Vec::new();
        for operand in &text.operands {
            let wanted = wanted(spec, operand, positional);
            positional += usize::from(operand.key.is_none());
            operands.push(self.operand(operand, wanted));
        }
        let formula = match &text.formula {
            Some(formula) => Some(self.formula(formula)?),
            None => None,
        };
        let operands = operands.into_iter().collect::<Option<Vec<_>>>()?;
        Some(WrittenInstruction { span: self.place(text.span), mnemonic, operands, formula })
    }

    fn operand(
        &mut self,
        operand: &OperandText,
        wanted: Option<WantedOperand>,
    ) -> Option<OperandText> {
        let key = operand.key.as_ref();
        let key = key.map(|key| Located { value: key.value.clone(), span: self.place(key.span) });
        let value = match wanted {
            Some(wanted) => self.atom(&operand.value, wanted)?,
            None => moved_atom(&operand.value, &mut |span| self.place(span)),
        };
        Some(OperandText { span: self.place(operand.span), key, value })
    }

    fn formula(&mut self, formula: &WrittenFormula) -> Option<WrittenFormula> {
        self.room.take(formula.expression.parts.len())?;
        let wanted =
            if formula.index.is_some() { WantedOperand::Array } else { WantedOperand::Target };
        let target = self.name(&formula.target, wanted);
        let index = match &formula.index {
            Some(index) => Some(self.expression(index)?),
            None => None,
        };
        let expression = self.expression(&formula.expression);
        let bit = formula.bit.as_ref();
        let bit = bit.map(|bit| Located { value: bit.value.clone(), span: self.place(bit.span) });
        Some(WrittenFormula { target: target?, index, bit, expression: expression? })
    }

    fn expression(&mut self, expression: &Expression) -> Option<Expression> {
        let parts = expression.parts.iter().map(|part| self.part(part));
        // Rewrites all parts first, so that every mistake is reported.
        let parts: Vec<Option<ExpressionPart>> = parts.collect();
        let parts = parts.into_iter().collect::<Option<Vec<_>>>()?;
        Some(Expression { parts })
    }

    fn part(&mut self, part: &ExpressionPart) -> Option<ExpressionPart> {
        let span = self.place(part.span);
        let kind = match &part.kind {
            ExpressionPartKind::Name(name) => {
                let atom = Atom { kind: AtomKind::Name(name.clone()), span: part.span };
                // Some functions take whole arrays; the resolver checks that.
                let named = self.instance.declared.parameter(name);
                let wanted = match named.map(|named| named.kind) {
                    Some(ParameterKind::Array) => WantedOperand::Array,
                    Some(_) | None => WantedOperand::Operand,
                };
                let atom = self.atom(&atom, wanted)?;
                let kind = match atom.kind {
                    AtomKind::Name(name) => ExpressionPartKind::Name(name),
                    AtomKind::Integer(n) => ExpressionPartKind::Integer(n.into()),
                    AtomKind::Duration(ms) => ExpressionPartKind::Duration(ms),
                    AtomKind::Real(real) => ExpressionPartKind::Real(real),
                };
                return Some(ExpressionPart { kind, span: atom.span });
            }
            ExpressionPartKind::Element(name) => {
                ExpressionPartKind::Element(self.name(name, WantedOperand::Array)?)
            }
            kind @ (ExpressionPartKind::Integer(_)
            | ExpressionPartKind::WordBit(_)
            | ExpressionPartKind::Duration(_)
            | ExpressionPartKind::Real(_)
            | ExpressionPartKind::Unary(_)
            | ExpressionPartKind::Binary(..)
            | ExpressionPartKind::Call(..)) => kind.moved(&mut |span| self.place(span)),
        };
        Some(ExpressionPart { kind, span })
    }
}

/// The kind of operand that is required; `None` for a Stage.
fn wanted(
    spec: Option<&'static Spec>,
    operand: &OperandText,
    positional: usize,
) -> Option<WantedOperand> {
    let Some(spec) = spec else { return Some(WantedOperand::Any) };
    let row = spec.row(operand.key.as_ref().map(|key| key.value.as_str()), positional);
    row.map_or(Some(WantedOperand::Any), |row| WantedOperand::of(row.kind))
}
