//! Random programs through `rungd sim` and through the reference model: the traces must be
//! equal, every operand of every scan.
//!
//! `RUNGD_DIFF_PROGRAMS` (150) is the number of programs, and `RUNGD_DIFF_SEED` (1) the first seed.
//! The run ends after `RUNGD_DIFF_MAX` (1) differences. `RUNGD_BIN` names a different rungd binary.
//! A case that differs is shrunk and written to a folder below the target's `tmp`.

use rungd_test_support::model::case::Case;
use rungd_test_support::model::generate::with_templates;
use rungd_test_support::model::shrink::shrink;
use rungd_test_support::model::{Options, simulate};
use rungd_test_support::setting::setting;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

enum Verdict {
    Same,
    /// Both ran, with different traces: the first difference, and the operands that differ there.
    Differs(String, Vec<String>),
    /// rungd or the model refused the case.
    Refused(String),
}

struct Bench {
    rungd: PathBuf,
    folder: PathBuf,
}

/// The files of a case.
struct CaseFiles {
    ladder: PathBuf,
    stimulus: PathBuf,
}

fn bench() -> Bench {
    let built = PathBuf::from(env!("CARGO_BIN_EXE_rungd"));
    let rungd = env::var_os("RUNGD_BIN").map_or(built, PathBuf::from);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("differential");
    Bench { rungd, folder }
}

impl Bench {
    fn write(&self, case: &Case, name: &str) -> Result<CaseFiles, String> {
        let folder = self.folder.join(name);
        let (ladder, stimulus) = (folder.join("ladder.toml"), folder.join("stimulus.csv"));
        fs::create_dir_all(&folder)
            .and_then(|()| fs::write(&ladder, case.ladder()))
            .and_then(|()| fs::write(&stimulus, case.stimulus()))
            .map_err(|error| format!("{}: {error}", folder.display()))?;
        Ok(CaseFiles { ladder, stimulus })
    }

    fn command(&self, case: &Case, files: &CaseFiles, watch: &[String]) -> Command {
        let mut command = Command::new(&self.rungd);
        command.arg("sim").arg(&files.ladder).arg("--stimulus").arg(&files.stimulus);
        command.args(["--trace", "-"]).args(case.arguments(watch));
        command
    }

    fn rungd_trace(&self, case: &Case) -> Result<String, String> {
        let files = self.write(case, &format!("run-{}", std::process::id()))?;
        let output = self.command(case, &files, &case.watch()).output();
        let output = output.map_err(|error| error.to_string())?;
        if output.status.success() {
            return String::from_utf8(output.stdout).map_err(|error| error.to_string());
        }
        let findings = String::from_utf8_lossy(&output.stderr).into_owned();
        Err(format!("rungd refused the case ({}):\n{findings}", output.status))
    }

    fn judge(&self, case: &Case) -> Verdict {
        let traces = model_trace(case).and_then(|m| self.rungd_trace(case).map(|r| (m, r)));
        match traces {
            Err(message) => Verdict::Refused(message),
            Ok((model, rungd)) => match difference(&model, &rungd) {
                None => Verdict::Same,
                Some((text, operands)) => Verdict::Differs(text, operands),
            },
        }
    }

    /// Shrinks a case that differs, writes it to a folder, and describes it.
    fn report(&self, case: &Case) -> String {
        let differs = |case: &Case| matches!(self.judge(case), Verdict::Differs(..));
        let small = shrink(case, 4000, &mut { differs });
        let Verdict::Differs(text, operands) = self.judge(&small) else {
            return format!("seed {}: the difference does not repeat", case.seed);
        };
        self.describe(&small, &text, &operands)
    }

    fn describe(&self, case: &Case, text: &str, watch: &[String]) -> String {
        let files = match self.write(case, &format!("seed-{}", case.seed)) {
            Ok(files) => files,
            Err(message) => return message,
        };
        let all = case.watch();
        let watch = if watch.is_empty() { &all } else { watch };
        let command = self.command(case, &files, watch);
        let words = command.get_args().map(|word| match word.to_string_lossy() {
            word if word.contains('$') => format!("'{word}'"),
            word => word.into_owned(),
        });
        let words: Vec<String> = words.collect();
        format!(
            "seed {}: {text}\n--- {}\n{}\n--- {}\n{}--- {} {}\n",
            case.seed,
            files.ladder.display(),
            case.ladder(),
            files.stimulus.display(),
            case.stimulus(),
            self.rungd.display(),
            words.join(" "),
        )
    }
}

fn model_trace(case: &Case) -> Result<String, String> {
    let (watch, stimulus) = (case.watch(), case.stimulus());
    let options = Options {
        period: case.period,
        scans: case.scans,
        stop: case.stop,
        clock: case.clock,
        watch: &watch,
        stimulus: &stimulus,
    };
    let trace = simulate(&case.ladder(), &options);
    trace.map_err(|message| format!("the model refused the case: {message}"))
}

/// The first scan with a difference, and each operand that differs in that scan.
fn difference(model: &str, rungd: &str) -> Option<(String, Vec<String>)> {
    if model == rungd {
        return None;
    }
    let header: Vec<&str> = model.lines().next().unwrap_or_default().split(',').collect();
    for (m, r) in model.lines().zip(rungd.lines()) {
        if m == r {
            continue;
        }
        let (m, r): (Vec<&str>, Vec<&str>) = (m.split(',').collect(), r.split(',').collect());
        if m.len() != r.len() {
            let text = format!("the model has {} columns, rungd {}", m.len(), r.len());
            return Some((text, Vec::new()));
        }
        let (mut cells, mut operands) = (Vec::new(), Vec::new());
        for (name, (m, r)) in header.iter().zip(m.iter().zip(&r)).filter(|(_, (m, r))| m != r) {
            cells.push(format!("  {name}: model {m}, rungd {r}"));
            operands.push(name.to_string());
        }
        let (scan, time) = (m.first().unwrap_or(&""), m.get(1).unwrap_or(&""));
        let text = format!("scan {scan} at {time} ms differs:\n{}", cells.join("\n"));
        return Some((text, operands));
    }
    let (m, r) = (model.lines().count(), rungd.lines().count());
    Some((format!("the model's trace has {m} lines, rungd's {r}"), Vec::new()))
}

#[test]
fn rungd_agrees_with_the_model() {
    let bench = bench();
    let (first, programs) = (setting("RUNGD_DIFF_SEED", 1), setting("RUNGD_DIFF_PROGRAMS", 150));
    let most = setting("RUNGD_DIFF_MAX", 1);
    let mut failures = Vec::new();
    for seed in first..first.saturating_add(programs) {
        let case = with_templates(seed);
        match bench.judge(&case) {
            Verdict::Same => continue,
            Verdict::Differs(..) => failures.push(bench.report(&case)),
            Verdict::Refused(message) => {
                failures.push(bench.describe(&case, &message, &[]));
            }
        }
        if failures.len() as u64 >= most {
            break;
        }
    }
    assert!(failures.is_empty(), "{} differ:\n{}", failures.len(), failures.join("\n\n"));
}

/// The model can run every generated program, and gives the same trace twice.
#[test]
fn the_model_runs_generated_programs() {
    for seed in 1..=100 {
        let (first, second) =
            (model_trace(&with_templates(seed)), model_trace(&with_templates(seed)));
        assert!(first.is_ok(), "seed {seed}: {first:?}\n{}", with_templates(seed).ladder());
        assert_eq!(first, second, "seed {seed}");
    }
}
