//! Files that mean harm, and damaged ones: a reason or findings, never a panic.

use rungd_base::random::SplitMix64;
use rungd_import::model::Fate;
use rungd_import::plcopen;
use rungd_import::write::files;
use rungd_test_support::setting::setting;

use super::chart_cases::{action, chart_file, coil_ladder, link, named, step, transition};
use super::chart_generator::chart_project;
use super::file;
use super::generator::project;
use crate::damage::damaged;
use crate::plant;

#[test]
fn no_damage_to_a_file_causes_a_panic() {
    let mut random = SplitMix64(11);
    for number in 0..setting("RUNGD_PLCOPEN_DAMAGED", 10) {
        let make = if number % 2 == 0 { project } else { chart_project };
        let whole = make(&mut random).xml;
        for text in damaged(&whole, &mut random) {
            if let Ok(project) = plcopen::read(&text) {
                plant::errors(&project);
            }
        }
    }
}

#[test]
fn hostile_files_are_refused_with_a_reason() {
    let bomb = "<!DOCTYPE a [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>\
                <project>&b;</project>";
    let deep = format!("<project>{}", "<a>".repeat(100_000));
    for (text, wanted) in [
        (bomb, "DTD"),
        ("<other/>", "no PLCopen project: its root is `other`"),
        (deep.as_str(), ""),
        ("", "document"),
    ] {
        let why = plcopen::read(text).expect_err("it is no PLCopen project");
        assert!(why.contains(wanted), "{why}");
    }
}

#[test]
fn blocks_that_use_each_other_are_named_and_end() {
    let own = |name: &str, other: &str| {
        format!(
            "<pou name=\"{name}\" pouType=\"functionBlock\"><interface><localVars><variable \
             name=\"x\"><type><derived name=\"{other}\"/></type></variable></localVars></interface>\
             <body><LD><block localId=\"1\" typeName=\"{other}\" instanceName=\"x\"><position \
             x=\"0\" y=\"0\"/><inputVariables/><outputVariables/></block></LD></body></pou>"
        )
    };
    let text = format!(
        "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><pous>{}{}</pous></types>\
         </project>",
        own("One", "Two"),
        own("Two", "One")
    );
    let project = plcopen::read(&text).unwrap();
    let rungs = &project.outcome.rungs;
    assert_eq!(rungs.len(), 2);
    assert!(rungs.iter().all(|rung| matches!(rung.fate, Fate::Todo(_))), "{rungs:?}");
}

#[test]
fn loops_of_blocks_end() {
    let block = |id: u32, from: u32| {
        format!(
            "<block localId=\"{id}\" typeName=\"ADD\"><position x=\"{id}\" \
            y=\"10\"/><inputVariables>\
             <variable formalParameter=\"IN1\"><connectionPointIn><connection \
             refLocalId=\"{from}\" \
             formalParameter=\"OUT\"/></connectionPointIn></variable><variable \
             formalParameter=\"IN2\"><connectionPointIn><connection refLocalId=\"{from}\" \
             formalParameter=\"OUT\"/></connectionPointIn></variable></inputVariables>\
             <outputVariables><variable formalParameter=\"OUT\"><connectionPointOut/></variable>\
             </outputVariables></block>"
        )
    };
    let project = plcopen::read(&file("", &(block(2, 3) + &block(3, 2)))).unwrap();
    assert_eq!(project.outcome.rungs.len(), 1);
    plant::errors(&project);
    let continuation = "<continuation localId=\"2\" name=\"c\"><position x=\"1\" y=\"1\"/>\
                        </continuation><connector localId=\"3\" name=\"c\"><position x=\"2\" \
                        y=\"1\"/>\
                        <connectionPointIn><connection refLocalId=\"2\"/></connectionPointIn>\
                        </connector><coil localId=\"4\"><position x=\"9\" \
                        y=\"1\"/><connectionPointIn>\
                        <connection \
                        refLocalId=\"2\"/></connectionPointIn><variable>a</variable></coil>";
    let project = plcopen::read(&file("", continuation)).unwrap();
    assert!(matches!(project.outcome.rungs[0].fate, Fate::Todo(_)));
}

#[test]
fn loops_of_divergences_end() {
    let chart = [
        step(1, "Start", &[]),
        link("selectionDivergence", 2, &[3]),
        link("selectionDivergence", 3, &[2, 1]),
        transition(4, "TRUE", &[2]),
        link("selectionConvergence", 5, &[6, 4]),
        link("selectionConvergence", 6, &[5]),
        step(7, "Run", &[6]),
    ];
    let project = plcopen::read(&chart_file(&[], "", &chart.concat())).unwrap();
    assert_eq!(plant::errors(&project), "");
    // A convergence of nothing but itself.
    let chart = [step(1, "Start", &[]), link("simultaneousConvergence", 2, &[2])].concat();
    let chart = chart + &transition(3, "TRUE", &[2]);
    let project = plcopen::read(&chart_file(&[], "", &chart)).unwrap();
    assert!(matches!(project.outcome.rungs[0].fate, Fate::Todo(_)));
}

#[test]
fn a_chart_of_many_steps_ends() {
    let count = setting("RUNGD_PLCOPEN_STEPS", 150) as u32;
    let (mut row, mut fork, mut net) = (String::new(), String::new(), String::new());
    let ids: Vec<u32> = (0..count).map(|at| 10 + 2 * at).collect();
    for (at, id) in ids.iter().enumerate() {
        let name = format!("S{at}");
        let before = if at == 0 { Vec::new() } else { vec![id - 1] };
        row += &(step(*id, &name, &before) + &transition(id + 1, "a", &[*id]));
        // All of one step, and into all of them from each.
        fork += &(transition(id + 1, "a", &[1]) + &step(*id, &name, &[id + 1]));
        net += &(transition(id + 1, "a", &[1]) + &step(*id, &name, &[2]));
    }
    let ends: Vec<u32> = ids.iter().map(|id| id + 1).collect();
    let start = step(1, "Start", &[]);
    let net = start.clone() + &net + &link("selectionConvergence", 2, &ends);
    for chart in [row, start + &fork, net] {
        let project = plcopen::read(&chart_file(&["a"], "", &chart)).unwrap();
        assert!(project.outcome.rungs.len() > count as usize);
        plant::errors(&project);
    }
}

#[test]
fn a_body_that_many_steps_share_ends() {
    let count = setting("RUNGD_PLCOPEN_SHARED", 10_000) as u32;
    let body = coil_ladder("b");
    let lists = format!("<actions><action name=\"do\"><body>{body}</body></action></actions>");
    let mut chart = String::new();
    for id in (0..count).map(|at| 10 + 3 * at) {
        let before = if chart.is_empty() { Vec::new() } else { vec![id - 2] };
        chart += &step(id, &format!("S{id}"), &before);
        chart += &transition(id + 1, "a", &[id]);
        chart += &action(id + 2, id, "", &named("do"));
    }
    let project = plcopen::read(&chart_file(&["a", "b"], &lists, &chart)).unwrap();
    let rows = &project.outcome.rungs;
    assert!(rows.iter().filter(|row| row.fate == Fate::Exact).count() >= 3 * count as usize);
    assert!(files(&project).len() > 1);
}
