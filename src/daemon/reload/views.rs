//! The data of a program that its readers need: the operator's service, the log, the Modbus server,
//! the simulated device and retentive memory.

use super::deploys::DeployCause;
use crate::daemon::alarm_keeper::unix_ns;
use crate::daemon::config::RunningProgram;
use crate::daemon::narration::Narration;
use crate::daemon::operator_server::{ProgramView, StatusSources};
use crate::daemon::record;
use crate::daemon::watches::WatchPlan;
use rungd_client::operator::protocol::ReloadResult;
use rungd_io::modbus::settings::ModbusServerSettings;
use rungd_io::{modbus, plant};
use rungd_language::resolve::program::Program;
use rungd_runtime::{Generations, monotonic_ns};
use rungd_state::retain::RetainPlan;

/// The readers' data of each program, by generation; one field per reader.
pub(in super::super) struct ProgramViews {
    pub operator: Generations<ProgramView>,
    pub about: StatusSources,
    pub narration: Generations<Narration>,
    /// The server's maps, and the settings of its start.
    pub modbus: Option<(Generations<modbus::ModbusMap>, ModbusServerSettings)>,
    pub device: Option<Generations<plant::Rules>>,
}

impl ProgramViews {
    /// Enters a program, before its swap.
    pub(super) fn insert(&self, generation: u32, running: &RunningProgram) {
        let RunningProgram { program, setup } = running;
        let watches = WatchPlan::new(&setup.watches, &setup.symbols, program);
        self.about.recording.program(record::program(setup, generation), setup.access, watches);
        self.operator.insert(generation, ProgramView::new(setup, &self.about));
        self.narration.insert(generation, setup.narration.clone());
        let layout = &setup.symbols.layout;
        if let Some((maps, started)) = &self.modbus {
            // If the new file has no `[modbus-server]`, the server continues until the restart, and
            // accepts no writes.
            let none = started.clone().bare();
            let settings = setup.modbus.as_ref().unwrap_or(&none);
            let limits = |word| setup.symbols.limits(word);
            maps.insert(generation, modbus::ModbusMap::new(settings, layout, limits));
        }
        if let Some(retention) = &self.about.retention {
            // If the new file has no `[retain]`, nothing is written: the file keeps its last image.
            let nothing = || RetainPlan::new(&[], &Program::default(), &setup.symbols);
            let plan = setup.retain.as_ref().map_or_else(nothing, |wanted| wanted.plan.clone());
            retention.plans.insert(generation, plan);
        }
        if let Some(rules) = &self.device {
            rules.insert(generation, plant::Rules::new(&setup.rules, layout));
        }
    }

    /// Notes a change of the program, for people who look.
    pub(super) fn deployed(&self, who: &str, done: &ReloadResult, is_rollback: bool) {
        let unix_ns = unix_ns(monotonic_ns());
        self.about.deploys.add(DeployCause { who, unix_ns, is_rollback }, done);
    }

    /// Removes a program that was not swapped in.
    pub(super) fn remove(&self, generation: u32) {
        self.operator.remove(generation);
        self.narration.remove(generation);
        self.modbus.iter().for_each(|(maps, _)| maps.remove(generation));
        self.device.iter().for_each(|rules| rules.remove(generation));
        self.about.retention.iter().for_each(|kept| kept.plans.remove(generation));
    }

    /// Removes the programs that no snapshot shows any more.
    pub(super) fn forget_before(&self, generation: u32) {
        self.operator.forget_before(generation);
        self.narration.forget_before(generation);
        self.modbus.iter().for_each(|(maps, _)| maps.forget_before(generation));
        self.device.iter().for_each(|rules| rules.forget_before(generation));
        self.about.retention.iter().for_each(|kept| kept.plans.forget_before(generation));
    }
}
