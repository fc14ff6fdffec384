//! The server, driven by a raw client over a real socket, before a controller that is the real
//! exchange and a made-up scan.

mod controller;
mod functions;
mod hostile;
mod limits;
mod scans;
