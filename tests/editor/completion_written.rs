//! A text is still TOML after a completion: at every place of a text, items are written and the
//! text is read again.

use serde_json::json;

use crate::editor::completion::{editor, items};
use crate::editor::project::{CONTROLLER, LADDER, TEST};

/// The text of a snippet with its gaps filled in.
fn typed_in(snippet: &str) -> String {
    let mut text = snippet.replace("${1|true,false|}", "true").replace("${1:", "");
    for number in 1..6 {
        text = text.replace(&format!("= ${number}"), "= 1").replace(&format!("${{{number}:"), "");
        text = text.replace(&format!("${number}"), "");
    }
    text
}

/// No item makes the text invalid TOML. Places within strings are not tried: items there are only
/// words.
#[test]
fn no_completion_item_makes_the_text_invalid_toml() {
    let item = json!({ "snippetSupport": true });
    let can = json!({ "textDocument": { "completion": { "completionItem": item } } });
    let (_folder, mut editor) = editor(can);
    let rung = "[[program]]\nname = \"Main\"\n\n[[program.rung]]\nname = \"a\"\n\
                when = [\"start\", \"level > 3\"]\ndo = [ \"OUT valve\" ]\n\n\
                [[task]]\nname = \"T\"\nrung = [\n    { when = [\"start\"], do = [] },\n]\n\
                [tags]\nx = { at = \"X3\", count = 2, spare = true }\n";
    let scan = "ladder = [\n    \"plant.toml\", # the one\n    \"b.toml\"\n]\n\n[scan]\n\
                period = \"10ms\" # fast\n\n[outputs]\non = [\"valve\"]\n\n[[device]]\n\
                name = \"io\"\nmap = [{ from = \"Y0\", to = \"coil 1\" }]\n";
    let steps = "ladder = [\"plant.toml\"]\n[[scenario]]\nname = \"n\"\nset = { start = true }\n\
                 steps = [\"set start 1\",\n  \"run 2 scans\" ]\n";
    let (mut tried, mut wrong) = (0, Vec::new());
    for (name, text) in [(LADDER, rung), (CONTROLLER, scan), (TEST, steps)] {
        rungd_language::format::formatted(text).expect("it is TOML");
        for at in (0..=text.len()).filter(|at| text[..*at].matches('"').count() % 2 == 0) {
            let cursor = format!("{}¦{}", &text[..at], &text[at..]);
            for item in items(&mut editor, name, &cursor).iter().step_by(3) {
                let edit = &item["textEdit"];
                let column = |of: &str| edit["range"][of]["character"].as_u64().unwrap() as usize;
                let line = text[..at].rfind('\n').map_or(0, |end| end + 1);
                let new = edit["newText"].as_str().unwrap();
                let (start, end) = (line + column("start"), line + column("end"));
                let after = format!("{}{}{}", &text[..start], typed_in(new), &text[end..]);
                // An item may also give a key or header a second time.
                let is_toml =
                    rungd_language::format::formatted(&after).is_ok() || is_only_twice(&after);
                tried += 1;
                if !is_toml && wrong.len() < 20 {
                    wrong.push(format!("{new:?} at {cursor}"));
                }
            }
        }
    }
    assert!(tried > 500, "{tried}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n---\n"));
}

/// Whether the only faults of a text are keys or headers that occur twice.
fn is_only_twice(text: &str) -> bool {
    let Err(findings) = rungd_language::format::formatted(text) else { return true };
    findings.iter().all(|finding| finding.message.contains("twice"))
}
