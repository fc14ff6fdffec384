//! `rungd check --addresses`: the places of the tags with a `type`, and the addresses that these
//! places avoid.

use std::path::PathBuf;
use std::process::Command;

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("addresses").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Compares the list for the first file with the expected one.
#[track_caller]
fn check(name: &str, files: &[(&str, &str)], expected: &str) {
    let folder = folder(name);
    for (name, text) in files {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let output = Command::new(env!("CARGO_BIN_EXE_rungd"))
        .args(["check", "--addresses"])
        .arg(folder.join(files[0].0))
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{errors}");
    assert_eq!(output.status.code(), Some(0), "{errors}");
}

const TYPES: &str = r#"
[tags]
b = { type = "int", spare = true }
"a" = { type = "int", spare = true }
B = { type = "int", spare = true }
hours = { type = "timer", spare = true }
parts = { type = "counter", spare = true }
drum = { type = "sensaphone", spare = true }
lamp = { type = "bit", spare = true }
level = { type = "real", spare = true }
code = { type = "word", spare = true }
[[program]]
name = "Main"
"#;

#[test]
fn tags_are_placed_in_byte_order_from_the_top_of_their_space() {
    check(
        "types",
        &[("ladder.toml", TYPES)],
        "B      int         D4095\na      int         D4094\nb      int         D4093\n\
         code   word        V4095\ndrum   sensaphone  N63\nhours  timer       T255\n\
         lamp   bit         C2047\nlevel  real        R1023\nparts  counter     CT255\n",
    );
}

#[test]
fn tags_are_not_placed_on_addresses_of_the_ladder() {
    let rungs = r#"
rung = [
  { when = ["D4095 > 3 | !(T255.Done)"], do = ["MATH D4092 = D4090 + D4089", "RSTCT CT255"] },
  { leg.up = ["C2047"], leg.rst = ["C2046"], do = ["CNT CT255 preset=V4095"] },
  { when = ["X0"], do = ["TMR T255 preset=N,63,6"], branch = [
    { when = ["N62.DN"], do = ["MOVE 1 to=R1023"] } ] },
]
"#;
    check(
        "ladder",
        &[("ladder.toml", &format!("{TYPES}{rungs}"))],
        "B      int         D4094\na      int         D4093\nb      int         D4091\n\
         code   word        V4094\ndrum   sensaphone  N61\nhours  timer       T254\n\
         lamp   bit         C2045\nlevel  real        R1022\nparts  counter     CT254\n",
    );
}

#[test]
fn tags_are_not_placed_on_addresses_of_the_controller_file() {
    let controller = r#"
ladder = ["ladder.toml"]
[retain]
ranges = ["low..high", "D4091", "CT250..CT255"]
[modbus-server]
writable = ["V4000..V4001"]
map = [
  { operand = "T254.Acc..T255.Acc", table = "input", address = 3000 },
  { operand = "V4000..V4095", table = "holding", address = 4000 },
]
[[simulated-device]]
input = "X0"
follows = "C2047"
after = "1s"
[[device]]
name = "plant"
driver = "simulated"
part = [{ kind = "motor", name = "drive" }]
map = [{ from = "C2046", to = "drive.run" }, { from = "drive.running", to = "C2045" }]
"#;
    let ladder = TYPES.replace(
        "[tags]",
        "[tags]\nlow = { at = \"D4093\" }\nhigh = { at = \"D4094\", spare = true }",
    );
    let rung = "rung = [{ when = [\"low == 3\"], do = [\"OUT C2046\"] }]\n";
    check(
        "controller",
        &[("controller.toml", controller), ("ladder.toml", &format!("{ladder}{rung}"))],
        "B      int         D4095\na      int         D4092\nb      int         D4090\n\
         code   word        V3999\ndrum   sensaphone  N63\nhours  timer       T253\n\
         lamp   bit         C2044\nlevel  real        R1023\nparts  counter     CT249\n",
    );
}

/// A simulation of a ladder with tags that have a `type`: its exit code, trace and errors.
fn sim(name: &str, more: &[&str]) -> (Option<i32>, String, String) {
    let ladder = folder("sim").join(format!("{name}.toml"));
    let text = r#"
[tags]
parts = { type = "counter" }
size = { type = "int", initial = 3, max = 9 }
lamp = { type = "bit" }
[[program]]
name = "Main"
rung = [
  { leg.up = ["X0"], leg.rst = ["$Off"], do = ["CNT parts preset=size"] },
  { when = ["parts.Done"], do = ["OUT lamp"] },
]
"#;
    std::fs::write(&ladder, text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = command.arg("sim").arg(&ladder).args(more).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_trace_names_placed_tags_and_refuses_their_addresses() {
    let (code, trace, errors) = sim("all", &["--scans", "1"]);
    assert_eq!(code, Some(0), "{errors}");
    let header = trace.lines().next().unwrap();
    assert!(header.starts_with("scan,time_ms,X0,$Off,parts.Acc,parts.Done,"), "{header}");
    assert!(!header.contains("CT255") && header.ends_with(",size,lamp"), "{header}");
    for (address, name) in [("D4095", "size"), ("CT255.Acc", "parts.Acc"), ("C2047", "lamp")] {
        let (code, _, errors) = sim("watch", &["--watch", address]);
        assert_eq!(code, Some(2), "{errors}");
        assert!(errors.contains(&format!("write `{name}`")), "{errors}");
    }
}

#[test]
fn a_stimulus_accepts_placed_tags_and_refuses_their_addresses() {
    let stimulus = folder("sim").join("stimulus.csv");
    let path = stimulus.display().to_string();
    let of = |text: &str| {
        std::fs::write(&stimulus, text).unwrap();
        sim("stimulus", &["--scans", "2", "--stimulus", &path, "--watch", "size,parts.Acc"])
    };
    let (_, trace, errors) = of("scan,size,parts.Acc\n1,8,5\n");
    assert!(trace.ends_with("0,0,3,0\n1,10,8,5\n"), "{trace}{errors}");
    let (code, _, errors) = of("scan,D4095\n1,8\n");
    assert_ne!(code, Some(0));
    assert!(errors.contains("`D4095` is the place of `size`"), "{errors}");
    let (_, _, errors) = of("scan,size\n1,10\n");
    assert!(errors.contains("`size` takes -2147483648 to 9, not 10"), "{errors}");
}
