//! Turns contacts into powers: an AND becomes an AND of powers, an OR the opposite of an AND of
//! opposites.

use super::assembler::Assembler;
use super::rungs;
use crate::resolve::program::{Comparison, ComputedContact, Contact, Edge, Value};
use rungd_engine::isa::{Bit, BitSpace};
pub use rungd_engine::ops::{
    And2, And3, And4, AnyWord, BitOwn, BitRead, BitWritten, Equal, EqualMixed, Fall, LegPowers,
    Less, LessMixed, MathReports, MathTarget, Op, Power, Powers, Rise,
};

impl Assembler<'_> {
    /// Adds the powers that must all be ON for the contact to be ON.
    pub fn all_of(&mut self, contact: &Contact, powers: &mut Vec<Power>) {
        if let Contact::All(contacts, _) = contact {
            for contact in contacts {
                self.all_of(contact, powers);
            }
            return;
        }
        let power = self.contact(contact);
        powers.push(power);
    }

    fn contact(&mut self, contact: &Contact) -> Power {
        let power = self.power_of(contact);
        match contact {
            Contact::Bit(..)
            | Contact::Element(..)
            | Contact::Edge(..)
            | Contact::Compare(..)
            | Contact::Computed(..) => self.note(|sites| sites.leaf(power)),
            Contact::Not(..) | Contact::All(..) | Contact::Any(..) => {}
        }
        power
    }

    fn power_of(&mut self, contact: &Contact) -> Power {
        match contact {
            Contact::Bit(bit, _) => Power::of(self.bit_cell(*bit)),
            Contact::Element(element, _) => self.picked_bit(*element),
            Contact::Not(inner, _) => self.contact(inner).opposite(),
            Contact::All(..) => {
                let mut powers = Vec::new();
                self.all_of(contact, &mut powers);
                self.and(&powers)
            }
            Contact::Any(contacts, _) => {
                let mut powers = Vec::new();
                self.none_of(contacts, &mut powers);
                self.and(&powers).opposite()
            }
            Contact::Edge(edge, inner, _) => self.edge(*edge, inner),
            Contact::Compare(a, comparison, b, _) => self.compare(*a, *comparison, *b),
            Contact::Computed(computed, _) => self.computed(computed),
        }
    }

    /// Adds the powers that are all ON exactly if none of the contacts is ON.
    fn none_of(&mut self, contacts: &[Contact], powers: &mut Vec<Power>) {
        for contact in contacts {
            match contact {
                Contact::Any(inner, _) => self.none_of(inner, powers),
                Contact::Bit(..)
                | Contact::Element(..)
                | Contact::Not(..)
                | Contact::All(..)
                | Contact::Edge(..)
                | Contact::Compare(..)
                | Contact::Computed(..) => {
                    let power = self.contact(contact);
                    powers.push(power.opposite());
                }
            }
        }
    }

    /// The power that is ON when all of `powers` are ON; a single power is returned as it is.
    ///
    /// A loop without copies: a leg may have as many contacts as the memory for programs holds.
    pub fn and(&mut self, powers: &[Power]) -> Power {
        let Some((&first, mut rest)) = powers.split_first() else {
            unreachable!("a series of contacts is never empty")
        };
        let mut so_far = first;
        while let [b, c, d, ref others @ ..] = *rest {
            let joined = Powers::new([so_far, b, c, d]);
            so_far = self.gate(|cell| Op::And4(And4 { cell, of: joined }));
            rest = others;
        }
        match *rest {
            [b, c] => {
                let joined = Powers::new([so_far, b, c]);
                self.gate(|cell| Op::And3(And3 { cell, of: joined }))
            }
            [b] => {
                let joined = Powers::new([so_far, b]);
                self.gate(|cell| Op::And2(And2 { cell, of: joined }))
            }
            _ => so_far,
        }
    }

    /// The leg that is ON when all of `powers` are ON.
    pub fn leg_of(&mut self, powers: &[Power]) -> LegPowers {
        match *powers {
            [ref first @ .., last] if !first.is_empty() => LegPowers::new([self.and(first), last]),
            _ => LegPowers::of(self.and(powers)),
        }
    }

    /// A leg as one power.
    pub fn one_power(&mut self, leg: LegPowers) -> Power {
        let [a, b] = leg.each();
        if a == b { a } else { self.and(&[a, b]) }
    }

    /// Returns a leg whose value stays the same while its rung executes. Inputs, private bits and
    /// the status bits of step 1 stay the same by themselves; any other bit is copied.
    pub fn keep(&mut self, leg: LegPowers) -> LegPowers {
        let power = self.one_power(leg);
        LegPowers::of(self.keep_power(power))
    }

    pub fn keep_power(&mut self, power: Power) -> Power {
        let cell = power.cell();
        let first_x = self.layout.bit(Bit::Space(BitSpace::X, 0)).0;
        let first_st = self.layout.bit(Bit::Space(BitSpace::St, 0)).0;
        let inputs = first_x..first_x + self.layout.sizes().x;
        let status = first_st..first_st + rungd_engine::isa::status::st::DIVIDE_BY_ZERO;
        if cell >= self.layout.bit_count() || inputs.contains(&cell) || status.contains(&cell) {
            return power;
        }
        let copy = self.private_bit();
        self.op(Op::And2(And2 { cell: BitOwn(copy), of: Powers::new([power, power]) }));
        Power::of(copy)
    }

    fn gate(&mut self, op: impl FnOnce(BitOwn) -> Op) -> Power {
        let cell = self.private_bit();
        self.op(op(BitOwn(cell)));
        Power::of(cell)
    }

    /// An edge of contacts; edges inside the contacts have their own histories.
    fn edge(&mut self, edge: Edge, contact: &Contact) -> Power {
        let text = rungs::edge_contact(&self.identity, edge, contact);
        let power = self.contact(contact);
        let bit = BitRead(self.as_bit(power));
        let history = self.history(text);
        self.gate(|cell| match edge {
            Edge::Rise => Op::Rise(Rise { cell, bit, history }),
            Edge::Fall => Op::Fall(Fall { cell, bit, history }),
        })
    }

    /// The cell of a power; for an opposite, a new private bit with its value.
    fn as_bit(&mut self, power: Power) -> u32 {
        if power.is_opposite() {
            let joined = Powers::new([power, power]);
            return self.gate(|cell| Op::And2(And2 { cell, of: joined })).cell();
        }
        power.cell()
    }

    /// A contact that computes, as a MATH into a private bit.
    pub(super) fn computed(&mut self, computed: &ComputedContact) -> Power {
        let cell = self.private_bit();
        let (put, on) = (MathTarget::Bit(BitWritten(cell)), self.on());
        let math = self.formula_into(put, &computed.condition(), on, MathReports::Nothing);
        self.op(Op::Math(math));
        Power::of(cell)
    }

    pub(super) fn compare(&mut self, a: Value, comparison: Comparison, b: Value) -> Power {
        let (a, b) = (self.any(a), self.any(b));
        match comparison {
            Comparison::Eq => self.equal(a, b),
            Comparison::Ne => self.equal(a, b).opposite(),
            Comparison::Lt => self.less(a, b),
            Comparison::Ge => self.less(a, b).opposite(),
            Comparison::Gt => self.less(b, a),
            Comparison::Le => self.less(b, a).opposite(),
        }
    }

    fn equal(&mut self, a: AnyWord, b: AnyWord) -> Power {
        self.gate(|cell| match a.real == b.real {
            true => Op::Equal(Equal { cell, a: a.word, b: b.word }),
            false => Op::EqualMixed(EqualMixed { cell, a, b }),
        })
    }

    /// Two reals are compared by their cells, which sort as the reals do.
    fn less(&mut self, a: AnyWord, b: AnyWord) -> Power {
        self.gate(|cell| match a.real == b.real {
            true => Op::Less(Less { cell, a: a.word, b: b.word }),
            false => Op::LessMixed(LessMixed { cell, a, b }),
        })
    }
}
