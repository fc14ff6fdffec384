//! Sections, blocks and segments as bytes: written data can be read again, and bytes that no writer
//! produces are refused.

use std::io::Cursor;

use crate::record::drawn::{Numbers, block, program, section};
use rungd_history::record::{FileIndex, Flaw, Recent, SectionBody, SegmentStart, index};

#[test]
fn a_section_survives_a_round_trip() {
    for seed in 0..2_000 {
        let section = section(&mut Numbers(seed));
        let bytes = section.write();
        assert_eq!(SectionBody::read(&bytes).as_ref(), Some(&section), "seed {seed}");
    }
}

#[test]
fn bytes_that_are_no_section_are_refused_without_a_panic() {
    for seed in 0..300 {
        let mut numbers = Numbers(seed);
        let mut bytes = section(&mut numbers).write();
        for _ in 0..50 {
            match numbers.below(3) {
                0 => bytes.truncate(numbers.below(bytes.len() as u64 + 1) as usize),
                1 => bytes.push(numbers.below(256) as u8),
                _ if bytes.is_empty() => {}
                _ => {
                    let at = numbers.below(bytes.len() as u64) as usize;
                    bytes[at] = numbers.below(256) as u8;
                }
            }
            // A section that can be read can also be written.
            if let Some(section) = SectionBody::read(&bytes) {
                assert_eq!(SectionBody::read(&section.write()), Some(section));
            }
        }
        let bytes: Vec<u8> = (0..numbers.below(300)).map(|_| numbers.below(256) as u8).collect();
        let _ = SectionBody::read(&bytes);
    }
}

/// A recording of two programs, with its sections.
fn recording() -> (Vec<u8>, Vec<SectionBody>) {
    let mut numbers = Numbers(7);
    let sections: Vec<_> = (0..6).map(|_| section(&mut numbers)).collect();
    let programs = [program(0), program(1)];
    let starts = [0, 1].map(|at: usize| SegmentStart::new(&programs[at]));
    let mut out = Vec::new();
    for (sequence, section) in sections.iter().enumerate() {
        let (program, start) = (&programs[sequence / 3], &starts[sequence / 3]);
        if sequence % 3 == 0 {
            out.extend_from_slice(&start.bytes);
        }
        block(sequence as u64, program, None, section).write(start.sum, true, &mut out);
    }
    (out, sections)
}

fn read(bytes: &[u8]) -> FileIndex {
    index(&mut Cursor::new(bytes)).expect("bytes can be read")
}

/// The sections that can be read, with their sequence numbers.
fn found(bytes: &[u8]) -> (Vec<(u64, SectionBody)>, Vec<Flaw>) {
    let FileIndex { blocks, flaws } = read(bytes);
    let mut sections = Vec::new();
    for block in blocks {
        if let Some((_, section)) = block.read(&mut Cursor::new(bytes)).unwrap() {
            assert_eq!(u64::from(block.program.generation), block.head.sequence / 3);
            sections.push((block.head.sequence, section));
        }
    }
    (sections, flaws)
}

#[test]
fn a_recording_survives_a_round_trip() {
    let (bytes, sections) = recording();
    let (found, flaws) = found(&bytes);
    assert_eq!(flaws, []);
    let expected: Vec<_> = (0..).zip(sections).collect();
    assert_eq!(found, expected);
    let first = &read(&bytes).blocks[0];
    assert_eq!(*first.program, *program(0));
    assert_eq!((first.head.number, first.head.follows, first.has_base), (0, false, false));
}

#[test]
fn a_truncated_recording_gives_its_complete_blocks() {
    let (bytes, sections) = recording();
    let mut most = 0;
    for length in 0..bytes.len() {
        let (found, flaws) = found(&bytes[..length]);
        assert!(found.len() >= most);
        most = found.len();
        for (at, (sequence, section)) in found.iter().enumerate() {
            assert_eq!((at as u64, section), (*sequence, &sections[at]));
        }
        assert!(flaws.len() <= 1 && flaws.iter().all(|flaw| matches!(flaw, Flaw::Torn { .. })));
        // A file that the file system has extended without writing the bytes.
        let longer = [&bytes[..length], &[0; 200]].concat();
        assert_eq!(self::found(&longer).0.len(), found.len(), "{length}");
    }
    assert_eq!(most, 5);
}

#[test]
fn a_flipped_bit_loses_one_block_and_misreads_nothing() {
    let (bytes, sections) = recording();
    for at in (0..bytes.len() * 8).step_by(11) {
        let mut other = bytes.clone();
        other[at / 8] ^= 1 << (at % 8);
        let (found, flaws) = found(&other);
        let blocks = read(&other).blocks.len();
        assert!(found.len() < 6 && found.len() >= 3, "bit {at}: {}", found.len());
        assert!(!flaws.is_empty() || found.len() < blocks, "bit {at} was not seen");
        for (sequence, section) in &found {
            assert_eq!(section, &sections[*sequence as usize], "bit {at}");
        }
    }
}

#[test]
fn an_intact_header_is_found_after_any_damage() {
    let (bytes, sections) = recording();
    for gap in [1, 75, 76, 77, 65_000, 65_460, 65_461, 65_535, 65_536, 65_537, 70_000, 131_000] {
        let mut other = bytes.clone();
        other.extend(vec![b'B'; gap]);
        other.extend_from_slice(&bytes);
        let (found, flaws) = found(&other);
        assert_eq!((found.len(), flaws), (12, vec![Flaw::Damaged { at: bytes.len() as u64 }]));
        assert_eq!(found[6].1, sections[0]);
    }
}

#[test]
fn a_recording_of_any_bytes_can_be_indexed() {
    let (bytes, _) = recording();
    for seed in 0..400 {
        let mut numbers = Numbers(seed);
        let mut other = Vec::new();
        for _ in 0..4 {
            let begin = numbers.below(bytes.len() as u64) as usize;
            let end = begin + numbers.below((bytes.len() - begin) as u64) as usize;
            other.extend_from_slice(&bytes[begin..end]);
            (0..numbers.below(40)).for_each(|_| other.push(numbers.below(256) as u8));
        }
        let _ = found(&other);
    }
}

#[test]
fn memory_keeps_the_newest_blocks_within_its_size() {
    let mut numbers = Numbers(3);
    let programs = [program(0), program(1), program(2)];
    let size = 6_000;
    let mut recent = Recent::new(size);
    assert_eq!((recent.reach_ns(), recent.write().len()), (0, 0));
    for sequence in 0..300 {
        let section = section(&mut numbers);
        let program = &programs[(sequence / 100) as usize];
        // Every third block has a state.
        let state = (sequence % 3 == 0).then_some(&[1, 2, 3][..]);
        let block = block(sequence, program, state, &section);
        recent.put(&block);
        let bytes = recent.write();
        assert!(bytes.len() <= size, "{}", bytes.len());
        let FileIndex { blocks, flaws } = read(&bytes);
        assert_eq!(flaws, []);
        let (first, last) = (&blocks[0], &blocks[blocks.len() - 1]);
        assert!(first.has_base && last.head == block.head && last.program == *program);
        for pair in blocks.windows(2) {
            assert_eq!(pair[0].head.sequence + 1, pair[1].head.sequence);
        }
        for from in [0, sequence.saturating_sub(4), sequence, sequence + 9] {
            let part = read(&recent.write_from(from, None, usize::MAX)).blocks;
            let (begin, end) = (part[0].head.sequence, part[part.len() - 1].head.sequence);
            let oldest = first.head.sequence;
            // A base image is at most two sections earlier.
            let wanted = from.min(sequence);
            assert!(part[0].has_base && end == sequence, "{from}: {begin} to {end}");
            assert!(begin <= wanted.max(oldest) && begin + 2 >= wanted, "{from}: {begin}");
        }
        for most in [0, 500, 1000, 3000, size] {
            let bytes = recent.write_from(0, None, most);
            let FileIndex { blocks: part, flaws } = read(&bytes);
            assert!(flaws.is_empty() && part[part.len() - 1].head == block.head);
            assert!(part[0].has_base);
            let later_bases = part[1..].iter().filter(|block| block.has_base).count();
            assert!(bytes.len() <= most || later_bases == 0, "{} of {most}", bytes.len());
            assert!(most < size || part.len() == blocks.len(), "nothing is left out in vain");
        }
        assert!(sequence < 10 || blocks.len() > 2);
    }
}

#[test]
fn a_block_larger_than_memory_is_not_kept() {
    let section = section(&mut Numbers(3));
    let mut recent = Recent::new(100);
    recent.put(&block(0, &program(0), Some(&[0]), &section));
    assert_eq!((recent.reach_ns(), recent.write().len()), (0, 0));
}
