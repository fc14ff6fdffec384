//! The settings of the `gpio` driver: a chip, and its lines. Made by `controller` from a controller
//! file. They contain no places in the file, because those change with every edit.

/// The settings of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct GpioSettings {
    /// The chip.
    pub chip: ChipId,
    /// The longest time an exchange may take, µs.
    pub budget_us: u32,
    /// Lines that are read.
    pub inputs: Vec<GpioLine>,
    /// Lines that are driven.
    pub outputs: Vec<GpioLine>,
}

/// A chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ChipId {
    /// Its character device.
    Path(String),
    /// Its label, which stays the same when its number changes with a boot.
    Label(String),
}

/// A line with its setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GpioLine {
    /// The line's name or number.
    pub at: LineId,
    /// The setting to request it with.
    pub setting: LineSetting,
}

/// The name or number of a chip's line.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum LineId {
    /// By its number.
    Offset(u32),
    /// By its name in the chip.
    Name(String),
}

/// The setting of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineSetting {
    /// A low level is ON.
    pub active_low: bool,
    /// The resistor that holds it when nothing drives it.
    pub bias: Bias,
    /// How an output drives it.
    pub drive: LineDrive,
    /// The time for which an input's level has to last before it counts; 0: at once.
    pub debounce_ms: u32,
}

/// The resistor that holds a line when nothing drives it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Bias {
    #[default]
    AsIs,
    PullUp,
    PullDown,
    Disabled,
}

impl Bias {
    /// All values but the default, with their names.
    pub const NAMES: [(&'static str, Bias); 3] =
        [("pull-up", Bias::PullUp), ("pull-down", Bias::PullDown), ("disabled", Bias::Disabled)];
}

/// How an output drives its line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum LineDrive {
    #[default]
    PushPull,
    OpenDrain,
    OpenSource,
}

impl LineDrive {
    /// All values but the default, with their names.
    pub const NAMES: [(&'static str, LineDrive); 3] = [
        ("push-pull", LineDrive::PushPull),
        ("open-drain", LineDrive::OpenDrain),
        ("open-source", LineDrive::OpenSource),
    ];
}

impl std::fmt::Display for LineId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            LineId::Offset(offset) => write!(f, "line {offset}"),
            LineId::Name(name) => write!(f, "line {name}"),
        }
    }
}

impl std::fmt::Display for ChipId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ChipId::Path(path) => f.write_str(path),
            ChipId::Label(label) => write!(f, "the chip labelled {label}"),
        }
    }
}
