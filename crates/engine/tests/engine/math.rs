//! MATH: tables of expressions with their results, sentence by sentence of `docs/semantics.md`,
//! section 8. Each row is a program of its own.

use rungd_test_support::plc::{Plc, plc};

/// The memory before each row's MATH.
const MEMORY: [(&str, i32); 9] = [
    ("D1", 7),
    ("D2", -7),
    ("D3", 0),
    ("D4", i32::MAX),
    ("D5", i32::MIN),
    ("D6", 100),
    ("V0", 65_535),
    ("C0", 1),
    ("C1", 0),
];

const BITS: [&str; 4] = ["$DivideByZero", "$Overflow", "$OutOfRange", "$IndexError"];

/// A program with one MATH, after its first scan.
fn after(math: &str) -> Plc {
    let rung = format!("rung = [ {{ when = [\"X0\"], do = [\"MATH {math}\"] }} ]");
    let mut plc = plc(&rung);
    let mut changes = MEMORY.to_vec();
    changes.push(("X0", 1));
    plc.scan(&changes);
    plc
}

fn bits(plc: &Plc) -> Vec<&'static str> {
    BITS.into_iter().filter(|bit| plc.value(bit) == 1).collect()
}

/// Checks rows of `expression -> result`. The result is the value in D0, with the status bits after
/// a `;`.
fn check(rows: &str) {
    let mut wrong = Vec::new();
    for row in rows.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let (expression, expected) = row.split_once("->").expect("an arrow");
        let plc = after(&format!("D0 = {}", expression.trim()));
        let noted = bits(&plc);
        let end = if noted.is_empty() { String::new() } else { format!("; {}", noted.join(" ")) };
        let found = format!("{}{end}", plc.value("D0"));
        if found != expected.trim() {
            wrong.push(format!("{row}\n    found {found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn operands_can_be_constants_durations_words_members_and_bits() {
    check(
        "
        42 -> 42
        1m30s -> 90000
        0xFFFFFFFF -> -1
        -2147483648 -> -2147483648
        D1 -> 7
        V0 -> 65535
        T0.Acc + CT0.Acc -> 0
        C0 + C0 + C1 -> 2
        CT0.Done + $On -> 1
        $ScanCounter -> 0
        ",
    );
}

#[test]
fn operators_bind_by_precedence_and_from_left_to_right() {
    check(
        "
        2 + 3 * 4 -> 14
        (2 + 3) * 4 -> 20
        10 - 3 - 2 -> 5
        -2 ** 2 -> 4
        2 ** 3 ** 2 -> 512
        2 ** -1 + 1 -> 1; $OutOfRange
        100 / 10 * 2 -> 20
        7 % 4 * 2 -> 6
        1 + 2 << 3 -> 24
        1 << 2 < 5 -> 1
        1 < 2 == 2 > 1 -> 1
        6 & 3 ^ 1 | 8 -> 11
        1 || 0 && 0 -> 1
        !0 + 1 -> 2
        ~0 -> -1
        - - 3 -> 3
        !!5 -> 1
        -D1 + D2 -> -14
        (D1 - D2) * (D6 - D1) -> 1302
        ",
    );
}

#[test]
fn integers_have_64_bits_within_an_expression() {
    check(
        "
        D4 * D4 / D4 -> 2147483647
        (D4 + D4) / 2 -> 2147483647
        D4 + 1 -> 2147483647; $Overflow
        D5 - 1 -> -2147483648; $Overflow
        D4 * D4 * 2 / D4 / 2 -> 2147483647
        D4 * D4 * D4 * 0 -> 0; $Overflow
        -(D5 * D4 * 4) > 0 -> 1; $Overflow
        abs(D5) - 1 -> 2147483647
        -(-2147483648) / 2 -> 1073741824
        -0x80000000 / 2 -> 1073741824
        - - -2147483648 -> -2147483648
        trunc(-(-2147483648) / 4.0) -> 536870912
        ",
    );
}

#[test]
fn division_and_remainder_truncate_and_report_zero() {
    check(
        "
        D1 / 2 -> 3
        D2 / 2 -> -3
        D1 % 2 -> 1
        D2 % 2 -> -1
        D1 % -2 -> 1
        D5 % -1 -> 0
        D1 / D3 -> 0; $DivideByZero
        D1 % D3 -> 0; $DivideByZero
        D1 / D3 + 5 -> 5; $DivideByZero
        trunc(D1 / 0.0) -> 0; $DivideByZero
        trunc(7.5 % 0) -> 0; $DivideByZero
        trunc(-7.5 % 2 * 10) -> -15
        ",
    );
}

#[test]
fn powers_saturate_and_report_values_out_of_range() {
    check(
        "
        D1 ** 2 -> 49
        D3 ** 0 -> 1
        D1 ** -1 -> 0; $OutOfRange
        D3 ** -1 -> 0; $DivideByZero
        D2 ** 3 -> -343
        D1 ** 100 < 0 -> 0; $Overflow
        D2 ** 99 < 0 -> 1; $Overflow
        trunc(2.0 ** -1 * 100) -> 50
        trunc(0.0 ** -1) -> 0; $DivideByZero
        trunc(-8.0 ** 0.5) -> 0; $OutOfRange
        trunc(-2.0 ** 3) -> -8
        ",
    );
}

#[test]
fn bit_operators_work_on_32_bits() {
    check(
        "
        12 & 10 -> 8
        12 | 3 -> 15
        12 ^ 10 -> 6
        ~D1 -> -8
        1 << 31 -> -2147483648
        1 << 32 -> 0
        1 << -1 -> 0
        D2 >> 1 -> -4
        D2 >> 40 -> -1
        D1 >> 40 -> 0
        D2 >>> 28 -> 15
        D2 >>> 32 -> 0
        (D4 + 1) | 0 -> -2147483648
        (D4 * 4) & 0xFF -> 252
        ",
    );
}

#[test]
fn one_real_operand_makes_the_result_real_and_compares_give_integers() {
    check(
        "
        7 / 2 * 2.0 -> 6
        7 / 2.0 * 2 -> 7
        1.0 / 2 + 1 / 2 == 0.5 -> 1
        (1.5 < 2) + (2 <= 2.0) + (3 > 2.5) + (2.5 >= 3) -> 3
        (0.5 == 0.5) / 2 -> 0
        !0.5 + !0.0 -> 1
        0.5 && 0.25 -> 1
        0.0 || 0.0 -> 0
        16777217 == 16777216.0 -> 0
        0.1 == 0.1 -> 1
        0.1 + 0.2 == 0.3 -> 0
        if(0.5, 1, 2) / 2 * 4 -> 0
        if(1, 1, 2.0) / 2 * 4 -> 2
        ",
    );
}

#[test]
fn operands_that_are_not_evaluated_set_no_status_bit() {
    check(
        "
        0 && 1 / D3 -> 0
        1 || 1 / D3 -> 1
        1 && 1 / D3 -> 0; $DivideByZero
        0 || 1 / D3 -> 0; $DivideByZero
        if(D3 != 0, 100 / D3, -1) -> -1
        if(D1 != 0, 100 / D1, 1 / D3) -> 14
        if(D3, 1, 1 / D3) -> 0; $DivideByZero
        C1 && 1 / D3 || C0 && !(C1 && 1 / D3) -> 1
        5 && 6 -> 1
        0 || 7 -> 1
        1 + (D1 > 3 && D2 < 0) * 10 -> 11
        if(if(C0, C1, 1 / D3), 1 / D3, if(C0, 5, 6)) + D1 -> 12
        D1 - (C0 && if(C1, 3, D6)) * 2 + D6 * (C1 || D2) -> 105
        ",
    );
}

#[test]
fn a_status_bit_shows_the_errors_of_the_operands_before_it() {
    check(
        "
        1 / D3 + $DivideByZero -> 1; $DivideByZero
        $DivideByZero + 1 / D3 -> 0; $DivideByZero
        $DivideByZero + 1 / D3 + ST10 * 2 -> 2; $DivideByZero
        (1 / D3 > 0) - ($DivideByZero > D3) -> -1; $DivideByZero
        D4 * D4 * D4 * 0 + $Overflow * 2 + $DivideByZero -> 2; $Overflow
        max(ln(0), $OutOfRange, $Overflow) * 3 -> 3; $OutOfRange
        if($OutOfRange, 5, sqrt(-1)) + if($OutOfRange, 5, 6) -> 5; $OutOfRange
        C0 && 1 / D3 || $DivideByZero -> 1; $DivideByZero
        C1 && 1 / D3 || $DivideByZero -> 0
        $IndexError + 1 / D3 -> 0; $DivideByZero
        ",
    );
}

#[test]
fn functions_return_the_type_that_the_page_defines() {
    check(
        "
        abs(D2) -> 7
        abs(-2.5) * 2 -> 5
        min(D1, D2, 3) -> -7
        max(D1, D2, 3) -> 7
        max(D1) -> 7
        min(1, 2.5) / 2 * 4 -> 2
        sum(1, D1, D2, D6) -> 101
        sum(1, 0.5, 0.5) -> 2
        sum(D4 * D4, D4 * D4, D4 * D4, -1) / D4 / D4 -> 2; $Overflow
        clamp(D6, 0, 50) -> 50
        clamp(D2, 0, 50) -> 0
        clamp(D1, 0, 50) -> 7
        clamp(D1, 50, 0) -> 50
        clamp(2.5, 0, 2) * 2 -> 4
        round(2.5) + round(-2.5) * 10 -> -27
        floor(-2.5) -> -3
        ceil(-2.5) -> -2
        trunc(-2.5) -> -2
        round(D1) -> 7
        trunc(1e30) > 0 -> 1; $Overflow
        toreal(D1) / 2 * 2 -> 7
        trunc(sqrt(2) * 10000000) -> 14142135
        trunc(sqrt(-1)) -> 0; $OutOfRange
        trunc(exp(1) * 1000000) -> 2718281
        trunc(exp(1000) > 3e38) -> 1; $Overflow
        ln(0) == 0 -> 1; $OutOfRange
        log10(1000) -> 3
        log10(-1) == 0 -> 1; $OutOfRange
        asin(2) == 0 -> 1; $OutOfRange
        acos(-1.5) == 0 -> 1; $OutOfRange
        round(1000 * (sin(1) + cos(1) * 1000)) -> 541144
        round(1000 * (tan(1) + asin(1) * 1000)) -> 1572354
        round(1000 * (acos(0) + atan(1) * 1000)) -> 786969
        atan2(0.0 * -1.0, -1) > 3 -> 1
        round(atan2(1, -1) * 1000) -> 2356
        ",
    );
}

#[test]
fn scale_gives_the_result_of_the_equivalent_operators() {
    check(
        "
        scale(D6, 0, 200, 0, 1000) -> 500
        scale(D6 * 3, 0, 200, 0, 1000) -> 1500
        scale(D6, 5, 5, 42, 1000) -> 42; $DivideByZero
        round(scale(6400, 6400, 32000, -50, 150)) -> -50
        round(scale(D1 + 1, D3 + 0, D1 + 9, D2 - 3, D6 - 0) * 10) -> 450
        round(scale(32000, 6400, 32000, -50, 150) * 10) -> 1500
        ",
    );
}

#[test]
fn nested_calls_and_lazy_operands_do_not_mix_their_operands() {
    check(
        "
        (D1 + 1) * min(D1 + 2, D2, 9, D6 - 1) - max(D3 - 1, 4, D1 * 2) -> -70
        sum(D1 + 1, 2, 3, D1 * 2, 1.5) * 2 -> 57
        sum(1, 2, D1 + 3, 0.5) * 2 -> 27
        max(1, 2, D1 + 3, D1 + 4, 0.5) -> 11
        min(D6, 2, D1 + 3, 0.5, D1 + 4) * 2 -> 1
        clamp(D1 * 2, D1 - 10, D1 + 1) + clamp(1, D1 + 1, D1 + 2) -> 16
        clamp(9, 2, D1 + 1) - (D1 - clamp(D2 - 1, D3 + 2, 8)) -> 3
        (D1 + 1) * (C0 && (D2 + 8) * (D1 - 6)) -> 8
        (D1 + 1) * if(D1 - 7, D1 + 5, (D1 + 1) / (D2 + 8)) -> 64
        2 * (D1 - 5) ** (D1 - 4) ** (D2 + 8) -> 16
        ",
    );
}

#[test]
fn a_result_is_limited_to_the_range_of_its_target() {
    let stored = |math: &str, target: &str| {
        let plc = after(math);
        (plc.value(target), bits(&plc))
    };
    let over = vec!["$Overflow"];
    assert_eq!(stored("V1 = 70000", "V1"), (65_535, over.clone()));
    assert_eq!(stored("V1 = -1", "V1"), (0, over.clone()));
    assert_eq!(stored("V1 = 65535.9", "V1"), (65_535, vec![]));
    assert_eq!(stored("MHR1 = -0.9", "MHR1"), (0, vec![]));
    assert_eq!(stored("D0 = -2.9", "D0"), (-2, vec![]));
    assert_eq!(stored("D0 = 1e30", "D0"), (2_147_483_647, over.clone()));
    assert_eq!(stored("D0 = -1e30", "D0"), (-2_147_483_648, over.clone()));
    assert_eq!(stored("N0.PRE = 40000", "N0.PRE"), (32_767, over));
    assert_eq!(stored("T0.Acc = 2s", "T0.Acc"), (2_000, vec![]));
    assert_eq!(stored("C5 = D1 - 7", "C5"), (0, vec![]));
    assert_eq!(stored("C5 = 0.25", "C5"), (1, vec![]));
    assert_eq!(stored("Y5 = D1 & 8 | 256", "Y5"), (1, vec![]));
}

#[test]
fn the_limits_of_a_tag_apply_after_the_range_and_set_no_status_bit() {
    let mut plc = plc("rung = [ { when = [\"$On\"], do = [\"MATH level = D1 * 10\"] } ]\n\
         [tags]\nlevel = { at = \"D0\", min = 10, max = 50 }");
    for (value, expected) in [(3, 30), (7, 50), (-3, 10)] {
        plc.scan(&[("D1", value)]);
        assert_eq!((plc.value("level"), bits(&plc)), (expected, vec![]));
    }
}

#[test]
fn status_bits_stay_on_for_later_rungs_of_the_same_scan() {
    let mut plc = plc(r#"rung = [
        { when = ["$Overflow"], do = ["OUT Y0"] },
        { when = ["X0"], do = ["MATH V0 = D1", "OUT Y1"] },
        { when = ["$Overflow"], do = ["OUT Y2"] },
        { when = ["!$Overflow"], do = ["MATH V1 = D1", "OUT Y3"] },
        { when = ["!$Overflow"], do = ["OUT Y4"] },
    ]"#);
    let mut at = |changes: &[(&str, i32)]| {
        plc.scan(changes);
        plc.values(["Y0", "Y1", "Y2", "Y3", "Y4", "$Overflow"])
    };
    assert_eq!(at(&[("D1", 70_000), ("X0", 1)]), [0, 1, 1, 0, 0, 1]);
    assert_eq!(at(&[("X0", 0)]), [0, 0, 0, 1, 0, 1], "the power stays in its rung");
    assert_eq!(at(&[("D1", 5)]), [0, 0, 0, 1, 1, 0]);
}

#[test]
fn math_on_a_rung_without_power_and_a_termination_pass_keep_the_target() {
    let mut plc =
        plc(r#"rung = [ { when = ["X0"], do = ["RUN P"] }, { when = ["X1"], do = ["HALT P"] } ]
        [[program]]
        name = "P"
        rung = [ { when = ["X2"], do = ["MATH D0 = D1 + 1", "MATH C5 = D1"] } ]"#);
    let mut at = |changes: &[(&str, i32)]| {
        plc.scan(changes);
        plc.values(["D0", "C5"])
    };
    assert_eq!(at(&[("D1", 4), ("X0", 1)]), [0, 0]);
    assert_eq!(at(&[("X2", 1), ("X0", 0)]), [5, 1]);
    assert_eq!(at(&[("X2", 0), ("D1", 9)]), [5, 1]);
    assert_eq!(at(&[("X1", 1)]), [5, 1]);
    assert_eq!(at(&[]), [5, 1], "after its pass");
}

#[test]
fn math_keeps_a_forced_target_and_sets_status_bits() {
    let mut plc =
        plc(r#"rung = [ { when = ["$On"], do = ["MATH D0 = 1 / D1", "MATH C5 = D1"] } ]"#);
    plc.force("D0", 42);
    plc.force("C5", 1);
    plc.scan(&[]);
    assert_eq!(plc.values(["D0", "C5", "$DivideByZero"]), [42, 1, 1]);
}

#[test]
fn each_math_that_sets_a_status_bit_is_reported_with_its_rung() {
    let mut plc = plc(r#"
        [[program.rung]]
        when = ["X0"]
        do = ["MATH D0 = 1 / D1", "MATH V0 = ln(0) - 1"]
        [[program.rung]]
        name = "second"
        when = ["$On"]
        do = ["MATH D0 = D4 + 1"]
        [[program]]
        name = "P"
        autostart = true
        [[program.stage]]
        name = "Open"
        rung = [ { when = ["$On"], do = ["MATH C0 = 1 % D1"] } ]"#);
    let reported = |plc: &Plc| -> Vec<String> {
        let told = |event: &rungd_engine::MathEvent| {
            let bits: Vec<_> = event.mishaps.each().map(|mishap| mishap.nickname()).collect();
            format!("{}: {}", plc.symbols.maths[event.math as usize], bits.join(" "))
        };
        plc.engine.maths().iter().map(told).collect()
    };
    plc.scan(&[("X0", 1), ("D4", i32::MAX)]);
    assert_eq!(
        reported(&plc),
        [
            "Main, rung 1: $DivideByZero",
            "Main, rung 1: $Overflow $OutOfRange",
            "Main, rung second: $Overflow",
            "P.Open, rung 1: $DivideByZero",
        ]
    );
    plc.scan(&[("D1", 1), ("D4", 0), ("X0", 0)]);
    assert_eq!(reported(&plc), [""; 0]);
}

#[test]
fn a_scan_reports_at_most_16_maths() {
    let maths = "\"MATH D0 = 1 / D1\", ".repeat(100);
    let mut plc = plc(&format!("rung = [ {{ when = [\"$On\"], do = [{maths}] }} ]"));
    plc.scan(&[]);
    assert_eq!((plc.engine.maths().len(), plc.engine.events_dropped()), (16, 84));
}
