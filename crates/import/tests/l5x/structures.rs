//! COP of structures: random copies, executed by rungd and by a model that knows nothing of where a
//! member lies here, only which members a type has.
//!
//! `RUNGD_COP_TEXTS=1000 cargo test -p rungd-import structures` is the long run.

use std::collections::BTreeMap;

use rungd_base::random::SplitMix64;
use rungd_import::l5x;
use rungd_import::model::{Fate, ForeignProject};
use rungd_test_support::setting::setting;

use super::file;
use crate::numbers::below;
use crate::plant;

const TYPES: &str = "<DataTypes><DataType Name=\"Inner\"><Members>\
    <Member Name=\"v\" DataType=\"DINT\" Dimension=\"0\"/>\
    <Member Name=\"tail\" DataType=\"INT\" Dimension=\"2\"/></Members></DataType>\
    <DataType Name=\"Part\"><Members><Member Name=\"n\" DataType=\"DINT\" Dimension=\"0\"/>\
    <Member Name=\"on\" DataType=\"BOOL\" Dimension=\"0\"/>\
    <Member Name=\"row\" DataType=\"DINT\" Dimension=\"3\"/>\
    <Member Name=\"deep\" DataType=\"Inner\" Dimension=\"0\"/>\
    <Member Name=\"many\" DataType=\"Inner\" Dimension=\"2\"/></Members></DataType></DataTypes>";

/// The members without parts of a type, each with its place here, where `#` stands for the number
/// of the element.
const INNER: [&str; 3] = ["v", "tail[0]", "tail[1]"];
const PART: [&str; 14] = [
    "n",
    "on",
    "row[0]",
    "row[1]",
    "row[2]",
    "deep.v",
    "deep.tail[0]",
    "deep.tail[1]",
    "many[0].v",
    "many[0].tail[0]",
    "many[0].tail[1]",
    "many[1].v",
    "many[1].tail[0]",
    "many[1].tail[1]",
];

fn read(rungs: &[String]) -> ForeignProject {
    let tags = ["on: BOOL", "a: Part[3]", "b: Part[4]", "one: Part", "inner: Inner"];
    let text = file(&tags.map(str::to_owned), rungs, &[]);
    l5x::read(&text.replace("<Tags>", &format!("{TYPES}<Tags>"))).unwrap()
}

/// Where a member lies here: `a[1].many[0].tail[1]` is `a_many_tail[5]`.
fn here(text: &str) -> String {
    let sizes = |name: &str| if ["tail", "many"].contains(&name) { 2 } else { 3 };
    let (mut names, mut at) = (Vec::new(), None);
    for part in text.split('.') {
        let (name, index) = match part.split_once('[') {
            Some((name, index)) => (name, Some(index.trim_end_matches(']').parse().unwrap())),
            None => (part, None),
        };
        names.push(name);
        if let Some(index) = index {
            let index: usize = index;
            at = Some(at.map_or(index, |at: usize| at * sizes(name) + index));
        }
    }
    let index = at.map_or(String::new(), |at| format!("[{at}]"));
    let is_array = ["tail", "row"].contains(names.last().unwrap());
    match names.pop() {
        Some(last) if !is_array && !names.is_empty() => {
            format!("{}{index}.{last}", names.join("_"))
        }
        Some(last) => {
            names.push(last);
            format!("{}{index}", names.join("_"))
        }
        None => unreachable!(),
    }
}

/// A copy: its text, and the members that it copies.
struct Copy {
    text: String,
    moves: Vec<(String, String)>,
}

fn copy(random: &mut SplitMix64) -> Copy {
    let mut one = |limit: u64| below(random, limit);
    let (i, j, m, k) = (one(3), one(4), one(2), 1 + one(3));
    let elements =
        |count: u64, leaves: &[&str], from: &dyn Fn(u64) -> String, to: &dyn Fn(u64) -> String| {
            let each = |at: u64| {
                let (from, to) = (from(at), to(at));
                leaves.iter().map(move |leaf| (format!("{from}{leaf}"), format!("{to}{leaf}")))
            };
            (0..count).flat_map(|at| each(at).collect::<Vec<_>>()).collect::<Vec<_>>()
        };
    let plain = &[""];
    match one(9) {
        0 => {
            let k = k.min(3 - i);
            let moves = elements(k.min(4 - j), &PART, &|at| format!("a[{}].", i + at), &|at| {
                format!("b[{}].", j + at)
            });
            Copy { text: format!("COP(a[{i}],b[{j}],{k})"), moves }
        }
        1 => {
            let moves = elements(k, &PART, &|at| format!("a[{at}]."), &|at| format!("b[{at}]."));
            Copy { text: format!("COP(a,b,{k})"), moves }
        }
        2 => {
            let moves = elements(1, &PART, &|_| "one.".to_owned(), &|_| format!("b[{j}]."));
            Copy { text: format!("CPS(one,b[{j}],1)"), moves }
        }
        3 => {
            let moves = elements(1, &INNER, &|_| format!("b[{j}].deep."), &|_| "inner.".to_owned());
            Copy { text: format!("COP(b[{j}].deep,inner,1)"), moves }
        }
        4 => {
            let k = k.min(2 - m);
            let moves = elements(k, &INNER, &|at| format!("a[{i}].many[{}].", m + at), &|at| {
                format!("one.many[{}].", m + at)
            });
            Copy { text: format!("COP(a[{i}].many[{m}],one.many[{m}],{k})"), moves }
        }
        5 => {
            let moves = elements(2, plain, &|at| format!("b[{j}].row[{}]", m + at), &|at| {
                format!("a[{i}].row[{at}]")
            });
            Copy { text: format!("COP(b[{j}].row[{m}],a[{i}].row[0],2)"), moves }
        }
        6 => {
            let moves =
                elements(k.min(4 - j), &PART, &|_| "0".to_owned(), &|at| format!("b[{}].", j + at));
            Copy { text: format!("FLL(0,b[{j}],{k})"), moves }
        }
        7 => {
            let moves = elements(1, &PART, &|_| "0".to_owned(), &|_| "one.".to_owned());
            Copy { text: "FLL(0,one,1)".to_owned(), moves }
        }
        _ => {
            let moves = elements(3, plain, &|at| format!("a[{i}].row[{at}]"), &|at| {
                format!("one.row[{at}]")
            });
            Copy { text: format!("COP(a[{i}].row,one.row,3)"), moves }
        }
    }
}

/// All members of all tags.
fn places() -> Vec<String> {
    let mut places = Vec::new();
    let tags = (0..3).map(|at| format!("a[{at}]")).chain((0..4).map(|at| format!("b[{at}]")));
    for tag in tags.chain(["one".to_owned()]) {
        places.extend(PART.map(|leaf| format!("{tag}.{leaf}")));
    }
    places.extend(INNER.map(|leaf| format!("inner.{leaf}")));
    places
}

#[test]
fn random_copies_of_structures_do_the_same_in_every_scan() {
    for seed in 0..setting("RUNGD_COP_TEXTS", 40) {
        let mut random = SplitMix64(900 + seed);
        let copies: Vec<Copy> = (0..3).map(|_| copy(&mut random)).collect();
        let rungs: Vec<String> =
            copies.iter().map(|copy| format!("XIC(on){};", copy.text)).collect();
        let project = read(&rungs);
        for rung in &project.outcome.rungs {
            assert_eq!(rung.fate, Fate::Exact, "{}", rung.text);
        }
        let mut plc = plant::started(&project);
        let is_known = |plc: &rungd_test_support::plc::Plc, place: &String| {
            let name = here(place);
            rungd_test_support::run::cell(&plc.program, &plc.symbols, &name).is_ok()
        };
        let places: Vec<String> =
            places().into_iter().filter(|place| is_known(&plc, place)).collect();
        let mut model: BTreeMap<String, i64> = BTreeMap::new();
        for scan in 0..20 {
            let on = below(&mut random, 3) > 0;
            let mut changes = vec![("on".to_owned(), i32::from(on))];
            for _ in 0..6 {
                let place = &places[below(&mut random, places.len() as u64) as usize];
                let limit = if place.ends_with(".on") { 2 } else { 1000 };
                let value = below(&mut random, limit) as i32;
                changes.push((here(place), value));
                model.insert(place.clone(), value.into());
            }
            plant::scan(&mut plc, scan * 10, &changes);
            for copy in copies.iter().filter(|_| on) {
                let read = |move_: &(String, String)| model.get(&move_.0).copied().unwrap_or(0);
                let values: Vec<i64> = copy.moves.iter().map(read).collect();
                for ((_, to), value) in copy.moves.iter().zip(values) {
                    model.insert(to.clone(), value);
                }
            }
            for place in &places {
                let wanted = model.get(place).copied().unwrap_or(0);
                let message = || format!("{place} in scan {scan}: {}", rungs.join(" "));
                assert_eq!(plc.value(&here(place)), wanted, "{}", message());
            }
        }
    }
}

#[test]
fn a_copy_that_would_go_on_into_other_members_gets_a_stub() {
    let rung = |text: &str| read(&[text.to_owned()]).outcome.rungs[0].fate.clone();
    let beyond = "a copy beyond the end of a member, into the next ones";
    for (text, reason) in [
        ("COP(a[0],one.many[1],1);", "COP of structures of different types"),
        ("COP(a[0].many[0],one.many[1],2);", beyond),
        ("COP(b[0].row[0],a[0].row[1],3);", beyond),
        ("FLL(1,a[0].row[2],2);", beyond),
        ("COP(a[0].row[2],b[0].row[0],2);", "COP beyond the end of its source"),
        ("COP(a[0].many[1],b[0].many[0],2);", "COP beyond the end of its source"),
        ("COP(a[2],b[0],2);", "COP beyond the end of its source"),
    ] {
        assert_eq!(rung(text), Fate::Todo(reason.to_owned()), "{text}");
    }
    assert_eq!(rung("COP(a[0],b[3],2);"), Fate::Exact);
}
