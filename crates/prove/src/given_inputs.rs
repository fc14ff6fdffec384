//! What comes from outside and no key of `[prove]` lists: the times of scans, and whether field
//! devices are there.
//!
//! `question` calls it. A proof has no times of scans, so each that is read has any value. A device
//! that may be lost is there or not in each scan, as its bits show it. Without its settings, as a
//! ladder alone has it, `.Stale` is ON exactly while it is lost; else only with `.Ok` OFF, because
//! `loss-after` passes first. The inputs of a device are free in a proof also while it is lost:
//! some of them may still be read then.

use std::collections::HashSet;

use crate::inputs::is_scan_time;
use crate::model::FreeInput;
use crate::named_input::{InputSetting, NamedInput};
use rungd_engine::isa::{Address, Bit, DeviceBit, DeviceId};
use rungd_engine::{Cell, Layout};
use rungd_lab::testing::{ProofEvent, Suite};
use rungd_language::resolve::program::{Contact, Program};
use rungd_language::source::span::Span;

/// The times of scans that are read: each has any value in every scan.
pub(crate) fn scan_times(
    program: &Program,
    read: &HashSet<Address>,
    cells: &Layout,
) -> Vec<(FreeInput, NamedInput)> {
    let mut times: Vec<Address> = read.iter().copied().filter(is_scan_time).collect();
    times.sort_unstable();
    let time = |address: Address| {
        let input = FreeInput { cell: cells.cell(address)?, low: 0, high: i32::MAX, cold: None };
        let (name, setting) = (program.names.name(address), InputSetting::Any("a time of scans"));
        Some((input, NamedInput { name, setting, is_written: false }))
    };
    times.into_iter().filter_map(time).collect()
}

/// A field device that may be lost, and one of whose bits is read.
pub(crate) struct LostDevice {
    id: DeviceId,
    name: String,
    /// Whether `.Stale` is read, too.
    has_stale: bool,
    /// Whether `.Stale` is ON exactly while the device is lost.
    is_stale_at_once: bool,
}

/// The devices that may be lost, if that is asked for. `read`: the addresses that are read.
pub(crate) fn lost_devices(
    suite: &Suite,
    program: &Program,
    read: &HashSet<Address>,
) -> Vec<LostDevice> {
    if !suite.proof.events.contains(&ProofEvent::DeviceLoss) {
        return Vec::new();
    }
    let is_read = |id, bit| read.contains(&Address::Bit(Bit::Device(id, bit)));
    let is_stale_at_once = suite.programs[0].controller.devices.is_empty();
    let devices = (0..).map(DeviceId).zip(&program.devices);
    let devices = devices.filter(|(id, _)| DeviceBit::ALL.iter().any(|bit| is_read(*id, *bit)));
    let device = |(id, name): (DeviceId, &String)| LostDevice {
        id,
        name: name.clone(),
        has_stale: is_read(id, DeviceBit::Stale),
        is_stale_at_once,
    };
    devices.map(device).collect()
}

impl LostDevice {
    /// Its bits, which may change before each scan.
    pub fn inputs(&self, cells: &Layout) -> Vec<(FreeInput, NamedInput)> {
        let input = |bit: DeviceBit, setting| {
            let cell = Cell::Bit(cells.bit(Bit::Device(self.id, bit)));
            let name = format!("{}.{}", self.name, bit.name());
            let input = FreeInput { cell, low: 0, high: 1, cold: None };
            (input, NamedInput { name, setting, is_written: false })
        };
        let ok = input(DeviceBit::Ok, InputSetting::Device(self.id));
        let stale = self.has_stale.then(|| input(DeviceBit::Stale, InputSetting::Follows));
        std::iter::once(ok).chain(stale).collect()
    }

    /// What is so in every scan: `.Stale` with `.Ok` OFF alone.
    pub fn constraint(&self) -> Option<Contact> {
        let bit = |bit| Contact::Bit(Bit::Device(self.id, bit), Span::default());
        let not = |contact| Contact::Not(Box::new(contact), Span::default());
        let [ok, stale] = [DeviceBit::Ok, DeviceBit::Stale].map(bit);
        let parts = vec![not(ok.clone()), not(stale.clone())];
        let never_both = Contact::Any(parts, Span::default());
        let some = Contact::Any(vec![ok, stale], Span::default());
        self.has_stale.then(|| match self.is_stale_at_once {
            true => Contact::All(vec![never_both, some], Span::default()),
            false => never_both,
        })
    }
}
