//! The seats at the operator's socket: a limited number of clients at a time; idle ones make room.
//!
//! A thousand connections of one user do not shut out the next user: no single user can take the
//! last seats, and neither can all users together that may only look. If all seats are taken, the
//! user with the most seats loses the seat that has been idle longest. Used by `server`, which lets
//! clients in, and by `session`.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};

use tokio::sync::Notify;
use tokio::time::Instant;

use rungd_base::locked::locked;

/// The number of seats that are reserved: neither a single user nor all users together that may
/// only look can take them.
pub(super) const KEPT: usize = 8;

/// All seats.
#[derive(Clone)]
pub(super) struct Seats {
    taken: Arc<Mutex<Sitters>>,
    count_max: usize,
    kept: usize,
}

#[derive(Default)]
struct Sitters {
    last: u64,
    sitters: HashMap<u64, Sitter>,
}

struct Sitter {
    uid: u32,
    may_change: bool,
    /// The moment since which it is idle; `None` while a request of this client is carried out.
    idle: Option<Instant>,
    leave: Arc<Notify>,
}

/// One taken seat; dropping it frees the seat.
pub(super) struct Seat {
    seats: Seats,
    number: u64,
    leave: Arc<Notify>,
}

impl Seats {
    /// `count_max` seats, of which `kept` are reserved.
    pub fn new(count_max: usize, kept: usize) -> Seats {
        Seats { taken: Arc::default(), count_max, kept }
    }

    /// A seat for a user; `None` if all seats that this user may have are taken and busy.
    pub fn take(&self, uid: u32, may_change: bool) -> Option<Seat> {
        let mut taken = self.lock();
        let most = self.count_max - self.kept;
        let room = taken.room(most, |sitter| sitter.uid == uid)
            && (may_change || taken.room(most, |sitter| !sitter.may_change))
            && taken.room(self.count_max, |_| true);
        if !room {
            return None;
        }
        taken.last += 1;
        let (number, leave) = (taken.last, Arc::new(Notify::new()));
        let idle = Some(Instant::now());
        let sitter = Sitter { uid, may_change, idle, leave: Arc::clone(&leave) };
        taken.sitters.insert(number, sitter);
        Some(Seat { seats: self.clone(), number, leave })
    }

    /// Asks an idle client, if there is one, to leave. Called when the machine gives no further
    /// file descriptor.
    pub fn make_room(&self) {
        self.lock().dismiss(|_| true);
    }

    fn lock(&self) -> MutexGuard<'_, Sitters> {
        locked(&self.taken)
    }
}

impl Sitters {
    /// Whether fewer than `most` of these clients have a seat. If necessary, one idle client of
    /// them is asked to leave.
    fn room(&mut self, most: usize, these: impl Fn(&Sitter) -> bool) -> bool {
        let sit = self.sitters.values().filter(|sitter| these(sitter)).count();
        sit < most || self.dismiss(these)
    }

    /// Asks an idle client of these to leave; false if all of them are busy.
    fn dismiss(&mut self, these: impl Fn(&Sitter) -> bool) -> bool {
        // The client is asked once, and its seat counts as free from now on.
        let leaver = self.leaver(these).and_then(|leaver| self.sitters.remove(&leaver));
        leaver.is_some_and(|sitter| {
            sitter.leave.notify_one();
            true
        })
    }

    /// The client of these to dismiss: of the user with the most seats, the client that has been
    /// idle longest.
    fn leaver(&self, these: impl Fn(&Sitter) -> bool) -> Option<u64> {
        let mut counts: HashMap<u32, usize> = HashMap::new();
        for sitter in self.sitters.values() {
            *counts.entry(sitter.uid).or_default() += 1;
        }
        let these = self.sitters.iter().filter(|(_, sitter)| these(sitter));
        let idle = these.filter_map(|(number, sitter)| {
            let since = sitter.idle?;
            Some((std::cmp::Reverse(counts[&sitter.uid]), since, *number))
        });
        idle.min().map(|(_, _, number)| number)
    }
}

impl Seat {
    /// Notes whether a request of this client is being carried out.
    pub fn set_busy(&self, busy: bool) {
        if let Some(sitter) = self.seats.lock().sitters.get_mut(&self.number) {
            sitter.idle = (!busy).then(Instant::now);
        }
    }

    /// Waits until this client is asked to leave.
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
    fn idle_connections_of_the_user_with_most_are_closed_first() {
        let seats = Seats::new(3, 0);
        let honest = seats.take(1, true).unwrap();
        let first = seats.take(2, true).unwrap();
        let second = seats.take(2, true).unwrap();
        first.set_busy(true);
        let third = seats.take(2, true).unwrap();
        let numbers = |seats: &Seats| {
            let mut numbers: Vec<u64> = seats.lock().sitters.keys().copied().collect();
            numbers.sort_unstable();
            numbers
        };
        assert_eq!(numbers(&seats), [honest.number, first.number, third.number]);
        drop(second);
        third.set_busy(true);
        honest.set_busy(true);
        assert!(seats.take(3, true).is_none(), "all at work");
        first.set_busy(false);
        let newcomer = seats.take(3, true).unwrap();
        assert_eq!(numbers(&seats), [honest.number, third.number, newcomer.number]);
        drop((honest, third, newcomer, first));
        assert!(numbers(&seats).is_empty());
    }

    #[test]
    fn no_user_takes_the_last_seats_and_those_that_look_leave_some_to_those_that_may_change() {
        let seats = Seats::new(10, 2);
        let busy = |uid: u32, may_change: bool| {
            let seat = seats.take(uid, may_change)?;
            seat.set_busy(true);
            Some(seat)
        };
        let taken = |uid: u32, may_change: bool| {
            let taken: Vec<Seat> = (0..20).map_while(|_| busy(uid, may_change)).collect();
            taken
        };
        // One user, all of whose clients are busy.
        let greedy = taken(7, true);
        assert_eq!(greedy.len(), 8);
        assert!(busy(0, true).is_some() && busy(8, false).is_some());
        drop(greedy);
        // Many users that may only look.
        let crowd: Vec<Seat> = (100..120).map_while(|uid| busy(uid, false)).collect();
        assert_eq!(crowd.len(), 8);
        let root = busy(0, true).unwrap();
        let operator = busy(1, true).unwrap();
        assert!(busy(2, true).is_none() && busy(300, false).is_none());
        // An idle client that may only look makes room for the next; no other client does.
        crowd[3].set_busy(false);
        root.set_busy(false);
        let reader = seats.take(301, false).unwrap();
        assert_eq!(seats.lock().sitters.len(), 10);
        assert!(seats.lock().sitters.contains_key(&root.number));
        assert!(!seats.lock().sitters.contains_key(&crowd[3].number));
        drop((reader, operator));
    }
}
