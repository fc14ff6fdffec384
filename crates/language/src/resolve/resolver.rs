//! The state of one load, and what every part of it needs: names are looked up, their uses
//! recorded, their mistakes reported.

use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::LazyLock;

use super::alarm_terms::WrittenAck;
use super::array::{Array, ArrayElement};
use super::layers::Layers;
use super::mistake::declared;
use super::program::{BlockKind, NamedArray, NamedOperand};
use super::record::RecordPlace;
use super::scope::{MisplacedName, NamedThing, Scope};
use super::template::pending::{Argument, UnusedTemplate};
use crate::source::atom::{Atom, AtomKind};
use crate::source::finding::{Code, Finding, Severity, TABLE};
use crate::source::fix::{Help, advise, possible};
use crate::source::indexed::IndexedName;
use crate::source::nearest::KnownNames;
use crate::source::reader::Text;
use crate::source::record::Records;
use crate::source::span::{FileId, Located, SourceFile, Span};
use rungd_base::progress::Progress;
use rungd_engine::isa::{Address, MemorySizes, Structure};

/// The names of all warnings, valid in `allow`.
static WARNINGS: LazyLock<KnownNames> = LazyLock::new(|| {
    let rows = TABLE.iter().filter(|row| row.severity == Severity::Warning);
    KnownNames::new(rows.map(|row| row.name))
});

/// The inputs of a load besides the ladder files.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Sizes of the memory blocks.
    pub sizes: MemorySizes,
    /// `order` of a controller file.
    pub order: Option<Located<Vec<Text>>>,
    /// Whether a controller file lists the ladders.
    pub has_controller: bool,
    /// The field devices of a controller file, in its order.
    pub devices: Vec<Text>,
    /// The texts of a controller file that may be addresses or ranges: no tag with a `type` is
    /// placed there.
    pub addresses: Vec<String>,
    /// The number of the first file: spans of the ladder at index k have the file `first_file + k`.
    pub first_file: FileId,
    /// The progress of the load.
    pub progress: Progress,
}

/// The state of one load: the names declared so far, and the findings.
pub(super) struct Resolver<'a> {
    pub(super) files: &'a [SourceFile],
    pub(super) options: &'a LoadOptions,
    pub(super) scope: Scope,
    pub(super) findings: Vec<Finding>,
    /// Whether the readers made findings. If so, a block may be missing because it was not
    /// readable.
    pub(super) misread: bool,
    /// Per tag: whether the ladder names it.
    pub(super) used: Vec<bool>,
    /// Bits and words with their names as written in the ladder, in order of resolving.
    pub(super) named: Vec<(Span, NamedOperand)>,
    /// The arrays that the ladder names.
    pub(super) arrays: Vec<(Span, NamedArray)>,
    /// The places where the ladder names a constant by its tag, and the tag's index.
    pub(super) constants: Vec<(Span, usize)>,
    /// The places of the rungs of templates.
    pub(super) layers: Layers,
    /// The names of the uses in rungs.
    pub(super) use_names: Vec<Text>,
    /// The whole names of all uses in rungs, including uses within uses.
    pub(super) uses: Vec<String>,
    /// The whole names of the uses whose template is unknown.
    pub(super) unknown_uses: Vec<String>,
    /// The arguments of the uses.
    pub(super) arguments: Vec<Argument>,
    /// Templates that nothing uses.
    pub(super) trials: Vec<UnusedTemplate>,
    /// The number of elements of whole arrays in formulas, so far.
    pub(super) elements: usize,
    /// The number of elements of the arrays of all tags, so far.
    pub(super) tag_elements: usize,
    /// The records of all files.
    pub(super) records: Records,
    /// The places of the findings about fields: each field is declared once a tag.
    pub(super) field_findings: HashSet<(Code, Span)>,
    /// The number of tags that the fields of all records have become, so far.
    pub(super) field_tags: usize,
    /// The condition of a test that is resolved, which is in no file of the ladder.
    pub(super) condition: Option<ConditionText>,
    /// Whether the expression that is resolved is in a contact, which touches no status bit.
    pub(super) is_in_contact: bool,
    /// Whether an observer of a test is resolved, in the names of a program.
    pub(super) observes: bool,
    /// The memory sizes with the places of an observer's tags.
    pub(super) grown: Option<MemorySizes>,
    /// The bits of `ack` that are not looked up yet.
    pub(super) acks: Vec<WrittenAck>,
    /// The words of tags, for tags that are a bit of one.
    pub(super) tag_words: Option<super::tag_words::TagWords>,
}

/// The text of a condition, and its place.
pub(super) struct ConditionText {
    pub text: String,
    pub span: Span,
}

impl ConditionText {
    fn has(&self, span: Span) -> bool {
        span.file == self.span.file && self.span.start <= span.start && span.end <= self.span.end
    }

    fn text(&self, span: Span) -> &str {
        let (start, end) = (span.start - self.span.start, span.end - self.span.start);
        self.text.get(start as usize..end as usize).unwrap_or("")
    }
}

impl<'a> Resolver<'a> {
    pub(super) fn new(files: &'a [SourceFile], options: &'a LoadOptions) -> Self {
        let scope = Scope::new(options.sizes.clone());
        Resolver {
            files,
            options,
            scope,
            findings: Vec::new(),
            misread: false,
            used: Vec::new(),
            named: Vec::new(),
            arrays: Vec::new(),
            constants: Vec::new(),
            layers: Layers::default(),
            use_names: Vec::new(),
            uses: Vec::new(),
            unknown_uses: Vec::new(),
            arguments: Vec::new(),
            trials: Vec::new(),
            elements: 0,
            tag_elements: 0,
            records: Records::new(),
            field_findings: HashSet::new(),
            field_tags: 0,
            condition: None,
            is_in_contact: false,
            observes: false,
            grown: None,
            acks: Vec::new(),
            tag_words: None,
        }
    }

    /// Checks a name of an `allow`: it must be the name of a warning.
    pub(super) fn allowed(&mut self, name: &Text) -> String {
        let message = match Code::from_name(&name.text).map(Code::severity) {
            Some(Severity::Warning) => return name.text.clone(),
            Some(Severity::Error) => format!("`{}` is an error: it cannot be silenced", name.text),
            None => format!("no warning is called `{}`", name.text),
        };
        let finding = Finding::new(Code::UnknownAllow, name.span, message);
        self.findings.push(finding.near(&name.text, &WARNINGS));
        name.text.clone()
    }

    pub(super) fn find(&mut self, finding: Finding) {
        self.findings.push(finding);
    }

    /// Looks up a name; a mistake becomes a finding.
    pub(super) fn look_up(&mut self, name: &str, span: Span) -> Option<NamedThing> {
        match self.scope.look_up(name) {
            Ok(found) => {
                if let Some(tag) = found.tag {
                    self.used[tag] = true;
                }
                if let NamedThing::Record(place) = found.thing {
                    self.use_record(place);
                }
                if let NamedThing::Array(array) | NamedThing::Element(ArrayElement { array, .. }) =
                    found.thing
                {
                    self.note_array(name, span, array, found.tag);
                }
                if let Some(index) = &found.index {
                    self.note_index(index, span);
                }
                Some(found.thing)
            }
            Err(mistake) => {
                self.mark_used(name);
                let finding = mistake.finding(span);
                self.findings.extend(finding.map(|finding| self.layers.near(finding, name)));
                None
            }
        }
    }

    /// Marks the fields of a record as used.
    fn use_record(&mut self, place: RecordPlace) {
        let tags = self.scope.records()[place.tag].tags(place.number());
        let tags: Vec<usize> = tags.collect();
        tags.into_iter().for_each(|tag| self.used[tag] = true);
    }

    /// Records that the ladder names this array; with the index of the tag of its element 0.
    pub(super) fn note_array(&mut self, name: &str, span: Span, array: Array, tag: Option<usize>) {
        let name = name.to_owned();
        self.arrays.push((span, NamedArray { name, array, tag, behind: 0 }));
    }

    /// As [`Resolver::look_up`], for a place that accepts only tags of some types: the help for an
    /// unknown name proposes these types.
    pub(super) fn look_up_as(
        &mut self,
        name: &str,
        span: Span,
        types: &[&str],
    ) -> Option<NamedThing> {
        let before = self.findings.len();
        let thing = self.look_up(name, span);
        if let (None, [_, others @ ..]) = (thing, types)
            && !name.contains(['.', '['])
        {
            let mut found = self.findings.split_off(before);
            let words = others.iter().map(|other| format!(", or \"{other}\"")).collect::<String>();
            let declared = || declared(name, types, &words);
            self.findings.extend(found.drain(..).map(|finding| finding.declared_as(declared)));
        }
        thing
    }

    /// Looks up an operand's name; a constant becomes a finding. `types` are the types of tags that
    /// are accepted here.
    pub(super) fn thing<'t>(
        &mut self,
        atom: &'t Atom,
        wanted: &str,
        types: &[&str],
    ) -> Option<(&'t str, NamedThing)> {
        let name = self.name_of(atom, wanted)?;
        Some((name, self.look_up_as(name, atom.span, types)?))
    }

    /// The operand's name; a constant becomes a finding.
    pub(super) fn name_of<'t>(&mut self, atom: &'t Atom, wanted: &str) -> Option<&'t str> {
        if atom.name().is_none() {
            let message = format!("`{atom}` is a constant, not {wanted}");
            let finding = Finding::new(Code::OperandType, atom.span, message);
            let blocks: &[&str] = match wanted {
                "a bit" => &["C", "Y"],
                "a word" => &["D"],
                _ => &[],
            };
            let number = match atom.kind {
                AtomKind::Integer(number) => number.max(0),
                AtomKind::Duration(_) | AtomKind::Real(_) | AtomKind::Name(_) => 0,
            };
            let examples = blocks.iter().map(|block| possible(format!("{block}{number}")));
            self.find(finding.label(format!("{wanted} belongs here")).fixes(examples));
        }
        atom.name()
    }

    /// Records the word or constant that is an index.
    fn note_index(&mut self, name: &str, span: Span) {
        if let Some(thing) = self.look_up(name, span) {
            match thing {
                NamedThing::Constant(..) => self.note_constant(name, span),
                NamedThing::Address(address) => self.note(name, span, address),
                NamedThing::Real(_)
                | NamedThing::Block(_)
                | NamedThing::Device(_)
                | NamedThing::Array(_)
                | NamedThing::Record(_)
                | NamedThing::Element(_) => {}
            }
        }
    }

    pub(super) fn mark_used(&mut self, name: &str) {
        let column = IndexedName::of(name).map(|name| name.column());
        let tag = column.as_deref().map_or(name, |column| column);
        if let Some(tag) = self.scope.tag_index(tag) {
            self.used[tag] = true;
        }
    }

    /// Records that the ladder names this bit, word or structure.
    pub(super) fn note(&mut self, name: &str, span: Span, address: Address) {
        match address {
            Address::Structure(structure) => {
                let name = without_comma(name, address);
                let members = NamedOperand::members(&name, structure);
                self.named.extend(members.map(|member| (span, member)));
            }
            Address::Bit(_) | Address::Word(_) => {
                let name = without_comma(name, address);
                let element = self.scope.element_name(&name, address);
                let name = element.as_deref().unwrap_or(&name);
                self.named.push((span, NamedOperand::new(name, address)));
            }
        }
    }

    /// The name of a file.
    pub(super) fn file_name(&self, id: FileId) -> &'a str {
        let file = (id.0 - self.options.first_file.0) as usize;
        self.files.get(file).map_or("", |file| file.name.as_str())
    }

    /// The text of a place.
    pub(super) fn text(&self, span: Span) -> &str {
        if let Some(condition) = self.condition.as_ref().filter(|condition| condition.has(span)) {
            return condition.text(span);
        }
        let span = self.layers.in_file(span);
        let file = (span.file.0 - self.options.first_file.0) as usize;
        let text = self.files.get(file).map_or("", |file| file.text.as_str());
        text.get(span.start as usize..span.end as usize).unwrap_or("")
    }

    /// Records that the ladder names a tag's constant at this place.
    pub(super) fn note_constant(&mut self, name: &str, span: Span) {
        let tag = self.scope.tag_index(name);
        self.constants.extend(tag.map(|tag| (span, tag)));
    }

    /// Adds the finding for a thing of the wrong kind.
    pub(super) fn wrong_kind(&mut self, misplaced: MisplacedName, wanted: &str, help: Help) {
        let MisplacedName { name, span, thing } = misplaced;
        let help = if let NamedThing::Record(place) = thing {
            self.scope.name_a_field(name, place)
        } else {
            help
        };
        let message = format!("`{name}` is {}, not {wanted}", self.kind_words(thing));
        self.find(
            Finding::new(Code::OperandType, span, message)
                .label(format!("{wanted} belongs here"))
                .help(help),
        );
    }

    /// The kind of a thing, in words.
    pub(super) fn kind_words(&self, thing: NamedThing) -> &'static str {
        match thing {
            NamedThing::Array(_) => "an array",
            NamedThing::Record(place) => place.words(),
            NamedThing::Element(element) if element.array.is_bits() => "a bit",
            NamedThing::Address(Address::Bit(_)) => "a bit",
            NamedThing::Address(Address::Word(_)) | NamedThing::Element(_) => "a word",
            NamedThing::Address(Address::Structure(Structure::Counter(_))) => "a counter",
            NamedThing::Address(Address::Structure(Structure::Timer(_))) => "a timer",
            NamedThing::Address(Address::Structure(Structure::Sensaphone(_))) => {
                "a Sensaphone counter"
            }
            NamedThing::Constant(..) | NamedThing::Real(_) => "a constant",
            NamedThing::Device(_) => "a device",
            NamedThing::Block(id) => {
                let kind = self.scope.block_of(id).map_or(BlockKind::Task, |(_, block)| block.kind);
                match kind.word() {
                    "program" => "a program",
                    "subroutine" => "a subroutine",
                    _ => "a task",
                }
            }
        }
    }
}

/// The help for an array in the place of one element.
pub(super) fn of_array(name: &str, array: Array) -> Help {
    if let Some((array, _)) = name.split_once('[') {
        return advise(
            &format!("name one element: `{{}}`, or `{array}[step]` with a word as the index"),
            [possible(format!("{array}[3]"))],
        );
    }
    let last = array.count - 1;
    let words = format!(
        "name one element, `{{}}` to `{name}[{last}]`, or `{name}[step]` with a word as the index"
    );
    advise(&words, [possible(format!("{name}[0]"))])
}

/// A name as written; of a Sensaphone counter `N0` for `N,0`, which would be two columns of a list.
fn without_comma(name: &str, address: Address) -> Cow<'_, str> {
    match name.contains(',') {
        true => Cow::Owned(address.to_string()),
        false => Cow::Borrowed(name),
    }
}
