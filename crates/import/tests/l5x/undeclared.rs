//! What the file does not declare: types by their data and by their use, texts, pending edits.

use rungd_import::l5x;
use rungd_import::model::{Fate, ForeignProject};
use rungd_import::report;

use super::file;
use crate::plant;

fn project(tags: &str, rungs: &str) -> ForeignProject {
    let text = file(&["on: BOOL".to_owned(), "n: DINT".to_owned()], &[], &[]);
    let text = text.replace("<Tags>", &format!("<Tags>{tags}"));
    let place = "<RLLContent></RLLContent>";
    l5x::read(&text.replacen(place, &format!("<RLLContent>{rungs}</RLLContent>"), 1)).unwrap()
}

fn rungs(texts: &[&str]) -> String {
    let rung = |text: &&str| format!("<Rung Type=\"N\"><Text><![CDATA[{text}]]></Text></Rung>");
    texts.iter().map(rung).collect()
}

fn fates(project: &ForeignProject) -> Vec<&Fate> {
    project.outcome.rungs.iter().map(|rung| &rung.fate).collect()
}

fn different(text: &str) -> Fate {
    Fate::Different(vec![text.to_owned()])
}

#[test]
fn a_member_of_a_modules_type_is_a_bit_where_a_contact_names_it_and_a_dint_elsewhere() {
    let tags = "<Tag Name=\"di\" DataType=\"AB:5000_DI16:I:0\"/>";
    let made = project(
        tags,
        &rungs(&[
            "XIC(di.Pt00.Data)OTE(on);",
            "MOV(di.Count,n);",
            "XIC(di.Status.3)OTE(on);",
            "XIC(di.Count)OTE(on);",
        ]),
    );
    let taken = "`di.Count` is not declared: taken as a DINT";
    let no_bit = Fate::Todo("`di.Count` is no bit".to_owned());
    assert_eq!(fates(&made), [&Fate::Exact, &different(taken), &Fate::Exact, &no_bit]);
    let errors = plant::errors(&made).replace("error[imported-todo]", "");
    assert!(!errors.contains("error["), "{errors}");
    let report = report::text(&made);
    let row = "| `di_Pt00` | `di.Pt00` | a module, as its type is AB:5000_DI16:I:0 |";
    assert!(report.contains(row), "{report}");
}

#[test]
fn a_member_whose_type_the_data_of_any_tag_shows_is_exact() {
    let tags = "<Tag Name=\"one\" DataType=\"AXIS\"/><Tag Name=\"two\" DataType=\"AXIS\"><Data \
                Format=\"Decorated\"><Structure DataType=\"AXIS\"><DataValueMember Name=\"CTL\" \
                DataType=\"DINT\" Value=\"0\"/><DataValueMember Name=\"CTL_On\" DataType=\"BOOL\" \
                Value=\"0\"/><DataValueMember Name=\"SP\" DataType=\"REAL\" Value=\"2.5\"/>\
                </Structure></Data></Tag>";
    let texts = ["XIC(one.CTL_On)OTE(two.CTL_On);", "MOV(two.SP,one.SP);", "MOV(one.CTL,n);"];
    let made = project(tags, &rungs(&texts));
    let bits = "`AXIS.CTL` and the members for its bits have places of their own";
    assert_eq!(fates(&made), [&Fate::Exact, &Fate::Exact, &different(bits)]);
    let mut plc = plant::started(&made);
    plant::scan(&mut plc, 0, &[]);
    assert_eq!(f32::from_bits(plc.value("one.SP") as u32), 2.5);
}

#[test]
fn an_alias_with_a_type_says_the_type_of_the_module_word_that_it_names() {
    let tags =
        "<Tag Name=\"level\" TagType=\"Alias\" DataType=\"REAL\" AliasFor=\"Local:2:I.Ch0\"/>";
    let made = project(tags, &rungs(&["GRT(level,1.5)OTE(on);", "MOV(Local:2:I.Ch1,n);"]));
    let taken = different("`Local:2:I.Ch1` is not declared: taken as a DINT");
    assert_eq!(fates(&made), [&Fate::Exact, &taken]);
    let source = &made.outcome.unwritten[0].source;
    assert_eq!(source, "the module at Local:2, which the file does not contain");
}

#[test]
fn a_timer_that_a_later_rung_names_is_one_in_the_first_rung_too() {
    let made = project("", &rungs(&["XIC(t.DN)OTE(on);", "XIO(on)TON(t,20,?);"]));
    assert_eq!(fates(&made), [&Fate::Exact, &Fate::Exact]);
    let mut plc = plant::started(&made);
    (0..4).for_each(|scan| plant::scan(&mut plc, scan * 10, &[]));
    assert_eq!(plc.value("on"), 1);
}

#[test]
fn a_moving_index_of_what_is_not_declared_gets_a_stub() {
    let made = project("", &rungs(&["XIC(far[n])OTE(on);", "XIC(a.b[n])OTE(on);"]));
    let far = Fate::Todo("the file does not declare the array `far`".to_owned());
    let b = Fate::Todo("the file does not tell how many elements `b` has".to_owned());
    assert_eq!(fates(&made), [&far, &b]);
    let made = project("", &rungs(&["XIC(far[3].up)OTE(on);", "XIC(a.b[2].4)OTE(on);"]));
    assert_eq!(fates(&made), [&Fate::Exact, &Fate::Exact]);
}

#[test]
fn what_only_makes_a_text_is_left_out_and_what_reads_one_gets_a_stub() {
    let tags = "<Tag Name=\"s\" DataType=\"STRING\"/><Tag Name=\"r\" DataType=\"REAL\"/>";
    let made =
        project(tags, &rungs(&["XIC(on)RTOS(r,s)OTE(on);", "MOV('up',s);", "EQU(s,s)OTE(on);"]));
    let left_out = "a text is not made: rungd has no texts, and nothing in the project reads it";
    let reads = Fate::Todo("`s`: rungd has no texts".to_owned());
    assert_eq!(fates(&made), [&different(left_out), &different(left_out), &reads]);
}

#[test]
fn a_pending_edit_is_the_program_that_runs() {
    let rung = |state: &str, text: &str| {
        format!("<Rung Type=\"{state}\"><Text><![CDATA[{text}]]></Text></Rung>")
    };
    let both = rung("IR", "XIO(on)OTE(a);") + &rung("R", "XIC(on)OTE(a);");
    let made = project("<Tag Name=\"a\" DataType=\"BOOL\"/>", &both);
    assert_eq!(made.outcome.counts().different, 2);
    let mut plc = plant::started(&made);
    plant::scan(&mut plc, 0, &[("on".to_owned(), 1)]);
    assert_eq!(plc.value("a"), 1);
}

#[test]
fn a_whole_division_into_a_real_is_computed_in_reals_with_a_named_difference() {
    let tags = "<Tag Name=\"r\" DataType=\"REAL\"/><Tag Name=\"size\" DataType=\"DINT\" \
                Dimensions=\"7\"/>";
    let made = project(tags, &rungs(&["CPT(r,(n+5)/2);", "SIZE(size[0],0,n);"]));
    assert!(matches!(fates(&made)[0], Fate::Different(_)));
    let mut plc = plant::started(&made);
    plant::scan(&mut plc, 0, &[]);
    assert_eq!((f32::from_bits(plc.value("r") as u32), plc.value("n")), (2.5, 7));
}

#[test]
fn two_uses_of_an_instruction_with_one_argument_drive_no_bit_twice() {
    let own = "<AddOnInstructionDefinitions><AddOnInstructionDefinition Name=\"Ch\"><Parameters>\
               <Parameter Name=\"In\" DataType=\"BOOL\" Usage=\"Input\" Required=\"true\"/>\
               <Parameter Name=\"Out\" DataType=\"AB:X:O:0\" Usage=\"InOut\" Required=\"true\"/>\
               </Parameters><Routines><Routine Name=\"Logic\" Type=\"RLL\"><RLLContent><Rung \
               Type=\"N\"><Text><![CDATA[XIC(In)OTE(Out.Data);]]></Text></Rung></RLLContent>\
               </Routine></Routines></AddOnInstructionDefinition></AddOnInstructionDefinitions>";
    let text = file(
        &["on: BOOL".to_owned()],
        &["Ch(a,on,M:O)XIC(M:O.Data)OTE(on);".to_owned(), "Ch(b,0,M:O);".to_owned()],
        &[],
    );
    let made = l5x::read(&text.replacen("<Tags>", &format!("{own}<Tags>"), 1)).unwrap();
    assert_eq!(made.outcome.counts().exact, 3, "{:?}", made.outcome.rungs);
    assert_eq!(plant::errors(&made), "");
    assert_eq!(made.outcome.outputs[0].was, "M:O");
}
