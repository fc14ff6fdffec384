//! The role of a cell in an operation: read, written, or the program's own.
//!
//! An operation names each of its cells by a type that tells the role. From these types follow the
//! cells that the scheduler must keep in order ([`Touches`]), and what the operation may do with a
//! cell in its `run`. A field whose type has no role does not compile.

use super::power::Powers;

/// What an operation reads and writes, by cell: what the scheduler must keep in order.
#[derive(Clone, Debug, Default)]
pub struct Touches {
    /// Bits read.
    pub bits_read: Vec<u32>,
    /// Bits written, always or sometimes; they may be read too.
    pub bits_written: Vec<u32>,
    /// Words read.
    pub words_read: Vec<u32>,
    /// Words written, always or sometimes; they may be read too.
    pub words_written: Vec<u32>,
}

impl Touches {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.bits_read.clear();
        self.bits_written.clear();
        self.words_read.clear();
        self.words_written.clear();
    }
}

/// What a field of an operation reads and writes.
pub(super) trait Role {
    /// Adds its cells.
    fn touches(&self, t: &mut Touches);
}

/// A bit that an operation may read.
pub(super) trait BitRole: Copy {
    /// Its cell.
    fn number(self) -> u32;
}

/// A word that an operation may read.
pub(super) trait WordRole: Copy {
    /// Its cell.
    fn number(self) -> u32;
}

macro_rules! roles {
    ($($(#[$doc:meta])* $role:ident $readable:ident $list:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $role(pub u32);

        impl Role for $role {
            fn touches(&self, t: &mut Touches) {
                t.$list.push(self.0);
            }
        }

        impl $readable for $role {
            #[inline(always)]
            fn number(self) -> u32 {
                self.0
            }
        }
    )*};
}

roles! {
    /// A bit that is read.
    BitRead BitRole bits_read;
    /// A bit that is written; a force holds it.
    BitWritten BitRole bits_written;
    /// A bit of the program's own that is written: a power or an edge history, never forced.
    BitOwn BitRole bits_written;
    /// A word that is read.
    WordRead WordRole words_read;
    /// A word that is written; a force holds it.
    WordWritten WordRole words_written;
}

impl<const N: usize> Role for Powers<N> {
    fn touches(&self, t: &mut Touches) {
        t.bits_read.extend(self.cells);
    }
}

impl<R: Role> Role for Option<R> {
    fn touches(&self, t: &mut Touches) {
        if let Some(role) = self {
            role.touches(t);
        }
    }
}
