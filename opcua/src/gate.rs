//! The gate before the server: what somebody whom nobody knows may take of this machine.
//!
//! The library keeps a frame of any announced length, opens sessions without encryption, and takes
//! any number of connections. So it listens at a port of this machine's loopback alone, and the
//! gate carries the bytes of each connection there: as long as `frames` finds nothing wrong, and
//! while a seat is free. A stranger has one of a few seats, for a short time; when all are taken,
//! the oldest stranger leaves, of the address with the most. A peer is known when the server has
//! opened a channel for a certificate that a person trusts: its answer names that, and the library
//! has then seen that the peer has the key. (It asks for trust itself only when a session begins.)
//! Of a known peer too only so many requests are carried as `under_way` allows.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rungd_base::locked::locked;
use rungd_io::seats::{ANY_GUEST, SeatClient, SeatSettings, Seats, TakenSeat};
use rustix::net::sockopt;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use tokio::time::sleep;

use crate::certificates::is_trusted;
use crate::frames::{ClientRules, FrameKind, FrameRefusal, FrameScanner, FrameStart};
use crate::journal::{ClientLine, ServerLines};
use crate::under_way::RequestsUnderWay;

/// The most strangers at a time.
const STRANGERS_MAX: usize = 100;
/// The longest stay of a stranger.
const STRANGER_MAX: Duration = Duration::from_secs(30);
/// The connections of known peers beyond one for each session.
const SPARE: usize = 10;
/// A peer that says nothing is asked by its system after each of these times whether it is there.
const GONE_ASK: Duration = Duration::from_secs(30);
/// The longest time without an answer of a peer's system. Then its connection ends.
const GONE_MAX: Duration = Duration::from_secs(120);
/// How much is carried at a time, bytes. A piece of a client has few requests.
const PIECE: usize = 16_384;
const CLIENT_PIECE: usize = 4096;

/// The gate.
pub struct ClientGate {
    /// Where the server listens.
    inner: SocketAddr,
    /// Whether sessions without encryption are possible.
    insecure: bool,
    /// The folder of certificates.
    certificates: PathBuf,
    strangers: Seats,
    known: Seats,
    lines: ServerLines,
}

/// What a gate lets in.
#[derive(Clone, Debug)]
pub struct GateTerms {
    /// Where the server listens.
    pub inner: SocketAddr,
    /// Whether sessions without encryption are possible.
    pub insecure: bool,
    /// The folder of certificates.
    pub certificates: PathBuf,
    /// The most sessions.
    pub sessions: usize,
}

/// Where the server listens: for the gate alone.
pub fn inner_address() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::LOCALHOST, 0))
}

impl ClientGate {
    /// A gate with all seats free.
    pub fn new(terms: GateTerms, lines: ServerLines) -> ClientGate {
        let seats = |count_max: usize| {
            Seats::new(SeatSettings {
                count_max,
                reserved: 0,
                idle_max: STRANGER_MAX,
                wait_max: Duration::ZERO,
                rest: Duration::from_millis(100),
            })
        };
        let GateTerms { inner, insecure, certificates, sessions } = terms;
        let (strangers, known) = (seats(STRANGERS_MAX), seats(sessions + SPARE));
        ClientGate { inner, insecure, certificates, strangers, known, lines }
    }

    /// Lets clients in, as long as it is polled.
    pub async fn serve(self: Arc<ClientGate>, listener: TcpListener) {
        loop {
            let Ok((client, address)) = listener.accept().await else {
                self.strangers.make_room().await;
                continue;
            };
            let Some(seat) = self.strangers.take(guest(address.ip())) else { continue };
            let gate = Arc::clone(&self);
            tokio::spawn(async move { gate.converse(client, address, seat).await });
        }
    }

    /// Carries a connection until it ends.
    async fn converse(&self, client: TcpStream, address: SocketAddr, seat: Arc<TakenSeat>) {
        let Ok(server) = TcpStream::connect(self.inner).await else { return };
        let _ = (client.set_nodelay(true), server.set_nodelay(true), end_if_gone(&client));
        let opened = Notify::new();
        let carried = carry(client, server, self, &opened);
        tokio::pin!(carried);
        let ended = tokio::select! {
            ended = &mut carried => Some(ended),
            () = seat.asked_to_leave() => return,
            () = sleep(STRANGER_MAX) => return,
            () = opened.notified() => None,
        };
        drop(seat);
        let ended = match ended {
            Some(ended) => ended,
            None => {
                let Some(seat) = self.known.take(ANY_GUEST) else {
                    return self.tell(address, "all seats of known clients are taken");
                };
                seat.set_busy(true);
                carried.await
            }
        };
        if let Err(refusal) = ended {
            self.tell(address, &refusal.to_string());
        }
    }

    fn tell(&self, address: SocketAddr, why: &str) {
        let line = format!("closed the connection of {address}: {why}");
        self.lines.say(ClientLine::Closed, &line);
    }
}

/// Has the system end a connection whose other end is gone without a word: otherwise a peer that
/// was switched off, or a line that was cut, would keep its seat.
///
/// # Errors
/// The system refuses.
fn end_if_gone(client: &TcpStream) -> rustix::io::Result<()> {
    sockopt::set_socket_keepalive(client, true)?;
    sockopt::set_tcp_keepidle(client, GONE_ASK)?;
    sockopt::set_tcp_keepintvl(client, GONE_ASK)?;
    // With data that nobody confirms, this time counts; it also ends the questions.
    let gone_ms = u32::try_from(GONE_MAX.as_millis()).unwrap_or(u32::MAX);
    sockopt::set_tcp_user_timeout(client, gone_ms)
}

/// The address as a user of seats: of IPv6 its network, in which a host has addresses at will.
fn guest(ip: IpAddr) -> SeatClient {
    // A server that listens at `[::]` sees IPv4 addresses in the form of IPv6.
    let user = match ip.to_canonical() {
        IpAddr::V4(ip) => ip.to_bits(),
        IpAddr::V6(ip) => {
            let network = ip.to_bits() >> 64;
            (network ^ (network >> 32)) as u32
        }
    };
    SeatClient { user, ..ANY_GUEST }
}

/// Carries the bytes of both directions until one of them ends. `opened` is told when the server
/// has opened a channel for somebody who may have a session.
async fn carry(
    client: TcpStream,
    server: TcpStream,
    gate: &ClientGate,
    opened: &Notify,
) -> Result<(), FrameRefusal> {
    let (from_client, to_client) = client.into_split();
    let (from_server, to_server) = server.into_split();
    let rules = Mutex::new(ClientRules::new(gate.insecure));
    let under_way = RequestsUnderWay::default();
    let asks = |frame: FrameStart<'_>| {
        under_way.ask(frame);
        locked(&rules).judge(frame)
    };
    let answers = |frame: FrameStart<'_>| {
        under_way.answer(frame);
        let trusts = |thumbprint: &[u8]| is_trusted(&gate.certificates, thumbprint);
        if frame.kind == FrameKind::Open && locked(&rules).opened(frame.body, trusts)? {
            opened.notify_one();
        }
        Ok(())
    };
    tokio::select! {
        ended = pipe(from_client, to_server, asks, Some(&under_way)) => ended,
        ended = pipe(from_server, to_client, answers, None) => ended,
    }
}

/// Carries one direction until it ends; that of a client while there is room for its requests.
async fn pipe(
    mut from: impl AsyncRead + Unpin,
    mut to: impl AsyncWrite + Unpin,
    mut judge: impl FnMut(FrameStart<'_>) -> Result<(), FrameRefusal>,
    under_way: Option<&RequestsUnderWay>,
) -> Result<(), FrameRefusal> {
    let length = if under_way.is_some() { CLIENT_PIECE } else { PIECE };
    let (mut piece, mut scanner) = (vec![0; length], FrameScanner::default());
    loop {
        if let Some(under_way) = under_way {
            under_way.room().await;
        }
        let Ok(count @ 1..) = from.read(&mut piece).await else { return Ok(()) };
        scanner.take(&piece[..count], &mut judge)?;
        if to.write_all(&piece[..count]).await.is_err() {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    use tokio::io::ReadBuf;

    use super::*;
    use crate::under_way::UNDER_WAY_MAX;

    #[tokio::test]
    async fn a_connection_whose_other_end_is_gone_ends_after_two_minutes() {
        let listener = TcpListener::bind(inner_address()).await.expect("a port");
        let address = listener.local_addr().expect("its address");
        let (client, accepted) = tokio::join!(TcpStream::connect(address), listener.accept());
        let (_client, accepted) = (client.expect("a client"), accepted.expect("a connection").0);
        end_if_gone(&accepted).expect("the system takes the times");
        assert!(sockopt::socket_keepalive(&accepted).expect("an option"));
        // What the documentation says: asked after each 30 s of silence, gone after two minutes.
        let second = Duration::from_secs(1);
        assert_eq!(sockopt::tcp_keepidle(&accepted).expect("an option"), 30 * second);
        assert_eq!(sockopt::tcp_keepintvl(&accepted).expect("an option"), 30 * second);
        assert_eq!(sockopt::tcp_user_timeout(&accepted).expect("an option"), 120_000);
    }

    /// The end of a connection that the system has given up.
    struct GivenUp;

    impl AsyncRead for GivenUp {
        fn poll_read(
            self: Pin<&mut GivenUp>,
            _: &mut Context<'_>,
            _: &mut ReadBuf<'_>,
        ) -> Poll<std::io::Result<()>> {
            Poll::Ready(Err(std::io::ErrorKind::TimedOut.into()))
        }
    }

    #[tokio::test]
    async fn a_connection_that_the_system_gives_up_gives_its_place_back() {
        let gave_up = pipe(GivenUp, tokio::io::sink(), |_| Ok(()), None).await;
        assert_eq!(gave_up, Ok(()), "it ends without a line: nobody did anything wrong");
    }

    #[test]
    fn a_client_that_asks_and_reads_no_answer_waits() {
        let request = [&b"MSGF"[..], &128_u32.to_le_bytes(), &[0; 120]].concat();
        let (all, under_way) = (request.repeat(10_000), RequestsUnderWay::default());
        let (mut carried, mut context) = (Vec::new(), Context::from_waker(Waker::noop()));
        let asks = |frame: FrameStart<'_>| {
            under_way.ask(frame);
            Ok(())
        };
        let mut first = Box::pin(pipe(&all[..], &mut carried, asks, Some(&under_way)));
        assert!(first.as_mut().poll(&mut context).is_pending());
        drop(first);
        let most = UNDER_WAY_MAX * request.len() + CLIENT_PIECE;
        assert!((1..=most).contains(&carried.len()), "{}", carried.len());
        // Each answer makes room, and all come through if all are answered.
        let (sent, answer) = (carried.len(), [&b"MSGF"[..], &24_u32.to_le_bytes(), &[0; 16]]);
        let answers = answer.concat().repeat(10_000);
        let mut scanner = FrameScanner::default();
        let answered = scanner.take(&answers, |frame| {
            under_way.answer(frame);
            Ok(())
        });
        assert_eq!(answered, Ok(()));
        let rest = &all[sent..][..CLIENT_PIECE];
        let mut second = Box::pin(pipe(rest, &mut carried, asks, Some(&under_way)));
        assert_eq!(second.as_mut().poll(&mut context), Poll::Ready(Ok(())));
        drop(second);
        assert_eq!(carried.len(), sent + CLIENT_PIECE);
    }

    #[test]
    fn each_address_has_places_of_its_own_and_an_ipv6_network_those_of_one() {
        let user = |text: &str| guest(text.parse().expect("an address")).user;
        assert_eq!(user("10.0.0.5"), user("::ffff:10.0.0.5"));
        assert_ne!(user("::ffff:10.0.0.5"), user("::ffff:10.0.0.6"));
        assert_eq!(user("2001:db8:1:2::1"), user("2001:db8:1:2:ffff::9"));
        assert_ne!(user("2001:db8:1:2::1"), user("2001:db8:1:3::1"));
    }
}
