//! One line of a CSV text, split into cells.
//!
//! [`super::stimulus`] reads with it. A cell may be in double quotes, as spreadsheets write it;
//! then a comma is a part of the cell, and `""` is a quote. A line end is never a part of a cell:
//! no name and no value has one.

use std::borrow::Cow;

/// The longest cell, in bytes: longer than the longest name with its members.
const CELL_MAX: usize = 1000;

/// The cells of a line, without the spaces around them.
///
/// # Errors
/// A quote is not closed, text follows the closing quote, or a cell is too long.
pub(super) fn cells(line: &str) -> Result<Vec<Cow<'_, str>>, String> {
    let mut cells = Vec::new();
    let mut rest = Some(line);
    while let Some(text) = rest {
        let (cell, behind) = match text.trim_start().strip_prefix('"') {
            Some(inner) => quoted(inner)?,
            None => match text.split_once(',') {
                Some((cell, behind)) => (Cow::Borrowed(cell.trim()), Some(behind)),
                None => (Cow::Borrowed(text.trim()), None),
            },
        };
        if cell.len() > CELL_MAX {
            let start: String = cell.chars().take(20).collect();
            return Err(format!(
                "the cell `{start}…` has {} bytes: a cell has at most {CELL_MAX}",
                cell.len()
            ));
        }
        cells.push(cell);
        rest = behind;
    }
    Ok(cells)
}

/// A cell after its opening quote, and the text after the comma that follows it, if any.
fn quoted(inner: &str) -> Result<(Cow<'_, str>, Option<&str>), String> {
    let mut cell = String::new();
    let mut rest = inner;
    loop {
        let Some((part, behind)) = rest.split_once('"') else {
            return Err("a cell begins with a quote and ends without one: close it".to_owned());
        };
        cell.push_str(part);
        let Some(more) = behind.strip_prefix('"') else {
            let cell = Cow::Owned(cell.trim().to_owned());
            let behind = behind.trim();
            return match behind.strip_prefix(',') {
                Some(next) => Ok((cell, Some(next))),
                None if behind.is_empty() => Ok((cell, None)),
                None => Err(format!(
                    "`{behind}` follows the closing quote of a cell: a cell is in quotes as a \
                     whole, or has none"
                )),
            };
        };
        cell.push('"');
        rest = more;
    }
}

#[cfg(test)]
mod tests {
    use super::{CELL_MAX, cells};

    #[test]
    fn quotes_around_a_cell_are_removed() {
        let rows = [
            ("scan,X0,D1", &["scan", "X0", "D1"][..]),
            (r#""scan","X0" , " D1 ""#, &["scan", "X0", "D1"]),
            (r#"0,"1,5",,""#, &["0", "1,5", "", "!"]),
            (r#""N,3,6",7"#, &["N,3,6", "7"]),
            (r#""say ""no""","""#, &["say \"no\"", ""]),
            ("", &[""]),
            ("1,", &["1", ""]),
            (r#""","""#, &["", ""]),
        ];
        for (row, wanted) in rows {
            match cells(row) {
                Ok(cells) => assert_eq!(cells, wanted, "{row}"),
                Err(why) => {
                    assert!(why.contains("close it") && wanted.last() == Some(&"!"), "{row}");
                }
            }
        }
        let long = cells(&format!("0,{}", "1".repeat(CELL_MAX + 1))).unwrap_err();
        assert!(long.len() < 120 && long.contains("has 1001 bytes"), "{long}");
        assert!(cells(&"1".repeat(CELL_MAX)).is_ok());
        assert!(cells(r#""1"2,3"#).unwrap_err().contains("`2,3` follows the closing quote"));
    }
}
