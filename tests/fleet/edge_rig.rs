//! An edge node with a real controller and a real broker, and a host that listens to it.

use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rungd_net::mqtt::{
    BrokerAddress, BrokerSettings, LastWill, MqttEvent, MqttSession, Qos, TlsFiles,
};
use rungd_net::sparkplug::{
    DataType, HostState, MessageKind, Metric, MetricValue, Payload, Topic, metric_of,
};

use crate::fleet::broker::PATIENCE;
use rungd_test_support::running::live::Live;
use rungd_test_support::system;

/// The name of the host that listens.
const HOST: &str = "judge";

/// A message of a node.
#[derive(Clone, Debug)]
pub struct HeardMessage {
    pub kind: MessageKind,
    pub payload: Payload,
}

/// A value that a node published.
#[derive(Clone, Debug, PartialEq)]
pub struct ToldValue {
    pub name: String,
    pub time_ms: u64,
    pub value: MetricValue,
    pub is_historical: bool,
    /// Whether it was in a birth.
    pub is_born: bool,
}

/// A host application: it listens, and publishes its state as online. It reconnects by itself.
pub struct Host {
    heard: Arc<Mutex<Vec<HeardMessage>>>,
    publish: Sender<(String, Vec<u8>)>,
}

impl Host {
    /// Listens at a broker until this value is dropped.
    pub fn listen(url: &str) -> Host {
        Host::listen_secured(url, None)
    }

    /// Same as [`Host::listen`], with certificates.
    pub fn listen_secured(url: &str, tls: Option<TlsFiles>) -> Host {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let (publish, inbox) = channel();
        let address = BrokerAddress::parse(url).unwrap();
        let mut settings = BrokerSettings::new(vec![address], "judge");
        settings.tls = tls;
        // A paused broker does not end the session.
        settings.keepalive = Duration::from_secs(300);
        let shared = Arc::clone(&heard);
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            runtime.unwrap().block_on(listen(&settings, &shared, &inbox));
        });
        Host { heard, publish }
    }

    /// All messages so far.
    pub fn heard(&self) -> Vec<HeardMessage> {
        self.heard.lock().unwrap().clone()
    }

    /// The number of messages of a kind.
    pub fn count(&self, kind: MessageKind) -> usize {
        self.heard().iter().filter(|of| of.kind == kind).count()
    }

    /// Sends a command to the node.
    pub fn command(&self, metrics: Vec<Metric>) {
        let payload = Payload { timestamp: Some(1), metrics, seq: None };
        self.send("spBv1.0/plant/NCMD/press", payload.bytes());
    }

    /// Publishes bytes.
    pub fn send(&self, topic: &str, payload: Vec<u8>) {
        self.publish.send((topic.to_owned(), payload)).unwrap();
    }

    /// The published values in order of arrival. An alias that no birth defines is a failure.
    pub fn told(&self) -> Vec<ToldValue> {
        let (mut names, mut told) = (HashMap::new(), Vec::new());
        for HeardMessage { kind, payload } in self.heard() {
            let is_born = kind == MessageKind::NodeBirth;
            if is_born {
                let named = payload.metrics.iter();
                let named =
                    named.filter_map(|of| Some((of.alias?, (of.name.clone()?, of.datatype?))));
                names = named.collect::<HashMap<u64, (String, u32)>>();
            }
            for metric in payload.metrics.iter().filter(|_| kind != MessageKind::NodeDeath) {
                let Some((name, datatype)) = metric.alias.and_then(|of| names.get(&of)) else {
                    assert!(metric.name.is_some(), "an alias without a birth: {metric:?}");
                    continue;
                };
                let datatype = DataType::of(*datatype).unwrap();
                let Some(content) = &metric.content else { continue };
                told.push(ToldValue {
                    name: name.clone(),
                    time_ms: metric.timestamp.unwrap(),
                    value: datatype.read(content).unwrap(),
                    is_historical: metric.is_historical == Some(true),
                    is_born,
                });
            }
        }
        told
    }

    /// The integers of a tag by time, without duplicates: present and historical values, but none
    /// of births.
    pub fn integers(&self, name: &str) -> Vec<(u64, i64)> {
        let told = self.told().into_iter().filter(|of| of.name == name && !of.is_born);
        let mut all: Vec<(u64, i64)> = told
            .filter_map(|of| match of.value {
                MetricValue::Signed(value) => Some((of.time_ms, value)),
                _ => None,
            })
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Waits until `is` holds.
    pub fn await_it(&self, what: &str, is: impl Fn(&Host) -> bool) {
        let begun = Instant::now();
        while !is(self) {
            assert!(begun.elapsed() < PATIENCE, "no {what}: {} messages", self.heard().len());
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

async fn listen(
    settings: &BrokerSettings,
    heard: &Mutex<Vec<HeardMessage>>,
    inbox: &Receiver<(String, Vec<u8>)>,
) {
    loop {
        let _ = session(settings, heard, inbox).await;
        match inbox.try_recv() {
            Err(std::sync::mpsc::TryRecvError::Disconnected) => return,
            _ => tokio::time::sleep(Duration::from_millis(100)).await,
        }
    }
}

async fn session(
    settings: &BrokerSettings,
    heard: &Mutex<Vec<HeardMessage>>,
    inbox: &Receiver<(String, Vec<u8>)>,
) -> Result<(), rungd_net::mqtt::MqttFailure> {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
    let timestamp = since.as_millis() as u64;
    let topic = Topic::HostState { host: HOST.to_owned() }.to_string();
    let state = |online| HostState { online, timestamp }.bytes();
    let payload = state(false);
    let will = LastWill { topic: topic.clone(), payload, qos: Qos::AtLeastOnce, retain: true };
    let mut session = MqttSession::connect(settings, &settings.addresses[0], Some(&will)).await?;
    session.subscribe(&[("spBv1.0/#", Qos::AtLeastOnce)]).await?;
    session.publish(&topic, &state(true), Qos::AtLeastOnce, true).await?;
    let mut ticks = tokio::time::interval(Duration::from_millis(20));
    loop {
        tokio::select! {
            event = session.next() => {
                let MqttEvent::Message { topic, payload, .. } = event? else { continue };
                let Some(Topic::Node { kind, .. }) = Topic::read(&topic) else { continue };
                if let (false, Ok(payload)) =
                    (kind == MessageKind::NodeCommand, Payload::read(&payload))
                {
                    heard.lock().unwrap().push(HeardMessage { kind, payload });
                }
            }
            _ = ticks.tick() => {
                while let Ok((topic, payload)) = inbox.try_recv() {
                    session.publish(&topic, &payload, Qos::AtMostOnce, false).await?;
                }
            }
        }
    }
}

/// A metric for a command.
pub fn commanded(name: &str, datatype: DataType, value: MetricValue) -> Metric {
    let name = Some(name.to_owned());
    Metric { name, datatype: Some(datatype.number()), ..metric_of(datatype, Some(&value), 1) }
}

/// A ladder whose `n` counts the tenths of a second, and whose `on` follows `start`.
pub const LADDER: &str = r#"
[tags]
start = { at = "C0", doc = "the button" }
on    = { at = "Y0" }
n     = { at = "D0" }
[[program]]
name = "Main"
rung = [
  { when = ["start"], do = ["OUT on"] },
  { when = ["rise($100ms)"], do = ["MATH n = n + 1"] },
]
"#;

/// The rest of the controller file.
pub const CONTROLLER: &str = "scan.period = \"10ms\"\nrecord.dir = \"rec\"\n";

/// An edge node's process. Dropping this value ends it by SIGKILL.
pub struct Edge {
    child: Child,
    file: PathBuf,
    log: PathBuf,
}

impl Edge {
    /// Starts the node `press` of the group `plant`.
    pub fn start(live: &Live, url: &str, more: &str) -> Edge {
        Edge::named("press", live, url, more)
    }

    /// Same as [`Edge::start`], with a given name.
    pub fn named(name: &str, live: &Live, url: &str, more: &str) -> Edge {
        let file = written(name, live, url, more);
        let log = live.folder.join("edge.log");
        Edge { child: spawned(&file, &log), file, log }
    }

    /// Same as [`Edge::start`], with a log whose reader is gone.
    pub fn start_unheard(live: &Live, url: &str, more: &str) -> Edge {
        let file = written("press", live, url, more);
        let mut child = command(&file).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stderr.take());
        Edge { child, log: file.with_extension("log"), file }
    }

    /// The log so far.
    pub fn said(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Waits until the log contains `words` at least `count` times.
    pub fn await_line(&self, words: &str, count: usize) {
        let begun = Instant::now();
        while self.said().matches(words).count() < count {
            assert!(begun.elapsed() < PATIENCE, "no `{words}`: {}", self.said());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Ends the process by SIGKILL, and starts it again.
    pub fn kill_and_start(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
        self.child = spawned(&self.file, &self.log);
    }

    /// Sends a signal to the process.
    pub fn signal(&self, name: &str) {
        system::signal(&self.child, name);
    }

    /// Ends the process by SIGTERM.
    pub fn end(&mut self) {
        self.signal("TERM");
        assert_eq!(self.child.wait().unwrap().code(), Some(0), "{}", self.said());
    }
}

/// Writes the configuration file of a node.
fn written(name: &str, live: &Live, url: &str, more: &str) -> PathBuf {
    let file = live.folder.join("edge.toml");
    let text = format!(
        "[node]\ngroup = \"plant\"\nname = \"{name}\"\nsocket = \"s\"\nstate-dir = \"state\"\n\
         [broker]\naddresses = [\"{url}\"]\nkeepalive = \"3s\"\n{more}"
    );
    std::fs::write(&file, text).unwrap();
    file
}

fn spawned(file: &Path, log: &Path) -> Child {
    let log = File::options().create(true).append(true).open(log).unwrap();
    command(file).stderr(log).spawn().unwrap()
}

fn command(file: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("edge").arg(file).stdin(Stdio::null()).stdout(Stdio::null());
    command.env_remove("RUNGD_SOCKET").env_remove("STATE_DIRECTORY").env_remove("NOTIFY_SOCKET");
    command
}

impl Drop for Edge {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            eprintln!("the edge's journal:\n{}", self.said());
        }
    }
}
