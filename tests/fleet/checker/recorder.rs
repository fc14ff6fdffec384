//! A small broker that keeps all packets of its client, on a port that the system chooses. It
//! serves one client at a time, and delivers messages for the test.

use std::io::Result;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::packets::{self, Packet};
use super::story::{Connection, Published, Step};
use rungd_test_support::patience::PATIENCE;

/// The broker.
pub struct Recorder {
    /// `mqtt://127.0.0.1:PORT`.
    pub url: String,
    kept: Arc<Kept>,
}

#[derive(Default)]
struct Kept {
    book: Mutex<Book>,
    news: Condvar,
}

#[derive(Default)]
struct Book {
    connections: Vec<Connection>,
    /// The client of the last connection, with its version.
    client: Option<(TcpStream, u8)>,
    /// The number of delivered messages; `acknowledged` counts those that clients have
    /// acknowledged.
    delivered: u16,
    acknowledged: u16,
    /// A delivered message until its acknowledgement, with the number of its connection. What the
    /// client sends before that may not know the message yet.
    under_way: Option<(usize, Published)>,
}

/// This machine's clock, ms since 1970.
pub fn now_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_millis() as u64
}

impl Recorder {
    pub fn start() -> Recorder {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("mqtt://{}", listener.local_addr().unwrap());
        let kept = Arc::new(Kept::default());
        let own = Arc::clone(&kept);
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let own = Arc::clone(&own);
                thread::spawn(move || drop(own.serve(stream)));
            }
        });
        Recorder { url, kept }
    }

    /// Delivers a message to the client, and waits for its acknowledgement. In the story the client
    /// has the message from then on.
    pub fn deliver(&self, topic: &str, payload: Vec<u8>) {
        let (topic, at_ms) = (topic.to_owned(), now_ms());
        let message = Published { topic, payload, qos: 1, retain: false, at_ms };
        let mut book = self.kept.book();
        let (stream, version) = book.client.as_ref().expect("a client");
        let (mut stream, version) = (stream.try_clone().unwrap(), *version);
        book.delivered += 1;
        packets::deliver(&mut stream, version, book.delivered, &message).unwrap();
        book.under_way = Some((book.connections.len() - 1, message));
        let due = book.delivered;
        drop(book);
        self.wait("an acknowledgement", |book| book.acknowledged >= due);
    }

    /// Closes the client's connection without a DISCONNECT.
    pub fn cut(&self) {
        if let Some((stream, _)) = self.kept.book().client.take() {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// The connections so far.
    pub fn connections(&self) -> Vec<Connection> {
        self.kept.book().connections.clone()
    }

    /// Waits until the connections fit.
    pub fn until(&self, what: &str, fits: impl Fn(&[Connection]) -> bool) {
        self.wait(what, |book| fits(&book.connections));
    }

    fn wait(&self, what: &str, fits: impl Fn(&Book) -> bool) {
        let end = Instant::now() + PATIENCE;
        let mut book = self.kept.book();
        while !fits(&book) {
            let left = end.saturating_duration_since(Instant::now());
            assert!(!left.is_zero(), "{what} did not come: {:#?}", book.connections);
            book = self.kept.news.wait_timeout(book, left).unwrap().0;
        }
    }
}

impl Kept {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap()
    }

    /// Keeps a step of a connection.
    fn step(&self, at: usize, step: Step) {
        self.book().connections[at].steps.push(step);
        self.news.notify_all();
    }

    /// Serves a client until its end.
    fn serve(&self, mut stream: TcpStream) -> Result<()> {
        let Some(Packet::Connect(connect)) = packets::read(&mut stream, 0, now_ms())? else {
            return Ok(());
        };
        let version = connect.version;
        let at = {
            let mut book = self.book();
            packets::welcome(&mut stream, version)?;
            book.client = Some((stream.try_clone()?, version));
            book.connections.push(Connection { connect, steps: Vec::new() });
            book.connections.len() - 1
        };
        self.news.notify_all();
        while let Some(packet) = packets::read(&mut stream, version, now_ms())? {
            match packet {
                Packet::Connect(_) => return Ok(()),
                Packet::Publish(message, number) => {
                    self.step(at, Step::Sent(message));
                    // Under the lock: a delivery may be written at the same time.
                    let _book = self.book();
                    number.map_or(Ok(()), |number| packets::acknowledge(&mut stream, number))?;
                }
                Packet::Subscribe(number, filters) => {
                    let _book = self.book();
                    packets::accept(&mut stream, version, number, &filters)?;
                    drop(_book);
                    self.step(at, Step::Subscribed(filters));
                }
                Packet::Acknowledged => {
                    let mut book = self.book();
                    book.acknowledged += 1;
                    if let Some((to, message)) = book.under_way.take() {
                        book.connections[to].steps.push(Step::Got(message));
                    }
                    drop(book);
                    self.news.notify_all();
                }
                Packet::Ping => {
                    let _book = self.book();
                    packets::pong(&mut stream)?;
                }
                Packet::Disconnect(reason) => {
                    self.step(at, Step::Disconnected(reason));
                    // A broker closes the connection; without this, `client` would keep the stream
                    // open.
                    let _ = stream.shutdown(Shutdown::Both);
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}
