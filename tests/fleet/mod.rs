//! `crates/net/src/mqtt` and the code above it, with real brokers: mosquitto, and a cluster of NATS servers,
//! one of which is killed or paused. `Mosquitto` and `NatsCluster` are the rig.

// Each test uses only a part of the rig.
#[allow(dead_code)]
mod broker;
#[allow(dead_code)]
mod certificates;
#[allow(dead_code)]
mod checker;
mod cluster;
mod edge;
mod edge_hostile;
mod edge_promise;
mod edge_rig;
mod edge_wire;
mod fleet_process;
mod foreign;
mod host;
mod host_hostile;
mod host_wire;
#[allow(dead_code)]
mod mosquitto;
#[allow(dead_code)]
mod nats;
mod secured;
mod sessions;
