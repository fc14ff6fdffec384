//! The most recent part of the recording, in memory: as many blocks as fit into a fixed number of
//! bytes.
//!
//! The daemon adds every block; `why` and the monitor get all blocks as one recording. The bytes
//! are allocated at the start and never exceeded; the oldest block is dropped first.

use std::collections::VecDeque;
use std::sync::Arc;

use super::block::RecordBlock;
use super::passed::PassedTime;
use super::program::RecordedProgram;
use super::segment::SegmentStart;

/// The blocks in memory.
pub struct Recent {
    /// The maximum number of bytes of blocks and programs.
    most: usize,
    /// The bytes of the blocks, one block after the other.
    bytes: VecDeque<u8>,
    blocks: VecDeque<KeptBlock>,
    programs: VecDeque<KeptProgram>,
    /// The time that passed up to the newest block.
    passed: PassedTime,
    /// The time of the blocks in memory, ns.
    reach_ns: u64,
}

/// A block in memory.
struct KeptBlock {
    bytes: usize,
    sequence: u64,
    /// The time that it added.
    passed_ns: u64,
    has_base: bool,
}

/// A program in memory, and the number of its blocks.
struct KeptProgram {
    program: Arc<RecordedProgram>,
    start: SegmentStart,
    blocks: usize,
}

impl Recent {
    /// Allocates room for this number of bytes.
    pub fn new(most: usize) -> Recent {
        let bytes = VecDeque::with_capacity(most);
        let (blocks, programs) = (VecDeque::new(), VecDeque::new());
        Recent { most, bytes, blocks, programs, passed: PassedTime::default(), reach_ns: 0 }
    }

    /// Adds a block, and drops older blocks to make room. A block that is larger than the room is
    /// not kept, and all blocks before it are dropped.
    pub fn put(&mut self, block: &RecordBlock) {
        let newest = self.programs.back();
        if newest.is_none_or(|newest| !Arc::ptr_eq(&newest.program, &block.program)) {
            let (program, start) = (block.program.clone(), SegmentStart::new(&block.program));
            self.programs.push_back(KeptProgram { program, start, blocks: 0 });
        }
        let bytes = block.bytes(true);
        while !self.blocks.is_empty() && self.used() + bytes > self.most {
            self.drop_oldest();
        }
        // The first block needs a base image.
        let is_usable = block.has_base() || !self.blocks.is_empty();
        if !is_usable || self.used() + bytes > self.most {
            self.programs.retain(|program| program.blocks > 0);
            return;
        }
        if let Some(program) = self.programs.back_mut() {
            let mut written = Vec::with_capacity(bytes);
            block.write(program.start.sum, true, &mut written);
            self.bytes.extend(written);
            program.blocks += 1;
        }
        let (sequence, has_base) = (block.head.sequence, block.has_base());
        let passed_ns = self.passed.add(&block.head);
        self.reach_ns = self.reach_ns.saturating_add(passed_ns);
        self.blocks.push_back(KeptBlock { bytes, sequence, passed_ns, has_base });
    }

    /// Bytes in use, of blocks and programs.
    fn used(&self) -> usize {
        self.bytes.len()
            + self.programs.iter().map(|program| program.start.bytes.len()).sum::<usize>()
    }

    /// Drops the oldest block, and the blocks that need it.
    fn drop_oldest(&mut self) {
        loop {
            let Some(block) = self.blocks.pop_front() else { return };
            self.bytes.drain(..block.bytes);
            self.reach_ns = self.reach_ns.saturating_sub(block.passed_ns);
            if let Some(program) = self.programs.front_mut() {
                program.blocks -= 1;
                if program.blocks == 0 {
                    self.programs.pop_front();
                }
            }
            if self.blocks.front().is_none_or(|first| first.has_base) {
                return;
            }
        }
    }

    /// The oldest program in memory.
    pub fn oldest_generation(&self) -> Option<u32> {
        self.programs.front().map(|program| program.program.generation)
    }

    /// The time that the blocks in memory cover, ns: time that passed, whatever the wall clock
    /// said.
    pub fn reach_ns(&self) -> u64 {
        self.reach_ns
    }

    /// The blocks from a section's number on as a recording. `last`: a block to append that is not
    /// kept. The recording begins with a base image, and therefore perhaps with an earlier block;
    /// the newest block is always in it. It has at most `most` bytes: if that is too little, it
    /// begins with a later base image, as long as there is one.
    pub fn write_from(&self, from: u64, last: Option<&RecordBlock>, most: usize) -> Vec<u8> {
        let at = self.blocks.partition_point(|block| block.sequence < from);
        let is_whole = last.is_some_and(RecordBlock::has_base);
        let newest = self.blocks.len().saturating_sub(usize::from(!is_whole));
        let mut first = at.min(newest);
        while first > 0 && self.blocks.get(first).map_or(!is_whole, |block| !block.has_base) {
            first -= 1;
        }
        first = self.within(first, most.saturating_sub(last.map_or(0, |last| last.bytes(true))));
        let mut out = self.write_blocks(first);
        let Some(last) = last.filter(|last| !self.blocks.is_empty() || last.has_base()) else {
            return out;
        };
        let newest = self.programs.back();
        let sum = match newest.filter(|newest| Arc::ptr_eq(&newest.program, &last.program)) {
            Some(newest) => {
                if first == self.blocks.len() {
                    out.extend_from_slice(&newest.start.bytes);
                }
                newest.start.sum
            }
            None => {
                let start = SegmentStart::new(&last.program);
                out.extend_from_slice(&start.bytes);
                start.sum
            }
        };
        last.write(sum, true, &mut out);
        out
    }

    /// The first block with a base image from `first` on with which the recording has at most
    /// `most` bytes; if there is none, the last block with a base image.
    fn within(&self, first: usize, most: usize) -> usize {
        let programs: usize = self.programs.iter().map(|program| program.start.bytes.len()).sum();
        let blocks = self.blocks.iter().skip(first).map(|block| block.bytes);
        let (mut bytes, mut begin) = (programs + blocks.sum::<usize>(), first);
        for (at, block) in self.blocks.iter().enumerate().skip(first) {
            if block.has_base {
                begin = at;
                if bytes <= most {
                    break;
                }
            }
            bytes -= block.bytes;
        }
        begin
    }

    /// All blocks as a recording: a segment for each program.
    pub fn write(&self) -> Vec<u8> {
        self.write_blocks(0)
    }

    /// The blocks from `first` on: a segment for each program that has one of these blocks.
    fn write_blocks(&self, first: usize) -> Vec<u8> {
        let mut out = Vec::new();
        let lengths = self.blocks.iter().map(|block| block.bytes);
        let (mut at, mut begin) = (0, 0);
        for program in &self.programs {
            let skipped: usize = first.saturating_sub(at).min(program.blocks);
            let count = |from: usize, to: usize| lengths.clone().take(to).skip(from).sum::<usize>();
            let end = begin + count(at, at + program.blocks);
            let from = begin + count(at, at + skipped);
            if skipped < program.blocks {
                out.extend_from_slice(&program.start.bytes);
                out.extend(self.bytes.range(from..end));
            }
            (at, begin) = (at + program.blocks, end);
        }
        out
    }
}
