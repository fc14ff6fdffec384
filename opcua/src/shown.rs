//! The tree of the running program, with its nodes by id and by cell.

use std::collections::HashMap;

use crate::tags::{PlantNode, PlantTree, PlantVariable};

/// The tree that clients see.
#[derive(Debug, Default)]
pub struct ShownTree {
    /// The tree.
    pub tree: PlantTree,
    /// The index of each node by its id.
    places: HashMap<String, usize>,
    /// The index of the node of each chosen cell.
    of_cell: Vec<usize>,
    /// The nodes that are wired to each device as inputs.
    of_device: Vec<Vec<usize>>,
}

impl ShownTree {
    /// The indexes of a tree.
    pub fn new(tree: PlantTree) -> ShownTree {
        let places = tree.nodes.iter().enumerate().map(|(at, node)| (node.id.clone(), at));
        let places = places.collect();
        let mut of_cell = Vec::new();
        let mut of_device = vec![Vec::new(); tree.device_ok.len()];
        for (at, variable) in variables(&tree) {
            for cell in &variable.cells {
                let cell = *cell as usize;
                if of_cell.len() <= cell {
                    of_cell.resize(cell + 1, at);
                }
                of_cell[cell] = at;
            }
            for device in &variable.devices {
                if let Some(nodes) = of_device.get_mut(*device) {
                    nodes.push(at);
                }
            }
        }
        ShownTree { tree, places, of_cell, of_device }
    }

    /// The node with an id.
    pub fn node(&self, id: &str) -> Option<&PlantNode> {
        self.tree.nodes.get(*self.places.get(id)?)
    }

    /// The index of the node that shows a cell.
    pub fn of_cell(&self, cell: u32) -> Option<usize> {
        self.of_cell.get(cell as usize).copied()
    }

    /// The device whose `.Ok` a cell is.
    pub fn device_of_ok(&self, cell: u32) -> Option<usize> {
        self.tree.device_ok.iter().position(|ok| *ok == cell)
    }

    /// The nodes that a device moves.
    pub fn moved_by(&self, device: usize) -> &[usize] {
        self.of_device.get(device).map_or(&[], Vec::as_slice)
    }

    /// The nodes with a value, with their indexes.
    pub fn variables(&self) -> impl Iterator<Item = (usize, &PlantVariable)> {
        variables(&self.tree)
    }
}

fn variables(tree: &PlantTree) -> impl Iterator<Item = (usize, &PlantVariable)> {
    let nodes = tree.nodes.iter().enumerate();
    nodes.filter_map(|(at, node)| Some((at, node.variable.as_ref()?)))
}
