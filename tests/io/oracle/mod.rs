//! The oracle: the right answer to every request, and the changes that the request may make.
//!
//! Written from the Modbus specification and `docs/modbus.md`, for `controller.toml` beside this
//! file. It shares no code with rungd: memory is a list of named cells, a table an array of 65,536
//! places, a request a slice of bytes.

pub mod requests;

use std::collections::HashMap;

/// A bit or word of memory, by its name in the ladder language.
#[derive(Clone, Debug)]
pub struct Cell {
    pub name: String,
    pub value: i64,
    /// The range of its values.
    pub min: i64,
    pub max: i64,
    /// The input bit that changes with this cell, if the cell is an input's coil.
    pub moves: Option<usize>,
}

/// The client that sends a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Client {
    /// 127.0.0.1.
    Loopback,
    /// 10.1.2.3.
    Ten,
    /// 10.9.2.3.
    TenNine,
}

/// The contents of an address.
#[derive(Clone, Copy, Debug)]
struct Place {
    cell: usize,
    /// 1 register, or the first (2) or second (3) of two; 0: a bit.
    part: u8,
    low_first: bool,
    /// The range of values that its registers can express.
    from: i64,
    to: i64,
}

pub const COIL: usize = 0;
pub const DISCRETE: usize = 1;
pub const HOLDING: usize = 2;
pub const INPUT: usize = 3;

type Table = Vec<Option<Place>>;

pub struct Oracle {
    pub cells: Vec<Cell>,
    names: HashMap<String, usize>,
    /// By unit (1, 2) and table.
    tables: [[Table; 4]; 2],
    /// By client and cell.
    writable: [Vec<bool>; 3],
}

impl Oracle {
    pub fn new() -> Oracle {
        let empty = || [(); 4].map(|()| vec![None; 65_536]);
        let writable = [Vec::new(), Vec::new(), Vec::new()];
        let names = HashMap::new();
        let mut oracle = Oracle { cells: Vec::new(), names, tables: [empty(), empty()], writable };
        oracle.standard_map();
        oracle.registers();
        oracle.bits();
        for (name, min, max) in [("MHR15", 5, 9), ("V3", 0, 100), ("D5", -10, 10)] {
            let cell = oracle.cell(name);
            (oracle.cells[cell].min, oracle.cells[cell].max) = (min, max);
        }
        for n in 0..4 {
            let (coil, input) =
                (oracle.cell(&format!("MC{}", 101 + n)), oracle.cell(&format!("X{n}")));
            oracle.cells[coil].moves = Some(input);
        }
        oracle.lists();
        oracle
    }

    fn standard_map(&mut self) {
        for n in 1..=1024 {
            self.bit(COIL, n - 1, &format!("MC{n}"));
            // MI11 to MI14 show Y0 to Y3.
            let shown =
                if (11..=14).contains(&n) { format!("Y{}", n - 11) } else { format!("MI{n}") };
            self.bit(DISCRETE, n - 1, &shown);
        }
        for n in 1..=2048 {
            self.word(HOLDING, n - 1, &format!("MHR{n}"), "u16");
            self.word(INPUT, n - 1, &format!("MIR{n}"), "u16");
        }
    }

    fn registers(&mut self) {
        for n in 0..10 {
            self.word(HOLDING, 2048 + n, &format!("V{}", 100 + n), "u16");
            self.word(HOLDING, 4008 + 2 * n, &format!("D{n}"), "low-first");
            self.word(HOLDING, 4028 + n, &format!("V{n}"), "u16");
        }
        for n in 0..4 {
            self.word(HOLDING, 4000 + 2 * n, &format!("CT{n}.Acc"), "i32");
            self.word(HOLDING, 4040 + n, &format!("D{}", 40 + n), "i16");
            self.word(INPUT, 30_000 + 2 * n, &format!("DST{n}"), "i32");
            self.word(INPUT, 30_008 + n, &format!("D{n}"), "u16");
        }
        for n in 0..2 {
            self.word(HOLDING, 4038 + n, &format!("N{n}.ACC"), "i16");
            self.word(HOLDING, 4044 + n, &format!("MIR{}", n + 1), "u16");
        }
        self.word(HOLDING, 65_534, "D20", "i32");
        let before = self.tables[0][HOLDING].clone();
        self.word(HOLDING, 9000, "D30", "u32");
        let (of_two, of_one) = (self.tables[1][HOLDING].clone(), before.clone());
        (self.tables[0][HOLDING], self.tables[1][HOLDING]) = (of_one, before);
        self.word(HOLDING, 9001, "V7", "u16");
        self.tables[1][HOLDING] = of_two;
    }

    fn bits(&mut self) {
        for n in 0..32 {
            self.bit(COIL, 5000 + n, &format!("C{n}"));
        }
        for n in 0..4 {
            self.bit(COIL, 5032 + n, &format!("Y{n}"));
            self.bit(COIL, 5036 + n, &format!("X{n}"));
            self.bit(COIL, 5040 + n, &format!("MC{}", 101 + n));
        }
        self.bit(COIL, 5044, "MI1");
        self.bit(COIL, 5045, "MI2");
        self.bit(COIL, 65_535, "C40");
        for n in 0..16 {
            self.bit(DISCRETE, 2000 + n, &format!("X{n}"));
        }
        for n in 0..8 {
            self.bit(DISCRETE, 2016 + n, &format!("CT{n}.Done"));
        }
    }

    fn lists(&mut self) {
        for list in &mut self.writable {
            list.resize(self.cells.len(), false);
        }
        let all = [0, 1, 2];
        let ranges = [
            ("MC", 1, 32),
            ("MC", 1000, 1024),
            ("MC", 101, 104),
            ("MHR", 10, 19),
            ("MHR", 2040, 2048),
            ("D", 0, 9),
            ("D", 20, 20),
            ("D", 30, 30),
            ("D", 40, 40),
            ("V", 0, 9),
            ("V", 105, 109),
            ("C", 0, 15),
            ("C", 40, 40),
            ("MI", 1, 1),
            ("MIR", 1, 1),
        ];
        for (space, first, last) in ranges {
            (first..=last).for_each(|n| self.list(&all, &format!("{space}{n}")));
        }
        (0..4).for_each(|n| self.list(&all, &format!("CT{n}.Acc")));
        self.list(&all, "N0.ACC");
        let (loopback, ten, ten_nine) = (0, 1, 2);
        (100..=109).for_each(|n| self.list(&[ten, ten_nine], &format!("MHR{n}")));
        (32..=40).for_each(|n| self.list(&[ten, ten_nine], &format!("MC{n}")));
        (105..=114).for_each(|n| self.list(&[loopback, ten_nine], &format!("MHR{n}")));
    }

    fn list(&mut self, clients: &[usize], name: &str) {
        let cell = self.cell(name);
        clients.iter().for_each(|client| self.writable[*client][cell] = true);
    }

    /// The number of a cell, which is added if it is new.
    fn cell(&mut self, name: &str) -> usize {
        if let Some(at) = self.names.get(name) {
            return *at;
        }
        let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let (min, max) = match letters {
            "V" | "MHR" | "MIR" => (0, 65_535),
            "D" | "DST" => (-2_147_483_648, 2_147_483_647),
            _ if name.starts_with('N') => (-32_768, 32_767),
            _ if name.ends_with(".Acc") => (-2_147_483_648, 2_147_483_647),
            _ => (0, 1),
        };
        self.names.insert(name.to_owned(), self.cells.len());
        self.cells.push(Cell { name: name.to_owned(), value: 0, min, max, moves: None });
        self.cells.len() - 1
    }

    fn bit(&mut self, table: usize, at: usize, name: &str) {
        let place = Place { cell: self.cell(name), part: 0, low_first: false, from: 0, to: 1 };
        self.tables.iter_mut().for_each(|unit| unit[table][at] = Some(place));
    }

    fn word(&mut self, table: usize, at: usize, name: &str, kind: &str) {
        let (from, to) = match kind {
            "u16" => (0, 65_535),
            "i16" => (-32_768, 32_767),
            "u32" => (0, 4_294_967_295),
            _ => (-2_147_483_648, 2_147_483_647),
        };
        let (cell, low_first) = (self.cell(name), kind == "low-first");
        let parts = if kind.ends_with("16") { &[1][..] } else { &[2, 3] };
        for (next, part) in parts.iter().enumerate() {
            let place = Place { cell, part: *part, low_first, from, to };
            self.tables.iter_mut().for_each(|unit| unit[table][at + next] = Some(place));
        }
    }

    /// The reply to a PDU, and the cells that change, with their new values.
    pub fn answer(&self, unit: u8, client: Client, pdu: &[u8]) -> (Vec<u8>, Vec<(usize, i64)>) {
        let function = pdu[0];
        let done = match unit {
            1 | 2 => self.ask(usize::from(unit) - 1, client, pdu),
            _ => Err(11),
        };
        match done {
            Ok(done) => done,
            Err(exception) => (vec![function | 0x80, exception], Vec::new()),
        }
    }

    fn ask(&self, unit: usize, client: Client, pdu: &[u8]) -> Result<Done, u8> {
        let word = |at: usize| usize::from(pdu[at]) << 8 | usize::from(pdu[at + 1]);
        let (function, length) = (pdu[0], pdu.len());
        let fits = |wanted: usize| if length == wanted { Ok(()) } else { Err(3) };
        let tables = &self.tables[unit];
        match function {
            1..=4 => {
                fits(5)?;
                within(word(3), if function < 3 { 2000 } else { 125 })?;
                let table = [COIL, DISCRETE, HOLDING, INPUT][usize::from(function) - 1];
                let bytes = self.read(&tables[table], word(1), word(3), &[])?;
                Ok(([vec![function, bytes.len() as u8], bytes].concat(), Vec::new()))
            }
            5 => {
                fits(5)?;
                let on = match word(3) {
                    0xff00 => 1,
                    0 => 0,
                    _ => return Err(3),
                };
                let changes = self.write_bits(&tables[COIL], client, word(1), &[on])?;
                Ok((pdu.to_vec(), changes))
            }
            6 => {
                fits(5)?;
                let changes = self.write_words(&tables[HOLDING], client, word(1), &[word(3)])?;
                Ok((pdu.to_vec(), changes))
            }
            22 => {
                fits(7)?;
                let changes = self.mask(
                    &tables[HOLDING],
                    client,
                    word(1),
                    MaskWords { and: word(3), or: word(5) },
                )?;
                Ok((pdu.to_vec(), changes))
            }
            15 | 16 | 23 => self.ask_with_values(tables, client, pdu),
            _ => Err(1),
        }
    }

    /// The functions that carry several values.
    fn ask_with_values(&self, tables: &[Table; 4], client: Client, pdu: &[u8]) -> Result<Done, u8> {
        let word = |at: usize| usize::from(pdu[at]) << 8 | usize::from(pdu[at + 1]);
        let length = pdu.len();
        // Checks the byte count at `at`, and that this many bytes follow.
        let counted = |at: usize, bytes: usize| match pdu.get(at) {
            Some(said) if usize::from(*said) == bytes && length == at + 1 + bytes => Ok(()),
            _ => Err(3),
        };
        match pdu[0] {
            15 => {
                if length < 6 {
                    return Err(3);
                }
                within(word(3), 1968)?;
                counted(5, word(3).div_ceil(8))?;
                let on = |n: usize| i64::from(pdu[6 + n / 8] >> (n % 8) & 1);
                let values: Vec<i64> = (0..word(3)).map(on).collect();
                let changes = self.write_bits(&tables[COIL], client, word(1), &values)?;
                Ok((pdu[..5].to_vec(), changes))
            }
            16 => {
                if length < 6 {
                    return Err(3);
                }
                within(word(3), 123)?;
                counted(5, word(3) * 2)?;
                let values: Vec<usize> = (0..word(3)).map(|n| word(6 + 2 * n)).collect();
                let changes = self.write_words(&tables[HOLDING], client, word(1), &values)?;
                Ok((pdu[..5].to_vec(), changes))
            }
            _ => {
                if length < 10 {
                    return Err(3);
                }
                within(word(3), 125)?;
                within(word(7), 121)?;
                counted(9, word(7) * 2)?;
                self.read(&tables[HOLDING], word(1), word(3), &[])?;
                let values: Vec<usize> = (0..word(7)).map(|n| word(10 + 2 * n)).collect();
                let changes = self.write_words(&tables[HOLDING], client, word(5), &values)?;
                let bytes = self.read(&tables[HOLDING], word(1), word(3), &changes)?;
                Ok(([vec![23, bytes.len() as u8], bytes].concat(), changes))
            }
        }
    }

    fn places<'a>(&self, table: &'a Table, at: usize, count: usize) -> Result<Vec<&'a Place>, u8> {
        (at..at + count).map(|at| table.get(at).and_then(Option::as_ref).ok_or(2)).collect()
    }

    fn read(
        &self,
        table: &Table,
        at: usize,
        count: usize,
        changes: &[(usize, i64)],
    ) -> Result<Vec<u8>, u8> {
        let places = self.places(table, at, count)?;
        let value = |cell: usize| {
            let changed = changes.iter().rev().find(|(changed, _)| *changed == cell);
            changed.map_or(self.cells[cell].value, |(_, value)| *value)
        };
        if places[0].part == 0 {
            let mut bytes = vec![0; count.div_ceil(8)];
            for (n, place) in places.iter().enumerate() {
                bytes[n / 8] |= (value(place.cell) as u8) << (n % 8);
            }
            return Ok(bytes);
        }
        let register = |place: &&Place| {
            let number = value(place.cell).max(place.from).min(place.to);
            let upper = number.rem_euclid(1 << 32) >> 16;
            let lower = number.rem_euclid(1 << 16);
            let of_two = |first_is_lower| if first_is_lower { lower } else { upper };
            let register = match place.part {
                1 => lower,
                2 => of_two(place.low_first),
                _ => of_two(!place.low_first),
            };
            [(register / 256) as u8, (register % 256) as u8]
        };
        Ok(places.iter().flat_map(register).collect())
    }

    fn listed(&self, places: &[&Place], client: Client) -> Result<(), u8> {
        let listed = &self.writable[client as usize];
        if places.iter().all(|place| listed[place.cell]) { Ok(()) } else { Err(2) }
    }

    fn write_bits(
        &self,
        table: &Table,
        by: Client,
        at: usize,
        values: &[i64],
    ) -> Result<Changes, u8> {
        let places = self.places(table, at, values.len())?;
        self.listed(&places, by)?;
        let mut changes = Vec::new();
        for (place, value) in places.iter().zip(values) {
            changes.push((place.cell, *value));
            changes.extend(self.cells[place.cell].moves.map(|input| (input, *value)));
        }
        Ok(changes)
    }

    fn write_words(
        &self,
        table: &Table,
        by: Client,
        at: usize,
        registers: &[usize],
    ) -> Result<Changes, u8> {
        let places = self.places(table, at, registers.len())?;
        self.listed(&places, by)?;
        if places[0].part == 3 || places[places.len() - 1].part == 2 {
            return Err(2);
        }
        let mut changes = Vec::new();
        for (n, place) in places.iter().enumerate().filter(|(_, place)| place.part != 3) {
            let bits = match place.part {
                1 => registers[n],
                _ if place.low_first => registers[n + 1] * 65_536 + registers[n],
                _ => registers[n] * 65_536 + registers[n + 1],
            };
            let span = if place.part == 1 { 65_536 } else { 4_294_967_296 };
            let value = if bits as i64 > place.to { bits as i64 - span } else { bits as i64 };
            let cell = &self.cells[place.cell];
            if value < cell.min || value > cell.max {
                return Err(3);
            }
            changes.push((place.cell, value));
        }
        Ok(changes)
    }

    fn mask(&self, table: &Table, by: Client, at: usize, masks: MaskWords) -> Result<Changes, u8> {
        let places = self.places(table, at, 1)?;
        self.listed(&places, by)?;
        let (place, cell) = (places[0], &self.cells[places[0].cell]);
        if place.part != 1 {
            return Err(2);
        }
        if (place.from, place.to) != (cell.min, cell.max) {
            return Err(3);
        }
        let (and, or) = (masks.and as i64, masks.or as i64);
        let bits = cell.value.rem_euclid(65_536);
        let result = (bits & and) | (or & (65_535 - and));
        Ok(vec![(place.cell, if result > place.to { result - 65_536 } else { result })])
    }
}

/// The words of a mask write.
struct MaskWords {
    and: usize,
    or: usize,
}

/// Checks that a quantity is between 1 and `most`.
fn within(n: usize, most: usize) -> Result<(), u8> {
    if n >= 1 && n <= most { Ok(()) } else { Err(3) }
}

type Changes = Vec<(usize, i64)>;
type Done = (Vec<u8>, Changes);
