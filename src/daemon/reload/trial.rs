//! The probation of a new program: its start, its end, and the reaction to a fault within it.
//!
//! All decisions depend on a mode and a time; there is no thread and no lock. Probation is
//! uninterrupted time in RUN: it starts with the program's first scans, and starts again after a
//! stop.

use std::time::{Duration, Instant};

use rungd_runtime::exchange::{FaultReason, Mode};

/// The time between two attempts of a rollback while the scan thread does not answer.
const TRY_AGAIN: Duration = Duration::from_millis(500);

/// The least number of scans in a probation, for programs whose period is longer than their
/// probation.
const SCANS_LEAST: u64 = 2;

/// A program within its probation.
#[derive(Clone, Copy, Debug)]
pub(in crate::daemon) struct Probation {
    span: Duration,
    /// Whether a fault causes a rollback: the previous program had no fault of its own.
    goes_back: bool,
    /// The end of the probation, as a time and as a number of scans; `None` outside RUN.
    until: Option<(Instant, u64)>,
    /// The time of the last attempt of a rollback.
    tried: Option<Instant>,
}

/// The result of a look at a program on trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::daemon) enum ProbationVerdict {
    /// The probation continues.
    Wait,
    /// The program has passed its probation.
    Proved,
    /// A bug in the engine: its memory cannot be trusted, so no program may continue with it.
    NoWayBack,
    /// A rollback is due; `first`: this is the first attempt.
    GoBack { fault: FaultReason, first: bool },
}

impl Probation {
    /// Begins the trial of a program that was swapped in while this mode was set; `None` without
    /// probation.
    pub fn new(span: Duration, found: Mode) -> Option<Probation> {
        let goes_back = !matches!(found, Mode::Fault(_));
        (!span.is_zero()).then_some(Probation { span, goes_back, until: None, tried: None })
    }

    /// Judges the program. `scans` is the number of complete scans of the process.
    pub fn look(&mut self, mode: Mode, scans: u64, now: Instant) -> ProbationVerdict {
        match mode {
            Mode::Run => {
                let begin = (now + self.span, scans + SCANS_LEAST);
                let (until, enough) = *self.until.get_or_insert(begin);
                if now >= until && scans >= enough {
                    ProbationVerdict::Proved
                } else {
                    ProbationVerdict::Wait
                }
            }
            Mode::Fault(FaultReason::EnginePanic) => ProbationVerdict::NoWayBack,
            Mode::Fault(fault) if self.goes_back => {
                if self.tried.is_some_and(|tried| now < tried + TRY_AGAIN) {
                    return ProbationVerdict::Wait;
                }
                let first = self.tried.replace(now).is_none();
                ProbationVerdict::GoBack { fault, first }
            }
            Mode::Fault(_) | Mode::Stop(_) => {
                self.until = None;
                ProbationVerdict::Wait
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_runtime::exchange::StopReason;

    const STOP: Mode = Mode::Stop(StopReason::Operator);
    const FAULT: Mode = Mode::Fault(FaultReason::ScanNeverEnds);

    /// Looks at a trial at these times (in ms), each time in the given mode, and compares the
    /// verdicts.
    fn check(found: Mode, looks: &[(u64, Mode, ProbationVerdict)]) {
        let (begin, mut trial) = (Instant::now(), Probation::new(Duration::from_secs(1), found));
        for (ms, mode, verdict) in looks {
            let now = begin + Duration::from_millis(*ms);
            let found = trial.as_mut().unwrap().look(*mode, ms / 10, now);
            assert_eq!(found, *verdict, "{ms}: {looks:?}");
        }
    }

    fn back(first: bool) -> ProbationVerdict {
        ProbationVerdict::GoBack { fault: FaultReason::ScanNeverEnds, first }
    }

    #[test]
    fn probation_counts_only_time_in_run() {
        use ProbationVerdict::{Proved, Wait};
        let run = Mode::Run;
        check(run, &[(0, run, Wait), (999, run, Wait), (1000, run, Proved)]);
        check(STOP, &[(0, STOP, Wait), (5000, run, Wait), (5999, run, Wait), (6000, run, Proved)]);
        check(run, &[(0, run, Wait), (900, STOP, Wait), (1000, run, Wait), (2000, run, Proved)]);
        assert!(Probation::new(Duration::ZERO, run).is_none());
        let (begin, mut slow) =
            (Instant::now(), Probation::new(Duration::from_secs(1), run).unwrap());
        for (ms, scans, verdict) in [(0, 7, Wait), (60_000, 8, Wait), (120_000, 9, Proved)] {
            assert_eq!(slow.look(run, scans, begin + Duration::from_millis(ms)), verdict);
        }
    }

    #[test]
    fn an_engine_panic_is_not_rolled_back() {
        let bug = Mode::Fault(FaultReason::EnginePanic);
        check(
            Mode::Run,
            &[(0, Mode::Run, ProbationVerdict::Wait), (10, bug, ProbationVerdict::NoWayBack)],
        );
    }

    #[test]
    fn a_fault_rolls_back_unless_the_previous_program_faulted_too() {
        let run = Mode::Run;
        check(
            run,
            &[
                (0, FAULT, back(true)),
                (10, FAULT, ProbationVerdict::Wait),
                (600, FAULT, back(false)),
            ],
        );
        check(STOP, &[(0, STOP, ProbationVerdict::Wait), (9000, FAULT, back(true))]);
        check(
            FAULT,
            &[
                (0, FAULT, ProbationVerdict::Wait),
                (1, run, ProbationVerdict::Wait),
                (9, FAULT, ProbationVerdict::Wait),
            ],
        );
    }
}
