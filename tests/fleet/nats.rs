//! A cluster of three NATS servers with JetStream and their MQTT listeners (MQTT 3.1.1 only).

use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use rustix::fs::{FlockOperation, flock};

use crate::fleet::broker::{PATIENCE, Process, free_ports, program};
use rungd_test_support::folder::TestFolder;
use rungd_test_support::needs::{nats_server, not_installed, usable};

/// The nodes of a cluster.
pub const NODES: usize = 3;

/// Allows one cluster at a time among all test processes of this machine. Each write of a server
/// waits for the disk, and two clusters on one disk lose their leaders. Closing the file ends the
/// lock.
fn one_at_a_time() -> File {
    let lock = File::create(std::env::temp_dir().join("rungd-nats.lock")).unwrap();
    flock(&lock, FlockOperation::LockExclusive).unwrap();
    lock
}

/// Three servers; each has the messages of all three. Nodes are numbered from zero.
pub struct NatsCluster {
    mqtt: Vec<u16>,
    nodes: Vec<Process>,
    /// Dropped after the nodes, which write to it.
    _folder: TestFolder,
    _turn: Rc<File>,
}

impl NatsCluster {
    /// Starts a cluster, and waits until every node accepts an MQTT client. If the server is not
    /// installed or too old, prints that and returns `None`.
    pub fn start() -> Option<NatsCluster> {
        let Some(server) = program("nats-server") else {
            not_installed("nats-server");
            return None;
        };
        if !usable(nats_server(&server)) {
            return None;
        }
        let turn = Rc::new(one_at_a_time());
        loop {
            let ports = free_ports(3 * NODES);
            let folder = TestFolder::new("nats");
            let node =
                |n| Process::new(command(&server, folder.path(), &ports, n), log(folder.path(), n));
            let mut nodes: Vec<Process> = (0..NODES).map(node).collect();
            nodes.iter_mut().for_each(Process::start);
            let mqtt = ports[..NODES].to_vec();
            let mut cluster = NatsCluster { mqtt, nodes, _folder: folder, _turn: Rc::clone(&turn) };
            if (0..NODES).all(|n| cluster.waits_for(n)) {
                return Some(cluster);
            }
            let said: Vec<String> = cluster.nodes.iter().map(Process::said).collect();
            let taken = |said: &String| said.contains("address already in use");
            assert!(said.iter().any(taken), "{}", said.join("\n"));
        }
    }

    /// The addresses of the nodes as rungd's settings write them.
    pub fn urls(&self) -> Vec<String> {
        self.mqtt.iter().map(|port| format!("mqtt://127.0.0.1:{port}")).collect()
    }

    /// Ends a node by SIGKILL.
    pub fn kill(&mut self, n: usize) {
        self.nodes[n].kill();
    }

    /// Starts a node again after [`NatsCluster::kill`]. Does not wait until the node accepts
    /// clients; [`NatsCluster::waits_for`] does.
    pub fn start_again(&mut self, n: usize) {
        self.nodes[n].start();
    }

    /// Pauses a node: its sockets stay open, and it answers nothing.
    pub fn stop(&self, n: usize) {
        self.nodes[n].stop();
    }

    /// Continues a node.
    pub fn cont(&self, n: usize) {
        self.nodes[n].cont();
    }

    /// A node's log.
    pub fn said(&self, n: usize) -> String {
        self.nodes[n].said()
    }

    /// Waits until a node accepts an MQTT client. False if the node has ended.
    pub fn waits_for(&mut self, n: usize) -> bool {
        let begun = Instant::now();
        while !takes_a_client(self.mqtt[n]) {
            if self.nodes[n].has_ended() {
                return false;
            }
            assert!(begun.elapsed() < PATIENCE, "takes no client: {}", self.said(n));
            std::thread::sleep(Duration::from_millis(200));
        }
        true
    }
}

fn log(folder: &Path, n: usize) -> PathBuf {
    folder.join(format!("log-{n}"))
}

/// Writes the configuration of node `n`; returns the command that starts it. `ports` has those of
/// MQTT, of the cluster, and of NATS's own clients.
fn command(server: &Path, folder: &Path, ports: &[u16], n: usize) -> Vec<String> {
    let (mqtt, rest) = ports.split_at(NODES);
    let (routes, clients) = rest.split_at(NODES);
    let store = folder.join(format!("store-{n}"));
    let urls: Vec<String> =
        routes.iter().map(|port| format!("\"nats-route://127.0.0.1:{port}\"")).collect();
    let conf = format!(
        "server_name: \"n{n}\"\nlisten: \"127.0.0.1:{client}\"\n\
         jetstream {{ store_dir: \"{store}\", sync_interval: always }}\n\
         cluster {{ name: rungd, listen: \"127.0.0.1:{route}\", routes: [{urls}] }}\n\
         mqtt {{ listen: \"127.0.0.1:{mqtt}\" }}\n",
        client = clients[n],
        store = store.display(),
        route = routes[n],
        urls = urls.join(", "),
        mqtt = mqtt[n],
    );
    let file = folder.join(format!("n{n}.conf"));
    std::fs::write(&file, conf).unwrap();
    vec![server.display().to_string(), "-c".to_owned(), file.display().to_string()]
}

/// Sends one CONNECT of MQTT 3.1.1 with a clean session. The server accepts it only if its
/// JetStream has a leader, and otherwise refuses it after some seconds.
fn takes_a_client(port: u16) -> bool {
    let connect = b"\x10\x16\x00\x04MQTT\x04\x02\x00\x3c\x00\x0arungd-rig-";
    let asked = || -> std::io::Result<bool> {
        let mut stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        stream.write_all(connect)?;
        let mut answer = [0; 4];
        stream.read_exact(&mut answer)?;
        stream.write_all(b"\xe0\x00")?;
        Ok(answer == [0x20, 2, 0, 0])
    };
    asked().unwrap_or(false)
}
