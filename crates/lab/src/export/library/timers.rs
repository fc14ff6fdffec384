//! The timers: semantics, section 3.

use crate::export::block_body::BlockBody;
use crate::export::functions::{at_least_zero, number, select, time_added, time_taken, variable};
use crate::export::project::{CallSource, ExportedUnit, NetworkPower, off, on};

/// A timer with one leg, or with a reset leg too.
fn timer(name: &str, doc: &str, legs: &[&str]) -> BlockBody {
    BlockBody::new(name, doc)
        .inputs("BOOL", legs)
        .inputs("DINT", &["Preset", "Elapsed"])
        .inputs("BOOL", &["Pending"])
        .inputs("DINT", &["Acc"])
        .outputs("DINT", &["NewAcc"])
        .outputs("BOOL", &["Done", "Reset", "Zero", "Timing"])
}

/// Whether a timer's new value is at its limit, and its flag Zero.
fn flags(body: BlockBody, compare: &str, limit: CallSource) -> BlockBody {
    body.compare("reached", compare, [variable("NewAcc"), limit]).compare(
        "Zero",
        "EQ",
        [variable("NewAcc"), number(0)],
    )
}

/// TMR and ONDTMR.
pub(super) fn up(name: &str) -> ExportedUnit {
    let body = timer(name, "TMR and ONDTMR of rungd", &["Leg"])
        .locals("BOOL", &["live", "adds", "was_live", "reached"])
        .coil("live", NetworkPower::all([on("Leg"), off("Pending")]))
        .coil("adds", NetworkPower::all([on("live"), on("was_live")]))
        .coil("was_live", on("live"))
        .store(
            "NewAcc",
            select(on("adds"), number(0), time_added(variable("Acc"), variable("Elapsed"))),
        );
    flags(body, "GE", at_least_zero(variable("Preset")))
        .coil("Done", NetworkPower::all([on("live"), on("reached")]))
        .coil("Reset", off("live"))
        .coil("Timing", on("live"))
        .0
}

/// TMRDOWN.
pub(super) fn down(name: &str) -> ExportedUnit {
    let body = timer(name, "TMRDOWN of rungd", &["Leg"])
        .locals("BOOL", &["live", "takes", "was_live", "reached"])
        .coil("live", NetworkPower::all([on("Leg"), off("Pending")]))
        .coil("takes", NetworkPower::all([on("live"), on("was_live")]))
        .coil("was_live", on("live"))
        .store(
            "NewAcc",
            select(
                on("takes"),
                at_least_zero(variable("Preset")),
                time_taken(variable("Acc"), variable("Elapsed")),
            ),
        );
    flags(body, "LE", number(0))
        .coil("Done", NetworkPower::all([on("live"), on("reached")]))
        .coil("Reset", off("live"))
        .coil("Timing", NetworkPower::all([on("live"), off("Zero")]))
        .0
}

/// OFFDTMR.
pub(super) fn off_delay(name: &str) -> ExportedUnit {
    let either = |one, other| NetworkPower::any([on(one), on(other)]);
    timer(name, "OFFDTMR of rungd", &["Leg"])
        .outputs("BOOL", &["Output"])
        .locals("BOOL", &["live", "counts", "loads", "keeps", "was_on", "was_timing", "positive"])
        .coil("live", NetworkPower::all([off("Leg"), off("Pending")]))
        .coil("counts", NetworkPower::all([on("live"), either("was_on", "was_timing")]))
        .coil("loads", either("Leg", "was_on"))
        .coil("keeps", either("Leg", "counts"))
        .store(
            "NewAcc",
            select(
                on("keeps"),
                number(0),
                select(
                    on("loads"),
                    time_taken(variable("Acc"), variable("Elapsed")),
                    at_least_zero(variable("Preset")),
                ),
            ),
        )
        .compare("positive", "GT", [variable("NewAcc"), number(0)])
        .compare("Zero", "EQ", [variable("NewAcc"), number(0)])
        .coil("Timing", NetworkPower::all([on("counts"), on("positive")]))
        .coil("was_timing", on("Timing"))
        .coil("was_on", on("Leg"))
        .coil("Done", NetworkPower::all([on("live"), off("positive")]))
        .coil("Reset", either("Leg", "Pending"))
        .coil("Output", either("Leg", "Timing"))
        .0
}

/// What TMRA and TMRADOWN have in common: when they are reset, when they time, when time counts.
fn accumulating(name: &str, doc: &str) -> BlockBody {
    timer(name, doc, &["Leg", "Rst"])
        .locals("BOOL", &["resets", "times", "counts", "was_timing", "reached"])
        .coil("resets", NetworkPower::any([on("Rst"), on("Pending")]))
        .coil("times", NetworkPower::all([on("Leg"), off("resets")]))
        .coil("counts", NetworkPower::all([on("times"), on("was_timing")]))
        .coil("was_timing", on("times"))
}

/// TMRA and TMRAG.
pub(super) fn accumulating_up(name: &str) -> ExportedUnit {
    let body = accumulating(name, "TMRA and TMRAG of rungd").store(
        "NewAcc",
        select(
            on("resets"),
            select(on("counts"), variable("Acc"), time_added(variable("Acc"), variable("Elapsed"))),
            number(0),
        ),
    );
    flags(body, "GE", at_least_zero(variable("Preset")))
        .coil("Done", NetworkPower::all([off("resets"), on("reached")]))
        .coil("Reset", on("resets"))
        .coil("Timing", on("times"))
        .0
}

/// TMRADOWN.
pub(super) fn accumulating_down(name: &str) -> ExportedUnit {
    let body = accumulating(name, "TMRADOWN of rungd")
        .locals("BOOL", &["loads", "loaded"])
        .locals("DINT", &["base"])
        .coil("loads", NetworkPower::any([on("resets"), off("loaded")]))
        .coil("loaded", NetworkPower::Constant(true))
        .store("base", select(on("loads"), variable("Acc"), at_least_zero(variable("Preset"))))
        .store(
            "NewAcc",
            select(
                on("counts"),
                variable("base"),
                time_taken(variable("base"), variable("Elapsed")),
            ),
        );
    flags(body, "LE", number(0))
        .coil("Done", NetworkPower::all([off("resets"), on("reached")]))
        .coil("Reset", on("resets"))
        .coil("Timing", NetworkPower::all([on("times"), off("Zero")]))
        .0
}
