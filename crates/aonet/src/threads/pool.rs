//! A few threads that wait for work. Unlike a work-stealing pool, handing work to them allocates nothing.
#![allow(unsafe_code, reason = "threads that outlive a call borrow what the call borrows")]

use crate::error::{Error, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

type Job = dyn Fn(usize) + Sync;

/// Threads that run the same closure at the same time.
#[derive(Debug)]
pub(crate) struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    start: Condvar,
    done: Condvar,
}

#[derive(Debug, Default)]
struct State {
    job: Option<JobPtr>,
    generation: usize,
    running: usize,
    panicked: bool,
    shutdown: bool,
}

#[derive(Debug, Clone, Copy)]
struct JobPtr(*const Job);

// SAFETY: the closure is `Sync`, and `Pool::run` keeps it alive while a worker can see the pointer.
unsafe impl Send for JobPtr {}

impl Pool {
    /// A pool of `threads`, of which the caller of [`Pool::run`] is one.
    ///
    /// # Errors
    /// When `threads` is 0 or a thread cannot be started.
    pub(crate) fn new(threads: usize) -> Result<Self> {
        if threads == 0 {
            return Err(Error::value("threads", "at least 1", threads));
        }
        let mut pool = Self { shared: Arc::default(), workers: Vec::new() };
        for index in 1..threads {
            let shared = Arc::clone(&pool.shared);
            let worker = std::thread::Builder::new()
                .name(format!("aonet-{index}"))
                .spawn(move || shared.work(index))
                .map_err(|e| Error::value("threads", "threads that can be started", e))?;
            pool.workers.push(worker);
        }
        // A starting thread allocates: wait for all of them here, not in the first frame.
        pool.run(&|_| ());
        Ok(pool)
    }

    /// Number of threads, the caller's included.
    pub(crate) fn threads(&self) -> usize {
        self.workers.len() + 1
    }

    /// Calls `job` once on every thread with the thread's index; returns when all have returned.
    ///
    /// # Panics
    /// When `job` does, on any thread.
    pub(crate) fn run(&mut self, job: &(dyn Fn(usize) + Sync)) {
        // SAFETY: only the lifetime changes; the workers drop the pointer before this function returns.
        let job_ptr =
            JobPtr(unsafe { std::mem::transmute::<*const (dyn Fn(usize) + Sync + '_), *const Job>(job) });
        let mut state = self.shared.lock();
        (state.job, state.running) = (Some(job_ptr), self.workers.len());
        state.generation = state.generation.wrapping_add(1);
        drop(state);
        self.shared.start.notify_all();
        let mine = catch_unwind(AssertUnwindSafe(|| job(0)));
        let mut state = self.shared.lock();
        while state.running > 0 {
            state = self.shared.done.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.job = None;
        let panicked = std::mem::take(&mut state.panicked);
        drop(state);
        if let Err(payload) = mine {
            std::panic::resume_unwind(payload);
        }
        assert!(!panicked, "a worker panicked");
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.lock().shutdown = true;
        self.shared.start.notify_all();
        for worker in self.workers.drain(..) {
            // A worker catches the panics of jobs, so that it has none of its own.
            let _ = worker.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self, index: usize) {
        let mut seen = 0;
        while let Some(job) = self.next(&mut seen) {
            // SAFETY: `Pool::run` keeps the closure alive until `running` is back at 0.
            let job = unsafe { &*job.0 };
            let result = catch_unwind(AssertUnwindSafe(|| job(index)));
            let mut state = self.lock();
            state.panicked |= result.is_err();
            state.running -= 1;
            if state.running == 0 {
                self.done.notify_one();
            }
        }
    }

    /// Waits for a job that this worker has not done; none at shutdown.
    fn next(&self, seen: &mut usize) -> Option<JobPtr> {
        let mut state = self.lock();
        while state.generation == *seen && !state.shutdown {
            state = self.start.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        *seen = state.generation;
        if state.shutdown { None } else { state.job }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn every_thread_runs_every_job_once() {
        let mut pool = Pool::new(3).unwrap();
        let counts: [AtomicUsize; 3] = Default::default();
        for _ in 0..1000 {
            pool.run(&|i| {
                counts[i].fetch_add(1, Ordering::Relaxed);
            });
        }
        assert!(counts.iter().all(|c| c.load(Ordering::Relaxed) == 1000), "{counts:?}");
    }

    #[test]
    fn a_panic_reaches_the_caller_and_the_pool_survives_it() {
        let mut pool = Pool::new(2).unwrap();
        for bad in [0, 1] {
            let caught = catch_unwind(AssertUnwindSafe(|| pool.run(&|i| assert!(i != bad))));
            assert!(caught.is_err());
        }
        pool.run(&|_| {});
        assert!(Pool::new(0).is_err());
    }
}
