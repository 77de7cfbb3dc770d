//! Work without the interpreter's lock, while its caller waits for Ctrl-C and tells of the progress.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
        mpsc::{RecvTimeoutError, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

use pyo3::{exceptions::PyRuntimeError, prelude::*};

/// Between two looks at Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// How long the end of the interpreter waits for work that was asked to stop.
const PATIENCE: Duration = Duration::from_secs(10);

/// Whether the interpreter ends, and calls that are waiting for their work.
static ENDS: AtomicBool = AtomicBool::new(false);
static WAITING: AtomicUsize = AtomicUsize::new(0);

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
        self.stop.load(Ordering::Relaxed) || ENDS.load(Ordering::Relaxed)
    }

    /// Calls `progress` if work was done since the last `reported`.
    fn report(&self, py: Python<'_>, progress: Option<&Py<PyAny>>, reported: &mut u64) -> PyResult<()> {
        let (done, all) = (self.done.load(Ordering::Relaxed), self.all.load(Ordering::Relaxed));
        let Some(progress) = progress.filter(|_| all > 0 && done != *reported) else { return Ok(()) };
        *reported = done;
        progress.call1(py, (done, all)).map(drop)
    }
}

/// One of the calls that are waiting.
struct Waiting;

impl Waiting {
    fn begin() -> Self {
        WAITING.fetch_add(1, Ordering::SeqCst);
        Self
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        WAITING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Stop all work and wait for its callers, daemon threads among them: none of them may come back into an interpreter that has ended.
#[pyfunction]
pub fn end(py: Python<'_>) {
    ENDS.store(true, Ordering::Relaxed);
    let begun = Instant::now();
    while WAITING.load(Ordering::SeqCst) > 0 && begun.elapsed() < PATIENCE {
        py.detach(|| thread::sleep(LOOK));
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
    let _waiting = Waiting::begin();
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
