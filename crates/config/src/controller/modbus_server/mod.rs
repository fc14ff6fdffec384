//! `[modbus-server]`, resolved: the map, the write permissions, and the limits of clients.
//!
//! Called by [`super`]. `map` resolves the entries of the explicit map. Only run time shows whether
//! the server can listen at the address.

pub mod keys;
mod map;

use keys::{self as written, Mapping};

use super::resolver::{AllowedSpaces, SettingsResolver};
use rungd_base::progress::Progress;
use rungd_engine::isa::{
    Address, Bit, BitSpace, MemorySizes, NumberRanges, Space, Structure, Word, WordSpace,
};
use rungd_io::modbus::clients::Network;
use rungd_io::modbus::settings::{LISTS_MAX, ModbusServerSettings, ModbusTable, WriteList};
use rungd_language::resolve::operands::{Operands, numbers, resolve_operands};
use rungd_language::resolve::range::Range;
use rungd_language::source::finding::{Code, Finding};
use rungd_language::source::fix::possible;
use rungd_language::source::reader::Text;

impl SettingsResolver<'_> {
    pub(super) fn modbus(
        &mut self,
        server: &written::WrittenModbusServer,
        sizes: &MemorySizes,
    ) -> ModbusServerSettings {
        let inputs = [(BitSpace::Mc, "coils (MC)"), (BitSpace::X, "inputs (X)")];
        let outputs = [(BitSpace::Y, "outputs (Y)"), (BitSpace::Mi, "discrete inputs (MI)")];
        let mut modbus = ModbusServerSettings {
            entries: map::resolve(server, sizes, self),
            inputs: server.inputs.as_ref().and_then(|mapping| self.mapping(mapping, inputs)),
            outputs: server.outputs.as_ref().and_then(|mapping| self.mapping(mapping, outputs)),
            ..server.settings.clone()
        };
        modbus.lists = self.lists(server, &modbus);
        modbus
    }

    /// `writable`, followed by the lists of `[[modbus-server.write]]`.
    fn lists(
        &mut self,
        server: &written::WrittenModbusServer,
        modbus: &ModbusServerSettings,
    ) -> Vec<WriteList> {
        let places = WritablePlaces::of(modbus, self.progress);
        let writable = self.writable(&server.writable, &places);
        let mut lists = vec![WriteList { ranges: writable, clients: None }];
        for list in self.progress.during(&server.writes) {
            let ranges = self.writable(&list.ranges, &places);
            let mut clients = Vec::new();
            for text in self.progress.during(&list.clients) {
                match Network::read(text) {
                    Ok(network) => clients.push(network),
                    Err(finding) => self.findings.push(finding),
                }
            }
            lists.push(WriteList { ranges, clients: Some(clients) });
        }
        if lists.len() > LISTS_MAX {
            let message = format!("at most {} lists of writes", LISTS_MAX - 1);
            self.findings.push(Finding::new(Code::Controller, server.span, message));
            lists.truncate(LISTS_MAX);
        }
        lists
    }

    fn writable(&mut self, texts: &[Text], places: &WritablePlaces) -> Vec<Operands> {
        let mut all = Vec::new();
        let progress = self.progress;
        for text in progress.during(texts) {
            let operands = match resolve_operands(self.scope, text) {
                Ok(operands) => operands,
                Err(finding) => {
                    self.findings.push(finding);
                    continue;
                }
            };
            let wrong = may_be_listed(&operands).or_else(|| places.lacking(&operands));
            match wrong {
                Some(finding) => self.findings.push(finding),
                None => all.push(operands),
            }
        }
        all
    }

    fn mapping(
        &mut self,
        mapping: &Mapping,
        spaces: [(BitSpace, &'static str); 2],
    ) -> Option<(Range, Range)> {
        let mut side = |text: &Option<Text>, (space, words): (BitSpace, &'static str)| {
            let spaces = [Space::Bit(space)];
            let wanted = AllowedSpaces { spaces: &spaces, words, code: Code::Controller };
            self.range(text.as_ref()?, &wanted)
        };
        let (from, to) = (side(&mapping.from, spaces[0]), side(&mapping.to, spaces[1]));
        let (from, to) = (from?, to?);
        if from.count() != to.count() {
            let message =
                format!("`{from}` has {} elements, and `{to}` {}", from.count(), to.count());
            let finding = Finding::new(Code::Controller, mapping.span, message);
            let finding = finding.help("both ranges are equally long");
            let count = from.count().min(to.count());
            let sides = [(&mapping.from, &from), (&mapping.to, &to)];
            let cut = sides.into_iter().filter_map(|(text, range)| {
                let last = range.first + count - 1;
                let text = text.as_ref().filter(|_| range.last > last)?;
                Some(possible(Range { last, ..*range }.to_string()).at(text.span))
            });
            self.findings.push(finding.fixes(cut));
            return None;
        }
        Some((from, to))
    }
}

/// The finding for operands that no client can write.
fn may_be_listed(operands: &Operands) -> Option<Finding> {
    let why = match operands.first {
        Address::Bit(Bit::Space(BitSpace::C | BitSpace::Mc | BitSpace::Mi, _)) => return None,
        Address::Bit(Bit::Flag(Structure::Sensaphone(_), _)) => return None,
        Address::Word(word) if word.writable() => return None,
        Address::Bit(Bit::InWord(bit)) if bit.word.writable() => return None,
        Address::Bit(Bit::Space(BitSpace::X, _)) => {
            "a client moves inputs by `[modbus-server.image]`"
        }
        Address::Bit(Bit::Space(BitSpace::Y, _)) => "clients can only read outputs",
        Address::Bit(Bit::Flag(..)) => "its instruction writes it at every execution",
        Address::Bit(Bit::Stage(_) | Bit::Running(_) | Bit::Done(_)) => {
            "Stages and blocks are switched by the ladder"
        }
        Address::Bit(Bit::Space(BitSpace::St, _) | Bit::Device(..) | Bit::InWord(_))
        | Address::Word(_)
        | Address::Structure(_) => "it shows the state of the controller",
    };
    let message = format!("`{operands}` cannot be written: {why}");
    let finding = Finding::new(Code::Controller, operands.span, message);
    Some(finding.help("list C, MC, MI, V, D, R, MHR, MIR, or an `.Acc`").or_omit())
}

/// The operands that have a coil or holding register.
struct WritablePlaces {
    standard_map: bool,
    /// The operands of the map, by their kinds ([`numbers`]).
    mapped: NumberRanges<Address>,
}

impl WritablePlaces {
    fn of(modbus: &ModbusServerSettings, progress: &Progress) -> WritablePlaces {
        let mut mapped = NumberRanges::default();
        for entry in progress.during(&modbus.entries) {
            if matches!(entry.table, ModbusTable::Coils | ModbusTable::HoldingRegisters) {
                mapped.add(numbers(entry.operands.first, entry.operands.count), 0);
            }
        }
        WritablePlaces { standard_map: modbus.standard_map, mapped }
    }

    /// The finding for listed operands without such a place.
    fn lacking(&self, operands: &Operands) -> Option<Finding> {
        let is_standard = matches!(
            operands.first,
            Address::Bit(Bit::Space(BitSpace::Mc, _))
                | Address::Word(Word::Space(WordSpace::Mhr, _))
        );
        let mapped = self.mapped.first_in(numbers(operands.first, operands.count));
        if mapped.is_some() || (is_standard && self.standard_map) {
            return None;
        }
        let message = format!("`{operands}` is listed, and it has no coil or holding register");
        let finding = Finding::new(Code::Controller, operands.span, message);
        Some(finding.help("give it a place by `[[modbus-server.map]]`").or_omit())
    }
}
