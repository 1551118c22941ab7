//! What a person sees: results on standard output, everything else on standard error.
//!
//! All of it is [`Text`], so that no name from a file acts on the terminal.

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

/// How much is said.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Volume {
    /// Errors only.
    Quiet,
    /// Warnings; on a terminal also progress and a summary.
    Normal,
    /// Phases and summary, also in a pipe.
    Verbose,
}

/// The two streams.
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
            // Fails only if there is a subscriber already, as in tests: then that one serves.
            let _ = tracing_subscriber::fmt()
                .with_max_level(level)
                .with_writer(|| Log)
                .without_time()
                .with_target(false)
                // Colours would be made visible together with what a file brings along.
                .with_ansi(false)
                .try_init();
        }
        Self {
            volume,
            on_terminal: std::io::stderr().is_terminal(),
        }
    }

    /// A result, to standard output. A reader that has gone away (`| head`) is no error.
    pub(crate) fn print(&self, text: &Text) -> Result<(), CliError> {
        self.print_own(text.as_str())
    }

    /// As [`Self::print`], for what no file has a part in.
    pub(crate) fn print_own(&self, text: &str) -> Result<(), CliError> {
        let mut out = std::io::stdout().lock();
        match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
            Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::Output(e)),
            _ => Ok(()),
        }
    }

    /// Whether a command should print what it did, where nobody asked for it.
    pub(crate) fn wants_summary(&self) -> bool {
        self.volume == Volume::Verbose || (self.volume == Volume::Normal && self.on_terminal)
    }

    /// Whether nothing but errors may be said.
    pub(crate) fn is_quiet(&self) -> bool {
        self.volume == Volume::Quiet
    }

    /// Something that did not stop the command but should be known.
    pub(crate) fn warn(&self, warning: impl Display) {
        if self.volume > Volume::Quiet {
            say(&Text::of(format_args!("warning: {warning}")));
        }
    }

    /// A summary, to standard error.
    pub(crate) fn note(&self, text: &Text) {
        if self.wants_summary() {
            say(text);
        }
    }

    /// A bar over the iterations; it shows on a terminal only.
    pub(crate) fn progress(&self, iterations: usize) -> Progress {
        let target = match self.volume {
            Volume::Quiet => ProgressDrawTarget::hidden(),
            // Hides itself where standard error is no terminal.
            _ => ProgressDrawTarget::stderr(),
        };
        let bar = ProgressBar::with_draw_target(Some(iterations as u64), target);
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style.progress_chars("=> "));
        }
        Progress { bar }
    }
}

const TEMPLATE: &str = "{prefix:>11} [{bar:32}] {pos}/{len} {msg}";

/// Prints an error, the last thing that a failing command does.
pub(crate) fn print_error(error: &CliError) {
    say(&Text::of(format_args!("error: {error}")));
}

/// Prints why the command line was not understood, or the help that it asks for.
pub(crate) fn print_usage(mut usage: clap::Error) {
    // What it quotes may be a file's name, as a shell's pattern found it.
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
    // If the stream is gone, there is no one left to tell.
    let _ = usage.print();
}

/// From now on a panic is told in one printable line: it is a fault of the program, but its message
/// may quote a file.
pub(crate) fn tell_panics() {
    std::panic::set_hook(Box::new(|info: &PanicHookInfo<'_>| {
        let message = info.payload_as_str().unwrap_or("of unknown cause");
        let place = info
            .location()
            .map_or_else(String::new, |place| format!(" at {place}"));
        say(&Text::of(format_args!(
            "error: this is a fault in cotan, please report it: panic{place}: {message}"
        )));
    }));
}

/// Standard error; if it is gone, there is no one left to tell.
fn say(text: &Text) {
    let _ = std::io::stderr().lock().write_all(text.as_str().as_bytes());
}

/// Standard error for the log, which hands over one event at a time.
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

/// A progress bar that goes away when it is dropped.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Names what is going on.
    pub(crate) fn phase(&self, name: &'static str) {
        tracing::info!("{name}");
        self.bar.set_prefix(name);
        self.bar.enable_steady_tick(Duration::from_millis(100));
    }

    /// After an iteration.
    pub(crate) fn step(&self, iteration: usize, change: f64) {
        self.bar.set_position(iteration as u64);
        self.bar.set_message(format!("change {change:.1e}"));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
