//! The map without a server: the writes and the reply bytes of a request.

use std::net::{IpAddr, Ipv4Addr};

use super::super::map::{ModbusMap, RequestSource, TableRead};
use super::super::pdu::{self, ElementRange, ModbusRequest};
use super::{any_client, loopback, range};
use crate::modbus::settings::ModbusServerSettings;
use rungd_engine::Layout;
use rungd_engine::isa::{Bit, BitSpace, MemorySizes, Space, Word, WordSpace};
use rungd_runtime::exchange::{Mode, OperandWrite, Snapshot, StopReason};

const ASKER: RequestSource = RequestSource { unit: 1, client: IpAddr::V4(Ipv4Addr::LOCALHOST) };

/// The memory has MC1..MC8, MI1..MI4, MHR1..MHR4 and MIR1..MIR2. The write list has MC1, MC2 and
/// MHR1..MHR3. MC3 and MC4 are copied to X0 and X1, and Y0 and Y1 to MI2 and MI3. A tag limits MHR2
/// to 5..=9.
fn small() -> (ModbusMap, Layout) {
    let sizes = MemorySizes { mc: 8, mi: 4, mhr: 4, mir: 2, ..MemorySizes::default() };
    let layout = Layout::new(&sizes, 1, 0);
    let [mc, x, y, mi] = [BitSpace::Mc, BitSpace::X, BitSpace::Y, BitSpace::Mi].map(Space::Bit);
    let settings = ModbusServerSettings {
        lists: vec![any_client(&["MC1..MC2", "MHR1..MHR3"])],
        inputs: Some((range(mc, 3, 4), range(x, 0, 1))),
        outputs: Some((range(y, 0, 1), range(mi, 2, 3))),
        ..loopback()
    };
    let limits = |word: Word| {
        if word == Word::Space(WordSpace::Mhr, 2) { (5, 9) } else { word.range() }
    };
    (ModbusMap::new(&settings, &layout, limits), layout)
}

fn write(pdu: &[u8]) -> Result<Vec<OperandWrite>, u8> {
    let request = pdu::parse(pdu).expect("a well-formed request");
    small().0.writes(ASKER, &request).map_err(|refusal| refusal.exception() as u8)
}

fn coil(n: u32, on: bool) -> OperandWrite {
    OperandWrite::Bit(small().1.bit(Bit::Space(BitSpace::Mc, n)), on)
}

fn register(n: u32, value: i32) -> OperandWrite {
    OperandWrite::Word(small().1.word(Word::Space(WordSpace::Mhr, n)), value)
}

#[test]
fn only_listed_addresses_can_be_written() {
    assert_eq!(write(&[5, 0, 0, 0xff, 0]), Ok(vec![coil(1, true)]));
    assert_eq!(write(&[5, 0, 4, 0xff, 0]), Err(2), "MC5 is not listed");
    assert_eq!(write(&[5, 0, 8, 0xff, 0]), Err(2), "MC9 does not exist");
    assert_eq!(write(&[5, 0xff, 0xff, 0xff, 0]), Err(2));
    assert_eq!(write(&[15, 0, 0, 0, 5, 1, 0x1f]), Err(2), "the last of five is not listed");
    assert_eq!(write(&[15, 0xff, 0xff, 0, 2, 1, 3]), Err(2));
    assert_eq!(write(&[6, 0, 0, 0x12, 0x34]), Ok(vec![register(1, 0x1234)]));
    assert_eq!(write(&[6, 0, 3, 0, 0]), Err(2), "MHR4 is not listed");
    assert_eq!(write(&[6, 0, 4, 0, 0]), Err(2), "MHR5 does not exist");
}

#[test]
fn a_value_beyond_a_tags_limits_refuses_the_whole_write() {
    assert_eq!(write(&[6, 0, 1, 0, 4]), Err(3));
    assert_eq!(write(&[6, 0, 1, 0, 5]), Ok(vec![register(2, 5)]));
    assert_eq!(write(&[6, 0, 1, 0, 9]), Ok(vec![register(2, 9)]));
    assert_eq!(write(&[6, 0, 1, 0, 10]), Err(3));
    assert_eq!(write(&[16, 0, 0, 0, 2, 4, 0, 1, 0, 10]), Err(3));
    let both = vec![register(1, 0xffff), register(2, 7)];
    assert_eq!(write(&[16, 0, 0, 0, 2, 4, 0xff, 0xff, 0, 7]), Ok(both));
}

#[test]
fn a_coil_of_the_image_is_writable_and_sets_its_input() {
    let writes = vec![
        coil(2, true),
        coil(3, false),
        OperandWrite::Input(0, false),
        coil(4, true),
        OperandWrite::Input(1, true),
    ];
    assert_eq!(write(&[15, 0, 1, 0, 3, 1, 0b101]), Ok(writes));
}

fn snapshot(layout: &Layout) -> Snapshot {
    Snapshot {
        generation: 0,
        safe: [].into(),
        since_ns: 0,
        ending: false,
        forces: Default::default(),
        scans: 1,
        now_ns: 0,
        mode: Mode::Stop(StopReason::NotStarted),
        bits: vec![0; layout.bit_count() as usize].into(),
        words: vec![0; layout.word_count() as usize].into(),
        outputs: vec![0; 2048].into(),
        tickets_done: 0,
    }
}

fn read(snapshot: &Snapshot, pdu: &[u8]) -> Result<Vec<u8>, u8> {
    let Ok(ModbusRequest::Read { table, first, count }) = pdu::parse(pdu) else {
        panic!("no read: {pdu:?}")
    };
    let mut reply = Vec::new();
    let ask = TableRead { function: pdu[0], range: ElementRange { table, first, count } };
    let done = small().0.read(1, ask, snapshot, &mut reply);
    done.map(|()| reply).map_err(|refusal| refusal.exception() as u8)
}

#[test]
fn each_table_is_readable_up_to_its_last_element() {
    let layout = small().1;
    let mut image = snapshot(&layout);
    let mut set = |bit, on: bool| image.bits[layout.bit(bit).0 as usize] = u8::from(on);
    set(Bit::Space(BitSpace::Mc, 1), true);
    set(Bit::Space(BitSpace::Mc, 8), true);
    set(Bit::Space(BitSpace::Mi, 1), true);
    set(Bit::Space(BitSpace::Mi, 2), true);
    image.words[layout.word(Word::Space(WordSpace::Mhr, 4)).0 as usize] = 0xabcd;
    image.words[layout.word(Word::Space(WordSpace::Mir, 1)).0 as usize] = 5;
    image.outputs[1] = 1;
    assert_eq!(read(&image, &[1, 0, 0, 0, 8]), Ok(vec![1, 1, 0x81]));
    assert_eq!(read(&image, &[1, 0, 0, 0, 9]), Err(2));
    assert_eq!(read(&image, &[1, 0, 8, 0, 1]), Err(2));
    let as_driven = Ok(vec![2, 1, 0b0101]);
    assert_eq!(read(&image, &[2, 0, 0, 0, 4]), as_driven, "MI2 is Y0 (OFF), MI3 is Y1 (ON)");
    assert_eq!(read(&image, &[3, 0, 2, 0, 2]), Ok(vec![3, 4, 0, 0, 0xab, 0xcd]));
    assert_eq!(read(&image, &[3, 0, 3, 0, 2]), Err(2));
    assert_eq!(read(&image, &[4, 0, 0, 0, 2]), Ok(vec![4, 4, 0, 5, 0, 0]));
    assert_eq!(read(&image, &[4, 0xff, 0xff, 0, 125]), Err(2));
}

#[test]
fn inputs_of_the_image_start_with_the_values_of_their_coils() {
    let (map, layout) = small();
    let mut image = snapshot(&layout);
    image.bits[layout.bit(Bit::Space(BitSpace::Mc, 4)).0 as usize] = 1;
    assert_eq!(map.first_inputs(&image).collect::<Vec<_>>(), [(0, false), (1, true)]);
}
