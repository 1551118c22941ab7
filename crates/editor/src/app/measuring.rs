//! Measurements of the shape on the screen.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cotan_workspace::meter::{Field, Meter, Reading, Subject};
use cotan_workspace::{Model, Shape};

/// The measuring thread, and what it was asked last.
pub(super) struct Measuring {
    meter: Meter,
    /// The colouring that is wanted.
    pub(super) field: Field,
    asked: Option<(Shape, Field, Instant)>,
}

impl Measuring {
    pub(super) fn start(notify: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        Ok(Self {
            meter: Meter::start(notify)?,
            field: Field::Plain,
            asked: None,
        })
    }

    pub(super) fn forget(&mut self) {
        self.asked = None;
    }

    pub(super) fn take(&self) -> Option<Reading> {
        self.meter.take()
    }

    /// Asks for a measurement, unless it was asked for already. Returns the time after which to
    /// ask again.
    ///
    /// Without colours the errors need not be measured in every frame while the shape moves.
    pub(super) fn ask(
        &mut self,
        model: &Model,
        shape: &Shape,
        is_moving: bool,
    ) -> Option<Duration> {
        let field = self.field;
        if let Some((asked, of, when)) = &self.asked {
            if asked.is(shape) && *of == field {
                return None;
            }
            if field == Field::Plain && is_moving && when.elapsed() < NUMBERS_EVERY {
                return Some(NUMBERS_EVERY);
            }
        }
        self.asked = Some((shape.clone(), field, Instant::now()));
        self.meter.post(Subject {
            mesh: Arc::clone(&model.file().processing),
            original: model.original().clone(),
            shape: shape.clone(),
            field,
        });
        None
    }
}

/// Interval between measurements while the shape moves and no colours show them.
const NUMBERS_EVERY: Duration = Duration::from_millis(250);
