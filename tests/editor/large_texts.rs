//! Texts of any size, for the tests of large files: texts that a person may write, and hostile
//! texts.

/// A text that grows.
pub struct LargeText {
    pub name: &'static str,
    head: &'static str,
    /// The part that is repeated; the size is the number of repetitions. `#` stands for the number
    /// of the repetition.
    item: &'static str,
    tail: &'static str,
}

const fn of(
    name: &'static str,
    head: &'static str,
    item: &'static str,
    tail: &'static str,
) -> LargeText {
    LargeText { name, head, item, tail }
}

impl LargeText {
    /// The text, and the byte of the cursor: at the text's `^`, or in the middle if it has none.
    pub fn of_size(&self, size: usize) -> (String, usize) {
        let mut text = self.head.replace('@', RUNG);
        (0..size).for_each(|at| text.push_str(&self.item.replace('#', &at.to_string())));
        text.push_str(&self.tail.replace('@', RUNG));
        let middle = (0..=text.len() / 2).rev().find(|at| text.is_char_boundary(*at));
        let cursor = text.find('^').or(middle).expect("a text has a start");
        (text.replacen('^', "", 1), cursor)
    }

    /// The name of the file with this text.
    pub fn file(&self) -> &'static str {
        let is_test = self.head.starts_with("ladder = [\"plant");
        if is_test { "large.test.toml" } else { "large.toml" }
    }
}

/// The text for `@`.
const RUNG: &str = "[[program]]\nname = \"Main\"\n[[program.rung]]\n";

/// Ladders and tests in the size of a factory.
pub const FILES: &[LargeText] = &[
    of("rungs", "@", "[[program.rung]]\nname = \"r#\"\nwhen = [\"X0\"]\ndo = [\"SET C0\"]\n", ""),
    of("findings", "# ^\n@", "[[program.rung]]\nwhen = [\"no_#\"]\ndo = [\"OUT C0\"]\n", ""),
    of("at a finding", "@", "[[program.rung]]\nwhen = [\"no_#\"]\ndo = [\"OUT C0\"]\n", ""),
    of("tags", "[tags]\n", "t# = { type = \"bit\", doc = \"a\" }\n", "@when = [\"t^\"]\n"),
    of("tag headers", "", "[tags.t#]\ntype = \"bit\"\n", "@when = [\"t^\"]\n"),
    of("dotted tags", "", "tags.t#.type = \"bit\"\n", "@when = [\"t^\"]\n"),
    of("one tag again", "[tags]\n", "t = { type = \"bit\" }\n", "@when = [\"t^\"]\n"),
    of(
        "stages",
        "[[program]]\nname = \"A\"\n",
        "[[program.stage]]\nname = \"s#\"\n[[program.stage.rung]]\ndo = [\"JMP s0\"]\n",
        "[[program.stage.rung]]\ndo = [\"JMP ^\"]\n",
    ),
    of(
        "programs",
        "",
        "[[program]]\nname = \"p#\"\n[[program.rung]]\ndo = [\"RUN p0\"]\n",
        "[[program.rung]]\ndo = [\"RUN ^\"]\n",
    ),
    of(
        "uses",
        "[[template]]\nname = \"T\"\n[template.parameters]\np = { type = \"bit\" }\n@",
        "[[program.rung]]\nuse = \"T\"\nname = \"u#\"\nwith = { p = \"X0\" }\n",
        "[[program.rung]]\nwhen = [\"^\"]\n",
    ),
    of(
        "own tags",
        "[[template]]\nname = \"T\"\n[template.tags]\n",
        "p# = { type = \"bit\" }\n",
        "@use = \"T\"\nname = \"u\"\n[[program.rung]]\nwhen = [\"u.^\"]\n",
    ),
    of(
        "templates",
        "",
        "[[template]]\nname = \"t#\"\n[template.parameters]\np = { type = \"bit\" }\n",
        "@use = \"^\"\n",
    ),
    of(
        "scenarios",
        "ladder = [\"plant.toml\"]\n",
        "[[scenario]]\nname = \"s#\"\nsteps = [\"run 1 scans\"]\n",
        "",
    ),
    of(
        "steps",
        "ladder = [\"plant.toml\"]\n[[scenario]]\nname = \"s\"\nsteps = [",
        "\"expect: X0\", ",
        "\"^\"]\n",
    ),
    of(
        "set",
        "ladder = [\"plant.toml\"]\n[[scenario]]\nname = \"s\"\nset = {",
        "C# = true, ",
        "^}\n",
    ),
    of(
        "parts",
        "ladder = [\"a.toml\"]\n[[device]]\nname = \"d\"\n",
        "[[device.part]]\nname = \"p#\"\n[[device.map]]\nfrom = \"p#.x\"\nto = \"X0\"\n",
        "[[device.map]]\nfrom = \"^\"\n",
    ),
];

/// Few lines, each of them long.
pub const LINES: &[LargeText] = &[
    of("contacts", "@when = [\"X0", " & X1", "\"]\ndo = [\"OUT Y0\"]\n"),
    of("contacts with umlauts", "@when = [\"X0", " & \u{e4} & X1", "\"]\n"),
    of("formula", "@do = [\"MATH D0 = D1", " + D2", "\"]\n"),
    of("tags", "tags = {", "t# = { type = \"bit\", doc = \"a\" }, ", "}\n@when = [\"t^\"]\n"),
    of(
        "rungs",
        "[[program]]\nname = \"Main\"\nrung = [",
        "{ when = [\"X0\"], do = [\"OUT C0\"] }, ",
        "^]\n",
    ),
    of("arguments", "@use = \"T\"\nname = \"u\"\nwith = {", "p# = \"X0\", ", "^}\n"),
    of("ladders", "ladder = [", "\"a#.toml\", ", "^]\n"),
    of("allowed", "[ladder]\nallow = [", "\"unused-tag\", ", "^]\n"),
    of("wide characters", "@doc = \"", "\u{1F600}", "\"\n"),
    of("dots", "@when = [\"a", ".a", "^\"]\n"),
    of("words", "@when = [\"", "a    ", "\"]\n"),
    of("spaces", "@when = [\"a", "          ", "b\"]\n"),
];

/// Texts that nobody would write.
pub const HOSTILE: &[LargeText] = &[
    of("braces", "a = ", "{ b = ", "^"),
    of("braces in arrays", "a = ", "[{ b = ", "^"),
    of("brackets", "a = ", "[", "^"),
    of("brackets that close braces", "a = ", "{ b = { c = ", "]]]]^"),
    of("open braces", "a = ", "[{ b = 1, ]", "^"),
    of("parentheses", "@when = [\"", "(", "^\"]\n"),
    of("parts of a key", "", "a.", "^"),
    of("parts of a header", "[[", "a.", "b]]\n^"),
    of("names of one block", "[[program]]\n", "name = \"Main\"\n", ""),
    of("keys of one tag", "[tags.t]\n", "k# = 1\n", "@when = [\"t^\"]\n"),
    of("placeholders", "[tags]\nt = { alarm = \"", "{p", "^\" }\n"),
    of("NUL", "", "\0\0\0\0\0\0\0\0", ""),
    of("equals signs", "", "================================================================", ""),
    of("quotes", "", "\"\"\"\"\"\"\"\"", ""),
    of("ends of lines", "", "\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r", ""),
    of("hashes", "", "########", ""),
    of("open strings", "", "a = \"b\n", ""),
    of("open long strings", "", "a = \"\"\"\n", ""),
    of("open arrays", "", "a = [\n", ""),
    of("open strings in an array", "a = [\n", "\"b\n", ""),
    of("atoms in an array", "a = [\n", "1 . ", "^"),
    of("lines in an array", "a = [\n", "a\n", "^"),
    of("headers", "", "[a]\n", ""),
    of("headers of arrays", "", "[[a]]\n[[a.b.c]]\n", ""),
];
