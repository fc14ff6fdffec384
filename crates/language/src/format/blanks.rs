//! Blank lines: one before each header, none at the ends, never two.
//!
//! Called by `format` between reading and ordering. Within a table of tags or settings a blank line
//! of the author stays, because it separates groups. A blank line beside a comment stays too, so
//! that the comment does not move to different lines; only a second blank line is removed.

use super::order::KeyOrder;
use crate::source::toml_tree::{Piece, TomlHead};

/// Sets the blank lines between the pieces.
pub(super) fn space(pieces: Vec<Piece<'_>>) -> Vec<Piece<'_>> {
    let mut spaced: Vec<Piece<'_>> = Vec::with_capacity(pieces.len() + 16);
    let mut keys = KeyOrder::Root;
    for piece in pieces {
        match &piece {
            Piece::Blank if matches!(spaced.last(), None | Some(Piece::Blank)) => continue,
            Piece::Blank | Piece::Remark(_) => {}
            Piece::Pair(_) => close_up(keys, &mut spaced),
            Piece::Head(head) => {
                part(head, &mut spaced);
                keys = KeyOrder::of(&head.path);
            }
        }
        spaced.push(piece);
    }
    while matches!(spaced.last(), Some(Piece::Blank)) {
        spaced.pop();
    }
    spaced
}

/// Removes a blank line between a header and its first key, or between two keys of a rung or block.
fn close_up(keys: KeyOrder, spaced: &mut Vec<Piece<'_>>) {
    let [.., before, Piece::Blank] = &spaced[..] else { return };
    let goes = match before {
        Piece::Head(_) => true,
        Piece::Pair(_) => keys.is_close(),
        Piece::Blank | Piece::Remark(_) => false,
    };
    if goes {
        spaced.pop();
    }
}

/// Adds the blank line before a header. If a comment is directly above the header, the blank line
/// is above that comment.
fn part(head: &TomlHead<'_>, spaced: &mut Vec<Piece<'_>>) {
    let remarks = spaced.iter().rev().take_while(|piece| matches!(piece, Piece::Remark(_))).count();
    let at = spaced.len() - remarks;
    let Some(before) = at.checked_sub(1) else { return };
    let is_blank = matches!(spaced[before], Piece::Blank);
    if !(remarks == 0 && is_part_of_a_rung(head)) {
        if !is_blank {
            spaced.insert(at, Piece::Blank);
        }
    } else if is_blank
        && !matches!(before.checked_sub(1).map(|at| &spaced[at]), Some(Piece::Remark(_)))
    {
        spaced.pop();
    }
}

/// Whether a header is `[[program.rung.branch]]` or `[program.rung.with]`: these have no blank line
/// before them.
fn is_part_of_a_rung(head: &TomlHead<'_>) -> bool {
    let Some((last, parents)) = head.path.split_last() else { return false };
    matches!(last.text(), "branch" | "with") && KeyOrder::of(parents) == KeyOrder::Rung
}
