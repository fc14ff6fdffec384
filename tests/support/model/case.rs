//! A generated case: a ladder as a tree, so that it can be shrunk, its stimulus, and the texts of
//! both.

use super::clock::{self, Clock};
use super::drawn_templates::{DrawnTemplate, own_bits};

#[derive(Clone, Debug)]
pub enum Expr {
    /// A bit or an edge contact.
    Leaf(String),
    Compare(String),
    Not(Box<Expr>),
    /// `rise` or `fall` of contacts.
    Edge(&'static str, Box<Expr>),
    All(Vec<Expr>),
    Any(Vec<Expr>),
    Group(Box<Expr>),
}

impl Expr {
    pub fn text(&self) -> String {
        match self {
            Expr::Leaf(text) | Expr::Compare(text) => text.clone(),
            Expr::Group(inner) => format!("({})", inner.text()),
            Expr::Edge(word, inner) => format!("{word}({})", inner.text()),
            Expr::Not(inner) => match **inner {
                Expr::Leaf(_) | Expr::Not(_) | Expr::Group(_) | Expr::Edge(..) => {
                    format!("!{}", inner.text())
                }
                _ => format!("!({})", inner.text()),
            },
            Expr::All(items) => {
                let items = items.iter().map(|item| match item {
                    Expr::Any(_) => format!("({})", item.text()),
                    _ => item.text(),
                });
                items.collect::<Vec<_>>().join(" & ")
            }
            Expr::Any(items) => items.iter().map(Expr::text).collect::<Vec<_>>().join(" | "),
        }
    }
}

#[derive(Clone, Debug)]
pub struct Branch {
    pub when: Vec<Expr>,
    pub instrs: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct Rung {
    /// `when`, or `leg.…`, with the series of its contacts.
    pub legs: Vec<(String, Vec<Expr>)>,
    pub instrs: Vec<String>,
    pub branches: Vec<Branch>,
}

#[derive(Clone, Debug)]
pub struct Stage {
    pub name: String,
    pub rungs: Vec<Rung>,
}

#[derive(Clone, Debug)]
pub struct Block {
    pub name: String,
    pub task: bool,
    pub subroutine: bool,
    pub autostart: bool,
    /// Whether the block's own rungs are written as one array of one-line tables.
    pub short: bool,
    pub rungs: Vec<Rung>,
    pub stages: Vec<Stage>,
}

#[derive(Clone, Debug)]
pub struct Tag {
    pub name: String,
    pub body: String,
    /// The bits and words of the tag that are watched by their names.
    pub watched: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct Case {
    pub seed: u64,
    pub period: i64,
    pub scans: i64,
    pub stop: bool,
    /// The local time of the first scan.
    pub clock: Clock,
    pub order: Option<Vec<String>>,
    pub tags: Vec<Tag>,
    /// The declarations of records, as TOML.
    pub records: Vec<String>,
    /// The templates; those without a use are not written.
    pub templates: Vec<DrawnTemplate>,
    pub blocks: Vec<Block>,
    pub columns: Vec<String>,
    pub rows: Vec<(i64, Vec<Option<i64>>)>,
}

pub const BUILTIN: [&str; 4] = ["FirstScan", "TopOfScan", "BottomOfScan", "LastScan"];

fn quoted(items: &[String]) -> String {
    let items = items.iter().map(|item| format!("\"{item}\""));
    format!("[{}]", items.collect::<Vec<_>>().join(", "))
}

fn series(items: &[Expr]) -> String {
    quoted(&items.iter().map(Expr::text).collect::<Vec<_>>())
}

impl Rung {
    /// The assignments of the rung, without its branches.
    fn parts(&self) -> Vec<String> {
        if let [(key, used), (_, name), arguments @ ..] = self.legs.as_slice()
            && key == "use"
        {
            let text = |of: &[Expr]| of.iter().map(Expr::text).collect::<String>();
            let with =
                arguments.iter().map(|(name, given)| format!("{name} = \"{}\"", text(given)));
            let with = with.collect::<Vec<_>>().join(", ");
            return vec![
                format!("use = \"{}\"", text(used)),
                format!("name = \"{}\"", text(name)),
                format!("with = {{ {with} }}"),
            ];
        }
        let legs = self.legs.iter().map(|(leg, contacts)| match leg.as_str() {
            "when" => format!("when = {}", series(contacts)),
            leg => format!("leg.{leg} = {}", series(contacts)),
        });
        let mut parts: Vec<String> = legs.collect();
        if !self.instrs.is_empty() {
            parts.push(format!("do = {}", quoted(&self.instrs)));
        }
        parts
    }

    fn one_line(&self) -> String {
        let mut parts = self.parts();
        if !self.branches.is_empty() {
            let branches = self.branches.iter().map(|branch| {
                format!("{{ when = {}, do = {} }}", series(&branch.when), quoted(&branch.instrs))
            });
            parts.push(format!("branch = [{}]", branches.collect::<Vec<_>>().join(", ")));
        }
        format!("{{ {} }}", parts.join(", "))
    }

    fn write(&self, header: &str, out: &mut String) {
        out.push_str(&format!("\n[[{header}]]\n{}\n", self.parts().join("\n")));
        for branch in &self.branches {
            let (when, instrs) = (series(&branch.when), quoted(&branch.instrs));
            out.push_str(&format!("\n[[{header}.branch]]\nwhen = {when}\ndo = {instrs}\n"));
        }
    }
}

impl Block {
    fn write(&self, out: &mut String) {
        let header = match (self.task, self.subroutine) {
            (true, _) => "task",
            (_, true) => "subroutine",
            _ => "program",
        };
        out.push_str(&format!("\n[[{header}]]\nname = \"{}\"\n", self.name));
        if self.autostart {
            out.push_str("autostart = true\n");
        }
        if self.short && !self.rungs.is_empty() {
            let rungs = self.rungs.iter().map(|rung| format!("    {},\n", rung.one_line()));
            out.push_str(&format!("rung = [\n{}]\n", rungs.collect::<String>()));
        } else {
            for rung in &self.rungs {
                rung.write(&format!("{header}.rung"), out);
            }
        }
        for stage in &self.stages {
            out.push_str(&format!("\n[[{header}.stage]]\nname = \"{}\"\n", stage.name));
            for rung in &stage.rungs {
                rung.write(&format!("{header}.stage.rung"), out);
            }
        }
    }
}

impl Case {
    pub fn ladder(&self) -> String {
        let mut out = format!("# seed {}\n[ladder]\nname = \"random\"\n", self.seed);
        if let Some(order) = &self.order {
            out.push_str(&format!("order = {}\n", quoted(order)));
        }
        if !self.tags.is_empty() {
            out.push_str("\n[tags]\n");
        }
        for tag in &self.tags {
            out.push_str(&format!("{} = {{ {} }}\n", tag.name, tag.body));
        }
        self.records.iter().for_each(|record| out.push_str(record));
        for template in self.templates.iter().filter(|template| self.uses(template)) {
            out.push_str(&format!("\n[[template]]\nname = \"{}\"\n", template.name));
            if !template.parameters.is_empty() {
                out.push_str("\n[template.parameters]\n");
            }
            for parameter in &template.parameters {
                out.push_str(&format!(
                    "{} = {{ type = \"{}\" }}\n",
                    parameter.name, parameter.kind
                ));
            }
            if !template.bits.is_empty() {
                out.push_str("\n[template.tags]\n");
            }
            for bit in &template.bits {
                out.push_str(&format!("{bit} = {{ type = \"bit\" }}\n"));
            }
            template.rungs.iter().for_each(|rung| rung.write("template.rung", &mut out));
        }
        for block in &self.blocks {
            block.write(&mut out);
        }
        out
    }

    fn all_rungs(&self) -> impl Iterator<Item = &Rung> {
        self.blocks.iter().flat_map(|block| {
            let stages = block.stages.iter().flat_map(|stage| &stage.rungs);
            block.rungs.iter().chain(stages)
        })
    }

    fn uses(&self, template: &DrawnTemplate) -> bool {
        let is_use = |(key, used): &(String, Vec<Expr>)| {
            key == "use" && used.iter().any(|used| used.text() == template.name)
        };
        self.all_rungs().any(|rung| rung.legs.first().is_some_and(is_use))
    }

    pub fn stimulus(&self) -> String {
        let mut out = String::from("scan");
        self.columns.iter().for_each(|column| out.push_str(&format!(",{column}")));
        for (scan, cells) in &self.rows {
            out.push_str(&format!("\n{scan}"));
            for cell in cells {
                let cell = cell.map(|value| value.to_string());
                out.push_str(&format!(",{}", cell.unwrap_or_default()));
            }
        }
        out + "\n"
    }

    /// All operands that a generated program can name.
    pub fn watch(&self) -> Vec<String> {
        let mut all = Vec::new();
        for (area, first, count) in super::pool::AREAS {
            all.extend((first..first + count).map(|n| format!("{area}{n}")));
        }
        for (area, count, members) in super::pool::STRUCTURES {
            for n in 0..count {
                all.extend(members.iter().map(|member| format!("{area}{n}.{member}")));
            }
        }
        for block in self.blocks.iter().filter(|block| !block.subroutine) {
            all.push(format!("{}.Running", block.name));
            if block.task {
                all.push(format!("{}.Done", block.name));
            }
            let stages = block.stages.iter();
            all.extend(stages.map(|stage| format!("{}.{}", block.name, stage.name)));
        }
        all.extend(["$1Second", "$ScanCounter", "$Year", "$Month", "$Day"].map(str::to_string));
        all.extend(["$Weekday", "$Hour", "$Minute", "$Second"].map(str::to_string));
        all.extend(["$DownSeconds", "$DayNumber", "$SecondOfDay"].map(str::to_string));
        all.extend(self.tags.iter().flat_map(|tag| tag.watched.clone()));
        all.extend(self.all_rungs().flat_map(|rung| own_bits(rung, &self.templates)));
        all
    }

    /// The arguments of `rungd sim` after the ladder and the stimulus.
    pub fn arguments(&self, watch: &[String]) -> Vec<String> {
        let mut all = vec![
            "--period".to_string(),
            format!("{}ms", self.period),
            "--scans".to_string(),
            self.scans.to_string(),
            "--clock".to_string(),
            clock::text(self.clock),
            "--watch".to_string(),
            watch.join(","),
        ];
        if self.stop {
            all.push("--stop".to_string());
        }
        all
    }
}
