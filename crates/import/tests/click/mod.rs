//! CLICK ladders: what pyrung does with random ones, and named cases.

mod cases;
mod traces;

/// A ladder in CSV of these rows: a marker, the conditions and the instruction, without the wires
/// at the end.
pub fn ladder(rows: &[&[&str]]) -> String {
    let columns: Vec<String> = (0..31_u8)
        .map(|at| match at {
            0..26 => char::from(b'A' + at).to_string(),
            _ => format!("A{}", char::from(b'A' + at - 26)),
        })
        .collect();
    let mut text = format!("marker,{},AF\n", columns.join(","));
    for row in rows {
        let [marker, cells @ .., call] = row else { panic!("a row has a marker and a call") };
        let wire = if *marker == "R" || call.starts_with('.') { "-" } else { "" };
        let mut all: Vec<&str> = cells.to_vec();
        all.resize(31, wire);
        text += &format!("{marker},{},\"{call}\"\n", all.join(","));
    }
    text
}
