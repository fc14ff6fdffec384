//! The loop of the server: messages of the editor in, answers and diagnostics out.
//!
//! `cli::lsp` calls [`serve`] with a connection; tests use a connection in memory. Requests are
//! answered here, one after the other, from texts that are up to date. Judging runs on its own
//! thread (`judge`).

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, Sender, select};
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{
    DidChangeConfiguration, DidChangeTextDocument, DidChangeWatchedFiles, DidCloseTextDocument,
    DidOpenTextDocument, DidSaveTextDocument, Exit, Initialized, Notification as _,
    PublishDiagnostics,
};
use lsp_types::request::{Initialize, Request as _, Shutdown};
use lsp_types::{
    DidChangeTextDocumentParams, DidChangeWatchedFilesParams, DidCloseTextDocumentParams,
    DidOpenTextDocumentParams, InitializeParams, PublishDiagnosticsParams,
};

use super::complete::proposal::ItemAbilities;
use super::jobs::{JobReport, Jobs};
use super::judge::{self, JudgeOrder, JudgedRoot, Judgement};
use super::lines::ColumnUnit;
use super::live_poller::{self, LiveNews, LiveOrder};
use super::outbox::Outbox;
use super::requests::DiskCare;
use super::uri::{path_of, uri_of};
use super::workspace::Workspace;
use super::{capabilities, commands, diagnostics, edits, live_targets, requests};

/// The error of a message that cannot be sent.
const CLOSED: &str = "the editor has closed the connection";

/// The refusal of edits of files that another program has changed meanwhile.
const OUTDATED: &str = "files of the project changed on disk while the edit was made: try again";

/// How an editor has ended the connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EditorEnd {
    /// It sent the request `shutdown`.
    Shutdown,
    /// It sent `exit` without `shutdown`, or closed its end of the connection.
    Gone,
}

/// Serves an editor until it ends the connection.
///
/// # Errors
/// The connection breaks, or the editor does not follow the protocol.
pub fn serve(connection: &Connection) -> Result<EditorEnd> {
    let Some((id, params)) = begun(connection)? else { return Ok(EditorEnd::Gone) };
    let general = params.capabilities.general.as_ref();
    let columns = ColumnUnit::of(general.and_then(|general| general.position_encodings.as_ref()));
    let told = capabilities::of(columns);
    connection.sender.send(Response::new_ok(id, told).into()).context(CLOSED)?;
    let (orders, judgements) = judge::start();
    let (live, news) = live_poller::start();
    let (jobs, reports) = Jobs::new();
    let client = params.capabilities;
    let mut workspace = Workspace::new(columns, jobs, Outbox::new(client.clone()));
    workspace.can = ItemAbilities::of(&client);
    workspace.client = client;
    let sender = connection.sender.clone();
    let mut server = EditorServer {
        sender,
        orders,
        live,
        workspace,
        published: BTreeSet::new(),
        ordered: (0, Vec::new()),
    };
    if let Some(settings) = params.initialization_options {
        server.workspace.configure(&settings);
    }
    server.run(connection, &ServerNews { judgements, news, reports })
}

/// Waits for the request `initialize`; `None` if the editor ends the connection before. Earlier
/// requests are refused.
fn begun(connection: &Connection) -> Result<Option<(RequestId, InitializeParams)>> {
    let refuse = |id: RequestId, code: ErrorCode, why: String| {
        let message = Response::new_err(id, code as i32, why).into();
        connection.sender.send(message).context(CLOSED)
    };
    for message in &connection.receiver {
        match message {
            Message::Request(request) if request.method == Initialize::METHOD => {
                match serde_json::from_value(request.params) {
                    Ok(params) => return Ok(Some((request.id, params))),
                    Err(error) => {
                        let why = format!("the parameters of `initialize`: {error}");
                        refuse(request.id, ErrorCode::InvalidParams, why)?;
                    }
                }
            }
            Message::Request(request) => {
                let why = format!("`{}` comes before `initialize`", request.method);
                refuse(request.id, ErrorCode::ServerNotInitialized, why)?;
            }
            Message::Notification(told) if told.method == Exit::METHOD => break,
            Message::Notification(_) | Message::Response(_) => {}
        }
    }
    Ok(None)
}

/// A server and its editor.
pub(super) struct EditorServer {
    sender: Sender<Message>,
    orders: Sender<JudgeOrder>,
    live: Sender<LiveOrder>,
    workspace: Workspace,
    /// The files that have diagnostics in the editor.
    published: BTreeSet<PathBuf>,
    /// The last order to `judge`: the number of the change, and the roots.
    ordered: (u64, Vec<JudgedRoot>),
}

/// The channels from the other threads.
struct ServerNews {
    judgements: Receiver<Judgement>,
    news: Receiver<LiveNews>,
    reports: Receiver<JobReport>,
}

impl EditorServer {
    fn run(&mut self, connection: &Connection, others: &ServerNews) -> Result<EditorEnd> {
        loop {
            self.flush()?;
            select! {
                recv(connection.receiver) -> message => match message {
                    Ok(Message::Request(request)) => {
                        if request.method == Shutdown::METHOD {
                            self.send(Response::new_ok(request.id, ()).into())?;
                            self.end(connection)?;
                            return Ok(EditorEnd::Shutdown);
                        }
                        self.answer(request)?;
                    }
                    Ok(Message::Notification(told)) if told.method == Exit::METHOD => {
                        return Ok(EditorEnd::Gone);
                    }
                    Ok(Message::Notification(told)) => self.hear(told)?,
                    Ok(Message::Response(response)) => {
                        self.workspace.outbox.answered(&response.id);
                    }
                    Err(_) => return Ok(EditorEnd::Gone),
                },
                recv(others.judgements) -> judgement => {
                    self.judged(judgement.context("the thread that judges has ended")?)?;
                }
                recv(others.news) -> news => {
                    let news = news.context("the thread of the live view has ended")?;
                    self.workspace.live.hear(news, &mut self.workspace.outbox);
                }
                recv(others.reports) -> report => {
                    self.reported(report.context("the server has ended")?)?;
                }
            }
        }
    }

    /// Waits for the end of the connection. The editor may still answer earlier requests.
    fn end(&self, connection: &Connection) -> Result<()> {
        while let Ok(message) = connection.receiver.recv() {
            match message {
                Message::Notification(told) if told.method == Exit::METHOD => break,
                Message::Request(request) => {
                    let (code, words) = (ErrorCode::InvalidRequest as i32, "the server has ended");
                    self.send(Response::new_err(request.id, code, words.to_owned()).into())?;
                }
                Message::Notification(_) | Message::Response(_) => {}
            }
        }
        Ok(())
    }

    fn send(&self, message: Message) -> Result<()> {
        self.sender.send(message).context(CLOSED)
    }

    /// Sends the messages of the outbox, and updates the targets of the live view.
    fn flush(&mut self) -> Result<()> {
        if self.workspace.live.is_stale() {
            let targets = live_targets::targets(&self.workspace);
            let order = self.workspace.live.aim(targets, &mut self.workspace.outbox);
            if let Some(order) = order {
                self.live.send(order).context("the thread of the live view has ended")?;
            }
        }
        self.workspace.outbox.take().into_iter().try_for_each(|message| self.send(message))
    }

    /// Shows the result of a job, unless a newer job has replaced it.
    fn reported(&mut self, report: JobReport) -> Result<()> {
        let Some(made) = self.workspace.jobs.ended(report) else { return Ok(()) };
        commands::done(&mut self.workspace, made);
        self.publish()
    }

    fn answer(&mut self, request: Request) -> Result<()> {
        let id = request.id.clone();
        let care = requests::disk_care(&request.method);
        self.look_again(care)?;
        let response = match requests::answer(&mut self.workspace, request) {
            Ok(value) => Response::new_ok(id, value),
            Err(refused) => Response::new_err(id, refused.code as i32, refused.why),
        };
        // An edit of a text that is no longer there would change a different place.
        let response = match self.look_again(care)? {
            true => response,
            false => Response::new_err(
                response.id,
                ErrorCode::ContentModified as i32,
                OUTDATED.to_owned(),
            ),
        };
        self.send(response.into())
    }

    /// Compares the files with the disk before edits of them are made or handed out. If they
    /// differ, they are read and judged again, and the result is `false`.
    fn look_again(&mut self, care: DiskCare) -> Result<bool> {
        let is_present = match care {
            DiskCare::Shows => true,
            DiskCare::EditsOne => self.workspace.library.is_present(false),
            DiskCare::EditsAll => self.workspace.library.is_present(true),
        };
        if !is_present {
            self.workspace.changed();
            self.order()?;
        }
        Ok(is_present)
    }

    /// Handles a notification of the editor. Ignores an unreadable or unknown notification.
    fn hear(&mut self, told: Notification) -> Result<()> {
        match told.method.as_str() {
            DidOpenTextDocument::METHOD => {
                let Ok(of) = serde_json::from_value::<DidOpenTextDocumentParams>(told.params)
                else {
                    return Ok(());
                };
                let document = of.text_document;
                let Some(path) = path_of(&document.uri) else { return Ok(()) };
                self.workspace.library.open(&path, document.text.into());
                self.workspace.versions.insert(path, document.version);
            }
            DidChangeTextDocument::METHOD => {
                let Ok(of) = serde_json::from_value::<DidChangeTextDocumentParams>(told.params)
                else {
                    return Ok(());
                };
                let Some(path) = path_of(&of.text_document.uri) else { return Ok(()) };
                let library = &self.workspace.library;
                let Some(text) = edits::applied(library, &path, of.content_changes) else {
                    return Ok(());
                };
                self.order_ahead(&path, &text)?;
                self.workspace.library.open(&path, text);
                self.workspace.versions.insert(path, of.text_document.version);
            }
            DidCloseTextDocument::METHOD => {
                let Ok(of) = serde_json::from_value::<DidCloseTextDocumentParams>(told.params)
                else {
                    return Ok(());
                };
                let Some(path) = path_of(&of.text_document.uri) else { return Ok(()) };
                self.workspace.library.close(&path);
                self.workspace.jobs.closed(&path);
                self.workspace.versions.remove(&path);
            }
            DidChangeConfiguration::METHOD => {
                self.workspace.configure(&told.params["settings"]);
                return Ok(());
            }
            DidChangeWatchedFiles::METHOD => {
                let params = serde_json::from_value::<DidChangeWatchedFilesParams>(told.params);
                let paths = params.into_iter().flat_map(|params| params.changes);
                for path in paths.filter_map(|change| path_of(&change.uri)) {
                    self.workspace.library.forget(&path);
                }
            }
            Initialized::METHOD => {
                self.workspace.outbox.watch();
                return Ok(());
            }
            DidSaveTextDocument::METHOD => {}
            _ => return Ok(()),
        }
        self.workspace.changed();
        self.order()
    }

    /// Orders a judgement of all open files, and removes the judgements of closed files.
    fn order(&mut self) -> Result<()> {
        let roots = self.workspace.roots();
        self.workspace.judged.retain(|root, _| roots.contains(root));
        let (change, texts) = (self.workspace.change, self.workspace.library.texts());
        if self.ordered == (change, roots.clone()) {
            return Ok(());
        }
        self.ordered = (change, roots.clone());
        if roots.is_empty() {
            return self.publish();
        }
        let order = JudgeOrder { change, texts, roots };
        self.orders.send(order).context("the thread that judges has ended")
    }

    /// Orders a judgement of the same roots as before with the new text of a file, which then runs
    /// while this thread reads that text. Most changes do not change the roots. The order gets the
    /// number of the next change.
    fn order_ahead(&mut self, path: &Path, text: &Arc<str>) -> Result<()> {
        let texts = self.workspace.library.texts_with(path, text);
        let (change, roots) = (self.workspace.change + 1, self.ordered.1.clone());
        if roots.is_empty() {
            return Ok(());
        }
        self.ordered.0 = change;
        let order = JudgeOrder { change, texts, roots };
        self.orders.send(order).context("the thread that judges has ended")
    }

    /// Stores and publishes a judgement, unless a newer one will follow or its files are closed.
    fn judged(&mut self, judgement: Judgement) -> Result<()> {
        let is_wanted = self.workspace.roots().contains(&judgement.root);
        if !is_wanted || judgement.change < self.workspace.change {
            return Ok(());
        }
        self.workspace.judged.insert(judgement.root.clone(), judgement);
        self.publish()
    }

    /// Sends the diagnostics of all files, and empty lists for the files that have none any more.
    fn publish(&mut self) -> Result<()> {
        let mut all = diagnostics::all(&self.workspace);
        for path in self.workspace.tests.paths() {
            let Some(file) = self.workspace.library.file(path) else { continue };
            all.entry(path.clone()).or_default().extend(self.workspace.tests.diagnostics(&file));
        }
        #[cfg(feature = "prove")]
        for path in self.workspace.surveys.paths().collect::<BTreeSet<_>>() {
            let Some(file) = self.workspace.library.file(path) else { continue };
            let shown = self.workspace.surveys.diagnostics(&file);
            all.entry(path.clone()).or_default().extend(shown);
        }
        let gone: Vec<PathBuf> =
            self.published.iter().filter(|path| !all.contains_key(*path)).cloned().collect();
        let cleared = gone.into_iter().map(|path| (path, Vec::new()));
        for (path, diagnostics) in all.into_iter().chain(cleared) {
            let Some(uri) = uri_of(&path) else { continue };
            let was_empty = !self.published.contains(&path);
            if was_empty && diagnostics.is_empty() && !self.workspace.library.is_open(&path) {
                continue;
            }
            match diagnostics.is_empty() {
                true => self.published.remove(&path),
                false => self.published.insert(path.clone()),
            };
            let version = self.workspace.versions.get(&path).copied();
            let params = PublishDiagnosticsParams { uri, diagnostics, version };
            let told = Notification::new(PublishDiagnostics::METHOD.to_owned(), params);
            self.send(told.into())?;
        }
        Ok(())
    }
}
