//! The families of a status that is given, as text.
use super::*;
