//! The settings from the command line, and their check before anything is opened.

use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

use anyhow::{Result, bail};

use rungd_net::http::with_port;

/// The settings of `rungd web`.
#[derive(Clone, Debug)]
pub struct WebOptions {
    /// The address at which the server listens.
    pub listen: ListenAt,
    /// The operator's socket of the controller; `None`: searched for in the usual places each time.
    pub socket: Option<PathBuf>,
    /// The host names that browsers use.
    pub hosts: Vec<String>,
    /// The certificate chain and the key, PEM.
    pub tls: Option<(PathBuf, PathBuf)>,
    /// Whether a proxy in front of the server speaks TLS.
    pub behind_proxy: bool,
    /// The file of users; `None`: a one-time link admits its first visitor.
    pub users: Option<PathBuf>,
    /// The folder with the drawings of panels.
    pub mimics: Option<PathBuf>,
}

/// An address to listen at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ListenAt {
    /// A TCP port.
    Port(SocketAddr),
    /// A Unix socket.
    Unix(PathBuf),
}

impl ListenAt {
    /// Reads `127.0.0.1:8080`, or the path of a socket, which contains a `/`.
    ///
    /// # Errors
    /// The text is neither, and how to write it.
    pub fn parse(text: &str) -> Result<ListenAt, String> {
        if text.contains('/') {
            return Ok(ListenAt::Unix(text.into()));
        }
        let local = text.strip_prefix("localhost:").map(|port| format!("127.0.0.1:{port}"));
        let help = "write an address with a port, as 127.0.0.1:8080, or the path of a socket";
        let address = local.as_deref().unwrap_or(text).parse();
        address.map(ListenAt::Port).map_err(|_| help.to_owned())
    }

    /// Whether only this machine can reach the address.
    pub fn is_local(&self) -> bool {
        match self {
            ListenAt::Port(address) => address.ip().is_loopback(),
            ListenAt::Unix(_) => true,
        }
    }
}

impl WebOptions {
    /// Refuses settings that would let strangers in.
    ///
    /// # Errors
    /// The missing setting, and the remedy.
    pub fn judge(&self) -> Result<()> {
        let is_local = self.listen.is_local();
        if !is_local && self.tls.is_none() && !self.behind_proxy {
            bail!(
                "an address that other machines can reach needs TLS: give `--tls-cert` and \
                 `--tls-key`, or `--behind-proxy` if a proxy provides TLS"
            );
        }
        let is_open = !is_local || self.behind_proxy;
        if is_open && self.users.is_none() {
            bail!(
                "users of other machines must sign in: make users with `rungd web passwd NAME`, \
                 and name their file with `--users-file FILE`"
            );
        }
        if is_open && self.hosts.is_empty() && self.fixed_ip().is_none() {
            bail!("name the host that browsers ask for: `--host plc.example`");
        }
        Ok(())
    }

    /// The IP address that browsers can use, if the server listens at a single one.
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

    /// The accepted values of `Host`: each name alone and with `port`, the port at which the server
    /// listens.
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
        with_port(&names, port)
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
            mimics: None,
        }
    }

    #[test]
    fn insecure_settings_are_refused() {
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
    fn only_the_configured_host_names_are_accepted() {
        let values = options("127.0.0.1:8080").host_values(Some(8080));
        assert_eq!(values, ["127.0.0.1", "localhost", "127.0.0.1:8080", "localhost:8080"]);
        let named = WebOptions { hosts: vec!["PLC.example".into()], ..options("0.0.0.0:443") };
        assert_eq!(named.host_values(Some(443)), ["plc.example", "plc.example:443"]);
    }
}
