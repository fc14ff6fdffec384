//! Names without an address of their own, with the real binary at both ends of the socket: own tags
//! of a template's use, elements and whole arrays are read, written and forced. Also names that
//! stand for several operands: blocks and uses; and lists with names that nothing has.

use crate::daemon::operator_commands;
use rungd_test_support::running::live::{Live, ask};

const LADDER: &str = r#"
[tags]
recipe = { at = "D10", count = 7, initial = [10, 11, 12, 13, 14, 15, 16], min = 1, max = 99 }
gate   = { type = "bit", count = 3 }
total  = { type = "int", initial = 40 }
[[template]]
name = "Pump"
rung = [
  { when = ["wanted", "!failed"], do = ["OUT motor"] },
  { when = ["motor", "!answer"], do = ["TMR late preset=10m"] },
  { when = ["late.Done"], do = ["SET failed"] },
]
[template.parameters]
wanted = { type = "contact" }
answer = { type = "bit" }
motor  = { type = "output" }
[template.tags]
failed = { type = "bit", alarm = "{name}: no answer" }
late   = { type = "timer" }
[[program]]
name = "Main"
rung = [
  { use = "Pump", name = "p1", with = { wanted = "$On", answer = "X1", motor = "Y1" } },
  { when = ["gate[1]", "p1.failed"], do = ["MOVE recipe[total] to=D0"] },
  { when = ["$On"], do = ["OUT C7"] },
]
"#;

fn live() -> Live {
    Live::scanning(LADDER)
}

#[test]
fn tags_of_a_use_are_read_and_forced_by_their_qualified_names() {
    let live = live();
    assert_eq!(live.ok("read p1.failed total"), "p1.failed  OFF\ntotal      40\n");
    assert_eq!(live.ok("read p1.failed Y1"), "p1.failed      OFF\nY1         Y1  ON\n");
    assert_eq!(live.ok("force p1.failed 1"), "p1.failed: ON, forced, was OFF\n");
    live.line("p1: no answer");
    live.await_values("Y1", "OFF");
    assert_eq!(live.ok("force p1.failed 0"), "p1.failed: OFF, forced, was ON, forced\n");
    live.await_values("Y1", "ON");
    assert_eq!(live.ok("read p1.failed"), "p1.failed  OFF  forced\n");
    assert_eq!(live.ok("unforce p1.failed"), "p1.failed: not forced, OFF, was OFF, forced\n");
    assert_eq!(live.ok("read p1.late").lines().count(), 5);
    assert!(live.ok("write p1.late.Acc 5m").starts_with("p1.late.Acc: 300"));
    assert_eq!(live.ok("write total 41"), "total: 41, was 40\n");
    let refused = live.say("read p2.failed");
    assert!(refused.err.contains("nothing is called `p2`"), "{}", refused.err);
}

#[test]
fn reading_a_block_reads_its_bits_and_stages() {
    let live = operator_commands::live();
    assert_eq!(
        live.ok("read Drain"),
        "\
Drain.Running  Drain.Running  ON
Drain.Open     Drain.Open     ON
Drain.Closed   Drain.Closed   OFF
"
    );
    assert_eq!(
        live.ok("read Often size"),
        "\
Often.Running  Often.Running  OFF
Often.Done     Often.Done     OFF
size           D1             12
"
    );
    assert!(live.ok("watch Drain --count 1").contains(" Drain.Running=ON Drain.Open=ON "));
    assert_eq!(live.say("read --json Drain").json()["values"][1]["address"], "Drain.Open");
    for asked in ["write Drain 1", "force Drain 1"] {
        let said = live.say(asked);
        let words = "`Drain` is a block: `Drain.Running` is its bit";
        assert!(said.code == 2 && said.err.contains(words), "{said:?}");
    }
}

#[test]
fn reading_a_use_reads_its_tags() {
    let live = live();
    let text = live.ok("read p1");
    let names: Vec<_> = text.lines().filter_map(|line| line.split(' ').next()).collect();
    let of_timer = ["Acc", "Done", "Reset", "Zero", "Timing"].map(|of| format!("p1.late.{of}"));
    assert_eq!(names[0], "p1.failed", "in the order of the file");
    assert_eq!(names[1..], of_timer);
    for asked in ["write p1 1", "force p1 1"] {
        let said = live.say(asked);
        let words = "`p1` is a use of a template: name one of its tags, as `p1.failed`";
        assert!(said.code == 2 && said.err.contains(words), "{said:?}");
    }
    assert!(live.say("read p2").err.contains("nothing is called `p2`"));
}

#[test]
fn an_array_is_read_whole_or_in_part_and_written_by_element() {
    let live = live();
    let rows = |from: usize, to: usize| -> String {
        (from..=to).map(|n| format!("recipe[{n}]  D{0}  {0}\n", 10 + n)).collect()
    };
    assert_eq!(live.ok("read recipe"), rows(0, 6));
    assert_eq!(live.ok("read recipe[0..6]"), rows(0, 6));
    assert_eq!(live.ok("read recipe[2..3] recipe[6]"), rows(2, 3) + &rows(6, 6));
    assert_eq!(live.ok("read gate"), "gate[0]  OFF\ngate[1]  OFF\ngate[2]  OFF\n");
    assert_eq!(live.ok("write recipe[2] 5"), "recipe[2] (D12): 5, was 12\n");
    live.line("wrote 5 to recipe[2] (D12)");
    assert_eq!(live.ok("force gate[1] 1"), "gate[1]: ON, forced, was OFF\n");
    assert_eq!(live.ok("force recipe[6] 3"), "recipe[6] (D16): 3, forced, was 16\n");
    for (asked, words) in [
        ("write recipe[2] 100", "1 to 99"),
        ("read recipe[7]", "`recipe` has the elements 0 to 6, not 7"),
        ("write recipe 5", "recipe"),
        ("write recipe[total] 5", "the index of `recipe[total]` is a word: name an element"),
        ("read recipe[5..9]", "`recipe` has the elements 0 to 6, not 9"),
    ] {
        let said = live.say(asked);
        assert!(said.err.contains(words), "{asked}: {}", said.err);
    }
}

/// A page that shows many operands sends one request, whatever a reload has removed.
#[test]
fn a_read_of_each_operand_answers_refused_operands_too() {
    let live = operator_commands::live();
    let mut stream = live.connect();
    let answer = ask(
        &mut stream,
        r#"{"do":"read","operands":["size","jamm","D0..D255","eye","D0..D999"],"each":true}"#,
    );
    let names = |key: &str| -> Vec<String> {
        let all = answer["ok"][key].as_array().expect("a list").iter();
        all.map(|one| one["operand"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!(names("values"), ["size", "eye"], "{answer}");
    assert_eq!(names("refused"), ["jamm", "D0..D255", "D0..D999"]);
    let refused = &answer["ok"]["refused"];
    assert_eq!(refused[0]["kind"], "bad-operand");
    assert!(refused[0]["message"].as_str().is_some_and(|why| why.contains("`jam`")), "{refused}");
    assert_eq!(refused[1]["message"], "one request reads at most 256 operands");
    // Without the key one refused operand refuses the list, in the words of its own refusal.
    let whole = ask(&mut stream, r#"{"do":"read","operands":["size","jamm"]}"#);
    assert_eq!(whole["error"]["message"], refused[0]["message"]);
    let plain = ask(&mut stream, r#"{"do":"read","operands":["size"]}"#);
    assert!(plain["ok"].get("refused").is_none(), "{plain}");
    let many = format!(r#"{{"do":"read","operands":[{}"x"],"each":true}}"#, "\"x\",".repeat(256));
    assert_eq!(ask(&mut stream, &many)["error"]["kind"], "bad-request");
}
