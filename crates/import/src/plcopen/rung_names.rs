//! The names of the rungs of one body or chart, each once: `stop`, `stop-n2`.
//!
//! Used by `finish` and `sfc_work`. The last number behind each name is kept, so that many equal
//! wishes do not take long.

use std::collections::{HashMap, HashSet};

use crate::model::{ProjectRung, RungBody};

/// The names that rungs have.
#[derive(Debug, Default)]
pub(super) struct RungNames {
    taken: HashSet<String>,
    /// The last number behind a name.
    next: HashMap<String, usize>,
}

impl RungNames {
    /// A name that no other rung has, near a wish.
    pub(super) fn fresh(&mut self, wish: String) -> String {
        if self.taken.insert(wish.clone()) {
            return wish;
        }
        let number = self.next.entry(wish.clone()).or_insert(1);
        loop {
            *number += 1;
            let name = format!("{wish}-n{number}");
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }

    /// Renames a rung that is called as another one. The name of a use stays.
    pub(super) fn keep_apart(&mut self, rung: &mut ProjectRung) {
        let is_use = matches!(rung.body, RungBody::Use { .. });
        let Some(name) = rung.name.as_mut().filter(|_| !is_use) else { return };
        *name = self.fresh(std::mem::take(name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_rungs_get_one_name_and_each_number_is_tried_once() {
        let mut names = RungNames::default();
        let wishes = ["stop", "stop-n2", "stop", "stop", "stop-n2"];
        let given = wishes.map(|wish| names.fresh(wish.to_owned()));
        assert_eq!(given, ["stop", "stop-n2", "stop-n3", "stop-n4", "stop-n2-n2"]);
        for _ in 0..1000 {
            names.fresh("stop".to_owned());
        }
        assert_eq!(names.next["stop"], 1004);
    }
}
