//! The recipes of `CONTRIBUTING.md`, followed on a scratch copy of the repository. Only rows and
//! variants are added to the copy. The places that the compiler then names must be those of the
//! recipe.
//!
//! The target folder of the copy is that of this test, so that all dependencies are compiled
//! already. The crate itself is not finished, because the compiler stops at the errors. One copy
//! has all additions and is compiled once for all tests. It has a version of its own: a package of
//! the same name and version would replace what cargo knows of the crate's last build, and the next
//! `cargo test` would compile the crate again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

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
        "    Simulated(Plant),\n",
        "    Simulated(Plant),\n    Blip,\n",
    ),
];

/// Each enum, its recipe, and the files whose matches of the enum lack an arm for Blip.
const ASKED_FOR: &[(&str, &str, &[&str])] = &[
    ("Mnemonic", "Adding an instruction", &["crates/language/src/lower/instructions.rs"]),
    (
        "OperandRole",
        "Adding an instruction",
        &[
            "crates/engine/src/isa/role.rs",
            "crates/history/src/observe/decide.rs",
            "crates/history/src/observe/idle.rs",
        ],
    ),
    (
        "ControlKind",
        "Adding an instruction",
        &[
            "crates/engine/src/blocks.rs",
            "crates/engine/src/control.rs",
            "crates/engine/src/slice.rs",
            "crates/engine/src/written.rs",
        ],
    ),
    (
        "Termination",
        "Adding an instruction",
        &[
            "crates/config/src/explain/mod.rs",
            "crates/engine/src/isa/columns.rs",
            "crates/language/src/lower/instructions.rs",
        ],
    ),
    (
        "OperandKind",
        "Adding an instruction",
        &[
            "crates/lsp/src/complete/nature.rs",
            "crates/config/src/explain/mod.rs",
            "crates/engine/src/isa/columns.rs",
            "crates/language/src/resolve/operand.rs",
            "crates/language/src/resolve/template/kind.rs",
        ],
    ),
    (
        "DriverSettings",
        "Adding a driver",
        &[
            "crates/config/src/controller/wired.rs",
            "src/daemon/devices.rs",
            "crates/lab/src/rig/field.rs",
        ],
    ),
    ("Command", "Adding a command", &["src/cli/mod.rs"]),
    ("Code", "Adding a finding", &["crates/language/src/source/rests_on.rs"]),
    (
        "Request",
        "Adding a command",
        &["crates/client/src/operator/protocol.rs", "src/daemon/operator/desk.rs"],
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
    copy_folder(&root().join("src"), &copy.join("src"));
    let package = |version| format!("name = \"rungd\"\nversion = \"{version}\"\n");
    for file in ["Cargo.toml", "Cargo.lock"] {
        fs::copy(root().join(file), copy.join(file)).expect("copied");
        replace(&copy.join(file), &package(env!("CARGO_PKG_VERSION")), &package(VERSION_OF_COPY));
    }
    for folder in ["benches", "config", "docs", "tests"] {
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

/// The compiler's errors for the copy with all additions.
fn errors_of_all() -> &'static [String] {
    static ERRORS: OnceLock<Vec<String>> = OnceLock::new();
    ERRORS.get_or_init(|| errors(&copy("recipes", &[BLIPS, HALF])))
}

/// The compiler's lines with errors for a copy.
fn errors(copy: &Path) -> Vec<String> {
    // `target/PROFILE/deps/it-…`
    let own = std::env::current_exe().expect("the path of this test");
    let folder = own.ancestors().nth(2).expect("the profile's folder");
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") => "dev",
        Some(other) => other,
        None => panic!("{} is in no profile's folder", own.display()),
    };
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([
        "test",
        "--test",
        "it",
        "--no-run",
        "--offline",
        "--locked",
        "--message-format",
        "short",
    ]);
    cargo.args(["--color", "never", "--profile", profile, "--target-dir"]);
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
    let of_copy = format!("rungd v{VERSION_OF_COPY} ");
    let again = said.lines().find(|line| {
        line.trim_start().strip_prefix("Compiling ").is_some_and(|of| !of.starts_with(&of_copy))
    });
    assert!(
        again.is_none(),
        "not only the copy is compiled, the next `cargo test` is slow: {said}"
    );
    let errors: Vec<String> =
        said.lines().filter(|line| line.contains(": error")).map(str::to_owned).collect();
    assert!(!errors.is_empty(), "{said}");
    errors
}

/// The enum and the file of an error such as ``src/a.rs:1:2: error[E0004]: non-exhaustive patterns:
/// `isa::Mnemonic::Blip` not covered``.
fn missing_arm(error: &str) -> Option<(String, String)> {
    let (place, message) = error.split_once(": error[E0004]: ")?;
    let path = message.split('`').nth(1)?;
    let (of, _) = path.split_once("::Blip")?;
    // Without what stands around the name: `&`, a path, `Some(`.
    let of = of.rsplit(|c: char| !c.is_alphanumeric()).next()?;
    Some((of.to_owned(), place.split(':').next()?.to_owned()))
}

fn recipe(title: &str) -> String {
    let page = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("readable");
    let (_, recipe) = page.split_once(&format!("\n## {title}\n")).expect("the recipe");
    recipe.split("\n## ").next().expect("a text").to_owned()
}

#[test]
fn the_compiler_asks_for_the_places_that_the_recipes_name() {
    let errors: Vec<_> = errors_of_all().iter().filter(|error| !is_of_half(error)).collect();
    let mut asked: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    // The first group of errors: the operation has no `run`.
    let (operation, arms): (Vec<_>, Vec<_>) = errors
        .iter()
        .copied()
        .partition(|error| error.contains("`Blip: Operation` is not satisfied"));
    assert!(!operation.is_empty(), "{errors:#?}");
    for error in arms {
        let (of, file) = missing_arm(error).unwrap_or_else(|| panic!("{errors:#?}"));
        asked.entry(of).or_default().insert(file);
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
        "    (Needs::Place, Code::OwnedTwice,",
        "    (Needs::Place, Code::Blip, blip::check),\n    (Needs::Place, Code::OwnedTwice,",
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

fn is_of_half(error: &str) -> bool {
    HALF_ASKED_FOR
        .iter()
        .any(|(file, missing, ..)| error.starts_with(file) && error.contains(missing))
}

/// The previous test refuses every error that is neither in `HALF_ASKED_FOR` nor a missing arm of a
/// match.
#[test]
fn a_line_without_its_row_and_a_finding_without_its_page_or_rule_do_not_compile() {
    let errors = errors_of_all();
    for (file, missing, title, place) in HALF_ASKED_FOR {
        let of_it = |error: &&String| error.starts_with(file) && error.contains(missing);
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
fn an_instruction_has_its_cases_its_behaviour_and_its_model() {
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
fn an_instruction_needs_six_files_of_code_at_most() {
    let asked = ASKED_FOR.iter().filter(|(of, ..)| ["Mnemonic", "ControlKind"].contains(of));
    let mut files: BTreeSet<&str> = asked.flat_map(|(_, _, files)| *files).copied().collect();
    files.insert(BLIPS[0].0);
    assert!(files.len() <= 6, "{files:?}");
}

#[test]
fn every_rule_of_the_check_has_its_tests() {
    let text = |file: &str| {
        fs::read_to_string(root().join("crates/language/src/check").join(file)).expect(file)
    };
    let table = text("mod.rs");
    let rows = table.lines().filter_map(|line| line.trim().strip_prefix("(Needs::"));
    let rules: BTreeSet<&str> =
        rows.filter_map(|row| row.rsplit(", ").next()?.split("::").next()).collect();
    assert!(rules.len() > 20, "{rules:?}");
    for rule in rules {
        let has_tests = text(&format!("{rule}.rs")).contains("#[cfg(test)]");
        assert!(has_tests, "crates/language/src/check/{rule}.rs has no tests");
    }
}

/// Files that match the values of the TOML parser, whose enum is not part of rungd.
const OF_TOML: [&str; 6] = [
    "crates/lsp/src/outline_reader.rs",
    "crates/language/src/source/statements.rs",
    "crates/language/src/source/headers.rs",
    "crates/language/src/source/strict.rs",
    "crates/language/src/source/table.rs",
    "crates/language/src/source/table/entries.rs",
];

/// No match has a `_` that would cover variants added later.
#[test]
fn matches_of_enums_are_exhaustive() {
    let text = fs::read_to_string(root().join("Cargo.toml")).expect("readable");
    assert!(text.contains("\nwildcard_enum_match_arm = \"deny\"\n"), "[workspace.lints.clippy]");
    for file in crate::house::sources() {
        let allows = file.text.contains("allow(clippy::wildcard_enum_match_arm)");
        let of_toml = OF_TOML.iter().any(|path| file.path.ends_with(path));
        assert!(!allows || of_toml, "{} is not about TOML", file.path.display());
    }
}
