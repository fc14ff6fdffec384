//! A minimal editor for tests: opens files of a folder, edits them, sends requests, and stores the
//! diagnostics that it receives.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Duration;

use lsp_server::{Connection, Message, Notification, Request, RequestId, Response};
use rungd_lsp::EditorEnd;
use serde_json::{Value, json};

use rungd_test_support::patience::PATIENCE;

/// An editor and its server, which is a thread of the test.
pub struct Editor {
    connection: Option<Connection>,
    server: Option<JoinHandle<EditorEnd>>,
    /// The folder in `/proc` of the server's thread.
    thread: PathBuf,
    folder: PathBuf,
    number: i32,
    versions: BTreeMap<String, i32>,
    /// The diagnostics by the file's URI, with the version of its text.
    diagnostics: RefCell<BTreeMap<String, Shown>>,
    /// The other notifications and requests of the server, in order.
    pub told: RefCell<Vec<Value>>,
}

/// A version, and its diagnostics.
type Shown = (Option<i64>, Vec<Value>);

impl Editor {
    /// An editor of a folder, without optional capabilities.
    pub fn new(folder: &Path) -> Editor {
        Editor::with(folder, json!({}))
    }

    /// An editor with these capabilities.
    pub fn with(folder: &Path, capabilities: Value) -> Editor {
        let (connection, server) = Connection::memory();
        let (tell_thread, thread) = std::sync::mpsc::channel();
        let serve = move || {
            let of = std::fs::read_link("/proc/thread-self").expect("the kernel knows the thread");
            tell_thread.send(Path::new("/proc").join(of)).expect("the editor waits for it");
            rungd_lsp::serve(&server).expect("the server ends well")
        };
        let mut editor = Editor {
            connection: Some(connection),
            server: Some(std::thread::spawn(serve)),
            thread: thread.recv().expect("the server has begun"),
            folder: folder.canonicalize().expect("the folder is there"),
            number: 0,
            versions: BTreeMap::new(),
            diagnostics: RefCell::default(),
            told: RefCell::default(),
        };
        let root = format!("file://{}", editor.folder.display());
        let params = json!({ "capabilities": capabilities, "rootUri": root });
        editor.ask("initialize", params);
        editor.tell("initialized", json!({}));
        editor
    }

    /// The URI of a file of the folder.
    pub fn uri(&self, name: &str) -> String {
        format!("file://{}", self.folder.join(name).display())
    }

    /// The text of a file on disk.
    pub fn disk(&self, name: &str) -> String {
        std::fs::read_to_string(self.folder.join(name)).expect("the file is there")
    }

    /// Whether a file is on disk.
    pub fn is_there(&self, name: &str) -> bool {
        self.folder.join(name).exists()
    }

    /// Opens a file with the text on disk.
    pub fn open(&mut self, name: &str) {
        let text = self.disk(name);
        self.open_with(name, &text);
    }

    /// Opens a file with this text instead of the text on disk.
    pub fn open_with(&mut self, name: &str, text: &str) {
        let version = self.next_version(name);
        let uri = self.uri(name);
        let document =
            json!({ "uri": uri, "languageId": "toml", "version": version, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// Closes a file.
    pub fn close(&mut self, name: &str) {
        self.versions.remove(name);
        let document = json!({ "uri": self.uri(name) });
        self.tell("textDocument/didClose", json!({ "textDocument": document }));
    }

    /// Replaces the whole text of an open file.
    pub fn replace(&mut self, name: &str, text: &str) {
        self.edit(name, json!([{ "text": text }]));
    }

    /// Changes parts of an open file; `changes` are content changes of the protocol.
    pub fn edit(&mut self, name: &str, changes: Value) {
        let version = self.next_version(name);
        let document = json!({ "uri": self.uri(name), "version": version });
        let params = json!({ "textDocument": document, "contentChanges": changes });
        self.tell("textDocument/didChange", params);
    }

    fn next_version(&mut self, name: &str) -> i32 {
        let version = self.versions.entry(name.to_owned()).or_default();
        *version += 1;
        *version
    }

    /// Waits for the diagnostics of a file's present text, and returns them.
    pub fn diagnostics(&mut self, name: &str) -> Vec<Value> {
        let (uri, version) = (self.uri(name), self.versions.get(name).copied().map(i64::from));
        loop {
            if let Some((of, diagnostics)) = self.diagnostics.borrow().get(&uri)
                && *of == version
            {
                return diagnostics.clone();
            }
            let message = self.next();
            self.take(message);
        }
    }

    /// All diagnostics as the server last sent them, by URI.
    pub fn all_diagnostics(&self) -> BTreeMap<String, Vec<Value>> {
        let all = self.diagnostics.borrow();
        all.iter().map(|(uri, (_, of))| (uri.clone(), of.clone())).collect()
    }

    /// Sends a request and returns the result. It must not be refused.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        let response = self.respond(method, params);
        response.response_result.unwrap_or_else(|error| panic!("{method}: {error:?}"))
    }

    /// Sends a request and returns the answer, which may be a refusal.
    pub fn respond(&mut self, method: &str, params: Value) -> Response {
        self.number += 1;
        let id = RequestId::from(self.number);
        self.send(Request { id: id.clone(), method: method.to_owned(), params }.into());
        loop {
            match self.next() {
                Message::Response(response) if response.id == id => return response,
                other => self.take(other),
            }
        }
    }

    /// As [`Editor::ask`], about a place in a file.
    pub fn ask_at(&mut self, method: &str, name: &str, line: usize, column: usize) -> Value {
        let position = json!({ "line": line, "character": column });
        let document = json!({ "uri": self.uri(name) });
        let context = json!({ "includeDeclaration": true });
        let params = json!({ "textDocument": document, "position": position, "context": context });
        self.ask(method, params)
    }

    /// Sends a notification to the server.
    pub fn tell(&mut self, method: &str, params: Value) {
        self.send(Notification { method: method.to_owned(), params }.into());
    }

    /// The processor time that the server's own thread has taken, without that of the threads it
    /// starts.
    pub fn server_time(&self) -> Duration {
        let told = std::fs::read_to_string(self.thread.join("schedstat")).expect("the thread runs");
        let ran = told.split(' ').next().and_then(|ns| ns.parse().ok()).expect("nanoseconds");
        Duration::from_nanos(ran)
    }

    fn connection(&self) -> &Connection {
        self.connection.as_ref().expect("the connection is open")
    }

    fn send(&self, message: Message) {
        self.connection().sender.send(message).expect("the server listens");
    }

    fn next(&self) -> Message {
        self.connection().receiver.recv_timeout(PATIENCE).expect("the server answers")
    }

    /// Waits for the next notification or request of the server.
    pub fn hear(&mut self) {
        let message = self.next();
        self.take(message);
    }

    fn take(&self, message: Message) {
        match message {
            Message::Notification(told) if told.method == "textDocument/publishDiagnostics" => {
                let uri = told.params["uri"].as_str().expect("a URI").to_owned();
                let all = told.params["diagnostics"].as_array().expect("diagnostics").clone();
                let version = told.params["version"].as_i64();
                self.diagnostics.borrow_mut().insert(uri, (version, all));
            }
            Message::Notification(told) => {
                let (method, params) = (told.method, told.params);
                self.told.borrow_mut().push(json!({ "method": method, "params": params }));
            }
            Message::Request(asked) => {
                let (method, params) = (asked.method, asked.params);
                self.told.borrow_mut().push(json!({ "method": method, "params": params }));
                self.send(Response::new_ok(asked.id, Value::Null).into());
            }
            Message::Response(response) => panic!("an answer that nobody waits for: {response:?}"),
        }
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        self.connection = None;
        let end = self.server.take().expect("it runs").join().expect("the server did not panic");
        assert_eq!(end, EditorEnd::Shutdown);
    }
}

/// The place of `wanted` in a text: line and column of its first byte, in bytes.
pub fn place_of(text: &str, wanted: &str) -> (usize, usize) {
    let at = text.find(wanted).unwrap_or_else(|| panic!("`{wanted}` is not in the text"));
    let line = text[..at].matches('\n').count();
    (line, at - text[..at].rfind('\n').map_or(0, |end| end + 1))
}
