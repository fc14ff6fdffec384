//! `sensaphone-preset`: a Sensaphone counter has no preset, or its CTU and CTD have different
//! ones.
//!
//! A constant is the value of PRE at a cold start; a location is copied to PRE at every execution.
//! A constant and a location count as different presets.
//!
//! Passes:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["CTU N0 preset=5"] },
//!   { when = ["X1"], do = ["CTD N0"] },
//! ]
//! ```
//!
//! Fails:
//!
//! ```toml
//! rung = [
//!   { when = ["X0"], do = ["CTU N0"] },
//!   { when = ["X1"], do = ["CTD N0"] },
//! ]
//! ```

use crate::resolve::program::Value;
use crate::source::finding::{Code, Finding};
use crate::source::fix::{advise, text};
use crate::source::span::Located;
use rungd_engine::isa::{Address, Structure};

use super::context::{Context, ProgramInstruction};
use super::names::list;

/// Reports counters without a preset.
pub fn check_missing(context: &Context, findings: &mut Vec<Finding>) {
    for (structure, owners) in counters(context).filter(|(_, owners)| stated(owners).is_empty()) {
        findings.push(none_stated(context, structure, owners));
    }
}

/// Reports counters with two different presets.
pub fn check_different(context: &Context, findings: &mut Vec<Finding>) {
    for (structure, owners) in counters(context) {
        if let [first, others @ ..] = stated(owners).as_slice() {
            let other = others.iter().filter(|other| !first.preset.value.is_as(other.preset.value));
            findings.extend(other.map(|other| different(context, structure, *first, *other)));
        }
    }
}

fn counters<'c>(
    context: &'c Context<'c>,
) -> impl Iterator<Item = (Structure, &'c [ProgramInstruction<'c>])> {
    context.owners().filter(|(structure, _)| matches!(structure, Structure::Sensaphone(_)))
}

/// An owner that has a preset, with the preset.
#[derive(Clone, Copy)]
struct StatedPreset<'c> {
    owner: &'c ProgramInstruction<'c>,
    preset: Located<Value>,
}

fn stated<'c>(owners: &'c [ProgramInstruction<'c>]) -> Vec<StatedPreset<'c>> {
    let stated = |owner: &'c ProgramInstruction<'c>| {
        Some(StatedPreset { owner, preset: owner.instruction.preset()? })
    };
    owners.iter().filter_map(stated).collect()
}

fn none_stated(context: &Context, structure: Structure, owners: &[ProgramInstruction]) -> Finding {
    let said = context.say_structure(structure);
    let names: Vec<String> = owners.iter().map(|o| format!("`{}`", o.name())).collect();
    let verb = if owners.len() == 1 { "does" } else { "do" };
    let message =
        format!("{} of {said} {verb} not state a preset: `.DN` compares with it", list(&names));
    let name = context.name(Address::Structure(structure));
    let mut finding = Finding::new(Code::SensaphonePreset, owners[0].instruction.span, message)
        .label("preset missing")
        .help(advise("`{}`", [text(format!("{} {name} preset=10", owners[0].name())).possible()]));
    for other in &owners[1..] {
        finding = finding.related(other.instruction.span, "nor here");
    }
    finding
}

fn different(
    context: &Context,
    structure: Structure,
    first: StatedPreset,
    second: StatedPreset,
) -> Finding {
    let said = context.say_structure(structure);
    let name = context.name(Address::Structure(structure));
    let message = format!(
        "`{}` and `{}` of {said} state different presets: a counter has one",
        first.owner.name(),
        second.owner.name()
    );
    Finding::new(Code::SensaphonePreset, second.preset.span, message)
        .label("a different preset")
        .related(first.preset.span, "the first")
        .help(advise(
            "leave it out here: `{}`",
            [text(format!("{} {name}", second.owner.name()))
                .at(second.owner.instruction.span)
                .proposed()],
        ))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_main;

    #[test]
    fn counters_without_a_preset_or_with_two_presets_are_reported() {
        check_main(
            r#"
            { when = ["X0"], do = ["CTU N0"] },
            { when = ["X1"], do = ["CTD N0"] },
            { when = ["X0"], do = ["CTU N1 preset=5"] },
            { when = ["X1"], do = ["CTD N1"] },
            { when = ["X0"], do = ["CTU N2 preset=5"] },
            { when = ["X1"], do = ["CTD N2 preset=6"] },
            { when = ["X0"], do = ["CTU N3 preset=5"] },
            { when = ["X1"], do = ["CTD N3 preset=D0"] },
            { when = ["X0"], do = ["CTU N4 preset=D0"] },
            { when = ["X1"], do = ["CTD N4 preset=D0"] },
            { when = ["X1"], do = ["CTD N5"] },
            "#,
            expect![[r#"
                4:25 sensaphone-preset
                  `CTU` and `CTD` of `N0` do not state a preset: `.DN` compares with it
                    `CTU N0 preset=10`
                9:39 sensaphone-preset
                  `CTU` and `CTD` of `N2` state different presets: a counter has one
                    leave it out here: `CTD N2`
                11:39 sensaphone-preset
                  `CTU` and `CTD` of `N3` state different presets: a counter has one
                    leave it out here: `CTD N3`
                14:25 sensaphone-preset
                  `CTD` of `N5` does not state a preset: `.DN` compares with it
                    `CTD N5 preset=10`
            "#]],
        );
    }
}
