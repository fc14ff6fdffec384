//! The trial of a template that nothing uses: it is written out with arguments that fit, and
//! checked like any other, outside the program.

