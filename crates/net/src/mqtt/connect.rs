//! Opens TCP, and TLS if the address requires it. `session` uses it, within a deadline.

use std::io;

use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio_rustls::rustls::pki_types::ServerName;

use super::failure::MqttCause;
use super::settings::{BrokerAddress, BrokerSettings};
use super::tls::connector;

/// A connection of any kind.
pub(super) trait BrokerSocket: AsyncRead + AsyncWrite + Unpin + Send {}
impl<S: AsyncRead + AsyncWrite + Unpin + Send> BrokerSocket for S {}

/// Opens a connection.
///
/// # Errors
/// No connection could be opened, or TLS does not accept the broker.
pub(super) async fn open(
    settings: &BrokerSettings,
    address: &BrokerAddress,
) -> Result<Box<dyn BrokerSocket>, MqttCause> {
    // Faults of the settings are reported before a connection is opened.
    let secured = match (address.tls, &settings.tls) {
        (true, files) => Some(connector(files.as_ref().unwrap_or(&Default::default()))?),
        (false, None) => None,
        (false, Some(_)) => {
            return Err(MqttCause::Settings(
                "files for TLS are given, but the address begins with `mqtt://`, which is not \
                 secured: write `mqtts://`",
            ));
        }
    };
    let stream = TcpStream::connect((address.host.as_str(), address.port)).await;
    let stream = stream.map_err(|error| MqttCause::Unreachable(error.to_string()))?;
    // A message must not wait for the next one.
    let _ = stream.set_nodelay(true);
    let Some(secured) = secured else { return Ok(Box::new(stream)) };
    let Ok(name) = ServerName::try_from(address.host.clone()) else {
        return Err(MqttCause::Insecure(format!("`{}` is not a host name", address.host)));
    };
    let stream = secured.connect(name, stream).await.map_err(|error| insecure(&error))?;
    Ok(Box::new(stream))
}

fn insecure(error: &io::Error) -> MqttCause {
    if error.kind() == io::ErrorKind::UnexpectedEof {
        return MqttCause::Insecure("the connection is closed: does it speak TLS?".to_owned());
    }
    MqttCause::Insecure(error.to_string())
}
