//! The instructions and histories that a reload keeps, terminates or starts again: a named case for
//! every rule of `docs/semantics.md`, section 4, *Reload*.

use crate::reload::reloaded::*;

#[test]
fn an_edited_preset_keeps_the_count() {
    counted()
        .main(&cnt("2"))
        .says("preset of CT0 12 → 2")
        .says("CT0 keeps 2 of 2: Done at its next execution")
        .holds([("CT0.Acc", 2), ("CT0.Done", 0)])
        .scan(&[])
        .holds([("CT0.Acc", 2), ("CT0.Done", 1)]);
}

#[test]
fn a_leg_that_was_on_does_not_count_again() {
    counted().main(&cnt("3")).scan(&[("X0", 1)]).holds([("CT0.Acc", 2)]);
}

#[test]
fn a_structure_follows_its_address_through_edits_of_its_rung() {
    counted()
        .main(&format!(
            "rung = [ {ON} {{ leg.up = [\"X0\", \"!X7\"], leg.rst = [\"X5\"], do = [\"CNT CT0 preset=D3\"] }} ]"
        ))
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 2)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 3)]);
}

#[test]
fn a_changed_mnemonic_terminates_the_old_instruction_and_starts_again() {
    counted()
        .main("rung = [ { leg.dn = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNTDN CT0 preset=5\"] } ]")
        .says("CT0 starts again: CNTDN in Main, was CNT in Main")
        .holds([("CT0.Acc", 0), ("CT0.Reset", 0)])
        .scan(&[("X0", 0)])
        .holds([("CT0.Acc", 5)]);
}

#[test]
fn a_structure_moved_to_another_block_starts_again() {
    let side =
        format!("rung = [ {ON} ]\n[[program]]\nname = \"Side\"\nautostart = true\n{}", cnt("12"));
    counted()
        .main(&side)
        .says("CT0 starts again: CNT in Side, was CNT in Main")
        .says("Program Side is new, and starts")
        .holds([("CT0.Acc", 0)]);
}

#[test]
fn a_removed_counter_is_terminated_but_a_removed_udcg_is_not() {
    let udcg = "{ leg.up = [\"X0\"], leg.dn = [\"X2\"], do = [\"UDCG CT1 up-preset=5\"] }";
    let both = format!(
        "rung = [ {{ leg.up = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNT CT0 preset=5\"] }}, {udcg} ]"
    );
    main_with(&both)
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 1), ("CT1.Acc", 1)])
        .main(&format!("rung = [ {ON} ]"))
        .says("CT0 is gone: CNT in Main")
        .holds([("CT0.Acc", 0), ("CT0.Reset", 1), ("CT1.Acc", 1)]);
}

#[test]
fn a_new_structure_starts_as_after_a_cold_start() {
    main_with(&format!("rung = [ {ON} ]"))
        .scan(&[("CT0.Acc", 7)])
        .main(&cnt("5"))
        .says("CT0 is new")
        .holds([("CT0.Acc", 0)]);
}

#[test]
fn a_timer_continues_timing() {
    let tmr = |preset| {
        format!("rung = [ {{ when = [\"X0\"], do = [\"ONDTMR T3 preset={preset} output=Y0\"] }} ]")
    };
    main_with(&tmr("10s"))
        .scan(&[("X0", 1)])
        .scans(420)
        .main(&tmr("4210ms"))
        .says("T3 keeps 4.2 s of 4.21 s")
        .says("preset of T3 10 s → 4.21 s")
        .holds([("T3.Timing", 1), ("Y0", 0)])
        .scan(&[])
        .holds([("T3.Acc", 4210), ("Y0", 1)]);
}

/// A smaller preset ends it at once, which the report says; a timer that was done says nothing new.
#[test]
fn the_report_names_a_timer_that_its_new_preset_completes() {
    let tmr = |preset: &str, rest: &str| {
        format!(
            "rung = [ {{ when = [\"X0\"], do = [\"TMR T3 preset={preset}\"] }}, \
             {{ when = [\"T3.Done\"], do = [\"OUT Y0\"] }}{rest} ]"
        )
    };
    main_with(&tmr("10s", ""))
        .scan(&[("X0", 1)])
        .scans(420)
        .main(&tmr("4s", ""))
        .says("T3 keeps 4.2 s of 4 s: Done at its next execution")
        .scan(&[])
        .holds([("T3.Done", 1), ("Y0", 1)])
        .main(&tmr("4s", ", { when = [\"X7\"], do = [\"OUT Y7\"] }"))
        .says("T3 keeps 4.21 s of 4 s");
}

#[test]
fn a_pending_reset_stays_pending() {
    let rungs = |text: &str| format!("rung = [ {text} ]");
    let count = "{ leg.up = [\"X0\"], leg.rst = [\"X1\"], do = [\"CNT CT0 preset=9\"] },";
    let reset = "{ when = [\"X2\"], do = [\"RSTCT CT0\"] },";
    main_with(&rungs(&format!("{count}{reset}")))
        .scan(&[("X0", 0), ("X2", 1)])
        .main(&rungs(&format!("{ON}{count}")))
        .scan(&[("X0", 1), ("X2", 0)])
        .holds([("CT0.Acc", 0), ("CT0.Reset", 1)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("CT0.Acc", 1)]);
}

#[test]
fn an_off_delay_continues_timing_down() {
    let rungs = |more: &str| {
        format!(
            "rung = [ {more} {{ when = [\"X0\"], do = [\"OFFDTMR T0 preset=50ms output=Y1\"] }} ]"
        )
    };
    main_with(&rungs(""))
        .scan(&[("X0", 1)])
        .scan(&[("X0", 0)])
        .scans(2)
        .main(&rungs(ON))
        .scan(&[])
        .holds([("T0.Acc", 20), ("Y1", 1)])
        .scans(2)
        .holds([("T0.Acc", 0), ("Y1", 0)]);
}

#[test]
fn the_history_of_an_edge_contact_follows_its_text() {
    let rung = |n: u32| format!("{{ when = [\"rise(X{n})\"], do = [\"ADD D{n} 1 to=D{n}\"] }},");
    main_with(&format!("rung = [ {} ]", rung(0)))
        .scan(&[("X0", 1), ("X1", 1)])
        .main(&format!("rung = [ {} {} ]", rung(1), rung(0)))
        .scan(&[])
        .holds([("D0", 1), ("D1", 1)]);
}

#[test]
fn the_history_of_an_edge_of_an_expression_follows_its_text() {
    let rung = |contact: &str, d: u32| {
        format!("{{ when = [\"{contact}\"], do = [\"ADD D{d} 1 to=D{d}\"] }},")
    };
    let edge = "rise(D5 > 2 & !X1 | fall(X2))";
    main_with(&format!("rung = [ {} ]", rung(edge, 0)))
        .scan(&[("D5", 3)])
        .main(&format!("rung = [ {} {} ]", rung("rise(D5 > 1)", 1), rung(edge, 0)))
        .scan(&[])
        .holds([("D0", 1), ("D1", 1)]);
}

#[test]
fn the_history_of_an_edge_contact_follows_the_name_of_its_rung() {
    let rung = |contact: &str| {
        format!(
            "rung = [ {{ name = \"count\", when = [\"{contact}\"], do = [\"ADD D0 1 to=D0\"] }} ]"
        )
    };
    main_with(&rung("rise(X0)"))
        .scan(&[("X0", 1), ("X1", 1)])
        .main(&rung("rise(X1)"))
        .scan(&[])
        .holds([("D0", 1)]);
}

const ADD: (&str, &str) = ("rise(X0)", "ADD D0 1 to=D0");
const SET: (&str, &str) = ("rise(X0)", "SET C1");

#[test]
fn an_inserted_rung_triggers_no_edge_of_other_rungs() {
    let new = ("rise(X0)", "SET C7");
    for after in [[new, ADD, SET], [ADD, new, SET], [ADD, SET, new]] {
        main_with(&rungs(&[ADD, SET]))
            .scan(&[("X0", 1)])
            .scan(&[("C1", 0)])
            .main(&rungs(&after))
            .scan(&[])
            .holds([("D0", 1), ("C1", 0), ("C7", 0)])
            .scan(&[("X0", 0)])
            .scan(&[("X0", 1)])
            .holds([("D0", 2), ("C1", 1), ("C7", 1)]);
    }
}

#[test]
fn a_new_falling_edge_takes_the_history_of_an_equal_contact() {
    let fall = ("fall(X0)", "ADD D0 1 to=D0");
    main_with(&rungs(&[fall]))
        .scan(&[("X0", 1)])
        .main(&rungs(&[("fall(X0)", "SET C7"), fall]))
        .scan(&[("X0", 0)])
        .holds([("D0", 1), ("C7", 1)]);
}

#[test]
fn instructions_of_unedited_rungs_keep_their_history() {
    let (a, b) = (("X0", "PONOFF C0"), ("X1", "PONOFF C0"));
    main_with(&rungs(&[a, b]))
        .scan(&[("X0", 1)])
        .holds([("C0", 1)])
        .main(&rungs(&[("X2", "PONOFF C0"), a, b]))
        .scan(&[])
        .holds([("C0", 1)])
        .scan(&[("X1", 1)])
        .holds([("C0", 0)]);
}

#[test]
fn a_history_is_not_transferred_to_an_edge_of_another_kind() {
    let check = |was: &str, is: &str, scan: &[(&str, i32)], fires: i64| {
        let rung = |when: &str| {
            let named = format!("name = \"n\", when = [{when}]");
            format!("rung = [ {{ {named}, do = [\"ADD D0 1 to=D0\"] }} ]")
        };
        main_with(&rung(was))
            .scan(&[("X0", 1)])
            .scan(&[("D0", 0)])
            .main(&rung(is))
            .scan(scan)
            .holds([("D0", fires)]);
    };
    check("\"rise(X0)\"", "\"fall(X1)\"", &[], 0);
    check("\"rise(X0)\"", "\"fall(X0)\"", &[], 0);
    // The history of a `fall` is only about its own bit.
    check("\"fall(X0)\"", "\"fall(X1)\"", &[], 0);
    check("\"rise(X0)\"", "\"rise(X1)\"", &[("X1", 1)], 0);
    check("\"rise(X0)\"", "\"!rise(X5)\", \"rise(X0)\"", &[], 0);
    check("\"fall(X0)\", \"!X7\"", "\"fall(X0)\"", &[("X0", 0)], 1);
}

#[test]
fn the_history_of_a_new_edge_contact_is_off() {
    let rung = |contact: &str| {
        format!("rung = [ {{ when = [\"{contact}\"], do = [\"ADD D0 1 to=D0\"] }} ]")
    };
    main_with(&rung("rise(X0)"))
        .scan(&[("X0", 1), ("X1", 1)])
        .main(&rung("rise(X1)"))
        .scan(&[])
        .holds([("D0", 2)]);
}

#[test]
fn instructions_with_an_edge_history_keep_the_history() {
    let rungs = |more: &str| {
        format!(
            "rung = [ {more} {{ when = [\"X0\"], do = [\"PONOFF C0\", \"PD C1\", \"ND C2\"] }} ]"
        )
    };
    main_with(&rungs(""))
        .scan(&[("X0", 1)])
        .main(&rungs(ON))
        .scan(&[])
        .holds([("C0", 1), ("C1", 0), ("C2", 0)])
        .scan(&[("X0", 0)])
        .holds([("C0", 1), ("C2", 1)]);
}

#[test]
fn the_clock_of_an_sr_keeps_its_history() {
    let legs = "leg.data = [\"$On\"], leg.clk = [\"X0\"], leg.rst = [\"$Off\"]";
    let rungs = |more: &str, bits: &str| {
        format!("rung = [ {more} {{ name = \"belt\", {legs}, do = [\"SR {bits}\"] }} ]")
    };
    main_with(&rungs("", "C0..C3"))
        .scan(&[("X0", 1)])
        .main(&rungs(ON, "C0..C3"))
        .scan(&[])
        .holds([("C0", 1), ("C1", 0)])
        .main(&rungs(ON, "C0..C7"))
        .scan(&[])
        .holds([("C0", 1), ("C1", 0)])
        .scan(&[("X0", 0)])
        .main(&rungs("", "C0..C7"))
        .scan(&[("X0", 1)])
        .holds([("C0", 1), ("C1", 1), ("C2", 0)]);
}

#[test]
fn an_output_that_nothing_drives_any_more_turns_off_and_set_bits_stay() {
    main_with("rung = [ { when = [\"$On\"], do = [\"OUT Y0\", \"SET C5\", \"OUT Y1\"] } ]")
        .scans(1)
        .main("rung = [ { when = [\"Y0\"], do = [\"OUT C1\"] }, { when = [\"Y1\"], do = [\"OUT C2\"] }, { when = [\"$On\"], do = [\"OUT Y1\"] } ]")
        .says("Y0 is not driven in Main any more, and goes OFF")
        .scan(&[])
        .holds([("Y0", 0), ("C5", 1), ("C1", 0), ("C2", 1)]);
}
