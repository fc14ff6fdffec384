//! Words that PACK writes, and bits that UNPACK writes.

use expect_test::expect;

use super::tape::{check, tape};

#[test]
fn the_answer_for_a_packed_word_lists_its_bits() {
    let mut plc = tape(r#"rung = [{ when = ["X0"], do = ["PACK C0..C3 to=D0"] }]"#);
    plc.scan(&[("X0", 1)]);
    plc.scan(&[("C1", 1), ("C2", 1)]);
    check(
        &plc,
        "D0",
        expect![[r#"
            D0 is 6
              PACK C0..C3 to=D0 made it 6 in this scan: Main, rung 1, a.toml:3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 10 ms ago, in scan 0
                with C0 = OFF
                  unchanged since rungd started: its initial value
                with C1 = ON
                  input C1 turned it ON in this scan
                with C2 = ON
                  input C2 turned it ON in this scan
                with C3 = OFF
                  unchanged since rungd started: its initial value
        "#]],
    );
    check(
        &plc,
        "D0.1",
        expect![[r#"
            D0.1 is ON
              PACK C0..C3 to=D0 turned it ON in this scan: Main, rung 1, a.toml:3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 10 ms ago, in scan 0
                with C1 = ON
                  input C1 turned it ON in this scan
            C1 OFF would turn it OFF in the next scan
        "#]],
    );
    check(
        &plc,
        "D0.9",
        expect![[r#"
            D0.9 is OFF
              PACK C0..C3 to=D0 keeps it OFF, unchanged since rungd started: Main, rung 1, a.toml:3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 10 ms ago, in scan 0
            one input is not enough to turn it ON in the next scan (5 tried)
        "#]],
    );
}

#[test]
fn the_answer_for_an_unpacked_bit_names_its_word() {
    let mut plc = tape(r#"rung = [{ when = ["X0"], do = ["UNPACK D1 to=C8..C9"] }]"#);
    plc.scan(&[("D1", 1), ("X0", 1)]);
    plc.scan(&[("D1", 2)]);
    check(
        &plc,
        "C9",
        expect![[r#"
            C9 is ON
              UNPACK D1 to=C8..C9 turned it ON in this scan: Main, rung 1, a.toml:3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 10 ms ago, in scan 0
                with D1 = 2
                  input D1 made it 2 in this scan
            one input is not enough to turn it OFF in the next scan (1 tried)
        "#]],
    );
    check(
        &plc,
        "C8",
        expect![[r#"
            C8 is OFF
              UNPACK D1 to=C8..C9 turned it OFF in this scan: Main, rung 1, a.toml:3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON 10 ms ago, in scan 0
                with D1 = 2
                  input D1 made it 2 in this scan
            one input is not enough to turn it ON in the next scan (1 tried)
        "#]],
    );
}

#[test]
fn a_word_that_pack_selects_lists_the_bits_and_the_index() {
    let mut plc = tape(
        "rung = [{ when = [\"X0\"], do = [\"PACK C0..C1 to=list[D1]\"] }]\n\
         [tags]\nlist = { at = \"D10\", count = 3 }",
    );
    plc.scan(&[("C0", 1), ("D1", 2), ("X0", 1)]);
    check(
        &plc,
        "list[2]",
        expect![[r#"
        list[2] (D12) is 1
          PACK C0..C1 to=list[D1] made it 1 in this scan: Main, rung 1, a.toml:3
            the rung is ON, because
              X0 is ON
                input X0 turned it ON in this scan
            with C0 = ON
              input C0 turned it ON in this scan
            with C1 = OFF
              unchanged since rungd started: its initial value
            with D1 = 2
              input D1 made it 2 in this scan
    "#]],
    );
}

#[test]
fn most_bits_that_are_off_are_left_out_of_a_long_pack() {
    let mut plc = tape(r#"rung = [{ when = ["X0"], do = ["PACK C0..C31 to=D0"] }]"#);
    plc.scan(&[("C7", 1), ("C30", 1), ("X0", 1)]);
    check(
        &plc,
        "D0",
        expect![[r#"
            D0 is 1073741952
              PACK C0..C31 to=D0 made it 1073741952 in this scan: Main, rung 1, a.toml:3
                the rung is ON, because
                  X0 is ON
                    input X0 turned it ON in this scan
                with C7 = ON
                  input C7 turned it ON in this scan
                with C30 = ON
                  input C30 turned it ON in this scan
                with C0 = OFF
                  unchanged since rungd started: its initial value
                and 29 that are 0
        "#]],
    );
}
