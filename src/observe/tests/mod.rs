//! Questions to small ladders, and a coverage made with the same walk.

mod tape;

use tape::tape;

#[test]
fn first_look() {
    let mut plc = tape(
        r#"
        [[program.rung]]
        name = "push"
        when = ["X0", "!X1 | C0"]
        do = ["OUT Y0"]
        [[program.rung]]
        leg.up = ["X2"]
        leg.rst = ["$Off"]
        do = ["CNT CT0 preset=3"]
        [[program.rung]]
        when = ["CT0.Done", "rise(X3)"]
        do = ["SET C0", "RUN Side"]
        [[program]]
        name = "Side"
        [[program.rung]]
        when = ["X0"]
        do = ["OUT Y1", "EXIT"]
        "#,
    );
    plc.scan(&[("X0", 1)]);
    plc.scans(30);
    plc.scan(&[("X1", 1), ("X2", 1)]);
    plc.scans(5);
    for name in ["Y0", "Y1", "C0", "CT0.Done", "CT0.Acc", "Side.Running"] {
        println!("{}", plc.why(name));
        println!("{}", plc.answer(name, super::At::Now).json());
    }
}
