//! The seats of a server: a limited number of clients at a time; idle ones make room.
//!
//! The one admission of all servers: the operator's sockets, Modbus, `rungd web`, `rungd metrics`.
//! If all seats are taken, the client that has been idle longest loses its seat, so connections
//! without a request keep nobody out. Where users are known, the user with the most seats loses
//! one: a thousand connections of one user do not shut out the next user. Seats may be reserved: no
//! single user can take the last seats, and neither can all users together that may only look.

use std::collections::HashMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use tokio::sync::Notify;
use tokio::time::{Instant, sleep, timeout};

use rungd_base::locked::locked;

/// The limits of a server.
#[derive(Clone, Copy, Debug)]
pub struct SeatSettings {
    /// The most clients at a time.
    pub count_max: usize,
    /// The number of seats that are reserved: neither a single user nor all users together that may
    /// only look can take them.
    pub reserved: usize,
    /// The longest time that a client may be idle. The server closes it then.
    pub idle_max: Duration,
    /// The longest wait for a seat while all of them are taken and busy.
    pub wait_max: Duration,
    /// The pause after a failed accept, for example if there are no file descriptors left. It
    /// leaves the descriptor of a client that made room to the rest of the process for a while.
    pub rest: Duration,
}

/// The facts about a client that decide on its seat.
#[derive(Clone, Copy, Debug)]
pub struct SeatClient {
    /// Its user.
    pub user: u32,
    /// Whether it may make changes.
    pub may_change: bool,
}

/// A client of a server that does not distinguish its clients.
pub const ANY_GUEST: SeatClient = SeatClient { user: 0, may_change: true };

/// All seats.
#[derive(Clone)]
pub struct Seats {
    settings: SeatSettings,
    shared: Arc<SharedSeats>,
}

#[derive(Default)]
struct SharedSeats {
    taken: Mutex<TakenSeats>,
    /// A client has left or become idle.
    room: Notify,
}

#[derive(Default)]
struct TakenSeats {
    last: u64,
    sitters: HashMap<u64, SeatOccupant>,
}

struct SeatOccupant {
    guest: SeatClient,
    /// The moment since which it is idle; `None` while a request of this client is carried out.
    idle: Option<Instant>,
    /// Whether it keeps its seat while it is idle.
    stays: bool,
    leave: Arc<Notify>,
}

/// One taken seat; dropping it frees the seat.
pub struct TakenSeat {
    seats: Seats,
    number: u64,
    leave: Arc<Notify>,
}

/// A seat whose client is not idle, until this is dropped.
pub struct BusySeat(Arc<TakenSeat>);

impl Seats {
    /// Free seats.
    pub fn new(settings: SeatSettings) -> Seats {
        Seats { settings, shared: Arc::default() }
    }

    /// The number of taken seats.
    pub fn count(&self) -> usize {
        self.lock().sitters.len()
    }

    /// A seat for a client; `None` if all seats that it may have are taken and busy.
    pub fn take(&self, guest: SeatClient) -> Option<Arc<TakenSeat>> {
        let mut taken = self.lock();
        let SeatSettings { count_max, reserved, .. } = self.settings;
        let most = count_max - reserved;
        let room = taken.room(most, |sitter| sitter.guest.user == guest.user)
            && (guest.may_change || taken.room(most, |sitter| !sitter.guest.may_change))
            && taken.room(count_max, |_| true);
        if !room {
            return None;
        }
        taken.last += 1;
        let (number, leave) = (taken.last, Arc::new(Notify::new()));
        let idle = Some(Instant::now());
        let sitter = SeatOccupant { guest, idle, stays: false, leave: Arc::clone(&leave) };
        taken.sitters.insert(number, sitter);
        Some(Arc::new(TakenSeat { seats: self.clone(), number, leave }))
    }

    /// Like [`Seats::take`], but waits while all seats are taken and busy.
    pub async fn take_soon(&self, guest: SeatClient) -> Option<Arc<TakenSeat>> {
        let taken = async {
            loop {
                let room = self.shared.room.notified();
                if let Some(seat) = self.take(guest) {
                    return seat;
                }
                room.await;
            }
        };
        timeout(self.settings.wait_max, taken).await.ok()
    }

    /// Asks an idle client, if there is one, to leave, and pauses. Called when the machine gives no
    /// further file descriptor.
    pub async fn make_room(&self) {
        self.lock().dismiss(|_| true);
        sleep(self.settings.rest).await;
    }

    /// Like [`Seats::make_room`], but the pause ends as soon as the client has left: the next
    /// client of this server gets its descriptor.
    pub async fn make_room_for_next(&self) {
        let left = self.shared.room.notified();
        if self.lock().dismiss(|_| true) {
            let _ = timeout(self.settings.rest, left).await;
        } else {
            sleep(self.settings.rest).await;
        }
    }

    /// Serves all clients of a listener: each as long as its conversation lasts, and until it is
    /// asked to leave.
    pub async fn serve<C, A, F>(
        &self,
        accept: impl Fn() -> A,
        converse: impl Fn(C, Arc<TakenSeat>) -> F,
    ) where
        A: Future<Output = io::Result<C>>,
        F: Future<Output = ()> + Send + 'static,
    {
        loop {
            let Ok(client) = accept().await else {
                self.make_room().await;
                continue;
            };
            let Some(seat) = self.take_soon(ANY_GUEST).await else { continue };
            let conversation = converse(client, Arc::clone(&seat));
            tokio::spawn(async move {
                tokio::select! {
                    () = conversation => {}
                    () = seat.asked_to_leave() => {}
                }
            });
        }
    }

    fn lock(&self) -> MutexGuard<'_, TakenSeats> {
        locked(&self.shared.taken)
    }
}

impl TakenSeats {
    /// Whether fewer than `most` of these clients have a seat. If necessary, one idle client of
    /// them is asked to leave.
    fn room(&mut self, most: usize, these: impl Fn(&SeatOccupant) -> bool) -> bool {
        let sit = self.sitters.values().filter(|sitter| these(sitter)).count();
        sit < most || self.dismiss(these)
    }

    /// Asks an idle client of these to leave; false if all of them are busy or stay.
    fn dismiss(&mut self, these: impl Fn(&SeatOccupant) -> bool) -> bool {
        // The client is asked once, and its seat counts as free from now on.
        let leaver = self.leaver(these).and_then(|leaver| self.sitters.remove(&leaver));
        leaver.is_some_and(|sitter| {
            sitter.leave.notify_one();
            true
        })
    }

    /// The client of these to dismiss: of the user with the most seats, the client that has been
    /// idle longest.
    fn leaver(&self, these: impl Fn(&SeatOccupant) -> bool) -> Option<u64> {
        let mut counts: HashMap<u32, usize> = HashMap::new();
        for sitter in self.sitters.values() {
            *counts.entry(sitter.guest.user).or_default() += 1;
        }
        let these = self.sitters.iter().filter(|(_, sitter)| these(sitter) && !sitter.stays);
        let idle = these.filter_map(|(number, sitter)| {
            let since = sitter.idle?;
            Some((std::cmp::Reverse(counts[&sitter.guest.user]), since, *number))
        });
        idle.min().map(|(_, _, number)| number)
    }
}

impl TakenSeat {
    /// Notes whether a request of this client is being carried out.
    pub fn set_busy(&self, busy: bool) {
        self.note(|sitter| sitter.idle = (!busy).then(Instant::now));
    }

    /// The client is busy until the answer is dropped.
    pub fn busy(self: &Arc<TakenSeat>) -> BusySeat {
        self.set_busy(true);
        BusySeat(Arc::clone(self))
    }

    /// From now on the client keeps its seat while it is idle.
    pub fn keep(&self) {
        self.note(|sitter| sitter.stays = true);
    }

    /// The moment at which the client will have been idle for too long.
    pub fn idle_until(&self) -> Instant {
        let taken = self.seats.lock();
        let idle = taken.sitters.get(&self.number).and_then(|sitter| sitter.idle);
        idle.unwrap_or_else(Instant::now) + self.idle_max()
    }

    /// The longest time that the client may be idle.
    pub fn idle_max(&self) -> Duration {
        self.seats.settings.idle_max
    }

    /// Waits until this client is asked to leave.
    pub async fn asked_to_leave(&self) {
        self.leave.notified().await;
    }

    fn note(&self, change: impl FnOnce(&mut SeatOccupant)) {
        if let Some(sitter) = self.seats.lock().sitters.get_mut(&self.number) {
            change(sitter);
        }
        self.seats.shared.room.notify_waiters();
    }
}

impl Drop for TakenSeat {
    fn drop(&mut self) {
        self.seats.lock().sitters.remove(&self.number);
        self.seats.shared.room.notify_waiters();
    }
}

impl Drop for BusySeat {
    fn drop(&mut self) {
        self.0.set_busy(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seats(count_max: usize, reserved: usize) -> Seats {
        let [idle_max, wait_max] = [Duration::from_secs(60), Duration::from_secs(5)];
        let rest = Duration::from_millis(100);
        Seats::new(SeatSettings { count_max, reserved, idle_max, wait_max, rest })
    }

    fn guest(user: u32, may_change: bool) -> SeatClient {
        SeatClient { user, may_change }
    }

    #[test]
    fn an_idle_client_of_the_user_with_most_connections_is_closed_first() {
        let seats = seats(3, 0);
        let honest = seats.take(guest(1, true)).unwrap();
        let first = seats.take(guest(2, true)).unwrap();
        let second = seats.take(guest(2, true)).unwrap();
        first.set_busy(true);
        let third = seats.take(guest(2, true)).unwrap();
        let numbers = |seats: &Seats| {
            let mut numbers: Vec<u64> = seats.lock().sitters.keys().copied().collect();
            numbers.sort_unstable();
            numbers
        };
        assert_eq!(numbers(&seats), [honest.number, first.number, third.number]);
        drop(second);
        third.set_busy(true);
        honest.set_busy(true);
        assert!(seats.take(guest(3, true)).is_none(), "all at work");
        first.set_busy(false);
        let newcomer = seats.take(guest(3, true)).unwrap();
        assert_eq!(numbers(&seats), [honest.number, third.number, newcomer.number]);
        drop((honest, third, newcomer, first));
        assert!(numbers(&seats).is_empty());
    }

    #[test]
    fn some_connections_are_reserved_for_other_users_and_users_who_may_write() {
        let seats = seats(10, 2);
        let busy = |uid: u32, may_change: bool| {
            let seat = seats.take(guest(uid, may_change))?;
            seat.set_busy(true);
            Some(seat)
        };
        let taken = |uid: u32, may_change: bool| {
            let taken: Vec<Arc<TakenSeat>> = (0..20).map_while(|_| busy(uid, may_change)).collect();
            taken
        };
        // One user, all of whose clients are busy.
        let greedy = taken(7, true);
        assert_eq!(greedy.len(), 8);
        assert!(busy(0, true).is_some() && busy(8, false).is_some());
        drop(greedy);
        // Many users that may only look.
        let crowd: Vec<Arc<TakenSeat>> = (100..120).map_while(|uid| busy(uid, false)).collect();
        assert_eq!(crowd.len(), 8);
        let root = busy(0, true).unwrap();
        let operator = busy(1, true).unwrap();
        assert!(busy(2, true).is_none() && busy(300, false).is_none());
        // An idle client that may only look makes room for the next; no other client does.
        crowd[3].set_busy(false);
        root.set_busy(false);
        let reader = seats.take(guest(301, false)).unwrap();
        assert_eq!(seats.lock().sitters.len(), 10);
        assert!(seats.lock().sitters.contains_key(&root.number));
        assert!(!seats.lock().sitters.contains_key(&crowd[3].number));
        drop((reader, operator));
    }

    #[test]
    fn a_kept_client_stays_connected_and_the_oldest_other_client_is_closed() {
        let seats = seats(2, 0);
        let stays = seats.take(ANY_GUEST).unwrap();
        stays.keep();
        let silent = seats.take(ANY_GUEST).unwrap();
        let newcomer = seats.take(ANY_GUEST).unwrap();
        assert!(!seats.lock().sitters.contains_key(&silent.number));
        newcomer.keep();
        assert!(seats.take(ANY_GUEST).is_none() && seats.count() == 2);
        drop(newcomer);
        assert!(seats.take(ANY_GUEST).is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn a_new_client_waits_until_a_busy_client_becomes_idle_or_leaves() {
        let seats = seats(1, 0);
        let seat = seats.take(ANY_GUEST).unwrap();
        let busy = seat.busy();
        let began = Instant::now();
        assert!(seats.take_soon(ANY_GUEST).await.is_none());
        assert_eq!(began.elapsed(), seats.settings.wait_max);
        let first = async {
            tokio::time::sleep(Duration::from_secs(1)).await;
            drop(busy);
            seat.asked_to_leave().await;
        };
        let (second, ()) = tokio::join!(seats.take_soon(ANY_GUEST), first);
        assert_eq!(began.elapsed(), seats.settings.wait_max + Duration::from_secs(1));
        let second = second.expect("the seat of the first");
        second.set_busy(true);
        let leaves = async { drop(second) };
        assert!(tokio::join!(seats.take_soon(ANY_GUEST), leaves).0.is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn an_idle_client_is_closed_when_file_descriptors_run_out() {
        let seats = seats(9, 0);
        let [idle, other] = [(); 2].map(|()| seats.take(ANY_GUEST).unwrap());
        let began = Instant::now();
        tokio::join!(seats.make_room(), idle.asked_to_leave());
        assert_eq!((began.elapsed(), seats.count()), (seats.settings.rest, 1));
        other.set_busy(true);
        seats.make_room().await;
        assert_eq!(seats.count(), 1, "the busy stay");
    }

    #[tokio::test(start_paused = true)]
    async fn a_leaving_client_frees_its_descriptor_at_once_for_the_next_client() {
        let seats = seats(9, 0);
        let (idle, began) = (seats.take(ANY_GUEST).unwrap(), Instant::now());
        let leaves = async {
            idle.asked_to_leave().await;
            drop(idle);
        };
        tokio::join!(seats.make_room_for_next(), leaves);
        assert_eq!((began.elapsed(), seats.count()), (Duration::ZERO, 0));
        seats.make_room_for_next().await;
        assert_eq!(began.elapsed(), seats.settings.rest, "nobody can leave");
    }

    #[tokio::test(start_paused = true)]
    async fn the_idle_time_starts_at_the_end_of_a_request() {
        let seats = seats(1, 0);
        let seat = seats.take(ANY_GUEST).unwrap();
        let until = seat.idle_until();
        drop(seat.busy());
        assert_eq!(seat.idle_until(), until);
        tokio::time::sleep(Duration::from_secs(9)).await;
        assert_eq!(seat.idle_until(), until, "blank lines and half requests change nothing");
        drop(seat.busy());
        assert_eq!(seat.idle_until(), until + Duration::from_secs(9));
    }
}
