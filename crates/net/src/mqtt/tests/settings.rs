//! Addresses as people write them.

use super::super::BrokerAddress;

#[test]
fn a_broker_address_is_parsed_and_printed() {
    for (text, host, port, tls) in [
        ("mqtt://plant", "plant", 1883, false),
        ("mqtts://plant.example", "plant.example", 8883, true),
        ("mqtt://10.0.0.7:11883/", "10.0.0.7", 11883, false),
        ("mqtts://[fe80::1]:1", "fe80::1", 1, true),
        ("mqtt://[::1]", "::1", 1883, false),
    ] {
        let address = BrokerAddress::parse(text).unwrap();
        assert_eq!(address, BrokerAddress { host: host.to_owned(), port, tls });
        assert_eq!(BrokerAddress::parse(&address.to_string()), Ok(address));
    }
}

#[test]
fn an_invalid_broker_address_is_refused_with_a_reason() {
    for (text, word) in [
        ("plant:1883", "begins neither"),
        ("MQTT://plant", "begins neither"),
        ("tcp://plant", "`mqtts://`"),
        ("mqtt://", "no host"),
        ("mqtt://:1883", "no host"),
        ("mqtt://plant:0", "no port"),
        ("mqtt://plant:65536", "no port"),
        ("mqtt://plant:+1", "no port"),
        ("mqtt://plant:", "no port"),
        ("mqtt://::1:1883", "without brackets"),
        ("mqtt://[::1", "brackets"),
        ("mqtt://[plant]:1", "brackets"),
        ("mqtt://[::1]1883", "no port"),
        ("mqtt://user:word@plant", "keys of their own"),
        ("mqtt://plant/topic", "keys of their own"),
        ("mqtt://a b", "keys of their own"),
    ] {
        let why = BrokerAddress::parse(text).unwrap_err();
        assert!(why.contains(word) && why.contains('`'), "{text}: {why}");
    }
}
