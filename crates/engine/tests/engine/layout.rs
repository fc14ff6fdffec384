//! The cells of addresses: every bit and word has its own cell, for any memory sizes.

use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{
    Address, Bit, BitSpace, BlockId, DeviceBit, DeviceId, MemorySizes, StageId, Structure, Word,
    WordSpace,
};
use rungd_engine::{Cell, Engine, Layout, ScanTimes};
use rungd_language::lower::lower;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_test_support::plc::plc;

const BLOCKS: u32 = 5;
const STAGES: u32 = 7;

fn addresses(sizes: &MemorySizes) -> Vec<Address> {
    let bits = [BitSpace::X, BitSpace::Y, BitSpace::C, BitSpace::Mc, BitSpace::Mi, BitSpace::St];
    let words =
        [WordSpace::V, WordSpace::D, WordSpace::R, WordSpace::Mhr, WordSpace::Mir, WordSpace::Dst];
    let mut all = Vec::new();
    for space in bits {
        let numbers = space.first()..space.first() + space.count(sizes);
        all.extend(numbers.map(|n| Address::Bit(Bit::Space(space, n))));
    }
    for space in words {
        let numbers = space.first()..space.first() + space.count(sizes);
        all.extend(numbers.map(|n| Address::Word(Word::Space(space, n))));
    }
    let counters = (0..sizes.ct).map(Structure::Counter);
    let timers = (0..sizes.t).map(Structure::Timer);
    let sensaphones = (0..64).map(Structure::Sensaphone);
    for structure in counters.chain(timers).chain(sensaphones) {
        all.extend(structure.member_addresses());
    }
    all.extend((0..STAGES).map(|n| Address::Bit(Bit::Stage(StageId(n)))));
    all.extend((0..BLOCKS).map(|n| Address::Bit(Bit::Running(BlockId(n)))));
    all.extend((0..BLOCKS).map(|n| Address::Bit(Bit::Done(BlockId(n)))));
    let health = |n| DeviceBit::ALL.map(|health| Address::Bit(Bit::Device(DeviceId(n), health)));
    all.extend((0..sizes.devices).flat_map(health));
    all
}

/// Checks that every address has its own cell. The only other cells are those in which the owner of
/// a structure keeps its state, beside the flags of the structure.
fn assert_dense(sizes: &MemorySizes) {
    let layout = Layout::new(sizes, BLOCKS, STAGES);
    let (mut bits, mut words) = (Vec::new(), Vec::new());
    for address in addresses(sizes) {
        match layout.cell(address) {
            Some(Cell::Bit(bit)) => bits.push(bit.0),
            Some(Cell::Word(word)) => words.push(word.0),
            Some(Cell::WordBit(_)) | None => panic!("{address} has no cell"),
        }
    }
    bits.sort_unstable();
    words.sort_unstable();
    assert!(bits.windows(2).all(|pair| pair[0] < pair[1]), "bits {sizes:?}");
    assert!(bits.last().is_some_and(|last| *last < layout.bit_count()), "bits {sizes:?}");
    let states = (sizes.ct + sizes.t) * 4 + 64 * 3;
    assert_eq!(bits.len() as u32 + states, layout.bit_count(), "bits {sizes:?}");
    assert!(words.iter().copied().eq(0..layout.word_count()), "words {sizes:?}");
    assert_eq!(layout.sizes(), sizes);
}

#[test]
fn every_address_has_its_own_cell() {
    assert_dense(&MemorySizes::default());
}

#[test]
fn every_address_has_its_own_cell_in_memories_of_other_sizes() {
    let (x, y, c, mc, mi) = (3, 9, 5, 11, 2);
    let (v, d, r, mhr, mir, ct, t) = (13, 4, 5, 6, 8, 10, 7);
    assert_dense(&MemorySizes { x, y, c, mc, mi, v, d, r, mhr, mir, ct, t, devices: 3 });
}

#[test]
fn a_structure_as_a_whole_has_no_cell() {
    let layout = Layout::new(&MemorySizes::default(), BLOCKS, STAGES);
    assert_eq!(layout.cell(Address::Structure(Structure::Counter(3))), None);
}

#[test]
fn an_image_shows_all_bits_and_words_by_cell() {
    let mut plc = plc(r#"rung = [ { when = ["$On"], do = ["SET C3", "MOVE -7 to=D2"] } ]"#);
    plc.scan(&[]);
    let image = plc.engine.image();
    let (Cell::Bit(c3), Cell::Word(d2)) = (plc.cell("C3"), plc.cell("D2")) else {
        panic!("C3 is a bit, D2 a word")
    };
    assert_eq!(image.bits()[c3.0 as usize], 1);
    assert_eq!(image.words()[d2.0 as usize], -7);
    assert!(image.bits().len() >= plc.symbols.layout.bit_count() as usize);
    assert!(image.words().len() > plc.symbols.layout.word_count() as usize);
    assert_eq!(image.bits().len(), plc.engine.program().bit_count as usize);
    assert_eq!(image.words().len(), plc.engine.program().word_count as usize);
}

/// The engine addresses short programs in a different way than long ones. Here the number of a
/// space's last cell exceeds 16 bits: this cell is written, and the cell with the same low 16 bits
/// is not.
#[test]
fn cells_numbered_beyond_16_bits_are_addressed_correctly() {
    let sizes = MemorySizes { c: 65_536, d: 65_536, ..MemorySizes::default() };
    let ladder = "[[program]]\nname = \"Main\"\nrung = [ \
         { when = [\"X1\"], do = [\"OUT C65535\", \"MOVE 7 to=D65535\"] } ]";
    let file = SourceFile { name: "long.toml".into(), text: ladder.into() };
    let options = LoadOptions { sizes, ..LoadOptions::default() };
    let program = load_ladders(&[file], &options).0.expect("it loads");
    let (program, symbols) = lower(&program);
    let bit = |space, n| symbols.layout.bit(Bit::Space(space, n));
    let word = symbols.layout.word(Word::Space(WordSpace::D, 65_535));
    let mut engine = Engine::new(program);
    engine.start(0);
    engine.begin_scan(0, &ScanTimes::default(), &LocalTime::default());
    engine.set_input(1, true);
    let before = engine.image().clone();
    engine.execute();
    let coil = bit(BitSpace::C, 65_535);
    assert!(coil.0 > 65_535 && word.0 > 65_535);
    let changed = |cells: &[u8], was: &[u8]| {
        (0..cells.len()).filter(|at| cells[*at] != was[*at]).collect::<Vec<_>>()
    };
    assert!(changed(engine.image().bits(), before.bits()).contains(&(coil.0 as usize)));
    for at in changed(engine.image().bits(), before.bits()) {
        assert!(at == coil.0 as usize || at as u32 >= symbols.layout.bit_count(), "cell {at}");
    }
    assert_eq!(engine.image().word(word), 7);
    let words = engine.image().words().iter().zip(before.words());
    assert_eq!(words.filter(|(now, was)| now != was).count(), 1);
}
