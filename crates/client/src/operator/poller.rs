//! A controller that is asked again and again, by a program that shows its state or passes it on.
//!
//! The one poller of the socket: of `monitor`, `web`, `edge`, `metrics` and the editor. It finds
//! the controller and stays with it, limits the wait for each answer, and says when to ask next.
//! What is asked, and what is done with the answers, is the caller's.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use serde::de::DeserializeOwned;

use super::client::{self, CallFailure};
use super::protocol::{
    AlarmList, ControllerStatus, OPERANDS_MAX, OperandValues, RefusalKind, RefusedOperand, Request,
    ShownValue,
};
use super::search;

/// The most requests for the values of a list: an operand may stand for so many values that few
/// operands have room in an answer.
const READS_MAX: u32 = 32;

/// How often a controller is asked.
#[derive(Clone, Copy, Debug)]
pub struct PollPace {
    /// The time from the beginning of a look to that of the next.
    pub every: Duration,
    /// The pause after a look lasts at least this many times as long as the look, so that a busy
    /// controller receives fewer requests.
    pub share: u32,
    /// The pause after a look at a controller that does not answer.
    pub retry: Duration,
}

impl PollPace {
    /// The pause after a look that took this time.
    pub fn pause(&self, took: Duration, answered: bool) -> Duration {
        match answered {
            true => self.every.saturating_sub(took).max(took * self.share),
            false => self.retry,
        }
    }
}

/// The controller at a socket, asked with a time limit.
#[derive(Clone, Debug)]
pub struct PolledController {
    /// The socket.
    pub socket: PathBuf,
    /// The longest wait for an answer.
    pub answer_max: Duration,
}

/// The values of a list of operands.
#[derive(Clone, Debug, Default)]
pub struct PolledValues {
    /// The values of the operands that the program has.
    pub values: Vec<ShownValue>,
    /// The other operands, with the reasons.
    pub refused: Vec<RefusedOperand>,
}

impl PolledController {
    /// Sends a request.
    ///
    /// # Errors
    /// [`CallFailure`].
    pub fn ask<T: DeserializeOwned>(&self, request: &Request) -> Result<T, CallFailure> {
        client::ask_within(&self.socket, request, self.answer_max)
    }

    /// The controller's status.
    ///
    /// # Errors
    /// [`CallFailure`].
    pub fn status(&self) -> Result<ControllerStatus, CallFailure> {
        self.ask(&Request::Status {})
    }

    /// The controller's status, and all listed alarms, including those that are over but not
    /// acknowledged.
    ///
    /// # Errors
    /// [`CallFailure`].
    pub fn status_and_alarms(&self) -> Result<(ControllerStatus, AlarmList), CallFailure> {
        Ok((self.status()?, self.ask(&Request::Alarms {})?))
    }

    /// The values of operands. A refused operand hides no other one.
    ///
    /// # Errors
    /// [`CallFailure`].
    pub fn values(&self, operands: &[String]) -> Result<PolledValues, CallFailure> {
        let (mut all, mut left) = (PolledValues::default(), operands.to_vec());
        for _ in 0..READS_MAX {
            if left.is_empty() {
                break;
            }
            let rest = left.split_off(left.len().min(OPERANDS_MAX));
            let OperandValues { values, refused, .. } = self.values_of_some(&left)?;
            // What had no room beside these values is asked once more, with the rest.
            let (again, refused): (Vec<_>, Vec<_>) = refused.into_iter().partition(|operand| {
                operand.refusal.kind == RefusalKind::BadRequest && !values.is_empty()
            });
            left = again.into_iter().map(|operand| operand.operand).chain(rest).collect();
            all.values.extend(values);
            all.refused.extend(refused);
        }
        Ok(all)
    }

    fn values_of_some(&self, operands: &[String]) -> Result<OperandValues, CallFailure> {
        let read = |operands: &[String], each| {
            self.ask::<OperandValues>(&Request::Read { operands: operands.to_vec(), each })
        };
        let mut all = match read(operands, true) {
            Err(CallFailure::Refused(refusal)) if refusal.is_of_operands() => {
                OperandValues::default()
            }
            other => return other,
        };
        // A rungd of an earlier version, which an upgrade has not ended, does not know `each`.
        for operand in operands {
            match read(std::slice::from_ref(operand), false) {
                Ok(one) => all.values.extend(one.values),
                Err(CallFailure::Refused(refusal)) if refusal.is_of_operands() => {
                    all.refused.push(RefusedOperand { operand: operand.clone(), refusal });
                }
                Err(failure) => return Err(failure),
            }
        }
        Ok(all)
    }
}

/// Finds a controller and stays with it: it searches until a controller has answered, and then
/// stays with that controller's socket. A write on a page must not go to a controller that was
/// started later.
#[derive(Clone, Debug)]
pub struct ControllerPoller {
    /// The named socket, or the one at which a controller has answered.
    kept: Option<PathBuf>,
    answer_max: Duration,
    /// Whether it answered the last time; `None` before the first look.
    answers: Option<bool>,
}

impl ControllerPoller {
    /// A poller of the controller at the named socket, or of the one that is found.
    pub fn new(named: Option<PathBuf>, answer_max: Duration) -> ControllerPoller {
        ControllerPoller { kept: named, answer_max, answers: None }
    }

    /// The controller at this time.
    ///
    /// # Errors
    /// None was found, or several.
    pub fn controller(&self) -> Result<PolledController, CallFailure> {
        let socket = search::socket(self.kept.clone())?;
        Ok(PolledController { socket, answer_max: self.answer_max })
    }

    /// The socket that is known from now on; `None`: it is still sought.
    pub fn kept(&self) -> Option<&PathBuf> {
        self.kept.as_ref()
    }

    /// This controller has answered.
    pub fn keep(&mut self, controller: &PolledController) {
        self.kept.get_or_insert_with(|| controller.socket.clone());
    }

    /// Whether this result of a look differs from the previous one: the controller answers, or does
    /// not.
    pub fn has_turned(&mut self, answers: bool) -> bool {
        self.answers.replace(answers) != Some(answers)
    }
}

impl fmt::Display for ControllerPoller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kept {
            Some(socket) => socket.display().fmt(f),
            None => f.write_str("a place that is still sought"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::net::UnixListener;
    use std::thread::{self, JoinHandle};

    use serde_json::{Value, json};

    use super::*;

    /// A controller that gives these answers, one after the other; returns the requests.
    fn fake(name: &str, answers: Vec<Value>) -> (PolledController, JoinHandle<Vec<Value>>) {
        let socket =
            std::env::temp_dir().join(format!("rungd-polled-{name}-{}", std::process::id()));
        let _ = std::fs::remove_file(&socket);
        let listener = UnixListener::bind(&socket).expect("a socket");
        let controller = PolledController { socket, answer_max: Duration::from_secs(60) };
        let thread = thread::spawn(move || {
            let answered = answers.into_iter().map(|answer| {
                let mut stream = listener.accept().expect("a client").0;
                let mut line = String::new();
                BufReader::new(&stream).read_line(&mut line).expect("a line");
                writeln!(stream, "{answer}").expect("it is taken");
                serde_json::from_str(&line).expect("a request")
            });
            answered.collect()
        });
        (controller, thread)
    }

    fn value(operand: &str) -> Value {
        json!({"operand": operand, "tag": null, "address": operand, "value": 1, "forced": false})
    }

    fn refusal(operand: &str, kind: &str) -> Value {
        json!({"operand": operand, "kind": kind, "message": "no"})
    }

    fn read(values: &[Value], refused: &[Value]) -> Value {
        json!({"ok": {"mode": "RUN", "scans": 1, "values": values, "refused": refused}})
    }

    /// The values of three operands, those that are refused, and the requests.
    fn asked(name: &str, answers: Vec<Value>) -> ([Vec<String>; 2], Vec<Value>) {
        let (controller, thread) = fake(name, answers);
        let read = controller.values(&["D0", "D1", "D2"].map(str::to_owned)).expect("answers");
        let values = read.values.into_iter().map(|value| value.operand).collect();
        let refused = read.refused.into_iter().map(|refused| refused.operand).collect();
        ([values, refused], thread.join().expect("all are asked"))
    }

    #[test]
    fn an_operand_without_room_is_requested_again_but_a_refused_one_is_not() {
        let full = [refusal("D1", "bad-operand"), refusal("D2", "bad-request")];
        let first = read(&[value("D0")], &full);
        let second = read(&[value("D2")], &[]);
        let ([values, refused], requests) = asked("room", vec![first, second]);
        assert_eq!((values, refused), (vec!["D0".into(), "D2".into()], vec!["D1".to_owned()]));
        assert_eq!(requests[1], json!({"do": "read", "operands": ["D2"], "each": true}));
        // An operand that has no room alone is refused.
        let none = read(&[], &["D0", "D1", "D2"].map(|operand| refusal(operand, "bad-request")));
        let ([values, refused], _) = asked("none", vec![none]);
        assert_eq!((values.len(), refused.len()), (0, 3));
    }

    #[test]
    fn a_controller_of_an_earlier_version_gets_one_request_per_operand() {
        let refuses = |kind: &str| json!({"error": {"kind": kind, "message": "no"}});
        let one = |operand| read(&[value(operand)], &[]);
        let answers = vec![refuses("bad-request"), one("D0"), refuses("bad-operand"), one("D2")];
        let ([values, refused], requests) = asked("earlier", answers);
        assert_eq!((values, refused), (vec!["D0".into(), "D2".into()], vec!["D1".to_owned()]));
        assert_eq!(requests[2], json!({"do": "read", "operands": ["D1"]}));
    }

    #[test]
    fn a_slow_controller_is_polled_less_often_and_a_silent_one_at_the_retry_interval() {
        let ms = Duration::from_millis;
        let pace = PollPace { every: ms(200), share: 10, retry: ms(1000) };
        let pause = |took, answered| pace.pause(ms(took), answered);
        assert_eq!([pause(0, true), pause(2, true)], [ms(200), ms(198)]);
        assert_eq!([pause(100, true), pause(300, true)], [ms(1000), ms(3000)]);
        assert_eq!([pause(0, false), pause(2000, false)], [ms(1000), ms(1000)]);
    }

    #[test]
    fn a_poller_reports_each_change_between_answering_and_silent_once() {
        let mut poller = ControllerPoller::new(Some("/run/s".into()), Duration::ZERO);
        let turned = [false, false, true, true, false].map(|answers| poller.has_turned(answers));
        assert_eq!(turned, [true, false, true, false, true]);
    }
}
