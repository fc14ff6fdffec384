//! The places that the recipes of `CONTRIBUTING.md` name, and the compiler asks for.

/// Each enum, its recipe, and the files whose matches of the enum lack an arm for Blip.
pub(super) const ASKED_FOR: &[(&str, &str, &[&str])] = &[
    ("Mnemonic", "Adding an instruction", &["crates/language/src/lower/instructions.rs"]),
    (
        "OperandRole",
        "Adding an instruction",
        &[
            "crates/engine/src/isa/role.rs",
            "crates/history/src/observe/decide.rs",
            "crates/history/src/observe/idle.rs",
        ],
    ),
    (
        "ControlKind",
        "Adding an instruction",
        &[
            "crates/engine/src/blocks.rs",
            "crates/engine/src/control.rs",
            "crates/engine/src/slice.rs",
            "crates/engine/src/written.rs",
            "crates/prove/src/encode/blocks.rs",
            "crates/prove/src/encode/written.rs",
        ],
    ),
    (
        "Op",
        "Adding an instruction",
        &[
            "crates/prove/src/encode/ops.rs",
            "crates/prove/src/encode/written.rs",
            "crates/prove/src/explore/effects.rs",
        ],
    ),
    (
        "Termination",
        "Adding an instruction",
        &[
            "crates/config/src/explain/mod.rs",
            "crates/engine/src/isa/columns.rs",
            "crates/language/src/lower/instructions.rs",
        ],
    ),
    (
        "OperandKind",
        "Adding an instruction",
        &[
            "crates/lsp/src/complete/nature.rs",
            "crates/config/src/explain/mod.rs",
            "crates/engine/src/isa/columns.rs",
            "crates/language/src/resolve/operand.rs",
            "crates/language/src/resolve/template/kind.rs",
        ],
    ),
    (
        "DriverSettings",
        "Adding a driver",
        &[
            "crates/config/src/controller/wired.rs",
            "src/daemon/devices.rs",
            "crates/lab/src/rig/field.rs",
        ],
    ),
    ("Command", "Adding a command", &["src/cli/mod.rs"]),
    ("Code", "Adding a finding", &["crates/language/src/source/rests_on.rs"]),
    (
        "Request",
        "Adding a command",
        &["crates/client/src/operator/protocol.rs", "src/daemon/operator_server/answer.rs"],
    ),
];
