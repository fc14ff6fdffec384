//! The values of a tag: `<Data Format="Decorated">`.

use roxmltree::Node;

/// A value, with its type.
#[derive(Clone, Debug)]
pub(crate) enum Datum {
    /// A value of a type that has no parts.
    Value {
        /// Its type: `DINT`.
        kind: String,
        /// Its text: `16#0000_00ff`.
        text: String,
    },
    /// An array: the elements in order, all dimensions in one list.
    Array {
        /// The type of an element.
        kind: String,
        /// The numbers of elements.
        dimensions: Vec<u32>,
        /// Its elements.
        elements: Vec<Datum>,
    },
    /// A structure.
    Structure {
        /// Its type.
        kind: String,
        /// Its members, in order.
        members: Vec<NamedDatum>,
    },
}

/// A member of a structure.
#[derive(Clone, Debug)]
pub(crate) struct NamedDatum {
    pub(crate) name: String,
    pub(crate) datum: Datum,
}

/// Deepest nesting of structures.
const DEPTH_MAX: usize = 32;

/// The decorated data of an element, whose list is `Data` or `DefaultData`.
pub(crate) fn decorated(node: Node<'_, '_>, list: &str) -> Option<Datum> {
    let is_decorated = |child: &Node<'_, '_>| {
        child.has_tag_name(list) && child.attribute("Format") == Some("Decorated")
    };
    let data = node.children().find(is_decorated)?;
    datum(data.children().find(Node::is_element)?, 0)
}

fn datum(node: Node<'_, '_>, depth: usize) -> Option<Datum> {
    if depth > DEPTH_MAX {
        return None;
    }
    let kind = node.attribute("DataType").unwrap_or_default().to_owned();
    let elements = || node.children().filter(Node::is_element);
    match node.tag_name().name() {
        "DataValue" | "DataValueMember" => Some(Datum::Value {
            kind,
            text: node.attribute("Value").unwrap_or_default().to_owned(),
        }),
        "Array" | "ArrayMember" => {
            let sizes = node.attribute("Dimensions").unwrap_or_default();
            let dimensions = sizes.split([' ', ',']).filter_map(|size| size.parse().ok());
            let element = |element: Node<'_, '_>| match element.attribute("Value") {
                Some(text) => Some(Datum::Value { kind: kind.clone(), text: text.to_owned() }),
                None => datum(element.children().find(Node::is_element)?, depth + 1),
            };
            let all: Vec<Datum> = elements().filter_map(element).collect();
            Some(Datum::Array { dimensions: dimensions.collect(), elements: all, kind })
        }
        "Structure" | "StructureMember" => {
            let member = |member: Node<'_, '_>| {
                let name = member.attribute("Name")?.to_owned();
                Some(NamedDatum { name, datum: datum(member, depth + 1)? })
            };
            Some(Datum::Structure { members: elements().filter_map(member).collect(), kind })
        }
        _ => None,
    }
}
