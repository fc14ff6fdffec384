//! Reads and writes the messages of the protocol on standard input and output.
//!
//! `cli::lsp` opens it and passes the connection to `server`. A frame that contains no message is
//! answered with an error and skipped. Only a broken header ends the connection, because then the
//! start of the next message is unknown. The crate lsp-server defines the messages themselves.

use std::io::{self, BufRead, Read, Write};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use anyhow::{Context, Result, anyhow};
use crossbeam_channel::{Sender, bounded};
use lsp_server::{Connection, ErrorCode, Message};
use serde_json::{Value, json};

use rungd_base::locked::locked;

/// The longest line of a header, in bytes.
const HEADER_LINE_MAX: u64 = 4096;

/// The longest message, in bytes: a ladder of the maximum size, with each character escaped.
const BODY_MAX: u64 = 1 << 30;

/// A connection, and the threads that read and write it.
#[derive(Debug)]
pub struct EditorConnection {
    reader: JoinHandle<Result<()>>,
    writer: JoinHandle<io::Result<()>>,
}

/// The output for messages; both threads write to it.
#[derive(Debug)]
struct SharedOutput<W>(Arc<Mutex<W>>);

/// A refused message: the ID for the answer, and the reason.
#[derive(Debug)]
struct RefusedMessage {
    id: Value,
    code: ErrorCode,
    why: String,
}

impl EditorConnection {
    /// Starts to read standard input and to write standard output.
    ///
    /// # Errors
    /// The system cannot create the threads.
    pub fn open() -> Result<(Connection, EditorConnection)> {
        let (sender, outgoing) = bounded::<Message>(0);
        let (incoming, receiver) = bounded(0);
        let output = SharedOutput(Arc::new(Mutex::new(io::stdout())));
        let for_errors = SharedOutput(output.0.clone());
        let read = move || read(&mut io::stdin().lock(), &incoming, &for_errors);
        let write = move || outgoing.into_iter().try_for_each(|message| output.write(&message));
        let reader = thread::Builder::new().name("lsp-reader".to_owned()).spawn(read)?;
        let writer = thread::Builder::new().name("lsp-writer".to_owned()).spawn(write)?;
        Ok((Connection { sender, receiver }, EditorConnection { reader, writer }))
    }

    /// Waits until all messages are written. The connection must be dropped before.
    ///
    /// # Errors
    /// Standard input or output failed, or a header of the input is broken.
    pub fn close(self) -> Result<()> {
        let ended = |_| anyhow!("a thread has ended");
        self.reader.join().map_err(ended)?.context("standard input")?;
        self.writer.join().map_err(ended)?.context("standard output")
    }
}

impl<W: Write> SharedOutput<W> {
    fn write(&self, message: &Message) -> io::Result<()> {
        message.write(&mut *locked(&self.0))
    }

    /// Answers a frame that contains no message. The message types are not used, because they allow
    /// no null as an ID.
    fn refuse(&self, RefusedMessage { id, code, why }: RefusedMessage) -> io::Result<()> {
        let error = json!({ "code": code as i32, "message": why });
        let text = json!({ "jsonrpc": "2.0", "id": id, "error": error }).to_string();
        let mut output = locked(&self.0);
        write!(output, "Content-Length: {}\r\n\r\n{text}", text.len())?;
        output.flush()
    }
}

/// Forwards all messages until the end of the input, or the notification `exit`.
fn read<W: Write>(
    input: &mut impl BufRead,
    messages: &Sender<Message>,
    output: &SharedOutput<W>,
) -> Result<()> {
    while let Some(length) = header(input)? {
        if length > BODY_MAX {
            io::copy(&mut input.by_ref().take(length), &mut io::sink())?;
            let why = format!("a message of {length} bytes is too long: at most {BODY_MAX}");
            output.refuse(RefusedMessage {
                id: Value::Null,
                code: ErrorCode::InvalidRequest,
                why,
            })?;
            continue;
        }
        let mut body = Vec::new();
        input.by_ref().take(length).read_to_end(&mut body)?;
        if (body.len() as u64) < length {
            return Ok(());
        }
        match message(&body) {
            Ok(Some(message)) => {
                let is_exit = matches!(&message, Message::Notification(of) if of.method == "exit");
                if messages.send(message).is_err() || is_exit {
                    return Ok(());
                }
            }
            Ok(None) => {}
            Err(refused) => output.refuse(refused)?,
        }
    }
    Ok(())
}

/// The length of the message after a header; `None` at the end of the input.
fn header(input: &mut impl BufRead) -> io::Result<Option<u64>> {
    let broken = |why: String| Err(io::Error::new(io::ErrorKind::InvalidData, why));
    let mut length = None;
    loop {
        let mut line = Vec::new();
        if input.by_ref().take(HEADER_LINE_MAX).read_until(b'\n', &mut line)? == 0 {
            return Ok(None);
        }
        let line = std::str::from_utf8(&line).ok().and_then(|line| line.strip_suffix('\n'));
        let Some(line) = line.map(str::trim) else {
            return broken("a line of a header is not text, or is too long".to_owned());
        };
        if line.is_empty() {
            break;
        }
        let Some((name, value)) = line.split_once(':') else {
            return broken(format!("a line of a header has no colon: `{line}`"));
        };
        if name.trim().eq_ignore_ascii_case("content-length") {
            let Ok(bytes) = value.trim().parse() else {
                return broken(format!("a header has no number after Content-Length: `{line}`"));
            };
            length = Some(bytes);
        }
    }
    match length {
        Some(length) => Ok(Some(length)),
        None => broken("a header has no Content-Length".to_owned()),
    }
}

/// The message in a body; `None` for an unreadable response, because responses get no answer.
fn message(body: &[u8]) -> Result<Option<Message>, RefusedMessage> {
    let refused = |id, code, why| Err(RefusedMessage { id, code, why });
    let value: Value = match serde_json::from_slice(body) {
        Ok(value) => value,
        Err(error) => {
            let why = format!("a message is not JSON: {error}");
            return refused(Value::Null, ErrorCode::ParseError, why);
        }
    };
    let id = value.get("id").cloned().unwrap_or_default();
    let is_answer = value.get("result").is_some() || value.get("error").is_some();
    match serde_json::from_value(value) {
        Ok(Message::Notification(_)) if !id.is_null() => {
            let why = "the ID of a request is a text, or an integer of 32 bits".to_owned();
            refused(id, ErrorCode::InvalidRequest, why)
        }
        Ok(message) => Ok(Some(message)),
        Err(_) if is_answer => Ok(None),
        Err(_) => {
            let why = "neither a request, nor an answer, nor a notification".to_owned();
            refused(id, ErrorCode::InvalidRequest, why)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn framed(body: &str) -> String {
        format!("Content-Length: {}\r\n\r\n{body}", body.len())
    }

    /// Checks the messages that are read from an input, the answer, and the error at the end.
    fn check(input: &str, methods: &[&str], answered: &str, end: &str) {
        let (send, messages) = crossbeam_channel::unbounded();
        let output: SharedOutput<Vec<u8>> = SharedOutput(Arc::default());
        let ended: Result<()> = read(&mut input.as_bytes(), &send, &output);
        drop(send);
        let method = |message: Message| match message {
            Message::Request(of) => of.method,
            Message::Notification(of) => of.method,
            Message::Response(of) => format!("answer {}", of.id),
        };
        assert_eq!(messages.iter().map(method).collect::<Vec<_>>(), methods, "{input}");
        let written = output.0.lock().unwrap().clone();
        assert_eq!(answered.is_empty(), written.is_empty(), "{input}");
        assert!(String::from_utf8(written).unwrap().contains(answered), "{input}");
        assert_eq!(ended.err().map(|error| format!("{error:#}")).unwrap_or_default(), end);
    }

    #[test]
    fn an_invalid_message_is_answered_with_an_error_and_the_next_is_read() {
        let next = framed(r#"{"method":"next"}"#);
        let after = |body: &str| framed(body) + &next;
        check(&after("{"), &["next"], "-32700", "");
        check(&after("[]"), &["next"], "-32600", "");
        check(&after("\"\""), &["next"], "-32600", "");
        check(&after(&"[".repeat(100_000)), &["next"], "-32700", "");
        check(&after(r#"{"id":7}"#), &["next"], r#""id":7"#, "");
        check(&after(r#"{"id":5000000000,"method":"a"}"#), &["next"], r#""id":5000000000"#, "");
        check(&after(r#"{"id":null,"error":{}}"#), &["next"], "", "");
        check(&after(r#"{"id":1,"result":null}"#), &["answer 1", "next"], "", "");
        check(&after(r#"{"id":"a","method":"b"}"#), &["b", "next"], "", "");
    }

    #[test]
    fn an_unreadable_header_ends_the_connection_with_a_reason() {
        check("\r\n{}", &[], "", "a header has no Content-Length");
        check("GET / HTTP/1.1\r\n", &[], "", "a line of a header has no colon: `GET / HTTP/1.1`");
        let minus = "a header has no number after Content-Length: `Content-Length: -1`";
        check("Content-Length: -1\r\n\r\n", &[], "", minus);
        let long = "a line of a header is not text, or is too long";
        check(&"a".repeat(100_000), &[], "", long);
    }

    #[test]
    fn the_end_of_the_input_ends_the_connection_without_an_error() {
        check("", &[], "", "");
        check("Content-Length: 100\r\n\r\n{", &[], "", "");
        check(&format!("Content-Length: {}\r\n\r\n{{", u64::MAX), &[], "too long", "");
        let exit = framed(r#"{"method":"exit"}"#);
        check(&(exit + &framed(r#"{"method":"next"}"#)), &["exit"], "", "");
    }
}
