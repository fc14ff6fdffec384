//! One file of `rungd fmt` or `rungd check --fix`: writes it so that no other program reads a
//! half-written file, and shows its first difference from the layout.
//!
//! Called by [`super::fmt`] and [`super::check`] for each file that changes.

use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt, fchown};
use std::path::Path;

use super::terminal::one_line;
use rungd_config::load::files::read_bytes;

/// The maximum number of lines of a difference that are shown from each text.
const SHOWN_LINES_MAX: usize = 8;

/// Replaces a file's text, if it still is `before`: writes a new file beside it, and renames it.
/// Mode and owner stay the same; a link stays a link. If the file has several names, or if the new
/// file cannot get its owner, the old file is overwritten. Until that is done, the new file keeps
/// the text.
///
/// # Errors
/// A file cannot be made in this folder, or cannot be written; the file has changed since it was
/// read.
pub(super) fn replace(path: &Path, before: &[u8], text: &str) -> io::Result<()> {
    let path = fs::canonicalize(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let fresh = path.with_file_name(format!(".{name}.{}.new", std::process::id()));
    let written = write_as(&path, &fresh, text);
    // The last step before the file is replaced: what a different program has written is kept.
    let judged = written.and_then(|is_like| unchanged(&path, before).map(|()| is_like));
    let is_like = match judged {
        Ok(is_like) => is_like,
        Err(error) => {
            let _ = fs::remove_file(&fresh);
            return Err(error);
        }
    };
    if is_like {
        return fs::rename(&fresh, &path);
    }
    write_within(&path, text).map_err(|error| {
        let words = format!("{error}; its new text is in {}", fresh.display());
        io::Error::new(error.kind(), words)
    })?;
    fs::remove_file(&fresh)
}

/// Refuses a file that is not as it was read.
fn unchanged(path: &Path, before: &[u8]) -> io::Result<()> {
    match read_bytes(path)? == before {
        true => Ok(()),
        false => Err(io::Error::other(
            "a different program has changed it meanwhile; nothing is written: \
             run the command again",
        )),
    }
}

/// Writes a text to a new file beside the old one. Returns true if the new file can replace it.
fn write_as(path: &Path, fresh: &Path, text: &str) -> io::Result<bool> {
    let about = fs::metadata(path)?;
    let mut file = OpenOptions::new().write(true).create_new(true).open(fresh)?;
    file.write_all(text.as_bytes())?;
    // The owner is set first, because a change of owner may clear bits of the mode.
    let is_owned = fchown(&file, Some(about.uid()), Some(about.gid())).is_ok();
    file.set_permissions(about.permissions())?;
    file.sync_all()?;
    Ok(is_owned && about.nlink() == 1)
}

/// Overwrites the file's text.
fn write_within(path: &Path, text: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).open(path)?;
    file.write_all(text.as_bytes())?;
    file.set_len(text.len() as u64)?;
    file.sync_all()
}

/// The first difference of two texts, with the name of their file and the number of the line.
pub(super) fn difference(name: &str, before: &str, after: &str) -> String {
    let before: Vec<&str> = before.split('\n').collect();
    let after: Vec<&str> = after.split('\n').collect();
    let same = before.iter().zip(&after).take_while(|(before, after)| before == after).count();
    let (before, after) = (&before[same..], &after[same..]);
    let (gone, come) = until_alike(before, after);
    let mut shown = format!("{}:{}:\n", one_line(name), same + 1);
    lines('-', &before[..gone], &mut shown);
    lines('+', &after[..come], &mut shown);
    shown
}

/// The number of lines of each text before the next two lines that are the same in both.
fn until_alike(before: &[&str], after: &[&str]) -> (usize, usize) {
    let alike = |(gone, come): (usize, usize)| {
        let rest = before.get(gone..).zip(after.get(come..));
        rest.is_some_and(|(before, after)| before.iter().take(2).eq(after.iter().take(2)))
    };
    let sums = 1..=2 * SHOWN_LINES_MAX;
    let mut both = sums.flat_map(|sum| (0..=sum).map(move |gone| (gone, sum - gone)));
    let all = (before.len().min(SHOWN_LINES_MAX + 1), after.len().min(SHOWN_LINES_MAX + 1));
    both.find(|both| alike(*both)).unwrap_or(all)
}

fn lines(mark: char, lines: &[&str], shown: &mut String) {
    for line in lines.iter().take(SHOWN_LINES_MAX) {
        let _ = writeln!(shown, "{mark}{}", one_line(line));
    }
    if lines.len() > SHOWN_LINES_MAX {
        let _ = writeln!(shown, "{mark}…");
    }
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use super::{difference, replace};

    #[test]
    fn a_file_changed_meanwhile_by_another_program_is_not_overwritten() {
        let folder = std::env::temp_dir().join(format!("rungd-fmt-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("a.toml");
        std::fs::write(&file, "a = 2\n").expect("written");
        let why = replace(&file, b"a=1\n", "a = 1\n").expect_err("refused").to_string();
        assert!(why.contains("a different program has changed it"), "{why}");
        assert_eq!(std::fs::read(&file).expect("read"), b"a = 2\n");
        assert_eq!(std::fs::read_dir(&folder).expect("read").count(), 1, "nothing stays beside it");
        replace(&file, b"a = 2\n", "a = 3\n").expect("replaced");
        assert_eq!(std::fs::read(&file).expect("read"), b"a = 3\n");
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    fn check(before: &str, after: &str, shown: Expect) {
        shown.assert_eq(&difference("a.toml", before, after));
    }

    #[test]
    fn the_first_difference_is_shown() {
        let after = "a = 1\nb = 2\nc = 3\nd = 4\n";
        check(
            "a = 1\nb=2\nc = 3\nd=4\n",
            after,
            expect![[r#"
                a.toml:2:
                -b=2
                -c = 3
                -d=4
                +b = 2
                +c = 3
                +d = 4
            "#]],
        );
        check(
            "a = 1\nb = 2\n\nc = 3\nd = 4\n",
            after,
            expect![[r#"
            a.toml:3:
            -
        "#]],
        );
        check(
            "a = 1\nb = 2\nc = 3\nd = 4",
            after,
            expect![[r#"
            a.toml:5:
            +
        "#]],
        );
    }

    #[test]
    fn a_long_difference_is_cut() {
        let lines = |text: &str| (1..20).map(|n| format!("{text} = {n}\n")).collect::<String>();
        check(
            &lines("a"),
            &lines("b"),
            expect![[r#"
            a.toml:1:
            -a = 1
            -a = 2
            -a = 3
            -a = 4
            -a = 5
            -a = 6
            -a = 7
            -a = 8
            -…
            +b = 1
            +b = 2
            +b = 3
            +b = 4
            +b = 5
            +b = 6
            +b = 7
            +b = 8
            +…
        "#]],
        );
    }
}
