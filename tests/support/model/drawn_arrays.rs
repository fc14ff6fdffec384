//! Random elements of arrays, random runs of neighbours, COPY and FILL.

use super::pool::{DrawnArray, Pool};

impl DrawnArray {
    /// The name without an index: the whole array.
    pub fn whole(&self) -> String {
        self.part("")
    }

    /// An element or a slice; `index` is what stands in the brackets.
    pub fn at(&self, index: &str) -> String {
        self.part(&format!("[{index}]"))
    }

    fn part(&self, brackets: &str) -> String {
        match self.field {
            "" => format!("{}{brackets}", self.name),
            field => format!("{}{brackets}.{field}", self.name),
        }
    }
}

impl Pool {
    /// Sometimes writes an address as an element of an array.
    pub fn as_element(&mut self, address: &str) -> String {
        for array in self.arrays.clone().into_iter().filter(|array| !array.placed) {
            let DrawnArray { name, area, count, .. } = array;
            let number = address.strip_prefix(area).and_then(|n| n.parse::<usize>().ok());
            if let Some(n) = number.filter(|n| n < &count)
                && self.rng.chance(40)
            {
                return format!("{name}[{n}]");
            }
        }
        address.to_string()
    }

    /// An element of an array of bits or words, selected by a word; `written`: for a write.
    pub fn element(&mut self, bits: bool, written: bool) -> Option<String> {
        let areas = match (bits, written) {
            (true, true) => ["C", "C"],
            (true, false) => ["C", "X"],
            (false, _) => ["D", "V"],
        };
        self.element_of(&areas)
    }

    /// An element of an array of reals, selected by a word.
    pub fn real_element(&mut self) -> Option<String> {
        self.element_of(&["R"])
    }

    fn array_of(&mut self, areas: &[&str]) -> Option<DrawnArray> {
        let fit = self.arrays.iter().filter(|array| areas.contains(&array.area));
        let fit: Vec<DrawnArray> = fit.copied().collect();
        (!fit.is_empty()).then(|| *self.rng.pick(&fit))
    }

    fn element_of(&mut self, areas: &[&str]) -> Option<String> {
        let array = self.array_of(areas)?;
        Some(array.at(&self.moving_index()))
    }

    /// A word that selects an element.
    pub fn moving_index(&mut self) -> String {
        match self.rng.weighted(&[40, 20, 15, 15, 10]) {
            0 => self.index_in("D"),
            1 => self.index_in("V"),
            2 => format!("CT{}.Acc", self.rng.below(4)),
            3 => self.indexed("MHR"),
            _ => "$ScanCounter".to_string(),
        }
    }

    /// A word of the area that is no element itself.
    fn index_in(&mut self, area: &str) -> String {
        let word = self.indexed(area);
        if word.contains('[') { format!("{area}0") } else { word }
    }

    /// Two neighbours, as a slice of an array or as a range.
    fn two(&mut self, bits: bool, written: bool) -> String {
        let runs: &[&str] = match bits {
            true => &["C0..C1", "C1..C2", "Y0..Y1", "Y1..Y2", "MC1..MC2"],
            false => &["D0..D1", "D1..D2", "V0..V1", "MHR1..MHR2", "R0..R1", "R1..R2"],
        };
        let mut runs: Vec<String> = runs.iter().map(|run| run.to_string()).collect();
        if bits && !written {
            runs.extend(["X0..X1", "X2..X3", "ST4..ST5"].map(str::to_string));
        }
        let fits = |array: &&DrawnArray| match array.area {
            "X" => false,
            area => (area == "C") == bits,
        };
        for array in self.arrays.iter().filter(fits) {
            let slices = (1..array.count).map(|last| array.at(&format!("{}..{last}", last - 1)));
            runs.extend(slices);
            runs.extend((array.count == 2).then(|| array.whole()));
        }
        self.rng.pick(&runs).clone()
    }

    /// A COPY or FILL.
    pub fn whole_arrays(&mut self) -> String {
        let bits = self.rng.chance(40);
        let to = self.two(bits, true);
        match (self.rng.chance(55), bits) {
            (true, _) => format!("COPY {} to={to}", self.two(bits, false)),
            (false, false) => format!("FILL {} to={to}", self.any_value()),
            (false, true) if self.rng.chance(40) => format!("FILL {} to={to}", self.rng.below(2)),
            (false, true) => format!("FILL {} to={to}", self.bit_of_its_own()),
        }
    }

    /// A PACK or UNPACK.
    pub fn packing(&mut self) -> String {
        let count = *self.rng.pick(&[1, 2, 3, 15, 16, 17, 31, 32]);
        let first = self.rng.below(3);
        let last = first + count - 1;
        if self.rng.chance(50) {
            let readable = ["C", "Y", "X"];
            let from = format!("{0}{first}..{0}{last}", self.rng.pick(&readable));
            return match self.element(false, true).filter(|_| count <= 16 && self.rng.chance(20)) {
                Some(element) => format!("PACK {from} to={element}"),
                None => format!("PACK {from} to={}", self.word_of(count)),
            };
        }
        let writable = ["C", "Y"];
        let to = format!("{0}{first}..{0}{last}", self.rng.pick(&writable));
        match self.rng.weighted(&[55, 25, 20]) {
            0 => format!("UNPACK {} to={to}", self.word_of(count)),
            1 => format!("UNPACK {} to={to}", self.rng.range(-70000, 70000)),
            _ => match self.element(false, false).filter(|_| count <= 16) {
                Some(element) => format!("UNPACK {element} to={to}"),
                None => format!("UNPACK -1 to={to}"),
            },
        }
    }

    /// A bit that is no bit of a word.
    fn bit_of_its_own(&mut self) -> String {
        let bit = self.bit();
        let ends_with_number =
            bit.rsplit_once('.').is_some_and(|(_, last)| last.parse::<u8>().is_ok());
        if ends_with_number { "$On".to_string() } else { bit }
    }

    /// The run that an SR shifts.
    pub fn shifted(&mut self) -> String {
        if self.rng.chance(50)
            && let Some(array) = self.array_of(&["C"])
        {
            return array.whole();
        }
        let runs = ["C0..C2", "C2..C0", "Y0..Y2", "MC2..MC1", "MI1..MI2"];
        self.rng.pick(&runs).to_string()
    }

    /// A word, possibly an R.
    pub fn any_word(&mut self) -> String {
        if self.rng.chance(75) {
            return self.word();
        }
        match self.real_element().filter(|_| self.rng.chance(25)) {
            Some(element) => element,
            None => {
                let address = self.indexed("R");
                self.name(&address)
            }
        }
    }

    /// A value, possibly a real.
    pub fn any_value(&mut self) -> String {
        let reals = [
            "0.5",
            "-1.25",
            "3.0",
            "1e3",
            "2.5e-7",
            "-1e30",
            "16777217.0",
            "0.1",
            "0.0",
            "-2.0",
            "2147483648.0",
            "3.4028235e38",
            "65535.5",
            "1e-45",
        ];
        match self.rng.weighted(&[60, 20, 20]) {
            0 => self.value(),
            1 => self.rng.pick(&reals).to_string(),
            _ => self.any_word(),
        }
    }

    /// An element in MATH. Its index may be an expression that contains the text of `index`.
    pub fn math_element(
        &mut self,
        areas: &[&str],
        index: impl Fn(&mut Pool) -> String,
    ) -> Option<String> {
        let array = self.array_of(areas)?;
        let index = self.math_index(array.count, index);
        Some(array.at(&index))
    }

    /// An index in MATH of an array with so many elements.
    pub fn math_index(&mut self, count: usize, index: impl Fn(&mut Pool) -> String) -> String {
        let area = if self.rng.chance(70) { "D" } else { "V" };
        let word = self.index_in(area);
        match self.rng.weighted(&[25, 25, 20, 15, 15]) {
            0 => self.rng.below(count).to_string(),
            1 => word,
            2 => format!("{word} % {count}"),
            3 => format!("$ScanCounter % {}", count + 1),
            _ => format!("{word} + {}", index(self)),
        }
    }

    /// A whole array or a slice, as an argument of a function.
    pub fn math_array(&mut self, areas: &[&str]) -> Option<String> {
        let array = self.array_of(areas)?;
        let low = self.rng.below(array.count);
        let high = low + self.rng.below(array.count - low);
        Some(match self.rng.chance(50) {
            true => array.whole(),
            false => array.at(&format!("{low}..{high}")),
        })
    }
}
