//! Large programs: for a program of sixteen times the size, a reload prepares its plan and its
//! retentive memory in about sixteen times the processor time. The measure is the time of the
//! test's thread, in one run; the margin is wide.

use std::time::Duration;

use rungd_engine::isa::{MemorySizes, Space, WordSpace};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::range::Range;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::span::{SourceFile, Span};
use rungd_state::reload::{LoweredProgram, ReloadPlan};
use rungd_state::retain::RetainPlan;

/// The smaller size, and the factor from the smaller to the larger size.
const SIZE: usize = 600;
const TIMES: usize = 16;
/// The maximum ratio of the costs. For work that grows with the square of the size, the ratio is
/// 256.
const RATIO_MAX: u32 = 40;
/// A cost so small that ratios of such costs mean nothing.
const LITTLE: Duration = Duration::from_millis(20);

struct Large {
    program: Program,
    code: rungd_engine::EngineProgram,
    symbols: Symbols,
}

impl Large {
    fn new(ladder: &str) -> Large {
        let sizes = MemorySizes { d: 65_536, t: 65_536, ..MemorySizes::default() };
        let text = format!("{ladder}\n[[program]]\nname = \"Main\"\n");
        let file = SourceFile { name: "large.toml".into(), text };
        let options = LoadOptions { sizes, ..LoadOptions::default() };
        let (program, findings) = load_ladders(&[file], &options);
        let program = program.unwrap_or_else(|| panic!("{:?}", findings.first()));
        let (code, symbols) = lower(&program);
        Large { program, code, symbols }
    }

    /// A program with these tags of D words.
    fn with_tags(count: usize, tag: impl Fn(usize) -> (String, usize, &'static str)) -> Large {
        let line = |at: usize| {
            let (name, address, keys) = tag(at);
            format!("{name} = {{ at = \"D{address}\"{keys} }}\n")
        };
        Large::new(&format!("[tags]\n{}", (0..count).map(line).collect::<String>()))
    }

    fn side(&self) -> LoweredProgram<'_> {
        LoweredProgram { program: &self.code, symbols: &self.symbols }
    }
}

/// The processor time of this thread. The kernel counts it when the thread yields.
fn processor_time() -> Duration {
    std::thread::yield_now();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").expect("the thread runs");
    let ran = told.split(' ').next().and_then(|ns| ns.parse().ok()).expect("nanoseconds");
    Duration::from_nanos(ran)
}

/// Checks that work costs in proportion to the size. `prepare` makes the work's input for a size.
#[track_caller]
fn costs_in_proportion<T>(prepare: impl Fn(usize) -> T, work: impl Fn(&T)) {
    let inputs = [SIZE, TIMES * SIZE].map(prepare);
    let cost = |input: &T| {
        let began = processor_time();
        work(input);
        processor_time() - began
    };
    // A real excess occurs in each of three tries. A busy machine, whose caches other programs
    // empty, may cause it in one of them.
    let tries = (0..3).map_while(|_| {
        let [small, large] = [cost(&inputs[0]), cost(&inputs[1])];
        (large > small * RATIO_MAX + LITTLE).then(|| format!("{small:?}, {large:?}"))
    });
    let tries: Vec<String> = tries.collect();
    assert!(tries.len() < 3, "{}", tries.join("; "));
}

/// A reload's programs.
struct Reload {
    old: Large,
    new: Large,
}

fn plan(Reload { old, new }: &Reload) {
    let plan = ReloadPlan::new(old.side(), new.side());
    assert!(!plan.transfer.blocks.is_empty());
}

#[test]
fn the_cost_of_renaming_tags_is_proportional_to_their_number() {
    let tags = |count: usize| {
        let old = Large::with_tags(count, |at| (format!("a{at:06}"), at, ""));
        let new = Large::with_tags(count, |at| (format!("b{:06}", count - at), at, ""));
        Reload { old, new }
    };
    costs_in_proportion(tags, plan);
}

#[test]
fn the_cost_of_moving_tags_is_proportional_to_their_number() {
    let tags = |count: usize| {
        let old = Large::with_tags(count, |at| (format!("a{at:06}"), at, ""));
        let new = |at: usize| (format!("a{at:06}"), 33_000 + at, ", initial = 1");
        Reload { old, new: Large::with_tags(count, new) }
    };
    costs_in_proportion(tags, plan);
}

#[test]
fn the_cost_of_reloading_recurrent_tasks_is_proportional_to_their_number() {
    let tasks = |count: usize, every: &str| {
        let task = |at: usize| format!("[[task]]\nname = \"Task{at}\"\n");
        let rung = |at: usize| {
            format!("{{ when = [\"X0\"], do = [\"ENTASK Task{at} every={every}\"] }},\n")
        };
        let tasks: String = (0..count).map(task).collect();
        let rungs: String = (0..count).map(rung).collect();
        let starter = format!("[[program]]\nname = \"Starter\"\nrung = [\n{rungs}]\n");
        Large::new(&format!("{tasks}{starter}"))
    };
    let prepare = |count: usize| Reload { old: tasks(count, "1s"), new: tasks(count, "2s") };
    costs_in_proportion(prepare, plan);
}

#[test]
fn the_cost_of_retained_words_and_timers_is_proportional_to_their_number() {
    let prepare = |count: usize| {
        let tag = |at: usize| format!("a{at} = {{ at = \"D{}\" }}\n", 2 * at);
        let tags: String = (0..count).map(tag).collect();
        let rung = |at: usize| format!("{{ when = [\"X0\"], do = [\"TMR T{at} preset=1s\"] }},\n");
        let rungs: String = (0..count).map(rung).collect();
        let timers = format!("[[program]]\nname = \"Timers\"\nrung = [\n{rungs}]\n");
        let large = Large::new(&format!("[tags]\n{tags}{timers}"));
        let span = Span::default();
        let range = |space, first, last| Range {
            space,
            first,
            last,
            span,
            of_tag: false,
            of_record: false,
        };
        let word = |at: u32| range(Space::Word(WordSpace::D), 2 * at, 2 * at);
        let words = (0..count as u32).map(word);
        let ranges = words.chain([range(Space::Timer, 0, count as u32 - 1)]);
        (large, ranges.collect::<Vec<_>>())
    };
    costs_in_proportion(prepare, |(large, ranges)| {
        let plan = RetainPlan::new(ranges, &large.program, &large.symbols);
        assert!(plan.content_bytes() > 0);
    });
}
