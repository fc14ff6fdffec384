//! Coils, timers and counters of Logix.
//!
//! Timers and counters are templates (`logix.toml`, a part of each project): Logix' structures
//! stand still, count and reset other than rungd's own.

use super::data::{Datum, NamedDatum};
use super::locate::{Index, LocatedOperand};
use super::path::whole;
use super::rll::RllInstruction;
use super::translate::{BitWrite, Terms, Translation, contact_on, operand};
use super::types::Kind;
use crate::condition::TouchedPlace;
use crate::model::{Action, ActionForm, RungStep, Term, UseArgument};

impl Translation<'_> {
    /// OTE, OTL, OTU, OSR, OSF.
    pub(super) fn coil(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        let bit = self.bit_to_write(operand(instruction, 0)?)?;
        match instruction.name.as_str() {
            "OTE" => {
                self.prescan.coil(self.scope, &bit);
                self.write_bit(&bit, when.clone(), BitWrite::Follow)
            }
            "OTL" => {
                self.prescan.other(&bit.place());
                self.write_bit(&bit, when.clone(), BitWrite::Set)
            }
            "OTU" => {
                self.prescan.other(&bit.place());
                self.write_bit(&bit, when.clone(), BitWrite::Reset)
            }
            name => {
                let output = self.bit_to_write(operand(instruction, 1)?)?;
                self.prescan.reset(self.scope, &output);
                self.edge(when, EdgeBits { storage: bit, output, is_rising: name == "OSR" })
            }
        }
    }

    /// OSR, OSF: the output is ON for the scan of the edge.
    fn edge(&mut self, when: &Terms, bits: EdgeBits) -> Result<(), String> {
        let EdgeBits { storage, output, is_rising } = bits;
        let stored = contact_on(&storage);
        let at = self.steps.len();
        let edge = match is_rising {
            true => {
                self.prescan.set(self.scope, &storage);
                let mut edge = when.clone();
                edge.push(Term { condition: stored.opposite(), at });
                edge
            }
            false => {
                self.prescan.reset(self.scope, &storage);
                let off = self.whole(when.clone()).opposite();
                vec![self.term(off), self.term(stored)]
            }
        };
        self.write_bit(&output, edge, BitWrite::Follow)?;
        self.write_bit(&storage, when.clone(), BitWrite::Follow)
    }

    /// TON, TOF, RTO, CTU, CTD, RES.
    pub(super) fn structure(
        &mut self,
        instruction: &RllInstruction,
        when: &Terms,
    ) -> Result<(), String> {
        let name = instruction.name.as_str();
        let text = operand(instruction, 0)?;
        let wanted = match name {
            "CTU" | "CTD" => "counter",
            "TON" | "TOF" | "RTO" => "timer",
            _ => "",
        };
        let guess = if wanted.is_empty() { "timer" } else { wanted };
        self.declare_preset(text, guess, instruction);
        let structure = self.written(text, &Kind::Struct(guess.to_owned()))?;
        self.memory.variables[structure.variable].is_read = true;
        let Kind::Struct(kind) = &structure.kind else {
            return Err(format!("`{text}` is no structure"));
        };
        if !wanted.is_empty() && kind != wanted || !structure.dimensions.is_empty() {
            return Err(format!("`{text}` is no {wanted}"));
        }
        let field = |field: &str| format!("{}.{field}", structure.text);
        match name {
            "RES" => return self.reset(&structure, when),
            "CTU" => self.prescan.text(self.scope, format!("SET {}", field("cu"))),
            "CTD" => self.prescan.text(self.scope, format!("SET {}", field("cd"))),
            _ => {
                for bit in ["en", "tt"] {
                    self.prescan.text(self.scope, format!("RST {}", field(bit)));
                }
                if name != "RTO" {
                    self.prescan.text(self.scope, format!("RST {}", field("dn")));
                }
                let pre = field("pre");
                let value = match name {
                    "TON" => Some("0"),
                    "TOF" => Some(pre.as_str()),
                    _ => None,
                };
                if let Some(value) = value {
                    self.prescan.text(self.scope, format!("MOVE {value} to={}", field("acc")));
                }
            }
        }
        if let Index::Moving(_) = structure.index {
            return Err(format!("{name} of a structure with a moving index"));
        }
        self.use_template(name, &structure, when.clone());
        Ok(())
    }

    /// A use of the template of a timer or counter.
    fn use_template(&mut self, name: &str, structure: &LocatedOperand, when: Terms) {
        let (first, rest) = name.split_at(1);
        let template = format!("{first}{}", rest.to_lowercase());
        let parameter = if name.starts_with("CT") { "counter" } else { "timer" };
        let wish = format!("{}_{}", structure.text, name.to_lowercase());
        let wish = wish.replace(['[', ']', '.'], "_");
        let own = self.memory.names.fresh(&wish);
        self.steps.push(RungStep {
            when,
            action: Action {
                form: ActionForm::Use {
                    template,
                    name: own,
                    contact: Some("run"),
                    arguments: vec![UseArgument {
                        name: parameter.to_owned(),
                        value: structure.text.clone(),
                    }],
                },
                writes: vec![TouchedPlace::of(&structure.text)],
            },
        });
    }

    /// RES: the accumulator, the position and all bits are 0.
    fn reset(&mut self, structure: &LocatedOperand, when: &Terms) -> Result<(), String> {
        let refused = || format!("RES of `{}`", structure.text);
        let Kind::Struct(kind) = &structure.kind else { return Err(refused()) };
        let (bits, word): (&[&str], &str) = match kind.as_str() {
            "timer" => (&["en", "tt", "dn"], "acc"),
            "counter" => (&["cu", "cd", "dn", "ov", "un"], "acc"),
            "control" => (&["en", "eu", "dn", "em", "er", "ul", "in", "fd"], "pos"),
            _ => return Err(refused()),
        };
        let writes = vec![TouchedPlace::of(&structure.text)];
        let is_moving = matches!(structure.index, Index::Moving(_));
        for bit in bits {
            let text = match is_moving {
                true => format!("MATH {}.{bit} = 0", structure.text),
                false => format!("RST {}.{bit}", structure.text),
            };
            self.push(when.clone(), text, writes.clone());
        }
        let text = match is_moving {
            true => format!("MATH {}.{word} = 0", structure.text),
            false => format!("MOVE 0 to={}.{word}", structure.text),
        };
        self.push(when.clone(), text, writes);
        Ok(())
    }

    /// Gives a tag without data the preset that the rung shows.
    fn declare_preset(&mut self, text: &str, kind: &str, instruction: &RllInstruction) {
        let Some(preset) = instruction.operands.get(1).filter(|text| whole(text).is_some()) else {
            return;
        };
        let id = match self.memory.known(self.scope, text) {
            Some(id) => id,
            None if text.contains(['.', '[']) => return,
            None => self.memory.variable(self.scope, text, &Kind::Struct(kind.to_owned())),
        };
        let variable = &mut self.memory.variables[id];
        if variable.data.is_none() && variable.dimensions.is_empty() && variable.parts.is_empty() {
            let datum = Datum::Value { kind: "DINT".to_owned(), text: preset.clone() };
            variable.data = Some(Datum::Structure {
                kind: kind.to_owned(),
                members: vec![NamedDatum { name: "PRE".to_owned(), datum }],
            });
        }
    }
}

/// The operands of OSR and OSF.
struct EdgeBits {
    storage: LocatedOperand,
    output: LocatedOperand,
    is_rising: bool,
}
