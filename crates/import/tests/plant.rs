//! An imported project in virtual time.

use rungd_config::load::{self, Loaded};
use rungd_engine::EngineCall;
use rungd_import::model::ForeignProject;
use rungd_import::write::{CONTROLLER, files};
use rungd_language::source::finding::Severity;
use rungd_language::source::render::{Style, render};
use rungd_test_support::folder::TestFolder;
use rungd_test_support::plc::Plc;

/// The files of a project, loaded as `rungd run` does.
pub fn loaded(project: &ForeignProject) -> Loaded {
    let folder = TestFolder::new("import");
    for file in files(project) {
        let path = folder.path().join(&file.path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, &file.text).unwrap();
    }
    load::controller_file(&folder.path().join(CONTROLLER)).unwrap()
}

/// The findings of a project that are errors, as they are printed.
pub fn errors(project: &ForeignProject) -> String {
    let mut loaded = loaded(project);
    loaded.findings.retain(|finding| finding.severity() == Severity::Error);
    match loaded.findings.is_empty() {
        true => String::new(),
        false => render(&loaded.findings, &loaded.files, Style::default()),
    }
}

/// The text of all ladder files, for messages.
pub fn texts(project: &ForeignProject) -> String {
    let own = |file: &rungd_import::write::WrittenFile| {
        file.path.ends_with(".toml") && !file.path.ends_with("logix.toml")
    };
    let files = files(project).into_iter().filter(own);
    files.map(|file| format!("# {}\n{}\n", file.path, file.text)).collect()
}

/// A started controller with an imported project, before its first scan.
pub fn started(project: &ForeignProject) -> Plc {
    let errors = errors(project);
    assert!(errors.is_empty(), "{errors}\n{}", texts(project));
    let mut plc = Plc::of(loaded(project).program.expect("no finding is an error"));
    plc.engine.start(0);
    plc
}

/// Makes a scan that begins at a time, with values that are written before it.
pub fn scan(plc: &mut Plc, now_ms: u64, changes: &[(String, i32)]) {
    plc.now_ns = now_ms * 1_000_000;
    plc.engine.begin_scan(plc.now_ns, &plc.times, &plc.local);
    for (name, value) in changes {
        let cell = plc.cell(name);
        plc.engine.apply(EngineCall::Write(cell, *value));
    }
    plc.engine.execute();
}
