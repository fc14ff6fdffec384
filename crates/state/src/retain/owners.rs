//! The use of retained elements by a program: the owners of structures, the presets of Sensaphone
//! counters in the ladder, the SRs, and the elements that a stop terminates.
//!
//! `plan` stores these with every image, so that a changed use is detected at the next start.

use std::collections::{HashMap, HashSet};

use super::content::{ElementText, RetainedContent, RetainedElement, element_of};
use rungd_engine::isa::Address;
use rungd_engine::{BitCell, Cell};
use rungd_language::lower::identity::Identity;
pub use rungd_language::resolve::program::{Program, Value};

/// The text between an owner and its preset.
const WITH_PRESET: &str = " with PRE ";
const FROM_LOCATION: &str = "from a location";

/// The preset in the instructions of a Sensaphone counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SensaphonePreset {
    Constant(i32),
    Location,
}

/// The elements that the termination passes of a program switch OFF or reset.
pub(super) fn terminated(program: &Program) -> HashSet<RetainedElement> {
    let all = program.instructions().map(|(_, instruction)| instruction);
    let terminated = all.filter(|one| one.mnemonic.spec().termination.switches_off());
    let elements = terminated.flat_map(|one| {
        let bit = one.written_bit().map(|bit| Address::Bit(bit.value));
        let structure = one.structure().map(Address::Structure);
        [bit, structure].into_iter().flatten()
    });
    elements.filter_map(element_of).collect()
}

/// The owners of structures, as `UDCG in Main`. The text of a Sensaphone counter names all its
/// counting instructions and the preset: `CTU in Main with PRE 10`.
pub(super) fn owners(program: &Program) -> Vec<ElementText> {
    let mut owners: Vec<ElementText> = Vec::new();
    let (mut places, mut presets) = (HashMap::new(), HashMap::new());
    for (block, instruction) in program.instructions() {
        let Some(at) = instruction.owned() else { continue };
        let Some(element) = element_of(Address::Structure(at)) else { continue };
        let own = format!("{} in {}", instruction.mnemonic.spec().name, block.name);
        if instruction.owned_sensaphone().is_some()
            && let Some(preset) = instruction.preset()
        {
            presets.insert(element, preset.value);
        }
        let at = *places.entry(element).or_insert(owners.len());
        match owners.get_mut(at) {
            Some(owner) => owner.text = format!("{}, {own}", owner.text),
            None => owners.push(ElementText { text: own, element }),
        }
    }
    for ElementText { text, element } in &mut owners {
        match presets.get(element) {
            Some(Value::Const(preset, _)) => *text = format!("{text}{WITH_PRESET}{preset}"),
            Some(Value::Word(_) | Value::Element(_)) => {
                *text = format!("{text}{WITH_PRESET}{FROM_LOCATION}")
            }
            Some(Value::Real(_)) | None => {}
        }
    }
    owners
}

/// The preset in the text of an owner; `None` if the text has none.
pub(super) fn preset(owner: &str) -> Option<SensaphonePreset> {
    match owner.rsplit_once(WITH_PRESET)?.1 {
        FROM_LOCATION => Some(SensaphonePreset::Location),
        constant => constant.parse().ok().map(SensaphonePreset::Constant),
    }
}

/// The SRs of which all bits are retained. The history of CLK is retained with the bits.
#[derive(Clone, Debug, Default)]
pub(super) struct RetainedShifts {
    /// `SR in Main`, with the first bit in the direction of the shift. A further SR with the same
    /// bit and block has a number.
    pub texts: Vec<ElementText>,
    /// The cells of the histories of CLK.
    pub clocks: Vec<BitCell>,
}

impl RetainedShifts {
    pub fn new(identity: &Identity, is_kept: impl Fn(&RetainedElement) -> bool) -> RetainedShifts {
        let mut shifts = RetainedShifts::default();
        let mut seen: HashMap<ElementText, u32> = HashMap::new();
        for shift in &identity.shifts {
            let mut bits: Vec<_> = shift.bits.array.addresses().map(element_of).collect();
            if shift.bits.down {
                bits.reverse();
            }
            let Some(Some(first)) = bits.first() else { continue };
            if !bits.iter().flatten().all(&is_kept) || bits.contains(&None) {
                continue;
            }
            let text = format!("SR in {}", identity.names.block(shift.block).name);
            let mut shown = ElementText { text, element: *first };
            let count = seen.entry(shown.clone()).or_default();
            *count += 1;
            if *count > 1 {
                shown.text = format!("{}, {count}", shown.text);
            }
            shifts.texts.push(shown);
            shifts.clocks.push(shift.cell);
        }
        shifts
    }

    /// The histories to restore from an image. `from` returns the element of the image from which
    /// an element takes its value.
    pub fn restore(
        &self,
        found: &RetainedContent,
        from: impl Fn(RetainedElement) -> Option<RetainedElement>,
    ) -> Vec<(Cell, i32)> {
        let was_on = |shift: &ElementText| {
            let then = |element| ElementText { text: shift.text.clone(), element };
            from(shift.element).is_some_and(|from| found.clocks.contains(&then(from)))
        };
        let each = self.texts.iter().zip(&self.clocks);
        let on = each.filter(|(shift, _)| was_on(shift));
        on.map(|(_, clock)| (Cell::Bit(*clock), 1)).collect()
    }
}
