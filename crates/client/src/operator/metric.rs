//! The operands whose values are metrics: those of tags with `metric = true`.
//!
//! Made by [`super::names::OperandNames`] for each program. `rungd metrics` requests the list when
//! the ladder has changed; it requests the values separately.

use serde::{Deserialize, Serialize};

use rungd_language::resolve::program::{Program, TagMeaning};

/// The most operands in the list: sixteen requests read their values.
const METRICS_MAX: usize = 4096;

/// The answer to a request for metrics.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MetricList {
    /// In file order, each in the form that a `read` accepts; for a structure, its members.
    pub operands: Vec<String>,
    /// The number of operands that the answer leaves out because of its limit.
    pub left_out: usize,
}

/// The operands of a program that are metrics.
#[derive(Debug, Default)]
pub(super) struct MetricNames {
    names: Vec<String>,
}

impl MetricNames {
    pub fn of(program: &Program) -> MetricNames {
        let tags = program.tags.iter().filter(|tag| tag.metric);
        let names = tags.flat_map(|tag| match tag.meaning {
            TagMeaning::Address(address) => {
                address.named_operands(&tag.name).map(|(name, _)| name).collect()
            }
            TagMeaning::Constant(..) | TagMeaning::Real(_) | TagMeaning::Array(_) => Vec::new(),
        });
        MetricNames { names: names.collect() }
    }

    pub fn list(&self) -> MetricList {
        let operands: Vec<String> = self.names.iter().take(METRICS_MAX).cloned().collect();
        MetricList { left_out: self.names.len() - operands.len(), operands }
    }
}
