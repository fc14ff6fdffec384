//! Findings as data: errors and warnings about a file.
//!
//! Made by the readers, the resolver and the checks; printed by `render`. A finding reports a
//! mistake of the file's author; the search for further findings continues after it. Faults at run
//! time and failures of the environment have their own types, in different modules.
//!
//! A finding is small, whatever the file contains: its texts are bounded here, and the search for
//! the nearest known name runs only when the finding is shown.

use std::borrow::Cow;

use super::fix::{Fix, FixEdit, Help, possible, propose, write};
use super::nearest::{KnownNames, UnknownName};
use super::span::Span;
use super::wording::bounded_line;

/// How severe a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The load is refused.
    Error,
    /// The load is refused only with `--deny warnings`.
    Warning,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The kind of finding, with its stable name.
    pub code: Code,
    /// Its place.
    pub span: Span,
    /// The mistake, in one sentence.
    pub message: String,
    /// A few words under the underlined place.
    pub label: String,
    /// Related places, each with a few words.
    pub related: Vec<(Span, String)>,
    /// What to write instead.
    help: Option<Box<Help>>,
    /// For an unknown name: the nearest known name replaces the help, if there is one.
    near: Option<Box<UnknownName>>,
}

/// Maximum number of related places of one finding.
pub(crate) const RELATED_MAX: usize = 16;

impl Finding {
    /// A finding with no related place and no help yet.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Finding {
        Finding {
            code,
            span,
            message: bounded_line(message.into()),
            label: String::new(),
            related: Vec::new(),
            help: None,
            near: None,
        }
    }

    /// Sets the words under the place.
    pub fn label(mut self, label: impl Into<String>) -> Finding {
        self.label = bounded_line(label.into());
        self
    }

    /// Sets the help: what to write instead.
    pub fn help(mut self, help: impl Into<Help>) -> Finding {
        self.help = Some(Box::new(help.into().bounded()));
        self
    }

    /// Sets the help: to write this text.
    pub fn write(self, fix: impl Into<Fix>) -> Finding {
        self.help(write(fix))
    }

    /// As [`Finding::write`], for the author to decide.
    pub fn propose(self, fix: impl Into<Fix>) -> Finding {
        self.help(propose(fix))
    }

    /// Adds a fix that the words of the help, or of the message, describe.
    pub fn fix(self, fix: impl Into<Fix>) -> Finding {
        self.fixes([fix])
    }

    /// Adds several fixes.
    pub fn fixes<F: Into<Fix>>(mut self, fixes: impl IntoIterator<Item = F>) -> Finding {
        let help = self.help.take().map_or_else(Help::default, |help| *help);
        self.help = Some(Box::new(help.with_all(fixes).bounded()));
        self
    }

    /// Adds that its place can be left out: the author decides whether it is needed.
    pub fn or_omit(self) -> Finding {
        self.fix(possible(FixEdit::Omit))
    }

    /// Adds that the row at its place can be deleted.
    pub fn or_delete_row(self) -> Finding {
        self.fix(possible(FixEdit::DeleteRow))
    }

    /// Replaces the help, if that is to declare a name.
    pub fn declared_as(self, help: impl FnOnce() -> Help) -> Finding {
        let declares = |fix: &Fix| matches!(fix.edits[..], [FixEdit::Declare(_)]);
        match self.help.as_ref().is_some_and(|help| help.fixes.iter().any(declares)) {
            true => self.help(help()),
            false => self,
        }
    }

    /// The same finding with the help of a different finding.
    pub fn with_help_of(self, other: Finding) -> Finding {
        Finding { help: other.help, near: other.near, ..self }
    }

    /// If one of the known names is near to `name`, it replaces the help.
    pub fn near(mut self, name: &str, known: &KnownNames) -> Finding {
        self.near = Some(Box::new(UnknownName::new(name, known)));
        self
    }

    /// As [`Finding::near`], with the result of a look-up.
    pub fn near_any(mut self, near: Option<Box<UnknownName>>) -> Finding {
        self.near = near;
        self
    }

    /// As [`Finding::near`], before the search that the finding has already: if one of these names
    /// is near, the other names are not searched.
    pub(crate) fn near_first(mut self, name: &str, known: &KnownNames) -> Finding {
        let near = UnknownName::new(name, known).or(self.near.take());
        self.near = Some(Box::new(near));
        self
    }

    /// The help: what to write instead. Searches for the nearest name, so call it only for findings
    /// that are shown.
    pub fn advice(&self) -> Option<Cow<'_, Help>> {
        let near = self.near.as_ref().and_then(|near| near.help()).map(Cow::Owned);
        near.or_else(|| self.help.as_deref().map(Cow::Borrowed))
    }

    /// The words of its help, as [`Finding::advice`]; `None` if it has only fixes.
    pub fn help_text(&self) -> Option<Cow<'_, str>> {
        let words = match self.advice()? {
            Cow::Owned(help) => Cow::Owned(help.text),
            Cow::Borrowed(help) => Cow::Borrowed(help.text.as_str()),
        };
        Some(words).filter(|words| !words.is_empty())
    }

    /// Adds a related place, up to `RELATED_MAX`.
    pub fn related(mut self, span: Span, words: impl Into<String>) -> Finding {
        if self.related.len() < RELATED_MAX {
            self.related.push((span, bounded_line(words.into())));
        }
        self
    }

    /// Changes its message, its label and its help.
    pub(crate) fn reword(&mut self, change: impl Fn(&str) -> String) {
        let texts = [&mut self.message, &mut self.label];
        texts.into_iter().for_each(|text| *text = change(text));
        self.reword_help(change);
    }

    /// Changes the words of its help, and the texts to write.
    pub(crate) fn reword_help(&mut self, change: impl Fn(&str) -> String) {
        self.help.iter_mut().for_each(|help| help.reword(&change));
    }

    /// Its severity.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}

/// One row of the table of findings.
#[derive(Debug)]
pub struct FindingRow {
    /// The finding's code.
    pub code: Code,
    /// The stable kebab-case name.
    pub name: &'static str,
    /// Error or warning.
    pub severity: Severity,
    /// Its meaning, in one sentence.
    pub summary: &'static str,
    /// Its page, `docs/findings/NAME.md`, as `rungd explain` prints it.
    pub page: &'static str,
}

macro_rules! findings {
    ($($code:ident $name:literal $severity:ident $summary:literal;)*) => {
        /// Every finding.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[allow(missing_docs)]
        pub enum Code { $($code),* }

        /// The table of findings: errors first, then warnings.
        pub static TABLE: &[FindingRow] = &[$(FindingRow {
            code: Code::$code,
            name: $name,
            severity: Severity::$severity,
            summary: $summary,
            page: include_str!(concat!("../../../../docs/findings/", $name, ".md")),
        }),*];
    };
}

findings! {
    // reading
    TomlSyntax "toml-syntax" Error "The file is not TOML 1.0.";
    UnknownKey "unknown-key" Error "A table has an unknown key.";
    WrongType "wrong-type" Error "A value is not of the type that its key wants.";
    BareString "bare-string" Error "Contacts and instructions are always arrays.";
    MissingKey "missing-key" Error "A required key is missing.";
    OutOfPlace "out-of-place" Error
        "A header comes after its parent was closed, and would join an earlier parent.";
    ContactSyntax "contact-syntax" Error "A contact does not follow the grammar.";
    InstructionSyntax "instruction-syntax" Error "An instruction does not follow its form.";
    ExpressionSyntax "expression-syntax" Error "An expression does not follow the grammar.";
    EmptyLeg "empty-leg" Error "A series of contacts is empty; a rung that is always ON has $On.";
    NoInstruction "no-instruction" Error "A rung or branch drives nothing.";
    ImportedTodo "imported-todo" Error
        "A rung stands in place of one that an import could not translate.";
    MixedLegs "mixed-legs" Error "A rung has both `when` and `leg.*`, or neither.";
    ForbiddenName "forbidden-name" Error "A name is invalid, or already means something else.";
    DuplicateName "duplicate-name" Error "Two things have the same name.";
    BadDuration "bad-duration" Error "A duration is not of the form 1h2m3s4ms or HH:MM:SS:mmm.";
    // resolving
    UnknownInstruction "unknown-instruction" Error "There is no such instruction.";
    UnknownOperand "unknown-operand" Error "The instruction has no such operand, or too many.";
    MissingOperand "missing-operand" Error "The instruction lacks an operand.";
    UnknownName "unknown-name" Error "There is no tag, address or nickname of this name.";
    UnknownMember "unknown-member" Error "The structure or block has no such member.";
    UnknownBlock "unknown-block" Error "There is no program or task of this name.";
    UnknownStage "unknown-stage" Error "The program has no stage of this name.";
    WrongCase "wrong-case" Error "An address, mnemonic or nickname has the wrong case.";
    BeyondMemory "beyond-memory" Error "The address lies beyond the memory block.";
    MemoryFull "memory-full" Error "Memory has no room for all tags with a `type`.";
    UnknownFunction "unknown-function" Error "MATH has no function of this name.";
    FunctionArguments "function-arguments" Error "A function has too few or too many arguments.";
    OperandType "operand-type" Error "An operand is of the wrong kind, as a bit instead of a word.";
    OutOfRange "out-of-range" Error "A constant lies outside the range of its place.";
    WriteToInput "write-to-input" Error "X bits are written by inputs only.";
    ReadOnly "read-only" Error "A program cannot write this bit, word or member.";
    UnknownLeg "unknown-leg" Error "The instruction has no such leg.";
    MissingLeg "missing-leg" Error "The instruction has a leg that is missing in the rung.";
    LegsShared "legs-shared" Error
        "An instruction with legs stands alone in its rung, without branches.";
    Order "order" Error "`order` names every block once.";
    // templates
    UnknownTemplate "unknown-template" Error "There is no template of this name.";
    TemplateArgument "template-argument" Error
        "An argument of a use is missing, unknown or of the wrong type.";
    TemplateParameter "template-parameter" Error
        "A parameter is at a place that does not accept its type, or its default does not fit.";
    TemplateRule "template-rule" Error "A template or a use breaks a rule of templates.";
    TemplateRecursion "template-recursion" Error "A template uses itself.";
    TemplateSize "template-size" Error "The uses of templates expand to too much, or templates are \
                                        nested too deeply.";
    TagKey "tag-key" Error "A key of a tag does not fit the meaning of the tag.";
    // rules over the whole program
    OwnedTwice "owned-twice" Error "A structure has exactly one owning instruction.";
    ResetWithoutOwner "reset-without-owner" Error "A reset of a structure without an owner.";
    SensaphonePreset "sensaphone-preset" Error
        "CTU and CTD state no preset, or different ones.";
    JumpOutsideStage "jump-outside-stage" Error "JMP and SGDIVRG stand in a stage.";
    BuiltInTask "built-in-task" Error "Nothing starts, stops or orders a built-in task.";
    StageInTask "stage-in-task" Error "A task contains no stages.";
    BlockRule "block-rule" Error "EXIT, RUN, RESTART or HALT where the block does not allow it.";
    SubroutineRule "subroutine-rule" Error
        "RETURN stands in a subroutine, EXIT does not, and only CALL acts on one.";
    SubroutineNesting "subroutine-nesting" Error
        "A subroutine calls itself, or more than 16 are active at once.";
    SubroutineRungs "subroutine-rungs" Error
        "CALLs let a scan execute more than 10,000,000 rungs.";
    EntaskConflict "entask-conflict" Error
        "A task is enabled by one recurrent ENTASK, or run once by any number of ENTASKs, never \
         both.";
    DuplicateOut "duplicate-out" Error
        "Two OUTs drive one bit within one block's own rungs or one stage.";
    LimitedWordBit "limited-word-bit" Error
        "An instruction writes a bit of a word that a tag limits.";
    RetainRange "retain-range" Error "A retained range is not data or structures.";
    NoMain "no-main" Error "A program has a block `Main`.";
    Controller "controller" Error "A controller file contains a setting that is impossible.";
    Edge "edge-file" Error "The file of an edge node contains a setting that is impossible.";
    OpcUa "opcua-file" Error
        "The file of an OPC UA server contains a setting that is impossible.";
    UnknownEvent "unknown-event" Error "The log has no event of this name.";
    KeptEvent "kept-event" Error "A controller file silences an event that must stay in the log.";
    TestFile "test-file" Error "A test file contains a setting that is impossible.";
    TestStep "test-step" Error
        "A step of a test has the wrong form, or is impossible.";
    // warnings
    OutElsewhere "out-elsewhere" Warning "Two OUTs in different places drive one bit.";
    WholeWordOverOut "whole-word-over-out" Warning
        "A whole word is written, and OUTs drive bits of it.";
    LimitedPack "limited-pack" Warning
        "PACK writes a word that a tag limits: some patterns become others.";
    OutLostOnJumpBack "out-lost-on-jump-back" Warning
        "After a jump back, the left stage's termination turns a bit of the new stage OFF.";
    RunsThrough "runs-through" Warning
        "The condition that enters a stage also leaves it, in the same scan.";
    StageNeverEntered "stage-never-entered" Warning "Nothing ever turns this stage ON.";
    BlockNeverStarted "block-never-started" Warning "Nothing ever starts this block.";
    SubroutineNeverCalled "subroutine-never-called" Warning "Nothing ever calls this subroutine.";
    SharedHistory "shared-history" Warning
        "A subroutine with an edge, timer, counter or SR is called at more than one place.";
    SetNeverReset "set-never-reset" Warning "A bit is SET and never RST.";
    ResetNeverSet "reset-never-set" Warning "A bit is RST and never SET.";
    NeverWritten "never-written" Warning "The ladder reads a bit or word that nothing writes.";
    MultiScanInTask "multi-scan-in-task" Warning
        "An instruction that works over several scans stands in a run-once task.";
    TaskStartsItself "task-starts-itself" Warning "A task holds the ENTASK that starts it.";
    ConstantCompare "constant-compare" Warning "A compare always gives the same result.";
    BareTimerValue "bare-timer-value" Warning "A timer value without a unit: ms or s?";
    DurationAsCount "duration-as-count" Warning
        "A duration where a counter wants a number of counts.";
    MixedAndOr "mixed-and-or" Warning "`&` and `|` are mixed without parentheses.";
    EdgeInClk "edge-in-clk" Warning
        "An edge contact stands in a leg that detects the edge itself: `clk` of SR, `up` or `dn` \
         of UDCG.";
    SelfResetLosesTime "self-reset-loses-time" Warning
        "A timer that its own Done resets takes longer for each round than its preset.";
    MixedOperators "mixed-operators" Warning
        "Operators of an expression that are easily misread are mixed without parentheses.";
    IntegerDivisionIntoReal "integer-division-into-real" Warning
        "A division of integers loses its fraction, and the result goes into a real.";
    ComplementOfBit "complement-of-bit" Warning
        "`~` of a bit is never 0: a bit that takes it is always ON.";
    ConstantSaturates "constant-saturates" Warning
        "A constant never fits its target: the target's limit is stored instead.";
    LostFraction "lost-fraction" Warning
        "A constant has a fraction, and the word that takes it holds whole numbers.";
    MathConstants "math-constants" Warning
        "Constants in MATH can only be a mistake, as a division by 0.";
    RetainedButReset "retained-but-reset" Warning
        "A retained structure or bit loses its value at every stop.";
    RetainsNothing "retains-nothing" Warning "`[retain]` names nothing that a restart keeps.";
    ColdForEver "cold-for-ever" Warning
        "A start with nothing to restore waits for an operator's command, but has no socket.";
    HeldButReset "held-but-reset" Warning "An output that is to be held goes OFF at every stop.";
    LongPeriod "long-period" Warning "Scans are more than a second apart.";
    ShortPeriod "short-period" Warning "Scans are less than a millisecond apart.";
    InputUnmapped "input-unmapped" Warning "The ladder reads an input that no field device moves.";
    OutputUnmapped "output-unmapped" Warning "An output that no field device takes.";
    InputNamedTwice "input-named-twice" Warning "Two tags are the same input.";
    VendorNumber "vendor-number" Warning
        "A Modbus address can be a manual's number that counts from 1.";
    UnusedTag "unused-tag" Warning "Nothing in the ladder names this tag.";
    UnusedTemplate "unused-template" Warning "Nothing uses this template.";
    LevelLeftOut "level-left-out" Warning
        "A level is given to an event that `[log] blocks` leaves out.";
    PasswordInClear "password-in-clear" Warning
        "The password of a broker's user goes over the network without TLS.";
    UnknownAllow "unknown-allow" Warning "`allow` names no warning.";
    TestEmpty "test-empty" Warning "A test file, or a scenario of it, tests nothing.";
}

impl Code {
    /// The table row.
    pub fn row(self) -> &'static FindingRow {
        &TABLE[self as usize]
    }

    /// The stable kebab-case name.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Error or warning.
    pub(crate) fn severity(self) -> Severity {
        self.row().severity
    }

    /// The code with this name.
    pub fn from_name(name: &str) -> Option<Code> {
        TABLE.iter().find(|row| row.name == name).map(|row| row.code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_finds_each_code_by_its_unique_name() {
        for row in TABLE {
            assert_eq!(Code::from_name(row.name), Some(row.code));
            assert_eq!(row.code.name(), row.name);
        }
    }
}
