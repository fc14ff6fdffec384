//! The package's statements about its libraries: their licences' texts, and the bill of materials.
//! The package contains every page, with its diagrams.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use serde_json::Value;

use rungd_test_support::folder::TestFolder;

/// The output of `third-party.sh`: several tests read it, and it takes seconds.
static LICENCES: LazyLock<String> = LazyLock::new(|| printed_by("third-party.sh"));

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn printed_by(script: &str) -> String {
    let output = Command::new(root().join("packaging").join(script)).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Name and version of every library of the bill.
fn libraries(bill: &Value) -> BTreeSet<String> {
    let components = bill["components"].as_array().unwrap();
    let name =
        |c: &Value| format!("{} {}", c["name"].as_str().unwrap(), c["version"].as_str().unwrap());
    components.iter().map(name).collect()
}

#[test]
fn the_bill_of_materials_lists_every_library_with_checksum_and_dependents() {
    let bill: Value = serde_json::from_str(&printed_by("sbom.sh")).unwrap();
    assert_eq!((&bill["bomFormat"], &bill["specVersion"]), (&"CycloneDX".into(), &"1.5".into()));
    let own = &bill["metadata"]["component"];
    assert_eq!(
        (&own["name"], &own["version"]),
        (&"rungd".into(), &env!("CARGO_PKG_VERSION").into())
    );
    for component in bill["components"].as_array().unwrap() {
        let hash = component["hashes"][0]["content"].as_str().unwrap_or_default();
        let licence = component["licenses"][0]["expression"].as_str().unwrap_or_default();
        assert!(hash.len() == 64 && !licence.is_empty(), "{component}");
    }
    let mut wanted = BTreeSet::new();
    for dependency in bill["dependencies"].as_array().unwrap() {
        let on = dependency["dependsOn"].as_array().unwrap().iter();
        wanted.extend(on.map(|on| on.as_str().unwrap().to_owned()));
    }
    let components = bill["components"].as_array().unwrap();
    let all = components.iter().map(|c| c["bom-ref"].as_str().unwrap().to_owned()).collect();
    assert_eq!(wanted, all, "everything is wanted by something");

    let licences = &*LICENCES;
    let list = licences.split("\n\n").nth(1).unwrap();
    let listed = list.lines().map(|line| line.split_once(": ").unwrap().0.to_owned());
    assert_eq!(libraries(&bill), listed.collect());
    for library in libraries(&bill) {
        assert!(licences.contains(&format!("{library} (")), "no licence's text for {library}");
    }
}

#[test]
fn the_page_names_every_library_without_a_licence_file() {
    const NONE: &str = "(it ships none: taken under Apache-2.0)";
    let owners = LICENCES.lines().filter(|line| line.contains(NONE));
    let owners = owners.flat_map(|line| line.split(", ")).filter(|owner| owner.ends_with(NONE));
    let found: BTreeSet<&str> = owners.filter_map(|owner| owner.split(' ').next()).collect();

    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let page = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let (before, _) = page.split_once(" ship no licence file;").unwrap();
    let names = before.rsplit(". ").next().unwrap();
    let named: BTreeSet<&str> = names.split('`').skip(1).step_by(2).collect();
    assert_eq!(found, named, "ARCHITECTURE.md, *Dependencies*");
}

#[test]
fn the_package_lists_no_file_twice() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let assets = manifest.split("\nassets = [\n").nth(1).unwrap().split("\n]").next().unwrap();
    let mut times: BTreeMap<&str, u32> = BTreeMap::new();
    assets.lines().for_each(|line| *times.entry(line).or_default() += 1);
    times.retain(|_, times| *times > 1);
    assert!(times.is_empty(), "{times:#?}");
}

/// Whether an asset includes a file. `*` in the asset stands for a file name, `**/*` for files in
/// any folder below.
fn takes(asset: &str, path: &str) -> bool {
    if let Some(folder) = asset.strip_suffix("**/*") {
        return path.starts_with(folder);
    }
    let Some((before, behind)) = asset.split_once('*') else { return asset == path };
    let name = path.strip_prefix(before).and_then(|rest| rest.strip_suffix(behind));
    name.is_some_and(|name| !name.contains('/'))
}

#[test]
fn every_file_of_the_docs_is_in_the_package() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let assets: Vec<&str> = manifest.split('"').filter(|word| word.starts_with("docs/")).collect();
    let mut folders = vec![root().join("docs")];
    let mut missing = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(root()).unwrap().display().to_string();
            if !assets.iter().any(|asset| takes(asset, &name)) {
                missing.push(name);
            }
        }
    }
    assert!(missing.is_empty(), "{missing:?}");
}

/// `systemctl enable` makes links that deb-systemd-helper does not know.
#[test]
fn a_purge_removes_only_the_links_of_enabled_units() {
    let script = fs::read_to_string(root().join("packaging/deb/postrm")).unwrap();
    let begin = script.find("    for unit in ").expect("the loop");
    let end = begin + script[begin..].find("\n    done\n").expect("its end");
    let folder = TestFolder::new("purge");
    let system = folder.path().join("etc/systemd/system");
    let body = script[begin..end].replace("/etc/systemd/system", &system.display().to_string());
    let links = ["multi-user.target.wants/rungd-web.service", "a.target.requires/rungd.service"];
    let other = "multi-user.target.wants/cron.service";
    for link in links.iter().chain([&other]) {
        fs::create_dir_all(system.join(link).parent().unwrap()).unwrap();
        std::os::unix::fs::symlink("/nonexistent", system.join(link)).unwrap();
    }
    let shell = Command::new("sh").args(["-ec", &format!("{body}\ndone")]).status();
    assert!(shell.unwrap().success());
    for link in links {
        assert!(fs::symlink_metadata(system.join(link)).is_err(), "{link}");
    }
    assert!(fs::symlink_metadata(system.join(other)).is_ok(), "{other}");
    assert!(!system.join("a.target.requires").exists(), "an empty folder");
}

/// The extension gets the schemas and the checks of the rungd on the PATH; of a different version it
/// would get wrong ones.
#[test]
fn the_extension_is_built_only_with_a_rungd_of_the_same_version() {
    let folder = TestFolder::new("vsix");
    let stub = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    };
    // The first step with rungd is `node test.js RUNGD`.
    stub("node", "echo \"node got $2\"; exit 7");
    let packed = || {
        let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap());
        let mut command = Command::new(root().join("editors/vscode/package.sh"));
        command.env("PATH", path).env("RUNGD_VSIX", folder.path().join("x.vsix"));
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
    };
    stub("rungd", &format!("echo rungd {}", env!("CARGO_PKG_VERSION")));
    let own = folder.path().join("rungd");
    let (code, said) = packed();
    assert!(code == Some(7) && said.contains(&format!("node got {}", own.display())), "{said}");
    stub("rungd", "echo rungd 9.8.7");
    let (code, said) = packed();
    assert!(code == Some(1) && said.contains("cargo build --release"), "{said}");
    assert!(said.contains("rungd 9.8.7") && !said.contains("node got"), "{said}");
}
