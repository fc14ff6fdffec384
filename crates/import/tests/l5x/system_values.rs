//! GSV, SSV, EVENT, and searches for texts: what the report says, and what the program sees.

use rungd_import::l5x;
use rungd_import::model::{Fate, ForeignProject};

use super::file;
use crate::plant;

fn read(tags: &[&str], rungs: &[&str]) -> ForeignProject {
    let own = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
    l5x::read(&file(&own(tags), &own(rungs), &[])).unwrap()
}

fn different(text: &str) -> Fate {
    Fate::Different(vec![text.to_owned()])
}

#[test]
fn the_state_of_a_module_is_a_tag_that_someone_has_to_bring() {
    let tags = ["state: INT", "ok: BOOL"];
    let rungs = ["GSV(Module,Rack,EntryStatus,state);", "MEQ(state,16#F000,16#4000)OTE(ok);"];
    let project = read(&tags, &rungs);
    let why = "`state` is not set: rungd has no EntryStatus of the class Module; it keeps its \
               value (0, if the file gives none) until something else writes it: the map of a \
               device, or a rung with the device's `.Ok`";
    assert_eq!(project.outcome.rungs[0].fate, different(why));
    assert_eq!(project.outcome.rungs[1].fate, Fate::Exact);
    assert_eq!(project.outcome.unwritten[0].name, "state");
    let mut plc = plant::started(&project);
    plant::scan(&mut plc, 0, &[]);
    assert_eq!(plc.value("ok"), 0);
    plant::scan(&mut plc, 10, &[("state".to_owned(), 0x4000)]);
    assert_eq!(plc.value("ok"), 1);
}

#[test]
fn the_local_time_is_that_of_the_scan() {
    let rungs = ["GSV(WallClockTime,,LocalDateTime,now[1]);"];
    let project = read(&["now: DINT[8]"], &rungs);
    let why = "the local time is that of the scan's beginning, in whole seconds";
    assert_eq!(project.outcome.rungs[0].fate, different(why));
    let mut plc = plant::started(&project);
    plant::scan(&mut plc, 0, &[]);
    let own = |at: usize| plc.value(&format!("now[{at}]"));
    let clock = ["$Year", "$Month", "$Day", "$Hour", "$Minute", "$Second"];
    for (at, name) in clock.iter().enumerate() {
        assert_eq!(own(at + 1), plc.value(name), "{name}");
    }
    assert_eq!((own(0), own(7)), (0, 0));
}

#[test]
fn what_is_told_to_a_controller_that_is_not_there_is_named() {
    let rungs = ["SSV(Task,Fast,Rate,n);", "EVENT(Elsewhere);", "EVENT(T);", "GSV(No,T,Rate,n);"];
    let project = read(&["n: DINT"], &rungs);
    let fates: Vec<Fate> = project.outcome.rungs.iter().map(|rung| rung.fate.clone()).collect();
    let wanted = [
        different("SSV sets nothing: rungd has no Rate of the class Task"),
        different("EVENT starts nothing: the file has no program of the task Elsewhere"),
        Fate::Todo("EVENT of a task whose programs are in the file".to_owned()),
        Fate::Todo("GSV of the class No".to_owned()),
    ];
    assert_eq!(fates, wanted);
}

/// An Add-On Instruction that looks for a text, with one more rung.
fn search(more: &str) -> Fate {
    let rung = |text: &str| format!("<Rung Type=\"N\"><Text><![CDATA[{text}]]></Text></Rung>");
    let look = "[RES(ctl) SIZE(list,0,ctl.LEN) ,FSC(ctl,?,?,ALL,list[ctl.POS].Code=code) ,\
                XIC(ctl.FD) COP(list[ctl.POS].Desc,found,1) ];";
    let text = file(&["on: BOOL".to_owned()], &[], &[]).replace(
        "<Tags>",
        &format!(
            "<DataTypes><DataType Name=\"Text\" Family=\"StringFamily\"><Members/></DataType>\
             <DataType Name=\"Row\"><Members><Member Name=\"Code\" DataType=\"DINT\"/><Member \
             Name=\"Desc\" DataType=\"Text\"/></Members></DataType></DataTypes>\
             <AddOnInstructionDefinitions><AddOnInstructionDefinition Name=\"Look\"><Parameters>\
             <Parameter Name=\"list\" DataType=\"Row\" Dimensions=\"5\" Usage=\"InOut\" \
             Required=\"true\"/><Parameter Name=\"code\" DataType=\"DINT\" Usage=\"Input\"/>\
             <Parameter Name=\"out\" DataType=\"DINT\" Usage=\"Output\"/></Parameters>\
             <LocalTags><LocalTag Name=\"ctl\" DataType=\"CONTROL\"/><LocalTag Name=\"found\" \
             DataType=\"Text\"/></LocalTags><Routines><Routine Name=\"Logic\" Type=\"RLL\">\
             <RLLContent>{}{}</RLLContent></Routine></Routines></AddOnInstructionDefinition>\
             </AddOnInstructionDefinitions><Tags>",
            rung(look),
            rung(more)
        ),
    );
    l5x::read(&text).unwrap().outcome.rungs[0].fate.clone()
}

#[test]
fn a_search_for_a_text_is_left_out_only_if_nothing_else_uses_it() {
    let left_out = "a search for a text is left out: rungd has no texts, and nothing else uses \
                    the CONTROL of the search";
    assert_eq!(search("MOV(code,out);"), different(left_out));
    assert_eq!(search("MOV(ctl.POS,out);"), Fate::Todo("the instruction FSC".to_owned()));
}
