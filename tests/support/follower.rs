//! Follows the tape of a scan thread: makes each call again on a second engine, and compares the
//! states.

use std::collections::HashMap;

use rungd_engine::{Engine, EngineProgram, EngineState};
use rungd_runtime::{TapeEntry, TapeReader};

/// An engine that makes the calls of a tape again.
pub struct Follower {
    reader: TapeReader,
    programs: HashMap<u32, EngineProgram>,
    engine: Option<Engine>,
    /// States that were compared with the engine's.
    pub compared: u32,
    /// Steps that the tape lost.
    pub lost: u64,
    /// Calls that were made again.
    pub calls: u64,
}

impl Follower {
    /// Follows a tape that begins with program 0.
    pub fn new(reader: TapeReader, first: EngineProgram) -> Follower {
        let programs = HashMap::from([(0, first)]);
        Follower { reader, programs, engine: None, compared: 0, lost: 0, calls: 0 }
    }

    /// Adds a program that may occur on the tape.
    pub fn know(&mut self, generation: u32, program: EngineProgram) {
        self.programs.insert(generation, program);
    }

    /// Reads all entries that are there.
    pub fn follow(&mut self) {
        while let Some((entry, state)) = self.reader.take() {
            match entry {
                TapeEntry::Call(call) => {
                    self.calls += 1;
                    self.engine.as_mut().expect("calls come after a state").apply(call);
                }
                TapeEntry::State { generation, .. } => {
                    let state = state.expect("a state comes with its entry");
                    self.meet(generation, &state);
                    self.reader.give_back(state);
                }
                TapeEntry::Swap { .. } => self.engine = None,
                TapeEntry::Lost { steps } => {
                    self.lost += steps;
                    self.engine = None;
                }
                TapeEntry::Origin(_) | TapeEntry::Number(_) | TapeEntry::Mode(_) => {}
            }
        }
    }

    /// Whether the follower's engine has this public memory.
    pub fn shows(&self, bits: &[u8], words: &[i32]) -> bool {
        self.engine.as_ref().is_some_and(|engine| {
            let image = engine.image();
            image.bits().starts_with(bits) && image.words().starts_with(words)
        })
    }

    fn meet(&mut self, generation: u32, state: &EngineState) {
        if let Some(engine) = &self.engine {
            assert_eq!(&EngineState::of(engine), state, "after {} calls", self.calls);
            self.compared += 1;
            return;
        }
        let mut engine = Engine::new(self.programs[&generation].clone());
        assert!(engine.resume(state), "a state of another program");
        self.engine = Some(engine);
    }
}
