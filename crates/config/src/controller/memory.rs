//! `[memory]`: the number of elements of each space, of the controller or of a ladder beside it.

use rungd_engine::isa::MemorySizes;
use rungd_language::source::key::{Key, key};
use rungd_language::source::reader::Table;

/// Reads `[memory]` of a table.
pub(super) fn read_in(root: &mut Table<'_>) -> MemorySizes {
    let mut sizes = MemorySizes::default();
    let Some(mut table) =
        root.table(key("memory", "The number of elements of each space of memory."), "`[memory]`")
    else {
        return sizes;
    };
    // Modbus numbers its elements with 16 bits; the other spaces need no more.
    let blocks: [(Key, &mut u32); 12] = [
        (key("X", "Inputs."), &mut sizes.x),
        (key("Y", "Outputs."), &mut sizes.y),
        (key("C", "Control relays."), &mut sizes.c),
        (key("MC", "Modbus coils."), &mut sizes.mc),
        (key("MI", "Modbus discrete inputs."), &mut sizes.mi),
        (key("V", "Words, unsigned, 16 bits."), &mut sizes.v),
        (key("D", "Words, signed, 32 bits."), &mut sizes.d),
        (key("R", "Reals, 32 bits."), &mut sizes.r),
        (key("MHR", "Modbus holding registers."), &mut sizes.mhr),
        (key("MIR", "Modbus input registers."), &mut sizes.mir),
        (key("CT", "Counters."), &mut sizes.ct),
        (key("T", "Timers."), &mut sizes.t),
    ];
    for (key, size) in blocks {
        if let Some(count) = table.whole(key, 1..=65_536) {
            *size = count.value;
        }
    }
    table.finish();
    sizes
}
