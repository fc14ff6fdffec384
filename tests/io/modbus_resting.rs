//! A silent unit of a Modbus device rests between requests: an exchange that asks nothing of it
//! counts no failure. In virtual time, with a link that is scripted.

use std::time::Duration;

use crate::io::liars::{client, poll};
use rungd_io::device::{Driver, Exchange, ExchangeFailure, ExchangeReason};
use rungd_io::modbus_client::settings::{LinkSettings as Way, ModbusPoint, RtuLine, RtuPort};
use rungd_io::modbus_client::{LinkFailure, ModbusClient, PeerLink};
use tokio::time::advance;

/// A line on which unit 1 is silent, and unit 2 has the right answers.
#[derive(Default)]
struct HalfSilent;

impl PeerLink for HalfSilent {
    const STARTS_ANEW: bool = true;

    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        Ok(())
    }

    async fn ask(
        &mut self,
        unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> Result<(), LinkFailure> {
        if unit == 1 {
            return Err(LinkFailure::Silent("no answer".to_owned()));
        }
        *answer = crate::io::liars::right(request);
        Ok(())
    }

    fn is_broadcast(&self, _: u8) -> bool {
        false
    }

    async fn broadcast(&mut self, _: &[u8]) -> Result<(), LinkFailure> {
        Ok(())
    }

    fn is_usable(&self) -> bool {
        true
    }

    fn close(&mut self) {}
}

/// A device of unit 1, and of unit 2 if `both`.
fn device(both: bool) -> ModbusClient<HalfSilent> {
    let peer = crate::io::liars::peer("127.0.0.1:1".parse().unwrap());
    let mut settings = client(Way::Rtu(RtuLine { port: RtuPort::Tcp(peer), echo: false }));
    if both {
        settings.inputs[1] = ModbusPoint { unit: 2, ..settings.inputs[1] };
    }
    ModbusClient::new(&settings, HalfSilent)
}

#[tokio::test(start_paused = true)]
async fn an_exchange_that_skips_a_resting_unit_counts_no_failure() {
    for both in [false, true] {
        let mut client = device(both);
        let mut inputs = [None; 2];
        let mut fresh = Vec::new();
        for _ in 0..1000 {
            let trouble = client.exchange(poll(&[1], &mut inputs)).await.unwrap_err();
            assert!(trouble.reason.starts_with("writing coil 0 of unit 1: no answer"), "{trouble}");
            fresh.push(!trouble.is_repeated);
            let change = Exchange { occasion: ExchangeReason::Change, ..poll(&[0], &mut []) };
            let trouble = client.exchange(change).await.unwrap_err();
            assert!(trouble.is_repeated, "a change asks nothing of a unit in trouble");
            advance(Duration::from_millis(20)).await;
        }
        assert!(fresh[0], "the first was asked");
        // In 20 s: pauses that grow from the timeout to 5 s.
        let asked = fresh.iter().filter(|fresh| **fresh).count();
        assert!((5..=20).contains(&asked), "{asked} requests");
    }
}
