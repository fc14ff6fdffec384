//! Commands without `--socket`: they find the controller that runs in the folder, else the user's
//! only one, and choose none if several would fit.

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rungd_test_support::folder::TestFolder;
use rungd_test_support::needs::{Need, skip};
use rungd_test_support::patience::PATIENCE;
use rungd_test_support::running::live::{Said, said};

const LADDER: &str = "[ladder]\nname = \"NAME\"\n[[program]]\nname = \"Main\"\n\
                      rung = [ { when = [\"C0\"], do = [\"OUT C1\"] } ]\n";

/// A user's folder, with a project in each of its subfolders, and the list of the controllers.
struct Home(TestFolder);

struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Home {
    fn new(name: &str) -> Home {
        let home = Home(TestFolder::new(name));
        fs::create_dir(home.path().join("list")).unwrap();
        home
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn project(&self, name: &str) {
        let folder = self.path().join(name);
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("ladder.toml"), LADDER.replace("NAME", name)).unwrap();
        let controller = format!(
            "ladder = [\"ladder.toml\"]\noperator.socket = \"{name}.sock\"\nscan.watchdog = \"30s\"\n"
        );
        fs::write(folder.join("controller.toml"), controller).unwrap();
    }

    fn command(&self, binary: &Path, folder: &str, words: &str) -> Command {
        let mut command = Command::new(binary);
        command.args(words.split_whitespace()).current_dir(self.path().join(folder));
        for name in ["RUNGD_LOG", "RUNGD_SOCKET", "RUNTIME_DIRECTORY", "JOURNAL_STREAM"] {
            command.env_remove(name);
        }
        command.env("XDG_RUNTIME_DIR", self.path().join("list"));
        command
    }

    fn say(&self, folder: &str, words: &str) -> Said {
        said(&mut self.command(Path::new(env!("CARGO_BIN_EXE_rungd")), folder, words))
    }

    /// Starts a project's controller from a folder, and waits for its socket.
    fn start(&self, folder: &str, controller: &str) -> Started {
        let rungd = Path::new(env!("CARGO_BIN_EXE_rungd"));
        let mut command = self.command(rungd, folder, &format!("run {controller}"));
        let started = Started(command.stderr(Stdio::null()).spawn().unwrap());
        let name = controller.split('/').rev().nth(1).unwrap_or(folder);
        self.until(folder, &format!("status --socket {}", self.socket(name)));
        started
    }

    fn socket(&self, name: &str) -> String {
        self.path().join(name).join(format!("{name}.sock")).display().to_string()
    }

    fn until(&self, folder: &str, words: &str) {
        let deadline = Instant::now() + PATIENCE;
        while self.say(folder, words).code != 0 {
            assert!(Instant::now() < deadline, "{words}");
            sleep(Duration::from_millis(10));
        }
    }
}

fn ladder(said: &Said) -> &str {
    let line = said.out.lines().find(|line| line.starts_with("  ladder"));
    line.and_then(|line| line.split_whitespace().nth(1)).unwrap_or_else(|| panic!("{said:?}"))
}

#[test]
fn a_command_finds_the_controller_of_its_folder_or_the_only_running_one() {
    let home = Home::new("found");
    ["press", "belt", "elsewhere"].into_iter().for_each(|name| home.project(name));
    let none = home.say("press", "status");
    assert_eq!(none.code, 69, "{none:?}");
    assert!(none.err.contains("no rungd answers at /run/rungd/rungd.sock"), "{none:?}");
    assert!(none.err.lines().count() == 3 && none.err.contains("--socket PATH"), "{none:?}");
    assert!(none.err.lines().all(|line| line.len() <= 100), "{none:?}");

    let press = home.start("", "press/controller.toml");
    // Where it was started, beside its file, and from anywhere while it is the only one.
    for folder in ["", "press", "elsewhere"] {
        assert_eq!(ladder(&home.say(folder, "status")), "press:", "{folder}");
    }
    let belt = home.start("belt", "controller.toml");
    assert_eq!(ladder(&home.say("press", "status")), "press:");
    assert_eq!(ladder(&home.say("belt", "status")), "belt:");
    assert_eq!(ladder(&home.say("", "status")), "press:", "only it was started here");
    let several = home.say("elsewhere", "mode stop");
    assert_eq!((several.code, several.out.as_str()), (2, ""), "{several:?}");
    for name in ["press", "belt"] {
        assert!(several.err.contains(&format!("--socket {}", home.socket(name))), "{several:?}");
    }
    let json = home.say("elsewhere", "status --json").json();
    assert_eq!(json["error"]["kind"], "several");
    for words in ["web --listen 127.0.0.1:0", "why C1", "write C0 1"] {
        assert_eq!(home.say("elsewhere", words).code, 2, "{words}");
    }

    // A process that was killed leaves its socket and its entry. In its own folder nothing takes
    // its place.
    drop(press);
    assert_eq!(ladder(&home.say("elsewhere", "status")), "belt:", "now it is the only one");
    let entries = || fs::read_dir(home.path().join("list/rungd-running")).unwrap().count();
    assert_eq!(entries(), 2);
    drop(belt);
    let _press = home.start("press", "controller.toml");
    assert_eq!(entries(), 1, "what is left over is removed");
    assert_eq!(ladder(&home.say("belt", "status")), "press:");
}

#[test]
fn the_folder_of_a_killed_controller_is_not_answered_by_another_controller() {
    let home = Home::new("found-killed");
    ["press", "belt"].into_iter().for_each(|name| home.project(name));
    let file = home.path().join("press/controller.toml");
    let text = fs::read_to_string(&file).unwrap().replace("press.sock", "rungd.sock");
    fs::write(&file, text).unwrap();
    let rungd = Path::new(env!("CARGO_BIN_EXE_rungd"));
    let mut run = home.command(rungd, "press", "run controller.toml");
    let press = Started(run.stderr(Stdio::null()).spawn().unwrap());
    home.until("press", "status");
    drop(press);
    let _belt = home.start("belt", "controller.toml");
    let wrong = home.say("press", "write C0 1");
    assert_eq!(wrong.code, 69, "{wrong:?}");
    assert!(wrong.err.contains("these of yours run"), "{wrong:?}");
    assert!(wrong.err.contains(&home.socket("belt")), "{wrong:?}");
}

#[test]
fn a_change_names_the_controller_that_it_reaches() {
    let home = Home::new("found-told");
    ["press", "elsewhere"].into_iter().for_each(|name| home.project(name));
    let _press = home.start("", "press/controller.toml");
    let here = home.say("", "write C0 1");
    assert_eq!(here.code, 0, "{here:?}");
    assert_eq!(
        here.err,
        "rungd: to press/controller.toml, which runs in this folder (--socket press/press.sock)\n"
    );
    let only = home.say("elsewhere", "force C0 off");
    let told = format!("your only running controller (--socket {})", home.socket("press"));
    assert!(only.code == 0 && only.err.contains(&told), "{only:?}");
    for words in ["mode stop", "mode run", "reload", "unforce --all", "ack --all"] {
        let said = home.say("elsewhere", words);
        assert!(said.err.contains(&told), "{words}: {said:?}");
    }
    let named = home.say("", &format!("write C0 0 --socket {}", home.socket("press")));
    assert_eq!((named.code, named.err.as_str()), (0, ""));
    assert_eq!(home.say("elsewhere", "read C0").err, "", "reading is silent");
}

#[test]
fn a_list_of_controllers_writable_by_others_is_not_used() {
    let home = Home::new("found-open");
    ["press", "elsewhere"].into_iter().for_each(|name| home.project(name));
    let list = home.path().join("list/rungd-running");
    let press = home.start("press", "controller.toml");
    assert_eq!(home.say("elsewhere", "status").code, 0);
    fs::set_permissions(&list, Permissions::from_mode(0o770)).unwrap();
    assert_eq!(home.say("elsewhere", "status").code, 69);
    drop(press);
    let _press = home.start("press", "controller.toml");
    assert_eq!(home.say("elsewhere", "status").code, 69, "and not written");
}

/// Needs root, to become another user.
#[test]
fn a_socket_of_another_user_is_used_only_if_it_is_named() {
    if fs::metadata("/proc/self").map(|of| std::os::unix::fs::MetadataExt::uid(&of)).unwrap() != 0 {
        return skip(Need::Root, "only root becomes another user");
    }
    let home = Home::new("found-users");
    ["press", "elsewhere"].into_iter().for_each(|name| home.project(name));
    let rungd = home.path().join("rungd");
    let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_rungd")).arg(&rungd).status();
    assert!(copied.unwrap().success());
    chown(home.path().join("list"), Some(65_534), Some(65_534)).unwrap();
    fs::set_permissions(home.path(), Permissions::from_mode(0o755)).unwrap();
    // The user may not write beside the controller file.
    let nobody = |folder: &str, words: &str| {
        let mut command = home.command(&rungd, folder, words);
        command.uid(65_534).gid(65_534);
        command
    };
    let mut run = nobody("press", "run controller.toml");
    let _press = Started(run.stderr(Stdio::null()).spawn().unwrap());
    let deadline = Instant::now() + PATIENCE;
    while said(&mut nobody("press", "status")).code != 0 {
        assert!(Instant::now() < deadline, "{:?}", said(&mut nobody("press", "status")));
        sleep(Duration::from_millis(10));
    }
    let socket = home.path().join("list/rungd-running/press.sock");
    assert!(socket.exists() && !home.path().join("press/press.sock").exists());
    // Root reads neither the list nor the socket of this user.
    assert_eq!(home.say("press", "status").code, 69);
    let named = home.say("press", &format!("status --socket {}", socket.display()));
    assert_eq!(ladder(&named), "press:");
    // As if the user had put a socket where root works.
    std::os::unix::fs::symlink(&socket, home.path().join("elsewhere/rungd.sock")).unwrap();
    assert_eq!(home.say("elsewhere", "status").code, 69);
    fs::remove_file(home.path().join("elsewhere/rungd.sock")).unwrap();
    let listener = std::os::unix::net::UnixListener::bind(home.path().join("elsewhere/rungd.sock"));
    let _listener = listener.unwrap();
    chown(home.path().join("elsewhere/rungd.sock"), Some(65_534), None).unwrap();
    let foreign = home.say("elsewhere", "status");
    assert_eq!(foreign.code, 69);
    assert!(foreign.err.contains("this folder's is a different user's"), "{foreign:?}");
}

#[test]
fn every_shipped_controller_has_a_socket_beside_its_file() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
    let mut count = 0;
    for entry in fs::read_dir(&config).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "toml") {
            let text = fs::read_to_string(&path).unwrap();
            let name = path.file_stem().unwrap().to_str().unwrap();
            assert!(text.contains(&format!("\noperator.socket = \"{name}.sock\"\n")), "{name}");
            count += 1;
        }
    }
    assert!(count > 10, "{count}");
    for name in ["lift-station.toml", "bottling-plant.toml"] {
        assert!(fs::read_to_string(config.join(name)).unwrap().contains("\n[[panel]]\n"), "{name}");
    }
}
