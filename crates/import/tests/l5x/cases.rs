//! Named cases: what Logix does, scan by scan.

use rungd_import::l5x;
use rungd_import::model::Fate;

use super::file;
use crate::plant;

/// The fate of a rung beside others that declare nothing.
fn fate(tags: &[&str], rung: &str) -> Fate {
    let tags: Vec<String> = tags.iter().map(|tag| (*tag).to_owned()).collect();
    let project = l5x::read(&file(&tags, &[rung.to_owned()], &[])).unwrap();
    project.outcome.rungs[0].fate.clone()
}

/// The values of some places after each scan of 10 ms, with the bit `on` as given.
fn trace(tags: &[&str], rungs: &[&str], on: &[i32], watch: &[&str]) -> Vec<String> {
    let own = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
    let project = l5x::read(&file(&own(tags), &own(rungs), &[])).unwrap();
    let mut plc = plant::started(&project);
    let mut lines = Vec::new();
    for (scan, value) in on.iter().enumerate() {
        plant::scan(&mut plc, scan as u64 * 10, &[("on".to_owned(), *value)]);
        let values: Vec<String> = watch.iter().map(|name| plc.value(name).to_string()).collect();
        lines.push(values.join(" "));
    }
    lines
}

#[test]
fn ton_is_done_when_its_time_is_over_and_its_accumulator_stands_then() {
    let rungs = ["MOV(25,t.PRE);", "XIC(on)TON(t,?,?);"];
    let watch = ["t.en", "t.tt", "t.dn", "t.acc"];
    let lines = trace(&["on: BOOL", "t: TIMER"], &rungs, &[1, 1, 1, 1, 1, 0], &watch);
    assert_eq!(lines, ["1 1 0 0", "1 1 0 10", "1 1 0 20", "1 0 1 30", "1 0 1 30", "0 0 0 0"]);
}

#[test]
fn a_timer_that_resets_itself_sees_its_own_bit_of_the_scan_before() {
    let rungs = ["MOV(15,t.PRE);", "XIO(t.DN)TON(t,?,?);"];
    let lines = trace(&["on: BOOL", "t: TIMER"], &rungs, &[0; 6], &["t.dn", "t.acc"]);
    assert_eq!(lines, ["0 0", "0 10", "1 20", "0 0", "0 0", "0 10"]);
}

#[test]
fn tof_times_behind_its_rung_and_begins_done_after_the_prescan() {
    let rungs = ["MOV(15,t.PRE);", "XIC(on)TOF(t,?,?);"];
    let watch = ["t.en", "t.tt", "t.dn", "t.acc"];
    let lines = trace(&["on: BOOL", "t: TIMER"], &rungs, &[0, 1, 0, 0, 0, 0], &watch);
    assert_eq!(lines, ["0 0 0 0", "1 0 1 0", "0 1 1 0", "0 1 1 10", "0 0 0 20", "0 0 0 20"]);
}

#[test]
fn rto_keeps_its_time_until_res() {
    let rungs = ["MOV(25,t.PRE);", "XIC(on)RTO(t,?,?);", "XIC(t.DN)XIO(on)RES(t);"];
    let watch = ["t.en", "t.dn", "t.acc"];
    let lines = trace(&["on: BOOL", "t: TIMER"], &rungs, &[1, 1, 0, 1, 1, 1, 0], &watch);
    assert_eq!(lines, ["1 0 0", "1 0 10", "0 0 10", "1 0 10", "1 0 20", "1 1 30", "0 0 0"]);
}

#[test]
fn ctu_does_not_count_an_input_that_is_on_at_the_start_and_counts_beyond_its_preset() {
    let rungs = ["MOV(1,c.PRE);", "XIC(on)CTU(c,?,?);"];
    let watch = ["c.cu", "c.dn", "c.acc"];
    let lines = trace(&["on: BOOL", "c: COUNTER"], &rungs, &[1, 0, 1, 1, 0, 1], &watch);
    assert_eq!(lines, ["1 0 0", "0 0 0", "1 1 1", "1 1 1", "0 1 1", "1 1 2"]);
}

#[test]
fn ons_gives_no_pulse_for_what_is_on_at_the_start() {
    let rungs = ["XIC(on)ONS(s)ADD(n,1,n);"];
    let tags = ["on: BOOL", "s: BOOL", "n: DINT"];
    let lines = trace(&tags, &rungs, &[1, 1, 0, 1, 1], &["n", "s"]);
    assert_eq!(lines, ["0 1", "0 1", "0 0", "1 1", "1 1"]);
}

#[test]
fn osf_pulses_at_the_falling_edge() {
    let rungs = ["XIC(on)OSF(s,out);"];
    let lines = trace(&["on: BOOL", "s: BOOL", "out: BOOL"], &rungs, &[0, 1, 0, 0], &["out"]);
    assert_eq!(lines, ["0", "0", "1", "0"]);
}

#[test]
fn whole_numbers_wrap_at_the_width_of_their_target() {
    let rungs = [
        "MOV(2147483647,d);",
        "ADD(d,1,d);",
        "MOV(32767,i);",
        "ADD(i,1,i);",
        "MOV(300,s);",
        "MUL(65536,65536,m);",
        "CPT(c,(2147483647+1)/2);",
    ];
    let tags = ["on: BOOL", "d: DINT", "i: INT", "s: SINT", "m: DINT", "c: DINT"];
    let lines = trace(&tags, &rungs, &[0], &["d", "i", "s", "m", "c"]);
    assert_eq!(lines, ["-2147483648 -32768 44 0 -1073741824"]);
}

#[test]
fn a_real_in_a_whole_number_is_rounded_half_to_even() {
    for (real, whole) in [("0.5", 0), ("1.5", 2), ("2.5", 2), ("-0.5", 0), ("-1.5", -2), ("2.6", 3)]
    {
        let rung = format!("MOV({real},d);");
        assert_eq!(trace(&["on: BOOL", "d: DINT"], &[&rung], &[0], &["d"]), [whole.to_string()]);
    }
}

#[test]
fn the_sign_of_a_narrow_word_is_its_highest_bit() {
    let rungs = ["XIC(on)OTE(i.15);"];
    let lines = trace(&["on: BOOL", "i: INT"], &rungs, &[1, 0], &["i"]);
    assert_eq!(lines, ["-32768", "0"]);
}

#[test]
fn an_output_in_the_middle_does_not_change_what_stood_before_it() {
    let rungs = ["XIO(a)[OTE(a) ,OTE(b) ];"];
    let lines = trace(&["on: BOOL", "a: BOOL", "b: BOOL"], &rungs, &[0, 0, 0], &["a", "b"]);
    assert_eq!(lines, ["1 1", "0 0", "1 1"]);
}

#[test]
fn the_last_of_two_coils_of_one_bit_wins() {
    let rungs = ["XIC(on)OTE(a);", "XIO(on)OTE(a);"];
    let lines = trace(&["on: BOOL", "a: BOOL"], &rungs, &[0, 1], &["a"]);
    assert_eq!(lines, ["1", "0"]);
}

#[test]
fn a_jump_leaves_rungs_out_and_their_coils_keep_their_state() {
    let rungs = ["XIC(on)JMP(l);", "XIO(on)OTE(a);", "ADD(n,1,n);", "LBL(l)ADD(m,1,m);"];
    let tags = ["on: BOOL", "a: BOOL", "n: DINT", "m: DINT"];
    let lines = trace(&tags, &rungs, &[0, 1, 1, 0], &["a", "n", "m"]);
    assert_eq!(lines, ["1 1 1", "1 1 2", "1 1 3", "1 2 4"]);
}

#[test]
fn a_zone_of_mcr_without_power_turns_coils_off_and_resets_timers() {
    let rungs = ["XIC(on)MCR();", "OTE(a);", "OTL(b);", "TON(t,?,?);", "MCR();", "OTE(c);"];
    let tags = ["on: BOOL", "a: BOOL", "b: BOOL", "c: BOOL", "t: TIMER"];
    let lines = trace(&tags, &rungs, &[1, 0], &["a", "b", "c", "t.en"]);
    assert_eq!(lines, ["1 1 1 1", "0 1 1 0"]);
}

#[test]
fn a_compare_by_which_nothing_acts_is_exact_whatever_it_compares() {
    let tags = ["a: BOOL", "b: BOOL", "s: STRING", "t: STRING"];
    for rung in ["XIC(a)[OTE(b) ,EQU(s,t) NOP() ];", "XIC(a)EQU(s,t)NOP();", "[EQU(s,t) ,XIC(a) ];"]
    {
        assert_eq!(fate(&tags, rung), Fate::Exact, "{rung}");
    }
    let no_texts = Fate::Todo("`s`: rungd has no texts".to_owned());
    for rung in ["XIC(a)[OTE(b) ,EQU(s,t) ]OTE(b);", "EQU(s,t)[NOP() ,OTE(b) ];"] {
        assert_eq!(fate(&tags, rung), no_texts, "{rung}");
    }
    let rungs = ["XIC(on)[OTE(b) ,EQU(s,t) NOP() ];"];
    let lines = trace(&["on: BOOL", "b: BOOL", "s: STRING", "t: STRING"], &rungs, &[0, 1], &["b"]);
    assert_eq!(lines, ["0", "1"]);
}

#[test]
fn what_rungd_cannot_say_gets_a_stub_with_the_reason() {
    for (rung, reason) in [
        ("XIC(a)MSG(m);", "the instruction MSG"),
        ("XIC(S:V)OTE(a);", "the arithmetic status flag S:V"),
        ("LBL(up)XIC(a)JMP(up);", "a jump that is not forward, not last, or without its label"),
        ("XIC(a)JSR(Nowhere,0);", "no routine `Nowhere` in the program"),
        ("XIC(l)OTE(a);", "`l`: rungd has no type LINT"),
        ("XIC(a)TON(a,?,?);", "`a` is no structure"),
        ("MOV(d[9],d[0]);", "`d`: index 9 of 4 elements"),
        ("XIC(a", "the text ends within the operands of an instruction"),
    ] {
        let found = fate(&["a: BOOL", "l: LINT", "d: DINT[4]"], rung);
        assert_eq!(found, Fate::Todo(reason.to_owned()), "{rung}");
    }
}

#[test]
fn the_project_with_a_stub_is_refused_by_check() {
    let rung = "XIC(a)MSG(m);".to_owned();
    let project = l5x::read(&file(&["a: BOOL".to_owned()], &[rung], &[])).unwrap();
    assert!(project.outcome.is_open());
    let errors = plant::errors(&project);
    assert!(errors.contains("error[imported-todo]: a rung was not translated"), "{errors}");
}

/// Nothing in a file from outside may end the import.
#[test]
fn a_rung_with_any_operands_is_translated_or_gets_a_stub() {
    let instructions = [
        "XIC", "xio", "OTE", "OTL", "ONS", "OSR", "TON", "RTO", "CTU", "RES", "EQU", "LIM", "MEQ",
        "CMP", "MOV", "MVM", "CLR", "CPT", "ADD", "DIV", "MOD", "SQR", "BTD", "SCP", "COP", "FLL",
        "FFL", "FFU", "BSL", "JSR", "SBR", "RET", "JMP", "LBL", "MCR", "NoSuch",
    ];
    let operands = [
        "",
        "€x",
        "é",
        "S:",
        "S:€",
        "s:fs",
        "[",
        "a[",
        "a[€]",
        "a.",
        "a..b",
        "a.[",
        "a.[€]",
        ".3",
        "a.99",
        "\\€",
        "\\a",
        "program:€",
        "Program:p.a",
        "16#",
        "16#zz",
        "99#1",
        "-",
        "--1",
        "1e999",
        "a b",
        "a+€",
        "(((",
        "a[0,0,0,0]",
        "a[4294967296]",
        "99999999999999999999",
        "SIN(€)",
        "?",
    ];
    for name in instructions {
        for operand in operands {
            for count in [1, 2, 3, 5] {
                let rung = format!("XIC(on){name}({});", vec![operand; count].join(","));
                fate(&["on: BOOL", "a: DINT"], &rung);
            }
        }
    }
}
