//! Compares the cross-reference of every shipped ladder with the engine.

use std::path::Path;
use std::sync::Arc;

use rungd_config::load;
use rungd_history::observe::Subject;
use rungd_history::observe::tests::uses::compare;

fn subject(path: &Path) -> Option<Subject> {
    let loaded = match load::is_controller_file(path).expect("readable") {
        true => load::controller_file(path).expect("readable"),
        false => load::ladder_files(&[path.to_owned()]).expect("readable"),
    };
    let program = loaded.program?;
    Some(Subject::new(Arc::new(program), loaded.files))
}

#[test]
fn no_reader_of_a_shipped_ladder_is_missing() {
    let config = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("config");
    let mut compared = 0;
    for folder in [config.clone(), config.join("programs"), config.join("lib")] {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|of| of == "toml")
                && let Some(subject) = subject(&path)
            {
                compared += compare(&subject, &path.display().to_string());
            }
        }
    }
    assert!(compared > 800, "{compared} places compared");
}
