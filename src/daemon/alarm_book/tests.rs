//! Unit tests of the book of alarms.

use super::entry::{DayCount, SLICE_NS, SLICES};
use super::*;
use rungd_client::operator::protocol::SHELF_MS_MAX;
use rungd_client::operator::protocol::{AlarmAck, AlarmState, AlarmStatus};
use rungd_engine::BitCell;
use rungd_engine::Cell;
use rungd_language::resolve::alarm_terms::AlarmTerms;
use rungd_runtime::command::Forces;
use rungd_runtime::exchange::Snapshot;
use rungd_runtime::exchange::{Mode, StopReason};

const SECOND_NS: u64 = 1_000_000_000;
const HOUR_NS: u64 = 3600 * SECOND_NS;

fn known(tags: &[&str]) -> Vec<KnownAlarm> {
    let alarm = |(at, tag): (usize, &&str)| KnownAlarm {
        of: AlarmSource::Bit(Cell::Bit(BitCell(at as u32))),
        tag: (*tag).to_owned(),
        text: format!("{tag} happened"),
        terms: AlarmTerms::default(),
        may_be_shelved: true,
    };
    tags.iter().enumerate().map(alarm).collect()
}

fn book() -> AlarmBook {
    AlarmBook::new(&known(&["a", "b", "c", "d"]))
}

/// The book of the next process.
fn fresh() -> AlarmBook {
    book()
}

/// The time of a scan: one scan per second.
fn at(scan: u64) -> BookTime {
    BookTime { scan, at_ns: scan * SECOND_NS, unix_ns: (scan * SECOND_NS) as i64 }
}

fn ack() -> AlarmAck {
    AlarmAck { who: "anna".to_owned(), unix_ns: 5 }
}

/// The list in a short form: `a1` stands and is the first of its episode, `(b2)` went away, `a1!`
/// is acknowledged, `c=shelved` is shelved.
fn short(book: &AlarmBook) -> String {
    let one = |alarm: &AlarmStatus| {
        let (tag, order) = (&alarm.tag, alarm.order);
        if let Some(shelf) = &alarm.shelved {
            return format!("{tag}={}", shelf.name());
        }
        match alarm.state {
            AlarmState::Normal => panic!("{tag} is in the list"),
            AlarmState::Unacknowledged => format!("{tag}{order}"),
            AlarmState::Acknowledged => format!("{tag}{order}!"),
            AlarmState::Returned => format!("({tag}{order})"),
        }
    };
    book.list(0).iter().map(one).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_first_out_is_the_first_alarm_after_none() {
    let mut book = book();
    for (number, on, scan) in [(2, true, 5), (0, true, 7), (3, true, 7), (2, false, 8)] {
        book.edge(number, on, at(scan));
    }
    assert_eq!(short(&book), "a2 d3 (c1)");
    book.edge(1, true, at(9));
    assert_eq!(short(&book), "a2 d3 b4 (c1)", "the episode goes on while one stands");
    book.edge(2, true, at(10));
    assert_eq!(short(&book), "c1 a2 d3 b4", "it rose first, and again");
    for number in 0..4 {
        book.edge(number, false, at(11));
    }
    book.edge(1, true, at(12));
    assert_eq!(short(&book), "b1 (c1) (a2) (d3)", "none stood: a new episode");
    let episodes: Vec<u64> = book.list(0).iter().map(|alarm| alarm.episode).collect();
    assert_eq!(episodes, [2, 1, 1, 1]);
}

/// The scan thread reports the changes of a scan in the order of the file, not in their order in
/// time.
#[test]
fn changes_of_one_scan_belong_to_one_episode_in_any_order() {
    for (first, second) in [((0, false), (1, true)), ((1, true), (0, false))] {
        let mut book = book();
        book.edge(0, true, at(3));
        for (number, on) in [first, second] {
            book.edge(number, on, at(6));
        }
        assert_eq!(short(&book), "b2 (a1)");
    }
}

#[test]
fn alarms_have_the_states_of_isa_18_2() {
    let mut book = book();
    let state = |book: &AlarmBook| book.alarms[0].state;
    let acked = |book: &mut AlarmBook| {
        let acked = book.acknowledge(0, ack()).expect("it is known").alarm;
        (acked.before, acked.after)
    };
    use AlarmState::{Acknowledged, Normal, Returned, Unacknowledged};
    assert_eq!(acked(&mut book), (Normal, Normal));
    book.edge(0, true, at(1));
    assert_eq!(acked(&mut book), (Unacknowledged, Acknowledged));
    assert_eq!(acked(&mut book), (Acknowledged, Acknowledged));
    assert_eq!(book.list(0)[0].acknowledged, Some(ack()));
    book.edge(0, false, at(2));
    assert_eq!(state(&book), Normal);
    book.edge(0, true, at(3));
    assert_eq!(state(&book), Unacknowledged, "it is to be acknowledged each time");
    assert_eq!(book.list(0)[0].acknowledged, None);
    book.edge(0, false, at(4));
    assert_eq!(state(&book), Returned);
    book.edge(0, true, at(5));
    assert_eq!(state(&book), Unacknowledged);
    book.edge(0, false, at(6));
    assert_eq!(acked(&mut book), (Returned, Normal));
    assert!(book.list(0).is_empty());
    assert_eq!(book.acknowledge(9, ack()), None);
}

#[test]
fn an_alarm_shows_its_start_and_its_duration() {
    let mut book = book();
    book.edge(1, true, at(10));
    book.edge(1, true, at(11));
    let shown = &book.list(25 * SECOND_NS)[0];
    assert_eq!(shown.since, Some(at(10).shown()), "what it says already changes nothing");
    assert_eq!((shown.ended, shown.lasted_ms, shown.day), (None, 15_000, 1));
    book.edge(1, false, at(30));
    let shown = &book.list(99 * SECOND_NS)[0];
    assert_eq!((shown.ended, shown.lasted_ms), (Some(at(30).shown()), 20_000));
    assert_eq!(shown.text, "b happened");
}

#[test]
fn rises_of_a_day_are_counted_in_bounded_memory() {
    let mut count = DayCount::default();
    for _ in 0..5 {
        count.add(HOUR_NS);
    }
    count.add(20 * HOUR_NS);
    assert_eq!(count.of_the_day_before(20 * HOUR_NS), 6);
    assert_eq!(count.of_the_day_before(24 * HOUR_NS), 6);
    assert_eq!(count.of_the_day_before(25 * HOUR_NS), 1);
    assert_eq!(count.of_the_day_before(44 * HOUR_NS), 0);
    for second in 0..300_000 {
        count.add((100_000 + second) * SECOND_NS);
    }
    assert!(count.0.len() as u64 <= SLICES, "{}", count.0.len());
    let day = count.of_the_day_before(400_000 * SECOND_NS);
    assert!((85_000..=86_400).contains(&day), "{day}");
    count.0.push_back((700, u32::MAX));
    count.add(700 * SLICE_NS);
    assert_eq!(count.of_the_day_before(700 * SLICE_NS), u32::MAX);
}

#[test]
fn an_alarm_keeps_its_state_by_name_over_a_reload() {
    let mut book = book();
    for number in [0, 1, 2] {
        book.edge(number, true, at(4 + number as u64));
    }
    book.acknowledge(2, ack());
    let mut new = known(&["x", "c", "a"]);
    new[1].text = "said better".to_owned();
    book.swap(1, &new);
    assert_eq!(short(&book), "a1 c3!");
    assert_eq!(book.list(0)[1].text, "said better");
    book.edge(0, true, at(9));
    assert_eq!(short(&book), "a1 c3! x4", "the episode goes on");
    assert_eq!((book.of_tag("c"), book.of_tag("b")), (Some(1), None));
    book.edge(9, true, at(9));
    book.swap(2, &[]);
    assert!(book.list(0).is_empty());
    book.swap(3, &known(&["a"]));
    book.edge(0, true, at(12));
    assert_eq!((short(&book).as_str(), book.list(0)[0].day), ("a1", 1));
}

#[test]
fn all_unacknowledged_alarms_are_acknowledged_in_the_order_of_the_list() {
    let mut book = book();
    for (number, scan) in [(3, 1), (0, 2), (1, 3)] {
        book.edge(number, true, at(scan));
    }
    book.edge(3, false, at(4));
    book.acknowledge(0, ack());
    assert_eq!(book.unacknowledged(), [1, 3]);
    assert_eq!(book.of_bit(0, Cell::Bit(BitCell(2))), [2]);
    assert!(book.of_bit(1, Cell::Bit(BitCell(2))).is_empty(), "a bit of another program");
}

fn shelf(for_ms: Option<u64>) -> WantedShelf {
    WantedShelf { who: "anna".to_owned(), why: "Filter is changed".to_owned(), for_ms }
}

/// An image of these scans in a mode.
pub(in super::super) fn image(scans: u64, mode: Mode) -> Snapshot {
    Snapshot {
        generation: 0,
        scans,
        now_ns: scans * SECOND_NS,
        mode,
        since_ns: 0,
        ending: false,
        bits: Box::default(),
        words: Box::default(),
        outputs: Box::default(),
        tickets_done: 0,
        forces: Forces::default(),
        safe: Vec::new().into(),
    }
}

#[test]
fn a_shelved_alarm_belongs_to_no_episode_and_nobody_acknowledges_it() {
    let mut book = book();
    book.edge(0, true, at(1));
    book.edge(1, true, at(2));
    book.shelve(0, shelf(Some(60_000)), at(3));
    assert_eq!(short(&book), "b2 a=shelved");
    assert_eq!(book.unacknowledged(), [1]);
    let acked = book.acknowledge(0, ack()).expect("it is known").alarm;
    assert!(acked.shelved && acked.before == acked.after);
    book.edge(1, false, at(4));
    book.edge(2, true, at(5));
    assert_eq!(short(&book), "c1 (b2) a=shelved", "the shelved one keeps no episode open");
    book.edge(0, false, at(6));
    book.edge(0, true, at(7));
    assert_eq!(short(&book), "c1 (b2) a=shelved", "it is followed, and in no list of others");
    assert_eq!(book.list(0)[2].since.map(|since| since.scan), Some(7));
    assert_eq!(book.list(0)[2].day, 2);
}

#[test]
fn an_alarm_that_comes_back_has_to_be_acknowledged_if_it_stands() {
    let mut book = book();
    book.edge(0, true, at(1));
    book.acknowledge(0, ack());
    book.shelve(0, shelf(Some(60_000)), at(2));
    book.edge(1, true, at(3));
    let told = book.unshelve(0, at(4)).expect("it is known");
    assert!(told.is_active && told.after.is_none());
    assert_eq!(short(&book), "b1 a2");
    assert_eq!(book.list(0)[1].since.map(|since| since.scan), Some(1), "it stands since then");
    book.shelve(1, shelf(None), at(5));
    assert_eq!(short(&book), "a2 b=out-of-service");
    book.edge(1, false, at(6));
    book.unshelve(1, at(7));
    assert_eq!(short(&book), "a2", "it went away while it was out of service");
    assert_eq!(book.unshelve(1, at(8)).expect("it is known").before, None);
    assert_eq!(book.unshelve(9, at(8)), None);
}

#[test]
fn a_shelf_ends_after_its_time_whatever_happens_to_the_clock() {
    let mut book = book();
    book.edge(0, true, at(1));
    book.shelve(0, shelf(Some(10_000)), at(2));
    book.shelve(1, shelf(None), at(2));
    let set = |scan: u64, unix_s: i64| BookTime { unix_ns: unix_s * 1_000_000_000, ..at(scan) };
    for (scan, unix_s) in [(3, 3), (4, 1_000_000), (5, -1_000_000), (11, 11)] {
        assert_eq!(book.lapse(set(scan, unix_s)), [], "{scan}");
        let until_ns = book.list(0)[0].shelved.as_ref().and_then(|shelf| shelf.until_ns);
        assert_eq!(until_ns, Some((unix_s + 12 - scan as i64) * 1_000_000_000));
    }
    let ended = book.lapse(at(12));
    assert_eq!((ended.len(), ended[0].why), (1, ShelfEnd::TimeOver));
    assert_eq!(short(&book), "a1 b=out-of-service");
    assert_eq!(book.lapse(at(9999)), []);
}

#[test]
fn a_shelf_ends_with_a_program_that_does_not_have_the_alarm_or_calls_it_critical() {
    let mut book = book();
    (0..3).for_each(|number| drop(book.shelve(number, shelf(None), at(1))));
    let mut next = known(&["b", "c", "d"]);
    next[0].may_be_shelved = false;
    book.swap(1, &next);
    assert!(!book.may_shelve(0) && book.may_shelve(1) && !book.may_shelve(9));
    let ended = book.lapse(at(2));
    let ended: Vec<_> = ended.iter().map(|ended| (ended.tag.as_str(), ended.why)).collect();
    assert_eq!(ended, [("a", ShelfEnd::Gone), ("b", ShelfEnd::Critical)]);
    assert_eq!(short(&book), "c=out-of-service");
}

#[test]
fn a_restart_keeps_shelves_and_acknowledgements_of_alarms_that_rise_again() {
    let mut book = book();
    (0..2).for_each(|number| book.edge(number, true, at(1)));
    book.acknowledge(0, ack());
    book.shelve(2, shelf(Some(60_000)), at(2));
    book.shelve(3, shelf(None), at(3));
    let kept = book.kept(&KeptAlarms::default(), &image(4, Mode::Run));
    // An orderly stop ends the alarms; what was acknowledged stays acknowledged.
    (0..2).for_each(|number| book.edge(number, false, at(5)));
    let kept = book.kept(&kept, &image(6, Mode::Stop(StopReason::Signal)));
    let read = KeptAlarms::read(&kept.bytes()).expect("it is right");
    assert_eq!(read, kept);
    let mut next = AlarmBook::new(&known(&["d", "c", "b", "a"]));
    next.restore(read, at(20));
    next.begin(&image(21, Mode::Run));
    assert_eq!(next.kept(&kept, &image(21, Mode::Run)), kept, "it may crash again at once");
    (2..4).for_each(|number| next.edge(number, true, at(22)));
    assert_eq!(short(&next), "b1 a2! c=shelved d=out-of-service");
    assert_eq!(next.list(0)[1].acknowledged, Some(ack()));
    let ended = next.lapse(at(62));
    assert_eq!(ended.len(), 1, "it was shelved at 2 for a minute");
}

#[test]
fn an_alarm_that_rises_later_is_a_new_one() {
    let mut book = book();
    book.edge(0, true, at(1));
    book.acknowledge(0, ack());
    let kept = book.kept(&KeptAlarms::default(), &image(2, Mode::Run));
    let mut next = fresh();
    next.restore(kept.clone(), at(100));
    next.begin(&image(101, Mode::Run));
    assert!(next.kept(&kept, &image(200, Mode::Run)).is_empty());
    next.edge(0, true, at(112));
    assert_eq!(short(&next), "a1");
}

#[test]
fn no_clock_makes_a_restored_shelf_longer_than_somebody_wanted() {
    let mut book = book();
    book.shelve(0, shelf(Some(SHELF_MS_MAX)), at(1000));
    book.shelve(1, shelf(Some(10_000)), at(1000));
    let kept = book.kept(&KeptAlarms::default(), &image(1001, Mode::Run));
    let left = |unix_s: i64| {
        let mut next = fresh();
        let now = BookTime { unix_ns: unix_s * 1_000_000_000, ..at(5) };
        next.restore(kept.clone(), now);
        (0..30).find(|s| !next.lapse(BookTime { at_ns: (5 + s) * SECOND_NS, ..now }).is_empty())
    };
    assert_eq!(left(1004), Some(6));
    assert_eq!(left(0), Some(10), "the clock was set back, or has lost its time");
    assert_eq!(left(i64::MIN / 1_000_000_000), Some(10));
    assert_eq!(left(1020), Some(0), "it ended while rungd was down");
}

#[test]
fn a_file_that_no_rungd_wrote_is_refused() {
    let ack = r#"{"tag":"a","who":"anna","unix_ns":5}"#;
    let whole = |format: u32, shelved: &str, acks: &str| {
        format!("{{\"format\":{format},\"shelved\":[{shelved}],\"acknowledged\":[{acks}]}}")
    };
    let shelf = |why: &str, until: &str| {
        format!("{{\"tag\":\"a\",\"who\":\"b\",\"why\":{why},\"since_ns\":0{until}}}")
    };
    let read = |text: String| KeptAlarms::read(text.as_bytes());
    assert!(read(whole(1, &shelf("\"ok\"", ""), ack)).is_ok());
    let long = format!("\"{}\"", "x".repeat(201));
    for wrong in [
        String::new(),
        "{".to_owned(),
        "[]".to_owned(),
        "\u{0}".to_owned(),
        "[".repeat(100_000),
        whole(2, "", ""),
        whole(1, &shelf("\"\\u001b[2J\"", ""), ""),
        whole(1, &shelf("\"\"", ""), ""),
        whole(1, &shelf(&long, ""), ""),
        whole(1, &shelf("7", ""), ""),
        whole(1, &shelf("\"ok\"", ",\"until_ns\":1e300"), ""),
        whole(1, "", &ack.replace("anna", "an\\nna")),
        whole(1, "", &ack.replace("anna", &"a".repeat(300))),
    ] {
        assert!(read(wrong.clone()).is_err(), "{}", wrong.chars().take(80).collect::<String>());
    }
    let mut book = book();
    let until = ",\"until_ns\":9223372036854775807";
    let shelves = vec![shelf("\"ok\"", until); 1000].join(",");
    let kept = read(whole(1, &shelves, ack)).expect("it is right");
    book.restore(kept, BookTime { scan: 0, at_ns: u64::MAX - 5, unix_ns: i64::MIN });
    assert_eq!(short(&book), "a=shelved");
    book.lapse(BookTime { scan: 0, at_ns: u64::MAX, unix_ns: i64::MAX });
}

#[test]
fn ten_thousand_alarms_are_shelved_kept_and_come_back() {
    let tags: Vec<String> = (0..10_000).map(|at| format!("alarm_{at}")).collect();
    let tags: Vec<&str> = tags.iter().map(String::as_str).collect();
    let mut book = AlarmBook::new(&known(&tags));
    for number in 0..tags.len() {
        book.edge(number, true, at(1));
        book.shelve(number, shelf(Some(10_000)), at(2));
    }
    assert_eq!((book.list(0).len(), book.standing), (tags.len(), 0));
    let kept = book.kept(&KeptAlarms::default(), &image(3, Mode::Run));
    let mut next = AlarmBook::new(&known(&tags));
    next.restore(KeptAlarms::read(&kept.bytes()).expect("it is right"), at(4));
    (0..tags.len()).for_each(|number| next.edge(number, true, at(5)));
    assert_eq!(next.lapse(at(12)).len(), tags.len());
    assert_eq!((next.standing, next.list(0)[9_999].order), (tags.len(), 10_000));
}
