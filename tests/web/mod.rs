//! `rungd web`: the real process with a real controller. The tests have their own client, which
//! sends both a browser's requests and requests that no browser would send.

mod client;
mod compares;
mod crowd;
mod mimic;
mod outputs;
mod pages;
mod press;
mod recipe;
mod rights;
mod secured;
mod strangers;
mod users;
