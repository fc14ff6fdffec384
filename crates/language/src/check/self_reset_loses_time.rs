//! `self-reset-loses-time`: a timer that its own Done resets, to begin again.
//!
//! Done is found only at a scan, up to a period late, and that part is thrown away; then one scan
//! executes the timer with its leg OFF (or RST ON), and the time begins to count at the scan after.
//! A round of 100 ms takes 110 to 120 ms with a period of 10 ms. The remedy lets the timer run on
//! and takes the time of a round off. OFFDTMR is not Done while its leg is ON, so it does not reset
//! itself this way. Two timers that restart each other are not reported: such a flasher is seldom
//! meant to measure.
//!
//! Passes:
//!
//! ```toml
//! { when = ["$On"], do = ["TMR T0 preset=100ms"] }
//! { when = ["T0.Done"], do = ["SUB T0.Acc 100ms to=T0.Acc", "ADD D0 1 to=D0"] }
//! ```
//!
//! Fails:
//!
//! ```toml
//! { when = ["!T0.Done"], do = ["TMR T0 preset=100ms"] }
//! ```

use crate::resolve::program::{Comparison, Contact, Value};
use crate::source::finding::{Code, Finding};
pub use rungd_engine::isa::{Address, Bit, Flag, LegName, Mnemonic, Structure, Word};

use super::constant_compare::mirrored;
use super::context::{Context, ProgramInstruction};

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    for placed in context.instructions() {
        let Some(timer) = SelfTimer::of(placed) else { continue };
        let legs = placed.place.rung.legs.iter();
        let branch = placed.place.branch.iter().flat_map(|branch| &branch.contacts);
        let enabling = legs.clone().filter(|leg| matches!(leg.name, LegName::When | LegName::En));
        let enabling = enabling.flat_map(|leg| &leg.contacts).chain(branch);
        let resets = legs.filter(|leg| leg.name == LegName::Rst).flat_map(|leg| &leg.contacts);
        let found = enabling
            .flat_map(Contact::in_series)
            .find(|contact| timer.is_over(contact, false))
            .or_else(|| {
                resets.flat_map(Contact::in_parallel).find(|contact| timer.is_over(contact, true))
            });
        findings.extend(found.map(|contact| timer.finding(context, placed, contact)));
    }
}

/// A timer that can reset itself.
struct SelfTimer {
    t: Structure,
    preset: Value,
    /// The output bit of ONDTMR.
    output: Option<Bit>,
}

impl SelfTimer {
    fn of(placed: &ProgramInstruction) -> Option<SelfTimer> {
        let instruction = placed.instruction;
        let t = instruction.owned().filter(|_| placed.mnemonic() != Mnemonic::Offdtmr)?;
        let (preset, output) =
            (instruction.preset()?.value, instruction.driven().map(|output| output.value));
        matches!(t, Structure::Timer(_)).then_some(SelfTimer { t, preset, output })
    }

    /// Whether the contact is in this state once the timer's time is over.
    fn is_over(&self, contact: &Contact, is_on: bool) -> bool {
        match contact {
            Contact::Bit(bit, _) => {
                let is_done = *bit == Bit::Flag(self.t, Flag::Done) || Some(*bit) == self.output;
                is_done && is_on
            }
            Contact::Not(inner, _) => self.is_over(inner, !is_on),
            Contact::Compare(left, comparison, right, _) => {
                let acc = Value::Word(Word::Acc(self.t));
                let comparison = match (*left == acc, *right == acc) {
                    (true, false) => *comparison,
                    (false, true) => mirrored(*comparison),
                    _ => return false,
                };
                match comparison {
                    Comparison::Ge | Comparison::Gt => is_on,
                    Comparison::Lt | Comparison::Le => !is_on,
                    Comparison::Eq | Comparison::Ne => false,
                }
            }
            Contact::Element(..)
            | Contact::All(..)
            | Contact::Any(..)
            | Contact::Edge(..)
            | Contact::Computed(..) => false,
        }
    }

    fn finding(
        &self,
        context: &Context,
        placed: &ProgramInstruction,
        contact: &Contact,
    ) -> Finding {
        let t = context.name(Address::Structure(self.t));
        let preset = context.milliseconds(self.preset);
        let resets = context.program.names.contact(contact);
        let message = format!(
            "{} resets itself: each round takes up to two scans longer than {preset}",
            context.say_structure(self.t)
        );
        let help = format!(
            "let it run on, and take the time of a round off, which loses nothing: without \
             `{resets}` here, as a TMR, and behind it\n  \
             {{ when = [\"{t}.Done\"], do = [\"SUB {t}.Acc {preset} to={t}.Acc\"] }},\n\
             `{t}.Done` is ON for one scan in each round, as before; or use the templates Tick and \
             Totalizer of `lib:tick` and `lib:totalizer`"
        );
        Finding::new(Code::SelfResetLosesTime, contact.span(), message)
            .label(format!("`{}` begins anew only two scans after it is done", placed.name()))
            .help(help)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_only;
    use crate::source::finding::Code;

    #[test]
    fn only_timers_that_reset_themselves_are_reported() {
        let rungs = r#"
            { when = ["!T0.Done"], do = ["TMR T0 preset=100ms"] },
            { when = ["X0 & !T1.Done", "X1"], do = ["TMR T1 preset=D0"] },
            { when = ["!C0"], do = ["ONDTMR T2 preset=3s output=C0"] },
            { leg.en = ["X0"], leg.rst = ["X1 | T3.Done"], do = ["TMRA T3 preset=3s"] },
            { leg.en = ["X0", "T4.Acc < 3s"], leg.rst = ["X1"], do = ["TMRA T4 preset=3s"] },
            { when = ["X0", "!T5.Done | X1"], do = ["TMR T5 preset=1s"] },
            { when = ["!T7.Done"], do = ["TMR T6 preset=1s"] },
            { when = ["T6.Done"], do = ["TMR T7 preset=1s"] },
            { when = ["!T8.Done"], do = ["OFFDTMR T8 preset=1s output=C8"] },
            { leg.en = ["T9.Done"], leg.rst = ["!T9.Done"], do = ["TMRA T9 preset=3s"] },
            { when = ["T10.Acc > 1s"], do = ["TMRAG T10 preset=3s", "RSTT T10"] },
            "#;
        let ladder = format!("[[program]]\nname = \"Main\"\nrung = [\n{}\n]", rungs.trim());
        check_only(
            Code::SelfResetLosesTime,
            &ladder,
            expect![[r#"
            4:12 self-reset-loses-time
              `T0` resets itself: each round takes up to two scans longer than 100ms
                let it run on, and take the time of a round off, which loses nothing:
                without `!T0.Done` here, as a TMR, and behind it
                { when = ["T0.Done"], do = ["SUB T0.Acc 100ms to=T0.Acc"] },
                `T0.Done` is ON for one scan in each round, as before; or use the
                templates Tick and Totalizer of `lib:tick` and `lib:totalizer`
            5:17 self-reset-loses-time
              `T1` resets itself: each round takes up to two scans longer than D0
                let it run on, and take the time of a round off, which loses nothing:
                without `!T1.Done` here, as a TMR, and behind it
                { when = ["T1.Done"], do = ["SUB T1.Acc D0 to=T1.Acc"] },
                `T1.Done` is ON for one scan in each round, as before; or use the
                templates Tick and Totalizer of `lib:tick` and `lib:totalizer`
            6:12 self-reset-loses-time
              `T2` resets itself: each round takes up to two scans longer than 3s
                let it run on, and take the time of a round off, which loses nothing:
                without `!C0` here, as a TMR, and behind it
                { when = ["T2.Done"], do = ["SUB T2.Acc 3s to=T2.Acc"] },
                `T2.Done` is ON for one scan in each round, as before; or use the
                templates Tick and Totalizer of `lib:tick` and `lib:totalizer`
            7:37 self-reset-loses-time
              `T3` resets itself: each round takes up to two scans longer than 3s
                let it run on, and take the time of a round off, which loses nothing:
                without `T3.Done` here, as a TMR, and behind it
                { when = ["T3.Done"], do = ["SUB T3.Acc 3s to=T3.Acc"] },
                `T3.Done` is ON for one scan in each round, as before; or use the
                templates Tick and Totalizer of `lib:tick` and `lib:totalizer`
            8:20 self-reset-loses-time
              `T4` resets itself: each round takes up to two scans longer than 3s
                let it run on, and take the time of a round off, which loses nothing:
                without `T4.Acc < 3s` here, as a TMR, and behind it
                { when = ["T4.Done"], do = ["SUB T4.Acc 3s to=T4.Acc"] },
                `T4.Done` is ON for one scan in each round, as before; or use the
                templates Tick and Totalizer of `lib:tick` and `lib:totalizer`
        "#]],
        );
    }
}
