//! Loaded into a program with `LD_PRELOAD`: counts the system calls that change something below a folder and, at call number K, ends the
//! process or makes the call fail.
//!
//! The calls are caught by a seccomp filter that this library sets up in its own process (`SECCOMP_RET_TRAP`), not by functions of the same
//! name: `tempfile` renames and unlinks, and granchain exchanges two folders, through `rustix`, whose `linux_raw` backend enters the kernel
//! without calling libc at all. The handler of `SIGSYS` looks at the call, and carries it out itself with [`PASS`] as sixth argument, which the
//! filter lets through: none of the calls caught has six.
//!
//! | variable | |
//! |---|---|
//! | `FAULTS_ROOT` | the folder; without it nothing is done |
//! | `FAULTS_LOG` | file outside of it that gets a line a call: number, name, path, second path |
//! | `FAULTS_AT` | K, from 1; 0 or none: only count |
//! | `FAULTS_DO` | `count` · `stop` before every call from K on, and in the middle of every write (`SIGSTOP`) · `kill` before the call · `tear`: half of a write, then kill · `full`: `ENOSPC` for this call and all after it that take space · `full-once`: for this call alone · `broken`, `broken-once`: `EIO`, for every call |
//!
//! Under `full` a first write is cut in half, as a disk that fills up does it; the next call is the first that fails.

#[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
compile_error!("the filter and the registers are those of Linux on x86-64");

use std::{
    ffi::{CStr, c_char, c_int, c_long, c_void},
    sync::atomic::{AtomicBool, AtomicI32, AtomicU8, AtomicU64, AtomicUsize, Ordering},
};

/// Sixth argument of a call that is let through.
const PASS: u64 = 0x6772_616e_6368_6169;

/// Longest path, bytes.
const LONGEST: usize = 4096;

/// What the first arguments of a call are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    /// A path.
    Path,
    /// A folder's descriptor and a path.
    At,
    /// Two paths.
    Paths,
    /// Two of descriptor and path.
    Ats,
    /// A text and a path.
    Link,
    /// A text, a descriptor and a path.
    LinkAt,
    /// An open file.
    Open,
    /// An open file that is written to: bytes and their number, or pieces and theirs.
    Write,
}

struct Call {
    number: c_long,
    name: &'static str,
    form: Form,
    /// Whether it can fail for want of space.
    takes_space: bool,
}

const fn call(number: c_long, name: &'static str, form: Form, takes_space: bool) -> Call {
    Call { number, name, form, takes_space }
}

const CALLS: [Call; 27] = [
    call(libc::SYS_open, "open", Form::Path, true),
    call(libc::SYS_openat, "open", Form::At, true),
    call(libc::SYS_openat2, "open", Form::At, true),
    call(libc::SYS_creat, "open", Form::Path, true),
    call(libc::SYS_write, "write", Form::Write, true),
    call(libc::SYS_pwrite64, "pwrite", Form::Write, true),
    call(libc::SYS_writev, "writev", Form::Open, true),
    call(libc::SYS_pwritev, "pwritev", Form::Open, true),
    call(libc::SYS_sendfile, "sendfile", Form::Open, true),
    call(libc::SYS_fallocate, "fallocate", Form::Open, true),
    call(libc::SYS_ftruncate, "ftruncate", Form::Open, false),
    call(libc::SYS_truncate, "truncate", Form::Path, false),
    call(libc::SYS_fsync, "fsync", Form::Open, true),
    call(libc::SYS_fdatasync, "fdatasync", Form::Open, true),
    call(libc::SYS_rename, "rename", Form::Paths, true),
    call(libc::SYS_renameat, "rename", Form::Ats, true),
    call(libc::SYS_renameat2, "rename", Form::Ats, true),
    call(libc::SYS_link, "link", Form::Paths, true),
    call(libc::SYS_linkat, "link", Form::Ats, true),
    call(libc::SYS_symlink, "symlink", Form::Link, true),
    call(libc::SYS_symlinkat, "symlink", Form::LinkAt, true),
    call(libc::SYS_mkdir, "mkdir", Form::Path, true),
    call(libc::SYS_mkdirat, "mkdir", Form::At, true),
    call(libc::SYS_rmdir, "rmdir", Form::Path, false),
    call(libc::SYS_unlink, "unlink", Form::Path, false),
    call(libc::SYS_unlinkat, "unlink", Form::At, false),
    call(libc::SYS_fchmod, "fchmod", Form::Open, false),
];

/// Opening for reading changes nothing.
const WRITING: c_int = libc::O_WRONLY | libc::O_RDWR | libc::O_CREAT | libc::O_TRUNC;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Act {
    Count,
    Stop,
    Kill,
    Tear,
    Full,
    Broken,
}

const ACTS: [(&[u8], Act, bool); 8] = [
    (b"count", Act::Count, false),
    (b"stop", Act::Stop, false),
    (b"kill", Act::Kill, false),
    (b"tear", Act::Tear, false),
    (b"full", Act::Full, false),
    (b"full-once", Act::Full, true),
    (b"broken", Act::Broken, false),
    (b"broken-once", Act::Broken, true),
];

static COUNT: AtomicU64 = AtomicU64::new(0);
static AT: AtomicU64 = AtomicU64::new(0);
static ACT: AtomicU8 = AtomicU8::new(0);
static ONCE: AtomicBool = AtomicBool::new(false);
static LOG: AtomicI32 = AtomicI32::new(-1);
/// The folder, a text that lives as long as the process.
static ROOT: AtomicUsize = AtomicUsize::new(0);

#[used]
#[unsafe(link_section = ".init_array")]
static BEGIN: extern "C" fn() = begin;

/// The variable, if it is set.
fn variable(name: &CStr) -> Option<&'static CStr> {
    // SAFETY: no thread but this one runs yet, and granchain changes no variable.
    let value = unsafe { libc::getenv(name.as_ptr()) };
    // SAFETY: not null, ended by a zero byte.
    (!value.is_null()).then(|| unsafe { CStr::from_ptr(value) })
}

extern "C" fn begin() {
    let Some(root) = variable(c"FAULTS_ROOT") else { return };
    ROOT.store(root.as_ptr() as usize, Ordering::SeqCst);
    if let Some(path) = variable(c"FAULTS_LOG") {
        // SAFETY: plain calls with texts ended by a zero byte. The descriptor goes where nobody counts on a lower one.
        unsafe {
            let file =
                libc::open(path.as_ptr(), libc::O_WRONLY | libc::O_CREAT | libc::O_APPEND | libc::O_CLOEXEC, 0o644);
            LOG.store(libc::fcntl(file, libc::F_DUPFD_CLOEXEC, 500), Ordering::SeqCst);
            libc::close(file);
        }
    }
    let at = variable(c"FAULTS_AT").and_then(|text| text.to_str().ok()?.parse().ok()).unwrap_or(0);
    AT.store(at, Ordering::SeqCst);
    if let Some(wanted) = variable(c"FAULTS_DO") {
        let Some((_, act, once)) = ACTS.iter().find(|(name, ..)| *name == wanted.to_bytes()) else {
            refuse("FAULTS_DO")
        };
        ACT.store(*act as u8, Ordering::SeqCst);
        ONCE.store(*once, Ordering::SeqCst);
    }
    catch();
}

/// A test that catches nothing must not pass.
fn refuse(what: &str) -> ! {
    eprintln!("granchain-faults: {what}: {}", std::io::Error::last_os_error());
    std::process::abort()
}

/// Have every call of the table end in [`caught`].
fn catch() {
    const fn load(offset: usize) -> libc::sock_filter {
        libc::sock_filter { code: (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16, jt: 0, jf: 0, k: offset as u32 }
    }
    const fn equal(value: u32, then: u8, otherwise: u8) -> libc::sock_filter {
        libc::sock_filter {
            code: (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16,
            jt: then,
            jf: otherwise,
            k: value,
        }
    }
    const fn end(value: u32) -> libc::sock_filter {
        libc::sock_filter { code: (libc::BPF_RET | libc::BPF_K) as u16, jt: 0, jf: 0, k: value }
    }
    // struct seccomp_data: number, architecture, instruction, six arguments.
    let mut filter = vec![
        load(16 + 5 * 8),
        equal(PASS as u32, 0, 3),
        load(16 + 5 * 8 + 4),
        equal((PASS >> 32) as u32, 0, 1),
        end(libc::SECCOMP_RET_ALLOW),
        load(0),
    ];
    for call in &CALLS {
        filter.extend([equal(call.number as u32, 0, 1), end(libc::SECCOMP_RET_TRAP)]);
    }
    filter.push(end(libc::SECCOMP_RET_ALLOW));
    let program = libc::sock_fprog { len: filter.len() as u16, filter: filter.as_mut_ptr() };
    // SAFETY: the structures are those that the kernel expects and live through the calls.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = caught as extern "C" fn(c_int, *mut libc::siginfo_t, *mut c_void) as usize;
        action.sa_flags = libc::SA_SIGINFO;
        if libc::sigaction(libc::SIGSYS, &action, std::ptr::null_mut()) != 0 {
            refuse("sigaction");
        }
        if libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
            || libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const program) != 0
        {
            refuse("seccomp");
        }
    }
}

/// The handler. It allocates nothing: the call may have come from anywhere.
extern "C" fn caught(_: c_int, _: *mut libc::siginfo_t, context: *mut c_void) {
    // SAFETY: the kernel hands the context of the call; `rax` still holds its number.
    let registers = unsafe { &mut (*context.cast::<libc::ucontext_t>()).uc_mcontext.gregs };
    let of = |register: c_int| registers[register as usize] as u64;
    let arguments = [libc::REG_RDI, libc::REG_RSI, libc::REG_RDX, libc::REG_R10, libc::REG_R8].map(of);
    let number = of(libc::REG_RAX) as c_long;
    registers[libc::REG_RAX as usize] = answer(number, arguments);
}

/// What the call returns, as the kernel says it: a number, or minus an error.
fn answer(number: c_long, arguments: [u64; 5]) -> i64 {
    let Some(call) = CALLS.iter().find(|call| call.number == number) else { return pass(number, arguments) };
    let flags = match number {
        libc::SYS_open => arguments[1] as c_int,
        libc::SYS_openat => arguments[2] as c_int,
        _ => WRITING,
    };
    let here = libc::AT_FDCWD as u64;
    let [first, second, third, fourth, _] = arguments;
    let paths = match call.form {
        Form::Path => [Path::of(here, first), Path::new()],
        Form::At => [Path::of(first, second), Path::new()],
        Form::Paths => [Path::of(here, first), Path::of(here, second)],
        Form::Ats => [Path::of(first, second), Path::of(third, fourth)],
        Form::Link => [Path::of(here, second), Path::new()],
        Form::LinkAt => [Path::of(second, third), Path::new()],
        Form::Open | Form::Write => [Path::of(first, 0), Path::new()],
    };
    if flags & WRITING == 0 || !paths.iter().any(Path::is_below_root) {
        return pass(number, arguments);
    }
    let count = COUNT.fetch_add(1, Ordering::SeqCst) + 1;
    log(count, call.name, &paths);
    let at = AT.load(Ordering::SeqCst);
    if at == 0 || count < at {
        return pass(number, arguments);
    }
    let [first_half, second_half] = halves(arguments);
    let half = || (call.form == Form::Write && arguments[2] >= 2).then(|| pass(number, first_half));
    let once = ONCE.load(Ordering::SeqCst);
    match ACTS.iter().map(|act| act.1).find(|act| *act as u8 == ACT.load(Ordering::SeqCst)).unwrap_or(Act::Count) {
        Act::Stop => {
            signal(libc::SIGSTOP);
            let Some(written) = half() else { return pass(number, arguments) };
            if written != first_half[2] as i64 {
                return written;
            }
            signal(libc::SIGSTOP);
            match pass(number, second_half) {
                more @ 0.. => written + more,
                _ => written,
            }
        }
        Act::Kill if count == at => signal(libc::SIGKILL),
        Act::Tear if count == at => {
            let written = half();
            signal(libc::SIGKILL);
            written.unwrap_or(0)
        }
        Act::Full if call.takes_space && (!once || count == at) => match (count == at).then(half).flatten() {
            Some(written) => {
                if once {
                    // The next call is the one that fails.
                    AT.store(at + 1, Ordering::SeqCst);
                }
                written
            }
            None => {
                if once {
                    AT.store(0, Ordering::SeqCst);
                }
                -i64::from(libc::ENOSPC)
            }
        },
        Act::Broken if !once || count == at => -i64::from(libc::EIO),
        _ => pass(number, arguments),
    }
}

/// A write as two.
fn halves(arguments: [u64; 5]) -> [[u64; 5]; 2] {
    let (mut first, mut second) = (arguments, arguments);
    first[2] /= 2;
    second[1] += first[2];
    second[2] -= first[2];
    [first, second]
}

/// Stop or end this process; nothing of it goes on until the signal is there.
fn signal(signal: c_int) -> i64 {
    // SAFETY: a plain call.
    unsafe { libc::kill(libc::getpid(), signal) }.into()
}

/// Carry out a call with [`PASS`].
fn pass(number: c_long, arguments: [u64; 5]) -> i64 {
    let answer: i64;
    // SAFETY: the call that the program made, with its own arguments; the sixth is one that no call of the table has.
    unsafe {
        std::arch::asm!(
            "syscall",
            inlateout("rax") number => answer,
            in("rdi") arguments[0],
            in("rsi") arguments[1],
            in("rdx") arguments[2],
            in("r10") arguments[3],
            in("r8") arguments[4],
            in("r9") PASS,
            lateout("rcx") _,
            lateout("r11") _,
        );
    }
    answer
}

/// A path in a buffer.
struct Path {
    bytes: [u8; LONGEST],
    length: usize,
}

impl Path {
    const fn new() -> Self {
        Self { bytes: [0; LONGEST], length: 0 }
    }

    fn push(&mut self, bytes: &[u8]) {
        let fits = bytes.len().min(LONGEST - self.length);
        self.bytes[self.length..self.length + fits].copy_from_slice(&bytes[..fits]);
        self.length += fits;
    }

    /// The path at address `path` (none: the open file itself) from the folder `from`.
    fn of(from: u64, path: u64) -> Self {
        let mut of = Self::new();
        let path: &[u8] = if path == 0 {
            &[]
        } else {
            // SAFETY: an argument of the program that the kernel would read as a text; granchain passes no other.
            unsafe { CStr::from_ptr(path as *const c_char) }.to_bytes()
        };
        if path.first() != Some(&b'/') {
            of.open_file(from as c_int);
            if !path.is_empty() {
                of.push(b"/");
            }
        }
        of.push(path);
        of
    }

    /// Where an open file is.
    fn open_file(&mut self, descriptor: c_int) {
        let mut name = Self::new();
        if descriptor == libc::AT_FDCWD {
            name.push(b"/proc/self/cwd\0");
        } else {
            name.push(b"/proc/self/fd/");
            name.push_number(descriptor as u64);
            name.push(b"\0");
        }
        // SAFETY: a text ended by a zero byte, and a buffer of the length told.
        let length = unsafe { libc::readlink(name.bytes.as_ptr().cast(), self.bytes.as_mut_ptr().cast(), LONGEST) };
        self.length = length.max(0) as usize;
    }

    fn push_number(&mut self, number: u64) {
        if number > 9 {
            self.push_number(number / 10);
        }
        self.push(&[b'0' + (number % 10) as u8]);
    }

    fn is_below_root(&self) -> bool {
        // SAFETY: a text of the environment, set before the filter was.
        let root = unsafe { CStr::from_ptr(ROOT.load(Ordering::SeqCst) as *const c_char) }.to_bytes();
        self.bytes[..self.length].strip_prefix(root).is_some_and(|rest| matches!(rest.first(), None | Some(b'/')))
    }
}

fn log(count: u64, name: &str, paths: &[Path; 2]) {
    let file = LOG.load(Ordering::SeqCst);
    if file < 0 {
        return;
    }
    let mut line = Path::new();
    line.push_number(count);
    for part in [name.as_bytes(), &paths[0].bytes[..paths[0].length], &paths[1].bytes[..paths[1].length]] {
        line.push(b"\t");
        line.push(part);
    }
    line.push(b"\n");
    let _ = pass(libc::SYS_write, [file as u64, line.bytes.as_ptr() as u64, line.length as u64, 0, 0]);
}
