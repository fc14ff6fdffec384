//! The page of every finding, as `rungd explain` prints it.
//!
//! The texts are in `docs/findings/` and are compiled into the program, so that they belong to its
//! own version. A test runs their examples.

/// The page of a finding, by its name.
pub fn page(name: &str) -> Option<&'static str> {
    PAGES.iter().find(|(of, _)| *of == name).map(|(_, text)| *text)
}

macro_rules! pages {
    ($($name:literal)*) => {
        /// All pages, by name, in the order of the table of findings.
        pub const PAGES: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../docs/findings/", $name, ".md")))),*];
    };
}

pages! {
    "toml-syntax"
    "unknown-key"
    "wrong-type"
    "bare-string"
    "missing-key"
    "out-of-place"
    "contact-syntax"
    "instruction-syntax"
    "empty-leg"
    "no-instruction"
    "mixed-legs"
    "forbidden-name"
    "duplicate-name"
    "bad-duration"
    "unknown-instruction"
    "unknown-operand"
    "missing-operand"
    "unknown-name"
    "unknown-member"
    "unknown-block"
    "unknown-stage"
    "wrong-case"
    "beyond-memory"
    "operand-type"
    "out-of-range"
    "write-to-input"
    "read-only"
    "unknown-leg"
    "missing-leg"
    "legs-shared"
    "order"
    "tag-key"
    "owned-twice"
    "reset-without-owner"
    "sensaphone-preset"
    "jump-outside-stage"
    "built-in-task"
    "stage-in-task"
    "block-rule"
    "entask-conflict"
    "duplicate-out"
    "retain-range"
    "no-main"
    "controller"
    "out-elsewhere"
    "out-lost-on-jump-back"
    "stage-never-entered"
    "block-never-started"
    "set-never-reset"
    "multi-scan-in-task"
    "task-starts-itself"
    "constant-compare"
    "bare-timer-value"
    "duration-as-count"
    "mixed-and-or"
    "constant-saturates"
    "retained-but-reset"
    "retains-nothing"
    "cold-for-ever"
    "held-but-reset"
    "long-period"
    "output-unmapped"
    "unused-tag"
    "unknown-allow"
}

#[cfg(test)]
mod tests {
    use crate::source::finding::TABLE;

    use super::*;

    #[test]
    fn every_finding_has_its_page() {
        let names: Vec<&str> = PAGES.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, TABLE.iter().map(|row| row.name).collect::<Vec<_>>());
        assert!(page("owned-twice").is_some_and(|text| text.starts_with("# owned-twice\n")));
        assert_eq!(page("no-such-finding"), None);
    }
}
