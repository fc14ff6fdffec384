//! The places where contacts stand, which differ in what a compare may compute.

/// The place of contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ContactUse {
    /// A leg or branch of a rung, or the argument of a template.
    Ladder,
    /// A condition of a test: one string, with `&` of numbers within parentheses.
    Test,
}
