//! Requests at an address: every function, with its edge quantities and random values.

/// A series of numbers, the same in every run.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u16 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 40) as u16
    }

    /// The byte count and `count` registers: small values, large values, and values within limits.
    fn registers(&mut self, count: u16) -> Vec<u8> {
        let registers = usize::from(count).min(126);
        let mut bytes = vec![(registers * 2) as u8];
        for _ in 0..registers {
            let value = match self.next() {
                n if n % 3 == 0 => 5 + n / 3 % 5,
                n if n % 3 == 1 => 0,
                n => n,
            };
            bytes.extend(value.to_be_bytes());
        }
        bytes
    }
}

fn place(function: u8, at: u16, count: u16) -> Vec<u8> {
    [&[function][..], &at.to_be_bytes(), &count.to_be_bytes()].concat()
}

/// Calls `ask` with the PDU of each request.
pub fn at_address(at: u16, random: &mut Random, mut ask: impl FnMut(&[u8])) {
    for function in [1, 2] {
        for count in [0, 1, 2, 7, 8, 9, 16, 2000, 2001, 65_535] {
            ask(&place(function, at, count));
        }
    }
    for function in [3, 4] {
        for count in [0, 1, 2, 3, 124, 125, 126, 65_535] {
            ask(&place(function, at, count));
        }
    }
    for value in [0xff00, 0, 1, 0xffff] {
        ask(&place(5, at, value));
    }
    for value in [5, 10, 0x8000, 0xffff] {
        ask(&place(6, at, value));
    }
    for count in [0, 1, 2, 8, 9, 16, 1968, 1969, 65_535_u16] {
        let bytes = usize::from(count).div_ceil(8).min(246);
        let values = (0..bytes).map(|_| random.next() as u8).collect::<Vec<_>>();
        ask(&[place(15, at, count), vec![bytes as u8], values].concat());
    }
    for count in [0, 1, 2, 3, 10, 123, 124, 65_535_u16] {
        let values = random.registers(count);
        ask(&[place(16, at, count), values].concat());
    }
    for (and, or) in [(0xf2, 0x25), (0, 0xffff), (0xffff, 0)] {
        ask(&[place(22, at, and), u16::to_be_bytes(or).to_vec()].concat());
    }
    for (read, write) in [(1, 1), (2, 2), (125, 121), (126, 1), (1, 122), (0, 1), (1, 0)] {
        let values = random.registers(write);
        // Reads at `at` and writes at 15, then the reverse.
        ask(&[&place(23, at, read)[..], &place(0, 15, write)[1..], &values].concat());
        ask(&[&place(23, 15, read)[..], &place(0, at, write)[1..], &values].concat());
    }
}
