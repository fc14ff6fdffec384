//! The interpreter's own reader of the text of a rung.

/// A part of a rung.
#[derive(Clone, Debug)]
pub enum Part {
    Instruction(String, Vec<String>),
    Branches(Vec<Vec<Part>>),
}

/// Reads a rung.
pub fn read(text: &str) -> Vec<Part> {
    let letters: Vec<char> = text.chars().collect();
    let mut at = 0;
    read_series(&letters, &mut at)
}

fn read_series(letters: &[char], at: &mut usize) -> Vec<Part> {
    let mut parts = Vec::new();
    while *at < letters.len() {
        match letters[*at] {
            '[' => {
                let mut branches = Vec::new();
                while letters[*at] != ']' {
                    *at += 1;
                    branches.push(read_series(letters, at));
                }
                *at += 1;
                parts.push(Part::Branches(branches));
            }
            ' ' => *at += 1,
            letter if letter.is_alphabetic() => {
                let begin = *at;
                while letters[*at] != '(' {
                    *at += 1;
                }
                let name: String = letters[begin..*at].iter().collect();
                let begin = *at + 1;
                while letters[*at] != ')' {
                    *at += 1;
                }
                let inside: String = letters[begin..*at].iter().collect();
                *at += 1;
                let operands = inside.split(',').filter(|one| !one.is_empty());
                parts.push(Part::Instruction(name, operands.map(str::to_owned).collect()));
            }
            _ => break,
        }
    }
    parts
}
