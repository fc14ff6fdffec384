//! The counters: semantics, section 2.

use crate::export::block_body::BlockBody;
use crate::export::functions::{difference, number, select, sum, variable};
use crate::export::project::{ExportedUnit, NetworkPower, off, on};

/// A counter with these legs and presets.
fn counter(name: &str, doc: &str, legs: &[&str], presets: &[&str]) -> BlockBody {
    BlockBody::new(name, doc)
        .inputs("BOOL", legs)
        .inputs("DINT", presets)
        .inputs("BOOL", &["Pending"])
        .inputs("DINT", &["Acc"])
        .outputs("DINT", &["NewAcc"])
        .outputs("BOOL", &["Done", "Reset", "Zero"])
        .locals("BOOL", &["resets"])
        .coil("resets", NetworkPower::any([on("Rst"), on("Pending")]))
}

/// A bit for the rising edge of a leg.
fn edge(body: BlockBody, bit: &str, [leg, was]: [&str; 2]) -> BlockBody {
    body.coil(bit, NetworkPower::all([on(leg), off(was)])).coil(was, on(leg))
}

/// The flags that all counters have.
fn flags(body: BlockBody) -> ExportedUnit {
    body.compare("Zero", "EQ", [variable("NewAcc"), number(0)]).coil("Reset", on("resets")).0
}

/// CNT.
pub(super) fn up(name: &str) -> ExportedUnit {
    let body = counter(name, "CNT of rungd", &["Up", "Rst"], &["Preset"])
        .locals("BOOL", &["counts", "was_up"]);
    let body = edge(body, "counts", ["Up", "was_up"]).store(
        "NewAcc",
        select(
            on("resets"),
            select(on("counts"), variable("Acc"), sum(variable("Acc"), number(1))),
            number(0),
        ),
    );
    flags(body.compare("Done", "GE", [variable("NewAcc"), variable("Preset")]))
}

/// CNTDN.
pub(super) fn down(name: &str) -> ExportedUnit {
    let body = counter(name, "CNTDN of rungd", &["Dn", "Rst"], &["Preset"])
        .locals("BOOL", &["counts", "was_dn", "takes", "loads", "loaded"])
        .locals("DINT", &["base"]);
    let body = edge(body, "counts", ["Dn", "was_dn"])
        .coil("takes", NetworkPower::all([on("counts"), off("resets")]))
        .coil("loads", NetworkPower::any([on("resets"), off("loaded")]))
        .coil("loaded", NetworkPower::Constant(true))
        .store("base", select(on("loads"), variable("Acc"), variable("Preset")))
        .store(
            "NewAcc",
            select(on("takes"), variable("base"), difference(variable("base"), number(1))),
        );
    flags(body.compare("Done", "LE", [variable("NewAcc"), number(0)]))
}

/// UDC and UDCG.
pub(super) fn up_down(name: &str) -> ExportedUnit {
    let presets = ["UpPreset", "DnPreset"];
    let legs = ["Up", "Dn", "Rst"];
    let body = counter(name, "UDC and UDCG of rungd", &legs, &presets)
        .outputs("BOOL", &["DnDone"])
        .locals("BOOL", &["rises", "falls", "was_up", "was_dn", "adds", "takes"])
        .locals("DINT", &["added"]);
    let body = edge(body, "rises", ["Up", "was_up"]);
    let body = edge(body, "falls", ["Dn", "was_dn"])
        .coil("adds", NetworkPower::all([on("rises"), off("falls")]))
        .coil("takes", NetworkPower::all([on("falls"), off("rises")]))
        .store("added", select(on("adds"), variable("Acc"), sum(variable("Acc"), number(1))))
        .store(
            "NewAcc",
            select(
                on("resets"),
                select(on("takes"), variable("added"), difference(variable("added"), number(1))),
                number(0),
            ),
        )
        .compare("Done", "GE", [variable("NewAcc"), variable("UpPreset")])
        .compare("DnDone", "LE", [variable("NewAcc"), variable("DnPreset")]);
    flags(body)
}
