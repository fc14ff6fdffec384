//! Neovim with the configuration of `docs/editors.md`, and the real binary. `neovim/drive.lua`
//! calls Neovim's own functions, as a user's keys would; this file checks what they show and
//! change.
//!
//! Without Neovim the test prints the reason and passes, unless `RUNGD_REQUIRE` names `programs`.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::editor::project::{CONTROLLER, LADDER, TEST, folder};
use rungd_test_support::needs::{neovim as probe, usable};
use rungd_test_support::page;

/// The time limit for Neovim. It is far longer than needed: the driver itself gives up earlier.
const SECONDS_MAX: &str = "900";

/// The code block of the page that begins with this comment.
fn configuration(first: &str) -> String {
    let blocks = page::blocks(&page::text("editors.md"), "lua");
    let block = blocks.into_iter().find(|block| block.starts_with(first));
    block.unwrap_or_else(|| panic!("no block of the page begins with {first:?}"))
}

fn is_installed() -> bool {
    usable(probe(Path::new("nvim")))
}

/// Runs Neovim in a folder with this configuration, and without the user's own.
fn neovim(folder: &Path, init: &str, arguments: &[&str]) {
    std::fs::write(folder.join("init.lua"), init).unwrap();
    let rungd = Path::new(env!("CARGO_BIN_EXE_rungd")).parent().unwrap();
    let path = format!("{}:{}", rungd.display(), std::env::var("PATH").unwrap_or_default());
    let run = Command::new("timeout")
        .args([SECONDS_MAX, "nvim", "--headless", "-u", "init.lua", "-i", "NONE", "-n"])
        .args(arguments)
        .current_dir(folder)
        .env("PATH", path)
        .env("HOME", folder)
        .env("XDG_CONFIG_HOME", folder.join("config"))
        .env("XDG_STATE_HOME", folder.join("state"))
        .env("XDG_DATA_HOME", folder.join("data"))
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .env("RUNGD_RESULT", folder.join("result.json"))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert!(run.status.success(), "{run:?}");
}

/// The results of the driver.
fn driven() -> Value {
    let folder = folder();
    let driver = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/editor/neovim/drive.lua");
    let does = format!("luafile {}", driver.display());
    let init = configuration("-- init.lua, Neovim 0.7\n");
    neovim(folder.path(), &init, &[LADDER, "-c", &does]);
    let text = std::fs::read_to_string(folder.path().join("result.json")).unwrap();
    let seen: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(seen["failure"], Value::Null, "{}", seen["failure"].as_str().unwrap_or_default());
    seen
}

#[test]
fn neovim_shows_finds_renames_and_formats() {
    if !is_installed() {
        return;
    }
    let seen = driven();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();

    let message = text(&seen["finding"]["message"]);
    assert!(message.contains("`valvve`") && message.contains("`valve`"), "{message}");
    let correction = text(&seen["corrections"][0]);
    assert!(correction.contains("`valve`"), "{}", seen["corrections"]);
    let offered: Vec<String> = seen["completion"].as_array().unwrap().iter().map(text).collect();
    assert!(offered.contains(&"valve".to_owned()), "{offered:?}");
    assert!(text(&seen["hover"]).contains("Opens the tank"), "{}", seen["hover"]);
    assert!(text(&seen["definition"]).starts_with("valve = { at = \"Y0\""), "{seen}");

    let renamed = |name: &str| text(&seen["renamed"][name]);
    assert!(renamed(CONTROLLER).contains("on = [\"gate\"]"), "{seen}");
    assert!(renamed(TEST).contains("expect: gate"), "{seen}");
    let ladder = renamed(LADDER);
    assert!(ladder.contains("wanted = \"start & gate\"") && !ladder.contains("valve"), "{ladder}");
    assert_eq!(text(&seen["formatted"]), rungd_language::format::formatted(&ladder).unwrap());
}

/// The installed Neovim may be too old for this configuration, so the functions that it may lack
/// are replaced.
#[test]
fn the_configuration_for_newer_neovim_is_valid_lua_and_names_the_server() {
    if !is_installed() {
        return;
    }
    let folder = folder();
    let stand_in = r#"
local seen = {}
vim.lsp.config = function(name, of) seen[name] = of end
vim.lsp.enable = function(name)
    vim.fn.writefile({ vim.json.encode(seen[name]) }, os.getenv('RUNGD_RESULT'))
end
vim.api.nvim_set_hl = function() end
"#;
    let init = stand_in.to_owned() + &configuration("-- init.lua, Neovim 0.11\n");
    neovim(folder.path(), &init, &["-c", "qa!"]);
    let text = std::fs::read_to_string(folder.path().join("result.json")).unwrap();
    let seen: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(seen["cmd"], serde_json::json!(["rungd", "lsp"]));
    assert_eq!(seen["filetypes"], serde_json::json!(["toml"]));
}
