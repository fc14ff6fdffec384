//! The tags of a program as metrics: which are published, with their types, units and limits.
//!
//! The log's reader (cells by name) and the birth (metrics) use the same choice from the same
//! program, so that both have the same numbers.

use std::sync::Arc;

use super::settings::{EdgeSettings, PublishRule};
use rungd_client::live::{ChooseCells, LoggedProgram, NamedCell, TagType};
use rungd_client::operator::protocol::GivenValue;
use rungd_config::controller::OUTPUT_UNKNOWN;
use rungd_engine::Cell;
use rungd_engine::isa::{Address, Real};
use rungd_language::lower::Symbols;
use rungd_language::resolve::program::{Program, Tag, TagMeaning};
use rungd_net::sparkplug::{BornMetric, DataType, MetricProperties, MetricValue};

/// A published tag.
#[derive(Clone, Debug)]
pub(super) struct TagMetric {
    /// The metric in a birth. Its alias is unique among all tags.
    pub metric: BornMetric,
    /// The rule for its publishing.
    pub rule: PublishRule,
    /// Whether commands may write it.
    pub may_write: bool,
}

/// Chooses the cells of the published tags.
pub fn chooser(settings: &EdgeSettings) -> ChooseCells {
    let settings = settings.clone();
    Arc::new(move |program: &Program, symbols: &Symbols| {
        let chosen = all(&settings, program, symbols).into_iter();
        chosen.map(|(name, _, cell, ..)| (name, cell)).collect::<Vec<NamedCell>>()
    })
}

/// The published tags of a program, in the order of its chosen cells. `first_alias`: the alias of
/// the first tag.
pub(super) fn metrics(
    settings: &EdgeSettings,
    logged: &LoggedProgram,
    first_alias: u64,
) -> Vec<TagMetric> {
    let all = all(settings, &logged.playable.program, &logged.playable.symbols);
    let metric = |(at, (name, address, cell, tag, rule)): (u64, ChosenTag<'_>)| {
        let datatype = datatype(TagType::of(address, cell, &logged.playable.symbols));
        let may_write = settings.commands.contains(&name);
        let content = |limit: &Option<(i32, _)>| limit.as_ref().map(|(content, _)| *content);
        let limits = content(&tag.min).zip(content(&tag.max));
        let is_whole = !matches!(tag.meaning, TagMeaning::Address(Address::Structure(_)));
        let limits = limits.filter(|_| is_whole);
        let number = |content| number(&known_value(datatype, content)).unwrap_or(0.0);
        let properties = MetricProperties {
            unit: tag.unit.as_ref().filter(|_| is_whole).map(|unit| unit.text.clone()),
            texts: tag.texts.as_ref().filter(|_| is_whole).map(|texts| texts.to_string()),
            documentation: tag.doc.clone(),
            limits: limits.map(|(low, high)| (number(low), number(high))),
            is_read_only: Some(!may_write),
        };
        let alias = Some(first_alias + at);
        let metric = BornMetric { name, alias, datatype, properties };
        TagMetric { metric, rule: rule.clone(), may_write }
    };
    (0..).zip(all).map(metric).collect()
}

type ChosenTag<'a> = (String, Address, Cell, &'a Tag, &'a PublishRule);

/// The tags with a rule. A structure is replaced by its members.
fn all<'a>(
    settings: &'a EdgeSettings,
    program: &'a Program,
    symbols: &Symbols,
) -> Vec<ChosenTag<'a>> {
    let mut all = Vec::new();
    let mut add = |name: String, address: Address, tag: &'a Tag| {
        if let (Some(rule), Some(cell)) = (settings.rule(&name), symbols.layout.cell(address)) {
            all.push((name, address, cell, tag, rule));
        }
    };
    for tag in &program.tags {
        let TagMeaning::Address(address) = tag.meaning else { continue };
        for (name, operand) in address.named_operands(&tag.name) {
            add(name, operand, tag);
        }
    }
    all
}

/// The type of a metric.
fn datatype(tag_type: TagType) -> DataType {
    match tag_type {
        TagType::Bit => DataType::Boolean,
        TagType::Unsigned16 => DataType::UInt16,
        TagType::Signed16 => DataType::Int16,
        TagType::Signed32 => DataType::Int32,
        TagType::Real => DataType::Float,
    }
}

/// The content of a cell as a value of a type; `None`: the state of the output is not known.
pub(super) fn value(datatype: DataType, content: i32) -> Option<MetricValue> {
    let is_unknown = datatype == DataType::Boolean && content == OUTPUT_UNKNOWN;
    (!is_unknown).then(|| known_value(datatype, content))
}

fn known_value(datatype: DataType, content: i32) -> MetricValue {
    match datatype {
        DataType::Boolean => MetricValue::Bool(content != 0),
        DataType::Float | DataType::Double => {
            MetricValue::Real(f64::from(Real::of_cell(content).number()))
        }
        DataType::UInt8 | DataType::UInt16 | DataType::UInt32 | DataType::UInt64 => {
            MetricValue::Unsigned(u64::from(content.unsigned_abs()))
        }
        DataType::Int8
        | DataType::Int16
        | DataType::Int32
        | DataType::Int64
        | DataType::String
        | DataType::DateTime
        | DataType::Text => MetricValue::Signed(content.into()),
    }
}

/// A value as a number; `None`: the value is a bit or a text.
pub fn number(value: &MetricValue) -> Option<f64> {
    match value {
        MetricValue::Signed(value) => Some(*value as f64),
        MetricValue::Unsigned(value) => Some(*value as f64),
        MetricValue::Real(value) => Some(*value),
        MetricValue::Bool(_) | MetricValue::Text(_) => None,
    }
}

/// The value of a command, in the form in which an operator gives a value: a bit for a bit, an
/// integer of any width for an integer, a real for a real.
///
/// # Errors
/// The value is not of the metric's kind. The text is the reason, as a clause.
pub(super) fn given(datatype: DataType, value: &MetricValue) -> Result<GivenValue, String> {
    let is_real = matches!(datatype, DataType::Float | DataType::Double);
    let wrong = || format!("the tag is of type {}, and {} is not", datatype.name(), shown(value));
    match value {
        MetricValue::Bool(on) if datatype == DataType::Boolean => Ok(GivenValue::Bit(*on)),
        _ if datatype == DataType::Boolean => Err(wrong()),
        MetricValue::Signed(value) if !is_real => Ok(GivenValue::Number(*value)),
        MetricValue::Unsigned(value) if !is_real => match i64::try_from(*value) {
            Ok(value) => Ok(GivenValue::Number(value)),
            Err(_) => Err(wrong()),
        },
        MetricValue::Real(value) if is_real && value.is_finite() => Ok(GivenValue::Real(*value)),
        MetricValue::Signed(_)
        | MetricValue::Unsigned(_)
        | MetricValue::Real(_)
        | MetricValue::Bool(_)
        | MetricValue::Text(_) => Err(wrong()),
    }
}

/// A value for people.
fn shown(value: &MetricValue) -> String {
    match value {
        MetricValue::Signed(value) => format!("the integer {value}"),
        MetricValue::Unsigned(value) => format!("the integer {value}"),
        MetricValue::Real(value) => format!("the real {value}"),
        MetricValue::Bool(value) => format!("the Boolean {value}"),
        MetricValue::Text(_) => "a text".to_owned(),
    }
}
