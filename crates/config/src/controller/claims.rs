//! An input has one mover: a rule of the simulated device, or Modbus clients, but not both.
//!
//! If both wrote the same X, each would overwrite the other's value without any sign of it.
//! `simulated_device`, which resolves the rules, finds two rules for the same input.
//!
//! ```toml
//! # passes: MC1..MC4 are X0..X3, and the device moves X4
//! [modbus-server.image]
//! inputs = { from = "MC1..MC4", to = "X0..X3" }
//! [[simulated-device]]
//! input = "X4"      # fails with "X3"
//! pulse = "200ms"
//! every = "800ms"
//! ```

use super::settings::Controller;
use rungd_io::plant::settings::InputRule;
use rungd_language::source::finding::{Code, Finding};

/// A finding for every rule whose input Modbus clients also move.
pub fn moved_twice(controller: &Controller) -> Vec<Finding> {
    let Some((_, image)) = controller.modbus.as_ref().and_then(|server| server.inputs) else {
        return Vec::new();
    };
    let inputs = image.first..=image.last;
    let clashing = controller.rules.iter().filter(|device| inputs.contains(&device.input));
    let finding = |device: &InputRule| {
        let message = format!("`X{}` is moved by a rule and by Modbus clients", device.input);
        Finding::new(Code::Controller, device.span, message)
            .related(image.span, "its coil is copied to it here")
            .help("leave the rule out, or shorten `inputs` of `[modbus-server.image]`")
    };
    clashing.map(finding).collect()
}

#[cfg(test)]
mod tests {
    use crate::controller::{self, resolve_controller};
    use rungd_language::resolve::{LoadOptions, load_ladders};
    use rungd_language::source::span::{FileId, SourceFile};

    const LADDER: &str = "[[program]]\nname = \"Main\"\n";

    fn check(inputs: &str, rules: &[&str], expected: &[&str]) {
        let file = SourceFile { name: "one.toml".into(), text: LADDER.into() };
        let program = load_ladders(&[file], &LoadOptions::default()).0.expect("a program");
        let mut text = format!(
            "ladder = [\"one.toml\"]\n[modbus-server.image]\n\
             inputs = {{ from = \"MC1..MC4\", to = \"{inputs}\" }}\n"
        );
        for input in rules {
            text += "[[simulated-device]]\npulse = \"1s\"\nevery = \"2s\"\n";
            text += &format!("input = \"{input}\"\n");
        }
        let (written, findings) = controller::read(&text, FileId(1));
        assert!(findings.is_empty(), "{findings:?}");
        let (_, findings) = resolve_controller(&written.expect("TOML"), &program);
        let messages: Vec<_> = findings.iter().map(|finding| &finding.message[..]).collect();
        assert_eq!(messages, expected);
    }

    #[test]
    fn an_input_with_two_writers_is_reported() {
        check("X0..X3", &["X4", "X5"], &[]);
        check("X4..X7", &["X3", "X8"], &[]);
        let both = "`X4` is moved by a rule and by Modbus clients";
        check("X4..X7", &["X3", "X4"], &[both]);
        check("X4..X7", &["X3", "X3"], &["a second rule for `X3`"]);
    }
}
