//! The system calls of the scan thread: the clocks, the absolute sleep, the scheduler.
//!
//! One of the two files with `unsafe` in this crate; the other is `daemon/operator_server/peer.rs`.
//! Every call passes pointers to local values that outlive it, or none; every result is checked.
//! Nothing here decides anything.
#![allow(unsafe_code)]

use std::io;

use rustix::time::{ClockId, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// CLOCK_MONOTONIC, in nanoseconds.
pub fn monotonic_ns() -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `now` is a valid timespec that lives through the call.
    let failed = unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut now) };
    assert_eq!(failed, 0, "CLOCK_MONOTONIC exists on every Linux");
    now.tv_sec as u64 * NS_PER_S + now.tv_nsec as u64
}

/// CLOCK_BOOTTIME, in nanoseconds: it goes on while the machine is suspended.
pub fn boottime_ns() -> u64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec.unsigned_abs() * NS_PER_S + now.tv_nsec.unsigned_abs()
}

/// CLOCK_REALTIME, in seconds since 1970.
pub fn wall_s() -> i64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `now` is a valid timespec that lives through the call.
    let failed = unsafe { libc::clock_gettime(libc::CLOCK_REALTIME, &mut now) };
    assert_eq!(failed, 0, "CLOCK_REALTIME exists on every Linux");
    now.tv_sec
}

/// Sleeps until CLOCK_MONOTONIC reaches the deadline; returns at once if it has passed.
pub fn sleep_until_ns(deadline_ns: u64) {
    let until = libc::timespec {
        tv_sec: (deadline_ns / NS_PER_S) as libc::time_t,
        tv_nsec: (deadline_ns % NS_PER_S) as libc::c_long,
    };
    loop {
        // SAFETY: `until` is a valid timespec; with TIMER_ABSTIME no remainder is written.
        let error = unsafe {
            let rest = std::ptr::null_mut();
            libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &until, rest)
        };
        if error != libc::EINTR {
            return;
        }
    }
}

/// Sets this thread's timer slack.
pub fn set_timer_slack_ns(slack_ns: u64) -> io::Result<()> {
    // SAFETY: takes only numbers.
    checked(unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, slack_ns as libc::c_ulong, 0, 0, 0) })
}

/// Gives this thread SCHED_FIFO at a priority of 1..=99.
pub fn set_fifo(priority: u8) -> io::Result<()> {
    set_scheduler(libc::SCHED_FIFO, priority)
}

/// Gives this thread SCHED_RR at a priority of 1..=99.
pub fn set_round_robin(priority: u8) -> io::Result<()> {
    set_scheduler(libc::SCHED_RR, priority)
}

fn set_scheduler(policy: libc::c_int, priority: u8) -> io::Result<()> {
    let param = libc::sched_param { sched_priority: i32::from(priority) };
    // SAFETY: 0 is this thread; `param` lives through the call.
    checked(unsafe { libc::sched_setscheduler(0, policy, &param) })
}

/// Keeps this thread on these CPUs. Fails if one of them does not exist, although the kernel
/// ignores a missing CPU.
pub fn pin_to_cpus(cpus: &[u32]) -> io::Result<()> {
    let size = size_of::<libc::cpu_set_t>();
    if let Some(cpu) = cpus.iter().find(|cpu| **cpu >= libc::CPU_SETSIZE as u32) {
        return Err(no_cpu(*cpu));
    }
    let nowhere = |error: io::Error| {
        if error.kind() == io::ErrorKind::InvalidInput { no_cpu(cpus[0]) } else { error }
    };
    // SAFETY: a cpu_set_t is plain bits, and all zero bits are the empty set; every number is
    // within it, and 0 is this thread.
    let granted = unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        cpus.iter().for_each(|cpu| libc::CPU_SET(*cpu as usize, &mut set));
        checked(libc::sched_setaffinity(0, size, &set)).map_err(nowhere)?;
        let mut granted: libc::cpu_set_t = std::mem::zeroed();
        checked(libc::sched_getaffinity(0, size, &mut granted))?;
        granted
    };
    // SAFETY: as above.
    let missing = cpus.iter().find(|cpu| unsafe { !libc::CPU_ISSET(**cpu as usize, &granted) });
    missing.map_or(Ok(()), |cpu| Err(no_cpu(*cpu)))
}

fn no_cpu(cpu: u32) -> io::Error {
    io::Error::other(format!("CPU {cpu} does not exist, or this process may not use it"))
}

/// Whether any amount of memory may be locked.
pub fn memory_lock_is_unlimited() -> bool {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `limit` is a valid rlimit that lives through the call.
    let failed = unsafe { libc::getrlimit(libc::RLIMIT_MEMLOCK, &mut limit) };
    failed == 0 && limit.rlim_cur == libc::RLIM_INFINITY
}

/// Locks all memory of the process, present and future.
pub fn lock_memory() -> io::Result<()> {
    // SAFETY: takes only flags.
    checked(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

/// Limits the allocator to two arenas: further arenas would be locked without need. (A hint, for
/// glibc only.)
pub fn limit_arenas() {
    #[cfg(target_env = "gnu")]
    // SAFETY: takes only numbers.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 2);
    }
}

/// Returns the memory that was freed to the system: a load frees most of what it needed. Takes
/// milliseconds, in which other threads may wait for the allocator; the scan thread does not use
/// it. (For glibc only.)
pub fn return_freed_memory() {
    #[cfg(target_env = "gnu")]
    // SAFETY: takes only a number.
    unsafe {
        libc::malloc_trim(0);
    }
}

fn checked(result: libc::c_int) -> io::Result<()> {
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeping_lasts_until_the_deadline_and_returns_at_once_if_it_has_passed() {
        let deadline = monotonic_ns() + 2_000_000;
        sleep_until_ns(deadline);
        assert!(monotonic_ns() >= deadline);
        sleep_until_ns(deadline - 1_000_000_000);
    }

    #[test]
    fn timer_slack_needs_no_privilege_and_an_unknown_cpu_is_refused() {
        set_timer_slack_ns(1).unwrap();
        assert!(pin_to_cpus(&[100_000]).is_err());
        let partly = std::thread::spawn(|| pin_to_cpus(&[0, 1023])).join().unwrap();
        assert_eq!(
            partly.unwrap_err().to_string(),
            "CPU 1023 does not exist, or this process may not use it"
        );
    }
}
