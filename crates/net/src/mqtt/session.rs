//! A session with a broker: the interface for callers of this module.
//!
//! Every call moves bytes in both directions as far as possible without waiting, and checks the
//! times (`pulse`). The session keeps all state, so any call may be dropped while it waits. A
//! caller calls `next` whenever it has nothing else to do: the session sends pings and checks times
//! only during a call.

use std::collections::VecDeque;
use std::future::{Future as _, poll_fn};
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead as _, AsyncReadExt as _, AsyncWrite as _, AsyncWriteExt as _, ReadBuf};
use tokio::time::{Instant, Sleep, sleep_until, timeout};

use super::connect::{BrokerSocket, open};
use super::failure::{LinkSilence, MqttCause, MqttFailure};
use super::packets::OutMessage;
use super::pulse::{KeepAliveTimes, KeepAliveVerdict};
use super::settings::{BrokerAddress, BrokerSettings, LastWill, Qos};
use super::wire::{BrokerPacket, MqttEvent, SessionProtocol};

/// The maximum number of bytes of a read.
const READ_BYTES: usize = 16 * 1024;

/// The bytes that may come before the answer to a subscription: a broker sends retained messages
/// first.
const FLOOD_BYTES_MAX: usize = 16 << 20;

/// A session with a broker. It ends when this value is dropped; the broker then publishes the last
/// will, unless [`MqttSession::disconnect`] was called.
pub struct MqttSession {
    broker: BrokerAddress,
    settings: BrokerSettings,
    socket: Box<dyn BrokerSocket>,
    wire: SessionProtocol,
    pulse: KeepAliveTimes,
    /// The received events that the caller has not taken yet.
    heard: VecDeque<BrokerPacket>,
    heard_bytes: usize,
    /// Whether bytes were written since the socket was flushed.
    flushing: bool,
    /// The queued bytes up to the end of the oldest ping that has not been sent; `None`: all were
    /// sent.
    before_question: Option<usize>,
    /// Wakes the caller when something is due.
    alarm: Pin<Box<Sleep>>,
    failed: Option<MqttCause>,
}

impl MqttSession {
    /// Begins a session: TCP, TLS if the address requires it, CONNECT with a clean session. The
    /// whole takes at most `answer_max`.
    ///
    /// # Errors
    /// No session could begin. A broker may refuse a session that it accepts a moment later.
    pub async fn connect(
        settings: &BrokerSettings,
        address: &BrokerAddress,
        will: Option<&LastWill>,
    ) -> Result<MqttSession, MqttFailure> {
        let begun = async {
            let socket = open(settings, address).await?;
            MqttSession::begin(socket, settings, address, will).await
        };
        let begun = timeout(settings.answer_max, begun).await;
        let begun = begun.unwrap_or(Err(MqttCause::Late(settings.answer_max)));
        begun.map_err(|cause| MqttFailure { broker: address.clone(), cause })
    }

    /// Begins a session on an open socket. Waits for the broker without a time limit.
    pub(super) async fn begin(
        socket: Box<dyn BrokerSocket>,
        settings: &BrokerSettings,
        address: &BrokerAddress,
        will: Option<&LastWill>,
    ) -> Result<MqttSession, MqttCause> {
        if settings.keepalive.is_zero() {
            return Err(MqttCause::Settings("`keepalive` is zero: at least a second is sensible"));
        }
        let now = Instant::now();
        let mut session = MqttSession {
            broker: address.clone(),
            settings: settings.clone(),
            socket,
            wire: SessionProtocol::new(settings, will)?,
            pulse: KeepAliveTimes::new(settings.keepalive, now),
            heard: VecDeque::new(),
            heard_bytes: 0,
            flushing: false,
            before_question: None,
            alarm: Box::pin(sleep_until(now)),
            failed: None,
        };
        poll_fn(|cx| session.poll_welcome(cx)).await?;
        Ok(session)
    }

    /// The broker of this session.
    pub fn broker(&self) -> &BrokerAddress {
        &self.broker
    }

    /// Queues a message. Waits while too much is queued, or while too many messages of QoS 1 have
    /// no acknowledgement. With QoS 1, returns the number of the later [`MqttEvent::Acknowledged`].
    /// If the call is dropped while it waits, nothing is sent.
    ///
    /// # Errors
    /// The message cannot be sent, or the session is at its end.
    pub async fn publish(
        &mut self,
        topic: &str,
        payload: &[u8],
        qos: Qos,
        retain: bool,
    ) -> Result<Option<u16>, MqttFailure> {
        let message = OutMessage { topic, payload, qos, retain };
        let limit = self.settings.answer_max + self.settings.keepalive;
        let room = timeout(limit, poll_fn(|cx| self.poll_room(cx, &message))).await;
        let number = match room {
            Ok(Ok(())) => self.wire.publish(&message),
            Ok(Err(cause)) => Err(cause),
            Err(_) if self.wire.has_place() || qos == Qos::AtMostOnce => {
                self.fail(MqttCause::Silent(LinkSilence::NoRoom, limit))
            }
            Err(_) => self.fail(MqttCause::Silent(LinkSilence::NoAcknowledgement, limit)),
        };
        self.queued(number).await
    }

    /// Subscribes to filters, and waits for the broker's answer. Messages that come before the
    /// answer are kept for [`MqttSession::next`].
    ///
    /// # Errors
    /// A filter is refused, there is no answer, or the session is at its end.
    pub async fn subscribe(&mut self, filters: &[(&str, Qos)]) -> Result<(), MqttFailure> {
        self.alive()?;
        let number = self.wire.subscribe(filters);
        let number = self.queued(number).await?;
        let limit = self.settings.answer_max;
        let answer = timeout(limit, poll_fn(|cx| self.poll_subscribed(cx, number))).await;
        let answer = answer
            .unwrap_or_else(|_| self.fail(MqttCause::Silent(LinkSilence::NoSubscription, limit)));
        answer.map_err(|cause| self.failure(cause))
    }

    /// Sends a ping and returns its number. The [`MqttEvent::Pong`] with this number shows that the
    /// broker has read everything that was sent before.
    ///
    /// # Errors
    /// The session is at its end.
    pub async fn ping(&mut self) -> Result<u64, MqttFailure> {
        self.alive()?;
        let number = self.ask();
        self.queued(number).await
    }

    /// The next event from the broker. The call may be dropped while it waits: nothing is lost.
    ///
    /// # Errors
    /// The session is at its end. Earlier events are returned first.
    pub async fn next(&mut self) -> Result<MqttEvent, MqttFailure> {
        let event = poll_fn(|cx| self.poll_next(cx)).await;
        event.map_err(|cause| self.failure(cause))
    }

    /// Ends the session in order: the broker does not publish the last will. Waits until the broker
    /// has closed the connection: it has then read everything.
    ///
    /// # Errors
    /// The broker has not closed the connection within `answer_max`: it may publish the will.
    pub async fn disconnect(self) -> Result<(), MqttFailure> {
        self.end_in_order(false).await
    }

    /// Like [`MqttSession::disconnect`], but with MQTT 5 the broker publishes the last will:
    /// Sparkplug 3.0 requires this of edge nodes.
    ///
    /// # Errors
    /// The broker has not closed the connection within `answer_max`.
    pub async fn disconnect_with_will(self) -> Result<(), MqttFailure> {
        self.end_in_order(true).await
    }

    async fn end_in_order(mut self, with_will: bool) -> Result<(), MqttFailure> {
        self.alive()?;
        let broker = self.broker.clone();
        let limit = self.settings.answer_max;
        let ended = timeout(limit, self.end(with_will)).await;
        let ended = ended.unwrap_or(Err(MqttCause::Silent(LinkSilence::NoProgress, limit)));
        ended.map_err(|cause| MqttFailure { broker, cause })
    }

    async fn end(&mut self, with_will: bool) -> Result<(), MqttCause> {
        self.wire.disconnect(with_will)?;
        let broken = |error| MqttCause::of_socket(&error);
        let rest: Vec<u8> = self.wire.out().drain(..).collect();
        self.socket.write_all(&rest).await.map_err(broken)?;
        // The broker may have closed the connection by now.
        let _ = self.socket.shutdown().await;
        let mut unread = vec![0; READ_BYTES];
        // A broker that resets the connection has ended it as well.
        while self.socket.read(&mut unread).await.is_ok_and(|count| count > 0) {}
        Ok(())
    }

    /// Sends the queued bytes, as far as possible without waiting.
    async fn queued<T>(&mut self, number: Result<T, MqttCause>) -> Result<T, MqttFailure> {
        let number = number.map_err(|cause| self.failure(cause))?;
        self.pulse.sent(Instant::now());
        let moved = poll_fn(|cx| Poll::Ready(self.write(cx))).await;
        moved.map_err(|cause| self.failure(cause))?;
        Ok(number)
    }

    fn ask(&mut self) -> Result<u64, MqttCause> {
        let number = self.wire.ping()?;
        self.pulse.questioned(Instant::now());
        self.before_question.get_or_insert(self.wire.out().len());
        Ok(number)
    }

    fn alive(&self) -> Result<(), MqttFailure> {
        match &self.failed {
            Some(cause) => Err(self.failure(cause.clone())),
            None => Ok(()),
        }
    }

    fn failure(&self, cause: MqttCause) -> MqttFailure {
        MqttFailure { broker: self.broker.clone(), cause }
    }

    /// Ends the session with this cause.
    fn fail<T>(&mut self, cause: MqttCause) -> Result<T, MqttCause> {
        let cause = match (cause, self.wire.too_long()) {
            (MqttCause::Silent(what, longest), Some(message)) => {
                MqttCause::Blocked(message, what, longest)
            }
            (cause, _) => cause,
        };
        self.failed = Some(cause.clone());
        Err(cause)
    }
}

/// The steps of the calls above. Each is called again whenever the socket or the alarm wakes it.
impl MqttSession {
    fn poll_welcome(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), MqttCause>> {
        loop {
            if let Some(BrokerPacket::Welcome(keepalive)) = self.heard.front() {
                if let Some(keepalive) = keepalive {
                    self.pulse.shorten(*keepalive);
                }
                self.take();
                return Poll::Ready(Ok(()));
            }
            self.write(cx)?;
            ready!(self.read(cx))?;
        }
    }

    fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<Result<MqttEvent, MqttCause>> {
        loop {
            while let Some(heard) = self.take() {
                if let BrokerPacket::Event(event) = heard {
                    return Poll::Ready(Ok(event));
                }
            }
            let moved = ready!(self.step(cx, self.settings.queue_bytes_max));
            // Events before a failure are returned first.
            if self.heard.is_empty() {
                moved?;
            }
        }
    }

    fn poll_subscribed(&mut self, cx: &mut Context<'_>, asked: u16) -> Poll<Result<(), MqttCause>> {
        loop {
            if self.heard.contains(&BrokerPacket::Subscribed(asked)) {
                return Poll::Ready(Ok(()));
            }
            ready!(self.step(cx, self.settings.queue_bytes_max.max(FLOOD_BYTES_MAX)))?;
        }
    }

    fn poll_room(
        &mut self,
        cx: &mut Context<'_>,
        message: &OutMessage<'_>,
    ) -> Poll<Result<(), MqttCause>> {
        loop {
            let moved = self.step(cx, self.settings.queue_bytes_max)?;
            let queued = self.wire.out().len();
            let more = message.payload.len() + message.topic.len();
            let has_room = queued == 0 || queued + more <= self.settings.queue_bytes_max;
            if has_room && (message.qos == Qos::AtMostOnce || self.wire.has_place()) {
                return Poll::Ready(Ok(()));
            }
            ready!(moved);
        }
    }

    /// Moves bytes once in each direction, and checks the times. Ready when bytes came. Reads
    /// nothing while `limit` bytes wait for the caller.
    fn step(&mut self, cx: &mut Context<'_>, limit: usize) -> Poll<Result<(), MqttCause>> {
        if let Some(cause) = &self.failed {
            return Poll::Ready(Err(cause.clone()));
        }
        self.write(cx)?;
        // The answers to a broker that does not read them have a limit too.
        let answers = self.wire.out().len();
        let reading = self.heard_bytes < limit && answers <= self.settings.queue_bytes_max;
        if reading && self.read(cx)?.is_ready() {
            return Poll::Ready(Ok(()));
        }
        loop {
            let now = Instant::now();
            let waiting = !self.wire.out().is_empty();
            match self.pulse.judge(waiting, reading, now) {
                KeepAliveVerdict::Well => {}
                KeepAliveVerdict::Silent(silence) => {
                    let longest = self.pulse.keepalive();
                    return Poll::Ready(self.fail(MqttCause::Silent(silence, longest)));
                }
                KeepAliveVerdict::Ask => {
                    self.ask()?;
                    self.write(cx)?;
                }
            }
            let waiting = !self.wire.out().is_empty();
            self.alarm.as_mut().reset(self.pulse.next(waiting, reading));
            ready!(self.alarm.as_mut().poll(cx));
        }
    }

    /// Writes as many bytes as the socket takes.
    fn write(&mut self, cx: &mut Context<'_>) -> Result<(), MqttCause> {
        if self.wire.out().is_empty() && !self.flushing {
            self.pulse.taken(Instant::now());
            return Ok(());
        }
        while !self.wire.out().is_empty() {
            let bytes = self.wire.out().as_slices().0;
            let Poll::Ready(written) = Pin::new(&mut self.socket).poll_write(cx, bytes) else {
                break;
            };
            match written {
                Ok(0) => return self.fail(MqttCause::Closed),
                Ok(count) => self.written(count),
                Err(error) => return self.fail(MqttCause::of_socket(&error)),
            }
        }
        if let Poll::Ready(flushed) = Pin::new(&mut self.socket).poll_flush(cx) {
            if let Err(error) = flushed {
                return self.fail(MqttCause::of_socket(&error));
            }
            self.flushing = false;
        }
        Ok(())
    }

    fn written(&mut self, count: usize) {
        let now = Instant::now();
        self.wire.out().drain(..count);
        self.flushing = true;
        self.pulse.taken(now);
        if let Some(before) = self.before_question {
            self.before_question = before.checked_sub(count).filter(|left| *left > 0);
            if self.before_question.is_none() {
                self.pulse.asked(now);
            }
        }
    }

    /// Reads once. Ready when bytes came.
    fn read(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), MqttCause>> {
        let mut bytes = [0; READ_BYTES];
        let mut buffer = ReadBuf::new(&mut bytes);
        let read = ready!(Pin::new(&mut self.socket).poll_read(cx, &mut buffer));
        if let Err(error) = read {
            return Poll::Ready(self.fail(MqttCause::of_socket(&error)));
        }
        if buffer.filled().is_empty() {
            return Poll::Ready(self.fail(MqttCause::Closed));
        }
        let now = Instant::now();
        self.pulse.heard(now);
        let (before, unanswered) = (self.heard.len(), self.wire.unanswered());
        let received = self.wire.receive(buffer.filled(), &mut self.heard);
        self.heard_bytes += self.heard.iter().skip(before).map(BrokerPacket::bytes).sum::<usize>();
        if self.wire.unanswered() < unanswered {
            let more = self.wire.unanswered() > 0;
            self.pulse.answered(more, self.before_question.is_none(), now);
        }
        Poll::Ready(match received {
            Ok(()) => Ok(()),
            Err(cause) => self.fail(cause),
        })
    }

    fn take(&mut self) -> Option<BrokerPacket> {
        let heard = self.heard.pop_front()?;
        self.heard_bytes -= heard.bytes();
        Some(heard)
    }
}
