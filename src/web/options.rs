//! What the command line says, judged before anything is opened: where it listens, and what that
//! needs.

use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

use anyhow::{Result, bail};

/// The settings of `rungd web`.
#[derive(Clone, Debug)]
pub struct WebOptions {
    /// Where it listens.
    pub listen: ListenAt,
    /// The operator's socket of the controller; `None`: the usual places, looked at anew each time.
    pub socket: Option<PathBuf>,
    /// The names by which browsers reach it.
    pub hosts: Vec<String>,
    /// The certificate chain and the key, PEM.
    pub tls: Option<(PathBuf, PathBuf)>,
    /// A proxy in front of it speaks TLS.
    pub behind_proxy: bool,
    /// The file of users; `None`: a one-time link lets in.
    pub users: Option<PathBuf>,
}

/// Where it listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ListenAt {
    /// A TCP port.
    Port(SocketAddr),
    /// A Unix socket.
    Unix(PathBuf),
}

impl ListenAt {
    /// `127.0.0.1:8080`, or the path of a socket: one with a `/`.
    ///
    /// # Errors
    /// Why it is neither.
    pub fn parse(text: &str) -> Result<ListenAt, String> {
        if text.contains('/') {
            return Ok(ListenAt::Unix(text.into()));
        }
        let local = text.strip_prefix("localhost:").map(|port| format!("127.0.0.1:{port}"));
        let help = "write an address with a port, as 127.0.0.1:8080, or the path of a socket";
        let address = local.as_deref().unwrap_or(text).parse();
        address.map(ListenAt::Port).map_err(|_| help.to_owned())
    }

    /// Whether only this machine reaches it.
    pub fn is_local(&self) -> bool {
        match self {
            ListenAt::Port(address) => address.ip().is_loopback(),
            ListenAt::Unix(_) => true,
        }
    }
}

impl WebOptions {
    /// Refuses what would let strangers in.
    ///
    /// # Errors
    /// What is missing, and the remedy.
    pub fn judge(&self) -> Result<()> {
        let is_local = self.listen.is_local();
        if !is_local && self.tls.is_none() && !self.behind_proxy {
            bail!(
                "beyond this machine passwords need TLS: name `--tls-cert` and `--tls-key`, or \
                 say `--behind-proxy` if a proxy that speaks TLS stands before it"
            );
        }
        let is_open = !is_local || self.behind_proxy;
        if is_open && self.users.is_none() {
            bail!(
                "whoever reaches it from another machine must sign in: make users with `rungd web \
                 passwd NAME`, and name their file with `--users-file FILE`"
            );
        }
        if is_open && self.hosts.is_empty() && self.fixed_ip().is_none() {
            bail!("name the host that browsers ask for: `--host plc.example`");
        }
        Ok(())
    }

    /// The address that browsers can name, if it listens at one.
    fn fixed_ip(&self) -> Option<IpAddr> {
        match &self.listen {
            ListenAt::Port(address) if !address.ip().is_unspecified() => Some(address.ip()),
            ListenAt::Port(_) | ListenAt::Unix(_) => None,
        }
    }

    /// Whether browsers speak TLS.
    pub(super) fn is_tls(&self) -> bool {
        self.tls.is_some() || self.behind_proxy
    }

    /// The values of `Host` that are answered: each name alone and with its port. `port`: the one
    /// at which it listens.
    pub(super) fn host_values(&self, port: Option<u16>) -> Vec<String> {
        let mut names: Vec<String> = self.hosts.clone();
        if let Some(ip) = self.fixed_ip() {
            names.push(match ip {
                IpAddr::V4(ip) => ip.to_string(),
                IpAddr::V6(ip) => format!("[{ip}]"),
            });
        }
        if self.listen.is_local() && !self.behind_proxy {
            names.push("localhost".to_owned());
        }
        let with_port = |name: &String| port.map(|port| format!("{name}:{port}"));
        let ports: Vec<String> = names.iter().filter_map(with_port).collect();
        names.extend(ports);
        names.iter().map(|name| name.to_ascii_lowercase()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(listen: &str) -> WebOptions {
        WebOptions {
            listen: ListenAt::parse(listen).expect("an address"),
            socket: None,
            hosts: Vec::new(),
            tls: None,
            behind_proxy: false,
            users: None,
        }
    }

    #[test]
    fn what_would_let_strangers_in_is_refused() {
        assert!(options("127.0.0.1:8080").judge().is_ok());
        assert!(options("localhost:8080").judge().is_ok());
        assert!(options("[::1]:8080").judge().is_ok());
        assert!(options("/run/rungd-web/web.sock").judge().is_ok());
        let said = |options: WebOptions| options.judge().unwrap_err().to_string();
        let open = options("192.0.2.7:443");
        assert!(said(open.clone()).contains("TLS"));
        let tls = WebOptions { tls: Some(("a".into(), "b".into())), ..open.clone() };
        assert!(said(tls.clone()).contains("sign in"));
        let users = Some(PathBuf::from("users"));
        assert!(WebOptions { users: users.clone(), ..tls.clone() }.judge().is_ok());
        let proxy = WebOptions { behind_proxy: true, ..options("127.0.0.1:8080") };
        assert!(said(proxy).contains("sign in"));
        let any = WebOptions { users, tls: tls.tls, ..options("0.0.0.0:443") };
        assert!(said(any).contains("--host"));
        for wrong in ["", "8080", "plant", "127.0.0.1", "127.0.0.1:99999"] {
            assert!(ListenAt::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn hosts_are_those_that_are_named() {
        let values = options("127.0.0.1:8080").host_values(Some(8080));
        assert_eq!(values, ["127.0.0.1", "localhost", "127.0.0.1:8080", "localhost:8080"]);
        let named = WebOptions { hosts: vec!["PLC.example".into()], ..options("0.0.0.0:443") };
        assert_eq!(named.host_values(Some(443)), ["plc.example", "plc.example:443"]);
    }
}
