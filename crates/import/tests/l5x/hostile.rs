//! Files that mean harm: a reason or findings, never a panic. Damaged ones are in `files`.

use rungd_import::l5x;
use rungd_import::model::{Fate, ForeignProject};

use super::file;
use crate::plant;

/// The project of a file with these tags and these rungs in its main routine.
fn read(tags: &[&str], main: &[&str]) -> ForeignProject {
    let owned = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
    l5x::read(&file(&owned(tags), &owned(main), &[])).unwrap()
}

#[test]
fn a_rung_that_nests_too_deep_or_is_too_long_is_not_translated() {
    let deep = format!("{}XIC(a){}OTE(b);", "[".repeat(50_000), "]".repeat(50_000));
    let long = format!("{}OTE(b);", "XIC(a)".repeat(60_000));
    let formula = format!("CPT(n,{}1{});", "(".repeat(50_000), ")".repeat(50_000));
    for text in [&deep, &long, &formula] {
        let project = read(&["a: BOOL", "b: BOOL", "n: DINT"], &[text]);
        let fate = &project.outcome.rungs[0].fate;
        assert!(matches!(fate, Fate::Todo(_)), "{fate:?}");
    }
}

#[test]
fn wrong_references_are_named_and_end() {
    let rungs = [
        "JSR(Nowhere,0);",
        "XIC(list[99999999999])OTE(b);",
        "XIC(list[-1])OTE(b);",
        "XIC(list[list[list[0]]])OTE(b);",
        "XIC(n.32)OTE(b);",
        "XIC(n.n.n.n)OTE(b);",
        "JMP(Nowhere);",
        "TON(n,?,?);",
        "COP(list[0],list[0],99999999);",
        "FLL(0,list[3],-5);",
    ];
    let project = read(&["b: BOOL", "n: DINT", "list: DINT[4]"], &rungs);
    assert_eq!(project.outcome.rungs.len(), rungs.len());
    plant::errors(&project);
}

#[test]
fn routines_that_call_each_other_end() {
    let texts = |text: &str| vec![text.to_owned()];
    let xml = file(&texts("b: BOOL"), &texts("JSR(Sub,0);"), &texts("JSR(Sub,0);"));
    plant::errors(&l5x::read(&xml).unwrap());
    let xml = file(&texts("b: BOOL"), &texts("JSR(Sub,0);"), &texts("JSR(Begin,0);"));
    plant::errors(&l5x::read(&xml).unwrap());
}

#[test]
fn instructions_and_types_that_contain_each_other_end() {
    let own = |name: &str, other: &str| {
        format!(
            "<AddOnInstructionDefinition Name=\"{name}\"><Parameters/><LocalTags><LocalTag \
             Name=\"x\" DataType=\"{other}\"/></LocalTags><Routines><Routine Name=\"Logic\" \
             Type=\"RLL\"><RLLContent><Rung Number=\"0\"><Text><![CDATA[{other}(x);]]></Text>\
             </Rung></RLLContent></Routine></Routines></AddOnInstructionDefinition>"
        )
    };
    let kind = |name: &str, other: &str| {
        format!(
            "<DataType Name=\"{name}\"><Members><Member Name=\"x\" DataType=\"{other}\" \
             Dimension=\"0\"/></Members></DataType>"
        )
    };
    let parts = format!(
        "<DataTypes>{}{}</DataTypes><AddOnInstructionDefinitions>{}{}\
         </AddOnInstructionDefinitions><Tags>",
        kind("Egg", "Hen"),
        kind("Hen", "Egg"),
        own("One", "Two"),
        own("Two", "One")
    );
    let texts = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
    let tags = texts(&["one: One", "egg: Egg", "b: BOOL"]);
    let xml = file(&tags, &texts(&["One(one);", "XIC(egg.x.x.x)OTE(b);"]), &[]);
    let project = l5x::read(&xml.replacen("<Tags>", &parts, 1)).unwrap();
    assert!(project.outcome.is_open());
    plant::errors(&project);
}
