//! Templates whose expansion exceeds any memory: nested ten thousand deep, in circles, with
//! contacts and arrays that grow. All end in findings. The time for this is compared with that of a
//! plain ladder.

use std::fmt::Write as _;
use std::time::Duration;

use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::finding::Code;
use rungd_language::source::span::SourceFile;
use rustix::time::{ClockId, clock_gettime};

const MANY: usize = 10_000;

/// A ladder with `count` templates and a Main. `rung` gives the rung of the template with this
/// number; `main` has the rungs of Main.
fn ladder(count: usize, rung: impl Fn(usize) -> String, main: &str) -> String {
    let mut text = String::new();
    for at in 0..count {
        let _ = writeln!(text, "[[template]]\nname = \"N{at}\"\nrung = [ {} ]", rung(at));
    }
    let _ = writeln!(text, "[[program]]\nname = \"Main\"\nrung = [ {main} ]");
    text
}

const PLAIN: &str = "{ when = [\"X0\"], do = [\"SET Y0\"] }";

/// The processor time of this thread so far, which other processes do not lengthen.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Loads a ladder: the names of its errors, each once, and the processor time.
fn load(text: String) -> (Vec<Code>, Duration) {
    let files = [SourceFile { name: "deep.toml".to_owned(), text }];
    let begin = processor_time();
    let (_, findings) = load_ladders(&files, &LoadOptions::default());
    let time = processor_time() - begin;
    let mut codes: Vec<Code> = findings.iter().map(|finding| finding.code).collect();
    codes.retain(|code| *code != Code::UnusedTemplate);
    codes.dedup();
    (codes, time)
}

/// A use of the template with this number.
fn uses(at: usize) -> String {
    format!("{{ use = \"N{at}\", name = \"a\" }}")
}

#[test]
fn ten_thousand_nested_templates_give_a_finding_quickly() {
    let plain = format!("{PLAIN}, {{ use = \"N999\", name = \"u\" }}");
    let (codes, control) = load(ladder(MANY / 10, |_| PLAIN.to_owned(), &plain));
    assert_eq!(codes, []);
    let main = uses(MANY - 1);
    let nested = |at: usize| if at == 0 { PLAIN.to_owned() } else { uses(at - 1) };
    let circle = |at: usize| uses((at + 1) % MANY);
    let own = uses;
    for (how, text, wanted) in [
        ("nested", ladder(MANY, nested, &main), Code::TemplateSize),
        ("in a circle", ladder(MANY, circle, &main), Code::TemplateRecursion),
        ("each in itself", ladder(MANY, own, &main), Code::TemplateRecursion),
    ] {
        let (codes, time) = load(text);
        assert_eq!(codes, [wanted], "{how}");
        assert!(time < 50 * control + Duration::from_secs(2), "{how}: {time:?}, {control:?}");
    }
}

#[test]
fn exponential_template_growth_gives_a_finding() {
    let grows = |kind: &str, given: &str, body: &str| {
        let mut text = String::new();
        for at in 0..30 {
            let rung = match at {
                0 => body.to_owned(),
                _ => format!(
                    "{{ use = \"N{}\", name = \"a\", with = {{ p = \"{given}\" }} }}",
                    at - 1
                ),
            };
            let _ = writeln!(
                text,
                "[[template]]\nname = \"N{at}\"\nrung = [ {rung} ]\n[template.parameters]\n\
                 p = {{ type = \"{kind}\" }}\n[template.tags]\nown = {{ type = \"bit\", count = 4096 }}"
            );
        }
        text + "[[program]]\nname = \"Main\"\nrung = [ { use = \"N29\", name = \"u\", with = { p = \"X0\" } } ]\n"
    };
    let begin = processor_time();
    for (text, wanted) in [
        // A contact that doubles its length with each template.
        (grows("contact", "p | !p", "{ when = [\"p\"], do = [\"SET Y0\"] }"), Code::TemplateSize),
        (
            grows("contact", "!(!(!(!(!(!(p))))))", "{ when = [\"p\"], do = [\"SET Y0\"] }"),
            Code::TemplateSize,
        ),
        // 30 arrays of 4096 bits exceed the memory of C.
        (grows("bit", "p", "{ when = [\"p\"], do = [\"SET own[0]\"] }"), Code::MemoryFull),
    ] {
        let (codes, _) = load(text);
        assert!(codes.contains(&wanted), "{codes:?} without {wanted:?}");
    }
    assert!(processor_time() - begin < Duration::from_secs(60));
}

#[test]
fn the_qualified_name_of_a_use_is_limited() {
    let nested = |at: usize| match at {
        0 => PLAIN.to_owned(),
        _ => format!("{{ use = \"N{}\", name = \"{}\" }}", at - 1, "n".repeat(100)),
    };
    let main =
        |at: usize| format!("{PLAIN}, {{ use = \"N{at}\", name = \"{}\" }}", "n".repeat(100));
    assert_eq!(load(ladder(5, nested, &main(4))).0, []);
    assert_eq!(load(ladder(6, nested, &main(5))).0, [Code::TemplateSize]);
}

/// Each use contains the names in its `allow` again in each of its rungs.
#[test]
fn the_size_of_an_allow_copied_to_each_rung_is_limited() {
    let names = vec!["\"mixed-and-or\""; 4_000].join(", ");
    let rungs = vec![PLAIN; 2_000].join(", ");
    let used = format!("{{ use = \"N0\", name = \"u\", allow = [{names}] }}");
    let (codes, _) = load(ladder(1, |_| rungs.clone(), &used));
    assert_eq!(codes, [Code::TemplateSize]);
}

/// Each use contains the texts of the defaults again.
#[test]
fn the_size_of_defaults_copied_to_each_use_is_limited() {
    let name = "n".repeat(60_000);
    let default = |at| format!("p{at}p = {{ type = \"bit\", default = \"{name}\" }}\n");
    let defaults: String = (0..10).map(default).collect();
    let used = |at| format!("{{ use = \"T\", name = \"u{at}u\" }}");
    let uses: Vec<String> = (0..30).map(used).collect();
    let text = format!(
        "[[template]]\nname = \"T\"\nrung = [ {PLAIN} ]\n[template.parameters]\n{defaults}\
         [[program]]\nname = \"Main\"\nrung = [ {} ]\n",
        uses.join(", ")
    );
    assert_eq!(load(text).0, [Code::TemplateSize]);
}

#[test]
fn the_size_of_a_text_filled_with_arguments_is_limited() {
    let text = |times: usize| {
        format!(
            "[[template]]\nname = \"T\"\n[template.parameters]\nx = {{ type = \"contact\" }}\n\
             [template.tags]\na = {{ type = \"bit\", alarm = \"{}\" }}\n\
             [[template.rung]]\nwhen = [\"x\"]\ndo = [\"OUT a\"]\n\
             [[program]]\nname = \"Main\"\n\
             rung = [ {{ use = \"T\", name = \"u\", with = {{ x = \"X0 & X1\" }} }} ]",
            "{x}".repeat(times)
        )
    };
    assert_eq!(load(text(142)).0, []);
    assert_eq!(load(text(143)).0, [Code::TagKey]);
}
