//! A reader of the scan log reports exactly the changes that happened: each once, in order, over
//! random inputs, reloads, restarts and pauses.

use std::collections::BTreeMap;

use rungd_client::live::{ChangeFollower, ChangeHistory, HistorySpan, LogEvent, LogPosition};
use rungd_history::record::Recording;

use rungd_test_support::logged_plant::{Happened, LoggedPlant, OFFSET_NS, choose_all};

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
fn a_follower_reports_each_change_once() {
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
fn the_past_contains_each_change_once_from_any_position() {
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
fn changes_older_than_memory_are_counted() {
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
fn a_gap_and_the_past_together_contain_every_change() {
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
fn a_section_that_cannot_be_executed_is_reported_as_a_gap() {
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
