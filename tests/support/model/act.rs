//! The effects of each instruction when it executes and when it terminates; contacts and values.

use super::exec::Sim;
use super::program::{Contact, Instr, Op, Value};

impl Sim<'_> {
    pub fn value(&self, value: Value) -> i64 {
        match value {
            Value::Const(number) => number,
            Value::Real(real) => panic!("{real} where only integers stand"),
            Value::At(loc) => self.memory.get(loc),
            Value::Element(array, index) => {
                let loc = array.element(self.memory.get(index));
                loc.map_or(0, |loc| self.memory.get(loc))
            }
        }
    }

    /// Evaluates a contact completely, so that every edge contact in it updates its history.
    pub fn contact(&mut self, contact: &Contact) -> bool {
        match contact {
            Contact::Bit(loc) => self.memory.bit(*loc),
            Contact::Element(array, index) => self.value(Value::Element(*array, *index)) != 0,
            Contact::Edge { rising, of, history } => {
                let on = self.contact(of);
                if *rising { self.edge(*history, on) } else { self.falling_edge(*history, on) }
            }
            Contact::Compare(left, compare, right) => self.compare(*left, *compare, *right),
            Contact::Computed(expr) => {
                self.quiet = true;
                let on = self.is_true(expr);
                self.quiet = false;
                on
            }
            Contact::Not(inner) => !self.contact(inner),
            Contact::All(items) => self.contacts(items).iter().all(|on| *on),
            Contact::Any(items) => self.contacts(items).iter().any(|on| *on),
        }
    }

    fn contacts(&mut self, items: &[Contact]) -> Vec<bool> {
        items.iter().map(|item| self.contact(item)).collect()
    }

    /// Executes one instruction of the element with the power of its legs. An instruction with one
    /// leg takes the rung's power.
    pub fn execute(&mut self, instr: &Instr, block: usize, element: usize, legs: &[bool]) {
        let power = legs.first().copied().unwrap_or(false);
        let history = instr.history[0];
        match &instr.op {
            Op::Out(bit) => self.memory.put_bit(*bit, power),
            Op::Set(bit) if power => self.write(*bit, 1),
            Op::Rst(bit) if power => self.write(*bit, 0),
            Op::Set(_) | Op::Rst(_) => {}
            Op::Sr(bits) => self.shift(bits, history, legs),
            Op::Pd(bit) => {
                let on = self.edge(history, power);
                self.memory.put_bit(*bit, on);
            }
            Op::Nd(bit) => {
                let on = self.falling_edge(history, power);
                self.memory.put_bit(*bit, on);
            }
            Op::Ponoff(bit) => {
                let risen = self.edge(history, power);
                if risen {
                    let on = self.memory.bit(*bit);
                    self.memory.put_bit(*bit, !on);
                }
            }
            Op::Counter(ct) => self.counter_run(*ct, instr, legs),
            Op::Timer(t) => self.timer_run(*t, legs),
            Op::Ctu(n, preset) => self.sensaphone_run(*n, true, *preset, instr, power),
            Op::Ctd(n, preset) => self.sensaphone_run(*n, false, *preset, instr, power),
            Op::Restart(program) => {
                let risen = self.edge(history, power);
                if risen {
                    self.stop_block(*program);
                    self.start_program(*program);
                    if *program == block {
                        self.end_current();
                    }
                }
            }
            Op::Entask(task, None) => {
                let risen = self.edge(history, power);
                if risen {
                    self.start_task(*task, None);
                }
            }
            Op::Entask(task, Some(every)) => {
                if power {
                    let every = match self.running(*task) {
                        true => 0,
                        false => self.read(*every),
                    };
                    self.start_task(*task, Some(every));
                } else {
                    self.stop_block(*task);
                }
            }
            op if power => self.act(op, block, element),
            _ => {}
        }
    }

    /// Executes an instruction that acts while its rung is ON and does nothing while it is OFF.
    fn act(&mut self, op: &Op, block: usize, element: usize) {
        match op {
            Op::Rstct(ct) => self.rstct(*ct),
            Op::Rstt(t) => self.rstt(*t),
            Op::Res(n) => self.res(*n),
            Op::Move(value, to) => {
                let number = self.operand(*value);
                self.store(*to, number);
            }
            Op::Add(a, b, to) => self.sum(*a, *b, *to),
            Op::Sub(a, b, to) => self.difference(*a, *b, *to),
            Op::Copy(from, to) => self.copy(*from, *to),
            Op::CopyRecord(from, to) => self.copy_record(from, to),
            Op::Fill(value, to) => self.fill(*value, *to),
            Op::Pack(from, to) => self.pack(*from, *to),
            Op::Unpack(value, to) => self.unpack(*value, *to),
            Op::Math(target, expr) => self.math(target, expr),
            Op::Run(program) => self.start_program(*program),
            Op::Halt(target) => {
                self.stop_block(*target);
                if *target == block {
                    self.end_current();
                }
            }
            Op::Exit => {
                self.stop_block(block);
                self.end_current();
            }
            Op::Jump(targets) => self.jump(block, element, targets),
            Op::Sgset(stage) => self.stage_on(block, *stage),
            Op::Sgrst(stage) => self.stage_off(block, *stage),
            Op::Sgconvrg(stages, to) => {
                let all_on = stages.iter().all(|stage| self.is_stage_on(block, *stage));
                if all_on {
                    stages.iter().for_each(|stage| self.stage_off(block, *stage));
                    self.stage_on(block, *to);
                }
            }
            Op::Stop => self.stop_asked = true,
            Op::Call(subroutine) => self.call_subroutine(*subroutine, element),
            Op::Return => self.returned = true,
            _ => {}
        }
    }

    /// Executes the instruction in a termination pass.
    pub fn terminate(&mut self, instr: &Instr) {
        match &instr.op {
            Op::Out(bit) | Op::Pd(bit) | Op::Nd(bit) => {
                self.memory.put_bit(*bit, false);
                self.forget(instr);
            }
            Op::Counter(ct) => self.counter_end(*ct, instr),
            Op::Timer(t) => self.timer_end(*t),
            Op::Ctu(n, _) => self.sensaphone_end(*n, true, instr),
            Op::Ctd(n, _) => self.sensaphone_end(*n, false, instr),
            Op::Entask(task, Some(_)) => self.stop_block(*task),
            // SR keeps its history.
            Op::Sr(_) => {}
            _ => self.forget(instr),
        }
    }
}
