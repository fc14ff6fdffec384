//! Whole ladders, from text to the resolved program.

use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::SourceFile;

fn load(text: &str) -> Program {
    let file = SourceFile { name: "bottling.toml".into(), text: text.into() };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    program.unwrap_or_else(|| panic!("{findings:#?}"))
}

#[test]
fn the_example_of_the_language_page_resolves() {
    let program = load(include_str!("../../../../tests/bottling.toml"));
    assert_eq!(program.name, "bottling");
    let blocks: Vec<&str> = program.blocks.iter().map(|b| b.name.as_str()).collect();
    assert_eq!(blocks, ["Main", "Drain", "Housekeeping"]);
    let operands: Vec<_> = program.operands.iter().map(|operand| operand.name()).collect();
    assert_eq!(
        operands,
        [
            "part_seen",
            "bin_reset",
            "bottles.Acc",
            "bottles.Done",
            "bottles.Reset",
            "bottles.Zero",
            "bottles.DnDone",
            "bin_size",
            "X3",
            "bin_full",
            "X4",
            "jam",
            "$On",
            "T0.Acc",
            "T0.Done",
            "T0.Reset",
            "T0.Zero",
            "T0.Timing",
            "Y1",
            "D0"
        ]
    );
    assert!(program.tags.iter().all(|tag| tag.used));
    for (name, address) in [
        ("part_seen", "X0"),
        ("bottles.Acc", "CT0.Acc"),
        ("Drain.Close", "stage 1"),
        ("Drain.Running", "block 1.Running"),
        ("Housekeeping.Done", "block 2.Done"),
        ("$FirstScan", "ST0"),
        ("N0.ACC", "N0.ACC"),
    ] {
        assert_eq!(program.scope().address(name).unwrap().to_string(), address);
    }
    for (name, error) in [
        ("botles.Done", "nothing is called `botles` (did you mean `bottles.Done`?)"),
        ("Drain", "`Drain` is a block: `Drain.Running` is its bit"),
        ("close_in", "`close_in` is a constant, 2500: it has no address"),
        ("ct0.Done", "`ct0.Done` is in the wrong case (write `CT0.Done`)"),
    ] {
        assert_eq!(program.scope().address(name).unwrap_err(), error);
    }
}
