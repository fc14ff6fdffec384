//! `docs/retain-format.md`: the reader on the page reads rungd's files. In damaged and irregular
//! files it finds the same image as rungd.

use crate::retain::disk;
use rungd_test_support::needs::{self, usable};
use std::path::Path;
use std::process::{Command, Output};

use rungd_engine::isa::{BitSpace, Space};
use rungd_state::retain::content::{ElementText, RetainedElement};
use rungd_state::retain::format::{Geometry, ImageStamp, put_slot};
use rungd_state::retain::slots::{Slots, survey};

/// A hand-made content in the page's format: D3; the tag `level` in D4, which has no address; C5 of
/// an OUT; CT0 of a UDCG; R7; an SR from C5 on, whose CLK was ON; and a second SR, whose CLK was
/// OFF; the Program Batch, which runs in two of its Stages, and one without an entry.
fn content() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut put = |numbers: &[u32]| numbers.iter().for_each(|n| bytes.extend(n.to_le_bytes()));
    put(&[4, 5, 3, 2, 1 | 1 << 8, 5, 1, 8, 0, 1, 11, 7, 1]);
    put(&[1, 5 | 1 << 8 | 5 << 16, 4]);
    bytes.extend(b"level\0\0\0");
    bytes.extend(3_u32.to_le_bytes());
    let owners =
        [(8, 0, 0, &b"UDCG in Main"[..]), (1, 1, 5, b"SR in Main"), (1, 0, 5, b"SR in Main, 2")];
    for (kind, flags, number, text) in owners {
        bytes.extend((kind | flags << 8 | (text.len() as u32) << 16).to_le_bytes());
        bytes.extend(u32::to_le_bytes(number));
        bytes.extend(text);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes.extend((-2_i32).to_le_bytes());
    bytes.extend(400_i32.to_le_bytes());
    bytes.push(1);
    bytes.extend(7_i32.to_le_bytes());
    bytes.extend([0, 0, 0, 0, 1, 0, 0, 0]);
    bytes.extend((-2.5_f32).to_le_bytes());
    bytes.extend(2_u32.to_le_bytes());
    put_program(&mut bytes, 3, "Batch", &[(0, "Idle"), (1, "Drain"), (1, "Flush")]);
    put_program(&mut bytes, 2, "Later", &[]);
    bytes
}

/// The bytes behind the values: a count, two Programs, three Stages.
const PROGRAM_BYTES: usize = 4 + 16 + 8 + 12 + 12 + 16;

/// Appends a Program with its flags, and its Stages with theirs.
fn put_program(bytes: &mut Vec<u8>, flags: u32, name: &str, stages: &[(u32, &str)]) {
    let mut put = |flags: u32, name: &str, count: Option<u32>| {
        bytes.extend((flags | (name.len() as u32) << 16).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend(&[0; 3][..name.len().next_multiple_of(4) - name.len()]);
        bytes.extend(count.iter().flat_map(|count| count.to_le_bytes()));
    };
    put(flags, name, Some(stages.len() as u32));
    stages.iter().for_each(|(flags, name)| put(*flags, name, None));
}

/// Runs the reader of the page on a file; `None` if Python is not installed.
fn read_by_page(test: &str, bytes: &[u8]) -> Option<Output> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("retain-format").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("memory"), bytes).unwrap();
    let page = include_str!("../../../../docs/retain-format.md");
    let script = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();
    std::fs::write(folder.join("reader.py"), script).unwrap();
    let mut python = Command::new("python3");
    if !usable(needs::python()) {
        return None;
    }
    Some(python.args(["reader.py", "memory"]).current_dir(&folder).output().unwrap())
}

/// Checks that the reader of the page prints the image that rungd finds on the disk.
#[track_caller]
fn page_agrees(test: &str, disk: &disk::Handle) {
    let newest = survey(&mut disk.clone()).map(|survey| survey.newest);
    let Some(output) = read_by_page(test, &disk.0.borrow().cache) else { return };
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let none = match newest {
        Ok(Some(newest)) => {
            let ImageStamp { sequence, scan, .. } = newest.stamp;
            let image = format!("image {sequence} of scan {scan}");
            assert_eq!(said.lines().next(), Some(image.as_str()), "{test}: {errors}");
            return;
        }
        Ok(None) => "no whole image\n",
        Err(_) => "no whole header\n",
    };
    assert_eq!((output.status.code(), said.as_str(), errors.as_str()), (Some(1), "", none));
}

#[test]
fn the_reader_of_the_page_reads_a_file_of_rungd() {
    let content = content();
    let read = rungd_state::retain::content::read(&content).expect("it is as the page says");
    assert_eq!((read.elements.len(), read.tags.len(), read.owners.len()), (5, 1, 2));
    assert_eq!(read.placed.into_iter().collect::<Vec<_>>(), [read.tags[0].element]);
    let c5 = RetainedElement { space: Space::Bit(BitSpace::C), number: 5 };
    assert_eq!(read.terminated.into_iter().collect::<Vec<_>>(), [c5]);
    assert_eq!(
        read.clocks.into_iter().collect::<Vec<_>>(),
        [ElementText { text: "SR in Main".to_owned(), element: c5 }]
    );
    let [batch] = &read.programs[..] else { panic!("{:?}", read.programs) };
    assert_eq!((batch.name.as_str(), batch.runs, batch.begins), ("Batch", true, false));
    assert_eq!(batch.on, ["Drain", "Flush"]);
    for cut in 1..content.len() {
        let read = rungd_state::retain::content::read(&content[..content.len() - cut]);
        // An image without Stages ends with the values.
        assert_eq!(read.is_some(), cut == PROGRAM_BYTES, "{cut}");
    }
    let geometry = Geometry::for_content(content.len(), 77);
    let disk = disk::Handle::new(512, geometry.file_bytes() as usize);
    let mut slots = Slots::format(disk.clone(), geometry).unwrap();
    for scan in [5, 6, 9, 12, 40] {
        slots
            .save(ImageStamp { sequence: 0, scan, saved_ms: 0, flags: 0, scanned_ms: 0 }, &content)
            .unwrap();
    }
    let mut bytes = disk.0.borrow().durable.clone();
    // Damage the first copy of the header and the second newest image.
    bytes[3] ^= 1;
    bytes[geometry.slot_at(3) as usize + 70] ^= 1;
    let Some(output) = read_by_page("written", &bytes) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        "image 5 of scan 40\nD3 -2\nlevel 400\nC5 1 OFF or reset at a stop\nCT0 7 0 0 0 0 1 0 0 0\n\
         R7 -2.5\nStages Batch runs Drain Flush\nSR in Main: CLK was ON, first bit C5\n"
    );
}

/// A disk with images 1 to 3 in slots 0 to 2 of 4, and its geometry.
fn three_images() -> (disk::Handle, Geometry) {
    let content = content();
    let geometry = Geometry::for_content(content.len(), 77);
    let disk = disk::Handle::new(512, geometry.file_bytes() as usize);
    let mut slots = Slots::format(disk.clone(), geometry).unwrap();
    for scan in [5, 6, 9] {
        slots.save(stamp(0, scan), &content).unwrap();
    }
    (disk, geometry)
}

fn stamp(sequence: u64, scan: u64) -> ImageStamp {
    ImageStamp { sequence, scan, saved_ms: 0, flags: 0, scanned_ms: 0 }
}

/// A whole image.
struct WholeImage<'a> {
    stamp: ImageStamp,
    content: &'a [u8],
}

/// Overwrites a slot with a whole image.
fn put(disk: &disk::Handle, geometry: &Geometry, slot: usize, image: &WholeImage<'_>) {
    let mut bytes = Vec::new();
    put_slot(&mut bytes, geometry.id, &image.stamp, image.content);
    let at = geometry.slot_at(slot) as usize;
    let mut disk = disk.0.borrow_mut();
    disk.durable[at..at + bytes.len()].copy_from_slice(&bytes);
    disk.cache[at..at + bytes.len()].copy_from_slice(&bytes);
}

#[test]
fn the_first_of_two_images_with_equal_numbers_counts() {
    let (disk, geometry) = three_images();
    put(&disk, &geometry, 3, &WholeImage { stamp: stamp(3, 40), content: &content() });
    let found = survey(&mut disk.clone()).unwrap().newest.unwrap();
    assert_eq!((found.slot, found.stamp.scan), (2, 9));
    page_agrees("same-number", &disk);
    put(&disk, &geometry, 1, &WholeImage { stamp: stamp(3, 50), content: &content() });
    let found = survey(&mut disk.clone()).unwrap().newest.unwrap();
    assert_eq!((found.slot, found.stamp.scan), (1, 50));
    page_agrees("same-number", &disk);
    // The next image is written to a different slot and has the next number.
    let (mut slots, _) = Slots::open(disk.clone()).unwrap();
    assert_eq!(slots.save(stamp(0, 60), &content()).unwrap().0.sequence, 4);
    let found = survey(&mut disk.clone()).unwrap().newest.unwrap();
    assert_eq!((found.slot, found.stamp.scan), (0, 60));
}

/// A whole copy of the header with these fields.
fn header(slot_bytes: u32, slots: u32, id: u64) -> Vec<u8> {
    let mut copy = b"rungd retain\r\n\x1a\n".to_vec();
    for number in [1, slot_bytes, slots, 0] {
        copy.extend(u32::to_le_bytes(number));
    }
    copy.extend(id.to_le_bytes());
    copy.resize(60, 0);
    copy.extend(crc32fast::hash(&copy).to_le_bytes());
    copy.resize(4096, 0);
    copy
}

#[test]
fn the_first_header_copy_with_fields_in_range_counts() {
    let (disk, geometry) = three_images();
    let put = |copy: usize, bytes: &[u8]| {
        disk.0.borrow_mut().cache[copy * 4096..(copy + 1) * 4096].copy_from_slice(bytes);
    };
    let newest = || survey(&mut disk.clone()).unwrap().newest.map(|newest| newest.stamp.scan);
    let Geometry { slot_bytes, slots, id } = geometry;
    let out_of_range =
        [(100, slots), (0, slots), (slot_bytes + 1, slots), (128 << 20, slots), (slot_bytes, 2)];
    for (slot_bytes, slots) in out_of_range.into_iter().chain([(slot_bytes, 65)]) {
        put(0, &header(slot_bytes, slots, id));
        assert_eq!(newest(), Some(9), "{slot_bytes} bytes, {slots} slots");
        page_agrees("header-out-of-range", &disk);
    }
    put(1, &header(100, slots, id));
    assert!(survey(&mut disk.clone()).is_err());
    page_agrees("header-out-of-range", &disk);
    for ((first, second), scan) in [((id, id + 1), Some(9)), ((id + 1, id), None)] {
        put(0, &header(slot_bytes, slots, first));
        put(1, &header(slot_bytes, slots, second));
        assert_eq!(newest(), scan);
        page_agrees("headers-differ", &disk);
    }
}

#[test]
fn slots_beyond_the_end_of_the_file_are_skipped() {
    let (disk, geometry) = three_images();
    for (bytes, newest) in [
        (geometry.slot_at(3), Some(9)),
        (geometry.slot_at(3) - 1, Some(9)),
        (geometry.slot_at(2) + 101, Some(6)),
        (geometry.slot_at(2) + 30, Some(6)),
        (geometry.slot_at(2), Some(6)),
        (geometry.slot_at(0), None),
    ] {
        let (cut, _) = three_images();
        cut.0.borrow_mut().cache.truncate(bytes as usize);
        let survey = survey(&mut cut.clone()).unwrap();
        assert!(!survey.whole, "{bytes} of {} bytes", geometry.file_bytes());
        assert_eq!(survey.slots.len(), geometry.slots as usize);
        assert_eq!(survey.newest.map(|newest| newest.stamp.scan), newest, "{bytes} bytes");
        page_agrees("cut", &cut);
    }
    assert!(survey(&mut disk.clone()).unwrap().whole, "the control");
}

#[test]
fn an_intact_but_meaningless_image_counts_as_the_newest() {
    let (disk, geometry) = three_images();
    let whole = content();
    let with = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    let contents = [
        with(4, 99),
        with(8 + 4, 200),
        with(8 + 4 + 3, 0xFF),
        [&whole[..], &[0, 0, 0, 0]].concat(),
        whole[..whole.len() - 1].to_vec(),
        Vec::new(),
    ];
    for bad in contents {
        put(&disk, &geometry, 3, &WholeImage { stamp: stamp(4, 40), content: &bad });
        let newest = survey(&mut disk.clone()).unwrap().newest.unwrap();
        assert_eq!((newest.stamp.scan, &newest.content), (40, &bad));
        page_agrees("without-sense", &disk);
        assert!(rungd_state::retain::content::read(&newest.content).is_none(), "{bad:?}");
    }
    assert!(rungd_state::retain::content::read(&whole).is_some(), "the control");
}
