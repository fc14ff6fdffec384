//! Mutants of contacts.

use expect_test::expect;

use super::check_main;

#[test]
fn bits_and_groups_have_the_listed_mutants() {
    check_main(
        r#"
        { name = "start", when = ["X0 & (X1 | !X2)", "!(X3 & X4)", "$On"], do = ["OUT Y0"] },
        { when = ["!!X2", "bits[D0]", "$Off | X1"], do = ["OUT Y1"] },
        "#,
        expect![[r#"
            Main, rung start
              rung-out: the rung left out
              group: `X0 & (X1 | !X2)` is `X0 | (X1 | !X2)`
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` left out
              group: `(X1 | !X2)` is `(X1 & !X2)`
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` left out
              inverted: contact `!X2` is `X2`
              contact-out: contact `!X2` left out
              inverted: contact `!(X3 & X4)` is `(X3 & X4)`
              group: `(X3 & X4)` is `(X3 | X4)`
              inverted: contact `X3` is `!X3`
              contact-out: contact `X3` left out
              inverted: contact `X4` is `!X4`
              contact-out: contact `X4` left out
              instruction: `OUT Y0` is `SET Y0`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `!!X2` is `!X2`
              contact-out: contact `!!X2` left out
              inverted: contact `bits[D0]` is `!bits[D0]`
              contact-out: contact `bits[D0]` left out
              group: `$Off | X1` is `$Off & X1`
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` left out
              instruction: `OUT Y1` is `SET Y1`
        "#]],
    );
}

#[test]
fn edges_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["rise(X0)"], do = ["SET C0"] },
        { when = ["!fall(X0 | X1)", "rise($Off)"], do = ["OUT Y1"] },
        { leg.up = ["rise(X0)"], leg.rst = ["rise(X1)"], do = ["CNT CT0 preset=12"] },
        { leg.up = ["!rise(X0)"], leg.rst = ["$Off"], do = ["CNT CT1 preset=D0"] },
        { when = ["rise(X2)"], do = ["PD C1"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `rise(X0)` is `!rise(X0)`
              contact-out: contact `rise(X0)` is always ON
              level: `rise(X0)` is `X0`
              other-edge: `rise(X0)` is `fall(X0)`
              instruction: `SET C0` is `RST C0`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `!fall(X0 | X1)` is `fall(X0 | X1)`
              contact-out: contact `!fall(X0 | X1)` left out
              level: `fall(X0 | X1)` is `X0 | X1`
              other-edge: `fall(X0 | X1)` is `rise(X0 | X1)`
              group: `X0 | X1` is `X0 & X1`
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` left out
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` left out
              instruction: `OUT Y1` is `SET Y1`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `rise(X0)` is `!rise(X0)`
              contact-out: contact `rise(X0)` is always ON
              other-edge: `rise(X0)` is `fall(X0)`
              inverted: contact `rise(X1)` is `!rise(X1)`
              contact-out: contact `rise(X1)` is always ON
              level: `rise(X1)` is `X1`
              other-edge: `rise(X1)` is `fall(X1)`
              number: preset 12 is 13 in `CNT CT0 preset=12`
              number: preset 12 is 11 in `CNT CT0 preset=12`
              number: preset 12 is 0 in `CNT CT0 preset=12`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `!rise(X0)` is `rise(X0)`
              contact-out: contact `!rise(X0)` is always ON
              level: `rise(X0)` is `X0`
              other-edge: `rise(X0)` is `fall(X0)`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `rise(X2)` is `!rise(X2)`
              contact-out: contact `rise(X2)` is always ON
              other-edge: `rise(X2)` is `fall(X2)`
              instruction: `PD C1` is `ND C1`
        "#]],
    );
}

#[test]
fn compares_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["D0 >= limit", "D1 == 3", "7 < D2", "R0 > 2.5"], do = ["OUT Y2"] },
        { when = ["$On"], do = ["TMR T0 preset=3s"] },
        { when = ["T0.Acc < 3s", "T0.Acc > 5ms", "D0 <= D1", "!(D2 != 0x10)"], do = ["OUT Y3"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `D0 >= limit` is `D0 < limit`
              contact-out: contact `D0 >= limit` left out
              border: `D0 >= limit` is `D0 > limit`
              number: `limit` (80) is 79 in `D0 >= limit`
              inverted: contact `D1 == 3` is `D1 != 3`
              contact-out: contact `D1 == 3` left out
              number: 3 is 4 in `D1 == 3`
              number: 3 is 2 in `D1 == 3`
              inverted: contact `7 < D2` is `7 >= D2`
              contact-out: contact `7 < D2` left out
              border: `7 < D2` is `7 <= D2`
              number: 7 is 8 in `7 < D2`
              inverted: contact `R0 > 2.5` is `R0 <= 2.5`
              contact-out: contact `R0 > 2.5` left out
              border: `R0 > 2.5` is `R0 >= 2.5`
              number: 2.5 is 2.525 in `R0 > 2.5`
              number: 2.5 is 2.475 in `R0 > 2.5`
              instruction: `OUT Y2` is `SET Y2`
            Main, rung 2
              rung-out: the rung left out
              number: preset 3s is 3s300ms in `TMR T0 preset=3s`
              number: preset 3s is 2s700ms in `TMR T0 preset=3s`
              number: preset 3s is 0ms in `TMR T0 preset=3s`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `T0.Acc < 3s` is `T0.Acc >= 3s`
              contact-out: contact `T0.Acc < 3s` left out
              border: `T0.Acc < 3s` is `T0.Acc <= 3s`
              number: 3s is 3s300ms in `T0.Acc < 3s`
              number: 3s is 2s700ms in `T0.Acc < 3s`
              inverted: contact `T0.Acc > 5ms` is `T0.Acc <= 5ms`
              contact-out: contact `T0.Acc > 5ms` left out
              border: `T0.Acc > 5ms` is `T0.Acc >= 5ms`
              number: 5ms is 15ms in `T0.Acc > 5ms`
              inverted: contact `D0 <= D1` is `D0 > D1`
              contact-out: contact `D0 <= D1` left out
              border: `D0 <= D1` is `D0 < D1`
              inverted: contact `!(D2 != 0x10` is `D2 != 0x10`
              contact-out: contact `!(D2 != 0x10` left out
              number: 0x10 is 17 in `D2 != 0x10`
              number: 0x10 is 15 in `D2 != 0x10`
              instruction: `OUT Y3` is `SET Y3`
        "#]],
    );
}

#[test]
fn bits_of_words_are_mutated_as_other_bits_and_exchanged_for_another_bit() {
    check_main(
        r#"
        { when = ["D0.3", "!V1.15"], do = ["OUT D2.31", "SET D3.0"] },
        { when = ["rise(D0.4)"], do = ["OFFDTMR T0 preset=2s output=D2.7"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `D0.3` is `!D0.3`
              contact-out: contact `D0.3` left out
              word-bit: contact `D0.3` is `D0.4`
              inverted: contact `!V1.15` is `V1.15`
              contact-out: contact `!V1.15` left out
              word-bit: contact `V1.15` is `V1.14`
              instruction-out: `OUT D2.31` left out
              instruction: `OUT D2.31` is `SET D2.31`
              word-bit: `D2.31` is `D2.30` in `OUT D2.31`
              instruction-out: `SET D3.0` left out
              instruction: `SET D3.0` is `RST D3.0`
              word-bit: `D3.0` is `D3.1` in `SET D3.0`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `rise(D0.4)` is `!rise(D0.4)`
              contact-out: contact `rise(D0.4)` is always ON
              level: `rise(D0.4)` is `D0.4`
              other-edge: `rise(D0.4)` is `fall(D0.4)`
              word-bit: contact `D0.4` is `D0.5`
              number: preset 2s is 2s200ms in `OFFDTMR T0 preset=2s output=D2.7`
              number: preset 2s is 1s800ms in `OFFDTMR T0 preset=2s output=D2.7`
              number: preset 2s is 0ms in `OFFDTMR T0 preset=2s output=D2.7`
              word-bit: `D2.7` is `D2.8` in `OFFDTMR T0 preset=2s output=D2.7`
        "#]],
    );
}

#[test]
fn bits_of_words_in_expressions_are_exchanged_for_another_bit() {
    check_main(
        r#"
        { when = ["D0.3 + V1.15 + C0 == 2"], do = ["MATH D5 = D2.31 * 4 - V0.15"] },
        { when = ["X0"], do = ["MATH D6 = if(D0.3, D3.0, 7)"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `D0.3 + V1.15 + C0 == 2` is `D0.3 + V1.15 + C0 != 2`
              contact-out: contact `D0.3 + V1.15 + C0 == 2` is always ON
              word-bit: `D0.3` is `D0.4` in `D0.3 + V1.15 + C0 == 2`
              operator: `+` is `-` in `D0.3 + V1.15`
              term-out: `V1.15` left out of `D0.3 + V1.15`
              term-out: `D0.3` left out of `D0.3 + V1.15`
              operator: `+` is `-` in `D0.3 + V1.15 + C0`
              term-out: `C0` left out of `D0.3 + V1.15 + C0`
              number: 2 is 3 in `D0.3 + V1.15 + C0 == 2`
              number: 2 is 1 in `D0.3 + V1.15 + C0 == 2`
              word-bit: `V1.15` is `V1.14` in `D0.3 + V1.15 + C0 == 2`
              word-bit: `D2.31` is `D2.30` in `MATH D5 = D2.31 * 4 - V0.15`
              operator: `*` is `/` in `D2.31 * 4`
              operator: `-` is `+` in `D2.31 * 4 - V0.15`
              term-out: `V0.15` left out of `D2.31 * 4 - V0.15`
              number: 4 is 5 in `MATH D5 = D2.31 * 4 - V0.15`
              number: 4 is 3 in `MATH D5 = D2.31 * 4 - V0.15`
              word-bit: `V0.15` is `V0.14` in `MATH D5 = D2.31 * 4 - V0.15`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              word-bit: `D0.3` is `D0.4` in `MATH D6 = if(D0.3, D3.0, 7)`
              word-bit: `D3.0` is `D3.1` in `MATH D6 = if(D0.3, D3.0, 7)`
              number: 7 is 8 in `MATH D6 = if(D0.3, D3.0, 7)`
              number: 7 is 6 in `MATH D6 = if(D0.3, D3.0, 7)`
        "#]],
    );
}
