//! The whole milliseconds since the last scan, as a DINT.
//!
//! The standard has no function that makes a number of ms of a TIME: TIME_TO_DINT gives seconds in
//! one system and ms in another. So the clock takes powers of two off the time that has passed; the
//! rest below 1 ms stays for the next scan, and nothing drifts. The time comes from two TONs, each
//! of which runs for ten minutes and then starts the other one: neither its ET nor its sum grows
//! without end.

use crate::export::block_body::BlockBody;
use crate::export::functions::{number, of_two, select, variable};
use crate::export::literals::CallLiteral;
use crate::export::project::{
    BlockCall, CallInput, CallResult, CallSource, ExportedUnit, NetworkBody, NetworkPower, off, on,
};

/// The largest power of two: 2^21 ms are 35 minutes. A scan is never longer.
const POWERS: std::ops::RangeInclusive<u32> = 0..=21;

/// A TIME.
fn time_ms(ms: u32) -> CallSource {
    CallSource::Literal(CallLiteral::TimeMs(ms))
}

/// The clock: `Elapsed` is the time since its last execution.
pub(super) fn unit(name: &str) -> ExportedUnit {
    let mut body = BlockBody::new(name, "Whole ms since the last scan")
        .outputs("DINT", &["Elapsed"])
        .locals("TON", &["one", "other"])
        .locals("TIME", &["one_time", "other_time", "now", "before", "passed"])
        .locals("BOOL", &["is_other", "changes", "runs_one", "runs_other", "is_late", "reaches"])
        .coil("runs_one", NetworkPower::any([off("is_other"), on("changes")]))
        .coil("runs_other", NetworkPower::any([on("is_other"), on("changes")]));
    for name in ["one", "other"] {
        let runs = CallSource::Power(on(&format!("runs_{name}")));
        let inputs = vec![
            CallInput { pin: "IN", source: runs },
            CallInput { pin: "PT", source: time_ms(3_600_000) },
        ];
        let call =
            BlockCall { type_name: "TON".to_owned(), instance: Some(name.to_owned()), inputs };
        let variable = format!("{name}_time");
        let results = vec![CallResult { pin: "ET", variable, is_coil: false }];
        body = body.network(NetworkBody::Call { call, results });
    }
    body = body
        .store("now", select(on("is_other"), variable("one_time"), variable("other_time")))
        .store(
            "passed",
            of_two("ADD", variable("passed"), of_two("SUB", variable("now"), variable("before"))),
        )
        .store("before", select(on("changes"), variable("now"), time_ms(0)))
        .compare("is_late", "GE", [variable("now"), time_ms(600_000)])
        .coil(
            "is_other",
            NetworkPower::any([
                NetworkPower::all([on("is_other"), off("changes")]),
                NetworkPower::all([off("is_other"), on("changes")]),
            ]),
        )
        .coil("changes", NetworkPower::all([on("is_late"), off("changes")]))
        .store("Elapsed", number(0));
    for power in POWERS.rev() {
        let ms = 1_u32 << power;
        let time = || time_ms(ms);
        body = body
            .compare("reaches", "GE", [variable("passed"), time()])
            .store_while("reaches", "passed", of_two("SUB", variable("passed"), time()))
            .store_while(
                "reaches",
                "Elapsed",
                of_two("ADD", variable("Elapsed"), number(ms.into())),
            );
    }
    body.0
}
