//! The arguments of `rungd fleet` that name a broker, and the exit codes of its failures.

use std::path::{Path, PathBuf};
use std::process;
use std::time::Duration;

use clap::{Args, ValueEnum};

use super::exit::Exit;
use super::terminal::say_line;
use rungd_base::wall_clock::now_ms;
use rungd_fleet::fleet::{FleetOptions, FleetResult};
use rungd_net::mqtt::{
    BrokerAddress, BrokerLogin, BrokerSettings, MqttCause, MqttFailure, MqttVersion, TlsFiles,
};
use rungd_net::sparkplug::check_name;

/// The codes of MQTT 3.1.1 and 5 for a bad login and for missing authorization.
const NOT_PERMITTED: [(MqttVersion, u8); 4] =
    [(MqttVersion::V3, 4), (MqttVersion::V3, 5), (MqttVersion::V5, 0x86), (MqttVersion::V5, 0x87)];

/// The maximum length of a packet: twice the maximum length of a message. A message that is a
/// little too long is counted, and its node is shown as stale. The bytes of a longer packet are not
/// kept.
const PACKET_BYTES_MAX: u32 = 8 << 20;

#[derive(Args, Debug)]
pub(super) struct BrokerArgs {
    /// A broker: `mqtt://HOST:PORT`, or `mqtts://` with TLS. Repeat the option for several brokers;
    /// one at a time is used
    #[arg(long = "broker", value_name = "URL", required = true, env = "RUNGD_BROKER")]
    #[arg(value_parser = BrokerAddress::parse, value_delimiter = ',')]
    brokers: Vec<BrokerAddress>,
    /// The version of MQTT
    #[arg(long, value_name = "VERSION", default_value = "3.1.1")]
    mqtt: MqttVersionArg,
    /// The authorities that may sign the broker's certificate, as PEM (default: the system's)
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,
    /// This client's certificate and its chain, as PEM
    #[arg(long, value_name = "FILE", requires = "key")]
    cert: Option<PathBuf>,
    /// The certificate's key, as PEM
    #[arg(long, value_name = "FILE", requires = "cert")]
    key: Option<PathBuf>,
    /// The user at the broker
    #[arg(long, value_name = "NAME", requires = "password_file")]
    user: Option<String>,
    /// A file whose first line is the user's password
    #[arg(long, value_name = "FILE", requires = "user")]
    password_file: Option<PathBuf>,
    /// Show only the nodes of this group
    #[arg(long, value_name = "GROUP", value_parser = name)]
    group: Option<String>,
    /// Request a new birth, with all values, from nodes whose birth was not received. No other
    /// command is sent to nodes, and this one changes no value
    #[arg(long)]
    pub(super) rebirth: bool,
    /// Publish the state of this host as ID: edge nodes with `primary-host = "ID"` hold back their
    /// values while it is offline
    #[arg(long, value_name = "ID", value_parser = name)]
    host_id: Option<String>,
    /// Print JSON. Names of times end with their unit
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum MqttVersionArg {
    #[value(name = "3.1.1")]
    V3,
    #[value(name = "5")]
    V5,
}

fn name(text: &str) -> Result<String, String> {
    check_name(text).map(|()| text.to_owned()).map_err(|fault| fault.to_string())
}

impl BrokerArgs {
    /// The options for listening for the time `lasts`. `Err` is the exit code of a failure, which
    /// has been printed.
    pub fn options(&self, lasts: Option<Duration>) -> Result<FleetOptions, Exit> {
        let mut brokers = BrokerSettings::new(self.brokers.clone(), &client_id());
        brokers.version = match self.mqtt {
            MqttVersionArg::V3 => MqttVersion::V3,
            MqttVersionArg::V5 => MqttVersion::V5,
        };
        brokers.packet_bytes_max = PACKET_BYTES_MAX;
        let login = self.user.as_ref().zip(self.password_file.as_ref());
        brokers.login = login.map(|(user, file)| login_of(user, file)).transpose()?;
        let in_clear = brokers.addresses.iter().find(|address| address.is_in_clear());
        if let Some(address) = in_clear.filter(|_| brokers.login.is_some()) {
            say_line(&format!(
                "rungd fleet: warning: the password goes to {address} in clear, for everybody on \
                 the way: use an address that begins with `mqtts://`"
            ));
        }
        let (ca, certificate, key) = (self.ca.clone(), self.cert.clone(), self.key.clone());
        let has_files = ca.is_some() || certificate.is_some();
        brokers.tls = has_files.then_some(TlsFiles { ca, certificate, key });
        Ok(FleetOptions {
            brokers,
            group: self.group.clone(),
            host_id: self.host_id.clone(),
            asks_births: self.rebirth,
            lasts,
        })
    }

    /// The exit code after listening.
    pub fn exit(&self, heard: &FleetResult) -> Exit {
        match &heard.failure {
            Some(failure) => exit_of(failure),
            None if heard.was_connected => Exit::Ok,
            None => {
                say_line("rungd fleet: no broker answered in time: allow more time with `--wait`");
                Exit::Unavailable
            }
        }
    }
}

fn login_of(user: &str, file: &Path) -> Result<BrokerLogin, Exit> {
    BrokerLogin::of_file(user, file).map_err(|error| {
        let file = file.display();
        say_line(&format!(
            "rungd fleet: --password-file {file} cannot be read ({error}): its first line is the \
             password of `--user`"
        ));
        Exit::Io
    })
}

/// An MQTT client identifier for this process. It must be unique, because a broker disconnects a
/// client if a different one connects with the same identifier. Every broker accepts 23 characters.
fn client_id() -> String {
    let moment = now_ms().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    format!("rungdf{:x}{moment:x}", process::id()).chars().take(23).collect()
}

fn exit_of(failure: &MqttFailure) -> Exit {
    match &failure.cause {
        MqttCause::File(..) => Exit::Io,
        MqttCause::Settings(_) | MqttCause::NotSendable(_) => Exit::Usage,
        MqttCause::Refused(version, code) if NOT_PERMITTED.contains(&(*version, *code)) => {
            Exit::NoPerm
        }
        MqttCause::FilterRefused(..) => Exit::NoPerm,
        MqttCause::Unreachable(_)
        | MqttCause::Late(_)
        | MqttCause::Insecure(_)
        | MqttCause::Refused(..)
        | MqttCause::MessageRefused(..)
        | MqttCause::Ended(_)
        | MqttCause::Closed
        | MqttCause::Broken(_)
        | MqttCause::Silent(..)
        | MqttCause::Garbage(_)
        | MqttCause::Blocked(..)
        | MqttCause::TooLong(_) => Exit::Unavailable,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_client_id_is_accepted_by_every_broker() {
        let id = client_id();
        assert!((10..=23).contains(&id.len()), "{id}");
        assert!(id.chars().all(|c| c.is_ascii_alphanumeric()), "{id}");
    }

    #[test]
    fn each_broker_failure_has_its_exit_code() {
        let broker = BrokerAddress::parse("mqtt://localhost").expect("an address");
        let exit = |cause| exit_of(&MqttFailure { broker: broker.clone(), cause });
        assert_eq!(exit(MqttCause::Refused(MqttVersion::V3, 5)), Exit::NoPerm);
        assert_eq!(exit(MqttCause::Refused(MqttVersion::V5, 5)), Exit::Unavailable);
        assert_eq!(exit(MqttCause::Closed), Exit::Unavailable);
    }
}
