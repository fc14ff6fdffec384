//! Tests of loads whose time limit ends, at each step of a load and within the steps.

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::load::{Loaded, controller_file_within};
use rungd_base::progress::{LoadStep, Progress};

const CONTROLLER: &str = "ladder = [\"ladder.toml\"]\n";
const LADDER: &str = "[tags]\nlamp = { at = \"Y0\" }\n[[program]]\nname = \"Main\"\n\
                      rung = [ { when = [\"X0\"], do = [\"OUT lamp\"] } ]\n";

/// A folder with a controller file and a ladder file, removed at the end of the test.
struct EndedFolder(std::path::PathBuf);

impl EndedFolder {
    fn new(controller: &str, ladder: &str) -> EndedFolder {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("rungd-ended-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("controller.toml"), controller).unwrap();
        std::fs::write(folder.join("ladder.toml"), ladder).unwrap();
        EndedFolder(folder)
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    fn load(&self, progress: &Progress) -> Loaded {
        controller_file_within(Path::new(&self.file("controller.toml")), progress).unwrap()
    }

    /// The number of looks of a whole load within a step.
    fn looks(&self, step: &LoadStep) -> usize {
        let progress = Progress::over_within(step.clone(), usize::MAX);
        self.load(&progress);
        usize::MAX - progress.looks_left()
    }
}

impl Drop for EndedFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_load_that_times_out_reports_its_current_step() {
    let folder = EndedFolder::new(CONTROLLER, LADDER);
    let (controller, ladder) = (folder.file("controller.toml"), folder.file("ladder.toml"));
    let steps = [
        LoadStep::Reading(controller.clone()),
        LoadStep::Parsing(controller.clone()),
        LoadStep::Reading(ladder.clone()),
        LoadStep::Parsing(ladder),
        LoadStep::Names,
        LoadStep::Settings,
        LoadStep::Rule("owned-twice"),
        LoadStep::Rule("out-lost-on-jump-back"),
        LoadStep::Rule("unused-tag"),
    ];
    for step in steps {
        let progress = Progress::over_at(step.clone());
        let loaded = folder.load(&progress);
        assert!(loaded.program.is_none() && loaded.controller.is_none(), "{step}");
        assert_eq!(progress.current(), Some(step), "it began no further step");
    }
    let loaded = folder.load(&Progress::new());
    assert!(loaded.program.is_some() && loaded.findings.is_empty(), "{:?}", loaded.findings);
}

#[test]
fn a_load_that_times_out_ends_at_the_next_check_of_the_time() {
    let folder = EndedFolder::new(&format!("{CONTROLLER}[outputs]\nhold = [\"Y1\"]\n"), LADDER);
    let steps = [
        LoadStep::Parsing(folder.file("controller.toml")),
        LoadStep::Parsing(folder.file("ladder.toml")),
        LoadStep::Names,
        LoadStep::Settings,
        LoadStep::Rule("never-written"),
        LoadStep::Rule("unused-tag"),
    ];
    for step in steps {
        let looks = folder.looks(&step);
        assert!(looks > 0, "{step}");
        for before in 0..looks {
            let progress = Progress::over_within(step.clone(), before);
            let loaded = folder.load(&progress);
            assert!(loaded.program.is_none() && loaded.controller.is_none(), "{step}: {before}");
            assert_eq!(progress.current(), Some(step.clone()), "after {before} looks");
        }
    }
}

/// Checks that a load looks once more within a step for each further part. `text` makes the
/// controller file and the ladder file with a number of parts.
#[track_caller]
fn looks_at_each(kind: &str, step: &LoadStep, text: impl Fn(usize) -> (String, String)) {
    let [some, more] = [20, 40].map(|parts| {
        let (controller, ladder) = text(parts);
        EndedFolder::new(&controller, &ladder).looks(step)
    });
    assert!(more >= some + 20, "{kind}, {step}: {some} looks, then {more}");
}

/// The parts 0, 1 …, each followed by `between`.
fn parts(count: usize, between: &str, part: impl Fn(usize) -> String) -> String {
    (0..count).map(|at| part(at) + between).collect()
}

#[test]
fn reading_settings_checks_the_time_at_each_item() {
    let each = |kind: &str, text: &dyn Fn(usize) -> String| {
        let files = |count| (format!("{CONTROLLER}{}", text(count)), LADDER.to_owned());
        looks_at_each(kind, &LoadStep::Settings, files);
    };
    let list = |table: &str, count: usize, item: &str| {
        format!("{table} = [{}]\n", parts(count, ", ", |at| format!("\"{item}{at}\"")))
    };
    each("outputs that are ON", &|n| list("[outputs]\non", n, "Y"));
    each("outputs that are held", &|n| list("[outputs]\nhold", n, "Y"));
    each("retained ranges", &|n| list("[retain]\nranges", n, "D"));
    each("patterns of retained tags", &|n| list("[retain]\ntags", n, "tag_*"));
    each("writable ranges", &|n| list("[modbus-server]\nwritable", n, "D"));
    each("operands of the web", &|n| list("[web]\nwrite", n, "D"));
    let tables = |count: usize, table: &str, keys: &dyn Fn(usize) -> String| {
        parts(count, "\n", |at| format!("[[{table}]]\n{}", keys(at)))
    };
    each("simulated inputs", &|n| {
        tables(n, "simulated-device", &|at| {
            format!("input = \"X{at}\"\npulse = \"1s\"\nevery = \"2s\"")
        })
    });
    each("entries of the Modbus map", &|n| {
        tables(n, "modbus-server.map", &|at| {
            format!("operand = \"D{at}\"\ntable = \"holding\"\naddress = {}", 4000 + 2 * at)
        })
    });
    each("lists of writes", &|n| {
        tables(n, "modbus-server.write", &|at| {
            format!("ranges = [\"D{at}\"]\nclients = [\"10.0.0.{at}\"]")
        })
    });
    each("panels", &|n| {
        tables(n, "panel", &|at| format!("name = \"p{at}\"\nshow = [{{ lamp = \"Y0\" }}]"))
    });
    each("lines that are watched", &|n| {
        tables(n, "watch", &|at| format!("name = \"w{at}\"\nalways = \"!Y0\""))
    });
    each("parts of a panel", &|n| {
        let show = parts(n, ", ", |_| "{ lamp = \"Y0\" }".to_owned());
        format!("[[panel]]\nname = \"p\"\nshow = [{show}]\n")
    });
}

#[test]
fn reading_settings_checks_the_time_at_each_row_part_and_fault() {
    let each = |kind: &str, text: &dyn Fn(usize) -> String| {
        let files = |count| (format!("{CONTROLLER}{}", text(count)), LADDER.to_owned());
        looks_at_each(kind, &LoadStep::Settings, files);
    };
    let device = |name: &str, driver: &str, keys: String| {
        format!("[[device]]\nname = \"{name}\"\ndriver = \"{driver}\"\n{keys}\n")
    };
    let rows = |count: usize, point: &str| {
        let row = |at: usize| format!("{{ from = \"{point} {at}\", to = \"C{at}\" }}");
        format!("map = [{}]", parts(count, ", ", row))
    };
    let chip = "chip = \"/dev/gpiochip0\"\n";
    each("devices", &|n| {
        parts(n, "", |at| device(&format!("d{at}"), "gpio", format!("{chip}{}", rows(1, "line"))))
    });
    each("rows of lines", &|n| device("d", "gpio", format!("{chip}{}", rows(n, "line"))));
    each("rows of a Modbus device", &|n| {
        let address = "address = \"192.168.1.20:502\"\n";
        device("d", "modbus-tcp", format!("{address}{}", rows(n, "coil")))
    });
    let part = |at: usize| format!("{{ name = \"p{at}\", kind = \"pulse\", pulse = \"1s\" }}");
    let plant = |count: usize| format!("part = [{}]\n", parts(count, ", ", part));
    each("parts of a plant", &|n| device("d", "simulated", plant(n)));
    each("faults of a plant", &|n| {
        let fault = |at: usize| format!("{{ name = \"f{at}\", kind = \"lost\" }}");
        let faults = format!("fault = [{}]", parts(n, ", ", fault));
        device("d", "simulated", plant(1) + &faults)
    });
}

#[test]
fn the_rules_check_the_time_at_each_instruction() {
    let rungs = |count| {
        let rung = |at: usize| format!("{{ when = [\"C{at}\"], do = [\"OUT C{}\"] }}", 100 + at);
        let rungs = parts(count, ", ", rung);
        let ladder = format!("[[program]]\nname = \"Main\"\nrung = [{rungs}]\n");
        (CONTROLLER.to_owned(), ladder)
    };
    let rules =
        ["block-rule", "duplicate-out", "constant-compare", "never-written", "set-never-reset"];
    for step in [LoadStep::Names].into_iter().chain(rules.map(LoadStep::Rule)) {
        looks_at_each("rungs", &step, rungs);
    }
}
