//! TLS, with a certificate that `openssl` makes, and a foreign client: `curl`.

use std::path::Path;
use std::process::Command;

use crate::web::client::{CONTROLLER, LADDER, Web};
use rungd_test_support::needs::{openssl, usable, works};
use rungd_test_support::running::live::Live;

fn certificate(folder: &Path) -> (String, String) {
    let at = |name: &str| folder.join(name).display().to_string();
    let (chain, key) = (at("chain.pem"), at("key.pem"));
    let mut openssl = Command::new("openssl");
    openssl.args(["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"]);
    openssl.args(["-nodes", "-days", "2", "-subj", "/CN=localhost", "-keyout", &key]);
    openssl.args(["-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-out", &chain]);
    assert!(openssl.output().unwrap().status.success());
    (chain, key)
}

#[test]
fn the_secured_server_accepts_only_tls() {
    let curl = || works("curl", Command::new("curl").arg("--version"));
    if !usable(openssl(Path::new("openssl"))) || !usable(curl()) {
        return;
    }
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let (chain, key) = certificate(&live.folder);
    let users = live.folder.join("users");
    std::fs::write(&users, "").unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o600);
    std::fs::set_permissions(&users, mode).unwrap();
    let users = users.display().to_string();
    let web = Web::of(live, &["--tls-cert", &chain, "--tls-key", &key, "--users-file", &users]);
    let mut curl = Command::new("curl");
    curl.args(["-s", "-i", "--cacert", &chain, &format!("https://{}/", web.host)]);
    let said = String::from_utf8(curl.output().unwrap().stdout).unwrap();
    assert!(said.starts_with("HTTP/1.1 200") && said.contains("<!DOCTYPE html>"), "{said}");
    let plain = web.ask("GET /", &[format!("Host: {}", web.host)], "");
    assert_eq!(plain.status, 0, "{plain:?}");
    let refused = |chain: &str, key: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.arg("web").arg("--socket").arg(&web.live.socket);
        command.args(["--listen", "127.0.0.1:0", "--tls-cert", chain, "--tls-key", key]);
        String::from_utf8(command.output().unwrap().stderr).unwrap()
    };
    assert!(refused("/nonexistent.pem", &key).contains("/nonexistent.pem"));
    assert!(refused(&chain, &users).contains("users"), "no key");
}
