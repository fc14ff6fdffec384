//! The nodes of a tree in the address space of the server, with the properties that the standard
//! gives them: unit, range, the texts of values.

use opcua::nodes::{AccessLevel, EventNotifier, ObjectBuilder, VariableBuilder};
use opcua::server::address_space::AddressSpace;
use opcua::types::{
    DataTypeId, EUInformation, EnumValueType, ExtensionObject, LocalizedText, NodeId, ObjectId,
    ObjectTypeId, QualifiedName, Range, UAString, VariableTypeId, Variant,
};
use rungd_client::live::TagType;

use crate::tags::{DEVICES, PROGRAMS, PlantNode, PlantVariable, TAGS};
use crate::values;

/// The id of the object of the controller.
pub const ROOT: &str = "/";
/// The id of the folder of the status.
pub const STATUS: &str = "/status";
/// The id of the folder of the alarms.
pub const ALARMS: &str = "/alarms";
/// The units of the standard's own list.
const UNITS: &str = "http://www.opcfoundation.org/UA/units/un/cefact";
/// The properties that a value may have, by their names.
const PROPERTIES: [&str; 6] =
    ["EngineeringUnits", "EURange", "EnumValues", "ValueAsText", "TrueState", "FalseState"];

/// The id of a node in the namespace of the controller.
pub fn node_id(namespace: u16, id: &str) -> NodeId {
    NodeId::new(namespace, id)
}

/// The id of a property of a node.
pub fn property_id(namespace: u16, id: &str, property: &str) -> NodeId {
    NodeId::new(namespace, format!("{id}/{property}"))
}

/// The nodes that every controller has.
pub fn add_frame(space: &mut AddressSpace, namespace: u16, name: &str) {
    let root = node_id(namespace, ROOT);
    ObjectBuilder::new(&root, QualifiedName::new(namespace, name), name)
        .has_type_definition(ObjectTypeId::BaseObjectType)
        .event_notifier(EventNotifier::SUBSCRIBE_TO_EVENTS)
        .organized_by(ObjectId::ObjectsFolder)
        .insert(space);
    for (id, name) in [
        (STATUS, "Status"),
        (TAGS, "Tags"),
        (PROGRAMS, "Programs"),
        (DEVICES, "Devices"),
        (ALARMS, "Alarms"),
    ] {
        ObjectBuilder::new(&node_id(namespace, id), QualifiedName::new(namespace, name), name)
            .has_type_definition(ObjectTypeId::FolderType)
            .component_of(root.clone())
            .insert(space);
    }
}

/// Adds a node. The node above it is there already.
pub fn add(space: &mut AddressSpace, namespace: u16, node: &PlantNode) {
    let (id, parent) = (node_id(namespace, &node.id), node_id(namespace, &node.parent));
    let doc = LocalizedText::new("", node.doc.as_deref().unwrap_or_default());
    let name = QualifiedName::new(namespace, node.name.as_str());
    let Some(variable) = &node.variable else {
        ObjectBuilder::new(&id, name, node.name.as_str())
            .has_type_definition(ObjectTypeId::BaseObjectType)
            .description(doc)
            .component_of(parent)
            .insert(space);
        return;
    };
    // What is written with a reason alone has a method for that, and no plain write.
    let access = match variable.may_write && !variable.wants_reason {
        true => AccessLevel::CURRENT_READ | AccessLevel::HISTORY_READ | AccessLevel::CURRENT_WRITE,
        false => AccessLevel::CURRENT_READ | AccessLevel::HISTORY_READ,
    };
    let mut builder = VariableBuilder::new(&id, name, node.name.as_str())
        .data_type(values::data_type(variable.tag_type))
        .access_level(access)
        .user_access_level(access)
        .historizing(true)
        .description(doc)
        .has_type_definition(type_of(variable))
        .component_of(parent);
    if variable.is_array {
        let count = u32::try_from(variable.cells.len()).unwrap_or(u32::MAX);
        builder = builder.value_rank(1).array_dimensions(&[count]);
    } else {
        builder = builder.value_rank(-1);
    }
    builder.insert(space);
    add_properties(space, namespace, &node.id, variable);
}

/// The standard's type of a node.
pub fn type_of_node(node: &PlantNode) -> NodeId {
    match &node.variable {
        Some(variable) => type_of(variable).into(),
        None => ObjectTypeId::BaseObjectType.into(),
    }
}

/// The standard's type of a value.
fn type_of(variable: &PlantVariable) -> VariableTypeId {
    match (variable.tag_type, variable.texts.is_empty(), variable.limits, &variable.unit) {
        (TagType::Bit, false, ..) => VariableTypeId::TwoStateDiscreteType,
        (_, false, ..) => VariableTypeId::MultiStateValueDiscreteType,
        (_, true, Some(_), _) => VariableTypeId::AnalogItemType,
        (_, true, None, Some(_)) => VariableTypeId::AnalogUnitType,
        (_, true, None, None) => VariableTypeId::BaseDataVariableType,
    }
}

fn add_properties(space: &mut AddressSpace, namespace: u16, id: &str, variable: &PlantVariable) {
    let mut add = |name: &str, data_type: DataTypeId, value: Variant, rank: i32| {
        VariableBuilder::new(&property_id(namespace, id, name), name, name)
            .data_type(data_type)
            .value_rank(rank)
            .value(value)
            .has_type_definition(VariableTypeId::PropertyType)
            .property_of(node_id(namespace, id))
            .insert(space);
    };
    if let Some(unit) = &variable.unit {
        let shown = LocalizedText::new("", unit);
        let information = EUInformation {
            namespace_uri: UAString::from(UNITS),
            // "No code of the list": the unit is the author's text.
            unit_id: -1,
            display_name: shown.clone(),
            description: shown,
        };
        let value = Variant::from(ExtensionObject::from_message(information));
        add("EngineeringUnits", DataTypeId::EUInformation, value, -1);
    }
    if let Some((low, high)) = variable.limits {
        let value = Variant::from(ExtensionObject::from_message(Range { low, high }));
        add("EURange", DataTypeId::Range, value, -1);
    }
    if variable.texts.is_empty() {
        return;
    }
    if variable.tag_type == TagType::Bit {
        for (name, content) in [("FalseState", 0), ("TrueState", 1)] {
            let value = Variant::from(LocalizedText::new("", text_of(variable, content)));
            add(name, DataTypeId::LocalizedText, value, -1);
        }
        return;
    }
    let texts = variable.texts.iter().map(|(value, text)| {
        let display_name = LocalizedText::new("", text);
        let value = i64::from(*value);
        ExtensionObject::from_message(EnumValueType {
            value,
            display_name,
            description: LocalizedText::null(),
        })
    });
    let texts: Vec<ExtensionObject> = texts.collect();
    add("EnumValues", DataTypeId::EnumValueType, Variant::from(texts), 1);
    add("ValueAsText", DataTypeId::LocalizedText, Variant::from(LocalizedText::null()), -1);
}

/// The text of a value; empty if there is none.
pub fn text_of(variable: &PlantVariable, content: i32) -> &str {
    let found = variable.texts.iter().find(|(value, _)| *value == content);
    found.map_or("", |(_, text)| text)
}

/// Removes a node and its properties.
pub fn remove(space: &mut AddressSpace, namespace: u16, id: &str) {
    for property in PROPERTIES {
        space.delete(&property_id(namespace, id, property), true);
    }
    space.delete(&node_id(namespace, id), true);
}
