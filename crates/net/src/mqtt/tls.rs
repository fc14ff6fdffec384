//! The start of TLS with a broker: the trusted authorities, our certificate, and the checks, which
//! cannot be turned off. Used by `connect`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::pki_types::pem::PemObject as _;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

use super::failure::MqttCause;
use super::settings::TlsFiles;
use rungd_base::regular_file::read_small;
use rungd_base::whole_file::judge_secret;

/// The file of the system's authorities, in Debian and most other distributions.
const SYSTEM_CA: &str = "/etc/ssl/certs/ca-certificates.crt";

/// The connector that starts TLS.
///
/// # Errors
/// A file is missing, or does not have the right contents.
pub(super) fn connector(files: &TlsFiles) -> Result<TlsConnector, MqttCause> {
    let ca = files.ca.clone().unwrap_or_else(|| PathBuf::from(SYSTEM_CA));
    let builder = ClientConfig::builder_with_provider(Arc::new(default_provider()));
    let builder = builder.with_safe_default_protocol_versions();
    let builder = builder.map_err(|error| MqttCause::Insecure(error.to_string()))?;
    let builder = builder.with_root_certificates(authorities(&ca, files.ca.is_some())?);
    let config = match (&files.certificate, &files.key) {
        (None, None) => builder.with_no_client_auth(),
        (Some(certificate), Some(key)) => {
            let chain = certificates(certificate)?;
            judge_secret(key, "the key")
                .map_err(|error| MqttCause::File(key.clone(), error.to_string()))?;
            let secret = read(key)?;
            let secret = PrivateKeyDer::from_pem_slice(&secret);
            let secret = secret.map_err(|error| of_file(key, &error, "a key"))?;
            let config = builder.with_client_auth_cert(chain, secret);
            config.map_err(|error| of_file(certificate, &error, "the certificate of the key"))?
        }
        (Some(_), None) => {
            return Err(MqttCause::Settings(
                "`certificate` is given without `key`: name the key's file too",
            ));
        }
        (None, Some(_)) => {
            return Err(MqttCause::Settings(
                "`key` is given without `certificate`: name the certificate's file too",
            ));
        }
    };
    Ok(TlsConnector::from(Arc::new(config)))
}

/// The authorities of a file. In a file that the user names, each certificate must be valid. The
/// system's bundle may have certificates that rustls cannot read.
fn authorities(path: &Path, named: bool) -> Result<RootCertStore, MqttCause> {
    let mut store = RootCertStore::empty();
    for certificate in certificates(path)? {
        let added = store.add(certificate);
        if let (true, Err(error)) = (named, added) {
            return Err(of_file(path, &error, "an authority"));
        }
    }
    if store.is_empty() {
        let missing = "it has no authority: name a file of PEM certificates as `ca`";
        return Err(MqttCause::File(path.to_owned(), missing.to_owned()));
    }
    Ok(store)
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, MqttCause> {
    let pem = read(path)?;
    let chain = CertificateDer::pem_slice_iter(&pem).collect::<Result<Vec<_>, _>>();
    let chain = chain.map_err(|error| of_file(path, &error, "a certificate"))?;
    if chain.is_empty() {
        let missing = "it has no certificate in PEM (`-----BEGIN CERTIFICATE-----`)";
        return Err(MqttCause::File(path.to_owned(), missing.to_owned()));
    }
    Ok(chain)
}

fn read(path: &Path) -> Result<Vec<u8>, MqttCause> {
    read_small(path).map_err(|error| MqttCause::File(path.to_owned(), error.to_string()))
}

fn of_file(path: &Path, error: &dyn std::error::Error, what: &str) -> MqttCause {
    MqttCause::File(path.to_owned(), format!("cannot be read as {what}: {error}"))
}
