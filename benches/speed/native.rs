//! The native side: compiles the straight-line Rust, loads it, runs it.
//!
//! The only part of the benchmark with `unsafe`: it calls the compiled code and the system's clock.
//! Compiled libraries stay in the target directory, named by a hash of their source.

use std::ffi::{CStr, CString, c_void};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::process::Command;
use std::{fs, mem};

use anyhow::{Context, bail};

use super::straight;
use super::workload::{INPUTS, Outside, WORDS, Workload};

/// Straight-line code and its memory.
pub struct Native {
    scan: extern "C" fn(*mut u8, i32),
    /// Stored as words for the alignment; begins with inputs, data words and coils.
    memory: Vec<u64>,
    coils: usize,
}

impl Native {
    pub fn new(workload: &Workload) -> anyhow::Result<Native> {
        let library = Library::open(&compile(&straight::source(workload))?)?;
        // SAFETY: these are the signatures that `straight` writes; a reference to `M` is a
        // pointer to it.
        let (size, start, scan) = unsafe {
            (
                mem::transmute::<*mut c_void, extern "C" fn() -> usize>(library.symbol(c"size")?),
                mem::transmute::<*mut c_void, extern "C" fn(*mut u8)>(library.symbol(c"start")?),
                mem::transmute::<*mut c_void, extern "C" fn(*mut u8, i32)>(
                    library.symbol(c"scan")?,
                ),
            )
        };
        let mut memory = vec![0u64; size().div_ceil(8)];
        start(memory.as_mut_ptr().cast());
        Ok(Native { scan, memory, coils: workload.coils() })
    }

    pub fn outside(&mut self, outside: &Outside) {
        for x in &outside.toggles {
            self.bytes_mut()[usize::from(*x)] ^= 1;
        }
        for (word, value) in &outside.writes {
            let at = INPUTS as usize + 4 * usize::from(*word);
            self.bytes_mut()[at..at + 4].copy_from_slice(&value.to_ne_bytes());
        }
    }

    /// One scan, 1 ms after the previous one.
    #[inline]
    pub fn scan(&mut self) {
        (self.scan)(self.memory.as_mut_ptr().cast(), 1);
    }

    pub fn coils(&self) -> &[u8] {
        let first = (INPUTS + 4 * WORDS) as usize;
        // SAFETY: all of the vector's bytes are initialised, and a byte may have any value.
        let bytes = unsafe {
            std::slice::from_raw_parts(self.memory.as_ptr().cast::<u8>(), self.memory.len() * 8)
        };
        &bytes[first..first + self.coils]
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        let length = self.memory.len() * 8;
        // SAFETY: as above, and any bytes make whole words.
        unsafe { std::slice::from_raw_parts_mut(self.memory.as_mut_ptr().cast(), length) }
    }
}

/// Straight-line formulas over words.
pub struct Formulas {
    scan: extern "C" fn(*mut Calculated),
    memory: Box<Calculated>,
    words: Vec<i32>,
}

/// The memory of formulas, as their source declares it.
#[repr(C)]
struct Calculated {
    d: *mut i32,
    x: [u8; 256],
    /// The status bits of mishaps.
    st: [u8; 4],
    /// The first statements with a mishap in a scan, and, in `tell`, the number of all such
    /// statements.
    told: [(u32, u8); 16],
    tell: u32,
}

impl Formulas {
    /// Compiles `statements`, which use the functions of `formulas.rs`. All contacts are ON.
    pub fn new(statements: &str, words: usize) -> anyhow::Result<Formulas> {
        let source = include_str!("formulas.rs").replace("STATEMENTS", statements);
        let library = Library::open(&compile(&source)?)?;
        // SAFETY: the signature of `scan` in that file.
        let scan = unsafe {
            mem::transmute::<*mut c_void, extern "C" fn(*mut Calculated)>(library.symbol(c"scan")?)
        };
        let mut words = vec![0; words];
        let memory = Calculated {
            d: words.as_mut_ptr(),
            x: [1; 256],
            st: [0; 4],
            told: [(0, 0); 16],
            tell: 0,
        };
        Ok(Formulas { scan, memory: Box::new(memory), words })
    }

    #[inline]
    pub fn scan(&mut self) {
        self.memory.d = self.words.as_mut_ptr();
        (self.scan)(&raw mut *self.memory);
    }

    pub fn put_word(&mut self, at: usize, value: i32) {
        self.words[at] = value;
    }

    pub fn words(&self) -> &[i32] {
        &self.words
    }

    /// The status bits of mishaps.
    pub fn mishaps(&self) -> [u8; 4] {
        self.memory.st
    }
}

/// Compiles a library, unless it is compiled already; returns its path.
fn compile(source: &str) -> anyhow::Result<PathBuf> {
    let mut hasher = DefaultHasher::new();
    source.hash(&mut hasher);
    let folder = std::env::current_exe()?;
    let folder = folder.parent().context("the program has no folder")?;
    let path = folder.join(format!("straight_{:016x}.so", hasher.finish()));
    if path.exists() {
        return Ok(path);
    }
    let (source_path, fresh) = (path.with_extension("rs"), path.with_extension("new"));
    fs::write(&source_path, source).context("cannot write the straight-line source")?;
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let status = Command::new(rustc)
        .args(["--edition=2024", "--crate-type=cdylib", "--crate-name=straight"])
        .args(["-Copt-level=3", "-Ccodegen-units=16", "-Cpanic=abort", "-o"])
        .args([&fresh, &source_path])
        .status()
        .context("cannot run rustc; set RUSTC to its path")?;
    if !status.success() {
        bail!("rustc refused {}", source_path.display());
    }
    fs::rename(&fresh, &path)?;
    Ok(path)
}

/// A loaded library; never unloaded, since its code may be running.
struct Library(*mut c_void);

impl Library {
    fn open(path: &std::path::Path) -> anyhow::Result<Library> {
        let name = CString::new(path.as_os_str().as_encoded_bytes())?;
        // SAFETY: `name` ends with a NUL; the library has no constructors of its own.
        let handle = unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_NOW) };
        if handle.is_null() {
            bail!("cannot load {}", path.display());
        }
        Ok(Library(handle))
    }

    fn symbol(&self, name: &CStr) -> anyhow::Result<*mut c_void> {
        // SAFETY: the handle is open, and `name` ends with a NUL.
        let symbol = unsafe { libc::dlsym(self.0, name.as_ptr()) };
        if symbol.is_null() {
            bail!("no {name:?} in the straight-line library");
        }
        Ok(symbol)
    }
}

/// Processor time of this thread, in seconds.
pub fn thread_time_s() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a timespec to write to; this clock exists on every Linux.
    let result = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(result, 0, "no clock of the thread's processor time");
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
