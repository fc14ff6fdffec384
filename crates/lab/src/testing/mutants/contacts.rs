//! The mutations of the contacts of a leg or branch.
//!
//! A contact here is a unit that an author adds or forgets: a bit, a compare or an edge, each with
//! its `!`. The members of groups are mutated one by one. `$On` and `$Off` are not mutated.

use rungd_engine::isa::{Bit, BitSpace, LegName, Mnemonic, Structure, Word, status::st};
pub use rungd_language::resolve::program::{
    Comparison, ComputedCompare, ComputedContact, ConstantForm, Contact, Edge, Instruction, Rung,
    Value,
};
use rungd_language::source::span::Span;

use super::formula::{self, ContactSite};
use super::ground::{ExchangedText, FoundMutation, Ground, MutationSite, change_of_constant};
use super::kind::MutantKind;
use super::mutation::{Mutation, RungContacts};
use super::values::{ConstantStep, Direction};
use super::word_bits::{other_bit_of_word, with_number};

/// All mutations of a rung's contacts, in file order.
pub(super) fn contacts(ground: &Ground, rung: &Rung) -> Vec<FoundMutation> {
    let mut found = Vec::new();
    for (at, leg) in rung.legs.iter().enumerate() {
        let mut search = ContactSearch::new(ground, RungContacts::Leg(at), &leg.contacts);
        search.sees_edges_only = sees_edges_only(rung, leg.name);
        leg.contacts.iter().for_each(|contact| search.contact(contact, false));
        found.append(&mut search.found);
    }
    for (at, branch) in rung.branches.iter().enumerate() {
        let mut search = ContactSearch::new(ground, RungContacts::Branch(at), &branch.contacts);
        branch.contacts.iter().for_each(|contact| search.contact(contact, false));
        found.append(&mut search.found);
    }
    found
}

/// Whether only the rising edges of a leg have an effect.
fn sees_edges_only(rung: &Rung, leg: LegName) -> bool {
    let contacts = |instruction: &Instruction| {
        matches!(instruction.mnemonic, Mnemonic::Pd | Mnemonic::Ponoff | Mnemonic::Restart)
            || instruction.runs_once()
    };
    match leg {
        LegName::Up | LegName::Dn | LegName::Clk => true,
        LegName::When => rung.branches.is_empty() && rung.body.iter().all(contacts),
        LegName::Rst | LegName::En | LegName::Data => false,
    }
}

/// A walk over one series.
struct ContactSearch<'g, 'a> {
    ground: &'g Ground<'a>,
    series: RungContacts,
    /// Whether the series has one contact.
    is_alone: bool,
    sees_edges_only: bool,
    /// The number of the next contact in the walk.
    number: u32,
    found: Vec<FoundMutation>,
}

/// A compare whose mutations are searched.
struct SearchedCompare {
    a: Value,
    how: Comparison,
    b: Value,
    span: Span,
}

impl<'g, 'a> ContactSearch<'g, 'a> {
    fn new(ground: &'g Ground<'a>, series: RungContacts, contacts: &[Contact]) -> Self {
        let is_alone = contacts.len() == 1;
        let found = Vec::new();
        ContactSearch { ground, series, is_alone, sees_edges_only: false, number: 0, found }
    }

    /// Walks a contact. `is_part`: the `!` or edge around the contact is mutated instead of it.
    fn contact(&mut self, contact: &Contact, is_part: bool) {
        let number = self.number;
        self.number += 1;
        if !is_part && is_single(contact) && !is_fixed(contact) {
            self.inverted(contact, number);
            self.left_out(contact, number);
        }
        match contact {
            Contact::Bit(bit, span) => self.other_bit(*bit, *span, number),
            Contact::Element(..) => {}
            Contact::Not(inner, span) => {
                let is_group = is_group(inner);
                if is_group && !is_part {
                    let text = self.ground.text_within(inner.span(), *span);
                    let what = self.became("contact ", *span, text);
                    let site = MutationSite::new(MutantKind::Inverted, *span);
                    self.find(site, what, number, inner);
                }
                self.contact(inner, !is_group);
            }
            Contact::All(members, _) | Contact::Any(members, _) => {
                self.group(contact, members, number);
                let was_alone = std::mem::replace(&mut self.is_alone, false);
                members.iter().for_each(|member| self.contact(member, false));
                self.is_alone = was_alone;
            }
            Contact::Edge(edge, inner, span) => {
                if !is_fixed(inner) {
                    self.edge(*span, number, *edge, inner);
                }
                self.contact(inner, !is_group(inner));
            }
            Contact::Compare(a, how, b, span) => {
                self.compare(SearchedCompare { a: *a, how: *how, b: *b, span: *span }, number);
            }
            Contact::Computed(computed, span) => self.computed(computed, *span, number),
        }
    }

    fn inverted(&mut self, contact: &Contact, number: u32) {
        let text = self.text(contact.span());
        let (new, new_text) = match contact {
            Contact::Not(inner, span) => {
                let text = self.ground.text_within(inner.span(), *span);
                ((**inner).clone(), text.to_owned())
            }
            Contact::Compare(a, how, b, span) => {
                let how = how.negated();
                (Contact::Compare(*a, how, *b, *span), self.compared(*span, how))
            }
            Contact::Computed(computed, span) if computed.compare.is_some() => {
                let mut new = computed.clone();
                let compare = new.compare.as_mut().expect("the arm's condition");
                compare.comparison = compare.comparison.negated();
                let text = self.compared(*span, compare.comparison);
                (Contact::Computed(new, *span), text)
            }
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::All(..)
            | Contact::Any(..)
            | Contact::Edge(..)
            | Contact::Computed(..) => {
                (Contact::Not(Box::new(contact.clone()), contact.span()), format!("!{text}"))
            }
        };
        let what = self.became("contact ", contact.span(), &new_text);
        self.find(MutationSite::new(MutantKind::Inverted, contact.span()), what, number, &new);
    }

    /// Exchanges a bit of a word for another bit of the same word.
    fn other_bit(&mut self, bit: Bit, span: Span, number: u32) {
        let Some(other) = other_bit_of_word(bit) else { return };
        let text = with_number(self.text(span), bit, other);
        let what = self.became("contact ", span, &text);
        let site = MutationSite::new(MutantKind::WordBit, span);
        self.find(site, what, number, &Contact::Bit(Bit::InWord(other), span));
    }

    fn left_out(&mut self, contact: &Contact, number: u32) {
        let text = self.text(contact.span());
        let what = match self.is_alone {
            true => format!("contact `{text}` is always ON"),
            false => format!("contact `{text}` left out"),
        };
        let site = MutationSite::new(MutantKind::ContactOut, contact.span());
        self.push(site, what, Mutation::Contact(self.series, number, None));
    }

    fn group(&mut self, contact: &Contact, members: &[Contact], number: u32) {
        let (span, members) = (contact.span(), members.to_vec());
        let text = |member: &Contact| self.ground.text_within(member.span(), span);
        let texts: Vec<&str> = members.iter().map(text).collect();
        let is_all = matches!(contact, Contact::All(..));
        let mut text = texts.join(if is_all { " | " } else { " & " });
        let new = if is_all { Contact::Any(members, span) } else { Contact::All(members, span) };
        if inside(self.text(span)).is_some() {
            text = format!("({text})");
        }
        let what = self.became("", span, &text);
        self.find(MutationSite::new(MutantKind::Group, span), what, number, &new);
    }

    fn edge(&mut self, span: Span, number: u32, edge: Edge, inner: &Contact) {
        let inner_text = self.ground.text_within(inner.span(), span);
        let is_leg = number == 0 && self.is_alone;
        if !(edge == Edge::Rise && self.sees_edges_only && is_leg) {
            let what = self.became("", span, inner_text);
            self.find(MutationSite::new(MutantKind::Level, span), what, number, inner);
        }
        let other = match edge {
            Edge::Rise => Edge::Fall,
            Edge::Fall => Edge::Rise,
        };
        let new = Contact::Edge(other, Box::new(inner.clone()), span);
        let inner_text = inside(inner_text).unwrap_or(inner_text);
        let what = self.became("", span, &format!("{}({inner_text})", other.name()));
        self.find(MutationSite::new(MutantKind::OtherEdge, span), what, number, &new);
    }

    fn compare(&mut self, SearchedCompare { a, how, b, span }: SearchedCompare, number: u32) {
        let moved = border_moved(how);
        if let Some(moved) = moved {
            let what = self.became("", span, &self.compared(span, moved));
            let new = Contact::Compare(a, moved, b, span);
            self.find(MutationSite::new(MutantKind::Border, span), what, number, &new);
        }
        let is_timer = |value| matches!(value, Value::Word(Word::Acc(Structure::Timer(_))));
        for (side, value, other) in [(0, a, b), (1, b, a)] {
            let is_time =
                matches!(value, Value::Const(_, ConstantForm::Duration)) || is_timer(other);
            let step = match is_time {
                true => ConstantStep::time(self.ground.period, 0),
                false => ConstantStep::count(i32::MIN, i32::MAX),
            };
            let same = border_as_constant(how, side == 0);
            for (to, new) in step.neighbours(value) {
                let is_whole = !value.is_real() && !other.is_real();
                let on_grid = matches!(value, Value::Const(n, _) if step.is_next(n));
                if is_whole && on_grid && same == Some(to) {
                    continue;
                }
                let (a, b) = if side == 0 { (new, b) } else { (a, new) };
                let texts = ExchangedText { old: &step.text(value), new: &step.text(new) };
                let written = self.sides(span)[side];
                let what = change_of_constant(written, texts);
                let what = format!("{what} in `{}`", self.text(span));
                let variant = side as u32 * 2 + to as u32;
                let new = Contact::Compare(a, how, b, span);
                let site = MutationSite { kind: MutantKind::Number, span, variant };
                self.find(site, what, number, &new);
            }
        }
    }

    fn computed(&mut self, computed: &ComputedContact, span: Span, number: u32) {
        if let Some(compare) = &computed.compare
            && let Some(moved) = border_moved(compare.comparison)
        {
            let what = self.became("", span, &self.compared(span, moved));
            let compare = ComputedCompare { comparison: moved, ..compare.clone() };
            let new = ComputedContact { compare: Some(compare), ..computed.clone() };
            let new = Contact::Computed(Box::new(new), span);
            self.find(MutationSite::new(MutantKind::Border, span), what, number, &new);
        }
        let (series, site) = (self.series, ContactSite { span, branch: self.branch() });
        let change = |new: ComputedContact| {
            let new = Contact::Computed(Box::new(new), span);
            Mutation::Contact(series, number, Some(new))
        };
        let parts = formula::of_contact(self.ground, computed, site, &change);
        self.found.extend(parts);
    }

    /// The number of the branch of this series, from 1.
    fn branch(&self) -> Option<usize> {
        match self.series {
            RungContacts::Leg(_) => None,
            RungContacts::Branch(at) => Some(at + 1),
        }
    }

    /// The text of a compare with a different sign.
    fn compared(&self, span: Span, how: Comparison) -> String {
        let [a, b] = self.sides(span);
        format!("{a} {} {b}", how.sign())
    }

    /// The texts on both sides of a compare.
    fn sides(&self, span: Span) -> [&'a str; 2] {
        let is_sign = |char: char| "<>=!".contains(char);
        let text = self.text(span);
        let at = text.find(is_sign).unwrap_or(text.len());
        let (a, b) = text.split_at(at);
        [a.trim(), b.trim_start_matches(is_sign).trim()]
    }

    fn text(&self, span: Span) -> &'a str {
        self.ground.text_of(span)
    }

    fn became(&self, before: &str, span: Span, new: &str) -> String {
        format!("{before}`{}` is `{new}`", self.text(span))
    }

    /// Adds the mutation that puts a new contact in the place of the contact with a number.
    fn find(&mut self, site: MutationSite, what: String, number: u32, new: &Contact) {
        self.push(site, what, Mutation::Contact(self.series, number, Some(new.clone())));
    }

    fn push(&mut self, site: MutationSite, what: String, mutation: Mutation) {
        let branch = self.branch();
        let MutationSite { kind, span, variant } = site;
        let place = self.ground.place(span);
        self.found.push(FoundMutation { kind, place, variant, what, branch, mutation });
    }
}

/// The compare with its border on the other side of its number. `==` and `!=` have no border.
fn border_moved(how: Comparison) -> Option<Comparison> {
    match how {
        Comparison::Lt => Some(Comparison::Le),
        Comparison::Le => Some(Comparison::Lt),
        Comparison::Gt => Some(Comparison::Ge),
        Comparison::Ge => Some(Comparison::Gt),
        Comparison::Eq | Comparison::Ne => None,
    }
}

/// The direction in which the neighbour of a whole constant has the same effect as the moved
/// border.
fn border_as_constant(how: Comparison, is_left: bool) -> Option<Direction> {
    match (how, is_left) {
        (Comparison::Ge | Comparison::Lt, false) | (Comparison::Le | Comparison::Gt, true) => {
            Some(Direction::More)
        }
        (Comparison::Gt | Comparison::Le, false) | (Comparison::Lt | Comparison::Ge, true) => {
            Some(Direction::Less)
        }
        (Comparison::Eq | Comparison::Ne, _) => None,
    }
}

/// Whether a contact is a bit, a compare or an edge, with or without `!`.
fn is_single(contact: &Contact) -> bool {
    match contact {
        Contact::Bit(..)
        | Contact::Element(..)
        | Contact::Edge(..)
        | Contact::Compare(..)
        | Contact::Computed(..) => true,
        Contact::Not(inner, _) => is_single(inner),
        Contact::All(..) | Contact::Any(..) => false,
    }
}

fn is_group(contact: &Contact) -> bool {
    matches!(contact, Contact::All(..) | Contact::Any(..))
}

/// Whether a contact is `$On` or `$Off`, or an edge of these. A use of a template passes them for
/// arguments that it does not need.
fn is_fixed(contact: &Contact) -> bool {
    match contact {
        Contact::Bit(Bit::Space(BitSpace::St, n), _) => [st::ON, st::OFF].contains(n),
        Contact::Not(inner, _) | Contact::Edge(_, inner, _) => is_fixed(inner),
        Contact::Bit(..)
        | Contact::Element(..)
        | Contact::All(..)
        | Contact::Any(..)
        | Contact::Compare(..)
        | Contact::Computed(..) => false,
    }
}

/// The text within a pair of parentheses that encloses the whole text; `None` if there is no such
/// pair.
fn inside(text: &str) -> Option<&str> {
    let within = text.strip_prefix('(')?.strip_suffix(')')?;
    let mut depth = 0;
    let closes = within.chars().any(|char| {
        depth += i32::from(char == '(') - i32::from(char == ')');
        depth < 0
    });
    (!closes).then_some(within)
}
