//! L5X: the tests' own interpreter of rungs, made from Rockwell's descriptions of its instructions,
//! random rungs for both, and named cases.

mod cases;
mod counter;
mod equality;
mod files;
mod generator;
mod hostile;
mod interpreter;
mod pid;
mod rung_text;
mod structures;
mod system_values;
mod undeclared;
mod values;

/// An L5X file with these tags, each `NAME: TYPE` or `NAME: TYPE[COUNT]`, and these rungs in the
/// main routine and in the routine `Sub`.
pub fn file(tags: &[String], main: &[String], sub: &[String]) -> String {
    let tag = |text: &String| {
        let (name, kind) = text.split_once(": ").unwrap();
        let (kind, size) = kind.split_once('[').unwrap_or((kind, ""));
        let size = size.trim_end_matches(']');
        let size = match size.is_empty() {
            true => String::new(),
            false => format!(" Dimensions=\"{size}\""),
        };
        format!("<Tag Name=\"{name}\" TagType=\"Base\" DataType=\"{kind}\"{size}/>")
    };
    let rungs = |rungs: &[String]| -> String {
        let rungs = rungs.iter().enumerate().map(|(number, text)| {
            format!("<Rung Number=\"{number}\" Type=\"N\"><Text><![CDATA[{text}]]></Text></Rung>")
        });
        rungs.collect()
    };
    let tags: String = tags.iter().map(tag).collect();
    let (main, sub) = (rungs(main), rungs(sub));
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><RSLogix5000Content SoftwareRevision=\"33.00\" \
         TargetName=\"Test\" TargetType=\"Controller\"><Controller Use=\"Target\" Name=\"Test\">\
         <Tags>{tags}</Tags><Programs><Program Name=\"Prog\" MainRoutineName=\"Begin\"><Routines>\
         <Routine Name=\"Begin\" Type=\"RLL\"><RLLContent>{main}</RLLContent></Routine>\
         <Routine Name=\"Sub\" Type=\"RLL\"><RLLContent>{sub}</RLLContent></Routine>\
         </Routines></Program></Programs><Tasks><Task Name=\"T\" Type=\"CONTINUOUS\">\
         <ScheduledPrograms><ScheduledProgram Name=\"Prog\"/></ScheduledPrograms></Task></Tasks>\
         </Controller></RSLogix5000Content>"
    )
}
