//! A TOML file as a plain tree.

use std::collections::BTreeMap;
use toml::de::{DeTable, DeValue};

pub type Table = BTreeMap<String, Tree>;

#[derive(Clone, Debug)]
pub enum Tree {
    Text(String),
    Number(i64),
    Bool(bool),
    List(Vec<Tree>),
    Table(Table),
}

pub fn parse(text: &str) -> Result<Table, String> {
    let root = DeTable::parse(text).map_err(|error| format!("TOML: {error}"))?;
    table(root.get_ref())
}

fn table(source: &DeTable) -> Result<Table, String> {
    let entries = source.iter();
    entries.map(|(key, value)| Ok((key.get_ref().to_string(), tree(value.get_ref())?))).collect()
}

fn tree(source: &DeValue) -> Result<Tree, String> {
    Ok(match source {
        DeValue::String(text) => Tree::Text(text.to_string()),
        DeValue::Boolean(on) => Tree::Bool(*on),
        DeValue::Array(items) => {
            let items = items.iter().map(|item| tree(item.get_ref()));
            Tree::List(items.collect::<Result<Vec<Tree>, String>>()?)
        }
        DeValue::Table(entries) => Tree::Table(table(entries)?),
        DeValue::Integer(digits) => {
            let number = i64::from_str_radix(digits.as_str(), digits.radix());
            Tree::Number(number.map_err(|error| format!("{digits:?}: {error}"))?)
        }
        _ => return Err("a value of a type that no ladder has".to_string()),
    })
}

impl Tree {
    pub fn as_text(&self) -> Option<&str> {
        match self {
            Tree::Text(text) => Some(text),
            _ => None,
        }
    }

    pub fn as_list(&self) -> Option<&[Tree]> {
        match self {
            Tree::List(items) => Some(items),
            _ => None,
        }
    }

    pub fn as_table(&self) -> Option<&Table> {
        match self {
            Tree::Table(table) => Some(table),
            _ => None,
        }
    }
}
