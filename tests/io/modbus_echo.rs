//! Serial lines whose adapter sends each request back: an echo is never taken for an answer.

use std::time::Duration;

use crate::io::liars::{Lie, PATIENT, Script, TIMEOUT, poll, rtu_client};
use crate::io::line::await_over_a_line;
use rungd_io::device::{Driver, ExchangeExtent, ExchangeFailure};
use rungd_io::modbus_client::settings::ClientSettings as Settings;
use rungd_io::modbus_client::{ModbusClient, RtuLink};

const REMEDY: &str = "the line sends requests back: set `echo = true`";

/// A client whose peer answers every request with the same lie.
async fn line(
    echo: bool,
    timeout: Duration,
    settings: impl FnOnce(&mut Settings),
    lie: fn(&[u8], &[u8]) -> Lie,
) -> ModbusClient<RtuLink> {
    let script = Script::default();
    (0..100).for_each(|_| script.lock().unwrap().push(Box::new(lie)));
    rtu_client(script, echo, timeout, settings).await
}

fn echo_and_answer(request: &[u8], right: &[u8]) -> Lie {
    Lie::Say([request, right].concat())
}

fn echo_alone(request: &[u8], _: &[u8]) -> Lie {
    Lie::Say(request.to_vec())
}

fn answer_alone(_: &[u8], _: &[u8]) -> Lie {
    Lie::None
}

async fn exchange(
    client: &mut ModbusClient<RtuLink>,
    on: i32,
) -> Result<[i32; 2], ExchangeFailure> {
    let mut inputs = [None; 2];
    let done = client.exchange(poll(&[on], &mut inputs)).await?;
    assert_eq!(done, ExchangeExtent::Whole);
    Ok(inputs.map(|input| input.expect("a good exchange reads all")))
}

/// `input 1000..1001`, whose echo looks like an answer: the high byte of 1000 is 3.
fn from_1000(settings: &mut Settings) {
    settings.inputs[0].at = 1000;
    settings.inputs[1].at = 1001;
}

#[test]
fn answers_after_a_configured_echo_are_read() {
    await_over_a_line(async || {
        for settings in [|_: &mut Settings| {}, from_1000] {
            let mut client = line(true, PATIENT, settings, echo_and_answer).await;
            for on in [1, 0, 1] {
                let inputs = exchange(&mut client, on).await.unwrap();
                // The peer's values are 1000 plus the low byte of the address.
                assert!(inputs == [1000, 1001] || inputs == [1232, 1233], "{inputs:?}");
            }
        }
    });
}

#[test]
fn a_configured_echo_does_not_confirm_a_write() {
    await_over_a_line(async || {
        let mut client = line(true, TIMEOUT, |settings| settings.inputs.clear(), echo_alone).await;
        let trouble = exchange(&mut client, 1).await.unwrap_err();
        let words = "writing coil 0 of unit 1: no answer in 400 ms";
        assert!(trouble.reason.starts_with(words), "{trouble}");
    });
}

#[test]
fn a_missing_configured_echo_is_an_error() {
    await_over_a_line(async || {
        let mut client =
            line(true, TIMEOUT, |settings| settings.outputs.clear(), answer_alone).await;
        let trouble = exchange(&mut client, 1).await.unwrap_err();
        let words = "the request did not come back first, as `echo = true` says";
        assert_eq!(trouble.reason, format!("reading input 0..1 of unit 1: {words}"));
    });
}

#[test]
fn an_unconfigured_echo_is_not_an_answer_and_the_error_names_the_key() {
    await_over_a_line(async || {
        for answer in [echo_alone, echo_and_answer] {
            for settings in [|_: &mut Settings| {}, from_1000] {
                let mut client = line(false, TIMEOUT * 8, settings, answer).await;
                let trouble = exchange(&mut client, 1).await.unwrap_err();
                assert!(trouble.reason.starts_with("reading input "), "{trouble}");
                assert!(trouble.reason.ends_with(REMEDY), "{trouble}");
            }
        }
    });
}

#[test]
fn a_write_on_a_line_with_a_detected_echo_is_not_confirmed_by_the_echo() {
    await_over_a_line(async || {
        let mut client = line(false, TIMEOUT, |_| {}, echo_alone).await;
        exchange(&mut client, 1).await.unwrap_err();
        tokio::time::sleep(TIMEOUT * 2).await;
        let trouble = exchange(&mut client, 0).await.unwrap_err();
        assert_eq!(trouble.reason, format!("writing coil 0 of unit 1: {REMEDY}"));
    });
}
