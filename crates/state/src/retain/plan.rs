//! The elements that a controller retains: their cells in the image, and their restoration.
//!
//! The plan is made from the program and the ranges of the controller file. `keeper` uses it to
//! gather the retained values of an image; the daemon uses it to restore them before the first
//! scan.
//!
//! Values are restored by tag, or by address if the element has no tag in the image and in the
//! program. So a tag with a new address keeps its value, and an address with a new meaning does not
//! get its old value.

use std::collections::{HashMap, HashSet};

use super::content::{
    self, ContentLists, ElementRun, ElementText, Preamble, RECORD_BYTES, RetainedContent,
    RetainedElement, RetainedValue, address, element_of, range, type_name, value_bytes,
};
use super::limits::RetainedLimits;
use super::owners::{RetainedShifts, SensaphonePreset, owners, preset, terminated};
pub use super::restoration::{DroppedElement, MemoryCount, Restoration, RestoredCell};
use super::stages::RetainedStages;
use rungd_engine::isa::{Address, Space, Structure, Word, WordSpace, status};
use rungd_engine::{BitCell, Cell, Layout, WordCell};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::{Program, TagMeaning};
use rungd_language::resolve::range::Range;

/// The elements that are retained.
#[derive(Clone, Debug)]
pub struct RetainPlan {
    layout: Layout,
    limits: RetainedLimits,
    runs: Vec<ElementRun>,
    tags: Vec<ElementText>,
    /// The elements whose only address is the name of their tag.
    placed: HashSet<RetainedElement>,
    owners: HashMap<RetainedElement, String>,
    shifts: RetainedShifts,
    stages: RetainedStages,
    preamble: Preamble,
    /// Whether the program names `$DownSeconds`.
    names_down_seconds: bool,
}

/// The greatest age of an image whose content does not change, if the program names
/// `$DownSeconds`. The images in between are not written, to spare the disk.
const AGE_MAX_MS: u64 = 60_000;

impl RetainPlan {
    /// The plan for the retained ranges of a program.
    pub fn new(ranges: &[Range], program: &Program, symbols: &Symbols) -> RetainPlan {
        let runs = runs(ranges, &terminated(program));
        let is_kept = |element: &RetainedElement| hold(&runs, *element);
        let mut tags = Vec::new();
        for tag in &program.tags {
            let TagMeaning::Address(at) = tag.meaning else { continue };
            if let Some(element) = element_of(at).filter(is_kept) {
                tags.push(ElementText { text: tag.name.clone(), element });
            }
        }
        let mut owners = owners(program);
        owners.retain(|owner| is_kept(&owner.element));
        let is_placed =
            |at: &RetainedElement| program.names.places.at(at.space.address(at.number)).is_some();
        let placed = tags.iter().map(|tag| tag.element).filter(is_placed).collect();
        let shifts = RetainedShifts::new(&symbols.identity, is_kept);
        let lists = ContentLists {
            runs: &runs,
            tags: &tags,
            placed: &placed,
            owners: &owners,
            shifts: &shifts.texts,
        };
        let preamble = Preamble::new(&lists);
        let owners = owners.into_iter().map(|owner| (owner.element, owner.text)).collect();
        let limits = RetainedLimits::new(program, symbols, element_of);
        let layout = symbols.layout.clone();
        let down_seconds = Address::Word(Word::Space(WordSpace::Dst, status::dst::DOWN_SECONDS));
        let names_down_seconds = program.operands.iter().any(|named| named.address == down_seconds);
        RetainPlan {
            layout,
            limits,
            runs,
            tags,
            placed,
            owners,
            shifts,
            stages: RetainedStages::new(&symbols.identity),
            preamble,
            names_down_seconds,
        }
    }

    /// The retained ranges in order, then the tags without an address, then the Programs: `C0..C7
    /// D100 shift`.
    pub fn ranges(&self) -> String {
        let mut ranges: Vec<(Space, u32, u32)> = Vec::new();
        let elements = self.runs.iter().flat_map(|run| {
            let space = run.space;
            (run.first..run.first + run.count).map(move |number| (space, number))
        });
        let is_placed = |(space, number): &(Space, u32)| {
            self.placed.contains(&RetainedElement { space: *space, number: *number })
        };
        for (space, number) in elements.filter(|element| !is_placed(element)) {
            match ranges.last_mut() {
                Some((same, _, last)) if (*same, *last + 1) == (space, number) => *last = number,
                _ => ranges.push((space, number, number)),
            }
        }
        let said = ranges.into_iter().map(|(space, first, last)| span(space, first, last));
        let tags = self.tags.iter().filter(|tag| self.placed.contains(&tag.element));
        let mut tags: Vec<String> = tags.map(|tag| tag.text.clone()).collect();
        tags.sort_unstable();
        said.chain(tags).chain(self.stages.names()).collect::<Vec<_>>().join(" ")
    }

    /// The number of retained elements; a Program with its Stages counts as one.
    pub fn elements(&self) -> usize {
        self.runs.iter().map(|run| run.count as usize).sum::<usize>() + self.stages.count()
    }

    /// Whether nothing is retained.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty() && self.stages.count() == 0
    }

    /// The number of bytes of a content.
    pub fn content_bytes(&self) -> usize {
        let values = self.runs.iter().map(|run| value_bytes(run.space) * run.count as usize);
        self.preamble.len() + values.sum::<usize>() + self.stages.bytes()
    }

    /// Whether an image is due although its content is the durable one, because the scan of that
    /// one was so long before. The image after the passes of a stop is always that of its scan.
    pub fn outdates(&self, age_ms: u64, is_final: bool) -> bool {
        self.names_down_seconds && age_ms >= if is_final { 1 } else { AGE_MAX_MS }
    }

    /// Writes the content for an image to a buffer.
    pub fn gather(&self, bits: &[u8], words: &[i32], into: &mut Vec<u8>) {
        into.clear();
        let clock = |clock: &BitCell| bits[clock.0 as usize];
        self.preamble.put(into, self.shifts.clocks.iter().map(clock));
        for run in &self.runs {
            let cells = |first: u32| first as usize..(first + run.count) as usize;
            match run.space.address(run.first) {
                Address::Bit(bit) => {
                    into.extend_from_slice(&bits[cells(self.layout.bit(bit).0)]);
                }
                Address::Word(word) => {
                    let words = &words[cells(self.layout.word(word).0)];
                    words.iter().for_each(|word| content::put_word(into, run.space, *word));
                }
                Address::Structure(first) => {
                    for number in run.first..run.first + run.count {
                        self.gather_structure(first.numbered(number), bits, words, into);
                    }
                }
            }
        }
        self.stages.gather(bits, into);
    }

    fn gather_structure(&self, at: Structure, bits: &[u8], words: &[i32], into: &mut Vec<u8>) {
        let word = |cell: WordCell| words[cell.0 as usize].to_le_bytes();
        into.extend(word(self.layout.word(Word::Acc(at))));
        if let Structure::Sensaphone(n) = at {
            into.extend(word(self.layout.word(Word::Pre(n))));
        }
        let record = self.layout.record_bits(at);
        into.extend_from_slice(&bits[record.start as usize..record.end as usize]);
    }

    /// The restoration of a content. `is_final`: the image was taken after the termination passes
    /// of its program.
    ///
    /// If it was not, call `Engine::terminate_all` afterwards. What an unchanged owner terminates
    /// is left to these passes, because a reset value can be a preset that a later pass resets. All
    /// else that the image's program terminates is terminated here, because the program of this
    /// plan may not terminate it.
    pub fn restore(&self, found: &RetainedContent, is_final: bool) -> Restoration {
        let mut restoration = Restoration::default();
        let mut drops = Vec::new();
        let values: HashMap<RetainedElement, &RetainedValue> =
            found.elements.iter().map(|(e, v)| (*e, v)).collect();
        let then = TagIndex::new(&found.tags, &found.placed);
        let now = TagIndex::new(&self.tags, &self.placed);
        let mut taken = HashSet::new();
        for run in &self.runs {
            for element in (run.first..run.first + run.count).map(|n| run.element(n)) {
                let from = source(element, &then, &now, &values);
                let Some(from) = from.filter(|from| same_type(*from, element)) else {
                    restoration.fresh += 1;
                    continue;
                };
                taken.insert(from);
                if let Some(why) = self.limits.refuse(element, values[&from].word) {
                    restoration.fresh += 1;
                    drops.push((from, why));
                    continue;
                }
                let mut value = *values[&from];
                let owner = found.owners.get(&from).map(String::as_str);
                if !is_final {
                    let mut terminated = value;
                    terminate(from, found, &mut terminated);
                    restoration.terminated += usize::from(terminated.word != value.word);
                    let same_owner = owner == self.owners.get(&element).map(String::as_str);
                    let same_pass = run.terminated == found.terminated.contains(&from);
                    if !(same_owner && same_pass) {
                        value = terminated;
                    }
                }
                self.put(&mut restoration, element, &value, owner);
            }
        }
        let from = |element| source(element, &then, &now, &values);
        restoration.puts.extend(self.shifts.restore(found, from));
        for (element, _) in &found.elements {
            if !taken.contains(element) {
                drops.push((*element, self.why(*element, &then, &now)));
            }
        }
        restoration.dropped.splice(0..0, dropped_lines(&drops, &then));
        self.stages.restore(&found.programs, &mut restoration);
        restoration
    }

    /// The cells that an image of the same program restores. `sizes`: the numbers of all bits and
    /// words of an engine with the program. Its tags may share names, as those of two programs in
    /// one memory do.
    pub fn restored_cells(&self, sizes: MemoryCount) -> Vec<RestoredCell> {
        let mut content = Vec::new();
        self.gather(&vec![1; sizes.bits], &vec![0; sizes.words], &mut content);
        let mut found = content::read(&content).expect("its own content");
        // Without limits nothing is refused; without tags each element takes its own value.
        found.tags.clear();
        let (limits, tags) = (RetainedLimits::default(), Vec::new());
        let plain = RetainPlan { limits, tags, ..self.clone() };
        let puts = plain.restore(&found, true).puts.into_iter();
        let limits = |cell| {
            let at = self.layout.address(cell).and_then(element_of)?;
            self.limits.limits(at)
        };
        puts.map(|(cell, _)| RestoredCell { cell, limits: limits(cell) }).collect()
    }

    fn put(
        &self,
        to: &mut Restoration,
        element: RetainedElement,
        value: &RetainedValue,
        owner: Option<&str>,
    ) {
        to.restored += 1;
        let (low, high) = range(element.space);
        let word = value.word.clamp(low, high);
        let at = element.space.address(element.number);
        let Address::Structure(structure) = at else {
            to.puts.extend(self.layout.cell(at).map(|cell| (cell, word)));
            return;
        };
        to.puts.push((Cell::Word(self.layout.word(Word::Acc(structure))), word));
        if let Structure::Sensaphone(n) = structure
            && self.takes_preset(to, element, value.preset, owner)
        {
            to.puts.push((Cell::Word(self.layout.word(Word::Pre(n))), value.preset));
        }
        // The flags belong to the structure; the bits after them belong to its owner.
        let flags = if element.space == Space::Sensaphone { 5 } else { 4 };
        let same_owner = owner.is_some() && owner == self.owners.get(&element).map(String::as_str);
        let kept = if same_owner { RECORD_BYTES } else { flags };
        let cells = self.layout.record_bits(structure);
        for (cell, bit) in cells.zip(value.record).take(kept) {
            to.puts.push((Cell::Bit(BitCell(cell)), i32::from(bit)));
        }
    }

    /// Whether a Sensaphone counter gets its PRE from the image. It does not if the ladder contains
    /// a new constant, which is then the intended preset.
    fn takes_preset(
        &self,
        to: &mut Restoration,
        element: RetainedElement,
        value: i32,
        owner: Option<&str>,
    ) -> bool {
        let now = self.owners.get(&element).and_then(|now| preset(now));
        let Some(SensaphonePreset::Constant(now)) = now else { return true };
        let what = format!("{}.PRE", TagIndex::new(&self.tags, &self.placed).element_text(element));
        let from = match owner.and_then(preset) {
            Some(SensaphonePreset::Constant(then)) if then == now => return true,
            Some(SensaphonePreset::Constant(then)) => format!("the ladder had {then}"),
            Some(SensaphonePreset::Location) => "the ladder had a location".to_owned(),
            None => {
                if value != now {
                    to.notes.push(format!("{what} is restored as {value}; the ladder has {now}"));
                }
                return true;
            }
        };
        if value != now {
            let why = format!("it was {value} ({from}), and is {now} now");
            to.dropped.push(DroppedElement { what, why });
        }
        false
    }

    /// The reason why an element of the image is not restored.
    fn why(&self, element: RetainedElement, then: &TagIndex<'_>, now: &TagIndex<'_>) -> String {
        let moved = then.tags_of(element).iter().find_map(|tag| Some((tag, now.element(tag)?)));
        if let Some((tag, at)) = moved {
            let (was, is) = (type_name(element.space), type_name(at.space));
            if !same_type(element, at) {
                let at = match now.placed.contains(&at) {
                    true => String::new(),
                    false => format!(", {}", address(at)),
                };
                return format!("its type changed: `{tag}` was {was} and is {is}{at}");
            }
            return format!(
                "`{tag}` is {0} now, and {0} got its value from a different tag",
                now.element_text(at)
            );
        }
        let here = hold(&self.runs, element);
        match (then.tags_of(element).first(), now.tags_of(element).first()) {
            (Some(_), _) => "no tag of this name is retained any more".to_owned(),
            (None, Some(tag)) if here => format!("it had no tag, and is `{tag}` now"),
            _ => "it is not retained any more".to_owned(),
        }
    }
}

/// Changes a value as a stop would have changed it.
fn terminate(element: RetainedElement, found: &RetainedContent, value: &mut RetainedValue) {
    if element.space == Space::Sensaphone {
        // The count stays; the enable bits and histories are as for a rung that is OFF.
        let enabled_and_histories = [0, 1, 5, 6, 7];
        enabled_and_histories.into_iter().for_each(|at| value.record[at] = 0);
    }
    if found.terminated.contains(&element) {
        value.word = 0;
        // Sets Reset and Zero. If the reset value is the preset, only the owner can set it. An
        // owner that still exists is terminated again in any case.
        value.record = [0, 1, 1, 0, 0, 0, 0, 0];
    }
}

/// The element of an image from which an element of the running program takes its value: the
/// element with the same tag, or, without tags on either side, the element at the same address.
fn source(
    element: RetainedElement,
    then: &TagIndex<'_>,
    now: &TagIndex<'_>,
    values: &HashMap<RetainedElement, &RetainedValue>,
) -> Option<RetainedElement> {
    let tags = now.tags_of(element);
    let from = match tags {
        [] if then.tags_of(element).is_empty() => Some(element),
        [] => None,
        tags => tags.iter().find_map(|tag| then.element(tag)),
    };
    from.filter(|from| values.contains_key(from))
}

fn same_type(a: RetainedElement, b: RetainedElement) -> bool {
    type_name(a.space) == type_name(b.space)
}

/// Tags by name and by element.
struct TagIndex<'a> {
    by_name: HashMap<&'a str, RetainedElement>,
    by_element: HashMap<RetainedElement, Vec<&'a str>>,
    placed: &'a HashSet<RetainedElement>,
}

impl<'a> TagIndex<'a> {
    fn new(tags: &'a [ElementText], placed: &'a HashSet<RetainedElement>) -> TagIndex<'a> {
        let mut names = TagIndex { by_name: HashMap::new(), by_element: HashMap::new(), placed };
        for ElementText { text, element } in tags {
            names.by_name.insert(text, *element);
            names.by_element.entry(*element).or_default().push(text);
        }
        names
    }

    fn element(&self, name: &str) -> Option<RetainedElement> {
        self.by_name.get(name).copied()
    }

    /// An element as text for people: its address, or its tag if rungd has chosen the address.
    fn element_text(&self, element: RetainedElement) -> String {
        let tag = self.tags_of(element).first().filter(|_| self.placed.contains(&element));
        tag.map_or_else(|| address(element), |tag| (*tag).to_owned())
    }

    fn tags_of(&self, element: RetainedElement) -> &[&'a str] {
        self.by_element.get(&element).map_or(&[], |names| &names[..])
    }
}

/// One line for each tag. Neighbouring addresses without a tag and with the same reason share a
/// line.
fn dropped_lines(drops: &[(RetainedElement, String)], then: &TagIndex<'_>) -> Vec<DroppedElement> {
    let mut lines: Vec<(RetainedElement, u32, &str, Option<String>)> = Vec::new();
    for (element, why) in drops {
        let tag = then.tags_of(*element).first();
        if tag.is_none()
            && let Some((first, last, same, None)) = lines.last_mut()
            && (first.space, *last + 1, *same) == (element.space, element.number, why.as_str())
        {
            *last += 1;
            continue;
        }
        let tag = tag.map(|tag| match then.placed.contains(element) {
            true => (*tag).to_owned(),
            false => format!("{tag} ({})", address(*element)),
        });
        lines.push((*element, element.number, why, tag));
    }
    let told =
        |(first, last, why, tag): (RetainedElement, u32, &str, Option<String>)| DroppedElement {
            what: match tag {
                Some(tag) => tag,
                None => span(first.space, first.number, last),
            },
            why: why.to_owned(),
        };
    lines.into_iter().map(told).collect()
}

/// Neighbouring elements in the form of the ladder: `D5`, `D5..D9`.
fn span(space: Space, first: u32, last: u32) -> String {
    let [from, to] = [first, last].map(|number| address(RetainedElement { space, number }));
    if first == last { from } else { format!("{from}..{to}") }
}

/// Whether an element is in one of the runs, which are in order and do not overlap.
fn hold(runs: &[ElementRun], element: RetainedElement) -> bool {
    let begins = |run: &ElementRun| (run.space, run.first) <= (element.space, element.number);
    let run = runs[..runs.partition_point(begins)].last();
    run.is_some_and(|run| run.space == element.space && element.number < run.first + run.count)
}

/// The ranges in order and without overlaps. Each run contains only elements that a stop
/// terminates, or only elements that it does not.
fn runs(ranges: &[Range], terminated: &HashSet<RetainedElement>) -> Vec<ElementRun> {
    let mut divided: Vec<ElementRun> = Vec::new();
    for run in merged(ranges) {
        for number in run.first..run.first + run.count {
            let is = terminated.contains(&run.element(number));
            match divided.last_mut() {
                Some(last) if number > run.first && last.terminated == is => last.count += 1,
                _ => divided.push(ElementRun { first: number, count: 1, terminated: is, ..run }),
            }
        }
    }
    divided
}

fn merged(ranges: &[Range]) -> Vec<ElementRun> {
    let kept = ranges.iter().filter(|range| Space::RETAINABLE.contains(&range.space));
    let mut all: Vec<(Space, u32, u32)> = kept.map(|r| (r.space, r.first, r.last)).collect();
    all.sort_unstable();
    let mut runs: Vec<ElementRun> = Vec::new();
    for (space, first, last) in all {
        if let Some(run) = runs.last_mut()
            && run.space == space
            && first <= run.first + run.count
        {
            run.count = run.count.max(last + 1 - run.first);
            continue;
        }
        runs.push(ElementRun { space, first, count: last + 1 - first, terminated: false });
    }
    runs
}
