//! What each key of a ladder file and a controller file means, in a sentence: for `rungd schema`,
//! and so for the editors that read it.
//!
//! Which keys there are, and of which type, the readers themselves tell ([`super::shape`]). A test
//! fails where a key has no row here, and where a row has no key.

/// A key's meaning.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The table it stands in, as the reader calls it.
    pub place: &'static str,
    /// The key; `*` for any name.
    pub key: &'static str,
    /// What it means.
    pub doc: &'static str,
    /// What can stand there, as JSON Schema, beyond its type. `false`: nothing, it is refused.
    pub more: &'static str,
}

const fn key(place: &'static str, key: &'static str, doc: &'static str) -> Key {
    Key { place, key, doc, more: "" }
}

const fn limited(mut row: Key, more: &'static str) -> Key {
    row.more = more;
    row
}

/// A name of a tag or block; the grammar in `docs/language.md`.
const TAG_NAME: &str = r#"{"propertyNames":{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}}"#;
const BLOCK_NAME: &str = r#"{"pattern":"^[A-Za-z][A-Za-z0-9_-]*$"}"#;
const PART_NAME: &str = r#"{"pattern":"^[A-Za-z][A-Za-z0-9_]*$"}"#;
const FAULT_NAME: &str = r#"{"pattern":"^[a-z][A-Za-z0-9_]*$"}"#;
const DEVICE_NAMES: &str = r#"{"items":{"pattern":"^[A-Za-z][A-Za-z0-9_-]*$"}}"#;
const RUNG_NAME: &str = r#"{"pattern":"^[a-z0-9]+(-[a-z0-9]+)*$"}"#;
const LEGS: &str = r#"{"minProperties":1,"propertyNames":{"enum":["up","dn","rst","en"]}}"#;
const NOT_EMPTY: &str = r#"{"minItems":1}"#;
const LEAST_1MS: &str = r#"{"not":{"const":"0ms"}}"#;

const RUNG: &str = "a rung";
const STAGE: &str = "a stage";
const PROGRAM: &str = "a program";
const TASK: &str = "a task";
const TAG: &str = "a tag";
const FILE: &str = "the file";

/// The keys of a ladder file.
pub const LADDER: &[Key] = &[
    key(FILE, "ladder", "What the file is."),
    limited(key(FILE, "tags", "Nicknames for addresses, and named constants."), TAG_NAME),
    key(FILE, "program", "Programs, scanned in file order; `Main` always runs."),
    key(FILE, "task", "Tasks, scanned behind the programs while ENTASK says so."),
    key("`[ladder]`", "name", "Shown in the log; else the file's name."),
    key("`[ladder]`", "doc", "What the program is for."),
    key("`[ladder]`", "order", "The scan order: every Program and Task once."),
    key("`[ladder]`", "allow", "Names of warnings that are silenced in this file."),
    limited(
        key("`[ladder]`", "devices", "Names of field devices that a controller file has."),
        DEVICE_NAMES,
    ),
    key("`[tags]`", "*", "A tag: an address with a name (`at`), or a constant with one (`value`)."),
    key(TAG, "at", "The address: `X0`, `D1`, `CT0`, `CT0.Acc`."),
    key(TAG, "value", "A constant: a number, or a duration as `\"2s500ms\"`."),
    key(TAG, "doc", "What it is."),
    key(TAG, "initial", "What a cold start puts there; else 0, OFF."),
    key(TAG, "min", "A write from outside below this is refused; the ladder's stops at it."),
    key(TAG, "max", "A write from outside above this is refused; the ladder's stops at it."),
    key(TAG, "alarm", "A text: a warning in the log when the bit goes ON."),
    limited(key(TAG, "log", "Each change is logged."), r#"{"const":"change"}"#),
    key(TAG, "spare", "Unused on purpose: no warning."),
    limited(key(PROGRAM, "name", "Its name."), BLOCK_NAME),
    key(PROGRAM, "doc", "What it does."),
    key(PROGRAM, "autostart", "Runs from the first scan on."),
    key(PROGRAM, "rung", "Its own rungs, before its stages in every scan."),
    key(PROGRAM, "stage", "Its stages; the first is the initial one."),
    limited(key(TASK, "name", "Its name."), BLOCK_NAME),
    key(TASK, "doc", "What it does."),
    key(TASK, "rung", "Its rungs."),
    limited(key(TASK, "stage", "A task contains no stages."), "false"),
    limited(key(STAGE, "name", "Its name, unique in its program."), BLOCK_NAME),
    key(STAGE, "doc", "What it does."),
    key(STAGE, "rung", "Its rungs, executed while the stage is ON."),
    limited(key(RUNG, "name", "A name in kebab-case, unique in its block."), RUNG_NAME),
    key(RUNG, "doc", "Why the rung is there."),
    key(RUNG, "allow", "Names of warnings that are silenced here."),
    limited(key(RUNG, "when", "Contacts in series; `|` is a parallel branch."), NOT_EMPTY),
    limited(key(RUNG, "leg", "The legs of an instruction that has several."), LEGS),
    key(RUNG, "do", "Instructions, executed in order with the rung's power."),
    key(RUNG, "branch", "Further contacts behind the rung's own, with instructions."),
    limited(key("`leg`", "*", "The contacts of this leg, in series."), NOT_EMPTY),
    limited(key("a branch", "when", "Contacts in series behind the rung's own."), NOT_EMPTY),
    limited(key("a branch", "do", "Instructions, executed in order."), NOT_EMPTY),
];

const SCAN: &str = "`[scan]`";
const REALTIME: &str = "`[realtime]`";
const MODBUS: &str = "`[modbus-server]`";
const ENTRY: &str = "an entry of the Modbus map";
const WRITES: &str = "a list of writes";
const DEVICE: &str = "a simulated device";
const FIELD: &str = "a device";
const MAP: &str = "a device's map";
const PART: &str = "a part";
const PLACES: &str = "the places of a part";
const FAULT: &str = "a fault";
const OPERATOR: &str = "`[operator]`";
const MEMORY: &str = "`[memory]`";

/// The keys of a controller file.
pub const CONTROLLER: &[Key] = &[
    limited(
        key(FILE, "ladder", "The ladder files, relative to this file: one program."),
        NOT_EMPTY,
    ),
    key(FILE, "order", "The scan order of all Programs and Tasks of all ladder files."),
    key(FILE, "memory", "How many elements each space of memory has."),
    key(FILE, "scan", "How often, and how long at most."),
    key(FILE, "realtime", "What is asked of the operating system."),
    key(FILE, "outputs", "The safe values of outputs, in STOP and FAULT; OFF where not said."),
    key(FILE, "retain", "What a restart keeps."),
    key(FILE, "modbus-server", "A Modbus TCP server; none where this is absent."),
    key(FILE, "simulated-device", "Inputs that move by themselves, instead of a plant."),
    key(FILE, "device", "Field devices: remote I/O, local lines, a simulated plant."),
    key(FILE, "operator", "The socket by which operators ask and command."),
    key(FILE, "reload", "How a reload goes."),
    key(FILE, "log", "What the log tells by itself."),
    key(MEMORY, "X", "Inputs."),
    key(MEMORY, "Y", "Outputs."),
    key(MEMORY, "C", "Control relays."),
    key(MEMORY, "MC", "Modbus coils."),
    key(MEMORY, "MI", "Modbus discrete inputs."),
    key(MEMORY, "V", "Words, unsigned, 16 bits."),
    key(MEMORY, "D", "Words, signed, 32 bits."),
    key(MEMORY, "MHR", "Modbus holding registers."),
    key(MEMORY, "MIR", "Modbus input registers."),
    key(MEMORY, "CT", "Counters."),
    key(MEMORY, "T", "Timers."),
    limited(key(FIELD, "name", "Its name: `NAME.Ok` and `NAME.Stale` are its bits."), BLOCK_NAME),
    limited(
        key(FIELD, "driver", "How it is reached."),
        r#"{"enum":["modbus-tcp","modbus-rtu","gpio","simulated"]}"#,
    ),
    limited(key(FIELD, "poll", "From exchange to exchange; 20ms if not given."), LEAST_1MS),
    limited(
        key(FIELD, "on-loss", "What becomes of its inputs when it is lost; `hold` if not given."),
        r#"{"enum":["hold","zero"]}"#,
    ),
    limited(
        key(FIELD, "loss-after", "So old may its last good exchange be; 1s if not given."),
        LEAST_1MS,
    ),
    key(FIELD, "map", "Which of its points goes with which bit or word."),
    key(MAP, "from", "Where the values come from: points of the device, or bits and words."),
    key(MAP, "to", "Where they go."),
    key(MAP, "safe", "What an output that is no Y is in STOP and FAULT; 0 if not given."),
    key(MAP, "hold", "An output that is no Y stays in STOP and FAULT as it was."),
    key(FIELD, "address", "`modbus-tcp`: its IP address and port; port 502 if not given."),
    limited(
        key(
            FIELD,
            "connect-timeout",
            "`modbus-tcp`: a connection is made by then; 1s if not given.",
        ),
        LEAST_1MS,
    ),
    key(FIELD, "port", "`modbus-rtu`: the character device of its serial line."),
    key(FIELD, "baud", "`modbus-rtu`: bits a second; 19200 if not given."),
    limited(
        key(FIELD, "parity", "`modbus-rtu`: its parity bit; `even` if not given."),
        r#"{"enum":["none","even","odd"]}"#,
    ),
    key(FIELD, "stop-bits", "`modbus-rtu`: 1 if not given, without parity 2."),
    key(FIELD, "echo", "`modbus-rtu`: its adapter sends requests back; false if not given."),
    key(FIELD, "unit", "Modbus: the unit of rows that name none; 1 if not given."),
    limited(
        key(FIELD, "timeout", "Modbus: an answer is whole by then; 200ms if not given."),
        LEAST_1MS,
    ),
    key(
        FIELD,
        "write-every",
        "Modbus: all outputs are written so often; 1s if not given; 0ms: never.",
    ),
    limited(
        key(FIELD, "writes", "Modbus: functions 5 and 6, 15 and 16, or which fits."),
        r#"{"enum":["fitting","single","multiple"]}"#,
    ),
    key(
        FIELD,
        "gap",
        "Modbus: registers between two points that are read with them; 0 if not given.",
    ),
    key(FIELD, "watchdog", "Modbus: a holding register to which a counter is written."),
    key("a watchdog", "register", "Its protocol address, from 0."),
    limited(key("a watchdog", "every", "How often it is fed; 500ms if not given."), LEAST_1MS),
    key("a watchdog", "unit", "Its unit; else the device's."),
    key(MAP, "unit", "Modbus: whose points; else the device's."),
    limited(
        key(MAP, "type", "Modbus: what the bits of a register, or two, are; `u16` if not given."),
        r#"{"enum":["u16","i16","u32","i32","f32"]}"#,
    ),
    limited(
        key(MAP, "word-order", "Modbus: which of two registers has the higher 16 bits."),
        r#"{"enum":["high-first","low-first"]}"#,
    ),
    limited(
        key(MAP, "multiply", "Modbus: the number is multiplied by it."),
        r#"{"not":{"const":0}}"#,
    ),
    key(MAP, "divide", "Modbus: then divided by it."),
    key(MAP, "offset", "Modbus: then this is added: what memory has."),
    key(FIELD, "part", "`simulated`: the parts of its plant."),
    key(FIELD, "fault", "`simulated`: what goes wrong, on demand."),
    key(FIELD, "seed", "`simulated`: another number, another noise; 1 if not given."),
    limited(key(PART, "name", "Its name: `NAME.point` is one of its points."), PART_NAME),
    limited(
        key(PART, "kind", "What it is."),
        r#"{"enum":["delay","motor","conveyor","tank","sensor","pulse"]}"#,
    ),
    key(PART, "in", "A delay's: the point of the plant that it follows, if no row of the map is."),
    key(PART, "of", "A sensor's: the point of the plant that it measures."),
    key(PART, "run", "The point of the plant by which it runs."),
    key(PART, "trip", "A motor's: the point of the plant by which it trips."),
    key(PART, "reset", "A motor's: the point of the plant by which it is reset."),
    key(PART, "feed", "A conveyor's: the point of the plant by which a part is laid on."),
    key(PART, "jam", "A conveyor's: the point of the plant by which its parts stand."),
    key(PART, "fill", "A tank's: the point of the plant that opens its inlet."),
    key(PART, "drain", "A tank's: the point of the plant that opens its outlet."),
    key(PART, "after", "So long it must be told to be ON before it is."),
    key(PART, "release", "So long it must be told to be OFF before it is; else as `after`."),
    key(PART, "pulse", "How long a pulse is ON."),
    key(PART, "every", "From pulse to pulse; from one part on the belt to the next."),
    key(PART, "offset", "When the first pulse begins."),
    key(PART, "length", "A conveyor's, in mm."),
    key(PART, "speed", "A conveyor's, in mm/s."),
    key(PART, "part-length", "Of the parts on a conveyor, in mm; 100 if not given."),
    key(PART, "eyes", "A conveyor's eyes: names, and where they look, in mm."),
    key(PART, "capacity", "What a tank holds."),
    key(PART, "fill-rate", "What comes in each second while the inlet is open."),
    key(PART, "drain-rate", "What goes out each second while the outlet is open."),
    key(PART, "initial", "What is in the tank at the start."),
    key(PART, "switches", "A tank's switches: names, and the levels from which they are ON."),
    key(PART, "on-at", "A sensor is ON from this value; 1 if not given."),
    key(PART, "off-at", "It is OFF below this value; else as `on-at`."),
    key(PART, "range", "What a sensor measures, from and to."),
    key(PART, "raw", "What it tells of that, from and to."),
    key(PART, "invert", "ON where it would be OFF."),
    key(PLACES, "*", "Where it is."),
    limited(key(FAULT, "name", "Its name: `fault.NAME` brings it about."), FAULT_NAME),
    key(FAULT, "point", "The point of the plant that it falsifies."),
    limited(
        key(FAULT, "kind", "What it does."),
        r#"{"enum":["stuck-on","stuck-off","stuck","noisy","late","lost"]}"#,
    ),
    key(FAULT, "when", "The point of the plant that brings it about."),
    key(FAULT, "value", "What a stuck point is; else what it was."),
    key(FAULT, "every", "How often noise is another; 20ms if not given."),
    key(FAULT, "amplitude", "By how much a number is off, at most."),
    key(FAULT, "by", "By how long a point is late."),
    key(FIELD, "chip", "`gpio`: its character device, or `label:` and what the chip calls itself."),
    key(FIELD, "budget-us", "`gpio`: so long may an exchange take; 200 if not given."),
    key(MAP, "active-low", "`gpio`: ON is a low level."),
    key(MAP, "debounce", "`gpio`: a level lasts so long before it counts; at most 10s."),
    limited(
        key(MAP, "bias", "`gpio`: what holds the line where nothing drives it."),
        r#"{"enum":["pull-up","pull-down","disabled"]}"#,
    ),
    limited(
        key(MAP, "drive", "`gpio`: how an output drives its line; `push-pull` if not given."),
        r#"{"enum":["push-pull","open-drain","open-source"]}"#,
    ),
    limited(key(SCAN, "period", "From one scan to the next; 10ms if not given."), LEAST_1MS),
    limited(
        key(SCAN, "watchdog", "A scan longer than this is a fault; 200ms if not given."),
        LEAST_1MS,
    ),
    limited(
        key(REALTIME, "policy", "How the scan thread is scheduled; `other` if not given."),
        r#"{"enum":["fifo","rr","other"]}"#,
    ),
    key(REALTIME, "priority", "Of policy `fifo` or `rr`."),
    limited(key(REALTIME, "cpus", "Where the scan thread may run."), NOT_EMPTY),
    key(REALTIME, "lock-memory", "All memory stays in RAM."),
    limited(
        key(REALTIME, "cpu-latency", "How long an idle CPU may take to wake up: `0us`, `1ms`."),
        r#"{"pattern":"^[0-9]+(us|ms)$"}"#,
    ),
    key(REALTIME, "strict", "Do not start if any of these is not granted."),
    key("`[outputs]`", "on", "Outputs that are ON in the safe state."),
    key("`[outputs]`", "hold", "Outputs that keep their value."),
    key("`[retain]`", "ranges", "Data and structures: `CT8..CT15`, `D100..D199`."),
    key(
        "`[retain]`",
        "file",
        "Where they are kept; else where systemd keeps state, or beside this file.",
    ),
    limited(
        key(
            "`[retain]`",
            "interval",
            "They are written when changed, at most so often; 1s if not given.",
        ),
        LEAST_1MS,
    ),
    limited(
        key(
            "`[retain]`",
            "cold-start",
            "Whether to run where nothing was found; `stop` if not given.",
        ),
        r#"{"enum":["run","stop"]}"#,
    ),
    key(
        "`[retain]`",
        "budget-mb-per-day",
        "More written than this is a warning; 2000 if not given.",
    ),
    key(MODBUS, "listen", "Address and port; 127.0.0.1:1502 if not given."),
    key(MODBUS, "units", "The unit identifiers that are answered; all if not given."),
    key(MODBUS, "standard-map", "MC, MI, MHR and MIR have their places; true if not given."),
    key(MODBUS, "writable", "What every client may write: ranges; else nothing."),
    key(MODBUS, "write", "What some clients may write."),
    key(MODBUS, "map", "Further places for any bits and words."),
    key(MODBUS, "connections", "How many at a time; 8 if not given."),
    key(MODBUS, "frame-timeout", "A request that begins must be whole by then."),
    key(MODBUS, "idle-timeout", "A connection without requests ends then."),
    key(MODBUS, "image", "Inputs and outputs that clients see."),
    key("`[modbus-server.image]`", "inputs", "Coils copied to inputs."),
    key("`[modbus-server.image]`", "outputs", "Outputs copied to discrete inputs."),
    limited(key(WRITES, "ranges", "What they may write."), NOT_EMPTY),
    limited(key(WRITES, "clients", "Who: `10.0.0.5`, `192.168.1.0/24`, `fd00::/8`."), NOT_EMPTY),
    key(ENTRY, "operand", "A bit or word, or a range of them: `CT0.Acc`, `X0..X15`, a tag."),
    limited(
        key(ENTRY, "table", "Of bits `coil` or `discrete`, of words `holding` or `input`."),
        r#"{"enum":["coil","discrete","holding","input"]}"#,
    ),
    key(ENTRY, "address", "The protocol address of the first element, counted from 0."),
    limited(
        key(ENTRY, "type", "Of words: 16 bits are one register, 32 two; else what fits."),
        r#"{"enum":["u16","i16","u32","i32"]}"#,
    ),
    limited(
        key(ENTRY, "word-order", "Of 32 bits: which half comes first; `high-first` if not given."),
        r#"{"enum":["high-first","low-first"]}"#,
    ),
    key(ENTRY, "unit", "It is there for this unit identifier alone."),
    key("`inputs`", "from", "A range of MC."),
    key("`inputs`", "to", "A range of X, equally long."),
    key("`outputs`", "from", "A range of Y."),
    key("`outputs`", "to", "A range of MI, equally long."),
    key(DEVICE, "input", "The input that moves: an X, or a tag of one."),
    key(DEVICE, "pulse", "How long it is ON in each `every`."),
    key(DEVICE, "every", "How often it pulses."),
    key(DEVICE, "offset", "When the first pulse begins."),
    key(DEVICE, "follows", "The bit that it follows."),
    key(DEVICE, "after", "How long that bit is ON before the input is."),
    key(DEVICE, "release", "How long that bit is OFF before the input is; else as `after`."),
    key(DEVICE, "while", "It moves only while this bit is ON."),
    key(DEVICE, "invert", "ON where the rule says OFF."),
    key(OPERATOR, "enabled", "Whether there is a socket; true if not given."),
    key(OPERATOR, "socket", "Its path, relative to this file; else where systemd wants it."),
    limited(
        key(OPERATOR, "mode", "Its permissions in octal digits; 0660 if not given."),
        r#"{"pattern":"^(0o)?0?[0-7]{3}$"}"#,
    ),
    key(OPERATOR, "group", "Its group, by name or number: its members may change things."),
    key(
        "`[reload]`",
        "probation",
        "A program that faults within this time after its reload is taken back; 0ms: never.",
    ),
    key("`[log]`", "statistics", "How often scan statistics are logged; 0ms: never."),
];

/// What holds for a whole table, beyond its keys, as JSON Schema: its place, and the schema.
pub const TOGETHER: &[(&str, &str)] = &[
    (TAG, r#"{"oneOf":[{"required":["at"]},{"required":["value"]}]}"#),
    (
        RUNG,
        r#"{"oneOf":[{"required":["when"]},{"required":["leg"]}],
            "anyOf":[{"required":["do"]},{"required":["branch"]}]}"#,
    ),
    ("a branch", r#"{"required":["when","do"]}"#),
    (
        DEVICE,
        r#"{"oneOf":[
            {"required":["pulse","every"],
             "not":{"anyOf":[{"required":["after"]},{"required":["release"]}]}},
            {"required":["follows"],
             "not":{"anyOf":[{"required":["pulse"]},{"required":["every"]},
                             {"required":["offset"]}]}}]}"#,
    ),
];
