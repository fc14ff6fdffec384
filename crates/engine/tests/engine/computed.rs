//! Contacts that compute, compared with what a MATH before their rung stores.

use proptest::prelude::*;
use rungd_test_support::plc::plc;

/// The words that are changed at random, with their names.
const WORDS: [&str; 5] = ["D0", "D1", "V0", "list[0]", "list[1]"];

/// An expression of contacts: a real one or a whole one.
fn expression() -> impl Strategy<Value = String> {
    let leaf = proptest::sample::select(
        &["D0", "D1", "V0", "R0", "X0 + C0", "3", "1.5", "7", "list[D1 % 3]", "sum(list)"][..],
    );
    let leaf = leaf.prop_map(|text| format!("({text} + 0)"));
    leaf.prop_recursive(4, 20, 3, |inner| {
        let sign = proptest::sample::select(&["+", "-", "*", "/", "%", "**"][..]);
        let name = proptest::sample::select(&["abs", "sqrt", "round", "ln", "toreal"][..]);
        let many = proptest::sample::select(&["min", "max", "sum"][..]);
        prop_oneof![
            (inner.clone(), sign, inner.clone())
                .prop_map(|(a, sign, b)| format!("({a} {sign} {b})")),
            (name, inner.clone()).prop_map(|(name, x)| format!("{name}({x})")),
            (many, proptest::collection::vec(inner.clone(), 1..4))
                .prop_map(|(name, all)| format!("{name}({})", all.join(", "))),
            (inner.clone(), inner.clone(), inner)
                .prop_map(|(c, x, y)| format!("if({c}, {x}, {y})")),
        ]
    })
}

/// The numbers that are written in a scan: each word, a real as its cell, and two bits.
type Numbers = ([i32; 5], i32, [bool; 2]);

fn numbers() -> impl Strategy<Value = Numbers> {
    let word = || prop_oneof![-3..4_i32, any::<i32>()];
    let words = (word(), word(), 0..65536_i32, -3..4_i32, -3..4_i32);
    (
        words.prop_map(|(a, b, c, d, e)| [a, b, c, d, e]),
        proptest::sample::select(&[0.0_f32, 0.5, -1.25, 3.0, 1e30, -3.4e38][..])
            .prop_map(|real| real.to_bits().cast_signed()),
        any::<[bool; 2]>(),
    )
}

proptest! {
    #[test]
    fn a_contact_is_the_math_before_it(
        left in expression(),
        right in expression(),
        sign in proptest::sample::select(&["==", "!=", "<", "<=", ">", ">="][..]),
        scans in proptest::collection::vec(numbers(), 1..6),
    ) {
        let tags = "[tags]\nlist = { at = \"D10\", count = 3 }\n";
        let compare = format!("{left} {sign} {right}");
        let contact = format!("rung = [ {{ when = [\"{compare}\"], do = [\"OUT Y0\"] }} ]\n{tags}");
        let math = format!(
            "rung = [ {{ when = [\"$On\"], do = [\"MATH C9 = {compare}\"] }},\n\
             {{ when = [\"C9\"], do = [\"OUT Y0\"] }} ]\n{tags}"
        );
        let (mut contact, mut math) = (plc(&contact), plc(&math));
        for (words, real, bits) in scans {
            let mut changes: Vec<(&str, i32)> = WORDS.into_iter().zip(words).collect();
            changes.extend([("R0", real), ("X0", bits[0].into()), ("C0", bits[1].into())]);
            contact.scan(&changes);
            math.scan(&changes);
            prop_assert_eq!(contact.value("Y0"), math.value("Y0"), "{}", compare);
            let status = ["$DivideByZero", "$Overflow", "$OutOfRange", "$IndexError"];
            prop_assert_eq!(contact.values(status), [0; 4]);
        }
    }
}
