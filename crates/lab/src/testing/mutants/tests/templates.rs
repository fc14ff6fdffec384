//! Mutants of templates and of the arguments in their uses.

use expect_test::expect;

use super::{PERIOD, check, load};
use crate::testing::mutants::mutants;

const PUMP: &str = r#"
[[template]]
name = "Pump"
[template.parameters]
wanted   = { type = "contact" }
feedback = { type = "bit" }
motor    = { type = "output" }
least    = { type = "int" }
patience = { type = "duration", default = "3s" }
[template.tags]
failed = { type = "bit" }
late   = { type = "timer" }
[[template.rung]]
name = "start"
when = ["wanted", "!failed", "D0 >= least"]
do   = ["OUT motor"]
[[template.rung]]
when = ["motor", "!feedback | wanted"]
do   = ["TMR late preset=patience"]
[[template.rung]]
when = ["late.Done", "!(wanted | motor)", "rise(wanted)"]
do   = ["SET failed"]
"#;

const PUMPS: &str = r#"
[[program]]
name = "Main"
[[program.rung]]
use  = "Pump"
name = "p1"
with = { wanted = "X0 & X1", feedback = "X2", motor = "Y0", least = 5 }
[[program.rung]]
use  = "Pump"
name = "p2"
with = { wanted = "X3", feedback = "X4", motor = "Y1", least = 6, patience = "5s" }
"#;

#[test]
fn a_mutant_of_a_template_is_in_all_its_uses_and_one_of_an_argument_in_one_use() {
    check(
        &[("pump.toml", PUMP), ("plant.toml", PUMPS)],
        expect![[r#"
            Main, rung 2
              number: preset 3s is 3s300ms in `TMR late preset=patience`
              number: preset 3s is 2s700ms in `TMR late preset=patience`
              number: preset 3s is 0ms in `TMR late preset=patience`
            Main, rung p1/start
              rung-out: the rung left out (at 2 places)
              inverted: contact `!failed` is `failed` (at 2 places)
              contact-out: contact `!failed` left out (at 2 places)
              inverted: contact `D0 >= least` is `D0 < least` (at 2 places)
              contact-out: contact `D0 >= least` left out (at 2 places)
              border: `D0 >= least` is `D0 > least` (at 2 places)
              number: `least` (5) is 4 in `D0 >= least` (similar at 2 places)
              instruction: `OUT motor` is `SET motor` (at 2 places)
            Main, rung 2
              rung-out: the rung left out (at 2 places)
              inverted: contact `motor` is `!motor` (at 2 places)
              contact-out: contact `motor` left out (at 2 places)
              group: `!feedback | wanted` is `!feedback & wanted` (at 2 places)
              inverted: contact `!feedback` is `feedback` (at 2 places)
              contact-out: contact `!feedback` left out (at 2 places)
            Main, rung 3
              rung-out: the rung left out (at 2 places)
              inverted: contact `late.Done` is `!late.Done` (at 2 places)
              contact-out: contact `late.Done` left out (at 2 places)
              inverted: contact `!(wanted | motor)` is `(wanted | motor)` (at 2 places)
              group: `(wanted | motor)` is `(wanted & motor)` (at 2 places)
              inverted: contact `motor` is `!motor` (at 2 places)
              contact-out: contact `motor` left out (at 2 places)
              inverted: contact `rise(wanted)` is `!rise(wanted)` (at 2 places)
              contact-out: contact `rise(wanted)` left out (at 2 places)
              level: `rise(wanted)` is `wanted` (at 2 places)
              other-edge: `rise(wanted)` is `fall(wanted)` (at 2 places)
              instruction: `SET failed` is `RST failed` (at 2 places)
            Main, rung p1/start
              group: `X0 & X1` is `X0 | X1` (at 4 places)
              inverted: contact `X0` is `!X0` (at 4 places)
              contact-out: contact `X0` left out (at 4 places)
              inverted: contact `X1` is `!X1` (at 4 places)
              contact-out: contact `X1` left out (at 4 places)
            Main, rung p2/start
              inverted: contact `X3` is `!X3` (at 3 places)
              contact-out: contact `X3` left out (at 3 places)
            Main, rung 5
              number: preset 5s is 5s500ms in `TMR late preset=patience`
              number: preset 5s is 4s500ms in `TMR late preset=patience`
              number: preset 5s is 0ms in `TMR late preset=patience`
        "#]],
    );
}

#[test]
fn the_library_is_mutated_only_if_there_is_no_other_file() {
    let own = format!("{PUMPS}[[program.rung]]\nwhen = [\"X7\"]\ndo = [\"OUT Y7\"]\n");
    check(
        &[("lib:pump", PUMP), ("plant.toml", &own)],
        expect![[r#"
            Main, rung p1/start
              group: `X0 & X1` is `X0 | X1` (at 4 places)
              inverted: contact `X0` is `!X0` (at 4 places)
              contact-out: contact `X0` left out (at 4 places)
              inverted: contact `X1` is `!X1` (at 4 places)
              contact-out: contact `X1` left out (at 4 places)
            Main, rung p2/start
              inverted: contact `X3` is `!X3` (at 3 places)
              contact-out: contact `X3` left out (at 3 places)
            Main, rung 5
              number: preset 5s is 5s500ms in `TMR late preset=patience`
              number: preset 5s is 4s500ms in `TMR late preset=patience`
              number: preset 5s is 0ms in `TMR late preset=patience`
            Main, rung 7
              rung-out: the rung left out
              inverted: contact `X7` is `!X7`
              contact-out: contact `X7` is always ON
              instruction: `OUT Y7` is `SET Y7`
        "#]],
    );
    let (program, files) = load(&[("lib:pump", PUMP), ("plant.toml", PUMPS)]);
    let places = mutants(&program, &files, PERIOD).into_iter().map(|mutant| mutant.span.file.0);
    assert!(places.clone().any(|file| file == 0) && places.clone().any(|file| file == 1));
}
