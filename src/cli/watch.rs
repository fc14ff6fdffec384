//! `rungd watch`: prints the values of a running controller's operands repeatedly.
//!
//! On a terminal it redraws a table; elsewhere it prints one line for each reading. Each reading is
//! one request, and all its values are from one scan.

use std::io::{self, IsTerminal, Write};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use clap_complete::engine::ArgValueCompleter;

use super::exit::Exit;
use super::operator::{OperatorArgs, complete};
use super::read::table;
use super::terminal::{self, one_line, plain};
use rungd_client::operator::protocol::{OperandValues, Request, ShownValue};
use rungd_engine::isa::duration::{self, not_a_duration};
use rungd_language::resolve::value_texts::with_text;

const INTERVAL_LEAST: Duration = Duration::from_millis(50);

/// Shows the values of a running controller's operands, twice a second
#[derive(Args, Debug)]
pub struct WatchArgs {
    /// Tags, addresses, members, ranges (`X0..X7`); a structure, block or use of a
    /// template stands for all its members
    #[arg(required = true, value_name = "OPERAND", add = ArgValueCompleter::new(complete))]
    operands: Vec<String>,
    /// The time between two readings
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = interval)]
    interval: Duration,
    /// End after N readings
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
    #[command(flatten)]
    at: OperatorArgs,
}

fn interval(text: &str) -> Result<Duration, String> {
    let time = duration::parse(text).map(|ms| Duration::from_millis(ms.unsigned_abs().into()));
    match time {
        Ok(time) if time >= INTERVAL_LEAST => Ok(time),
        Ok(_) => Err("an interval is at least 50ms".to_owned()),
        Err(_) => Err(not_a_duration(text, "500ms or 2s")),
    }
}

/// Watches until it is interrupted, the count is reached, or no controller answers.
///
/// # Errors
/// Standard output cannot be written.
pub fn watch(args: &WatchArgs) -> Result<Exit> {
    let request = Request::Read { operands: args.operands.clone(), each: false };
    let drawn = io::stdout().is_terminal() && !args.at.json;
    let mut next = Instant::now();
    for look in 0.. {
        if args.count.is_some_and(|count| look >= count) {
            break;
        }
        sleep(next.saturating_duration_since(Instant::now()));
        next = Instant::now() + args.interval;
        let values: OperandValues = match args.at.ask(&request) {
            Ok(values) => values,
            Err(exit) => return Ok(exit),
        };
        match drawn {
            true => draw(&drawing(&values, look == 0, window()))?,
            false => args.at.print(&values, || line(&values))?,
        }
        io::stdout().flush()?;
    }
    Ok(Exit::Ok)
}

/// Prints a drawing, including its control sequences.
fn draw(drawing: &str) -> io::Result<()> {
    io::stdout().lock().write_all(drawing.as_bytes())
}

/// `RUN scan=120 jam=OFF bin_size=12,forced`.
fn line(values: &OperandValues) -> String {
    let name =
        |value: &ShownValue| one_line(value.tag.as_ref().unwrap_or(&value.operand)).into_owned();
    let forced = |value: &ShownValue| if value.forced { ",forced" } else { "" };
    let shown = values.values.iter();
    let shown = shown.map(|value| {
        let (forced, driven) = (forced(value), value.driven_text(","));
        let driven = driven.replace("output not known, last", "output=unknown,last");
        let driven = driven.replace("not known", "unknown");
        let unit = value.unit.as_deref().unwrap_or_default().replace(' ', "");
        let text = value.text.as_deref().map(|text| text.replace(' ', "_"));
        let held = with_text(format_args!("{}{unit}", value.value), text.as_deref());
        let held = held.replace(' ', "");
        format!(" {}={held}{forced}{}", name(value), driven.replace(' ', "="))
    });
    format!("{} scan={}{}\n", values.mode, values.scans, shown.collect::<String>())
}

/// The size of the terminal.
struct WindowSize {
    columns: usize,
    lines: usize,
}

/// The size of the terminal; without limits if it does not report its size.
fn window() -> WindowSize {
    let (columns, lines) = terminal::window(io::stdout()).unwrap_or((usize::MAX, usize::MAX));
    WindowSize { columns, lines }
}

/// The table, drawn from the top of the screen; the rest of the screen is cleared. Lines that do
/// not fit in the window are left out and counted, because a longer table would scroll.
fn drawing(values: &OperandValues, first: bool, window: WindowSize) -> String {
    let mut text = String::from(if first { "\x1b[2J\x1b[H" } else { "\x1b[H" });
    let mut lines = vec![format!("{}  scan {}", values.mode, values.scans)];
    lines.extend(plain(&table(&values.values)).lines().map(str::to_owned));
    // The last line of the window stays empty for the cursor.
    let room = window.lines.saturating_sub(1).max(2);
    if lines.len() > room {
        let hidden = lines.len() - (room - 1);
        lines.truncate(room - 1);
        lines.push(format!("… {hidden} more: the window has too few lines"));
    }
    for line in lines {
        // The last column stays empty too: the sequence that clears the rest of the line would
        // clear it.
        text.extend(line.chars().take(window.columns.saturating_sub(1).max(1)));
        text += "\x1b[K\n";
    }
    text + "\x1b[J"
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_client::operator::protocol::BitOrNumber;

    fn values() -> OperandValues {
        let value = |operand: &str, tag: Option<&str>, address: &str, value, forced| ShownValue {
            operand: operand.into(),
            tag: tag.map(str::to_owned),
            address: address.into(),
            value,
            unit: None,
            text: None,
            forced,
            driven: None,
            unknown: None,
        };
        let values = vec![
            value("jam", Some("jam"), "C0", BitOrNumber::Bit(false), false),
            value("D12", None, "D12", BitOrNumber::Word(-7), true),
        ];
        OperandValues { mode: "RUN".into(), scans: 120, values, refused: Vec::new() }
    }

    #[test]
    fn watched_values_are_printed_as_a_line_or_a_table() {
        assert_eq!(line(&values()), "RUN scan=120 jam=OFF D12=-7,forced\n");
        assert_eq!(table(&values().values), "jam  C0   OFF\nD12  D12  -7  forced\n");
        let drawing = drawing(&values(), true, WindowSize { columns: 80, lines: 25 });
        assert!(
            drawing.contains("RUN  scan 120\x1b[K\n") && drawing.ends_with("forced\x1b[K\n\x1b[J")
        );
    }

    #[test]
    fn an_output_is_shown_with_its_driven_value_outside_run() {
        let mut values = values();
        (values.mode, values.values[0].driven) = ("STOP".into(), Some(true));
        values.values[1].driven = Some(false);
        let look = "STOP scan=120 jam=OFF,output=ON D12=-7,forced,output=OFF\n";
        assert_eq!(line(&values), look);
        let rows = "jam  C0   OFF  output ON\nD12  D12  -7  forced  output OFF\n";
        assert_eq!(table(&values.values), rows);
    }

    #[test]
    fn a_table_stays_within_its_window() {
        let mut values = values();
        values.values = (0..20).flat_map(|_| values.values.clone()).collect();
        let drawing = drawing(&values, false, WindowSize { columns: 13, lines: 10 });
        let lines: Vec<&str> = drawing.lines().map(|l| l.trim_end_matches("\x1b[K")).collect();
        assert_eq!(lines.len(), 10, "nine lines, and the cursor's: {lines:?}");
        assert_eq!(
            (lines[1], lines[2], lines[8]),
            ("jam  C0   OF", "D12  D12  -7", "… 33 more: t")
        );
        let least = super::drawing(&values, false, WindowSize { columns: 0, lines: 0 });
        assert!(least.lines().count() <= 3, "{least:?}");
    }

    #[test]
    fn intervals_are_read_and_limited() {
        assert_eq!(interval("2s"), Ok(Duration::from_secs(2)));
        assert!(interval("10ms").is_err() && interval("often").is_err());
    }
}
