//! What a finding rests on: whether it may be about what is missing in a file that is not whole.
//!
//! Used by [`super::lost`]. A new finding must be given its row here.

use super::finding::Code;

/// What must be whole for a finding to be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RestsOn {
    /// The text at its place.
    Itself,
    /// The declarations of the names that it is about.
    Names,
    /// The table at its place, and the names that it is about.
    Table,
    /// The same, with all tables of its block or device.
    Group,
    /// The settings around the ladders, as the sizes of memory.
    Settings,
    /// All files: it says that something is nowhere.
    Everything,
}

impl Code {
    /// What the finding rests on.
    #[rustfmt::skip]
    pub(super) fn rests_on(self) -> RestsOn {
        use Code::*;
        match self {
            TomlSyntax | OutOfPlace | UnknownKey
            | WrongType | BareString | ContactSyntax | InstructionSyntax
            | ExpressionSyntax | DuplicateName | BadDuration | UnknownInstruction
            | UnknownOperand | MissingOperand | WrongCase | UnknownFunction | FunctionArguments
            | OperandType | OutOfRange | WriteToInput | ReadOnly | UnknownLeg | LegsShared
            | TemplateParameter | TemplateRecursion | TemplateSize | OwnedTwice | SensaphonePreset
            | JumpOutsideStage | BuiltInTask | StageInTask | BlockRule | EntaskConflict
            | DuplicateOut | RetainRange | OutElsewhere | TaskStartsItself | ConstantCompare
            | BareTimerValue | DurationAsCount | MixedAndOr | EdgeInClk | MixedOperators
            | IntegerDivisionIntoReal | ComplementOfBit | ConstantSaturates | LostFraction
            | MathConstants | RetainedButReset | LongPeriod | UnknownAllow | UnknownEvent
            | KeptEvent => RestsOn::Itself,
            UnknownName | UnknownMember | UnknownBlock | UnknownStage
            | UnknownTemplate => RestsOn::Names,
            MissingKey | EmptyLeg | NoInstruction | MixedLegs | MissingLeg | TemplateArgument
            | ForbiddenName | TemplateRule | TagKey | TestStep | TestEmpty
            | LevelLeftOut => RestsOn::Table,
            Controller | Edge | TestFile => RestsOn::Group,
            BeyondMemory | MemoryFull | RetainsNothing | ColdForEver => RestsOn::Settings,
            Order | ResetWithoutOwner | NoMain | OutLostOnJumpBack | StageNeverEntered
            | BlockNeverStarted | SetNeverReset | ResetNeverSet | NeverWritten | MultiScanInTask
            | HeldButReset | InputUnmapped | OutputUnmapped | UnusedTag
            | UnusedTemplate => RestsOn::Everything,
        }
    }
}
