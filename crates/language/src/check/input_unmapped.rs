//! `input-unmapped`: the ladder reads an X that nothing moves, although devices move other X.
//!
//! Reported only with a controller file whose devices move an X: a ladder without such a file is
//! probably still being tried out. Rules of simulated devices and the coils of
//! `[modbus-server.image]` move an X too. An X whose tag has `initial` is meant to keep that value.
//!
//! Passes, with a map that has `X0` and `X1`; fails with `X0` alone:
//!
//! ```toml
//! [[program]]
//! name = "Main"
//! rung = [ { when = ["X0", "!X1"], do = ["OUT Y0"] } ]
//! ```

use crate::source::finding::{Code, Finding};
use rungd_engine::isa::{Address, Bit, BitSpace};

use super::context::Context;
use super::usage::reads;
use super::writers::is_writable;

/// The rule.
pub fn check(context: &Context, findings: &mut Vec<Finding>) {
    let Some(devices) = context.outside.and_then(|outside| outside.wired) else { return };
    for &(address, span) in context.progress.during(reads(context)) {
        let is_x = matches!(address, Address::Bit(Bit::Space(BitSpace::X, _)));
        if !is_x || is_writable(context, address) {
            continue;
        }
        let message = format!("no device moves {}", context.say(address));
        let name = context.name(address);
        findings.push(
            Finding::new(Code::InputUnmapped, span, message)
                .label("always OFF")
                .related(devices, "this device moves other inputs")
                .help(format!("add a row to a map: `{{ from = \"…\", to = \"{name}\" }}`")),
        );
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::check_outside;

    #[test]
    fn inputs_that_no_device_maps_are_reported() {
        check_outside(
            r#"
            { when = ["X0", "!X1", "rise(X1)", "X3"], do = ["OUT Y0"] },
            { when = ["$On"], do = ["MATH D0 = X2 + 1"] },
            "#,
            expect![[r#"
                4:19 input-unmapped
                  no device moves `X1`
                    add a row to a map: `{ from = "…", to = "X1" }`
                4:37 input-unmapped
                  no device moves `X3`
                    add a row to a map: `{ from = "…", to = "X3" }`
                5:26 input-unmapped
                  no device moves `X2`
                    add a row to a map: `{ from = "…", to = "X2" }`
            "#]],
        );
    }
}
