//! Reads AIGER files, text and binary, and executes their steps: as another program would.

use rungd_prove::aig::Literal;
use rungd_prove::aig::aiger::{AigerSystem, NamedLatch, NamedLiteral};
use rungd_prove::gates::Gates;

/// A file that was written and read again, and the state of its latches.
pub struct WrittenSystem {
    file: AigerFile,
    latches: Vec<u64>,
}

/// What a file says, with the numbers of its literals.
#[derive(Debug, PartialEq, Eq)]
struct AigerFile {
    inputs: u32,
    /// The next literal and the reset value.
    latches: Vec<[u32; 2]>,
    bad: Vec<u32>,
    constraints: Vec<u32>,
    gates: Vec<[u32; 3]>,
}

/// The values of the outputs in a step.
pub struct StepValues {
    pub bad: Vec<u64>,
    pub constraints: Vec<u64>,
}

/// The question whether one of these literals is ever ON.
pub fn written<'g>(gates: &'g Gates, bad: &[Literal]) -> AigerSystem<'g> {
    let named = |name: &str, all: Vec<Literal>| {
        let one = |(at, literal)| NamedLiteral { literal, name: format!("{name} {at}") };
        all.into_iter().enumerate().map(one).collect()
    };
    let latches = gates.latches.iter().map(|latch| NamedLatch {
        literal: latch.literal,
        next: latch.next,
        initial: latch.initial,
        name: format!("{:?}", latch.holds),
    });
    AigerSystem {
        graph: &gates.graph,
        inputs: named("input", gates.inputs.iter().map(|input| input.literal).collect()),
        latches: latches.collect(),
        bad: named("bad", bad.to_vec()),
        constraints: named("constraint", gates.constraints.clone()),
        comment: "A comment.".to_owned(),
    }
}

impl WrittenSystem {
    /// Writes gates whose judged bits are asked for, and reads the file.
    pub fn of(gates: &Gates) -> WrittenSystem {
        let bad: Vec<Literal> = gates.judged.iter().map(|judged| !*judged).collect();
        let system = written(gates, &bad);
        let file = AigerFile::of_text(&system.ascii());
        assert_eq!(AigerFile::of_bytes(&system.binary()), file, "both formats say the same");
        let latches = file.latches.iter().map(|[_, reset]| if *reset == 1 { !0 } else { 0 });
        WrittenSystem { latches: latches.collect(), file }
    }

    /// Executes a step.
    pub fn step(&mut self, inputs: &[u64]) -> StepValues {
        let AigerFile { bad, constraints, gates, latches, .. } = &self.file;
        let mut values = vec![0];
        values.extend(inputs);
        values.extend(&self.latches);
        let value = |values: &[u64], literal: u32| {
            values[literal as usize / 2] ^ if literal % 2 == 1 { !0 } else { 0 }
        };
        for [left, a, b] in gates {
            assert_eq!(*left as usize, 2 * values.len(), "gates are in order");
            values.push(value(&values, *a) & value(&values, *b));
        }
        let of = |literals: &[u32]| literals.iter().map(|at| value(&values, *at)).collect();
        let step = StepValues { bad: of(bad), constraints: of(constraints) };
        self.latches = latches.iter().map(|[next, _]| value(&values, *next)).collect();
        step
    }
}

/// The numbers of a line.
fn numbers(line: &str) -> Vec<u32> {
    line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

impl AigerFile {
    fn of_text(text: &str) -> AigerFile {
        let mut lines = text.lines().map(numbers);
        let header = lines.next().expect("a header");
        let [_, inputs, latches, _, gates, bad, constraints] = header[..] else {
            panic!("{header:?}");
        };
        for at in 1..=inputs {
            assert_eq!(lines.next(), Some(vec![2 * at]));
        }
        let mut latch = |at: u32| {
            let line = lines.next().expect("a latch");
            assert_eq!(line[0], 2 * (inputs + at + 1));
            [line[1], line.get(2).copied().unwrap_or(0)]
        };
        let latches = (0..latches).map(&mut latch).collect();
        let mut one = || lines.next().expect("a literal")[0];
        let bad = (0..bad).map(|_| one()).collect();
        let constraints = (0..constraints).map(|_| one()).collect();
        let mut gate = || {
            let line = lines.next().expect("a gate");
            [line[0], line[1], line[2]]
        };
        let gates = (0..gates).map(|_| gate()).collect();
        AigerFile { inputs, latches, bad, constraints, gates }
    }

    fn of_bytes(bytes: &[u8]) -> AigerFile {
        let mut rest = bytes;
        let mut line = || {
            let end = rest.iter().position(|byte| *byte == b'\n').expect("a line");
            let line = numbers(str::from_utf8(&rest[..end]).expect("text"));
            rest = &rest[end + 1..];
            line
        };
        let header = line();
        let [_, inputs, latches, _, gates, bad, constraints] = header[..] else {
            panic!("{header:?}");
        };
        let mut latch = || {
            let line = line();
            [line[0], line.get(1).copied().unwrap_or(0)]
        };
        let latches: Vec<[u32; 2]> = (0..latches).map(|_| latch()).collect();
        let bad = (0..bad).map(|_| line()[0]).collect();
        let constraints = (0..constraints).map(|_| line()[0]).collect();
        let mut delta = || {
            let end = rest.iter().position(|byte| byte & 0x80 == 0).expect("a number");
            let number = rest[..=end].iter().rev();
            let number = number.fold(0, |all, byte| all << 7 | u32::from(byte & 0x7F));
            rest = &rest[end + 1..];
            number
        };
        let first = inputs + latches.len() as u32 + 1;
        let mut gate = |at: u32| {
            let left = 2 * (first + at);
            let a = left - delta();
            [left, a, a - delta()]
        };
        let gates = (0..gates).map(&mut gate).collect();
        AigerFile { inputs, latches, bad, constraints, gates }
    }
}
