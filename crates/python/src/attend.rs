//! Work without the interpreter's lock, while its caller waits for Ctrl-C and tells of the progress.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc::{RecvTimeoutError, sync_channel},
    },
    thread,
    time::Duration,
};

use pyo3::{exceptions::PyRuntimeError, prelude::*};

/// Between two looks at Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Of the thread that works, bytes: as much as the program has.
const STACK: usize = 8 << 20;

/// What the work says while it is done, and whether it is to stop.
#[derive(Debug, Clone, Default)]
pub struct Attendance {
    done: Arc<AtomicU64>,
    all: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
}

impl Attendance {
    /// So much of so much is done. Returns whether to go on.
    pub fn go_on(&self, done: u64, all: u64) -> bool {
        self.all.store(all, Ordering::Relaxed);
        self.done.store(done, Ordering::Relaxed);
        !self.stops()
    }

    pub fn stops(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Calls `progress` if work was done since the last `reported`.
    fn report(&self, py: Python<'_>, progress: Option<&Py<PyAny>>, reported: &mut u64) -> PyResult<()> {
        let (done, all) = (self.done.load(Ordering::Relaxed), self.all.load(Ordering::Relaxed));
        let Some(progress) = progress.filter(|_| all > 0 && done != *reported) else { return Ok(()) };
        *reported = done;
        progress.call1(py, (done, all)).map(drop)
    }
}

/// Do `work` on a thread of its own. A Ctrl-C, or an exception in `progress`, stops it and is raised once it has stopped.
///
/// # Errors
/// That exception; a panic of the work.
pub fn attend<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Attendance) -> T + Send,
) -> PyResult<T> {
    let attendance = Attendance::default();
    let (sender, mut receiver) = sync_channel::<()>(1);
    let (of_work, attendance) = (attendance.clone(), &attendance);
    thread::scope(|scope| {
        let worker = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || {
            // Held until the work is done, or has panicked.
            let _ended = sender;
            work(&of_work)
        })?;
        let (mut reported, mut raised) = (0, None);
        loop {
            let waited;
            (waited, receiver) = py.detach(move || (receiver.recv_timeout(LOOK), receiver));
            if raised.is_none()
                && let Err(error) = py.check_signals().and_then(|()| attendance.report(py, progress, &mut reported))
            {
                attendance.stop.store(true, Ordering::Relaxed);
                raised = Some(error);
            }
            if waited != Err(RecvTimeoutError::Timeout) {
                break;
            }
        }
        let done = py.detach(|| worker.join());
        match (raised, done) {
            (Some(error), _) => Err(error),
            (None, Ok(done)) => Ok(done),
            (None, Err(_)) => {
                Err(PyRuntimeError::new_err("granchain panicked; please report what standard error says"))
            }
        }
    })
}
