//! A record of every frame for tests and measurements, one line of JSON per frame.
//!
//! The trace is output only. A test moves the real pointer and presses real keys; from the trace
//! it learns the positions of widgets and the time at which each frame was drawn.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use eframe::egui::{self, Pos2, Rect};
use serde_json::json;

use cotan_workspace::solver::State;

use super::Editor;

/// The trace file.
#[derive(Debug)]
pub struct Trace {
    file: BufWriter<File>,
    /// Seconds since 1970 when `clock` was read.
    epoch: f64,
    clock: Instant,
    frame: u64,
    widgets: BTreeMap<String, [f32; 4]>,
    /// The pointer position for each goal of a drag.
    pointers: BTreeMap<u64, Pos2>,
    /// The goal whose shape arrived in this frame, and its times.
    taken: Option<(u64, [f64; 3])>,
}

impl Trace {
    /// Creates the trace file.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub fn create(path: &Path) -> std::io::Result<Self> {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        Ok(Self {
            file: BufWriter::new(File::create(path)?),
            epoch: since.map_or(0.0, |since| since.as_secs_f64()),
            clock: Instant::now(),
            frame: 0,
            widgets: BTreeMap::new(),
            pointers: BTreeMap::new(),
            taken: None,
        })
    }

    /// Seconds since 1970.
    fn at(&self, instant: Instant) -> f64 {
        self.epoch + instant.saturating_duration_since(self.clock).as_secs_f64()
    }

    /// Records that a shape has arrived.
    pub(super) fn taken(&mut self, tag: u64, times: [Instant; 3]) {
        self.taken = Some((tag, times.map(|t| self.at(t))));
    }
}

impl Editor {
    /// Records the position of a widget on the screen.
    pub(super) fn mark(&mut self, name: &str, rect: Rect) {
        if let Some(trace) = &mut self.startup.trace {
            let sides = [rect.left(), rect.top(), rect.right(), rect.bottom()];
            trace.widgets.insert(name.to_owned(), sides);
        }
    }

    /// Records the pointer position of the goal that was just posted.
    pub(super) fn note_pointer(&mut self, ctx: &egui::Context) {
        let tag = self.workspace.solver().tag();
        if let Some(trace) = &mut self.startup.trace
            && let Some(pos) = ctx.input(|i| i.pointer.latest_pos())
        {
            trace.pointers.entry(tag).or_insert(pos);
        }
    }

    /// Writes the line of the frame that started at `begin`.
    pub(super) fn write_trace(&mut self, ctx: &egui::Context, begin: Instant) {
        if self.startup.trace.is_none() {
            return;
        }
        self.note_pointer(ctx);
        let (state, choice) = self.workspace.solver().state();
        let scene = self.scene();
        let handles: Vec<_> = scene
            .map(|scene| {
                let marks = scene.handles().iter().map(|group| {
                    let center = group.center(scene.rest.positions());
                    json!({ "name": group.name, "vertices": group.vertices.len(), "at": center.coords.as_slice() })
                });
                marks.collect()
            })
            .unwrap_or_default();
        let is_settled = scene.is_some_and(|scene| scene.is_settled);
        let history = self.workspace.model().map(cotan_workspace::Model::history);
        let label = history.map(|history| history.present().label.clone());
        let viewport = self
            .startup
            .trace
            .as_ref()
            .and_then(|t| t.widgets.get("viewport").copied());
        let view = viewport.map(|[left, top, right, bottom]| {
            let rect = Rect::from_min_max(egui::pos2(left, top), egui::pos2(right, bottom));
            let matrix = self.shown.camera.view_projection(rect);
            // In row-major order.
            matrix.transpose().as_slice().to_vec()
        });
        let timing = self.shown.renderer().timing();
        let selected = scene.map(|scene| scene.selection()).unwrap_or_default();
        let file = self.workspace.model().map(cotan_workspace::Model::file);
        let selection: Vec<usize> = selected
            .iter()
            .take(8)
            .filter_map(|&v| Some(file?.processing.document_vertex(v)))
            .collect();
        let samples = self.workspace.solver().samples();
        let last = samples
            .last()
            .map(|s| (s.iteration, s.residual, s.milliseconds));
        let path = file.map(|file| file.path.clone());
        let size = file.map(|file| {
            let mesh = file.processing.mesh();
            [mesh.num_vertices(), mesh.num_faces()]
        });
        let line = json!({
            "path": path,
            "size": size,
            "tag": self.workspace.solver().tag(),
            "state": match &state {
                State::Idle => "idle",
                State::Preparing => "preparing",
                State::Running => "running",
                State::Settled => "settled",
                State::Failed(_) => "failed",
            },
            "problem": match &state { State::Failed(text) => Some(text), _ => None },
            "strategy": choice,
            "is_settled": is_settled,
            "is_changed": self.workspace.is_changed(),
            "is_dragging": self.pointer.drag.is_some(),
            "label": label,
            "undo": history.and_then(cotan_workspace::History::undo_label),
            "dialog": self.dialogs.name(),
            "task": self.workspace.job().map(|(name, _)| name),
            "handles": handles,
            "active": scene.and_then(|scene| scene.props.active),
            "selected": selected.len(),
            "typed": self.pointer.hand.as_ref().map(super::typing::Hand::text),
            "mirror": scene.is_some_and(|scene| scene.props.mirror.is_some()),
            "hidden": scene.map_or(0, |scene| scene.hidden().len()),
            "selection": selection,
            "last_step": last,
            "steps": samples.len(),
            "errors": self.shown.reading().and_then(|r| r.errors).map(|e| [e.parameterization, e.geometry]),
            "morph": self.workspace.morph().map(cotan_workspace::Morph::share),
            "view": view,
            "pixels_per_point": ctx.pixels_per_point(),
            "upload_ms": 1e3 * timing.upload.as_secs_f64(),
            "draw_ms": 1e3 * timing.draw.as_secs_f64(),
        });
        if let Some(trace) = &mut self.startup.trace {
            trace.write(line, begin);
        }
    }
}

impl Trace {
    fn write(&mut self, mut line: serde_json::Value, begin: Instant) {
        self.frame += 1;
        if let Some(fields) = line.as_object_mut() {
            fields.insert("frame".to_owned(), json!(self.frame));
            // When this frame starts, the previous one is on the screen.
            fields.insert("begin".to_owned(), json!(self.at(begin)));
            fields.insert("end".to_owned(), json!(self.at(Instant::now())));
            fields.insert("widgets".to_owned(), json!(self.widgets));
            if let Some((tag, times)) = self.taken.take() {
                fields.insert("taken".to_owned(), json!({ "tag": tag, "times": times }));
                let pointer = self.pointers.get(&tag).map(|p| [p.x, p.y]);
                fields.insert("pointer_of_taken".to_owned(), json!(pointer));
                self.pointers.retain(|&t, _| t >= tag);
            }
        }
        self.widgets.clear();
        // A failure to write the trace must not stop the editor.
        let _ = writeln!(self.file, "{line}").and_then(|()| self.file.flush());
    }
}
