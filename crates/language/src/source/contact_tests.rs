//! The grammar of contacts as a list of examples, and property tests of the parser and the printer.

use expect_test::{Expect, expect};
use proptest::prelude::*;

use super::atom::{Atom, AtomKind};
use super::contact::{Comparison, Edge, WrittenContact};
use super::contact_parser::parse;
use super::contact_side::{CompareSide, ContactExpression};
use super::expression::{Binary, Expression, ExpressionPart, ExpressionPartKind, Unary};
use super::span::{FileId, Located, Span};

fn span_of(text: &str) -> Span {
    Span { file: FileId(0), start: 0, end: text.len() as u32 }
}

/// The tree as an expression with the place of every part.
fn tree(contact: &WrittenContact) -> String {
    let place = |span: Span| format!("{}..{}", span.start, span.end);
    let all = |items: &[WrittenContact]| items.iter().map(tree).collect::<Vec<_>>().join(" ");
    match contact {
        WrittenContact::Bit(name) => format!("{}@{}", name.value, place(name.span)),
        WrittenContact::Indexed(computed) => format!("{computed}@{}", place(computed.span)),
        WrittenContact::Not(inner, span) => format!("(not@{} {})", place(*span), tree(inner)),
        WrittenContact::All(items, span) => format!("(and@{} {})", place(*span), all(items)),
        WrittenContact::Any(items, span) => format!("(or@{} {})", place(*span), all(items)),
        WrittenContact::Edge(edge, inner, span) => {
            format!("({}@{} {})", edge.name(), place(*span), tree(inner))
        }
        WrittenContact::Compare(a, sign, b, span) => {
            let (a, b) = (format!("{a}@{}", place(a.span())), format!("{b}@{}", place(b.span())));
            format!("({}@{} {a} {b})", sign.sign(), place(*span))
        }
    }
}

fn check(text: &str, expected: Expect) {
    let found = match parse(text, span_of(text)) {
        Ok(contact) => tree(&contact),
        Err(finding) => {
            format!("{}..{} {}", finding.span.start, finding.span.end, finding.message)
        }
    };
    expected.assert_eq(&found);
}

#[test]
fn bits_and_names_parse_with_their_spans() {
    check("X0", expect!["X0@0..2"]);
    check("  part_seen ", expect!["part_seen@2..11"]);
    check("bottles.Done", expect!["bottles.Done@0..12"]);
    check("Day-Shift.Ns-Green", expect!["Day-Shift.Ns-Green@0..18"]);
    check("$100ms", expect!["$100ms@0..6"]);
    check("N,0,6 == 3", expect!["(==@0..10 N,0,6@0..5 3@9..10)"]);
    check("N, 0, 2", expect!["N, 0, 2@0..7"]);
}

#[test]
fn not_binds_tighter_than_and_and_and_tighter_than_or() {
    check("!X0 & X1 | X2", expect!["(or@0..13 (and@0..8 (not@0..3 X0@1..3) X1@6..8) X2@11..13)"]);
    check("X0 | X1 & X2", expect!["(or@0..12 X0@0..2 (and@5..12 X1@5..7 X2@10..12))"]);
    check("X0 & X1 & X2", expect!["(and@0..12 X0@0..2 X1@5..7 X2@10..12)"]);
    check("!!X0", expect!["(not@0..4 (not@1..4 X0@2..4))"]);
}

#[test]
fn parentheses_widen_the_span_of_a_group() {
    check("(X0 | X1) & X2", expect!["(and@0..14 (or@0..9 X0@1..3 X1@6..8) X2@12..14)"]);
    check("(X0 & X1) & X2", expect!["(and@0..14 (and@0..9 X0@1..3 X1@6..8) X2@12..14)"]);
    check("((X0))", expect!["X0@2..4"]);
    check("!(X0 & X1)", expect!["(not@0..10 (and@1..10 X0@2..4 X1@7..9))"]);
}

#[test]
fn edges_and_compares_parse_with_their_spans() {
    check("rise(X0)", expect!["(rise@0..8 X0@5..7)"]);
    check("rise(!X0)", expect!["(rise@0..9 (not@5..8 X0@6..8))"]);
    check("rise(D0 > 5)", expect!["(rise@0..12 (>@5..11 D0@5..7 5@10..11))"]);
    check("fall(X0 & X1)", expect!["(fall@0..13 (and@5..12 X0@5..7 X1@10..12))"]);
    check(
        "rise(fall(X0) | X1)",
        expect!["(rise@0..19 (or@5..18 (fall@5..13 X0@10..12) X1@16..18))"],
    );
    check("!fall( CT0.Done )", expect!["(not@0..17 (fall@1..17 CT0.Done@7..15))"]);
    check("D0 >= -5 & X0", expect!["(and@0..13 (>=@0..8 D0@0..2 -5@6..8) X0@11..13)"]);
    check("T0.Acc<1m30s", expect!["(<@0..12 T0.Acc@0..6 1m30s@7..12)"]);
    check("0x1F != D0", expect!["(!=@0..10 31@0..4 D0@8..10)"]);
    check("!(D0 == 3)", expect!["(not@0..9 (==@2..9 D0@2..4 3@8..9))"]);
}

#[test]
fn compares_take_expressions() {
    check("D0 + 1 > D1 * 2", expect!["(>@0..15 D0 + 1@0..6 D1 * 2@9..15)"]);
    check(
        "(D0 - D1) / 2 >= -5 & X0",
        expect!["(and@0..24 (>=@0..19 (D0 - D1) / 2@0..13 -5@17..19) X0@22..24)"],
    );
    check("-D0 < abs(D1)", expect!["(<@0..13 -D0@0..3 abs(D1)@6..13)"]);
    check(
        "!(max(D0, D1, 3) ** 2 == 4)",
        expect!["(not@0..26 (==@2..26 max(D0, D1, 3) ** 2@2..21 4@25..26))"],
    );
    check(
        "X0 | D0 == list[i + 1].3",
        expect!["(or@0..24 X0@0..2 (==@5..24 D0@5..7 list[i + 1].3@11..24))"],
    );
    check(
        "gate[i + 1] & !gate[2 * (i - 1)]",
        expect!["(and@0..32 gate[i + 1]@0..11 (not@14..32 gate[2 * (i - 1)]@15..32))"],
    );
    check("rise(gate[list[i]])", expect!["(rise@0..19 gate[list[i]]@5..18)"]);
    check("(D0) == (3)", expect!["(==@0..11 D0@0..4 3@8..11)"]);
    check("T0.Acc + 5s > T1.Acc", expect!["(>@0..20 T0.Acc + 5s@0..11 T1.Acc@14..20)"]);
    check(
        "a-b.On & D0 > 2e-3 - 1",
        expect!["(and@0..22 a-b.On@0..6 (>@9..22 D0@9..11 0.002 - 1@14..22))"],
    );
    check(
        "min(a, max(b, c)) < sum(list)",
        expect!["(<@0..29 min(a, max(b, c))@0..17 sum(list)@20..29)"],
    );
}

#[test]
fn what_contacts_do_not_compute_is_refused() {
    check("(D0 & 4) != 0", expect!["4..5 `&` in the arithmetic of a contact"]);
    check("D0 << 2 > 3", expect!["3..5 `<<` in the arithmetic of a contact"]);
    check("(X0 | X1) == X2", expect!["4..5 `|` in the arithmetic of a contact"]);
    check("(D0 > 3) + 1 > 1", expect!["4..5 `>` in the arithmetic of a contact"]);
    check("D0 + !X0 > 1", expect!["5..8 `!` in the arithmetic of a contact"]);
    check("D0 + ~D1 > 1", expect!["5..6 `~` does not negate a contact"]);
    check("D0 + 1", expect!["0..6 `D0 + 1` is a number, not a contact"]);
    check("D0 + 1 > 2 > 3", expect!["11..12 two compares in a row"]);
    check("!D0 + 1 == 3", expect!["0..12 `!` binds tighter than a compare"]);
    check("D0 -1 > 3", expect!["3..4 a minus without spaces around it"]);
    check("5-D0 > 3", expect!["1..2 a minus without spaces around it"]);
    check("D0 + > 3", expect!["4..4 a value is missing here"]);
    check("D0 > * 3", expect!["5..6 a value is missing before `*`"]);
    check("MAX(D0, D1) > 3", expect!["0..3 `MAX` cannot have parentheses after it"]);
    check("max(D0, D1", expect!["10..10 `)` is missing"]);
    check("list[i + > 3", expect!["4..12 `]` is missing"]);
    check("D0 > 3000000000", expect!["5..15 `3000000000` lies outside -2147483648..2147483647"]);
    check(
        "D0 + 3000000000 > 1",
        expect!["5..15 `3000000000` lies outside -2147483648..2147483647"],
    );
    check(
        "D0 + 0xFFFFFFFF > 1",
        expect!["5..15 `0xFFFFFFFF` lies outside -2147483648..2147483647"],
    );
    check("(D0 + 1) & X0", expect!["1..7 `D0 + 1` is a number, not a contact"]);
    check("X0, X1", expect!["2..3 a comma in a contact"]);
}

#[test]
fn syntax_errors_have_exact_spans() {
    check("", expect!["0..0 an empty contact"]);
    check("X0 | & X1", expect!["5..6 a contact is missing before this"]);
    check("X0 & (X1 | X2", expect!["13..13 `)` is missing"]);
    check("X0 & ü", expect!["5..7 `ü` belongs to no name"]);
    check("!D0 == 3", expect!["0..8 `!` binds tighter than `==`"]);
    check("()", expect!["1..2 `)` closes nothing, or is too early"]);
    check("rise()", expect!["5..6 `rise()` has no contact"]);
    check("rise(X0", expect!["7..7 `)` is missing"]);
    check("rise(X0 X1)", expect!["8..10 `&` or `|` is missing before this"]);
    check("X0 = 1", expect!["3..4 `=` is written `==`"]);
}

#[test]
fn the_nesting_depth_of_a_contact_is_limited() {
    let deep = |n: usize| format!("{}X0{}", "!(".repeat(n), ")".repeat(n));
    assert!(parse(&deep(15), span_of(&deep(15))).is_ok());
    let text = deep(100_000);
    let finding = parse(&text, span_of(&text)).unwrap_err();
    assert_eq!(finding.message, "more than 32 levels of parentheses and `!`");
}

fn at<T>(value: T) -> Located<T> {
    Located { value, span: Span::default() }
}

const NAMES: &[&str] =
    &["X0", "bottles.Done", "a_b", "Day-1.On", "$100ms", "N,0,6", "N", "rise", "T0.Acc"];

fn name() -> impl Strategy<Value = String> {
    proptest::sample::select(NAMES).prop_map(str::to_owned)
}

fn value() -> impl Strategy<Value = Atom> {
    let kind = prop_oneof![
        name().prop_map(AtomKind::Name),
        any::<i32>().prop_map(AtomKind::Integer),
        (0..=i32::MAX).prop_map(AtomKind::Duration),
    ];
    kind.prop_map(|kind| Atom { kind, span: Span::default() })
}

/// The parts of an expression that contacts may have.
fn expression() -> impl Strategy<Value = Expression> {
    use ExpressionPartKind::{Binary as Two, Call, Duration, Element, Integer, Name, Unary as One};
    let kind = prop_oneof![
        proptest::sample::select(&["D0", "bottles.Acc", "a_b", "$Second"][..])
            .prop_map(|name| Name(name.to_owned())),
        (0..=i32::MAX).prop_map(|n| Integer(n.into())),
        (1000..=i32::MAX).prop_map(Duration),
    ];
    let part = |kind| ExpressionPart { kind, span: Span::default() };
    let leaf = kind.prop_map(move |kind| vec![part(kind)]);
    let parts = leaf.prop_recursive(4, 24, 3, move |inner| {
        use Binary::{Add, Divide, Multiply, Power, Remainder, Subtract};
        let sign =
            proptest::sample::select(&[Add, Subtract, Multiply, Divide, Remainder, Power][..]);
        let behind = move |mut all: Vec<ExpressionPart>, kind| {
            all.push(part(kind));
            all
        };
        prop_oneof![
            (inner.clone(), inner.clone(), sign).prop_map(move |(mut a, b, sign)| {
                a.extend(b);
                behind(a, Two(sign, Span::default()))
            }),
            // A duration is never negative in a contact.
            inner.clone().prop_map(move |a| match matches!(a[0].kind, Duration(_)) {
                true => a,
                false => behind(a, One(Unary::Minus)),
            }),
            inner.clone().prop_map(move |a| behind(a, Element(at("list".to_owned())))),
            proptest::collection::vec(inner.clone(), 1..4).prop_map(move |all| {
                let count = all.len() as u32;
                behind(all.concat(), Call(at("max".to_owned()), count))
            }),
        ]
    });
    parts.prop_map(|parts| Expression { parts })
}

fn side() -> impl Strategy<Value = CompareSide> {
    let computed = expression().prop_filter("a single part is an atom", |all| all.parts.len() > 1);
    prop_oneof![
        value().prop_map(CompareSide::Atom),
        computed.prop_map(|expression| {
            CompareSide::Computed(ContactExpression { expression, span: Span::default() })
        }),
    ]
}

fn comparison() -> impl Strategy<Value = Comparison> {
    use Comparison::{Eq, Ge, Gt, Le, Lt, Ne};
    proptest::sample::select(&[Eq, Ne, Lt, Le, Gt, Ge][..])
}

fn contact() -> impl Strategy<Value = WrittenContact> {
    let leaf = prop_oneof![
        name().prop_map(|name| WrittenContact::Bit(at(name))),
        (side(), comparison(), side()).prop_map(|(a, sign, b)| WrittenContact::Compare(
            a,
            sign,
            b,
            Span::default()
        )),
    ];
    leaf.prop_recursive(5, 40, 4, |inner| {
        let items = || proptest::collection::vec(inner.clone(), 2..4);
        let edge = proptest::sample::select(&[Edge::Rise, Edge::Fall][..]);
        let whole = (edge, inner.clone());
        prop_oneof![
            whole.prop_map(|(edge, c)| WrittenContact::Edge(edge, Box::new(c), Span::default())),
            inner.clone().prop_map(|c| WrittenContact::Not(Box::new(c), Span::default())),
            items().prop_map(|items| WrittenContact::All(items, Span::default())),
            items().prop_map(|items| WrittenContact::Any(items, Span::default())),
        ]
    })
}

proptest! {
    #[test]
    fn a_printed_contact_parses_to_the_same_contact(contact in contact()) {
        let text = contact.to_string();
        let parsed = parse(&text, span_of(&text));
        let printed = parsed.as_ref().map(WrittenContact::to_string);
        prop_assert_eq!(printed.as_deref(), Ok(text.as_str()));
        prop_assert_eq!(shape(&parsed.unwrap()), shape(&contact));
    }

    #[test]
    fn no_text_of_contact_characters_panics(text in "[X0-9a-z!&|()=<>$,.: é-]{0,40}") {
        let _ = parse(&text, span_of(&text));
    }

    #[test]
    fn no_arbitrary_text_panics(text in ".{0,60}") {
        let _ = parse(&text, span_of(&text));
    }
}

/// The tree without places.
fn shape(contact: &WrittenContact) -> String {
    let parts = |items: &[WrittenContact]| items.iter().map(shape).collect::<Vec<_>>().join(" ");
    match contact {
        WrittenContact::Bit(name) => name.value.clone(),
        WrittenContact::Indexed(computed) => computed.to_string(),
        WrittenContact::Not(inner, _) => format!("(not {})", shape(inner)),
        WrittenContact::All(items, _) => format!("(and {})", parts(items)),
        WrittenContact::Any(items, _) => format!("(or {})", parts(items)),
        WrittenContact::Edge(edge, inner, _) => format!("({} {})", edge.name(), shape(inner)),
        WrittenContact::Compare(a, sign, b, _) => format!("({} {a} {b})", sign.sign()),
    }
}
