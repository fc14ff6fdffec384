//! Tests change the state by keys and news, and draw it into a terminal in memory. No socket, no
//! clock.

mod asked;
mod changes;
mod drawn;
mod moves;

use std::sync::Arc;

use ratatui_core::backend::TestBackend;
use ratatui_core::terminal::Terminal;
use serde_json::{Value, json};

use super::message::{
    ControllerLook, KeyPress, MonitorAction, MonitorEvent, MonitorNews, ThreadOrder,
};
use super::paint::paint;
use super::power_of::PowerOf;
use super::state::MonitorState;
use super::update::update;
use rungd_client::live::LiveProgram;
use rungd_client::operator::protocol::{BitOrNumber, ControllerStatus, ShownValue};
use rungd_history::record::{RecordedFile, RecordedProgram};
use rungd_lab::draw::circuit::ContactSymbol;

const LADDER: &str = r#"
[tags]
start = { at = "X0", doc = "Button" }
stop  = { at = "X1" }
motor = { at = "Y0" }
jam   = { at = "C0", alarm = "The belt is jammed" }

[[program]]
name = "Main"

[[program.rung]]
name = "run"
when = ["start | motor", "!stop"]
do   = ["OUT motor"]

[[program.rung]]
when = ["D0 > 500"]
do   = ["SET jam", "MOVE 0 to=D0"]

[[program]]
name = "Filler"
autostart = true

[[program.stage]]
name = "Fill"

[[program.stage.rung]]
when = ["$On"]
do   = ["OUT Y1"]

[[program.stage]]
name = "Drain"
"#;

/// A monitor without a terminal and without a controller.
struct Bench {
    state: MonitorState,
    /// The wishes since the last call of `orders`.
    wishes: Vec<MonitorAction>,
    size: (u16, u16),
}

/// The conducting contacts, by rung and leaf. Only the Program Main is executed.
#[derive(Debug)]
struct SomeConduct(&'static [(u32, usize)]);

impl PowerOf for SomeConduct {
    fn scan(&self) -> u64 {
        120
    }

    fn value(&self, operand: &str) -> Option<String> {
        (operand == "motor").then(|| "ON".to_owned())
    }

    fn conducts(&self, element: &str, rung: u32, contact: &ContactSymbol) -> Option<bool> {
        (element == "Main").then(|| self.0.contains(&(rung, contact.leaf)))
    }

    fn compared(&self, element: &str, rung: u32, _: &ContactSymbol) -> Option<String> {
        (element == "Main" && rung == 2).then(|| "612 > 500".to_owned())
    }
}

impl Bench {
    /// A monitor after the first look, with the ladder.
    fn start() -> Bench {
        let mut bench = Bench::silent();
        bench.look(status(), vec![]);
        bench.news(MonitorNews::Ladder("abc".to_owned(), Ok(program())));
        bench
    }

    /// A monitor before the first look.
    fn silent() -> Bench {
        Bench { state: MonitorState::default(), wishes: Vec::new(), size: (80, 24) }
    }

    fn news(&mut self, news: MonitorNews) {
        self.wishes.extend(update(&mut self.state, MonitorEvent::News(news)));
    }

    fn look(&mut self, status: Value, values: Vec<ShownValue>) {
        let status: ControllerStatus = serde_json::from_value(status).expect("a status");
        let look = ControllerLook { status, values, unknown: Vec::new() };
        self.news(MonitorNews::Look(Box::new(look)));
    }

    fn press(&mut self, press: KeyPress) {
        self.wishes.extend(update(&mut self.state, MonitorEvent::Press(press)));
    }

    /// Presses one key for each letter.
    fn keys(&mut self, text: &str) {
        text.chars().for_each(|c| self.press(KeyPress::Char(c)));
    }

    fn tick(&mut self, ms: u64) {
        self.wishes.extend(update(&mut self.state, MonitorEvent::Tick(ms)));
    }

    /// The orders since the last call, as text.
    fn orders(&mut self) -> Vec<String> {
        let order = |wish: MonitorAction| match wish {
            MonitorAction::Quit => "quit".to_owned(),
            MonitorAction::Ask(ThreadOrder::Change(request)) => {
                serde_json::to_string(&request).expect("a request")
            }
            MonitorAction::Ask(order) => format!("{order:?}"),
        };
        std::mem::take(&mut self.wishes).into_iter().map(order).collect()
    }

    /// The rows that the terminal shows, without trailing spaces.
    fn shown(&self) -> String {
        let (width, height) = self.size;
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("in memory");
        terminal.draw(|frame| paint(frame, &self.state, false)).expect("in memory");
        let buffer = terminal.backend().buffer();
        let row = |y: u16| {
            let cells = (0..width).map(|x| buffer[(x, y)].symbol());
            cells.collect::<String>().trim_end().to_owned() + "\n"
        };
        (0..height).map(row).collect()
    }
}

fn program() -> Arc<LiveProgram> {
    let file = |name: &str, text: &str| RecordedFile { name: name.into(), text: text.into() };
    let files = vec![file("c.toml", "ladder = [\"a.toml\"]\n"), file("a.toml", LADDER)];
    let recorded = Arc::new(RecordedProgram { files, ..RecordedProgram::default() });
    Arc::new(LiveProgram::of(recorded).expect("a ladder"))
}

fn bit(operand: &str, address: &str, on: bool) -> ShownValue {
    let tag = (operand != address).then(|| operand.to_owned());
    let (operand, address) = (operand.to_owned(), address.to_owned());
    ShownValue {
        operand,
        tag,
        address,
        value: BitOrNumber::Bit(on),
        unit: None,
        text: None,
        forced: false,
        driven: None,
        unknown: None,
    }
}

fn word(operand: &str, value: i32) -> ShownValue {
    ShownValue { value: BitOrNumber::Word(value), ..bit(operand, operand, false) }
}

/// The shelf of an alarm.
fn shelf() -> Value {
    json!({"who": "anna", "why": "Filter", "since_ns": 1, "until_ns": 2})
}

fn status() -> Value {
    let spread = json!({
        "last_us": 12.5, "min_us": 9.0, "mean_us": 12.0, "p50_us": 12.0, "p99_us": 31.0,
        "p999_us": 40.0, "max_us": 44.0, "histogram": []
    });
    json!({
        "protocol": 1, "version": "0.2.0", "pid": 7, "uptime_ms": 61_000,
        "controller": "c.toml", "mode": "RUN", "reason": null, "mode_ms": 60_000, "scans": 6000,
        "period_us": 10_000, "watchdog_us": 200_000, "posture": [],
        "ladder": {"name": "belt", "files": "a.toml", "sha256": "abc", "blocks": 2, "rungs": 3},
        "scan": {"over_ms": 60_000, "scans": 6000, "overruns": 2, "skipped": 0,
                 "execution": spread, "lateness": spread},
        "blocks": [
            {"name": "Main", "kind": "program", "running": true, "done": null, "stages": []},
            {"name": "Filler", "kind": "program", "running": true, "done": null,
             "stages": ["Fill"]}
        ],
        "alarms": [
            {"tag": "jam", "text": "The belt is jammed", "priority": "high",
             "state": "unacknowledged", "lasted_ms": 65_000, "order": 1, "day": 3}
        ],
        "forces": [{"operand": "stop", "tag": "stop", "address": "X1", "value": false,
                    "forced": true}],
        "devices": {"modbus": {"address": "127.0.0.1:1502", "clients": 1, "connections_max": 16},
            "simulated_rules": null,
            "field": [{"name": "io", "driver": "modbus", "peer": "10.0.0.9:502", "ok": false,
                "stale": true, "exchanges": 9, "failures": 3, "took_us": 800,
                "took_max_us": 900, "trouble": "connect: refused"}]},
        "log": {"level": "info", "lines_dropped": 0, "records_dropped": 0}
    })
}
