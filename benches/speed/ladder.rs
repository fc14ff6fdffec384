//! Writes a workload as a ladder file, and gives the memory sizes that it needs.

use std::fmt::Write;

use rungd_engine::isa::MemorySizes;

use super::workload::{
    Bit, BitContact, Contact, Kind, Rung, STAGED_COILS, STAGES, Shape, Stage, Workload,
};

pub fn sizes(workload: &Workload) -> MemorySizes {
    let default = MemorySizes::default();
    MemorySizes {
        c: default.c.max(workload.coils() as u32),
        ct: default.ct.max(workload.structures() as u32),
        t: default.t.max(workload.structures() as u32),
        ..default
    }
}

pub fn text(workload: &Workload) -> String {
    let mut text = format!("[ladder]\nname = \"{}\"\n", workload.name.text());
    text.push_str("\n[[program]]\nname = \"Main\"\n");
    match &workload.shape {
        Shape::Flat(rungs) => {
            for (at, rung) in rungs.iter().enumerate() {
                flat_rung(&mut text, at, rung);
            }
        }
        Shape::Staged(programs) => {
            for (at, stages) in programs.iter().enumerate() {
                write!(text, "\n[[program]]\nname = \"Line{at}\"\nautostart = true\n").unwrap();
                for (s, stage) in stages.iter().enumerate() {
                    staged_rungs(&mut text, at, s, stage);
                }
            }
        }
    }
    text
}

fn flat_rung(text: &mut String, at: usize, rung: &Rung) {
    let (leg, preset) = (leg(&rung.leg), rung.preset);
    let [c, d] = rung.reset.map(bit);
    let counter = |text: &mut String, name: &str, mnemonic: &str| {
        let reset = format!("leg.rst = [\"{c}\", \"{d}\"]");
        let count = format!("do = [\"{mnemonic} CT{at} preset={preset}\"]");
        write!(text, "\n[[program.rung]]\nleg.{name} = {leg}\n{reset}\n{count}\n").unwrap();
        write!(text, "\n[[program.rung]]\nwhen = [\"CT{at}.Done\"]\ndo = [\"OUT C{at}\"]\n")
            .unwrap();
    };
    let timer = |text: &mut String, mnemonic: &str| {
        let time = format!("do = [\"{mnemonic} T{at} preset={preset}ms output=C{at}\"]");
        write!(text, "\n[[program.rung]]\nwhen = {leg}\n{time}\n").unwrap();
    };
    match rung.kind {
        Kind::CountUp => counter(text, "up", "CNT"),
        Kind::CountDown => counter(text, "dn", "CNTDN"),
        Kind::OnDelay => timer(text, "ONDTMR"),
        Kind::OffDelay => timer(text, "OFFDTMR"),
    }
}

fn staged_rungs(text: &mut String, program: usize, at: usize, stage: &Stage) {
    let (coil, timer) = (program * STAGED_COILS, program * STAGES + at);
    let (own, timed) = (coil + 1 + at, coil + 1 + STAGES + at);
    let next = (at + 1) % STAGES;
    let (shared, own_leg, leave) = (leg(&stage.shared), leg(&stage.own), contact(&stage.leave));
    let (time, preset) = (contact(&stage.timer), stage.preset);
    write!(
        text,
        "\n[[program.stage]]\nname = \"S{at}\"\nrung = [\n\
         {{ when = {shared}, do = [\"OUT C{coil}\"] }},\n\
         {{ when = {own_leg}, do = [\"OUT C{own}\"] }},\n\
         {{ when = [\"{time}\"], do = [\"ONDTMR T{timer} preset={preset}ms output=C{timed}\"] }},\n\
         {{ when = [\"T{timer}.Done\", \"{leave}\"], do = [\"JMP S{next}\"] }},\n]\n"
    )
    .unwrap();
}

fn leg(contacts: &[Contact]) -> String {
    let contacts: Vec<_> = contacts.iter().map(|c| format!("\"{}\"", contact(c))).collect();
    format!("[{}]", contacts.join(", "))
}

fn contact(contact: &Contact) -> String {
    match contact {
        Contact::Bit(bit) => bit_contact(bit),
        Contact::Or(a, b) => format!("{} | {}", bit_contact(a), bit_contact(b)),
        Contact::Less(word, than) => format!("D{word} < {than}"),
        Contact::NotRise(x) => format!("!rise(X{x})"),
    }
}

fn bit_contact(contact: &BitContact) -> String {
    format!("{}{}", if contact.opposite { "!" } else { "" }, bit(contact.bit))
}

fn bit(bit: Bit) -> String {
    match bit {
        Bit::Input(x) => format!("X{x}"),
        Bit::Coil(rung) => format!("C{rung}"),
    }
}
