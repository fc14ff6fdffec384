//! The nearest known name: what somebody who mistyped probably meant.
//!
//! Called wherever a name is unknown. Distance is counted in single-letter slips (a letter more,
//! less, other, or two swapped), without regard to case.

/// The known name nearest to a mistyped one, if any is near enough to be worth offering: one
/// slip for every three letters, and at least one if it has two.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = fold(name);
    let limit = (name.len() / 3).max(usize::from(name.len() > 1));
    known
        .into_iter()
        .map(|candidate| (distance(&name, &fold(candidate)), candidate))
        .filter(|(slips, _)| *slips <= limit)
        .min_by_key(|(slips, _)| *slips)
        .map(|(_, candidate)| candidate)
}

/// `did you mean …?` for a help text, if something is near.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, known).map(|near| format!("did you mean `{near}`?"))
}

fn fold(name: &str) -> Vec<char> {
    // Names are short; a page of text in the place of one is cut, so that the table stays small.
    name.chars().take(64).flat_map(char::to_lowercase).collect()
}

/// Edit distance with swaps of neighbours (optimal string alignment).
fn distance(a: &[char], b: &[char]) -> usize {
    let width = b.len() + 1;
    let mut rows = vec![vec![0; width]; a.len() + 1];
    rows[0] = (0..width).collect();
    for i in 1..=a.len() {
        rows[i][0] = i;
        for j in 1..width {
            let other = usize::from(a[i - 1] != b[j - 1]);
            let mut best = (rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
            best = best.min(rows[i - 1][j - 1] + other);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_forgiven_within_reason() {
        let known = ["bottles", "bin_size", "bin_full", "jam"];
        assert_eq!(nearest("botles", known), Some("bottles"));
        assert_eq!(nearest("bin_fulll", known), Some("bin_full"));
        assert_eq!(nearest("BOTTLES", known), Some("bottles"));
        assert_eq!(nearest("bin_szie", known), Some("bin_size"));
        assert_eq!(nearest("jma", known), Some("jam"));
        assert_eq!(nearest("conveyor", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest("Q", ["X", "Y"]), None);
    }

    #[test]
    fn distances() {
        let d = |a: &str, b: &str| distance(&fold(a), &fold(b));
        assert_eq!(d("", "abc"), 3);
        assert_eq!(d("CNTDN", "CTNDN"), 1);
        assert_eq!(d("kitten", "sitting"), 3);
    }
}
