//! Converts a state to bytes and back; `docs/record-format.md` calls the bytes a base image.
//!
//! `record` compresses, checks and stores these bytes. All numbers are little-endian. Bytes from
//! outside never cause a panic: [`EngineState::read`] refuses bytes that cannot be a state of any
//! program; `state_check` refuses a state that cannot be one of a given program.

use super::events::Element;
use super::machine::{BlockState, StageState};
use super::state::EngineState;
use super::state_check::{INTERVAL_MAX_NS, TIME_END_NS};
use crate::isa::{BlockId, StageId};
use rungd_base::byte_source::ByteSource;

impl EngineState {
    /// Appends the state.
    pub fn write(&self, out: &mut Vec<u8>) {
        for number in [self.now_ns, self.start_ns, self.scans] {
            out.extend(number.to_le_bytes());
        }
        out.push(flags([self.last, self.stop_requested]));
        out.extend((self.bits.len() as u32).to_le_bytes());
        out.extend_from_slice(&self.bits);
        let absent = &self.absent_words;
        let words = [&self.words[..absent.start], &self.words[absent.end..]];
        let count: usize = words.iter().map(|words| words.len()).sum();
        out.extend((count as u32).to_le_bytes());
        let first = out.len();
        out.resize(first + 4 * count, 0);
        let places = out[first..].as_chunks_mut().0.iter_mut();
        let words = words.into_iter().flatten();
        places.zip(words).for_each(|(bytes, word)| *bytes = word.to_le_bytes());
        for forced in [&self.forced_bits, &self.forced_words] {
            write_forced(if self.forces > 0 { forced } else { &[] }, out);
        }
        out.extend((self.blocks.len() as u32).to_le_bytes());
        for block in &self.blocks {
            out.push(flags([block.pass_due, block.first_turn, block.executed, block.recurrent]));
            let times = [block.executed_ms, block.enabled_ns, block.every_ns, block.intervals];
            times.iter().for_each(|number| out.extend(number.to_le_bytes()));
        }
        out.extend((self.stages.len() as u32).to_le_bytes());
        for stage in &self.stages {
            out.push(flags([stage.pass_due, stage.executed]));
            out.extend(stage.executed_ms.to_le_bytes());
        }
        for caller in &self.callers {
            let (kind, number) = match caller {
                None => (0, 0),
                Some(Element::Block(BlockId(at))) => (1, *at),
                Some(Element::Stage(StageId(at))) => (2, *at),
            };
            out.push(kind);
            out.extend(number.to_le_bytes());
        }
    }

    /// Reads a state that takes all of `bytes`; `None`: these bytes are no state.
    pub fn read(bytes: &[u8]) -> Option<EngineState> {
        let mut bytes = ByteSource(bytes);
        let (now_ns, start_ns, scans) = (bytes.time_ns()?, bytes.time_ns()?, bytes.u64()?);
        let [last, stop_requested] = bytes.flags()?;
        let count = bytes.u32()? as usize;
        let bits: Box<[u8]> = bytes.take(count)?.into();
        let count = bytes.u32()? as usize;
        let words = bytes.take(count.checked_mul(4)?)?.as_chunks().0.iter();
        let words: Box<[i32]> = words.map(|word| i32::from_le_bytes(*word)).collect();
        let (bits_forced, forced_bits) = bytes.forced(bits.len())?;
        let (words_forced, forced_words) = bytes.forced(words.len())?;
        let state = EngineState {
            forces: bits_forced.checked_add(words_forced)?,
            blocks: bytes.list(ByteSource::block)?,
            stages: bytes.list(ByteSource::stage)?,
            callers: bytes.callers()?,
            bits,
            words,
            forced_bits,
            forced_words,
            now_ns,
            start_ns,
            scans,
            last,
            stop_requested,
            absent_words: 0..0,
        };
        let valid = bytes.0.is_empty() && state.bits.iter().all(|bit| *bit <= 1);
        valid.then_some(state)
    }
}

/// Writes the number of forced cells, then their cell numbers in ascending order.
fn write_forced(forced: &[bool], out: &mut Vec<u8>) {
    let cells = || (0_u32..).zip(forced).filter(|(_, forced)| **forced);
    out.extend((cells().count() as u32).to_le_bytes());
    cells().for_each(|(cell, _)| out.extend(cell.to_le_bytes()));
}

/// Flags as the bits of a byte; the first flag is the lowest bit.
fn flags<const N: usize>(flags: [bool; N]) -> u8 {
    flags.iter().rev().fold(0, |byte, flag| byte << 1 | u8::from(*flag))
}

/// The forms of a state, read from bytes.
trait StateSource: Sized {
    fn flags<const N: usize>(&mut self) -> Option<[bool; N]>;

    /// A time, ns.
    fn time_ns(&mut self) -> Option<u64>;

    /// A time, whole ms.
    fn time_ms(&mut self) -> Option<u64>;

    /// Reads how many and which of `cells` cells are forced: their numbers, each once, in ascending
    /// order.
    fn forced(&mut self, cells: usize) -> Option<(u32, Box<[bool]>)>;

    /// Reads a length and a list of that length. Allocates only as the bytes of the list are found.
    fn list<T>(&mut self, one: impl Fn(&mut Self) -> Option<T>) -> Option<Box<[T]>>;

    fn block(&mut self) -> Option<BlockState>;

    fn stage(&mut self) -> Option<StageState>;

    /// The element that executed each subroutine last, up to the end.
    fn callers(&mut self) -> Option<Box<[Option<Element>]>>;
}

impl StateSource for ByteSource<'_> {
    fn flags<const N: usize>(&mut self) -> Option<[bool; N]> {
        let byte = self.byte()?;
        (u32::from(byte) < 1 << N).then(|| std::array::from_fn(|at| byte >> at & 1 == 1))
    }

    fn time_ns(&mut self) -> Option<u64> {
        self.u64().filter(|time_ns| *time_ns < TIME_END_NS)
    }

    fn time_ms(&mut self) -> Option<u64> {
        self.u64().filter(|time_ms| *time_ms < TIME_END_NS / 1_000_000)
    }

    fn forced(&mut self, cells: usize) -> Option<(u32, Box<[bool]>)> {
        let mut forced = vec![false; cells];
        let mut least = 0;
        let count = self.u32()?;
        for _ in 0..count {
            let at = self.u32()? as usize;
            *forced.get_mut(at).filter(|_| at >= least)? = true;
            least = at + 1;
        }
        Some((count, forced.into()))
    }

    fn list<T>(&mut self, one: impl Fn(&mut Self) -> Option<T>) -> Option<Box<[T]>> {
        (0..self.u32()?).map(|_| one(self)).collect()
    }

    fn block(&mut self) -> Option<BlockState> {
        let [pass_due, first_turn, executed, recurrent] = self.flags()?;
        let (executed_ms, enabled_ns) = (self.time_ms()?, self.time_ns()?);
        let every_ns = self.u64().filter(|every_ns| *every_ns <= INTERVAL_MAX_NS)?;
        let intervals = self.time_ns()?;
        Some(BlockState {
            pass_due,
            first_turn,
            executed,
            executed_ms,
            recurrent,
            enabled_ns,
            every_ns,
            intervals,
        })
    }

    fn stage(&mut self) -> Option<StageState> {
        let [pass_due, executed] = self.flags()?;
        Some(StageState { pass_due, executed, executed_ms: self.time_ms()? })
    }

    fn callers(&mut self) -> Option<Box<[Option<Element>]>> {
        let mut callers = Vec::new();
        while !self.0.is_empty() {
            callers.push(match (self.byte()?, self.u32()?) {
                (0, 0) => None,
                (1, at) => Some(Element::Block(BlockId(at))),
                (2, at) => Some(Element::Stage(StageId(at))),
                _ => return None,
            });
        }
        Some(callers.into())
    }
}
