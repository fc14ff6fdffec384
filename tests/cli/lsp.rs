//! `rungd lsp` as an editor starts it: over standard input and output, with a client that also
//! breaks the protocol.

use std::io::Write;
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};

/// The server's outputs and exit code after this input.
fn serve(input: &[u8]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("lsp").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("started");
    child.stdin.take().expect("a pipe").write_all(input).expect("written");
    child.wait_with_output().expect("ended")
}

fn framed(body: &str) -> String {
    format!("Content-Length: {}\r\n\r\n{body}", body.len())
}

fn request(id: Value, method: &str) -> String {
    let params = json!({ "capabilities": {} });
    framed(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }).to_string())
}

fn notification(method: &str) -> String {
    framed(&json!({ "jsonrpc": "2.0", "method": method, "params": {} }).to_string())
}

/// Checks the exit code, the codes of the errors sent to the editor, and standard error.
fn check(input: &str, code: i32, errors: &[i64], stderr: &str) {
    let output = serve(input.as_bytes());
    let written = String::from_utf8(output.stdout).expect("text");
    let bodies = written.split("Content-Length: ").filter_map(|part| part.split_once("\r\n\r\n"));
    let codes: Vec<i64> = bodies
        .filter_map(|(_, body)| {
            serde_json::from_str::<Value>(body).expect("JSON")["error"]["code"].as_i64()
        })
        .collect();
    assert_eq!(codes, errors, "{written}");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(said, stderr);
    assert_eq!(output.status.code(), Some(code));
}

fn begun() -> String {
    request(json!(1), "initialize") + &notification("initialized")
}

#[test]
fn the_exit_code_shows_whether_the_shutdown_was_requested() {
    let ended = request(json!(2), "shutdown") + &notification("exit");
    check(&(begun() + &ended), 0, &[], "");
    check(&(begun() + &notification("exit")), 1, &[], "");
    check(&begun(), 1, &[], "");
    check(&notification("exit"), 1, &[], "");
}

#[test]
fn the_initialize_answer_lists_the_capabilities() {
    let output = serve(begun().as_bytes());
    let written = String::from_utf8(output.stdout).expect("text");
    let (_, body) = written.split_once("\r\n\r\n").expect("a body");
    let answer: Value = serde_json::from_str(body).expect("JSON");
    assert_eq!(answer["result"]["capabilities"]["hoverProvider"], true, "{body}");
}

#[test]
fn requests_before_initialize_are_refused() {
    let early = request(json!(0), "textDocument/hover") + &notification("textDocument/didOpen");
    let odd = framed(r#"{"jsonrpc":"2.0","id":0,"method":"initialize","params":7}"#);
    let ended = request(json!(2), "shutdown") + &notification("exit");
    check(&(early + &odd + &begun() + &ended), 0, &[-32002, -32602], "");
}

#[test]
fn invalid_messages_do_not_end_the_server() {
    let ended = request(json!("end"), "shutdown") + &notification("exit");
    let odd = [
        framed("{"),
        framed("[]"),
        request(json!(1_u64 << 40), "textDocument/hover"),
        request(json!(3), "textDocument/hover"),
        request(json!(4), "textDocument/none"),
    ];
    let codes = [-32700, -32600, -32600, -32602, -32601];
    check(&(begun() + &odd.concat() + &ended), 0, &codes, "");
}

#[test]
fn a_broken_header_ends_the_server_with_a_reason() {
    let broken = begun() + "Content-Length: many\r\n\r\n";
    let why = "rungd: standard input: a header has no number after Content-Length: \
               `Content-Length: many`\n";
    check(&broken, 74, &[], why);
    let long = begun() + &format!("Content-Length: {}\r\n\r\n{{", u64::MAX);
    check(&long, 1, &[-32600], "");
}
