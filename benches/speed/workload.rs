//! The workloads as data: their rungs, and the inputs and queued writes of each scan.
//!
//! `ladder` writes a workload as a ladder file, `straight` as Rust; both do the same work. A
//! workload is generated from a seed. W, W′ and W-chain are flat: rungs of four kinds in Main. S is
//! staged: Programs of eight Stages; one Stage of each executes in a scan.

/// Number of inputs that change, and of data words that compares read.
pub const INPUTS: u64 = 256;
pub const WORDS: u64 = 64;
/// Number of data words written from outside in a scan.
const WRITES_PER_SCAN: usize = 4;
/// Number of scans until inputs and queued writes repeat.
const SCENE_SCANS: usize = 1024;
/// Number of rungs above a rung of W-chain whose coils its contacts may read.
const CHAIN_REACH: u64 = 200;
/// Stages of each Program of S.
pub const STAGES: usize = 8;
/// Coils of each Program of S: one that all Stages drive, and two for each Stage.
pub const STAGED_COILS: usize = 1 + 2 * STAGES;

/// A named workload and its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    /// W, the four kinds one after the other.
    Ordered,
    /// W, the four kinds mixed.
    Shuffled,
    /// W′: more contacts, of more kinds; kinds of rungs mixed.
    Contacts,
    /// W-chain: as W with the kinds mixed, and 30 of 100 contacts read a coil of a rung above.
    Chained30,
    /// The same with 60 of 100.
    Chained60,
    /// S: Programs with Stages.
    Stages,
}

impl Name {
    pub const ALL: [Name; 6] = [
        Name::Ordered,
        Name::Shuffled,
        Name::Contacts,
        Name::Chained30,
        Name::Chained60,
        Name::Stages,
    ];

    /// The sizes that the table shows.
    pub fn sizes(self) -> &'static [usize] {
        match self {
            Name::Ordered | Name::Contacts => &[100, 1000, 10_000],
            // 5000 beside W-chain.
            Name::Shuffled => &[100, 1000, 5000, 10_000],
            Name::Chained30 | Name::Chained60 => &[100, 1000, 5000],
            Name::Stages => &[10, 100, 1000],
        }
    }

    pub fn text(self) -> &'static str {
        match self {
            Name::Ordered => "W-order",
            Name::Shuffled => "W-shuffled",
            Name::Contacts => "W-contacts",
            Name::Chained30 => "W-chain-30",
            Name::Chained60 => "W-chain-60",
            Name::Stages => "S-stages",
        }
    }
}

/// The kind of a rung.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    CountUp,
    CountDown,
    OnDelay,
    OffDelay,
}

/// A bit that a contact reads.
#[derive(Clone, Copy, Debug)]
pub enum Bit {
    Input(u64),
    /// The coil of the flat rung of this number, which stands above.
    Coil(usize),
}

/// A bit as a contact.
#[derive(Clone, Copy, Debug)]
pub struct BitContact {
    pub bit: Bit,
    pub opposite: bool,
}

/// One contact of a leg.
#[derive(Clone, Copy, Debug)]
pub enum Contact {
    Bit(BitContact),
    Or(BitContact, BitContact),
    Less(u64, i32),
    NotRise(u64),
}

/// A rung of W, W′ or W-chain: contacts, an instruction, a coil. `reset`: two bits, for counters.
#[derive(Clone, Debug)]
pub struct Rung {
    pub kind: Kind,
    pub leg: Vec<Contact>,
    pub reset: [Bit; 2],
    pub preset: i32,
}

/// A Stage of S: two OUTs, an on-delay, and a JMP to the next Stage, which the delay allows.
#[derive(Clone, Debug)]
pub struct Stage {
    pub shared: [Contact; 2],
    pub own: [Contact; 2],
    pub timer: Contact,
    pub preset: i32,
    pub leave: Contact,
}

#[derive(Clone, Debug)]
pub enum Shape {
    Flat(Vec<Rung>),
    Staged(Vec<[Stage; STAGES]>),
}

/// The inputs and queued writes before a scan.
#[derive(Clone, Debug, Default)]
pub struct Outside {
    /// Inputs that change.
    pub toggles: Vec<u16>,
    /// Queued writes of data words.
    pub writes: Vec<(u16, i32)>,
}

#[derive(Clone, Debug)]
pub struct Workload {
    pub name: Name,
    pub n: usize,
    pub shape: Shape,
    pub scene: Vec<Outside>,
}

impl Workload {
    pub fn new(name: Name, n: usize) -> Workload {
        let mut random = Random(0x5eed_0000 + n as u64);
        let shape = match name {
            Name::Ordered => Shape::Flat(flat(n, &mut random, plain_leg)),
            Name::Shuffled => {
                let mut rungs = flat(n, &mut random, plain_leg);
                random.shuffle(&mut rungs);
                Shape::Flat(rungs)
            }
            Name::Contacts => {
                let mut rungs = flat(n, &mut random, rich_leg);
                random.shuffle(&mut rungs);
                Shape::Flat(rungs)
            }
            Name::Chained30 => Shape::Flat(chained(n, &mut random, 30)),
            Name::Chained60 => Shape::Flat(chained(n, &mut random, 60)),
            Name::Stages => Shape::Staged((0..n).map(|_| stages(&mut random)).collect()),
        };
        let writes = if name == Name::Contacts { WRITES_PER_SCAN } else { 0 };
        let scene = (0..SCENE_SCANS).map(|_| outside(&mut random, writes)).collect();
        Workload { name, n, shape, scene }
    }

    /// The number of coils, from C0 on.
    pub fn coils(&self) -> usize {
        match &self.shape {
            Shape::Flat(rungs) => rungs.len(),
            Shape::Staged(programs) => programs.len() * STAGED_COILS,
        }
    }

    /// The maximum number of structures of one kind.
    pub fn structures(&self) -> usize {
        match &self.shape {
            Shape::Flat(rungs) => rungs.len(),
            Shape::Staged(programs) => programs.len() * STAGES,
        }
    }

    /// The number of rungs that a scan executes; in S, those of one Stage of each Program.
    pub fn rungs_per_scan(&self) -> usize {
        match &self.shape {
            Shape::Flat(rungs) => rungs.len(),
            Shape::Staged(programs) => programs.len() * 4,
        }
    }
}

fn flat(n: usize, random: &mut Random, leg: fn(&mut Random) -> Vec<Contact>) -> Vec<Rung> {
    let kind = |at: usize| match at * 4 / n {
        0 => Kind::CountUp,
        1 => Kind::CountDown,
        2 => Kind::OnDelay,
        _ => Kind::OffDelay,
    };
    let mut rung = |at| Rung {
        kind: kind(at),
        leg: leg(random),
        reset: [Bit::Input(random.below(INPUTS)), Bit::Input(random.below(INPUTS))],
        preset: 2 + random.below(14) as i32,
    };
    (0..n).map(&mut rung).collect()
}

/// Rungs of W, of which `percent` of 100 contacts read the coil of one of the rungs just above.
fn chained(n: usize, random: &mut Random, percent: u64) -> Vec<Rung> {
    let mut rungs = flat(n, random, plain_leg);
    random.shuffle(&mut rungs);
    for (at, rung) in rungs.iter_mut().enumerate().skip(1) {
        let contacts = rung.leg.iter_mut().filter_map(|contact| match contact {
            Contact::Bit(contact) => Some(&mut contact.bit),
            Contact::Or(..) | Contact::Less(..) | Contact::NotRise(_) => None,
        });
        for bit in contacts.chain(&mut rung.reset) {
            if random.below(100) < percent {
                *bit = Bit::Coil(at - 1 - random.below(CHAIN_REACH.min(at as u64)) as usize);
            }
        }
    }
    rungs
}

fn plain_leg(random: &mut Random) -> Vec<Contact> {
    vec![random.bit(false), random.bit(true)]
}

fn rich_leg(random: &mut Random) -> Vec<Contact> {
    let (a, b) = (random.input(true), random.input(false));
    let less = Contact::Less(random.below(WORDS), 50 + random.below(50) as i32);
    vec![random.bit(false), Contact::Or(a, b), less, Contact::NotRise(random.below(INPUTS))]
}

fn stages(random: &mut Random) -> [Stage; STAGES] {
    std::array::from_fn(|_| Stage {
        shared: [random.bit(false), random.bit(true)],
        own: [random.bit(false), random.bit(true)],
        timer: Contact::Or(random.input(false), random.input(true)),
        preset: 2 + random.below(14) as i32,
        leave: random.bit(false),
    })
}

fn outside(random: &mut Random, writes: usize) -> Outside {
    Outside {
        toggles: (0..INPUTS as u16).filter(|_| random.below(8) == 0).collect(),
        writes: (0..writes)
            .map(|_| (random.below(WORDS) as u16, random.below(100) as i32))
            .collect(),
    }
}

/// splitmix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        ((self.next() >> 32) * bound) >> 32
    }

    fn input(&mut self, opposite: bool) -> BitContact {
        BitContact { bit: Bit::Input(self.below(INPUTS)), opposite }
    }

    fn bit(&mut self, opposite: bool) -> Contact {
        Contact::Bit(self.input(opposite))
    }

    fn shuffle<T>(&mut self, items: &mut [T]) {
        for at in (1..items.len()).rev() {
            items.swap(at, self.below(at as u64 + 1) as usize);
        }
    }
}
