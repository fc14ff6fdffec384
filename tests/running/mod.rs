//! The program itself in a test: started as a process, asked through its socket.

pub mod live;
pub mod operator;
pub mod process;
