//! Tests of the swap of a program between two scans: the publications and the returned package.

use super::super::command::{CommandDenial, CommandId, CommandOutcome, ScanCommand};
use super::super::record::CarriedWatches;
use super::super::swap::{Package, PackageParts};
use super::*;
use rungd_engine::{Cell, Transfer, WordCell};

impl Rig {
    /// A program with one more bit, whose scans take `takes_ns`.
    fn package(&self, generation: u32, takes_ns: u64) -> Package<Fake> {
        let machine = Fake {
            clock: self.clock.clone(),
            bits: [0; 3],
            words: [0],
            takes_ns: vec![takes_ns],
            panics_in: None,
            stops_in: None,
            scans: 0,
            forced_ns: 0,
            stop: false,
            times: Rc::clone(&self.times),
            local: Rc::clone(&self.local),
        };
        let contents = PackageParts {
            transfer: Transfer::default(),
            generation,
            tempo: self.port.tempo(),
            asked: vec![Cell::Word(WordCell(0))],
            watched: WatchedCells { bits: vec![BitCell(1)], ..WatchedCells::default() },
            carried: CarriedWatches { bits: vec![None], words: vec![] },
            bits: 2,
            words: 1,
            safe: vec![SafeState::On],
        };
        Package::new(machine, contents, &self.port.latest())
    }

    /// Does the same as [`Rig::package`], with this safe value of Y0.
    fn package_with(&self, generation: u32, takes_ns: u64, safe: SafeState) -> Package<Fake> {
        let mut package = self.package(generation, takes_ns);
        package.safe = vec![safe];
        package.fresh.iter_mut().for_each(|fresh| {
            std::sync::Arc::get_mut(fresh).unwrap().safe = vec![safe].into();
        });
        package
    }

    pub(super) fn swap(&mut self, generation: u32, takes_ns: u64, resume: bool) -> CommandId {
        let package = self.package(generation, takes_ns);
        let id = self.reloader.hand_in(package, resume).unwrap();
        self.step();
        id
    }
}

#[test]
fn a_program_is_swapped_between_two_scans_and_the_old_one_is_returned() {
    let mut rig = rig(|_, _| {});
    rig.steps(3);
    let id = rig.swap(1, MS, false);
    let latest = rig.port.latest();
    assert_eq!((latest.generation, latest.scans, latest.mode), (1, 4, Mode::Run));
    assert_eq!((&*latest.bits, &*latest.words), (&[0, 1][..], &[4][..]), "its shape, and memory");
    assert!(matches!(rig.port.answer(id), Some(CommandOutcome::Done(_))));
    let back = rig.reloader.returned().expect("the package comes back");
    assert_eq!(back.swapped.map(|swapped| swapped.mode), Some(Mode::Run));
    assert_eq!((back.machine.scans, back.machine.words[0]), (3, 3));
    assert_eq!(back.asked, [(Cell::Word(WordCell(0)), 3)], "as it was before the swap");
    let told = rig.heard.take();
    assert!(told.iter().any(|line| line.starts_with("3: Swapped { generation: 1")), "{told:?}");
    assert!(told.contains(&"4: Bit { watch: 0, on: true, after_ns: 0 }".to_owned()), "{told:?}");
    rig.steps(50);
    assert_eq!((rig.port.latest().scans, rig.port.latest().bits.len()), (54, 2));
}

/// The log's reader is late: the ring of records is full.
#[test]
fn a_swap_is_reported_before_any_record_of_the_new_program() {
    let watched = WatchedCells { bits: vec![BitCell(0)], ..WatchedCells::default() };
    let mut rig = rig(|_, settings| settings.watched = watched);
    rig.steps(3);
    let told = |rig: &Rig| rig.heard.take().join("\n");
    // Every scan tells a change of bit 0.
    (0..5000).for_each(|_| _ = rig.scanner.step());
    let _ = rig.reloader.hand_in(rig.package(1, MS), false).unwrap();
    (0..3).for_each(|_| _ = rig.scanner.step());
    rig.monitor.turn(rig.clock.now_ns());
    let late = told(&rig);
    assert!(late.contains("Bit { watch: 0") && !late.contains("Swapped"), "the ring was full");
    rig.step();
    let lines = told(&rig);
    let first = lines.lines().next().unwrap_or_default();
    assert!(first.contains("Swapped { generation: 1"), "{lines}");
}

#[test]
fn many_swaps_lose_no_snapshot_and_no_scan() {
    let mut rig = rig(|_, _| {});
    rig.step();
    let mut readers = Vec::new();
    for generation in 1..200 {
        readers.push(rig.port.latest());
        readers.drain(..readers.len().saturating_sub(5));
        rig.swap(generation, MS, false);
        let latest = rig.port.latest();
        assert_eq!((latest.generation, latest.scans), (generation, u64::from(generation) + 1));
        assert!(rig.reloader.returned().is_some());
    }
}

#[test]
fn a_swap_in_fault_continues_in_run_if_requested() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, MS, 100 * MS]);
    rig.steps(3);
    assert!(matches!(rig.port.latest().mode, Mode::Fault(_)));
    rig.swap(1, MS, false);
    let latest = rig.port.latest();
    assert!(matches!(latest.mode, Mode::Fault(_)), "without it the fault stays");
    assert_eq!((latest.generation, &*latest.outputs), (1, &[1][..]), "safe values stay");
    rig.swap(2, MS, true);
    rig.step();
    let latest = rig.port.latest();
    assert_eq!((latest.generation, latest.mode, latest.scans), (2, Mode::Run, 3));
    assert_eq!(latest.words[0], 4, "memory is as it is: the scan of the fault counts too");
}

#[test]
fn a_swap_after_a_panic_is_refused_and_loses_no_program() {
    let mut rig = rig(|fake, _| fake.panics_in = Some(1));
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    rig.steps(2);
    std::panic::set_hook(hook);
    assert_eq!(rig.port.latest().mode, Mode::Fault(FaultReason::EnginePanic));
    let id = rig.swap(1, MS, false);
    assert_eq!(rig.port.answer(id), Some(CommandOutcome::Denied(CommandDenial::EngineBroken)));
    let mut back = 0;
    for generation in 2..20 {
        let package = rig.package(generation, MS);
        let handed_in = rig.reloader.hand_in(package, true);
        rig.step();
        match handed_in {
            Ok(id) => {
                assert_eq!(
                    rig.port.answer(id),
                    Some(CommandOutcome::Denied(CommandDenial::EngineBroken))
                );
            }
            Err(denial) => assert_eq!(denial, CommandDenial::QueueFull, "until those are back"),
        }
        while let Some(package) = rig.reloader.returned() {
            assert_eq!(package.swapped, None);
            back += 1;
        }
    }
    assert!(back > 8, "{back}");
    let latest = rig.port.latest();
    assert_eq!(latest.mode, Mode::Fault(FaultReason::EnginePanic), "also as the way back");
    assert_eq!(latest.generation, 0);
}

#[test]
fn a_fault_in_the_first_scan_of_a_new_program_shows_this_program() {
    let mut rig = rig(|_, _| {});
    rig.steps(3);
    let package = rig.package_with(1, 100 * MS, SafeState::Off);
    let id = rig.reloader.hand_in(package, false).unwrap();
    rig.step();
    let latest = rig.port.latest();
    let fault = Mode::Fault(FaultReason::ScanTooLong { scan_us: 100_000 });
    assert_eq!((latest.generation, latest.scans, latest.mode), (1, 3, fault));
    assert_eq!((latest.bits.len(), &*latest.words), (2, &[3][..]), "as that scan found it");
    assert_eq!(*latest.outputs, [0], "its safe values");
    assert!(matches!(rig.port.answer(id), Some(CommandOutcome::Done(_))));

    let id = rig.swap(2, 100 * MS, true);
    assert!(matches!(rig.port.answer(id), Some(CommandOutcome::Done(_))));
    rig.step();
    let latest = rig.port.latest();
    assert_eq!((latest.generation, latest.scans, latest.mode), (2, 3, fault), "resumed, and again");
    let force = rig.order_and_step(ScanCommand::Force { cell: Cell::Word(WordCell(0)), value: 7 });
    assert!(
        matches!(rig.port.answer(force), Some(CommandOutcome::Done(_))),
        "no cell is of a gone program"
    );
}

/// The last scan before STOP faults on probation: the program is taken back, and nothing runs.
#[test]
fn a_fault_in_the_last_scan_before_stop_causes_no_further_scan() {
    let mut rig = rig(|fake, _| fake.takes_ns = vec![MS, MS, 100 * MS, MS]);
    rig.steps(2);
    rig.order(ScanCommand::Stop);
    rig.steps(2);
    let fault = Mode::Fault(FaultReason::ScanTooLong { scan_us: 100_000 });
    assert_eq!((rig.port.latest().mode, rig.port.latest().scans), (fault, 2));
    let id = rig.swap(1, MS, true);
    assert!(matches!(rig.port.answer(id), Some(CommandOutcome::Done(_))), "it is taken back");
    rig.steps(3);
    let latest = rig.port.latest();
    assert_eq!((latest.generation, latest.scans, latest.mode), (1, 2, fault));
    rig.order_and_step(ScanCommand::Run);
    rig.step();
    assert_eq!((rig.port.latest().mode, rig.port.latest().scans), (Mode::Run, 3));
}

#[test]
fn a_hanging_first_scan_shows_its_program_and_safe_values() {
    let mut rig = rig(|_, _| {});
    rig.steps(3);
    let package = rig.package_with(1, MS, SafeState::Off);
    let _ = rig.reloader.hand_in(package, false).unwrap();
    let now_ns = rig.clock.now_ns();
    rig.scanner.obey(now_ns);
    rig.scanner.beat.begin(now_ns);
    rig.monitor.turn(now_ns + MS);
    assert_eq!(rig.port.latest().generation, 0, "while the scan may be in time");
    rig.monitor.turn(now_ns + 1000 * MS);
    let latest = rig.port.latest();
    let fault = Mode::Fault(FaultReason::ScanNeverEnds);
    assert_eq!((latest.generation, latest.scans, latest.mode), (1, 3, fault));
    assert_eq!(*latest.outputs, [0], "its safe values");
}

#[test]
fn safe_values_of_a_new_program_apply_from_the_swap_on() {
    let mut rig = rig(|_, _| {});
    rig.steps(2);
    rig.port.command(super::super::command::ScanCommand::Stop).unwrap();
    rig.steps(3);
    for (generation, safe, outputs) in [
        (1, SafeState::On, 1),
        (2, SafeState::Hold, 1),
        (3, SafeState::Off, 0),
        (4, SafeState::Hold, 0),
    ] {
        let package = rig.package_with(generation, MS, safe);
        rig.reloader.hand_in(package, false).unwrap();
        rig.step();
        let latest = rig.port.latest();
        assert_eq!((latest.generation, &*latest.outputs), (generation, &[outputs][..]), "{safe:?}");
    }
}

#[test]
fn a_swap_in_stop_shows_memory_in_the_new_layout() {
    let mut rig = rig(|_, _| {});
    rig.steps(2);
    rig.port.command(super::super::command::ScanCommand::Stop).unwrap();
    rig.steps(3);
    rig.swap(1, MS, false);
    let latest = rig.port.latest();
    assert_eq!((latest.generation, latest.bits.len()), (1, 2));
    assert!(matches!(latest.mode, Mode::Stop(StopReason::Operator)));
}

#[test]
fn a_new_period_counts_from_the_deadline_of_the_swap() {
    let mut rig = rig(|_, _| {});
    rig.steps(3);
    let due = |rig: &Rig| rig.port.latest().now_ns;
    let begin_ns = due(&rig);
    for (generation, period_ms, next_ms) in [(1, 25, 35), (2, 5, 65), (3, 10, 80)] {
        let mut package = rig.package(generation, MS);
        package.tempo = Tempo { period_ns: period_ms * MS, watchdog_ns: 50 * MS };
        let _ = rig.reloader.hand_in(package, false).unwrap();
        rig.step();
        assert_eq!(rig.port.tempo(), Tempo { period_ns: period_ms * MS, watchdog_ns: 50 * MS });
        rig.step();
        assert_eq!(due(&rig) - begin_ns, next_ms * MS);
    }
    assert_eq!(rig.port.latest().mode, Mode::Run);
}

#[test]
fn a_longer_watchdog_applies_from_the_scan_of_the_swap_on() {
    let mut rig = rig(|_, _| {});
    rig.steps(3);
    let mut package = rig.package(1, 90 * MS);
    package.tempo.watchdog_ns = 100 * MS;
    let _ = rig.reloader.hand_in(package, false).unwrap();
    rig.steps(2);
    assert_eq!(rig.port.latest().mode, Mode::Run);
    let mut package = rig.package(2, 90 * MS);
    package.tempo.watchdog_ns = 80 * MS;
    let _ = rig.reloader.hand_in(package, false).unwrap();
    rig.step();
    assert!(matches!(rig.port.latest().mode, Mode::Fault(_)));
}
