//! CSV: its records, for the readers of CLICK ladders, nicknames and element documentation.

/// A record of a CSV file.
pub(crate) struct CsvRecord {
    /// The line on which it begins, from 1.
    pub(crate) line: usize,
    pub(crate) fields: Vec<String>,
}

/// The records of a CSV file; a field in quotation marks may contain commas and ends of lines.
///
/// # Errors
/// A quotation mark is missing; the reason has the line.
pub(crate) fn records(text: &str) -> Result<Vec<CsvRecord>, String> {
    let mut records = Vec::new();
    let (mut fields, mut field) = (Vec::new(), String::new());
    let (mut line, mut begin, mut is_quoted) = (1, 1, false);
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => {
                letters.next();
                field.push('"');
            }
            '"' if is_quoted || field.is_empty() => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(std::mem::take(&mut field)),
            '\n' if !is_quoted => {
                line += 1;
                fields.push(std::mem::take(&mut field));
                let fields = std::mem::take(&mut fields);
                if fields.iter().any(|field| !field.trim().is_empty()) {
                    records.push(CsvRecord { line: begin, fields });
                }
                begin = line;
            }
            '\r' if !is_quoted => {}
            letter => {
                line += usize::from(letter == '\n');
                field.push(letter);
            }
        }
    }
    if is_quoted {
        return Err(format!("line {begin}: a quotation mark is missing"));
    }
    fields.push(field);
    if fields.iter().any(|field| !field.trim().is_empty()) {
        records.push(CsvRecord { line: begin, fields });
    }
    Ok(records)
}
