//! A reader of contacts for the judge. It finds the places of their leaves in the file, and
//! computes their value.

use rungd_history::observe::Subject;

pub enum Tree {
    Leaf(usize),
    Not(Box<Tree>),
    All(Vec<Tree>),
    Any(Vec<Tree>),
}

pub struct Leaf {
    /// Its first byte in the file.
    pub start: usize,
    /// The contact's text in a normal form: the same for the same contact.
    pub key: String,
}

pub struct Reader<'t> {
    text: &'t str,
    at: usize,
    end: usize,
    subject: &'t Subject,
    pub leaves: Vec<Leaf>,
}

impl<'t> Reader<'t> {
    pub fn new(text: &'t str, subject: &'t Subject) -> Reader<'t> {
        Reader { text, at: 0, end: 0, subject, leaves: Vec::new() }
    }

    /// Reads the contacts at a place.
    pub fn read(&mut self, start: usize, end: usize) -> Tree {
        // A place does not include the parentheses around its first contact: read the whole string.
        self.at = self.text[..start].rfind('"').map_or(start, |quote| quote + 1);
        self.end = self.text[end..].find('"').map_or(end, |quote| end + quote);
        self.any()
    }

    fn skip(&mut self) {
        while self.at < self.end && self.text.as_bytes()[self.at] == b' ' {
            self.at += 1;
        }
    }

    fn take(&mut self, token: u8) -> bool {
        self.skip();
        let found = self.at < self.end && self.text.as_bytes()[self.at] == token;
        self.at += usize::from(found);
        found
    }

    fn any(&mut self) -> Tree {
        let mut all = vec![self.all()];
        while self.take(b'|') {
            all.push(self.all());
        }
        if all.len() == 1 { all.remove(0) } else { Tree::Any(all) }
    }

    fn all(&mut self) -> Tree {
        let mut all = vec![self.one()];
        while self.take(b'&') {
            all.push(self.one());
        }
        if all.len() == 1 { all.remove(0) } else { Tree::All(all) }
    }

    fn one(&mut self) -> Tree {
        if self.take(b'!') {
            return Tree::Not(Box::new(self.one()));
        }
        self.skip();
        if !self.is_compare() && self.take(b'(') {
            let inner = self.any();
            self.take(b')');
            return inner;
        }
        self.skip();
        let (start, mut depth) = (self.at, 0);
        while self.at < self.end {
            match self.text.as_bytes()[self.at] {
                b'(' => depth += 1,
                b')' if depth == 0 => break,
                b')' => depth -= 1,
                b'&' | b'|' if depth == 0 => break,
                _ => {}
            }
            self.at += 1;
        }
        let key = self.key(start);
        self.leaves.push(Leaf { start, key });
        Tree::Leaf(self.leaves.len() - 1)
    }

    /// Whether the next contact is a compare, whose left side may begin with a parenthesis.
    fn is_compare(&self) -> bool {
        let mut depth = 0;
        for byte in self.text[self.at..self.end].bytes() {
            match byte {
                b'(' => depth += 1,
                b')' if depth == 0 => return false,
                b')' => depth -= 1,
                b'&' | b'|' if depth == 0 => return false,
                b'<' | b'>' | b'=' if depth == 0 => return true,
                _ => {}
            }
        }
        false
    }

    fn key(&self, start: usize) -> String {
        let text = self.text[start..self.at].trim();
        if text.starts_with("rise(") || text.starts_with("fall(") {
            return format!("{text} at {start}");
        }
        let spaced = ["==", "!=", "<=", ">="]
            .iter()
            .fold(text.to_owned(), |text, sign| text.replace(sign, &format!(" {sign} ")));
        let word = |word: &str| match self.subject.cell(word) {
            Ok(cell) => format!("{cell:?}"),
            Err(_) => word.to_owned(),
        };
        spaced.split_whitespace().map(word).collect::<Vec<_>>().join(" ")
    }
}

impl Tree {
    pub fn is_on(&self, on: &dyn Fn(usize) -> bool) -> bool {
        match self {
            Tree::Leaf(at) => on(*at),
            Tree::Not(inner) => !inner.is_on(on),
            Tree::All(all) => all.iter().all(|one| one.is_on(on)),
            Tree::Any(any) => any.iter().any(|one| one.is_on(on)),
        }
    }
}
