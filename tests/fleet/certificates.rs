//! Certificates for a test, made by `openssl`: an authority, a server's and a client's.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Files in PEM.
pub struct Certificates {
    pub ca: PathBuf,
    pub server: PathBuf,
    pub server_key: PathBuf,
    pub client: PathBuf,
    pub client_key: PathBuf,
}

impl Certificates {
    /// Makes the files in a folder. The server's certificate is for `localhost` only.
    pub fn make(folder: &Path) -> Certificates {
        std::fs::create_dir_all(folder).unwrap();
        let (ca, ca_key) = (folder.join("ca.pem"), folder.join("ca.key"));
        let mut openssl = new_key("CN=rungd test CA", &ca_key);
        openssl.args(["-x509", "-days", "2", "-out"]).arg(&ca);
        run(openssl);
        let signed = |name: &str, extensions: &str| {
            let at = |end: &str| folder.join(format!("{name}.{end}"));
            let mut openssl = new_key(&format!("CN={name}"), &at("key"));
            openssl.arg("-out").arg(at("csr"));
            run(openssl);
            std::fs::write(at("ext"), extensions).unwrap();
            let mut openssl = Command::new("openssl");
            openssl.args(["x509", "-req", "-days", "2", "-in"]).arg(at("csr"));
            openssl.arg("-CA").arg(&ca).arg("-CAkey").arg(&ca_key).arg("-CAcreateserial");
            openssl.arg("-extfile").arg(at("ext")).arg("-out").arg(at("pem"));
            run(openssl);
            (at("pem"), at("key"))
        };
        let of_all = "basicConstraints=CA:FALSE\n";
        let (server, server_key) = signed(
            "server",
            &format!(
                "{of_all}extendedKeyUsage=serverAuth\n\
                 subjectAltName=DNS:localhost\n"
            ),
        );
        let extensions = format!("{of_all}extendedKeyUsage=clientAuth\n");
        let (client, client_key) = signed("client", &extensions);
        Certificates { ca, server, server_key, client, client_key }
    }
}

fn new_key(subject: &str, key: &Path) -> Command {
    let mut openssl = Command::new("openssl");
    openssl.args(["req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]);
    openssl.args(["-subj", &format!("/{subject}"), "-keyout"]).arg(key);
    openssl
}

fn run(mut command: Command) {
    let said = command.output().unwrap();
    let error = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success(), "{command:?}: {error}");
}
