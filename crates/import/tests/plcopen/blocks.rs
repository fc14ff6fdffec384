//! The function blocks of IEC 61131-3: the state machines of MatIEC's library.

use std::collections::HashMap;

use super::values::Value;

/// The states of a block.
#[derive(Clone, Debug, Default)]
pub struct State {
    pub q: bool,
    pub other_q: bool,
    pub number: i64,
    was: [bool; 2],
    state: u8,
    start: i64,
}

impl State {
    /// Executes the block.
    pub fn execute(&mut self, kind: &str, given: &HashMap<String, Value>, now: i64) {
        match kind {
            "TON" | "TOF" | "TP" => self.timer(kind, given, now),
            "CTU" | "CTD" | "CTUD" => self.counter(kind, given),
            _ => self.latch(kind, given),
        }
    }

    fn edge(&mut self, at: usize, value: bool) -> bool {
        let q = value && !self.was[at];
        self.was[at] = value;
        q
    }

    fn timer(&mut self, kind: &str, given: &HashMap<String, Value>, now: i64) {
        let (s, number, input) = (self, given["PT"].whole(), given["IN"].is_on());
        match kind {
            "TON" => {
                if s.state == 0 && !s.was[0] && input {
                    (s.state, s.q, s.start) = (1, false, now);
                } else if !input {
                    (s.number, s.q, s.state) = (0, false, 0);
                } else if s.state == 1 {
                    if s.start + number <= now {
                        (s.state, s.q, s.number) = (2, true, number);
                    } else {
                        s.number = now - s.start;
                    }
                }
                s.was[0] = input;
            }
            "TOF" => {
                if s.state == 0 && s.was[0] && !input {
                    (s.state, s.start) = (1, now);
                } else if input {
                    (s.number, s.state) = (0, 0);
                } else if s.state == 1 {
                    if s.start + number <= now {
                        (s.state, s.number) = (2, number);
                    } else {
                        s.number = now - s.start;
                    }
                }
                s.q = input || s.state == 1;
                s.was[0] = input;
            }
            _ => {
                if s.state == 0 && !s.was[0] && input {
                    (s.state, s.q, s.start) = (1, true, now);
                } else if s.state == 1 {
                    if s.start + number <= now {
                        (s.state, s.q, s.number) = (2, false, number);
                    } else {
                        s.number = now - s.start;
                    }
                }
                if s.state == 2 && !input {
                    (s.number, s.state) = (0, 0);
                }
                s.was[0] = input;
            }
        }
    }

    fn counter(&mut self, kind: &str, given: &HashMap<String, Value>) {
        let on = |pin: &str| given[pin].is_on();
        let (s, number) = (self, given["PV"].whole());
        match kind {
            "CTU" => {
                let up = s.edge(0, on("CU"));
                if on("R") {
                    s.number = 0;
                } else if up && s.number < number {
                    s.number += 1;
                }
                s.q = s.number >= number;
            }
            "CTD" => {
                let down = s.edge(0, on("CD"));
                if on("LD") {
                    s.number = number;
                } else if down && s.number > 0 {
                    s.number -= 1;
                }
                s.q = s.number <= 0;
            }
            _ => {
                let (up, down) = (s.edge(0, on("CU")), s.edge(1, on("CD")));
                if on("R") {
                    s.number = 0;
                } else if on("LD") {
                    s.number = number;
                } else if up != down {
                    if up && s.number < number {
                        s.number += 1;
                    } else if down && s.number > 0 {
                        s.number -= 1;
                    }
                }
                (s.q, s.other_q) = (s.number >= number, s.number <= 0);
            }
        }
    }

    fn latch(&mut self, kind: &str, given: &HashMap<String, Value>) {
        let on = |pin: &str| given[pin].is_on();
        let s = self;
        match kind {
            "R_TRIG" => s.q = s.edge(0, on("CLK")),
            "F_TRIG" => s.q = s.edge(0, !on("CLK")),
            "SR" => s.q = on("S1") || (!on("R") && s.q),
            "RS" => s.q = !on("R1") && (on("S") || s.q),
            kind => panic!("the interpreter has no {kind}"),
        }
    }
}
