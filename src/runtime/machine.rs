//! The engine as the scanner's machine.

use super::scanner::Machine;
use crate::engine::{BitCell, BlockEvent, Engine, ScanTimes, WordCell};

impl Machine for Engine {
    fn start(&mut self, now_ns: u64) {
        Engine::start(self, now_ns);
    }

    fn begin_scan(&mut self, now_ns: u64, times: &ScanTimes) {
        Engine::begin_scan(self, now_ns, times);
    }

    fn set_input(&mut self, x: u32, on: bool) {
        Engine::set_input(self, x, on);
    }

    fn write_bit(&mut self, cell: BitCell, on: bool) {
        Engine::write_bit(self, cell, on);
    }

    fn write_word(&mut self, cell: WordCell, value: i32) {
        Engine::write_word(self, cell, value);
    }

    fn execute(&mut self) -> bool {
        Engine::execute(self).last
    }

    fn request_stop(&mut self) {
        Engine::request_stop(self);
    }

    fn terminate(&mut self) {
        Engine::terminate(self);
    }

    fn image(&self) -> (&[u8], &[i32]) {
        let image = Engine::image(self);
        (image.bits(), image.words())
    }

    fn events(&self) -> (&[BlockEvent], u32) {
        (Engine::events(self), self.events_dropped())
    }
}
