//! Makes the answer to `status`.
//!
//! The answer is made of facts from the start, the latest image, and the scan thread's atomics. No
//! command goes to the scan thread.

use std::collections::HashSet;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use super::outputs::{DeviceOutputs, OutputSight};
use crate::daemon::alarm_book::AlarmBook;
use crate::daemon::alarm_file::AlarmFileHandle;
use crate::daemon::alarm_keeper::SharedBook;
use crate::daemon::config::{ControllerSetup, LadderFacts};
use crate::daemon::log;
use crate::daemon::record_thread::RecordHandle;
use crate::daemon::reload::Deploys;
use crate::daemon::retain_thread::RetainHandle;
use rungd_base::locked::locked;
use rungd_client::operator::names::OperandNames;
use rungd_client::operator::protocol::{
    self, AlarmStatus, BlockStatus, ControllerStatus, DeployList, DevicesStatus, FieldDevice,
    HistogramBar, LadderStatus, LogStatus, ModbusStatus, PROTOCOL, PostureStatus, RecordDir,
    RecordStatus, RetainStatus, ScanStatus, ShownValue, SpreadStatus,
};
use rungd_config::controller::web::WebSettings;
use rungd_engine::isa::{self, Address, Bit, BitSpace, BlockId, DeviceId, StageId};
use rungd_engine::{Cell, Layout};
use rungd_history::record::RecordedFile;
use rungd_io::device::DeviceHealth;
use rungd_io::seats::Seats;
use rungd_language::lower;
use rungd_language::resolve::name_book::{BlockName, NameBook};
use rungd_language::resolve::program::BlockKind;
use rungd_runtime::exchange::{Mode, Snapshot, Tempo};
use rungd_runtime::{self as runtime, Grant, PreparedThreads, ThreadGauge, monotonic_ns};

/// The facts that were collected at the start. They are the same for every program.
#[derive(Clone)]
pub(in super::super) struct StatusSources {
    pub grants: Vec<Grant>,
    pub gauge: ThreadGauge,
    pub started: Instant,
    /// The Modbus server's address, its greatest number of clients, and their seats.
    pub modbus: Option<(String, u32, Seats)>,
    pub retention: Option<RetainHandle>,
    pub recording: RecordHandle,
    /// The field devices, by number.
    pub devices: Vec<DeviceHealth>,
    /// The book of alarms.
    pub book: SharedBook,
    /// The file that keeps shelves and acknowledgements.
    pub alarm_file: Option<AlarmFileHandle>,
    /// The last changes of the program.
    pub deploys: Deploys,
}

impl StatusSources {
    /// The facts without a Modbus server, field devices and alarms; the caller adds these.
    pub fn new(
        prepared: &PreparedThreads,
        retention: Option<RetainHandle>,
        recording: RecordHandle,
    ) -> StatusSources {
        StatusSources {
            grants: prepared.grants().to_vec(),
            gauge: prepared.gauge(),
            started: Instant::now(),
            modbus: None,
            retention,
            recording,
            devices: Vec::new(),
            book: Arc::new(Mutex::new(AlarmBook::new(&[]))),
            alarm_file: None,
            deploys: Deploys::default(),
        }
    }
}

/// The data that the service needs about a program.
pub(in super::super) struct ProgramView {
    pub names: Arc<OperandNames>,
    pub about: StatusFacts,
    /// What users of pages may write and hold.
    pub pages: Arc<WebSettings>,
}

impl ProgramView {
    pub fn new(setup: &ControllerSetup, parts: &StatusSources) -> ProgramView {
        let (names, about) = (Arc::clone(&setup.names), StatusFacts::new(setup, parts));
        ProgramView { names, about, pages: Arc::clone(&setup.pages) }
    }

    /// The sight of the latest image.
    pub(super) fn sight<'a>(&self, latest: &'a Snapshot) -> OutputSight<'a> {
        let StatusFacts { parts, outputs, .. } = &self.about;
        OutputSight::new(latest, parts.devices.iter().zip(outputs))
    }
}

/// The facts of a status that stay the same while a program runs, and the sources of the others.
pub(in super::super) struct StatusFacts {
    controller: String,
    ladder: LadderFacts,
    files: Arc<[RecordedFile]>,
    parts: StatusSources,
    tempo: Tempo,
    blocks: Vec<NamedBlock>,
    layout: Layout,
    rules: usize,
    /// The alarms, each with the cell of its bit; `None`: it has a delay, and only the book knows.
    alarms: Vec<(Option<Cell>, AlarmStatus)>,
    /// The name of each driver, with the addresses that it moves.
    movers: Vec<(String, HashSet<Address>)>,
    /// The outputs of each field device, by number.
    outputs: Vec<DeviceOutputs>,
}

struct NamedBlock {
    id: BlockId,
    name: String,
    is_task: bool,
    stages: Vec<(StageId, String)>,
}

impl StatusFacts {
    fn new(setup: &ControllerSetup, parts: &StatusSources) -> StatusFacts {
        let modbus = setup.modbus.as_ref();
        let input = |n| Address::Bit(Bit::Space(BitSpace::X, n));
        let simulated = setup.rules.iter().map(|rule| input(rule.input)).collect();
        let image = modbus.and_then(|modbus| modbus.inputs.as_ref());
        let image = image.into_iter().flat_map(|(_, x)| x.first..=x.last).map(input).collect();
        let mut movers = vec![
            ("the simulated device".to_owned(), simulated),
            ("a Modbus client".to_owned(), image),
        ];
        movers.extend(setup.devices.iter().map(|device| {
            let moved = device.inputs.iter().map(|input| input.address).collect();
            (format!("device {}", device.name), moved)
        }));
        StatusFacts {
            controller: setup.controller.clone(),
            ladder: setup.ladder.clone(),
            files: Arc::clone(&setup.files),
            parts: parts.clone(),
            tempo: setup.pace.tempo,
            blocks: named_blocks(&setup.symbols.names),
            layout: setup.symbols.layout.clone(),
            rules: setup.rules.len(),
            alarms: alarms(setup),
            movers,
            outputs: setup.field.iter().map(DeviceOutputs::of).collect(),
        }
    }

    /// Retentive memory, if the controller file has it.
    pub(super) fn retention(&self) -> Option<&RetainHandle> {
        self.parts.retention.as_ref()
    }

    /// The scan log.
    pub(super) fn recording(&self) -> &RecordHandle {
        &self.parts.recording
    }

    /// The program's files.
    pub(super) fn files(&self) -> &Arc<[RecordedFile]> {
        &self.files
    }

    /// The driver that moves an input, or a word or bit that serves as an input.
    pub(super) fn driver_of(&self, what: Address) -> Option<&str> {
        let mover = self.movers.iter().find(|(_, moved)| moved.contains(&what));
        mover.map(|(driver, _)| driver.as_str())
    }

    pub(super) fn status(
        &self,
        latest: &Snapshot,
        forces: Vec<ShownValue>,
        outputs: Vec<ShownValue>,
    ) -> ControllerStatus {
        let now_ns = monotonic_ns();
        let ladder = &self.ladder;
        ControllerStatus {
            protocol: PROTOCOL,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            uptime_ms: self.parts.started.elapsed().as_millis() as u64,
            controller: self.controller.clone(),
            ladder: LadderStatus {
                name: ladder.name.clone(),
                files: ladder.files.clone(),
                sha256: ladder.sha256.clone(),
                blocks: ladder.blocks,
                rungs: ladder.rungs,
            },
            mode: latest.mode.name().to_owned(),
            reason: reason(latest.mode),
            mode_ms: now_ns.saturating_sub(latest.since_ns) / 1_000_000,
            scans: latest.scans,
            period_us: self.tempo.period_ns / 1000,
            watchdog_us: self.tempo.watchdog_ns / 1000,
            posture: self.parts.grants.iter().map(posture).collect(),
            scan: scan(&self.parts.gauge.meter.read(now_ns)),
            blocks: self.blocks.iter().map(|block| self.block(block, latest)).collect(),
            alarms: self.active(latest),
            forces,
            outputs,
            devices: DevicesStatus {
                modbus: self.parts.modbus.as_ref().map(|(address, connections_max, seats)| {
                    ModbusStatus {
                        address: address.clone(),
                        clients: seats.count(),
                        connections_max: *connections_max,
                    }
                }),
                simulated_rules: (self.rules > 0).then_some(self.rules),
                field: self.field(latest),
            },
            retain: self.parts.retention.as_ref().map(retain),
            record: record(&self.parts.recording),
            log: LogStatus {
                level: log::level(),
                lines_dropped: log::lines_dropped(),
                records_dropped: self.parts.gauge.records_dropped(),
            },
        }
    }

    /// The book of alarms.
    pub(super) fn book(&self) -> MutexGuard<'_, AlarmBook> {
        locked(&self.parts.book)
    }

    /// The last changes of the program.
    pub(super) fn deploys(&self) -> DeployList {
        self.parts.deploys.list()
    }

    /// The file that keeps shelves and acknowledgements.
    pub(super) fn alarm_file(&self) -> Option<&AlarmFileHandle> {
        self.parts.alarm_file.as_ref()
    }

    /// The alarms that are ON, also those that are shelved. For an alarm that has just risen, the
    /// book may have no entry yet.
    fn active(&self, latest: &Snapshot) -> Vec<AlarmStatus> {
        let (book, now_ns) = (self.book(), monotonic_ns());
        let active = self.alarms.iter().enumerate().filter_map(|(number, (cell, alarm))| {
            let booked = || book.active(latest.generation, number, now_ns);
            match cell {
                Some(cell) if latest.value(*cell) == 0 => None,
                Some(_) => Some(booked().unwrap_or_else(|| alarm.clone())),
                None => booked(),
            }
        });
        active.chain(book.broken_watches(now_ns)).collect()
    }

    fn field(&self, latest: &Snapshot) -> Vec<FieldDevice> {
        let is_on = |bit| latest.bit(self.layout.bit(bit));
        let device = |(at, health): (usize, &DeviceHealth)| {
            let (id, reading) = (DeviceId(at as u32), health.condition());
            FieldDevice {
                name: reading.name,
                driver: reading.driver.to_owned(),
                peer: reading.peer,
                ok: is_on(Bit::Device(id, isa::DeviceBit::Ok)),
                stale: is_on(Bit::Device(id, isa::DeviceBit::Stale)),
                exchanges: reading.exchanges,
                failures: reading.failures,
                took_us: reading.took.as_micros() as u64,
                took_max_us: reading.took_max.as_micros() as u64,
                trouble: reading.trouble,
            }
        };
        self.parts.devices.iter().enumerate().map(device).collect()
    }

    fn block(&self, block: &NamedBlock, latest: &Snapshot) -> BlockStatus {
        let is_on = |bit| latest.bit(self.layout.bit(bit));
        let on = block.stages.iter().filter(|(id, _)| is_on(Bit::Stage(*id)));
        BlockStatus {
            name: block.name.clone(),
            kind: if block.is_task { "task" } else { "program" }.to_owned(),
            // In FAULT the bits of the blocks keep their values, but no block runs.
            running: latest.mode == Mode::Run && is_on(Bit::Running(block.id)),
            done: block.is_task.then(|| is_on(Bit::Done(block.id))),
            stages: on.map(|(_, name)| name.clone()).collect(),
        }
    }
}

fn alarms(setup: &ControllerSetup) -> Vec<(Option<Cell>, AlarmStatus)> {
    let alarm = |named: &lower::Alarm| AlarmStatus {
        tag: named.tag.clone(),
        text: named.text.clone(),
        priority: named.terms.priority,
        group: named.terms.group.clone(),
        ..AlarmStatus::default()
    };
    let bit = |named: &lower::Alarm| (!named.terms.is_delayed()).then_some(named.bit);
    setup.symbols.alarms.iter().map(|named| (bit(named), alarm(named))).collect()
}

fn named_blocks(names: &NameBook) -> Vec<NamedBlock> {
    let block = |(id, block): (u32, &BlockName)| {
        let is_task = block.kind != BlockKind::Program;
        NamedBlock { id: BlockId(id), name: block.name.clone(), is_task, stages: Vec::new() }
    };
    let mut blocks: Vec<NamedBlock> = (0..).zip(&names.blocks).map(block).collect();
    for (id, stage) in (0..).zip(&names.stages) {
        blocks[stage.block.0 as usize].stages.push((StageId(id), stage.name.clone()));
    }
    // A subroutine never runs by itself.
    blocks.retain(|block| names.block(block.id).kind != BlockKind::Subroutine);
    blocks
}

fn retain(retention: &RetainHandle) -> RetainStatus {
    let (wanted, figures) = (&retention.wanted, retention.figures());
    let us = |time: Duration| time.as_micros() as u64;
    let kept = figures.kept.as_ref();
    RetainStatus {
        file: wanted.path.display().to_string(),
        interval_ms: wanted.interval.as_millis() as u64,
        image: kept.map(|(kept, _)| kept.stamp.sequence),
        scan: kept.map(|(kept, _)| kept.stamp.scan),
        age_ms: kept.map(|(_, since)| since.elapsed().as_millis() as u64),
        flush_us: us(figures.flush),
        flush_max_us: us(figures.flush_max),
        writes: figures.writes,
        bytes: figures.bytes,
        bytes_per_day: figures.projected(wanted.budget),
        budget_per_day: wanted.budget,
        restored: figures.restored,
        failing: figures.failing,
    }
}

fn record(recording: &RecordHandle) -> RecordStatus {
    let figures = recording.figures();
    RecordStatus {
        memory_ms: figures.reach_ns / 1_000_000,
        memory_bytes: figures.memory_bytes,
        lost: figures.lost,
        disk: figures.disk.map(|disk| RecordDir {
            dir: disk.dir,
            bytes: disk.bytes,
            size: disk.size,
            failing: disk.failing,
            behind_ms: disk.behind.as_millis() as u64,
        }),
    }
}

fn posture(grant: &Grant) -> PostureStatus {
    PostureStatus {
        asked: grant.what.clone(),
        granted: grant.refused.is_none(),
        why: grant.refused.as_ref().map(|refusal| refusal.why.clone()),
    }
}

fn scan(reading: &runtime::MeterReading) -> ScanStatus {
    let statistics = &reading.statistics;
    ScanStatus {
        over_ms: statistics.over_ns / 1_000_000,
        scans: statistics.scans,
        overruns: statistics.overruns,
        skipped: statistics.skipped,
        execution: spread(&statistics.execution, &reading.execution),
        lateness: spread(&statistics.lateness, &reading.lateness),
    }
}

fn spread(spread: &runtime::Spread, bars: &[runtime::HistogramBucket]) -> protocol::SpreadStatus {
    use crate::daemon::narration::us;
    let bar = |bar: &runtime::HistogramBucket| HistogramBar {
        up_to_us: us(bar.up_to_ns),
        count: bar.count,
    };
    SpreadStatus {
        last_us: us(spread.last_ns),
        min_us: us(spread.min_ns),
        sum_us: us(spread.sum_ns),
        mean_us: us(spread.mean_ns),
        p50_us: us(spread.p50_ns),
        p99_us: us(spread.p99_ns),
        p999_us: us(spread.p999_ns),
        max_us: us(spread.max_ns),
        histogram: bars.iter().map(bar).collect(),
    }
}

/// The reason for the mode; `None` in RUN.
pub(super) fn reason(mode: Mode) -> Option<String> {
    (mode != Mode::Run).then(|| crate::daemon::narration::reason(mode))
}
