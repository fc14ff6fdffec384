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
