//! The tags, Programs and field devices of a controller's program as a tree of nodes, with the
//! cells whose contents they show.
//!
//! `chooser` and `tree` make the same choice from the same program, so that both have the same
//! numbers of cells. A node's id is the name by which an operator reads it (`rungd read`), and so
//! stays the same over a reload. Used by `follow` and `space`. Knows nothing of OPC UA's types.

use std::collections::HashMap;
use std::sync::Arc;

use rungd_client::live::{ChooseCells, NamedCell, TagType};
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Bit, DeviceBit, DeviceId, Real, StageId};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::{Block, BlockKind, Program, Tag, TagMeaning};
use rungd_language::source::indexed::IndexedName;

use rungd_fleet::opcua::OpcUaSettings;

/// The id of the folder of the tags. No tag has a `/` in its name.
pub const TAGS: &str = "/tags";
/// The id of the folder of the Programs and Tasks.
pub const PROGRAMS: &str = "/programs";
/// The id of the folder of the field devices.
pub const DEVICES: &str = "/devices";

/// A node of the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantNode {
    /// Its id: the name by which an operator reads it.
    pub id: String,
    /// The id of the node above it.
    pub parent: String,
    /// Its name below that node.
    pub name: String,
    /// `doc`.
    pub doc: Option<String>,
    /// Its value; `None`: it has only nodes below it.
    pub variable: Option<PlantVariable>,
}

/// A value of the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantVariable {
    /// The type of the value, or of each element.
    pub tag_type: TagType,
    /// The numbers of its cells among the chosen ones; of an array, in order.
    pub cells: Vec<u32>,
    /// Whether it is an array.
    pub is_array: bool,
    /// `unit`.
    pub unit: Option<String>,
    /// `min` and `max`.
    pub limits: Option<(f64, f64)>,
    /// `texts`.
    pub texts: Vec<(i32, String)>,
    /// Whether clients may write it.
    pub may_write: bool,
    /// Whether a write needs a reason (`rights` knows).
    pub wants_reason: bool,
    /// The devices that it is wired to as an input, by number.
    pub devices: Vec<usize>,
}

/// The tree of a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlantTree {
    /// The nodes; each stands behind the node above it.
    pub nodes: Vec<PlantNode>,
    /// The cell of each field device's `.Ok` among the chosen ones.
    pub device_ok: Vec<u32>,
}

/// Chooses the cells of the nodes.
pub fn chooser(settings: &OpcUaSettings) -> ChooseCells {
    let settings = settings.clone();
    Arc::new(move |program: &Program, symbols: &Symbols| {
        TreeMaker::new(&settings, program, symbols, &[]).made().1
    })
}

/// The tree of a program. `inputs`: the operands that each field device moves, by device.
pub fn tree(
    settings: &OpcUaSettings,
    program: &Program,
    symbols: &Symbols,
    inputs: &[Vec<Address>],
) -> PlantTree {
    TreeMaker::new(settings, program, symbols, inputs).made().0
}

struct TreeMaker<'p> {
    settings: &'p OpcUaSettings,
    program: &'p Program,
    symbols: &'p Symbols,
    /// The devices that move an operand.
    movers: HashMap<Address, Vec<usize>>,
    tree: PlantTree,
    cells: Vec<NamedCell>,
    /// The index of each node by its id.
    places: HashMap<String, usize>,
}

impl PlantVariable {
    /// An array without elements, which clients may write.
    pub fn array_of(tag_type: TagType) -> PlantVariable {
        PlantVariable {
            tag_type,
            cells: Vec::new(),
            is_array: true,
            unit: None,
            limits: None,
            texts: Vec::new(),
            may_write: true,
            wants_reason: false,
            devices: Vec::new(),
        }
    }
}

impl<'p> TreeMaker<'p> {
    fn new(
        settings: &'p OpcUaSettings,
        program: &'p Program,
        symbols: &'p Symbols,
        inputs: &[Vec<Address>],
    ) -> TreeMaker<'p> {
        let mut movers: HashMap<Address, Vec<usize>> = HashMap::new();
        for (device, operands) in inputs.iter().enumerate() {
            for operand in operands {
                movers.entry(*operand).or_default().push(device);
            }
        }
        TreeMaker {
            settings,
            program,
            symbols,
            movers,
            tree: PlantTree::default(),
            cells: Vec::new(),
            places: HashMap::new(),
        }
    }

    fn made(mut self) -> (PlantTree, Vec<NamedCell>) {
        for tag in &self.program.tags {
            if let TagMeaning::Address(address) = tag.meaning {
                self.tag(tag, address);
            }
        }
        self.programs();
        self.devices();
        (self.tree, self.cells)
    }

    /// A tag with an address: a value, an element of an array, or a structure.
    fn tag(&mut self, tag: &Tag, address: Address) {
        if matches!(address, Address::Structure(_)) {
            let wanted: Vec<_> = address
                .named_operands(&tag.name)
                .filter(|(name, _)| self.settings.shows(name))
                .collect();
            if wanted.is_empty() {
                return;
            }
            self.object(&tag.name, tag.doc.as_deref());
            for (name, operand) in wanted {
                self.value(&name, None, operand);
            }
            return;
        }
        if !self.settings.shows(&tag.name) {
            return;
        }
        match IndexedName::of(&tag.name) {
            Some(IndexedName { base, behind: "", .. }) if tag.of_array.is_some() => {
                self.element(base.to_owned(), tag, address);
            }
            Some(_) | None => self.value(&tag.name, Some(tag), address),
        }
    }

    /// An element of an array: the array is one value.
    fn element(&mut self, array: String, tag: &Tag, address: Address) {
        if !self.places.contains_key(&array) {
            self.value(&array, Some(tag), address);
            if let Some(variable) = self.variable(&array) {
                variable.is_array = true;
            }
            return;
        }
        let Some(cell) = self.symbols.layout.cell(address) else { return };
        let number = self.chosen(tag.name.clone(), cell);
        if let Some(variable) = self.variable(&array) {
            variable.cells.push(number);
        }
    }

    fn variable(&mut self, id: &str) -> Option<&mut PlantVariable> {
        let place = *self.places.get(id)?;
        self.tree.nodes.get_mut(place)?.variable.as_mut()
    }

    fn chosen(&mut self, name: String, cell: Cell) -> u32 {
        self.cells.push((name, cell));
        self.cells.len() as u32 - 1
    }

    /// A value with a name of its own.
    fn value(&mut self, id: &str, tag: Option<&Tag>, address: Address) {
        let Some(cell) = self.symbols.layout.cell(address) else { return };
        let tag_type = TagType::of(address, cell, self.symbols);
        let number = self.chosen(id.to_owned(), cell);
        let (parent, name) = self.above(id);
        let content = |limit: &Option<(i32, _)>| limit.as_ref().map(|(content, _)| *content);
        let limits = tag.and_then(|tag| content(&tag.min).zip(content(&tag.max)));
        let texts = tag.and_then(|tag| tag.texts.as_ref());
        let variable = PlantVariable {
            tag_type,
            cells: vec![number],
            is_array: false,
            unit: tag.and_then(|tag| tag.unit.as_ref()).map(|unit| unit.text.clone()),
            limits: limits.map(|(low, high)| (shown(tag_type, low), shown(tag_type, high))),
            texts: texts.map_or_else(Vec::new, |texts| {
                texts.iter().map(|(value, text)| (value, text.to_owned())).collect()
            }),
            may_write: self.settings.write.iter().any(|name| name == id),
            wants_reason: false,
            devices: self.movers.get(&address).cloned().unwrap_or_default(),
        };
        let doc = tag.and_then(|tag| tag.doc.clone());
        self.node(PlantNode { id: id.to_owned(), parent, name, doc, variable: Some(variable) });
    }

    /// An object with nodes below it.
    fn object(&mut self, id: &str, doc: Option<&str>) {
        if self.places.contains_key(id) {
            return;
        }
        let (parent, name) = self.above(id);
        let doc = doc.map(str::to_owned);
        self.node(PlantNode { id: id.to_owned(), parent, name, doc, variable: None });
    }

    fn node(&mut self, node: PlantNode) {
        self.places.insert(node.id.clone(), self.tree.nodes.len());
        self.tree.nodes.push(node);
    }

    /// The node above the one with this id, which is made if it is missing, and the name below it:
    /// `recipe[2].target` is `target` below `recipe[2]`, which is below `recipe`.
    fn above(&mut self, id: &str) -> (String, String) {
        let whole = || (TAGS.to_owned(), id.to_owned());
        if let Some(IndexedName { base, index, behind }) = IndexedName::of(id) {
            let element = format!("{base}[{index}]");
            return match behind.strip_prefix('.') {
                Some(member) => {
                    self.object(base, self.record_doc(base).as_deref());
                    self.object(&element, None);
                    (element, member.to_owned())
                }
                None => {
                    self.object(base, self.record_doc(base).as_deref());
                    (base.to_owned(), format!("[{index}]"))
                }
            };
        }
        let Some((before, last)) = id.rsplit_once('.') else { return whole() };
        let is_structure = self.places.contains_key(before);
        let is_record = self.program.records.iter().any(|record| record.name == before);
        if is_record {
            self.object(before, self.record_doc(before).as_deref());
        }
        if is_structure || is_record { (before.to_owned(), last.to_owned()) } else { whole() }
    }

    fn record_doc(&self, name: &str) -> Option<String> {
        let record = self.program.records.iter().find(|record| record.name == name)?;
        record.doc.clone()
    }

    /// Programs and Tasks with their Stages.
    fn programs(&mut self) {
        let is_own = |block: &&Block| match block.kind {
            BlockKind::Program | BlockKind::Task => true,
            BlockKind::FirstScan
            | BlockKind::TopOfScan
            | BlockKind::BottomOfScan
            | BlockKind::LastScan
            | BlockKind::Subroutine => false,
        };
        for block in self.program.blocks.iter().filter(is_own) {
            let object = format!("{PROGRAMS}/{}", block.name);
            let done = (block.kind == BlockKind::Task).then_some((Bit::Done(block.id), "Done"));
            let bits = [(Bit::Running(block.id), "Running")].into_iter().chain(done);
            let stages = block.stages.iter().enumerate().filter_map(|(at, stage)| {
                let place = self.program.stages.iter().position(|known| *known == (block.id, at));
                let id = StageId(u32::try_from(place?).ok()?);
                Some((Bit::Stage(id), stage.name.clone()))
            });
            let bits: Vec<(Bit, String)> =
                bits.map(|(bit, name)| (bit, name.to_owned())).chain(stages).collect();
            let (doc, name) = (block.doc.clone(), block.name.clone());
            let parent = PROGRAMS.to_owned();
            self.node(PlantNode { id: object.clone(), parent, name, doc, variable: None });
            for (bit, name) in bits {
                let id = format!("{}.{name}", block.name);
                self.bit(id, &object, name, bit);
            }
        }
    }

    /// The field devices with their state.
    fn devices(&mut self) {
        for (at, device) in self.program.devices.iter().enumerate() {
            let object = format!("{DEVICES}/{device}");
            let parent = DEVICES.to_owned();
            let (name, doc) = (device.clone(), None);
            self.node(PlantNode { id: object.clone(), parent, name, doc, variable: None });
            let id = DeviceId(at as u32);
            for health in [DeviceBit::Ok, DeviceBit::Stale] {
                let name = health.name().to_owned();
                let number =
                    self.bit(format!("{device}.{name}"), &object, name, Bit::Device(id, health));
                if let (DeviceBit::Ok, Some(number)) = (health, number) {
                    self.tree.device_ok.push(number);
                }
            }
        }
    }

    fn bit(&mut self, id: String, parent: &str, name: String, bit: Bit) -> Option<u32> {
        let cell = self.symbols.layout.cell(Address::Bit(bit))?;
        let number = self.chosen(id.clone(), cell);
        let variable = PlantVariable {
            tag_type: TagType::Bit,
            cells: vec![number],
            is_array: false,
            unit: None,
            limits: None,
            texts: Vec::new(),
            may_write: false,
            wants_reason: false,
            devices: Vec::new(),
        };
        let parent = parent.to_owned();
        self.node(PlantNode { id, parent, name, doc: None, variable: Some(variable) });
        Some(number)
    }
}

/// The number that a content stands for.
fn shown(tag_type: TagType, content: i32) -> f64 {
    match tag_type {
        TagType::Real => f64::from(Real::of_cell(content).number()),
        TagType::Bit | TagType::Unsigned16 | TagType::Signed16 | TagType::Signed32 => {
            f64::from(content)
        }
    }
}
