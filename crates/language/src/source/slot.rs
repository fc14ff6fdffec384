//! The meaning of a value and of a key in a file: contacts, an instruction, the name of a block.
//!
//! The reader that requests a key gives both with it ([`super::key`]), and [`super::shape`] keeps
//! them. An editor finds the names in a file by them. No reader asks for them.

/// The kind of a declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DeclaredKind {
    /// A tag.
    Tag,
    /// A Program.
    Program,
    /// A Task.
    Task,
    /// A subroutine.
    Subroutine,
    /// A Stage.
    Stage,
    /// A rung.
    Rung,
    /// A template.
    Template,
    /// A parameter of a template.
    Parameter,
    /// A tag of a template.
    OwnTag,
    /// A record.
    Record,
    /// A field of a record.
    Field,
    /// A use of a template.
    Use,
    /// A field device.
    Device,
    /// A test.
    Test,
}

/// What a value stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The name of a declaration here.
    Declares(DeclaredKind),
    /// Contacts.
    Contacts,
    /// An instruction.
    Instruction,
    /// An argument for a template: contacts or a name.
    Argument,
    /// The name of a template.
    Template,
    /// Names of warnings.
    Allow,
    /// Names of blocks.
    Block,
    /// The path of a file.
    File,
    /// The path of a ladder of a device's own side, which is none of the project's.
    DeviceLadder,
    /// The name of a field device.
    Device,
    /// An address.
    Address,
    /// A type of a tag or parameter.
    Type,
    /// The name of one bit or word, or a range.
    Operand,
    /// Contacts whose compares may contain sums.
    Condition,
    /// One side of a device's map: a point of the device, or a name of the program.
    Point,
    /// A step of a test.
    Step,
    /// The first value of a tag; for a record a table with values of its fields.
    Initial,
    /// A text that contains parameters of a template in braces.
    Placeholders,
    /// A text or a number without names in it.
    Other,
}

/// What a key stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeySlot {
    /// The name of a declaration here.
    Declares(DeclaredKind),
    /// A parameter of the template that is used here.
    Parameter,
    /// The name of a bit or word.
    Operand,
    /// A field of the record that is the type of the tag around it.
    Field,
    /// A word of the file format.
    Word,
}
