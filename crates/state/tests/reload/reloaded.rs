//! A controller that is reloaded while it runs, in virtual time: shared by the tests of the rules.

use rungd_engine::{Cell, Engine};
use rungd_language::lower::lower;
use rungd_state::reload::{FileTexts, LoweredProgram, OldMemory, ReloadPlan};
use rungd_test_support::plc::{Plc, of_ladder};
use rungd_test_support::run;

/// A controller that is reloaded while it runs.
pub struct Reloaded {
    pub plc: Plc,
    pub forces: Vec<Cell>,
    pub report: Vec<String>,
}

pub fn plc(ladder: &str) -> Reloaded {
    let mut plc = of_ladder(ladder);
    plc.engine.start(0);
    Reloaded { plc, forces: Vec::new(), report: Vec::new() }
}

/// A controller whose Main has these rungs.
pub fn main_with(rungs: &str) -> Reloaded {
    plc(&main_text(rungs))
}

pub fn main_text(rungs: &str) -> String {
    format!("[[program]]\nname = \"Main\"\n{rungs}")
}

impl Reloaded {
    pub fn scan(mut self, changes: &[(&str, i32)]) -> Self {
        self.plc.scan(changes);
        self
    }

    pub fn scans(mut self, count: u32) -> Self {
        self.plc.scans(count);
        self
    }

    pub fn force(mut self, name: &str, value: i32) -> Self {
        self.plc.force(name, value);
        self.forces.push(self.plc.cell(name));
        self
    }

    pub fn main(self, rungs: &str) -> Self {
        self.reload(&main_text(rungs))
    }

    pub fn reload(mut self, ladder: &str) -> Self {
        let program = run::load(ladder).unwrap_or_else(|errors| panic!("{errors}"));
        let (engine_program, symbols) = lower(&program);
        let plan = ReloadPlan::new(
            LoweredProgram { program: self.plc.engine.program(), symbols: &self.plc.symbols },
            LoweredProgram { program: &engine_program, symbols: &symbols },
        );
        let image = self.plc.engine.image();
        let (bits, words) = (image.bits().to_vec(), image.words().to_vec());
        let (forces, passed) = (self.forces.as_slice(), None);
        let (old, new) = (&self.plc.symbols.clone(), &symbols.clone());
        let seen = OldMemory { old, new, bits: &bits, words: &words, forces, passed };
        let forecast = plan.report(&seen, FileTexts::default());
        let mut engine = Engine::new(engine_program);
        engine.adopt(&mut self.plc.engine, &plan.transfer, true, &self.forces);
        let passed = Some(self.plc.engine.image().bits());
        self.report = plan.report(&OldMemory { passed, ..seen }, FileTexts::default());
        assert_eq!(forecast, self.report, "what a dry run says is what is done");
        self.forces = self.forces.iter().filter_map(|c| plan.transfer.cell(*c)).collect();
        (self.plc.engine, self.plc.program, self.plc.symbols) = (engine, program, symbols);
        self
    }

    #[track_caller]
    pub fn holds<const N: usize>(self, expected: [(&str, i64); N]) -> Self {
        let found = expected.map(|(name, _)| (name, self.plc.value(name)));
        assert_eq!(found, expected);
        self
    }

    #[track_caller]
    pub fn says(self, words: &str) -> Self {
        assert!(self.report.iter().any(|line| line == words), "{words}: {:#?}", self.report);
        self
    }
}

pub const ON: &str = "{ when = [\"$On\"], do = [\"OUT C99\"] },";

pub fn cnt(preset: &str) -> String {
    format!(
        "rung = [ {{ leg.up = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNT CT0 preset={preset}\"] }} ]"
    )
}

pub fn counted() -> Reloaded {
    main_with(&cnt("12")).scan(&[("X0", 1)]).scan(&[("X0", 0)]).scan(&[("X0", 1)])
}

/// Unnamed rungs, each with this contact and one instruction.
pub fn rungs(of: &[(&str, &str)]) -> String {
    let rung =
        |(when, run): &(&str, &str)| format!("{{ when = [\"{when}\"], do = [\"{run}\"] }},\n");
    format!("rung = [ {} ]", of.iter().map(rung).collect::<String>())
}

pub const NONE: &str = "no difference in what the program does";
