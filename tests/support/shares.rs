//! Spreads the cases of one long test over the processors of the machine.
//!
//! Cargo runs the binaries of tests one after the other: a long test at the end of a binary leaves
//! all other processors idle.

use std::thread;

/// A part of a test's cases.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    number: usize,
    count: usize,
}

impl Share {
    /// Whether a case belongs to it, by the case's number.
    pub fn has(self, case: usize) -> bool {
        case % self.count == self.number
    }
}

/// Does the work of all shares at once; returns their results. A share that panics fails the test.
pub fn in_shares<T: Send>(work: impl Fn(Share) -> T + Sync) -> Vec<T> {
    let count = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let work = &work;
        let begin = |number| scope.spawn(move || work(Share { number, count }));
        let begun: Vec<_> = (0..count).map(begin).collect();
        let end = |share: thread::ScopedJoinHandle<'_, T>| {
            share.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        begun.into_iter().map(end).collect()
    })
}

#[test]
fn each_case_belongs_to_one_share() {
    let all = in_shares(|share| (0..100).filter(|case| share.has(*case)).collect::<Vec<_>>());
    let mut cases = all.concat();
    cases.sort_unstable();
    assert_eq!(cases, (0..100).collect::<Vec<_>>());
}
