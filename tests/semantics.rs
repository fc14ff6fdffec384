//! Runs the cases of `tests/semantics/*.toml`, each as a named test: `cargo test --test semantics
//! cnt-` runs those whose names contain `cnt-`. `tests/README.md` describes the form of a case.

#![allow(unsafe_code, clippy::wildcard_enum_match_arm)]

use std::process::ExitCode;

use rungd_test_support::{case, run};

/// The request of the command line. Other switches of test programs are accepted and ignored.
#[derive(Default)]
struct Wanted {
    filters: Vec<String>,
    skips: Vec<String>,
    exact: bool,
    list: bool,
    quiet: bool,
}

impl Wanted {
    fn from_arguments() -> Wanted {
        let mut wanted = Wanted::default();
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--exact" => wanted.exact = true,
                "--list" => wanted.list = true,
                "--quiet" | "-q" => wanted.quiet = true,
                "--skip" => wanted.skips.extend(arguments.next()),
                "--test-threads" | "--format" | "--color" | "--logfile" | "-Z" => {
                    arguments.next();
                }
                other if other.starts_with('-') => {}
                filter => wanted.filters.push(filter.to_owned()),
            }
        }
        wanted
    }

    fn takes(&self, name: &str) -> bool {
        let hit = |pattern: &String| {
            if self.exact { name == pattern } else { name.contains(pattern.as_str()) }
        };
        (self.filters.is_empty() || self.filters.iter().any(hit)) && !self.skips.iter().any(hit)
    }
}

fn main() -> ExitCode {
    let wanted = Wanted::from_arguments();
    let cases = match case::all() {
        Ok(cases) => cases,
        Err(error) => {
            println!("error: {error}");
            return ExitCode::FAILURE;
        }
    };
    if wanted.list {
        let names = cases.iter().flat_map(case::Case::tests);
        names.filter(|name| wanted.takes(name)).for_each(|name| println!("{name}: test"));
        return ExitCode::SUCCESS;
    }
    let total: usize = cases.iter().map(|case| case.tests().len()).sum();
    let (mut passed, mut failures) = (0, Vec::new());
    println!("\nrunning the tests of {} cases", cases.len());
    for case in &cases {
        if !case.tests().iter().any(|test| wanted.takes(test)) {
            continue;
        }
        for outcome in run::run_case(case).into_iter().filter(|o| wanted.takes(&o.test)) {
            let ok = outcome.wrong.is_empty();
            if !wanted.quiet || !ok {
                println!("test {} ... {}", outcome.test, if ok { "ok" } else { "FAILED" });
            }
            if ok {
                passed += 1;
            } else {
                failures.push((case, outcome));
            }
        }
    }
    for (case, outcome) in &failures {
        println!("\n---- {} ({}) ----\n{}", outcome.test, case.file, case.says);
        outcome.wrong.iter().for_each(|line| println!("  {line}"));
    }
    let result = if failures.is_empty() { "ok" } else { "FAILED" };
    let failed = failures.len();
    let rest = total - passed - failed;
    println!(
        "\ntest result: {result}. {passed} passed; {failed} failed; 0 ignored; 0 measured; \
         {rest} filtered out\n"
    );
    if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
