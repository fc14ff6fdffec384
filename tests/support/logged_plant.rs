//! A plant in virtual time with a scan log, for tests of what reads the log: it notes every change
//! that happens, through random inputs, reloads and restarts.

use rungd_base::random::SplitMix64;
use rungd_client::live::{ChooseCells, LogPosition, NamedCell};
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
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

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
pub fn choose_all() -> ChooseCells {
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
pub const OFFSET_NS: i64 = 1_000_000_000_000;

/// The process, the scan and the name of the cell of a change.
pub type Happened = (i64, u64, String);

/// A rig with its log, and the changes that happened in it.
pub struct LoggedPlant {
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
            let value = image.value(*cell);
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
    pub fn mislabelled_reload(&mut self) {
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
        self.rig.restart(0);
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
    pub fn expected(&self, from: LogPosition, until: LogPosition) -> BTreeMap<Happened, i32> {
        let key = |of: LogPosition| (of.process_start_ns, of.scan);
        let is_in = |of: &&Happened| (key(from).0, key(from).1) < (of.0, of.1);
        let all = self.changes.iter().filter(|(of, _)| is_in(of));
        let all = all.filter(|(of, _)| (of.0, of.1) <= key(until));
        all.map(|(of, value)| (of.clone(), *value)).collect()
    }
}
