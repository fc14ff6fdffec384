//! The types that event filters are checked against: those of the library, with inheritance.
//!
//! A client may ask for a field of a supertype by the subtype's name, and for the condition itself
//! by an empty path (part 9, 5.5.2); the library looks only at the fields that a type declares.

use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use opcua::nodes::{DefaultTypeTree, TypeProperty, TypeTree, TypeTreeNode};
use opcua::server::node_manager::{
    RequestContext, TypeTreeForUser, TypeTreeForUserStatic, TypeTreeReadContext,
};
use opcua::sync::RwLock;
use opcua::types::{NamespaceMap, NodeClass, NodeId, ObjectTypeId, QualifiedName};

/// Gives every user the types with inheritance.
#[derive(Debug)]
pub struct InheritingTypes;

impl TypeTreeForUser for InheritingTypes {
    fn get_type_tree_for_user<'a>(
        &'a self,
        context: &'a RequestContext,
    ) -> Box<dyn TypeTreeReadContext + 'a> {
        Box::new(TypesGuard(context.type_tree.read()))
    }

    fn get_type_tree_static(&self, context: &RequestContext) -> Arc<dyn TypeTreeForUserStatic> {
        Arc::new(KeptTypes(Arc::clone(&context.type_tree)))
    }
}

struct KeptTypes(Arc<RwLock<DefaultTypeTree>>);

impl TypeTreeForUserStatic for KeptTypes {
    fn get_type_tree<'a>(&'a self) -> Box<dyn TypeTreeReadContext + 'a> {
        Box::new(TypesGuard(self.0.read()))
    }
}

/// The types while they are read.
struct TypesGuard<G>(G);

impl<G: Deref<Target = DefaultTypeTree>> TypeTreeReadContext for TypesGuard<G> {
    fn get(&self) -> &dyn TypeTree {
        self
    }
}

/// The condition itself, which an empty path names.
fn condition() -> &'static TypeProperty {
    static CONDITION: OnceLock<TypeProperty> = OnceLock::new();
    CONDITION.get_or_init(|| TypeProperty {
        node_id: ObjectTypeId::ConditionType.into(),
        node_class: NodeClass::Object,
    })
}

impl<G: Deref<Target = DefaultTypeTree>> TypeTree for TypesGuard<G> {
    fn is_subtype_of(&self, child: &NodeId, ancestor: &NodeId) -> bool {
        self.0.is_subtype_of(child, ancestor)
    }

    fn get_node<'a>(&'a self, node: &NodeId) -> Option<TypeTreeNode<'a>> {
        self.0.get_node(node)
    }

    fn get(&self, node: &NodeId) -> Option<NodeClass> {
        self.0.get(node)
    }

    fn find_type_prop_by_browse_path(
        &self,
        type_id: &NodeId,
        path: &[QualifiedName],
    ) -> Option<&TypeProperty> {
        if path.is_empty() {
            let is_condition = self.0.is_subtype_of(type_id, &ObjectTypeId::ConditionType.into());
            return is_condition.then(condition);
        }
        let mut declaring = Some(type_id);
        while let Some(known) = declaring {
            if let Some(found) = self.0.find_type_prop_by_browse_path(known, path) {
                return Some(found);
            }
            declaring = self.0.get_supertype(known);
        }
        None
    }

    fn get_supertype<'a>(&'a self, node: &NodeId) -> Option<&'a NodeId> {
        self.0.get_supertype(node)
    }

    fn namespaces(&self) -> &NamespaceMap {
        self.0.namespaces()
    }
}
