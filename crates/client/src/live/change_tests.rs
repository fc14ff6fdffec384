//! A reader of the scan log reports exactly the changes that happened: each once, in order, over
//! random inputs, reloads, restarts and pauses.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use super::change_follower::ChangeFollower;
use super::change_history::{ChangeHistory, HistorySpan};
use super::log_event::{LogEvent, LogPosition};
use super::logged_program::{ChooseCells, NamedCell, content};
use rungd_base::random::SplitMix64;
use rungd_config::load;
use rungd_engine::EngineState;
use rungd_engine::isa::Address;
use rungd_history::record::{
    Recent, RecordedFile, RecordedProgram, Recorder, Recording, TapeClock,
};
use rungd_lab::rig::{Rig, RigProgram, RigSetup, TapeListener};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::{Program, TagMeaning};
use rungd_language::source::span::SourceFile;
use rungd_runtime::TapeEntry;

const CONTROLLER: &str = "ladder = [\"l.toml\"]\nscan.period = \"10ms\"\n";

/// A ladder in which a bit follows X0, a counter counts X0, and a word follows the counter.
fn ladder(more: &str) -> String {
    format!(
        "[tags]\nstart = {{ at = \"X0\" }}\nstop = {{ at = \"X1\" }}\non = {{ at = \"Y0\" }}\n\
         count = {{ at = \"CT0\" }}\nlevel = {{ at = \"V0\" }}\n{more}\n\
         [[program]]\nname = \"Main\"\nrung = [\n\
         {{ when = [\"start\", \"!stop\"], do = [\"OUT on\"] }},\n\
         {{ leg.up = [\"start\"], leg.rst = [\"stop\"], do = [\"CNT count preset=5\"] }},\n\
         {{ when = [\"$On\"], do = [\"MATH level = count.Acc * 3\"] }},\n]\n"
    )
}

/// The additional tag of the program of a generation.
fn more(generation: u32) -> String {
    format!("new{} = {{ at = \"V{}\" }}", generation % 3, generation % 3 + 1)
}

/// All tags with a cell.
fn choose_all() -> ChooseCells {
    Arc::new(|program: &Program, symbols: &Symbols| {
        let mut all: Vec<NamedCell> = Vec::new();
        for tag in &program.tags {
            let TagMeaning::Address(address) = tag.meaning else { continue };
            match address {
                Address::Structure(of) => {
                    let members = of.members().iter().zip(of.member_addresses());
                    all.extend(members.filter_map(|(member, address)| {
                        Some((format!("{}.{member}", tag.name), symbols.layout.cell(address)?))
                    }));
                }
                Address::Bit(_) | Address::Word(_) => {
                    let cell = symbols.layout.cell(address);
                    all.extend(cell.map(|cell| (tag.name.clone(), cell)));
                }
            }
        }
        all
    })
}

/// The recorder of the rig's present process, its memory, and a disk that keeps everything.
struct Logs {
    recorder: Recorder,
    recent: Recent,
    disk: Recent,
}

impl Logs {
    fn keep(&mut self, block: Option<rungd_history::record::RecordBlock>) {
        if let Some(block) = block {
            self.recent.put(&block);
            self.disk.put(&block);
        }
    }
}

struct LogListener(Arc<Mutex<Logs>>);

impl TapeListener for LogListener {
    fn hear(&mut self, _: &Arc<RigProgram>, entry: TapeEntry, state: Option<&EngineState>) {
        let mut logs = self.0.lock().expect("it is whole");
        let block = logs.recorder.take(entry, state, CLOCK);
        logs.keep(block);
    }
}

/// The clock for all entries; it does not advance. The rig supplies the times of the scans.
const CLOCK: TapeClock = TapeClock { unix_ns: OFFSET_NS, unix_offset_ns: OFFSET_NS };

/// The offset added to the time of the rig.
const OFFSET_NS: i64 = 1_000_000_000_000;

/// The process, the scan and the name of the cell of a change.
pub(crate) type Happened = (i64, u64, String);

/// A rig with its log, and the changes that happened in it.
pub(crate) struct LoggedPlant {
    pub rig: Rig,
    logs: Arc<Mutex<Logs>>,
    pub process: i64,
    generation: u32,
    pub random: SplitMix64,
    chosen: Vec<NamedCell>,
    values: BTreeMap<String, i32>,
    pub changes: BTreeMap<Happened, i32>,
    /// The time of each scan, ms, by process and scan.
    pub times: BTreeMap<(i64, u64), u64>,
    /// The last scan before each exchange of the program.
    pub swaps: Vec<(i64, u64)>,
}

fn files(more: &str) -> [RecordedFile; 2] {
    [("c.toml", CONTROLLER.to_owned()), ("l.toml", ladder(more))]
        .map(|(name, text)| RecordedFile { name: name.to_owned(), text: text.into() })
}

fn recorded(process_start_ns: i64, generation: u32, more: &str) -> RecordedProgram {
    let files = files(more).to_vec();
    RecordedProgram { process_start_ns, generation, files, ..RecordedProgram::default() }
}

fn program(more: &str) -> (Program, Arc<RigProgram>) {
    let sources = files(more).map(|of| SourceFile { name: of.name, text: of.text.to_string() });
    let mut loaded = load::recorded_files(&sources);
    let program = loaded.program.take();
    let program = program.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    let controller = Arc::new(loaded.controller.expect("it has settings"));
    let lowered = Arc::new(RigProgram::new(&program, &controller));
    (program, lowered)
}

impl LoggedPlant {
    pub fn new(seed: u64, memory: usize) -> LoggedPlant {
        let (first, lowered) = program("");
        let (recent, disk) = (Recent::new(memory), Recent::new(1 << 26));
        let recorder = Recorder::new(recorded(1, 0, ""));
        let logs = Arc::new(Mutex::new(Logs { recorder, recent, disk }));
        let setup = RigSetup { is_taped: true, ..RigSetup::default() };
        let mut rig = Rig::new(&lowered, &setup);
        rig.listen(Box::new(LogListener(Arc::clone(&logs))));
        let chosen = choose_all()(&first, &lowered.symbols);
        let (values, changes, times) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        let random = SplitMix64(seed);
        let (process, generation) = (1, 0);
        let mut plant = LoggedPlant {
            rig,
            logs,
            process,
            generation,
            random,
            chosen,
            values,
            changes,
            times,
            swaps: Vec::new(),
        };
        plant.note();
        plant
    }

    /// Notes the changes.
    fn note(&mut self) {
        let image = self.rig.image();
        for (name, cell) in &self.chosen {
            let value = content(image, *cell);
            if self.values.insert(name.clone(), value) != Some(value) {
                self.changes.insert((self.process, self.rig.scans(), name.clone()), value);
            }
        }
    }

    pub fn scan(&mut self) {
        let input = (self.random.next() % 2) as u32;
        let on = self.random.next().is_multiple_of(3);
        self.rig.set_input(input, on);
        let time_ms = (OFFSET_NS as u64 + self.rig.next_ns()) / 1_000_000;
        let is_last = self.rig.scan();
        self.rig.end_scan(is_last);
        self.times.insert((self.process, self.rig.scans()), time_ms);
        self.note();
    }

    pub fn reload(&mut self) {
        self.generation += 1;
        let more = more(self.generation);
        let (next, lowered) = program(&more);
        let of = recorded(self.process, self.generation, &more);
        self.logs.lock().expect("it is whole").recorder.program(of);
        self.rig.reload(&lowered);
        self.swaps.push((self.process, self.rig.scans()));
        self.chosen = choose_all()(&next, &lowered.symbols);
        self.note();
    }

    /// Reloads the same program, but records another one, which the sections that follow do not
    /// fit.
    fn mislabelled_reload(&mut self) {
        self.generation += 1;
        let timer =
            "[[task]]\nname = \"T\"\nrung = [{ when = [\"start\"], do = [\"TMR T9 preset=3s\"] }]";
        let (_, lowered) = program("");
        let of = recorded(self.process, self.generation, timer);
        self.logs.lock().expect("it is whole").recorder.program(of);
        self.rig.reload(&lowered);
    }

    /// Kills the process, and starts a new one with the same program.
    pub fn restart(&mut self, memory: usize) {
        let more = match self.generation {
            0 => String::new(),
            of => more(of),
        };
        (self.process, self.generation) = (self.process + 1_000_000_000_000, 0);
        {
            let mut logs = self.logs.lock().expect("it is whole");
            let block = logs.recorder.flush(CLOCK);
            logs.keep(block);
            logs.recorder = Recorder::new(recorded(self.process, 0, &more));
            logs.recent = Recent::new(memory);
        }
        self.rig.restart();
    }

    /// The answer of the controller's memory.
    pub fn answer(&self, from: u64) -> Recording {
        let logs = self.logs.lock().expect("it is whole");
        Recording::of_bytes(logs.recent.write_from(
            from,
            logs.recorder.under_way().as_ref(),
            usize::MAX,
        ))
    }

    /// The whole recording.
    pub fn all(&self) -> Recording {
        let logs = self.logs.lock().expect("it is whole");
        Recording::of_bytes(logs.disk.write_from(0, logs.recorder.under_way().as_ref(), usize::MAX))
    }

    /// The changes after one position, up to another.
    fn expected(&self, from: LogPosition, until: LogPosition) -> BTreeMap<Happened, i32> {
        let key = |of: LogPosition| (of.process_start_ns, of.scan);
        let is_in = |of: &&Happened| (key(from).0, key(from).1) < (of.0, of.1);
        let all = self.changes.iter().filter(|(of, _)| is_in(of));
        let all = all.filter(|(of, _)| (of.0, of.1) <= key(until));
        all.map(|(of, value)| (of.clone(), *value)).collect()
    }
}

/// Collects the reported events, and checks their order.
#[derive(Default)]
struct ToldEvents {
    names: Vec<String>,
    process: i64,
    last: (i64, u64),
    changes: BTreeMap<Happened, i32>,
    lost: Vec<Option<u64>>,
    jumps: Vec<(LogPosition, LogPosition)>,
}

impl ToldEvents {
    fn take(&mut self, events: Vec<LogEvent>) {
        for event in events {
            match event {
                LogEvent::Begins { program, at, .. } => {
                    self.names = program.chosen.iter().map(|(name, _)| name.clone()).collect();
                    self.process = at.process_start_ns;
                }
                LogEvent::Changed(change) => {
                    let place = (self.process, change.scan);
                    assert!(place >= self.last, "{place:?} behind {:?}", self.last);
                    self.last = place;
                    let name = self.names[change.cell as usize].clone();
                    let key = (place.0, place.1, name);
                    let before = self.changes.insert(key.clone(), change.value);
                    assert_eq!(before, None, "{key:?} is told twice");
                }
                LogEvent::Jumped { from, to } => self.jumps.push((from, to)),
                LogEvent::Missing(gap) => self.lost.push(gap.scans),
            }
        }
    }
}

fn past(recording: Recording, span: HistorySpan) -> ToldEvents {
    let mut history = ChangeHistory::new(recording, span, choose_all());
    let mut told = ToldEvents::default();
    while let Some(events) = history.next_section() {
        told.take(events);
    }
    let (at, until) = (history.position(), span.until);
    assert_eq!((at.process_start_ns, at.scan), (until.process_start_ns, until.scan));
    told
}

#[test]
fn a_follower_tells_each_change_once() {
    let mut plant = LoggedPlant::new(5, 1 << 22);
    let mut follower = ChangeFollower::new(choose_all());
    let mut told = ToldEvents::default();
    (0..30).for_each(|_| plant.scan());
    told.take(follower.take(plant.answer(u64::MAX)).expect("it has a section"));
    let first = follower.position().expect("it has scans");
    told.changes.clear();
    for round in 0..300 {
        (0..plant.random.next() % 40).for_each(|_| plant.scan());
        if round % 37 == 36 {
            plant.reload();
        }
        let from = follower.next_section();
        told.take(follower.take(plant.answer(from)).expect("it has a section"));
    }
    let last = follower.position().expect("it has scans");
    assert_eq!((last.process_start_ns, last.scan), (1, plant.rig.scans()));
    // The values at a reload are reported with the new program, not as changes.
    let expected = plant.expected(first, last);
    let births = expected.keys().filter(|key| !told.changes.contains_key(*key)).count();
    assert!(births <= 8, "{births} changes are not told");
    assert!(told.changes.iter().all(|(key, value)| expected.get(key) == Some(value)));
    assert!(expected.len() > 1000 && told.jumps.is_empty(), "{:?}", told.jumps);
}

#[test]
fn the_past_has_each_change_once_from_any_place() {
    let mut plant = LoggedPlant::new(7, 1 << 22);
    let mut places = vec![LogPosition { process_start_ns: 1, ..LogPosition::default() }];
    for round in 0..200 {
        (0..plant.random.next() % 60).for_each(|_| plant.scan());
        match round % 50 {
            20 => plant.reload(),
            40 => plant.restart(1 << 22),
            _ => {}
        }
        let unix_ns = OFFSET_NS + plant.rig.next_ns() as i64 - 10_000_000;
        let (process_start_ns, scan) = (plant.process, plant.rig.scans());
        places.push(LogPosition { process_start_ns, scan, unix_ns });
    }
    for _ in 0..40 {
        let one = plant.random.next() as usize % places.len();
        let other = plant.random.next() as usize % places.len();
        let (from, until) = (places[one.min(other)], places[one.max(other)]);
        let told = past(plant.all(), HistorySpan { from, margin_ns: 0, until });
        assert!(told.changes == plant.expected(from, until), "{from:?} {until:?}");
        assert!(told.lost.iter().all(Option::is_none), "{:?}", told.lost);
    }
}

#[test]
fn what_memory_does_not_reach_is_counted() {
    let mut plant = LoggedPlant::new(9, 1 << 12);
    (0..5000).for_each(|_| plant.scan());
    let from = LogPosition { process_start_ns: 1, scan: 100, unix_ns: OFFSET_NS + 1_000_000_000 };
    let until =
        LogPosition { process_start_ns: 1, scan: 5000, unix_ns: OFFSET_NS + 50_000_000_000 };
    let told = past(plant.answer(0), HistorySpan { from, margin_ns: 0, until });
    let [Some(lost)] = told.lost[..] else { panic!("{:?}", told.lost) };
    let begin = LogPosition { scan: 100 + lost, ..from };
    let expected = plant.expected(begin, until);
    let told: BTreeMap<_, _> = told.changes.into_iter().filter(|of| of.0.1 > begin.scan).collect();
    assert!(lost > 1000 && told == expected, "{lost}");
    // The disk has all of it.
    let told = past(plant.all(), HistorySpan { from, margin_ns: 0, until });
    assert!(told.lost.is_empty() && told.changes == plant.expected(from, until));
    // The margin is reported again.
    let told = past(plant.all(), HistorySpan { from, margin_ns: 500_000_000, until });
    let before = LogPosition { scan: 50, ..from };
    assert!(told.changes == plant.expected(before, until));
}

/// A restart and a pause longer than memory are jumps, and the past has the changes between.
#[test]
fn a_jump_and_the_past_give_all() {
    let mut plant = LoggedPlant::new(11, 1 << 12);
    let mut follower = ChangeFollower::new(choose_all());
    plant.scan();
    let mut told = ToldEvents::default();
    told.take(follower.take(plant.answer(u64::MAX)).expect("it has a section"));
    let first = follower.position().expect("it has scans");
    told.changes.clear();
    let mut births = 0;
    for round in 0..60 {
        let pause = if round % 10 == 9 { 3000 } else { 30 };
        (0..pause).for_each(|_| plant.scan());
        if round % 15 == 14 {
            plant.restart(1 << 12);
            (0..300).for_each(|_| plant.scan());
        }
        let from = follower.next_section();
        let mut live = ToldEvents {
            names: told.names.clone(),
            process: told.process,
            ..ToldEvents::default()
        };
        live.take(follower.take(plant.answer(from)).expect("it has a section"));
        (told.names, told.process) = (live.names.clone(), live.process);
        for (from, until) in std::mem::take(&mut live.jumps) {
            births += 1;
            let told_past = past(plant.all(), HistorySpan { from, margin_ns: 0, until });
            told.changes.extend(told_past.changes);
        }
        told.changes.extend(live.changes);
    }
    let expected = plant.expected(first, follower.position().expect("it has scans"));
    let missing: Vec<_> = expected.keys().filter(|key| !told.changes.contains_key(*key)).collect();
    assert!(births > 5 && missing.is_empty(), "{births} {missing:?}");
}

/// A section that its program cannot execute is skipped, and the next section reports a jump.
#[test]
fn a_section_that_does_not_fit_is_a_jump() {
    let mut plant = LoggedPlant::new(13, 1 << 22);
    let mut follower = ChangeFollower::new(choose_all());
    (0..30).for_each(|_| plant.scan());
    follower.take(plant.answer(u64::MAX)).expect("it has a section");
    let last = follower.position().expect("it has scans");
    plant.mislabelled_reload();
    (0..30).for_each(|_| plant.scan());
    follower.take(plant.answer(follower.next_section())).expect("it has sections");
    assert_eq!(follower.position(), Some(last));
    plant.reload();
    (0..30).for_each(|_| plant.scan());
    let mut told = ToldEvents::default();
    told.take(follower.take(plant.answer(follower.next_section())).expect("it has sections"));
    let jumps: Vec<_> = told.jumps.iter().map(|(from, to)| (from.scan, to.scan)).collect();
    assert_eq!(jumps, [(last.scan, 60)]);
}
