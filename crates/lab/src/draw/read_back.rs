//! Reads drawings back, as a person does: wires, symbols and names. Tests compare the result with
//! the original rung.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use rungd_base::random::SplitMix64;
use rungd_engine::isa::LegName;
use rungd_language::resolve::program::{Contact, Edge, Rung};

use super::wording::Wording;

/// A point of a drawing, in characters or in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct ReadPoint {
    x: usize,
    y: usize,
}

/// A straight wire between two points.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReadWire {
    from: ReadPoint,
    to: ReadPoint,
}

impl ReadWire {
    fn has(self, point: ReadPoint) -> bool {
        let ReadWire { from: a, to: b } = self;
        let within =
            |at: usize, one: usize, other: usize| at >= one.min(other) && at <= one.max(other);
        within(point.x, a.x, b.x) && within(point.y, a.y, b.y)
    }
}

/// A symbol in a line of text.
struct ReadSymbol<'t> {
    symbol: &'t str,
    /// The word above it.
    above: &'t str,
    /// The ends of the wires before and after it.
    place: ReadWire,
    /// Whether nothing but the right rail is after it.
    is_last: bool,
}

/// The wires, contacts and instructions that were read.
#[derive(Debug, Default)]
pub(super) struct ReadRung {
    /// The wires.
    pub wires: Vec<ReadWire>,
    /// Contacts between two points. A contact conducts while its statement is true, or with
    /// `false`, while it is false.
    pub contacts: Vec<(ReadPoint, ReadPoint, String, bool)>,
    /// The point from which an instruction gets its power, its leg (or ""), and its text.
    pub outlets: Vec<(ReadPoint, String, String)>,
}

/// The truth of the statements at contacts.
pub(super) type Truth<'t> = &'t dyn Fn(&str) -> bool;

impl ReadRung {
    /// The powers of the outlets, in the order of their points. `nodes`: the node of each point.
    fn powers(
        &self,
        nodes: &HashMap<ReadPoint, usize>,
        truth: Truth,
    ) -> Vec<(String, String, bool)> {
        let mut reached: HashSet<usize> = HashSet::new();
        let rail = nodes.iter().filter(|(point, _)| point.x == 0);
        let mut todo: Vec<usize> = rail.map(|(_, node)| *node).collect();
        while let Some(node) = todo.pop() {
            if !reached.insert(node) {
                continue;
            }
            for (from, to, statement, plain) in &self.contacts {
                if nodes[from] == node && truth(statement) == *plain {
                    todo.push(nodes[to]);
                }
            }
        }
        let mut outlets: Vec<_> = self.outlets.iter().collect();
        outlets.sort_by_key(|(point, ..)| (point.y, point.x));
        let power = |(point, leg, text): &&(ReadPoint, String, String)| {
            (leg.clone(), text.clone(), reached.contains(&nodes[point]))
        };
        outlets.iter().map(power).collect()
    }

    /// The points that wires join, as the number of their node.
    fn nodes(&self) -> HashMap<ReadPoint, usize> {
        let points: HashSet<ReadPoint> = self.points().into_iter().collect();
        let mut nodes = HashMap::new();
        for (number, first) in points.iter().enumerate() {
            let mut todo = vec![*first];
            while let Some(point) = todo.pop() {
                if nodes.contains_key(&point) {
                    continue;
                }
                nodes.insert(point, number);
                for wire in self.wires.iter().filter(|wire| wire.has(point)) {
                    todo.extend(points.iter().copied().filter(|point| wire.has(*point)));
                }
            }
        }
        nodes
    }

    /// All points at which a wire or contact begins or ends, or an outlet begins.
    fn points(&self) -> Vec<ReadPoint> {
        let wires = self.wires.iter().flat_map(|wire| [wire.from, wire.to]);
        let contacts = self.contacts.iter().flat_map(|(a, b, ..)| [*a, *b]);
        let outlets = self.outlets.iter().map(|(point, ..)| *point);
        wires.chain(contacts).chain(outlets).collect()
    }
}

/// The powers at the outlets of a rung, by its text.
pub(super) fn expected(
    rung: &Rung,
    wording: &Wording,
    truth: Truth,
) -> Vec<(String, String, bool)> {
    let all = |contacts: &[Contact]| contacts.iter().all(|contact| is_on(contact, wording, truth));
    let text = |instruction| {
        let (mnemonic, operands) = wording.instruction(instruction);
        [&[mnemonic.to_owned()], &*operands].concat().join(" ")
    };
    let mut powers = Vec::new();
    if let ([instruction], [first, ..]) = (&*rung.body, &*rung.legs)
        && first.name != LegName::When
    {
        for leg in &rung.legs {
            powers.push((leg.name.key().to_owned(), text(instruction), all(&leg.contacts)));
        }
        return powers;
    }
    let own = rung.legs.first().is_none_or(|leg| all(&leg.contacts));
    powers.extend(rung.body.iter().map(|instruction| (String::new(), text(instruction), own)));
    for branch in &rung.branches {
        let on = own && all(&branch.contacts);
        powers.extend(branch.body.iter().map(|instruction| (String::new(), text(instruction), on)));
    }
    powers
}

fn is_on(contact: &Contact, wording: &Wording, truth: Truth) -> bool {
    match contact {
        Contact::All(all, _) => all.iter().all(|contact| is_on(contact, wording, truth)),
        Contact::Any(any, _) => any.iter().any(|contact| is_on(contact, wording, truth)),
        Contact::Not(inner, _) => !is_on(inner, wording, truth),
        Contact::Edge(edge, inner, _) => match (&**inner, edge) {
            (Contact::Bit(..), Edge::Rise) => truth(&format!("P {}", wording.contact(inner))),
            (Contact::Bit(..), Edge::Fall) => truth(&format!("N {}", wording.contact(inner))),
            (_, Edge::Rise | Edge::Fall) => truth(&wording.contact(contact)),
        },
        Contact::Bit(..) | Contact::Element(..) | Contact::Compare(..) | Contact::Computed(..) => {
            truth(&wording.contact(contact))
        }
    }
}

/// Compares a drawing that was read with its rung, for random values of the statements.
pub(super) fn compare(read: &ReadRung, rung: &Rung, wording: &Wording, drawn: &str) {
    let (mut random, nodes) = (SplitMix64(7), read.nodes());
    for _ in 0..60 {
        let mut known: BTreeMap<String, bool> = BTreeMap::new();
        let statements = read.contacts.iter().map(|(_, _, statement, _)| statement.clone());
        for statement in statements {
            known.entry(statement).or_insert_with(|| !random.next().is_multiple_of(3));
        }
        let truth = |statement: &str| {
            *known.get(statement).unwrap_or_else(|| panic!("`{statement}` is not in\n{drawn}"))
        };
        assert_eq!(
            read.powers(&nodes, &truth),
            expected(rung, wording, &truth),
            "{known:?}\n{drawn}"
        );
    }
}

/// Reads a rung drawn as text with lines.
pub(super) fn of_text(lines: &[String]) -> ReadRung {
    let mut chars: Vec<Vec<char>> = lines.iter().map(|line| line.chars().collect()).collect();
    let mut read = ReadRung::default();
    framed(&mut chars, &mut read);
    let chars = chars;
    let at = |x: usize, y: usize| chars.get(y).and_then(|line| line.get(x)).copied().unwrap_or(' ');
    for (y, line) in chars.iter().enumerate() {
        let mut x = 0;
        while x < line.len() {
            if goes_right(line[x]) && goes_left(at(x + 1, y)) {
                read.wires
                    .push(ReadWire { from: ReadPoint { x, y }, to: ReadPoint { x: x + 1, y } });
            }
            if goes_down(line[x]) && goes_up(at(x, y + 1)) {
                read.wires
                    .push(ReadWire { from: ReadPoint { x, y }, to: ReadPoint { x, y: y + 1 } });
            }
            let begins = matches!(line[x], ']' | '[' | '(');
            if !begins || x == 0 || !goes_right(line[x - 1]) {
                x += 1;
                continue;
            }
            let end = symbol_end(line, x);
            let symbol: String = line[x..end].iter().collect();
            let above = label(chars.get(y.wrapping_sub(1)), x..end);
            let place = ReadWire { from: ReadPoint { x: x - 1, y }, to: ReadPoint { x: end, y } };
            let is_last = line[end..line.len() - 1].iter().all(|c| *c == '─');
            assert!(!is_last || line.last() == Some(&'┤'), "the right rail: {lines:?}");
            let symbol = ReadSymbol { symbol: &symbol, above: &above, place, is_last };
            symbol_read(&mut read, &symbol);
            x = end;
        }
    }
    read
}

fn symbol_read(read: &mut ReadRung, ReadSymbol { symbol, above, place, is_last }: &ReadSymbol) {
    let ReadWire { from, to } = *place;
    let mut contact = |statement: String, plain: bool| {
        read.contacts.push((from, to, statement, plain));
    };
    match *symbol {
        "] [" => contact((*above).to_owned(), true),
        "]/[" => contact((*above).to_owned(), false),
        "]P[" => contact(format!("P {above}"), true),
        "]N[" => contact(format!("N {above}"), true),
        "]/P[" => contact(format!("P {above}"), false),
        "]/N[" => contact(format!("N {above}"), false),
        "( )" => read.outlets.push((from, String::new(), format!("OUT {above}"))),
        "(S)" => read.outlets.push((from, String::new(), format!("SET {above}"))),
        "(R)" => read.outlets.push((from, String::new(), format!("RST {above}"))),
        "(P)" => read.outlets.push((from, String::new(), format!("PD {above}"))),
        "(N)" => read.outlets.push((from, String::new(), format!("ND {above}"))),
        boxed => {
            let inner = boxed.trim_start_matches('[').strip_suffix(']').unwrap_or(boxed);
            match (*is_last, inner.strip_prefix("!(")) {
                (false, Some(inner)) => {
                    contact(inner.strip_suffix(')').unwrap_or(inner).to_owned(), false);
                }
                (false, None) => contact(inner.to_owned(), true),
                (true, _) => read.outlets.push((from, String::new(), inner.to_owned())),
            }
        }
    }
}

/// Reads an instruction in a frame, into which its legs lead, and takes the frame away. The text of
/// the instruction is in the first row, after the leg.
fn framed(chars: &mut [Vec<char>], read: &mut ReadRung) {
    let corner = |c: char, line: &Vec<char>| line.iter().position(|other| *other == c);
    let place = |c: char| (0..).zip(&*chars).find_map(|(y, line)| Some((corner(c, line)?, y)));
    let (Some((left, top)), Some((right, _))) = (place('┌'), place('┐')) else { return };
    let bottom = (top..chars.len()).find(|y| chars[*y][left] == '└').expect("a frame ends");
    let mut text = None;
    for (y, line) in chars.iter_mut().enumerate().take(bottom + 1).skip(top) {
        let inner: String = line[left + 1..right].iter().collect();
        let (leg, behind) = inner.trim().split_once(' ').unwrap_or((inner.trim(), ""));
        if line[left] == '┤' {
            let from = ReadPoint { x: left - 1, y };
            let text = text.get_or_insert_with(|| behind.trim().to_owned());
            read.outlets.push((from, leg.to_owned(), text.clone()));
        } else if y > top && y < bottom {
            assert_eq!((line[left], leg), ('│', ""), "{inner}");
        }
        line[left..=right].fill(' ');
    }
}

/// The position after a symbol, which may contain closed brackets.
fn symbol_end(line: &[char], start: usize) -> usize {
    if line[start] == ']' {
        return start + line[start..].iter().position(|c| *c == '[').unwrap_or(0) + 1;
    }
    let (open, close) = if line[start] == '[' { ('[', ']') } else { ('(', ')') };
    let mut depth = 0;
    for (at, c) in line.iter().enumerate().skip(start) {
        depth += i32::from(*c == open) - i32::from(*c == close);
        if depth == 0 {
            return at + 1;
        }
    }
    line.len()
}

/// The word above a symbol.
fn label(line: Option<&Vec<char>>, mut columns: Range<usize>) -> String {
    let Some(line) = line else { return String::new() };
    let is_name =
        |at: &usize| line.get(*at).is_some_and(|c| *c != ' ' && !"│├┤┼┬┴┘┐└┌".contains(*c));
    let Some(inside) = columns.find(is_name) else { return String::new() };
    let start = (0..=inside).rev().take_while(is_name).last().unwrap_or(inside);
    let end = (inside..line.len()).take_while(is_name).last().unwrap_or(inside);
    line[start..=end].iter().collect()
}

fn goes_right(c: char) -> bool {
    "─┌└├┬┴┼".contains(c)
}

fn goes_left(c: char) -> bool {
    "─┐┘┤┬┴┼".contains(c)
}

fn goes_down(c: char) -> bool {
    "│┌┐├┤┬┼".contains(c)
}

fn goes_up(c: char) -> bool {
    "│└┘├┤┴┼".contains(c)
}

/// Reads a rung in a page or picture.
pub(super) fn of_svg(body: &str) -> ReadRung {
    let mut read = ReadRung::default();
    let mut rest = body;
    // Outside of groups there are only wires.
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        if rest.starts_with("<g ") {
            let end = rest.find("</g>").expect("a group ends");
            group(&mut read, &rest[..end]);
            rest = &rest[end..];
        } else if rest.starts_with("<path class=\"wire\"") {
            read.wires.extend(paths(rest.split('>').next().expect("a tag")));
        }
        rest = &rest[1..];
    }
    // The drawing begins at the rail, which is at the left.
    let rail = 12;
    let left = |point: &mut ReadPoint| point.x = if point.x == rail { 0 } else { point.x };
    read.wires.iter_mut().flat_map(|wire| [&mut wire.from, &mut wire.to]).for_each(left);
    read.contacts.iter_mut().flat_map(|(from, to, ..)| [from, to]).for_each(left);
    read.outlets.iter_mut().map(|(point, ..)| point).for_each(left);
    read
}

fn group(read: &mut ReadRung, group: &str) {
    let class = attribute(group, "class");
    let name = attribute(group, "data-name");
    let wires: Vec<ReadWire> = group
        .split("<path ")
        .filter(|element| element.starts_with("class=\"wire\""))
        .flat_map(paths)
        .collect();
    if let Some(form) = class.strip_prefix("contact ") {
        let (from, to) = (wires[0].from, wires[1].to);
        let (statement, plain) = match form {
            "open" | "boxed" => (name, true),
            "closed" | "not-boxed" => (name, false),
            "rising" => (format!("P {name}"), true),
            "falling" => (format!("N {name}"), true),
            "not-rising" => (format!("P {name}"), false),
            "not-falling" => (format!("N {name}"), false),
            other => panic!("a contact is {other}"),
        };
        return read.contacts.push((from, to, statement, plain));
    }
    let mnemonic = attribute(group, "data-mnemonic");
    let text = if class == "coil" { format!("{mnemonic} {name}") } else { name };
    let legs: Vec<&str> = group.split("<text class=\"leg\"").skip(1).collect();
    for (at, wire) in wires.iter().enumerate() {
        let leg = legs.get(at).and_then(|leg| leg.split(['>', '<']).nth(1)).unwrap_or_default();
        read.outlets.push((wire.from, leg.to_owned(), text.clone()));
    }
}

fn attribute(tag: &str, name: &str) -> String {
    let value = tag.split(&format!("{name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
    let text = value.unwrap_or_default().replace("&lt;", "<").replace("&gt;", ">");
    text.replace("&quot;", "\"").replace("&#39;", "'").replace("&amp;", "&")
}

/// The straight lines of a path, such as `M12 30H40M40 30V88`.
fn paths(tag: &str) -> Vec<ReadWire> {
    let path = attribute(tag, " d");
    let number = |text: &str| text.trim().parse::<usize>().expect("a number");
    path.split('M')
        .filter(|part| !part.is_empty())
        .map(|part| {
            let (start, along) = part.split_once(['H', 'V']).expect("a straight line");
            let (x, y) = start.split_once(' ').expect("a point");
            let (from, along) = (ReadPoint { x: number(x), y: number(y) }, number(along));
            let is_level = part.contains('H');
            let to = if is_level {
                ReadPoint { x: along, ..from }
            } else {
                ReadPoint { y: along, ..from }
            };
            ReadWire { from, to }
        })
        .collect()
}
