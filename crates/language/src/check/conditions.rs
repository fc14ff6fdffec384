//! Prints conditions for the help texts of findings, ready to paste.
//!
//! Called by the rules. The book of names prints each contact; a test loads the texts again.

use crate::resolve::name_book::NameBook;
use crate::resolve::program::{Contact, Value};
pub use rungd_engine::isa::{Address, Bit, BitSpace, LegName, duration, status};

use super::context::{Context, RungPlace};

/// The maximum length of a condition in a help text (characters).
const CONDITION_MAX: usize = 72;

/// The maximum number of places in a condition in a help text.
pub(super) const PLACES_MAX: usize = 6;

/// The bit that is always ON.
pub const ON: &str = status::BIT_NICKNAMES[status::st::ON as usize];

/// A series of contacts, after the bit of its stage or program if it needs that bit. An empty
/// series is always ON.
pub struct ContactSeries<'a> {
    /// The bit at the beginning of the series: `Day.Green`, `Drain.Running`.
    pub gate: Option<String>,
    /// The contacts.
    pub contacts: Vec<&'a Contact>,
}

impl ContactSeries<'_> {
    /// The text as one element of `when`. With `alone` = false, the text can be placed beside `&`
    /// or `|`: it has parentheses if it needs them.
    fn print(&self, names: &NameBook, alone: bool) -> String {
        let all = match (&self.gate, self.contacts.as_slice()) {
            (None, []) => return ON.to_owned(),
            (Some(gate), []) => return gate.clone(),
            (None, [one @ Contact::Any(..)]) => return names.contact(one),
            (None, [one @ Contact::All(..)]) => names.contact(one),
            (None, [one]) => return names.contact(one),
            (gate, many) => {
                let parts = many.iter().flat_map(|contact| contact.in_series());
                let parts = parts.map(|contact| names.grouped(contact));
                gate.iter().cloned().chain(parts).collect::<Vec<_>>().join(" & ")
            }
        };
        if alone { all } else { format!("({all})") }
    }
}

impl<'a> Context<'a> {
    /// A value as text; a bare number of milliseconds gets its unit.
    pub fn milliseconds(&self, value: Value) -> String {
        match value {
            Value::Const(ms, _) => duration::print(ms),
            Value::Real(_) | Value::Word(_) | Value::Element(_) => self.program.names.value(value),
        }
    }

    /// One condition that is ON if any of `powers` is ON, as the text of `when = ["…"]`. `None` if
    /// a power is unknown, or if the condition is too long or always ON.
    pub fn any_of(
        &self,
        powers: impl ExactSizeIterator<Item = Option<ContactSeries<'a>>>,
    ) -> Option<String> {
        let count = powers.len();
        if count > PLACES_MAX {
            return None;
        }
        let mut terms: Vec<String> = Vec::new();
        for power in powers {
            let term = power?.print(&self.program.names, count == 1);
            if !terms.contains(&term) {
                terms.push(term);
            }
        }
        let text = terms.join(" | ");
        (text.len() <= CONDITION_MAX && !terms.iter().any(|term| term == ON)).then_some(text)
    }

    /// The power at a place, without `$On`. `None` in a rung without a `when` leg, and if contacts
    /// may have been left out of the program.
    pub fn power(&self, place: &RungPlace<'a>) -> Option<ContactSeries<'a>> {
        if !self.whole {
            return None;
        }
        let when = place.rung.legs.iter().find(|leg| leg.name == LegName::When)?;
        let behind = place.branch.map_or(&[][..], |branch| &branch.contacts);
        let on = Bit::Space(BitSpace::St, status::st::ON);
        let needed = |c: &&Contact| !matches!(c, Contact::Bit(bit, _) if *bit == on);
        let contacts = when.contacts.iter().chain(behind).filter(needed).collect();
        Some(ContactSeries { gate: None, contacts })
    }

    /// The power at a place, for use in a different block: with the bit of its stage or program.
    /// `None` in a task or subroutine too, because its rungs do not execute in every scan.
    pub fn power_from_outside(&self, place: &RungPlace<'a>) -> Option<ContactSeries<'a>> {
        let mut power = self.power(place)?;
        power.gate = match place.stage {
            _ if place.is_outside_programs() => return None,
            Some(stage) => Some(self.name(Address::Bit(Bit::Stage(stage.id)))),
            None if place.block.is_main() => None,
            None => Some(self.name(Address::Bit(Bit::Running(place.block.id)))),
        };
        Some(power)
    }
}

#[cfg(test)]
mod tests {
    use crate::check::testing::load;

    /// The contacts of a rung, loaded and printed.
    fn printed(contacts: &[String]) -> Vec<String> {
        let contacts: Vec<String> = contacts.iter().map(|text| format!("\"{text}\"")).collect();
        let ladder = format!(
            "[tags]\nlamp = {{ at = \"Y0\" }}\nbottles = {{ at = \"CT0\" }}\n\
             limit = {{ value = 5 }}\nsettle = {{ value = \"2s\" }}\nhot = {{ value = 80.5 }}\n\
             [[program]]\nname = \"Main\"\n\
             rung = [ {{ when = [{}], do = [\"OUT lamp\", \"RUN Day\", \"ENTASK Tell\"] }} ]\n\
             [[program]]\nname = \"Day\"\n[[program.stage]]\nname = \"Green\"\n\
             [[task]]\nname = \"Tell\"\n",
            contacts.join(", ")
        );
        let (program, findings) = load(&ladder);
        let program = program.unwrap_or_else(|| panic!("{findings:?}"));
        let when = &program.blocks[0].rungs[0].legs[0];
        when.contacts.iter().map(|contact| program.names.contact(contact)).collect()
    }

    #[test]
    fn printed_conditions_parse_to_the_same_condition() {
        let written = [
            "Y0 | CT0.Done",
            "!X0 & !(X1 | C2) & !rise(X3)",
            "X0 & X1 | X2 & (fall(C1) | MC1)",
            "!(D0 == -3) & V1 <= 2s & CT0.Acc != N,0,6",
            "Day.Green | Day.Running | Tell.Done | N0.DN",
            "$On & ST0 & $ScanCounter > 5 & DST4 < N3.PRE",
        ];
        let once = printed(&written.map(str::to_owned));
        assert_eq!(
            once,
            [
                "lamp | bottles.Done",
                "!X0 & !(X1 | C2) & !rise(X3)",
                "(X0 & X1) | (X2 & (fall(C1) | MC1))",
                "!(D0 == -3) & V1 <= 2s & bottles.Acc != N0.ACC",
                "Day.Green | Day.Running | Tell.Done | N0.DN",
                "$On & $FirstScan & $ScanCounter > 5 & DST4 < N3.PRE",
            ]
        );
        assert_eq!(printed(&once), once);
    }

    fn printed_texts(contacts: &[&str]) -> Vec<String> {
        printed(&contacts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn constants_are_shown_by_their_names() {
        let written = [
            "D0 > limit",
            "X0 & (limit < D0 | X1)",
            "T0.Acc >= settle",
            "R0 < hot",
            "D0 + limit * 3 > 7 - D1",
            "!rise(D0 == limit) & D1 == 5",
        ];
        assert_eq!(printed_texts(&written), written);
    }

    #[test]
    fn a_name_that_may_belong_to_either_of_two_numbers_is_shown_as_a_number() {
        assert_eq!(
            printed_texts(&["D0 * limit > 5", "D0 + 5 > limit"]),
            ["D0 * 5 > 5", "D0 + 5 > 5"]
        );
        assert_eq!(printed_texts(&["D0 + 5 > limit + 5"]), ["D0 + 5 > 5 + 5"]);
        assert_eq!(printed_texts(&["D0 + limit > limit"]), ["D0 + limit > limit"]);
    }
}
