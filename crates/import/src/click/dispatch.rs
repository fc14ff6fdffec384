//! Which instruction of a CLICK rung is translated by which function; called by `project`.

use super::work::{PoweredCall, RungWork};

impl RungWork<'_> {
    /// Adds what an instruction does.
    ///
    /// # Errors
    /// The reason why rungd cannot say it.
    pub(super) fn act(&mut self, powered: &PoweredCall) -> Result<(), String> {
        let call = &powered.call;
        if call.has("oneshot") {
            return Err(format!("{} as a one-shot", call.name));
        }
        if call.option("convert").is_some() {
            return Err(format!("{} that converts", call.name));
        }
        let has_pins = powered.reset.is_some() || powered.down.is_some();
        let takes_pins = matches!(call.name.as_str(), "on_delay" | "count_up" | "count_down");
        if has_pins && !takes_pins {
            return Err(format!("{} with a second input", call.name));
        }
        match call.name.as_str() {
            "out" | "latch" | "reset" => self.coil(call, &powered.power),
            "on_delay" => self.on_delay(powered),
            "off_delay" => self.off_delay(powered),
            "count_up" | "count_down" => self.count(powered),
            "copy" => self.copy(call, &powered.power),
            "fill" => self.fill(call, &powered.power),
            "blockcopy" => self.block_copy(call, &powered.power),
            "math" => self.math(call, &powered.power),
            name => Err(format!("the instruction {name}")),
        }
    }
}
