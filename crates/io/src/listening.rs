//! Why rungd cannot listen at an address, and what helps: one sentence for `rungd web`, `rungd
//! metrics` and the Modbus server.

use std::io;
use std::net::SocketAddr;

/// The address, the reason and the remedy, for a message that ends with the system's error.
/// `other`: how to choose another address.
pub fn cannot_listen(at: SocketAddr, error: &io::Error, other: &str) -> String {
    let (kind, port) = (error.kind(), at.port());
    if kind == io::ErrorKind::AddrInUse {
        format!(
            "{at}: another process listens there (`ss -ltnp sport = :{port}` shows it): end it, \
             or {other}"
        )
    } else if kind == io::ErrorKind::PermissionDenied {
        format!(
            "{at}: ports below 1024 are for root, and for a service with the capability \
             CAP_NET_BIND_SERVICE: {other}"
        )
    } else if kind == io::ErrorKind::AddrNotAvailable {
        format!("{at}: this machine has no such address (`ip address` lists its own): {other}")
    } else {
        at.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_listen_error_is_reported_with_a_remedy() {
        let at: SocketAddr = "127.0.0.1:80".parse().expect("an address");
        let told = |kind: io::ErrorKind| cannot_listen(at, &kind.into(), "use `--listen`");
        for (kind, words) in [
            (io::ErrorKind::AddrInUse, "`ss -ltnp sport = :80` shows it): end it, or use `--l"),
            (io::ErrorKind::PermissionDenied, "CAP_NET_BIND_SERVICE: use `--listen`"),
            (io::ErrorKind::AddrNotAvailable, "no such address (`ip address` lists its own): use"),
        ] {
            assert!(told(kind).contains(words), "{}", told(kind));
        }
        assert_eq!(told(io::ErrorKind::OutOfMemory), "127.0.0.1:80");
    }
}
