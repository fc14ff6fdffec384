//! Bits of words, compared with the arithmetic that they stand for, and under a force.

use proptest::prelude::*;
use rungd_test_support::plc::plc;

#[test]
fn a_forced_word_discards_the_writes_of_its_bits() {
    let mut plc = plc(r#"
        rung = [
          { when = ["X0"], do = ["OUT D0.0", "SET D0.1", "RST D0.2", "PONOFF D0.3"] },
          { when = ["X0"], do = ["MATH D0.4 = 1", "ONDTMR T0 preset=0ms output=D0.5"] },
          { when = ["D0.2"], do = ["OUT Y0"] },
        ]
    "#);
    plc.force("D0", 4);
    for input in [1, 0, 1] {
        plc.scan(&[("X0", input)]);
        assert_eq!(plc.values(["D0", "Y0"]), [4, 1], "{input}");
    }
    plc.release("D0");
    plc.scan(&[("X0", 1)]);
    assert_eq!(plc.values(["D0", "Y0"]), [1 + 2 + 16 + 32, 0]);
}

#[test]
fn forced_bits_and_words_keep_their_values_under_pack_and_unpack() {
    let mut plc = plc(r#"
        rung = [ { when = ["X0"], do = ["UNPACK D0 to=C0..C3", "PACK C0..C3 to=D1"] } ]
    "#);
    plc.force("C1", 1);
    plc.scan(&[("X0", 1), ("D0", 12)]);
    assert_eq!(plc.values(["C0", "C1", "C2", "C3", "D1"]), [0, 1, 1, 1, 14]);
    plc.force("D1", 7);
    plc.scan(&[("D0", 1)]);
    assert_eq!(plc.values(["C0", "C1", "C2", "C3", "D1"]), [1, 1, 0, 0, 7]);
    plc.release("C1");
    plc.release("D1");
    plc.scan(&[("D0", 8)]);
    assert_eq!(plc.values(["C0", "C1", "C2", "C3", "D1"]), [0, 0, 0, 1, 8]);
}

/// The words, each with the number of its bits and whether the highest one is its sign.
const WORDS: [(&str, u32, bool); 4] =
    [("D0", 32, true), ("V0", 16, false), ("N0.ACC", 16, true), ("CT0.Acc", 32, true)];

proptest! {
    /// PACK is an OUT of each bit to a word of 0, UNPACK an OUT from each contact.
    #[test]
    fn pack_and_unpack_are_an_out_of_each_bit(
        word in proptest::sample::select(&WORDS[..]),
        first in 0..3_u32,
        count in 1..33_u32,
        contents in proptest::collection::vec(any::<i32>(), 1..4),
    ) {
        let (word, bits, _) = word;
        let count = count.min(bits);
        let last = first + count - 1;
        let whole = format!(
            "rung = [ {{ when = [\"$On\"], do = [\"UNPACK D1 to=C{first}..C{last}\", \
             \"PACK C{first}..C{last} to={word}\"] }} ]"
        );
        let mut single = format!("rung = [ {{ when = [\"$On\"], do = [\"MOVE 0 to={word}\"] }},\n");
        for at in 0..count {
            let bit = first + at;
            single += &format!(
                "{{ when = [\"D1.{at}\"], do = [\"OUT C{bit}\", \"OUT {word}.{at}\"] }},\n"
            );
        }
        let (mut whole, mut single) = (plc(&whole), plc(&format!("{single}]")));
        for content in contents {
            whole.scan(&[("D1", content)]);
            single.scan(&[("D1", content)]);
            for at in 0..count {
                let bit = format!("C{}", first + at);
                let values = [bit.as_str(), word];
                prop_assert_eq!(whole.values(values), single.values(values), "{} {}", word, bit);
            }
        }
    }

    /// A contact is what `/` and `%` compute, and a coil what MOVE and MATH do.
    #[test]
    fn a_bit_is_the_arithmetic_of_its_word(
        word in proptest::sample::select(&WORDS[..]),
        number in 0..32_u32,
        coil in proptest::sample::select(&["OUT", "SET", "RST", "MATH"][..]),
        scans in proptest::collection::vec((any::<i32>(), any::<bool>()), 1..6),
    ) {
        let (word, count, has_sign) = word;
        let number = number % count;
        let weight = match has_sign && number + 1 == count {
            true => -(1_i64 << number),
            false => 1 << number,
        };
        let write = match coil {
            "MATH" => format!("MATH {word}.{number} = X0"),
            other => format!("{other} {word}.{number}"),
        };
        let when = if coil == "MATH" { "$On" } else { "X0" };
        let bits = format!(
            "rung = [ {{ when = [\"{word}.{number}\"], do = [\"OUT Y0\"] }},\n\
             {{ when = [\"{when}\"], do = [\"{write}\"] }} ]"
        );
        let was = format!("(({word} >>> {number}) & 1)");
        let now = match coil {
            "OUT" | "MATH" => "X0".to_owned(),
            "SET" => format!("({was} || X0)"),
            _ => format!("({was} && !X0)"),
        };
        let sums = format!(
            "rung = [ {{ when = [\"$On\"], do = [\"MATH Y0 = {was}\"] }},\n\
             {{ when = [\"$On\"], do = [\"MATH {word} = {word} + ({now} - {was}) * {weight}\"] }} ]"
        );
        let (mut bits, mut sums) = (plc(&bits), plc(&sums));
        for (content, on) in scans {
            let content = if count == 32 { content } else if has_sign {
                i32::from(content as i16)
            } else {
                i32::from(content as u16)
            };
            let changes = [(word, content), ("X0", on.into())];
            bits.scan(&changes);
            sums.scan(&changes);
            let values = [word, "Y0"];
            prop_assert_eq!(bits.values(values), sums.values(values), "{} {}", word, number);
        }
    }
}
