//! Single ladders whose export was wrong once.

use rungd_base::random::SplitMix64;
use rungd_lab::export::exported;
use rungd_language::resolve::program::Program;
use rungd_test_support::run::load;

use super::judge::Judge;

fn program(tags: &str, rungs: &str) -> Program {
    load(&format!("[tags]\n{tags}\n[[program]]\nname = \"Main\"\n{rungs}")).unwrap()
}

fn text(program: &Program) -> String {
    exported(program, rungd_base::scan_period::ScanPeriod::DEFAULT).unwrap().text
}

#[test]
fn tags_called_as_numbers_are_no_constants() {
    for name in ["infinity", "inf", "nan"] {
        let tags = format!("{name} = {{ type = \"int\" }}\nratio = {{ type = \"real\" }}");
        let rungs = format!(
            "rung = [{{ when = [\"{name} > 5\"], do = [\"OUT Y0\"] }}, \
             {{ when = [\"X0\"], do = [\"MATH ratio = 1.5 / {name}\"] }}]"
        );
        let program = program(&tags, &rungs);
        let judge = Judge { name, program: &program, scans: 100, step_ms_max: 20 };
        judge.judge(&mut SplitMix64(3)).unwrap();
        assert!(text(&program).contains(&format!("<expression>{name}</expression>")), "{name}");
    }
}

#[test]
fn a_calculated_whole_number_becomes_a_real_and_no_long_real() {
    let tags = "num = { type = \"int\" }\nratio = { type = \"real\" }";
    for formula in ["2 * 3", "num * 0", "7 - 2 * 3"] {
        let rung = format!("{{ when = [\"X0\"], do = [\"MATH ratio = {formula}\"] }}");
        let text = text(&program(tags, &format!("rung = [{rung}]")));
        assert!(text.contains("typeName=\"DINT_TO_REAL\""), "{formula}: {text}");
        assert!(!text.contains("LREAL"), "{formula}: {text}");
    }
}

#[test]
fn a_calculation_of_constants_alone_keeps_its_type() {
    let tags = "small = { type = \"word\" }\nnum = { type = \"int\" }";
    for formula in
        ["-(27)", "if(X1, -1, 2)", "max(-3, min(5, 70000))", "(33 - 7) * 3 - 2000000000 * 2"]
    {
        let rung =
            |name: &str| format!("{{ when = [\"X0\"], do = [\"MATH {name} = {formula}\"] }}");
        let program = program(tags, &format!("rung = [{}, {}]", rung("small"), rung("num")));
        let judge = Judge { name: formula, program: &program, scans: 50, step_ms_max: 20 };
        judge.judge(&mut SplitMix64(7)).unwrap();
    }
}

#[test]
fn a_program_called_as_a_block_of_the_library_gets_a_name_of_its_own() {
    let tags = "wait = { type = \"timer\" }";
    let rungs = "rung = [{ when = [\"X0\"], do = [\"TMR wait preset=1s\"] }, \
                 { when = [\"wait.Done\"], do = [\"OUT Y0\"] }]";
    let mut program = program(tags, rungs);
    program.name = "Rungd_TMR".to_owned();
    let text = text(&program);
    assert_eq!(text.matches("<pou name=\"Rungd_TMR\"").count(), 1, "{text}");
    assert!(text.contains("<pou name=\"Rungd_TMR_2\" pouType=\"program\">"), "{text}");
    assert!(text.contains("typeName=\"Rungd_TMR_2\"/>"), "{text}");
    let judge = Judge { name: "Rungd_TMR", program: &program, scans: 100, step_ms_max: 400 };
    judge.judge(&mut SplitMix64(5)).unwrap();
}

#[test]
fn signs_that_xml_does_not_allow_are_not_in_the_file() {
    let tags = "lamp = { at = \"Y0\", doc = \"a\u{fffe}b\u{ffff}c\" }";
    let text = text(&program(tags, "rung = [{ when = [\"X0\"], do = [\"OUT lamp\"] }]"));
    assert!(text.contains("<xhtml:p>a\u{fffd}b\u{fffd}c</xhtml:p>"), "{text}");
}
