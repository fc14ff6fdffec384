//! `docs/retain-format.md`: the reader that stands there reads what rungd writes.

use crate::disk;
use crate::support::needs::not_installed;
use std::path::Path;
use std::process::Command;

use rungd::retain::content::ElementKind;
use rungd::retain::format::{Geometry, Stamp};
use rungd::retain::slots::Slots;

/// A content by hand, as the page has it: D3 and D4 (`level`), C5 of an OUT, CT0 of a
/// UDCG.
fn content() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut put = |numbers: &[u32]| numbers.iter().for_each(|n| bytes.extend(n.to_le_bytes()));
    put(&[3, 5, 3, 2, 1 | 1 << 8, 5, 1, 8, 0, 1]);
    put(&[1, 5 | 5 << 16, 4]);
    bytes.extend(b"level\0\0\0");
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend((8_u32 | 12 << 16).to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(b"UDCG in Main");
    bytes.extend((-2_i32).to_le_bytes());
    bytes.extend(400_i32.to_le_bytes());
    bytes.push(1);
    bytes.extend(7_i32.to_le_bytes());
    bytes.extend([0, 0, 0, 0, 1, 0, 0, 0]);
    bytes
}

#[test]
fn the_reader_of_the_page_reads_what_is_written() {
    let content = content();
    let read = rungd::retain::content::read(&content).expect("it is as the page says");
    assert_eq!((read.elements.len(), read.tags.len(), read.owners.len()), (4, 1, 1));
    assert_eq!(read.terminated.into_iter().collect::<Vec<_>>(), [(ElementKind::C, 5)]);
    let geometry = Geometry::for_content(content.len(), 77);
    let disk = disk::Handle::new(512, geometry.file_bytes() as usize);
    let mut slots = Slots::format(disk.clone(), geometry).unwrap();
    for scan in [5, 6, 9, 12, 40] {
        slots.save(Stamp { sequence: 0, scan, saved_ms: 0, flags: 0 }, &content).unwrap();
    }
    let mut bytes = disk.0.borrow().durable.clone();
    // The first copy of the header and the newest but one image are damaged.
    bytes[3] ^= 1;
    bytes[geometry.slot_at(3) as usize + 70] ^= 1;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("retain-format");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("memory"), &bytes).unwrap();
    let page = include_str!("../../docs/retain-format.md");
    let script = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();
    std::fs::write(folder.join("reader.py"), script).unwrap();
    let mut python = Command::new("python3");
    let Ok(output) = python.args(["reader.py", "memory"]).current_dir(&folder).output() else {
        return not_installed("python3");
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        "image 5 of scan 40\nD3 -2\nD4 level 400\nC5 1 OFF or reset at a stop\nCT0 7 0 0 0 0 1 0 0 0\n"
    );
}
