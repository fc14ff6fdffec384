//! The rungs of a block as networks, in their order.
//!
//! A rung's contacts are evaluated once in rungd, before its instructions. A network of IEC 61131-3
//! reads its contacts anew for each coil. So where an instruction of the rung changes what its
//! contacts read, and where many contacts would be written for several networks, the power is kept
//! in a bit first. Coils of one rung share a network, as long as none changes what a later one
//! reads.

use super::project::{CoilAction, ExportedNetwork, NetworkBody, NetworkCoil, NetworkPower, on};
use super::refusal::ExportRefusal;
use super::rung_acts::{InstructionLegs, LegPower, RungAct, RungExport};
use rungd_engine::isa::LegName;
use rungd_language::resolve::program::{Instruction, Rung};

/// Contacts that are written again for each network, instead of a bit that keeps their power.
const REPEATED_MAX: usize = 3;

impl RungExport<'_, '_> {
    /// The networks of a rung.
    ///
    /// # Errors
    /// The first part of it that has no faithful form.
    pub(super) fn networks(mut self, rung: &Rung) -> Result<Vec<ExportedNetwork>, ExportRefusal> {
        let is_plain = rung.legs.iter().all(|leg| leg.name == LegName::When);
        let mut networks = match is_plain {
            true => self.plain(rung)?,
            false => self.legs(rung)?,
        };
        if let Some(first) = networks.first_mut() {
            let name = rung.name.iter().cloned();
            let parts: Vec<String> = name.chain(rung.doc.iter().cloned()).collect();
            first.doc = parts.join(": ");
        }
        Ok(networks)
    }

    fn legs(&mut self, rung: &Rung) -> Result<Vec<ExportedNetwork>, ExportRefusal> {
        let mut legs = Vec::new();
        for leg in &rung.legs {
            let power = self.series(&leg.contacts)?;
            legs.push(LegPower { name: leg.name, power });
        }
        let legs = InstructionLegs(legs);
        for instruction in &rung.body {
            self.instruction(instruction, &legs)?;
        }
        let acts = std::mem::take(&mut self.acts);
        Ok(self.grouped(&NetworkPower::Constant(true), acts))
    }

    fn plain(&mut self, rung: &Rung) -> Result<Vec<ExportedNetwork>, ExportRefusal> {
        let contacts = rung.legs.iter().flat_map(|leg| &leg.contacts).cloned();
        let mut power = self.series(&contacts.collect::<Vec<_>>())?;
        if self.is_first_scan {
            power = NetworkPower::all([on(&self.memory.shared("FirstScan", "BOOL")), power]);
        }
        let acts = self.acts_of(|export| export.body(rung))?;
        let power = self.kept(power, &acts);
        let before = std::mem::take(&mut self.acts);
        let mut networks = self.grouped(&NetworkPower::Constant(true), before);
        networks.extend(self.grouped(&power, acts));
        Ok(networks)
    }

    /// The acts that a part of the rung adds; they are not among the rung's own.
    fn acts_of(
        &mut self,
        add: impl FnOnce(&mut Self) -> Result<(), ExportRefusal>,
    ) -> Result<Vec<RungAct>, ExportRefusal> {
        let own = std::mem::take(&mut self.acts);
        let added = add(self);
        let acts = std::mem::replace(&mut self.acts, own);
        added.map(|()| acts)
    }

    /// The instructions of a rung, and its branches.
    fn body(&mut self, rung: &Rung) -> Result<(), ExportRefusal> {
        self.instructions(&rung.body)?;
        for branch in &rung.branches {
            let power = self.series(&branch.contacts)?;
            let acts = self.acts_of(|export| export.instructions(&branch.body))?;
            let rung = NetworkPower::OfRung { is_negated: false };
            let kept = self.kept(NetworkPower::all([rung, power]), &acts);
            self.acts.extend(acts.into_iter().map(|act| act.with_rung(&kept)));
        }
        Ok(())
    }

    fn instructions(&mut self, body: &[Instruction]) -> Result<(), ExportRefusal> {
        let power = InstructionLegs::of_rung();
        body.iter().try_for_each(|instruction| self.instruction(instruction, &power))
    }

    /// The power for acts; if they need it, a bit with it, which is written before them.
    fn kept(&mut self, power: NetworkPower, acts: &[RungAct]) -> NetworkPower {
        let mut reads = Vec::new();
        power.read(&mut reads);
        let users = acts.iter().filter(|act| act.has_rung());
        let calls = users.filter(|act| matches!(act, RungAct::Call { .. })).count();
        let is_changed = acts.iter().enumerate().any(|(at, act)| {
            let is_read_behind = acts[at + 1..].iter().any(RungAct::has_rung);
            is_read_behind && act.writes().any(|name| reads.iter().any(|read| read == name))
        });
        let is_long = power.weight() > REPEATED_MAX && calls > 0 && acts.len() > 1;
        if !is_changed && !is_long {
            return power;
        }
        let bit = self.fresh("power", "BOOL");
        self.coil(CoilAction::Assign, power, &bit);
        on(&bit)
    }

    /// The networks of acts; coils with the rung's power share one where they can.
    fn grouped(&mut self, rung: &NetworkPower, acts: Vec<RungAct>) -> Vec<ExportedNetwork> {
        let mut networks = Vec::new();
        let mut group: Vec<NetworkCoil> = Vec::new();
        let mut rung_reads = Vec::new();
        rung.read(&mut rung_reads);
        for act in acts {
            let coil = match act {
                RungAct::Coil(coil) => coil,
                RungAct::Call { call, results } => {
                    self.close(rung, &mut group, &mut networks);
                    let call = call.mapped(&|power| power.with_rung(rung));
                    networks.push(network(NetworkBody::Call { call, results }));
                    continue;
                }
            };
            let mut reads = rung_reads.clone();
            coil.power.read(&mut reads);
            let own = behind_rung(&coil.power);
            if own.is_none() || group.iter().any(|coil| reads.contains(&coil.variable)) {
                self.close(rung, &mut group, &mut networks);
            }
            match own {
                Some(power) => group.push(NetworkCoil { power, ..coil }),
                None => {
                    let power = self.closed(coil.power.clone().with_rung(rung));
                    let coils = vec![NetworkCoil { power: NetworkPower::Constant(true), ..coil }];
                    networks.push(network(NetworkBody::Coils { power, coils }));
                }
            }
        }
        self.close(rung, &mut group, &mut networks);
        networks
    }

    /// Ends a group of coils.
    fn close(
        &mut self,
        rung: &NetworkPower,
        group: &mut Vec<NetworkCoil>,
        networks: &mut Vec<ExportedNetwork>,
    ) {
        let coils = std::mem::take(group);
        if coils.is_empty() {
            return;
        }
        let coils = coils.into_iter();
        let coils =
            coils.map(|coil| NetworkCoil { power: self.closed(coil.power), ..coil }).collect();
        let power = self.closed(rung.clone());
        networks.push(network(NetworkBody::Coils { power, coils }));
    }

    /// A power that can be drawn: an open end is a contact that is never ON.
    fn closed(&mut self, power: NetworkPower) -> NetworkPower {
        match power == NetworkPower::Constant(false) {
            true => on(&self.memory.shared("Never", "BOOL")),
            false => power,
        }
    }
}

/// A network without a comment.
fn network(body: NetworkBody) -> ExportedNetwork {
    ExportedNetwork { doc: String::new(), body }
}

/// The contacts behind the rung's power; `None` if the power does not begin with it.
fn behind_rung(power: &NetworkPower) -> Option<NetworkPower> {
    let rung = NetworkPower::OfRung { is_negated: false };
    if *power == rung {
        return Some(NetworkPower::Constant(true));
    }
    let NetworkPower::Series(parts) = power else { return None };
    let (first, rest) = parts.split_first()?;
    let rest = NetworkPower::all(rest.iter().cloned());
    (*first == rung && !rest.has_rung()).then_some(rest)
}
