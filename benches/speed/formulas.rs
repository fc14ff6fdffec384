//! The native side of MATH: straight-line statements over a memory, compiled by `native.rs`.
//! The arithmetic is that of `docs/semantics.md`, section 8.
#![allow(dead_code, unused_macros)]

#[repr(C)]
pub struct Memory {
    d: *mut i32,
    x: [u8; 256],
    st: [u8; 4],
    told: [(u32, u8); 16],
    tell: u32,
}

/// The mishaps of a formula: a bit each.
struct Mishaps(u8);

const DIVIDE: u8 = 1;
const OVERFLOW: u8 = 2;

#[inline(always)]
fn limited(result: Option<i64>, below: bool, m: &mut Mishaps) -> i64 {
    let Some(value) = result else {
        m.0 |= OVERFLOW;
        return limit(below);
    };
    value
}

// Kept out of line, as in the engine.
#[cold]
#[inline(never)]
fn limit(below: bool) -> i64 {
    if below { i64::MIN } else { i64::MAX }
}

#[cold]
#[inline(never)]
fn largest(infinity: f64) -> f64 {
    f64::MAX.copysign(infinity)
}

#[inline(always)]
fn add(a: i64, b: i64, m: &mut Mishaps) -> i64 {
    limited(a.checked_add(b), a < 0, m)
}

#[inline(always)]
fn sub(a: i64, b: i64, m: &mut Mishaps) -> i64 {
    limited(a.checked_sub(b), a < 0, m)
}

#[inline(always)]
fn mul(a: i64, b: i64, m: &mut Mishaps) -> i64 {
    limited(a.checked_mul(b), (a < 0) != (b < 0), m)
}

// A division by a constant becomes a multiplication.
#[inline(always)]
fn div(a: i64, b: i64, m: &mut Mishaps) -> i64 {
    if b == 0 {
        m.0 |= DIVIDE;
        return 0;
    }
    limited(a.checked_div(b), false, m)
}

#[inline(always)]
fn finite(value: f64, m: &mut Mishaps) -> f64 {
    if value.abs() > f64::MAX {
        m.0 |= OVERFLOW;
        return largest(value);
    }
    value
}

#[inline(always)]
fn radd(a: f64, b: f64, m: &mut Mishaps) -> f64 {
    finite(a + b, m)
}

#[inline(always)]
fn rsub(a: f64, b: f64, m: &mut Mishaps) -> f64 {
    finite(a - b, m)
}

// Adding 0 turns -0 into 0.
#[inline(always)]
fn rmul(a: f64, b: f64, m: &mut Mishaps) -> f64 {
    finite(a * b, m) + 0.0
}

#[inline(always)]
fn rdiv(a: f64, b: f64, m: &mut Mishaps) -> f64 {
    if b == 0.0 {
        m.0 |= DIVIDE;
        return 0.0;
    }
    finite(a / b, m) + 0.0
}

#[inline(always)]
fn put(value: i64, m: &mut Mishaps) -> i32 {
    let limited = value.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
    if limited != value {
        m.0 |= OVERFLOW;
    }
    limited as i32
}

#[inline(always)]
fn put_real(value: f64, m: &mut Mishaps) -> i32 {
    put(value as i64, m)
}

#[cold]
#[inline(never)]
fn tell(memory: &mut Memory, k: u32, mishaps: u8) {
    for (at, bit) in memory.st.iter_mut().enumerate() {
        *bit |= mishaps >> at & 1;
    }
    if let Some(told) = memory.told.get_mut(memory.tell as usize) {
        *told = (k, mishaps);
    }
    memory.tell += 1;
}

macro_rules! d {
    ($memory:ident $at:literal) => {
        i64::from(unsafe { *$memory.d.add($at) })
    };
}

macro_rules! r {
    ($memory:ident $at:literal) => {
        f64::from(unsafe { *$memory.d.add($at) })
    };
}

macro_rules! math {
    ($memory:ident $m:ident $k:literal $x:literal $to:literal $value:expr) => {
        if $memory.x[$x] != 0 {
            let $m = &mut Mishaps(0);
            let value = $value;
            unsafe { *$memory.d.add($to) = value };
            if $m.0 != 0 {
                tell($memory, $k, $m.0);
            }
        }
    };
}

#[unsafe(no_mangle)]
pub extern "C" fn scan(memory: &mut Memory) {
    memory.st = [0; 4];
    memory.tell = 0;
    STATEMENTS
}
