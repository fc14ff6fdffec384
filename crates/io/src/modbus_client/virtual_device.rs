//! A Modbus device in virtual time: its driver, and a peer that answers at once.
//!
//! Called by the rig, for a device whose own side a test describes. The driver plans its requests,
//! joins and splits registers, scales, feeds watchdogs and judges answers as under `rungd run`;
//! frames, sockets and pauses are left out, and its clock is the rig's.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use tokio::time::Instant;

use super::client::ModbusClient;
use super::link::{LinkFailure, PeerLink};
use super::settings::{ClientSettings, LinkSettings};
use crate::device::{Driver, Exchange, ExchangeFailure, ExchangeReason};

/// The peer of a device in virtual time.
pub trait RegisterPeer: Send + 'static {
    /// Answers the PDU of a request at a time, ns; the PDU of the answer replaces `answer`.
    fn answer(&mut self, now_ns: u64, request: &[u8], answer: &mut Vec<u8>);
}

/// A device in virtual time.
pub struct VirtualDevice<P> {
    client: ModbusClient<VirtualLink<P>>,
}

/// The link to a peer that answers at once.
struct VirtualLink<P> {
    peer: P,
    /// The moment of virtual time 0.
    begun: Instant,
    now_ns: u64,
    is_rtu: bool,
}

impl<P: RegisterPeer> VirtualDevice<P> {
    /// A device that is connected and has not exchanged yet.
    pub fn new(settings: &ClientSettings, peer: P) -> VirtualDevice<P> {
        let is_rtu = matches!(settings.link, LinkSettings::Rtu(_));
        let link = VirtualLink { peer, begun: Instant::now(), now_ns: 0, is_rtu };
        VirtualDevice { client: ModbusClient::new(settings, link) }
    }

    /// The peer, to be changed.
    pub fn peer(&mut self) -> &mut P {
        &mut self.client.link_mut().peer
    }

    /// The peer as it is.
    pub fn peer_now(&self) -> &P {
        &self.client.link().peer
    }

    /// Connects anew: the next exchange writes all outputs.
    pub fn connect(&mut self, now_ns: u64) {
        self.client.link_mut().now_ns = now_ns;
        let _ = at_once(self.client.connect());
    }

    /// Exchanges once at a time, ns. `outputs` and `inputs` have one value per point, in the order
    /// of the map.
    ///
    /// # Errors
    /// The driver's failure; if it is not disconnected, the inputs that were read are valid.
    pub fn exchange(
        &mut self,
        now_ns: u64,
        occasion: ExchangeReason,
        outputs: &[i32],
        inputs: &mut [Option<i32>],
    ) -> Result<(), ExchangeFailure> {
        self.client.link_mut().now_ns = now_ns;
        let exchange = Exchange { occasion, outputs, inputs, is_urgent: &|| false };
        at_once(self.client.exchange(exchange)).map(|_| ())
    }
}

/// The result of a future that never waits.
fn at_once<T>(
    future: impl Future<Output = Result<T, ExchangeFailure>>,
) -> Result<T, ExchangeFailure> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(done) => done,
        Poll::Pending => Err(ExchangeFailure::disconnected("the peer did not answer at once")),
    }
}

impl<P: RegisterPeer> PeerLink for VirtualLink<P> {
    const STARTS_ANEW: bool = false;

    fn now(&self) -> Instant {
        self.begun + Duration::from_nanos(self.now_ns)
    }

    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        Ok(())
    }

    async fn ask(
        &mut self,
        _unit: u8,
        request: &[u8],
        answer: &mut Vec<u8>,
    ) -> Result<(), LinkFailure> {
        self.peer.answer(self.now_ns, request, answer);
        Ok(())
    }

    fn is_broadcast(&self, unit: u8) -> bool {
        self.is_rtu && unit == 0
    }

    async fn broadcast(&mut self, request: &[u8]) -> Result<(), LinkFailure> {
        let mut unread = Vec::new();
        self.peer.answer(self.now_ns, request, &mut unread);
        Ok(())
    }

    fn is_usable(&self) -> bool {
        true
    }

    fn close(&mut self) {}
}
