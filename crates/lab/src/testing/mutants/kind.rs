//! The kinds of mutants: the table that pages and options list.

macro_rules! kinds {
    ($($kind:ident $name:literal $doc:literal;)*) => {
        /// The kind of the change in a mutant.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum MutantKind { $(#[doc = $doc] $kind),* }

        impl MutantKind {
            /// All kinds, in the order of the mutants at one place.
            pub const ALL: &[MutantKind] = &[$(MutantKind::$kind),*];

            /// Its name.
            pub fn name(self) -> &'static str {
                match self { $(MutantKind::$kind => $name),* }
            }
        }
    };
}

kinds! {
    RungOut "rung-out" "A rung is left out.";
    BranchOut "branch-out" "A branch is left out.";
    Inverted "inverted" "A contact is inverted.";
    ContactOut "contact-out" "A contact is left out; a leg without a second contact is always ON.";
    WordBit "word-bit" "A bit of a word is another bit of the same word.";
    Group "group" "The `&` of a group is a `|`, or its `|` is a `&`.";
    Border "border" "A compare has its border on the other side: `>=` is `>`, `<` is `<=`.";
    Level "level" "An edge is a level: `rise(x)` is `x`.";
    OtherEdge "other-edge" "A rising edge is a falling one, or a falling edge is a rising one.";
    Number "number" "A constant is 1 more or less, a duration or preset a tenth; a preset is 0.";
    InstructionOut "instruction-out" "An instruction is left out.";
    Instruction "instruction" "An instruction is its opposite: SET is RST, OUT is SET, ADD is SUB.";
    Stage "stage" "A jump leads to the next Stage of the Program instead.";
    Operator "operator" "An operator or function of MATH is replaced: `+` is `-`.";
    SignOut "sign-out" "A `-`, `!` or `~` of MATH is left out.";
    TermOut "term-out" "A term of a sum in MATH or in a compare is left out.";
    RetainOut "retain-out" "A tag, range or Program is left out of `[retain]`.";
}

impl MutantKind {
    /// The kind with this name.
    pub fn from_name(name: &str) -> Option<MutantKind> {
        MutantKind::ALL.iter().find(|kind| kind.name() == name).copied()
    }
}
