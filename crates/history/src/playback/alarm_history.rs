//! The history of alarms in a recording: how often each rose, how long it stood, whether it
//! chattered, and when.
//!
//! `rungd alarms --since` prints it, and `alarm_playback` fills it, scan by scan, from before the
//! window. What is not recorded is a gap: an alarm that stands before it ends with the last scan
//! before it.

use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};
use std::ops::RangeInclusive;

use super::alarm_follower::{AlarmFollower, PlacedAlarms};
use super::followed_alarm::FollowedAlarm;
use super::replay::PlayedScan;
use rungd_language::resolve::priority::Priority;
use rungd_runtime::AlarmChange;

/// The most times that are kept one by one; all are counted.
const SPANS_MAX: usize = 1_000_000;
/// An alarm chatters if it rises this often within this time (ISA-18.2: three times in a minute).
const CHATTER_RISES: usize = 3;
const CHATTER_NS: i64 = 60 * 1_000_000_000;

/// An alarm of the recorded programs, and what became of it.
#[derive(Clone, Debug)]
pub struct AlarmFigures {
    /// Its tag, or the name of its line.
    pub tag: String,
    /// Its text, in the first program that has it, as its priority and its group are.
    pub text: String,
    /// Its priority.
    pub priority: Priority,
    /// Its group.
    pub group: Option<String>,
    /// How often it rose.
    pub rises: u64,
    /// How long it stood in all, ns.
    pub stood_ns: u64,
    /// How long it stood at most without a break, ns.
    pub longest_ns: u64,
    /// How often it began to chatter: to rise three times within a minute.
    pub chatters: u64,
    /// Whether it stands at the end.
    pub stands: bool,
    /// The times of its last rises, ns since 1970 (UTC).
    recent: VecDeque<i64>,
    /// Whether its last rise was within a chatter.
    is_chattering: bool,
}

/// A time for which an alarm stood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AlarmSpan {
    /// The index of the alarm in [`AlarmHistory::alarms`].
    pub alarm: usize,
    /// Its place among all such times, in the order in which they began: those of one scan in the
    /// order of execution.
    pub order: u64,
    /// The scan that turned its bit ON; the first one that is known, if it stood before.
    pub scan: u64,
    /// From when, ns since 1970 (UTC).
    pub from_ns: i64,
    /// To when: the last scan that is known, if it did not end.
    pub to_ns: i64,
    /// How it began.
    pub begin: SpanBegin,
    /// How it ended.
    pub end: SpanEnd,
}

/// How the time of an alarm began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpanBegin {
    /// The alarm rose.
    Rose,
    /// It stood already when the window begins, or in the first scan after a gap.
    Before,
}

/// How the time of an alarm ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpanEnd {
    /// The alarm went away.
    Gone,
    /// A reload brought a program without it.
    Removed,
    /// The recording has a gap: what followed is not known.
    Gap,
    /// The alarm stands at the end.
    Stands,
}

impl AlarmSpan {
    /// How long it lasted, ns.
    pub fn lasted_ns(&self) -> u64 {
        self.to_ns.saturating_sub(self.from_ns).max(0).unsigned_abs()
    }
}

/// A scan that was executed again.
#[derive(Clone, Copy)]
pub(super) struct SeenScan<'a> {
    pub scan: PlayedScan,
    /// Whether the window has it.
    pub is_shown: bool,
    /// The state of the bit of an alarm, or that a line does not hold.
    pub is_on: &'a dyn Fn(&FollowedAlarm) -> bool,
}

/// The history.
#[derive(Debug, Default)]
pub struct AlarmHistory {
    follower: AlarmFollower,
    /// All alarms of the programs, in the order in which they were met first.
    pub alarms: Vec<AlarmFigures>,
    /// The times for which alarms stood, in the order of their ends.
    pub spans: Vec<AlarmSpan>,
    /// The number of these times that are not kept.
    pub more: u64,
    /// The number of scans.
    pub scans: u64,
    /// The number of gaps.
    pub gaps: u64,
    /// The number of sections that cannot be executed.
    pub unplayable: u64,
    numbers: HashMap<String, usize>,
    /// The number of times that began.
    begun: u64,
    /// The alarms that stand.
    open: BTreeMap<usize, AlarmSpan>,
    /// The first scan since a gap, and the place of the last one's program.
    first: Option<u64>,
    place: Option<usize>,
    /// The times of the first and of the last scan, ns since 1970 (UTC).
    begin_ns: Option<i64>,
    last_ns: i64,
}

impl AlarmHistory {
    /// The times of the first and of the last scan, ns since 1970 (UTC).
    pub fn span(&self) -> Option<RangeInclusive<i64>> {
        Some(self.begin_ns?..=self.last_ns)
    }

    /// The alarms that rose or stood.
    pub fn shown_alarms(&self) -> impl Iterator<Item = &AlarmFigures> {
        self.alarms.iter().filter(|alarm| alarm.rises > 0 || alarm.stood_ns > 0)
    }

    /// Leaves out all alarms that are not of a group.
    pub fn retain_group(&mut self, group: &str) {
        let is_of = |alarm: &AlarmFigures| alarm.group.as_deref() == Some(group);
        self.spans.retain(|span| is_of(&self.alarms[span.alarm]));
        let others = self.alarms.iter_mut().filter(|alarm| !is_of(alarm));
        others.for_each(|alarm| (alarm.rises, alarm.stood_ns, alarm.chatters) = (0, 0, 0));
    }

    /// Adds the changes of alarms at the end of a scan. Scans before the window are followed, and
    /// not counted.
    pub(super) fn look(&mut self, program: PlacedAlarms<'_>, seen: SeenScan<'_>) {
        let SeenScan { scan, is_shown, is_on } = seen;
        let first = *self.first.get_or_insert(scan.number);
        let changes = self.follower.look(program, &scan, is_on);
        if self.place.replace(program.place).is_some_and(|before| before != program.place) {
            self.remove_others(program.alarms, scan.unix_ns);
        }
        if is_shown {
            if self.begin_ns.is_none() {
                for span in self.open.values_mut() {
                    (span.scan, span.from_ns) = (scan.number, scan.unix_ns);
                }
                self.begin_ns = Some(scan.unix_ns);
            }
            (self.scans, self.last_ns) = (self.scans + 1, scan.unix_ns);
        } else if self.begin_ns.is_some() {
            return;
        }
        for change in changes {
            let alarm = self.number(&program.alarms[change.number]);
            self.changed(alarm, &change, change.scan == first);
        }
    }

    /// Ends the alarms that a new program does not have.
    fn remove_others(&mut self, alarms: &[FollowedAlarm], at_ns: i64) {
        let kept: HashSet<&str> = alarms.iter().map(|alarm| alarm.tag.as_str()).collect();
        let gone = self.open.keys().copied();
        let gone = gone.filter(|alarm| !kept.contains(self.alarms[*alarm].tag.as_str()));
        for alarm in gone.collect::<Vec<_>>() {
            if let Some(span) = self.open.remove(&alarm) {
                self.add(AlarmSpan { to_ns: at_ns, end: SpanEnd::Removed, ..span });
            }
        }
    }

    /// What follows is not known to follow.
    pub(super) fn gap(&mut self) {
        self.gaps += u64::from(self.first.is_some());
        self.end(SpanEnd::Gap);
        (self.follower, self.first) = (AlarmFollower::default(), None);
    }

    /// Ends what stands at the last scan.
    pub(super) fn end(&mut self, end: SpanEnd) {
        for (alarm, span) in std::mem::take(&mut self.open) {
            self.alarms[alarm].stands = end == SpanEnd::Stands;
            let to_ns = self.last_ns.max(span.from_ns);
            self.add(AlarmSpan { to_ns, end, ..span });
        }
    }

    fn changed(&mut self, alarm: usize, change: &AlarmChange, is_first: bool) {
        let at_ns = i64::try_from(change.at_ns).unwrap_or(i64::MAX);
        if !change.on {
            if let Some(span) = self.open.remove(&alarm) {
                self.add(AlarmSpan { to_ns: at_ns, end: SpanEnd::Gone, ..span });
            }
            return;
        }
        let is_before = is_first || self.begin_ns.is_none();
        let begin = if is_before { SpanBegin::Before } else { SpanBegin::Rose };
        if begin == SpanBegin::Rose {
            self.alarms[alarm].count_rise(at_ns);
        }
        let (scan, end) = (change.scan, SpanEnd::Stands);
        let order = self.begun;
        self.begun += 1;
        let span = AlarmSpan { alarm, order, scan, from_ns: at_ns, to_ns: at_ns, begin, end };
        self.open.insert(alarm, span);
    }

    /// Adds a time that is over, unless it was over before the window.
    fn add(&mut self, span: AlarmSpan) {
        let is_earlier = span.begin == SpanBegin::Before && span.to_ns <= span.from_ns;
        if self.begin_ns.is_none() || is_earlier && span.end != SpanEnd::Stands {
            return;
        }
        let figures = &mut self.alarms[span.alarm];
        figures.stood_ns = figures.stood_ns.saturating_add(span.lasted_ns());
        figures.longest_ns = figures.longest_ns.max(span.lasted_ns());
        if self.spans.len() < SPANS_MAX {
            self.spans.push(span);
        } else {
            self.more += 1;
        }
    }

    /// The index of an alarm: the same if its name is, whatever the program.
    fn number(&mut self, alarm: &FollowedAlarm) -> usize {
        if let Some(number) = self.numbers.get(&alarm.tag) {
            return *number;
        }
        let number = self.alarms.len();
        self.numbers.insert(alarm.tag.clone(), number);
        self.alarms.push(AlarmFigures {
            tag: alarm.tag.clone(),
            text: alarm.text.clone(),
            priority: alarm.terms.priority,
            group: alarm.terms.group.clone(),
            rises: 0,
            stood_ns: 0,
            longest_ns: 0,
            chatters: 0,
            stands: false,
            recent: VecDeque::new(),
            is_chattering: false,
        });
        number
    }
}

impl AlarmFigures {
    fn count_rise(&mut self, at_ns: i64) {
        self.rises += 1;
        self.recent.push_back(at_ns);
        if self.recent.len() > CHATTER_RISES {
            self.recent.pop_front();
        }
        let is_full = self.recent.len() == CHATTER_RISES;
        let since_ns = self.recent.front().copied().unwrap_or(at_ns);
        let chatters = is_full && at_ns.saturating_sub(since_ns) <= CHATTER_NS;
        self.chatters += u64::from(chatters && !self.is_chattering);
        self.is_chattering = chatters;
    }
}
