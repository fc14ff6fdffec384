//! One change from many writes, with the real binary at both ends of the socket: on the command line
//! and from a file, written whole or not at all, logged and recorded as one; files of values that
//! can be written back; hostile clients and files.

use std::fs;
use std::path::PathBuf;

use rungd_test_support::running::live::{Live, Said, ask, said};
use serde_json::{Value, json};

const LADDER: &str = r#"
[ladder]
name = "sets"
[tags]
jam    = { at = "C0", doc = "Bottles jammed" }
lamp   = { at = "Y0" }
parts  = { at = "CT0" }
size   = { at = "D1", initial = 12, min = 1, max = 500, unit = "mm" }
again  = { at = "D1" }
eye    = { at = "X0" }
level  = { type = "real", initial = 0.1, min = -5.5, max = 99.5, unit = "m" }
huge   = { type = "real", initial = 1e30 }
recipe = { type = "int", count = 4, initial = [1, 2, 3, 4], max = 900 }
curve  = { type = "real", count = 3, initial = 0.3 }
marks  = { type = "bit", count = 3 }
modbus = { at = "MHR3", initial = 65535 }
wide   = { type = "int", initial = -2147483648 }
wait   = { type = "timer" }
five   = { value = 5 }
[[template]]
name = "Limit"
[template.parameters]
out = { type = "output" }
[template.tags]
limit = { type = "int", initial = 3, max = 10 }
[[template.rung]]
when = ["limit > 4"]
do   = ["OUT out"]
[[program]]
name = "Main"
rung = [
  { leg.up = ["eye"], leg.rst = ["$Off"], do = ["CNT parts preset=size"] },
  { when = ["jam", "again > five"], do = ["OUT lamp"] },
  { when = ["level > 1.0", "huge > 1.0", "curve[0] > 1.0", "marks[0]"], do = ["TMR wait preset=1s"] },
  { when = ["recipe[0] > 1", "modbus > 1", "wide > 1"], do = ["OUT C8"] },
  { when = ["size == recipe[0]"], do = ["OUT C6"] },
  { when = ["$On"], do = ["OUT C7"] },
  { use = "Limit", name = "p1", with = { out = "Y3" } },
]
"#;

fn live() -> Live {
    Live::scanning(LADDER)
}

/// A file in the controller's folder.
fn file(live: &Live, text: &str) -> PathBuf {
    let path = live.folder.join("set.toml");
    fs::write(&path, text).unwrap();
    path
}

fn write_file(live: &Live, text: &str) -> Said {
    let path = file(live, text);
    live.say(&format!("write --file {}", path.display()))
}

#[test]
fn several_writes_are_one_change_of_one_scan_with_one_line_in_the_log() {
    let live = live();
    assert_eq!(
        live.ok("write size=24 jam=ON recipe[1]=7 level=-2.5e-1 D9=1m30s"),
        "\
size (D1): 24, was 12
jam (C0): ON, was OFF
recipe[1]: 7, was 2
level: -0.25, was 0.1
D9: 90000, was 0
"
    );
    let line = live.line("wrote in one change");
    let field = |name: &str| line[name].as_str().unwrap_or_default().to_owned();
    assert_eq!((field("event"), field("level")), ("operator-write".into(), "INFO".into()));
    assert_eq!(field("what"), "size, jam, recipe[1], level, D9");
    assert_eq!(field("address"), "D1, C0, recipe[1], level, D9");
    assert_eq!(field("before"), "12, OFF, 2, 0.1, 0");
    assert!(field("after") == "24, ON, 7, -0.25, 90000", "{line}");
    assert!(field("message").contains("24 to size (D1) (it was 12, and is 24), ON to jam"));
    let json = live.say("write size=30 --json").json();
    assert_eq!(json["changes"][0]["before"], 24);
    assert_eq!(live.line("wrote 30 to size")["what"], "size", "one write has the line of one");
    assert_eq!(live.ok("write size 31"), "size (D1): 31, was 30\n", "the old form");
    // The scan that sees one of the writes sees the other: the coil never comes ON.
    for number in 100..130 {
        live.ok(&format!("write size={} recipe[0]={number}", number + 1));
        live.ok(&format!("write size={} recipe[0]={}", number + 3, number + 2));
        assert_eq!(live.ok("read C6"), "C6  C6  OFF\n");
    }
}

#[test]
fn a_change_is_refused_whole_and_every_mistake_is_named() {
    let live = live();
    live.ok("force jam off");
    let said = live.say("write size=501 recipe[1]=9 jam=ON siez=1 lamp=2 again=4 p1.limit=11");
    assert_eq!((said.code, said.out.as_str()), (2, ""), "{said:?}");
    for words in [
        "rungd: nothing is written:\n  `size` takes 1 to 500, not 501\n",
        "  `jam` is forced to OFF, and a write to it is discarded: unforce it first\n",
        "did you mean `size`",
        "  `lamp` is a bit: it takes ON or OFF\n",
        "  `p1.limit` takes -2147483648 to 10, not 11\n",
    ] {
        assert!(said.err.contains(words), "{words}: {said:?}");
    }
    assert!(live.ok("read size").ends_with("  12 mm\n"), "nothing is written");
    assert!(live.ok("read recipe[1]").ends_with("  2\n"), "nothing is written");
    assert_eq!(live.say("write jam=ON size=4").code, 1, "the present state alone refuses it");
    let json = live.say("write --json size=501 jam=ON").json();
    assert_eq!(json["error"]["kind"], "bad-value");
    assert_eq!(json["error"]["mistakes"][1]["operand"], "jam");
    assert_eq!(json["error"]["mistakes"][1]["kind"], "refused");
    for (words, message) in [
        ("write size=1 size=2", "`size` is named twice: name it once"),
        ("write size=1 again=2", "`size` and `again` are the same place: name one of them"),
        ("write D1=1 size=2", "`D1` and `size` are the same place"),
        ("write size=1 jam", "`jam` is no OPERAND=VALUE"),
        ("write size", "`size` is no OPERAND=VALUE"),
        ("write =5", "`=5` is no OPERAND=VALUE"),
        ("write", "name what to write"),
        ("write recipe=1 size=2", "`recipe` is an array"),
        ("write parts=1", "`parts` is a structure: name a member"),
        ("write $FirstScan=ON size=1", "it shows the state of the controller"),
        ("write --file a.toml size 1", "cannot be used with"),
    ] {
        let said = live.say(words);
        assert!(said.code == 2 && said.err.contains(message), "{words}: {said:?}");
    }
    live.ok("unforce --all");
    live.ok("mode stop");
    let said = live.say("write size=5 lamp=ON");
    assert!(said.code == 1 && said.err.contains("the controller is in STOP"), "{said:?}");
}

#[test]
fn a_file_of_values_can_be_written_back_whatever_the_ladder_has() {
    let live = live();
    live.ok("write level=99.5 huge=3.4028235e38 curve[1]=1e-45 marks[2]=ON p1.limit=10");
    let path = live.folder.join("set.toml");
    let before = live.say(&format!("read --file {}", path.display()));
    assert_eq!(before.code, 0, "{before:?}");
    assert!(before.out.ends_with("set.toml: 19 values\n"), "{before:?}");
    assert!(before.err.contains("left out: 2 structures, 0 places"), "{before:?}");
    let text = fs::read_to_string(&path).unwrap();
    let (head, rest) = text.split_once('\n').unwrap();
    assert!(head.starts_with("# Values after scan "), "{head}");
    assert_eq!(
        rest,
        "\
jam = false
lamp = false
size = 12  # mm
eye = false
level = 99.5  # m
huge = 3.4028235e38
recipe = [1, 2, 3, 4]
curve = [0.3, 1e-45, 0.3]
marks = [false, false, true]
modbus = 65535
wide = -2147483648
\"p1.limit\" = 10
"
    );
    let again = live.say(&format!("read --file {}", path.display()));
    assert!(again.code != 0 && again.err.contains("is there already: name another file"));
    live.ok("write level=1 huge=2 recipe[3]=9 curve[1]=5 marks[2]=OFF wide=0 p1.limit=1 size=500");
    let written = live.ok(&format!("write --file {}", path.display()));
    assert_eq!(written.lines().count(), 19, "{written}");
    assert!(written.contains("curve[1]: 1e-45, was 5.0\n"), "{written}");
    fs::remove_file(&path).unwrap();
    live.ok(&format!("read --file {}", path.display()));
    let second = fs::read_to_string(&path).unwrap();
    assert_eq!(second.split_once('\n').unwrap().1, rest, "the same values");
    // Operands that are named: a structure's member only by itself, a slice, a use.
    let part = live.say("read --file - recipe[1..2] p1 parts.Acc wait D1 again $FirstScan");
    let (_, part_text) = part.out.split_once('\n').unwrap();
    assert_eq!(
        part_text,
        "\"recipe[1]\" = 2\n\"recipe[2]\" = 3\n\"p1.limit\" = 10\n\"parts.Acc\" = 0\nsize = 12  # mm\n"
    );
    assert!(part.err.contains("left out: 1 structures, 1 places"), "{part:?}");
    let said = write_file(&live, &part.out);
    assert!(said.code == 0 && said.out.lines().count() == 5, "{said:?}");
}

/// A ladder with records, and with tags that are bits of words.
const RECORDS: &str = r#"
[[record]]
name = "Step"
[record.fields]
kind   = { type = "int", min = 0, max = 5 }
target = { type = "real", initial = 2.5 }
on     = { type = "bit" }
over   = { type = "timer" }
[tags]
fault   = { at = "status.3" }
recipe  = { type = "Step", count = 3, initial = [{ kind = 1, target = 20.0 }, { kind = 2 }] }
current = { type = "Step" }
status  = { type = "word", initial = 9 }
[[template]]
name = "Lamp"
parameters = { out = { type = "output" } }
tags = { mine = { type = "Step" } }
rung = [ { when = ["mine.on", "mine.kind > 1", "mine.target > 1.0"], do = ["OUT out", "TMR mine.over preset=1s"] } ]
[[program]]
name = "Main"
rung = [
  { when = ["recipe[D0].on", "recipe[D0].kind > 1", "recipe[D0].target > 1.0", "fault"], do = ["TMR recipe[0].over preset=1s", "OUT Y0"] },
  { when = ["current.on", "current.kind > 1", "current.target > 1.0", "status > 1"], do = ["TMR current.over preset=1s"] },
  { use = "Lamp", name = "p1", with = { out = "Y1" } },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

#[test]
fn a_file_of_records_has_a_table_for_each_record() {
    let live = Live::scanning(RECORDS);
    let path = live.folder.join("set.toml");
    let read = live.say(&format!("read --file {}", path.display()));
    assert!(read.err.contains("left out: 5 structures, 0 places"), "{read:?}");
    let text = fs::read_to_string(&path).unwrap();
    let expected = "\
recipe = [
    { kind = 1, target = 20.0, on = false },
    { kind = 2, target = 2.5, on = false },
    { kind = 0, target = 2.5, on = false },
]
current = { kind = 0, target = 2.5, on = false }
status = 9
\"p1.mine\" = { kind = 0, target = 2.5, on = false }
";
    assert_eq!(
        text.split_once('\n').unwrap().1,
        expected,
        "a bit of `status` is in it by its word"
    );
    live.ok("write recipe[2].kind=4 current.on=ON p1.mine.target=7.5 status=0");
    assert_eq!(live.ok(&format!("write --file {}", path.display())).lines().count(), 16);
    let part = live.say("read --file - recipe[1] current.kind fault");
    let rest = part.out.split_once('\n').unwrap().1;
    let one = "\"recipe[1]\" = { kind = 2, target = 2.5, on = false }\n";
    assert_eq!(rest, format!("{one}current = {{ kind = 0 }}\nfault = true\n"));
    let text = "recipe = [{ kind = 3 }, { target = 7.0, on = true }]\ncurrent = { kind = 5 }\n\
                p1.mine.on = true\n";
    assert_eq!(
        write_file(&live, text).out,
        "recipe[0].kind: 3, was 1\nrecipe[1].target: 7.0, was 2.5\nrecipe[1].on: ON, was OFF\n\
         current.kind: 5, was 0\np1.mine.on: ON, was OFF\n"
    );
    let said = write_file(
        &live,
        "recipe = [\n  { kind = 6 },\n  { target = 1.0, kin = 1 },\n  { over = 3 },\n\
         { kind = 1 } ]\ncurrent = [ { kind = 1 } ]\nlost = { kind = 1 }\n",
    );
    assert_eq!((said.code, said.out.as_str()), (2, ""), "{said:?}");
    for words in [
        "set.toml:2: `recipe[0].kind` takes 0 to 5, not 6\n",
        "set.toml:3: record `Step` has no field `kin` (did you mean `recipe[1].kind`?)\n",
        "set.toml:4: `recipe[2].over` is a structure",
        "set.toml:5: `recipe.kind` has the elements 0 to 2, not 3",
        "set.toml:6: `current` is one record: it has no index (write `current.kind`)\n",
        "set.toml:7: nothing is called `lost`",
    ] {
        assert!(said.err.contains(words), "{words}: {said:?}");
    }
    assert!(live.ok("read recipe[1].target").ends_with("  7.0\n"), "nothing is written");
}

#[test]
fn a_word_and_a_bit_of_it_are_refused_in_one_change() {
    let live = Live::scanning(RECORDS);
    for (words, message) in [
        (
            "write status=1 status.2=ON",
            "`status.2` is a bit of `status`: write the word, or only bits of it",
        ),
        ("write status.2=ON status=1", "`status.2` is a bit of `status`"),
        ("write status.0=ON status.2=ON fault=OFF status=1", "`status.0` is a bit of `status`"),
        ("write status=1 fault=ON", "`fault` is a bit of `status`"),
        ("write fault=ON status.3=ON", "`fault` and `status.3` are the same place"),
    ] {
        let said = live.say(words);
        assert!(said.code == 2 && said.err.contains(message), "{words}: {said:?}");
    }
    let said = write_file(&live, "fault = true\nstatus = 4\n");
    assert!(said.err.contains("set.toml:2: `fault` is a bit of `status`"), "{said:?}");
    assert_eq!(live.ok("write status.1=ON status.0=OFF").lines().count(), 2);
    assert!(live.ok("read status").ends_with("  10\n"));
}

#[test]
fn a_refused_file_shows_the_place_of_each_mistake() {
    let live = live();
    let said = write_file(&live, "size = 501\nrecipe = [1, 901,\n 3, 4, 5]\nsiez = true\n");
    assert_eq!((said.code, said.out.as_str()), (2, ""), "{said:?}");
    for words in [
        "set.toml:1: `size` takes 1 to 500, not 501\n",
        "set.toml:2: `recipe[1]` takes -2147483648 to 900, not 901\n",
        "set.toml:3: `recipe` has the elements 0 to 3, not 4",
        "set.toml:4: ",
    ] {
        assert!(said.err.contains(words), "{words}: {said:?}");
    }
    for (text, code, words) in [
        ("size = nan\nlamp = []", 78, "2 errors"),
        ("size = ", 78, "set.toml:1:"),
        ("not a table", 78, "rungd: nothing is written"),
        ("# nothing\n", 78, "has no values"),
        ("a.b.c.d = [[[{ e = 1 }]]]", 2, "set.toml:1: nothing is called `a`"),
        ("\"size\\n  jam: all is well\" = 1", 2, "nothing is written:\n"),
        ("\"size\" = 1\n\"D1\" = 2", 2, "set.toml:2: `size` and `D1` are the same place"),
    ] {
        let said = write_file(&live, text);
        assert!(said.code == code && said.err.contains(words), "{text}: {said:?}");
        assert!(!said.err.contains("\n  jam: all"), "{said:?}");
    }
    fs::write(live.folder.join("set.toml"), [0xff, 0xfe, b'a']).unwrap();
    let path = live.folder.join("set.toml");
    let said = live.say(&format!("write --file {}", path.display()));
    assert!(said.code == 74 && said.err.contains("not a text in UTF-8"), "{said:?}");
    fs::remove_file(&path).unwrap();
    rustix::fs::mkfifoat(rustix::fs::CWD, &path, rustix::fs::Mode::RWXU).unwrap();
    for words in ["write", "read"] {
        let said = live.say(&format!("{words} --file {}", path.display()));
        assert!(said.code != 0 && said.err.contains("set.toml"), "{said:?}");
    }
    assert_eq!(live.say("write --file none.toml").code, 74);
    assert_eq!(live.say(&format!("write --file {}", live.folder.display())).code, 74);
    let mut piped = live.command("write --file -");
    piped.stdin(fs::File::open(file_for_pipe(&live)).unwrap());
    assert_eq!(said_of(&mut piped).out, "size (D1): 77, was 12\n");
}

fn file_for_pipe(live: &Live) -> PathBuf {
    let path = live.folder.join("piped.toml");
    fs::write(&path, "size = 77").unwrap();
    path
}

fn said_of(command: &mut std::process::Command) -> Said {
    said(command)
}

#[test]
fn a_change_is_recorded_and_explained_as_one() {
    let live = live();
    live.ok("write recipe[0]=77 size=77");
    live.await_values("C6", "ON");
    let why = live.ok("why recipe[0]");
    assert!(why.contains("wrote") && why.contains("77"), "{why}");
    let recording = live.folder.join("cut.rec");
    live.ok(&format!("record cut -o {}", recording.display()));
    let verified = live.ok(&format!("record verify {}", recording.display()));
    assert!(verified.contains("hashes are equal"), "{verified}");
    let test = live.ok(&format!("record test {}", recording.display()));
    let steps = "    \"set recipe[0] 77\",\n    \"set size 77\",\n    \"run ";
    assert!(test.contains(steps), "before one scan: {test}");
}

#[test]
fn hostile_changes_are_refused_and_the_next_client_is_served() {
    let live = live();
    let mut stream = live.connect();
    let set = |writes: Value| json!({"do": "write-set", "writes": writes}).to_string();
    let write = |operand: &str, value: Value| json!({"operand": operand, "value": value});
    for (line, kind, words) in [
        (set(json!([])), "bad-request", "1 to 4096 operands"),
        (set(json!({"size": 1})), "bad-request", "not a request"),
        (set(json!([write("size", json!([1]))])), "bad-request", "a value is true or false"),
        (set(json!([{"operand": "size"}])), "bad-request", "missing field"),
        (set(json!([{"operand": "size", "value": 1, "to": 2}])), "bad-request", "unknown field"),
        (set(json!([write("size", json!(1e300))])), "bad-value", "`size` is a word"),
        (set(json!([write("level", json!(1e300))])), "bad-value", "`level` takes -5.5 to 99.5"),
        (set(json!([write("size", json!("NaN"))])), "bad-value", "takes a whole number"),
        (set(json!(vec![write("size", json!(1)); 4097])), "bad-request", "this one has 4097"),
        (set(json!(vec![write("size", json!(1)); 4096])), "bad-operand", "more than these 100"),
        (set(json!(vec![write("no such", json!(1)); 4096])), "bad-operand", "nothing is written"),
        (json!({"do": "read-set", "operands": ["X0..X9999999"]}).to_string(), "bad-operand", ""),
        (json!({"do": "read-set", "from": 1}).to_string(), "bad-request", "unknown field"),
    ] {
        let answer = ask(&mut stream, &line);
        let line = line.get(..80).unwrap_or(&line);
        assert_eq!(answer["error"]["kind"], kind, "{line}: {answer}");
        assert!(answer["error"]["message"].as_str().unwrap().contains(words), "{line}: {answer}");
    }
    // As many as fit, in one scan.
    let all: Vec<Value> = (0..4096).map(|n| write(&format!("V{n}"), json!(n))).collect();
    let answer = ask(&mut live.connect(), &set(json!(all)));
    let changes = answer["ok"]["changes"].as_array().unwrap_or_else(|| panic!("{answer}"));
    assert_eq!((changes.len(), &changes[4095]["now"]["value"]), (4096, &json!(4095)));
    let line = live.line("wrote in one change");
    assert!(line.to_string().len() < 6000 && line.to_string().contains("and 4064 more"), "{line}");
    let answer = ask(&mut live.connect(), &json!({"do": "read-set"}).to_string());
    assert_eq!(answer["ok"]["values"].as_array().unwrap().len(), 19);
    assert_eq!(live.ok("write size 13"), "size (D1): 13, was 12\n");
}
