//! Unit tests of the book of alarms.

use super::*;
use rungd_engine::BitCell;

const SECOND_NS: u64 = 1_000_000_000;
const HOUR_NS: u64 = 3600 * SECOND_NS;

fn known(tags: &[&str]) -> Vec<KnownAlarm> {
    let alarm = |(at, tag): (usize, &&str)| KnownAlarm {
        of: AlarmSource::Bit(Cell::Bit(BitCell(at as u32))),
        tag: (*tag).to_owned(),
        text: format!("{tag} happened"),
        terms: AlarmTerms::default(),
    };
    tags.iter().enumerate().map(alarm).collect()
}

fn book() -> AlarmBook {
    AlarmBook::new(&known(&["a", "b", "c", "d"]))
}

/// The time of a scan: one scan per second.
fn at(scan: u64) -> BookTime {
    BookTime { scan, at_ns: scan * SECOND_NS, unix_ns: (scan * SECOND_NS) as i64 }
}

fn ack() -> AlarmAck {
    AlarmAck { who: "anna".to_owned(), unix_ns: 5 }
}

/// The list in a short form: `a1` stands and is the first of its episode, `(b2)` went away, `a1!`
/// is acknowledged.
fn short(book: &AlarmBook) -> String {
    let one = |alarm: &AlarmStatus| {
        let (tag, order) = (&alarm.tag, alarm.order);
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
