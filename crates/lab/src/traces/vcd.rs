//! Traces as VCD (IEEE 1364), the format that GTKWave and other waveform viewers read.
//!
//! A bit is a `wire`, a word an `integer` of 32 bits, a real a `real`; the one scope is `rungd`.
//! Times are in µs. Only changes are written, so a quiet plant needs few bytes. Names become
//! Verilog identifiers, because a viewer reads `.` as part of a hierarchy and `[` as part of a
//! vector. A comment contains the name in the ladder if it differs. The variable `stop` is 1 in the
//! row of that name. Two rows of the same time (a scan and its stop) are 1 µs apart, so that both
//! are visible.

use std::collections::HashSet;
use std::io::{self, Write};

use super::trace::{RowName, TracedOperand, ValueTrace};
use rungd_engine::Cell;
use rungd_engine::isa::Real;

/// The characters of a variable's short name: from `!` to `~`.
const FIRST: u8 = b'!';
const CHARACTERS: usize = 94;

/// Writes rows as VCD.
pub struct VcdTrace<'a, W: Write> {
    watched: &'a [TracedOperand],
    out: W,
    /// The short names of the operands, and, as the last, the short name of `stop`.
    codes: Vec<String>,
    /// The values of the last row.
    last: Vec<i32>,
    /// Whether the last row was an orderly stop.
    stopped: bool,
    /// The time of the last row, and the last time that was written.
    time_us: Option<u64>,
    written_us: Option<u64>,
}

impl<'a, W: Write> VcdTrace<'a, W> {
    /// Writes the declarations.
    ///
    /// # Errors
    /// The error of the output.
    pub fn new(watched: &'a [TracedOperand], mut out: W) -> io::Result<Self> {
        let codes: Vec<String> = (0..=watched.len()).map(code).collect();
        writeln!(out, "$version rungd {} $end", env!("CARGO_PKG_VERSION"))?;
        writeln!(out, "$timescale 1 us $end")?;
        let names = names(watched);
        for (watched, name) in watched.iter().zip(&names).filter(|(w, name)| w.name != **name) {
            // A `$` could end the comment.
            let ladder = watched.name.replace('$', "");
            writeln!(out, "$comment {name} is {ladder} of the ladder $end")?;
        }
        writeln!(out, "$scope module rungd $end")?;
        for ((watched, name), code) in watched.iter().zip(&names).zip(&codes) {
            let kind = match watched.cell {
                Cell::Bit(_) | Cell::WordBit(_) => "wire 1",
                Cell::Word(_) if watched.real => "real 64",
                Cell::Word(_) => "integer 32",
            };
            writeln!(out, "$var {kind} {code} {name} $end")?;
        }
        writeln!(out, "$var wire 1 {} stop $end", codes[watched.len()])?;
        writeln!(out, "$upscope $end\n$enddefinitions $end")?;
        let (last, stopped) = (Vec::new(), false);
        Ok(VcdTrace { watched, out, codes, last, stopped, time_us: None, written_us: None })
    }

    /// Writes the time of the last row, so that a viewer shows that row; flushes, and returns the
    /// writer.
    ///
    /// # Errors
    /// The error of the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.at_last_time()?;
        self.out.flush()?;
        Ok(self.out)
    }

    /// Writes the time of the last row, unless it was already written.
    fn at_last_time(&mut self) -> io::Result<()> {
        if let Some(time_us) = self.time_us.filter(|_| self.written_us != self.time_us) {
            writeln!(self.out, "#{time_us}")?;
            self.written_us = self.time_us;
        }
        Ok(())
    }

    fn all(&mut self, values: &[i32], stop: bool) -> io::Result<()> {
        self.at_last_time()?;
        writeln!(self.out, "$dumpvars")?;
        for (at, value) in values.iter().enumerate() {
            self.change(at, *value)?;
        }
        writeln!(self.out, "{}{}\n$end", u8::from(stop), self.codes[self.watched.len()])
    }

    fn change(&mut self, at: usize, value: i32) -> io::Result<()> {
        let (watched, code) = (&self.watched[at], &self.codes[at]);
        match watched.cell {
            Cell::Bit(_) | Cell::WordBit(_) => writeln!(self.out, "{}{code}", u8::from(value != 0)),
            Cell::Word(_) if watched.real => {
                writeln!(self.out, "r{} {code}", Real::of_cell(value))
            }
            Cell::Word(_) => writeln!(self.out, "b{value:b} {code}"),
        }
    }
}

impl<W: Write> ValueTrace for VcdTrace<'_, W> {
    fn watched(&self) -> &[TracedOperand] {
        self.watched
    }

    fn values(&mut self, name: RowName, time_us: u64, values: &[i32]) -> io::Result<()> {
        let stop = name == RowName::Stop;
        let is_first = self.time_us.is_none();
        let after = self.time_us.map_or(time_us, |last| last.saturating_add(1));
        self.time_us = Some(time_us.max(after));
        if is_first {
            self.all(values, stop)?;
        } else {
            for (at, value) in values.iter().enumerate() {
                if self.last[at] != *value {
                    self.at_last_time()?;
                    self.change(at, *value)?;
                }
            }
            if self.stopped != stop {
                self.at_last_time()?;
                writeln!(self.out, "{}{}", u8::from(stop), self.codes[self.watched.len()])?;
            }
        }
        self.stopped = stop;
        self.last.clear();
        self.last.extend_from_slice(values);
        Ok(())
    }
}

/// The short name of a variable: `!`, `"` … `~`, `!!` …
fn code(mut number: usize) -> String {
    let mut text = String::new();
    loop {
        text.push(char::from(FIRST + (number % CHARACTERS) as u8));
        number /= CHARACTERS;
        if number == 0 {
            return text;
        }
        number -= 1;
    }
}

/// The operands' names as Verilog identifiers: all different, and none of them `stop`.
fn names(watched: &[TracedOperand]) -> Vec<String> {
    let mut taken = HashSet::from(["stop".to_owned()]);
    let mut names = Vec::new();
    for watched in watched {
        let plain = identifier(&watched.name);
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let mut free = std::iter::once(plain.clone()).chain(numbered);
        let name = free.find(|name| !taken.contains(name)).unwrap_or(plain);
        taken.insert(name.clone());
        names.push(name);
    }
    names
}

/// `recipe[3]` becomes `recipe_3`, `CT0.Acc` becomes `CT0_Acc`.
fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let text: String = name.trim_end_matches(']').chars().map(plain).collect();
    match text.starts_with(|c: char| c.is_ascii_digit()) || text.is_empty() {
        true => format!("_{text}"),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rungd_engine::{BitCell, WordCell};

    fn bit(name: &str) -> TracedOperand {
        TracedOperand { name: name.to_owned(), cell: Cell::Bit(BitCell(0)), real: false }
    }

    fn word(name: &str, real: bool) -> TracedOperand {
        TracedOperand { name: name.to_owned(), cell: Cell::Word(WordCell(0)), real }
    }

    fn vcd(watched: &[TracedOperand], rows: &[(RowName, u64, &[i32])]) -> String {
        let mut trace = VcdTrace::new(watched, Vec::new()).unwrap();
        for (name, time_us, values) in rows {
            trace.values(*name, *time_us, values).unwrap();
        }
        let text = String::from_utf8(trace.finish().unwrap()).unwrap();
        text.replace(env!("CARGO_PKG_VERSION"), "VERSION")
    }

    #[test]
    fn a_value_is_written_only_when_it_changes() {
        let watched = [bit("Y0"), word("CT0.Acc", false), word("R1", true), bit("$End")];
        let real = |number: f32| Real::finite(number).unwrap().cell();
        let text = vcd(
            &watched,
            &[
                (RowName::Scan(7), 0, &[0, -1, real(0.5), 1]),
                (RowName::Scan(8), 10_000, &[1, -1, real(0.5), 1]),
                (RowName::Scan(9), 20_000, &[1, -1, real(0.5), 1]),
                (RowName::Scan(10), 30_500, &[1, 6, real(-2.5e-7), 1]),
                (RowName::Stop, 30_500, &[0, 6, real(-2.5e-7), 1]),
            ],
        );
        expect_test::expect![[r##"
            $version rungd VERSION $end
            $timescale 1 us $end
            $comment CT0_Acc is CT0.Acc of the ladder $end
            $comment _End is End of the ladder $end
            $scope module rungd $end
            $var wire 1 ! Y0 $end
            $var integer 32 " CT0_Acc $end
            $var real 64 # R1 $end
            $var wire 1 $ _End $end
            $var wire 1 % stop $end
            $upscope $end
            $enddefinitions $end
            #0
            $dumpvars
            0!
            b11111111111111111111111111111111 "
            r0.5 #
            1$
            0%
            $end
            #10000
            1!
            #30500
            b110 "
            r-2.5e-7 #
            #30501
            0!
            1%
        "##]]
        .assert_eq(&text);
    }

    #[test]
    fn the_last_time_is_written_even_without_a_change() {
        let text = vcd(&[bit("Y0")], &[(RowName::Scan(0), 0, &[1]), (RowName::Scan(1), 9, &[1])]);
        assert!(text.ends_with("$end\n#9\n"), "{text}");
        assert!(vcd(&[], &[]).ends_with("$enddefinitions $end\n"));
    }

    #[test]
    fn names_become_unique_identifiers() {
        let all = ["a.b", "a_b", "a[12]", "stop", "7up", "é", "x y", "Y0@old"];
        let watched: Vec<TracedOperand> = all.iter().map(|name| bit(name)).collect();
        let named = ["a_b", "a_b_2", "a_12", "stop_2", "_7up", "_", "x_y", "Y0_old"];
        assert_eq!(names(&watched), named);
    }

    #[test]
    fn short_codes_are_unique_and_printable() {
        let codes: HashSet<String> = (0..20_000).map(code).collect();
        assert_eq!(codes.len(), 20_000);
        assert!(codes.iter().all(|code| code.bytes().all(|byte| (b'!'..=b'~').contains(&byte))));
        assert_eq!([code(0), code(93), code(94)], ["!", "~", "!!"]);
    }
}
