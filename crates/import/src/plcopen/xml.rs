//! Elements of XML: by name in any namespace, with their attributes and texts.

use roxmltree::Node;

/// An element.
pub(super) type XmlElement<'d, 'i> = Node<'d, 'i>;

/// Whether an element has a name, in any namespace.
pub(super) fn is(node: XmlElement<'_, '_>, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// The first child element with a name.
pub(super) fn child<'d, 'i>(node: XmlElement<'d, 'i>, name: &str) -> Option<XmlElement<'d, 'i>> {
    node.children().find(|child| is(*child, name))
}

/// The languages of bodies.
const LANGUAGES: [&str; 5] = ["LD", "FBD", "ST", "IL", "SFC"];

/// The content of a body: its first element that is called as a language.
pub(super) fn content<'d, 'i>(node: XmlElement<'d, 'i>) -> Option<XmlElement<'d, 'i>> {
    node.children().find(|child| LANGUAGES.iter().any(|name| is(*child, name)))
}

/// An attribute without the spaces around it; empty if there is none.
pub(super) fn attribute(node: XmlElement<'_, '_>, name: &str) -> String {
    node.attribute(name).unwrap_or_default().trim().to_owned()
}

/// Whether an attribute is `true`.
pub(super) fn is_true(node: XmlElement<'_, '_>, name: &str) -> bool {
    node.attribute(name).is_some_and(|value| matches!(value.trim(), "true" | "1"))
}

/// The text of an element, all of its pieces.
pub(super) fn text(node: XmlElement<'_, '_>) -> String {
    let pieces = node.descendants().filter(Node::is_text).filter_map(|piece| piece.text());
    pieces.collect::<String>().trim().to_owned()
}
