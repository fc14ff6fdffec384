//! The clients that a write list admits: addresses, and networks in CIDR notation.
//!
//! `controller` reads them; the Modbus server calls [`Network::admits`]. The client
//! `::ffff:10.0.0.5` counts as 10.0.0.5: a socket for both families reports IPv4 clients in this
//! form.

use std::net::IpAddr;

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, propose};
use rungd_language::source::reader::Text;

/// An address, or all addresses that begin with the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Network {
    /// The address as 128 bits; an IPv4 address is in the last 32.
    bits: u128,
    /// The number of leading bits of the family's address that count.
    prefix: u32,
    v4: bool,
}

impl Network {
    /// Whether a client's address belongs to this network.
    pub fn admits(&self, client: IpAddr) -> bool {
        let AddressBits { bits, v4 } = bits_of(client);
        v4 == self.v4 && (bits ^ self.bits) & mask(self.prefix, v4) == 0
    }

    /// All addresses with the same first `prefix` bits; the further bits of `address` do not count.
    #[cfg(test)]
    pub fn of(address: IpAddr, prefix: u32) -> Network {
        let AddressBits { bits, v4 } = bits_of(address);
        Network { bits: bits & mask(prefix, v4), prefix, v4 }
    }

    /// Reads `10.0.0.5`, `192.168.1.0/24`, `fd00::/8`.
    ///
    /// # Errors
    /// The finding.
    pub fn read(text: &Text) -> Result<Network, Finding> {
        let written = text.text.trim();
        let wrong = |message: String, help: Help| {
            Finding::new(Code::Controller, text.span, message).help(help)
        };
        let bad = || {
            let help = "write an IP address or a network: `10.0.0.5`, `192.168.1.0/24`, `fd00::/8`";
            wrong(format!("`{written}` is no client's address"), help.into())
        };
        let (address, prefix) = match written.split_once('/') {
            Some((address, prefix)) => (address, Some(prefix)),
            None => (written, None),
        };
        let address: IpAddr = address.parse().map_err(|_| bad())?;
        let AddressBits { bits, v4 } = bits_of(address);
        let most = if v4 { 32 } else { 128 };
        // An IPv4 address in IPv6 notation has an IPv6 prefix.
        let extra = if v4 && address.is_ipv6() { 96 } else { 0 };
        let digits = |text: &&str| text.bytes().all(|byte| byte.is_ascii_digit());
        let prefix = match prefix {
            None => most,
            Some(prefix) => Some(prefix)
                .filter(digits)
                .and_then(|prefix| prefix.parse::<u32>().ok()?.checked_sub(extra))
                .filter(|prefix| *prefix <= most)
                .ok_or_else(bad)?,
        };
        if bits & !mask(prefix, v4) != 0 {
            let message = format!("`{written}` has bits beyond its prefix");
            let network = address_of(bits & mask(prefix, v4), v4);
            return Err(wrong(
                message,
                propose(format!("{network}/{prefix}")).and(", or no prefix"),
            ));
        }
        Ok(Network { bits, prefix, v4 })
    }
}

/// An address as 128 bits; an IPv4 address is in the last 32.
struct AddressBits {
    bits: u128,
    v4: bool,
}

fn bits_of(address: IpAddr) -> AddressBits {
    match address.to_canonical() {
        IpAddr::V4(address) => AddressBits { bits: u32::from(address).into(), v4: true },
        IpAddr::V6(address) => AddressBits { bits: address.into(), v4: false },
    }
}

fn address_of(bits: u128, v4: bool) -> IpAddr {
    if v4 { IpAddr::V4((bits as u32).into()) } else { IpAddr::V6(bits.into()) }
}

/// The mask of the bits that count.
fn mask(prefix: u32, v4: bool) -> u128 {
    let length = if v4 { 32 } else { 128 };
    let ones = u128::MAX.checked_shr(128 - length).unwrap_or(0);
    ones ^ ones.checked_shr(prefix).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_language::source::span::Span;

    fn read(text: &str) -> Result<Network, String> {
        let text = Text { text: text.to_owned(), span: Span::default(), exact: true };
        Network::read(&text).map_err(|finding| finding.help_text().unwrap_or_default().into_owned())
    }

    #[test]
    fn networks_and_single_addresses_admit_only_their_clients() {
        for (network, client, admitted) in [
            ("10.0.0.5", "10.0.0.5", true),
            ("10.0.0.5", "10.0.0.4", false),
            ("10.0.0.5", "::ffff:10.0.0.5", true),
            ("::ffff:10.0.0.5", "10.0.0.5", true),
            ("::ffff:10.0.0.0/104", "10.255.0.1", true),
            ("::ffff:10.0.0.0/104", "11.0.0.1", false),
            ("192.168.1.0/24", "192.168.1.255", true),
            ("192.168.1.0/24", "192.168.2.0", false),
            ("192.168.1.0/24", "::ffff:192.168.1.7", true),
            ("192.168.1.128/25", "192.168.1.127", false),
            ("192.168.1.6/31", "192.168.1.7", true),
            ("0.0.0.0/0", "255.255.255.255", true),
            ("0.0.0.0/0", "::1", false),
            ("::/0", "fe80::1", true),
            ("::/0", "10.0.0.1", false),
            ("fd00::/8", "fdff::1", true),
            ("fd00::/8", "fe00::1", false),
            ("::1", "::1", true),
            ("::1", "::2", false),
        ] {
            let admits = read(network).unwrap().admits(client.parse().unwrap());
            assert_eq!(admits, admitted, "{network} {client}");
        }
    }

    #[test]
    fn invalid_networks_are_refused_with_a_correction() {
        for bad in ["", "x", "10.0.0", "10.0.0.5/33", "10.0.0.0/+8", "10.0.0.0/", "::/129", "a/8"] {
            assert!(read(bad).unwrap_err().starts_with("write an IP address"), "{bad}");
        }
        assert_eq!(read("10.0.0.5/8").unwrap_err(), "write `10.0.0.0/8`, or no prefix");
        assert_eq!(read("fd00::1/8").unwrap_err(), "write `fd00::/8`, or no prefix");
    }
}
