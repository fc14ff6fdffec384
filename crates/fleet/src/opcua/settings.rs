//! The settings of an OPC UA server, as `keys` reads them from OPCUA.toml.

use std::net::SocketAddr;
use std::path::PathBuf;

use rungd_net::sparkplug::fits;

/// The settings of a server.
#[derive(Clone, Debug)]
pub struct OpcUaSettings {
    /// The name that clients show.
    pub name: String,
    /// The address at which the server listens.
    pub listen: SocketAddr,
    /// The host name in the server's address and certificate.
    pub host: String,
    /// Whether connections without encryption are accepted too. Only at a loopback address.
    pub insecure: bool,
    /// The file of users, as `rungd web passwd` writes it; `None`: nobody has to sign in, which is
    /// possible at a loopback address only.
    pub users: Option<PathBuf>,
    /// The folder of the certificates.
    pub certificates: PathBuf,
    /// The most sessions.
    pub sessions: usize,
    /// The operator's socket of the controller; `None`: the usual places, searched each time.
    pub socket: Option<PathBuf>,
    /// The patterns of the shown tags.
    pub show: Vec<String>,
    /// The tags that clients may write.
    pub write: Vec<String>,
    /// Whether clients may acknowledge alarms.
    pub may_acknowledge: bool,
    /// Whether clients may shelve alarms, and bring them back.
    pub may_shelve: bool,
}

impl OpcUaSettings {
    /// The address that clients connect to.
    pub fn url(&self) -> String {
        format!("opc.tcp://{}:{}/", self.host, self.listen.port())
    }

    /// Whether clients see a tag.
    pub fn shows(&self, name: &str) -> bool {
        self.show.iter().any(|pattern| fits(pattern, name))
    }

    /// The identity of this server, which its certificate contains.
    pub fn application_uri(&self) -> String {
        format!("urn:{}:rungd:{}", self.host, self.name)
    }
}
