//! The look of the picture.

/// The look of the picture. Colours are sRGB.
#[derive(Clone, PartialEq, Debug)]
pub struct Style {
    /// The source of the normals.
    pub shading: Shading,
    /// The light on the surface.
    pub light: Light,
    /// The colour of the edges, or `None` to hide them.
    pub wireframe: Option<[u8; 3]>,
    /// The colour of the outside where vertices have no colour of their own.
    pub base: [u8; 3],
    /// The tint of the inside, visible through holes or where the surface is flipped.
    pub inside: [u8; 3],
    /// The background colour.
    pub background: [u8; 3],
    /// The colours of the tints 1, 2, … of [`Renderer::set_tints`](super::Renderer::set_tints).
    pub palette: Palette,
    /// The colour of the vertex normals, or `None` to hide them.
    pub normals: Option<[u8; 3]>,
    /// Opacity of marks behind the surface, from 0 (invisible) to 1 (as if there were no
    /// surface).
    pub hidden_marks: f32,
}

/// The colours of the tints 1 to 7.
pub type Palette = [[u8; 3]; 7];

/// The source of the normals.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Shading {
    /// Vertex normals.
    #[default]
    Smooth,
    /// Face normals.
    Flat,
}

/// The light on the surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Light {
    /// A key light above the eye and a soft one from the sky.
    #[default]
    Studio,
    /// A light at the eye: nothing is in the dark.
    Eye,
    /// A picture of a ball of clay, looked up by the normal.
    Clay,
}

impl Light {
    /// The next one, to go through all of them.
    #[must_use]
    pub fn next(self) -> Self {
        match self {
            Self::Studio => Self::Eye,
            Self::Eye => Self::Clay,
            Self::Clay => Self::Studio,
        }
    }
}

impl Style {
    /// The style for a dark theme.
    #[must_use]
    pub fn dark() -> Self {
        Self {
            background: [38, 40, 44],
            wireframe: None,
            ..Self::light()
        }
    }

    /// The style for a light theme.
    #[must_use]
    pub fn light() -> Self {
        Self {
            shading: Shading::Smooth,
            light: Light::Studio,
            wireframe: None,
            base: [205, 208, 214],
            inside: [196, 132, 92],
            background: [236, 238, 241],
            palette: PALETTE,
            normals: None,
            hidden_marks: 0.25,
        }
    }
}

/// Colours that are distinguishable with any kind of colour vision: those of Okabe and Ito
/// without black.
const PALETTE: Palette = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
];
