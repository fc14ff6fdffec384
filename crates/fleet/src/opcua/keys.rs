//! OPCUA.toml: its keys with their explanations, and the checks of their values.
//!
//! Called by `rungd-opcua`, which shows the findings, and by `rungd schema`.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use rungd_base::directories;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{NOT_EMPTY, key};
use rungd_language::source::reader::{self, Table, Text};
use rungd_language::source::shape::TableShape;
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::ParsedText;

use super::settings::OpcUaSettings;
use crate::settings_file::{ReadSettings, read_settings};

/// The most sessions: the least, the most, and without the key.
const SESSIONS: (i64, i64, usize) = (1, 200, 50);
/// The most patterns or tags in a list.
const LIST_MAX: usize = 10_000;
/// The port of OPC UA.
const PORT: u16 = 4840;

/// Reads OPCUA.toml. `path`: the path of the file. Paths in the file are relative to its folder.
pub fn read_opcua(path: &Path, bytes: &[u8]) -> ReadSettings<OpcUaSettings> {
    read_settings(path, bytes, read_root)
}

/// The keys of OPCUA.toml.
pub fn shape() -> TableShape {
    reader::shape(|root| drop(read_root(root, Path::new(""))))
}

fn read_root(mut root: Table<'_>, base: &Path) -> OpcUaSettings {
    root.require("server", "{ name = \"press-3\" }");
    let explained = key("server", "The server: its name, address, users and certificates.");
    let server = root.table(explained, "`[server]`");
    let mut settings = server.map_or_else(unread, |table| read_server(table, base));
    let controller = root.table(key("controller", "The controller."), "`[controller]`");
    if let Some(mut table) = controller {
        let explained = key("socket", "The controller's socket; the service's if not given.");
        settings.socket = path(table.string(explained), base);
        table.finish();
    }
    let explained = key("tags", "The tags that clients see and write; all are seen, none written.");
    if let Some(table) = root.table(explained, "`[tags]`") {
        read_tags(table, &mut settings);
    }
    let explained = key("alarms", "What clients may do with alarms.");
    if let Some(mut table) = root.table(explained, "`[alarms]`") {
        let explained =
            key("acknowledge", "Whether clients may acknowledge alarms; false if not given.");
        settings.may_acknowledge = table.flag(explained, false);
        let explained = key("shelve", "Whether clients may shelve alarms; false if not given.");
        settings.may_shelve = table.flag(explained, false);
        table.finish();
    }
    root.finish();
    settings
}

/// The settings of a file without `[server]`, which is refused.
fn unread() -> OpcUaSettings {
    OpcUaSettings {
        name: String::new(),
        listen: SocketAddr::from(([127, 0, 0, 1], PORT)),
        host: "localhost".to_owned(),
        insecure: false,
        users: None,
        certificates: PathBuf::new(),
        sessions: SESSIONS.2,
        socket: None,
        show: vec!["*".to_owned()],
        write: Vec::new(),
        may_acknowledge: false,
        may_shelve: false,
    }
}

fn read_server(mut table: Table<'_>, base: &Path) -> OpcUaSettings {
    let span = table.span();
    table.require("name", "\"press-3\"");
    let explained = key("name", "The name that clients show.");
    let name = table.value_of(explained, &NAME).unwrap_or_default();
    let explained = key("listen", "The address and port; \"127.0.0.1:4840\" if not given.");
    let listen = table.value_of(explained, &ADDRESS).unwrap_or_else(|| unread().listen);
    let explained = key("host", "The host name by which clients reach the server.");
    let host = table.value_of(explained, &NAME);
    let explained = key("insecure", "Also without encryption, at a loopback address only.");
    let insecure = table.flag(explained, false);
    let explained = key("users-file", "The users, as `rungd web passwd` writes them.");
    let users = path(table.string(explained), base);
    let explained =
        key("certificates", "The folder of the certificates; $STATE_DIRECTORY/pki if not given.");
    let certificates = path(table.string(explained), base)
        .or_else(|| directories::state().map(|state| state.join("pki")));
    let explained = key("sessions", "The most sessions at a time; 50 if not given.");
    let sessions = table.integer(explained, SESSIONS.0..=SESSIONS.1);
    let sessions = sessions.and_then(|count| usize::try_from(count.value).ok());
    let is_local = listen.ip().is_loopback();
    if certificates.is_none() {
        let message = "there is no folder for the certificates".to_owned();
        wrong(&table, span, message, "give `certificates = \"pki\"`, a folder beside this file");
    }
    if !is_local && insecure {
        let message = "without encryption everybody in the network reads along".to_owned();
        wrong(&table, span, message, "leave `insecure` out, or listen at 127.0.0.1");
    }
    if !is_local && users.is_none() {
        let message = "other machines can reach this address, and nobody has to sign in".to_owned();
        let help = "make users with `rungd web passwd NAME`, and name their file: `users-file`";
        wrong(&table, span, message, help);
    }
    if host.is_none() && listen.ip().is_unspecified() {
        let message = "clients cannot connect to an unspecified address".to_owned();
        wrong(&table, span, message, "name this machine: `host = \"plc.example\"`");
    }
    table.finish();
    OpcUaSettings {
        name,
        listen,
        host: host.unwrap_or_else(|| listen.ip().to_string()),
        insecure,
        users,
        certificates: certificates.unwrap_or_default(),
        sessions: sessions.unwrap_or(SESSIONS.2),
        ..unread()
    }
}

fn read_tags(mut table: Table<'_>, settings: &mut OpcUaSettings) {
    let explained = key("show", "Names of tags; `*` stands for any characters. All if not given.");
    if let Some(texts) = table.strings(explained.limited(NOT_EMPTY)) {
        settings.show = names(&table, texts);
    }
    let explained = key("write", "The tags that clients may write, each by its name.");
    let texts = table.strings(explained);
    for text in texts.iter().flat_map(|texts| &texts.value).filter(|text| text.text.contains('*')) {
        let message = "`[tags] write` takes names, not patterns".to_owned();
        wrong(&table, text.span, message, "list each tag by itself");
    }
    settings.write = texts.map_or_else(Vec::new, |texts| names(&table, texts));
    if !settings.write.is_empty() && settings.users.is_none() && !settings.listen.ip().is_loopback()
    {
        let message = "clients may write, and nobody has to sign in".to_owned();
        wrong(&table, table.span(), message, "give `users-file` in `[server]`");
    }
    table.finish();
}

fn names(table: &Table<'_>, texts: Located<Vec<Text>>) -> Vec<String> {
    if texts.value.len() > LIST_MAX {
        let message = format!("more than {LIST_MAX} names");
        wrong(table, texts.span, message, "use patterns, as \"line1.*\"");
    }
    texts.value.into_iter().map(|text| text.text).collect()
}

/// An address with a port.
const ADDRESS: ParsedText<SocketAddr> = ParsedText::new(|_, text| {
    text.text.parse().map_err(|_| {
        let message = format!("`{}` is no address with a port", text.text);
        finding(text.span, message, "write `\"127.0.0.1:4840\"`, or `\"[::1]:4840\"`")
    })
});

/// A name of a server or host: it stands in addresses and certificates.
const NAME: ParsedText<String> = ParsedText::new(|key, text| {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if !text.text.is_empty() && text.text.len() <= 100 && text.text.chars().all(is_plain) {
        return Ok(text.text.clone());
    }
    let message = format!("`{}` cannot be the `{key}` of a server", text.text);
    Err(finding(text.span, message, "write letters, digits, `-`, `_` and `.`"))
})
.limited(r#"{"pattern":"^[A-Za-z0-9._-]{1,100}$"}"#);

fn path(text: Option<Text>, base: &Path) -> Option<PathBuf> {
    text.map(|text| base.join(text.text))
}

fn wrong(table: &Table<'_>, span: Span, message: String, help: &str) {
    table.find(finding(span, message, help));
}

fn finding(span: Span, message: String, help: &str) -> Finding {
    Finding::new(Code::OpcUa, span, message).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> ReadSettings<OpcUaSettings> {
        read_opcua(Path::new("/etc/rungd/opcua.toml"), text.as_bytes())
    }

    const LEAST: &str = "[server]\nname = \"press-3\"\ncertificates = \"pki\"\n";

    #[test]
    fn every_omitted_key_has_a_default() {
        let settings = read(LEAST).settings.expect("it is enough");
        assert_eq!(settings.url(), "opc.tcp://127.0.0.1:4840/");
        assert_eq!(settings.certificates, Path::new("/etc/rungd/pki"));
        assert!(!settings.insecure && settings.write.is_empty());
        assert!(!settings.may_acknowledge && !settings.may_shelve);
        assert_eq!((settings.sessions, settings.show), (50, vec!["*".to_owned()]));
    }

    #[test]
    fn settings_that_let_strangers_in_are_refused_and_their_helps_can_be_followed() {
        let open = format!("{LEAST}listen = \"0.0.0.0:4840\"\n");
        let users = format!("{open}users-file = \"users\"\n");
        for (text, said, remedy) in [
            (open.clone(), "nobody has to sign in", "host = \"a\"\nusers-file = \"users\"\n"),
            (users.clone(), "unspecified address", "host = \"plc.example\"\n"),
            (format!("{users}host = \"a\"\ninsecure = true\n"), "reads along", ""),
            (format!("{LEAST}listen = \"4840\"\n"), "no address with a port", ""),
            (format!("{LEAST}[tags]\nwrite = [\"a*\"]\n"), "takes names, not patterns", ""),
            (format!("{LEAST}[tag]\n"), "no key `tag`", ""),
            (LEAST.replace("press-3", "press 3"), "cannot be the `name`", ""),
        ] {
            let refused = read(&text);
            let messages: Vec<&str> =
                refused.findings.iter().map(|finding| &*finding.message).collect();
            let is_said = messages.iter().any(|message| message.contains(said));
            assert!(is_said && refused.settings.is_none(), "{text}: {messages:?}");
            if !remedy.is_empty() {
                let mended = read(&format!("{text}{remedy}"));
                assert!(mended.settings.is_some(), "{text}{remedy}: {:?}", mended.findings);
            }
        }
    }
}
