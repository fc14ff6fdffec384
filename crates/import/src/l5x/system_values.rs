//! What a controller of Logix tells of itself, and is told: GSV, SSV, EVENT.
//!
//! Called by `walk`. The local time of day is rungd's own. Any other attribute, such as the state
//! of a module, exists in the original's controller alone: the tag is left to whoever brings it,
//! which is a named difference that says what the program sees.

use super::formula::LogixFormula;
use super::path::{self, PathPart};
use super::rll::RllInstruction;
use super::translate::{Terms, Translation, operand};
use super::types::{Kind, Member};
use crate::condition::TouchedPlace;

/// The classes of objects that have attributes.
const CLASSES: [&str; 19] = [
    "ADDONINSTRUCTIONDEFINITION",
    "AXIS",
    "CONTROLLER",
    "CONTROLLERDEVICE",
    "COORDINATESYSTEM",
    "CST",
    "DF1",
    "FAULTLOG",
    "HARDWARESTATUS",
    "MESSAGE",
    "MODULE",
    "MOTIONGROUP",
    "PROGRAM",
    "REDUNDANCY",
    "ROUTINE",
    "SERIALPORT",
    "TASK",
    "TIMESYNCHRONIZE",
    "WALLCLOCKTIME",
];

/// Year, month, day, hour, minute, second of the local time.
const CLOCK: [&str; 6] = ["$Year", "$Month", "$Day", "$Hour", "$Minute", "$Second"];

const NO_MICROSECONDS: &str = "the local time is that of the scan's beginning, in whole seconds";

impl Translation<'_> {
    /// GSV, SSV, EVENT.
    pub(super) fn system_value(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        if instruction.name == "EVENT" {
            return self.event(instruction);
        }
        let class = operand(instruction, 0)?;
        if !CLASSES.iter().any(|known| known.eq_ignore_ascii_case(class)) {
            return Err(format!("{} of the class {class}", instruction.name));
        }
        let attribute = operand(instruction, 2)?;
        let text = operand(instruction, 3)?.to_owned();
        if instruction.name == "SSV" {
            self.value(&text)?;
            self.differences
                .insert(format!("SSV sets nothing: rungd has no {attribute} of the class {class}"));
            return Ok(());
        }
        if attribute.eq_ignore_ascii_case("LocalDateTime") {
            return self.local_time(&text, when);
        }
        self.read(&text, &Kind::Dint)?;
        self.differences.insert(format!(
            "`{text}` is not set: rungd has no {attribute} of the class {class}; it keeps its \
             value (0, if the file gives none) until something else writes it: the map of a \
             device, or a rung with the device's `.Ok`"
        ));
        Ok(())
    }

    /// EVENT of a task: its programs are in another file.
    fn event(&mut self, instruction: &RllInstruction) -> Result<(), String> {
        let task = operand(instruction, 0)?;
        if self.calls.tasks.contains(&task.to_lowercase()) {
            return Err("EVENT of a task whose programs are in the file".to_owned());
        }
        self.differences
            .insert(format!("EVENT starts nothing: the file has no program of the task {task}"));
        Ok(())
    }

    /// The local time in seven DINTs: year, month, day, hour, minute, second, microseconds.
    fn local_time(&mut self, text: &str, when: &Terms) -> Result<(), String> {
        let places = self.seven_from(text)?;
        for (at, place) in places.iter().enumerate() {
            let value = match CLOCK.get(at) {
                Some(name) => LogixFormula {
                    reads: vec![TouchedPlace::of(name)],
                    ..LogixFormula::plain((*name).to_owned())
                },
                None => LogixFormula::whole(0),
            };
            self.store(place, value, when)?;
        }
        self.differences.insert(NO_MICROSECONDS.to_owned());
        Ok(())
    }

    /// The texts of seven neighbouring DINTs, of an array or of a structure's members.
    fn seven_from(&mut self, text: &str) -> Result<Vec<String>, String> {
        let refused = || format!("the local time in `{text}`, which is no row of seven DINTs");
        let path = path::parse(text).ok_or_else(refused)?;
        match path.parts.last() {
            Some(PathPart::Index(indexes)) => {
                let [index] = &indexes[..] else { return Err(refused()) };
                let first = path::whole(index).ok_or_else(refused)?;
                let array = text.rsplit_once('[').ok_or_else(refused)?.0;
                Ok((0..7).map(|at| format!("{array}[{}]", first + at)).collect())
            }
            Some(PathPart::Member(name)) => {
                let parent = text.rsplit_once('.').ok_or_else(refused)?.0;
                let structure = self.read(parent, &Kind::Dint)?;
                let Kind::Struct(kind) = &structure.kind else { return Err(refused()) };
                let members = &self.memory.types.structure(kind).ok_or_else(refused)?.members;
                let from = members.iter().position(|member| member.name.eq_ignore_ascii_case(name));
                let is_dint =
                    |member: &&Member| member.kind == Kind::Dint && member.dimensions.is_empty();
                let row = members.iter().skip(from.unwrap_or(members.len())).take_while(is_dint);
                let row: Vec<String> =
                    row.take(7).map(|member| format!("{parent}.{}", member.name)).collect();
                if row.len() == 7 { Ok(row) } else { Err(refused()) }
            }
            Some(PathPart::Bit(_) | PathPart::MovingBit(_)) | None => {
                Ok((0..7).map(|at| format!("{text}[{at}]")).collect())
            }
        }
    }
}
