//! What a user who has signed in may change: by the roles of the running program's controller
//! file, as in `rungd web`. Who need not sign in has no role: there `OPCUA.toml` alone counts.
//!
//! `follow` reads them with each program; `PlantController::judge` asks them before each change.
//! What a part of a panel writes with a reason alone (`reason = true`) is written so here too, by
//! everybody: `reasons` has the method for that.

use std::collections::HashSet;

use rungd_client::operator::protocol::GivenWrite;
use rungd_config::controller::user::{WebRole, WebUsers};
use rungd_history::playback::PlayableProgram;
use rungd_language::resolve::program::TagMeaning;

use crate::tags::PlantTree;

/// The rights of users.
#[derive(Debug, Default)]
pub struct PlantRights {
    users: WebUsers,
    /// The names of what only the role `service` writes.
    service: HashSet<String>,
    /// The names of what is written with a reason alone.
    reasons: HashSet<String>,
}

impl PlantRights {
    /// The rights that a program's controller file gives.
    pub fn of(program: &PlayableProgram) -> PlantRights {
        let Some(controller) = &program.loaded.controller else { return PlantRights::default() };
        let pages = &controller.web;
        let tags = program.program.tags.iter().filter_map(|tag| {
            let TagMeaning::Address(address) = tag.meaning else { return None };
            Some((tag, address))
        });
        let mut rights = PlantRights { users: pages.users.clone(), ..PlantRights::default() };
        for (name, operand) in tags.flat_map(|(tag, address)| address.named_operands(&tag.name)) {
            if pages.wants_reason(operand) {
                rights.reasons.insert(name.clone());
            }
            if pages.needed(operand) == Some(WebRole::Service) {
                rights.service.insert(name);
            }
        }
        rights
    }

    /// Marks the values of a tree that are written with a reason alone.
    pub fn mark(&self, tree: &mut PlantTree) {
        for node in &mut tree.nodes {
            let Some(variable) = &mut node.variable else { continue };
            variable.wants_reason = match variable.is_array {
                true => (0..variable.cells.len())
                    .any(|at| self.reasons.contains(&format!("{}[{at}]", node.id))),
                false => self.reasons.contains(&node.id),
            };
        }
    }

    /// Judges writes that have no reason.
    ///
    /// # Errors
    /// One of them wants one: why.
    pub fn judge_without_reason(&self, writes: &[GivenWrite]) -> Result<(), String> {
        match writes.iter().find(|write| self.reasons.contains(&write.operand)) {
            None => Ok(()),
            Some(write) => Err(format!(
                "`{}` is written with a reason alone: call WriteWithReason",
                write.operand
            )),
        }
    }

    /// Judges a change of a user: of alarms, or of what the writes name.
    ///
    /// # Errors
    /// It needs a higher role: why.
    pub fn judge(&self, user: &str, writes: &[GivenWrite]) -> Result<(), String> {
        let is_service = writes.iter().any(|write| self.service.contains(&write.operand));
        let needed = if is_service { WebRole::Service } else { WebRole::Operate };
        let role = self.users.role_of(user);
        if role >= needed {
            return Ok(());
        }
        let (needed, role) = (needed.word(), role.word());
        Err(format!(
            "this needs the role `{needed}`, and {user} has `{role}`: see `[[user]]` of the \
             controller file"
        ))
    }
}
