//! Output to the user: results on standard output, everything else on standard error.
//!
//! All output is [`Text`], so names from files cannot control the terminal.

use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::panic::PanicHookInfo;
use std::time::Duration;

use clap::error::{ContextKind, ContextValue};
use cotan_io::printable;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::args::Messages;
use crate::error::CliError;
use crate::text::Text;

/// The verbosity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Volume {
    /// Errors only.
    Quiet,
    /// Warnings; on a terminal also progress and a summary.
    Normal,
    /// Phases and summary, also in a pipe.
    Verbose,
}

/// Standard output and standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Console {
    volume: Volume,
    on_terminal: bool,
}

impl Console {
    pub(crate) fn new(messages: &Messages) -> Self {
        let volume = match (messages.quiet, messages.verbose) {
            (true, _) => Volume::Quiet,
            (false, 0) => Volume::Normal,
            (false, _) => Volume::Verbose,
        };
        if let Some(level) = match messages.verbose {
            0 => None,
            1 => Some(tracing::Level::INFO),
            2 => Some(tracing::Level::DEBUG),
            _ => Some(tracing::Level::TRACE),
        } {
            // Fails only if there is already a subscriber, as in tests. That one is used then.
            let _ = tracing_subscriber::fmt()
                .with_max_level(level)
                .with_writer(|| Log)
                .without_time()
                .with_target(false)
                // Escape sequences for colours would be escaped along with those from files.
                .with_ansi(false)
                .try_init();
        }
        Self {
            volume,
            on_terminal: std::io::stderr().is_terminal(),
        }
    }

    /// Prints a result to standard output. A closed pipe (`| head`) is not an error.
    pub(crate) fn print(&self, text: &Text) -> Result<(), CliError> {
        self.print_own(text.as_str())
    }

    /// Like [`Self::print`], for text that contains nothing from a file.
    pub(crate) fn print_own(&self, text: &str) -> Result<(), CliError> {
        let mut out = std::io::stdout().lock();
        match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
            Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::Output(e)),
            _ => Ok(()),
        }
    }

    /// Returns `true` if a command should print a summary that was not requested.
    pub(crate) fn wants_summary(&self) -> bool {
        self.volume == Volume::Verbose || (self.volume == Volume::Normal && self.on_terminal)
    }

    /// Returns `true` if only errors may be printed.
    pub(crate) fn is_quiet(&self) -> bool {
        self.volume == Volume::Quiet
    }

    /// Prints a warning: something that did not stop the command but that the user should know.
    pub(crate) fn warn(&self, warning: impl Display) {
        if self.volume > Volume::Quiet {
            say(&Text::of(format_args!("warning: {warning}")));
        }
    }

    /// Prints a note about something the command did in addition to its task.
    pub(crate) fn inform(&self, text: impl Display) {
        if self.volume > Volume::Quiet {
            say(&Text::of(format_args!("note: {text}")));
        }
    }

    /// Prints a summary to standard error.
    pub(crate) fn note(&self, text: &Text) {
        if self.wants_summary() {
            say(text);
        }
    }

    /// A progress bar over the iterations, shown on a terminal only; `None` for work without one.
    pub(crate) fn progress(&self, iterations: Option<usize>) -> Progress {
        let Some(iterations) = iterations else {
            return Progress { bar: None };
        };
        let target = match self.volume {
            Volume::Quiet => ProgressDrawTarget::hidden(),
            // Hidden automatically if standard error is not a terminal.
            _ => ProgressDrawTarget::stderr(),
        };
        let bar = ProgressBar::with_draw_target(Some(iterations as u64), target);
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style.progress_chars("=> "));
        }
        Progress { bar: Some(bar) }
    }
}

const TEMPLATE: &str = "{prefix:>11} [{bar:32}] {pos}/{len} {msg}";

/// Prints an error. This is the last thing a failing command does.
pub(crate) fn print_error(error: &CliError) {
    say(&Text::of(format_args!("error: {error}")));
}

/// Prints a usage error or the requested help.
pub(crate) fn print_usage(mut usage: clap::Error) {
    // Quoted arguments may be file names expanded by the shell.
    let quoted: Vec<(ContextKind, String)> = usage
        .context()
        .filter_map(|(kind, value)| match value {
            ContextValue::String(text) => Some((kind, text.clone())),
            _ => None,
        })
        .collect();
    for (kind, text) in quoted {
        usage.insert(kind, ContextValue::String(printable(&text).into_owned()));
    }
    // If the stream is closed, there is nowhere to report it.
    let _ = usage.print();
}

/// Installs a panic hook that prints one printable line.
///
/// A panic is a bug in this program, but its message may quote a file.
pub(crate) fn install_panic_hook() {
    std::panic::set_hook(Box::new(|info: &PanicHookInfo<'_>| {
        let payload = info.payload();
        let message = payload.downcast_ref::<&str>().copied();
        let message = message.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        let message = message.unwrap_or("of unknown cause");
        let place = info
            .location()
            .map_or_else(String::new, |place| format!(" at {place}"));
        say(&Text::of(format_args!(
            "error: this is a bug in cotan, please report it: panic{place}: {message}"
        )));
    }));
}

/// Prints to standard error. If it is closed, the text is dropped.
fn say(text: &Text) {
    let _ = std::io::stderr().lock().write_all(text.as_str().as_bytes());
}

/// Standard error as the writer of the log, which passes one event at a time.
struct Log;

impl Write for Log {
    fn write(&mut self, event: &[u8]) -> std::io::Result<usize> {
        say(&Text::of(String::from_utf8_lossy(event).trim_end()));
        Ok(event.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A progress bar that is removed when it is finished or dropped.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Sets the name of the current phase.
    pub(crate) fn phase(&self, name: &'static str) {
        if let Some(bar) = &self.bar {
            tracing::info!("{name}");
            bar.set_prefix(name);
            bar.enable_steady_tick(Duration::from_millis(100));
        }
    }

    /// Updates the bar after an iteration.
    pub(crate) fn step(&self, iteration: usize, change: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position(iteration as u64);
            bar.set_message(format!("change {change:.1e}"));
        }
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar
            && !bar.is_finished()
        {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}
