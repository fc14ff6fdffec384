//! `[operator]`: its keys, and the settings made from them: a path of a valid length, permissions
//! as a number. Only run time shows whether the group exists and the socket can be made.

use crate::source::finding::{Code, Finding};
use crate::source::key::key;
use crate::source::reader::{Table, Text};
use crate::source::span::Span;

/// `[operator]`.
#[derive(Clone, Debug)]
pub struct WrittenOperator {
    /// The place of its header.
    pub(crate) span: Span,
    /// `enabled`: whether there is a socket.
    pub(crate) enabled: bool,
    /// `socket`: its path, relative to the controller file.
    pub(crate) socket: Option<Text>,
    /// `mode`: its permissions, in octal digits.
    pub(crate) mode: Option<Text>,
    /// `group`: its group, by name or number.
    pub(crate) group: Option<Text>,
}

/// The settings of the operator's socket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operator {
    /// Whether there is a socket.
    pub(crate) enabled: bool,
    /// Its path, relative to the controller file; if not given, the daemon's default path.
    pub(crate) socket: Option<String>,
    /// Its permissions.
    pub(crate) mode: u32,
    /// Its group, by name or number; if not given, the daemon's own.
    pub(crate) group: Option<String>,
}

impl Default for Operator {
    fn default() -> Self {
        Operator { enabled: true, socket: None, mode: 0o660, group: None }
    }
}

/// The longest path. The system's limit is 107 bytes, and the socket is made under a longer,
/// temporary name.
pub(crate) const SOCKET_BYTES_MAX: usize = 103;

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
            key("mode", "Its permissions in octal digits; 0660 if not given.")
                .limited(r#"{"pattern":"^(0o)?0?[0-7]{3}$"}"#),
        ),
        group: table
            .string(key("group", "Its group, by name or number; members may give commands.")),
    };
    table.finish();
    operator
}

/// Makes the settings from the keys, with a finding for each wrong value.
pub fn resolve(written: &WrittenOperator, findings: &mut Vec<Finding>) -> Operator {
    let mut wrong = |text: &Text, message: String, help: &str| {
        findings.push(Finding::new(Code::Controller, text.span, message).help(help));
    };
    let mut operator = Operator { enabled: written.enabled, ..Operator::default() };
    if let Some(socket) = &written.socket {
        let path = &socket.text;
        if path.is_empty() || path.ends_with('/') || path.contains('\0') {
            wrong(
                socket,
                "a socket is a file".into(),
                "write `socket = \"/run/rungd/rungd.sock\"`",
            );
        } else if path.len() > SOCKET_BYTES_MAX {
            let message = format!("a socket's path has at most {SOCKET_BYTES_MAX} bytes");
            wrong(socket, message, "choose a shorter one, as `/run/rungd/rungd.sock`");
        }
        operator.socket = Some(path.clone());
    }
    if let Some(mode) = &written.mode {
        match octal(&mode.text) {
            Some(bits) => operator.mode = bits,
            None => {
                let message = format!("`{}` is no file mode", mode.text);
                wrong(mode, message, "write it in octal digits: `mode = \"0660\"`");
            }
        }
    }
    if let Some(group) = &written.group {
        let odd = |c: char| c.is_whitespace() || c.is_control() || c == ':';
        if group.text.is_empty() || group.text.contains(odd) {
            let message = format!("`{}` is no group", group.text);
            wrong(group, message, "write its name or number: `group = \"rungd\"`");
        }
        operator.group = Some(group.text.clone());
    }
    operator
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
