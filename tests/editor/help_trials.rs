//! Tries the helps of a file in an editor: every code action, and the repairs made by hand of the
//! helps that show text to write and have no action.
//!
//! Each change must remove its finding and bring no other, neither an error nor a warning, in any
//! file. The repair of a warning by an action must change no trace.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::editor::client::Editor;
use crate::editor::project::empty;
use rungd_test_support::helps::{Repairs, texts_to_write};

pub fn editor(folder: &Path) -> Editor {
    let literals = json!({ "codeActionKind": { "valueSet": ["quickfix"] } });
    let wants =
        json!({ "textDocument": { "codeAction": { "codeActionLiteralSupport": literals } } });
    Editor::with(folder, wants)
}

/// The actions for a diagnostic.
pub fn actions(editor: &mut Editor, name: &str, diagnostic: &Value) -> Vec<Value> {
    let params = json!({
        "textDocument": { "uri": editor.uri(name) },
        "range": diagnostic["range"],
        "context": { "diagnostics": [diagnostic] },
    });
    let all = editor.ask("textDocument/codeAction", params);
    let all = all.as_array().cloned().unwrap_or_default();
    let is_own = |action: &Value| action["diagnostics"][0] == *diagnostic;
    all.into_iter().filter(is_own).collect()
}

/// A text with the edits of an action.
pub fn applied(text: &str, action: &Value) -> String {
    let edits = action["edit"]["changes"].as_object().unwrap().values().next().unwrap();
    let offset = |place: &Value| {
        let line = place["line"].as_u64().unwrap() as usize;
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
        let start = starts.into_iter().nth(line).unwrap();
        let wanted = place["character"].as_u64().unwrap() as usize;
        let mut units = 0;
        let rest = text[start..].char_indices();
        let within = rest
            .take_while(|(_, char)| {
                units += char.len_utf16();
                units <= wanted
            })
            .last();
        start + within.map_or(0, |(at, char)| at + char.len_utf8())
    };
    let mut edits: Vec<(usize, usize, &str)> = edits
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            (offset(&range["start"]), offset(&range["end"]), edit["newText"].as_str().unwrap())
        })
        .collect();
    edits.sort_unstable();
    let mut changed = text.to_owned();
    for (start, end, new) in edits.into_iter().rev() {
        changed.replace_range(start..end, new);
    }
    changed
}

/// The trace of `rungd sim` for a single ladder file, column by column; `None` if it cannot be
/// simulated.
fn columns(text: &str) -> Option<BTreeMap<String, Vec<String>>> {
    let folder = empty();
    let (ladder, stimulus) = (folder.path().join("a.toml"), folder.path().join("s.csv"));
    std::fs::write(&ladder, text).unwrap();
    let mut rows = "scan,X0,X1,X2,X3\n".to_owned();
    let mut state = 1_u32;
    for scan in 0..200 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let bit = |at: u32| (state >> (20 + at)) & 1;
        let _ = writeln!(rows, "{scan},{},{},{},{}", bit(0), bit(1), bit(2), bit(3));
    }
    std::fs::write(&stimulus, rows).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rungd"));
    command.arg("sim").arg(&ladder).arg("--stimulus").arg(&stimulus);
    let out = command.args(["--scans", "200", "--trace", "-"]).output().unwrap();
    let text = out.status.success().then(|| String::from_utf8(out.stdout).unwrap())?;
    let mut rows = text.lines().map(|row| row.split(','));
    let names: Vec<String> = rows.next()?.map(str::to_owned).collect();
    let mut columns = vec![Vec::new(); names.len()];
    for row in rows {
        row.zip(&mut columns).for_each(|(value, column)| column.push(value.to_owned()));
    }
    Some(names.into_iter().zip(columns).collect())
}

/// Checks that every operand of both traces has the same values in both.
fn same_traces(before: &str, after: &str, title: &str) {
    let Some(before) = columns(before) else { return };
    let after = columns(after).expect("a repaired ladder can be simulated");
    for (name, values) in &after {
        let same = before.get(name).is_none_or(|before| before == values);
        assert!(same, "{title}: {name} changes");
    }
}

/// The number of findings of all files, by file, name and message.
type Counted = BTreeMap<(String, String, String), usize>;

/// The findings of all files, once those of this file's present text are there.
fn counted(editor: &mut Editor, name_of: &str) -> Counted {
    editor.diagnostics(name_of);
    // The diagnostics of the other files are sent before the answer.
    editor.ask(
        "textDocument/documentSymbol",
        json!({ "textDocument": { "uri": editor.uri(name_of) } }),
    );
    let mut counted = Counted::new();
    for (uri, diagnostics) in editor.all_diagnostics() {
        for diagnostic in &diagnostics {
            let (code, message) = name(diagnostic);
            *counted.entry((uri.clone(), code, message)).or_default() += 1;
        }
    }
    counted
}

/// The name and the message of a finding, without its help.
fn name(diagnostic: &Value) -> (String, String) {
    let message = diagnostic["message"].as_str().unwrap();
    let message = message.split("\nhelp: ").next().unwrap();
    (diagnostic["code"].as_str().unwrap_or("-").to_owned(), message.to_owned())
}

/// The trials of all helps of some files.
pub struct HelpTrials<'t> {
    editor: &'t mut Editor,
    repairs: Repairs,
    /// What was tried, by finding.
    told: String,
    /// What went wrong.
    wrong: Vec<String>,
}

impl<'t> HelpTrials<'t> {
    pub fn new(editor: &'t mut Editor, repairs: Repairs) -> HelpTrials<'t> {
        HelpTrials { editor, repairs, told: String::new(), wrong: Vec::new() }
    }

    /// What was tried; all of it must be right.
    pub fn end(self) -> String {
        let unused = self.unused();
        assert!(unused.is_empty(), "repairs that no finding needs:\n{}", unused.join("\n"));
        self.told()
    }

    /// What was tried; all of it must be right. Repairs may be unused.
    pub fn told(self) -> String {
        assert!(self.wrong.is_empty(), "{} wrong:\n{}", self.wrong.len(), self.wrong.join("\n"));
        self.told
    }

    /// The repairs that no finding has needed so far.
    pub fn unused(&self) -> Vec<String> {
        self.repairs.unused()
    }

    /// Tries all helps of a file.
    pub fn file(&mut self, name_of: &str, text: &str) {
        self.editor.open_with(name_of, text);
        let diagnostics = self.editor.diagnostics(name_of);
        let before = counted(self.editor, name_of);
        // All actions are asked for before the first edit.
        let mut offers: Vec<(&Value, Vec<Value>)> = Vec::new();
        for diagnostic in &diagnostics {
            if offers.iter().all(|(seen, _)| *seen != diagnostic) {
                offers.push((diagnostic, actions(self.editor, name_of, diagnostic)));
            }
        }
        let warnings_only = diagnostics.iter().all(|of| of["severity"] == 2);
        for (diagnostic, offered) in offers {
            let (code, line) = (name(diagnostic).0, line_of(diagnostic));
            let _ = writeln!(self.told, "{name_of}:{} {code}", line + 1);
            let trial = Trial { file: (name_of, text), diagnostic, before: &before };
            for action in &offered {
                self.action(&trial, action, warnings_only);
            }
            let repairs = |of: &Value| !of["title"].as_str().unwrap().starts_with("Allow");
            self.by_hand(&trial, offered.iter().any(repairs));
        }
        self.editor.close(name_of);
    }

    fn action(&mut self, trial: &Trial, action: &Value, warnings_only: bool) {
        let title = action["title"].as_str().unwrap();
        let mark = if action["isPreferred"] == true { "*" } else { "-" };
        let _ = writeln!(self.told, "  {mark} {title}");
        let (name_of, text) = trial.file;
        let changed = applied(text, action);
        if !title.starts_with("Allow") && trial.diagnostic["severity"] == 2 && warnings_only {
            same_traces(text, &changed, title);
        }
        self.judge(trial, title, &[(name_of.to_owned(), changed)]);
    }

    /// The repair by hand of a help that shows text and has no action.
    fn by_hand(&mut self, trial: &Trial, has_action: bool) {
        let Some((_, help)) = trial.diagnostic["message"].as_str().unwrap().split_once("\nhelp: ")
        else {
            return;
        };
        if has_action {
            return;
        }
        let (name_of, text) = trial.file;
        let (first, line) = (help.lines().next().unwrap(), line_of(trial.diagnostic));
        let shown = texts_to_write(help);
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/");
        let Some(repair) = self.repairs.next(name_of, &first.replace(root, "")) else {
            match shown.is_empty() {
                true => drop(writeln!(self.told, "  names: {first}")),
                false => self.wrong.push(format!(
                    "@ {name_of} {}\n#{}: {}",
                    first.replace(root, ""),
                    line + 1,
                    text.lines().nth(line).unwrap_or_default()
                )),
            }
            return;
        };
        let _ = writeln!(self.told, "  by hand: {first}");
        let read = |name: &str| match self.editor.is_there(name) {
            true => self.editor.disk(name),
            false => String::new(),
        };
        let texts = repair.writes_what_is_shown(help).and(repair.applied(text, line, read));
        match texts {
            Ok(texts) => self.judge(trial, first, &texts),
            Err(wrong) => self.wrong.push(format!("{name_of}:{}: {first}: {wrong}", line + 1)),
        }
    }

    /// Judges the changed texts, and restores them.
    fn judge(&mut self, trial: &Trial, title: &str, texts: &[(String, String)]) {
        let (name_of, text) = trial.file;
        let others: Vec<&str> =
            texts.iter().map(|(name, _)| name.as_str()).filter(|name| *name != name_of).collect();
        let mut before = trial.before.clone();
        for name in &others {
            if self.editor.is_there(name) {
                self.editor.open(name);
                for (finding, of) in counted(self.editor, name) {
                    let known = before.entry(finding).or_default();
                    *known = of.max(*known);
                }
            }
        }
        // A new controller file changes what the other files are judged with: it is judged first.
        let (there, new): (Vec<_>, Vec<_>) =
            texts.iter().partition::<Vec<&(String, String)>, _>(|of| self.editor.is_there(&of.0));
        for (name, changed) in new {
            self.editor.open_with(name, changed);
            self.editor.diagnostics(name);
        }
        for (name, changed) in there {
            self.editor.replace(name, changed);
        }
        let mut after = counted(self.editor, name_of);
        for name in &others {
            after = counted(self.editor, name);
            self.editor.close(name);
        }
        self.editor.replace(name_of, text);
        let place = format!("{name_of}:{}", line_of(trial.diagnostic) + 1);
        let (code, message) = name(trial.diagnostic);
        let own = (self.editor.uri(name_of), code, message);
        let count = |of: &Counted, finding| of.get(finding).copied().unwrap_or(0);
        if count(&after, &own) >= count(&before, &own) {
            self.wrong.push(format!("{place}: {title}: the finding stays"));
        }
        for (finding, of) in after.iter().filter(|(at, of)| count(&before, at) < **of) {
            self.wrong.push(format!("{place}: {title}: brings {of} {} {}", finding.1, finding.2));
        }
    }
}

/// A finding, its file, and all findings of the unchanged files.
struct Trial<'t> {
    file: (&'t str, &'t str),
    diagnostic: &'t Value,
    before: &'t Counted,
}

fn line_of(diagnostic: &Value) -> usize {
    diagnostic["range"]["start"]["line"].as_u64().unwrap() as usize
}
