//! Memory: adjustable limits, runs in address spaces that are too small, and vertices whose
//! valence squared exceeds any memory.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use cotan::shapes::{bipyramid, icosphere};
use cotan_io::{Document, Format};

use crate::sandbox::Sandbox;

/// The end of a run: its exit code, or `None` for a signal, and its standard error.
struct Ended {
    code: Option<i32>,
    stderr: String,
}

/// Runs `cotan` in the sandbox with an address space of `kilobytes`.
///
/// Returns `None` if there is no shell that can set the limit.
fn within(sandbox: &Sandbox, kilobytes: u64, line: &str) -> Option<Ended> {
    let program = env!("CARGO_BIN_EXE_cotan");
    let script = format!("ulimit -v {kilobytes} && exec \"{program}\" {line}");
    let output = Command::new("sh")
        .args(["-c", &script])
        .current_dir(sandbox.path(""))
        .stdin(Stdio::null())
        .output()
        .ok()?;
    Some(Ended {
        code: output.status.code(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    })
}

/// The smallest tested address space in which a small mesh can be read.
///
/// Returns `None`, with a message, if the limit cannot be set.
fn least_space(sandbox: &Sandbox) -> Option<u64> {
    let shape = icosphere::<f64>(2);
    let document =
        Document::from_mesh(shape.connectivity(), shape.positions()).expect("a document");
    cotan_io::save(&document, sandbox.path("small.obj")).expect("a mesh file");
    let works = |kilobytes: &u64| {
        within(sandbox, *kilobytes, "info small.obj").is_some_and(|ended| ended.code == Some(0))
    };
    let least = [50_000, 100_000, 200_000, 400_000, 800_000]
        .into_iter()
        .find(works);
    if least.is_none() {
        cotan_testing::skip("no shell can limit the address space here");
    }
    least
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

/// Files that are small on disk and large in memory, each with `count` vertices or faces.
fn bombs(count: usize) -> Vec<(&'static str, Vec<u8>)> {
    let header = |vertices: usize, faces: usize| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
             property float y\nproperty float z\nelement face {faces}\n\
             property list uchar int vertex_indices\nend_header\n"
        )
    };
    let mut vertices = header(count, 0).into_bytes();
    vertices.resize(vertices.len() + 12 * count, 0);
    let mut faces = header(3, count).into_bytes();
    for x in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        faces.extend(x.to_le_bytes());
    }
    faces.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0].repeat(count));
    let text_ply =
        header(count, 0).replace("binary_little_endian", "ascii") + &"0 0 0\n".repeat(count);
    let obj_vertices = "v 0 0 0\n".repeat(count);
    let obj_faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned() + &"f 1 2 3\n".repeat(count);
    let obj_normals = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned()
        + &"vn 0 0 1\n".repeat(count)
        + "f 1//1 2//2 3//3\n";
    let off = format!("OFF\n{count} 0 0\n") + &"0 0 0\n".repeat(count);
    let mut stl = vec![b' '; 80];
    stl.extend((count as u32).to_le_bytes());
    let mut facet = [0u8; 50];
    facet[12] = 1;
    facet[28] = 2;
    facet[44] = 3;
    stl.extend(facet.repeat(count));
    let text_facet =
        "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n";
    let text_stl = "solid a\n".to_owned() + &text_facet.repeat(count / 4) + "endsolid a\n";
    vec![
        ("vertices.ply.gz", gzip(&vertices)),
        ("faces.ply.gz", gzip(&faces)),
        ("text.ply.gz", gzip(text_ply.as_bytes())),
        ("vertices.obj.gz", gzip(obj_vertices.as_bytes())),
        ("faces.obj.gz", gzip(obj_faces.as_bytes())),
        ("normals.obj.gz", gzip(obj_normals.as_bytes())),
        ("vertices.off.gz", gzip(off.as_bytes())),
        ("facets.stl.gz", gzip(&stl)),
        ("text.stl.gz", gzip(text_stl.as_bytes())),
        ("vertices.glb.gz", gzip(&glb(count))),
    ]
}

/// A GLB of one primitive with `count` vertices and no indices.
fn glb(count: usize) -> Vec<u8> {
    let count = count / 3 * 3;
    let length = 12 * count;
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{length}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}]}}"#
    );
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + json.len() + length) as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json.as_bytes());
    out.extend((length as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.resize(out.len() + length, 0);
    out
}

/// A file decides how much is allocated, and a failed allocation must be an error with exit code
/// 1, never a signal.
///
/// The limit is twice the space the program needs to start. With less, its own allocations fail
/// at random.
#[test]
fn memory_that_a_file_requests_and_cannot_get_is_an_error() {
    let sandbox = Sandbox::new();
    let Some(least) = least_space(&sandbox) else {
        return;
    };
    let mut refused = 0;
    for (name, bytes) in bombs(3_000_000) {
        sandbox.write(name, bytes);
        for factor in [2.0, 3.0, 4.5, 6.0] {
            let kilobytes = (least as f64 * factor) as u64;
            for line in [
                format!("info {name}"),
                format!("convert {name} out.ply"),
                format!("repair {name} -o out.obj"),
                // Without the default limit, the allocation itself fails.
                format!("info {name} --max-memory 100G"),
                format!("convert {name} out.obj --max-memory 100G"),
            ] {
                let Some(ended) = within(&sandbox, kilobytes, &line) else {
                    return;
                };
                let code = ended.code;
                assert!(
                    matches!(code, Some(0 | 1)),
                    "{kilobytes} KB, {line}: {code:?} {}",
                    ended.stderr
                );
                if code == Some(1) {
                    refused += 1;
                    assert!(ended.stderr.contains("error: "), "{line}: {}", ended.stderr);
                }
            }
        }
    }
    assert!(refused > 50, "{refused}");
}

/// Every command on a valid mesh, in address spaces from too small to large enough.
///
/// The smallest has room for the arenas that an allocator reserves per thread (64 MB with glibc).
/// Without them, the program's own allocations fail at random.
#[test]
fn no_command_crashes_in_a_small_address_space() {
    let sandbox = Sandbox::new();
    let Some(least) = least_space(&sandbox) else {
        return;
    };
    let shape = icosphere::<f64>(6);
    let document =
        Document::from_mesh(shape.connectivity(), shape.positions()).expect("a document");
    cotan_io::save(&document, sandbox.path("ball.obj")).expect("a mesh file");
    sandbox.write(
        "h.json",
        r#"{"handles": [{"vertices": [0], "fixed": true}, {"vertices": [1], "to": [[0, 0, 2]]}]}"#,
    );
    let mut region = String::new();
    for v in 0..2_000 {
        let _ = write!(region, "{v}, ");
    }
    sandbox.write(
        "region.json",
        format!(
            r#"{{"handles": [{{"vertices": [{region}2000], "fixed": true}},
                {{"vertices": [9000], "to": [[0, 0, 2]]}}]}}"#
        ),
    );
    let lines = [
        "info ball.obj",
        "convert ball.obj out.glb",
        "repair ball.obj -o out.obj --all",
        "deform ball.obj --handles h.json -o out.obj",
        "deform ball.obj --handles region.json -o out.obj --threads 1",
        "deform ball.obj --handles h.json -o out.obj --strategy iterative",
        "reconstruct ball.obj --handles h.json -o out.obj --iterations 3",
        "smooth ball.obj -o out.obj",
        "denoise ball.obj -o out.obj",
        "denoise ball.obj -o out.obj --method feature",
        "detail ball.obj -o out.obj --scale 2 --iterations 2",
        "sphere ball.obj -o out.obj",
        "sphere ball.obj -o out.obj --method cmcf",
        "resample ball.obj -o out.obj --level 5",
        "morph ball.obj ball.obj -t 0.5 -o out.obj",
        "geodesic ball.obj --from 0 -o out.ply",
        "compare ball.obj ball.obj",
        "bench ball.obj --rounds 1",
    ];
    let mut codes = [0; 2];
    for line in lines {
        for factor in [4.0, 5.0, 9.0, 20.0] {
            let kilobytes = (least as f64 * factor) as u64;
            let Some(ended) = within(&sandbox, kilobytes, line) else {
                return;
            };
            match ended.code {
                Some(code @ (0 | 1)) => codes[code as usize] += 1,
                code => panic!("{kilobytes} KB, {line}: {code:?} {}", ended.stderr),
            }
        }
    }
    println!("done and refused: {codes:?}");
    assert!(codes[0] > 20 && codes[1] > 5, "{codes:?}");
}

#[test]
fn every_command_respects_the_memory_limit() {
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.json", crate::sandbox::json_handles());
    for line in [
        "info bar.obj",
        "convert bar.obj out.ply",
        "repair bar.obj -o out.obj",
        "deform bar.obj --handles h.json -o out.obj",
        "reconstruct bar.obj --handles h.json -o out.obj --iterations 2",
        "smooth bar.obj -o out.obj",
        "denoise bar.obj -o out.obj",
        "detail bar.obj -o out.obj --scale 2",
        "sphere bar.obj -o out.obj",
        "resample bar.obj -o out.obj --level 2",
        "morph bar.obj bar.obj -t 0.5 -o out.obj",
        "geodesic bar.obj --from 0 -o out.obj",
        "compare bar.obj bar.obj",
        "bench bar.obj",
    ] {
        sandbox.refused(&format!("{line} --max-memory 1M"), &["bar.obj", " bytes"]);
        sandbox.refused(
            &format!("--max-memory 10K {line}"),
            &["bar.obj", "bytes of memory"],
        );
        assert!(!sandbox.path("out.obj").exists(), "{line}");
    }
}

#[test]
fn every_reading_limit_is_enforced() {
    let sandbox = Sandbox::with_bar();
    for (limit, word) in [
        ("--limit-file 1K", "more than 1000 bytes"),
        ("--limit-memory 2K", "more than 2000 bytes of memory"),
        ("--limit-vertices 10", "more than 10 vertices"),
        ("--limit-faces 11", "more than 11 faces"),
        ("--limit-corners 12", "more than 12 face corners"),
        ("--limit-degree 2", "more than 2 corners of a face"),
        ("--limit-line 3", "more than 3 bytes in a line"),
    ] {
        sandbox.refused(&format!("info bar.obj {limit}"), &[word]);
        sandbox.refused(&format!("smooth bar.obj -o out.obj {limit}"), &[word]);
    }
    // Files of handles and landmarks are read within the same limit.
    sandbox.write("long.txt", " ".repeat(20_000));
    let limit = "bar.obj -o out.obj --limit-file 19K";
    for option in ["deform --handles", "sphere --landmarks"] {
        let line = format!("{option} long.txt {limit}");
        sandbox.refused(&line, &["long.txt", "larger than"]);
    }
    let document = cotan_io::load(sandbox.path("bar.obj")).expect("a mesh");
    sandbox.write("bar.gltf", document.write(Format::Gltf).expect("bytes"));
    sandbox.refused(
        "info bar.gltf --limit-depth 1",
        &["more than 1 levels of nesting"],
    );
    sandbox.cotan_ok("info bar.gltf");
}

#[test]
fn threads_are_bounded() {
    let sandbox = Sandbox::with_bar();
    for threads in ["0", "1025", "100000000000", "many", "-1"] {
        for line in [
            "smooth bar.obj -o out.obj",
            "sphere bar.obj -o out.obj",
            "bench bar.obj",
        ] {
            let outcome = sandbox.cotan(&format!("{line} --threads={threads}"));
            assert_eq!(outcome.code, 2, "{line} {threads}: {outcome:?}");
            assert!(outcome.stderr.contains("from 1 to 1024"), "{outcome:?}");
        }
    }
    sandbox.cotan_ok("smooth bar.obj -o out.obj --threads 3");
}

/// Two vertices of valence 20,000 in a file of less than 2 MB are edited within 300 MB, where the
/// square of the valence would take gigabytes.
#[test]
fn a_vertex_of_valence_20000_is_edited_in_little_memory() {
    let sandbox = Sandbox::new();
    let shape = bipyramid::<f64>(20_000);
    let document =
        Document::from_mesh(shape.connectivity(), shape.positions()).expect("a document");
    cotan_io::save(&document, sandbox.path("b.obj")).expect("a mesh file");
    let points = r#"{"vertices": [0], "fixed": true}, {"vertices": [1], "to": [[0.3, 0, -1]]}"#;
    sandbox.write("points.json", format!(r#"{{"handles": [{points}]}}"#));
    let region: Vec<usize> = (100..5_000).collect();
    let region = format!(r#"{points}, {{"vertices": {region:?}, "fixed": true}}"#);
    sandbox.write("region.json", format!(r#"{{"handles": [{region}]}}"#));
    let hub = r#"{"vertices": [7], "fixed": true}, {"vertices": [20000], "to": [[0, 0.2, 2]]}"#;
    sandbox.write("hub.json", format!(r#"{{"handles": [{hub}]}}"#));
    for line in [
        "smooth b.obj -o out.obj",
        "denoise b.obj -o out.obj",
        "denoise b.obj -o out.obj --method feature",
        "denoise b.obj -o out.obj --method anchored",
        "detail b.obj -o out.obj --scale 2 --iterations 3",
        "sphere b.obj -o out.obj",
        "deform b.obj --handles points.json -o out.obj --iterations 5",
        "deform b.obj --handles region.json -o out.obj --iterations 5",
        "deform b.obj --handles hub.json -o out.obj --iterations 5",
        "deform b.obj --handles points.json -o out.obj --iterations 3 --strategy normal",
        "deform b.obj --handles points.json -o out.obj --iterations 3 --scheme tutte",
        "deform b.obj --handles points.json -o out.obj --iterations 3 --orientation rotation",
    ] {
        let outcome = sandbox.cotan(&format!("{line} --max-memory 300M"));
        assert_eq!(outcome.code, 0, "{line}: {outcome:?}");
    }
    // Verify with an address space of not much more, independently of the prediction.
    if let Some(ended) = within(
        &sandbox,
        600_000,
        "smooth b.obj -o out.obj --max-memory 300M",
    ) {
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    }
}
