//! Requests and scans: a scan sees a whole write, a read shows the values of one scan, and the
//! coils and inputs of the image agree.

use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use super::controller::{Controller, Do, settings};
use rungd_engine::isa::BitSpace;

const PERIOD: Duration = Duration::from_millis(1);

#[test]
fn a_read_never_mixes_two_scans() {
    let controller = Controller::start(settings(), Duration::ZERO);
    let mut client = controller.client();
    let mut seen = std::collections::BTreeSet::new();
    let began = Instant::now();
    for requests in 1.. {
        let reply = client.ask(&[4, 0, 0, 0, 125]);
        let words: Vec<_> = reply[2..].chunks(2).collect();
        assert!(words.iter().all(|word| *word == words[0]), "{reply:?}");
        seen.insert(words[0].to_vec());
        if requests >= 500 && seen.len() > 10 {
            return;
        }
        assert!(began.elapsed() < Duration::from_secs(30), "only {} scans", seen.len());
    }
}

#[test]
fn no_scan_sees_a_partial_write() {
    let controller = Controller::start(settings(), Duration::ZERO);
    let write = |value: u8| {
        let mut client = controller.client();
        for _ in 0..100 {
            let mut pdu = vec![16, 0, 0, 0, 100, 200];
            pdu.extend((0..100).flat_map(|_| [value, value]));
            assert_eq!(client.ask(&pdu), [16, 0, 0, 0, 100]);
            let reply = client.ask(&[3, 0, 0, 0, 100]);
            assert!(reply[2..].iter().all(|byte| *byte == reply[2]), "{reply:?}");
        }
    };
    thread::scope(|scope| {
        for value in [1, 2, 3] {
            scope.spawn(move || write(value));
        }
    });
    assert_eq!(controller.torn.load(Ordering::Relaxed), 0);
}

#[test]
fn the_reply_to_a_write_is_sent_after_the_scan_that_applied_the_write() {
    let controller = Controller::start(settings(), Duration::from_millis(100));
    let mut client = controller.client();
    client.ask(&[5, 0, 1, 0xff, 0]);
    let (before, began) = (controller.port.latest().scans, Instant::now());
    client.ask(&[5, 0, 0, 0xff, 0]);
    assert!(controller.port.latest().scans > before);
    assert!(controller.bit(BitSpace::Mi, 1), "that scan's program has worked with it");
    assert!(began.elapsed() > Duration::from_millis(20), "it waited for the next scan");
}

#[test]
fn a_coil_of_the_image_sets_its_input_in_the_same_scan() {
    let controller = Controller::start(settings(), PERIOD);
    let mut client = controller.client();
    for round in 0..200_u8 {
        let coils = round % 16;
        assert_eq!(client.ask(&[15, 0, 100, 0, 4, 1, coils]), [15, 0, 100, 0, 4]);
        let input = |x| u8::from(controller.bit(BitSpace::X, x)) << x;
        let inputs = (0..4).map(input).sum::<u8>();
        assert_eq!(inputs, coils, "X0..X3");
        assert_eq!(client.ask(&[2, 0, 10, 0, 1]), [2, 1, coils & 1], "MI11 is Y0, which is X0");
    }
    assert_eq!(controller.torn.load(Ordering::Relaxed), 0, "X and MC differed in a scan");
}

#[test]
fn discrete_inputs_of_the_image_show_the_outputs_as_driven() {
    let controller = Controller::start(settings(), PERIOD);
    let mut client = controller.client();
    client.ask(&[5, 0, 100, 0xff, 0]);
    assert_eq!(client.ask(&[2, 0, 10, 0, 4]), [2, 1, 0b0011], "Y0 and Y1 are ON");
    controller.order(Do::Stop);
    assert_eq!(client.ask(&[2, 0, 10, 0, 4]), [2, 1, 0b0100], "all OFF but Y2, which is safe ON");
}

#[test]
fn a_client_that_leaves_with_a_pending_write_does_not_disturb_others() {
    let controller = Controller::start(settings(), PERIOD);
    controller.order(Do::Freeze);
    let mut leaving = controller.client();
    let frame = leaving.frame(&[5, 0, 0, 0xff, 0]);
    std::io::Write::write_all(&mut leaving.stream, &frame).unwrap();
    thread::sleep(Duration::from_millis(50));
    drop(leaving);
    controller.order(Do::Run);
    let mut client = controller.client();
    client.ask(&[5, 0, 1, 0xff, 0]);
    assert!(controller.bit(BitSpace::Mc, 1), "the write was handed in, and is done");
}
