//! Tests with very large generated files: they count the work of a load for each finding, and check
//! the length of its messages. No test here measures time: `growth` and `benches/check.py` do.

use crate::load::{InputFile, Loaded, ladder_inputs, recorded_files};
use rungd_language::source::finding::Code;
use rungd_language::source::nearest::counted;
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::SourceFile;

const MAIN: &str = "[[program]]\nname = \"Main\"\n";

fn load(text: &str) -> Loaded {
    ladder_inputs(&[InputFile { path: "ladder.toml".into(), bytes: text.into() }]).unwrap()
}

/// Loads a controller file of a ladder, without its key `ladder`.
fn controlled(controller: &str, ladder: &str) -> Loaded {
    let controller = format!("ladder = [\"ladder.toml\"]\n{controller}");
    let file = |name: &str, text: &str| SourceFile { name: name.into(), text: text.into() };
    recorded_files(&[file("controller.toml", &controller), file("ladder.toml", ladder)])
}

fn shown(loaded: &Loaded) -> String {
    render(&loaded.findings, &loaded.files, Style::default())
}

fn rungs(n: usize, rung: impl Fn(usize) -> String) -> String {
    (0..n).map(|k| format!("[[program.rung]]\n{}\n", rung(k))).collect()
}

fn many(n: usize, entry: impl Fn(usize) -> String) -> String {
    (0..n).map(entry).collect()
}

fn list(n: usize, entry: impl Fn(usize) -> String) -> String {
    (0..n).map(entry).collect::<Vec<_>>().join(", ")
}

fn tags(n: usize) -> String {
    (0..n).map(|k| format!("tag_number_{k} = {{ at = \"C0\", spare = true }}\n")).collect()
}

/// The number of edit distances that the load computes, and the number for showing its findings.
#[track_caller]
fn distances(text: &str, code: Code) -> (usize, usize) {
    distances_of(|| load(text), code)
}

#[track_caller]
fn distances_of(load: impl Fn() -> Loaded, code: Code) -> (usize, usize) {
    counted::take();
    let loaded = load();
    let of_code = loaded.findings.iter().filter(|finding| finding.code == code).count();
    assert!(of_code >= 300, "{of_code} of {code:?}");
    let by_load = counted::take();
    assert!(shown(&loaded).contains("did you mean"), "{}", shown(&loaded));
    counted::take();
    shown(&loaded);
    (by_load, counted::take())
}

/// Checks that the load computes no distance, and that showing computes some, but at most `most`.
#[track_caller]
fn looked_up(text: &str, code: Code, most: usize) {
    looked_up_in(|| load(text), code, most);
}

#[track_caller]
fn looked_up_in(load: impl Fn() -> Loaded, code: Code, most: usize) {
    let (by_load, by_showing) = distances_of(load, code);
    assert!(by_load == 0 && (1..=most).contains(&by_showing), "{by_load}, {by_showing}");
}

#[test]
fn the_nearest_name_is_searched_only_for_shown_findings() {
    let unknown = rungs(400, |k| format!("when = [\"tga_number_{k}\"]\ndo = [\"STOP\"]"));
    let text = format!("[tags]\n{}{MAIN}{unknown}", tags(300));
    looked_up(&text, Code::UnknownName, 100 * 301);

    let blocks: String = (0..300).map(|k| format!("[[task]]\nname = \"Task-{k}\"\n")).collect();
    let unknown = rungs(400, |k| format!("when = [\"X0\"]\ndo = [\"ENTASK Tsak-{k}\"]"));
    let text = format!("{MAIN}{unknown}{blocks}");
    looked_up(&text, Code::UnknownBlock, 100 * 301);

    let stages = |body: &str| -> String {
        let stage = |k: usize| {
            let rung = format!("{{ when = [\"X0\"], do = [\"{body}{k}\"] }}");
            format!("[[program.stage]]\nname = \"Stage-{k}\"\nrung = [{rung}]\n")
        };
        (0..300).map(stage).collect()
    };
    let text = format!("{MAIN}{}", stages("JMP Satge-"));
    looked_up(&text, Code::UnknownStage, 100 * 300);

    let unknown = rungs(400, |k| format!("when = [\"Main.Satge-{k}\"]\ndo = [\"STOP\"]"));
    let text = format!("{MAIN}{unknown}{}", stages("JMP Stage-"));
    looked_up(&text, Code::UnknownStage, 100 * 301);

    let unknown = rungs(400, |_| "when = [\"X0\"]\ndo = [\"OUTT C1\"]".to_owned());
    let (by_load, by_showing) = distances(&format!("{MAIN}{unknown}"), Code::UnknownInstruction);
    assert!(by_load == 0 && by_showing > 0, "{by_load}, {by_showing}");
}

const USED: &str = "rung = [{ use = \"T\", name = \"u\" }]\n";

#[test]
fn the_nearest_name_in_a_template_is_searched_only_for_shown_findings() {
    let own = many(300, |k| format!("tag_number_{k} = {{ type = \"bit\", spare = true }}\n"));
    let rungs =
        many(400, |k| format!("[[template.rung]]\nwhen = [\"tga_number_{k}\"]\ndo = [\"STOP\"]\n"));
    let template = format!("[[template]]\nname = \"T\"\n[template.tags]\n{own}{rungs}");
    looked_up(&format!("{template}{MAIN}{USED}"), Code::UnknownName, 100 * 301);

    let parameters = many(300, |k| format!("par_number_{k} = {{ type = \"bit\" }}\n"));
    let rung = "rung = [{ when = [\"X0\"], do = [\"STOP\"] }]";
    let template =
        format!("[[template]]\nname = \"T\"\n{rung}\n[template.parameters]\n{parameters}");
    let with = many(400, |k| format!("pra_number_{k} = \"X0\", "));
    let with = with.trim_end_matches(", ");
    let used = format!("rung = [{{ use = \"T\", name = \"u\", with = {{ {with} }} }}]\n");
    looked_up(&format!("{template}{MAIN}{used}"), Code::TemplateArgument, 100 * 300);
}

#[test]
fn the_nearest_name_of_a_setting_is_searched_only_for_shown_findings() {
    let parts = list(300, |k| {
        let keys = format!("kind = \"motor\", name = \"motor_number_{k}\"");
        format!("{{ {keys}, run = \"motor_number_0.running\" }}")
    });
    let rows = list(400, |k| format!("{{ from = \"Y0\", to = \"mtoor_number_{k}.run\" }}"));
    let plant = format!(
        "[[device]]\nname = \"plant\"\ndriver = \"simulated\"\npart = [{parts}]\nmap = [{rows}]\n"
    );
    let ladder = format!("{MAIN}rung = [{{ when = [\"X0\"], do = [\"OUT Y0\"] }}]\n");
    looked_up_in(|| controlled(&plant, &ladder), Code::UnknownName, 100 * 300);

    let unknown = list(400, |k| format!("\"tga_number_{k}\""));
    let retain = format!("[retain]\ntags = [{unknown}]\n");
    let ladder = format!("[tags]\n{}{ladder}", tags(300));
    looked_up_in(|| controlled(&retain, &ladder), Code::UnknownName, 100 * 300);
    let rules = many(400, |k| {
        format!("[[simulated-device]]\ninput = \"X{k}\"\nfollows = \"tga_number_{k}\"\n")
    });
    looked_up_in(|| controlled(&rules, &ladder), Code::UnknownName, 100 * 301);
}

/// The points of a map are held in memory one by one, so their number has a limit.
#[test]
fn the_number_of_points_of_a_device_is_limited() {
    let row = "{ from = \"coil 0..65535\", to = \"X0..X65535\" }";
    let said = |rows: usize| {
        let rows = vec![row; rows].join(", ");
        let keys = "driver = \"modbus-tcp\"\naddress = \"127.0.0.1:502\"";
        let device = format!("[[device]]\nname = \"rio\"\n{keys}\nmap = [{rows}]\n");
        let text = format!("[memory]\nX = 65536\n{device}");
        let loaded = controlled(&text, &format!("{MAIN}rung = []\n"));
        let of_points =
            loaded.findings.iter().filter(|finding| finding.message.contains(" points"));
        of_points.map(|finding| finding.message.clone()).collect::<Vec<_>>()
    };
    assert!(said(1).is_empty());
    assert_eq!(said(5_000), ["a device has at most 65536 points"]);
}

#[test]
fn the_printed_findings_do_not_grow_with_a_long_name() {
    let name = "n".repeat(200_000);
    let dashes = format!("n{}", "-".repeat(200_000));
    let nines = "9".repeat(200_000);
    let rung = |when: &str, body: &str| {
        format!("{MAIN}[[program.rung]]\nwhen = [\"{when}\"]\ndo = [\"{body}\"]\n")
    };
    for text in [
        rung(&name, "OUT C0"),
        rung(&dashes, "OUT C0"),
        rung(&format!("D0 > {nines}"), "OUT C0"),
        rung(&format!("X0{}", " & X0 | X1".repeat(20_000)), "OUT C0"),
        rung("X0", &format!("{name} C0")),
        rung("X0", &format!("OUT {name}")),
        rung("X0", &format!("TMR T0 preset=1s {name}=3")),
        rung("X0", &format!("TMR T0{}", " preset=1s".repeat(10_000))),
        rung("X0", &format!("OUT{}", " C0".repeat(10_000))),
        rung("X0", &format!("JMP {name}")),
        rung("X0", &format!("RUN {name}")),
        format!("{name} = 3\n{MAIN}"),
        format!("[tags]\n{name} = {{ at = \"C0\" }}\n{MAIN}"),
        format!("[tags]\na = {{ at = \"{name}\" }}\n{MAIN}"),
        format!("[tags]\n{name} = {{ at = \"{name}\" }}\n{MAIN}"),
        format!("[ladder]\nallow = [\"{name}\"]\norder = [\"{name}\"]\n{MAIN}"),
        format!("{MAIN}[[task]]\nname = \"{name}\"\n"),
        format!("{MAIN}[[program]]\nname = \"P\"\n[[program.stage]]\nname = \"{name}\"\n"),
        format!("{MAIN}rung = [{{ name = \"{name}\", when = [\"X0\"], do = [\"STOP\"] }}]\n"),
        format!("{MAIN}rung = [{{ name = \"É {name}\", when = [\"X0\"], do = [\"STOP\"] }}]\n"),
    ] {
        let said = shown(&load(&text));
        let head: String = text.chars().take(90).collect();
        assert!(said.len() < 40_000 && said.len() > 60, "{} bytes: {head}", said.len());
    }
}

/// Tokens and trees take many times the memory of their text, so the text has a limit.
#[test]
fn the_length_of_contacts_and_instructions_is_limited() {
    const MOST: usize = 64 * 1024;
    let rung = |when: &str, body: &str| {
        load(&format!("{MAIN}[[program.rung]]\nwhen = [\"{when}\"]\ndo = [\"{body}\"]\n"))
    };
    let fits = |head: &str| format!("{head}{}", " ".repeat(MOST - head.len()));
    assert!(rung(&fits("X0"), &fits("OUT Y0")).findings.is_empty());
    for (when, body, code) in [
        (format!("{} ", fits("X0")), "OUT Y0".to_owned(), Code::ContactSyntax),
        (
            format!("{}a{}", "(".repeat(MOST), ")".repeat(MOST)),
            "OUT Y0".into(),
            Code::ContactSyntax,
        ),
        ("rise(".repeat(MOST), "OUT Y0".to_owned(), Code::ContactSyntax),
        ("b".repeat(2 * MOST), "OUT Y0".to_owned(), Code::ContactSyntax),
        ("X0".to_owned(), format!("{} ", fits("OUT Y0")), Code::InstructionSyntax),
        ("X0".to_owned(), "a,".repeat(MOST), Code::InstructionSyntax),
    ] {
        let loaded = rung(&when, &body);
        let [finding] = &loaded.findings[..] else { panic!("{}", shown(&loaded)) };
        assert_eq!(finding.code, code);
        assert!(finding.message.contains("65536 bytes"), "{}", finding.message);
        assert!(shown(&loaded).contains("ladder.toml:"), "{}", shown(&loaded));
    }
}

/// Each element of a whole array in a formula becomes a step, so their number has a limit.
#[test]
fn the_total_size_of_arrays_in_formulas_is_limited() {
    let head = format!("[tags]\na = {{ type = \"int\", count = 4000 }}\n{MAIN}");
    let math = |sums: usize| {
        let sum = vec!["sum(a)"; sums].join(" + ");
        format!("when = [\"$On\"]\ndo = [\"MATH D0 = {sum}\"]")
    };
    let sums = [100, 150, 1, 5000];
    let loaded = load(&format!("{head}{}", rungs(sums.len(), |k| math(sums[k]))));
    let [finding] = &loaded.findings[..] else { panic!("{}", shown(&loaded)) };
    assert!(loaded.program.is_none() && finding.code == Code::FunctionArguments);
    assert!(finding.message.contains("1000000 elements"), "{}", finding.message);
    // The finding is in the third rung, because the first two rungs fit exactly.
    assert!(shown(&loaded).contains("ladder.toml:13:"), "{}", shown(&loaded));
}

#[test]
fn names_longer_than_128_characters_are_refused() {
    let fits = "n".repeat(128);
    let tag =
        |name: &str| load(&format!("[tags]\n{name} = {{ at = \"C0\", spare = true }}\n{MAIN}"));
    assert!(tag(&fits).findings.is_empty(), "{}", shown(&tag(&fits)));
    let long = tag(&format!("{fits}n"));
    assert!(long.program.is_none() && long.findings[0].code == Code::ForbiddenName);
    assert!(shown(&long).contains("at most 128"), "{}", shown(&long));
    // The uses of the tag cause no further findings.
    let name = format!("{fits}n");
    let used = load(&format!(
        "[tags]\n{name} = {{ at = \"C0\" }}\n{MAIN}{}",
        rungs(3, |_| format!("when = [\"X0\"]\ndo = [\"SET {name}\", \"RST {name}\"]"))
    ));
    assert_eq!(used.findings.len(), 1, "{}", shown(&used));
}

#[test]
fn control_characters_and_windows_line_endings_do_not_reach_the_terminal() {
    let text = "[tags]\r\n\"a\\u001b[31m\" = { at = \"C0\" }\r\n[[program]]\r\nname = \"Main\"\r\n\
                [[program.rung]]\r\nleg.up = [\"X0\"]\r\nleg.reset = [\r\n  \"X1\",\r\n]\r\n\
                do = [\"CNT CT0 preset=3\"]\r\n";
    let loaded = load(text);
    let said = shown(&loaded);
    assert!(!said.contains('\u{1b}') && !said.contains('\r'), "{said:?}");
    assert!(said.contains("\\u{1b}"), "{said}");
    assert!(said.contains("write `leg.rst = [\n"), "{said}");
}

#[test]
fn an_unreadable_ladder_gives_one_finding() {
    let text = "ladder = [\"no-such-file.toml\"]\n\
                [outputs]\non = [\"lamp\"]\n\
                [retain]\nranges = [\"recipe\", \"part.Acc\", \"a..b\"]\n\
                [modbus-server]\nwritable = [\"lamp\", \"recipe\"]\n\
                [[simulated-device]]\ninput = \"start\"\nfollows = \"lamp\"\n\
                [[device]]\nname = \"rio\"\ndriver = \"modbus-tcp\"\naddress = \"127.0.0.1:502\"\n\
                map = [{ from = \"coil 1\", to = \"eye\" }, { from = \"lamp\", to = \"coil 2\" }]\n\
                [[device]]\nname = \"plant\"\ndriver = \"simulated\"\n\
                part = [{ kind = \"motor\", name = \"drive\" }]\n\
                map = [{ from = \"lamp\", to = \"drive.run\" }]\n";
    let input = InputFile { path: "controller.toml".into(), bytes: text.into() };
    let loaded = crate::load::controller_input(&input);
    assert_eq!(loaded.findings.len(), 1, "{}", shown(&loaded));
}
