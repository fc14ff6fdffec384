//! The plan of reads: few requests, each for several points of one unit and table.
//!
//! Made once, before the first exchange. Points share a request if they are neighbours, or if
//! their distance is no more than the author's `gap`. A request stays within the limits of the
//! protocol and of the peer. A number in several registers stays within one request, so that all
//! of them are from the same moment.

use super::settings::{ModbusPoint, ModbusTable, PeerHabits, PointForm};
use super::values;
use crate::modbus::pdu::{READ_BITS_MAX, READ_WORDS_MAX};

/// One request that reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadGroup {
    /// The unit.
    pub unit: u8,
    /// The table.
    pub table: ModbusTable,
    /// The first address.
    pub first: u16,
    /// The number of elements.
    pub count: u16,
    /// The points that it reads, each with its number in the order of the map.
    points: Vec<(usize, ModbusPoint)>,
}

/// The requests that read all points.
pub fn reads(points: &[ModbusPoint], gap: u16, habits: &PeerHabits) -> Vec<ReadGroup> {
    let mut groups: Vec<ReadGroup> = Vec::new();
    for (at, point) in ModbusPoint::by_place(points) {
        match groups.last_mut() {
            Some(group) if group.takes(&point, gap, habits) => {
                group.count = group.count.max(point.at - group.first + point.width());
                group.points.push((at, point));
            }
            _ => groups.push(ReadGroup {
                unit: point.unit,
                table: point.table,
                first: point.at,
                count: point.width(),
                points: vec![(at, point)],
            }),
        }
    }
    groups
}

impl ReadGroup {
    /// Whether a point belongs to this request. The point must not be before the request's first
    /// point.
    fn takes(&self, point: &ModbusPoint, gap: u16, habits: &PeerHabits) -> bool {
        if (self.unit, self.table) != (point.unit, point.table) {
            return false;
        }
        let (max, gap) = match self.table.is_bits() {
            true => (READ_BITS_MAX, u32::from(gap) * 16),
            false => (READ_WORDS_MAX, u32::from(gap)),
        };
        let max = habits.elements_max(self.table, max);
        let end = u32::from(self.first) + u32::from(self.count);
        let count = u32::from(point.at - self.first) + u32::from(point.width());
        u32::from(point.at) <= end + gap && count <= u32::from(max)
    }

    /// Whether several points share the request, so that a smaller limit would divide it.
    pub fn is_joined(&self) -> bool {
        let widest = self.points.iter().map(|(_, point)| point.width()).max();
        widest.is_some_and(|width| width < self.count)
    }

    /// Stores the read values in the inputs of their points; `data` has the length that
    /// [`super::answer::check`] ensures. False if a point is a real that is not a number; such a
    /// point counts as not read.
    pub fn bring_in(&self, data: &[u8], inputs: &mut [Option<i32>]) -> bool {
        let mut all = true;
        for (at, point) in &self.points {
            let place = usize::from(point.at - self.first);
            let value = match point.form {
                PointForm::Bit => Some(i32::from(data[place / 8] >> (place % 8) & 1)),
                PointForm::RegisterBit(bit) => Some(i32::from(word(data, place) >> bit & 1)),
                PointForm::Number(number) => {
                    let bytes = &data[place * 2..(place + usize::from(point.width())) * 2];
                    values::decode(&number, number.order.join(bytes))
                }
            };
            inputs[*at] = value;
            all &= value.is_some();
        }
        all
    }
}

fn word(data: &[u8], place: usize) -> u16 {
    u16::from_be_bytes([data[place * 2], data[place * 2 + 1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modbus::number::{NumberOrder, RegisterNumberType, WordOrder};
    use crate::modbus_client::settings::{NumberPart, RegisterNumber};
    use crate::scaling::Scaling;
    use proptest::prelude::*;

    fn number(kind: RegisterNumberType, words: WordOrder) -> PointForm {
        let order = NumberOrder { words, ..NumberOrder::default() };
        let (part, scaling) = (NumberPart::Whole, Scaling::none(false));
        PointForm::Number(RegisterNumber { kind, order, part, scaling })
    }

    fn register(at: u16) -> ModbusPoint {
        ModbusPoint {
            unit: 1,
            table: ModbusTable::HoldingRegisters,
            at,
            form: number(RegisterNumberType::U16, WordOrder::HighFirst),
        }
    }

    fn wide(at: u16) -> ModbusPoint {
        ModbusPoint { form: number(RegisterNumberType::U32, WordOrder::HighFirst), ..register(at) }
    }

    fn bit(at: u16) -> ModbusPoint {
        ModbusPoint { unit: 1, table: ModbusTable::DiscreteInputs, at, form: PointForm::Bit }
    }

    fn shape(points: &[ModbusPoint], gap: u16) -> Vec<(u16, u16)> {
        reads(points, gap, &PeerHabits::default())
            .iter()
            .map(|group| (group.first, group.count))
            .collect()
    }

    #[test]
    fn adjacent_points_share_a_request_in_any_order_of_the_map() {
        let points = [register(12), register(10), wide(13), register(11)];
        assert_eq!(shape(&points, 0), [(10, 5)]);
        assert_eq!(shape(&[register(10), register(12)], 0), [(10, 1), (12, 1)]);
        assert_eq!(shape(&[register(10), register(12)], 1), [(10, 3)]);
        assert_eq!(shape(&[bit(0), bit(16)], 0), [(0, 1), (16, 1)]);
        assert_eq!(shape(&[bit(0), bit(16)], 1), [(0, 17)]);
        assert_eq!(shape(&[wide(10), register(10)], 0), [(10, 2)], "one register in two points");
    }

    #[test]
    fn each_unit_and_table_has_its_own_requests() {
        let other_unit = ModbusPoint { unit: 2, ..register(11) };
        let other_table = ModbusPoint { table: ModbusTable::InputRegisters, ..register(12) };
        let groups = reads(&[register(10), other_unit, other_table], 100, &PeerHabits::default());
        assert_eq!(groups.len(), 3);
    }

    #[test]
    fn requests_stay_within_the_limits_of_the_protocol() {
        let registers: Vec<ModbusPoint> = (0..300).map(register).collect();
        assert_eq!(shape(&registers, 0), [(0, 125), (125, 125), (250, 50)]);
        let bits: Vec<ModbusPoint> = (0..2001).map(bit).collect();
        assert_eq!(shape(&bits, 0), [(0, 2000), (2000, 1)]);
        assert_eq!(shape(&[register(65_534), register(65_535)], 0), [(65_534, 2)]);
    }

    #[test]
    fn requests_stay_within_the_limits_of_the_peer() {
        let limited = |points: &[ModbusPoint], registers_max, bits_max| -> Vec<(u16, u16)> {
            let habits = PeerHabits { registers_max, bits_max, ..PeerHabits::default() };
            reads(points, 100, &habits).iter().map(|group| (group.first, group.count)).collect()
        };
        let registers: Vec<ModbusPoint> = (0..5).map(register).collect();
        assert_eq!(limited(&registers, 2, 2000), [(0, 2), (2, 2), (4, 1)]);
        assert_eq!(limited(&registers, 1, 2000).len(), 5);
        assert_eq!(limited(&[register(0), register(9)], 9, 2000), [(0, 1), (9, 1)], "no gap");
        let bits: Vec<ModbusPoint> = (0..5).map(bit).collect();
        assert_eq!(limited(&bits, 125, 3), [(0, 3), (3, 2)]);
        assert_eq!(limited(&[wide(0), wide(2)], 3, 2000), [(0, 2), (2, 2)], "numbers are whole");
    }

    #[test]
    fn the_halves_of_a_number_are_read_together() {
        let half = |part| {
            let PointForm::Number(number) = number(RegisterNumberType::U64, WordOrder::HighFirst)
            else {
                unreachable!()
            };
            let form = PointForm::Number(RegisterNumber { part, ..number });
            ModbusPoint { form, ..register(10) }
        };
        let points = [half(NumberPart::High), half(NumberPart::Low), register(14)];
        let habits = PeerHabits { registers_max: 4, ..PeerHabits::default() };
        let groups = reads(&points, 0, &habits);
        assert_eq!(groups.len(), 2);
        let mut inputs = [None; 3];
        assert!(groups[0].bring_in(&[0, 1, 0, 2, 0, 3, 0, 4], &mut inputs));
        assert_eq!(inputs, [Some(0x1_0002), Some(0x3_0004), None]);
        assert!(!groups[0].is_joined() && !groups[1].is_joined());
    }

    #[test]
    fn a_number_in_two_registers_is_never_split_across_requests() {
        let numbers: Vec<ModbusPoint> = (0..100).map(|at| wide(at * 2)).collect();
        assert_eq!(shape(&numbers, 0), [(0, 124), (124, 76)]);
    }

    #[test]
    fn read_values_are_assigned_to_their_points() {
        let low_first = ModbusPoint {
            form: number(RegisterNumberType::I32, WordOrder::LowFirst),
            ..register(12)
        };
        let flag = ModbusPoint { form: PointForm::RegisterBit(9), ..register(11) };
        let points = [low_first, register(10), flag];
        let mut inputs = [None; 3];
        let groups = reads(&points, 0, &PeerHabits::default());
        assert!(groups[0].bring_in(&[0, 7, 2, 0, 0, 5, 0, 1], &mut inputs));
        assert_eq!(inputs, [Some(65_541), Some(7), Some(1)]);
        let bits = reads(&[bit(3), bit(8)], 1, &PeerHabits::default());
        let mut inputs = [None; 2];
        assert!(bits[0].bring_in(&[0b10_0000], &mut inputs));
        assert_eq!(inputs, [Some(0), Some(1)]);
    }

    #[test]
    fn values_that_are_not_numbers_are_reported_and_not_stored() {
        let form = number(RegisterNumberType::F32, WordOrder::HighFirst);
        let float = |at| ModbusPoint { form, ..register(at) };
        let mut inputs = [None; 2];
        let data = [0x7f, 0xc0, 0, 0, 0x3f, 0x80, 0, 0];
        assert!(
            !reads(&[float(0), float(2)], 0, &PeerHabits::default())[0]
                .bring_in(&data, &mut inputs)
        );
        assert_eq!(inputs, [None, Some(1)], "its neighbour is read");
    }

    const TABLES: [ModbusTable; 4] = [
        ModbusTable::Coils,
        ModbusTable::DiscreteInputs,
        ModbusTable::HoldingRegisters,
        ModbusTable::InputRegisters,
    ];

    fn any_point() -> impl Strategy<Value = ModbusPoint> {
        (1u8..4, 0..4usize, 0u16..700, any::<bool>()).prop_map(|(unit, table, at, is_wide)| {
            let table = TABLES[table];
            let form = match (table.is_bits(), is_wide) {
                (true, _) => PointForm::Bit,
                (false, true) => number(RegisterNumberType::U32, WordOrder::HighFirst),
                (false, false) => number(RegisterNumberType::U16, WordOrder::HighFirst),
            };
            ModbusPoint { unit, table, at, form }
        })
    }

    proptest! {
        #[test]
        fn every_point_is_read_exactly_once_and_whole(
            points in prop::collection::vec(any_point(), 0..200), gap in 0u16..=100,
        ) {
            let mut seen = vec![0; points.len()];
            for group in reads(&points, gap, &PeerHabits::default()) {
                let max = if group.table.is_bits() { READ_BITS_MAX } else { READ_WORDS_MAX };
                prop_assert!((1..=max).contains(&group.count));
                for (at, point) in &group.points {
                    seen[*at] += 1;
                    prop_assert!(point.at >= group.first);
                    prop_assert!(point.at + point.width() <= group.first + group.count);
                    prop_assert_eq!((point.unit, point.table), (group.unit, group.table));
                }
            }
            prop_assert!(seen.iter().all(|times| *times == 1));
        }
    }
}
