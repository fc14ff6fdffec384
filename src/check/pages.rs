//! The page of every finding, as `rungd explain` prints it.

/// The page of a finding, by its name.
pub fn page(name: &str) -> Option<&'static str> {
    PAGES.iter().find(|(of, _)| *of == name).map(|(_, text)| *text)
}

/// All pages, by name.
pub const PAGES: &[(&str, &str)] = &[];
