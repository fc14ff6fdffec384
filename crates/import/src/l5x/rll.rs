//! The text of a Rockwell rung: instructions in series, and branches in brackets.
//!
//! `XIC(a)[XIO(b) ,XIC(c) ]OTE(d);` is a series of a contact, two parallel branches and a coil.
//! What an instruction means is not known here.

/// A rung, or a branch: nodes in series.
pub(crate) type Series = Vec<RllNode>;

/// A part of a series.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum RllNode {
    /// An instruction.
    RllInstruction(RllInstruction),
    /// Parallel branches.
    Branches(Vec<Series>),
}

/// An instruction with its operands as they are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RllInstruction {
    /// In capital letters: Logix takes any.
    pub(crate) name: String,
    pub(crate) operands: Vec<String>,
}

/// Deepest nesting of branches.
const DEPTH_MAX: usize = 100;
/// Longest text of a rung, in bytes.
const BYTES_MAX: usize = 256 * 1024;

/// Reads the text of a rung.
///
/// # Errors
/// The reason with the place, in bytes from the beginning.
pub(crate) fn parse(text: &str) -> Result<Series, String> {
    if text.len() > BYTES_MAX {
        return Err(format!("a rung of {} bytes", text.len()));
    }
    let mut parser = RllParser { text, at: 0 };
    let series = parser.series(0)?;
    parser.blanks();
    match parser.rest() {
        "" | ";" => Ok(series),
        rest if rest.trim_start_matches(';').trim().is_empty() => Ok(series),
        _ => Err(parser.wrong("`;` or an instruction")),
    }
}

/// All instructions of a series, in the order of the text.
pub(crate) fn instructions(series: &[RllNode]) -> Vec<&RllInstruction> {
    let mut all = Vec::new();
    collect(series, &mut all);
    all
}

fn collect<'s>(series: &'s [RllNode], all: &mut Vec<&'s RllInstruction>) {
    for node in series {
        match node {
            RllNode::RllInstruction(instruction) => all.push(instruction),
            RllNode::Branches(branches) => branches.iter().for_each(|branch| collect(branch, all)),
        }
    }
}

struct RllParser<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> RllParser<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn blanks(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start().len();
    }

    fn wrong(&self, wanted: &str) -> String {
        let found: String = self.rest().chars().take(12).collect();
        match found.is_empty() {
            true => format!("the text ends where {wanted} should stand"),
            false => format!("at byte {}: `{found}` where {wanted} should stand", self.at),
        }
    }

    fn takes(&mut self, sign: char) -> bool {
        self.blanks();
        let is_there = self.rest().starts_with(sign);
        self.at += if is_there { sign.len_utf8() } else { 0 };
        is_there
    }

    fn series(&mut self, depth: usize) -> Result<Series, String> {
        if depth > DEPTH_MAX {
            return Err(format!("branches nest deeper than {DEPTH_MAX}"));
        }
        let mut series = Vec::new();
        loop {
            self.blanks();
            match self.rest().chars().next() {
                Some('[') => {
                    self.at += 1;
                    series.push(RllNode::Branches(self.branches(depth)?));
                }
                Some(letter) if letter.is_ascii_alphabetic() || letter == '_' => {
                    series.push(RllNode::RllInstruction(self.instruction()?));
                }
                Some(_) | None => return Ok(series),
            }
        }
    }

    fn branches(&mut self, depth: usize) -> Result<Vec<Series>, String> {
        let mut branches = Vec::new();
        loop {
            branches.push(self.series(depth + 1)?);
            if self.takes(']') {
                return Ok(branches);
            }
            if !self.takes(',') {
                return Err(self.wrong("`,` or `]`"));
            }
        }
    }

    fn instruction(&mut self) -> Result<RllInstruction, String> {
        let rest = self.rest();
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let end = rest.find(|c: char| !is_name(c)).unwrap_or(rest.len());
        let name = rest[..end].to_ascii_uppercase();
        self.at += end;
        if !self.takes('(') {
            return Err(self.wrong(&format!("`(` behind {name}")));
        }
        let mut operands = Vec::new();
        loop {
            let operand = self.operand()?;
            let is_only = operands.is_empty() && self.rest().starts_with(')');
            if !(is_only && operand.is_empty()) {
                operands.push(operand);
            }
            if self.takes(')') {
                return Ok(RllInstruction { name, operands });
            }
            if !self.takes(',') {
                return Err(self.wrong("`,` or `)`"));
            }
        }
    }

    /// An operand: up to a comma or parenthesis outside of brackets, parentheses and quotes.
    fn operand(&mut self) -> Result<String, String> {
        let (mut depth, mut is_quoted) = (0_usize, false);
        let rest = self.rest();
        for (at, letter) in rest.char_indices() {
            match letter {
                '\'' => is_quoted = !is_quoted,
                _ if is_quoted => {}
                '(' | '[' => depth += 1,
                ',' | ')' if depth == 0 => {
                    self.at += at;
                    return Ok(rest[..at].trim().to_owned());
                }
                ')' | ']' => depth = depth.saturating_sub(1),
                _ => {}
            }
        }
        Err("the text ends within the operands of an instruction".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(series: &[RllNode]) -> String {
        let one = |node: &RllNode| match node {
            RllNode::RllInstruction(RllInstruction { name, operands }) => {
                format!("{name}<{}>", operands.join("; "))
            }
            RllNode::Branches(branches) => {
                let branches: Vec<String> = branches.iter().map(|branch| shown(branch)).collect();
                format!("[{}]", branches.join(" | "))
            }
        };
        series.iter().map(one).collect()
    }

    #[test]
    fn a_rung_is_a_series_with_branches() {
        for (text, wanted) in [
            ("XIC(a)OTE(b);", "XIC<a>OTE<b>"),
            (
                "XIC(a)[XIO(b) ,[XIC(c) ,XIC(d) ]XIC(e) ]OTE(f);",
                "XIC<a>[XIO<b> | [XIC<c> | XIC<d>]XIC<e>]OTE<f>",
            ),
            ("[OTE(a),];", "[OTE<a> | ]"),
            ("NOP();", "NOP<>"),
            (";", ""),
            ("TON(T[i,2],?,?);", "TON<T[i,2]; ?; ?>"),
            ("CPT(d,(a+b[1,2])*ABS(c));", "CPT<d; (a+b[1,2])*ABS(c)>"),
            ("MSG(m,'a,(b');", "MSG<m; 'a,(b'>"),
        ] {
            assert_eq!(shown(&parse(text).unwrap()), wanted, "{text}");
        }
    }

    #[test]
    fn a_broken_rung_is_told_with_its_place() {
        for (text, wanted) in [
            ("XIC(a", "the text ends within the operands of an instruction"),
            ("[XIC(a);", "at byte 7: `;` where `,` or `]` should stand"),
            ("XIC a", "at byte 4: `a` where `(` behind XIC should stand"),
            ("XIC(a)]", "at byte 6: `]` where `;` or an instruction should stand"),
        ] {
            assert_eq!(parse(text).unwrap_err(), wanted, "{text}");
        }
        assert!(parse(&"[".repeat(5000)).is_err());
    }
}
