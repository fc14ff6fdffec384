//! Mutants of instructions.

use expect_test::expect;

use super::check_main;

#[test]
fn bit_instructions_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["$On"], do = ["OUT Y0"] },
        { when = ["X0"], do = ["OUT Y1", "PD C0", "ND C1", "PONOFF C2", "SET C3", "RST C3"] },
        { when = ["X0"], do = ["SET bits[D0]"] },
        { leg.data = ["X0"], leg.clk = ["X1"], leg.rst = ["X2"], do = ["SR C4..C7"] },
        { when = ["X9"], do = ["STOP"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `OUT Y1` left out
              instruction: `OUT Y1` is `SET Y1`
              instruction-out: `PD C0` left out
              instruction: `PD C0` is `ND C0`
              instruction-out: `ND C1` left out
              instruction: `ND C1` is `PD C1`
              instruction-out: `PONOFF C2` left out
              instruction-out: `SET C3` left out
              instruction: `SET C3` is `RST C3`
              instruction-out: `RST C3` left out
              instruction: `RST C3` is `SET C3`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction: `SET bits[D0]` is `RST bits[D0]`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              inverted: contact `X2` is `!X2`
              contact-out: contact `X2` is always ON
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X9` is `!X9`
              contact-out: contact `X9` is always ON
        "#]],
    );
}

#[test]
fn counters_have_the_listed_mutants() {
    check_main(
        r#"
        { leg.up = ["X0"], leg.rst = ["$Off"], do = ["CNT CT0 preset=12"] },
        { leg.dn = ["X0"], leg.rst = ["X1"], do = ["CNTDN CT1 preset=0"] },
        { leg.up = ["X0"], leg.dn = ["X1"], leg.rst = ["X2"], do = ["UDC CT2 up-preset=-1"] },
        { leg.up = ["X0"], leg.dn = ["X1"], do = ["UDCG CT3 up-preset=9 dn-preset=1"] },
        { when = ["X0"], do = ["CTU N0 preset=5", "CTD N0"] },
        { when = ["X0"], do = ["CTU N1 preset=3", "CTD N1 preset=3", "RSTCT CT3", "RES N0"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              number: preset 12 is 13 in `CNT CT0 preset=12`
              number: preset 12 is 11 in `CNT CT0 preset=12`
              number: preset 12 is 0 in `CNT CT0 preset=12`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: preset 0 is 1 in `CNTDN CT1 preset=0`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              inverted: contact `X2` is `!X2`
              contact-out: contact `X2` is always ON
              number: up-preset -1 is 0 in `UDC CT2 up-preset=-1`
              number: up-preset -1 is -2 in `UDC CT2 up-preset=-1`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: up-preset 9 is 10 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: up-preset 9 is 8 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: up-preset 9 is 0 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: dn-preset 1 is 2 in `UDCG CT3 up-preset=9 dn-preset=1`
              number: dn-preset 1 is 0 in `UDCG CT3 up-preset=9 dn-preset=1`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `CTU N0 preset=5` left out
              number: preset 5 is 6 in `CTU N0 preset=5`
              number: preset 5 is 4 in `CTU N0 preset=5`
              number: preset 5 is 0 in `CTU N0 preset=5`
              instruction-out: `CTD N0` left out
            Main, rung 6
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `CTU N1 preset=3` left out
              instruction-out: `CTD N1 preset=3` left out
              instruction-out: `RSTCT CT3` left out
              instruction-out: `RES N0` left out
        "#]],
    );
}

#[test]
fn timers_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["X0"], do = ["ONDTMR T0 preset=3s output=Y2"] },
        { when = ["X0"], do = ["OFFDTMR T1 preset=5ms output=Y3"] },
        { when = ["X0"], do = ["TMR T2 preset=D0", "TMRDOWN T3 preset=1m", "RSTT T4"] },
        { when = ["X0"], do = ["TMRAG T4 preset=patience"] },
        { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRA T5 preset=1s"] },
        { leg.en = ["X0"], leg.rst = ["X1"], do = ["TMRADOWN T6 preset=2000"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              number: preset 3s is 3s300ms in `ONDTMR T0 preset=3s output=Y2`
              number: preset 3s is 2s700ms in `ONDTMR T0 preset=3s output=Y2`
              number: preset 3s is 0ms in `ONDTMR T0 preset=3s output=Y2`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              number: preset 5ms is 15ms in `OFFDTMR T1 preset=5ms output=Y3`
              number: preset 5ms is 0ms in `OFFDTMR T1 preset=5ms output=Y3`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `TMR T2 preset=D0` left out
              instruction-out: `TMRDOWN T3 preset=1m` left out
              number: preset 1m is 1m6s in `TMRDOWN T3 preset=1m`
              number: preset 1m is 54s in `TMRDOWN T3 preset=1m`
              number: preset 1m is 0ms in `TMRDOWN T3 preset=1m`
              instruction-out: `RSTT T4` left out
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              number: preset `patience` (2s) is 2s200ms in `TMRAG T4 preset=patience`
              number: preset `patience` (2s) is 1s800ms in `TMRAG T4 preset=patience`
              number: preset `patience` (2s) is 0ms in `TMRAG T4 preset=patience`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: preset 1s is 1s100ms in `TMRA T5 preset=1s`
              number: preset 1s is 900ms in `TMRA T5 preset=1s`
              number: preset 1s is 0ms in `TMRA T5 preset=1s`
            Main, rung 6
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              inverted: contact `X1` is `!X1`
              contact-out: contact `X1` is always ON
              number: preset 2000 is 2s200ms in `TMRADOWN T6 preset=2000`
              number: preset 2000 is 1s800ms in `TMRADOWN T6 preset=2000`
              number: preset 2000 is 0ms in `TMRADOWN T6 preset=2000`
        "#]],
    );
}

#[test]
fn word_instructions_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["X0"], do = ["MOVE 65535 to=V0", "MOVE 2s to=D0", "MOVE 1.5 to=R0"] },
        { when = ["X0"], do = ["MOVE 9 to=speed", "MOVE 7 to=words[D3]", "MOVE D0 to=D1"] },
        { when = ["X0"], do = ["ADD D0 1 to=D1", "SUB D0 0 to=D2"] },
        { when = ["X0"], do = ["ADD D3 1 to=D3", "SUB D3 1 to=D3", "SUB 1 D3 to=D3"] },
        { when = ["X0"], do = ["COPY C0..C3 to=C4..C7", "FILL 0 to=C8..C9", "FILL 3 to=D8..D9"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `MOVE 65535 to=V0` left out
              number: 65535 is 65534 in `MOVE 65535 to=V0`
              instruction-out: `MOVE 2s to=D0` left out
              number: 2s is 2s200ms in `MOVE 2s to=D0`
              number: 2s is 1s800ms in `MOVE 2s to=D0`
              instruction-out: `MOVE 1.5 to=R0` left out
              number: 1.5 is 1.515 in `MOVE 1.5 to=R0`
              number: 1.5 is 1.485 in `MOVE 1.5 to=R0`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `MOVE 9 to=speed` left out
              number: 9 is 8 in `MOVE 9 to=speed`
              instruction-out: `MOVE 7 to=words[D3]` left out
              number: 7 is 8 in `MOVE 7 to=words[D3]`
              number: 7 is 6 in `MOVE 7 to=words[D3]`
              instruction-out: `MOVE D0 to=D1` left out
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `ADD D0 1 to=D1` left out
              instruction: `ADD D0 1 to=D1` is `SUB D0 1 to=D1`
              number: 1 is 2 in `ADD D0 1 to=D1`
              number: 1 is 0 in `ADD D0 1 to=D1`
              instruction-out: `SUB D0 0 to=D2` left out
              number: 0 is 1 in `SUB D0 0 to=D2`
              number: 0 is -1 in `SUB D0 0 to=D2`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `ADD D3 1 to=D3` left out
              instruction: `ADD D3 1 to=D3` is `SUB D3 1 to=D3`
              number: 1 is 2 in `ADD D3 1 to=D3`
              instruction-out: `SUB D3 1 to=D3` left out
              instruction: `SUB D3 1 to=D3` is `ADD D3 1 to=D3`
              number: 1 is 2 in `SUB D3 1 to=D3`
              instruction-out: `SUB 1 D3 to=D3` left out
              instruction: `SUB 1 D3 to=D3` is `ADD 1 D3 to=D3`
              number: 1 is 2 in `SUB 1 D3 to=D3`
              number: 1 is 0 in `SUB 1 D3 to=D3`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              instruction-out: `COPY C0..C3 to=C4..C7` left out
              instruction-out: `FILL 0 to=C8..C9` left out
              number: 0 is 1 in `FILL 0 to=C8..C9`
              instruction-out: `FILL 3 to=D8..D9` left out
              number: 3 is 4 in `FILL 3 to=D8..D9`
              number: 3 is 2 in `FILL 3 to=D8..D9`
        "#]],
    );
}

#[test]
fn integer_formulas_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["X0"], do = ["MATH D0 = (D1 + 3) * -D2 - 2s"] },
        { when = ["X0"], do = ["MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2"] },
        { when = ["X0"], do = ["MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff"] },
        { when = ["X0"], do = ["MATH D0 = -2147483648 - D1"] },
        { when = ["X0"], do = ["MATH D0 = D1 * X1 + X2"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `+` is `-` in `(D1 + 3)`
              term-out: `3` left out of `(D1 + 3)`
              term-out: `D1` left out of `(D1 + 3)`
              operator: `*` is `/` in `(D1 + 3) * -D2`
              operator: `-` is `+` in `(D1 + 3) * -D2 - 2s`
              term-out: `2s` left out of `(D1 + 3) * -D2 - 2s`
              number: 3 is 4 in `MATH D0 = (D1 + 3) * -D2 - 2s`
              number: 3 is 2 in `MATH D0 = (D1 + 3) * -D2 - 2s`
              sign-out: `-` left out in `-D2`
              number: 2s is 2s200ms in `MATH D0 = (D1 + 3) * -D2 - 2s`
              number: 2s is 1s800ms in `MATH D0 = (D1 + 3) * -D2 - 2s`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `&&` is `||` in `(D1 < 5 && !(X1 == 1))`
              operator: `||` is `&&` in `(D1 < 5 && !(X1 == 1)) || 7 >= D2`
              operator: `<` is `<=` in `D1 < 5`
              number: 5 is 4 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              sign-out: `!` left out in `!(X1 == 1)`
              operator: `==` is `!=` in `(X1 == 1)`
              number: 1 is 2 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              number: 1 is 0 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              number: 7 is 8 in `MATH C0 = (D1 < 5 && !(X1 == 1)) || 7 >= D2`
              operator: `>=` is `>` in `7 >= D2`
            Main, rung 3
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `^` is `&` in `if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              operator: `&` is `|` in `D1 & 1`
              number: 1 is 2 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 1 is 0 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 1 is 2 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 1 is 0 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              term-out: `D3` left out of `D3 + 0`
              number: 0 is 1 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0 is -1 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0xff is 256 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
              number: 0xff is 254 in `MATH D0 = if(D1 & 1, D2 * 1, D3 + 0) ^ 0xff`
            Main, rung 4
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `-` is `+` in `-2147483648 - D1`
              term-out: `D1` left out of `-2147483648 - D1`
            Main, rung 5
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `+` is `-` in `D1 * X1 + X2`
              term-out: `X2` left out of `D1 * X1 + X2`
              term-out: `D1 * X1` left out of `D1 * X1 + X2`
        "#]],
    );
}

#[test]
fn formulas_with_reals_and_arrays_have_the_listed_mutants() {
    check_main(
        r#"
        { when = ["X0"], do = ["MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)"] },
        { when = ["X0"], do = ["MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1"] },
        "#,
        expect![[r#"
            Main, rung 1
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              operator: `max` is `min` in `max(R1, 0.0)`
              operator: `/` is `*` in `max(R1, 0.0) / 2.0 ** round(R2)`
              number: 0.0 is 1.0 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              number: 0.0 is -1.0 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              number: 2.0 is 2.02 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              number: 2.0 is 1.98 in `MATH R0 = max(R1, 0.0) / 2.0 ** round(R2)`
              operator: `**` is `*` in `2.0 ** round(R2)`
              operator: `round` is `trunc` in `round(R2)`
            Main, rung 2
              rung-out: the rung left out
              inverted: contact `X0` is `!X0`
              contact-out: contact `X0` is always ON
              number: 10 is 11 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 10 is 9 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `%` is `*` in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              sign-out: `~` left out in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `+` is `-` in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              term-out: a term left out of `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              term-out: a term left out of `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 1 is 2 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 1 is 0 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `<<` is `>>` in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              operator: `+` is `-` in `D4 + 1`
              term-out: `1` left out of `D4 + 1`
              term-out: `D4` left out of `D4 + 1`
              number: 1 is 2 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
              number: 1 is 0 in `MATH words[D4 + 1] = (sum(words) % 10 + ~D8) << 1`
        "#]],
    );
}
