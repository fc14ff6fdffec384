//! `rungd metrics` with a controller: its metrics, its clients, and a Prometheus that scrapes it.

mod files;
mod hostile;
mod prometheus;
mod rig;
mod scrapes;
