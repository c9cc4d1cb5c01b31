//! One QEMU process that runs the image, and the serial line to it.
//!
//! The board is `netduinoplus2` (STM32F405). `-icount shift=0` ties virtual time to instructions:
//! one nanosecond each, so the board's 1 GHz timer counts instructions, repeatably. The serial
//! line is a TCP connection on the loopback interface; the image's log comes out of QEMU's
//! standard output (semihosting) into a file. Every wait has a limit, and the process ends with
//! its [`Machine`].

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

const PROGRAM: &str = "qemu-system-arm";
/// QEMU opens its side of the line within milliseconds; a loaded machine gets more.
const CONNECT_TIME_MAX: Duration = Duration::from_secs(20);
const END_TIME_MAX: Duration = Duration::from_secs(1);
const POLL_TIME: Duration = Duration::from_millis(5);

/// Why the machine cannot be used (any longer).
#[derive(Debug, thiserror::Error)]
pub enum QemuError {
    /// QEMU is not installed.
    #[error("{PROGRAM} not found: run tests/setup.sh, or install QEMU for Arm systems")]
    Missing,
    /// A file, process or socket operation failed.
    #[error("QEMU: {action}: {cause}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// What the system said.
        cause: io::Error,
    },
    /// QEMU did not open the serial line in time.
    #[error("QEMU did not open its serial line within {} s", CONNECT_TIME_MAX.as_secs())]
    NoLine,
    /// QEMU ended, or the image made it end.
    #[error("QEMU ended early ({status}){}", if stderr.is_empty() { String::new() } else { format!(": {stderr}") })]
    Ended {
        /// Its exit status.
        status: ExitStatus,
        /// What it said.
        stderr: String,
    },
    /// The image sent nothing for this long.
    #[error("the image did not answer within {} s", limit.as_secs())]
    Silent {
        /// The limit that was reached.
        limit: Duration,
    },
}

/// A running image. Dropping it ends the process.
#[derive(Debug)]
pub struct Machine {
    process: Process,
    line: BufReader<TcpStream>,
    answer_time_max: Duration,
}

#[derive(Debug)]
struct Process {
    child: Child,
    /// Holds what the process writes.
    folder: TempDir,
}

const LOG_FILE: &str = "log";
const STDERR_FILE: &str = "stderr";

impl Machine {
    /// Starts `image` and connects its serial port. A read or write that takes longer than
    /// `answer_time_max` is an error.
    ///
    /// # Errors
    /// QEMU is missing, or did not come up.
    pub fn boot(image: &Path, answer_time_max: Duration) -> Result<Self, QemuError> {
        let io = |action| move |cause| QemuError::Io { action, cause };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))
            .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
            .map_err(io("open a local port"))?;
        let address = listener.local_addr().map_err(io("open a local port"))?;
        let mut process = Process::start(image, address.port())?;
        let line = process.accept(&listener)?;
        line.set_nonblocking(false)
            .and_then(|()| line.set_nodelay(true))
            .and_then(|()| line.set_read_timeout(Some(answer_time_max)))
            .and_then(|()| line.set_write_timeout(Some(answer_time_max)))
            .map_err(io("set the serial line up"))?;
        Ok(Self {
            process,
            line: BufReader::new(line),
            answer_time_max,
        })
    }

    /// Sends bytes to the image.
    ///
    /// # Errors
    /// The line is closed or stuck.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), QemuError> {
        let sent = self.line.get_mut().write_all(bytes);
        sent.map_err(|cause| self.explain("write to the serial line", cause))
    }

    /// Waits for one byte from the image.
    ///
    /// # Errors
    /// Nothing came in time, or QEMU ended.
    pub fn receive(&mut self) -> Result<u8, QemuError> {
        let mut byte = [0u8];
        match self.line.read_exact(&mut byte) {
            Ok(()) => Ok(byte[0]),
            Err(cause) => Err(self.explain("read from the serial line", cause)),
        }
    }

    /// All the image has logged so far, still encoded.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub fn log(&self) -> Result<Vec<u8>, QemuError> {
        std::fs::read(self.process.folder.path().join(LOG_FILE)).map_err(|cause| QemuError::Io {
            action: "read the log",
            cause,
        })
    }

    fn explain(&mut self, action: &'static str, cause: io::Error) -> QemuError {
        if matches!(
            cause.kind(),
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
        ) {
            return QemuError::Silent {
                limit: self.answer_time_max,
            };
        }
        // A closed line mostly means that the process is ending: give it a moment to be gone.
        let deadline = Instant::now() + END_TIME_MAX;
        while Instant::now() < deadline {
            if let Some(ended) = self.process.ended() {
                return ended;
            }
            std::thread::sleep(POLL_TIME);
        }
        QemuError::Io { action, cause }
    }
}

impl Process {
    fn start(image: &Path, port: u16) -> Result<Self, QemuError> {
        let io = |action| move |cause| QemuError::Io { action, cause };
        let folder = tempfile::tempdir().map_err(io("make a temporary folder"))?;
        let file = |name| File::create(folder.path().join(name)).map_err(io("make a file"));
        let child = Command::new(PROGRAM)
            .args(["-machine", "netduinoplus2", "-icount", "shift=0"])
            .args(["-display", "none", "-monitor", "none", "-nodefaults"])
            .arg("-chardev")
            .arg(format!(
                "socket,id=line,host=127.0.0.1,port={port},nodelay=on"
            ))
            .args(["-serial", "chardev:line"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args([OsStr::new("-kernel"), image.as_os_str()])
            .stdin(Stdio::null())
            .stdout(file(LOG_FILE)?)
            .stderr(file(STDERR_FILE)?)
            .spawn()
            .map_err(|cause| match cause.kind() {
                io::ErrorKind::NotFound => QemuError::Missing,
                _ => QemuError::Io {
                    action: "start",
                    cause,
                },
            })?;
        Ok(Self { child, folder })
    }

    /// Waits for QEMU to connect, but no longer than it lives.
    fn accept(&mut self, listener: &TcpListener) -> Result<TcpStream, QemuError> {
        let deadline = Instant::now() + CONNECT_TIME_MAX;
        while Instant::now() < deadline {
            match listener.accept() {
                Ok((line, _)) => return Ok(line),
                Err(cause) if cause.kind() == io::ErrorKind::WouldBlock => {}
                Err(cause) => {
                    return Err(QemuError::Io {
                        action: "connect the serial line",
                        cause,
                    });
                }
            }
            if let Some(ended) = self.ended() {
                return Err(ended);
            }
            std::thread::sleep(POLL_TIME);
        }
        Err(QemuError::NoLine)
    }

    /// How the process ended, if it did.
    fn ended(&mut self) -> Option<QemuError> {
        let status = self.child.try_wait().ok()??;
        let text = std::fs::read(self.folder.path().join(STDERR_FILE)).unwrap_or_default();
        Some(QemuError::Ended {
            status,
            stderr: String::from_utf8_lossy(&text).trim().replace('\n', "; "),
        })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail only when the process is gone already, which is what is wanted.
        if self.child.kill().is_ok() {
            self.child.wait().ok();
        }
    }
}
