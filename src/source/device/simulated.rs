//! The keys of the simulated plant (`simulated`) in a `[[device]]`.

use super::Kind;
use crate::source::reader::Table;

/// What a `[[device]]` says of its plant.
#[derive(Clone, Debug, Default)]
pub struct Keys {}

impl Keys {
    pub(super) fn read(_table: &mut Table<'_>, _driver: Option<Kind>) -> Keys {
        Keys {}
    }
}
