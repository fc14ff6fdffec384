//! The bodies of the fuzz targets: one function for each parser.
//!
//! No target may panic. Some check more: printed text parses to the same value, a reply is one
//! frame. `fuzz/run` runs all targets. A new parser gets a function here, a file of three lines in
//! `fuzz_targets/`, and a row in `Cargo.toml` and in `run`.

use std::collections::HashSet;
use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::sync::LazyLock;

use rungd_base::calendar::LocalTime;
use rungd_client::operator::names::OperandNames;
use rungd_client::operator::protocol::{BitOrNumber, GivenValue, Request, ShownValue, WRITES_MAX};
use rungd_client::operator::value_set::{FileWrite, file_text, read_file};
use rungd_config::controller::{self, Controller, resolve_controller};
use rungd_config::load::decode;
use rungd_engine::isa::{MemorySizes, address_text, duration};
use rungd_engine::{Cell, Engine, ScanTimes};
use rungd_fleet::fleet::{FleetLimits, FleetView, ReceivedMessage};
use rungd_history::record::{RecordedProgram, Recording, SectionBody, SegmentStart, read_program};
use rungd_io::modbus::ModbusMap;
use rungd_io::modbus::answer::{AnsweredRequest, RequestDecision, answer, refused, written};
use rungd_io::modbus::frame::{self, FRAME_BYTES_MAX, FrameSplit};
use rungd_io::modbus::map::RequestSource;
use rungd_io::modbus::number::{ByteOrder, NumberOrder, RegisterNumberType, WordOrder};
use rungd_io::modbus_client as client;
use rungd_io::scaling::Scaling;
use rungd_lab::traces::stimulus::{Stimulus, StimulusTarget};
use rungd_language::lower::{Symbols, lower};
use rungd_language::resolve::program::Program;
use rungd_language::resolve::{LoadOptions, load_ladders};
use rungd_language::source::finding::{Finding, Severity};
use rungd_language::source::render::{Style, render};
use rungd_language::source::span::{FileId, SourceFile, Span};
use rungd_language::source::{contact_parser, instruction};
use rungd_runtime::command::Forces;
use rungd_runtime::exchange::{Mode, Snapshot};
use rungd_state::retain::Storage;
use rungd_state::retain::format::{ImageStamp, put_slot, read_slot};

const LADDER: &str = include_str!("../../tests/io/oracle/ladder.toml");
const CONTROLLER: &str = include_str!("../../tests/io/oracle/controller.toml");

/// A program, its symbols and a controller file that fits it.
struct Known {
    program: Program,
    symbols: Symbols,
    settings: Controller,
    names: OperandNames,
}

/// Made once; every run only reads it.
static KNOWN: LazyLock<Known> = LazyLock::new(|| {
    let file = SourceFile { name: "ladder.toml".to_owned(), text: LADDER.to_owned() };
    let program = load_ladders(&[file], &LoadOptions::default()).0.expect("a program");
    let symbols = lower(&program).1;
    let written = controller::read(CONTROLLER, FileId(0)).0.expect("a controller file");
    let settings = resolve_controller(&written, &program).0;
    let names = OperandNames::new(&program, &symbols);
    Known { program, symbols, settings, names }
});

/// The file's text, as a load decodes it.
fn file(bytes: &[u8]) -> (SourceFile, Vec<Finding>) {
    let (text, finding) = decode(bytes, FileId(0));
    (SourceFile { name: "fuzz.toml".to_owned(), text }, finding.into_iter().collect())
}

/// Renders the findings: that must not panic either.
fn show(findings: &[Finding], file: SourceFile) {
    let shown = render(findings, &[file], Style::default());
    assert!(!shown.contains('\u{1b}'), "no escape of the author's reaches the terminal");
}

/// An L5X file: reads it, and writes the project that it becomes.
pub fn l5x(bytes: &[u8]) {
    if let Ok(project) = rungd_import::l5x::read(&String::from_utf8_lossy(bytes)) {
        assert!(!rungd_import::write::files(&project).is_empty());
    }
}

/// A PLCopen file: reads it, and writes the project that it becomes.
pub fn plcopen(bytes: &[u8]) {
    if let Ok(project) = rungd_import::plcopen::read(&String::from_utf8_lossy(bytes)) {
        assert!(!rungd_import::write::files(&project).is_empty());
    }
}

/// A CLICK ladder in CSV; what stands behind the first zero byte is a nickname file for it.
pub fn click(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0).map(String::from_utf8_lossy);
    let ladder = parts.next().unwrap_or_default();
    let project = match parts.next() {
        Some(nicknames) => rungd_import::click::read_named(&ladder, &nicknames),
        None => rungd_import::click::read(&ladder),
    };
    if let Ok(project) = project {
        assert!(!rungd_import::write::files(&project).is_empty());
    }
}

/// Element documentation of a Do-more: reads it, and writes the project that it becomes.
pub fn domore(bytes: &[u8]) {
    if let Ok(project) = rungd_import::domore::read(&String::from_utf8_lossy(bytes)) {
        assert!(!rungd_import::write::files(&project).is_empty());
    }
}

/// A ladder file: reads, resolves, checks and lowers it.
pub fn ladder(bytes: &[u8]) {
    let (file, mut findings) = file(bytes);
    let files = [file];
    let (program, found) = load_ladders(&files, &LoadOptions::default());
    findings.extend(found);
    if let Some(program) = program {
        findings.extend(rungd_language::check::check(
            &program,
            rungd_language::check::CheckInputs::of(&[]),
        ));
        if findings.iter().all(|finding| finding.severity() != Severity::Error) {
            let _ = lower(&program);
        }
    }
    let [file] = files;
    show(&findings, file);
}

/// A template and its use. The lines of the text are: the argument for a contact, a contact in the
/// template, an instruction in the template, the text of an alarm.
pub fn templates(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if text.contains(['"', '\\', '\r']) {
        return;
    }
    let mut lines = text.lines();
    let mut line = || lines.next().unwrap_or("X0");
    let (given, contact, instruction, alarm) = (line(), line(), line(), line());
    let ladder = format!(
        "[[template]]\nname = \"Inner\"\nrung = [ {{ when = [\"on\", \"{contact}\"], \
         do = [\"OUT out\", \"{instruction}\"] }} ]\n[template.parameters]\n\
         on = {{ type = \"contact\" }}\nout = {{ type = \"output\" }}\n\
         n = {{ type = \"int\", default = 7 }}\n[template.tags]\n\
         late = {{ type = \"timer\" }}\nseen = {{ type = \"bit\", alarm = \"{alarm}\" }}\n\
         [[template]]\nname = \"Outer\"\nrung = [ {{ use = \"Inner\", name = \"i\", \
         with = {{ on = \"{contact}\", out = \"out\" }} }} ]\n[template.parameters]\n\
         on = {{ type = \"contact\" }}\nout = {{ type = \"output\" }}\n\
         [[program]]\nname = \"Main\"\nrung = [\n\
         {{ use = \"Outer\", name = \"a\", with = {{ on = \"{given}\", out = \"Y0\" }} }},\n\
         {{ use = \"Inner\", name = \"b\", with = {{ on = \"{given}\", out = \"Y1\" }} }},\n]\n"
    );
    self::ladder(ladder.as_bytes());
}

/// A controller file: reads it, and resolves it against a program.
pub fn controller_file(bytes: &[u8]) {
    let (file, mut findings) = file(bytes);
    let (written, found) = controller::read(&file.text, FileId(0));
    findings.extend(found);
    rungd_language::source::file_kind::is_controller(&file.text);
    if let Some(written) = written {
        let (settings, found) = resolve_controller(&written, &KNOWN.program);
        let error =
            findings.iter().chain(&found).any(|finding| finding.severity() == Severity::Error);
        findings.extend(found);
        if let (false, Some(modbus)) = (error, settings.modbus) {
            let symbols = &KNOWN.symbols;
            let _ = ModbusMap::new(&modbus, &symbols.layout, |word| symbols.limits(word));
        }
    }
    show(&findings, file);
}

/// A contact.
pub fn contact(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let _ = contact_parser::parse(text, Span::default());
}

/// An instruction's text.
pub fn instruction(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let mut findings = Vec::new();
    let _ = instruction::parse(text, Span::default(), &mut findings);
}

/// A MATH: parses, resolves and lowers it, and calculates for a scan.
pub fn math(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if text.contains(['"', '\\', '\n', '\r']) {
        return;
    }
    let rung = format!("{{ when = [\"$On\"], do = [\"MATH {text}\"] }}");
    let text = format!("[[program]]\nname = \"Main\"\nrung = [ {rung} ]\n");
    let file = SourceFile { name: "fuzz.toml".to_owned(), text };
    if let (Some(program), _) = load_ladders(&[file], &LoadOptions::default()) {
        let mut engine = Engine::new(lower(&program).0);
        engine.start(0);
        engine.begin_scan(0, &ScanTimes::default(), &LocalTime::default());
        engine.execute();
    }
}

/// Addresses, durations, names and values, as an operator types them too.
pub fn texts(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(address) = address_text::parse(text, &MemorySizes::default()) {
        let again = address_text::parse(&address.to_string(), &MemorySizes::default());
        assert_eq!(again.ok(), Some(address));
    }
    if let Ok(ms) = duration::parse(text) {
        assert_eq!(duration::parse(&duration::print(ms)).ok(), Some(ms));
    }
    let _ = duration::in_order(text);
    let names = &KNOWN.names;
    let (name, value) = text.split_once(' ').unwrap_or((text, "1"));
    let _ = names.beginning(name);
    if let Ok(operand) = names.find_one(name) {
        let _ = (operand.may_write(), operand.may_force());
        let _ = names.number(&operand, &GivenValue::Text(value.to_owned()));
    }
}

/// The bytes that a Modbus server receives: a stream of frames, each answered by one frame.
pub fn modbus_server(mut bytes: &[u8]) {
    static MAP: LazyLock<(ModbusMap, Snapshot)> = LazyLock::new(|| {
        let Known { symbols, settings, .. } = &*KNOWN;
        let settings = settings.modbus.as_ref().expect("it has a server");
        let map = ModbusMap::new(settings, &symbols.layout, |word| symbols.limits(word));
        (map, image(symbols))
    });
    let (map, latest) = &*MAP;
    let asker = |unit| RequestSource { unit, client: IpAddr::V4(Ipv4Addr::LOCALHOST) };
    while let FrameSplit::Frame { header, pdu, bytes: taken } = frame::split(bytes) {
        let reply = match answer(map, asker(header.unit), pdu, latest) {
            RequestDecision::Reply(reply) => reply,
            RequestDecision::Refused(request, refusal) => {
                let _ = (map.place(header.unit, &request), refusal.to_string());
                refused(pdu, refusal)
            }
            RequestDecision::Write(request, batch) => {
                assert!(!batch.is_empty() && batch.len() <= 4096);
                let request = AnsweredRequest { pdu, request: &request };
                written(map, header.unit, request, latest).expect("as it was")
            }
        };
        assert!(reply[0] == pdu[0] || (reply[0] == pdu[0] | 0x80 && reply.len() == 2));
        let framed = frame::around(header, |frame| frame.extend_from_slice(&reply));
        assert!(framed.len() <= FRAME_BYTES_MAX);
        let whole = frame::split(&framed);
        assert!(matches!(whole, FrameSplit::Frame { pdu, .. } if pdu == reply));
        bytes = &bytes[taken..];
    }
}

/// The bytes that a Modbus client receives: an answer to each kind of request, by TCP and on a
/// serial line.
pub fn modbus_client(bytes: &[u8]) {
    let requests: [&[u8]; 8] = [
        &[1, 0, 0, 0, 9],
        &[2, 0, 0, 7, 208],
        &[3, 0, 5, 0, 2],
        &[4, 255, 255, 0, 1],
        &[5, 0, 0, 255, 0],
        &[6, 0, 1, 18, 52],
        &[15, 0, 0, 0, 9, 2, 255, 1],
        &[16, 0, 0, 0, 1, 2, 1, 2],
    ];
    for request in requests {
        let of_read = request[0] <= 4;
        if let Ok(data) = client::answer::check(request, bytes) {
            assert!(bytes.ends_with(data) && (of_read || data.is_empty()));
        }
        if let Some(pdu) = client::rtu::find(bytes, 17, request) {
            assert!(pdu[0] & 0x7f == request[0]);
            let _ = client::answer::check(request, pdu);
        }
        if let FrameSplit::Frame { pdu, .. } = frame::split(bytes) {
            let _ = client::answer::check(request, pdu);
        }
    }
}

/// Points of Modbus devices: a text as points of a map, and the registers that a device answers, read
/// as numbers of every type and order, with any scaling, into every kind of memory. A number that
/// was read is sent back, and is then read as the same number.
pub fn modbus_points(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes)
        && !text.contains(['"', '\\', '\n', '\r'])
    {
        let rows =
            format!("{{ from = \"{text}\", to = \"D0\" }}, {{ from = \"D1\", to = \"{text}\" }}");
        let device =
            "[[device]]\nname = \"line1\"\ndriver = \"modbus-tcp\"\naddress = \"10.0.0.1\"";
        controller_file(format!("ladder = [\"l.toml\"]\n{device}\nmap = [{rows}]\n").as_bytes());
    }
    let Some(form) = PointNumber::read(bytes) else { return };
    let group = client::reads(&[form.point], 0, &client::settings::PeerHabits::default()).remove(0);
    let mut inputs = [None];
    let is_number = group.bring_in(&form.registers[..usize::from(group.count) * 2], &mut inputs);
    assert_eq!(is_number, inputs[0].is_some());
    let Some(value) = inputs[0] else { return };
    let mut run = client::runs(&[form.point], &client::settings::PeerHabits::default()).remove(0);
    let sent = |run: &mut client::OutputRun, value| {
        run.want(&[value]);
        let part = run.due(true).expect("all is due");
        let mut request = Vec::new();
        run.push_request(&mut request, part, client::settings::WriteFunctions::Multiple, 0);
        request
    };
    let request = sent(&mut run, value);
    assert_eq!(request.len(), 6 + usize::from(group.count) * 2);
    if form.is_exact {
        let mut again = [None];
        assert!(group.bring_in(&request[6..], &mut again));
        assert_eq!(again[0], Some(value), "{:?}", form.point);
    }
}

/// A point with a number, from the first bytes of an input, and its registers, from the others.
struct PointNumber<'a> {
    point: client::settings::ModbusPoint,
    registers: &'a [u8],
    /// Whether memory and registers hold the same numbers, so that nothing is lost on the way.
    is_exact: bool,
}

impl<'a> PointNumber<'a> {
    fn read(bytes: &'a [u8]) -> Option<PointNumber<'a>> {
        use client::settings::{ModbusPoint, ModbusTable, NumberPart, PointForm, RegisterNumber};
        let (head, registers) = bytes.split_at_checked(10)?;
        let registers = registers.get(..8)?;
        let [kind, form, a, b, c, d, e, f, g, h] = *head.first_chunk::<10>()?;
        let (_, kind) =
            RegisterNumberType::NAMES[usize::from(kind) % RegisterNumberType::NAMES.len()];
        let words = [WordOrder::HighFirst, WordOrder::LowFirst][usize::from(form & 1)];
        let bytes = [ByteOrder::HighFirst, ByteOrder::LowFirst][usize::from(form >> 1 & 1)];
        let is_real = form & 4 != 0;
        let is_scaled = form & 8 != 0;
        let scaling = match is_scaled {
            true => Scaling {
                real: is_real,
                multiply: (i32::from(i16::from_be_bytes([a, b])) * 30).clamp(-1_000_000, -1),
                divide: 1 + i32::from(u16::from_be_bytes([c, d])) * 15,
                offset: i32::from_be_bytes([e, f, g, h]),
            },
            false => Scaling { real: is_real, multiply: 1, divide: 1, offset: 0 },
        };
        let number = RegisterNumber {
            kind,
            order: NumberOrder { words, bytes },
            part: NumberPart::Whole,
            scaling,
        };
        let (table, form) = (ModbusTable::HoldingRegisters, PointForm::Number(number));
        let is_exact = !is_scaled
            && !is_real
            && matches!(kind, RegisterNumberType::I32 | RegisterNumberType::I64);
        Some(PointNumber {
            point: ModbusPoint { unit: 1, table, at: 7, form },
            registers,
            is_exact,
        })
    }
}

fn image(symbols: &Symbols) -> Snapshot {
    let layout = &symbols.layout;
    Snapshot {
        generation: 0,
        scans: 1,
        now_ns: 0,
        mode: Mode::Run,
        since_ns: 0,
        ending: false,
        bits: vec![1; layout.bit_count() as usize].into(),
        words: vec![-7; layout.word_count() as usize].into(),
        outputs: vec![1; layout.sizes().y as usize].into(),
        tickets_done: 0,
        forces: Forces::default(),
        safe: [].into(),
    }
}

/// A line of the operator's protocol: a request that was read is written as a line that reads as
/// the same request.
pub fn operator(bytes: &[u8]) {
    let Ok(request) = serde_json::from_slice::<Request>(bytes) else { return };
    let line = serde_json::to_vec(&request).expect("it is of plain parts");
    let again: Request = serde_json::from_slice(&line).expect("its own line");
    assert_eq!(serde_json::to_vec(&again).expect("as before"), line);
}

/// A file of values for `rungd write --file`: what it names is looked up, and the file that would be
/// made of its values is read as the same values.
pub fn value_set(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let (writes, findings) = read_file(text);
    assert!(writes.len() <= WRITES_MAX || !findings.is_empty());
    show(&findings, SourceFile { name: "set.toml".to_owned(), text: text.to_owned() });
    if !findings.is_empty() {
        return;
    }
    let mut named = HashSet::new();
    let mut values = Vec::new();
    for FileWrite { write, .. } in writes {
        if let Ok(operand) = KNOWN.names.find_one(&write.operand) {
            let _ = KNOWN.names.number(&operand, &write.value);
        }
        let GivenValue::Text(text) = &write.value else { panic!("a file gives texts") };
        let value = match (text.as_str(), text.parse()) {
            ("true", _) => BitOrNumber::Bit(true),
            ("false", _) => BitOrNumber::Bit(false),
            (_, Ok(number)) => BitOrNumber::Word(number),
            (_, Err(_)) => continue,
        };
        if named.insert(write.operand.clone()) {
            values.push(shown_value(write.operand, value));
        }
    }
    let (again, findings) = read_file(&file_text(&values, &[]));
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(again.len(), values.len());
    for (FileWrite { write, .. }, value) in again.iter().zip(&values) {
        assert_eq!(write.operand, value.operand);
        let text = match value.value {
            BitOrNumber::Bit(on) => on.to_string(),
            number @ (BitOrNumber::Word(_) | BitOrNumber::Real(_)) => number.to_string(),
        };
        assert_eq!(write.value, GivenValue::Text(text));
    }
}

/// A value as an answer of a controller has it.
fn shown_value(operand: String, value: BitOrNumber) -> ShownValue {
    ShownValue {
        address: operand.clone(),
        operand,
        tag: None,
        value,
        unit: None,
        text: None,
        forced: false,
        driven: None,
        unknown: None,
    }
}

/// A connection to `rungd web`: it ends, and gives no session to a client that has not signed in.
pub fn web(bytes: &[u8]) {
    let answer = rungd_web::conversation(bytes);
    let has = |word: &[u8]| answer.windows(word.len()).any(|part| part == word);
    assert!(!has(b"set-cookie:") && !has(b"\"csrf\""), "it lets in");
}

/// What the bytes of an OPC UA client reach, or with a first byte of 255 a file of the server.
pub fn opcua(bytes: &[u8]) {
    if let [255, text @ ..] = bytes {
        let read = rungd_fleet::opcua::read_opcua(Path::new("/etc/rungd/opcua.toml"), text);
        show(&read.findings, read.file);
    } else {
        rungd_opcua::strangers::take(bytes);
    }
}

/// The packets of an MQTT broker: none causes a panic, and the client's answers and memory stay in
/// proportion to the packets.
pub fn mqtt(bytes: &[u8]) {
    rungd_net::mqtt::conversation(bytes);
}

/// A stimulus for the simulator.
pub fn stimulus(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let lookup = |name: &str| {
        let operand = KNOWN.names.find_one(name).map_err(|refusal| refusal.message)?;
        Ok(match operand.cell {
            cell @ (Cell::Bit(_) | Cell::WordBit(_)) => StimulusTarget::Bit(cell),
            Cell::Word(cell) => StimulusTarget::Word(cell, (-5, 70_000)),
        })
    };
    let _ = Stimulus::parse(text, &lookup);
}

/// A test file, with the ladders of `tests/suites`.
pub fn test_file(bytes: &[u8]) {
    let (file, found) = file(bytes);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/suites/fuzzed.test.toml");
    let read = rungd_lab::testing::read_text(&path, file, found.into_iter().next());
    let _ = render(&read.findings, &read.files, Style::default());
}

/// A file of retentive memory: shows it, and searches for its newest image.
pub fn retain(bytes: &[u8]) {
    let mut disk = Disk(bytes.to_vec());
    let _ = rungd_state::retain::show::show(&mut disk, &|_, _| None);
    let _ = rungd_state::retain::slots::survey(&mut disk);
    if let Some(content) = rungd_state::retain::content::read(bytes) {
        let _ = format!("{content:?}");
    }
    // Every slot is read as it was written.
    let stamp = ImageStamp { sequence: 3, scan: 2, saved_ms: 1, flags: 0, scanned_ms: 0 };
    let mut slot = Vec::new();
    put_slot(&mut slot, 7, &stamp, bytes);
    assert_eq!(read_slot(&slot, 7), Ok((stamp, bytes)));
}

/// A recording: its programs, its sections, and a part of it as a recording of its own.
pub fn record(bytes: &[u8]) {
    let recording = Recording::of_bytes(bytes.to_vec());
    for at in 0..recording.count() {
        let _ = (recording.base_of(at), recording.read(at));
    }
    let mut cut = Vec::new();
    let _ = recording.cut(0..recording.count(), &mut cut);
    assert!(Recording::of_bytes(cut).count() <= recording.count());
    // A section that can be read can also be written, and is then read as the same section.
    if let Some(section) = SectionBody::read(bytes) {
        assert_eq!(SectionBody::read(&section.write()), Some(section));
    }
}

/// The program of a recording, before packing: its names are for one line, and it can be written
/// and read again.
pub fn recorded_program(bytes: &[u8]) {
    let Some(program) = read_program(&stored(bytes)) else { return };
    let RecordedProgram { version, source, hash, files, .. } = &program;
    let names = files.iter().map(|file| &file.name).chain([version, source, hash]);
    for name in names {
        assert!(!name.chars().any(char::is_control), "{name:?}");
    }
    let segment = SegmentStart::new(&program).bytes;
    assert_eq!(read_program(&segment[32..]), Some(program));
}

/// Bytes as a zlib stream without compression.
fn stored(bytes: &[u8]) -> Vec<u8> {
    let mut stream = vec![0x78, 0x01];
    for chunk in bytes.chunks(0xFFFF) {
        let length = chunk.len() as u16;
        stream.push(0);
        stream.extend(length.to_le_bytes());
        stream.extend((!length).to_le_bytes());
        stream.extend(chunk);
    }
    stream.extend([1, 0, 0, 0xFF, 0xFF]);
    let (mut low, mut high) = (1_u32, 0_u32);
    for byte in bytes {
        low = (low + u32::from(*byte)) % 65_521;
        high = (high + low) % 65_521;
    }
    stream.extend((high << 16 | low).to_be_bytes());
    stream
}

/// The messages of a hostile broker to `rungd fleet`. Each consists of a byte for topic and flags,
/// two bytes for the length, and the payload.
pub fn sparkplug(mut bytes: &[u8]) {
    let limits =
        FleetLimits { nodes_max: 3, metrics_max: 50, bytes_max: 20_000, ..Default::default() };
    let mut view = FleetView::new(limits, None);
    let mut now_ms = 1_000_000;
    while let [head, low, high, rest @ ..] = bytes {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
        let (payload, rest) = rest.split_at(length);
        bytes = rest;
        let raw = String::from_utf8_lossy(payload).into_owned();
        let topic = match head & 7 {
            0 => "spBv1.0/g/NBIRTH/n",
            1 => "spBv1.0/g/NDATA/n",
            2 => "spBv1.0/g/NDEATH/n",
            3 => "spBv1.0/g/DDATA/n/d",
            4 => "spBv1.0/g/NBIRTH/m",
            5 => "spBv1.0/g/NDATA/m",
            6 => "spBv1.0/STATE/h",
            _ => &raw,
        };
        let message = ReceivedMessage { topic, payload, is_retained: head & 8 != 0 };
        let _ = view.hear(message, now_ms);
        if head & 16 != 0 {
            now_ms += 7_000;
            let _ = view.wants_birth(now_ms);
        }
        if head & 32 != 0 {
            let _ = view.lose_link(now_ms);
        }
    }
    let _ = serde_json::to_string(&view.report(now_ms)).expect("a report is JSON");
}

/// A storage device in memory.
struct Disk(Vec<u8>);

impl Storage for Disk {
    fn size(&mut self) -> io::Result<u64> {
        Ok(self.0.len() as u64)
    }

    fn read_at(&mut self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        let from = self.0.get(at.min(self.0.len() as u64) as usize..).unwrap_or(&[]);
        let count = from.len().min(into.len());
        into[..count].copy_from_slice(&from[..count]);
        Ok(count)
    }

    fn write_at(&mut self, _at: u64, _from: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::ReadOnlyFilesystem.into())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn settle(&mut self) {}

    fn reopen(&mut self) -> io::Result<()> {
        Ok(())
    }
}
