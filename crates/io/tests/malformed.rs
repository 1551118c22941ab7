//! Tests on broken and odd files that developers have in a folder next to the workspace; it need
//! not exist.
//!
//! Every file is read, its surface built and its defects searched, within 1 GB and 5 s each.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use cotan_io::{Document, Folder, IoError, Limits, load_with};
use peak_alloc::PeakAlloc;
use serde_json::Value;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

const MAX_MEGABYTES: f32 = 1000.0;
const MAX_SECONDS: f64 = 5.0;

/// The words that each error must contain, by file: the location, or the element that is wrong.
const WORDS: &[(&str, &str)] = &[
    (
        "obj_relative_index_no_vertices.obj",
        "line 1: face 0 refers to vertex -4",
    ),
    ("obj_zero_index.obj", "line 16: face 0 refers to vertex 0"),
    (
        "obj_nan_inf_coords.obj",
        "line 12: vertex 0 has the coordinate nan",
    ),
    (
        "obj_index_past_end.obj",
        "line 12: face 1 refers to vertex 7",
    ),
    (
        "obj_html_instead.obj",
        "no vertices: this is an empty mesh or not OBJ at all",
    ),
    (
        "obj_coordinate_overflow.obj",
        "line 2: vertex 1 has the coordinate 1e400",
    ),
    (
        "obj_nonmanifold_wrap.obj",
        "the edge between vertices 0 and 1 has 4 faces",
    ),
    ("obj_joined_tetrahedra.obj", "has 4 faces"),
    (
        "obj_fan3_nonmanifold_edge.obj",
        "the edge between vertices 2 and 4 has 3 faces",
    ),
    (
        "obj_hourglass_nonmanifold_vertex.obj",
        "vertex 22 joins 2 separate fans",
    ),
    ("obj_bowtie_open.obj", "vertex 0 joins 2 separate fans"),
    (
        "obj_backslash_longline.obj",
        "passes twice through vertex 0",
    ),
    (
        "obj_flipped_faces.obj",
        "faces 0 and 10 both run from vertex 0 to vertex 3",
    ),
    ("obj_moebius.obj", "oriented against each other"),
    ("obj_mixed_formats.obj", "has 3 faces"),
    ("obj_duplicate_faces.obj", "has 4 faces"),
    (
        "ply_fuzz_broken_header.ply",
        "the file ends before `end_header`",
    ),
    (
        "ply_no_vertex_properties.ply",
        "the element `vertex` needs the properties x, y and z",
    ),
    ("ply_no_vertex_element.ply", "no element `vertex`"),
    ("ply_empty_header_only.ply", "no element `vertex`"),
    (
        "ply_truncated_binary.ply",
        "byte 392: the file ends at face 9",
    ),
    (
        "ply_huge_counts.ply",
        "4000000000 of element `vertex` are promised, but 252 bytes",
    ),
    ("ply_negative_count.ply", "line 3: `element vertex -4`"),
    ("ply_unknown_type.ply", "line 5: `property real y`"),
    ("ply_index_out_of_range.ply", "face 3 refers to vertex 7"),
    ("ply_negative_index.ply", "face 3 refers to vertex -1"),
    ("ply_nan_binary.ply", "vertex 3 has the coordinate NaN"),
    ("ply_bunny_nonmanifold.ply", "has 4 faces"),
    (
        "off_huge_count.off",
        "the header promises 353535235358 vertices",
    ),
    ("off_short_and_garbled.off", "line 6: face 0"),
    (
        "off_index_out_of_range.off",
        "line 10: face 3 refers to vertex 4",
    ),
    (
        "off_negative_index.off",
        "line 10: face 3 refers to vertex -1",
    ),
    ("off_truncated.off", "line 15: face 4 has 2 numbers"),
    ("stl_cut_ascii.stl", "line 19: the file ends in facet 2"),
    ("stl_four_vertices_in_loop.stl", "line 14: facet 1"),
    ("stl_bad_vertex_word.stl", "line 13: facet 1 has `blah`"),
    ("stl_spider_degenerate.stl", "passes twice through vertex"),
    ("stl_flipped_facet.stl", "oriented against each other"),
    ("stl_zero_area_facet.stl", "face 13 passes twice"),
    ("stl_empty.stl", "the file is empty"),
    (
        "stl_truncated_binary.stl",
        "byte 614: the file ends at facet 10",
    ),
    ("stl_huge_count.stl", "4294967295 were promised"),
    ("stl_nan_vertex.stl", "vertex 4 has the coordinate NaN"),
    (
        "gltf_index_out_of_range/IndexOutOfRange.gltf",
        "meshes[0].primitives[0].indices",
    ),
    (
        "gltf_missing_bin/BoxTextured.gltf",
        "`BoxTextured0.bin`, which cannot be read",
    ),
    ("gltf_recursive_nodes.gltf", "their own ancestors"),
    (
        "glb_draco_compressed.glb",
        "KHR_draco_mesh_compression is not supported",
    ),
    (
        "gltf_external_http_uri.gltf",
        "`http://example.com/buffer.bin`, which cannot be read",
    ),
    ("gltf_invalid_base64.gltf", "buffers[0].uri"),
    (
        "gltf_index_oob_validator/index_buffer_oob.gltf",
        "index 5 (face 1) refers to vertex 5",
    ),
    (
        "gltf_bufferview_1e300/integer-out-of-bounds.gltf",
        "`1e+300`",
    ),
    ("gltf_version_1.gltf", "glTF 1.0 is not supported"),
    (
        "glb_truncated_chunk.glb",
        "the header promises 48 bytes and the file has 47",
    ),
    ("glb_chunk_too_big.glb", "byte 8"),
    ("glb_invalid_magic.glb", "byte 0"),
    (
        "glb_infinities.glb",
        "accessors[2]: element 0 has the coordinate -inf",
    ),
    (
        "gltf_nan_position.gltf",
        "accessors[1]: element 3 has the coordinate NaN",
    ),
    (
        "gltf_accessor_past_buffer.gltf",
        "accessors[1].bufferView: 400 elements",
    ),
    ("gltf_path_traversal_uri.gltf", "points outside the folder"),
];

fn load(path: &Path) -> Result<Document, IoError> {
    load_with(path, &Limits::default(), &Folder::of(path))
}

#[test]
fn every_file_does_what_is_expected_of_it() {
    let Some(folder) = cotan_testing::shared("malformed") else {
        return;
    };
    let text = std::fs::read_to_string(folder.join("expect.json")).unwrap();
    let table: Vec<Value> = serde_json::from_str(&text).unwrap();
    let mut surprises = Vec::new();
    for expectation in &table {
        let name = expectation["file"].as_str().unwrap();
        let path: PathBuf = folder.join(name);
        MEMORY.reset_peak_usage();
        let clock = Instant::now();
        let result = load(&path);
        let surface = result.as_ref().ok().map(Document::surface);
        let (seconds, megabytes) = (clock.elapsed().as_secs_f64(), MEMORY.peak_usage_as_mb());
        let said = match (&result, &surface) {
            (Err(error), _) | (_, Some(Err(error))) => error.to_string(),
            _ => "fine".to_owned(),
        };
        let said = said.replace(&*folder.to_string_lossy(), "");
        let counts = result
            .as_ref()
            .ok()
            .map(|d| (d.positions().len() as u64, d.faces().num_triangles() as u64));
        eprintln!("{name}: {counts:?} {said}");
        let expected = (expectation["V"].as_u64(), expectation["F"].as_u64());
        let expected = expected.0.zip(expected.1);
        let is_expected = match expectation["expect"].as_str().unwrap() {
            "ERROR" => result.is_err(),
            "EITHER" => result.is_err() || expected.is_none() || counts == expected,
            _ => counts == expected,
        };
        let words = WORDS.iter().find(|(file, _)| *file == name);
        let is_named = words.is_none_or(|(_, words)| said.contains(words));
        let is_small = seconds < MAX_SECONDS && megabytes < MAX_MEGABYTES;
        if !is_expected || !is_named || !is_small {
            surprises.push(format!(
                "{name}: {} expected with {expected:?} and {words:?}, found {counts:?} in \
                 {seconds:.2} s and {megabytes:.0} MB: {said}",
                expectation["expect"],
            ));
        }
    }
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}
