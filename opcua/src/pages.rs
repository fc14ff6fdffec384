//! Values of the past, and the pages in which a client gets them.
//!
//! Called by `history`. What waits for a client's next request is counted, for all clients
//! together, by the elements of the values: an array of 4,000 words is no single value.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use opcua::types::{StatusCode, Variant};

/// The most elements that all clients together may leave waiting.
const WAITING_MAX: usize = 2_000_000;

/// A value of the past.
#[derive(Clone, Debug, PartialEq)]
pub struct PastValue {
    /// The time of its scan, ns since 1970 (UTC).
    pub unix_ns: i64,
    /// The value.
    pub value: Variant,
    /// Its quality.
    pub status: StatusCode,
}

impl PastValue {
    /// The number of its elements: what it takes of an answer and of memory.
    pub fn elements(&self) -> usize {
        let Variant::Array(array) = &self.value else { return 1 };
        array.values.len().max(1)
    }
}

/// How many elements wait, of all clients.
#[derive(Clone, Debug, Default)]
pub struct WaitingElements(Arc<AtomicUsize>);

/// The values that were read for a client, of which a part waits.
#[derive(Debug)]
struct WaitingValues {
    values: Vec<PastValue>,
    elements: usize,
    all: WaitingElements,
}

/// The rest of an answer.
#[derive(Clone, Debug)]
pub struct PastRest {
    waiting: Arc<WaitingValues>,
    from: usize,
}

/// A page of an answer.
#[derive(Debug)]
pub struct PastPage {
    /// Its values.
    pub values: Vec<PastValue>,
    /// What follows; `None`: nothing.
    pub rest: Option<PastRest>,
}

impl WaitingElements {
    /// The first page of values: at most `most` of them, and of elements as many, but one value at
    /// least. `None`: too much waits already.
    pub fn first_page(&self, mut values: Vec<PastValue>, most: usize) -> Option<PastPage> {
        let end = end_of_page(&values, most);
        if end == values.len() {
            return Some(PastPage { values, rest: None });
        }
        let behind = values.split_off(end);
        let elements = behind.iter().map(PastValue::elements).sum();
        let before = self.0.fetch_add(elements, Ordering::Relaxed);
        let waiting = WaitingValues { values: behind, elements, all: self.clone() };
        let rest = PastRest { waiting: Arc::new(waiting), from: 0 };
        // Dropped, the rest counts no more.
        (before.saturating_add(elements) <= WAITING_MAX)
            .then_some(PastPage { values, rest: Some(rest) })
    }
}

impl Drop for WaitingValues {
    fn drop(&mut self) {
        self.all.0.fetch_sub(self.elements, Ordering::Relaxed);
    }
}

impl PastRest {
    /// The next page.
    pub fn page(&self, most: usize) -> PastPage {
        let left = &self.waiting.values[self.from..];
        let end = end_of_page(left, most);
        let is_last = end == left.len();
        let rest = PastRest { waiting: Arc::clone(&self.waiting), from: self.from + end };
        PastPage { values: left[..end].to_vec(), rest: (!is_last).then_some(rest) }
    }
}

fn end_of_page(values: &[PastValue], most: usize) -> usize {
    let mut elements = 0;
    for (at, value) in values.iter().enumerate() {
        elements += value.elements();
        if elements > most {
            return at.max(1);
        }
    }
    values.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(count: i64, value: &Variant) -> Vec<PastValue> {
        let of = |unix_ns| PastValue { unix_ns, value: value.clone(), status: StatusCode::Good };
        (0..count).map(of).collect()
    }

    #[test]
    fn pages_have_every_value_once_and_what_waits_is_freed_with_the_last() {
        let all = WaitingElements::default();
        let first = all.first_page(values(25, &Variant::from(1)), 10).expect("room");
        assert_eq!(all.0.load(Ordering::Relaxed), 15);
        let (mut times, mut rest): (Vec<i64>, _) =
            (first.values.iter().map(|value| value.unix_ns).collect(), first.rest);
        while let Some(waiting) = rest {
            let page = waiting.page(10);
            times.extend(page.values.iter().map(|value| value.unix_ns));
            rest = page.rest;
        }
        assert_eq!(times, (0..25).collect::<Vec<_>>());
        assert_eq!(all.0.load(Ordering::Relaxed), 0);
        let whole = all.first_page(values(10, &Variant::from(1)), 10).expect("room");
        assert!(whole.values.len() == 10 && whole.rest.is_none());
    }

    #[test]
    fn an_array_counts_by_its_elements_and_too_much_waits_for_nobody() {
        let array = Variant::from(vec![0_i32; 1000]);
        let all = WaitingElements::default();
        let page = all.first_page(values(50, &array), 10_000).expect("room");
        assert_eq!(page.values.len(), 10);
        // One value is longer than a page.
        let long = all.first_page(values(2, &array), 10).expect("room");
        assert_eq!(long.values.len(), 1);
        assert!(all.first_page(values(2_000, &array), 10_000).is_none(), "beside what waits");
        drop((page, long));
        assert_eq!(all.0.load(Ordering::Relaxed), 0);
        assert!(all.first_page(values(2_000, &array), 10_000).is_some());
    }
}
