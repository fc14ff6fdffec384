//! Which expressions are times.

use crate::resolve::program::Contact;
use crate::resolve::{LoadOptions, load_ladders};
use crate::source::span::SourceFile;

/// Whether the left side of a compare is a time.
fn is_time(side: &str) -> bool {
    let text = format!(
        "[tags]\nt = {{ type = \"timer\" }}\nlanes = {{ type = \"timer\", count = 3 }}\n\
         [[program]]\nname = \"Main\"\nrung = [\n\
         {{ when = [\"{side} > D9 * 2\"], do = [\"OUT Y0\"] }},\n\
         {{ when = [\"X0\"], do = [\"TMR t preset=1s\"] }} ]\n"
    );
    let file = SourceFile { name: "a.toml".to_owned(), text };
    let (program, findings) = load_ladders(&[file], &LoadOptions::default());
    let program = program.unwrap_or_else(|| panic!("{findings:?}"));
    let main = &program.blocks[0].rungs[0];
    let Contact::Computed(computed, _) = &main.legs[0].contacts[0] else { panic!("{side}") };
    computed.left.is_time()
}

#[test]
fn durations_and_times_of_timers_are_times_until_an_operator_makes_a_number_of_them() {
    for side in [
        "t.Acc + 1s",
        "-t.Acc",
        "t.Acc % 250ms",
        "2 * t.Acc - 1s",
        "t.Acc * D1 / 3",
        "max(t.Acc, 3s)",
        "lanes[D1].Acc + 2s",
        "if(D1, t.Acc, 1m)",
    ] {
        assert!(is_time(side), "{side}");
    }
    for side in ["t.Acc / 1s", "t.Acc + 500", "t.Acc * 1s", "D1 + 2", "t.Acc + D1"] {
        assert!(!is_time(side), "{side}");
    }
}
