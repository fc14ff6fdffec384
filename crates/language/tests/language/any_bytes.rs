//! No bytes cause a panic: neither as a ladder file, a controller file or a test file, nor when
//! findings are printed.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use proptest::prelude::*;
use rungd_config::controller;
use rungd_config::controller::resolve_controller;
use rungd_config::load::decode;
use rungd_lab::testing::read_suite;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::file_kind;
use rungd_language::source::finding::Severity;
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::{FileId, SourceFile};

/// Pieces of ladder and controller files; joined at random they reach far more code than noise
/// does.
const PIECES: &[&str] = &[
    "[[program]]\nname = \"Main\"\n",
    "[[program]]\nname = \"Drain\"\nautostart = true\n",
    "[[program.rung]]\n",
    "[[program.stage]]\nname = \"Open\"\n",
    "[[program.stage.rung]]\n",
    "[[program.stage.rung.branch]]\n",
    "[[program.rung.branch]]\n",
    "[[task]]\nname = \"FirstScan\"\n",
    "[[task.rung]]\n",
    "[program.rung.leg]\n",
    "[tags]\n",
    "[tags.jam]\nat = \"C0\"\n",
    "[ladder]\norder = [\"Main\", \"Drain\", \"Main\"]\n",
    "part = { at = \"X0\", initial = true }\n",
    "bottles = { at = \"CT0\" }\n",
    "size = { at = \"D1\", min = 1, max = -1, initial = 9 }\n",
    "slow = { value = \"2s500ms\" }\n",
    "when = [\"part\", \"!(bottles.Done | rise(X1)) & D0 >= 5\"]\n",
    "when = \"$On\"\n",
    "leg.up = [\"part\"]\n",
    "leg.rst = [\"$Off\"]\n",
    "leg = 5\n",
    "do = [\"OUT Y0\", \"CNT bottles preset=size\"]\n",
    "do = [\"SGCONVRG Open Open to=Open\", \"MOVE N,0,7 to=size\"]\n",
    "do = [\"TMR T0 preset=slow\", \"RUN Drain\", \"ENTASK FirstScan every=1s\"]\n",
    "ladder = [\"a.toml\"]\n",
    "[scan]\nperiod = \"10ms\"\n[realtime]\npolicy = \"fifo\"\npriority = 7\ncpus = [1]\ncpu-latency = \"5us\"\n",
    "[outputs]\non = [\"Y0..Y9\"]\nhold = [\"Y9..Y0\", \"part\"]\n",
    "[retain]\nranges = [\"CT8..CT15\", \"..\", \"D0..\"]\n",
    "[modbus-server]\nlisten = \"x\"\nwritable = [\"MC1..MC9\"]\n",
    "[modbus-server.image]\ninputs = { from = \"MC1..MC8\", to = \"X0..X7\" }\n",
    "[[modbus-server.map]]\noperand = \"D0..D9\"\ntable = \"holding\"\naddress = 65530\n",
    "[[modbus-server.map]]\noperand = \"part\"\ntable = \"coil\"\naddress = 0\nunit = 9\n",
    "[[modbus-server.write]]\nranges = [\"D0\"]\nclients = [\"10.0.0.0/99\", \"::/0\"]\n",
    "units = []\nstandard-map = false\n",
    "[[simulated-device]]\ninput = \"X0\"\nfollows = \"Y0\"\n",
    "[memory]\nX = 1\n",
    "allow = [\"unused-tag\", \"nonsense\"]\n",
    "recipe = { at = \"D10\", count = 7, initial = [1, 2] }\n",
    "gate = { type = \"bit\", count = 4096 }\n",
    "do = [\"MATH recipe[size] = sum(recipe[0..2]) / gate[1]\", \"COPY recipe to=gate[0..6]\", \"SR gate\"]\n",
    "[[template]]\nname = \"Pump\"\n",
    "[template.parameters]\non = { type = \"contact\" }\nof = { type = \"array\" }\n",
    "[template.tags]\nseen = { type = \"bit\", alarm = \"{name}\" }\n",
    "[[template.rung]]\n",
    "when = [\"on & seen\", \"of[size] > 3\"]\n",
    "use = \"Pump\"\nname = \"p1\"\n",
    "with = { on = \"part | X3\", of = \"recipe[1..3]\" }\n",
    "x = { a = 1,\n b.c = 2, }\n",
    "\u{feff}",
    "doc = \"\"\"\nü\t\\e\n\"\"\"\n",
    "# \u{1F980}\r\n",
    "ladder = [\"suites/crates.toml\"]\nperiod = \"10ms\"\n",
    "controller = \"suites/rungd.toml\"\n",
    "always = [\"pusher & (size + 1) * 2 - 3 > -level\", \"!!rise(bottle | gate[step])\"]\n",
    "[[scenario]]\nname = \"a\"\nset = { size = 3, bottle = true, \"late.Acc\" = \"2s\", X = [] }\n",
    "steps = [\"set size 9\", \"pulse bottle 1s every 2s times 3\", \"run 2 scan\", \"within 2s: X0\"]\n",
    "steps = [\"reload suites/crates.toml\", \"expect: step - 1 == recipe[step]\", \"lose\"]\n",
    "[[random]]\nname = \"b\"\nruns = 3\nscans = 4\n",
    "change = { start = \"1%\", level = { walk = \"0..9\", step = 1, chance = \"2%\" }, size = 3 }\n",
    "[prove]\n",
    "= [ \" ] }",
];

fn feed(bytes: &[u8]) {
    let (text, finding) = decode(bytes, FileId(0));
    let files = [SourceFile { name: "fuzz.toml".to_owned(), text }];
    let (program, mut findings) = load_ladders(&files, &LoadOptions::default());
    findings.extend(finding);
    let (written, found) = controller::read(&files[0].text, FileId(0));
    findings.extend(found);
    if let Some(written) = written {
        let program = program.unwrap_or_default();
        findings.extend(resolve_controller(&written, &program).1);
    }
    file_kind::is_controller(&files[0].text);
    feed_test(bytes);
    let shown = render(&findings, &files, Style::default());
    assert!(shown.ends_with(" warnings\n") || shown.ends_with(" warning\n"));
    assert!(!shown.contains('\u{1b}'));
}

/// Makes a folder with the ladders of `tests/suites`.
fn suites() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("any-bytes");
        std::fs::create_dir_all(folder.join("suites")).expect("a folder");
        for name in ["crates.toml", "rungd.toml"] {
            let from = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
                .join("tests/suites")
                .join(name);
            std::fs::copy(from, folder.join("suites").join(name)).expect("a copy");
        }
        folder
    })
}

/// Reads the bytes as a test file.
fn feed_test(bytes: &[u8]) {
    let name =
        format!("rungd-any-{}-{:?}.test.toml", std::process::id(), std::thread::current().id());
    let folder = suites();
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a file");
    let read = read_suite(&path).expect("it was written");
    std::fs::remove_file(&path).expect("it was written");
    let errors = read.findings.iter().any(|finding| finding.severity() == Severity::Error);
    assert_eq!(read.suite.is_none(), errors);
    let shown = render(&read.findings, &read.files, Style::default());
    assert!(!shown.contains('\u{1b}'));
}

proptest! {
    #[test]
    fn random_bytes_do_not_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        feed(&bytes);
    }

    #[test]
    fn random_text_does_not_panic(text in "[\\[\\]{}a-z\"'.=,#\\\\ \n0-9]{0,80}") {
        feed(text.as_bytes());
    }

    #[test]
    fn random_pieces_of_toml_do_not_panic(
        pieces in proptest::collection::vec(proptest::sample::select(PIECES), 0..16),
    ) {
        feed(pieces.concat().as_bytes());
    }

    #[test]
    fn random_pieces_with_one_wrong_byte_do_not_panic(
        pieces in proptest::collection::vec(proptest::sample::select(PIECES), 1..10),
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
    ) {
        let mut bytes = pieces.concat().into_bytes();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        feed(&bytes);
    }
}

#[test]
fn deep_nesting_does_not_panic() {
    for text in [
        format!("a = {}", "[".repeat(100_000)),
        format!("a = {}1{}", "[".repeat(1_000), "]".repeat(1_000)),
        format!("a = {}", "{a=".repeat(50_000)),
        format!("{} = 1", "a.".repeat(20_000)),
        format!("[[{}a]]", "a.".repeat(5_000)),
    ] {
        feed(text.as_bytes());
    }
}
