//! Contacts: a recursive descent over the grammar of a leg.

use super::math_read;
use super::names::Names;
use super::program::{Compare, Contact};

const OPERATORS: [(&str, Compare); 6] = [
    ("==", Compare::Equal),
    ("!=", Compare::NotEqual),
    ("<=", Compare::LessEqual),
    (">=", Compare::GreaterEqual),
    ("<", Compare::Less),
    (">", Compare::Greater),
];

struct Reader<'a> {
    rest: &'a str,
    names: &'a Names,
    histories: &'a mut usize,
}

/// Reads one item of a leg; each edge contact in it takes its own history.
pub fn contact(text: &str, names: &Names, histories: &mut usize) -> Result<Contact, String> {
    let mut reader = Reader { rest: text, names, histories };
    let contact = reader.any()?;
    reader.skip();
    if reader.rest.is_empty() {
        return Ok(contact);
    }
    Err(format!("`{}` is left over in `{text}`", reader.rest))
}

impl Reader<'_> {
    fn skip(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn take(&mut self, token: &str) -> bool {
        self.skip();
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn word(&mut self) -> Result<String, String> {
        self.skip();
        let inside = |c: char| c.is_ascii_alphanumeric() || "_$.,:-[]".contains(c);
        let end = self.rest.find(|c| !inside(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            return Err(format!("a word is missing before `{rest}`"));
        }
        Ok(word.to_string())
    }

    fn any(&mut self) -> Result<Contact, String> {
        let mut items = vec![self.all()?];
        while self.take("|") {
            items.push(self.all()?);
        }
        Ok(Contact::Any(items))
    }

    fn all(&mut self) -> Result<Contact, String> {
        let mut items = vec![self.one()?];
        while self.take("&") {
            items.push(self.one()?);
        }
        Ok(Contact::All(items))
    }

    fn one(&mut self) -> Result<Contact, String> {
        if self.take("!") {
            return Ok(Contact::Not(Box::new(self.one()?)));
        }
        if let Some(end) = self.computed_end() {
            let (text, rest) = self.rest.split_at(end);
            self.rest = rest;
            return Ok(Contact::Computed(Box::new(math_read::of_contact(text, self.names)?)));
        }
        if self.take("(") {
            let inner = self.any()?;
            return self.close(inner);
        }
        let word = self.word()?;
        if (word == "rise" || word == "fall") && self.take("(") {
            let of = Box::new(self.any()?);
            let history = *self.histories;
            *self.histories += 1;
            return self.close(Contact::Edge { rising: word == "rise", of, history });
        }
        for (token, compare) in OPERATORS {
            if self.take(token) {
                let right = self.word()?;
                let (left, right) = (self.names.value(&word)?, self.names.value(&right)?);
                return Ok(Contact::Compare(left, compare, right));
            }
        }
        Ok(match self.names.element(&word) {
            Some((array, index)) => Contact::Element(array, index),
            None => Contact::Bit(self.names.place(&word)?),
        })
    }

    /// The length of the next item if it computes: a compare with an operator, a call or an
    /// expression as an index, a compare of two bits, or a bit with an expression as an index.
    fn computed_end(&mut self) -> Option<usize> {
        self.skip();
        let (mut depth, mut end, mut compare) = (0, self.rest.len(), None);
        for (at, c) in self.rest.char_indices() {
            match c {
                '(' | '[' => depth += 1,
                ']' => depth -= 1,
                ')' if depth > 0 => depth -= 1,
                ')' => {
                    end = at;
                    break;
                }
                '&' | '|' if depth == 0 => {
                    end = at;
                    break;
                }
                '<' | '>' | '=' if depth == 0 => compare = compare.or(Some(at)),
                _ => {}
            }
        }
        let item = &self.rest[..end];
        let Some(compare) = compare else {
            let index = item.split_once('[').filter(|(name, _)| !name.contains('('))?.1;
            return index.contains(['+', '*', '/', '%', '(', ' ']).then_some(end);
        };
        let left = item[..compare].trim_end_matches('!').trim();
        let is_bit = matches!(self.names.place(left), Ok(loc) if loc.range() == (0, 1));
        let computes = item.contains(['+', '*', '/', '%', '(']) || item.contains(" - ");
        (computes || is_bit).then_some(end)
    }

    fn close(&mut self, contact: Contact) -> Result<Contact, String> {
        if self.take(")") {
            return Ok(contact);
        }
        Err(format!("`)` is missing before `{}`", self.rest))
    }
}
