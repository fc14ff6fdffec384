//! Every function code and every exception of the server.

use std::time::Duration;

use super::controller::{Controller, Do, RawClient, settings};
use rungd_engine::isa::BitSpace;
use rungd_runtime::exchange::QUEUED_BATCHES_MAX;

const PERIOD: Duration = Duration::from_millis(2);

fn start() -> (Controller, RawClient) {
    let controller = Controller::start(settings(), PERIOD);
    let client = controller.client();
    (controller, client)
}

#[test]
fn coils_are_written_and_read() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[5, 0, 0, 0xff, 0]), [5, 0, 0, 0xff, 0]);
    assert!(controller.bit(BitSpace::Mc, 1));
    assert_eq!(client.ask(&[1, 0, 0, 0, 1]), [1, 1, 1]);
    assert_eq!(client.ask(&[2, 0, 0, 0, 1]), [2, 1, 1], "the scan copied MC1 to MI1");
    assert_eq!(client.ask(&[5, 0, 0, 0, 0]), [5, 0, 0, 0, 0]);
    assert_eq!(client.ask(&[15, 0, 1, 0, 10, 2, 0b1010_0101, 0b10]), [15, 0, 1, 0, 10]);
    assert_eq!(client.ask(&[1, 0, 0, 0, 11]), [1, 2, 0b0100_1010, 0b101]);
}

#[test]
fn registers_are_written_and_read() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[6, 0, 9, 0xfe, 0xdc]), [6, 0, 9, 0xfe, 0xdc]);
    assert_eq!(controller.register(10), 0xfedc);
    assert_eq!(client.ask(&[16, 0, 10, 0, 2, 4, 0, 1, 0, 2]), [16, 0, 10, 0, 2]);
    assert_eq!(client.ask(&[3, 0, 9, 0, 3]), [3, 6, 0xfe, 0xdc, 0, 1, 0, 2]);
    let reply = client.ask(&[4, 0, 0, 0, 125]);
    assert_eq!((reply.len(), &reply[..2]), (252, &[4, 250][..]));
}

#[test]
fn the_longest_requests_are_answered() {
    let (_controller, mut client) = start();
    assert_eq!(client.ask(&[1, 0, 0, 0x03, 0xe8]).len(), 2 + 125, "1000 coils of 1024");
    assert_eq!(client.ask(&[1, 0, 0, 0x07, 0xd0]), [0x81, 2], "2000 are well-formed");
    let mut all = vec![16, 0, 0, 0, 123, 246];
    all.extend((0..123).flat_map(|_| [0, 50]));
    assert_eq!(client.ask(&all), [16, 0, 0, 0, 123]);
    let mut coils = vec![15, 0, 0, 0x07, 0xb0, 246];
    coils.extend([0; 246]);
    assert_eq!(client.ask(&coils), [0x8f, 2], "1968 are well-formed");
}

#[test]
fn addresses_that_do_not_exist_or_are_not_writable_give_exception_2() {
    let (_controller, mut client) = start();
    assert_eq!(client.ask(&[1, 4, 0, 0, 1]), [0x81, 2], "MC1025");
    assert_eq!(client.ask(&[2, 3, 0xff, 0, 2]), [0x82, 2]);
    assert_eq!(client.ask(&[3, 8, 0, 0, 1]), [0x83, 2], "MHR2049");
    assert_eq!(client.ask(&[4, 0xff, 0xff, 0, 1]), [0x84, 2]);
    assert_eq!(client.ask(&[5, 0, 32, 0, 0]), [0x85, 2], "MC33 is not listed");
    assert_eq!(client.ask(&[6, 0, 123, 0, 0]), [0x86, 2], "MHR124 is not listed");
    assert_eq!(client.ask(&[15, 0, 30, 0, 3, 1, 7]), [0x8f, 2]);
    assert_eq!(client.ask(&[16, 0, 122, 0, 2, 4, 0, 1, 0, 1]), [0x90, 2]);
    assert_eq!(client.ask(&[1, 0, 30, 0, 2]), [1, 1, 0], "nothing of it was written");
    assert_eq!(client.ask(&[3, 0, 122, 0, 1]), [3, 2, 0, 0]);
}

#[test]
fn bad_quantities_and_values_give_exception_3() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[1, 0, 0, 0, 0]), [0x81, 3]);
    assert_eq!(client.ask(&[2, 0, 0, 0x07, 0xd1]), [0x82, 3]);
    assert_eq!(client.ask(&[3, 0, 0, 0, 126]), [0x83, 3]);
    assert_eq!(client.ask(&[4, 0, 0]), [0x84, 3]);
    assert_eq!(client.ask(&[5, 0, 0, 1, 0]), [0x85, 3]);
    assert_eq!(client.ask(&[6, 0, 0]), [0x86, 3]);
    assert_eq!(client.ask(&[15, 0, 0, 0, 9, 1, 1]), [0x8f, 3]);
    assert_eq!(client.ask(&[16, 0, 0, 0, 1, 4, 0, 1]), [0x90, 3]);
    assert_eq!(client.ask(&[6, 0, 109, 0, 101]), [0x86, 3], "MHR110's tag says 1 to 100");
    assert_eq!(client.ask(&[6, 0, 109, 0, 0]), [0x86, 3]);
    assert_eq!(client.ask(&[6, 0, 109, 0, 100]), [6, 0, 109, 0, 100]);
    assert_eq!(controller.register(110), 100);
}

#[test]
fn unknown_functions_give_exception_1() {
    let (_controller, mut client) = start();
    for function in [0, 7, 17, 20, 24, 43, 127] {
        assert_eq!(client.ask(&[function, 0, 0, 0, 1]), [function | 0x80, 1]);
    }
}

#[test]
fn writes_in_stop_or_fault_give_exception_4_and_reads_still_work() {
    let (controller, mut client) = start();
    assert_eq!(client.ask(&[6, 0, 0, 0, 7]), [6, 0, 0, 0, 7]);
    for order in [Do::Stop, Do::Fault] {
        controller.order(order);
        for pdu in [[5, 0, 0, 0xff, 0], [6, 0, 0, 0, 9]] {
            assert_eq!(client.ask(&pdu), [pdu[0] | 0x80, 4]);
        }
        assert_eq!(
            client.ask(&[6, 0, 123, 0, 0]),
            [0x86, 2],
            "a wrong address is wrong in STOP too"
        );
        assert_eq!(client.ask(&[3, 0, 0, 0, 1]), [3, 2, 0, 7]);
    }
    controller.order(Do::Run);
    assert_eq!(client.ask(&[6, 0, 0, 0, 9]), [6, 0, 0, 0, 9]);
}

#[test]
fn a_pending_write_gives_exception_4_when_the_controller_stops() {
    let (controller, mut client) = start();
    controller.order(Do::Freeze);
    let asking = std::thread::spawn(move || client.ask(&[5, 0, 0, 0xff, 0]));
    std::thread::sleep(Duration::from_millis(100));
    assert!(!asking.is_finished(), "no scan has seen it");
    controller.order(Do::Stop);
    assert_eq!(asking.join().unwrap(), [0x85, 4]);
    assert!(!controller.bit(BitSpace::Mc, 1));
}

#[test]
fn a_write_to_a_full_queue_gives_exception_6() {
    let (controller, mut client) = start();
    controller.order(Do::Freeze);
    let waiting = (0..=QUEUED_BATCHES_MAX).take_while(|_| controller.port.submit(vec![]).is_ok());
    assert_eq!(waiting.count(), QUEUED_BATCHES_MAX);
    assert_eq!(client.ask(&[5, 0, 0, 0xff, 0]), [0x85, 6]);
    assert_eq!(client.ask(&[1, 0, 0, 0, 1]), [1, 1, 0], "reads go on");
    controller.order(Do::Run);
    assert_eq!(client.ask(&[5, 0, 0, 0xff, 0]), [5, 0, 0, 0xff, 0]);
}
