//! The place of retentive memory, and unusual files there: symbolic links, which are followed and
//! never replaced; a file with no sequence numbers left; a file that is damaged while nothing
//! changes; and a file that cannot be replaced by a longer one.

use std::fs;
use std::os::unix::fs::{FileExt, symlink};
use std::path::{Path, PathBuf};

use crate::retain::memory::{
    COUNTS, KEEPS, Plant, Running, ask, file, find, held, message, run, until,
};
use rungd_state::retain::file::{Access, FileDevice};
use rungd_state::retain::format::{ImageStamp, put_slot, slot_bytes};
use rungd_state::retain::slots::survey;

/// A plant whose file is a link into a different folder.
fn linked() -> (Plant, PathBuf) {
    let plant = Plant::new(COUNTS, KEEPS);
    fs::create_dir(plant.0.join("far")).unwrap();
    symlink("middle", file(&plant)).unwrap();
    symlink("far/target", plant.0.join("middle")).unwrap();
    let target = plant.0.join("far/target");
    (plant, target)
}

fn is_link(plant: &Plant) -> bool {
    fs::symlink_metadata(file(plant)).unwrap().is_symlink()
}

/// The names in a folder, in order.
fn names(folder: PathBuf) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_link_to_a_missing_file_is_followed() {
    let (plant, target) = linked();
    let lines = run(&plant, "30");
    assert_eq!(find(&lines, "is made: ")["event"], "retain-made");
    assert!(is_link(&plant) && target.is_file());
    assert_eq!(names(plant.0.join("far")), ["target"]);
    let lines = run(&plant, "10");
    assert_eq!(find(&lines, "restored: image")["restored"], 4001);
    assert_eq!(held(&target).unwrap().count, 40);
}

#[test]
fn a_link_is_kept_when_a_longer_file_is_made() {
    let (plant, target) = linked();
    let controller = plant.0.join("controller.toml");
    let text = fs::read_to_string(&controller).unwrap();
    let short = text.replace("\"D0..D3999\"", "\"D0..D1\", \"D3999\"");
    fs::write(&controller, short).unwrap();
    run(&plant, "30");
    let before = fs::metadata(&target).unwrap().len();
    fs::write(&controller, text).unwrap();
    let lines = run(&plant, "10");
    assert_eq!(find(&lines, "restored: image")["restored"], 4);
    assert!(is_link(&plant) && fs::metadata(&target).unwrap().len() > before);
    assert_eq!(held(&target).unwrap().count, 40);
}

#[test]
fn a_foreign_target_of_a_link_is_renamed_in_its_own_folder() {
    let (plant, target) = linked();
    fs::write(&target, "my only copy of something else\n").unwrap();
    let lines = run(&plant, "5");
    let aside = plant.0.join("far/target.aside-1");
    assert!(message(find(&lines, "is kept: it was renamed")).contains("far/target.aside-1"));
    assert_eq!(fs::read(aside).unwrap(), b"my only copy of something else\n");
    assert!(is_link(&plant) && held(&target).unwrap().count == 5);
}

#[test]
fn a_link_into_a_missing_folder_is_reported_with_its_target() {
    let (plant, target) = linked();
    fs::remove_dir(target.parent().unwrap()).unwrap();
    let lines = run(&plant, "5");
    let told = find(&lines, "cannot be written");
    assert!(message(told).contains("far/target.new: No such file"), "{told}");
    assert!(is_link(&plant));
}

#[test]
fn a_circular_link_is_reported_and_kept() {
    let plant = Plant::new(COUNTS, KEEPS);
    symlink("memory", file(&plant)).unwrap();
    let lines = run(&plant, "5");
    let told = find(&lines, "cannot be written");
    assert!(message(told).contains("symbolic links"), "{told}");
    assert!(is_link(&plant));
}

#[test]
fn a_link_changed_while_the_controller_runs_is_followed() {
    let (plant, target) = linked();
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    let other = plant.0.join("far/other");
    let fresh = plant.0.join("fresh");
    symlink("far/other", &fresh).unwrap();
    fs::rename(&fresh, file(&plant)).unwrap();
    running.line("is written again");
    running.stop();
    assert!(held(&other).unwrap().is_final && is_link(&plant));
    assert!(!held(&target).unwrap().is_final);
}

#[test]
fn a_file_with_the_last_image_number_is_replaced_by_a_new_file() {
    let plant = Plant::new(COUNTS, KEEPS);
    run(&plant, "30");
    let mut device = FileDevice::open(&file(&plant), Access::Read).unwrap();
    let full = survey(&mut device).unwrap();
    let newest = full.newest.unwrap();
    let stamp = ImageStamp { sequence: u64::MAX, ..newest.stamp };
    let mut slot = Vec::new();
    put_slot(&mut slot, full.geometry.id, &stamp, &newest.content);
    let at = full.geometry.slot_at(newest.slot);
    let bytes = fs::OpenOptions::new().write(true).open(file(&plant)).unwrap();
    bytes.write_all_at(&slot, at).unwrap();
    let lines = run(&plant, "5");
    assert_eq!(find(&lines, "restored: image")["image"], u64::MAX);
    let kept = held(&file(&plant)).unwrap();
    assert_eq!((kept.count, kept.is_final), (35, true));
    assert!(kept.sequence < 9, "the new file numbers anew: {}", kept.sequence);
    let id = |path: &Path| {
        survey(&mut FileDevice::open(path, Access::Read).unwrap()).unwrap().geometry.id
    };
    assert_ne!(id(&file(&plant)), full.geometry.id);
    run(&plant, "5");
    assert_eq!(held(&file(&plant)).unwrap().count, 40);
}

#[test]
fn a_file_emptied_while_the_controller_runs_is_recreated() {
    let plant = Plant::new(COUNTS, KEEPS);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    std::thread::sleep(std::time::Duration::from_millis(100));
    fs::OpenOptions::new().write(true).truncate(true).open(file(&plant)).unwrap();
    let told = running.line("cannot be written");
    assert!(message(&told).contains("it is not what was written there"), "{told}");
    running.line("is written again");
    running.stop();
    assert!(held(&file(&plant)).unwrap().is_final);
}

const STILL: &str = "[[program]]\nname = \"Main\"\nrung = [\n\
    { when = [\"$FirstScan\"], do = [\"MOVE 7 to=D0\"] },\n]\n";

/// D0 in the newest image, and whether the image is from after an orderly stop.
fn kept_d0(plant: &Plant) -> Option<(i32, bool)> {
    let mut device = FileDevice::open(&file(plant), Access::Read).ok()?;
    let newest = survey(&mut device).ok()?.newest?;
    let content = rungd_state::retain::content::read(&newest.content).unwrap();
    let found =
        content.elements.iter().find(|(at, _)| rungd_state::retain::content::address(*at) == "D0");
    Some((found.unwrap().1.word, newest.stamp.flags != 0))
}

/// Damages the file of a controller in which nothing changes. `harm` receives the file's contents
/// from before D0 was 8. An image reported as durable must be in the file, and without a request
/// the controller writes the file again by itself.
#[track_caller]
fn harmed(harm: impl Fn(&std::path::Path, &[u8])) {
    let plant = Plant::new(STILL, &KEEPS.replace("20ms", "1h"));
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    // A write is answered after a complete scan: before the first scan, there is nothing to save.
    ask(&plant, &["write", "D0", "7"]);
    ask(&plant, &["retain", "save"]);
    let older = fs::read(file(&plant)).unwrap();
    ask(&plant, &["write", "D0", "8"]);
    ask(&plant, &["retain", "save"]);
    assert_eq!(kept_d0(&plant), Some((8, false)));
    harm(&file(&plant), &older);
    ask(&plant, &["retain", "save"]);
    assert_eq!(kept_d0(&plant), Some((8, false)), "an operator asked");
    running.line("is written again");
    harm(&file(&plant), &older);
    running.line("is written again");
    // The controller also checks by itself: the line may be about the first damage.
    until(|| kept_d0(&plant) == Some((8, false)));
    ask(&plant, &["mode", "stop"]);
    ask(&plant, &["retain", "save"]);
    harm(&file(&plant), &older);
    running.stop();
    assert_eq!(kept_d0(&plant), Some((8, true)), "at the end");
}

#[test]
fn a_file_removed_while_no_value_changes_is_recreated() {
    harmed(|file, _| fs::remove_file(file).unwrap());
}

/// rungd makes no folder for the file: perhaps a disk is missing there.
#[test]
fn a_file_in_a_removed_folder_is_recreated_when_the_folder_returns() {
    let plant = Plant::new(COUNTS, &KEEPS.replace("\"memory\"", "\"kept/memory\""));
    let folder = plant.0.join("kept");
    fs::create_dir(&folder).unwrap();
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    until(|| folder.join("memory").exists());
    fs::remove_dir_all(&folder).unwrap();
    let told = running.line("cannot be written");
    assert_eq!(told["event"], "retain-failed", "{told}");
    let status = ask(&plant, &["status"]);
    assert!(status.contains("NOT WRITTEN"), "{status}");
    fs::create_dir(&folder).unwrap();
    running.line("is written again");
    running.stop();
    assert!(held(&folder.join("memory")).unwrap().is_final);
}

#[test]
fn a_file_emptied_while_no_value_changes_is_recreated() {
    harmed(|file, _| fs::write(file, "").unwrap());
}

#[test]
fn a_file_truncated_while_no_value_changes_is_recreated() {
    harmed(|file, _| {
        fs::OpenOptions::new().write(true).open(file).unwrap().set_len(8192).unwrap();
    });
}

#[test]
fn a_file_overwritten_with_an_older_copy_is_written_again() {
    harmed(|file, older| fs::write(file, older).unwrap());
}

#[test]
fn a_file_replaced_by_an_older_copy_is_written_again() {
    harmed(|file, older| {
        fs::write(file.with_extension("copy"), older).unwrap();
        fs::rename(file.with_extension("copy"), file).unwrap();
    });
}

/// Checks a controller whose file is too short for its ranges, and cannot grow because an obstacle
/// cannot be removed.
#[track_caller]
fn cannot_grow(plant: &Plant, running: &Running) {
    let told = running.line("cannot be written");
    assert!(message(&told).contains("memory.new is in the way: "), "{told}");
    // A second controller still finds the file in use.
    let mut second = Running::new(&mut plant.second());
    second.line("another rungd uses this file");
    assert_eq!(second.end().code(), Some(74));
}

#[test]
fn the_old_file_and_its_lock_stay_if_a_longer_file_cannot_be_made() {
    let short = KEEPS.replace("\"D0..D3999\"", "\"D0..D1\", \"D3999\"");
    let plant = Plant::new(COUNTS, &short);
    run(&plant, "30");
    fs::write(plant.0.join("controller.toml"), format!("ladder = [\"ladder.toml\"]\n{KEEPS}"))
        .unwrap();
    fs::create_dir_all(plant.0.join("memory.new/full")).unwrap();
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    cannot_grow(&plant, &running);
    fs::remove_dir_all(plant.0.join("memory.new")).unwrap();
    // A write is answered after a complete scan: before the first scan, there is nothing further to
    // keep.
    ask(&plant, &["write", "D9", "7"]);
    running.stop();
    assert!(held(&file(&plant)).unwrap().count > 30);
}

#[test]
fn a_reload_keeps_the_old_file_until_the_longer_one_exists() {
    let short = KEEPS.replace("\"D0..D3999\"", "\"D0..D1\", \"D3999\"");
    let plant = Plant::new(COUNTS, &short);
    let mut running = Running::new(&mut plant.command(&[] as &[&str]));
    running.line("RUN");
    fs::write(plant.0.join("controller.toml"), format!("ladder = [\"ladder.toml\"]\n{KEEPS}"))
        .unwrap();
    fs::create_dir_all(plant.0.join("memory.new/full")).unwrap();
    ask(&plant, &["reload"]);
    cannot_grow(&plant, &running);
    fs::remove_dir_all(plant.0.join("memory.new")).unwrap();
    running.line("is written again");
    running.stop();
    assert!(held(&file(&plant)).unwrap().is_final);
}

/// Several controllers start at the same moment; one gets the file, the others do not start.
#[track_caller]
fn one_of_many_has_it(plant: &Plant) {
    let mut all: Vec<Running> =
        (0..4).map(|_| Running::new(&mut plant.command(&[] as &[&str]))).collect();
    // However late the others start, the controller with the file still runs.
    until(|| {
        all.iter_mut().filter_map(|one| one.child.try_wait().unwrap()).count() >= all.len() - 1
    });
    let codes: Vec<Option<i32>> = all
        .iter_mut()
        .map(|one| one.child.try_wait().unwrap())
        .map(|ended| ended.map(|status| status.code().unwrap()))
        .collect();
    let refused = codes.iter().filter(|code| **code == Some(74)).count();
    let runs = codes.iter().position(Option::is_none);
    let logs = |all: &[Running]| all.iter().map(Running::so_far).collect::<Vec<_>>();
    assert!(refused == 3 && runs.is_some(), "{codes:?}: {:#?}", logs(&all));
    let one = &mut all[runs.unwrap()];
    one.line("RUN");
    one.stop();
    assert!(held(&file(plant)).unwrap().is_final);
}

#[test]
fn only_one_of_several_simultaneous_starts_owns_the_new_file() {
    for _ in 0..3 {
        let controller =
            KEEPS.replace("[operator]\nsocket = \"op\"\n", "[operator]\nenabled = false\n");
        let plant = Plant::new(COUNTS, &controller);
        one_of_many_has_it(&plant);
        assert_eq!(names(plant.0.clone()), ["controller.toml", "ladder.toml", "memory"]);
        fs::remove_file(file(&plant)).unwrap();
        fs::write(file(&plant), "my only copy of something else\n").unwrap();
        one_of_many_has_it(&plant);
        let wanted = ["controller.toml", "ladder.toml", "memory", "memory.aside-1"];
        assert_eq!(names(plant.0.clone()), wanted, "what is good is not kept aside");
        // The rest of a controller that was killed while it made the file is no obstacle.
        fs::remove_file(file(&plant)).unwrap();
        fs::write(plant.0.join("memory.new"), "half a file").unwrap();
        one_of_many_has_it(&plant);
    }
}

#[test]
fn a_file_with_an_invalid_newest_image_is_renamed_and_not_restored() {
    let plant = Plant::new(COUNTS, KEEPS);
    run(&plant, "30");
    let found = survey(&mut FileDevice::open(&file(&plant), Access::Read).unwrap()).unwrap();
    let newest = found.newest.unwrap();
    let stamp = ImageStamp { sequence: newest.stamp.sequence + 1, ..newest.stamp };
    let mut slot = Vec::new();
    put_slot(&mut slot, found.geometry.id, &stamp, b"whole, and no content");
    let other = (newest.slot + 1) % found.geometry.slots as usize;
    let bytes = fs::OpenOptions::new().write(true).open(file(&plant)).unwrap();
    bytes.write_all_at(&slot, found.geometry.slot_at(other)).unwrap();
    let bad = fs::read(file(&plant)).unwrap();
    let lines = run(&plant, "5");
    assert!(message(find(&lines, "is kept: it was renamed")).contains("memory.aside-1"));
    assert_eq!(fs::read(plant.0.join("memory.aside-1")).unwrap(), bad);
    assert_eq!(held(&file(&plant)).unwrap().count, 5, "counted from a cold start");
}

#[test]
fn a_longer_file_begins_with_the_newest_image_and_its_number() {
    let plant = Plant::new(COUNTS, KEEPS);
    let controller = plant.0.join("controller.toml");
    let text = fs::read_to_string(&controller).unwrap();
    fs::write(&controller, text.replace("\"D0..D3999\"", "\"D0..D1\", \"D3999\"")).unwrap();
    run(&plant, "30");
    let look = || survey(&mut FileDevice::open(&file(&plant), Access::Read).unwrap()).unwrap();
    let short = look();
    let (was, stamp) = (short.geometry, short.newest.unwrap().stamp);
    fs::write(&controller, text).unwrap();
    // Without a scan, the file has only the image that the growth wrote.
    let mut running = Running::new(plant.command(&[] as &[&str]).arg("--stopped"));
    running.line("restored: image");
    let long = look();
    running.kill();
    let is = long.geometry;
    assert!(is.slot_bytes > was.slot_bytes && is.id != was.id, "{was:?}, {is:?}");
    assert!(is.slot_bytes as usize >= slot_bytes(16_000) * 5 / 4, "a quarter to spare: {is:?}");
    let newest = long.newest.unwrap();
    assert_eq!((newest.stamp.sequence, newest.stamp.scan), (stamp.sequence, stamp.scan));
    assert_eq!(long.slots.iter().flatten().count(), 1, "the older images stayed behind");
}
