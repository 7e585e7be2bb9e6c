//! What may still come: the answers of past requests, and which requests they could be taken for.
//!
//! A Modbus RTU answer carries no register and no number, so a late or repeated answer is a valid answer to the next request of the
//! same shape. Nothing in the frame tells them apart; the only defence is never to ask in a shape that may still come.
//!
//! A request leaves a trace from the moment it is sent, before anything else happens, so that a caller who stops waiting half-way
//! leaves the line as safe as one who did not.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;
use wire::modbus::Request;

/// All that tells one answer from another: unit, function and length, or the echoed fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Function 03: so many words.
    Words(u16),
    /// Function 06: address and value.
    Single(u16, u16),
    /// Function 16: address and count.
    Multiple(u16, u16),
}

impl Shape {
    /// Of the answer to a request.
    pub fn of(request: &Request) -> Self {
        match request {
            Request::ReadHolding { count, .. } => Self::Words(*count),
            Request::WriteSingle { address, value } => Self::Single(*address, *value),
            Request::WriteMultiple { address, .. } => Self::Multiple(*address, request.count()),
        }
    }

    /// Exceptions show the function and nothing else.
    fn function(self) -> u8 {
        match self {
            Self::Words(_) => 3,
            Self::Single(..) => 6,
            Self::Multiple(..) => 16,
        }
    }
}

/// How long answers may come after they were due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LateReplyWindow {
    /// An answer that was given up may come until so long after its request, even after later answers.
    pub late: Duration,
    /// An answer that was taken may come once more until so long after.
    pub repeated: Duration,
}

impl Default for LateReplyWindow {
    fn default() -> Self {
        Self { late: Duration::from_millis(400), repeated: Duration::from_millis(250) }
    }
}

#[derive(Debug, Clone, Copy)]
struct Trace {
    unit: u8,
    shape: Shape,
    sent: Instant,
    answered: Option<Instant>,
    /// Its answer was an exception.
    refused: bool,
    /// A later request was answered: lines keep the order, so within the window this one is answered or never.
    overtaken: bool,
}

/// Requests whose answers may still come.
#[derive(Debug)]
pub struct Memory {
    traces: VecDeque<Trace>,
    late_replies: LateReplyWindow,
}

impl Memory {
    /// Of a line on which nothing was asked yet.
    pub fn new(late_replies: LateReplyWindow) -> Self {
        Self { traces: VecDeque::new(), late_replies }
    }

    /// A request is about to be sent.
    pub fn sent(&mut self, unit: u8, shape: Shape, now: Instant) {
        self.expire(now);
        self.traces.push_back(Trace { unit, shape, sent: now, answered: None, refused: false, overtaken: false });
    }

    /// The latest request was answered.
    pub fn answered(&mut self, refused: bool, now: Instant) {
        if let Some(latest) = self.traces.back_mut() {
            (latest.answered, latest.refused) = (Some(now), refused);
        }
        for trace in &mut self.traces {
            trace.overtaken = true;
        }
    }

    /// When a request of this shape may be sent; `None`: at once. After that time, if the line was silent, [`Memory::forget`] it.
    pub fn free_at(&mut self, unit: u8, shape: Shape, now: Instant) -> Option<Instant> {
        self.expire(now);
        // A trace that nothing has overtaken waits for a silence as long as the window after all that was sent.
        let latest = self.traces.back()?.sent;
        let matching = self.traces.iter().filter(|trace| trace.unit == unit && trace.shape == shape);
        matching.map(|trace| self.end(trace).unwrap_or(latest + self.late_replies.late)).max()
    }

    /// Forgets a shape whose time is over.
    pub fn forget(&mut self, unit: u8, shape: Shape) {
        self.traces.retain(|trace| trace.unit != unit || trace.shape != shape);
    }

    /// Whether an exception to the latest request might be that of an earlier one.
    pub fn exception_is_ambiguous(&self) -> bool {
        let mut traces = self.traces.iter().rev();
        let Some(latest) = traces.next() else { return false };
        traces.any(|trace| {
            trace.unit == latest.unit
                && trace.shape.function() == latest.shape.function()
                && (trace.answered.is_none() || trace.refused)
        })
    }

    /// Whether an answer is owed by an earlier request than the latest.
    #[cfg(test)]
    fn owed(&self) -> usize {
        self.traces.iter().filter(|trace| trace.answered.is_none()).count()
    }

    fn end(&self, trace: &Trace) -> Option<Instant> {
        match trace.answered {
            Some(answered) => Some(answered + self.late_replies.repeated),
            None if trace.overtaken => Some(trace.sent + self.late_replies.late),
            None => None,
        }
    }

    fn expire(&mut self, now: Instant) {
        let late_replies = self.late_replies;
        self.traces.retain(|trace| match trace.answered {
            Some(answered) => now < answered + late_replies.repeated,
            None => !trace.overtaken || now < trace.sent + late_replies.late,
        });
        // A line that never answers is asked on: its oldest debts are beyond any window of use.
        while self.traces.len() > LONGEST {
            self.traces.pop_front();
        }
    }
}

/// Traces kept at most; a device that is asked as fast as it can leaves fewer within any window.
const LONGEST: usize = 256;

#[cfg(test)]
mod tests {
    use super::*;

    const LATE: Duration = Duration::from_millis(400);
    const REPEATED: Duration = Duration::from_millis(250);

    fn memory() -> (Memory, Instant) {
        (Memory::new(LateReplyWindow::default()), Instant::now())
    }

    fn ms(n: u64) -> Duration {
        Duration::from_millis(n)
    }

    #[test]
    fn an_answered_shape_is_free_once_no_repetition_can_come() {
        let (mut memory, start) = memory();
        memory.sent(1, Shape::Words(2), start);
        memory.answered(false, start + ms(5));
        assert_eq!(memory.free_at(1, Shape::Words(2), start + ms(6)), Some(start + ms(5) + REPEATED));
        assert_eq!(memory.free_at(1, Shape::Words(3), start + ms(6)), None);
        assert_eq!(memory.free_at(2, Shape::Words(2), start + ms(6)), None, "another unit's answers name it");
        assert_eq!(memory.free_at(1, Shape::Words(2), start + ms(5) + REPEATED), None);
    }

    #[test]
    fn an_unanswered_shape_stays_until_a_later_answer_and_the_horizon() {
        let (mut memory, start) = memory();
        memory.sent(1, Shape::Words(2), start);
        // Never overtaken: no time alone frees it, only a silence after the last request.
        assert_eq!(memory.free_at(1, Shape::Words(2), start + ms(5000)), Some(start + LATE));
        memory.sent(1, Shape::Words(3), start + ms(100));
        memory.answered(false, start + ms(110));
        assert_eq!(memory.free_at(1, Shape::Words(2), start + ms(120)), Some(start + LATE));
        assert_eq!(memory.free_at(1, Shape::Words(2), start + LATE), None);
    }

    #[test]
    fn writes_are_told_apart_by_what_they_echo() {
        let (mut memory, start) = memory();
        memory.sent(1, Shape::Single(8, 100), start);
        assert_eq!(memory.free_at(1, Shape::Single(8, 0), start), None);
        assert_eq!(memory.free_at(1, Shape::Multiple(8, 1), start), None);
        assert!(memory.free_at(1, Shape::Single(8, 100), start).is_some());
        memory.forget(1, Shape::Single(8, 100));
        assert_eq!(memory.free_at(1, Shape::Single(8, 100), start), None);
    }

    #[test]
    fn an_exception_is_doubted_while_another_may_be_on_its_way() {
        let (mut memory, start) = memory();
        memory.sent(1, Shape::Words(2), start);
        assert!(!memory.exception_is_ambiguous());
        memory.sent(1, Shape::Words(3), start + ms(100));
        assert!(memory.exception_is_ambiguous());
        memory.sent(1, Shape::Single(8, 1), start + ms(200));
        assert!(!memory.exception_is_ambiguous(), "another function");
        memory.answered(false, start + ms(201));
        memory.sent(1, Shape::Single(8, 2), start + LATE + ms(100));
        assert!(!memory.exception_is_ambiguous());
    }

    #[test]
    fn memory_is_bounded() {
        let (mut memory, start) = memory();
        for n in 0..10_000 {
            memory.sent(1, Shape::Words(n % 7), start + ms(u64::from(n)));
        }
        assert!(memory.owed() <= LONGEST + 1);
    }
}
