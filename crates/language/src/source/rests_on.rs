//! What a finding depends on. If that may be missing in a file, the finding may be wrong.
//!
//! Used by [`super::lost`]. A new finding needs an entry here.

use super::finding::Code;

/// The part that must be complete for a finding to be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RestsOn {
    /// The text at its place.
    Itself,
    /// The declarations of the names that it is about.
    Names,
    /// The table at its place, and the names that it is about.
    Table,
    /// All tables of the block or device at its place, and the names that it is about.
    Group,
    /// The settings around the ladders: the sizes of memory, for example.
    Settings,
    /// All files: the finding states that something is in none of them.
    Everything,
}

impl Code {
    /// What the finding depends on.
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
            | InputNamedTwice | VendorNumber | LimitedWordBit | WholeWordOverOut | LimitedPack
            | SubroutineRule | SubroutineNesting | SubroutineRungs | SharedHistory
            | MathConstants | RetainedButReset | SelfResetLosesTime | LongPeriod | ShortPeriod
            | UnknownAllow | UnknownEvent | KeptEvent | ImportedTodo => RestsOn::Itself,
            UnknownName | UnknownMember | UnknownBlock | UnknownStage
            | UnknownTemplate => RestsOn::Names,
            MissingKey | EmptyLeg | NoInstruction | MixedLegs | MissingLeg | TemplateArgument
            | ForbiddenName | TemplateRule | TagKey | TestStep | TestEmpty
            | LevelLeftOut | PasswordInClear => RestsOn::Table,
            Controller | Edge | OpcUa | TestFile => RestsOn::Group,
            BeyondMemory | MemoryFull | RetainsNothing | ColdForEver => RestsOn::Settings,
            Order | ResetWithoutOwner | NoMain | OutLostOnJumpBack | RunsThrough | StageNeverEntered
            | SubroutineNeverCalled
            | BlockNeverStarted | SetNeverReset | ResetNeverSet | NeverWritten | MultiScanInTask
            | HeldButReset | InputUnmapped | OutputUnmapped | UnusedTag
            | UnusedTemplate => RestsOn::Everything,
        }
    }
}
