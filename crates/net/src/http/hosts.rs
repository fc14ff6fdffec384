//! The names by which clients may ask for this host. A request with another `Host` comes from a
//! browser that was sent here by a foreign name, which its owner points to this machine's address:
//! the page of that name could read the answer.
//!
//! Used by `web`, whose guard also checks the origin, and by `metrics`.

use std::net::IpAddr;

use hyper::Uri;
use hyper::header::{HOST, HeaderMap};

/// The accepted values of `Host`.
#[derive(Clone, Debug)]
pub struct ExpectedHosts {
    /// In small letters.
    values: Vec<String>,
    /// Whether every IP address is accepted: none can be pointed to a different machine.
    any_ip: bool,
    /// The command line that adds a name, for the message.
    adds: &'static str,
}

impl ExpectedHosts {
    /// These values alone. `adds`: the command line that adds one.
    pub fn new(values: Vec<String>, adds: &'static str) -> ExpectedHosts {
        ExpectedHosts { values, any_ip: false, adds }
    }

    /// These values, and every IP address, with any port.
    pub fn with_any_ip(self) -> ExpectedHosts {
        ExpectedHosts { any_ip: true, ..self }
    }

    /// The host of a request, in small letters.
    ///
    /// # Errors
    /// Why the request is not answered.
    pub fn host(&self, uri: &Uri, headers: &HeaderMap) -> Result<String, String> {
        if uri.authority().is_some() {
            return Err("this server is not a proxy".to_owned());
        }
        let mut hosts = headers.get_all(HOST).iter();
        let (Some(host), None) = (hosts.next(), hosts.next()) else {
            return Err("a request must have exactly one Host header".to_owned());
        };
        let host = host.to_str().unwrap_or_default().to_ascii_lowercase();
        if self.values.contains(&host) || self.any_ip && is_ip(&host) {
            return Ok(host);
        }
        Err(format!("this host is not known by that name: `{}` adds one", self.adds))
    }
}

/// Names in small letters, each alone and with the port at which the server listens.
pub fn with_port(names: &[String], port: Option<u16>) -> Vec<String> {
    let small = names.iter().map(|name| name.to_ascii_lowercase());
    let mut values: Vec<String> = small.collect();
    let ports = values.iter().filter_map(|name| port.map(|port| format!("{name}:{port}")));
    let ports: Vec<String> = ports.collect();
    values.extend(ports);
    values
}

/// Whether a value of `Host` is an IP address, with or without a port.
fn is_ip(host: &str) -> bool {
    let (name, port) = match host.rsplit_once(':') {
        Some((name, port))
            if !port.contains(']') && (!name.contains(':') || name.contains(']')) =>
        {
            (name, port)
        }
        _ => (host, ""),
    };
    let is_port = port.is_empty() || port.parse::<u16>().is_ok();
    let inner = name.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let is_address = match (inner, name.parse::<IpAddr>()) {
        (Some(inner), _) => inner.parse::<std::net::Ipv6Addr>().is_ok(),
        (None, Ok(ip)) => ip.is_ipv4(),
        (None, Err(_)) => false,
    };
    is_port && is_address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ip_address_is_recognized_with_and_without_a_port() {
        for yes in ["127.0.0.1", "10.0.3.7:9464", "[::1]", "[fe80::1]:80"] {
            assert!(is_ip(yes), "{yes}");
        }
        for no in ["", "localhost", "::1", "127.0.0.1.evil.example", "1.2.3.4:x", "[::1", "a:1"] {
            assert!(!is_ip(no), "{no}");
        }
    }

    #[test]
    fn host_names_are_accepted_with_and_without_the_port() {
        let values = with_port(&["PLC.example".into()], Some(9464));
        assert_eq!(values, ["plc.example", "plc.example:9464"]);
        let hosts = ExpectedHosts::new(values, "rungd x --host NAME").with_any_ip();
        let host = |value: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(HOST, value.parse().expect("a value"));
            hosts.host(&Uri::from_static("/metrics"), &headers)
        };
        assert!(host("plc.EXAMPLE:9464").is_ok() && host("10.0.0.1:80").is_ok());
        let refused = host("evil.example").expect_err("a strange name");
        assert!(refused.contains("`rungd x --host NAME` adds one"), "{refused}");
    }
}
