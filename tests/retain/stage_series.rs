//! Power cuts at random scans, in virtual time: a plant always goes on in the Stages of its image.
//! The plants are the test's own, and every shipped controller that retains Stages.
//!
//! `RUNGD_STAGE_CUTS` (1000) power cuts of each plant, from the seed `RUNGD_STAGE_SEED` (1) on.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rungd_config::load;
use rungd_engine::isa::{Bit, BitSpace, BlockId, StageId};
use rungd_engine::{BitCell, Cell};
use rungd_lab::rig::{PowerOff, Rig, RigMode, RigProgram, RigSetup};
use rungd_test_support::numbers::Numbers;
use rungd_test_support::setting::setting;

/// Three Programs with Stages, which inputs start, stop and move on.
const LADDER: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["X0"], do = ["RUN A"] },
  { when = ["rise(X1)"], do = ["HALT A", "RUN B"] },
  { when = ["rise(X2)"], do = ["RESTART B"] },
]

[[program]]
name = "A"

[[program.stage]]
name = "One"
rung = [{ when = ["X3"], do = ["JMP Two"] }]

[[program.stage]]
name = "Two"
rung = [{ when = ["X4"], do = ["SGDIVRG Three Four"] }, { when = ["$On"], do = ["OUT Y0"] }]

[[program.stage]]
name = "Three"
rung = [{ when = ["X5"], do = ["SGCONVRG Three Four to=One"] }]

[[program.stage]]
name = "Four"
rung = [{ when = ["X6"], do = ["EXIT"] }]

[[program]]
name      = "B"
autostart = true

[[program.stage]]
name = "Rest"
rung = [{ when = ["X7"], do = ["JMP Work"] }]

[[program.stage]]
name = "Work"
rung = [{ when = ["X0 & X1"], do = ["SGRST Work"] }, { when = ["X3"], do = ["JMP Rest"] }]

[[program]]
name = "Last"
rung = [{ when = ["X5 & X6"], do = ["RUN A"] }, { when = ["X6"], do = ["RUN B"] }]
"#;

/// What a start must restore of a Program.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ProgramState {
    runs: bool,
    on: Vec<bool>,
}

struct Plant {
    program: Arc<RigProgram>,
    rig: Rig,
    numbers: Numbers,
    inputs: u32,
    programs: Vec<(BlockId, std::ops::Range<u32>)>,
}

impl Plant {
    fn new(controller: &Path, seed: u64) -> Plant {
        let loaded = load::controller_file(controller).expect("it can be read");
        assert!(loaded.program.is_some(), "{}: {:?}", controller.display(), loaded.findings);
        let (program, mut controller) = (loaded.program.unwrap(), loaded.controller.unwrap());
        // Every scan has an image.
        controller.retention.interval_ms = 1;
        let retained = program.blocks.iter().filter(|block| block.retains_stages);
        let programs = retained.map(|block| {
            let first = block.stages[0].id.0;
            (block.id, first..first + block.stages.len() as u32)
        });
        let programs = programs.collect();
        let inputs = 8.min(program.sizes.x);
        let program = Arc::new(RigProgram::new(&program, &Arc::new(controller)));
        let setup = RigSetup { keeps_images: true, ..RigSetup::default() };
        let rig = Rig::new(&program, &setup);
        Plant { program, rig, numbers: Numbers(seed), inputs, programs }
    }

    fn bit(&self, bit: Bit) -> bool {
        self.rig.image().bit(self.program.symbols.layout.bit(bit))
    }

    /// The Programs as an image after this scan has them.
    fn state(&self) -> Vec<ProgramState> {
        let of = |(block, stages): &(BlockId, std::ops::Range<u32>)| {
            let runs = self.bit(Bit::Running(*block));
            // A Program whose first turn is due has no Stage ON after the start.
            let kept = self.program.symbols.identity.kept.iter();
            let kept = kept.clone().find(|kept| kept.program == *block).expect("retained");
            let begins = self.rig.image().bit(kept.begins());
            let on = stages.clone().map(|n| runs && !begins && self.bit(Bit::Stage(StageId(n))));
            ProgramState { runs, on: on.collect() }
        };
        self.programs.iter().map(of).collect()
    }

    fn scans(&mut self, count: u64) {
        for _ in 0..count {
            for x in 0..self.inputs {
                if self.numbers.below(6) == 0 {
                    let BitCell(cell) = self.program.symbols.layout.bit(Bit::Space(BitSpace::X, x));
                    let on = self.rig.image().value(Cell::Bit(BitCell(cell))) == 0;
                    self.rig.set_input(x, on);
                }
            }
            let is_last = self.rig.scan();
            self.rig.end_scan(is_last);
        }
    }
}

/// Cuts the power of a plant at random scans; every scan has an image.
fn cuts(controller: &Path, count: u64) {
    let seed = setting("RUNGD_STAGE_SEED", 1);
    let mut plant = Plant::new(controller, seed);
    let (mut resumed, mut stages) = (0_u64, std::collections::BTreeSet::new());
    for cut in 0..count {
        let scans = 1 + plant.numbers.below(40);
        plant.scans(scans);
        let expected = plant.state();
        let ends_orderly = plant.numbers.below(8) == 0;
        if ends_orderly {
            plant.rig.request_stop();
            let is_last = plant.rig.scan();
            assert!(is_last);
            let expected = plant.state();
            plant.rig.end_scan(is_last);
            plant.rig.restart(0);
            assert_eq!(plant.state(), expected, "{}: stop {cut}", controller.display());
        } else {
            plant.rig.power_cut(PowerOff { down_ms: 0, lose_ms: 0 });
            assert_eq!(plant.state(), expected, "{}: cut {cut}", controller.display());
        }
        assert_eq!(plant.rig.mode(), RigMode::Run);
        let state = plant.state();
        resumed += u64::from(state.iter().any(|program| program.on.contains(&true)));
        stages.extend(state.into_iter().map(|program| (program.runs, program.on)));
    }
    println!("{}: {count} cuts, {resumed} within Stages: {stages:?}", controller.display());
    assert!(resumed > count / 10, "{}: most cuts are within Stages", controller.display());
}

/// A folder with a controller of the test's own.
fn own() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stage-series");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("ladder.toml"), LADDER).unwrap();
    let controller = "ladder = [\"ladder.toml\"]\nscan.period = \"10ms\"\n[retain]\n\
        stages = [\"*\"]\ninterval = \"1ms\"\n";
    std::fs::write(folder.join("controller.toml"), controller).unwrap();
    folder.join("controller.toml")
}

#[test]
fn a_thousand_power_cuts_resume_in_the_stages_of_the_image() {
    cuts(&own(), setting("RUNGD_STAGE_CUTS", 1000));
}

/// Shipped controllers that retain Stages; the devices of their plants go on over a power cut.
#[test]
fn shipped_plants_resume_in_their_stages() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|toml| toml == "toml") {
            let loaded = load::controller_file(&path).expect("it can be read");
            let retains = loaded.program.iter().flat_map(|program| &program.blocks);
            if retains.clone().any(|block| block.retains_stages) {
                cuts(&path, setting("RUNGD_STAGE_CUTS", 100));
            }
        }
    }
}
