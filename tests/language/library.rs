//! The templates of `config/lib/`, as a plant uses them: every file passes the check without a
//! finding, alone and in use.

use std::path::PathBuf;

use rungd_config::load;
use rungd_language::source::render::{Style, render};

/// One use of every template.
const PLANT: &str = r#"
[tags]
level    = { at = "R0", initial = 20.0 }
hand     = { at = "R1" }
setpoint = { at = "R2", initial = 50.0 }
hours    = { type = "int", count = 8, initial = 800 }
raw      = { at = "D0", initial = 12000 }

[[program]]
name = "Main"
rung = [
  { use = "Debounce", name = "d", with = { raw = "X0" } },
  { use = "Flasher", name = "f", with = { wanted = "X1", bright = "200ms" } },
  { use = "HourMeter", name = "h", with = { running = "X2", service = 3, done = "X3" } },
  { use = "LeadLag2", name = "l2", with = { first = "X4", second = "X5", ready1 = "X6", ready2 = "X7", run1 = "Y0", run2 = "Y1" } },
  { use = "LeadLag3", name = "l3", with = { first = "X4", second = "X5", ready1 = "X6", ready2 = "X7", ready3 = "$On", run1 = "Y2", run2 = "Y3", run3 = "Y4" } },
  { use = "Alternate", name = "alt", with = { wanted = "X4", one = "Y5", other = "Y6" } },
  { use = "AnalogIn", name = "a", with = { raw = "raw", low = 0, high = 100 } },
  { use = "Ramp", name = "r", with = { target = "setpoint", up = 10, down = 20 } },
  { use = "Hysteresis", name = "hy", with = { value = "a.value", high = 60, low = 40 } },
  { use = "HysteresisInt", name = "hi", with = { value = "raw", high = 6000, low = 4000 } },
  { use = "Pid", name = "p", with = { value = "level", setpoint = "setpoint", hand = "hand", gain = 2, reset = 5, by_hand = "X8" } },
  { use = "FirstOut", name = "fo", with = { alarm1 = "X9", alarm2 = "X10", ack = "X11" } },
  { use = "Tick", name = "t", with = { every = "100ms" } },
  { use = "Totalizer", name = "q", with = { rate = "level", clear = "t.now" } },
  { use = "Pulse", name = "pu", with = { trigger = "X12", length = "2s" } },
  { use = "Valve", name = "v", with = { wanted = "X14", open_switch = "X15", closed_switch = "!X15", open_time = "5s", close_time = "5s" } },
  { use = "Vote", name = "vo", with = { call1 = "X16", call2 = "X17", call3 = "X18" } },
  { use = "Median", name = "me", with = { value1 = "level", value2 = "a.value", value3 = "r.value", bad2 = "a.broken", deviation = 0.5 } },
  { use = "Week", name = "w", with = { begin = "hours", end = "hours", holidays = "hours", size = 8 } },
  { use = "Duty", name = "du", with = { need = "l3.need", ready1 = "X6", ready2 = "X7" } },
  { use = "RampSoak", name = "rs", with = { run = "X19", reset = "X20", value = "level", targets = "hours", rates = "hours", soaks = "hours", size = 8 } },
  { use = "Drive", name = "dr", with = { wanted = "X23", speed = "level", link = "X24", status = "hours[0]", control = "V11", reference = "V12", full = 1500, reset = "X25" } },
  { use = "PlantTank", name = "pt", with = { inflow = "level", outflow = "hand", capacity = 1000 } },
  { use = "PlantLag", name = "pl", with = { input = "level", constant = 10 } },
  { use = "PlantMotor", name = "pm", with = { run = "X26" } },
  { use = "PlantValve", name = "pv", with = { open = "X27", close = "!X27" } },
  { use = "PlantBelt", name = "pb", with = { run = "X28", feed = "X29", speed = 500, length = 1000, at1 = 300, at2 = 700 } },
  { use = "PlantDrive", name = "pd", with = { control = "hours[1]", reference = "hours[2]", status = "V13", rate = 500 } },
  { use = "Sequence", name = "s", with = { kinds = "hours", start = "X21", done = "X22" } },
  { use = "ShortCycle", name = "sc", with = { wanted = "X13", on_time = "1m", off_time = "2m" } },
  { use = "Ton", name = "ton", with = { IN = "X30", PT = "2s" } },
  { use = "Tof", name = "tof", with = { IN = "X30", PT = "2s" } },
  { use = "Tp", name = "tp", with = { IN = "X30", PT = "2s" } },
  { use = "Ctu", name = "ctu", with = { CU = "X31", PV = 5 } },
  { use = "Ctd", name = "ctd", with = { CD = "X31", PV = 5 } },
  { use = "Ctud", name = "ctud", with = { CU = "X31", CD = "X32", PV = 5 } },
  { use = "RTrig", name = "rose", with = { CLK = "X33" } },
  { use = "FTrig", name = "fell", with = { CLK = "X33" } },
  { use = "Sr", name = "sr", with = { S1 = "X34", R = "X35" } },
  { use = "Rs", name = "rs1", with = { S = "X34", R = "X35" } },
]
"#;

pub const LIBRARY: [&str; 28] = [
    "alternate",
    "debounce",
    "drive",
    "duty",
    "first-out",
    "flasher",
    "hour-meter",
    "hysteresis",
    "iec",
    "lead-lag",
    "pid",
    "plant-belt",
    "plant-drive",
    "plant-lag",
    "plant-motor",
    "plant-tank",
    "plant-valve",
    "pulse",
    "ramp",
    "ramp-soak",
    "scaling",
    "sequence",
    "short-cycle",
    "tick",
    "totalizer",
    "valve",
    "vote",
    "week",
];

#[test]
fn every_template_is_used_without_a_finding() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("library");
    std::fs::create_dir_all(&folder).expect("a folder");
    let plant = folder.join("plant.toml");
    std::fs::write(&plant, PLANT).expect("writable");
    let paths = LIBRARY.iter().map(|name| PathBuf::from(format!("lib:{name}")));
    let paths: Vec<PathBuf> = paths.chain([plant]).collect();
    let loaded = load::ladder_files(&paths).expect("all are there");
    assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
    let all = LIBRARY.map(|name| format!("\"lib:{name}\"")).join(", ");
    let controller = folder.join("controller.toml");
    // The values that a plant needs after a restart; a stop resets none of them.
    let kept = "h.hours h.since h.part q.total q.part q.rest l2.lead l3.lead alt.others_turn \
                fo.first fo.came fo.horn p.out p.integral r.value du.ran1 du.ran2 du.ran3 du.ran4 \
                rs.step rs.soaking rs.from rs.time s.active s.step s.aborted v.not_opened v.not_closed v.moved v.switches";
    let kept = format!("[\"{}\"]", kept.split_whitespace().collect::<Vec<_>>().join("\", \""));
    let text = format!("ladder = [{all}, \"plant.toml\"]\n[retain]\ntags = {kept}\n");
    std::fs::write(&controller, text).expect("writable");
    let loaded = load::controller_file(&controller).expect("readable");
    assert_eq!(loaded.program.as_ref().map(|program| &*program.name), Some("plant"));
    assert!(loaded.program.is_some(), "{:#?}", loaded.findings);
    let about = |code: &str| loaded.findings.iter().any(|finding| finding.code.name() == code);
    assert!(!about("retained-but-reset") && !about("retains-nothing"), "{:#?}", loaded.findings);
}

#[test]
fn the_library_contains_every_file_of_its_folder_and_reports_unknown_names() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("config/lib");
    let entries = std::fs::read_dir(folder).expect("the folder");
    // The folder also contains the folder of the library's tests.
    let files = entries.map(|entry| entry.expect("readable").path()).filter(|path| path.is_file());
    let names = files.map(|path| path.file_stem().expect("a name").to_owned());
    let mut names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    assert_eq!(names, LIBRARY);
    let error = load::ladder_files(&["lib:pdi".into()]).expect_err("it is unknown");
    assert_eq!(error.to_string(), "the library has no `pdi`: did you mean `pid`?");
}

fn shown(loaded: &load::Loaded) -> String {
    render(&loaded.findings, &loaded.files, Style::default())
}

#[test]
fn checking_a_ladder_without_its_library_names_the_right_command() {
    for plant in ["temperature-loop", "lift-station"] {
        let path = format!("config/programs/{plant}.toml");
        let loaded = load::ladder_files(&[path.clone().into()]).expect("readable");
        let shown = shown(&loaded);
        let commands: Vec<&str> =
            shown.split('`').filter(|t| t.starts_with("rungd check ")).collect();
        assert!(!commands.is_empty() && commands.len() == loaded.findings.len(), "{shown}");
        assert!(commands.iter().all(|command| *command == commands[0]), "{shown}");
        let files: Vec<PathBuf> = commands[0].split(' ').skip(2).map(PathBuf::from).collect();
        assert_eq!(files.last(), Some(&path.into()), "{shown}");
        let loaded = load::ladder_files(&files).expect("all are there");
        assert!(loaded.program.is_some() && loaded.findings.is_empty(), "{:#?}", loaded.findings);
    }
}

#[test]
fn a_library_file_in_place_of_a_template_is_reported_with_the_template_names() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("library's use");
    std::fs::create_dir_all(&folder).expect("a folder");
    let plant = folder.join("plant.toml");
    let text = "[[program]]\nname = \"Main\"\n[[program.rung]]\nuse = \"lib:pid\"\nname = \"p\"\n";
    std::fs::write(&plant, text).expect("writable");
    let said = |files: &[PathBuf]| {
        let loaded = load::ladder_files(files).expect("readable");
        assert_eq!(loaded.findings.len(), 1, "{:#?}", loaded.findings);
        shown(&loaded)
    };
    let help = said(std::slice::from_ref(&plant));
    assert!(help.contains("`use = \"Pid\"`"), "{help}");
    // The folder's name is quoted for the shell.
    assert!(
        help.contains("`rungd check lib:pid '/") && help.contains("library'\\''s use/"),
        "{help}"
    );
    let help = said(&["lib:pid".into(), plant]);
    assert!(help.contains("its template is `Pid`: `use = \"Pid\"`\n"), "{help}");
    assert!(!help.contains("rungd check"), "{help}");
}
