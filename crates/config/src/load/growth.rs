//! Tests with large generated files: eight times as many entries cost about eight times the work.
//!
//! The measure is the processor time of the thread, for a load and for showing its findings. The
//! margin is wide. `large` counts the work for findings instead.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use crate::load::{Loaded, recorded_files};
use rungd_language::source::finding::Code;
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::SourceFile;

/// The smaller number of entries, and the factor from the smaller to the larger number.
const SIZE: usize = 600;
const TIMES: usize = 8;
/// The maximum ratio of the costs. For work that grows with the square of the size, it is 64.
const RATIO_MAX: u32 = 20;

const MEMORY: &str = "[memory]\nX = 65536\nY = 65536\nC = 65536\nD = 65536\n";
const MAIN: &str = "[[program]]\nname = \"Main\"\n";
const RUNG: &str = "rung = [{ when = [\"X0\"], do = [\"SET C0\", \"RST C0\"] }]\n";

/// A controller file without its ladder, and the ladder.
type Texts = (String, String);

/// A case: its name, the code of its findings, and its texts with a number of entries. There is
/// about one finding for each entry; `None`: there is none at all.
type Case = (&'static str, Option<Code>, fn(usize) -> Texts);

fn many(n: usize, entry: impl Fn(usize) -> String) -> String {
    (0..n).map(entry).collect()
}

fn list(n: usize, entry: impl Fn(usize) -> String) -> String {
    (0..n).map(entry).collect::<Vec<_>>().join(", ")
}

fn rungs(n: usize, rung: impl Fn(usize) -> String) -> String {
    many(n, |k| format!("[[program.rung]]\n{}\n", rung(k)))
}

fn tags(n: usize) -> String {
    let tag = |k: usize| format!("tag_number_{k} = {{ at = \"D{}\", spare = true }}\n", k % 4096);
    format!("[tags]\n{}", many(n, tag))
}

/// A device with these keys and one row for each entry.
fn device(n: usize, keys: &str, row: impl Fn(usize) -> String) -> String {
    format!("[[device]]\nname = \"rio\"\n{keys}\nmap = [{}]\n", list(n, row))
}

/// `[retain] tags` with these names, beside tags `tag_number_0`, `tag_number_1` ….
fn retain(n: usize, name: &str) -> Texts {
    let names = list(n, |k| format!("\"{name}_{k}\""));
    (format!("[retain]\ntags = [{names}]\n"), format!("{}{MAIN}{RUNG}", tags(n)))
}

/// A template with parameters `par_number_0`, `par_number_1` ….
fn template(n: usize) -> String {
    let parameters = many(n, |k| format!("par_number_{k} = {{ type = \"bit\" }}\n"));
    format!("[[template]]\nname = \"T\"\n{RUNG}[template.parameters]\n{parameters}")
}

/// A use of a template with these arguments.
fn used(n: usize, template: &str, argument: &str) -> Texts {
    let with = list(n, |k| format!("{argument}_{k} = \"X0\""));
    let used = format!("rung = [{{ use = \"T\", name = \"u\", with = {{ {with} }} }}]\n");
    (MEMORY.to_owned(), format!("{template}{MAIN}{used}"))
}

fn files(controller: &str, ladder: String) -> Vec<SourceFile> {
    let controller = format!("ladder = [\"ladder.toml\"]\n{controller}");
    let file = |name: &str, text| SourceFile { name: name.to_owned(), text };
    vec![file("controller.toml", controller), file("ladder.toml", ladder)]
}

/// The processor time of this thread so far, which other processes do not lengthen.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// A load of these files, and its cost.
fn load(files: &[SourceFile]) -> (Loaded, Duration) {
    let begin = processor_time();
    let loaded = recorded_files(files);
    let _ = render(&loaded.findings, &loaded.files, Style::default());
    (loaded, processor_time() - begin)
}

/// The costs of a case, if that of the larger text is out of proportion.
fn out_of_proportion(name: &str, code: Option<Code>, texts: fn(usize) -> Texts) -> Option<String> {
    let load_of = |size| {
        let (controller, ladder) = texts(size);
        load(&files(&controller, ladder))
    };
    let (loaded, small) = load_of(SIZE);
    let said = || render(&loaded.findings, &loaded.files, Style::default());
    match code {
        None => assert!(loaded.findings.is_empty(), "{name}: {}", said()),
        Some(code) => {
            let of_code = loaded.findings.iter().filter(|finding| finding.code == code);
            assert!(of_code.count() >= SIZE - 1, "{name}: {}", said());
        }
    }
    let (_, large) = load_of(TIMES * SIZE);
    (large > small * RATIO_MAX).then(|| format!("{name}: {small:?}, {large:?}"))
}

fn assert_in_proportion(cases: &[Case]) {
    let mut wrong = Vec::new();
    for (name, code, texts) in cases {
        // A real excess occurs in each of three tries. A busy machine, whose caches other programs
        // empty, may cause it in one of them.
        let tries: Vec<_> = (0..3).map_while(|_| out_of_proportion(name, *code, *texts)).collect();
        wrong.extend((tries.len() == 3).then(|| tries.join("\n")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_cost_of_retentive_memory_is_proportional_to_its_settings() {
    assert_in_proportion(&[
        ("tags", None, |n| retain(n, "tag_number")),
        ("unknown tags", Some(Code::UnknownName), |n| retain(n, "tga_number")),
        ("one array again and again", None, |n| {
            let names = list(n, |_| "\"a\"".to_owned());
            let array = "[tags]\na = { at = \"D0\", count = 4096, spare = true }\n";
            (format!("[retain]\ntags = [{names}]\n"), format!("{array}{MAIN}{RUNG}"))
        }),
        ("ranges beside reads", Some(Code::NeverWritten), |n| {
            let ranges = list(n, |k| format!("\"C{k}\""));
            let read = |k: usize| format!("when = [\"D{k} > 0\"]\ndo = [\"STOP\"]");
            let ladder = format!("{MAIN}{}", rungs(n, read));
            (format!("{MEMORY}[retain]\nranges = [{ranges}]\n"), ladder)
        }),
        ("one range again and again", None, |n| {
            let ranges = list(n, |_| "\"D0..D65535\"".to_owned());
            let ladder = format!("{MAIN}{RUNG}");
            (format!("{MEMORY}[retain]\nranges = [{ranges}]\n"), ladder)
        }),
    ]);
}

#[test]
fn the_cost_of_settings_is_proportional_to_their_number() {
    assert_in_proportion(&[
        ("outputs that are held", Some(Code::HeldButReset), |n| {
            let [on, hold] =
                [0, 20_000].map(|first: usize| list(n, |k| format!("\"Y{}\"", first + k)));
            let out = |k: usize| format!("when = [\"X0\"]\ndo = [\"OUT Y{}\"]", 20_000 + k);
            let controller = format!("{MEMORY}[outputs]\non = [{on}]\nhold = [{hold}]\n");
            (controller, format!("{MAIN}{}", rungs(n, out)))
        }),
        ("simulated inputs", Some(Code::UnknownName), |n| {
            let rule = |k: usize| format!("input = \"X{k}\"\nfollows = \"tga_number_{k}\"\n");
            let rules = many(n, |k| format!("[[simulated-device]]\n{}", rule(k)));
            (format!("{MEMORY}{rules}"), format!("{}{MAIN}{RUNG}", tags(n)))
        }),
        ("the map of the Modbus server", None, |n| {
            let entry = |k: usize| {
                format!("operand = \"D{k}\"\ntable = \"holding\"\naddress = {}\n", 2 * k)
            };
            let map = many(n, |k| format!("[[modbus-server.map]]\n{}", entry(k)));
            let writable = list(n, |k| format!("\"D{k}\""));
            let server = format!("standard-map = false\nwritable = [{writable}]\n{map}");
            (format!("{MEMORY}[modbus-server]\n{server}"), format!("{MAIN}{RUNG}"))
        }),
        ("lines that are watched", Some(Code::UnknownName), |n| {
            let line = |k: usize| format!("!(C{k} & tga_number_{k}) | was(C{k})");
            let watch = |k| format!("[[watch]]\nname = \"w{k}\"\nalways = \"{}\"\n", line(k));
            (format!("{MEMORY}{}", many(n, watch)), format!("{}{MAIN}{RUNG}", tags(n)))
        }),
        ("panels", Some(Code::UnknownName), |n| {
            let write = list(n, |k| format!("\"C{k}\""));
            let show =
                |k: usize| format!("{{ button = \"C{k}\" }}, {{ lamp = \"tga_number_{k}\" }}");
            let panels = many(n, |k| format!("[[panel]]\nname = \"p{k}\"\nshow = [{}]\n", show(k)));
            let ladder = format!("{}{MAIN}{RUNG}", tags(n));
            (format!("{MEMORY}[web]\nwrite = [{write}]\n{panels}"), ladder)
        }),
    ]);
}

#[test]
fn the_cost_of_devices_is_proportional_to_their_number() {
    assert_in_proportion(&[
        ("points of a plant", Some(Code::UnknownName), |n| {
            let part = |k: usize| {
                let driven = "run = \"motor_number_0.running\"";
                format!("{{ kind = \"motor\", name = \"motor_number_{k}\", {driven} }}")
            };
            let keys = format!("driver = \"simulated\"\npart = [{}]", list(n, part));
            let row = |k: usize| format!("{{ from = \"Y0\", to = \"mtoor_number_{k}.run\" }}");
            (device(n, &keys, row), format!("{MAIN}{RUNG}"))
        }),
        ("lines of a chip", None, |n| {
            let row = |k: usize| format!("{{ from = \"line {k}\", to = \"X{k}\" }}");
            let keys = "driver = \"gpio\"\nchip = \"/dev/gpiochip0\"";
            (format!("{MEMORY}{}", device(n, keys, row)), format!("{MAIN}{RUNG}"))
        }),
        ("outputs of a peer", Some(Code::OutputUnmapped), |n| {
            let row = |k: usize| format!("{{ from = \"Y{k}\", to = \"coil {k}\" }}");
            let keys = "driver = \"modbus-tcp\"\naddress = \"127.0.0.1:502\"";
            let out = |k: usize| format!("when = [\"X0\"]\ndo = [\"OUT Y{}\"]", 20_000 + k);
            let ladder = format!("{MAIN}{}", rungs(n, out));
            (format!("{MEMORY}{}", device(n, keys, row)), ladder)
        }),
        ("one coil again and again", Some(Code::Controller), |n| {
            let row = |k: usize| format!("{{ from = \"Y{k}\", to = \"coil 0\" }}");
            let keys = "driver = \"modbus-tcp\"\naddress = \"127.0.0.1:502\"";
            (format!("{MEMORY}{}", device(n, keys, row)), format!("{MAIN}{RUNG}"))
        }),
        ("devices on a serial line", Some(Code::Controller), |n| {
            let device = |k: usize| {
                let keys = "driver = \"modbus-rtu\"\nport = \"/dev/ttyUSB0\"";
                let map = format!("map = [{{ from = \"coil 0\", to = \"X{k}\" }}]");
                format!("[[device]]\nname = \"rio_{k}\"\n{keys}\n{map}\n")
            };
            (format!("{MEMORY}{}", many(n, device)), format!("{MAIN}{RUNG}"))
        }),
    ]);
}

#[test]
fn the_cost_of_templates_is_proportional_to_their_number() {
    assert_in_proportion(&[
        ("unknown arguments", Some(Code::TemplateArgument), |n| {
            used(n, &template(n), "pra_number")
        }),
        ("arguments and words in braces", Some(Code::TemplateRule), |n| {
            let own = many(n, |k| {
                let doc = format!("doc = \"{{par_number_{k}}} of {{nmae}}\"");
                format!("own_{k} = {{ type = \"bit\", spare = true, {doc} }}\n")
            });
            used(n, &format!("{}[template.tags]\n{own}", template(n)), "par_number")
        }),
        ("own tags and unknown names", Some(Code::UnknownName), |n| {
            let own = many(n, |k| format!("tag_number_{k} = {{ type = \"bit\", spare = true }}\n"));
            let rung = |k: usize| format!("when = [\"tga_number_{k}\"]\ndo = [\"STOP\"]");
            let rungs = many(n, |k| format!("[[template.rung]]\n{}\n", rung(k)));
            let template = format!("[[template]]\nname = \"T\"\n[template.tags]\n{own}{rungs}");
            let used = format!("{MAIN}rung = [{{ use = \"T\", name = \"u\" }}]\n");
            (MEMORY.to_owned(), format!("{template}{used}"))
        }),
    ]);
}

#[test]
fn the_cost_of_the_rules_is_proportional_to_the_program() {
    assert_in_proportion(&[
        ("elements of arrays", Some(Code::MixedAndOr), |n| {
            let array = |k: usize| {
                format!("a{k} = {{ at = \"C{}\", count = 2, initial = false }}\n", k % 999)
            };
            let rung = |k: usize| format!("when = [\"a{k}[i] & X1 | X2\"]\ndo = [\"STOP\"]");
            let tags = format!("[tags]\ni = {{ at = \"D0\", initial = 0 }}\n{}", many(n, array));
            (String::new(), format!("{tags}{MAIN}{}", rungs(n, rung)))
        }),
        ("jumps back", Some(Code::OutLostOnJumpBack), |n| {
            let stage = |k: usize| {
                let (back, on) = (k.saturating_sub(1), if k + 1 < n { k + 1 } else { 0 });
                let outs = format!("\"OUT C{k}\", \"OUT C{}\"", k + 1);
                let jumps = format!("\"JMP S{back}\", \"JMP S{on}\"");
                let rung = format!("{{ when = [\"X0\"], do = [{outs}, {jumps}] }}");
                format!("[[program.stage]]\nname = \"S{k}\"\nrung = [{rung}]\n")
            };
            let main = format!("{MAIN}rung = [{{ when = [\"X0\"], do = [\"RUN P\"] }}]\n");
            let stages = many(n, stage);
            (MEMORY.to_owned(), format!("{main}[[program]]\nname = \"P\"\n{stages}"))
        }),
        ("branches of a rung that allows them", None, |n| {
            let allow = list(n, |_| "\"mixed-and-or\"".to_owned());
            let branch = |k: usize| format!("when = [\"X1 & X2 | X3\"]\ndo = [\"OUT C{k}\"]\n");
            let branches = many(n, |k| format!("[[program.rung.branch]]\n{}", branch(k)));
            let rung = format!("[[program.rung]]\nallow = [{allow}]\nwhen = [\"X0\"]\n{branches}");
            (MEMORY.to_owned(), format!("{MAIN}{rung}"))
        }),
        ("branches of a rung with one coil", Some(Code::DuplicateOut), |n| {
            let branch = "[[program.rung.branch]]\nwhen = [\"X1\"]\ndo = [\"OUT C0\"]\n";
            let rung = format!("[[program.rung]]\nwhen = [\"X0\"]\n{}", branch.repeat(n));
            (String::new(), format!("{MAIN}{rung}"))
        }),
    ]);
}

/// Each pattern with `*` is compared with all tags, so their number has a limit.
#[test]
fn too_many_patterns_give_one_finding() {
    let load = |patterns: usize| {
        let patterns = list(patterns, |k| format!("\"*_number_{k}\""));
        let controller = format!("[retain]\ntags = [\"tag_number_0\", {patterns}]\n");
        load(&files(&controller, format!("{}{MAIN}{RUNG}", tags(20_000)))).0
    };
    let loaded = load(5_001);
    let [finding] = &loaded.findings[..] else { panic!("{:?}", loaded.findings.len()) };
    assert_eq!(finding.code, Code::Controller);
    let message = "more than 5,000 patterns with `*`, the maximum for 20,000 tags";
    assert_eq!(finding.message, message);
    let loaded = load(3);
    assert!(loaded.findings.is_empty());
    let retained = loaded.controller.map_or(Vec::new(), |controller| controller.retain);
    assert_eq!(retained.len(), 3, "each tag is there once");
}
