//! The points of a field device, for one side of its map: the points of the parts of a simulated
//! plant, the tags of a plant's ladder, the tables of a Modbus device, the lines of a chip.
//!
//! `texts` offers them together with the names of the program. They are derived from the file as it
//! is typed: a part without a kind has no points yet.

use lsp_types::CompletionItemKind;

use super::describe::detail;
use super::proposal::{CompletionProposal, Proposals};
use super::scene::CompletionScene;
use crate::slots::DeclaredKind;
pub use rungd_config::controller::device::driver::OfferedPoints;
use rungd_config::controller::device::drivers;
pub use rungd_config::controller::device::simulated::{self, OfferedPoint};

/// Offers the points of the device around the cursor, as the row of its driver says. A driver that
/// rungd does not have has none.
pub(super) fn offer(scene: &CompletionScene, into: &mut Proposals) {
    let outline = &scene.file.outline;
    let Some(device) = outline.enclosing(scene.site.object, &["device"]) else { return };
    let name = scene.file.value(device, &["driver"]);
    let Some(driver) = drivers::row(name.unwrap_or_default()) else { return };
    let is_target = scene.site.keys.last().is_some_and(|key| key == "to");
    match driver.points {
        OfferedPoints::OfParts => plant(scene, device, is_target, into),
        OfferedPoints::OfLadder => of_ladder(scene, device, into),
        OfferedPoints::Beginnings(beginnings) => {
            for point in beginnings().iter().filter(|point| point.is_written || !is_target) {
                add(&point.text, &point.about, 0, into);
            }
        }
    }
}

/// Offers the points of the parts of a plant, and the commands of its faults.
pub fn plant(scene: &CompletionScene, device: usize, is_target: bool, into: &mut Proposals) {
    let (file, outline) = (scene.file, &scene.file.outline);
    for (object, part) in
        outline.objects.iter().enumerate().filter(|(_, part)| part.parent == device)
    {
        let Some(name) = file.value(object, &["name"]) else { continue };
        if part.kind == "device.fault" && is_target {
            add(&format!("fault.{name}"), "a bit, causes the fault", 0, into);
        }
        if part.kind != "device.part" {
            continue;
        }
        let points = file.value(object, &["kind"]).map(simulated::points_of).unwrap_or_default();
        for OfferedPoint { name: point, holds, is_command } in points {
            let about = if is_command { "drives the part" } else { "reported by the part" };
            let (label, about) = (format!("{name}.{point}"), format!("{holds}, {about}"));
            add(&label, &about, u8::from(is_command != is_target), into);
        }
        let places = outline.pairs_in(object).filter(|pair| {
            pair.keys.len() == 2 && matches!(pair.keys[0].text.as_str(), "eyes" | "switches")
        });
        for place in places {
            let label = format!("{name}.{}", place.key().text);
            add(&label, "a bit, reported by the part", u8::from(is_target), into);
        }
    }
}

/// Offers the tags of a plant that is a ladder.
fn of_ladder(scene: &CompletionScene, device: usize, into: &mut Proposals) {
    let Some(name) = scene.file.value(device, &["name"]) else { return };
    let Some((side, _)) = scene.side(name) else { return };
    let tags = side.names().all.iter().filter(|declared| declared.kind == DeclaredKind::Tag);
    for declared in tags.filter(|tag| tag.parent.is_none()) {
        let label = format!("{name}.{}", declared.name);
        add(&label, &detail(declared, side.project), 0, into);
    }
}

fn add(label: &str, about: &str, rank: u8, into: &mut Proposals) {
    into.add(CompletionProposal::new(label, CompletionItemKind::INTERFACE, rank).detail(about));
}
