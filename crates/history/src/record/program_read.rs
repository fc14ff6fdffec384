//! Reads the program of a segment from packed bytes: the inverse of `program`.
//!
//! The bytes may come from outside, and a few of them may unpack to any size. So they are unpacked
//! as a stream, and there are limits for one program and for all programs of a recording. Equal
//! texts of several programs are kept once. Names are printed in lines of a report: a character
//! that would act on a terminal or end a line becomes its escape (`\\u{a}`) here, for every reader.

use std::collections::BTreeSet;
use std::io::{self, BufReader, Read};
use std::sync::Arc;

use flate2::bufread::ZlibDecoder;

use super::program::{RecordedFile, RecordedProgram};
use rungd_base::byte_source::number_from;
use rungd_language::source::wording::escaped;

/// The maximum number of bytes of a program before packing, and of the different texts of all
/// programs of a recording.
pub(super) const PROGRAM_BYTES_MAX: usize = 1 << 28;

/// The maximum number of files of a program, and the bytes that each needs besides its text.
const FILES_MAX: u64 = 1 << 16;
const FILE_BYTES: usize = 128;

/// The maximum number of bytes of a name, a version, a hash.
const NAME_BYTES_MAX: u64 = 1 << 16;

/// The program in packed bytes, as the only one of a recording; `None`: they are not a program, or
/// it is larger than a limit.
pub fn read_program(packed: &[u8]) -> Option<RecordedProgram> {
    ProgramTexts::all().read(packed)
}

/// Which texts of programs are kept, and how many.
#[derive(Debug)]
pub(super) struct ProgramTexts {
    known: BTreeSet<Arc<str>>,
    /// The bytes that are still allowed.
    left: usize,
    /// Whether the texts of files are left out.
    only_names: bool,
}

impl ProgramTexts {
    /// All texts, within the limit of a recording.
    pub fn all() -> ProgramTexts {
        ProgramTexts { known: BTreeSet::new(), left: PROGRAM_BYTES_MAX, only_names: false }
    }

    /// Names only: enough for lists.
    pub fn names() -> ProgramTexts {
        ProgramTexts { only_names: true, ..ProgramTexts::all() }
    }

    /// Counts bytes that are kept; `None`: they are too many.
    fn take(&mut self, bytes: usize) -> Option<()> {
        self.left = self.left.checked_sub(bytes)?;
        Some(())
    }

    fn keep(&mut self, text: String) -> Option<Arc<str>> {
        if let Some(known) = self.known.get(&*text) {
            return Some(Arc::clone(known));
        }
        self.take(text.len())?;
        let text: Arc<str> = text.into();
        self.known.insert(Arc::clone(&text));
        Some(text)
    }

    /// Reads a program that fills all of the packed `bytes`; `None`: they are not a program, or it
    /// is larger than a limit.
    pub fn read(&mut self, bytes: &[u8]) -> Option<RecordedProgram> {
        let unpacked = ZlibDecoder::new(bytes).take(PROGRAM_BYTES_MAX as u64);
        let mut source = ProgramSource(BufReader::new(unpacked));
        let version = source.name()?;
        let process_start_ns = i64::from_le_bytes(source.bytes()?);
        let generation = source.number()?.try_into().ok()?;
        let (origin, hash) = (source.name()?, source.name()?);
        self.take(version.len() + origin.len() + hash.len())?;
        let count = source.number().filter(|count| *count <= FILES_MAX)?;
        let mut files = Vec::new();
        for _ in 0..count {
            let name = source.name()?;
            self.take(FILE_BYTES + name.len())?;
            let text = if self.only_names {
                source.skip()?;
                Arc::default()
            } else {
                let text = source.text(PROGRAM_BYTES_MAX as u64)?;
                self.keep(text)?
            };
            files.push(RecordedFile { name, text });
        }
        source.ends(bytes.len() as u64)?;
        let source = origin;
        Some(RecordedProgram { version, process_start_ns, generation, source, hash, files })
    }
}

/// Unpacked bytes as they come.
struct ProgramSource<'b>(BufReader<io::Take<ZlibDecoder<&'b [u8]>>>);

impl ProgramSource<'_> {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes).ok()?;
        Some(bytes)
    }

    fn number(&mut self) -> Option<u64> {
        number_from(|| self.bytes().map(|[byte]| byte))
    }

    /// A text of at most this many bytes, after its length.
    fn text(&mut self, most: u64) -> Option<String> {
        let count = self.number().filter(|count| *count <= most)?;
        let mut text = String::new();
        self.0.by_ref().take(count).read_to_string(&mut text).ok()?;
        (text.len() as u64 == count).then_some(text)
    }

    /// A text that is printed in a line. It can be written and read again: its escapes are within
    /// the limit too.
    fn name(&mut self) -> Option<String> {
        let name = self.text(NAME_BYTES_MAX).map(|name| escaped(&name).into_owned())?;
        (name.len() as u64 <= NAME_BYTES_MAX).then_some(name)
    }

    fn skip(&mut self) -> Option<()> {
        let count = self.number()?;
        let skipped = io::copy(&mut self.0.by_ref().take(count), &mut io::sink()).ok()?;
        (skipped == count).then_some(())
    }

    /// Whether nothing is left, neither unpacked nor packed.
    fn ends(mut self, packed: u64) -> Option<()> {
        let is_end = self.0.read(&mut [0]).ok()? == 0;
        let taken = self.0.into_inner().into_inner().total_in();
        (is_end && taken == packed).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::zip::packed;
    use rungd_base::byte_source::{put_number, put_text};

    fn program(count: u64, files: impl Iterator<Item = (String, String)>) -> Vec<u8> {
        let mut out = Vec::new();
        put_text(&mut out, "1.0");
        out.extend(7_i64.to_le_bytes());
        put_number(&mut out, 0);
        put_text(&mut out, "start");
        put_text(&mut out, "abc");
        put_number(&mut out, count);
        for (name, text) in files {
            put_text(&mut out, &name);
            put_text(&mut out, &text);
        }
        packed(&out)
    }

    #[test]
    fn a_program_of_millions_of_empty_files_is_refused() {
        let claimed = 134_000_000;
        assert!(ProgramTexts::all().read(&program(claimed, std::iter::empty())).is_none());
        let many = || (0..70_000).map(|_| (String::new(), String::new()));
        assert!(ProgramTexts::all().read(&program(70_000, many())).is_none());
        let fewer = many().take(60_000);
        assert_eq!(
            ProgramTexts::names().read(&program(60_000, fewer)).unwrap().files.len(),
            60_000
        );
    }

    #[test]
    fn the_programs_of_a_recording_share_one_size_limit_and_their_equal_texts() {
        let file = |at: u8| (format!("{at}.toml"), "x".repeat(1 << 20));
        let one = program(2, [file(1), file(2)].into_iter());
        let mut texts = ProgramTexts { left: (1 << 20) + 100_000, ..ProgramTexts::all() };
        for _ in 0..100 {
            let program = texts.read(&one).expect("equal texts count once");
            assert!(Arc::ptr_eq(&program.files[0].text, &program.files[1].text));
        }
        let other = program(1, [("a".to_owned(), "y".repeat(1 << 20))].into_iter());
        assert!(texts.read(&other).is_none(), "a second megabyte is above the limit");
        let mut names = ProgramTexts { left: 1000, ..ProgramTexts::names() };
        let read = names.read(&other).expect("texts are not kept");
        assert_eq!((&*read.files[0].name, &*read.files[0].text), ("a", ""));
    }

    #[test]
    fn control_characters_in_a_file_name_are_escaped() {
        let name = "x.toml\nall 10 hashes are equal\u{1b}[2K".to_owned();
        let read = ProgramTexts::all().read(&program(1, [(name, "a\nb".to_owned())].into_iter()));
        let read = read.unwrap();
        assert_eq!(read.files[0].name, "x.toml\\u{a}all 10 hashes are equal\\u{1b}[2K");
        assert_eq!(&*read.files[0].text, "a\nb");
    }

    #[test]
    fn a_program_with_missing_or_extra_bytes_is_refused() {
        let whole = program(0, std::iter::empty());
        assert!(ProgramTexts::all().read(&whole).is_some());
        assert!(ProgramTexts::all().read(&[&whole[..], &[0]].concat()).is_none());
        assert!(ProgramTexts::all().read(&whole[..whole.len() - 1]).is_none());
        let more = program(0, [(String::new(), String::new())].into_iter());
        assert!(ProgramTexts::all().read(&more).is_none());
    }
}
