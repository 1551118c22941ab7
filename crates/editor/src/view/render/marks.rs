//! Small balls and thin lines of constant size on the screen, drawn slightly in front of the
//! surface.

use nalgebra::Point3;
use three_d::{Blend, Context, Cull, DepthTest, InstanceBuffer, Program, RenderStates, WriteMask};

use super::frame::{DrawFrame, LocalFrame};
use super::shaders;
use super::style::Style;
use super::surface::Data;

/// A small ball at a point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mark {
    /// The centre.
    pub position: Point3<f64>,
    /// The colour in sRGB.
    pub color: [u8; 3],
    /// The diameter in screen points.
    pub size: f32,
}

/// A thin line between two points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Line {
    /// The two ends.
    pub ends: [Point3<f64>; 2],
    /// The colour in sRGB.
    pub color: [u8; 3],
}

/// Draws marks: first the hidden ones faintly, then the visible ones.
pub(super) struct MarkPass {
    program: Program,
    marks: Vec<Mark>,
    is_stale: bool,
    /// Centre and diameter.
    balls: InstanceBuffer<[f32; 4]>,
    tints: InstanceBuffer<[u8; 4]>,
}

impl MarkPass {
    pub(super) fn new(context: &Context) -> Result<Self, String> {
        Ok(Self {
            program: shaders::program(context, &shaders::marks())?,
            marks: Vec::new(),
            is_stale: false,
            balls: InstanceBuffer::new(context),
            tints: InstanceBuffer::new(context),
        })
    }

    pub(super) fn set(&mut self, marks: Vec<Mark>) {
        self.marks = marks;
        self.is_stale = true;
    }

    /// Call this also when the local frame has changed.
    pub(super) fn mark_stale(&mut self) {
        self.is_stale = true;
    }

    pub(super) fn upload(&mut self, frame: &LocalFrame) {
        if !std::mem::take(&mut self.is_stale) || self.marks.is_empty() {
            return;
        }
        let ball = |mark: &Mark| {
            let [x, y, z] = frame.point(&mark.position);
            [x, y, z, mark.size]
        };
        let balls: Vec<_> = self.marks.iter().map(ball).collect();
        let tints: Vec<_> = self.marks.iter().map(|m| opaque(m.color)).collect();
        self.balls.fill(&balls);
        self.tints.fill(&tints);
    }

    pub(super) fn draw(&self, frame: &DrawFrame, style: &Style) {
        if self.marks.is_empty() {
            return;
        }
        let faint = style.hidden_marks.clamp(0.0, 1.0);
        if faint > 0.0 {
            self.draw_where(frame, DepthTest::Greater, faint);
        }
        self.draw_where(frame, DepthTest::LessOrEqual, 1.0);
    }

    fn draw_where(&self, frame: &DrawFrame, depth_test: DepthTest, opacity: f32) {
        let program = &self.program;
        frame.send(program);
        frame.send_screen(program);
        program.use_uniform("opacity", opacity);
        program.use_instance_attribute("ball", &self.balls);
        program.use_instance_attribute("tint", &self.tints);
        program.draw_arrays_instanced(
            states(depth_test),
            frame.viewport,
            CORNERS,
            self.balls.instance_count(),
        );
    }
}

/// Draws lines and vertex normals.
pub(super) struct LinePass {
    program: Program,
    lines: Vec<Line>,
    is_stale: bool,
    segments: Segments,
    normals: Segments,
    /// The colour of the normals on the card, or `None` if they are out of date.
    normals_color: Option<[u8; 3]>,
}

struct Segments {
    starts: InstanceBuffer<[f32; 3]>,
    ends: InstanceBuffer<[f32; 3]>,
    tints: InstanceBuffer<[u8; 4]>,
}

impl LinePass {
    pub(super) fn new(context: &Context) -> Result<Self, String> {
        Ok(Self {
            program: shaders::program(context, &shaders::lines())?,
            lines: Vec::new(),
            is_stale: false,
            segments: Segments::new(context),
            normals: Segments::new(context),
            normals_color: None,
        })
    }

    pub(super) fn set(&mut self, lines: Vec<Line>) {
        self.lines = lines;
        self.is_stale = true;
    }

    /// Call this when the shape or the local frame has changed.
    pub(super) fn mark_stale(&mut self) {
        self.is_stale = true;
        self.normals_color = None;
    }

    pub(super) fn upload(&mut self, frame: &LocalFrame, data: &Data, style: &Style) {
        if std::mem::take(&mut self.is_stale) {
            let ends = |i: usize| self.lines.iter().map(move |l| frame.point(&l.ends[i]));
            let (starts, ends) = (ends(0).collect::<Vec<_>>(), ends(1).collect::<Vec<_>>());
            let tints: Vec<_> = self.lines.iter().map(|l| opaque(l.color)).collect();
            self.segments.fill(&starts, &ends, &tints);
        }
        if let Some(color) = style.normals
            && self.normals_color != Some(color)
        {
            self.normals_color = Some(color);
            let length = NORMAL_LENGTH * mean_edge_length(data);
            let tip = |(p, n): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|k| p[k] + length * n[k]);
            let tips: Vec<_> = data.positions.iter().zip(&data.normals).map(tip).collect();
            let tints = vec![opaque(color); tips.len()];
            self.normals.fill(&data.positions, &tips, &tints);
        }
    }

    pub(super) fn draw(&self, frame: &DrawFrame, style: &Style) {
        if !self.lines.is_empty() {
            self.segments.draw(&self.program, frame);
        }
        if style.normals.is_some() {
            self.normals.draw(&self.program, frame);
        }
    }
}

impl Segments {
    fn new(context: &Context) -> Self {
        Self {
            starts: InstanceBuffer::new(context),
            ends: InstanceBuffer::new(context),
            tints: InstanceBuffer::new(context),
        }
    }

    fn fill(&mut self, starts: &[[f32; 3]], ends: &[[f32; 3]], tints: &[[u8; 4]]) {
        self.starts.fill(starts);
        self.ends.fill(ends);
        self.tints.fill(tints);
    }

    fn draw(&self, program: &Program, frame: &DrawFrame) {
        if self.starts.instance_count() == 0 {
            return;
        }
        frame.send(program);
        frame.send_screen(program);
        program.use_instance_attribute("start", &self.starts);
        program.use_instance_attribute("end", &self.ends);
        program.use_instance_attribute("tint", &self.tints);
        program.draw_arrays_instanced(
            states(DepthTest::LessOrEqual),
            frame.viewport,
            CORNERS,
            self.starts.instance_count(),
        );
    }
}

fn opaque([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [red, green, blue, 255]
}

fn mean_edge_length(data: &Data) -> f32 {
    let length = |[i, j, _]: &[u32; 3]| {
        let (p, q) = (data.positions[*i as usize], data.positions[*j as usize]);
        let square: f32 = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum();
        f64::from(square).sqrt()
    };
    let sum: f64 = data.triangles.iter().map(length).sum();
    (sum / data.triangles.len().max(1) as f64) as f32
}

/// The render states of marks and lines.
///
/// They do not write depth: their soft borders would cut into each other.
fn states(depth_test: DepthTest) -> RenderStates {
    RenderStates {
        depth_test,
        write_mask: WriteMask::COLOR,
        blend: Blend::STANDARD_TRANSPARENCY,
        cull: Cull::None,
    }
}

/// Two triangles make a rectangle.
const CORNERS: u32 = 6;

/// Length of a normal in edges, short enough that neighbouring normals do not meet on a curved
/// surface.
const NORMAL_LENGTH: f32 = 0.8;
