//! Proofs about ladders in text, by each way; what the two ways have in common.

mod abc;
mod aig;
mod aiger_file;
mod alike;
mod bench;
mod cone;
mod device_loss;
mod drawn;
mod encoded;
mod environment;
mod equal;
mod events;
mod exhaust;
mod explore;
mod figures;
mod given;
mod judged;
mod lanes;
mod mistake;
mod rig_events;
mod rig_retained;
mod survey;
mod ways;
