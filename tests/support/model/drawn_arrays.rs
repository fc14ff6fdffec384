//! Random elements of arrays, runs of neighbours, COPY and FILL.

use super::pool::Pool;

impl Pool {
    /// An address as an element of an array, at times.
    pub fn as_element(&mut self, address: &str) -> String {
        for (name, area, count) in self.arrays.clone() {
            let number = address.strip_prefix(area).and_then(|n| n.parse::<usize>().ok());
            if let Some(n) = number.filter(|n| n < &count)
                && self.rng.chance(40)
            {
                return format!("{name}[{n}]");
            }
        }
        address.to_string()
    }

    /// An element that a word selects, of bits or words, that programs read or write.
    pub fn element(&mut self, bits: bool, written: bool) -> Option<String> {
        let is_bits = |area: &str| ["X", "C"].contains(&area);
        let fits = |area: &str| is_bits(area) == bits && !(written && area == "X");
        let all = self.arrays.iter().filter(|(_, area, _)| fits(area));
        let names: Vec<&str> = all.map(|(name, ..)| *name).collect();
        if names.is_empty() {
            return None;
        }
        let name = *self.rng.pick(&names);
        let index = match self.rng.weighted(&[40, 20, 15, 15, 10]) {
            0 => self.indexed("D"),
            1 => self.indexed("V"),
            2 => format!("CT{}.Acc", self.rng.below(4)),
            3 => self.indexed("MHR"),
            _ => "$ScanCounter".to_string(),
        };
        Some(format!("{name}[{index}]"))
    }

    /// Two neighbours: a slice of an array, or a range.
    fn two(&mut self, bits: bool, written: bool) -> String {
        let mut runs = match bits {
            true => vec!["C0..C1", "C1..C2", "Y0..Y1", "Y1..Y2", "MC1..MC2"],
            false => vec!["D0..D1", "D1..D2", "V0..V1", "MHR1..MHR2", "MIR1..MIR2"],
        };
        if bits && !written {
            runs.extend(["X0..X1", "X2..X3", "ST4..ST5"]);
        }
        for (name, ..) in &self.arrays {
            match *name {
                "row" if !bits => runs.extend(["row[0..1]", "row[1..2]"]),
                "regs" if !bits => runs.push("regs"),
                "bits" if bits => runs.extend(["bits[0..1]", "bits[1..2]"]),
                _ => {}
            }
        }
        self.rng.pick(&runs).to_string()
    }

    /// COPY and FILL.
    pub fn whole_arrays(&mut self) -> String {
        let bits = self.rng.chance(40);
        let to = self.two(bits, true);
        match (self.rng.chance(55), bits) {
            (true, _) => format!("COPY {} to={to}", self.two(bits, false)),
            (false, false) => format!("FILL {} to={to}", self.value()),
            (false, true) if self.rng.chance(40) => format!("FILL {} to={to}", self.rng.below(2)),
            (false, true) => format!("FILL {} to={to}", self.bit()),
        }
    }

    /// What a SR shifts.
    pub fn shifted(&mut self) -> String {
        let has_array = self.arrays.iter().any(|(name, ..)| *name == "bits");
        if has_array && self.rng.chance(50) {
            return "bits".to_string();
        }
        let runs = ["C0..C2", "C2..C0", "Y0..Y2", "MC2..MC1", "MI1..MI2"];
        self.rng.pick(&runs).to_string()
    }
}
