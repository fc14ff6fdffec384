//! Makes a part's settings from its keys.

use super::keys::{PlantPartKind, WrittenPart};
use rungd_io::plant::settings::{Delays, PartSettings, Scale};
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::{Help, advise, give_one, pair, propose};
use rungd_language::source::span::{Located, Span};

/// The length of a part on a belt if `part-length` is not given, mm.
const PART_MM: u32 = 100;

/// A part's settings, if its keys are valid.
pub fn resolve(part: &WrittenPart, findings: &mut Vec<Finding>) -> Option<PartSettings> {
    let mut reader = PartReader { part, findings };
    let delays = reader.delays();
    Some(match part.kind? {
        PlantPartKind::Delay => PartSettings::Delay { delays, invert: part.invert },
        PlantPartKind::Motor => PartSettings::Motor { delays },
        PlantPartKind::Conveyor => reader.conveyor()?,
        PlantPartKind::Tank => reader.tank()?,
        PlantPartKind::Sensor => reader.sensor(delays)?,
        PlantPartKind::Pulse => reader.pulse()?,
        PlantPartKind::Lag => reader.lag()?,
    })
}

struct PartReader<'a> {
    part: &'a WrittenPart,
    findings: &'a mut Vec<Finding>,
}

impl PartReader<'_> {
    fn find(&mut self, code: Code, span: Span, message: impl Into<String>, help: impl Into<Help>) {
        self.findings.push(Finding::new(code, span, message).help(help));
    }

    fn missing<T>(&mut self, key: &str, example: &str) -> Option<T> {
        let kind = self.part.kind.map_or("part", PlantPartKind::name);
        let message = format!("a {kind} has no `{key}`");
        self.find(Code::MissingKey, self.part.span, message, give_one(key, example));
        None
    }

    fn time(&self, key: &str) -> Option<u32> {
        self.part.time(key).map(|ms| ms.value.max(0).unsigned_abs())
    }

    fn number(&self, key: &str) -> Option<u32> {
        self.part.number(key).map(|number| small(number.value))
    }

    /// A required time of at least 1 ms.
    fn some_time(&mut self, key: &str) -> Option<u32> {
        match self.part.time(key) {
            Some(ms) if ms.value < 1 => {
                let help = propose(pair(format!("{key} = \"2s\"")));
                self.find(Code::OutOfRange, ms.span, format!("`{key}` is at least 1ms"), help);
                None
            }
            Some(ms) => Some(ms.value.unsigned_abs()),
            None => self.missing(key, "\"2s\""),
        }
    }

    fn delays(&self) -> Delays {
        let after_ms = self.time("after").unwrap_or(0);
        Delays { after_ms, release_ms: self.time("release").unwrap_or(after_ms) }
    }

    fn conveyor(&mut self) -> Option<PartSettings> {
        let length = self.number("length").or_else(|| self.missing("length", "2000"));
        let speed = self.number("speed").or_else(|| self.missing("speed", "500"));
        let every = self.part.time("every").map(|_| self.some_time("every"));
        // A part leaves the belt when its front reaches the end, so an eye must be before the end.
        let eyes_mm = self.places("the belt", length.map(|length| length - 1));
        Some(PartSettings::Conveyor {
            length_mm: length?,
            speed_mm_s: speed?,
            every_ms: every.unwrap_or(Some(0))?,
            part_mm: self.number("part-length").unwrap_or(PART_MM),
            eyes_mm,
        })
    }

    fn tank(&mut self) -> Option<PartSettings> {
        let capacity = self.number("capacity").or_else(|| self.missing("capacity", "1000"));
        let initial = self.number("initial").unwrap_or(0);
        if let (Some(at), Some(most)) = (self.part.number("initial"), capacity)
            && at.value > i64::from(most)
        {
            let help = Help::from("begin with less").with(most.to_string());
            self.find(Code::OutOfRange, at.span, "more than the tank holds", help);
        }
        if let Some(at) = self.part.number("initial").filter(|at| at.value < 0) {
            let help = Help::from("begin with 0 or more").with("0");
            self.find(Code::OutOfRange, at.span, "a level below 0", help);
        }
        let switches = self.places("the tank", capacity);
        Some(PartSettings::Tank {
            capacity: capacity?,
            fill_rate: self.number("fill-rate").unwrap_or(0),
            drain_rate: self.number("drain-rate").unwrap_or(0),
            initial,
            switches,
        })
    }

    /// The named places, with a finding for each place beyond the end.
    fn places(&mut self, what: &str, end: Option<u32>) -> Vec<u32> {
        let Some(end) = end else { return Vec::new() };
        let part = self.part;
        for (name, at) in part.places.iter().filter(|(_, at)| at.value > i64::from(end)) {
            let message = format!("`{}` lies beyond {what}", name.text);
            let help = Help::from(format!("the last place is {end}")).with(end.to_string());
            self.find(Code::OutOfRange, at.span, message, help);
        }
        part.places.iter().map(|(_, at)| small(at.value)).collect()
    }

    fn sensor(&mut self, delays: Delays) -> Option<PartSettings> {
        let at = |key| self.part.number(key).map(|number| number.value as i32);
        let on_at = at("on-at").unwrap_or(1);
        let off_at = at("off-at").unwrap_or(on_at);
        if let Some(written) = self.part.number("off-at").filter(|_| off_at > on_at) {
            let message = "`off-at` must be at or below `on-at`";
            let invert = pair("invert = true").possible();
            let help = advise("for a sensor that is ON below a value, add `{}`", [invert]);
            self.find(Code::Controller, written.span, message, help);
        }
        let (range, raw) = (self.pair("range"), self.pair("raw"));
        let scale = match (range, raw) {
            (Some(range), Some(raw)) => Some(Scale { range: range?, raw: raw? }),
            (None, None) => None,
            (range, _) => {
                let (there, missing) =
                    if range.is_some() { ("range", "raw") } else { ("raw", "range") };
                let span = self.part.pair(there).map_or(self.part.span, |pair| pair.span);
                let ends = pair(format!("{missing} = [0, 1000]")).possible();
                let help = advise(&format!("give it `{missing}` too: `{{}}`"), [ends]);
                let message = format!("`{there}` without `{missing}`");
                self.find(Code::MissingKey, span, message, help);
                return None;
            }
        };
        Some(PartSettings::Sensor { on_at, off_at, delays, invert: self.part.invert, scale })
    }

    fn pair(&mut self, key: &str) -> Option<Option<[i32; 2]>> {
        let pair = self.part.pair(key)?;
        let two: Option<[i64; 2]> = pair.value.as_slice().try_into().ok();
        if two.is_none_or(|[low, high]| key == "range" && low == high) {
            let message = format!("`{key}` is two numbers, one for each end");
            self.find(Code::Controller, pair.span, message, propose("[0, 1000]"));
            return Some(None);
        }
        Some(two.map(|two| two.map(|number| number as i32)))
    }

    fn lag(&mut self) -> Option<PartSettings> {
        let number = |key| self.part.number(key).map(|number| number.value as i32);
        let (gain, ambient) = (number("gain"), number("ambient").unwrap_or(0));
        let initial = number("initial").unwrap_or(ambient);
        let gain = gain.or_else(|| self.missing("gain", "2000"));
        let time_ms = self.some_time("time-constant");
        Some(PartSettings::Lag { gain: gain?, ambient, initial, time_ms: time_ms? })
    }

    fn pulse(&mut self) -> Option<PartSettings> {
        let (width, every) = (self.some_time("pulse"), self.some_time("every"));
        let (width_ms, every_ms) = (width?, every?);
        if let Some(Located { span, .. }) = self.part.time("pulse").filter(|_| width_ms > every_ms)
        {
            let message = "`pulse` is longer than `every`";
            let half = pair(format!("pulse = \"{}ms\"", every_ms.div_ceil(2)));
            let help = Help::from("make `pulse` shorter").with(half);
            self.find(Code::Controller, *span, message, help);
        }
        Some(PartSettings::Pulse {
            width_ms,
            every_ms,
            offset_ms: self.time("offset").unwrap_or(0),
            invert: self.part.invert,
        })
    }
}

/// A number as 32 bits; its reader has checked that it is not negative and that it fits.
fn small(number: i64) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
