//! Reads a test file: its keys, its steps and conditions, and the files that it names.
//!
//! `cli` calls [`read_suite`] and prints the findings; `runner` gets the [`Suite`]. The test file
//! has the number 0, the ladder or controller files follow. Errors in these files are findings too,
//! but their warnings are not: `rungd check` reports them.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};

use super::condition::Condition;
use super::device_names::DeviceNames;
use super::interlock;
use super::names::{OBSERVER, Observation};
use super::programs::{BenchSettings, NamedProgram, Programs, TestFile, test_program};
use super::proving::{self, ProofConditions};
use super::random;
use super::step_text::{self, WrittenStep};
use super::steps::StepResolver;
use super::suite::{RandomTest, Scenario, Suite, TestOperand, TestProgram};
use super::written::{self, WrittenBench, WrittenRandom, WrittenScenario, WrittenSuite};
use crate::rig::SimulatedDevice;
use rungd_config::controller::Controller;
use rungd_config::controller::side_ladder::WrittenSideLadder;
use rungd_config::controller::simulated_side::{SimulatedSide, WrittenSimulated};
use rungd_config::load::side_ladders;
pub use rungd_config::load::test_ladders::{InputKind, SettingsFile, bench};
pub use rungd_config::load::{self, Loaded, OpenTexts, decode, read_bytes};
use rungd_language::resolve::LoadOptions;
use rungd_language::resolve::program::Program;
use rungd_language::source::condition::{WrittenCondition, condition};
use rungd_language::source::finding::{Code, Finding, Severity};
use rungd_language::source::lost::LostTexts;
use rungd_language::source::reader::Text;
use rungd_language::source::renaming;
use rungd_language::source::span::{FileId, Located, SourceFile, Span};

/// The result of reading a test file.
#[derive(Debug)]
pub struct ReadSuite {
    /// The test file, and the files of the program with which its scenarios begin, in the order of
    /// their numbers.
    pub files: Vec<SourceFile>,
    /// All findings, in order of place.
    pub findings: Vec<Finding>,
    /// The tests; `None` if a finding is an error.
    pub suite: Option<Suite>,
}

impl ReadSuite {
    /// The paths of all files that were read, with those of `reload` steps. Files of the library
    /// are not among them.
    pub fn paths(&self) -> Vec<String> {
        let programs = self.suite.iter().flat_map(|suite| &suite.programs);
        let files = self.files.iter().chain(programs.flat_map(|program| &program.files));
        let mut paths: Vec<String> = files.map(|file| file.name.clone()).collect();
        paths.retain(|path| !path.starts_with("lib:"));
        paths.sort_unstable();
        paths.dedup();
        paths
    }
}

/// Reads a test file and the files that it names.
///
/// # Errors
/// The test file itself cannot be read.
pub fn read_suite(path: &Path) -> Result<ReadSuite> {
    let bytes = read_bytes(path).with_context(|| path.display().to_string())?;
    let (text, finding) = decode(&bytes, FileId(0));
    let file = SourceFile { name: path.display().to_string(), text };
    Ok(read_text(path, file, finding))
}

/// As [`read_suite`], with the text of the file.
pub fn read_text(path: &Path, file: SourceFile, undecoded: Option<Finding>) -> ReadSuite {
    read_among(path, file, undecoded, &OpenTexts::default())
}

/// As [`read_text`], with texts that replace files on disk. `undecoded`: the finding of `decode`.
pub fn read_among(
    path: &Path,
    file: SourceFile,
    undecoded: Option<Finding>,
    texts: &OpenTexts,
) -> ReadSuite {
    let (findings, files) = (undecoded.into_iter().collect(), vec![file]);
    let mut reading =
        SuiteReading { findings, files, texts: texts.clone(), lost: LostTexts::default() };
    let suite = match reading.findings.is_empty() {
        true => reading.suite(path),
        false => None,
    };
    let SuiteReading { mut findings, files, lost, .. } = reading;
    lost.keep_sure(&mut findings);
    findings.sort_by_key(|finding| {
        (finding.span.file, finding.span.start, finding.span.end, finding.code)
    });
    let refused =
        !lost.is_empty() || findings.iter().any(|finding| finding.severity() == Severity::Error);
    ReadSuite { files, findings, suite: suite.filter(|_| !refused) }
}

/// The files and findings so far.
struct SuiteReading {
    files: Vec<SourceFile>,
    findings: Vec<Finding>,
    texts: OpenTexts,
    lost: LostTexts,
}

/// A scenario whose steps have been read, but not resolved.
struct ReadScenario {
    scenario: WrittenScenario,
    steps: Vec<Located<WrittenStep>>,
}

impl SuiteReading {
    fn suite(&mut self, path: &Path) -> Option<Suite> {
        let (written, found) = written::read(&self.files[0].text, FileId(0));
        self.findings.extend(found);
        let WrittenSuite {
            bench,
            always,
            interlocks,
            has_observer,
            simulated,
            scenarios,
            randoms,
            prove,
            lost,
        } = written?;
        self.lost.add_settings(FileId(0), lost);
        self.names(&scenarios, &randoms);
        let mut always = self.conditions(always);
        let locked = interlock::conditions(&interlocks, &mut self.findings);
        let interlocked = locked.len();
        always.extend(locked);
        let prove = prove.unwrap_or_default();
        let (assume, can) = (prove.assume.clone(), prove.can.clone());
        let mut asked = ProofConditions::new(self.conditions(assume), self.conditions(can));
        let scenarios: Vec<ReadScenario> =
            scenarios.into_iter().map(|scenario| self.read_steps(scenario)).collect();
        let (settings, first, names) = self.bench(path, bench?)?;
        let (options, texts) = (LoadOptions::default(), self.texts.clone());
        let first = NamedProgram { program: first, files: &names };
        let observer = has_observer.then(|| self.files[0].clone());
        let sides = self.sides(path, &simulated, &first.program.controller);
        let ladders = DeviceNames::of(&first.program, &sides);
        let mut observation = Observation { observer, ..Observation::default() };
        let of_file = always.iter().chain(&asked.assume).chain(&asked.can);
        let steps = scenarios.iter().flat_map(|scenario| &scenario.steps);
        let of_steps = steps.filter_map(|step| step.value.condition());
        for condition in of_file.map(|(_, condition)| condition).chain(of_steps) {
            observation.remember(condition);
            observation.show(condition, &ladders);
        }
        asked.know_devices(&always, ladders);
        let file = TestFile { path, texts: &texts, observation };
        let shift = shift_of(&settings);
        let mut programs = Programs::new(file, settings, first, &options);
        sides.iter().for_each(|side| programs.add_side(side));
        let devices = sides.iter().map(SimulatedDevice::of).collect();
        let mistakes = std::mem::take(&mut programs.names[0].mistakes);
        self.findings.extend(mistakes.into_iter().map(|finding| shifted(finding, shift)));
        let resolved = Resolution::of(&mut programs, &always, scenarios, randoms);
        self.findings.extend(resolved.findings);
        let proof = proving::settings(&mut programs, &prove, &asked, &mut self.findings);
        Some(Suite {
            name: self.files[0].name.clone(),
            file: self.files[0].clone(),
            programs: programs.finish(),
            always: resolved.always,
            interlocked,
            devices,
            scenarios: resolved.scenarios,
            randoms: resolved.randoms,
            proof,
        })
    }

    /// Adds findings for tests with the same name.
    fn names(&mut self, scenarios: &[WrittenScenario], randoms: &[WrittenRandom]) {
        let mut seen: HashMap<&str, Span> = HashMap::new();
        let names = scenarios
            .iter()
            .map(|scenario| &scenario.name)
            .chain(randoms.iter().map(|random_test| &random_test.name));
        for name in names.flatten() {
            if let Some(first) = seen.insert(&name.text, name.span) {
                let message = format!("two tests are called `{}`", name.text);
                let finding = Finding::new(Code::DuplicateName, name.span, message);
                let finding = finding.related(first, "the other one");
                let fix = renaming::another(&name.text, ' ', |name| seen.contains_key(name));
                self.findings.push(finding.help("give each test a name of its own").fix(fix));
                seen.insert(&name.text, first);
            }
        }
    }

    fn conditions(&mut self, texts: Vec<Text>) -> Vec<(Span, WrittenCondition)> {
        let mut conditions = Vec::new();
        for text in texts {
            match condition(&text.text, text.span) {
                Ok(condition) => {
                    self.findings.extend(condition.doubts());
                    conditions.push((text.span, condition));
                }
                Err(finding) => self.findings.push(finding),
            }
        }
        conditions
    }

    fn read_steps(&mut self, mut scenario: WrittenScenario) -> ReadScenario {
        let mut steps = Vec::new();
        for text in std::mem::take(&mut scenario.steps) {
            match step_text::parse(&text.text, text.span) {
                Ok(value) => {
                    self.findings.extend(
                        value.condition().map_or(Vec::new(), |condition| condition.doubts()),
                    );
                    steps.push(Located { value, span: text.span });
                }
                Err(finding) => self.findings.push(finding),
            }
        }
        ReadScenario { scenario, steps }
    }

    /// The settings, the program with which scenarios begin, and the names of its files.
    fn bench(
        &mut self,
        path: &Path,
        bench_written: WrittenBench,
    ) -> Option<(BenchSettings, TestProgram, Vec<String>)> {
        let (loaded, settings, names) = match bench_written {
            WrittenBench::Ladders(settings) => {
                let names = settings.ladder.iter().map(|name| name.text.clone()).collect();
                let (file, kind) = (self.files[0].clone(), InputKind::Ladder);
                let loaded = bench(path, SettingsFile { file, kind }, &settings, &self.texts);
                (loaded, BenchSettings::Test(settings), names)
            }
            WrittenBench::Controller(name) => {
                let controller = load::test_ladders::path_of(path, &name.text);
                match load::controller_among(&controller, &self.texts) {
                    Ok(loaded) => (loaded, BenchSettings::Controller, vec![name.text]),
                    Err(failure) => {
                        let cause = failure.root_cause();
                        let message = format!("cannot read `{}`: {cause}", controller.display());
                        let finding = Finding::new(Code::TestFile, name.span, message);
                        let finding = finding.help("paths are relative to the test file");
                        self.findings.push(finding);
                        return None;
                    }
                }
            }
        };
        self.add(&loaded, shift_of(&settings));
        Some((settings, test_program(loaded).ok()?, names))
    }

    /// The Modbus devices whose own side is a ladder by this test file.
    fn sides(
        &mut self,
        path: &Path,
        simulated: &[WrittenSimulated],
        controller: &Controller,
    ) -> Vec<SimulatedSide> {
        let loaded: Vec<_> =
            simulated.iter().map(|one| self.device_ladder(path, &one.side)).collect();
        let (devices, code) = (&controller.devices, Code::TestFile);
        let (sides, found) = WrittenSimulated::resolve(simulated, &loaded, devices, code);
        self.findings.extend(found);
        sides
    }

    /// Loads the ladder of a field device.
    fn device_ladder(&mut self, path: &Path, side: &WrittenSideLadder) -> Option<Arc<Program>> {
        let loaded = side_ladders::of_test(path, self.files[0].clone(), side, &self.texts);
        let base = self.files.len() as u32 - 1;
        self.files.extend(loaded.files[1..].iter().cloned());
        let shifted = |span: &mut Span| {
            if span.file.0 > 0 {
                span.file.0 += base;
            }
        };
        for mut finding in loaded.findings {
            shifted(&mut finding.span);
            finding.related.iter_mut().for_each(|(span, _)| shifted(span));
            if finding.severity() == Severity::Error || finding.span.file == FileId(0) {
                self.findings.push(finding);
            }
        }
        loaded.program
    }

    /// Adds the files and findings of a load. `shift`: added to the file numbers of the load.
    fn add(&mut self, loaded: &Loaded, shift: u32) {
        let new = if shift == 0 { 1 } else { 0 };
        self.files.extend(loaded.files[new..].iter().cloned());
        for finding in &loaded.findings {
            let finding = shifted(finding.clone(), shift);
            if finding.severity() == Severity::Error || finding.span.file == FileId(0) {
                self.findings.push(finding);
            }
        }
    }
}

/// The tests with their names resolved.
struct Resolution {
    findings: Vec<Finding>,
    always: Vec<Vec<Condition>>,
    scenarios: Vec<Scenario>,
    randoms: Vec<RandomTest>,
}

impl Resolution {
    fn of(
        programs: &mut Programs<'_>,
        always: &[(Span, WrittenCondition)],
        scenarios: Vec<ReadScenario>,
        randoms: Vec<WrittenRandom>,
    ) -> Resolution {
        let mut all = Resolution {
            findings: Vec::new(),
            always: Vec::new(),
            scenarios: Vec::new(),
            randoms: Vec::new(),
        };
        all.always(programs, always, None);
        for ReadScenario { scenario, steps } in scenarios {
            let mut resolver = StepResolver::new(programs);
            let set = resolver.set(&scenario.set);
            let before = resolver.programs.programs.len();
            let steps = resolver.steps(steps);
            all.findings.append(&mut resolver.findings);
            if programs.programs.len() > before {
                all.always(programs, always, Some(&steps));
            }
            let name = scenario.name.map(|name| name.text).unwrap_or_default();
            all.scenarios.push(Scenario { name, span: scenario.span, set, steps });
        }
        for random in randoms {
            let set = all.set(programs, &random);
            let changes = random::changes(programs, &random, &mut all.findings);
            let incidents = random::incidents(programs, &random.events, &mut all.findings);
            let whole = |number: Option<Located<i64>>| {
                number.map_or(0, |number| number.value.unsigned_abs())
            };
            all.randoms.push(RandomTest {
                name: random.name.map(|name| name.text).unwrap_or_default(),
                span: random.span,
                runs: u32::try_from(whole(random.runs)).unwrap_or(u32::MAX),
                scans: whole(random.scans),
                seed: whole(random.seed),
                set,
                incidents,
                changes,
            });
        }
        all
    }

    fn set(
        &mut self,
        programs: &mut Programs<'_>,
        random: &WrittenRandom,
    ) -> Vec<(TestOperand, i32)> {
        let mut resolver = StepResolver::new(programs);
        let set = resolver.set(&random.set);
        self.findings.append(&mut resolver.findings);
        set
    }

    /// Resolves `always` for the new programs; `steps`: the steps that loaded them.
    fn always(
        &mut self,
        programs: &mut Programs<'_>,
        always: &[(Span, WrittenCondition)],
        steps: Option<&[Located<super::suite::TestStep>]>,
    ) {
        for id in self.always.len()..programs.programs.len() {
            let mut conditions = Vec::new();
            let reload = steps.and_then(|steps| reload_of(steps, id));
            for (span, written) in always {
                match (programs.names[id].condition(written), reload) {
                    (Ok(condition), _) => conditions.push(condition),
                    (Err(found), None) => self.findings.extend(found),
                    (Err(found), Some(step)) => {
                        self.findings.extend(behind_reload(step, *span, found));
                    }
                }
            }
            self.always.push(conditions);
        }
    }
}

/// The difference between the numbers of files here and in a load: the files of a controller file
/// follow the test file, which is the first file of its own load.
fn shift_of(settings: &BenchSettings) -> u32 {
    u32::from(matches!(settings, BenchSettings::Controller))
}

/// A finding of a load, with the numbers of files here. Places of the observer are in the test
/// file.
fn shifted(mut finding: Finding, shift: u32) -> Finding {
    let places = finding.related.iter_mut().map(|(place, _)| place);
    for place in places.chain([&mut finding.span]) {
        place.file.0 = if place.file == OBSERVER { 0 } else { place.file.0 + shift };
    }
    finding
}

/// The place of the `reload` step that loads a program.
fn reload_of(steps: &[Located<super::suite::TestStep>], id: usize) -> Option<Span> {
    let to = super::suite::ProgramId(id);
    steps.iter().find(|step| step.value.reloaded() == Some(to)).map(|step| step.span)
}

/// The findings about a line of `always` in the program of a `reload` step, placed at that step.
fn behind_reload(step: Span, line: Span, found: Vec<Finding>) -> Vec<Finding> {
    let at_step = |finding: Finding| {
        let message = format!("an `always` line does not fit this program: {}", finding.message);
        let told = Finding::new(Code::TestStep, step, message).related(line, "this line");
        told.with_help_of(finding)
    };
    found.into_iter().map(at_step).collect()
}
