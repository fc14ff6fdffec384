//! The status of the controller as values: mode, scans, ladder, forces, alarms.

use opcua::nodes::{AccessLevel, VariableBuilder};
use opcua::server::address_space::AddressSpace;
use opcua::types::{DataTypeId, NodeId, QualifiedName, VariableTypeId, Variant};
use rungd_client::operator::protocol::{AlarmList, ControllerStatus};

use crate::space::{STATUS, node_id};

/// A value of the status: its name, its type, its content.
type StatusValue = (&'static str, DataTypeId, fn(&ControllerStatus, &AlarmList) -> Variant);

/// The values of the status.
const VALUES: [StatusValue; 12] = [
    ("Mode", DataTypeId::String, |status, _| Variant::from(status.mode.as_str())),
    ("ModeReason", DataTypeId::String, |status, _| {
        Variant::from(status.reason.as_deref().unwrap_or_default())
    }),
    ("Scans", DataTypeId::UInt64, |status, _| Variant::from(status.scans)),
    ("Overruns", DataTypeId::UInt64, |status, _| Variant::from(status.scan.overruns)),
    ("PeriodMicroseconds", DataTypeId::UInt64, |status, _| Variant::from(status.period_us)),
    ("UptimeMilliseconds", DataTypeId::UInt64, |status, _| Variant::from(status.uptime_ms)),
    ("Ladder", DataTypeId::String, |status, _| Variant::from(status.ladder.name.as_str())),
    ("LadderSha256", DataTypeId::String, |status, _| Variant::from(status.ladder.sha256.as_str())),
    ("Version", DataTypeId::String, |status, _| Variant::from(status.version.as_str())),
    ("Forces", DataTypeId::UInt32, |status, _| count(status.forces.len())),
    ("ActiveAlarms", DataTypeId::UInt32, |_, alarms| {
        count(alarms.alarms.iter().filter(|alarm| alarm.is_standing()).count())
    }),
    ("ListedAlarms", DataTypeId::UInt32, |_, alarms| count(alarms.alarms.len())),
];

fn count(count: usize) -> Variant {
    Variant::from(u32::try_from(count).unwrap_or(u32::MAX))
}

/// Adds the nodes of the status.
pub fn add_status(space: &mut AddressSpace, namespace: u16) {
    for (name, data_type, _) in VALUES {
        VariableBuilder::new(
            &status_id(namespace, name),
            QualifiedName::new(namespace, name),
            name,
        )
        .data_type(data_type)
        .value_rank(-1)
        .access_level(AccessLevel::CURRENT_READ)
        .user_access_level(AccessLevel::CURRENT_READ)
        .has_type_definition(VariableTypeId::BaseDataVariableType)
        .component_of(node_id(namespace, STATUS))
        .insert(space);
    }
}

/// The values of a status, with their nodes.
pub fn status_values(
    namespace: u16,
    status: &ControllerStatus,
    alarms: &AlarmList,
) -> Vec<(NodeId, Variant)> {
    let value = |(name, _, of): StatusValue| (status_id(namespace, name), of(status, alarms));
    VALUES.map(value).into()
}

fn status_id(namespace: u16, name: &str) -> NodeId {
    node_id(namespace, &format!("{STATUS}/{name}"))
}
