//! Tests the promise of an edge node in virtual time: a host receives every change with one value,
//! and each stream in its order. Links break at any message; the program is reloaded; the
//! controller restarts.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use rungd_client::live::{ChangeFollower, ChangeHistory, LogPosition};
use rungd_fleet::edge::{EdgeNode, EdgeSettings, NodeAction, chooser, number, read_edge};
use rungd_net::sparkplug::{DataType, MetricValue, Payload, Sequence};
use rungd_test_support::logged_plant::LoggedPlant;

const EDGE: &str = "[node]\ngroup = \"g\"\nname = \"n\"\n[broker]\naddresses = [\"mqtt://h\"]\n\
                    [history]\nmargin = \"2s\"\n";

/// The bytes of the log in memory: few, so that a part of the past is on disk.
const MEMORY: usize = 1 << 16;

/// A host with the received value of each tag and time.
#[derive(Default)]
struct KnowingHost {
    names: HashMap<u64, (String, DataType)>,
    values: BTreeMap<(String, u64), i64>,
    /// The last time in the stream of the present, and in the stream of the past since the last
    /// birth.
    last: [u64; 2],
}

impl KnowingHost {
    fn hear(&mut self, topic: &str, payload: &[u8]) {
        let payload = Payload::read(payload).expect("a payload");
        let is_birth = topic.contains("/NBIRTH/");
        if is_birth {
            let named = payload.metrics.iter().filter_map(|of| {
                let datatype = DataType::of(of.datatype?)?;
                Some((of.alias?, (of.name.clone()?, datatype)))
            });
            (self.names, self.last[1]) = (named.collect(), 0);
            return;
        }
        for metric in &payload.metrics {
            let known = metric.alias.and_then(|alias| self.names.get(&alias));
            let (name, datatype) = known.expect("a birth comes before data").clone();
            let (Some(time), Some(content)) = (metric.timestamp, &metric.content) else { continue };
            if name.starts_with("rungd/") {
                continue;
            }
            let last = &mut self.last[usize::from(metric.is_historical == Some(true))];
            assert!(time >= *last, "{name} at {time} behind {last}");
            *last = time;
            let value = datatype.read(content).expect("of its type");
            let value = match value {
                MetricValue::Bool(on) => i64::from(on),
                MetricValue::Signed(_)
                | MetricValue::Unsigned(_)
                | MetricValue::Real(_)
                | MetricValue::Text(_) => number(&value).expect("a number") as i64,
            };
            let before = self.values.insert((name.clone(), time), value);
            assert!(before.is_none_or(|before| before == value), "{name} at {time}");
        }
    }
}

/// A node with its log, and a link to the host.
struct LinkedNode {
    plant: LoggedPlant,
    follower: ChangeFollower,
    node: EdgeNode,
    history: Option<ChangeHistory>,
    settings: EdgeSettings,
    is_linked: bool,
    /// The messages that were published and have not arrived.
    under_way: Vec<(String, Vec<u8>)>,
    host: KnowingHost,
    now_ms: u64,
}

impl LinkedNode {
    fn new(seed: u64) -> LinkedNode {
        let settings = read_edge(Path::new("e"), EDGE.as_bytes()).settings.expect("it is right");
        LinkedNode {
            plant: LoggedPlant::new(seed, MEMORY),
            follower: ChangeFollower::new(chooser(&settings)),
            node: EdgeNode::new(settings.clone(), Sequence::default(), None),
            history: None,
            settings,
            is_linked: false,
            under_way: Vec::new(),
            host: KnowingHost::default(),
            now_ms: 1_000_000,
        }
    }

    fn look(&mut self) {
        let answer = self.plant.answer(self.follower.next_section());
        let events = self.follower.take(answer).expect("it has a section");
        let at = self.follower.position().expect("it has scans");
        self.node.live(events, at, self.now_ms);
        self.send();
    }

    /// Publishes a piece of the past.
    fn past(&mut self) {
        let Some(history) = &mut self.history else { return };
        match history.next_section() {
            Some(events) => self.node.past(events, history.position(), self.now_ms),
            None => {
                self.history = None;
                self.node.past_done(self.now_ms);
            }
        }
        self.send();
    }

    fn send(&mut self) {
        while let Some(out) = self.node.take_out() {
            match out {
                NodeAction::Publish(topic, payload) => self.under_way.push((topic, payload)),
                NodeAction::Replay(span) => {
                    let choose = chooser(&self.settings);
                    self.history = Some(ChangeHistory::new(self.plant.all(), span, choose));
                }
                NodeAction::Write(..) | NodeAction::Leave(_) => panic!("{out:?}"),
                NodeAction::Say(_) | NodeAction::SayLimited(..) => {}
            }
        }
    }

    /// Delivers all messages and confirms them.
    fn confirm(&mut self) {
        let published: Option<LogPosition> = self.node.published();
        for (topic, payload) in std::mem::take(&mut self.under_way) {
            self.host.hear(&topic, &payload);
        }
        published.into_iter().for_each(|at| self.node.confirm(at));
    }

    /// Breaks the link after some of the messages have arrived.
    fn cut(&mut self) {
        let arrived = self.plant.random.next() as usize % (self.under_way.len() + 1);
        for (topic, payload) in std::mem::take(&mut self.under_way).into_iter().take(arrived) {
            self.host.hear(&topic, &payload);
        }
        self.node.disconnected();
        (self.history, self.is_linked) = (None, false);
    }

    fn link(&mut self) {
        self.node.next_birth();
        self.node.connected(self.now_ms);
        self.is_linked = true;
        self.send();
    }

    fn round(&mut self, round: u64) {
        let scans = self.plant.random.next() % 40;
        (0..scans).for_each(|_| self.plant.scan());
        self.now_ms += scans * 10;
        match round % 120 {
            50 => self.plant.reload(),
            100 => {
                self.plant.restart(MEMORY);
                (0..20).for_each(|_| self.plant.scan());
            }
            _ => {}
        }
        self.look();
        self.past();
        match (self.is_linked, self.plant.random.next() % 20) {
            (true, 0) => self.cut(),
            (true, 1..12) => self.confirm(),
            (false, 0..4) => self.link(),
            (true, _) | (false, _) => {}
        }
    }
}

#[test]
fn a_host_gets_every_change_over_any_unreliable_link() {
    for seed in 1..6 {
        let mut linked = LinkedNode::new(seed);
        linked.plant.scan();
        linked.look();
        let first = linked.plant.rig.scans();
        (0..400).for_each(|round| linked.round(round));
        if !linked.is_linked {
            linked.link();
        }
        linked.look();
        while linked.history.is_some() {
            linked.past();
        }
        linked.confirm();
        let mut compared = 0;
        for ((process, scan, name), value) in &linked.plant.changes {
            // The birth contains the changes by a reload or a restart.
            let time = linked.plant.times.get(&(*process, *scan));
            let Some(time) = time.filter(|_| *process > 1 || *scan > first) else { continue };
            if linked.plant.swaps.contains(&(*process, *scan)) {
                continue;
            }
            let heard = linked.host.values.get(&(name.clone(), *time));
            let is_gone = !linked.host.names.values().any(|(known, _)| known == name);
            assert!(
                heard == Some(&i64::from(*value)) || is_gone,
                "seed {seed}: {name} in scan {scan} of {process} at {time}: {heard:?}, not {value}"
            );
            compared += 1;
        }
        assert!(compared > 3000, "{compared}");
    }
}
