//! What a reload keeps: tests of the rules, with random programs, and with the real binary.

mod back;
mod live;
mod random;
mod unit;
