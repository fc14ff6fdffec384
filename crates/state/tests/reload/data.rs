//! The rules of a reload for data, tags, forces and Sensaphone counters, a named case each.

use crate::reload::reloaded::*;

#[test]
fn the_report_warns_if_a_moved_tag_leaves_its_value_behind() {
    let main = main_text(
        "rung = [ { when = [\"Level == 5\", \"count.Done\", \"V20 == 3\"], do = [\"OUT Y0\"] }, { leg.up = [\"X0\"], leg.rst = [\"$Off\"], do = [\"CNT count preset=9\"] } ]",
    );
    let tags = |level: &str, count: &str| {
        format!(
            "[tags]\neye = {{ at = \"X{level}\" }}\nLevel = {{ at = \"V{level}\" }}\n\
             count = {{ at = \"{count}\" }}\n{main}"
        )
    };
    plc(&tags("10", "CT0"))
        .scan(&[("V10", 17), ("V20", 3), ("X0", 1)])
        .reload(&tags("20", "CT1"))
        .says("tag eye moved from X10 to X20")
        .says("warning: tag Level moved from V10 to V20: V20 keeps its own value 3; V10's was 17")
        .says("warning: tag count moved from CT0 to CT1: CT1 begins at 0; CT0's was 1")
        .holds([("V20", 3), ("CT1.Acc", 0)])
        .scan(&[("V20", 17)])
        .reload(&tags("10", "CT1"))
        .says("tag Level moved from V20 to V10: both are 17");
}

#[test]
fn the_report_shows_values_with_the_texts_of_their_tags() {
    let main = main_text(&rungs(&[("mode == 5", "OUT Y0"), ("D30 == D40", "OUT Y1")]));
    let tags = |at: &str, initial: &str, more: &str| {
        let texts = "texts = { 0 = \"idle\", 3 = \"dosing\" }";
        let mode = format!("mode = {{ at = \"{at}\", {texts}, initial = {initial} }}\n");
        format!("[tags]\n{mode}{more}{main}")
    };
    let next = "next = { at = \"D50\", initial = 7, texts = { 7 = \"rinse\" } }\n";
    plc(&tags("D10", "0", ""))
        .scan(&[("D10", 3), ("D30", 3)])
        .reload(&tags("D10", "3", next))
        .says("initial of mode (D10) 0 (idle) → 3 (dosing), from the next cold start on")
        .says("next (D50) is new: 7 (rinse)")
        .reload(&tags("D30", "3", next))
        .says("tag mode moved from D10 to D30: both are 3 (dosing)")
        .reload(&tags("D20", "3", next))
        .says("warning: tag mode moved from D30 to D20: D20 begins at 3 (dosing); D30's was 3 (dosing)")
        .reload(&tags("D40", "3", next))
        .says("warning: tag mode moved from D20 to D40: D40 keeps its own value 0 (idle); D20's was 3 (dosing)");
}

#[test]
fn the_report_names_a_force_left_behind_by_its_tag() {
    let ladder = |fan: &str, heater: &str| {
        let tags =
            format!("[tags]\nfan = {{ at = \"{fan}\" }}\nheater = {{ at = \"{heater}\" }}\n");
        tags + &main_text(&rungs(&[("X0", "OUT fan"), ("X1", "OUT heater")]))
    };
    plc(&ladder("Y2", "Y3")).force("Y2", 0).scan(&[]).reload(&ladder("Y5", "Y2")).says(
        "warning: tag fan moved from Y2 to Y5: Y5 keeps its own value OFF; Y2's was OFF (forced); \
         the force stays on Y2, which is heater now; fan (Y5) is not forced",
    );
}

#[test]
fn the_report_warns_of_a_bit_that_stays_on_and_that_no_rung_writes() {
    let set = [("X0", "SET Y0"), ("X0", "SET C5"), ("X0", "OUT Y1"), ("X1", "RST C6")];
    let plc = main_with(&rungs(&set)).scan(&[("X0", 1)]).main(&rungs(&[("X1", "RST C5")]));
    let warnings: Vec<_> = plc.report.iter().filter(|l| l.starts_with("warning: ")).collect();
    assert_eq!(warnings, ["warning: Y0 stays ON, and no rung writes it any more"]);
    plc.scan(&[]).holds([("Y0", 1)]);
}

#[test]
fn the_report_warns_of_a_value_beyond_new_limits() {
    let tagged = |limits: &str| {
        let tags = format!("[tags]\nsize = {{ at = \"D1\"{limits} }}\n");
        tags + &main_text(&rungs(&[("size == 5", "OUT Y0")]))
    };
    let plc = |value: i32| plc(&tagged("")).scan(&[("D1", value)]);
    plc(17).reload(&tagged(", min = 0, max = 10")).says(
        "warning: size (D1) keeps 17, which is outside its new limits, 0 to 10; a restart would \
         discard it",
    );
    let told = "limits of size (D1) none → 0 to 10";
    assert_eq!(plc(10).reload(&tagged(", min = 0, max = 10")).report, [told]);
    assert_eq!(plc(10).reload(&tagged("")).report, [NONE]);
}

#[test]
fn the_report_lists_changed_limits_and_initial_values() {
    let tagged = |size: &str, lamp: &str, row: &str| {
        let tags = format!(
            "[tags]\nsize = {{ at = \"D1\"{size} }}\nlamp = {{ at = \"C1\"{lamp} }}\n\
             row = {{ type = \"real\", count = 3{row} }}\n"
        );
        tags + &main_text(&rungs(&[("lamp", "OUT Y0"), ("size == 5", "MOVE 2 to=row[0]")]))
    };
    let first = tagged(", initial = 7, min = 0, max = 10", "", ", max = 4.5");
    let second = tagged(", initial = 8, min = 0, max = 9", ", initial = true", ", max = 5");
    let report = plc(&first).scan(&[]).reload(&second).holds([("D1", 7), ("C1", 0)]).report;
    let told: Vec<&str> = report.iter().map(String::as_str).collect();
    assert_eq!(
        told,
        [
            "limits of size (D1) 0 to 10 → 0 to 9",
            "limits of row -3.4028235e38 to 4.5 → -3.4028235e38 to 5.0",
            "initial of lamp (C1) none → ON, from the next cold start on",
            "initial of size (D1) 7 → 8, from the next cold start on",
        ]
    );
    let back = plc(&second).scan(&[]).reload(&tagged("", "", "")).report;
    assert!(back.contains(&"limits of size (D1) 0 to 9 → none".to_owned()), "{back:?}");
    assert!(
        back.contains(&"initial of lamp (C1) ON → none, from the next cold start on".to_owned()),
        "{back:?}"
    );
}

#[test]
fn the_report_names_a_renamed_tag() {
    let tagged = |tag: &str| {
        let tags = format!("[tags]\n{tag} = {{ at = \"D1\" }}\n");
        tags + &main_text(&rungs(&[("D1 == 5", "OUT Y0")]))
    };
    assert_eq!(plc(&tagged("a")).reload(&tagged("b")).report, ["tag a (D1) was renamed to b"]);
}

#[test]
fn the_report_has_one_line_for_a_moved_or_renamed_array() {
    let ladder = |name: &str, at: &str| {
        let tags = format!("[tags]\n{name} = {{ at = \"{at}\", count = 12 }}\n");
        tags + &main_text(&rungs(&[("D0 == 5", "OUT Y0")]))
    };
    let before = || plc(&ladder("mix", "D10")).scan(&[("D12", 7), ("D21", 9), ("D50", 4)]);
    let report = |now: &str, at: &str| before().reload(&ladder(now, at)).report;
    assert_eq!(report("paste", "D10"), ["array mix (D10..D21) was renamed to paste"]);
    assert_eq!(
        report("mix", "D50"),
        [
            "warning: array mix moved from D10..D21 to D50..D61: 3 of 12 values differ: mix[0] is 4, \
          was 0"
        ]
    );
    let plain = |at: &str| plc(&ladder("mix", "D10")).scan(&[]).reload(&ladder("mix", at)).report;
    assert_eq!(
        plain("D50"),
        ["array mix moved from D10..D21 to D50..D61: all values are the same"]
    );
    let forced = before().force("D12", 7).scan(&[]).reload(&ladder("mix", "D50"));
    forced.says(
        "warning: array mix moved from D10..D21 to D50..D61: 3 of 12 values differ: mix[0] is 4, \
         was 0; forces stay on D10..D21; mix (D50..D61) is not forced",
    );
    let forced = before().force("D12", 7).scan(&[]).reload(&ladder("paste", "D10"));
    forced.says("array mix (D10..D21) was renamed to paste; its forces stay");
}

#[test]
fn the_report_counts_edited_new_and_removed_rungs() {
    let (a, b, c) = (("X0", "OUT C0"), ("X1", "OUT C1"), ("X2", "OUT C2"));
    let said = |was: &[(&str, &str)], is: &[(&str, &str)]| {
        main_with(&rungs(was)).main(&rungs(is)).report.join("; ")
    };
    assert_eq!(said(&[a, b], &[a, b]), NONE);
    assert_eq!(said(&[a, b], &[b, a]), "the order of the rungs has changed");
    assert_eq!(said(&[a, b], &[a, c, b]), "0 rungs edited, 1 new, 0 gone");
    assert_eq!(said(&[a, b], &[a, ("X5", "OUT C1")]), "1 rung edited, 0 new, 0 gone");
    assert_eq!(said(&[a, ("X7", "SET C3")], &[a]), "0 rungs edited, 0 new, 1 gone");
}

#[test]
fn an_initial_value_does_not_change_a_forced_cell() {
    let tagged = "[tags]\nsize = { at = \"D1\", initial = 4 }\n";
    let main = main_text("rung = [ { when = [\"D2 == 5\"], do = [\"OUT Y0\"] } ]");
    plc(&main)
        .force("D1", 7)
        .scan(&[])
        .reload(&format!("{tagged}{}", main.replace("D2", "size")))
        .says("size (D1) is new: 4, but stays 7 (forced)")
        .holds([("D1", 7)]);
}

#[test]
fn data_is_kept_by_address_and_new_tags_take_their_initial_values() {
    let tagged =
        "[tags]\nsize = { at = \"D1\", initial = 12 }\nlot = { at = \"D2\", initial = 7 }\n";
    let old = main_text("rung = [ { when = [\"D2 == 5\"], do = [\"OUT Y0\"] } ]");
    let new = main_text("rung = [ { when = [\"D2 == size\", \"lot > 1\"], do = [\"OUT Y0\"] } ]");
    plc(&old)
        .scan(&[("D2", 5), ("D9", 3)])
        .reload(&format!("{tagged}{new}"))
        .says("size (D1) is new: 12")
        .holds([("D1", 12), ("D2", 5), ("D9", 3)]);
}

#[test]
fn forces_survive_a_reload() {
    main_with(&cnt("5"))
        .force("Y3", 1)
        .force("D7", 42)
        .scan(&[])
        .main(&format!("{}\n[[task]]\nname = \"T\"\nrung = [ {{ when = [\"$On\"], do = [\"MOVE 1 to=D7\", \"OUT Y3\"] }} ]", cnt("6")))
        .scan(&[("Y3", 0), ("D7", 1)])
        .holds([("Y3", 1), ("D7", 42), ("$ForcesActive", 1)]);
}

#[test]
fn a_sensaphone_counter_continues_and_uses_an_edited_preset() {
    let up = |preset| format!("{{ when = [\"X0\"], do = [\"CTU N0 preset={preset}\"] }},");
    let down = "{ when = [\"X1\"], do = [\"CTD N0\"] },";
    main_with(&format!("rung = [ {} {down} ]", up(5)))
        .scan(&[("X0", 1), ("X1", 1)])
        .scan(&[("X0", 0)])
        .scan(&[("X0", 1)])
        .holds([("N0.ACC", 1), ("N0.PRE", 5), ("N0.CD", 1)])
        .main(&format!("rung = [ {} ]", up(8)))
        .scan(&[])
        .holds([("N0.ACC", 1), ("N0.PRE", 8), ("N0.CD", 0)]);
}

#[test]
fn a_written_sensaphone_preset_is_kept_if_its_constant_is_unchanged() {
    let up =
        |more: &str| format!("rung = [ {more} {{ when = [\"X0\"], do = [\"CTU N0 preset=5\"] }} ]");
    main_with(&up("")).scan(&[("N0.PRE", 9)]).main(&up(ON)).scan(&[]).holds([("N0.PRE", 9)]);
}

#[test]
fn a_reload_causes_no_first_scan_and_keeps_status_words() {
    let first = "rung = [ { when = [\"$FirstScan\"], do = [\"ADD D0 1 to=D0\"] } ]\n[[task]]\nname = \"FirstScan\"\nrung = [ { when = [\"$On\"], do = [\"ADD D1 1 to=D1\"] } ]";
    main_with(&format!("rung = [ {ON} ]")).scans(3).main(first).scans(2).holds([
        ("D0", 0),
        ("D1", 0),
        ("DST0", 4),
    ]);
}

#[test]
fn a_requested_stop_survives_a_reload() {
    let stop = |more: &str| format!("rung = [ {more} {{ when = [\"X0\"], do = [\"STOP\"] }} ]");
    let mut reloaded = main_with(&stop("")).scan(&[("X0", 1)]).main(&stop(ON));
    assert!(reloaded.plc.scan(&[]).last);
}

/// The content of an R word's cell.
fn real(text: &str) -> i32 {
    text.parse::<rungd_engine::isa::Real>().expect("a real").cell()
}

#[test]
fn a_real_keeps_its_value_and_the_report_shows_reals() {
    let tagged = |tag: &str| {
        let tags = format!("[tags]\nlevel = {{ {tag} }}\n");
        tags + &main_text(&rungs(&[("level > 5.5", "OUT Y0"), ("X0", "MOVE 2.5 to=R7")]))
    };
    let value = real("12.25");
    let plc = || plc(&tagged("at = \"R1\"")).scan(&[("R1", value)]);
    let edited = tagged("at = \"R1\"").replace("2.5", "2.75");
    plc().reload(&edited).holds([("R1", value.into())]);
    plc()
        .reload(&tagged("at = \"R2\", initial = 0.5"))
        .says("warning: tag level moved from R1 to R2: R2 begins at 0.5; R1's was 12.25");
    plc().reload(&tagged("at = \"R1\", min = 0.5, max = 9")).says(
        "warning: level (R1) keeps 12.25, which is outside its new limits, 0.5 to 9.0; a restart \
         would discard it",
    );
    plc()
        .force("R1", real("-1.5"))
        .scan(&[])
        .reload(&edited)
        .scan(&[("R1", value)])
        .holds([("R1", real("-1.5").into())]);
}
