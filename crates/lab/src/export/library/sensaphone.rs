//! The counters of the Sensaphone SCADA 3000: semantics, section 5.

use crate::export::block_body::BlockBody;
use crate::export::functions::{number, of_two, select, variable};
use crate::export::project::{ExportedUnit, NetworkPower, off, on};

/// CTU.
pub(super) fn up(name: &str) -> ExportedUnit {
    counter(name, ["Ov", "NewOv", "Un", "NewUn"], "ADD", [32_767, -32_768])
}

/// CTD.
pub(super) fn down(name: &str) -> ExportedUnit {
    counter(name, ["Un", "NewUn", "Ov", "NewOv"], "SUB", [-32_768, 32_767])
}

/// A step over the limit of 16 bits turns its own flag ON, or the opposite one OFF.
fn counter(
    name: &str,
    [own, new_own, other, new_other]: [&str; 4],
    step: &str,
    [limit, beyond]: [i64; 2],
) -> ExportedUnit {
    let doc = if step == "ADD" { "CTU of rungd" } else { "CTD of rungd" };
    BlockBody::new(name, doc)
        .inputs("BOOL", &["Leg", "Ov", "Un"])
        .inputs("DINT", &["Pre", "Acc"])
        .outputs("DINT", &["NewAcc"])
        .outputs("BOOL", &["Enabled", "Dn", "NewOv", "NewUn"])
        .locals("BOOL", &["counts", "was_on", "ends", "wraps"])
        .coil("counts", NetworkPower::all([on("Leg"), off("was_on")]))
        .coil("was_on", on("Leg"))
        .coil("Enabled", on("Leg"))
        .compare("ends", "EQ", [variable("Acc"), number(limit)])
        .coil("wraps", NetworkPower::all([on("counts"), on("ends")]))
        .store(
            "NewAcc",
            select(
                on("counts"),
                variable("Acc"),
                select(on("wraps"), of_two(step, variable("Acc"), number(1)), number(beyond)),
            ),
        )
        .coil(new_own, NetworkPower::any([on(own), NetworkPower::all([on("wraps"), off(other)])]))
        .coil(new_other, NetworkPower::all([on(other), off("wraps")]))
        .compare("Dn", "GE", [variable("NewAcc"), variable("Pre")])
        .0
}
