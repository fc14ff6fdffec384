//! The recipes of `CONTRIBUTING.md`, followed on a scratch copy of the repository. Only rows and
//! variants are added to the copy. The places that the compiler then names must be those of the
//! recipe.
//!
//! The compiler stops at the first crate with errors. So the copy is compiled in rounds: after each
//! one, the arms that the compiler asks for are put in, as it proposes them, and the next round
//! reaches the next crates. The target folder is that of this test, so that all dependencies are
//! compiled already. The copy has a version of its own: packages of the same names and versions
//! would replace what cargo knows of the last build, and the next `cargo test` would compile all
//! crates again.

use super::recipe_places::ASKED_FOR;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde::Deserialize;

use rungd_engine::isa::instruction::TABLE;

/// Replacements in the copy: the file, the old text, the new text.
type Additions = &'static [(&'static str, &'static str, &'static str)];

/// A row of an instruction, a row of an operation, and a variant for each enum that a recipe
/// extends, all named Blip. The row has the page of another instruction.
const BLIPS: Additions = &[
    (
        "crates/engine/src/isa/instruction_table.rs",
        "    Set \"SET\"",
        "    Blip \"BLIP\" \"out\" \"Blip\", WHEN, DRIVEN, false, Off, HELP, \"Blips.\";\n    \
         Set \"SET\"",
    ),
    (
        "crates/engine/src/isa/role.rs",
        "    /// Reads the value,",
        "    Blip,\n    /// Reads the value,",
    ),
    (
        "crates/engine/src/ops.rs",
        "    /// SET: ",
        "    /// Blips.\n    Blip blip { leg: LegPowers, bit: BitWritten }\n    /// SET: ",
    ),
    ("crates/engine/src/control.rs", "    /// SGSET.\n", "    Blip,\n    /// SGSET.\n"),
    (
        "crates/engine/src/isa/columns.rs",
        "    /// The bit it drives goes OFF.\n",
        "    Blip,\n    /// The bit it drives goes OFF.\n",
    ),
    ("crates/engine/src/isa/columns.rs", "    /// A Program.\n", "    Blip,\n    /// A Program.\n"),
    (
        "crates/client/src/operator/protocol.rs",
        "    RetainSave {},\n",
        "    RetainSave {},\n    Blip {},\n",
    ),
    ("src/cli/mod.rs", "enum Command {\n", "enum Command {\n    Blip,\n"),
    (
        "crates/config/src/controller/device/settings.rs",
        "    Simulated(PlantSettings),\n",
        "    Simulated(PlantSettings),\n    Blip,\n",
    ),
];

const VERSION_OF_COPY: &str = concat!(env!("CARGO_PKG_VERSION"), "-copy");

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Makes a copy of the repository with the additions. The sources are copied, everything else is
/// linked.
fn copy(name: &str, additions: &[Additions]) -> PathBuf {
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&copy);
    for folder in ["crates", "src"] {
        copy_folder(&root().join(folder), &copy.join(folder));
    }
    let own = format!("version = \"{}\"\n", env!("CARGO_PKG_VERSION"));
    let other = format!("version = \"{VERSION_OF_COPY}\"\n");
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("readable");
    let package = "[workspace.package]\n";
    assert!(manifest.contains(&format!("{package}{own}")), "the version of the workspace");
    let manifest = manifest.replace(&format!("{package}{own}"), &format!("{package}{other}"));
    fs::write(copy.join("Cargo.toml"), manifest).expect("writable");
    let lock = fs::read_to_string(root().join("Cargo.lock")).expect("readable");
    let lock = lock.split("\n\n").map(|entry| match entry.contains("\nname = \"rungd") {
        true => entry.replacen(&own, &other, 1),
        false => entry.to_owned(),
    });
    fs::write(copy.join("Cargo.lock"), lock.collect::<Vec<_>>().join("\n\n")).expect("writable");
    for folder in ["benches", "config", "docs", "opcua", "tests"] {
        symlink(root().join(folder), copy.join(folder)).expect("linked");
    }
    for (file, before, after) in additions.iter().copied().flatten() {
        replace(&copy.join(file), before, after);
    }
    copy
}

/// Replaces a text that stands in the file once.
fn replace(file: &Path, before: &str, after: &str) {
    let text = fs::read_to_string(file).expect("it was copied");
    assert_eq!(text.matches(before).count(), 1, "{} has not once: {before}", file.display());
    fs::write(file, text.replace(before, after)).expect("writable");
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder of the copy");
    for entry in fs::read_dir(from).expect("a folder is readable") {
        let path = entry.expect("an entry is readable").path();
        let to = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy_folder(&path, &to);
        } else {
            fs::copy(&path, &to).expect("copied");
        }
    }
}

/// A message of the compiler.
#[derive(Deserialize)]
struct Message {
    level: String,
    message: String,
    spans: Vec<Place>,
    children: Vec<Message>,
}

#[derive(Deserialize)]
struct Place {
    file_name: String,
    byte_start: usize,
    byte_end: usize,
    is_primary: bool,
    suggested_replacement: Option<String>,
}

/// A line of cargo.
#[derive(Deserialize)]
struct CargoLine {
    message: Option<Message>,
}

/// An error of the compiler: its file and its text.
#[derive(Debug)]
struct CompileError {
    file: String,
    text: String,
}

/// The compiler's errors for the copy with all additions, of all rounds.
fn errors_of_all() -> &'static [CompileError] {
    static ERRORS: OnceLock<Vec<CompileError>> = OnceLock::new();
    ERRORS.get_or_init(|| {
        let copy = copy("recipes", &[BLIPS, HALF]);
        let mut all = Vec::new();
        for _ in 0..ROUNDS_MAX {
            let messages = messages(&copy);
            let errors: Vec<CompileError> = messages.iter().filter_map(error).collect();
            let is_last = errors.iter().any(|error| error.file.starts_with("src/"));
            mend(&copy, &messages, &errors);
            all.extend(errors);
            if is_last {
                return all;
            }
        }
        panic!("after {ROUNDS_MAX} rounds the compiler still asks: {all:#?}");
    })
}

/// More rounds than there are crates above each other.
const ROUNDS_MAX: usize = 12;

fn error(message: &Message) -> Option<CompileError> {
    let place = message.spans.iter().find(|place| place.is_primary)?;
    Some(CompileError { file: place.file_name.clone(), text: message.message.clone() })
}

/// Lets the crates with these errors compile: puts in the missing arms, as the compiler proposes
/// them, and the operation's behaviour; takes the half-done steps back.
fn mend(copy: &Path, messages: &[Message], errors: &[CompileError]) {
    let mut arms: BTreeMap<&str, Vec<&Place>> = BTreeMap::new();
    for place in messages.iter().flat_map(|message| &message.children).flat_map(|help| &help.spans)
    {
        if place.suggested_replacement.as_ref().is_some_and(|text| text.contains("todo!()")) {
            arms.entry(&place.file_name).or_default().push(place);
        }
    }
    for (file, mut places) in arms {
        let mut text = fs::read_to_string(copy.join(file)).expect("it was compiled");
        places.sort_by_key(|place| std::cmp::Reverse(place.byte_start));
        places.dedup_by_key(|place| place.byte_start);
        for place in places {
            let arm = place.suggested_replacement.as_deref().expect("it was asked for");
            // The compiler names the variant by a path that is not always one here.
            let (variant, rest) = arm.split_once("=>").expect("an arm");
            let before = variant.find(|c: char| !" \n,{".contains(c)).unwrap_or(0);
            let arm = format!("{}_ =>{rest}", &variant[..before]);
            text.replace_range(place.byte_start..place.byte_end, &arm);
        }
        fs::write(copy.join(file), text).expect("writable");
    }
    if errors.iter().any(is_operation) {
        let file = copy.join("crates/engine/src/logic.rs");
        let text = fs::read_to_string(&file).expect("it was copied");
        fs::write(&file, text + BEHAVIOUR).expect("writable");
    }
    for (file, before, after) in HALF {
        if errors.iter().any(|error| error.file == *file && is_of_half(error)) {
            replace(&copy.join(file), after, before);
        }
    }
}

/// The behaviour of the operation: none.
const BEHAVIOUR: &str = "\nimpl super::ops::Operation for super::ops::Blip {\n    \
                         fn run<R: Reach>(&self, _: &mut MemoryView<R>) {}\n}\n";

fn is_operation(error: &CompileError) -> bool {
    error.text.contains("`Blip: Operation` is not satisfied")
}

/// The compiler's errors for a copy.
fn messages(copy: &Path) -> Vec<Message> {
    // `target/PROFILE/deps/texts-…`
    let own = std::env::current_exe().expect("the path of this test");
    let folder = own.ancestors().nth(2).expect("the profile's folder");
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") => "dev",
        Some(other) => other,
        None => panic!("{} is in no profile's folder", own.display()),
    };
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["check", "--test", "texts", "--offline", "--locked", "--keep-going"]);
    cargo.args(["--message-format", "json", "--profile", profile, "--target-dir"]);
    cargo.arg(folder.parent().expect("the target folder")).current_dir(copy);
    // Cargo set these for this test. The build script of `ring` reads them: with other values than
    // before, `ring` and all that uses it would be built again, and also by the next `cargo test`.
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if ["CARGO_MANIFEST_", "CARGO_PKG_"].iter().any(|prefix| text.starts_with(prefix)) {
            cargo.env_remove(name);
        }
    }
    let output = cargo.env("CARGO_INCREMENTAL", "0").output().expect("cargo runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "the compiler asks for nothing: {said}");
    let of_copy = format!(" v{VERSION_OF_COPY} ");
    let again = said.lines().find(|line| {
        let compiled = line.trim_start().strip_prefix("Compiling ");
        compiled.is_some_and(|of| !of.starts_with("rungd") || !of.contains(&of_copy))
    });
    assert!(
        again.is_none(),
        "not only the copy is compiled, the next `cargo test` is slow: {said}"
    );
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines = lines.lines().filter_map(|line| serde_json::from_str::<CargoLine>(line).ok());
    let messages = lines.filter_map(|line| line.message);
    let is_error = |message: &Message| message.level == "error" && !message.spans.is_empty();
    let errors: Vec<Message> = messages.filter(is_error).collect();
    assert!(!errors.is_empty(), "the compiler asks for nothing: {said}");
    errors
}

/// The enum of an error such as ``non-exhaustive patterns: `isa::Mnemonic::Blip` not covered``.
fn missing_arm(error: &CompileError) -> Option<String> {
    let message = error.text.strip_prefix("non-exhaustive patterns: ")?;
    let path = message.split('`').nth(1)?;
    let (of, _) = path.split_once("::Blip")?;
    // Without what stands around the name: `&`, a path, `Some(`.
    let of = of.rsplit(|c: char| !c.is_alphanumeric()).next()?;
    Some(of.to_owned())
}

fn recipe(title: &str) -> String {
    let page = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("readable");
    let (_, recipe) = page.split_once(&format!("\n## {title}\n")).expect("the recipe");
    recipe.split("\n## ").next().expect("a text").to_owned()
}

#[test]
fn the_compiler_reports_exactly_the_places_that_the_recipes_name() {
    let errors: Vec<_> = errors_of_all().iter().filter(|error| !is_of_half(error)).collect();
    let mut asked: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    // The first group of errors: the operation has no `run`.
    let (operation, arms): (Vec<_>, Vec<_>) =
        errors.iter().copied().partition(|error| is_operation(error));
    assert!(!operation.is_empty(), "{errors:#?}");
    // The tests of the crates are compiled too; what they ask for is no part of a recipe.
    for error in arms.into_iter().filter(|error| !error.file.contains("/tests/")) {
        let of = missing_arm(error).unwrap_or_else(|| panic!("{error:#?} of {errors:#?}"));
        asked.entry(of).or_default().insert(error.file.clone());
    }
    let expected = ASKED_FOR.iter().map(|(of, _, files)| {
        ((*of).to_owned(), files.iter().map(|file| (*file).to_owned()).collect())
    });
    assert_eq!(asked, expected.collect(), "{errors:#?}");
    for (_, title, files) in ASKED_FOR {
        let recipe = recipe(title);
        for file in *files {
            assert!(recipe.contains(&format!("`{file}`")), "{title} does not name {file}");
        }
    }
}

/// A log line with an event that has no row, and a finding without its page and its rule: the first
/// steps of two recipes.
const HALF: Additions = &[
    (
        "src/daemon/shell.rs",
        "    say!(\n        PROCESS_START,",
        "    say!(BLIP, \"it blips\");\n    say!(\n        PROCESS_START,",
    ),
    (
        "crates/language/src/source/finding.rs",
        "    UnknownName \"unknown-name\"",
        "    Blip \"blip\" Error \"Blips.\";\n    UnknownName \"unknown-name\"",
    ),
    (
        "crates/language/src/check/mod.rs",
        "    (RuleNeeds::Place, Code::OwnedTwice,",
        "    (RuleNeeds::Place, Code::Blip, blip::check),\n    (RuleNeeds::Place, Code::OwnedTwice,",
    ),
];

/// For each error of `HALF`: its file, the missing item, the recipe, and the place that the recipe
/// names.
const HALF_ASKED_FOR: [(&str, &str, &str, &str); 3] = [
    ("src/daemon/shell.rs", "BLIP", "Adding an event", "crates/runtime/src/events/"),
    (
        "crates/language/src/source/finding.rs",
        "docs/findings/blip.md",
        "Adding a finding",
        "docs/findings/",
    ),
    (
        "crates/language/src/check/mod.rs",
        "blip",
        "Adding a finding",
        "crates/language/src/check/mod.rs",
    ),
];

fn is_of_half(error: &CompileError) -> bool {
    let asks = |(file, missing, ..): &(&str, &str, &str, &str)| {
        error.file == *file && error.text.contains(missing)
    };
    HALF_ASKED_FOR.iter().any(asks)
}

/// The previous test refuses every error that is neither in `HALF_ASKED_FOR` nor a missing arm of a
/// match.
#[test]
fn a_missing_row_page_or_rule_does_not_compile() {
    let errors = errors_of_all();
    for (file, missing, title, place) in HALF_ASKED_FOR {
        let of_it = |error: &&CompileError| error.file == file && error.text.contains(missing);
        assert_eq!(errors.iter().filter(of_it).count(), 1, "{file}: {errors:#?}");
        assert!(recipe(title).contains(place), "{title} does not name {place}");
    }
}

fn texts(folder: &str) -> String {
    let entries = fs::read_dir(root().join(folder)).expect("a folder is readable");
    let paths = entries.map(|entry| entry.expect("an entry is readable").path());
    let files = paths.filter(|path| path.is_file());
    files.map(|path| fs::read_to_string(path).expect("a text")).collect()
}

/// The steps of the instruction's recipe that the compiler does not check.
#[test]
fn every_instruction_has_cases_a_described_behaviour_and_a_model() {
    let semantics = fs::read_to_string(root().join("docs/semantics.md")).expect("readable");
    let (cases, model) = (texts("tests/semantics"), texts("tests/support/model"));
    for spec in TABLE {
        let is_word = |text: &str| {
            let word = |c: char| !c.is_ascii_uppercase();
            text.split(word).any(|part| part == spec.name)
        };
        assert!(is_word(&semantics), "docs/semantics.md says nothing of {}", spec.name);
        assert!(is_word(&cases), "no case of tests/semantics has {}", spec.name);
        assert!(is_word(&model), "the model of tests/support/model does not know {}", spec.name);
    }
}

#[test]
fn a_new_instruction_needs_at_most_six_files_of_code_and_two_of_proofs() {
    let asked = ASKED_FOR.iter().filter(|(of, ..)| ["Mnemonic", "ControlKind"].contains(of));
    let mut files: BTreeSet<&str> = asked.flat_map(|(_, _, files)| *files).copied().collect();
    files.insert(BLIPS[0].0);
    let (proofs, others): (Vec<&str>, Vec<&str>) =
        files.into_iter().partition(|file| file.starts_with("crates/prove/"));
    assert!(others.len() <= 6 && proofs.len() <= 2, "{others:?} {proofs:?}");
}

#[test]
fn every_rule_of_the_check_has_tests() {
    let text = |file: &str| {
        fs::read_to_string(root().join("crates/language/src/check").join(file)).expect(file)
    };
    let table = text("mod.rs");
    let rows = table.lines().filter_map(|line| line.trim().strip_prefix("(RuleNeeds::"));
    let rules: BTreeSet<&str> =
        rows.filter_map(|row| row.rsplit(", ").next()?.split("::").next()).collect();
    assert!(rules.len() > 20, "{rules:?}");
    for rule in rules {
        let has_tests = text(&format!("{rule}.rs")).contains("#[cfg(test)]");
        assert!(has_tests, "crates/language/src/check/{rule}.rs has no tests");
    }
}

/// Files that match the values of TOML's parser or of OPC UA, whose enums are not part of rungd.
const OF_LIBRARIES: [&str; 10] = [
    "opcua/src/aggregate.rs",
    "opcua/src/values.rs",
    "crates/language/src/source/toml_tree_reader.rs",
    "crates/language/src/source/statements.rs",
    "crates/language/src/source/headers.rs",
    "crates/language/src/source/strict.rs",
    "crates/language/src/source/table.rs",
    "crates/language/src/source/table/constants.rs",
    "crates/language/src/source/table/entries.rs",
    "crates/language/src/source/table/places.rs",
];

/// No match has a `_` that would cover variants added later.
#[test]
fn matches_of_enums_are_exhaustive() {
    let text = fs::read_to_string(root().join("Cargo.toml")).expect("readable");
    assert!(text.contains("\nwildcard_enum_match_arm = \"deny\"\n"), "[workspace.lints.clippy]");
    for file in crate::house::sources() {
        let allows = file.text.contains("allow(clippy::wildcard_enum_match_arm)");
        let is_listed = OF_LIBRARIES.iter().any(|path| file.path.ends_with(path));
        assert!(!allows || is_listed, "{} matches enums of rungd", file.path.display());
    }
}
