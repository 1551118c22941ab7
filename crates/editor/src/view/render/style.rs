//! How the picture looks.

/// How the picture looks. Colours are sRGB.
#[derive(Clone, PartialEq, Debug)]
pub struct Style {
    /// How normals are made.
    pub shading: Shading,
    /// The colour of the edges, or none are drawn.
    pub wireframe: Option<[u8; 3]>,
    /// The colour of the outside where vertices have none of their own.
    pub base: [u8; 3],
    /// The tint of the inside, seen through a hole or where the surface is turned over.
    pub inside: [u8; 3],
    /// What is behind the mesh.
    pub background: [u8; 3],
    /// The colours of the tints 1, 2, … of [`Renderer::set_tints`](super::Renderer::set_tints).
    pub palette: Palette,
    /// The colour of the vertex normals, or none are drawn.
    pub normals: Option<[u8; 3]>,
    /// How much is seen of marks behind the surface: 0 for nothing, 1 as if there were none.
    pub hidden_marks: f32,
}

/// The colours of the tints 1 to 7.
pub type Palette = [[u8; 3]; 7];

/// How normals are made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Shading {
    /// From those of the vertices.
    #[default]
    Smooth,
    /// From the triangles.
    Flat,
}

impl Style {
    /// For a dark theme.
    #[must_use]
    pub fn dark() -> Self {
        Self {
            background: [38, 40, 44],
            wireframe: None,
            ..Self::light()
        }
    }

    /// For a light theme.
    #[must_use]
    pub fn light() -> Self {
        Self {
            shading: Shading::Smooth,
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

/// Told apart by people of all kinds of colour vision: Okabe and Ito's colours without black.
const PALETTE: Palette = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
];
