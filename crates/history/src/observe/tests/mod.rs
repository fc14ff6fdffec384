//! Questions to small ladders, one for each kind of reason.

mod changed;
mod coverage;
mod kinds;
mod packing;
mod past;
mod power;
mod reasons;
mod slices;
mod stops;
mod subroutines;
mod tape;
