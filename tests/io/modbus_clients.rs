//! The Modbus server with foreign clients: mbpoll, pymodbus, libmodbus.
//!
//! The examples of `docs/modbus.md` are executed: `rungd run` runs its controller file, its
//! commands are run, and their output must be the output on the page. If a client is not installed,
//! its test prints that and does nothing, unless `RUNGD_REQUIRE` names `programs`.

use rungd_test_support::calm::calm;
use rungd_test_support::needs::{usable, works};
use rungd_test_support::page;
use rungd_test_support::patience::PATIENCE;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

/// The page's controller, run by the real program.
struct Controller {
    rungd: Child,
    log: Receiver<String>,
    port: String,
    folder: PathBuf,
}

impl Controller {
    /// Starts the controller on a port that the system chooses, and waits for its first scan.
    fn start(page: &str, test: &str) -> Controller {
        Controller::of(page, test, "filler")
    }

    /// Starts the controller of `NAME-controller.toml`, with its ladder.
    fn of(page: &str, test: &str, name: &str) -> Controller {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
        fs::create_dir_all(&folder).unwrap();
        let file = format!("{name}-controller.toml");
        for name in [&format!("{name}.toml"), &file] {
            let mut text = page::file(page, name).replace("127.0.0.1:1502", "127.0.0.1:0");
            if !text.contains("listen") {
                let header = "[modbus-server]\n";
                text = text.replacen(header, &format!("{header}listen = \"127.0.0.1:0\"\n"), 1);
            }
            let text = if *name == file { calm(&text) } else { text };
            fs::write(folder.join(name), text).unwrap();
        }
        let mut rungd = Command::new(env!("CARGO_BIN_EXE_rungd"))
            .args(["run", "--log-format", "text", &file])
            .current_dir(&folder)
            .env_remove("RUNGD_LOG")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (tell, log) = channel();
        let lines = BufReader::new(rungd.stderr.take().unwrap()).lines().map_while(Result::ok);
        thread::spawn(move || lines.for_each(|line| drop(tell.send(line))));
        let mut controller = Controller { rungd, log, port: String::new(), folder };
        let listens = controller.expect("Modbus server listens");
        let port = listens.split_once("address=127.0.0.1:").expect("its address").1;
        controller.port = port.split_whitespace().next().expect("its port").to_owned();
        controller.expect("RUN: ");
        controller
    }

    /// Waits for the next line of the log that contains `part`.
    fn expect(&mut self, part: &str) -> String {
        let mut seen = Vec::new();
        while let Ok(line) = self.log.recv_timeout(PATIENCE) {
            if line.contains(part) {
                return line;
            }
            seen.push(line);
        }
        panic!("{part:?} is not in the log: {seen:#?}");
    }

    /// Runs a command of the page with the controller's port.
    fn client(&self, program: &str, option: &str, text: &str) -> Output {
        let text = text.replace("1502", &self.port);
        Command::new(program).args([option, &text]).output().unwrap()
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        let _ = self.rungd.kill();
        let _ = self.rungd.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Whether a client is installed, and has what its test needs.
fn installed(client: &str, probe: &[&str]) -> bool {
    usable(works(client, Command::new(probe[0]).args(&probe[1..])))
}

/// The names of the page's script that earlier versions lack.
const PYMODBUS: &str = "import inspect; from pymodbus.client import ModbusTcpClient as client; \
                        inspect.signature(client.write_coil).parameters['device_id']";

/// Every line, with its words one space apart.
fn words(text: &str) -> Vec<String> {
    text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
}

fn everything(output: &Output) -> String {
    [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat()
}

#[test]
fn mbpoll_prints_what_the_page_shows() {
    if !installed("mbpoll", &["mbpoll", "-h"]) {
        return;
    }
    let page = page::text("modbus.md");
    let mut controller = Controller::start(&page, "mbpoll");
    let session = page::blocks(&page, "console").join("");
    let mut commands = 0;
    for exchange in session.split("$ ").skip(1) {
        let (command, shown) = exchange.split_once('\n').expect("a command's line");
        let output = controller.client("sh", "-c", command);
        let printed = everything(&output);
        let mut lines = words(&printed).into_iter();
        for line in words(shown) {
            assert!(lines.any(|printed| printed == line), "{command}: {line}\n{printed}");
        }
        commands += 1;
    }
    assert!(commands >= 7, "the page's session was found: {commands} commands");
    controller.expect("write refused: MHR10 takes 1 to 500, not 501");
    controller.expect("write refused: MC10 is not in `writable`");
}

#[test]
fn pymodbus_prints_what_the_page_shows() {
    if !installed("pymodbus", &["python3", "-c", PYMODBUS]) {
        return;
    }
    let page = page::text("modbus.md");
    let controller = Controller::start(&page, "pymodbus");
    let script = page::blocks(&page, "python").concat();
    let output = controller.client("python3", "-c", &script);
    let shown = page::blocks(&page, "text").concat();
    assert_eq!(String::from_utf8_lossy(&output.stdout), shown, "{}", everything(&output));
}

/// Compiles a C program of `tests/clients/`; `None` if its library is not installed.
fn compiled(source: &str, library: &str) -> Option<PathBuf> {
    let has_library = installed(library, &["pkg-config", "--exists", library]);
    if !has_library || !installed("cc", &["cc", "--version"]) {
        return None;
    }
    let flags = Command::new("pkg-config").args(["--cflags", "--libs", library]).output().unwrap();
    let flags = String::from_utf8(flags.stdout).unwrap();
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("client-of-libmodbus");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients").join(source);
    let mut cc = Command::new("cc");
    cc.args(["-Wall", "-Werror", "-o"]).arg(&program).arg(source).args(flags.split_whitespace());
    let output = cc.output().unwrap();
    assert!(output.status.success(), "{}", everything(&output));
    Some(program)
}

#[test]
fn libmodbus_reads_and_writes_the_map_of_the_page() {
    let Some(program) = compiled("libmodbus.c", "libmodbus") else { return };
    let page = page::text("modbus.md");
    let mut controller = Controller::of(&page, "libmodbus", "mixer");
    let output = Command::new(program).arg(&controller.port).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout), "ok\n", "{}", everything(&output));
    controller.expect("write refused: CT0.Acc needs a write to both of its registers");
}

#[test]
fn the_files_of_the_modbus_page_pass_the_check() {
    let page = page::text("modbus.md");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lists");
    fs::create_dir_all(&folder).unwrap();
    for name in ["filler.toml", "lists-controller.toml"] {
        fs::write(folder.join(name), page::file(&page, name)).unwrap();
    }
    let mut rungd = Command::new(env!("CARGO_BIN_EXE_rungd"));
    let output = rungd.arg("check").arg(folder.join("lists-controller.toml")).output().unwrap();
    assert!(output.status.success(), "{}", everything(&output));
}
