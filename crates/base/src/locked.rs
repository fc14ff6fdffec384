//! Locks a mutex and ignores poison: for data that is consistent after every statement, so that a
//! panic of one thread does no harm to the others. The scan thread locks nothing.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks, also after a panic of a thread that held the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
