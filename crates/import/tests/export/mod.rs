//! What `rungd export` writes, executed: by the tests' interpreter of PLCopen XML, and by rungd
//! behind an import of it. Both do what the ladder does, in every bit and word of every scan.

mod cases;
mod generator;
mod judge;
mod ladders;
mod random;
