//! What a user who has signed in may change: by the roles of the running program's controller
//! file, as in `rungd web`. Who need not sign in has no role: there `OPCUA.toml` alone counts.
//!
//! `follow` reads them with each program; `PlantController::judge` asks them before each change.
//! Reasons (`reason = true`) are for pages alone: a write of OPC UA has no place for one.

use std::collections::HashSet;

use rungd_client::operator::protocol::GivenWrite;
use rungd_config::controller::user::{WebRole, WebUsers};
use rungd_history::playback::PlayableProgram;
use rungd_language::resolve::program::TagMeaning;

/// The rights of users.
#[derive(Debug, Default)]
pub struct PlantRights {
    users: WebUsers,
    /// The names of what only the role `service` writes.
    service: HashSet<String>,
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
        let operands = tags.flat_map(|(tag, address)| address.named_operands(&tag.name));
        let is_service = |(_, operand): &(_, _)| pages.needed(*operand) == Some(WebRole::Service);
        let service = operands.filter(is_service).map(|(name, _)| name).collect();
        PlantRights { users: pages.users.clone(), service }
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
