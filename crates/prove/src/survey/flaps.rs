//! Outputs that change in every scan for ever while all inputs stand still.
//!
//! Called by `survey` for each output. Conditions are stored behind each scan: has the output
//! changed in this scan and in those before it, with inputs as before? Where that can be, the run
//! is executed on until a state comes again.

use rungd_engine::BitCell;
use rungd_engine::isa::{Address, Bit, BitSpace, Space, WordSpace};
use rungd_lab::rig::RigProgram;
use rungd_lab::testing::Suite;
use rungd_language::lower::judged::{Judges, StoredCondition};
use rungd_language::resolve::program::{Comparison, Contact, Edge, Program, Value};
use rungd_language::source::span::Span;

use super::contacts::not;
use super::facts::Possibility;
use crate::cone::cone;
use crate::explore::changes_for_ever;
use crate::model::{ProofModel, Target};
use crate::question::ModelledProgram;
use crate::race::{Decision, Effort, Race};

/// The number of scans in which an output changes before its run is executed on.
const CHANGES: u32 = 4;

/// The ladder whose outputs are asked about.
pub(super) struct FlapSearch<'a> {
    pub suite: &'a Suite,
    pub lowered: &'a RigProgram,
    pub program: &'a Program,
    /// The model of the survey.
    pub model: &'a ProofModel,
}

impl FlapSearch<'_> {
    /// Whether an output can flap. `judged`: the bit of the survey's model that judges it.
    pub fn output(&self, bit: Bit, judged: BitCell, race: &Race) -> Possibility {
        let layout = &self.model.code.layout;
        let inputs = cone(self.model, &[judged]).model.inputs;
        let inputs = inputs.iter().filter_map(|input| layout.address(input.cell));
        let addresses: Vec<Address> = inputs.collect();
        let mut watch = FlapWatch::of(self.program);
        watch.output(bit, &addresses);
        let behind = [watch.last(), contact(bit)];
        let FlapWatch { program, stored, remembered } = watch;
        let judges = Judges {
            behind: &behind,
            stored: &stored,
            remembered: &remembered,
            ..Judges::default()
        };
        let asked = ModelledProgram { program: &program, judges };
        let model = asked.model(self.suite, self.lowered).model;
        let [flaps, is_on] = [model.judged[0], model.judged[1]];
        let cone = cone(&model, &[flaps]);
        match race.decide_by_effort(&cone, Target { bit: flaps, value: true }, Effort::SURVEY) {
            Decision::Never(..) => Possibility::Never,
            Decision::Open(_) => Possibility::Open,
            Decision::Found(_, path) => {
                let path = cone.widened(&path);
                match changes_for_ever(&model, Target { bit: is_on, value: true }, &path) {
                    true => Possibility::Can(path),
                    false => Possibility::Open,
                }
            }
        }
    }
}

/// A ladder with the bits that remember changes.
struct FlapWatch {
    program: Program,
    stored: Vec<StoredCondition>,
    remembered: Vec<(Address, Address)>,
}

fn contact(bit: Bit) -> Contact {
    Contact::Bit(bit, Span::default())
}

fn edge(edge: Edge, bit: Bit) -> Contact {
    Contact::Edge(edge, Box::new(contact(bit)), Span::default())
}

impl FlapWatch {
    fn of(program: &Program) -> FlapWatch {
        FlapWatch { program: program.clone(), stored: Vec::new(), remembered: Vec::new() }
    }

    /// The next free element behind the memory.
    fn added(&mut self, space: Space) -> Address {
        let sizes = &mut self.program.sizes;
        let count = space.count(sizes);
        *sizes = space.sized(sizes, count + 1);
        space.address(space.first() + count)
    }

    fn added_bit(&mut self) -> Bit {
        match self.added(Space::Bit(BitSpace::C)) {
            Address::Bit(bit) => bit,
            Address::Word(_) | Address::Structure(_) => unreachable!("a C is a bit"),
        }
    }

    /// The contacts that are ON in a scan whose input is that of the scan before.
    fn still(&mut self, input: Address) -> Vec<Contact> {
        match input {
            Address::Bit(bit) => vec![not(edge(Edge::Rise, bit)), not(edge(Edge::Fall, bit))],
            Address::Word(word) => {
                let space = if word.is_real() { WordSpace::R } else { WordSpace::D };
                let kept = self.added(Space::Word(space));
                self.remembered.push((input, kept));
                let Address::Word(kept) = kept else { return Vec::new() };
                let [now, before] = [word, kept].map(Value::Word);
                vec![Contact::Compare(now, Comparison::Eq, before, Span::default())]
            }
            Address::Structure(_) => Vec::new(),
        }
    }

    /// Stores whether an output has changed in 1, 2, … scans with still inputs.
    fn output(&mut self, bit: Bit, inputs: &[Address]) {
        let changes =
            Contact::Any(vec![edge(Edge::Rise, bit), edge(Edge::Fall, bit)], Span::default());
        let mut all = vec![changes];
        for input in inputs {
            all.extend(self.still(*input));
        }
        let all = match all.as_slice() {
            [one] => one.clone(),
            _ => Contact::All(all, Span::default()),
        };
        let now = self.added_bit();
        let bits: Vec<Bit> = (0..CHANGES).map(|_| self.added_bit()).collect();
        self.stored.push(StoredCondition { contact: all, bit: now });
        // The longest first: each reads what the one before it was in the scan before.
        for at in (1..bits.len()).rev() {
            let both = Contact::All(vec![contact(now), contact(bits[at - 1])], Span::default());
            self.stored.push(StoredCondition { contact: both, bit: bits[at] });
        }
        self.stored.push(StoredCondition { contact: contact(now), bit: bits[0] });
    }

    /// The contact that is ON behind the last of the changes.
    fn last(&self) -> Contact {
        let last = self.stored.get(1).map(|stored| stored.bit);
        contact(last.expect("the changes are stored"))
    }
}
