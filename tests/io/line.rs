//! Pseudo-terminals as serial lines, and a control line that detects their stalls.
//!
//! A kernel thread carries the bytes of a pseudo-terminal. On a busy machine this thread sometimes
//! stalls for seconds, while processes, pipes and sockets continue: with eight busy loops, 2.1 s
//! were measured, but 4 ms over a pipe in the same half minute. During a stall, a test over a
//! serial line misses its deadlines without a fault of rungd.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::FromRawFd;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

/// The least delay of the control line after which a failed test proves nothing: a quarter of the
/// shortest deadline of these tests.
const STILL: Duration = Duration::from_millis(100);

static CONTROL: Mutex<Control> = Mutex::new(Control { sent: None, delays: Vec::new() });

struct Control {
    /// The time at which the byte under way was sent.
    sent: Option<Instant>,
    /// Each delay of at least `STILL`, after the time of its end.
    delays: Vec<(Instant, Duration)>,
}

/// A pseudo-terminal: the peer's end, and the path of the client's end. Processes that other tests
/// start do not inherit it.
pub fn pty() -> (File, String) {
    let mut name = [0; 64];
    // SAFETY: plain system calls, on a descriptor that is checked; `name` has room for its size.
    let (master, name) = unsafe {
        let flags = libc::O_RDWR | libc::O_NOCTTY | libc::O_CLOEXEC;
        let master = libc::posix_openpt(flags);
        assert!(master >= 0 && libc::grantpt(master) == 0 && libc::unlockpt(master) == 0);
        assert_eq!(libc::ptsname_r(master, name.as_mut_ptr(), name.len()), 0);
        (File::from_raw_fd(master), std::ffi::CStr::from_ptr(name.as_ptr()))
    };
    (master, name.to_str().unwrap().to_owned())
}

/// Runs a test over a serial line. A test that fails during a stall of the control line runs again.
pub fn over_a_line(test: impl Fn()) {
    begin_control();
    for again in (0..10).rev() {
        let begun = Instant::now();
        let Err(failure) = catch_unwind(AssertUnwindSafe(&test)) else { return };
        match control().longest_since(begun) {
            Some(delay) if again > 0 => {
                println!("the control's line stood still for {delay:?}: the test runs again");
            }
            Some(_) | None => resume_unwind(failure),
        }
    }
}

/// `over_a_line`, for a test that awaits.
pub fn await_over_a_line<T: Future<Output = ()>>(test: impl Fn() -> T) {
    over_a_line(|| {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        runtime.enable_all().build().unwrap().block_on(test());
    });
}

impl Control {
    /// The longest of the delays that ended after `begun` and of the delay under way.
    fn longest_since(&self, begun: Instant) -> Option<Duration> {
        let over = self.delays.iter().filter(|(over, _)| *over > begun).map(|(_, delay)| *delay);
        let under_way = self.sent.map(|sent| sent.elapsed()).filter(|delay| *delay >= STILL);
        over.chain(under_way).max()
    }
}

fn control() -> MutexGuard<'static, Control> {
    CONTROL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts the control, once per process: it sends bytes over its own line from end to end.
fn begin_control() {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(|| {
        spawn(|| {
            let (mut near, path) = pty();
            let mut far = File::options().read(true).write(true).open(path).unwrap();
            make_raw(&far);
            let mut byte = [0];
            loop {
                let sent = Instant::now();
                control().sent = Some(sent);
                near.write_all(b"x").unwrap();
                far.read_exact(&mut byte).unwrap();
                let mut control = control();
                control.sent = None;
                if sent.elapsed() >= STILL {
                    control.delays.push((Instant::now(), sent.elapsed()));
                }
                drop(control);
                sleep(Duration::from_millis(5));
            }
        });
    });
}

/// Sets a line to forward each byte at once, without an echo.
fn make_raw(line: &File) {
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    let mut settings = tcgetattr(line).unwrap();
    settings.make_raw();
    tcsetattr(line, OptionalActions::Now, &settings).unwrap();
}

#[test]
#[should_panic(expected = "a fault of rungd")]
fn a_failure_on_an_undisturbed_line_fails_the_test() {
    over_a_line(|| panic!("a fault of rungd"));
}
