//! `README.md`, `docs/start.md`, `docs/operator.md`, `docs/alarms.md`, `docs/audit.md`,
//! `docs/record.md`, `docs/black-box.md`, `docs/testing.md`, `docs/import/README.md`,
//! `docs/export.md`, `docs/ladder-plant.md`, `docs/proving.md`, `docs/xref.md` and `docs/draw.md`,
//! executed: each
//! command in a ```` ```console ```` block runs, in order, in a folder with a copy of `config/`,
//! and prints what the page shows.
//!
//! In an output on the page, `…` within a line stands for any text, and a line `…` for any lines.
//! Overruns of a busy machine are ignored. The pages about recordings show times and scan numbers
//! of an earlier run: there every number is masked, and a number that a command takes from an
//! earlier output of the page is replaced by the number printed in this run (`support/masked.rs`).
//! `UPDATE_EXPECT=1 cargo test --test commands cli::docs_commands` updates the outputs that have no `…`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rungd_test_support::calm::{calm, calmed};
use rungd_test_support::masked::{Carried, masked};
use rungd_test_support::shown::lines_match;

/// A part of the page.
enum Part<'a> {
    /// Text that is left as it is.
    Text(&'a str),
    /// The body of a console block.
    Console(&'a str),
    /// A file to be written before the next command: its name, and the part of the page that shows
    /// it.
    File(&'a str, &'a str),
}

const CONSOLE: &str = "```console\n";
const FILE: &str = "<!-- file: ";

fn parts(page: &str) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    let mut rest = page;
    loop {
        let (console, file) = (rest.find(CONSOLE), rest.find(FILE));
        let Some(at) = [console, file].into_iter().flatten().min() else {
            parts.push(Part::Text(rest));
            return parts;
        };
        let (head, tail) = (console == Some(at), &rest[at..]);
        if head {
            let begin = at + CONSOLE.len();
            let end = begin + rest[begin..].find("```").expect("a console block ends");
            parts.push(Part::Text(&rest[..begin]));
            parts.push(Part::Console(&rest[begin..end]));
            rest = &rest[end..];
        } else {
            let end = tail.match_indices("```").nth(1).expect("a file's block").0;
            let name = tail[FILE.len()..].split(" -->").next().expect("a name");
            parts.push(Part::Text(&rest[..at]));
            parts.push(Part::File(name, &tail[..end]));
            rest = &tail[end..];
        }
    }
}

/// The pages about recordings, whose numbers are masked.
const RECORDED: [&str; 2] = ["record", "black-box"];

/// The pages whose commands name the socket of the page's controller.
const SOCKETS: [(&str, &str); 6] = [
    ("operator", "config/rungd.sock"),
    ("alarms", "rungd.sock"),
    ("audit", "rungd.sock"),
    ("proving", "rungd.sock"),
    ("record", "config/rungd.sock"),
    ("black-box", "config/bottling-plant.sock"),
];

/// The folder in which a reader would run the commands.
fn workplace(page: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("rungd-docs-{page}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    for sub in ["config/programs", "config/tests", "config"] {
        fs::create_dir_all(folder.join(sub)).expect("a folder");
        let source = config.parent().expect("a root").join(sub);
        for entry in fs::read_dir(source).expect("config") {
            let path = entry.expect("an entry").path();
            if path.is_file() {
                let text = fs::read_to_string(&path).expect("text");
                // A pause of a busy machine must not end a page's story in a FAULT.
                let is_controller = sub == "config" && text.contains("\nwatchdog");
                let text = if is_controller { calmed(&text) } else { text };
                fs::write(folder.join(sub).join(path.file_name().unwrap()), text).expect("a copy");
            }
        }
    }
    folder
}

/// Waits until the controller is in RUN: a busy machine may need longer than the second that the
/// page waits. It answers earlier, still in STOP.
const ANSWERS: &str = "for n in $(seq 300); do rungd status 2>/dev/null | grep -q ' RUN for ' && \
                       break; sleep 0.2; done";

/// The standard output and standard error of a command together, as a terminal shows them.
fn output(command: &str, folder: &Path) -> String {
    let binary = Path::new(env!("CARGO_BIN_EXE_rungd"));
    let path = std::env::var("PATH").unwrap_or_default();
    let bin = binary.parent().expect("a folder").display();
    // On these pages the commands name the controller's socket.
    let name = folder.to_string_lossy();
    let sockets = SOCKETS.iter().find(|(page, _)| name.contains(&format!("-{page}-")));
    let socket = sockets.map(|(_, socket)| folder.join(socket));
    let command = command.replace("& sleep 1", &format!("& sleep 1; {ANSWERS}"));
    let output = Command::new("sh")
        .args(["-c", &format!("{{ {command}\n}} 2>&1")])
        .current_dir(folder)
        .env("PATH", format!("{bin}:{path}"))
        .env("NO_COLOR", "1")
        .env("XDG_RUNTIME_DIR", folder)
        .envs(socket.map(|socket| ("RUNGD_SOCKET", socket)))
        .env_remove("RUNGD_LOG")
        .env_remove("RUNTIME_DIRECTORY")
        .env_remove("JOURNAL_STREAM")
        .output()
        .expect("sh runs");
    let text = String::from_utf8(output.stdout).expect("text");
    // The watchdog that the pages show; `workplace` changed it.
    let text = text.replace("watchdog=10m", "watchdog=200ms");
    let text = text.replace("watchdog 10m", "watchdog 200ms");
    let lines = text.lines().filter(|line| !line.contains(" overrun: "));
    lines.map(|line| format!("{}\n", plural(line))).collect()
}

/// Puts counts in the plural, as the page shows them: a slow machine may have made only one scan.
fn plural(line: &str) -> String {
    let line = line.replace(" 1 scan in all", " 1 scans in all");
    ["scan", "overrun"]
        .iter()
        .fold(line, |line, thing| line.replace(&format!(" 1 {thing},"), &format!(" 1 {thing}s,")))
}

/// The most runs that are made again because the machine held them up.
const HELD_UP_MOST: usize = 5;

/// Whether a run of a number of scans skipped some, by its own statistics. A simulated plant goes on
/// meanwhile, and the ladder misses parts of it that the page shows: such a run shows the machine.
fn was_held_up(printed: &str) -> bool {
    let skipped = printed.split(" skipped=").nth(1).and_then(|rest| rest.split(' ').next());
    skipped.and_then(|number| number.parse::<u64>().ok()).is_some_and(|number| number > 0)
}

#[test]
fn a_run_with_skipped_scans_is_recognized_by_its_statistics() {
    let line =
        |skipped: u32| format!("x\n… 6.5s scans=650 overruns=1 skipped={skipped} over_us=1\n");
    assert!(was_held_up(&line(3)) && !was_held_up(&line(0)) && !was_held_up("0 errors\n"));
}

/// A page that is executed.
struct Execution {
    folder: PathBuf,
    /// The numbers of a recording; `None`: the numbers on the page must be those printed.
    carried: Option<Carried>,
    differences: Vec<String>,
}

impl Execution {
    /// Runs the commands of a block; returns the block with the outputs of this run.
    fn run_block(&mut self, block: &str) -> String {
        let mut anew = String::new();
        assert!(block.starts_with("$ "), "a console block begins with a command: {block}");
        for session in format!("\n{block}").split("\n$ ").skip(1) {
            let (command, shown) = session.split_once('\n').unwrap_or((session, ""));
            let now = self.carried.as_ref().map(|carried| carried.translate(command));
            let command_now = now.as_deref().unwrap_or(command);
            let mut printed = output(command_now, &self.folder);
            let mut fits = self.fits(shown, &printed);
            for _ in 0..HELD_UP_MOST {
                if fits || !was_held_up(&printed) {
                    break;
                }
                printed = output(command_now, &self.folder);
                fits = self.fits(shown, &printed);
            }
            if !fits {
                let difference = format!("$ {command}\nshown:\n{shown}\nprinted:\n{printed}");
                self.differences.push(difference);
            }
            let kept = fits || shown.contains('…') && !shown.starts_with("…\n");
            let shown = if shown.is_empty() {
                String::new()
            } else {
                format!("{}\n", shown.trim_end_matches('\n'))
            };
            anew.push_str(&format!("$ {command}\n{}", if kept { &shown } else { &printed }));
        }
        anew
    }

    /// Whether an output matches the page. Remembers the numbers of the output.
    fn fits(&mut self, shown: &str, printed: &str) -> bool {
        let (wanted, got): (Vec<&str>, Vec<&str>) =
            (shown.lines().collect(), printed.lines().collect());
        let Some(carried) = &mut self.carried else { return lines_match(&wanted, &got) };
        if wanted.len() == got.len() {
            wanted.iter().zip(&got).for_each(|(wanted, got)| carried.learn(wanted, got));
        }
        let (wanted, got): (Vec<String>, Vec<String>) =
            (wanted.into_iter().map(masked).collect(), got.into_iter().map(masked).collect());
        let (wanted, got): (Vec<&str>, Vec<&str>) =
            (wanted.iter().map(String::as_str).collect(), got.iter().map(String::as_str).collect());
        lines_match(&wanted, &got)
    }
}

#[test]
fn the_commands_of_the_five_minute_tour_print_what_the_page_shows() {
    run_page("docs/start.md");
}

#[test]
fn the_commands_of_the_readme_print_what_it_shows() {
    run_page("README.md");
}

#[test]
fn the_commands_of_the_operator_page_print_what_the_page_shows() {
    run_page("docs/operator.md");
}

#[test]
fn alarms_are_listed_and_acknowledged_as_documented() {
    run_page("docs/alarms.md");
}

#[test]
fn the_audit_trail_is_shown_and_judged_as_documented() {
    run_page("docs/audit.md");
}

#[test]
fn the_commands_of_the_recording_page_print_what_the_page_shows() {
    run_page("docs/record.md");
}

#[test]
fn the_commands_of_the_testing_page_print_what_the_page_shows() {
    run_page("docs/testing.md");
}

#[test]
fn the_commands_of_the_page_about_ladder_plants_print_what_the_page_shows() {
    run_page("docs/ladder-plant.md");
}

#[test]
fn the_commands_of_the_page_about_proofs_print_what_it_shows() {
    run_page("docs/proving.md");
}

#[test]
fn the_commands_of_the_drawing_page_print_what_the_page_shows() {
    run_page("docs/draw.md");
}

#[test]
fn the_commands_of_the_cross_reference_page_print_what_the_page_shows() {
    run_page("docs/xref.md");
}

#[test]
#[cfg(feature = "import")]
fn the_first_hour_with_an_imported_program_goes_as_the_page_shows() {
    run_page("docs/import/README.md");
}

#[test]
#[cfg(feature = "import")]
fn the_commands_of_the_export_page_print_what_the_page_shows() {
    run_page("docs/export.md");
}

#[test]
fn the_commands_of_the_black_box_page_print_what_the_page_shows() {
    run_page("docs/black-box.md");
}

/// The first commands of `README.md`, in three terminals of one folder: the pages have an address,
/// and the feeder has a reason.
#[test]
fn the_first_commands_of_the_readme_work() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md"));
    let page = page.expect("the page");
    let block = page.split("```sh\n").nth(1).and_then(|rest| rest.split("```").next());
    let lines = block.expect("a block").lines().filter_map(|line| line.strip_prefix("cargo run "));
    let command = |line: &str| line.trim_start_matches("-- ").split('#').next().unwrap().to_owned();
    let [run, web, why] = &lines.map(command).collect::<Vec<_>>()[..] else {
        panic!("three commands: {block:?}")
    };
    let folder = workplace("first-commands");
    output(&format!("rungd {run} >rungd.log 2>&1 & sleep 1"), &folder);
    let said = output(&format!("rungd {why}"), &folder);
    let pages = output(
        &format!(
            "rungd {web} --listen 127.0.0.1:0 >web.log 2>&1 & web=$!\n\
             for n in $(seq 300); do grep -q :// web.log && break; sleep 0.2; done\n\
             kill $web; cat web.log"
        ),
        &folder,
    );
    end_controller(&folder);
    assert!(said.starts_with("feeder (Y0) is "), "{said}");
    assert!(pages.contains("http://127.0.0.1:"), "{pages}");
}

/// Ends the controller that a page leaves running.
fn end_controller(folder: &Path) {
    let _ =
        output("pid=$(rungd status | sed -n 's/.*pid \\([0-9]*\\),.*/\\1/p') && kill $pid", folder);
    let _ = fs::remove_dir_all(folder);
}

fn run_page(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    let page = fs::read_to_string(&path).expect("the page");
    let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("a name");
    let folder = workplace(&name.trim_end_matches(".md").replace('/', "-"));
    let carried = RECORDED.contains(&stem).then(Carried::default);
    let mut execution = Execution { folder: folder.clone(), carried, differences: Vec::new() };
    let mut anew = String::new();
    for part in parts(&page) {
        match part {
            Part::Text(text) => anew.push_str(text),
            Part::Console(block) => anew.push_str(&execution.run_block(block)),
            Part::File(name, text) => {
                let body = text.split_once("```").and_then(|(_, body)| body.split_once('\n'));
                let body = body.expect("a body").1;
                let body = if name == "controller.toml" { calm(body) } else { body.to_owned() };
                fs::write(folder.join(name), body).expect("a file");
                anew.push_str(text);
            }
        }
    }
    end_controller(&folder);
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, anew).expect("the page");
    }
    let differences = execution.differences;
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

#[test]
fn dots_match_any_text_and_any_lines() {
    let fits = |shown: &str, printed: &str| {
        let (shown, printed): (Vec<&str>, Vec<&str>) =
            (shown.lines().collect(), printed.lines().collect());
        lines_match(&shown, &printed)
    };
    assert!(fits("a … c\n…\ne", "a b c\nd\nd\ne"));
    assert!(fits("… c …", "b c "));
    assert!(!fits("a … c", "a b d"));
    assert!(!fits("…\ne", "d\ne\nf"));
}
