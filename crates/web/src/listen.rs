//! The listener: a TCP port or a Unix socket, with or without TLS.

use std::fs;
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, UnixListener, UnixStream};
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::pki_types::pem::PemObject as _;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};

use super::options::ListenAt;
use super::patience::PeerEnd;
use rungd_base::regular_file::read_small;
use rungd_base::whole_file::judge_secret;
use rungd_io::listening::cannot_listen;

/// The time limit of the TLS handshake.
const HANDSHAKE_MAX: Duration = Duration::from_secs(10);

/// A connection of any kind.
pub(super) trait BrowserStream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<S: AsyncRead + AsyncWrite + Unpin + Send> BrowserStream for S {}

/// A connected browser.
pub(super) struct Browser {
    pub connection: Box<dyn BrowserStream>,
    /// The browser's end of the connection.
    pub peer: PeerEnd,
}

/// The source of connections.
pub(super) enum WebListener {
    Port(TcpListener),
    Unix(UnixListener),
}

impl WebListener {
    /// Opens the listener.
    ///
    /// # Errors
    /// The system's error; another process answers at the socket.
    pub async fn open(at: &ListenAt) -> Result<WebListener> {
        match at {
            ListenAt::Port(address) => {
                let listener = TcpListener::bind(address).await;
                let listener = listener.map_err(|error| {
                    let about = cannot_listen(*address, &error, &other_port(*address));
                    anyhow::Error::new(error).context(about)
                });
                Ok(WebListener::Port(listener?))
            }
            ListenAt::Unix(path) => {
                let of_path = || path.display().to_string();
                free(path).await.with_context(of_path)?;
                let listener = UnixListener::bind(path).with_context(of_path)?;
                // Only the owner and the group can connect, for example a proxy of the same group.
                let mode = fs::Permissions::from_mode(0o660);
                fs::set_permissions(path, mode).with_context(of_path)?;
                Ok(WebListener::Unix(listener))
            }
        }
    }

    /// The address of a TCP port; `None` for a Unix socket.
    pub fn address(&self) -> Option<SocketAddr> {
        match self {
            WebListener::Port(listener) => listener.local_addr().ok(),
            WebListener::Unix(_) => None,
        }
    }

    /// The next browser that connects.
    ///
    /// # Errors
    /// The system's error.
    pub async fn accept(&self) -> io::Result<Browser> {
        match self {
            WebListener::Port(listener) => {
                let (stream, _) = listener.accept().await?;
                let _ = stream.set_nodelay(true);
                let peer = PeerEnd::of(&stream)?;
                Ok(Browser { connection: Box::new(stream), peer })
            }
            WebListener::Unix(listener) => {
                let (stream, _) = listener.accept().await?;
                let peer = PeerEnd::of(&stream)?;
                Ok(Browser { connection: Box::new(stream), peer })
            }
        }
    }
}

/// How to choose another port.
fn other_port(taken: SocketAddr) -> String {
    let next = taken.port().checked_add(1).unwrap_or(8080);
    let port = if taken.port() < 1024 { 8443 } else { next };
    format!("use another port: `--listen {}`", SocketAddr::new(taken.ip(), port))
}

/// Removes a socket that an earlier process has left.
async fn free(path: &Path) -> Result<()> {
    match fs::symlink_metadata(path) {
        Ok(facts) if facts.file_type().is_socket() => {
            if UnixStream::connect(path).await.is_ok() {
                bail!("another process listens there: end it, or name another path (`--listen`)");
            }
            fs::remove_file(path)?;
        }
        Ok(_) => bail!("a file that is not a socket is there"),
        Err(_) => {}
    }
    Ok(())
}

/// Makes the acceptor of TLS connections from a certificate chain and a key.
///
/// # Errors
/// The files are not a certificate chain and a key.
pub(super) fn tls(certificates: &Path, key: &Path) -> Result<TlsAcceptor> {
    let of_file = |path: &Path| path.display().to_string();
    let read = |path: &Path| read_small(path).with_context(|| of_file(path));
    let pem = read(certificates)?;
    let chain = CertificateDer::pem_slice_iter(&pem).collect::<Result<Vec<_>, _>>();
    let chain = chain.with_context(|| of_file(certificates))?;
    judge_secret(key, "the key").with_context(|| of_file(key))?;
    let secret = PrivateKeyDer::from_pem_slice(&read(key)?).with_context(|| of_file(key))?;
    let builder = ServerConfig::builder_with_provider(Arc::new(default_provider()));
    let builder = builder.with_safe_default_protocol_versions()?.with_no_client_auth();
    let mut config =
        builder.with_single_cert(chain, secret).with_context(|| of_file(certificates))?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(TlsAcceptor::from(Arc::new(config)))
}

/// Begins TLS on a connection.
///
/// # Errors
/// The peer does not speak TLS, or takes too long.
pub(super) async fn secured(
    acceptor: &TlsAcceptor,
    connection: Box<dyn BrowserStream>,
) -> io::Result<Box<dyn BrowserStream>> {
    let secured = timeout(HANDSHAKE_MAX, acceptor.accept(connection)).await;
    Ok(Box::new(secured.map_err(|_| io::ErrorKind::TimedOut)??))
}
