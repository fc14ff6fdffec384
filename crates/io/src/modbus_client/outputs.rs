//! The plan of writes: neighbouring outputs in few requests, and the values that were written last.
//!
//! A run is a sequence of neighbouring coils or holding registers of one unit that are all outputs.
//! After a change, the elements from the first changed one to the last are written. The whole run
//! is written when all outputs are due, and if the peer's values are not known: at the start, and
//! after a failed write.

use super::request::{push_write_multiple, push_write_single};
use super::settings::{ModbusPoint, ModbusTable, PeerHabits, PointForm, WriteFunctions};
use super::values;
use crate::modbus::pdu::{WRITE_BITS_MAX, WRITE_WORDS_MAX};

/// Neighbouring outputs.
#[derive(Clone, Debug)]
pub struct OutputRun {
    /// The unit.
    pub unit: u8,
    /// Coils or holding registers.
    pub table: ModbusTable,
    /// The first address.
    pub first: u16,
    /// The outputs, each with its number in the order of the map.
    points: Vec<(usize, ModbusPoint)>,
    /// The wanted values, one per element: 0 or 1 for a coil, the content for a register.
    wanted: Vec<u16>,
    /// The values that were written last.
    sent: Vec<u16>,
    /// Whether the peer is known to have the values of `sent`.
    is_known: bool,
}

/// A part of a run, in elements from its first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunPart {
    from: usize,
    to: usize,
}

impl RunPart {
    /// The number of its elements.
    pub fn count(self) -> usize {
        self.to - self.from
    }
}

/// The runs of all outputs.
pub fn runs(points: &[ModbusPoint], habits: &PeerHabits) -> Vec<OutputRun> {
    let mut runs: Vec<OutputRun> = Vec::new();
    for (at, point) in ModbusPoint::by_place(points) {
        let run = match runs.last_mut() {
            Some(run) if run.takes(&point, habits) => run,
            _ => {
                runs.push(OutputRun::begin(&point));
                runs.last_mut().expect("it was put there")
            }
        };
        let count = usize::from(point.at - run.first + point.width());
        run.wanted.resize(count.max(run.wanted.len()), 0);
        run.sent.resize(run.wanted.len(), 0);
        run.points.push((at, point));
    }
    runs
}

impl OutputRun {
    fn begin(point: &ModbusPoint) -> OutputRun {
        OutputRun {
            unit: point.unit,
            table: point.table,
            first: point.at,
            points: Vec::new(),
            wanted: Vec::new(),
            sent: Vec::new(),
            is_known: false,
        }
    }

    /// Whether a point belongs to this run. The point must not be before the run's first point.
    fn takes(&self, point: &ModbusPoint, habits: &PeerHabits) -> bool {
        let max = if self.table.is_bits() { WRITE_BITS_MAX } else { WRITE_WORDS_MAX };
        let max = habits.elements_max(self.table, max);
        let place = usize::from(point.at.wrapping_sub(self.first));
        (self.unit, self.table) == (point.unit, point.table)
            && place <= self.wanted.len()
            && place + usize::from(point.width()) <= usize::from(max)
    }

    /// The number of its elements.
    pub fn count(&self) -> u16 {
        self.wanted.len() as u16
    }

    /// Notes that the peer's values are not known.
    pub fn forget(&mut self) {
        self.is_known = false;
    }

    /// Sets the wanted values from all outputs, in the order of the map.
    pub fn want(&mut self, outputs: &[i32]) {
        self.wanted.fill(0);
        for (at, point) in &self.points {
            let (place, value) = (usize::from(point.at - self.first), outputs[*at]);
            match point.form {
                PointForm::Bit => self.wanted[place] = u16::from(value != 0),
                PointForm::RegisterBit(bit) => self.wanted[place] |= u16::from(value != 0) << bit,
                PointForm::Number(number) => {
                    let written = point.written();
                    let from = written.start as usize - usize::from(self.first);
                    let registers = &mut self.wanted[from..from + written.len()];
                    number.order.split(values::encode(&number, value), registers);
                }
            }
        }
    }

    /// The part to be written; with `all`, the whole run.
    pub fn due(&self, all: bool) -> Option<RunPart> {
        if all || !self.is_known {
            return Some(RunPart { from: 0, to: self.wanted.len() });
        }
        let changed = |at: &usize| self.wanted[*at] != self.sent[*at];
        let first = (0..self.wanted.len()).find(changed)?;
        let last = (0..self.wanted.len()).rev().find(changed)?;
        let mut part = RunPart { from: first, to: last + 1 };
        // Write all registers of a number, even if only one of them changed.
        for (_, point) in self.points.iter().filter(|(_, point)| point.width() > 1) {
            let place = usize::from(point.at - self.first);
            let end = place + usize::from(point.width());
            if place < part.to && part.from < end {
                part = RunPart { from: part.from.min(place), to: part.to.max(end) };
            }
        }
        Some(part)
    }

    /// The number of requests that write a part.
    pub fn requests(&self, part: RunPart, writes: WriteFunctions) -> usize {
        if writes == WriteFunctions::Single { part.to - part.from } else { 1 }
    }

    /// Appends one of these requests; `number` counts from 0.
    pub fn push_request(
        &self,
        pdu: &mut Vec<u8>,
        part: RunPart,
        writes: WriteFunctions,
        number: usize,
    ) {
        let are_coils = self.table.is_bits();
        let single = |at: usize| (self.first + at as u16, self.wanted[at]);
        match (writes, part.to - part.from) {
            (WriteFunctions::Single, _) | (WriteFunctions::Fitting, 1) => {
                let (address, value) = single(part.from + number);
                push_write_single(pdu, are_coils, address, value);
            }
            (WriteFunctions::Multiple | WriteFunctions::Fitting, _) => {
                let values = &self.wanted[part.from..part.to];
                push_write_multiple(pdu, are_coils, self.first + part.from as u16, values);
            }
        }
    }

    /// Notes that a part has been written.
    pub fn written(&mut self, part: RunPart) {
        self.sent[part.from..part.to].copy_from_slice(&self.wanted[part.from..part.to]);
        self.is_known |= part == RunPart { from: 0, to: self.wanted.len() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modbus::number::{ByteOrder, NumberOrder, RegisterNumberType, WordOrder};
    use crate::modbus::pdu;
    use crate::modbus_client::settings::{NumberPart, RegisterNumber};
    use crate::scaling::Scaling;
    use proptest::prelude::*;

    fn coil(at: u16) -> ModbusPoint {
        ModbusPoint { unit: 1, table: ModbusTable::Coils, at, form: PointForm::Bit }
    }

    fn register(at: u16, kind: RegisterNumberType) -> ModbusPoint {
        let scaling = Scaling::none(false);
        let number = RegisterNumber {
            kind,
            order: NumberOrder::default(),
            part: NumberPart::Whole,
            scaling,
        };
        ModbusPoint {
            unit: 1,
            table: ModbusTable::HoldingRegisters,
            at,
            form: PointForm::Number(number),
        }
    }

    /// The requests of a write that the peer accepts.
    fn written(
        run: &mut OutputRun,
        all: bool,
        writes: WriteFunctions,
        outputs: &[i32],
    ) -> Vec<Vec<u8>> {
        run.want(outputs);
        let Some(part) = run.due(all) else { return Vec::new() };
        let request = |number| {
            let mut request = Vec::new();
            run.push_request(&mut request, part, writes, number);
            request
        };
        let requests = (0..run.requests(part, writes)).map(request).collect();
        run.written(part);
        requests
    }

    #[test]
    fn all_outputs_are_sent_first_and_then_only_changed_outputs() {
        let mut run = runs(&[coil(4), coil(5), coil(6)], &PeerHabits::default()).remove(0);
        let mut write = |all, outputs| written(&mut run, all, WriteFunctions::Fitting, outputs);
        assert_eq!(write(false, &[1, 0, 0]), [[15, 0, 4, 0, 3, 1, 0b001]]);
        assert_eq!(write(false, &[1, 0, 0]), [[0u8; 0]; 0]);
        assert_eq!(write(false, &[1, 1, 0]), [[5, 0, 5, 0xff, 0]]);
        assert_eq!(write(false, &[0, 1, 1]), [[15, 0, 4, 0, 3, 1, 0b110]]);
        assert_eq!(write(true, &[0, 1, 1]), [[15, 0, 4, 0, 3, 1, 0b110]]);
    }

    #[test]
    fn a_failed_output_is_sent_again_even_if_unchanged() {
        let mut run = runs(&[coil(0), coil(1)], &PeerHabits::default()).remove(0);
        written(&mut run, false, WriteFunctions::Fitting, &[0, 0]);
        run.want(&[1, 0]);
        assert!(run.due(false).is_some());
        run.forget();
        assert_eq!(
            written(&mut run, false, WriteFunctions::Fitting, &[0, 0]),
            [[15, 0, 0, 0, 2, 1, 0]],
            "the peer may have taken the 1"
        );
    }

    #[test]
    fn both_registers_of_a_number_are_written_together() {
        let points = [
            register(0, RegisterNumberType::U16),
            register(1, RegisterNumberType::I32),
            register(3, RegisterNumberType::U16),
        ];
        let mut run = runs(&points, &PeerHabits::default()).remove(0);
        written(&mut run, false, WriteFunctions::Fitting, &[1, 2, 3]);
        let half = written(&mut run, false, WriteFunctions::Fitting, &[1, 4, 3]);
        assert_eq!(half, [[16, 0, 1, 0, 2, 4, 0, 0, 0, 4]]);
        let one = written(&mut run, false, WriteFunctions::Fitting, &[7, 4, 3]);
        assert_eq!(one, [[6, 0, 0, 0, 7]]);
        let one = written(&mut run, false, WriteFunctions::Multiple, &[8, 4, 3]);
        assert_eq!(one, [[16, 0, 0, 0, 1, 2, 0, 8]]);
    }

    #[test]
    fn numbers_of_64_bits_are_written_whole_in_any_word_order() {
        let wide = |order, part| {
            let number = RegisterNumber {
                kind: RegisterNumberType::I64,
                order,
                part,
                scaling: Scaling::none(false),
            };
            ModbusPoint { form: PointForm::Number(number), ..register(4, RegisterNumberType::I64) }
        };
        let swapped = NumberOrder { words: WordOrder::LowFirst, bytes: ByteOrder::LowFirst };
        let mut run = runs(&[wide(swapped, NumberPart::Whole)], &PeerHabits::default()).remove(0);
        let requests = written(&mut run, false, WriteFunctions::Fitting, &[0x1234_5678]);
        assert_eq!(requests, [[16, 0, 4, 0, 4, 8, 0x78, 0x56, 0x34, 0x12, 0, 0, 0, 0]]);
        let words = NumberOrder { words: WordOrder::LowFirst, ..NumberOrder::default() };
        let halves = [wide(words, NumberPart::High), wide(words, NumberPart::Low)];
        let mut run = runs(&halves, &PeerHabits::default()).remove(0);
        let all = written(&mut run, false, WriteFunctions::Fitting, &[0x1_0002, 0x3_0004]);
        assert_eq!(all, [[16, 0, 4, 0, 4, 8, 0, 4, 0, 3, 0, 2, 0, 1]]);
        let again = written(&mut run, false, WriteFunctions::Fitting, &[0x1_0002, 5]);
        assert_eq!(again, [[16, 0, 4, 0, 4, 8, 0, 5, 0, 0, 0, 2, 0, 1]], "both halves");
    }

    #[test]
    fn writes_stay_within_the_limits_of_the_peer() {
        let habits = PeerHabits { registers_max: 2, bits_max: 1, ..PeerHabits::default() };
        let registers: Vec<ModbusPoint> =
            (0..3).map(|at| register(at, RegisterNumberType::U16)).collect();
        let shape = |points: &[ModbusPoint]| -> Vec<(u16, u16)> {
            runs(points, &habits).iter().map(|run| (run.first, run.count())).collect()
        };
        assert_eq!(shape(&registers), [(0, 2), (2, 1)]);
        assert_eq!(shape(&[coil(0), coil(1)]), [(0, 1), (1, 1)]);
    }

    #[test]
    fn single_write_functions_send_one_request_per_point() {
        let mut run = runs(
            &[register(7, RegisterNumberType::U16), register(8, RegisterNumberType::I16)],
            &PeerHabits::default(),
        )
        .remove(0);
        let requests = written(&mut run, false, WriteFunctions::Single, &[1, -1]);
        assert_eq!(requests, [[6, 0, 7, 0, 1], [6, 0, 8, 0xff, 0xff]]);
    }

    #[test]
    fn bits_of_one_register_are_written_as_one_value() {
        let bit = |bit| ModbusPoint {
            form: PointForm::RegisterBit(bit),
            ..register(5, RegisterNumberType::U16)
        };
        let mut run = runs(&[bit(0), bit(15), bit(3)], &PeerHabits::default()).remove(0);
        let requests = written(&mut run, false, WriteFunctions::Fitting, &[1, 1, 0]);
        assert_eq!(requests, [[6, 0, 5, 0x80, 1]]);
    }

    #[test]
    fn write_runs_end_at_gaps_and_at_the_limits_of_the_protocol() {
        let shape = |points: &[ModbusPoint]| -> Vec<(u16, u16)> {
            runs(points, &PeerHabits::default())
                .iter()
                .map(|run| (run.first, run.count()))
                .collect()
        };
        assert_eq!(shape(&[coil(0), coil(2)]), [(0, 1), (2, 1)]);
        let coils: Vec<ModbusPoint> = (0..2000).map(coil).collect();
        assert_eq!(shape(&coils), [(0, 1968), (1968, 32)]);
        let wide: Vec<ModbusPoint> =
            (0..70).map(|at| register(at * 2, RegisterNumberType::U32)).collect();
        assert_eq!(shape(&wide), [(0, 122), (122, 18)]);
        assert_eq!(shape(&[coil(65_535)]), [(65_535, 1)]);
    }

    proptest! {
        #[test]
        fn a_peer_gets_the_requested_outputs(
            steps in prop::collection::vec(prop::collection::vec(-2i32..3, 6), 1..20),
            writes in prop::sample::select(vec![WriteFunctions::Fitting, WriteFunctions::Multiple]),
        ) {
            let (one, two) = (RegisterNumberType::I16, RegisterNumberType::I32);
            let kinds = [one, two, one, two, one, one];
            let addresses = [0, 1, 3, 4, 6, 9];
            let points: Vec<ModbusPoint> =
                addresses.into_iter().zip(kinds).map(|(at, kind)| register(at, kind)).collect();
            let (mut planned, mut peer) = (runs(&points, &PeerHabits::default()), [0u16; 10]);
            for outputs in steps {
                for run in &mut planned {
                    for request in written(run, false, writes, &outputs) {
                        let Ok(pdu::ModbusRequest::WriteRegisters { first, values }) =
                            pdu::parse(&request) else { panic!("{request:?}") };
                        for (at, value) in values.chunks(2).enumerate() {
                            peer[usize::from(first) + at] =
                                u16::from_be_bytes([value[0], value[1]]);
                        }
                    }
                }
                let wide = |at: usize| (u32::from(peer[at]) << 16 | u32::from(peer[at + 1])) as i32;
                let one = |at: usize| i32::from(peer[at] as i16);
                let has = [one(0), wide(1), one(3), wide(4), one(6), one(9)];
                prop_assert_eq!(&has[..], &outputs[..]);
            }
        }
    }
}
