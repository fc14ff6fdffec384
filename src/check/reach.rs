//! What is reached from where: for stages that are entered and blocks that are started.

use std::collections::BTreeSet;

/// All that the roots lead to, themselves included. An edge `(None, b)` reaches `b` from outside.
pub fn reached<T: Ord + Copy>(
    roots: impl IntoIterator<Item = T>,
    edges: &[(Option<T>, T)],
) -> BTreeSet<T> {
    let mut reached: BTreeSet<T> = roots.into_iter().collect();
    loop {
        let before = reached.len();
        for (from, to) in edges {
            if from.is_none_or(|from| reached.contains(&from)) {
                reached.insert(*to);
            }
        }
        if reached.len() == before {
            return reached;
        }
    }
}
