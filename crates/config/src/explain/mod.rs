//! Explanations of instructions (from the instruction table and the page of the instruction), of
//! functions of MATH, of findings (from their pages), of events of the log (from the catalogue) and
//! of files of the library.
//!
//! `rungd explain` prints them; an editor shows them at a name. This module only builds texts.

use std::fmt::Write as _;

mod library_page;
mod page;

pub use self::library_page::facts as library_facts;
pub use self::library_page::of_library;
use self::page::{indented, section, wrapped};
use rungd_engine::isa::function::{FunctionSpec, ResultType};
use rungd_engine::isa::instruction::{Mnemonic, Termination};
use rungd_engine::isa::{Function, LegName, OperandKind, Spec, dialects};
use rungd_language::source::finding::Code;
use rungd_runtime::events::{self, Event, LineLimit, Silence};

/// The sections of an instruction's page that are shown without a diagram.
const SECTIONS: [&str; 4] = ["Behaviour", "Termination", "Members", "Notes"];

/// The text for a mnemonic or function in any case, a finding's name, an event's name or code, or a
/// mnemonic of other controllers.
pub fn explanation(name: &str) -> Option<String> {
    if let Some(mnemonic) = Mnemonic::from_name(&name.to_ascii_uppercase()) {
        return Some(of_instruction(mnemonic.spec()));
    }
    let lower = name.to_ascii_lowercase();
    if let Some(function) = Function::from_name(&lower) {
        return Some(of_function(function.spec()));
    }
    let event = || events::named(&lower).or_else(|| events::coded(name)).map(of_event);
    Code::from_name(&lower).map(of_finding).or_else(event).or_else(|| of_other_controllers(name))
}

fn of_other_controllers(name: &str) -> Option<String> {
    let (instead, name) = (dialects::instead_of(name)?, name.to_ascii_uppercase());
    Some(format!(
        "{name} is an instruction of other controllers. In a ladder of rungd, {instead}.\n"
    ))
}

fn of_function(spec: &FunctionSpec) -> String {
    let result = match spec.result {
        ResultType::Kept => "an integer if all arguments are integers, else a real",
        ResultType::Integer => "an integer",
        ResultType::Real => "a real",
    };
    format!(
        "{}, a function of MATH and of contacts\n\n{}\nThe result is {result}.\n\n\
         See `rungd explain MATH`.\n",
        spec.form(),
        spec.summary
    )
}

fn of_event(event: &Event) -> String {
    let (code, name, level) = (event.code(), event.name, event.level.name());
    let mut text = format!("{name} ({code}), an event of the log, level {level}\n\n");
    for line in wrapped(event.meaning, 78) {
        let _ = writeln!(text, "{line}");
    }
    text.push('\n');
    for line in wrapped(&format!("What to do: {}", event.remedy), 78) {
        let _ = writeln!(text, "{line}");
    }
    if event.limit != LineLimit::NONE {
        let (burst, per_second) = (event.limit.burst, event.limit.per_second());
        let _ = writeln!(
            text,
            "\nAt most {burst} lines at once, then {per_second} a second; further lines are \
             counted (lines-withheld)."
        );
    }
    let silence = match event.silence {
        Silence::Never => "It stays in every log: `[log.events]` cannot silence it.".to_owned(),
        Silence::ByName => format!("`[log.events] {name} = \"off\"` leaves it out."),
        Silence::ByBlocks | Silence::ByStages => {
            format!("`[log] blocks` or `[log.events] {name} = \"off\"` leaves it out.")
        }
    };
    let _ = writeln!(text, "\n{silence}");
    let _ = writeln!(text, "\nIn the journal: journalctl -u rungd RUNGD_EVENT={name}");
    text
}

fn of_instruction(spec: &Spec) -> String {
    let mut text = format!("{}: {}\n\n", spec.name, spec.title);
    for line in wrapped(spec.summary, 78) {
        let _ = writeln!(text, "{line}");
    }
    let _ = write!(text, "\n{}", indented(&facts(spec)));
    let _ = writeln!(text, "\nExample:\n\n{}", indented(&example(spec)));
    let page = spec.page;
    text.push_str(&SECTIONS.map(|title| section(page, title)).concat());
    let file = spec.name.to_ascii_lowercase();
    let _ = writeln!(text, "With a timing diagram: docs/instructions/{file}.md");
    text
}

/// The explanation of an instruction as Markdown, without its diagram.
pub fn instruction_page(spec: &Spec) -> String {
    let mut text = format!("**{}**: {}\n\n{}\n", spec.name, spec.title, spec.summary);
    let _ = writeln!(text, "\n```text\n{}```", facts(spec));
    let _ = writeln!(text, "\n```toml\n{}```\n", example(spec));
    let page = spec.page;
    text + &SECTIONS.map(|title| section(page, title)).concat()
}

/// The facts in the table about an instruction, one per line. They are shown here and in the
/// instruction's page.
pub fn facts(spec: &Spec) -> String {
    let legs: Vec<&str> = spec.legs.iter().map(|leg| leg.key()).collect();
    let mut text = format!("form         {}\n", spec.form());
    let _ = writeln!(text, "legs         {}", legs.join(", "));
    for (at, operand) in spec.operands.iter().enumerate() {
        let head = if at == 0 { "operands" } else { "" };
        let optional = if operand.optional { ", or left out" } else { "" };
        let kind = describe(operand.kind, spec);
        let _ = writeln!(text, "{head:<12} {:<10} {kind}{optional}", operand.name);
    }
    let _ = writeln!(text, "termination  {}", termination(spec));
    let _ = writeln!(text, "source       {}", spec.source);
    text
}

/// The page of a finding without the marks for its test, and without the blank lines around them.
fn of_finding(code: Code) -> String {
    let mut lines: Vec<&str> = Vec::new();
    for line in code.row().page.lines().filter(|line| !line.starts_with("<!--")) {
        if !(line.is_empty() && lines.last().is_some_and(|last| last.is_empty())) {
            lines.push(line);
        }
    }
    lines.join("\n") + "\n"
}

fn termination(spec: &Spec) -> &'static str {
    match spec.termination {
        Termination::Off => "the bit it drives goes OFF",
        Termination::Reset if spec.operand("output").is_none() => "its structure is reset",
        Termination::Reset => "its structure is reset, and its output bit goes OFF",
        Termination::Kept => match spec.operands.last().map(|operand| operand.kind) {
            Some(OperandKind::WritableBit) => "none: the bit keeps its value",
            Some(OperandKind::WritableWord) => "none: the word keeps its value",
            Some(OperandKind::Target) => "none: the target keeps its value",
            Some(OperandKind::Array | OperandKind::Filling) => {
                "none: the elements keep their values"
            }
            Some(OperandKind::WritableBits) => "none: the bits keep their states",
            Some(OperandKind::Shifted) => "none: the bits keep their states, and CLK its history",
            Some(OperandKind::Counter | OperandKind::Timer | OperandKind::Sensaphone) => {
                "none: the structure keeps its values"
            }
            None
            | Some(
                OperandKind::Number
                | OperandKind::Value(..)
                | OperandKind::Duration
                | OperandKind::Interval
                | OperandKind::WritableArray
                | OperandKind::Bits
                | OperandKind::Program
                | OperandKind::Block
                | OperandKind::Task
                | OperandKind::Subroutine
                | OperandKind::Stage
                | OperandKind::Stages,
            ) => "none",
        },
        Termination::Untouched | Termination::Held | Termination::EnableOff => {
            "none: it keeps its value when its block stops"
        }
        Termination::RungOff => "as with its rung OFF",
    }
}

fn describe(kind: OperandKind, spec: &Spec) -> String {
    match kind {
        OperandKind::WritableBit => "a bit that a program can write: Y, C, MC, MI".to_owned(),
        OperandKind::WritableWord => {
            "a word that a program can write: V, D, R, MHR, MIR, .Acc".to_owned()
        }
        OperandKind::Target => {
            "a word or bit that a program can write, then `= expression`".to_owned()
        }
        OperandKind::Array => {
            "an array, a slice or a range: recipe, recipe[0..6], D0..D9; or a record: recipe[2]"
                .to_owned()
        }
        OperandKind::WritableArray if spec.mnemonic == Mnemonic::Fill => {
            "an array, a slice or a range that a program can write".to_owned()
        }
        OperandKind::WritableArray => {
            "a writable array, slice or range of the same length and kind; or a record of the \
             same type"
                .to_owned()
        }
        OperandKind::Bits => "an array, a slice or a range of bits: lamps, C0..C7".to_owned(),
        OperandKind::WritableBits => {
            "an array, a slice or a range of bits that a program can write".to_owned()
        }
        OperandKind::Shifted => {
            "an array, slice or range of bits that a program can write; C7..C0 runs down".to_owned()
        }
        OperandKind::Filling => "a constant or a word; for bits 0, 1 or a bit".to_owned(),
        OperandKind::Counter => "a counter: CTn".to_owned(),
        OperandKind::Timer => "a timer: Tn".to_owned(),
        OperandKind::Sensaphone => "a Sensaphone counter: Nn".to_owned(),
        OperandKind::Number => "a constant or a word".to_owned(),
        OperandKind::Value(i32::MIN, i32::MAX) => "a constant or a word, not a real".to_owned(),
        OperandKind::Value(least, most) => format!("a constant {least}..{most}, or a word"),
        OperandKind::Duration => "a duration, or a word that holds ms".to_owned(),
        OperandKind::Interval => "a duration, or a word that holds ms; 0: every scan".to_owned(),
        OperandKind::Program => "a program".to_owned(),
        OperandKind::Block => "a program or a task".to_owned(),
        OperandKind::Task => "a task".to_owned(),
        OperandKind::Subroutine => "a subroutine".to_owned(),
        OperandKind::Stage => "a stage of the same program".to_owned(),
        OperandKind::Stages => "one or more stages of the same program".to_owned(),
    }
}

/// A rung with the instruction, ready to be pasted.
fn example(spec: &Spec) -> String {
    let mut words = vec![spec.name.to_owned()];
    for operand in spec.operands {
        let value = match operand.kind {
            OperandKind::WritableBit => "Y0",
            OperandKind::WritableWord => "D0",
            OperandKind::Target => "D0 = (D1 + D2) / 2",
            OperandKind::Array => "D10..D16",
            OperandKind::WritableArray => "D20..D26",
            OperandKind::Bits | OperandKind::WritableBits | OperandKind::Shifted => "C0..C7",
            OperandKind::Filling => "0",
            OperandKind::Counter => "CT0",
            OperandKind::Timer => "T0",
            OperandKind::Sensaphone => "N0",
            OperandKind::Value(..) if operand.name == "dn-preset" => "0",
            OperandKind::Number | OperandKind::Value(..) => "12",
            OperandKind::Duration => "2s500ms",
            OperandKind::Interval => "1s",
            OperandKind::Program | OperandKind::Block => "Drain",
            OperandKind::Task => "Housekeeping",
            OperandKind::Subroutine => "Dose",
            OperandKind::Stage => "Close",
            OperandKind::Stages => "Left Right",
        };
        words.push(match operand.key {
            Some(key) => format!("{key}={value}"),
            None => value.to_owned(),
        });
    }
    // RETURN stands in subroutines alone.
    let element = if spec.mnemonic == Mnemonic::Return { "subroutine" } else { "program" };
    let mut lines = vec![format!("[[{element}.rung]]")];
    for (at, leg) in spec.legs.iter().enumerate() {
        let key = match leg {
            LegName::When => "when".to_owned(),
            LegName::Up
            | LegName::Dn
            | LegName::Rst
            | LegName::En
            | LegName::Data
            | LegName::Clk => {
                format!("leg.{}", leg.key())
            }
        };
        lines.push(format!("{key:<7} = [\"X{at}\"]"));
    }
    lines.push(format!("{:<7} = [\"{}\"]", "do", words.join(" ")));
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_base::calendar::LocalTime;
    use rungd_engine::isa::instruction;
    use rungd_engine::{Engine, ScanTimes};
    use rungd_language::lower::lower;
    use rungd_language::resolve::{LoadOptions, load_ladders};
    use rungd_language::source::finding;
    use rungd_language::source::span::SourceFile;

    /// The blocks that some instructions name; then the Stages that some instructions name.
    const AROUND: &str = "[[program]]\nname = \"Drain\"\n[[task]]\nname = \"Housekeeping\"\n\
                          [[subroutine]]\nname = \"Dose\"\n";
    const STAGES: &str = "[[program.stage]]\nname = \"Close\"\n[[program.stage]]\nname = \"Left\"\n\
                          [[program.stage]]\nname = \"Right\"\n";

    #[test]
    fn every_example_can_be_pasted_and_executes() {
        for spec in instruction::TABLE {
            let example = example(spec);
            let text = match example.starts_with("[[subroutine") {
                true => format!("[[program]]\nname = \"Main\"\n{AROUND}{example}"),
                false => format!("[[program]]\nname = \"Main\"\n{example}{STAGES}{AROUND}"),
            };
            let file = SourceFile { name: "example.toml".into(), text };
            let (program, findings) = load_ladders(&[file], &LoadOptions::default());
            let program = program.unwrap_or_else(|| panic!("{example}{findings:#?}"));
            let mut engine = Engine::new(lower(&program).0);
            engine.start(0);
            engine.set_input(0, true);
            for _ in 0..2 {
                engine.begin_scan(0, &ScanTimes::default(), &LocalTime::default());
                engine.execute();
            }
            let stops = engine.execute().last;
            assert_eq!(stops, spec.name == "STOP", "{} stops the controller", spec.name);
            engine.terminate();
        }
    }

    #[test]
    fn an_event_is_explained_by_name_and_by_code() {
        let text = explanation("modbus-gone").unwrap_or_default();
        assert_eq!(explanation("rungd-0704").as_ref(), Some(&text));
        expect_test::expect![[r#"
            modbus-gone (RUNGD-0704), an event of the log, level info

            A Modbus client closed its connection, was silent for too long, or was lost.

            What to do: Nothing. If a client comes and goes all the time, look at the
            client.

            At most 20 lines at once, then 1 a second; further lines are counted (lines-withheld).

            `[log.events] modbus-gone = "off"` leaves it out.

            In the journal: journalctl -u rungd RUNGD_EVENT=modbus-gone
        "#]]
        .assert_eq(&text);
    }

    #[test]
    fn no_event_has_the_name_of_a_finding() {
        assert!(events::all().all(|event| Code::from_name(event.name).is_none()));
    }

    #[test]
    fn an_instruction_is_explained() {
        let text = explanation("cnt").unwrap_or_default();
        let (table, page) = text.split_once("## ").unwrap_or_default();
        expect_test::expect![[r#"
            CNT: Up counter

            Adds one at each rising edge of UP. Done while .Acc >= preset; continues to
            count beyond the preset. RST holds .Acc at 0 and has priority.

              form         CNT ct preset=v
              legs         up, rst
              operands     ct         a counter: CTn
                           preset     a constant 0..2147483647, or a word
              termination  its structure is reset
              source       the Do-more help, topic DMD0030 (CNT)

            Example:

              [[program.rung]]
              leg.up  = ["X0"]
              leg.rst = ["X1"]
              do      = ["CNT CT0 preset=12"]

        "#]]
        .assert_eq(table);
        let headings: Vec<&str> = page.lines().filter(|l| l.starts_with("## ")).collect();
        assert_eq!(headings, ["## Termination", "## Members", "## Notes"]);
        assert!(page.starts_with("Behaviour\n"));
        assert!(text.ends_with("\n\nWith a timing diagram: docs/instructions/cnt.md\n"));
        assert!(!text.contains("<!--") && !text.contains("](") && !text.contains("```"));
    }

    #[test]
    fn every_finding_has_an_explanation() {
        for row in finding::TABLE {
            assert!(explanation(row.name).is_some_and(|text| text.contains(row.name)));
        }
        assert_eq!(explanation("no-such-thing"), None);
    }

    #[test]
    fn an_instruction_of_other_controllers_is_explained_by_its_equivalent() {
        for (name, words) in [
            ("TON", "`TMR t preset=d`"),
            ("ote", "`OUT b`"),
            ("XIO", "`!`"),
            ("MUL", "`MATH D0 = D1 * D2 / 100`"),
            ("DIV", "`MATH D0 = D1 * D2 / 100`"),
            ("MULD", "`MATH D0 = D1 * D2 / 100`"),
            ("SUBROUTINE", "`CALL s`"),
            ("JSR", "`CALL s`"),
            ("SHFT", "`SR C0..C7`"),
            ("DRUM", "a Stage for each step"),
        ] {
            let text = explanation(name).unwrap_or_default();
            assert!(text.contains(words) && text.contains("other controllers"), "{name}: {text}");
        }
    }
}
