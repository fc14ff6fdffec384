//! The grammar of MATH as a list of examples.

use expect_test::{Expect, expect};

use super::expression::{Expression, ExpressionPartKind};
use super::expression_lexer::ExpressionUse;
use super::expression_parser::{parse, parse_formula};
use super::finding::Finding;
use super::span::{FileId, Span};

fn span_of(text: &str) -> Span {
    Span { file: FileId(0), start: 0, end: text.len() as u32 }
}

/// The expression with all its parentheses.
fn tree(expression: &Expression) -> String {
    let mut operands: Vec<String> = Vec::new();
    for part in &expression.parts {
        let text = match &part.kind {
            ExpressionPartKind::Integer(n) => n.to_string(),
            ExpressionPartKind::Duration(ms) => ms.to_string(),
            ExpressionPartKind::Real(real) => real.to_string(),
            ExpressionPartKind::Name(name) => name.clone(),
            ExpressionPartKind::Unary(operator) => {
                format!("({}{})", operator.sign(), operands.pop().unwrap())
            }
            ExpressionPartKind::Binary(operator, _) => {
                let right = operands.pop().unwrap();
                format!("({} {} {right})", operands.pop().unwrap(), operator.sign())
            }
            ExpressionPartKind::Element(name) => {
                format!("{}[{}]", name.value, operands.pop().unwrap())
            }
            ExpressionPartKind::WordBit(bit) => {
                format!("{}.{}", operands.pop().unwrap(), bit.value)
            }
            ExpressionPartKind::Call(name, count) => {
                let arguments = operands.split_off(operands.len() - *count as usize);
                format!("{}({})", name.value, arguments.join(", "))
            }
        };
        operands.push(text);
    }
    assert_eq!(operands.len(), 1, "{operands:?}");
    operands.remove(0)
}

fn told(finding: &Finding) -> String {
    let place = format!("{}..{}", finding.span.start, finding.span.end);
    let help = finding.help_text().map(|help| format!("\n  {help}")).unwrap_or_default();
    format!("{} {place} {}{help}", finding.code.name(), finding.message)
}

fn check(text: &str, expected: Expect) {
    let mut warnings = Vec::new();
    let found = match parse(text, span_of(text), ExpressionUse::Math, &mut warnings) {
        Ok(expression) => tree(&expression),
        Err(finding) => told(&finding),
    };
    let lines: Vec<String> = std::iter::once(found).chain(warnings.iter().map(told)).collect();
    expected.assert_eq(&lines.join("\n"));
}

#[test]
fn operators_bind_by_the_precedence_table() {
    check("-a ** 2", expect!["((-a) ** 2)"]);
    check("2 ** -a ** b", expect!["(2 ** ((-a) ** b))"]);
    check("a ** b ** c", expect!["(a ** (b ** c))"]);
    check("a - b - c * d / e % f", expect!["((a - b) - (((c * d) / e) % f))"]);
    check("a + b < c * d", expect!["((a + b) < (c * d))"]);
    check("a < b == c > d", expect!["((a < b) == (c > d))"]);
    check(
        "a && b == 1 || !c",
        expect![[r#"
        ((a && (b == 1)) || (!c))
        mixed-operators 12..14 `||` and `&&` are mixed without parentheses
          it is read as `(a && b == 1) || !c`"#]],
    );
    check("(a || b) && (c | d) > 0", expect!["((a || b) && ((c | d) > 0))"]);
    check("-!~a", expect!["(-(!(~a)))"]);
    check("a<<2>>>b>>c", expect!["(((a << 2) >>> b) >> c)"]);
    check("a-1", expect!["(a - 1)"]);
    check("a - -1", expect!["(a - (-1))"]);
}

#[test]
fn integers_durations_and_reals_are_constants() {
    check("12 + 0x1F", expect!["(12 + 31)"]);
    check("0xFFFFFFFF", expect!["-1"]);
    check("1m30s / 00:00:02:500", expect!["(90000 / 2500)"]);
    check("12.5 + 1e3 - 2.5e-7 * 1e-3", expect!["((12.5 + 1000.0) - (2.5e-7 * 0.001))"]);
    check("-2147483648", expect!["(-2147483648)"]);
    check("1e20", expect!["1e20"]);
}

#[test]
fn constants_out_of_range_are_reported() {
    check(
        "2147483648",
        expect![[r#"
        out-of-range 0..10 `2147483648` lies outside -2147483648..2147483647
          constants have 32 bits; a real may be larger: `2147483648.0`"#]],
    );
    check(
        "-(2147483648)",
        expect![[r#"
        out-of-range 2..12 `2147483648` lies outside -2147483648..2147483647
          constants have 32 bits; a real may be larger: `2147483648.0`"#]],
    );
    check(
        "a -2147483648",
        expect![[r#"
        out-of-range 3..13 `2147483648` lies outside -2147483648..2147483647
          constants have 32 bits; a real may be larger: `2147483648.0`"#]],
    );
    check(
        "99999999999999999999",
        expect![[r#"
        out-of-range 0..20 `99999999999999999999` lies outside -2147483648..2147483647
          constants have 32 bits; a real may be larger: `99999999999999999999.0`"#]],
    );
    check(
        "0x100000000",
        expect![[r#"
        out-of-range 0..11 `0x100000000` has more than 32 bits
          the greatest is `0xFFFFFFFF`, which is -1"#]],
    );
    check(
        "1e39",
        expect![[r#"
        out-of-range 0..4 `1e39` lies beyond the largest real
          a real is a binary32, up to `3.4028235e38`"#]],
    );
    check(
        "1.",
        expect![[r#"
        expression-syntax 0..2 `1.` is no number
          write `1.0`"#]],
    );
    check(
        ".5",
        expect![[r#"
        expression-syntax 0..1 a point without digits before it
          a real has digits on both sides of its point: `0.5`"#]],
    );
    check(
        "1e+3",
        expect![[r#"
        expression-syntax 0..4 `1e+3` is no number
          write `1e3`"#]],
    );
    check(
        "1E3",
        expect![[r#"
        expression-syntax 0..3 `1E3` is no number
          write `1e3`"#]],
    );
    check(
        "5s1m",
        expect![[r#"
        bad-duration 0..4 the units of `5s1m` do not descend
          write `1m5s`"#]],
    );
}

#[test]
fn calls_indexes_and_names_are_parsed() {
    check("min(a, -b, c.Acc) + $100ms", expect!["(min(a, (-b), c.Acc) + $100ms)"]);
    check("sqrt (abs(x))", expect!["sqrt(abs(x))"]);
    check("f()", expect!["f()"]);
    check("a[b + 1] * -c[0]", expect!["(a[(b + 1)] * (-c[0]))"]);
    check("a [b[c[2]]] ** 2", expect!["(a[b[c[2]]] ** 2)"]);
    check("sum(a[0..3], b[ 1 .. 2 ], c)", expect!["sum(a[0..3], b[1..2], c)"]);
    check("min", expect!["min"]);
    check(
        "f(a,)",
        expect![[r#"
        expression-syntax 4..5 a value is missing here
          a value is a constant, a name, a call or an expression in parentheses"#]],
    );
    check(
        "f(,a)",
        expect![[r#"
        expression-syntax 2..3 a value is missing here
          a value is a constant, a name, a call or an expression in parentheses"#]],
    );
    check("f(a", expect!["expression-syntax 3..3 `)` is missing"]);
    check(
        "a, b",
        expect![[r#"
        expression-syntax 1..2 a comma outside a call
          a Sensaphone element is written `N0.ACC` here, a real `12.5`"#]],
    );
    check(
        "(a, b)",
        expect![[r#"
        expression-syntax 2..3 a comma outside a call
          a Sensaphone element is written `N0.ACC` here, a real `12.5`"#]],
    );
    check(
        "N,0,6",
        expect![[r#"
        expression-syntax 1..2 a comma outside a call
          a Sensaphone element is written `N0.ACC` here, a real `12.5`"#]],
    );
    check("recipe[3]", expect!["recipe[3]"]);
}

#[test]
fn each_syntax_error_shows_a_correct_form() {
    check(
        "",
        expect![[r#"
        expression-syntax 0..0 a value is missing here
          a value is a constant, a name, a call or an expression in parentheses"#]],
    );
    check(
        "a +",
        expect![[r#"
        expression-syntax 3..3 a value is missing here
          a value is a constant, a name, a call or an expression in parentheses"#]],
    );
    check(
        "+ a",
        expect![[r#"
        expression-syntax 0..1 a value has no `+` before it
          take the `+` away"#]],
    );
    check(
        "a b",
        expect![[r#"
        expression-syntax 2..3 an operator is missing before this
          operators are `+ - * / % **` and the like"#]],
    );
    check(
        "a mod b",
        expect![[r#"
        expression-syntax 2..5 an operator is missing before this
          write `%`"#]],
    );
    check("a (b)", expect!["a(b)"]);
    check("(a", expect!["expression-syntax 2..2 `)` is missing"]);
    check("a)", expect!["expression-syntax 1..2 `)` closes nothing, or is too early"]);
    check(
        "()",
        expect![[r#"
        expression-syntax 1..2 a value is missing here
          a value is a constant, a name, a call or an expression in parentheses"#]],
    );
}

#[test]
fn operators_of_other_notations_are_reported_with_the_right_operator() {
    check(
        "a = b",
        expect![[r#"
        expression-syntax 2..3 `=` in an expression
          a compare is `==`; one MATH stores in one target"#]],
    );
    check(
        "a <> b",
        expect![[r#"
        expression-syntax 2..4 `<>` is written `!=`
          write `!=`"#]],
    );
    check(
        "a => b",
        expect![[r#"
        expression-syntax 2..4 `=>` is written `>=`
          write `>=`"#]],
    );
    check(
        "a ? b",
        expect![[r#"
        expression-syntax 2..3 `?` is no operator
          a choice is `if(c, x, y)`"#]],
    );
    check(
        "grö",
        expect![[r#"
        expression-syntax 2..4 `ö` belongs to no name
          names are of the letters A to Z and a to z, digits and `_`: `groesse`"#]],
    );
    check(
        "!a == 3",
        expect![[r#"
        expression-syntax 0..7 `!` binds tighter than `==`
          write `!(a == 3)`"#]],
    );
    check("!a.Acc + 1 < 3", expect!["(((!a.Acc) + 1) < 3)"]);
    check(
        "a < b <= c",
        expect![[r#"
        expression-syntax 0..10 two compares in a row
          join them: `a < b && b <= c`"#]],
    );
}

#[test]
fn operators_that_are_easily_misread_get_a_warning() {
    check(
        "a & b == 1",
        expect![[r#"
        (a & (b == 1))
        mixed-operators 2..3 `&` and `==` are mixed without parentheses
          it is read as `a & (b == 1)`"#]],
    );
    check(
        "a | b & c",
        expect![[r#"
        (a | (b & c))
        mixed-operators 2..3 `|` and `&` are mixed without parentheses
          it is read as `a | (b & c)`"#]],
    );
    check(
        "a & b & c ^ d",
        expect![[r#"
        (((a & b) & c) ^ d)
        mixed-operators 10..11 `^` and `&` are mixed without parentheses
          it is read as `(a & b & c) ^ d`"#]],
    );
    check(
        "a << b + 1",
        expect![[r#"
        (a << (b + 1))
        mixed-operators 2..4 `<<` and `+` are mixed without parentheses
          it is read as `a << (b + 1)`"#]],
    );
    check(
        "a && b || c",
        expect![[r#"
        ((a && b) || c)
        mixed-operators 7..9 `||` and `&&` are mixed without parentheses
          it is read as `(a && b) || c`"#]],
    );
    check(
        "(a & b) == 1 && ((c | d) & e) << (f + 1)",
        expect!["(((a & b) == 1) && (((c | d) & e) << (f + 1)))"],
    );
}

#[test]
fn the_target_of_a_formula_ends_at_the_first_equals_sign() {
    let check = |text: &str, expected: Expect| {
        let mut findings = Vec::new();
        let found = match parse_formula(text, span_of(text), &mut findings) {
            Some(formula) => format!("{}: {}", formula.target.value, tree(&formula.expression)),
            None => findings.iter().map(told).collect(),
        };
        expected.assert_eq(&found);
    };
    check("D0=1", expect!["D0: 1"]);
    check(" level = a == b", expect!["level: (a == b)"]);
    check("T0.Acc = 2s", expect!["T0.Acc: 2000"]);
    check(
        "D0 == 1",
        expect![[r#"
        expression-syntax 0..7 MATH lacks the `=` behind its target
          its form is `MATH target = expression`: `MATH level = (raw - 6400) / 51`"#]],
    );
    check(
        "D0",
        expect![[r#"
        expression-syntax 0..2 MATH lacks the `=` behind its target
          its form is `MATH target = expression`: `MATH level = (raw - 6400) / 51`"#]],
    );
    check(
        "= 1",
        expect![[r#"
        expression-syntax 0..1 MATH lacks its target
          its form is `MATH target = expression`: `MATH level = (raw - 6400) / 51`"#]],
    );
    check(
        "D0 := 1",
        expect![[r#"
        expression-syntax 0..4 `:=` is no sign here
          write `D0 = …`"#]],
    );
    check(
        "D0 += 1",
        expect![[r#"
        expression-syntax 0..4 `+=` is no sign here
          write `D0 = D0 + …`"#]],
    );
    check(
        "D0 <= 1",
        expect![[r#"
        expression-syntax 0..4 `D0 <` is no target
          the target is the name of a word or bit: `MATH D0 = D1 + 1`"#]],
    );
    check("recipe[a == b] = 1", expect!["recipe: 1"]);
    check(
        "recipe[a = b] = 1",
        expect![[r#"
            expression-syntax 9..10 `=` in an expression
              a compare is `==`; one MATH stores in one target"#]],
    );
    check(
        "5 = 1",
        expect![[r#"
        expression-syntax 0..1 `5` is no target
          the target is the name of a word or bit: `MATH D0 = D1 + 1`"#]],
    );
}

#[test]
fn nesting_is_limited_to_32_levels_but_length_is_not() {
    let nested = |levels: usize| format!("{}a{}", "(".repeat(levels), ")".repeat(levels));
    let mut warnings = Vec::new();
    let mut ends =
        |text: String| match parse(&text, span_of(&text), ExpressionUse::Math, &mut warnings) {
            Ok(expression) => format!("{} parts", expression.parts.len()),
            Err(finding) => finding.message,
        };
    assert_eq!(ends(nested(32)), "1 parts");
    let too_deep = "more than 32 levels of parentheses, calls and signs";
    assert_eq!(ends(nested(33)), too_deep);
    assert_eq!(ends(nested(10_000)), too_deep);
    assert_eq!(ends(format!("{}a", "-".repeat(32))), "33 parts");
    assert_eq!(ends(format!("{}a", "!".repeat(33))), too_deep);
    assert_eq!(ends(format!("{}a{}", "f(".repeat(33), ")".repeat(33))), too_deep);
    assert_eq!(ends(format!("1{}", "**1".repeat(20_000))), "40001 parts");
    assert_eq!(ends(format!("1{}", "+(1)".repeat(16_000))), "32001 parts");
}
