//! Whatever a disk does, the image found on it is exactly one scan's, and no image acknowledged as
//! durable is lost.
//!
//! The disk is in memory. Every content that a power cut may leave is checked, every bit is
//! flipped, and every call fails once. The normal run makes a random part of these tests; all of
//! them, with figures:
//!
//! ```console
//! cargo test --release -p rungd-state retain::disk_states -- --ignored --nocapture
//! ```

use std::cell::Cell;
use std::rc::Rc;
use std::time::Instant;

use crate::retain::disk::{Bytes, Fault, Handle};
use rungd_state::retain::format::{Geometry, ImageStamp};
use rungd_state::retain::slots::{SlotSurvey, Slots, survey};
use rungd_test_support::numbers::Numbers;

const FAULTS: [Fault; 4] = [Fault::Errno(5), Fault::Errno(28), Fault::Errno(4), Fault::Short];

/// An image of a scan: the scan's number at both ends, words that differ from scan to scan, and
/// their sum.
fn image(scan: u64, bytes: usize) -> Vec<u8> {
    let mut numbers = Numbers(scan);
    let mut image = scan.to_le_bytes().to_vec();
    let mut sum = scan;
    while image.len() < bytes - 16 {
        let word = numbers.below(1 << 30);
        sum = sum.wrapping_mul(31).wrapping_add(word);
        image.extend((word as u32).to_le_bytes());
    }
    image.truncate(bytes - 16);
    image.extend(sum.to_le_bytes());
    image.extend(scan.to_le_bytes());
    image
}

fn stamp(scan: u64) -> ImageStamp {
    ImageStamp { sequence: 0, scan, saved_ms: 7, flags: 0, scanned_ms: 0 }
}

fn geometry(content: usize) -> Geometry {
    let slot_bytes = rungd_state::retain::format::slot_bytes(content) as u32;
    Geometry { slot_bytes, slots: 4, id: 0x5EED }
}

/// The scan of the newest image; checks that it is exactly that scan's image.
fn found(survey: &SlotSurvey, images: &[Vec<u8>]) -> u64 {
    let Some(newest) = &survey.newest else { return 0 };
    let scan = newest.stamp.scan;
    let content = &newest.content;
    let (first, last) = (&content[..8], &content[content.len() - 8..]);
    assert_eq!((first, last), (&scan.to_le_bytes()[..], &scan.to_le_bytes()[..]), "a mixture");
    assert!(images[scan as usize] == *content, "not the image of scan {scan}");
    scan
}

/// The scan of the newest image in these bytes; the file's header must be readable.
fn found_on(bytes: &[u8], images: &[Vec<u8>]) -> u64 {
    let survey = survey(&mut Bytes(bytes)).expect("the header is durable");
    found(&survey, images)
}

/// Saves `saves` images, and checks every content that a power cut may leave after every call.
fn every_subset(sector: usize, content: usize, saves: u64) -> u64 {
    let geometry = geometry(content);
    let images: Vec<_> = (0..=saves).map(|scan| image(scan, content)).collect();
    let disk = Handle::new(sector, geometry.file_bytes() as usize);
    let mut slots = Slots::format(disk.clone(), geometry).unwrap();
    let (acknowledged, states) = (Rc::new(Cell::new(0)), Rc::new(Cell::new(0)));
    {
        let (acknowledged, states, images) = (acknowledged.clone(), states.clone(), images.clone());
        let mut disk = disk.0.borrow_mut();
        disk.most = 3 * sector;
        disk.watch = Some(Rc::new(move |disk| {
            let looked = disk.cuts(|bytes| {
                let scan = found_on(bytes, &images);
                let last = acknowledged.get();
                assert!((last..=last + 1).contains(&scan), "{scan}, and {last} was durable");
            });
            states.set(states.get() + looked);
        }));
    }
    for scan in 1..=saves {
        slots.save(stamp(scan), &images[scan as usize]).unwrap();
        acknowledged.set(scan);
    }
    states.get()
}

/// A file with images 1..=6 in it, and those images.
fn six(content: usize) -> (Vec<u8>, Vec<Vec<u8>>, Geometry) {
    let geometry = geometry(content);
    let images: Vec<_> = (0..=6).map(|scan| image(scan, content)).collect();
    let disk = Handle::new(512, geometry.file_bytes() as usize);
    let mut slots = Slots::format(disk.clone(), geometry).unwrap();
    for scan in 1..=6 {
        slots.save(stamp(scan), &images[scan as usize]).unwrap();
    }
    let bytes = disk.0.borrow().durable.clone();
    (bytes, images, geometry)
}

/// Flips bits one by one: the newest image is found, or the image before it if the bit is in the
/// newest one.
fn flips(bits: impl Iterator<Item = usize>) -> u64 {
    let (mut bytes, images, _) = six(3000);
    let newest = survey(&mut Bytes(&bytes)).unwrap().newest.unwrap();
    let geometry = geometry(3000);
    let begin = geometry.slot_at(newest.slot) as usize;
    let hit = begin..begin + 64 + 3000 + 32;
    let mut count = 0;
    for bit in bits {
        let bit = bit % (bytes.len() * 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
        let scan = found_on(&bytes, &images);
        let expected = if hit.contains(&(bit / 8)) { 5 } else { 6 };
        assert_eq!(scan, expected, "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
        count += 1;
    }
    count
}

/// Lets each call fail, alone and with others in a row; saves are retried as the keeper does.
fn nth_call_fails(sector: usize, content: usize) -> u64 {
    let geometry = geometry(content);
    let images: Vec<_> = (0..=13).map(|scan| image(scan, content)).collect();
    let mut states = 0;
    let images = &images;
    for fault in FAULTS {
        for in_a_row in [1, 2, 5, 9] {
            for n in 1.. {
                let disk = Handle::new(sector, geometry.file_bytes() as usize);
                let mut slots = Slots::format(disk.clone(), geometry).unwrap();
                let before = {
                    let mut disk = disk.0.borrow_mut();
                    disk.most = 2 * sector;
                    disk.fault = Some((fault, disk.calls + n, in_a_row));
                    disk.calls
                };
                let mut durable = 0;
                for scan in 1..=12 {
                    if slots.save(stamp(scan), &images[scan as usize]).is_ok() {
                        durable = scan;
                    }
                    let disk = disk.0.borrow();
                    if disk.cut_count() > 4096 {
                        continue;
                    }
                    states += disk.cuts(|bytes| {
                        let seen = found_on(bytes, images);
                        assert!((durable..=scan).contains(&seen), "{seen}: {durable}..={scan}");
                    });
                }
                let calls = disk.0.borrow().calls;
                disk.0.borrow_mut().fault = None;
                slots.save(stamp(13), &images[13]).expect("it recovers");
                if calls < before + n {
                    break;
                }
            }
        }
    }
    states
}

/// Lets each reading call fail: no wrong image is found, and the file does not count as foreign.
fn nth_read_fails() -> u64 {
    let (bytes, images, _) = six(3000);
    let mut count = 0;
    for fault in FAULTS {
        for n in 1..40 {
            let disk = Handle::new(512, bytes.len());
            disk.0.borrow_mut().cut(|_| 0);
            disk.0.borrow_mut().durable.clone_from(&bytes);
            disk.0.borrow_mut().cache.clone_from(&bytes);
            disk.0.borrow_mut().fault = Some((fault, n, 1));
            let look = match Slots::open(disk) {
                Ok((_, look)) => look,
                Err(why) => panic!("one call failed, and a header is left: {why:?}"),
            };
            let scan = found(&look, &images);
            assert!(scan == 6 || scan == 5 && look.slots.iter().any(Result::is_err), "{scan}");
            count += 1;
        }
    }
    count
}

/// Successive processes ("lives") of a controller on one disk: saves, failures, kills, power cuts.
fn lives(seed: u64, count: u64) -> u64 {
    let mut numbers = Numbers(seed);
    let content = 200 + numbers.below(6000) as usize;
    let geometry = geometry(content);
    let images: Vec<_> = (0..count * 8 + 9).map(|scan| image(scan, content)).collect();
    let sector = if numbers.below(2) == 0 { 512 } else { 4096 };
    let disk = Handle::new(sector, geometry.file_bytes() as usize);
    let _ = Slots::format(disk.clone(), geometry).unwrap();
    let (mut scan, mut durable) = (0, 0);
    for _ in 0..count {
        let (mut slots, look) = Slots::open(disk.clone()).expect("the header is durable");
        let seen = found(&look, &images);
        assert!((durable..=scan).contains(&seen), "{seen}: {durable}..={scan}, seed {seed}");
        disk.0.borrow_mut().most = 1 + numbers.below(3 * 4096) as usize;
        for _ in 0..numbers.below(8) {
            if numbers.below(4) == 0 {
                let fault = FAULTS[numbers.below(4) as usize];
                let mut disk = disk.0.borrow_mut();
                disk.fault = Some((fault, disk.calls + numbers.below(12), numbers.below(6)));
            }
            scan += 1;
            if slots.save(stamp(scan), &images[scan as usize]).is_ok() {
                durable = scan;
            }
        }
        let mut disk = disk.0.borrow_mut();
        disk.fault = None;
        match numbers.below(3) {
            0 => {}
            1 => disk.cut(|versions| numbers.below(versions as u64) as usize),
            _ => {
                // A power cut in the middle of a further save.
                drop(disk);
                scan += 1;
                let midst = Handle(slots.device().0.clone());
                let calls = midst.0.borrow().calls;
                midst.0.borrow_mut().fault = Some((Fault::Errno(5), calls + numbers.below(9), 99));
                if slots.save(stamp(scan), &images[scan as usize]).is_ok() {
                    durable = scan;
                }
                let cut = |versions| numbers.below(versions as u64) as usize;
                midst.0.borrow_mut().cut(cut);
            }
        }
    }
    count
}

#[test]
fn slots_are_read_in_any_order_and_any_of_them_may_be_missing() {
    let (bytes, images, geometry) = six(3000);
    let slot = |at: usize| {
        let begin = geometry.slot_at(at) as usize;
        begin..begin + geometry.slot_bytes as usize
    };
    for order in 0..256_usize {
        let order = [order & 3, order >> 2 & 3, order >> 4 & 3, order >> 6];
        let mut other = bytes.clone();
        let mut expected = 0;
        for (to, from) in order.into_iter().enumerate() {
            other[slot(to)].copy_from_slice(&bytes[slot(from)]);
            let own = survey(&mut Bytes(&bytes)).unwrap().slots[from].unwrap();
            expected = expected.max(own.scan);
        }
        assert_eq!(found_on(&other, &images), expected, "{order:?}");
    }
    for gone in 0..16_usize {
        let mut other = bytes.clone();
        let mut expected = 0;
        for at in 0..4 {
            if gone >> at & 1 != 0 {
                other[slot(at)].fill(0);
            } else {
                expected =
                    expected.max(survey(&mut Bytes(&bytes)).unwrap().slots[at].unwrap().scan);
            }
        }
        assert_eq!(found_on(&other, &images), expected, "{gone:04b}");
    }
}

#[test]
fn a_truncated_file_gives_its_remaining_images() {
    let (bytes, images, _) = six(3000);
    for length in (0..bytes.len()).step_by(97) {
        match survey(&mut Bytes(&bytes[..length])) {
            Ok(survey) => assert!(!survey.whole && found(&survey, &images) <= 6),
            Err(_) => assert!(length < 64),
        }
    }
}

#[test]
fn a_sample_of_all_disk_states_gives_a_whole_image() {
    let states = every_subset(512, 4000, 12) + every_subset(4096, 32_000, 8);
    assert!(states > 2_000, "{states}");
    let mut numbers = Numbers(1);
    assert_eq!(flips((0..2_000).map(|_| numbers.below(1 << 30) as usize)), 2_000);
    assert!(nth_read_fails() > 100);
    assert!(nth_call_fails(4096, 7000) > 1_000);
    for seed in 0..60 {
        lives(seed, 40);
    }
}

#[test]
#[ignore = "all of it: a minute, with --release"]
fn all_disk_states_give_a_whole_image() {
    let told = |what: &str, begin: Instant, count: u64| {
        let took = begin.elapsed().as_secs_f64();
        println!("{what:52} {count:>9} in {took:5.1} s");
        count
    };
    let whole = Instant::now();
    let mut all = 0;
    let begin = Instant::now();
    all += told("cuts, every subset of sectors of 512", begin, every_subset(512, 8000, 9));
    let begin = Instant::now();
    all += told("cuts, every subset of sectors of 4096", begin, every_subset(4096, 40_000, 12));
    let begin = Instant::now();
    let bits = geometry(3000).file_bytes() as usize * 8;
    all += told("every bit flipped", begin, flips(0..bits));
    let begin = Instant::now();
    let count = nth_call_fails(512, 3000) + nth_call_fails(4096, 7000);
    all += told("cuts around each call failed", begin, count);
    let begin = Instant::now();
    all += told("each read failed", begin, nth_read_fails());
    let begin = Instant::now();
    let count = (0..4_000).map(|seed| lives(seed, 50)).sum();
    all += told("random lives with failures, kills and cuts", begin, count);
    told("all", whole, all);
    assert!(all > 1_000_000);
}

#[test]
fn a_slot_is_doubted_after_a_failed_write() {
    let geometry = geometry(300);
    let disk = Handle::new(512, geometry.file_bytes() as usize);
    let mut slots = Slots::format(disk.clone(), geometry).unwrap();
    let first = slots.save(stamp(1), &image(1, 300)).unwrap().0;
    let older = disk.0.borrow().cache.clone();
    let second = slots.save(stamp(2), &image(2, 300)).unwrap().0;
    assert!(slots.has(&second, &image(2, 300)).unwrap());
    assert!(!slots.has(&first, &image(1, 300)).unwrap(), "the newest is asked for");
    let newer = std::mem::replace(&mut disk.0.borrow_mut().cache, older);
    assert!(!slots.has(&second, &image(2, 300)).unwrap(), "an older copy lies there");
    disk.0.borrow_mut().cache = newer;
    assert!(slots.has(&second, &image(2, 300)).unwrap() && !slots.is_doubted());
    // Reading the header succeeds, and writing the image fails.
    let calls = disk.0.borrow().calls;
    disk.0.borrow_mut().fault = Some((Fault::Errno(5), calls + 2, 100));
    assert!(slots.save(stamp(3), &image(3, 300)).is_err() && slots.is_doubted());
}
