//! `rungd audit --verify`: whether the chain of an audit trail is whole.
//!
//! The links are made again, from the first line that has one. The first line that does not fit is
//! reported, because every later one rests on it.

use std::fmt;

use super::audit_source::AuditedLine;
use crate::daemon::log_chain::ChainLink;
use rungd_runtime::events::LOG_CHAIN;

/// A chain that is followed line by line.
#[derive(Debug, Default)]
pub(super) struct ChainCheck {
    /// The last link.
    last: Option<ChainLink>,
    /// The first link. Behind a number above 1 the lines before it are elsewhere.
    first: Option<ChainLink>,
    /// The number of lines that fit.
    pub lines: u64,
    /// The lines without a link before the chain.
    pub unchained: u64,
    /// A link that must be in the chain, and whether it has been seen.
    wanted: Option<ChainLink>,
    is_seen: bool,
}

/// Why a chain is not whole: the first line that does not fit.
#[derive(Debug)]
pub(super) struct ChainBreak {
    place: String,
    kind: ChainBreakKind,
}

#[derive(Debug)]
enum ChainBreakKind {
    Changed(u64),
    Removed { from: u64, to: u64 },
    Inserted(u64),
    Unlinked,
    StartsBehind { behind: u64, last: u64 },
}

impl ChainCheck {
    /// A check that wants to see a link.
    pub fn wanting(wanted: Option<ChainLink>) -> ChainCheck {
        ChainCheck { wanted, ..ChainCheck::default() }
    }

    /// Takes the next line of the trail.
    ///
    /// # Errors
    /// It does not fit behind the line before it.
    pub fn take(&mut self, AuditedLine { place, line }: &AuditedLine) -> Result<(), ChainBreak> {
        let broken = |kind| Err(ChainBreak { place: place.clone(), kind });
        let Some(link) = line.link else {
            self.unchained += u64::from(self.last.is_none());
            return if self.last.is_none() { Ok(()) } else { broken(ChainBreakKind::Unlinked) };
        };
        // The first line of a part of a log cannot be judged: the link before it is elsewhere,
        // unless it is the wanted one.
        let is_next = |wanted: &ChainLink| wanted.number.checked_add(1) == Some(link.number);
        let wanted = self.wanted.filter(is_next);
        let before = self.last.or((link.number == 1).then_some(ChainLink::NONE)).or(wanted);
        if let Some(last) = before {
            self.is_seen |= self.wanted == Some(last);
            let next = last.next(line.covered.as_bytes());
            let kind = match link.number {
                number if number == next.number && link != next => ChainBreakKind::Changed(number),
                number if number == next.number => return self.fits(link),
                number if number > next.number => {
                    ChainBreakKind::Removed { from: next.number, to: number - 1 }
                }
                number if line.event.number == LOG_CHAIN.number => {
                    let (behind, last) = (number.saturating_sub(1), last.number);
                    ChainBreakKind::StartsBehind { behind, last }
                }
                number => ChainBreakKind::Inserted(number),
            };
            return broken(kind);
        }
        self.fits(link)
    }

    fn fits(&mut self, link: ChainLink) -> Result<(), ChainBreak> {
        self.first.get_or_insert(link);
        (self.last, self.lines) = (Some(link), self.lines + 1);
        self.is_seen |= self.wanted == Some(link);
        Ok(())
    }

    /// The sentence about a chain without a break; `Err`: it is not as wanted.
    pub fn verdict(&self) -> Result<String, String> {
        let (Some(first), Some(last)) = (self.first, self.last) else {
            return Err("no line has a link: RUNGD_LOG_CHAIN was not set".to_owned());
        };
        if let Some(wanted) = self.wanted.filter(|_| !self.is_seen) {
            return Err(match wanted.number {
                number if number < first.number => format!(
                    "link {number} is before the first line (link {}): give the files before it, \
                     too",
                    first.number
                ),
                number if number > last.number => format!(
                    "link {number} is behind the last line (link {}): its end is missing, or the \
                     chain was made anew",
                    last.number
                ),
                number => format!("link {number} differs: the chain was made anew"),
            });
        }
        let mut text = format!("intact: links {} to {}", first.number, last.number);
        if first.number > 1 {
            text += "; the first line rests on a log before this one";
        }
        if self.unchained > 0 {
            text += &format!("; {} lines before the chain have no link", self.unchained);
        }
        Ok(format!("{text}\nnewest link: {last}"))
    }
}

impl fmt::Display for ChainBreak {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place)?;
        match self.kind {
            ChainBreakKind::Changed(number) => write!(
                f,
                "this line (link {number}) was changed, or the link of the line before it"
            ),
            ChainBreakKind::Removed { from, to } if from == to => {
                write!(f, "the line with link {from} was removed before this one")
            }
            ChainBreakKind::Removed { from, to } => {
                write!(f, "the lines with links {from} to {to} were removed before this one")
            }
            ChainBreakKind::Inserted(number) => {
                write!(f, "this line (link {number}) was inserted, or is at a wrong place")
            }
            ChainBreakKind::Unlinked => f.write_str(
                "this line has no link: it was inserted, or rungd ran without RUNGD_LOG_CHAIN",
            ),
            ChainBreakKind::StartsBehind { behind, last } => write!(
                f,
                "this start goes on behind link {behind}, and the log behind link {last}: the \
                 file of RUNGD_LOG_CHAIN was lost or is old (a power cut), or lines were inserted"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daemon::log_reading::LoggedLine;

    /// The lines of a chain of five links, as text, and its links.
    fn chain() -> (Vec<String>, Vec<ChainLink>) {
        let (mut lines, mut links, mut last) = (Vec::new(), Vec::new(), ChainLink::NONE);
        for count in 0..5 {
            let text = format!("RUNGD-0801 operator-write: {count} who=anna");
            last = last.next(text.as_bytes());
            lines.push(format!("{text} chain={last}"));
            links.push(last);
        }
        (lines, links)
    }

    /// A link with the hash of a different one.
    fn renumbered(link: ChainLink, number: u64) -> ChainLink {
        let text = link.to_string();
        ChainLink::parse(&format!("{number}:{}", text.split_once(':').unwrap().1)).unwrap()
    }

    fn verdict(lines: &[String], wanted: ChainLink) -> Result<String, String> {
        let mut check = ChainCheck::wanting(Some(wanted));
        for line in lines {
            let line = LoggedLine::read(line).unwrap();
            let audited = AuditedLine { place: "log:1".to_owned(), line };
            check.take(&audited).map_err(|broken| broken.to_string())?;
        }
        check.verdict()
    }

    #[test]
    fn a_wanted_link_is_found_also_right_before_the_first_line() {
        let (lines, links) = chain();
        assert!(verdict(&lines, links[2]).is_ok());
        assert!(verdict(&lines[2..], links[1]).is_ok(), "it judges the first line");
        let other = renumbered(links[4], 2);
        assert!(verdict(&lines[2..], other).unwrap_err().contains("(link 3) was changed"));
    }

    #[test]
    fn a_wanted_link_that_is_missing_is_told_with_its_side() {
        let (lines, links) = chain();
        let told = |lines: &[String], wanted| verdict(lines, wanted).unwrap_err();
        assert!(told(&lines[2..], links[0]).contains("before the first line (link 3)"));
        assert!(told(&lines[..3], links[4]).contains("behind the last line (link 3)"));
        let other = renumbered(links[4], 3);
        assert!(told(&lines, other).contains("differs"));
    }
}
