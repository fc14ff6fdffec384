//! A controller with field devices from an operator's view: status, names, forces, reload. One of
//! two controllers is the other's remote I/O, through its Modbus server.

use rungd_test_support::running::live::Live;

const REMOTE: &str = r#"
[[program]]
name = "Main"
rung = [
  { when = ["MC1"], do = ["OUT MI1"] },
  { when = ["$On"], do = ["MOVE MHR1 to=MIR1"] },
]
"#;

const LADDER: &str = r#"
[ladder]
devices = ["line1"]
[tags]
lost = { at = "C0", alarm = "line1 is lost" }
[[program]]
name = "Main"
rung = [
  { when = ["$On"], do = ["OUT Y0", "MOVE 1234 to=D0"] },
  { when = ["line1.Stale"], do = ["OUT lost"] },
]
"#;

/// A controller as remote I/O, on a port that the system chooses.
fn remote() -> (Live, String) {
    let server = "[modbus-server]\nlisten = \"127.0.0.1:0\"\nwritable = [\"MC1\", \"MHR1\"]\n";
    let live = Live::start(REMOTE, server, &[]);
    let status = live.say("status --json").json();
    let address = status["devices"]["modbus"]["address"].as_str().expect("a server").to_owned();
    (live, address)
}

fn device(name: &str, address: &str) -> String {
    format!(
        "[[device]]\nname = \"{name}\"\ndriver = \"modbus-tcp\"\naddress = \"{address}\"\n\
         loss-after = \"300ms\"\non-loss = \"zero\"\nmap = [\n\
         {{ from = \"discrete 0\", to = \"X0\" }},\n{{ from = \"input 0\", to = \"D5\" }},\n\
         {{ from = \"Y0\", to = \"coil 0\" }},\n{{ from = \"D0\", to = \"holding 0\" }},\n]\n"
    )
}

#[test]
fn the_loss_and_return_of_a_device_show_in_status_memory_and_log() {
    let (remote_io, address) = remote();
    let live = Live::start(LADDER, &device("line1", &address), &[]);
    live.await_values("X0 D5 line1.Ok line1.Stale", "ON 1234 ON OFF");
    let status = live.ok("status");
    assert!(status.contains(&format!("line1 (modbus-tcp, {address}): ok")), "{status}");
    remote_io.signal("KILL");
    live.await_values("X0 D5 line1.Ok line1.Stale C0", "OFF 0 OFF ON ON");
    assert!(
        live.ok("status").contains("line1 (modbus-tcp, ") && live.ok("status").contains("STALE")
    );
    let lost = live.line("line1 is lost: ");
    assert_eq!((&lost["event"], &lost["level"]), (&"device-lost".into(), &"WARN".into()));
    let device = &live.say("status --json").json()["devices"]["field"][0];
    assert!(device["trouble"].is_string() && device["stale"] == true, "{device}");
}

#[test]
fn the_status_bits_of_a_device_can_be_forced_but_not_written() {
    let live = Live::start(LADDER, &device("line1", "127.0.0.1:9"), &[]);
    live.await_values("line1.Ok line1.Stale C0", "OFF ON ON");
    let refused = live.say("write line1.Ok on");
    assert_eq!(refused.code, 2, "{refused:?}");
    let written = live.say("write X0 on");
    assert!(written.err.contains("device line1 moves `X0`"), "{written:?}");
    let written = live.say("write D5 7");
    assert!(written.err.contains("device line1 moves `D5`"), "{written:?}");
    live.ok("force line1.Stale off");
    live.await_values("line1.Stale C0", "OFF OFF");
    let ladder = std::fs::read_to_string(live.folder.join("ladder.toml")).unwrap();
    std::fs::write(live.folder.join("ladder.toml"), ladder.replace("1234", "1235")).unwrap();
    live.ok("reload");
    live.await_values("D0 line1.Stale C0", "1235 OFF OFF");
    assert!(live.ok("status").contains("line1.Stale"), "the force survives the reload");
    live.ok("unforce line1.Stale");
    live.await_values("line1.Stale C0", "ON ON");
}

#[test]
fn a_reload_names_the_device_settings_that_need_a_restart() {
    let live = Live::start(LADDER, &device("line1", "127.0.0.1:9"), &[]);
    live.await_values("Y0", "ON");
    let path = live.folder.join("controller.toml");
    let controller = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, controller.replace("300ms", "400ms")).unwrap();
    let said = live.ok("reload");
    assert!(said.contains("needs a restart: `[[device]]`"), "{said}");
    // A comment at the top moves every position in the file, but changes no setting.
    std::fs::write(&path, format!("# the press\n{controller}")).unwrap();
    let said = live.ok("reload");
    assert!(!said.contains("needs a restart"), "{said}");
    let second = device("line2", "127.0.0.1:9").replace("X0", "X1").replace("D5", "D6");
    let second =
        second.replace("Y0", "Y1").replace("coil 0", "coil 9").replace("holding 0", "holding 9");
    std::fs::write(&path, format!("{controller}{second}")).unwrap();
    let said = live.say("reload");
    assert_eq!(said.code, 78, "{said:?}");
    live.line("its devices, or their order, differ from the running ones");
    live.await_values("Y0 line1.Stale", "ON ON");
}

/// A reload keeps a device's wiring, so it must not give the wired cell to a different element.
#[test]
fn a_reload_that_would_wire_a_device_to_another_element_is_refused() {
    let ladder = "[ladder]\ndevices = [\"line1\"]\n[[program]]\nname = \"Main\"\n\
                  [[program.stage]]\nname = \"Wait\"\nrung = [ { when = [\"X0\"], do = [\"JMP \
                  Open\"] } ]\n[[program.stage]]\nname = \"Open\"\nrung = [ { when = [\"$On\"], do \
                  = [\"OUT Y0\", \"MOVE 1 to=D0\"] } ]\n";
    let controller = format!("{}[memory]\nD = 8\n", device("line1", "127.0.0.1:9"));
    let controller = controller.replace("\"Y0\"", "\"Main.Open\"");
    let live = Live::start(ladder, &controller, &[]);
    live.await_values("Main.Wait", "ON");
    let write = |ladder: &str| std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
    let refused = |ladder: &str, why: &str| {
        write(ladder);
        for words in ["reload --dry-run", "reload"] {
            let said = live.say(words);
            assert_eq!(said.code, 78, "{said:?}");
            assert!(said.err.contains(why), "{said:?}");
        }
    };
    let stage =
        "[[program.stage]]\nname = \"New\"\nrung = [ { when = [\"$On\"], do = [\"OUT Y1\"] } ]\n";
    let before = ladder.replacen("[[program.stage]]", &format!("{stage}[[program.stage]]"), 1);
    refused(
        &before,
        "device `line1` is wired to `Main.Open` until a restart, and this program moves",
    );
    let gone = ladder.replace("Open", "Closed");
    let controller_file = live.folder.join("controller.toml");
    let controller = std::fs::read_to_string(&controller_file).unwrap();
    std::fs::write(&controller_file, controller.replace("Main.Open", "Main.Closed")).unwrap();
    refused(&gone, "wired to `Main.Open` until a restart, and this program does not have it");

    // D5 is free in the files, but not before a restart.
    let free = controller.replace("\"D5\"", "\"D6\"");
    std::fs::write(&controller_file, &free).unwrap();
    let typed = ladder.replace(
        "[[program]]",
        "[tags]\nsize = { type = \"int\" }\nmore = { type = \
                                \"int\" }\n[[program]]",
    );
    let typed = typed.replace("MOVE 1 to=D0", "MOVE 1 to=D7\", \"MOVE more to=size");
    refused(&typed, "device `line1` is wired to D5 until a restart, and this program would place");

    // A stage behind the wired one leaves its cell where it is.
    std::fs::write(&controller_file, &controller).unwrap();
    write(&format!("{ladder}{stage}"));
    live.ok("reload");
    live.await_values("Main.Wait Main.New", "ON OFF");
}

/// A tag with a `type` may be wired as long as reloads leave it in its place.
#[test]
fn a_reload_that_moves_a_wired_tag_with_a_type_is_refused() {
    let record = "[[record]]\nname = \"Step\"\nfields = { kind = { type = \"int\" }, target = { type = \
                  \"int\" } }\n";
    let ladder = format!(
        "[ladder]\ndevices = [\"line1\"]\n{record}[tags]\nrecipe = {{ type = \"Step\", count = 2 }}\n\
         [[program]]\nname = \"Main\"\nrung = [ {{ when = [\"recipe[1].target > 3\"], do = [\"OUT Y0\", \
         \"MOVE 1 to=recipe[0].kind\"] }} ]\n"
    );
    let controller = device("line1", "127.0.0.1:9").replace("\"D5\"", "\"recipe[1].target\"");
    let live = Live::start(&ladder, &controller, &[]);
    live.await_values("Y0", "OFF");
    let write = |ladder: &str| std::fs::write(live.folder.join("ladder.toml"), ladder).unwrap();
    write(
        &ladder.replace("> 3", "> 4").replace("count = 2 }", "count = 2 }\nz = { type = \"int\" }"),
    );
    live.ok("reload");
    for moved in [
        // An earlier name takes its place; a longer array moves what is behind it.
        ladder.replace("[tags]", "[tags]\na = { type = \"int\" }").replace("MOVE 1", "MOVE a"),
        ladder.replace("count = 2", "count = 3"),
        ladder.replace("recipe", "menu"),
    ] {
        write(&moved);
        if moved.contains("menu") {
            let file = live.folder.join("controller.toml");
            let text = std::fs::read_to_string(&file).unwrap().replace("recipe", "menu");
            std::fs::write(&file, text).unwrap();
        }
        for words in ["reload --dry-run", "reload"] {
            let said = live.say(words);
            assert_eq!(said.code, 78, "{said:?}");
            let why = "wired to the place of `recipe[1].target` until a restart, and this program \
                       moves that tag";
            assert!(said.err.contains(why), "{said:?}");
        }
    }
}
