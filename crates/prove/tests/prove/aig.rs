//! Graphs of gates: their values, their simplifications, and their AIGER files.

use expect_test::expect;
use proptest::prelude::*;
use rungd_prove::aig::aiger::{AigerSystem, NamedLatch, NamedLiteral};
use rungd_prove::aig::simulator::NodeValues;
use rungd_prove::aig::{GateGraph, Literal};

/// The values of six inputs in all 64 patterns.
const INPUTS: [u64; 6] = [
    0xAAAA_AAAA_AAAA_AAAA,
    0xCCCC_CCCC_CCCC_CCCC,
    0xF0F0_F0F0_F0F0_F0F0,
    0xFF00_FF00_FF00_FF00,
    0xFFFF_0000_FFFF_0000,
    0xFFFF_FFFF_0000_0000,
];

proptest! {
    #[test]
    fn every_gate_has_the_value_of_its_operator(
        steps in prop::collection::vec((0u8..4, any::<u16>(), any::<u16>(), any::<u16>()), 1..200),
    ) {
        let mut graph = GateGraph::default();
        let mut literals = vec![Literal::TRUE];
        literals.extend((0..6).map(|_| graph.input()));
        let mut expected = vec![u64::MAX];
        expected.extend(INPUTS);
        for (kind, a, b, c) in steps {
            let pick = |n: u16| (usize::from(n >> 1) % literals.len(), n & 1 == 1);
            let literal = |n: u16| literals[pick(n).0].inverted_if(pick(n).1);
            let value = |n: u16| expected[pick(n).0] ^ if pick(n).1 { u64::MAX } else { 0 };
            let (la, lb, lc) = (literal(a), literal(b), literal(c));
            let (va, vb, vc) = (value(a), value(b), value(c));
            let (made, meant) = match kind {
                0 => (graph.and(la, lb), va & vb),
                1 => (graph.or(la, lb), va | vb),
                2 => (graph.xor(la, lb), va ^ vb),
                _ => (graph.mux(la, lb, lc), va & vb | !va & vc),
            };
            literals.push(made);
            expected.push(meant);
        }
        let values = NodeValues::of(&graph, |node| INPUTS[node as usize - 1]);
        for (literal, expected) in literals.iter().zip(&expected) {
            prop_assert_eq!(values.of_literal(*literal), *expected);
        }
    }
}

#[test]
fn a_gate_whose_value_follows_from_its_operands_is_not_made() {
    let mut graph = GateGraph::default();
    let [a, b, c] = [(); 3].map(|()| graph.input());
    let ab = graph.and(a, b);
    let choice = graph.mux(a, b, c);
    let count = graph.nodes().len();
    assert_eq!(graph.and(b, a), ab);
    assert_eq!(graph.and(ab, a), ab);
    assert_eq!(graph.and(ab, !b), Literal::FALSE);
    assert_eq!(graph.and(!ab, !b), !b);
    assert_eq!(graph.and(a, choice), ab);
    assert_eq!(graph.mux(a, choice, c), choice);
    assert_eq!(graph.xor(a, !a), Literal::TRUE);
    assert_eq!(graph.nodes().len(), count);
}

/// A latch that an input toggles, and which is never ON in two steps one after the other.
fn toggled(graph: &mut GateGraph) -> (NamedLiteral, Vec<NamedLatch>) {
    let (input, latch, before) = (graph.input(), graph.latch(), graph.latch());
    let next = graph.xor(input, latch);
    let named = |literal, next, initial, name: &str| NamedLatch {
        literal,
        next,
        initial,
        name: name.to_owned(),
    };
    let latches =
        vec![named(latch, next, Some(true), "light"), named(before, latch, None, "light before")];
    (NamedLiteral { literal: input, name: "button".to_owned() }, latches)
}

#[test]
fn a_system_is_written_as_aiger_text_and_as_binary() {
    let mut graph = GateGraph::default();
    let (input, latches) = toggled(&mut graph);
    let bad = graph.and(latches[0].literal, !latches[1].literal);
    let system = AigerSystem {
        graph: &graph,
        inputs: vec![input.clone()],
        latches,
        bad: vec![NamedLiteral { literal: bad, name: "never twice".to_owned() }],
        constraints: vec![NamedLiteral { literal: !input.literal, name: "calm".to_owned() }],
        comment: "A light.".to_owned(),
    };
    expect![[r#"
        aag 7 1 2 0 4 1 1
        2
        4 13 1
        6 4 6
        14
        3
        8 5 2
        10 4 3
        12 11 9
        14 7 4
        i0 button
        l0 light
        l1 light before
        b0 never twice
        c0 calm
        c
        A light.
    "#]]
    .assert_eq(&system.ascii());
    let binary = system.binary();
    let text: Vec<&[u8]> = binary.splitn(6, |byte| *byte == b'\n').collect();
    assert_eq!(text[0], b"aig 7 1 2 0 4 1 1");
    assert_eq!((text[1], text[2]), (&b"13 1"[..], &b"4 6"[..]));
    assert_eq!((text[3], text[4]), (&b"14"[..], &b"3"[..]));
    assert_eq!(text[5][..8], [3, 3, 6, 1, 1, 2, 7, 3]);
    assert!(text[5][8..].starts_with(b"i0 button\n"));
}
