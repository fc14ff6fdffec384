//! The variables that each random ladder has.

pub const KINDS: [Kind; 6] = [
    Kind { prefix: "bit", kind: "BOOL", count: 8 },
    Kind { prefix: "num", kind: "INT", count: 3 },
    Kind { prefix: "dbl", kind: "DINT", count: 2 },
    Kind { prefix: "uns", kind: "UINT", count: 2 },
    Kind { prefix: "rea", kind: "REAL", count: 2 },
    Kind { prefix: "span", kind: "TIME", count: 2 },
];

pub struct Kind {
    pub prefix: &'static str,
    pub kind: &'static str,
    pub count: u64,
}

/// The declarations of the variables, but of those that are declared elsewhere.
pub fn declared(without: &[&str]) -> String {
    let mut text = String::new();
    for kind in &KINDS {
        for at in 0..kind.count {
            let name = format!("{}{at}", kind.prefix);
            if !without.contains(&name.as_str()) {
                text +=
                    &format!("<variable name=\"{name}\"><type><{}/></type></variable>", kind.kind);
            }
        }
    }
    text
}
