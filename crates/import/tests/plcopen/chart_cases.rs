//! Named cases of charts: what each construct becomes, and what it does.

use rungd_import::model::{Fate, ForeignProject};
use rungd_import::plcopen;
use rungd_test_support::plc::Plc;

use super::counter::is_complete;
use crate::plant;

/// A program with a chart; `lists` are its `actions` and `transitions`.
pub fn chart_file(bits: &[&str], lists: &str, chart: &str) -> String {
    let bit = |name: &&str| format!("<variable name=\"{name}\"><type><BOOL/></type></variable>");
    let bits: String = bits.iter().map(bit).collect();
    format!(
        "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><pous><pou name=\"prog\" \
         pouType=\"program\"><interface><localVars>{bits}</localVars></interface>{lists}<body><SFC>\
         {chart}</SFC></body></pou></pous></types></project>"
    )
}

/// An element: where it stands from left to right is its number.
fn element(kind: &str, id: u32, more: &str, inner: &str) -> String {
    format!("<{kind} localId=\"{id}\" {more}><position x=\"{id}\" y=\"10\"/>{inner}</{kind}>")
}

fn input(from: &[u32]) -> String {
    let point = |id: &u32| {
        format!("<connectionPointIn><connection refLocalId=\"{id}\"/></connectionPointIn>")
    };
    from.iter().map(point).collect()
}

/// A step; the first one is the initial step.
pub fn step(id: u32, name: &str, from: &[u32]) -> String {
    let more = format!("name=\"{name}\" initialStep=\"{}\"", from.is_empty());
    element("step", id, &more, &input(from))
}

/// A transition with a condition in ST.
pub fn transition(id: u32, text: &str, from: &[u32]) -> String {
    prior(id, "", text, from)
}

fn prior(id: u32, priority: &str, text: &str, from: &[u32]) -> String {
    let condition = format!("<inline name=\"\"><ST><p><![CDATA[{text}]]></p></ST></inline>");
    waiting(id, priority, &condition, from)
}

/// A transition with a condition of any form.
pub fn waiting(id: u32, more: &str, condition: &str, from: &[u32]) -> String {
    element("transition", id, more, &(input(from) + "<condition>" + condition + "</condition>"))
}

pub fn link(kind: &str, id: u32, from: &[u32]) -> String {
    element(kind, id, "", &input(from))
}

fn jump(id: u32, target: &str, from: &[u32]) -> String {
    element("jumpStep", id, &format!("targetName=\"{target}\""), &input(from))
}

pub fn action(id: u32, step: u32, more: &str, body: &str) -> String {
    let action = format!("<action localId=\"0\" {more}>{body}</action>");
    element("actionBlock", id, "", &(input(&[step]) + &action))
}

pub fn named(name: &str) -> String {
    format!("<reference name=\"{name}\"/>")
}

/// A coil behind the left rail.
pub fn coil_ladder(variable: &str) -> String {
    format!(
        "<LD><leftPowerRail localId=\"1\"><position x=\"0\" y=\"0\"/></leftPowerRail><coil \
         localId=\"2\"><position x=\"9\" y=\"0\"/><connectionPointIn><connection refLocalId=\"1\"/>\
         </connectionPointIn><variable>{variable}</variable></coil></LD>"
    )
}

pub fn made(bits: &[&str], lists: &str, chart: &str) -> ForeignProject {
    plcopen::read(&chart_file(bits, lists, chart)).unwrap()
}

/// The fate of the row of the report whose text begins so.
pub fn fate(project: &ForeignProject, begin: &str) -> Fate {
    let rows = &project.outcome.rungs;
    let whole = rows.iter().find(|row| row.text == begin);
    let row = whole.or(rows.iter().find(|row| row.text.starts_with(begin)));
    row.unwrap_or_else(|| panic!("no row {begin}: {rows:?}")).fate.clone()
}

/// The values of a bit in scans of 10 ms, with changes of inputs before them: `#` is ON.
fn trace(plc: &mut Plc, bit: &str, scans: u64, changes: &[(u64, &str, i32)]) -> String {
    let mut shown = String::new();
    for scan in 0..scans {
        let now = changes.iter().filter(|change| change.0 == scan);
        let now: Vec<(String, i32)> = now.map(|one| (one.1.to_owned(), one.2)).collect();
        plant::scan(plc, scan * 10, &now);
        shown.push(if plc.value(bit) == 1 { '#' } else { '.' });
    }
    shown
}

#[test]
fn a_chart_goes_on_by_one_step_a_scan() {
    let chart = [
        step(1, "One", &[]),
        transition(2, "TRUE", &[1]),
        step(3, "Two", &[2]),
        transition(4, "TRUE", &[3]),
        step(5, "Three", &[4]),
        transition(6, "back", &[5]),
        jump(7, "One", &[6]),
    ];
    let project = made(&["back"], "", &chart.concat());
    assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
    for (bit, wanted) in [("One.X", "....#.."), ("Two.X", "#....#."), ("Three.X", ".###..#")] {
        let mut plc = plant::started(&project);
        let changes = [(4, "back", 1), (5, "back", 0)];
        assert_eq!(trace(&mut plc, bit, 7, &changes), wanted, "{bit}");
    }
}

#[test]
fn a_transition_may_compare_a_bit_that_the_file_does_not_declare() {
    let chart = [step(1, "One", &[]), transition(2, "go = 1", &[1]), step(3, "Two", &[2])];
    let project = made(&[], "", &chart.concat());
    let why = "`go` is not declared: taken as a BOOL".to_owned();
    assert_eq!(fate(&project, "transition One to Two"), Fate::Different(vec![why]));
    let mut plc = plant::started(&project);
    assert_eq!(trace(&mut plc, "Two.X", 4, &[(1, "go", 1)]), ".###");
}

/// Two transitions of one step, with what stands before their conditions.
fn selection(first: &str, second: &str, conditions: [&str; 2]) -> ForeignProject {
    let chart = [
        step(1, "Start", &[]),
        link("selectionDivergence", 2, &[1]),
        prior(3, first, conditions[0], &[2]),
        prior(4, second, conditions[1], &[2]),
        step(5, "Left", &[3]),
        step(6, "Right", &[4]),
    ];
    made(&["a", "b"], "", &chart.concat())
}

#[test]
fn of_two_branches_the_first_one_from_the_left_is_taken() {
    let project = selection("", "", ["a", "b"]);
    let mut plc = plant::started(&project);
    plant::scan(&mut plc, 0, &[("a".to_owned(), 1), ("b".to_owned(), 1)]);
    assert_eq!([plc.value("Left.X"), plc.value("Right.X")], [1, 0]);
    let Fate::Different(why) = fate(&project, "transition Start to Right") else {
        panic!("MatIEC enters both branches");
    };
    assert!(why[0].starts_with("a selection without priorities"), "{why:?}");
    assert_eq!(fate(&project, "transition Start to Left"), Fate::Exact);
    // Conditions that are never ON together are no difference.
    let project = selection("", "", ["a AND b", "NOT a"]);
    assert_eq!(fate(&project, "transition Start to Right"), Fate::Exact);
}

#[test]
fn a_branch_with_a_smaller_number_has_priority() {
    let project = selection("priority=\"2\"", "priority=\"1\"", ["a", "b"]);
    let mut plc = plant::started(&project);
    plant::scan(&mut plc, 0, &[("a".to_owned(), 1), ("b".to_owned(), 1)]);
    assert_eq!([plc.value("Left.X"), plc.value("Right.X")], [0, 1]);
    assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
}

#[test]
fn parallel_branches_wait_for_each_other() {
    let chart = [
        step(1, "Start", &[]),
        transition(2, "a", &[1]),
        link("simultaneousDivergence", 3, &[2]),
        step(4, "Fill", &[3]),
        step(5, "Heat", &[3]),
        transition(6, "b", &[5]),
        step(7, "Hot", &[6]),
        link("simultaneousConvergence", 8, &[4, 7]),
        transition(9, "TRUE", &[8]),
        step(10, "Done", &[9]),
    ];
    let project = made(&["a", "b"], "", &chart.concat());
    assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
    for (bit, wanted) in
        [("Fill.X", ".####."), ("Heat.X", ".###.."), ("Hot.X", "....#."), ("Done.X", ".....#")]
    {
        let mut plc = plant::started(&project);
        assert_eq!(trace(&mut plc, bit, 6, &[(1, "a", 1), (4, "b", 1)]), wanted, "{bit}");
    }
}

#[test]
fn each_qualifier_does_what_matiec_executes() {
    // The step is active in the scans 2 to 7, of 10 ms each; another one resets behind that.
    for (qualifier, duration, wanted) in [
        ("N", "", "..######...."),
        ("S", "", "..########.."),
        ("P", "", "..#........."),
        ("P1", "", "..#........."),
        ("P0", "", "........#..."),
        ("L", "T#25ms", "..###......."),
        ("D", "T#25ms", ".....###...."),
        ("SD", "T#25ms", ".....#####.."),
        ("SD", "T#70ms", ".........#.."),
        ("DS", "T#25ms", ".....#####.."),
        ("DS", "T#70ms", "............"),
        ("SL", "T#25ms", "..###......."),
        ("SL", "T#75ms", "..########.."),
    ] {
        let duration = match duration {
            "" => String::new(),
            text => format!("duration=\"{text}\""),
        };
        let chart = [
            step(1, "Start", &[]),
            transition(2, "go", &[1]),
            step(3, "Run", &[2]),
            action(20, 3, &format!("qualifier=\"{qualifier}\" {duration}"), &named("motor")),
            transition(4, "NOT go", &[3]),
            step(5, "Wait", &[4]),
            transition(6, "Wait.T >= T#20ms", &[5]),
            step(7, "Reset", &[6]),
            action(21, 7, "qualifier=\"R\"", &named("motor")),
        ];
        let project = made(&["go", "motor"], "", &chart.concat());
        assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
        let mut plc = plant::started(&project);
        let found = trace(&mut plc, "motor", 12, &[(2, "go", 1), (8, "go", 0)]);
        assert_eq!(found, wanted, "{qualifier} {duration}");
    }
}

#[test]
fn a_body_is_not_executed_once_more_behind_its_step() {
    // The coil keeps what the last execution left: MatIEC knows no last scan of an action.
    let lists = format!(
        "<actions><action name=\"run\"><body>{}</body></action></actions>",
        coil_ladder("motor")
    );
    let chart = [
        step(1, "Start", &[]),
        transition(2, "go", &[1]),
        step(3, "Run", &[2]),
        action(20, 3, "", &named("run")),
        transition(4, "NOT go", &[3]),
        step(5, "Wait", &[4]),
    ];
    let project = made(&["go", "motor"], &lists, &chart.concat());
    assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
    let mut plc = plant::started(&project);
    assert_eq!(trace(&mut plc, "motor", 8, &[(2, "go", 1), (4, "go", 0)]), "..######");
    let texts = plant::texts(&project);
    assert!(texts.contains("when = [\"prog_run_active\"]\ndo   = [\"CALL prog_run\"]"), "{texts}");
}

#[test]
fn the_states_and_times_of_steps_can_be_read() {
    let ladder = coil_ladder("shown").replace(
        "<coil",
        "<contact localId=\"3\"><position x=\"5\" y=\"0\"/><connectionPointIn><connection \
         refLocalId=\"1\"/></connectionPointIn><variable>Start.X</variable></contact><coil",
    );
    let ladder = ladder.replace(
        "<position x=\"9\" y=\"0\"/><connectionPointIn><connection refLocalId=\"1\"/>",
        "<position x=\"9\" y=\"0\"/><connectionPointIn><connection refLocalId=\"3\"/>",
    );
    let chart = [
        step(1, "Start", &[]),
        action(20, 1, "qualifier=\"S\"", &format!("<inline>{ladder}</inline>")),
        transition(2, "Start.T > T#25ms", &[1]),
        step(3, "Run", &[2]),
    ];
    let project = made(&["shown"], "", &chart.concat());
    assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
    let mut plc = plant::started(&project);
    assert_eq!(trace(&mut plc, "shown", 6, &[]), "###...");
    assert_eq!(plc.value("Start.T"), 30);
}

#[test]
fn blocks_before_a_transition_have_the_values_of_the_last_scan() {
    let block = "<inVariable localId=\"30\"><position x=\"0\" y=\"50\"/><expression>a</expression>\
                 </inVariable><block localId=\"31\" typeName=\"NOT\"><position x=\"9\" y=\"50\"/>\
                 <inputVariables><variable formalParameter=\"IN\"><connectionPointIn><connection \
                 refLocalId=\"30\"/></connectionPointIn></variable></inputVariables>\
                 <inOutVariables/><outputVariables><variable formalParameter=\"OUT\">\
                 <connectionPointOut/></variable></outputVariables></block>";
    let condition = "<connectionPointIn><connection refLocalId=\"31\" \
                     formalParameter=\"OUT\"/></connectionPointIn>";
    let chart =
        [step(1, "Start", &[]), waiting(2, "", condition, &[1]), step(3, "Run", &[2])].concat();
    let project = made(&["a"], "", &(chart + block));
    assert!(project.outcome.rungs.iter().all(|row| row.fate == Fate::Exact));
    let mut plc = plant::started(&project);
    let changes = [(0, "a", 1), (2, "a", 0)];
    assert_eq!(trace(&mut plc, "Run.X", 5, &changes), "...##");
}

#[test]
fn an_action_of_two_steps_follows_the_order_of_the_text() {
    // From Two back to One: Two stands behind One in the text, so that its end comes last.
    let chart = [
        step(1, "One", &[]),
        action(20, 1, "", &named("motor")),
        transition(2, "TRUE", &[1]),
        step(3, "Two", &[2]),
        action(21, 3, "", &named("motor")),
        transition(4, "TRUE", &[3]),
        jump(5, "One", &[4]),
    ];
    let project = made(&["motor"], "", &chart.concat());
    let mut plc = plant::started(&project);
    assert_eq!(trace(&mut plc, "motor", 6, &[]), "#.#.#.");
}

#[test]
fn what_a_chart_says_other_than_in_ladder_gets_a_stub_with_its_reason() {
    let st = "<inline><ST><p>n := n + 1;</p></ST></inline>";
    let start = step(1, "Start", &[]);
    let run = step(3, "Run", &[2]);
    let whole = |transition: String| [start.clone(), transition, run.clone()].concat();
    let with = |action: String| whole(transition(2, "a", &[1])) + &action;
    let inline =
        |body: &str| whole(waiting(2, "", &format!("<inline name=\"\">{body}</inline>"), &[1]));
    for (chart, row, wanted) in [
        (with(action(20, 3, "", st)), "action N in ST of Run", "an action in ST"),
        (with(action(20, 3, "", &named("calc"))), "action N calc", "an action in IL"),
        (with(action(20, 3, "", &named(""))), "action N", "an action without a name"),
        (with(action(20, 3, "", &named("a.b"))), "action N a.b", "`a.b`"),
        (with(action(20, 3, "qualifier=\"X\"", &named("a"))), "action X", "the qualifier `X`"),
        (with(action(20, 3, "qualifier=\"L\"", &named("a"))), "action L", "without a duration"),
        (
            with(action(20, 3, "qualifier=\"D\" duration=\"soon\"", &named("a"))),
            "action D",
            "`soon`, which the file does not declare",
        ),
        (with(action(20, 99, "", &named("a"))), "action a", "the element 99"),
        (whole(transition(2, "n + 1 > 2", &[1])), "transition", "a transition in ST: `n + 1 > 2`"),
        (inline("<IL>LD a</IL>"), "transition", "a transition in IL"),
        (inline("<LD/>"), "transition", "without a coil or variable"),
        (whole(waiting(2, "", "", &[1])), "transition", "without a condition"),
        (
            whole(waiting(2, "", "<reference name=\"go\"/>", &[1])),
            "transition",
            "no transition of the program is called `go`",
        ),
        (whole(transition(2, "a", &[])), "transition", "behind no step"),
        (
            whole(transition(2, "a", &[3])) + &transition(9, "a", &[1]),
            "transition Start to nothing",
            "before no step",
        ),
        (whole(transition(2, "a", &[77])), "transition", "the element 77"),
        (
            whole(transition(2, "a", &[1])) + &jump(9, "Nowhere", &[2]),
            "jumpStep Nowhere",
            "a jump to `Nowhere`, which no step is called",
        ),
        (
            whole(transition(2, "a", &[1])) + &step(9, "run", &[2]),
            "step run",
            "two steps are called `run`",
        ),
        (whole(transition(2, "a", &[1])) + &step(9, "a", &[2]), "step a", "a step and a variable"),
        (whole(transition(2, "a", &[1])) + &step(9, "", &[2]), "step ", "a step without a name"),
        (
            whole(transition(2, "a", &[1])) + &element("macroStep", 9, "name=\"M\"", &input(&[2])),
            "step M",
            "a macro step",
        ),
        (run.clone(), "step Run", "which is none here"),
        (step(1, "Start", &[1]), "step Start", "where a transition must stand"),
    ] {
        let lists = "<actions><action name=\"calc\"><body><IL>LD a</IL></body></action></actions>";
        let project = made(&["a"], lists, &chart);
        match fate(&project, row) {
            Fate::Todo(why) => assert!(why.contains(wanted), "{wanted}: {why}"),
            other => panic!("{wanted}: {other:?}"),
        }
        assert!(plant::errors(&project).contains("imported-todo"), "{wanted}");
    }
}

#[test]
fn what_does_nothing_in_a_chart_is_named() {
    let lists = format!(
        "<actions><action name=\"idle\"><body>{}</body></action></actions>",
        coil_ladder("a")
    );
    let chart = [
        step(1, "Start", &[]),
        step(3, "Lost", &[4]),
        transition(4, "a", &[3]),
        action(20, 3, "", &named("a")),
        jump(6, "Start", &[]),
    ];
    let project = made(&["a"], &lists, &chart.concat());
    for (row, wanted) in [
        ("step Lost", "no way leads to the step"),
        ("action N a of Lost", "no way leads to its step"),
        ("jumpStep Start", "no transition leads to it"),
        ("coil a", "nothing in the chart names it"),
    ] {
        match fate(&project, row) {
            Fate::Different(why) => assert!(why[0].starts_with(wanted), "{why:?}"),
            other => panic!("{row}: {other:?}"),
        }
    }
    assert_eq!(plant::errors(&project), "");
}

#[test]
fn a_function_block_with_a_chart_is_named_with_all_its_parts() {
    let chart = [step(1, "Start", &[]), transition(2, "a", &[1]), step(3, "Run", &[2])].concat()
        + &action(20, 3, "", &named("a"))
        + &jump(21, "Start", &[]);
    let text = chart_file(&["a"], "", &chart).replace("\"program\"", "\"functionBlock\"");
    let project = plcopen::read(&text).unwrap();
    assert_eq!(project.outcome.counts().todo, 5);
    is_complete(&text);
    assert_eq!(
        fate(&project, "step Run"),
        Fate::Todo("a function block: its body is in SFC".to_owned())
    );
}
