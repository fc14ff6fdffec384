//! EDGE.toml: its keys with their explanations, and the checks of their values.
//!
//! Called by `cli`, which shows the findings, and by `rungd schema`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::settings::{BrokerKeys, EdgeSettings, PublishRule};
use crate::settings_file::{ReadSettings, read_settings};
use rungd_engine::isa::{Real, duration};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::{Key, NOT_EMPTY, key};
use rungd_language::source::reader::{self, Constant, Table, Text};
use rungd_language::source::shape::{TableShape, ValueForm};
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::{Millis, ParsedText, ValueKind, read_duration};
use rungd_language::source::wording::is_unseen;
use rungd_net::mqtt::BrokerAddress;
use rungd_net::sparkplug::check_name;

/// The limits of a time, ms: the minimum, the maximum, the default.
struct TimeLimits(u32, u32, u32);

const KEEPALIVE: TimeLimits = TimeLimits(1000, 3_600_000, 15_000);
const INTERVAL: TimeLimits = TimeLimits(10, 60_000, 100);
const MARGIN: TimeLimits = TimeLimits(0, 3_600_000, 30_000);
const EVERY: TimeLimits = TimeLimits(0, 86_400_000, 0);

/// The maximum number of patterns or tags in a list.
const LIST_MAX: usize = 10_000;

/// Reads EDGE.toml. `path`: the path of the file. Paths in the file are relative to its folder.
pub fn read_edge(path: &Path, bytes: &[u8]) -> ReadSettings<EdgeSettings> {
    read_settings(path, bytes, read_root)
}

/// The keys of EDGE.toml.
pub fn shape() -> TableShape {
    reader::shape(|root| drop(read_root(root, Path::new(""))))
}

fn read_root(mut root: Table<'_>, base: &Path) -> EdgeSettings {
    root.require("node", "{ group = \"plant\", name = \"press-3\" }");
    let node = root.table(key("node", "The node: its group, name and controller."), "`[node]`");
    let (group, name, socket, state_dir) =
        node.map_or_else(Default::default, |table| read_node(table, base));
    root.require("broker", "{ addresses = [\"mqtts://broker.example\"] }");
    let broker = root.table(key("broker", "The MQTT brokers."), "`[broker]`");
    let broker = broker.map_or_else(no_broker, |table| read_broker(table, base));
    let sparkplug = root.table(key("sparkplug", "The options of Sparkplug B."), "`[sparkplug]`");
    let (primary_host, interval) = sparkplug.map_or((None, INTERVAL.default()), read_sparkplug);
    let history = root.table(key("history", "The past that is sent again."), "`[history]`");
    let margin = history.map_or(MARGIN.default(), read_history);
    let explained = key("publish", "Tags to be published; every tag with an address if not given.");
    let mut publish: Vec<PublishRule> =
        root.tables(explained, "`[[publish]]`").into_iter().map(read_publish).collect();
    if publish.is_empty() {
        let tags = vec!["*".to_owned()];
        publish.push(PublishRule { tags, deadband: 0.0, every: Duration::ZERO });
    }
    let explained = key("commands", "What hosts may write; nothing if not given.");
    let commands = root.table(explained, "`[commands]`").map_or_else(Vec::new, read_commands);
    root.finish();
    EdgeSettings {
        group,
        name,
        socket,
        state_dir,
        broker,
        primary_host,
        interval,
        margin,
        publish,
        commands,
    }
}

type ReadNode = (String, String, Option<PathBuf>, Option<PathBuf>);

fn read_node(mut table: Table<'_>, base: &Path) -> ReadNode {
    table.require("group", "\"plant\"");
    let explained = key("group", "The group: the second level of its topics.");
    let group = table.value_of(explained, &LEVEL);
    table.require("name", "\"press-3\"");
    let explained = key("name", "The node: one name for one controller.");
    let name = table.value_of(explained, &LEVEL);
    let explained = key("socket", "The controller's socket; the service's if not given.");
    let socket = path(table.string(explained), base);
    let explained =
        key("state-dir", "The folder for the log position; $STATE_DIRECTORY if not given.");
    let state_dir = path(table.string(explained), base);
    table.finish();
    (group.unwrap_or_default(), name.unwrap_or_default(), socket, state_dir)
}

fn no_broker() -> BrokerKeys {
    BrokerKeys {
        addresses: Vec::new(),
        is_v5: false,
        keepalive: KEEPALIVE.default(),
        user: None,
        password_file: None,
        ca: None,
        certificate: None,
    }
}

fn read_broker(mut table: Table<'_>, base: &Path) -> BrokerKeys {
    let span = table.span();
    table.require("addresses", "[\"mqtts://broker.example\"]");
    let explained = key("addresses", "The brokers, tried in turn: `mqtt://` or `mqtts://`.");
    let addresses = table.strings(explained.limited(NOT_EMPTY));
    let addresses = addresses.map_or_else(Vec::new, |texts| judged_addresses(&table, texts));
    let explained =
        key("version", "MQTT's version; \"3.1.1\", which every broker speaks, if not given.");
    let is_v5 = table.value_of(explained, &VERSION).unwrap_or_default();
    let explained = key("keepalive", "The longest silence of the broker; \"15s\" if not given.");
    let keepalive = KEEPALIVE.read_in(&mut table, explained);
    let user = table.string(key("user", "The user.")).map(|text| text.text);
    let explained = key("password-file", "A file whose first line is the password.");
    let password_file = path(table.string(explained), base);
    if password_file.is_some() && user.is_none() {
        let message = "`password-file` is given without `user`".to_owned();
        wrong(&table, span, message, "give `user` too");
    }
    let explained = key("ca", "The certificates of brokers, PEM; the system's if not given.");
    let ca = path(table.string(explained), base);
    let explained = key("certificate", "The node's own certificate and its chain, PEM.");
    let certificate = path(table.string(explained), base);
    let own_key = path(table.string(key("key", "The key of `certificate`, PEM.")), base);
    if certificate.is_some() != own_key.is_some() {
        let message = "a certificate and its key belong together".to_owned();
        wrong(&table, span, message, "give both `certificate` and `key`");
    }
    let is_plain =
        !addresses.is_empty() && addresses.iter().all(|address| address.starts_with("mqtt://"));
    if is_plain && (ca.is_some() || certificate.is_some()) {
        let message = "certificates are for `mqtts://`".to_owned();
        wrong(&table, span, message, "write `mqtts://` in `addresses`");
    }
    if password_file.is_some() {
        let in_clear = addresses.iter().filter_map(|text| BrokerAddress::parse(text).ok());
        for address in in_clear.filter(BrokerAddress::is_in_clear) {
            let message = format!("the password goes to {address} in clear");
            let finding = Finding::new(Code::PasswordInClear, span, message);
            table.find(finding.help("write `mqtts://` in `addresses`"));
        }
    }
    table.finish();
    let certificate = certificate.zip(own_key);
    BrokerKeys { addresses, is_v5, keepalive, user, password_file, ca, certificate }
}

fn judged_addresses(table: &Table<'_>, texts: Located<Vec<Text>>) -> Vec<String> {
    if texts.value.is_empty() {
        let message = "there is no broker in `addresses`".to_owned();
        wrong(table, texts.span, message, "name one: `[\"mqtts://broker.example\"]`");
    }
    for text in &texts.value {
        if let Err(why) = super::shell::judged_address(&text.text) {
            let help = "write `mqtt://host:port` or `mqtts://host:port`";
            wrong(table, text.span, why, help);
        }
    }
    texts.value.into_iter().map(|text| text.text).collect()
}

fn read_sparkplug(mut table: Table<'_>) -> (Option<String>, Duration) {
    let explained = key("primary-host", "The primary host: nothing is sent while it is offline.");
    let primary_host = table.value_of(explained, &LEVEL);
    let explained = key("interval", "Changes are collected for this time; \"100ms\" if not given.");
    let interval = INTERVAL.read_in(&mut table, explained);
    table.finish();
    (primary_host, interval)
}

fn read_history(mut table: Table<'_>) -> Duration {
    let explained = key(
        "margin",
        "This much before the confirmed position is sent again; \"30s\" if not given.",
    );
    let margin = MARGIN.read_in(&mut table, explained);
    table.finish();
    margin
}

fn read_publish(mut table: Table<'_>) -> PublishRule {
    table.require("tags", "[\"*\"]");
    let explained = key("tags", "Names of tags; `*` stands for any characters.");
    let tags = table.strings(explained.limited(NOT_EMPTY));
    let tags = tags.map_or_else(Vec::new, |texts| names(&table, texts));
    let explained =
        key("deadband", "A number is sent if it differs by at least this; 0 if not given.");
    let deadband = table.constant(explained.limited(r#"{"type":"number","minimum":0}"#));
    let deadband = deadband.map_or(0.0, |given| judged_deadband(&table, given));
    let explained =
        key("every", "At most one value of a tag is sent in this time; all if not given.");
    let every = EVERY.read_in(&mut table, explained);
    table.finish();
    PublishRule { tags, deadband, every }
}

fn judged_deadband(table: &Table<'_>, given: Located<Constant>) -> f64 {
    let number = match given.value {
        Constant::Integer(number) => f64::from(number),
        Constant::Real(real) => f64::from(Real::number(real)),
        Constant::Duration(_) | Constant::Bit(_) => -1.0,
    };
    if number < 0.0 {
        let message = "a deadband is a number, 0 or more".to_owned();
        wrong(table, given.span, message, "write `deadband = 0.5`");
    }
    number.max(0.0)
}

fn read_commands(mut table: Table<'_>) -> Vec<String> {
    let explained = key("tags", "The tags that commands may write, each by its name.");
    let tags = table.strings(explained);
    for text in tags.iter().flat_map(|texts| &texts.value).filter(|text| text.text.contains('*')) {
        let message = "`[commands] tags` takes names, not patterns".to_owned();
        wrong(&table, text.span, message, "list each tag by itself");
    }
    let tags = tags.map_or_else(Vec::new, |texts| names(&table, texts));
    table.finish();
    tags
}

fn names(table: &Table<'_>, texts: Located<Vec<Text>>) -> Vec<String> {
    if texts.value.len() > LIST_MAX {
        let message = format!("more than {LIST_MAX} names");
        wrong(table, texts.span, message, "use patterns, as \"line1.*\"");
    }
    texts.value.into_iter().map(|text| text.text).collect()
}

/// The version of MQTT: whether it is 5.
const VERSION: ParsedText<bool> = ParsedText::new(|_, text| match &*text.text {
    "5" => Ok(true),
    "3.1.1" => Ok(false),
    other => {
        let message = format!("version `{other}` of MQTT is not supported");
        Err(finding(text.span, message, "write \"5\" or \"3.1.1\""))
    }
})
.limited(r#"{"enum":["5","3.1.1"]}"#);

/// A level of a topic.
const LEVEL: ParsedText<String> = ParsedText::new(|_, text| {
    let message = match check_name(&text.text) {
        Err(fault) => format!("`{}` cannot be a level of a topic: {fault}", text.text),
        Ok(()) if text.text.contains(is_unseen) => {
            format!("`{}` has a character that cannot be seen", text.text)
        }
        Ok(()) => return Ok(text.text.clone()),
    };
    Err(finding(text.span, message, "write letters, digits, `-` and `_`"))
});

fn path(text: Option<Text>, base: &Path) -> Option<PathBuf> {
    text.map(|text| base.join(text.text))
}

fn wrong(table: &Table<'_>, span: Span, message: String, help: &str) {
    table.find(finding(span, message, help));
}

fn finding(span: Span, message: String, help: &str) -> Finding {
    Finding::new(Code::Edge, span, message).help(help)
}

impl TimeLimits {
    fn default(&self) -> Duration {
        Duration::from_millis(self.2.into())
    }

    fn read_in(&self, table: &mut Table<'_>, explained: Key) -> Duration {
        table.value_of(explained, self).unwrap_or_else(|| self.default())
    }
}

impl ValueKind for TimeLimits {
    type Value = Duration;

    fn form(&self) -> ValueForm {
        ValueForm::Duration
    }

    fn noun(&self) -> &'static str {
        Millis::ANY.noun()
    }

    fn read(&self, key: &str, text: &Text, find: &mut dyn FnMut(Finding)) -> Option<Duration> {
        let TimeLimits(least, most, _) = *self;
        let ms = read_duration(text, find)?;
        if !(least..=most).contains(&ms) {
            let print = |ms: u32| duration::print(ms.cast_signed());
            let message = format!("`{key}` is {} to {}", print(least), print(most));
            find(finding(text.span, message, "write a time within these limits"));
        }
        Some(Duration::from_millis(ms.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> ReadSettings<EdgeSettings> {
        read_edge(Path::new("/etc/rungd/edge.toml"), text.as_bytes())
    }

    const LEAST: &str =
        "[node]\ngroup = \"g\"\nname = \"n\"\n[broker]\naddresses = [\"mqtt://h\"]\n";

    #[test]
    fn every_omitted_key_has_a_default() {
        let settings = read(LEAST).settings.expect("it is enough");
        assert_eq!(settings.interval, Duration::from_millis(100));
        assert_eq!(settings.broker.keepalive, Duration::from_secs(15));
        assert_eq!(settings.margin_ns(), 30_000_000_000);
        assert!(settings.rule("anything").is_some() && settings.commands.is_empty());
        let text = format!("{LEAST}[[publish]]\ntags = [\"a*\"]\nevery = \"1m\"\ndeadband = 0.5\n");
        let settings = read(&text).settings.expect("it is right");
        let rule = settings.rule("abc").expect("it is named");
        assert_eq!((rule.deadband, rule.every), (0.5, Duration::from_secs(60)));
        // The margin covers a value that waits for the end of its `every`.
        assert!(settings.rule("b").is_none() && settings.margin_ns() == 60_000_000_000);
    }

    #[test]
    fn impossible_settings_give_findings() {
        for (more, said) in [
            ("[sparkplug]\ninterval = \"1ms\"", "`interval` is 10ms to 1m"),
            ("[sparkplug]\nprimary-host = \"a\u{200b}b\"", "cannot be seen"),
            ("[sparkplug]\nprimary-host = \"a/b\"", "cannot be a level of a topic"),
            ("[history]\nmargin = \"2h\"", "`margin` is 0ms to 1h"),
            ("[[publish]]\ntags = [\"a\"]\ndeadband = -1", "0 or more"),
            ("[[publish]]\ntags = [\"a\"]\ndeadband = true", "a deadband is a number"),
            ("[[publish]]\n", "has no `tags`"),
            ("[commands]\ntags = [\"a*\"]", "takes names, not patterns"),
            ("[comands]\n", "no key `comands`"),
        ] {
            let read = read(&format!("{LEAST}{more}\n"));
            let messages: Vec<&str> =
                read.findings.iter().map(|finding| &*finding.message).collect();
            let is_said = messages.iter().any(|message| message.contains(said));
            assert!(is_said && read.settings.is_none(), "{more}: {messages:?}");
        }
        for (from, to, said) in [
            ("mqtt://h\"]", "http://h\"]", "neither with `mqtt://`"),
            ("[\"mqtt://h\"]", "[]", "no broker"),
            ("[broker]\n", "[broker]\nversion = \"4\"\n", "version `4` of MQTT is not supported"),
            ("[broker]\n", "[broker]\npassword-file = \"p\"\n", "without `user`"),
            ("[broker]\n", "[broker]\nkey = \"p\"\n", "belong together"),
            ("[broker]\n", "[broker]\nca = \"p\"\n", "for `mqtts://`"),
            ("name = \"n\"\n", "", "no `name`"),
            ("[node]\ngroup = \"g\"\nname = \"n\"\n", "", "no `node`"),
        ] {
            let read = read(&LEAST.replace(from, to));
            let messages: Vec<&str> =
                read.findings.iter().map(|finding| &*finding.message).collect();
            let is_said = messages.iter().any(|message| message.contains(said));
            assert!(is_said && read.settings.is_none(), "{to}: {messages:?}");
        }
    }

    /// What a help shows, and the text that follows it: it leaves no finding.
    #[test]
    fn following_the_help_of_a_finding_removes_the_finding() {
        let broker = "addresses = [\"mqtt://h\"]\n";
        let end = |more: &str| format!("{broker}{more}");
        for (wrong, help, shown, right) in [
            (end("version = \"4\"\n"), "write \"5\"", "\"5\"", end("version = \"5\"\n")),
            (broker.replace("mqtt", "http"), "write `mqtt://host:port`", "mqtt://", broker.into()),
            (
                "addresses = []\n".into(),
                "name one: `[\"mqtts://broker.example\"]`",
                "[\"mqtts://broker.example\"]",
                "addresses = [\"mqtts://broker.example\"]\n".into(),
            ),
            (
                end("ca = \"p\"\n"),
                "write `mqtts://`",
                "mqtts://",
                broker.replace("mqtt", "mqtts") + "ca = \"p\"\n",
            ),
            (
                end("user = \"u\"\npassword-file = \"p\"\n"),
                "write `mqtts://`",
                "mqtts://",
                broker.replace("mqtt", "mqtts") + "user = \"u\"\npassword-file = \"p\"\n",
            ),
            (
                broker.replace("mqtt", "mqtts") + "password-file = \"p\"\n",
                "give `user` too",
                "user",
                broker.replace("mqtt", "mqtts") + "user = \"u\"\npassword-file = \"p\"\n",
            ),
            (
                end("[[publish]]\ntags = [\"a\"]\ndeadband = -1\n"),
                "write `deadband = 0.5`",
                "deadband = 0.5",
                end("[[publish]]\ntags = [\"a\"]\ndeadband = 0.5\n"),
            ),
            (
                end("[[publish]]\n"),
                "tags = [\"*\"]",
                "tags = [\"*\"]",
                end("[[publish]]\ntags = [\"*\"]\n"),
            ),
            (end("[comands]\n"), "`commands`", "commands", end("[commands]\n")),
            (
                end("[sparkplug]\ninterval = \"0,5s\"\n"),
                "write `500ms`",
                "500ms",
                end("[sparkplug]\ninterval = \"500ms\"\n"),
            ),
        ] {
            let findings = read(&LEAST.replace(broker, &wrong)).findings;
            let helps: Vec<_> = findings.iter().filter_map(|finding| finding.help_text()).collect();
            assert!(helps.iter().any(|of| of.contains(help)), "{wrong}: {helps:?}");
            let rest = read(&LEAST.replace(broker, &right)).findings;
            assert!(right.contains(shown) && rest.is_empty(), "{right}: {rest:?}");
        }
    }

    #[test]
    fn paths_are_relative_to_the_edge_file() {
        let text = LEAST.replace("name = \"n\"\n", "name = \"n\"\nstate-dir = \"state\"\n");
        let state = read(&text).settings.expect("it is right").state_dir;
        assert_eq!(state.as_deref(), Some(Path::new("/etc/rungd/state")));
    }
}
