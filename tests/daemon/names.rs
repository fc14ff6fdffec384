//! Names that have no address of their own, with the real binary at both ends of the socket: own
//! tags of a template's use, elements and whole arrays, read, written and forced.

use crate::support::live::Live;

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
    let live = Live::start(LADDER, "", &[]);
    live.await_values("C7", "ON");
    live
}

#[test]
fn own_tags_of_a_use_are_read_and_forced_by_their_whole_names() {
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
fn an_array_is_read_whole_or_in_part_and_written_by_its_elements() {
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
