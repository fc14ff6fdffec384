//! A device's task with a scripted driver, in virtual time.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::io::rig::{Rig, rig};
use rungd_io::device::{
    DeviceHealth, DeviceParts, DeviceTask, Driver, Exchange, ExchangeExtent, ExchangeFailure,
    ExchangeReason,
};
use rungd_runtime::wiring::OutputSource;
use tokio::sync::oneshot;
use tokio::task::{JoinHandle, LocalSet};
use tokio::time::{Instant, sleep};

/// A call of the driver.
#[derive(Clone, Debug, PartialEq)]
pub enum Call {
    Connect,
    Exchange(ExchangeReason, Vec<i32>),
    Disconnect,
}

#[derive(Default)]
pub struct Script {
    pub calls: Vec<(Duration, Call)>,
    /// The results of the next connects; success if empty. `exchanges` has those of the exchanges.
    pub connects: Vec<Result<(), ExchangeFailure>>,
    /// The number of next attempts to connect that do not end.
    pub hangs: u32,
    pub exchanges: Vec<Result<(), ExchangeFailure>>,
    /// The number of requests of an exchange, and the duration of each.
    pub requests: (u32, Duration),
    /// The inputs that an exchange reads.
    pub inputs: Vec<Option<i32>>,
}

pub struct Scripted {
    pub script: Arc<Mutex<Script>>,
    pub begun: Instant,
    /// The number of finished requests of the present exchange.
    pub requests: u32,
}

impl Scripted {
    pub fn note(&self, call: Call) -> std::sync::MutexGuard<'_, Script> {
        let mut script = self.script.lock().unwrap();
        script.calls.push((self.begun.elapsed(), call));
        script
    }
}

/// The trouble with which a driver of these tests panics.
pub const BUG: &str = "a bug of this driver";

/// Removes the next result from the script; success if there is none.
pub fn next(answers: &mut Vec<Result<(), ExchangeFailure>>) -> Result<(), ExchangeFailure> {
    if answers.is_empty() { Ok(()) } else { answers.remove(0) }
}

impl Driver for Scripted {
    async fn connect(&mut self) -> Result<(), ExchangeFailure> {
        let (answer, hangs) = {
            let mut script = self.note(Call::Connect);
            let hangs = script.hangs > 0;
            script.hangs = script.hangs.saturating_sub(1);
            (next(&mut script.connects), hangs)
        };
        if hangs {
            std::future::pending::<()>().await;
        }
        answer
    }

    async fn exchange(
        &mut self,
        exchange: Exchange<'_>,
    ) -> Result<ExchangeExtent, ExchangeFailure> {
        let call = Call::Exchange(exchange.occasion, exchange.outputs.to_vec());
        let (answer, (requests, each)) = {
            let mut script = self.note(call);
            exchange.inputs.copy_from_slice(&script.inputs);
            (next(&mut script.exchanges), script.requests)
        };
        assert!(!answer.as_ref().is_err_and(|trouble| trouble.reason == BUG), "{BUG}");
        if matches!(exchange.occasion, ExchangeReason::Poll | ExchangeReason::First) {
            while self.requests < requests {
                sleep(each).await;
                self.requests += 1;
                if self.requests < requests && (exchange.is_urgent)() {
                    return Ok(ExchangeExtent::Part);
                }
            }
            self.requests = 0;
        }
        answer.map(|()| ExchangeExtent::Whole)
    }

    fn disconnect(&mut self) {
        drop(self.note(Call::Disconnect));
    }
}

pub struct Bench {
    pub rig: Rig,
    pub script: Arc<Mutex<Script>>,
    pub health: DeviceHealth,
    pub stop: Option<oneshot::Sender<()>>,
    pub task: JoinHandle<()>,
}

pub const POLL: Duration = Duration::from_millis(20);

impl Bench {
    /// Starts a device's task with a running controller.
    pub fn start(script: Script) -> Bench {
        let mut rig = rig(false);
        rig.scans(1);
        Bench::of(rig, script)
    }

    pub fn before_the_first_scan(script: Script) -> Bench {
        Bench::of(rig(false), script)
    }

    pub fn of_sources(script: Script, sources: Vec<OutputSource>) -> Bench {
        let mut rig = rig(false);
        rig.sources = sources;
        rig.scans(1);
        Bench::of(rig, script)
    }

    pub fn of(mut rig: Rig, script: Script) -> Bench {
        let script =
            Arc::new(Mutex::new(Script { inputs: [1, 0, 42, 7].map(Some).into(), ..script }));
        let health = DeviceHealth::new("line1", "scripted", "the test".to_owned());
        let driver = Scripted { script: Arc::clone(&script), begun: Instant::now(), requests: 0 };
        let (stop, stopped) = oneshot::channel::<()>();
        let input_end = rig.take_line();
        let parts = DeviceParts {
            driver,
            input_end,
            port: rig.port.clone(),
            inputs: 4,
            outputs: rig.sources.clone(),
            health: health.clone(),
            poll: POLL,
        };
        let task = tokio::task::spawn_local(DeviceTask::new(parts).run(async move {
            let _ = stopped.await;
        }));
        Bench { rig, script, health, stop: Some(stop), task }
    }

    pub fn calls(&self) -> Vec<Call> {
        self.timed().into_iter().map(|(_, call)| call).collect()
    }

    pub fn timed(&self) -> Vec<(Duration, Call)> {
        std::mem::take(&mut self.script.lock().unwrap().calls)
    }

    pub async fn end(&mut self) {
        let _ = self.stop.take().expect("once").send(());
        (&mut self.task).await.expect("the task ends by itself");
    }
}

pub fn run(test: impl Future<Output = ()>) {
    let tokio = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .start_paused(true)
        .build()
        .expect("a runtime");
    tokio.block_on(LocalSet::new().run_until(test));
}

pub fn poll(y2: i32, d1: i32, v0: i32) -> Call {
    Call::Exchange(ExchangeReason::Poll, vec![y2, d1, v0])
}
