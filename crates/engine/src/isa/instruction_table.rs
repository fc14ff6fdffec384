//! The rows of the instruction table: every mnemonic with its page, legs, operands, source and a
//! summary.
//!
//! `columns` has the types of the columns, `instruction` the questions that other modules ask. The
//! role of an operand says what an execution does with it; nothing else lists what an instruction
//! reads, writes, owns, enters or starts.

use super::columns::{LegName, OperandKind, OperandSpec, Termination};
use super::role::OperandRole::{self, *};

/// One row of the instruction table.
#[derive(Debug)]
pub struct Spec {
    /// The instruction.
    pub mnemonic: Mnemonic,
    /// The mnemonic as written.
    pub name: &'static str,
    /// Its page of `docs/instructions/`, compiled into the program, so that the page's version is
    /// the program's.
    pub page: &'static str,
    /// The instruction's full name.
    pub title: &'static str,
    /// Its legs, in their order.
    pub legs: &'static [LegName],
    /// Its operands, positional ones first.
    pub operands: &'static [OperandSpec],
    /// Whether it needs several scans to finish (the vendor's yellow triangle).
    pub multi_scan: bool,
    /// The effect of a termination pass on it.
    pub termination: Termination,
    /// The source of its behaviour.
    pub source: &'static str,
    /// Its behaviour, in two or three sentences.
    pub summary: &'static str,
}

const fn positional(name: &'static str, role: OperandRole, kind: OperandKind) -> OperandSpec {
    OperandSpec { key: None, name, role, kind, optional: false }
}

const fn keyed(name: &'static str, role: OperandRole, kind: OperandKind) -> OperandSpec {
    OperandSpec { key: Some(name), name, role, kind, optional: false }
}

const fn optional(name: &'static str, role: OperandRole, kind: OperandKind) -> OperandSpec {
    OperandSpec { key: Some(name), name, role, kind, optional: true }
}

const fn bit(role: OperandRole) -> OperandSpec {
    positional("bit", role, OperandKind::WritableBit)
}

const ANY: OperandKind = OperandKind::Value(i32::MIN, i32::MAX);
const NUMBER: OperandKind = OperandKind::Number;
const COUNT: OperandKind = OperandKind::Value(0, i32::MAX);
const I16: OperandKind = OperandKind::Value(-32_768, 32_767);

const WHEN: &[LegName] = &[LegName::When];
const DRIVEN: &[OperandSpec] = &[bit(Drives)];
const UP_DOWN_PRESETS: &[OperandSpec] = &[
    positional("ct", Owns, OperandKind::Counter),
    optional("up-preset", Reads, ANY),
    optional("dn-preset", Reads, ANY),
];
const TIMER: &[OperandSpec] =
    &[positional("t", Owns, OperandKind::Timer), keyed("preset", Reads, OperandKind::Duration)];
const DELAY: &[OperandSpec] = &[
    positional("t", Owns, OperandKind::Timer),
    keyed("preset", Reads, OperandKind::Duration),
    keyed("output", Drives, OperandKind::WritableBit),
];
const COUNTER: &[OperandSpec] =
    &[positional("ct", Owns, OperandKind::Counter), keyed("preset", Reads, COUNT)];
const SENSAPHONE: &[OperandSpec] =
    &[positional("n", Owns, OperandKind::Sensaphone), optional("preset", Reads, I16)];
const STORED: OperandSpec = keyed("to", Stores, OperandKind::WritableWord);
const ARITHMETIC: &[OperandSpec] =
    &[positional("a", Reads, NUMBER), positional("b", Reads, NUMBER), STORED];

const STORED_ARRAY: OperandSpec = keyed("to", Stores, OperandKind::WritableArray);
const COPIED: &[OperandSpec] = &[positional("from", Reads, OperandKind::Array), STORED_ARRAY];
const FILLED: &[OperandSpec] = &[positional("value", Reads, OperandKind::Filling), STORED_ARRAY];
const PACKED: &[OperandSpec] = &[positional("bits", Reads, OperandKind::Bits), STORED];
const UNPACKED: &[OperandSpec] =
    &[positional("word", Reads, ANY), keyed("to", Stores, OperandKind::WritableBits)];
const SHIFTED: &[LegName] = &[LegName::Data, LegName::Clk, LegName::Rst];

const PROGRAM: &[OperandSpec] = &[positional("block", Starts, OperandKind::Program)];
const ENABLED: &[OperandSpec] = &[
    positional("block", Enables, OperandKind::Task),
    optional("every", Reads, OperandKind::Interval),
];
const CONVERGED: &[OperandSpec] =
    &[positional("stage", Awaits, OperandKind::Stages), keyed("to", Enters, OperandKind::Stage)];

const HELP: &str = "the Do-more help; docs/semantics.md";
const SENSAPHONE_MANUAL: &str = "the Sensaphone SCADA 3000 manual, page 15-9";
const BLOCKS: &str = "docs/semantics.md, section 4";
const SUBROUTINES: &str = "docs/semantics.md, Subroutines";

macro_rules! instructions {
    ($($mnemonic:ident $name:literal $page:literal $title:literal, $legs:expr, $operands:expr,
       $multi:literal, $termination:ident, $source:expr, $summary:literal;)*) => {
        /// Every instruction.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[allow(missing_docs)]
        pub enum Mnemonic { $($mnemonic),* }

        /// The table, in the order of the language reference.
        pub static TABLE: &[Spec] = &[$(Spec {
            mnemonic: Mnemonic::$mnemonic,
            name: $name,
            page: include_str!(concat!("../../../../docs/instructions/", $page, ".md")),
            title: $title,
            legs: $legs,
            operands: $operands,
            multi_scan: $multi,
            termination: Termination::$termination,
            source: $source,
            summary: $summary,
        }),*];
    };
}

instructions! {
    Out "OUT" "out" "Output coil", WHEN, DRIVEN, false, Off, HELP,
        "Writes the rung's power to the bit, ON and OFF, at every execution.";
    Set "SET" "set" "Set coil", WHEN, &[bit(TurnsOn)], false, Kept, HELP,
        "Turns the bit ON while the rung is ON. The bit stays ON until something turns it OFF.";
    Rst "RST" "rst" "Reset coil", WHEN, &[bit(TurnsOff)], false, Kept, HELP,
        "Turns the bit OFF while the rung is ON.";
    Pd "PD" "pd" "Positive differential", WHEN, DRIVEN, false, Off, HELP,
        "The bit is ON for the one execution that sees the rung go from OFF to ON.";
    Nd "ND" "nd" "Negative differential", WHEN, DRIVEN, false, Off, HELP,
        "The bit is ON for the one execution that sees the rung go from ON to OFF.";
    Ponoff "PONOFF" "ponoff" "Push ON, push OFF", WHEN, &[bit(Changes)], false, Kept, HELP,
        "Toggles the bit each time the rung goes from OFF to ON.";
    Cnt "CNT" "cnt" "Up counter", &[LegName::Up, LegName::Rst], COUNTER, true, Reset,
        "the Do-more help, topic DMD0030 (CNT)",
        "Adds one at each rising edge of UP. Done while .Acc >= preset; continues to count beyond \
         the preset. RST holds .Acc at 0 and has priority.";
    Cntdn "CNTDN" "cntdn" "Down counter", &[LegName::Dn, LegName::Rst], COUNTER, true, Reset,
        "the Do-more help, topic DMD0031 (CNTDN)",
        "Starts from the preset and subtracts one at each rising edge of DN. Done while .Acc <= 0; \
         continues to count below 0. RST puts .Acc back to the preset and has priority.";
    Udc "UDC" "udc" "Up/down counter", &[LegName::Up, LegName::Dn, LegName::Rst], UP_DOWN_PRESETS,
        true, Reset, "the Do-more help on UDC, and topic DMD0094 (UDCG)",
        "Counts up at UP's rising edges, down at DN's. Done while .Acc >= up-preset, DnDone \
         while .Acc <= dn-preset, each if given. RST holds .Acc at 0.";
    Udcg "UDCG" "udcg" "Global up/down counter", &[LegName::Up, LegName::Dn], UP_DOWN_PRESETS, true,
        Untouched, "the Do-more help, topic DMD0094 (UDCG)",
        "Like UDC, but without a reset leg and without termination logic: it keeps its count when \
         its block stops. RSTCT is the only way to reset it.";
    Rstct "RSTCT" "rstct" "Reset counter", WHEN, &[positional("ct", Resets, OperandKind::Counter)],
        false, Kept, HELP,
        "While the rung is ON, resets the counter at once, and holds the reset through the \
         counter's own next execution.";
    Rstt "RSTT" "rstt" "Reset timer", WHEN,
        &[positional("t", Resets, OperandKind::Timer)], false, Kept, HELP,
        "While the rung is ON, resets the timer at once, and holds the reset through the timer's \
         own next execution.";
    Ondtmr "ONDTMR" "ondtmr" "ON delay timer", WHEN, DELAY, true, Reset,
        "the Do-more help, topic DMD0175 (ONDTMR)",
        "The output comes ON when the leg has been ON for the preset time, and goes OFF with the \
         leg.";
    Offdtmr "OFFDTMR" "offdtmr" "OFF delay timer", WHEN, DELAY, true, Reset,
        "the Do-more help, topic DMD0174 (OFFDTMR)",
        "The output comes ON with the leg and stays ON for the preset time after the leg went OFF. \
         .Acc counts down.";
    Tmr "TMR" "tmr" "Up timer", WHEN, TIMER, true, Reset, HELP,
        "Times while the leg is ON; Done while .Acc >= preset. It is reset while the leg is OFF.";
    Tmrdown "TMRDOWN" "tmrdown" "Down timer", WHEN, TIMER, true, Reset, HELP,
        "Times from the preset down to 0 while the leg is ON; Done at 0. It is reloaded while the \
         leg is OFF.";
    Tmra "TMRA" "tmra" "Accumulating up timer",
        &[LegName::En, LegName::Rst], TIMER, true, Reset, HELP,
        "Adds up the time that EN is ON, and keeps it while EN is OFF. Done while .Acc >= preset. \
         RST resets .Acc to 0.";
    Tmradown "TMRADOWN" "tmradown" "Accumulating down timer",
        &[LegName::En, LegName::Rst], TIMER, true, Reset, HELP,
        "Subtracts the time that EN is ON from the preset, and keeps the rest while EN is OFF. \
         Done at 0. RST reloads the preset.";
    Tmrag "TMRAG" "tmrag" "Global accumulating up timer", WHEN, TIMER, true, Held, HELP,
        "Like TMRA, but without a reset leg and without termination logic. RSTT resets it.";
    Ctu "CTU" "ctu" "Sensaphone count up", WHEN, SENSAPHONE, true, EnableOff,
        SENSAPHONE_MANUAL,
        "Adds 1 to ACC at each false-to-true transition of the rung; after 32767 comes -32768, \
         which sets OV. DN while ACC >= PRE.";
    Ctd "CTD" "ctd" "Sensaphone count down", WHEN, SENSAPHONE, true, EnableOff,
        SENSAPHONE_MANUAL,
        "Subtracts 1 from ACC at each false-to-true transition of the rung; after -32768 comes \
         32767, which sets UN. DN while ACC >= PRE.";
    Res "RES" "res" "Sensaphone reset", WHEN,
        &[positional("n", Resets, OperandKind::Sensaphone)], false, Kept,
        SENSAPHONE_MANUAL,
        "While the rung is ON, clears ACC and all status bits of the counter.";
    Move "MOVE" "move" "Move", WHEN,
        &[positional("a", Reads, NUMBER), STORED], false, Kept, HELP,
        "Copies the value to the word in every scan while the rung is ON, saturating at the \
         word's range. In a word of whole numbers, a real is truncated towards zero.";
    Add "ADD" "add" "Add", WHEN, ARITHMETIC, false, Kept, HELP,
        "Writes a + b to the word in every scan while the rung is ON, saturating. If a or b is a \
         real, the sum is a real; a word of whole numbers gets it truncated towards zero.";
    Sub "SUB" "sub" "Subtract", WHEN, ARITHMETIC, false, Kept, HELP,
        "Writes a - b to the word in every scan while the rung is ON, saturating. If a or b is a \
         real, the result is a real; a word of whole numbers gets it truncated towards zero.";
    Math "MATH" "math" "Calculate", WHEN,
        &[positional("target", Stores, OperandKind::Target)], false, Kept, HELP,
        "Evaluates the expression and stores the result in every scan while the rung is ON. \
         Results saturate at their limits; status bits report what happened.";
    Copy "COPY" "copy" "Copy array or record", WHEN, COPIED, false, Kept,
        "docs/semantics.md, sections 9 and 13",
        "Copies each element, or each field of a record, to its counterpart in every scan while \
         the rung is ON, like MOVE, as if all were read first.";
    Fill "FILL" "fill" "Fill array", WHEN, FILLED, false, Kept, "docs/semantics.md, section 9",
        "Writes the value, read once, to each element in every scan while the rung is ON.";
    Pack "PACK" "pack" "Pack bits", WHEN, PACKED, false, Kept, "docs/semantics.md, section 11",
        "Writes the bits to the word in every scan while the rung is ON: the first is its lowest \
         bit, and bits of the word beyond the last are 0.";
    Unpack "UNPACK" "unpack" "Unpack bits", WHEN, UNPACKED, false, Kept,
        "docs/semantics.md, section 11",
        "Writes the bits of the word, the lowest first, to the elements in every scan while the \
         rung is ON.";
    Sr "SR" "sr" "Shift register", SHIFTED,
        &[positional("bits", Changes, OperandKind::Shifted)], true,
        Untouched, "docs/semantics.md, section 9",
        "At the rising edge of CLK every bit takes the state of the bit before it, and the first \
         bit the state of DATA. RST turns all OFF and has priority. No termination logic.";
    Run "RUN" "run" "Run program", WHEN, PROGRAM, false, Kept, BLOCKS,
        "Starts the Program while the rung is ON; no effect on a Program that is running.";
    Restart "RESTART" "restart" "Restart program", WHEN, PROGRAM, false,
        Kept, BLOCKS,
        "At the rung's rising edge: HALT, then RUN. The Program terminates first and then starts \
         again.";
    Halt "HALT" "halt" "Halt program or task", WHEN,
        &[positional("block", Stops, OperandKind::Block)],
        false, Kept, BLOCKS,
        "Stops the Program or Task while the rung is ON; its termination pass follows at its \
         next turn. In its own block it ends the execution at once.";
    Exit "EXIT" "exit" "Exit program", WHEN, &[], false, Kept, BLOCKS,
        "Ends its own Program at once; its termination pass follows in the next scan.";
    Entask "ENTASK" "entask" "Enable task", WHEN,
        ENABLED, true, RungOff,
        BLOCKS,
        "Without every: runs the Task once at the rung's rising edge. With every: runs it at \
         that interval while the rung is ON.";
    Call "CALL" "call" "Call subroutine", WHEN,
        &[positional("block", Calls, OperandKind::Subroutine)], false, Kept, SUBROUTINES,
        "Executes the rungs of the subroutine at once while the rung is ON, once for each CALL \
         that is executed.";
    Return "RETURN" "return" "Return from subroutine", WHEN, &[], false, Kept, SUBROUTINES,
        "Ends this execution of its own subroutine: what follows in it is not executed.";
    Jmp "JMP" "jmp" "Jump to stage", WHEN,
        &[positional("stage", Enters, OperandKind::Stage)], false, Kept, BLOCKS,
        "Turns its own Stage OFF and the target ON. It is not a goto: the remaining rungs of the \
         Stage still execute.";
    Sgset "SGSET" "sgset" "Stage set", WHEN,
        &[positional("stage", Starts, OperandKind::Stage)], false, Kept, BLOCKS,
        "Turns a Stage ON without leaving the current one.";
    Sgrst "SGRST" "sgrst" "Stage reset", WHEN,
        &[positional("stage", Stops, OperandKind::Stage)], false, Kept, BLOCKS,
        "Turns a Stage OFF; its termination pass follows at its next turn.";
    Sgdivrg "SGDIVRG" "sgdivrg" "Stage diverge", WHEN,
        &[positional("stage", Enters, OperandKind::Stages)],
        false, Kept, BLOCKS,
        "Jumps to one or several Stages at once.";
    Sgconvrg "SGCONVRG" "sgconvrg" "Stage converge", WHEN,
        CONVERGED, false, Kept, BLOCKS,
        "Once all of its Stages are ON, turns them OFF and its target ON.";
    Stop "STOP" "stop" "Stop", WHEN, &[], false, Kept, BLOCKS,
        "An orderly stop: this scan completes, and the next one is the last.";
}
