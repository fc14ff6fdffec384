//! The tests of `rungd-prove` that need nothing but ladders as text.

mod prove;
