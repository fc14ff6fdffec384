//! `[operator]`: its keys, read into settings: paths of a valid length, permissions as numbers.
//! Only run time shows whether the groups exist and the sockets can be made.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, pair, possible, propose};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::{Located, Span};
use rungd_language::source::value_kind::ParsedText;
use rungd_language::source::wording::is_unseen;

/// `[operator]`.
#[derive(Clone, Debug)]
pub struct WrittenOperator {
    /// The place of its header.
    pub(crate) span: Span,
    /// `socket`, with its place.
    pub(crate) socket: Option<Located<String>>,
    /// `view-socket`, with its place.
    pub(crate) view_socket: Option<Located<String>>,
    /// All of its keys.
    pub settings: Operator,
}

/// The settings of the operator's socket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operator {
    /// Whether there is a socket.
    pub enabled: bool,
    /// Its path, relative to the controller file; if not given, the daemon's default path.
    pub socket: Option<String>,
    /// Its permissions.
    pub mode: u32,
    /// Its group, by name or number; if not given, the daemon's own.
    pub group: Option<String>,
    /// The view socket.
    pub view: ViewSocket,
}

/// The settings of the view socket, which refuses every change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewSocket {
    /// Its path, relative to the controller file; if not given, beside the operator's socket.
    pub socket: Option<String>,
    /// Its permissions; if not given, those of the operator's socket.
    pub mode: Option<u32>,
    /// Its group, by name or number; if not given, the daemon's default group for it.
    pub group: Option<String>,
}

impl Default for Operator {
    fn default() -> Self {
        let view = ViewSocket { socket: None, mode: None, group: None };
        Operator { enabled: true, socket: None, mode: MODE, group: None, view }
    }
}

/// The permissions of a socket if none are given.
const MODE: u32 = 0o660;
/// The longest path. The system's limit is 107 bytes, and the socket is made under a longer,
/// temporary name.
pub const SOCKET_BYTES_MAX: usize = 103;

/// Reads `[operator]`, if there is one.
pub(super) fn read_in(root: &mut Table<'_>) -> Option<WrittenOperator> {
    let explained = key("operator", "The socket for operators' questions and commands.");
    root.table(explained, "`[operator]`").map(read)
}

fn read(mut table: Table<'_>) -> WrittenOperator {
    let explained = key("enabled", "Whether there is a socket; true if not given.");
    let enabled = table.flag(explained, true);
    let explained = key(
        "socket",
        "Its path, relative to this file; if not given, in systemd's runtime folder.",
    );
    let socket = table.value(explained, &SOCKET);
    let explained = key("mode", "Its permissions in octal digits; 0660 if not given.");
    let mode = table.value_of(explained, &PERMISSIONS).unwrap_or(MODE);
    let explained = key("group", "Its group, by name or number; members may give commands.");
    let group = table.value_of(explained, &GROUP);
    let explained = key(
        "view-socket",
        "A second socket, which refuses every change; `rungd-view.sock` beside `rungd.sock` if \
         not given.",
    );
    let view_socket = table.value(explained, &VIEW_SOCKET);
    let explained = key("view-mode", "The permissions of `view-socket`; `mode` if not given.");
    let view_mode = table.value_of(explained, &PERMISSIONS);
    let explained =
        key("view-group", "The group of `view-socket`: members may look, and change nothing.");
    let view_group = table.value_of(explained, &VIEW_GROUP);
    let span = table.span();
    table.finish();
    let path = |socket: &Option<Located<String>>| socket.as_ref().map(|path| path.value.clone());
    let view = ViewSocket { socket: path(&view_socket), mode: view_mode, group: view_group };
    let settings = Operator { enabled, socket: path(&socket), mode, group, view };
    WrittenOperator { span, socket, view_socket, settings }
}

const SOCKET: ParsedText<String> = ParsedText::new(|key, text| socket(key, text, "rungd.sock"));
const VIEW_SOCKET: ParsedText<String> =
    ParsedText::new(|key, text| socket(key, text, "rungd-view.sock"));
const GROUP: ParsedText<String> = ParsedText::new(|key, text| group(key, text, "rungd"));
const VIEW_GROUP: ParsedText<String> = ParsedText::new(|key, text| group(key, text, "rungd-view"));
const PERMISSIONS: ParsedText<u32> =
    ParsedText::new(permissions).limited(r#"{"pattern":"^(0o)?0?[0-7]{3}$"}"#);

fn wrong<T>(text: &Text, message: String, help: Help) -> Result<T, Finding> {
    Err(Finding::new(Code::Controller, text.span, message).help(help))
}

/// The path of a socket; `name` is an example of its last part.
fn socket(key: &str, socket: &Text, name: &str) -> Result<String, Finding> {
    let path = &socket.text;
    if path.is_empty() || path.ends_with('/') || path.contains('\0') {
        let help = propose(pair(format!("{key} = \"/run/rungd/{name}\"")));
        return wrong(socket, "a socket is a file".to_owned(), help);
    }
    if path.len() > SOCKET_BYTES_MAX {
        let message = format!("a socket's path has at most {SOCKET_BYTES_MAX} bytes");
        let shorter = possible(format!("/run/rungd/{name}"));
        return wrong(socket, message, advise("choose a shorter one, as `{}`", [shorter]));
    }
    Ok(path.clone())
}

fn permissions(key: &str, mode: &Text) -> Result<u32, Finding> {
    octal(&mode.text).map_or_else(
        || {
            let message = format!("`{}` is no file mode", mode.text);
            let digits = pair(format!("{key} = \"0660\"")).proposed();
            wrong(mode, message, advise("write it in octal digits: `{}`", [digits]))
        },
        Ok,
    )
}

/// A group, by name or number; `name` is an example.
fn group(key: &str, group: &Text, name: &str) -> Result<String, Finding> {
    let odd = |c: char| c.is_whitespace() || is_unseen(c) || c == ':';
    if group.text.is_empty() || group.text.contains(odd) {
        let message = format!("`{}` is no group", group.text);
        let name = pair(format!("{key} = \"{name}\"")).possible();
        return wrong(group, message, advise("write its name or number: `{}`", [name]));
    }
    Ok(group.text.clone())
}

fn octal(text: &str) -> Option<u32> {
    let digits = text.strip_prefix("0o").unwrap_or(text);
    let fits =
        (3..=4).contains(&digits.len()) && digits.bytes().all(|b| (b'0'..=b'7').contains(&b));
    u32::from_str_radix(digits, 8).ok().filter(|mode| fits && *mode <= 0o777)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn socket_modes_are_octal() {
        assert_eq!(
            (octal("0660"), octal("660"), octal("0o600")),
            (Some(0o660), Some(0o660), Some(0o600))
        );
        for wrong in ["", "66", "0888", "1777", "rw-rw----", "-660", "06600", "+66"] {
            assert_eq!(octal(wrong), None, "{wrong}");
        }
    }
}
