//! `rungd sim` as a user runs it: the real binary, its options, its traces, its refusals.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A counter of one input, and a word that may be written from outside.
const LADDER: &str = r#"[tags]
part  = { at = "X0" }
parts = { at = "CT0" }
size  = { at = "D0", initial = 2, min = 1, max = 9 }
full  = { at = "Y0" }

[[program]]
name = "Main"
rung = [
  { leg.up = ["part"], leg.rst = ["$Off"], do = ["CNT parts preset=size"] },
  { when = ["parts.Done"], do = ["OUT full"] },
]
"#;

const STIMULUS: &str = "scan,X0,size\n1,1,\n2,0,\n3,1,\n4,,3\n";

/// The same stimulus without the row of scan 4, for runs of four scans.
const WITHIN_FOUR_SCANS: &str = "scan,X0,size\n1,1,\n2,0,\n3,1,\n";

/// An R word that may be written from outside.
const REALS: &str = r#"[tags]
level = { at = "R0", initial = 1.5, min = -10, max = 99.5 }

[[program]]
name = "Main"
rung = [ { when = ["level >= 0.25"], do = ["MATH R1 = level * 1000000000.0", "MATH R2 = level / 1e9"] } ]
"#;

/// A folder of this test's own, with the ladder and the stimulus.
pub struct Place(PathBuf);

impl Place {
    pub fn new(test: &str) -> Place {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("sim_cli").join(test);
        std::fs::create_dir_all(&folder).unwrap();
        let place = Place(folder);
        place.write("count.toml", LADDER);
        place.write("parts.csv", STIMULUS);
        place
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap()
    }

    /// Runs `rungd sim` in the folder; `args` are separated by spaces.
    pub fn sim(&self, args: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
        command.current_dir(&self.0).arg("sim").args(args.split_whitespace());
        command.output().unwrap()
    }

    /// The trace on standard output of a run that prints nothing else.
    #[track_caller]
    pub fn trace(&self, args: &str) -> String {
        let output = self.sim(args);
        assert_eq!(text(&output.stderr), "");
        assert_eq!(output.status.code(), Some(0));
        text(&output.stdout)
    }

    /// Checks that the run is refused with this exit code and message, and without a trace.
    #[track_caller]
    pub fn refused(&self, args: &str, code: i32, said: &str) {
        let output = self.sim(args);
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{errors}");
        assert!(errors.contains(said), "{errors}");
        assert_eq!(text(&output.stdout), "");
    }
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The scans of a trace: the first cell of each row below the header.
pub fn scans(trace: &str) -> Vec<&str> {
    trace.lines().skip(1).filter_map(|line| line.split(',').next()).collect()
}

#[test]
fn every_operand_of_the_ladder_is_traced_without_watch() {
    let place = Place::new("default-watch");
    let trace = place.trace("count.toml --scans 1");
    expect_test::expect![[r#"
        scan,time_ms,part,$Off,parts.Acc,parts.Done,parts.Reset,parts.Zero,parts.DnDone,size,full
        0,0,0,0,0,0,0,1,0,2,0
    "#]]
    .assert_eq(&trace);
}

#[test]
fn the_first_elements_of_arrays_are_traced_without_watch() {
    let place = Place::new("default-arrays");
    let ladder = |count: u32| {
        format!(
            r#"[tags]
recipe = {{ at = "D10", count = 4 }}
long = {{ at = "D1000", count = {count} }}
step = {{ at = "V5" }}

[[program]]
name = "Main"
rung = [
  {{ when = ["$On"], do = ["MATH D0 = sum(recipe[1..2])", "MATH recipe[0] = 7"] }},
  {{ when = ["recipe[step] == 7"], do = ["FILL 0 to=C4..C5", "FILL 1 to=long"] }},
]
"#
        )
    };
    place.write("arrays.toml", &ladder(2));
    expect_test::expect![[r#"
        scan,time_ms,$On,D0,recipe[1],recipe[2],recipe[0],recipe[3],step,C4,C5,long[0],long[1]
        0,0,1,0,0,0,7,0,0,0,0,1,1
    "#]]
    .assert_eq(&place.trace("arrays.toml --scans 1"));
    place.write("arrays.toml", &ladder(65));
    let output = place.sim("arrays.toml --scans 1");
    let said = "note: of the 65 elements of `long` the trace has the first 64; `--watch` names ";
    assert_eq!(text(&output.stderr), format!("{said}others\n"));
    let header = text(&output.stdout).lines().next().map(str::to_owned).unwrap();
    assert!(header.ends_with(",long[62],long[63]"), "{header}");
}

#[test]
fn watch_selects_operands_and_their_order() {
    let place = Place::new("watch");
    let args = "count.toml --stimulus parts.csv --scans 6 --watch full,CT0.Acc,size,X0";
    expect_test::expect![[r#"
        scan,time_ms,full,CT0.Acc,size,X0
        0,0,0,0,2,0
        1,10,0,1,2,1
        2,20,0,1,2,0
        3,30,1,2,2,1
        4,40,0,2,3,1
        5,50,0,2,3,1
    "#]]
    .assert_eq(&place.trace(args));
    place.refused("count.toml --watch full,ful", 2, "--watch: ");
    place.refused("count.toml --watch full,ful", 2, "`ful`");
    place.refused("count.toml --watch Y9999", 2, "`Y9999`");
    place.refused("count.toml --watch X0..X3", 2, "a range is not taken here");
    place.refused("count.toml --watch N0", 2, "as `N0.DN`");
    place.refused("count.toml --watch N,3,6", 2, "write `N3.ACC`");
    place.refused("count.toml --watch N,99,1", 2, "`N,99,1` lies beyond memory: N0..N63");
    place.refused("count.toml --watch CT0", 2, "`CT0` is a structure: name its members");
}

#[test]
fn the_length_of_a_simulation_is_given_in_scans_or_time() {
    let place = Place::new("how-long");
    assert_eq!(scans(&place.trace("count.toml --watch X0")).len(), 100);
    assert_eq!(scans(&place.trace("count.toml --watch X0 --scans 3")), ["0", "1", "2"]);
    let timed = place.trace("count.toml --watch X0 --for 1s --period 250ms");
    let times: Vec<&str> = timed.lines().skip(1).filter_map(|l| l.split(',').nth(1)).collect();
    assert_eq!(times, ["0", "250", "500", "750"]);
    let begun = place.trace("count.toml --watch X0 --for 25ms");
    assert_eq!(scans(&begun), ["0", "1", "2"], "a period that was begun counts");
    assert_eq!(place.trace("count.toml --watch X0 --scans 0"), "scan,time_ms,X0\n");
    place.refused("count.toml --scans 3 --for 1s", 2, "cannot be used with");
    place.refused("count.toml --period 0ms", 2, "a period is at least 100us");
    place.refused("count.toml --for soon", 2, "`soon` is not a duration");
    place.refused("count.toml --for 1,5s", 2, "its numbers are whole: write 1s500ms");
    place.refused("count.toml --for 1,5", 2, "it lacks its unit: write 1s500ms or 1m30s");
    place.refused("count.toml --period 10", 2, "it lacks its unit: write 10ms or 10s");
    place.refused("count.toml --period 600h", 2, "the longest is 596h31m23s647ms");
    place.refused("", 2, "FILE.toml");
}

#[test]
fn reals_are_traced_and_stimulated_in_their_written_form() {
    let place = Place::new("reals");
    place.write("reals.toml", REALS);
    place.write("reals.csv", "scan,level\n1,0.1\n2,99.5\n3,7\n4,-0.0\n5,2.5e1\n");
    let args = "reals.toml --stimulus reals.csv --scans 6 --watch level,R1,R2";
    expect_test::expect![[r#"
        scan,time_ms,level,R1,R2
        0,0,1.5,1500000000.0,1.5e-9
        1,10,0.1,1500000000.0,1.5e-9
        2,20,99.5,99500000000.0,9.95e-8
        3,30,7.0,7000000000.0,7e-9
        4,40,0.0,7000000000.0,7e-9
        5,50,25.0,25000000000.0,2.5e-8
    "#]]
    .assert_eq(&place.trace(args));
    place.trace(&format!("{args} --trace reals.svg"));
    let svg = place.read("reals.svg");
    for number in ["1.5", "0.1", "99.5", "25.0", "99500000000.0", "9.95e-8"] {
        assert!(svg.contains(&format!(">{number}</text>")), "{number}: {svg}");
    }
    for (value, said) in [
        ("much", "s.csv:2: `level` is a real: it takes a number as 12.5, not `much`"),
        ("nan", "s.csv:2: `level` is a real: it takes a number as 12.5, not `nan`"),
        ("inf", "s.csv:2: `level` is a real: it takes a number as 12.5, not `inf`"),
        ("1e39", "s.csv:2: `level` takes -10.0 to 99.5, not 1e39"),
        ("99.6", "s.csv:2: `level` takes -10.0 to 99.5, not 99.6"),
        ("-11", "s.csv:2: `level` takes -10.0 to 99.5, not -11.0"),
    ] {
        place.write("s.csv", &format!("scan,level\n1,{value}\n"));
        place.refused("reals.toml --stimulus s.csv --scans 9", 78, said);
    }
    place.write("s.csv", "scan,D0\n1,1.5\n");
    place.refused("reals.toml --stimulus s.csv", 78, "`D0` is a word: it takes a whole number, as");
}

#[test]
fn a_real_is_printed_with_an_exponent_where_that_is_shorter() {
    let place = Place::new("exponents");
    place.write(
        "copy.toml",
        "[tags]\nset = { at = \"R0\", initial = 0.0 }\n[[program]]\nname = \"Main\"\n\
         rung = [ { when = [\"$On\"], do = [\"MOVE set to=R1\"] } ]\n",
    );
    let shown = [
        "0.0001",
        "9.9999e-5",
        "1e16",
        "9999999000000000.0",
        "3.4028235e38",
        "1e-45",
        "0.1",
        "16777216.0",
        "-1.5e-7",
        "3.0",
    ];
    let rows = shown.iter().enumerate().map(|(scan, real)| format!("{scan},{real}\n"));
    place.write("reals.csv", &format!("scan,R0\n{}", rows.collect::<String>()));
    let trace = place.trace("copy.toml --stimulus reals.csv --scans 10 --watch R1");
    let traced: Vec<&str> = trace.lines().skip(1).filter_map(|row| row.split(',').nth(2)).collect();
    assert_eq!(traced, shown);
}

#[test]
fn the_clock_of_a_simulation_starts_at_the_given_time() {
    let place = Place::new("clock");
    let args = "count.toml --period 1s --scans 2 --watch $Year,$Month,$Day,$Weekday,$Hour,$Second";
    expect_test::expect![[r#"
        scan,time_ms,$Year,$Month,$Day,$Weekday,$Hour,$Second
        0,0,2001,1,1,1,0,0
        1,1000,2001,1,1,1,0,1
    "#]]
    .assert_eq(&place.trace(args));
    expect_test::expect![[r#"
        scan,time_ms,$Year,$Month,$Day,$Weekday,$Hour,$Second
        0,0,2026,11,22,7,23,59
        1,1000,2026,11,23,1,0,0
    "#]]
    .assert_eq(&place.trace(&format!("{args} --clock 2026-11-22T23:59:59")));
    for wrong in ["noon", "2026-11-22", "2026-02-29T00:00:00", "2026-11-22T24:00:00"] {
        let said = format!("`{wrong}` is not a time of the calendar: write it as 2026-");
        place.refused(&format!("{args} --clock {wrong}"), 2, &said);
    }
    place.write("clock.csv", "scan,$Hour\n0,5\n");
    place.refused(&format!("{args} --stimulus clock.csv"), 78, "`$Hour` is read-only");
}

#[test]
fn the_stop_option_sets_last_scan_and_adds_a_row_after_the_stop() {
    let place = Place::new("stop");
    place.write("parts.csv", WITHIN_FOUR_SCANS);
    let args = "count.toml --stimulus parts.csv --scans 4 --watch $LastScan,full,CT0.Acc,CT0.Reset";
    expect_test::expect![[r#"
        scan,time_ms,$LastScan,full,CT0.Acc,CT0.Reset
        0,0,0,0,0,0
        1,10,0,0,1,0
        2,20,0,0,1,0
        3,30,1,1,2,0
        stop,30,1,0,0,1
    "#]]
    .assert_eq(&place.trace(&format!("{args} --stop")));
}

#[test]
fn the_stop_instruction_ends_the_simulation_one_scan_later() {
    let place = Place::new("stop-instruction");
    let rung = "{ when = [\"parts.Done\"], do = [\"OUT full\", \"STOP\"] }";
    let ladder = LADDER.replace("{ when = [\"parts.Done\"], do = [\"OUT full\"] }", rung);
    place.write("stops.toml", &ladder);
    let args = "stops.toml --stimulus parts.csv --scans 50 --watch full,$LastScan";
    let expected = "scan,time_ms,full,$LastScan\n0,0,0,0\n1,10,0,0\n2,20,0,0\n3,30,1,0\n\
                    4,40,0,1\nstop,40,0,1\n";
    assert_eq!(place.trace(args), expected);
    assert_eq!(place.trace(&format!("{args} --stop")), expected);
}

#[test]
fn rows_of_a_stimulus_after_the_last_scan_give_a_warning() {
    let place = Place::new("rows-left-out");
    let ladder = LADDER.replace("do = [\"OUT full\"]", "do = [\"OUT full\", \"STOP\"]");
    place.write("stops.toml", &ladder);
    place.write("late.csv", "scan,X0\n1,1\n2,0\n3,1\n5,0\n50,1\n");
    let warned = |args: &str, scan: &str, why: &str| {
        let output = place.sim(&format!("{args} --stimulus late.csv --watch full"));
        assert_eq!(output.status.code(), Some(0));
        let said = format!("warning: late.csv:{scan} is not executed: {why}\n");
        assert_eq!(text(&output.stderr), said, "{args}");
        text(&output.stdout).lines().count()
    };
    let of_five = "the simulation has 5 scans, from 0 on (2 rows are left out)";
    assert_eq!(warned("count.toml --scans 5", "5: scan 5", of_five), 6);
    assert_eq!(warned("count.toml --scans 5 --stop", "5: scan 5", of_five), 7);
    let of_ten = "the simulation has 10 scans, from 0 on (1 row is left out)";
    assert_eq!(warned("count.toml --for 100ms", "6: scan 50", of_ten), 11);
    // The rung of STOP is ON in scan 3, so scan 4 is the last one.
    let stopped = "a STOP instruction ended the simulation after scan 4 (2 rows are left out)";
    assert_eq!(warned("stops.toml --scans 60", "5: scan 5", stopped), 7);
    assert_eq!(warned("stops.toml --scans 60 --changes", "5: scan 5", stopped), 4);
    place.trace("count.toml --scans 51 --stimulus late.csv");
}

#[test]
fn a_trace_is_written_to_standard_output_or_a_file() {
    let place = Place::new("trace");
    let args = "count.toml --stimulus parts.csv --scans 5 --watch X0,CT0.Acc";
    let shown = place.trace(args);
    assert_eq!(place.trace(&format!("{args} --trace -")), shown);
    assert_eq!(place.trace(&format!("{args} --trace out.csv")), "");
    assert_eq!(place.read("out.csv"), shown);
    assert_eq!(place.trace(&format!("{args} --trace out.svg")), "");
    let svg = place.read("out.svg");
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    place.refused(&format!("{args} --trace no/such/folder.csv"), 74, "no/such/folder.csv");
}

#[test]
fn a_timing_diagram_shows_any_number_of_scans() {
    let place = Place::new("many-scans");
    let diagram = |scans: u32| {
        let scans = format!("count.toml --watch X0,$FirstScan,D0 --scans {scans} --trace many.svg");
        assert_eq!(place.trace(&scans), "");
        place.read("many.svg")
    };
    let exact = diagram(1_001);
    assert!(!exact.contains("each column is"));
    assert!(diagram(1_002).contains(">each column is 1 scan; "));
    let million = diagram(1_000_000);
    assert!(million.contains(">each column is 1024 scans; "));
    assert!(million.len() < exact.len(), "{}", million.len());
    assert!(million.starts_with("<svg ") && million.ends_with("</svg>\n"));
}

#[test]
fn a_trace_never_overwrites_an_input_file() {
    let place = Place::new("overwrite");
    let link = place.0.join("link.csv");
    let _ = std::fs::remove_file(&link);
    std::fs::hard_link(place.0.join("parts.csv"), link).unwrap();
    std::fs::copy(place.0.join("count.toml"), place.0.join("count.csv")).unwrap();
    for trace in ["parts.csv", "./parts.csv", "link.csv"] {
        let args = format!("count.toml --stimulus parts.csv --trace {trace}");
        place.refused(&args, 2, "would overwrite parts.csv");
        assert_eq!(place.read("parts.csv"), STIMULUS);
    }
    place.refused("count.csv --trace count.csv", 2, "would overwrite count.csv");
    assert_eq!(place.read("count.csv"), LADDER);
}

#[test]
fn an_unknown_trace_format_is_refused_before_anything_is_written() {
    let place = Place::new("vcd");
    let said = "--trace out.xyz: the ending must be `.csv`, `.svg` or `.vcd`";
    place.refused("count.toml --trace out.xyz", 2, said);
    assert!(!place.0.join("out.xyz").exists());
}

#[test]
fn a_wrong_stimulus_is_refused_with_its_row() {
    let place = Place::new("stimulus");
    let cases = [
        ("X0\n1,1\n", "s.csv:1: the header is `scan,` or `time,` and operands"),
        ("scan;X0\n1;1\n", "s.csv:1: cells are separated by `,`, not by `;`"),
        ("scan,X0\n1,1\n2,2\n", "s.csv:3: `X0` is a bit: it takes 0 or 1, not `2`"),
        ("scan,size\n\n5,10\n", "s.csv:3: `size` takes 1 to 9, not 10"),
        ("scan,size\n5,many\n", "s.csv:2: `size` is a word: it takes a whole number"),
        ("scan,X0\n5,1\n4,0\n", "s.csv:3: scan 4 comes after scan 5: rows ascend by scan"),
        ("scan,X0\n1,1,1\n", "s.csv:2: the row has 2 cells after the first"),
        ("scan,X0\nfirst,1\n", "s.csv:2: `first` is not a scan"),
        ("scan,CT0.Done\n1,1\n", "s.csv:1: `CT0.Done` is read-only: nothing outside can write it"),
        ("scan,$FirstScan\n1,1\n", "s.csv:1: `$FirstScan` is read-only"),
        ("scan,CT0\n1,1\n", "s.csv:1: `CT0` is a structure: name a member, as `CT0.Acc`"),
        ("scan,X0,part\n1,1,1\n", "s.csv:1: `part` and `X0` are the same operand"),
        ("scan,nothing\n1,1\n", "s.csv:1: "),
    ];
    for (stimulus, said) in cases {
        place.write("s.csv", stimulus);
        place.refused("count.toml --stimulus s.csv --scans 9", 78, said);
    }
    std::fs::write(place.0.join("s.csv"), b"scan,X0\n1,\xFF\n").unwrap();
    place.refused("count.toml --stimulus s.csv", 78, "s.csv: the file is not UTF-8 text");
    place.refused("count.toml --stimulus none.csv", 74, "none.csv: No such file");
}

#[test]
fn a_refused_stimulus_does_not_change_an_old_trace() {
    let place = Place::new("old-trace");
    place.write("out.csv", "old\n");
    place.write("s.csv", "scan,X0\n1,2\n");
    place.refused("count.toml --stimulus s.csv --trace out.csv", 78, "s.csv:2: ");
    place.refused("count.toml --watch nothing --trace out.csv", 2, "--watch");
    assert_eq!(place.read("out.csv"), "old\n");
}

#[test]
fn several_ladder_files_form_one_program() {
    let place = Place::new("several");
    place.write("parts.csv", WITHIN_FOUR_SCANS);
    place.write(
        "lamp.toml",
        "[[program]]\nname = \"Lamp\"\nautostart = true\n\
         rung = [ { when = [\"full\"], do = [\"OUT Y1\"] } ]\n",
    );
    let args = "--stimulus parts.csv --scans 4 --watch full,Y1";
    let expected = "scan,time_ms,full,Y1\n0,0,0,0\n1,10,0,0\n2,20,0,0\n3,30,1,1\n";
    assert_eq!(place.trace(&format!("count.toml lamp.toml {args}")), expected);
    // Programs execute in the order of the files: now `Lamp` comes first and reads the value of the
    // previous scan.
    assert_eq!(
        place.trace(&format!("lamp.toml count.toml {args}")),
        expected.replace("30,1,1", "30,1,0")
    );
    place.refused("lamp.toml --scans 1", 78, "`full`");
}

#[test]
fn equal_inputs_give_identical_traces() {
    let place = Place::new("same");
    let args = "count.toml --stimulus parts.csv --for 1s --stop";
    assert_eq!(place.trace(args), place.trace(args));
    for name in ["a.svg", "b.svg"] {
        place.trace(&format!("{args} --trace {name}"));
    }
    assert_eq!(place.read("a.svg"), place.read("b.svg"));
}

#[test]
fn findings_are_printed_to_standard_error_and_only_errors_refuse() {
    let place = Place::new("findings");
    place.write("warned.toml", &LADDER.replace("[tags]", "[tags]\njam = { at = \"C0\" }"));
    let output = place.sim("warned.toml --scans 1 --watch X0");
    assert_eq!(output.status.code(), Some(0));
    assert!(text(&output.stderr).contains("warning[unused-tag]"));
    assert_eq!(text(&output.stdout), "scan,time_ms,X0\n0,0,0\n");
    place.write("wrong.toml", &LADDER.replace("OUT full", "OUT X1"));
    place.refused("wrong.toml --scans 1 --trace wrong.csv", 78, "error[write-to-input]");
    assert!(!Path::new(&place.0.join("wrong.csv")).exists());
}

#[test]
fn a_controller_file_among_ladders_is_refused_with_the_files_to_give() {
    let place = Place::new("controller");
    place.write("plant.toml", "ladder = [\"lib:pid\", \"count.toml\"]\n");
    place.refused(
        "plant.toml count.toml --scans 1",
        78,
        "give the ladders that it names: `lib:pid count.toml`",
    );
}

#[test]
fn simulations_beyond_the_time_range_and_endless_files_are_refused() {
    let place = Place::new("bounds");
    for args in [
        "count.toml --scans 18446744073709551615",
        "count.toml --period 24h --scans 300000",
        "count.toml --stimulus /dev/zero",
    ] {
        let output = place.sim(args);
        let errors = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(78 | 74)), "{args}: {errors}");
        let why = ["longer than time", "it is a device"];
        assert!(why.iter().any(|why| errors.contains(why)), "{errors}");
        assert_eq!(text(&output.stdout), "");
    }
}

#[test]
fn a_field_device_is_ok_until_a_stimulus_changes_it() {
    let place = Place::new("device");
    let ladder = "[ladder]\ndevices = [\"line1\"]\n[[program]]\nname = \"Main\"\nrung = [\n\
                  { when = [\"line1.Ok\"], do = [\"OUT Y0\"] },\n\
                  { when = [\"line1.Stale\"], do = [\"OUT Y1\"] },\n]\n";
    place.write("line.toml", ladder);
    place.write("loss.csv", "scan,line1.Ok,line1.Stale\n2,0,\n3,,1\n5,1,0\n");
    let trace = place.trace("line.toml --scans 6 --stimulus loss.csv --watch Y0,Y1");
    let values = |row: &str| row.splitn(3, ',').nth(2).unwrap_or("").to_owned();
    let rows: Vec<String> = trace.lines().skip(1).map(values).collect();
    assert_eq!(rows, ["1,0", "1,0", "0,0", "0,1", "0,1", "1,0"]);
}
