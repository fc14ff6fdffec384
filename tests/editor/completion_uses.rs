//! Completion in uses and devices: parameters in the braces of texts and in uses of one line,
//! points in the map of a device.

use crate::editor::completion::{RICH, check};
use crate::editor::project::{CONTROLLER, LADDER};

#[test]
fn parameters_are_offered_in_texts_and_inline_uses() {
    let template = "[[template]]\nname = \"Lamp\"\n[template.parameters]\non = { type = \"bit\" }\n\
                    [template.tags]\n";
    check(
        LADDER,
        template,
        &[
            ("late = { type = \"bit\", alarm = \"{¦}\" }", &["name", "on"], &["late"]),
            ("late = { type = \"bit\", alarm = \"{name}: {o¦\" }", &["on"], &["name"]),
            ("late = { type = \"bit\", doc = \"of ¦\" }", &[], &[]),
            ("late = { type = \"bit\", alarm = \"{name} ¦\" }", &[], &[]),
        ],
    );
    check(
        LADDER,
        RICH,
        &[
            (
                "[[task]]\nname = \"T\"\nrung = [{ use = \"Pump\", with = { ¦ } }]",
                &["wanted", "motor", "patience"],
                &["amount"],
            ),
            (
                "[[task]]\nname = \"T\"\nrung = [\n  { use = \"Pump\", with = { motor = \"Y3\", ¦",
                &["wanted"],
                &["motor"],
            ),
            (
                "[[task]]\nname = \"T\"\nrung = [{ use = \"Pump\", with = { motor = \"¦\" } }]",
                &["valve"],
                &["start"],
            ),
        ],
    );
}

#[test]
fn records_are_offered_to_a_parameter_of_their_type() {
    let text = "[tags]\nrecipe = { type = \"Step\", count = 3 }\ncurrent = { type = \"Step\" }\n\
                lane = { type = \"Lane\" }\nlevel = { type = \"int\" }\n[[record]]\n\
                name = \"Step\"\nfields = { kind = { type = \"int\" }, on = { type = \"bit\" } }\n\
                [[record]]\nname = \"Lane\"\nfields = { late = { type = \"timer\" } }\n\
                [[template]]\nname = \"Dose\"\nparameters = { step = { type = \"Step\" } }\n";
    check(
        LADDER,
        text,
        &[
            ("rung = [{ when = [\"step.¦\"] }]", &["on"], &["late"]),
            ("rung = [{ do = [\"OUT step.¦\"] }]", &["on"], &["late"]),
            ("rung = [{ do = [\"OUT step.kind.¦\"] }]", &["0", "31"], &["on"]),
            (
                "tags.own = { type = \"Step\" }\nrung = [{ use = \"Dose\", with = { step = \"¦\" } }]",
                &["own", "step", "current"],
                &["lane", "level"],
            ),
            (
                "[[program]]\nname = \"Main\"\nrung = [{ use = \"Dose\", with = { step = \"¦\" } }]",
                &["recipe", "current"],
                &["lane", "level", "X", "step"],
            ),
            (
                "[[template]]\nname = \"T\"\nparameters = { s = { type = \"¦\" } }",
                &["Step", "Lane", "int-out"],
                &[],
            ),
        ],
    );
}

#[test]
fn points_are_offered_in_device_maps() {
    let plant = "ladder = [\"plant.toml\"]\n[[device]]\nname = \"plant\"\ndriver = \"simulated\"\n\
                 part = [{ name = \"pump\", kind = \"motor\" }, { name = \"belt\", kind = \
                 \"conveyor\", eyes = { infeed = 100 } }]\nfault = [{ name = \"worn\" }]\n";
    check(
        CONTROLLER,
        plant,
        &[
            (
                "map = [{ from = \"¦\", to = \"X0\" }]",
                &["pump.running", "belt.infeed", "valve"],
                &["fault.worn", "coil "],
            ),
            ("map = [{ from = \"Y0\", to = \"¦\" }]", &["pump.run", "fault.worn", "start"], &[]),
            ("map = [{ from = \"Y0\", to = \"pump.r¦\" }]", &["pump.run"], &["start", "belt.run"]),
            ("[[device.map]]\nfrom = \"Y0\"\nto = \"pu¦\"", &["pump.trip"], &[]),
        ],
    );
    let line = "ladder = [\"plant.toml\"]\n[[device]]\nname = \"io\"\ndriver = \"modbus-tcp\"\n";
    check(
        CONTROLLER,
        line,
        &[
            ("map = [{ from = \"¦\" }]", &["coil ", "input ", "valve"], &["pump.run"]),
            ("map = [{ to = \"¦\" }]", &["holding "], &["input "]),
        ],
    );
}
