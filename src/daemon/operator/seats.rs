//! The seats at the operator's socket: a limited number of clients at a time; idle ones make room.
//!
//! A thousand connections of one user do not keep the next user out. Where all seats are taken, the
//! user with the most seats loses one: the one that has been idle longest. Used by `server`, which
//! lets clients in, and by `session`.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;
use tokio::time::Instant;

/// All seats.
#[derive(Clone)]
pub(super) struct Seats {
    taken: Arc<Mutex<Taken>>,
    count_max: usize,
}

#[derive(Default)]
struct Taken {
    last: u64,
    sitters: HashMap<u64, Sitter>,
}

struct Sitter {
    uid: u32,
    /// Since when it is idle; `None` while a request of it is carried out.
    idle: Option<Instant>,
    leave: Arc<Notify>,
}

/// One seat, taken; free again when it is dropped.
pub(super) struct Seat {
    seats: Seats,
    number: u64,
    leave: Arc<Notify>,
}

impl Seats {
    pub fn new(count_max: usize) -> Seats {
        Seats { taken: Arc::default(), count_max }
    }

    /// A seat for a user; `None` where all are taken and all are at work.
    pub fn take(&self, uid: u32) -> Option<Seat> {
        let mut taken = self.lock();
        if taken.sitters.len() >= self.count_max && !taken.dismiss() {
            return None;
        }
        taken.last += 1;
        let (number, leave) = (taken.last, Arc::new(Notify::new()));
        let sitter = Sitter { uid, idle: Some(Instant::now()), leave: Arc::clone(&leave) };
        taken.sitters.insert(number, sitter);
        Some(Seat { seats: self.clone(), number, leave })
    }

    /// Asks an idle client to leave, where there is one: the machine gives no further descriptor.
    pub fn make_room(&self) {
        self.lock().dismiss();
    }

    fn lock(&self) -> MutexGuard<'_, Taken> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Taken {
    /// Asks an idle client to leave; false where all are at work.
    fn dismiss(&mut self) -> bool {
        // It is told once, and its seat counts as free from now on.
        let leaver = self.leaver().and_then(|leaver| self.sitters.remove(&leaver));
        leaver.is_some_and(|sitter| {
            sitter.leave.notify_one();
            true
        })
    }

    /// Of the user with most seats, the one that has been idle longest.
    fn leaver(&self) -> Option<u64> {
        let mut counts: HashMap<u32, usize> = HashMap::new();
        for sitter in self.sitters.values() {
            *counts.entry(sitter.uid).or_default() += 1;
        }
        let idle = self.sitters.iter().filter_map(|(number, sitter)| {
            let since = sitter.idle?;
            Some((std::cmp::Reverse(counts[&sitter.uid]), since, *number))
        });
        idle.min().map(|(_, _, number)| number)
    }
}

impl Seat {
    /// Says whether a request of it is being carried out.
    pub fn set_busy(&self, busy: bool) {
        if let Some(sitter) = self.seats.lock().sitters.get_mut(&self.number) {
            sitter.idle = (!busy).then(Instant::now);
        }
    }

    /// Ends when it is to make room.
    pub async fn asked_to_leave(&self) {
        self.leave.notified().await;
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.seats.lock().sitters.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_idle_of_the_greediest_make_room_and_the_busy_stay() {
        let seats = Seats::new(3);
        let honest = seats.take(1).unwrap();
        let first = seats.take(2).unwrap();
        let second = seats.take(2).unwrap();
        first.set_busy(true);
        let third = seats.take(2).unwrap();
        let numbers = |seats: &Seats| {
            let mut numbers: Vec<u64> = seats.lock().sitters.keys().copied().collect();
            numbers.sort_unstable();
            numbers
        };
        assert_eq!(numbers(&seats), [honest.number, first.number, third.number]);
        drop(second);
        third.set_busy(true);
        honest.set_busy(true);
        assert!(seats.take(3).is_none(), "all at work");
        first.set_busy(false);
        let newcomer = seats.take(3).unwrap();
        assert_eq!(numbers(&seats), [honest.number, third.number, newcomer.number]);
        drop((honest, third, newcomer, first));
        assert!(numbers(&seats).is_empty());
    }
}
