//! The ways in which a controller ends: the cause of each, and the values that the outputs take.

use super::watcher::Watcher;

/// A way to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    LastScan,
    Operator,
    Instruction,
    Watchdog,
    PanicInScan,
    PanicInThread,
    PanicInMonitor,
    PanicInDriver,
    PanicInShell,
    Terminate,
    Interrupt,
    Kill,
    Stand,
    Segment,
    Silent,
    Cut,
}

/// The values that the outputs take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// rungd writes the safe values, and continues its exchanges with the devices.
    Safe,
    /// rungd writes the safe values, and ends with this exit code.
    SafeThenGone(i32),
    /// rungd is killed or stopped by a signal, and writes nothing.
    AsTheyWere,
    /// rungd continues in RUN.
    InRun,
}

/// All ways, in the order of the table.
pub const WAYS: [Way; 16] = [
    Way::LastScan,
    Way::Operator,
    Way::Instruction,
    Way::Watchdog,
    Way::PanicInScan,
    Way::PanicInThread,
    Way::PanicInMonitor,
    Way::PanicInDriver,
    Way::PanicInShell,
    Way::Terminate,
    Way::Interrupt,
    Way::Kill,
    Way::Stand,
    Way::Segment,
    Way::Silent,
    Way::Cut,
];

const SIGINT: i32 = 2;
const SIGKILL: i32 = 9;
const SIGSEGV: i32 = 11;
const SIGTERM: i32 = 15;
const SIGCONT: i32 = 18;
const SIGSTOP: i32 = 19;

impl Way {
    /// The name of the way in the table.
    pub fn name(self) -> &'static str {
        match self {
            Way::LastScan => "orderly stop (`--scans`)",
            Way::Operator => "operator's stop (`rungd mode stop`)",
            Way::Instruction => "STOP instruction",
            Way::Watchdog => "watchdog (500 ms; the scan takes 1 s)",
            Way::PanicInScan => "panic in the scan",
            Way::PanicInThread => "panic elsewhere: scan thread, between scans",
            Way::PanicInMonitor => "panic elsewhere: monitor thread",
            Way::PanicInDriver => "panic elsewhere: a device's driver",
            Way::PanicInShell => "panic elsewhere: main thread",
            Way::Terminate => "SIGTERM",
            Way::Interrupt => "SIGINT",
            Way::Kill => "SIGKILL",
            Way::Stand => "SIGSTOP",
            Way::Segment => "SIGSEGV",
            Way::Silent => "lost device: no answer any more",
            Way::Cut => "lost device: connection reset, port closed",
        }
    }

    pub fn fate(self) -> Fate {
        match self {
            Way::Operator | Way::Instruction => Fate::Safe,
            Way::Watchdog | Way::PanicInScan | Way::PanicInThread => Fate::Safe,
            Way::LastScan | Way::Terminate | Way::Interrupt => Fate::SafeThenGone(0),
            Way::PanicInMonitor | Way::PanicInShell => Fate::SafeThenGone(70),
            Way::Kill | Way::Stand | Way::Segment => Fate::AsTheyWere,
            Way::PanicInDriver | Way::Silent | Way::Cut => Fate::InRun,
        }
    }

    /// Whether the way needs a build in which a test can cause faults at named points.
    pub fn wants_faults(self) -> bool {
        self.fault().is_some()
    }

    fn fault(self) -> Option<&'static str> {
        Some(match self {
            Way::Watchdog => "stall",
            Way::PanicInScan => "scan",
            Way::PanicInThread => "thread",
            Way::PanicInMonitor => "monitor",
            Way::PanicInDriver => "device",
            Way::PanicInShell => "shell",
            _ => return None,
        })
    }

    /// Lets the watcher cause the end; returns the time of the cause by the watcher's clock, in us.
    /// For a way that the watcher cannot cause, only returns the time.
    pub fn cause(self, watcher: &mut Watcher, pid: u32, faults: &str) -> u64 {
        let mut kill = |signal| watcher.tell(&format!("kill {pid} {signal}"));
        match self {
            Way::Terminate => kill(SIGTERM),
            Way::Interrupt => kill(SIGINT),
            Way::Kill => kill(SIGKILL),
            Way::Stand => kill(SIGSTOP),
            Way::Segment => {
                // Rust's handler treats the first signal as a stack overflow and removes itself;
                // the second one kills the process.
                let at = kill(SIGSEGV);
                kill(SIGSEGV);
                at
            }
            Way::Instruction => watcher.tell("set 0 discrete 0 1"),
            Way::Silent => watcher.tell("silent 0 on"),
            Way::Cut => watcher.tell("cut 0"),
            Way::LastScan | Way::Operator => watcher.tell("mark"),
            _ => {
                let point = self.fault().expect("all other ways are faults");
                watcher.tell(&format!("write {faults} {point}"))
            }
        }
    }

    /// Ends the cause; returns the time by the watcher's clock, in us. `None` if the cause cannot
    /// be ended.
    pub fn return_of(self, watcher: &mut Watcher, pid: u32) -> Option<u64> {
        match self {
            Way::Stand => Some(watcher.tell(&format!("kill {pid} {SIGCONT}"))),
            Way::Silent => Some(watcher.tell("silent 0 off")),
            Way::Cut => Some(watcher.tell("mend 0")),
            _ => None,
        }
    }
}
