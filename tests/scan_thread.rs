//! The scan thread allocates nothing. The allocations are counted with writes, inputs, events,
//! forces, mode commands and reloads pending, with the log's reader and the image's readers
//! stalled, and over a stop, for generated ladders and for every shipped ladder. In addition, the
//! sources of the scan thread name nothing that could make it wait.
//!
//! Lowering a long series allocates in proportion to its contacts.
//!
//! The scanner runs on the test's own thread with a simulated clock. The allocator counts the calls
//! on that thread between the beginning and the end of a step.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fmt::Write as _;
use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::Ordering;

use rungd_base::calendar::LocalTime;
use rungd_engine::isa::{Bit, BitSpace, MemorySizes, Word, WordSpace};
use rungd_engine::{BitCell, Cell as MemoryCell, Engine};
use rungd_io::device::Opener;
use rungd_io::gpio::GpioOpener;
use rungd_io::gpio::settings::{
    ChipId as ChipName, GpioLine, GpioSettings as GpioLines, LineId, LineSetting,
};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;
use rungd_runtime::command::ScanCommand;
use rungd_runtime::exchange::{Mode, OperandWrite, Port, Snapshot, StopReason, Tempo};
use rungd_runtime::pacing::Clock;
use rungd_runtime::wiring::{OutputSource, Wiring, WiringTarget};
use rungd_runtime::{
    CarriedWatches, Observer, Package, PackageParts, Posture, PublicMemory, RuntimeParts,
    SafeState, ScanRecord, ScannerSettings, Statistics, Taped, ThreadSettings, WatchedCells,
    assemble, assemble_reloadable, assemble_whole, tape, tape_of,
};
use rungd_state::reload::{LoweredProgram, ReloadPlan};

use rungd_test_support::fake_chip::FakeChip;
use rungd_test_support::follower::Follower;
use rungd_test_support::numbers::Numbers;

thread_local! {
    static CALLS: Cell<Option<u64>> = const { Cell::new(None) };
    static BYTES: Cell<usize> = const { Cell::new(0) };
}

/// Counts the calls on a thread that has switched counting on.
struct Counting;

fn count(bytes: usize) {
    let _ = BYTES.try_with(|sum| sum.set(sum.get() + bytes));
    let _ = CALLS.try_with(|calls| calls.set(calls.get().map(|n| n + 1)));
}

// SAFETY: passes every call on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        count(0);
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn counted<T>(call: impl FnOnce() -> T) -> (T, u64) {
    CALLS.set(Some(0));
    let result = call();
    (result, CALLS.replace(None).unwrap_or(0))
}

#[derive(Clone, Default)]
struct SimulatedClock(Rc<Cell<u64>>);

impl Clock for SimulatedClock {
    fn now_ns(&self) -> u64 {
        self.0.set(self.0.get() + 1000);
        self.0.get()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.set(self.0.get().max(deadline_ns));
    }

    fn local_s(&self) -> i64 {
        LocalTime::SIMULATED_S
    }
}

struct Deaf;

impl Observer for Deaf {
    fn record(&mut self, _: &ScanRecord) {}
    fn statistics(&mut self, _: &Statistics) {}
    fn dropped(&mut self, _: u64) {}
    fn tripped(&mut self, _: rungd_runtime::exchange::FaultReason, _: u64) {}
    fn turn(&mut self, _: &Snapshot, _: u64) {}

    fn ended(&mut self, _: u64) {}
}

/// Work for the scan, drawn.
trait DrawnWork: Sized {
    fn contact(&mut self) -> String;
}

impl DrawnWork for Numbers {
    fn contact(&mut self) -> String {
        let n = self.below(16);
        match self.below(6) {
            0 => format!("X{n}"),
            1 => format!("!C{n}"),
            2 => format!("rise(X{n})"),
            3 => format!("fall(MC{})", n + 1),
            4 => format!("X{n} | Y{}", self.below(16)),
            _ => format!("D{n} < {}", self.below(9)),
        }
    }
}

const TAGS: &str = r#"
[tags]
alarm = { at = "X0", alarm = "An input that toggles" }
bit = { at = "X1", log = "change" }
word = { at = "D0", log = "change" }
"#;

/// A ladder with every kind of block, which starts and stops the blocks as inputs change.
fn generated(seed: u64) -> String {
    let mut numbers = Numbers(seed);
    let mut text =
        format!("[ladder]\nname = \"generated\"\n{TAGS}\n[[program]]\nname = \"Main\"\n");
    let rung = |text: &mut String, place: &str, contact: &str, instruction: &str| {
        let _ =
            write!(text, "[[{place}.rung]]\nwhen = [\"{contact}\"]\ndo = [\"{instruction}\"]\n");
    };
    for n in 0..4 + numbers.below(12) {
        let contact = numbers.contact();
        let instruction = match numbers.below(9) {
            0 => format!("TMR T{n} preset={}ms", numbers.below(50)),
            1 => format!("ONDTMR T{n} preset=20ms output=C{}", 100 + n),
            2 => format!("OFFDTMR T{n} preset=20ms output=C{}", 100 + n),
            3 => format!("PONOFF C{}", 200 + n),
            4 => format!("ADD D{n} 1 to=D{n}"),
            5 => format!("CTU N{n} preset=3"),
            6 => format!("MOVE X{n}X to=D0").replace(&format!("X{n}X"), &format!("CT{n}.Acc")),
            7 => format!("SET C{}", 300 + n),
            _ => format!("OUT Y{n}"),
        };
        rung(&mut text, "program", &contact, &instruction);
        let (up, reset) = (numbers.contact(), numbers.contact());
        let _ = write!(
            text,
            "[[program.rung]]\nleg.up = [\"{up}\"]\nleg.rst = [\"{reset}\"]\ndo = [\"CNT CT{n} \
             preset=2\"]\n"
        );
    }
    for instruction in ["RUN Side", "RESTART Side", "ENTASK Often every=20ms", "ENTASK Once"] {
        let contact = numbers.contact();
        rung(&mut text, "program", &contact, instruction);
    }
    text += "[[program]]\nname = \"Side\"\n[[program.stage]]\nname = \"A\"\n";
    rung(&mut text, "program.stage", &numbers.contact(), "JMP B");
    text += "[[program.stage]]\nname = \"B\"\n";
    rung(&mut text, "program.stage", &numbers.contact(), "JMP A");
    rung(&mut text, "program.stage", &numbers.contact(), "EXIT");
    text += "[[task]]\nname = \"Often\"\n";
    rung(&mut text, "task", &numbers.contact(), "OUT C400");
    text += "[[task]]\nname = \"Once\"\n";
    rung(&mut text, "task", &numbers.contact(), "HALT Side");
    text
}

fn program(name: &str, text: String) -> Program {
    let file = SourceFile { name: name.to_owned(), text };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    program.unwrap_or_else(|| panic!("{name}: {findings:#?}"))
}

fn settings(symbols: &Symbols, scans: u64) -> ThreadSettings {
    let sizes = MemorySizes::default();
    let layout = &symbols.layout;
    let mut safe = vec![SafeState::Off; sizes.y as usize];
    safe[..3].copy_from_slice(&[SafeState::On, SafeState::Hold, SafeState::Hold]);
    let watched = WatchedCells {
        bits: bits(&symbols.alarms),
        words: vec![layout.word(Word::Space(WordSpace::D, 0))],
        ..WatchedCells::default()
    };
    ThreadSettings {
        pace: ScannerSettings {
            tempo: Tempo { period_ns: 10_000_000, watchdog_ns: 200_000_000 },
            scans: Some(scans),
            statistics_every_ns: Some(100_000_000),
            start_in_stop: None,
        },
        memory: PublicMemory::new(layout, safe),
        watched,
        posture: Posture::default(),
        field: Vec::new(),
    }
}

/// Inputs that toggle, and batches of every size.
fn stir(port: &Port, symbols: &Symbols, numbers: &mut Numbers) {
    for x in 0..16 {
        port.set_input(x, numbers.below(2) == 0);
    }
    for _ in 0..numbers.below(3) {
        let mut writes = Vec::new();
        for _ in 0..numbers.below(40) {
            let n = numbers.below(16) as u32;
            let bit = symbols.layout.bit(Bit::Space(BitSpace::Mc, n + 1));
            let word = symbols.layout.word(Word::Space(WordSpace::D, n));
            writes.push(OperandWrite::Bit(bit, numbers.below(2) == 0));
            writes.push(OperandWrite::Word(word, numbers.below(9) as i32));
            writes.push(OperandWrite::Input(n, numbers.below(2) == 0));
        }
        let _ = port.submit(writes);
    }
    for _ in 0..numbers.below(3) {
        let _ = port.command(command(symbols, numbers));
    }
}

/// A random command: a force, a release, STOP or RUN.
fn command(symbols: &Symbols, numbers: &mut Numbers) -> ScanCommand {
    let n = numbers.below(400) as u32;
    let bit = MemoryCell::Bit(symbols.layout.bit(Bit::Space(BitSpace::C, n)));
    let word = MemoryCell::Word(symbols.layout.word(Word::Space(WordSpace::D, n)));
    match numbers.below(40) {
        0 => ScanCommand::Stop,
        1..8 => ScanCommand::Run,
        8 => ScanCommand::ReleaseAll,
        9..15 => ScanCommand::Release(bit),
        15..25 => ScanCommand::Force { cell: bit, value: numbers.below(2) as i32 },
        _ => ScanCommand::Force { cell: word, value: numbers.below(9) as i32 },
    }
}

/// Scans a program to its orderly stop, and counts the allocations of every step. For some scans
/// nobody reads the log and the image.
fn assert_no_allocation(name: &str, program: &Program, scans: u64) {
    let (code, symbols) = lower(program);
    let settings = settings(&symbols, scans);
    let clock = SimulatedClock::default();
    let (machine, reader) = tape(Engine::new(code.clone()));
    let (mut scanner, mut monitor, port) = assemble(machine, clock, &settings, Deaf);
    let mut follower = Follower::new(reader, code);
    let mut numbers = Numbers(7);
    let (_, calls) = counted(|| scanner.start());
    assert_eq!(calls, 0, "{name}: at the start of RUN");
    for scan in 0.. {
        stir(&port, &symbols, &mut numbers);
        let (goes_on, calls) = counted(|| scanner.step());
        assert_eq!(calls, 0, "{name}: in scan {scan}");
        if !(scans / 3..scans / 2).contains(&scan) {
            monitor.turn(0);
            follower.follow();
        }
        if !goes_on {
            break;
        }
    }
    monitor.turn(0);
    let latest = port.latest();
    let ended = (latest.scans, latest.mode);
    // A ladder may stop itself.
    let orderly = ended == (scans, Mode::Stop(StopReason::ScanLimit))
        || ended.1 == Mode::Stop(StopReason::Instruction);
    assert!(orderly, "{name}: {ended:?}");
    follower.follow();
    assert_eq!(follower.lost, 0, "{name}");
    assert!(follower.shows(&latest.bits, &latest.words), "{name}: followed to another memory");
}

#[test]
fn scans_of_two_hundred_generated_ladders_allocate_nothing() {
    for seed in 0..200 {
        let name = format!("ladder {seed}");
        assert_no_allocation(&name, &program(&name, generated(seed)), 90);
    }
}

/// Scans over many reloads, with inputs, writes and commands pending too.
#[test]
fn scans_across_a_hundred_reloads_allocate_nothing() {
    let lowered = |seed| lower(&program(&format!("ladder {seed}"), generated(seed)));
    let (code, mut symbols) = lowered(0);
    let settings = settings(&symbols, 2000);
    let clock = SimulatedClock::default();
    // The tape has room for only a few steps, so that some are lost.
    let (machine, reader) = tape_of(Engine::new(code.clone()), 200);
    let (mut scanner, mut monitor, port, mut reloader) =
        assemble_reloadable(machine, clock, &settings, Deaf);
    let mut follower = Follower::new(reader, code.clone());
    let (mut numbers, mut running) = (Numbers(11), code);
    scanner.start();
    for generation in 1..=100 {
        let (code, next) = lowered(u64::from(generation));
        let side = |program, symbols| LoweredProgram { program, symbols };
        let plan = ReloadPlan::new(side(&running, &symbols), side(&code, &next));
        let watched = WatchedCells {
            bits: bits(&next.alarms),
            words: vec![next.layout.word(Word::Space(WordSpace::D, 0))],
            ..WatchedCells::default()
        };
        let carried =
            CarriedWatches { bits: vec![Some(0); watched.bits.len()], words: vec![Some(0)] };
        let contents = PackageParts {
            asked: plan.asked(),
            tempo: settings.pace.tempo,
            transfer: plan.transfer,
            generation,
            watched,
            carried,
            bits: next.layout.bit_count() as usize,
            words: next.layout.word_count() as usize,
            safe: settings.memory.safe.clone(),
        };
        follower.know(generation, code.clone());
        let machine = Taped::new(Engine::new(code.clone())).with_spares();
        let package = Package::new(machine, contents, &port.latest());
        let handed_in = reloader.hand_in(package, false);
        for scan in 0..9 {
            stir(&port, &symbols, &mut numbers);
            let (_, calls) = counted(|| scanner.step());
            assert_eq!(calls, 0, "reload {generation}: in scan {scan}");
            if generation % 7 != 0 {
                monitor.turn(0);
                follower.follow();
            }
        }
        // If the queue of commands is full, the package is not accepted, and is returned later.
        while let Some(package) = reloader.returned() {
            if package.swapped.is_some() {
                assert!(handed_in.is_ok());
                (running, symbols) = (code.clone(), next.clone());
            }
        }
        monitor.turn(0);
        monitor.turn(0);
        if running.bit_count == code.bit_count {
            assert_eq!(port.latest().bits.len(), symbols.layout.bit_count() as usize);
        }
    }
    assert!(follower.compared > 5, "{} states compared", follower.compared);
    assert!(follower.lost > 0, "no step was lost: the ring is too long for this test");
}

/// Local lines that are read and written in every scan, fail and come back, also over a stop.
#[test]
fn scans_with_local_lines_allocate_nothing() {
    let line = |offset| GpioLine { at: LineId::Offset(offset), setting: LineSetting::default() };
    let lines = GpioLines {
        chip: ChipName::Path("/dev/none".into()),
        budget_us: 200,
        inputs: (0..100).map(line).collect(),
        outputs: (100..200).map(line).collect(),
    };
    let chip = FakeChip::default();
    let gpio = GpioOpener::new(&lines, chip.clone());
    let (code, symbols) = lower(&program("local", generated(3)));
    let mut settings = settings(&symbols, 600);
    let bit = |n| symbols.layout.bit(Bit::Space(BitSpace::C, n));
    settings.field = vec![Wiring {
        inputs: (0..100).map(WiringTarget::Input).collect(),
        outputs: (0..100).map(OutputSource::Output).collect(),
        ok: bit(500),
        stale: bit(501),
        loss_after_ns: 50_000_000,
        zero_on_loss: true,
        local_budget_ns: Some(10_000_000_000),
    }];
    let clock = SimulatedClock::default();
    let (machine, reader) = tape(Engine::new(code.clone()));
    let mut follower = Follower::new(reader, code);
    let whole = assemble_whole(machine, clock, &settings, Deaf);
    let RuntimeParts { mut scanner, mut monitor, port, mut lines, .. } = whole;
    let mut local = lines.remove(0).local.expect("it is local");
    let mut numbers = Numbers(5);
    scanner.start();
    let mut failures = 0;
    for scan in 0.. {
        if scan % 40 == 0 {
            assert!(local.hand_in(gpio.open(&[0; 100]).expect("it opens")));
        }
        chip.is_gone.store(scan % 40 == 30, Ordering::Relaxed);
        stir(&port, &symbols, &mut numbers);
        let (goes_on, calls) = counted(|| scanner.step());
        assert_eq!(calls, 0, "in scan {scan}");
        failures += u32::from(local.failure().is_some());
        monitor.turn(0);
        follower.follow();
        if !goes_on {
            break;
        }
    }
    assert!(failures > 3, "{failures}");
    assert!(follower.compared > 3 && follower.lost == 0, "{} states compared", follower.compared);
}

#[test]
fn scans_with_arrays_allocate_nothing() {
    let text = r#"
        [tags]
        word = { at = "D10", count = 9 }
        gate = { at = "C0", count = 9 }
        [[program]]
        name = "Main"
        rung = [
          { when = ["$On"], do = ["MATH D0 = $ScanCounter % 12 - 1", "MOVE word[D0] to=D1"] },
          { when = ["gate[D0] | word[D0] > 3"], do = ["RST gate[D0]", "MATH word[D0] = sum(word)"] },
          { when = ["$ScanToggle"], do = ["COPY word[0..7] to=word[1..8]", "FILL D0 to=word[0..1]"] },
          { leg.data = ["$1Second"], leg.clk = ["$50ms"], leg.rst = ["$Off"], do = ["SR gate"] },
          { leg.up = ["$50ms"], leg.rst = ["$Off"], do = ["CNT CT0 preset=word[D0]"] },
        ]
        "#;
    assert_no_allocation("arrays", &program("arrays", text.to_owned()), 1000);
}

#[test]
fn scans_of_every_shipped_ladder_allocate_nothing() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let entries = std::fs::read_dir(folder).expect("config");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    // Loads the controller file, because it also names the library's files.
    for path in paths.filter(|path| path.extension().is_some_and(|e| e == "toml")) {
        let loaded = rungd_config::load::controller_file(&path).expect("readable");
        let program = loaded.program.expect("a program");
        assert_no_allocation(&path.display().to_string(), &program, 1000);
    }
}

#[test]
fn the_allocation_counter_counts_allocations() {
    let (_, calls) = counted(|| drop(std::hint::black_box(Box::new(1))));
    assert_eq!(calls, 2);
}

#[test]
fn the_sources_of_the_scan_thread_name_nothing_that_waits() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/runtime/src");
    let forbidden = [
        "Mutex", "RwLock", "Condvar", "println!", "tracing", "std::fs", "std::net", "std::io",
        "format!", ".recv(", "vec!", "Box::new", "String",
    ];
    for file in ["scanner.rs", "scan_loop.rs", "obey.rs", "beat.rs", "pacing.rs", "machine.rs"] {
        let text = std::fs::read_to_string(folder.join(file)).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        for line in lines {
            let found = forbidden.iter().find(|word| line.contains(*word));
            assert_eq!(found, None, "{file}: {line}");
        }
    }
}

#[test]
fn lowering_allocates_in_proportion_to_the_contacts_of_a_leg() {
    let bytes = |contacts: usize| {
        let when = "\"X0\",".repeat(contacts);
        let rung = format!("[[program.rung]]\nwhen = [{when}]\ndo = [\"OUT Y0\"]\n");
        let program = program("series", format!("[[program]]\nname = \"Main\"\n{rung}"));
        let before = BYTES.get();
        lower(&program);
        BYTES.get() - before
    };
    let (none, some, many) = (bytes(1), bytes(1000), bytes(4000));
    assert!(many - none < 6 * (some - none), "{none}, {some}, {many} bytes");
}

/// The bits of alarms that are no bits of words.
fn bits(alarms: &[rungd_language::lower::Alarm]) -> Vec<BitCell> {
    let bit = |alarm: &rungd_language::lower::Alarm| match alarm.bit {
        MemoryCell::Bit(bit) => Some(bit),
        MemoryCell::Word(_) | MemoryCell::WordBit(_) => None,
    };
    alarms.iter().filter_map(bit).collect()
}
