//! The templates of `config/lib/` in use, in virtual time: the promises of each template, and the
//! cases that an engineer would doubt.
//!
//! A [`Bench`] is a ladder with one file of the library and some uses. `tests/language/library.rs`
//! shows that the files load.

mod analog;
mod durations;
mod duty;
mod first_out;
mod iec;
mod pid;
mod plants;
mod pumps;
mod ramp;
mod ramp_soak;
mod timing;
mod valve;
mod vote;
mod week;

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;

use rungd_engine::isa::{Address, Bit, BitSpace, Real};
use rungd_engine::{Cell, EngineCall};

use rungd_test_support::plc::{Plc, of_ladder};
use rungd_test_support::run;

/// A ladder with a file of the library, scanned by the test.
struct Bench {
    plc: Plc,
    /// Values to be written before the next scan.
    pending: Vec<(Place, i32)>,
    /// The places of the names used so far, because finding a place takes longer than a scan.
    places: RefCell<HashMap<String, Place>>,
}

#[derive(Clone, Copy)]
struct Place {
    cell: Cell,
    /// The number of the input, if the place is an X.
    input: Option<u32>,
}

/// A started controller with these uses of one file's templates, in Main. One scan takes 10 ms.
fn bench(library: &str, tags: &str, uses: &str) -> Bench {
    let main = format!("[[program]]\nname = \"Main\"\nrung = [\n{uses}\n]\n");
    started(library, tags, &main)
}

/// The same as [`bench`], with these blocks.
fn started(library: &str, tags: &str, blocks: &str) -> Bench {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join(format!("config/lib/{library}.toml"));
    let library = std::fs::read_to_string(path).expect("a file of the library");
    let mut plc = of_ladder(&format!("{library}\n[tags]\n{tags}\n{blocks}"));
    plc.engine.start(0);
    Bench { plc, pending: Vec::new(), places: RefCell::default() }
}

impl Bench {
    fn period(mut self, ms: u64) -> Bench {
        self.plc.period_ns = ms * 1_000_000;
        self
    }

    /// Sets a bit or an integer from the next scan on.
    fn set(&mut self, name: &str, value: i32) -> &mut Bench {
        let place = self.place(name);
        self.pending.push((place, value));
        self
    }

    /// Sets a real from the next scan on.
    fn put(&mut self, name: &str, value: f32) -> &mut Bench {
        self.set(name, Real::finite(value).expect("a finite number").cell())
    }

    fn place(&self, name: &str) -> Place {
        if let Some(place) = self.places.borrow().get(name) {
            return *place;
        }
        let input = match self.plc.program.scope().address(name) {
            Ok(Address::Bit(Bit::Space(BitSpace::X, n))) => Some(n),
            _ => None,
        };
        let place = Place { cell: self.plc.cell(name), input };
        self.places.borrow_mut().insert(name.to_owned(), place);
        place
    }

    fn scan(&mut self) -> &mut Bench {
        let plc = &mut self.plc;
        plc.engine.begin_scan(plc.now_ns, &plc.times, &plc.local);
        for (place, value) in self.pending.drain(..) {
            match (place.input, place.cell) {
                (Some(n), _) => plc.engine.set_input(n, value != 0),
                (None, cell) => plc.engine.apply(EngineCall::Write(cell, value)),
            }
        }
        plc.now_ns += plc.period_ns;
        plc.engine.execute();
        self
    }

    /// Scans until this time has passed, at least once.
    fn run(&mut self, ms: u64) -> &mut Bench {
        let end = self.plc.now_ns + ms * 1_000_000;
        self.scan();
        while self.plc.now_ns < end {
            self.scan();
        }
        self
    }

    /// An orderly stop and the next start, with memory unchanged.
    fn restart(&mut self) -> &mut Bench {
        self.plc.stop();
        self.plc.engine.start(self.plc.now_ns);
        self
    }

    fn on(&self, name: &str) -> bool {
        self.int(name) != 0
    }

    fn int(&self, name: &str) -> i64 {
        run::value(self.plc.engine.image(), self.place(name).cell)
    }

    fn real(&self, name: &str) -> f32 {
        Real::of_cell(i32::try_from(self.int(name)).expect("a cell")).number()
    }

    /// A picture of some bits: `1` or `0` for each.
    fn bits(&self, names: &[&str]) -> String {
        names.iter().map(|name| if self.on(name) { '1' } else { '0' }).collect()
    }

    /// The number of scans in which a bit is ON during some time, and the number of its rising
    /// edges.
    fn watch(&mut self, name: &str, ms: u64) -> (u32, u32) {
        let end = self.plc.now_ns + ms * 1_000_000;
        let (mut scans, mut rises, mut before) = (0, 0, self.on(name));
        while self.plc.now_ns < end {
            self.scan();
            let now = self.on(name);
            scans += u32::from(now);
            rises += u32::from(now && !before);
            before = now;
        }
        (scans, rises)
    }
}
