//! The events that a viewer receives five times a second: the power of the rungs in its window, the
//! values of their compares, and the values of operands, of one scan. Server-sent events; only
//! changes are sent.

use std::sync::Arc;

use hyper::StatusCode;
use hyper::body::Bytes;
use serde_json::{Map, Value, json};
use tokio::sync::mpsc;

use super::body::AnswerBody;
use super::query::Query;
use super::reply::{WebFailure, WebResult, typed};
use super::site::WebSite;
use rungd_client::live::{LiveProgram, LiveView, TagValue};
use rungd_client::operator::deadline::Deadline;
use rungd_config::controller::OutputState;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, BlockId, StageId};
use rungd_history::observe::ScanPower;
use rungd_lab::draw::ladder::RungPicture;
use rungd_lab::draw::live_svg;
use rungd_language::resolve::program::BlockKind;
use rungd_language::resolve::value_texts::ValueTexts;

/// The most rungs, and the most values, of a window.
const RUNGS_MAX: usize = 100;
const TAGS_MAX: usize = 300;

/// The key of the present moment of the clock of deadlines: from it a page makes the deadlines of
/// its changes.
const CLOCK: &str = "clock";

/// The part of the program that a viewer shows.
#[derive(Clone, Debug, Default)]
pub(super) struct ProgramWindow {
    /// The rungs of its page.
    own: RungRange,
    /// The rungs of subroutines that are folded out within them; [`RUNGS_MAX`] together.
    within: Vec<RungRange>,
    /// The operands whose values are shown.
    tags: Vec<String>,
}

/// Rungs of a block or Stage.
#[derive(Clone, Debug, Default)]
struct RungRange {
    /// A block, or a Stage with its Program's name.
    element: String,
    /// The first and the last of its rungs, counted from 1.
    from: usize,
    to: usize,
}

/// Some rungs with the key of each in an event.
struct KeyedRungs<'r> {
    element: &'r str,
    rungs: &'r [RungPicture],
    /// What stands before the number of a rung in its key: nothing, or `Dose:`.
    prefix: String,
}

/// The data last sent to a viewer.
#[derive(Default)]
pub(super) struct SentState {
    /// The program, and the cells of the window's operands in it.
    program: Option<(Arc<LiveProgram>, Vec<Option<Cell>>)>,
    power: Map<String, Value>,
    compared: Map<String, Value>,
    values: Map<String, Value>,
    on: Value,
    running: Value,
    status: Option<Arc<Value>>,
}

impl ProgramWindow {
    /// The window in a request's query.
    pub fn of(query: &Query) -> ProgramWindow {
        let number = |key: &str| query.number(key).and_then(|n| usize::try_from(n).ok());
        let (from, to) = (number("from").unwrap_or(1), number("to").unwrap_or(0));
        let element = query.get("element").unwrap_or_default();
        let mut room = RUNGS_MAX;
        let within = query.get("within").unwrap_or_default().split(',');
        let within = within.filter_map(|text| {
            let range = RungRange::read(text, room)?;
            room -= (range.to + 1).saturating_sub(range.from);
            Some(range)
        });
        let within = within.collect();
        let tags = query.get("tags").unwrap_or_default().split(',').filter(|tag| !tag.is_empty());
        ProgramWindow {
            own: RungRange { element: element.to_owned(), from, to }.at_most(RUNGS_MAX),
            within,
            tags: tags.take(TAGS_MAX).map(str::to_owned).collect(),
        }
    }

    /// The rungs that it shows.
    fn shown<'r>(&'r self, program: &'r LiveProgram) -> impl Iterator<Item = KeyedRungs<'r>> {
        let own = [(String::new(), &self.own)].into_iter();
        let within = self.within.iter().map(|range| (format!("{}:", range.element), range));
        own.chain(within).filter_map(|(prefix, range)| {
            let rungs = program.rungs(&range.element)?;
            let end = range.to.min(rungs.len());
            let rungs = rungs.get(range.from - 1..end).unwrap_or_default();
            Some(KeyedRungs { element: &range.element, rungs, prefix })
        })
    }
}

impl RungRange {
    /// The rungs of a text as `Dose:1-4`, at most this many; `None` for any other text.
    fn read(text: &str, most: usize) -> Option<RungRange> {
        let (element, range) = text.rsplit_once(':')?;
        let (from, to) = range.split_once('-')?;
        let (from, to) = (from.parse().ok()?, to.parse().ok()?);
        Some(RungRange { element: element.to_owned(), from, to }.at_most(most))
    }

    /// The same rungs, at most this many.
    fn at_most(self, most: usize) -> RungRange {
        let from = self.from.max(1);
        RungRange { from, to: self.to.min(from.saturating_add(most) - 1), ..self }
    }
}

/// The events of a viewer, until its session ends.
pub(super) fn events(site: &Arc<WebSite>, query: &Query, cookie: &str) -> WebResult {
    let place = Arc::clone(&site.streams).try_acquire_owned().map_err(|_| {
        let why = "too many pages show this controller: close one";
        WebFailure(StatusCode::SERVICE_UNAVAILABLE, why.to_owned())
    })?;
    let (site, window, cookie) = (Arc::clone(site), ProgramWindow::of(query), cookie.to_owned());
    let (send, events) = mpsc::channel(1);
    tokio::spawn(async move {
        let _place = place;
        let (mut watcher, mut told) = (site.follow.watcher(), SentState::default());
        let mut seen = site.follow.now().await;
        watcher.mark_unchanged();
        loop {
            let mut event = match &seen.view {
                Ok(view) => told.news(view, &view.power, &window),
                Err(why) => json!({ "error": why }),
            };
            let is_new = |known: &Arc<Value>| Some(known) != told.status.as_ref();
            if let Some(status) = seen.status.clone().filter(is_new) {
                event["status"] = (*status).clone();
                told.status = Some(status);
            }
            event[CLOCK] = json!(Deadline::now());
            // Waits until the browser has taken the previous event.
            if send.send(Bytes::from(format!("data: {event}\n\n"))).await.is_err() {
                return;
            }
            match site.follow.next(&mut watcher).await {
                Some(next) if site.is_session_open(&cookie) => seen = next,
                Some(_) | None => return,
            }
        }
    });
    Ok(typed("text/event-stream", AnswerBody::Events(events, None)))
}

impl SentState {
    /// The changes in a scan since the previous call, for a window.
    pub fn news(&mut self, view: &LiveView, power: &ScanPower, window: &ProgramWindow) -> Value {
        let mut event = json!({
            "scan": power.scan,
            "time_ms": power.unix_ns / 1_000_000,
            "mode": power.mode.name(),
            "program": name_of(&view.program),
        });
        if let Some(scans) = view.scans() {
            event["scans"] = json!([scans.start(), scans.end()]);
        }
        if let Some(present) = &view.present {
            event["now"] = json!({ "mode": present.mode, "reason": present.reason });
        }
        if !view.executes(power) {
            event["executes"] = json!(false);
        }
        if self.know(&view.program, window) {
            event["texts"] = texts(view, window);
        }
        let lit = lit(view, power, window);
        let values = self.tag_values(view, power, window);
        event["compared"] = changed(&mut self.compared, compared(view, power, window));
        event["power"] = changed(&mut self.power, lit);
        event["values"] = changed(&mut self.values, values);
        let (on, running) = blocks(view, power);
        for (key, told, now) in [("on", &mut self.on, on), ("running", &mut self.running, running)]
        {
            if *told != now {
                event[key] = now.clone();
                *told = now;
            }
        }
        event
    }

    /// Finds the cells of the window's operands, once for each program. Returns whether the program
    /// is new.
    fn know(&mut self, program: &Arc<LiveProgram>, window: &ProgramWindow) -> bool {
        if self.program.as_ref().is_some_and(|(known, _)| Arc::ptr_eq(known, program)) {
            return false;
        }
        let cells = window.tags.iter().map(|tag| program.subject.cell(tag).ok()).collect();
        *self = SentState { program: Some((Arc::clone(program), cells)), ..SentState::default() };
        true
    }

    fn tag_values(
        &self,
        view: &LiveView,
        power: &ScanPower,
        window: &ProgramWindow,
    ) -> Map<String, Value> {
        let Some((_, cells)) = &self.program else { return Map::new() };
        let value = |(tag, cell): (&String, &Option<Cell>)| {
            let cell = (*cell)?;
            Some((tag.clone(), shown_value(view, power, cell)))
        };
        window.tags.iter().zip(cells).filter_map(value).collect()
    }
}

/// The name of a program. If it changes, a page loads its pictures again.
pub(super) fn name_of(program: &LiveProgram) -> String {
    let recorded = &program.recorded;
    format!("{}.{}.{}", recorded.process_start_ns, recorded.generation, recorded.hash)
}

/// The texts of the values of the window's operands, by operand.
fn texts(view: &LiveView, window: &ProgramWindow) -> Value {
    let subject = &view.program.subject;
    let symbols = subject.symbols();
    let texts = |tag: &String| {
        let address = symbols.layout.address(subject.cell(tag).ok()?)?;
        Some((tag.clone(), texts_by_value(symbols.names.texts(address)?)))
    };
    window.tags.iter().filter_map(texts).collect()
}

/// The texts of a tag's values, by value.
pub(super) fn texts_by_value(texts: &ValueTexts) -> Value {
    texts.iter().map(|(value, text)| (value.to_string(), Value::from(text))).collect()
}

/// The value of a cell in a scan, for a page. Of an output that does not follow memory: what it is
/// driven to (`on`; null: not known) and what memory holds.
fn shown_value(view: &LiveView, power: &ScanPower, cell: Cell) -> Value {
    let memory = tag_value(view.tag_value(cell, power.value(cell)));
    match view.output(power, cell) {
        None | Some(OutputState::AsMemory) => memory,
        Some(OutputState::Safe(on)) => json!({ "on": on, "memory": memory }),
        Some(OutputState::Unknown(last)) => json!({ "on": null, "last": last, "memory": memory }),
    }
}

/// A value in JSON, for a page.
pub(super) fn tag_value(value: TagValue) -> Value {
    match value {
        TagValue::Bit(on) => json!(on),
        TagValue::Integer(value) => json!(value),
        TagValue::Real(value) => json!(value),
    }
}

/// Returns the entries that are new or differ from the known ones, and adds them to the known ones.
fn changed(known: &mut Map<String, Value>, now: Map<String, Value>) -> Value {
    let mut news = Map::new();
    for (key, value) in now {
        if known.get(&key) != Some(&value) {
            news.insert(key.clone(), value.clone());
            known.insert(key, value);
        }
    }
    Value::Object(news)
}

/// The power of each rung of the window; null: the rung was not executed.
fn lit(view: &LiveView, power: &ScanPower, window: &ProgramWindow) -> Map<String, Value> {
    let executes = view.executes(power);
    let mut all = Map::new();
    for KeyedRungs { element, rungs, prefix } in window.shown(&view.program) {
        for rung in rungs {
            let number = rung.number as u32;
            let is_executed = executes && view.is_executed(power, element, number);
            let conducts =
                |contact: &_| view.conducts(power, element, number, contact).unwrap_or(false);
            let power = is_executed.then(|| live_svg::power(&rung.grid, &conducts));
            all.insert(format!("{prefix}{number}"), json!(power));
        }
    }
    all
}

/// The values of the compares in the rungs of the window, by rung, then by contact (`0.2`: the
/// third one of the rung's own legs).
fn compared(view: &LiveView, power: &ScanPower, window: &ProgramWindow) -> Map<String, Value> {
    let executes = view.executes(power);
    let mut all = Map::new();
    for KeyedRungs { element, rungs, prefix } in window.shown(&view.program) {
        for rung in rungs {
            let number = rung.number as u32;
            let symbols = rung.grid.contacts.iter().map(|contact| &contact.symbol);
            let values = symbols.filter_map(|symbol| {
                let text = view.compared(power, element, number, symbol);
                let place = format!("{}.{}", symbol.branch.unwrap_or(0), symbol.leaf);
                Some((place, Value::from(text.filter(|_| executes)?)))
            });
            all.insert(format!("{prefix}{number}"), Value::Object(values.collect()));
        }
    }
    all
}

/// The Stages that are ON, and the running blocks.
fn blocks(view: &LiveView, power: &ScanPower) -> (Value, Value) {
    let symbols = view.program.subject.symbols();
    let is_on = |bit: Bit| {
        let cell = symbols.layout.cell(Address::Bit(bit));
        cell.is_some_and(|cell| power.value(cell) != 0)
    };
    let stages = (0..).zip(&symbols.names.stages);
    let on =
        stages.filter(|(at, _)| is_on(Bit::Stage(StageId(*at)))).map(|(_, stage)| &stage.whole);
    let blocks = (0..).zip(&symbols.names.blocks);
    // Only in RUN: in FAULT the bits of the blocks keep their values, but no block runs.
    let executes = view.executes(power);
    let blocks = blocks.filter(|_| executes);
    // A subroutine is executed by its CALLs, and never runs.
    let blocks = blocks.filter(|(_, block)| block.kind != BlockKind::Subroutine);
    let running = blocks.filter(|(at, _)| is_on(Bit::Running(BlockId(*at))));
    let running = running.map(|(_, block)| &block.name);
    (json!(on.collect::<Vec<_>>()), json!(running.collect::<Vec<_>>()))
}
