//! The certificates: the server's own, made at the first start, and those of clients, which a
//! person trusts or not (`rungd-opcua trust`).
//!
//! The folders are those of the OPC UA library: `own/`, `private/`, `trusted/`, `rejected/`. The
//! library puts an unknown certificate into `rejected/` and looks into `trusted/` at each
//! connection, so moving a file is enough.

use std::fs;
use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use opcua::crypto::{CertificateStore, X509, X509Data};
use rungd_fleet::opcua::OpcUaSettings;
use rungd_language::source::wording::is_unseen;

/// How long the server's own certificate is valid.
const VALID_DAYS: u32 = 20 * 365;
/// The size of its key, bits.
const KEY_BITS: u32 = 2048;
/// The most certificates that are kept in `rejected/`: strangers can cause them.
const REJECTED_MAX: usize = 100;

/// The folder of trusted certificates.
const TRUSTED: &str = "trusted";
/// The folder of certificates that nobody trusts yet.
const REJECTED: &str = "rejected";

/// Makes the server's own certificate and its key, if they do not exist. Only the user of the
/// process may read the key. Returns whether they were made.
///
/// # Errors
/// The folder cannot be written.
pub fn make_own(settings: &OpcUaSettings) -> Result<bool> {
    let store = CertificateStore::new(&settings.certificates);
    store.ensure_pki_path().map_err(anyhow::Error::msg)?;
    let (certificate, key) = (store.own_certificate_path(), store.own_private_key_path());
    if certificate.exists() && key.exists() {
        return Ok(false);
    }
    let uri = settings.application_uri();
    let made = X509Data {
        key_size: KEY_BITS,
        common_name: format!("rungd {}", settings.name),
        organization: "rungd".to_owned(),
        organizational_unit: settings.name.clone(),
        country: "XX".to_owned(),
        state: "-".to_owned(),
        alt_host_names: X509Data::alt_host_names(&uri, Some(hosts(settings)), false, false, false),
        certificate_duration_days: VALID_DAYS,
    };
    CertificateStore::create_certificate_and_key(&made, true, &certificate, &key)
        .map_err(anyhow::Error::msg)?;
    Ok(true)
}

/// The names under which clients reach the server.
fn hosts(settings: &OpcUaSettings) -> Vec<String> {
    let mut hosts = vec![settings.host.clone()];
    let ip = settings.listen.ip();
    if !ip.is_unspecified() {
        hosts.push(ip.to_string());
    }
    if ip.is_loopback() {
        hosts.extend(["localhost".to_owned(), IpAddr::V4(Ipv4Addr::LOCALHOST).to_string()]);
    }
    hosts.sort();
    hosts.dedup();
    hosts
}

/// A client's certificate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientCertificate {
    /// The name in the certificate, without what a terminal would obey.
    pub name: String,
    /// SHA-1 of the certificate, hexadecimal.
    pub thumbprint: String,
    /// Whether it is trusted.
    pub is_trusted: bool,
    path: PathBuf,
}

/// The clients' certificates, the trusted ones first, each group by name.
///
/// # Errors
/// A folder cannot be read.
pub fn clients(folder: &Path) -> Result<Vec<ClientCertificate>> {
    let mut all = Vec::new();
    for (below, is_trusted) in [(TRUSTED, true), (REJECTED, false)] {
        all.extend(of_folder(&folder.join(below), is_trusted)?);
    }
    all.sort_by(|a, b| (!a.is_trusted, &a.name).cmp(&(!b.is_trusted, &b.name)));
    Ok(all)
}

fn of_folder(folder: &Path, is_trusted: bool) -> Result<Vec<ClientCertificate>> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error).context(folder.display().to_string()),
    };
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.with_context(|| folder.display().to_string())?.path();
        let Ok(certificate) = CertificateStore::read_cert(&path) else { continue };
        let name = shown_name(&certificate);
        let thumbprint = certificate.thumbprint().as_hex_string();
        found.push(ClientCertificate { name, thumbprint, is_trusted, path });
    }
    Ok(found)
}

/// Whether a certificate with this thumbprint (SHA-1) is among the trusted ones, by the names that
/// the library gives their files.
pub fn is_trusted(folder: &Path, thumbprint: &[u8]) -> bool {
    let hex: String = thumbprint.iter().map(|byte| format!("{byte:02x}")).collect();
    let Ok(entries) = fs::read_dir(folder.join(TRUSTED)) else { return false };
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    !hex.is_empty() && names.into_iter().any(|name| name.to_ascii_lowercase().contains(&hex))
}

/// The name in a certificate, without what a terminal would obey.
pub fn shown_name(certificate: &X509) -> String {
    let name = certificate.common_name().unwrap_or_default();
    let name = name.strip_prefix("CN=").unwrap_or(&name);
    name.chars().take(80).map(|c| if is_unseen(c) { '?' } else { c }).collect()
}

/// Trusts a certificate, or takes the trust back. `start`: the beginning of its thumbprint.
///
/// # Errors
/// No certificate begins so, or several; a folder cannot be written.
pub fn set_trust(folder: &Path, start: &str, trusts: bool) -> Result<ClientCertificate> {
    let start = start.to_ascii_lowercase();
    let all = clients(folder)?;
    let fits = |known: &&ClientCertificate| {
        known.thumbprint.to_ascii_lowercase().starts_with(&start) && !start.is_empty()
    };
    let mut fitting = all.iter().filter(fits);
    let Some(found) = fitting.next() else {
        bail!("no certificate's thumbprint begins with `{start}` (`trust list` shows them)");
    };
    if fitting.any(|other| other.thumbprint != found.thumbprint) {
        bail!("several thumbprints begin with `{start}`: write more of it");
    }
    let Some(name) = found.path.file_name() else { bail!("{} is no file", found.path.display()) };
    let to = folder.join(if trusts { TRUSTED } else { REJECTED }).join(name);
    if found.path != to {
        fs::rename(&found.path, &to).with_context(|| to.display().to_string())?;
    }
    Ok(ClientCertificate { is_trusted: trusts, path: to, ..found.clone() })
}

/// Removes the oldest rejected certificates beyond the most that are kept.
pub fn prune_rejected(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder.join(REJECTED)) else { return };
    let mut all: Vec<_> = entries
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let changed = fs::metadata(&path).and_then(|meta| meta.modified()).ok()?;
            Some((changed, path))
        })
        .collect();
    all.sort();
    let surplus = all.len().saturating_sub(REJECTED_MAX);
    for (_, path) in &all[..surplus] {
        let _ = fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(folder: &Path) -> OpcUaSettings {
        let text = format!("[server]\nname = \"t\"\ncertificates = \"{}\"\n", folder.display());
        let read = rungd_fleet::opcua::read_opcua(Path::new("/x/opcua.toml"), text.as_bytes());
        read.settings.expect("it is right")
    }

    #[test]
    fn a_certificate_is_made_once_and_moves_between_trusted_and_rejected() {
        let folder = std::env::temp_dir().join(format!("rungd-opcua-pki-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        assert!(make_own(&settings(&folder)).expect("made"));
        assert!(!make_own(&settings(&folder)).expect("known"));
        let own = folder.join("own/cert.der");
        let certificate = CertificateStore::read_cert(&own).expect("read");
        let file = CertificateStore::cert_file_name(&certificate);
        fs::copy(&own, folder.join("rejected").join(file)).expect("copied");
        fs::write(folder.join("rejected/junk.der"), b"junk").expect("written");
        let all = clients(&folder).expect("read");
        let [client] = &all[..] else { panic!("{all:?}") };
        assert!(client.name == "rungd t" && !client.is_trusted);
        let start = &client.thumbprint[..8];
        assert!(set_trust(&folder, "zz", true).is_err() && set_trust(&folder, "", true).is_err());
        assert!(set_trust(&folder, start, true).expect("moved").is_trusted);
        assert!(clients(&folder).expect("read")[0].is_trusted);
        let thumbprint = certificate.thumbprint();
        assert!(is_trusted(&folder, thumbprint.value()));
        assert!(!is_trusted(&folder, &[0; 20]) && !is_trusted(&folder, &[]));
        assert!(!set_trust(&folder, start, false).expect("moved").is_trusted);
        assert!(!is_trusted(&folder, thumbprint.value()));
        for number in 0..REJECTED_MAX + 20 {
            fs::write(folder.join(format!("rejected/{number}.der")), b"junk").expect("written");
        }
        prune_rejected(&folder);
        let left = fs::read_dir(folder.join("rejected")).expect("read").count();
        assert_eq!(left, REJECTED_MAX);
        let _ = fs::remove_dir_all(&folder);
    }
}
