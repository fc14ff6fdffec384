//! The explicit map, unit identifiers and write lists, over a real socket.

use std::time::Duration;

use super::controller::{Controller, RawClient, settings};
use super::{any_client, operands};
use crate::modbus::clients::Network;
use crate::modbus::number::{RegisterNumberType, WordOrder};
use crate::modbus::settings::{MappedOperands, ModbusServerSettings, ModbusTable, WriteList};
use rungd_engine::isa::{Address, BitSpace};
use rungd_language::source::span::Span;
use rungd_runtime::exchange::OperandWrite;

const PERIOD: Duration = Duration::from_millis(2);

fn entry(text: &str, table: ModbusTable, address: u16) -> MappedOperands {
    let operands = operands(text);
    let kind = match operands.first {
        Address::Word(word) => Some(RegisterNumberType::of(word)),
        Address::Bit(_) | Address::Structure(_) => None,
    };
    let (order, span) = (WordOrder::default(), Span::default());
    MappedOperands { operands, table, address, kind, order, unit: None, span }
}

/// Holding registers from 4000: CT0.Acc; D0, low half first; D1 as i16; N0.ACC; V5; D2 as u32.
/// Coils from 4000: C0..C3, MC101 (copied to X0), Y0, X0. Discrete inputs from 4000: Y0..Y3. Unit 9
/// has V7 at 5000. Every client may write all these words except V5, and C0..C1. V5 is writable
/// from 10.0.0.0/8, C2 from loopback.
fn mapped() -> ModbusServerSettings {
    use ModbusTable::{Coils, DiscreteInputs, HoldingRegisters as Holding};
    let entries = vec![
        entry("CT0.Acc", Holding, 4000),
        MappedOperands { order: WordOrder::LowFirst, ..entry("D0", Holding, 4002) },
        MappedOperands { kind: Some(RegisterNumberType::I16), ..entry("D1", Holding, 4004) },
        entry("N0.ACC", Holding, 4005),
        entry("V5", Holding, 4006),
        MappedOperands { kind: Some(RegisterNumberType::U32), ..entry("D2", Holding, 4007) },
        entry("C0..C3", Coils, 4000),
        entry("MC101", Coils, 4004),
        entry("Y0", Coils, 4005),
        entry("X0", Coils, 4006),
        entry("Y0..Y3", DiscreteInputs, 4000),
        MappedOperands { unit: Some(9), ..entry("V7", Holding, 5000) },
    ];
    let mut any = any_client(&["CT0.Acc", "D0..D2", "N0.ACC", "V7", "C0..C1", "MHR1..MHR123"]);
    any.ranges.push(operands("MC1..MC32"));
    let list = |range: &str, network: (&str, u32)| WriteList {
        ranges: vec![operands(range)],
        clients: Some(vec![Network::of(network.0.parse().unwrap(), network.1)]),
    };
    let lists = vec![any, list("V5", ("10.0.0.0", 8)), list("C2", ("127.0.0.0", 8))];
    ModbusServerSettings { entries, lists, units: Some(vec![17, 9]), ..settings() }
}

fn start() -> (Controller, RawClient) {
    let controller = Controller::start(mapped(), PERIOD);
    let client = controller.client();
    (controller, client)
}

/// The value of a word, in any space.
fn word(controller: &Controller, text: &str) -> i32 {
    let Address::Word(word) = operands(text).first else { panic!("{text}") };
    controller.port.latest().word(controller.layout.word(word))
}

/// Writes a word directly, without the rules for clients.
fn put(controller: &Controller, text: &str, value: i32) {
    let Address::Word(word) = operands(text).first else { panic!("{text}") };
    let cell = controller.layout.word(word);
    controller.port.submit(vec![OperandWrite::Word(cell, value)]).unwrap();
    while controller.port.latest().word(cell) != value {
        std::thread::sleep(Duration::from_millis(1));
    }
}

const AT: u8 = 0x0f; // 4000 is 0x0fa0.

#[test]
fn two_registers_hold_one_value_in_the_configured_word_order() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[16, AT, 0xa0, 0, 2, 4, 0x12, 0x34, 0x56, 0x78])[0], 16);
    assert_eq!(word(&controller, "CT0.Acc"), 0x1234_5678);
    assert_eq!(client.ask(&[16, AT, 0xa2, 0, 2, 4, 0x56, 0x78, 0xff, 0xff])[0], 16);
    assert_eq!(word(&controller, "D0"), 0xffff_5678_u32 as i32);
    let all = [3, 8, 0x12, 0x34, 0x56, 0x78, 0x56, 0x78, 0xff, 0xff];
    assert_eq!(client.ask(&[3, AT, 0xa0, 0, 4]), all);
    assert_eq!(client.ask(&[3, AT, 0xa1, 0, 1]), [3, 2, 0x56, 0x78], "a half can be read");
    let both = [0, 1, 0, 2, 0, 4, 0, 3];
    assert_eq!(client.ask(&[&[16, AT, 0xa0, 0, 4, 8][..], &both].concat())[0], 16);
    assert_eq!((word(&controller, "CT0.Acc"), word(&controller, "D0")), (0x0001_0002, 0x0003_0004));
}

#[test]
fn writing_half_of_a_value_is_refused() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[6, AT, 0xa0, 0, 1]), [0x86, 2]);
    assert_eq!(client.ask(&[6, AT, 0xa1, 0, 1]), [0x86, 2]);
    assert_eq!(client.ask(&[16, AT, 0xa1, 0, 2, 4, 0, 1, 0, 2]), [0x90, 2]);
    assert_eq!(client.ask(&[16, AT, 0xa2, 0, 1, 2, 0, 1]), [0x90, 2]);
    assert_eq!(client.ask(&[22, AT, 0xa0, 0, 0, 0, 1]), [0x96, 2]);
    assert_eq!((word(&controller, "CT0.Acc"), word(&controller, "D0")), (0, 0));
}

#[test]
fn registers_show_the_nearest_value_and_accept_only_values_in_range() {
    let (controller, mut client) = start();
    for (value, shown) in [(-2, 0xfffe), (-40_000, 0x8000), (40_000, 0x7fff), (7, 7)] {
        put(&controller, "D1", value);
        let [high, low] = u16::to_be_bytes(shown);
        assert_eq!(client.ask(&[3, AT, 0xa4, 0, 1]), [3, 2, high, low], "{value}");
    }
    assert_eq!(client.ask(&[6, AT, 0xa4, 0xff, 0xfe])[0], 6);
    assert_eq!(word(&controller, "D1"), -2);
    put(&controller, "D2", -1);
    assert_eq!(client.ask(&[3, AT, 0xa7, 0, 2]), [3, 4, 0, 0, 0, 0], "u32 has no -1");
    assert_eq!(client.ask(&[16, AT, 0xa7, 0, 2, 4, 0x80, 0, 0, 0]), [0x90, 3], "D ends before");
    assert_eq!(client.ask(&[16, AT, 0xa7, 0, 2, 4, 0x7f, 0xff, 0, 0])[0], 16);
    assert_eq!(word(&controller, "D2"), 0x7fff_0000);
}

#[test]
fn bits_of_any_kind_can_be_coils_and_only_listed_coils_are_writable() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[15, AT, 0xa0, 0, 3, 1, 0b101])[0], 15);
    assert_eq!(client.ask(&[1, AT, 0xa0, 0, 7]), [1, 1, 0b101]);
    assert_eq!(client.ask(&[5, AT, 0xa3, 0xff, 0]), [0x85, 2], "C3 is not listed");
    assert_eq!(client.ask(&[5, AT, 0xa5, 0xff, 0]), [0x85, 2], "Y0");
    assert_eq!(client.ask(&[5, AT, 0xa6, 0xff, 0]), [0x85, 2], "X0");
    assert_eq!(client.ask(&[5, AT, 0xa4, 0xff, 0])[0], 5, "MC101 is X0, and X0 is Y0");
    assert_eq!(client.ask(&[1, AT, 0xa4, 0, 3]), [1, 1, 0b111]);
    assert_eq!(client.ask(&[2, AT, 0xa0, 0, 4]), [2, 1, 0b0011], "Y1 is ON, as driven");
    assert!(controller.bit(BitSpace::X, 0));
    assert_eq!(client.ask(&[1, AT, 0xa0, 0, 8]), [0x81, 2], "seven coils");
    controller.order(super::controller::Do::Stop);
    assert_eq!(client.ask(&[2, AT, 0xa0, 0, 4]), [2, 1, 0b0100], "Y2 is safe when it is ON");
}

#[test]
fn a_writable_list_applies_only_to_its_clients() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[6, AT, 0xa6, 0, 1]), [0x86, 2], "V5 is for 10.0.0.0/8");
    assert_eq!(client.ask(&[15, AT, 0xa0, 0, 3, 1, 7])[0], 15, "C2 is for loopback");
    assert!(controller.logged().contains("only other clients may write V5"));
}

#[test]
fn a_unit_has_its_own_addresses_besides_the_common_ones() {
    let (_controller, mut client) = start();
    assert_eq!(client.ask(&[3, 0x13, 0x88, 0, 1]), [0x83, 2], "5000 is unit 9's");
    client.unit = 9;
    assert_eq!(client.ask(&[6, 0x13, 0x88, 0, 7]), [6, 0x13, 0x88, 0, 7]);
    assert_eq!(client.ask(&[3, 0x13, 0x88, 0, 1]), [3, 2, 0, 7]);
    assert_eq!(client.ask(&[3, AT, 0xa6, 0, 1]), [3, 2, 0, 0]);
    for unit in [0, 1, 255] {
        client.unit = unit;
        assert_eq!(client.ask(&[3, 0, 0, 0, 1]), [0x83, 11]);
        assert_eq!(client.ask(&[99]), [0xe3, 11]);
    }
}

#[test]
fn a_mask_write_changes_the_present_value_of_the_word() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[6, 0, 4, 0, 0x12])[0], 6);
    let pdu = [22, 0, 4, 0, 0xf2, 0, 0x25];
    assert_eq!(client.ask(&pdu), pdu);
    assert_eq!(controller.register(5), 0x17, "the example of the specification");
    let pdu = [22, AT, 0xa5, 0, 0, 0xff, 0xfe];
    assert_eq!(client.ask(&pdu), pdu);
    assert_eq!(word(&controller, "N0.ACC"), -2);
    assert_eq!(client.ask(&[22, 0, 109, 0, 0, 0, 1]), [0x96, 3], "MHR110 has a tag with limits");
    assert_eq!(client.ask(&[22, AT, 0xa4, 0, 0, 0, 1]), [0x96, 3], "D1 holds more than i16");
    assert_eq!(client.ask(&[22, 0, 123, 0, 0, 0, 1]), [0x96, 2], "MHR124 is not listed");
    assert_eq!(client.ask(&[22, 0xff, 0xff, 0, 0, 0, 1]), [0x96, 2]);
    assert_eq!(client.ask(&[22, 0, 4, 0, 0, 0]), [0x96, 3]);
}

#[test]
fn a_read_write_request_reads_after_the_scan_that_applied_its_write() {
    let (controller, mut client) = start();
    let write =
        |read: [u8; 4], first: [u8; 2]| [&[23][..], &read, &first, &[0, 2, 4, 0, 5, 0, 6]].concat();
    assert_eq!(client.ask(&write([0, 0, 0, 3], [0, 0])), [23, 6, 0, 5, 0, 6, 0, 0]);
    assert_eq!(client.ask(&write([AT, 0xa0, 0, 2], [AT, 0xa0])), [23, 4, 0, 5, 0, 6]);
    assert_eq!(word(&controller, "CT0.Acc"), 0x0005_0006);
    assert_eq!(client.ask(&write([0xff, 0, 0, 1], [0, 9])), [0x97, 2], "nothing to read there");
    assert_eq!(client.ask(&write([0, 0, 0, 1], [0, 122])), [0x97, 2], "MHR124 is not listed");
    assert_eq!(client.ask(&write([0, 0, 0, 126], [0, 9])), [0x97, 3]);
    assert_eq!((controller.register(10), controller.register(123)), (0, 0));
    controller.order(super::controller::Do::Stop);
    assert_eq!(client.ask(&write([0, 0, 0, 1], [0, 0])), [0x97, 4]);
}
