//! Properties of arrays that no ladder can show: forces of elements, and the report of a wrong
//! index.

use rungd_test_support::plc::{Plc, plc};

/// Writes by an index, and writes of whole arrays.
const WRITES: &str = r#"
rung = [
  { when = ["X0"], do = ["MOVE 5 to=word[D0]", "MATH word[D0 + 1] = 6", "SET gate[D0]"] },
  { when = ["X1"], do = ["FILL 7 to=word", "FILL 1 to=gate"] },
  { when = ["X2"], do = ["COPY D20..D23 to=word", "COPY X4..X7 to=gate"] },
  { leg.data = ["$On"], leg.clk = ["X3"], leg.rst = ["$Off"], do = ["SR gate"] },
]
[tags]
word = { at = "D10", count = 4 }
gate = { at = "C0", count = 4 }
"#;

#[test]
fn a_forced_element_keeps_its_value() {
    let mut plc = plc(WRITES);
    plc.force("D11", 99);
    plc.force("C1", 0);
    plc.scan(&[("D0", 1), ("X5", 1), ("D21", 3)]);
    for input in ["X0", "X1", "X2", "X3"] {
        plc.scan(&[(input, 1)]);
        plc.scan(&[(input, 0)]);
        assert_eq!(plc.values(["D11", "C1"]), [99, 0], "{input}");
    }
    // The other elements were written.
    assert_eq!(plc.values(["D10", "D12", "C0", "C2"]), [0, 0, 1, 0]);
    plc.release("D11");
    plc.scan(&[("X1", 1)]);
    assert_eq!(plc.value("D11"), 7);
}

#[test]
fn a_wrong_index_is_reported_with_its_rung() {
    let mut plc = plc(r#"
        [[program.rung]]
        name = "read"
        when = ["X0", "word[D0] == 0"]
        do = ["MOVE word[D0] to=D1", "ADD 1 word[D2] to=D1"]
        [[program.rung]]
        leg.up = ["X0"]
        leg.rst = ["$Off"]
        do = ["CNT CT0 preset=word[D0]"]
        [[program.rung]]
        when = ["X0"]
        do = ["MATH word[D0] = 1 / D2", "FILL word[D0] to=V0..V1"]
        [tags]
        word = { at = "D10", count = 4 }"#);
    let reported = |plc: &Plc| -> Vec<String> {
        let told = |event: &rungd_engine::MathEvent| {
            let bits: Vec<_> = event.mishaps.each().map(|mishap| mishap.nickname()).collect();
            format!("{}: {}", plc.symbols.maths[event.math as usize], bits.join(" "))
        };
        plc.engine.maths().iter().map(told).collect()
    };
    plc.scan(&[("X0", 1), ("D0", 4)]);
    assert_eq!(
        reported(&plc),
        [
            "Main, rung read: $IndexError",
            "Main, rung 2: $IndexError",
            "Main, rung 3: $DivideByZero $IndexError",
            "Main, rung 3: $IndexError",
        ]
    );
    plc.scan(&[("X0", 0)]);
    assert_eq!(reported(&plc), ["Main, rung 2: $IndexError"]);
    plc.scan(&[("X0", 1), ("D0", 3), ("D2", 1)]);
    assert!(reported(&plc).is_empty());
}
