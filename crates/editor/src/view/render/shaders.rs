//! The shaders, in GLSL 3.30 or ES 3.00; three-d writes the header.

use three_d::{Context, Program};

/// Transforms local coordinates to eye coordinates, in all vertex shaders.
const SEEN: &str = "
uniform vec3 pivot;
uniform vec3 pivot_seen;
uniform mat3 turn;
uniform mat4 projection;

vec3 seen_from_eye(vec3 local) {
    return turn * (local - pivot) + pivot_seen;
}
";

/// A key light slightly above and to the side of the eye, and a soft light from the sky.
///
/// Lighting is linear; a square root approximates the sRGB curve.
const LIGHT: &str = "
vec3 lit(vec3 color, vec3 normal, vec3 to_eye) {
    vec3 key = normalize(vec3(0.25, 0.45, 1.0));
    float direct = max(dot(normal, key), 0.0);
    float sky = 0.5 + 0.5 * normal.y;
    vec3 halfway = normalize(key + to_eye);
    float shine = pow(max(dot(normal, halfway), 0.0), 40.0);
    vec3 light = color * color * (0.14 + 0.20 * sky + 0.72 * direct) + 0.06 * shine;
    return sqrt(light);
}
";

/// With `PULLED` the data of a corner is fetched from textures.
///
/// The wireframe needs weights per corner, which vertices shared by triangles cannot have.
const SURFACE_VERTEX: &str = "
#ifdef PULLED
uniform highp sampler2D positions;
uniform highp sampler2D normals;
uniform highp sampler2D paints;
in uint corner;
out vec3 weights;

ivec2 texel(highp sampler2D map, uint index) {
    ivec2 size = textureSize(map, 0);
    int i = int(index);
    // Rows are stored from the last to the first.
    return ivec2(i % size.x, size.y - 1 - i / size.x);
}
#else
in vec3 position;
in vec3 normal;
in uvec4 paint;
#endif
uniform vec3 base;
uniform float painted;
uniform vec3 palette[8];
out vec3 seen;
out vec3 facing;
out vec3 color;

void main() {
#ifdef PULLED
    ivec2 at = texel(positions, corner);
    vec3 position = texelFetch(positions, at, 0).xyz;
    vec3 normal = texelFetch(normals, at, 0).xyz;
    vec4 paint = texelFetch(paints, at, 0) * 255.0;
    int side = gl_VertexID % 3;
    weights = vec3(side == 0, side == 1, side == 2);
#endif
    seen = seen_from_eye(position);
    facing = turn * normal;
    color = mix(base, vec3(paint.rgb) / 255.0, painted);
    int tint = int(float(paint.a) + 0.5);
    color = mix(color, palette[min(tint, 7)], tint > 0 ? 0.75 : 0.0);
    gl_Position = projection * vec4(seen, 1.0);
}
";

/// The lights to choose from; see `Light`.
const LIGHTS: &str = "
uniform int lighting;

// The light is at the eye, as that of a miner.
vec3 lit_from_eye(vec3 color, vec3 normal, vec3 to_eye) {
    return sqrt(color * color * (0.08 + 0.92 * max(dot(normal, to_eye), 0.0)));
}

// A ball of clay: the colour depends on the normal alone, and curvature shows.
vec3 clay(vec3 color, vec3 normal) {
    float warm = 0.5 + 0.5 * dot(normal, normalize(vec3(-0.4, 0.6, 0.7)));
    vec3 ball = mix(vec3(0.20, 0.13, 0.14), vec3(0.98, 0.80, 0.68), warm);
    float rim = pow(clamp(1.0 - normal.z, 0.0, 1.0), 3.0);
    ball = mix(ball, vec3(0.32, 0.38, 0.48), 0.6 * rim);
    float shine = pow(max(dot(normal, normalize(vec3(-0.35, 0.55, 0.75))), 0.0), 24.0);
    return min(ball * color * 1.25 + 0.12 * shine, vec3(1.0));
}

vec3 lit_as_chosen(vec3 color, vec3 normal, vec3 to_eye) {
    if (lighting == 1) {
        return lit_from_eye(color, normal, to_eye);
    }
    return lighting == 2 ? clay(color, normal) : lit(color, normal, to_eye);
}
";

const SURFACE_FRAGMENT: &str = "
uniform vec3 inside;
uniform float flatness;
#ifdef PULLED
uniform vec3 line_color;
uniform float line_width;
in vec3 weights;
#endif
in vec3 seen;
in vec3 facing;
in vec3 color;
out vec4 result;

void main() {
    // The derivatives' product always faces the eye.
    vec3 face_normal = cross(dFdx(seen), dFdy(seen));
    vec3 normal = gl_FrontFacing ? facing : -facing;
    // A vertex of no area has no normal.
    bool is_flat = flatness > 0.5 || dot(normal, normal) < 0.01;
    normal = normalize(is_flat ? face_normal : normal);
    vec3 outside = gl_FrontFacing ? color : mix(color, inside, 0.8);
    vec3 shade = lit_as_chosen(outside, normal, normalize(-seen));
#ifdef PULLED
    vec3 slope = fwidth(weights);
    vec3 pixels = weights / max(slope, vec3(1e-9));
    float edge = min(pixels.x, min(pixels.y, pixels.z));
    float half_width = 0.5 * line_width;
    float line = 1.0 - smoothstep(half_width - 0.5, half_width + 0.7, edge);
    // Triangles of a few pixels would be nothing but lines: there the wireframe fades.
    float height = 1.0 / max(slope.x, max(slope.y, slope.z));
    line *= clamp((height - 1.5) / 8.0, 0.0, 0.8);
    shade = mix(shade, line_color, line);
#endif
    result = vec4(shade, 1.0);
}
";

/// The corners of a rectangle from −1 to 1, for instances of marks and lines.
const RECTANGLE: &str = "
uniform vec2 size;
uniform float focal;
uniform float pixels_per_point;
in uvec4 tint;
out vec3 color;

vec2 corner() {
    vec2 corners[6] = vec2[6](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0),
                              vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0));
    return corners[gl_VertexID];
}

// Moves a point towards the eye without changing its position on the screen.
vec3 before(vec3 seen, float pixels) {
    return seen * (1.0 - min(pixels / focal, 0.5));
}
";

const MARK_VERTEX: &str = "
in vec4 ball;
out vec2 place;
out float radius;

void main() {
    place = corner();
    color = vec3(tint.rgb) / 255.0;
    radius = max(0.5 * ball.w * pixels_per_point, 1.0);
    vec4 center = projection * vec4(before(seen_from_eye(ball.xyz), 2.0 * radius), 1.0);
    // A pixel more all around for the soft border.
    vec2 shift = place * (radius + 1.0) * 2.0 / size;
    place *= (radius + 1.0) / radius;
    gl_Position = center + vec4(shift * center.w, 0.0, 0.0);
}
";

const MARK_FRAGMENT: &str = "
uniform float opacity;
in vec2 place;
in float radius;
in vec3 color;
out vec4 result;

void main() {
    float away = length(place);
    float cover = clamp((1.0 - away) * radius + 0.5, 0.0, 1.0);
    if (cover <= 0.0) {
        discard;
    }
    vec3 normal = vec3(place, sqrt(max(1.0 - away * away, 0.0)));
    vec3 shade = lit(color, normal, vec3(0.0, 0.0, 1.0));
    // A dark rim tells a mark from a surface of its own colour.
    float rim = smoothstep(0.0, 1.5, (away - 1.0) * radius + 2.0);
    result = vec4(mix(shade, 0.25 * color, 0.8 * rim), cover * opacity);
}
";

const LINE_VERTEX: &str = "
in vec3 start;
in vec3 end;
out float across;

void main() {
    color = vec3(tint.rgb) / 255.0;
    vec3 a = before(seen_from_eye(start), 1.5);
    vec3 b = before(seen_from_eye(end), 1.5);
    // What is behind the eye has no place on the screen: the line is cut before.
    float near = projection[3][2] / (projection[2][2] - 1.0);
    if (a.z > -near && b.z < -near) {
        a = mix(b, a, (b.z + near) / (b.z - a.z));
    } else if (b.z > -near && a.z < -near) {
        b = mix(a, b, (a.z + near) / (a.z - b.z));
    }
    vec4 from = projection * vec4(a, 1.0);
    vec4 to = projection * vec4(b, 1.0);
    vec2 along = (to.xy / to.w - from.xy / from.w) * size;
    along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
    float half_width = 0.5 * pixels_per_point + 0.5;
    vec2 place = corner();
    across = place.y * half_width;
    vec4 point = place.x < 0.0 ? from : to;
    vec2 shift = vec2(-along.y, along.x) * across * 2.0 / size;
    gl_Position = point + vec4(shift * point.w, 0.0, 0.0);
}
";

const LINE_FRAGMENT: &str = "
uniform float pixels_per_point;
in float across;
in vec3 color;
out vec4 result;

void main() {
    float cover = clamp(0.5 * pixels_per_point + 0.5 - abs(across), 0.0, 1.0);
    result = vec4(color, cover);
}
";

/// Vertex and fragment shader of the surface.
pub(super) fn surface() -> [String; 2] {
    [
        format!("{SEEN}{SURFACE_VERTEX}"),
        format!("{LIGHT}{LIGHTS}{SURFACE_FRAGMENT}"),
    ]
}

/// Vertex and fragment shader of the surface with its edges.
pub(super) fn surface_with_edges() -> [String; 2] {
    surface().map(|shader| format!("#define PULLED\n{shader}"))
}

/// Vertex and fragment shader of marks.
pub(super) fn marks() -> [String; 2] {
    [
        format!("{SEEN}{RECTANGLE}{MARK_VERTEX}"),
        format!("{LIGHT}{MARK_FRAGMENT}"),
    ]
}

/// Vertex and fragment shader of lines.
pub(super) fn lines() -> [String; 2] {
    [
        format!("{SEEN}{RECTANGLE}{LINE_VERTEX}"),
        LINE_FRAGMENT.to_owned(),
    ]
}

/// Compiles a pair of shaders.
pub(super) fn program(
    context: &Context,
    [vertex, fragment]: &[String; 2],
) -> Result<Program, String> {
    Program::from_source(context, vertex, fragment).map_err(|e| e.to_string())
}
