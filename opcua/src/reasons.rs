//! Writes with a reason: the method WriteWithReason of the controller's object.
//!
//! A write of OPC UA has no place for a reason, and what a panel's part with `reason = true` writes
//! is written with one alone (`rights`). So the method has the tag, the value and the reason as
//! arguments. `manager` carries it out: it writes what a plain write could write too.

use opcua::nodes::MethodBuilder;
use opcua::server::address_space::AddressSpace;
use opcua::types::{
    Argument, DataTypeId, LocalizedText, NumericRange, QualifiedName, StatusCode, UAString, Variant,
};
use rungd_client::operator::protocol::is_reason;
use rungd_language::source::indexed::IndexedName;

use crate::space::{ROOT, node_id, property_id};

/// The id of the method.
pub const WRITE_WITH_REASON: &str = "/WriteWithReason";
/// Its name.
const NAME: &str = "WriteWithReason";
/// The rank of an argument that may be one value or an array.
const ANY_RANK: i32 = -2;
/// The rank of an argument that is one value.
const SCALAR_RANK: i32 = -1;

/// Adds the method to the object of the controller.
pub fn add_method(space: &mut AddressSpace, namespace: u16) {
    let argument = |name: &str, data_type: DataTypeId, what: &str| Argument {
        name: UAString::from(name),
        value_rank: if data_type == DataTypeId::BaseDataType { ANY_RANK } else { SCALAR_RANK },
        data_type: data_type.into(),
        array_dimensions: None,
        description: LocalizedText::new("", what),
    };
    let arguments = [
        argument("Tag", DataTypeId::String, "The name of the tag: the id of its node"),
        argument("Value", DataTypeId::BaseDataType, "The value, of the type of the tag"),
        argument("Reason", DataTypeId::String, "One line of at most 200 characters"),
    ];
    let id = node_id(namespace, WRITE_WITH_REASON);
    let inputs = property_id(namespace, WRITE_WITH_REASON, "InputArguments");
    MethodBuilder::new(&id, QualifiedName::new(namespace, NAME), NAME)
        .description(LocalizedText::new("", "Writes a tag, with a reason for the log"))
        .component_of(node_id(namespace, ROOT))
        .executable(true)
        .user_executable(true)
        .input_args(space, &inputs, &arguments)
        .insert(space);
}

/// What a call wants to write.
#[derive(Clone, Debug, PartialEq)]
pub struct ReasonedWrite {
    /// The id of the node.
    pub id: String,
    /// The part of an array.
    pub range: NumericRange,
    /// The value.
    pub value: Variant,
    /// Why.
    pub reason: String,
}

impl ReasonedWrite {
    /// What the arguments of a call want.
    ///
    /// # Errors
    /// The results of the arguments.
    pub fn of(arguments: &[Variant]) -> Result<ReasonedWrite, Vec<StatusCode>> {
        let [tag, value, reason] = arguments else {
            return Err(vec![StatusCode::BadInvalidArgument; arguments.len()]);
        };
        let reason = text_of(reason).and_then(|reason| match is_reason(&reason) {
            true => Ok(reason),
            false => Err(StatusCode::BadOutOfRange),
        });
        match (text_of(tag), reason) {
            (Ok(tag), Ok(reason)) => {
                let (id, range) = node_of(tag);
                Ok(ReasonedWrite { id, range, value: value.clone(), reason })
            }
            (tag, reason) => {
                let result = |wrong: Option<StatusCode>| wrong.unwrap_or(StatusCode::Good);
                Err(vec![result(tag.err()), StatusCode::Good, result(reason.err())])
            }
        }
    }
}

/// The text of an argument.
///
/// # Errors
/// It is no text.
fn text_of(argument: &Variant) -> Result<String, StatusCode> {
    let text = if let Variant::String(text) = argument {
        text
    } else if let Variant::LocalizedText(text) = argument {
        &text.text
    } else {
        return Err(StatusCode::BadTypeMismatch);
    };
    Ok(text.as_ref().trim().to_owned())
}

/// The node of a tag, and the part of it: an element of an array is a part of the array's node.
fn node_of(tag: String) -> (String, NumericRange) {
    match IndexedName::of(&tag) {
        Some(IndexedName { base, index, behind: "" }) => match index.parse() {
            Ok(index) => (base.to_owned(), NumericRange::Index(index)),
            Err(_) => (tag, NumericRange::None),
        },
        Some(_) | None => (tag, NumericRange::None),
    }
}
