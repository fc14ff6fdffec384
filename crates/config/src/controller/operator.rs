//! `[operator]`: its keys, and the settings made from them: paths of a valid length, permissions as
//! numbers. Only run time shows whether the groups exist and the sockets can be made.

use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::key::key;
use rungd_language::source::reader::{Table, Text};
use rungd_language::source::span::Span;
use rungd_language::source::wording::is_unseen;

/// `[operator]`.
#[derive(Clone, Debug)]
pub struct WrittenOperator {
    /// The place of its header.
    pub(crate) span: Span,
    /// `enabled`: whether there is a socket.
    pub enabled: bool,
    /// `socket`: its path, relative to the controller file.
    pub(crate) socket: Option<Text>,
    /// `mode`: its permissions, in octal digits.
    pub(crate) mode: Option<Text>,
    /// `group`: its group, by name or number.
    pub(crate) group: Option<Text>,
    /// `view-socket`: the path of the view socket, relative to the controller file.
    pub(crate) view_socket: Option<Text>,
    /// `view-mode`: its permissions, in octal digits.
    pub(crate) view_mode: Option<Text>,
    /// `view-group`: its group, by name or number.
    pub(crate) view_group: Option<Text>,
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
/// The form of permissions, for the schema.
const MODE_FORM: &str = r#"{"pattern":"^(0o)?0?[0-7]{3}$"}"#;

/// The longest path. The system's limit is 107 bytes, and the socket is made under a longer,
/// temporary name.
pub const SOCKET_BYTES_MAX: usize = 103;

/// Reads `[operator]`, if there is one.
pub(super) fn read_in(root: &mut Table<'_>) -> Option<WrittenOperator> {
    let explained = key("operator", "The socket for operators' questions and commands.");
    root.table(explained, "`[operator]`").map(read)
}

fn read(mut table: Table<'_>) -> WrittenOperator {
    let operator = WrittenOperator {
        span: table.span(),
        enabled: table
            .boolean(key("enabled", "Whether there is a socket; true if not given."))
            .is_none_or(|enabled| enabled.value),
        socket: table.string(key(
            "socket",
            "Its path, relative to this file; if not given, in systemd's runtime folder.",
        )),
        mode: table.string(
            key("mode", "Its permissions in octal digits; 0660 if not given.").limited(MODE_FORM),
        ),
        group: table
            .string(key("group", "Its group, by name or number; members may give commands.")),
        view_socket: table.string(key(
            "view-socket",
            "A second socket, which refuses every change; `rungd-view.sock` beside `rungd.sock` if \
             not given.",
        )),
        view_mode: table.string(
            key("view-mode", "The permissions of `view-socket`; `mode` if not given.")
                .limited(MODE_FORM),
        ),
        view_group: table.string(key(
            "view-group",
            "The group of `view-socket`: members may look, and change nothing.",
        )),
    };
    table.finish();
    operator
}

/// Makes the settings from the keys, with a finding for each wrong value.
pub fn resolve(written: &WrittenOperator, findings: &mut Vec<Finding>) -> Operator {
    let none = Operator::default();
    let mut judged = Judged(findings);
    Operator {
        enabled: written.enabled,
        socket: judged.socket(written.socket.as_ref(), "socket", "rungd.sock"),
        mode: judged.mode(written.mode.as_ref(), "mode").unwrap_or(none.mode),
        group: judged.group(written.group.as_ref(), "group", "rungd"),
        view: ViewSocket {
            socket: judged.socket(written.view_socket.as_ref(), "view-socket", "rungd-view.sock"),
            mode: judged.mode(written.view_mode.as_ref(), "view-mode"),
            group: judged.group(written.view_group.as_ref(), "view-group", "rungd-view"),
        },
    }
}

/// The values of the keys of one socket, judged; `key` names the key.
struct Judged<'a>(&'a mut Vec<Finding>);

impl Judged<'_> {
    fn wrong(&mut self, text: &Text, message: String, help: &str) {
        self.0.push(Finding::new(Code::Controller, text.span, message).help(help));
    }

    fn socket(&mut self, socket: Option<&Text>, key: &str, name: &str) -> Option<String> {
        let socket = socket?;
        let path = &socket.text;
        if path.is_empty() || path.ends_with('/') || path.contains('\0') {
            let help = format!("write `{key} = \"/run/rungd/{name}\"`");
            self.wrong(socket, "a socket is a file".into(), &help);
        } else if path.len() > SOCKET_BYTES_MAX {
            let message = format!("a socket's path has at most {SOCKET_BYTES_MAX} bytes");
            self.wrong(socket, message, &format!("choose a shorter one, as `/run/rungd/{name}`"));
        }
        Some(path.clone())
    }

    fn mode(&mut self, mode: Option<&Text>, key: &str) -> Option<u32> {
        let mode = mode?;
        let bits = octal(&mode.text);
        if bits.is_none() {
            let message = format!("`{}` is no file mode", mode.text);
            self.wrong(mode, message, &format!("write it in octal digits: `{key} = \"0660\"`"));
        }
        bits
    }

    fn group(&mut self, group: Option<&Text>, key: &str, name: &str) -> Option<String> {
        let group = group?;
        let odd = |c: char| c.is_whitespace() || is_unseen(c) || c == ':';
        if group.text.is_empty() || group.text.contains(odd) {
            let message = format!("`{}` is no group", group.text);
            self.wrong(group, message, &format!("write its name or number: `{key} = \"{name}\"`"));
        }
        Some(group.text.clone())
    }
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
    fn modes_are_octal() {
        assert_eq!(
            (octal("0660"), octal("660"), octal("0o600")),
            (Some(0o660), Some(0o660), Some(0o600))
        );
        for wrong in ["", "66", "0888", "1777", "rw-rw----", "-660", "06600", "+66"] {
            assert_eq!(octal(wrong), None, "{wrong}");
        }
    }
}
