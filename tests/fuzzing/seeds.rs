//! Seeds for the fuzzers, made by our own code.

use std::io::Write as _;

use cotan::shapes::{bipyramid, bumpy_plane, icosphere, tetrahedron};
use cotan_io::{
    Attributes, COLOR, CornerProperty, Document, Format, LabelKind, Labels, NORMAL, Property, UV,
    Values,
};
use nalgebra::Point3;

/// A seed: its target, its name, its bytes.
type Seed = (&'static str, String, Vec<u8>);

/// All seeds, the same bytes every time.
///
/// # Panics
/// If a sample cannot be written, which is a bug.
pub fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (name, document) in documents() {
        for format in Format::ALL {
            let bytes = document
                .write(format)
                .unwrap_or_else(|error| panic!("{name} as {format}: {error}"));
            add_file(
                &mut seeds,
                &format!("{name}.{}", format.extension()),
                format,
                bytes,
            );
        }
    }
    for (name, text) in [("vertices.obj.gz", "v 0 0 0\n"), ("lines.obj.gz", "\n")] {
        add_file(&mut seeds, name, Format::Obj, bomb(text));
    }
    for (name, format, text) in TEXTS {
        add_file(&mut seeds, name, format, text.as_bytes().to_vec());
    }
    for (name, text) in LIBRARIES {
        seeds.push(("materials", name.to_owned(), text.as_bytes().to_vec()));
    }
    for (name, length, step) in [("short", 40, 1), ("long", 400, 7), ("wild", 300, 251)] {
        let bytes: Vec<u8> = (0..length).map(|i| (i * step % 256) as u8).collect();
        for target in [
            "document_roundtrip",
            "halfedge_build",
            "halfedge_edits",
            "sphere",
        ] {
            seeds.push((target, name.to_owned(), bytes.clone()));
        }
    }
    seeds
}

fn add_file(seeds: &mut Vec<Seed>, name: &str, format: Format, bytes: Vec<u8>) {
    let target = match format {
        Format::Obj => "obj",
        Format::Ply => "ply",
        Format::Off => "off",
        Format::Stl => "stl",
        _ => "gltf",
    };
    if target == "obj" {
        seeds.push(("obj_differential", name.to_owned(), bytes.clone()));
    }
    let choice = [0, 0, seeds.len() as u8, 1];
    seeds.push((
        "pipeline",
        name.to_owned(),
        [&choice, bytes.as_slice()].concat(),
    ));
    seeds.push((target, name.to_owned(), bytes));
}

/// A few kilobytes that unpack to four megabytes of one line.
fn bomb(line: &str) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    let text = line.repeat((4 << 20) / line.len());
    let written = encoder.write_all(text.as_bytes());
    written
        .and_then(|()| encoder.finish())
        .unwrap_or_else(|error| panic!("in memory: {error}"))
}

fn documents() -> Vec<(&'static str, Document)> {
    let sphere = icosphere::<f64>(1);
    let plane = bumpy_plane::<f64>([1.0, 2.0], [2, 3], 0.1);
    let pyramid = tetrahedron::<f64>();
    // Of a valence at which rows are cut into pieces and fans are searched by their angle.
    let hubs = bipyramid::<f64>(150);
    let of = |shape: &cotan::Mesh<f64>| {
        Document::from_mesh(shape.connectivity(), shape.positions())
            .unwrap_or_else(|error| panic!("{error}"))
    };
    vec![
        ("sphere", of(&sphere)),
        ("plane", of(&plane)),
        ("pyramid", of(&pyramid)),
        ("hubs", of(&hubs)),
        ("rich", rich()),
    ]
}

/// Two squares with attributes of every kind.
fn rich() -> Document {
    let positions = (0..6)
        .map(|i| Point3::new(f64::from(i % 3), f64::from(i / 3), 0.0))
        .collect();
    let faces = [[0u32, 1, 4, 3], [1, 2, 5, 4]].iter().collect();
    let ramp = |count: u8| Values::F32((0..count).map(|i| f32::from(i) / 8.0).collect());
    let attributes = Attributes {
        vertices: vec![
            Property {
                name: COLOR.into(),
                components: 3,
                values: Values::U8((0..18).map(|i| i * 14).collect()),
            },
            Property {
                name: "quality".into(),
                components: 1,
                values: ramp(6),
            },
        ],
        faces: vec![Property {
            name: "flags".into(),
            components: 1,
            values: Values::I32(vec![-1, 7]),
        }],
        corners: vec![
            CornerProperty {
                name: UV.into(),
                components: 2,
                values: ramp(8),
                indices: vec![0, 1, 2, 3, 0, 1, 2, 3],
            },
            CornerProperty {
                name: NORMAL.into(),
                components: 3,
                values: Values::F64(vec![0.0, 0.0, 1.0]),
                indices: vec![0; 8],
            },
        ],
        labels: vec![
            Labels {
                kind: LabelKind::Group,
                names: vec!["left".into(), "right".into()],
                faces: vec![0, 1],
            },
            Labels {
                kind: LabelKind::Material,
                names: vec!["stone".into()],
                faces: vec![0, 0],
            },
        ],
        comments: vec!["made by hand".into()],
        libraries: vec!["stone.mtl".into()],
    };
    Document::new(positions, faces)
        .and_then(|document| document.with_attributes(attributes))
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Libraries with statements of every kind, right and wrong.
const LIBRARIES: [(&str, &str); 3] = [
    (
        "plain.mtl",
        "newmtl a\nKa 0 0 0\nKd 0.8 0.7 0.6\nKs 0.5 0.5 0.5\nNs 96.078431\nNi 1.45\nd 0.5\n\
         illum 2\nmap_Kd wood.png\n\nnewmtl b\nKd 1 0 0\nTr 0.25\n",
    ),
    (
        "physical.mtl",
        "newmtl a\r\nKd 0.1 0.2 0.3\r\nKe 0 12.5 0\r\nPr 0.25\r\nPm 1\r\nPc 0.5\r\n\
         map_Kd -s 2 2 1 -clamp on tex\\my wood.png\r\nmap_d tex/my wood.png\r\nmap_Ke ./b.jpg\r\n\
         norm -bm 0.5 n.png\r\nmap_Pr r.png\r\nnewmtl b # 2\r\nnewmtl b\r\n",
    ),
    (
        "odd.mtl",
        "\u{feff}Kd 1 1\nnewmtl\nKd\nKd 1 x\nNs nan\nillum 300\nmap_Kd\nmap_d ../a\nNewMtl a\n\
         kd 0.5\nd -halo 1\nTr 1e99\nKe -1 2 1e38\nbump \\\n a.png\nmap_Ke C:\\a.png\nnewmtl a\\\nPr 2\n",
    ),
];

const TEXTS: [(&str, Format, &str); 13] = [
    (
        "odd.obj",
        Format::Obj,
        "\u{feff}# odd\r\nmtllib a b.mtl\r\no caf\u{e9}\r\nv 0 0 0 1\r\nv 1 0 0 0.5 nan 0.5\r\n\
         v +1.0 1e0 .0\r\nv 0 1 0 # last\r\nvt 0 0\nvn 0 0 1\ng a b\ns 1\nusemtl m\nf 1 2 3#x\n\
         f 1/1 2/1 3/1 4/1\ns off\nf 1//1 2//1 3//1\nf -4/-1/-1 -3/1/1 \\\r\n-2/1/1\nl 1 2 -1\np 3\n",
    ),
    (
        "far.obj",
        Format::Obj,
        "v 1e300 0 0\nv 0 1e-300 0\nv 0 0 1\nv 1 1 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
    ),
    (
        "strips.ply",
        Format::Ply,
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
         property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
         0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n8 0 1 2 3 -1 2 3 4\n",
    ),
    (
        "odd.ply",
        Format::Ply,
        "ply\r\nformat ascii 1.0\r\ncomment c\r\nobj_info i\r\nelement camera 1\r\n\
         property list uchar short k\r\nelement vertex 3\r\nproperty list uchar int near\r\n\
         property float y\r\nproperty uchar red\r\nproperty double x\r\nproperty short z\r\n\
         property float nx\r\nproperty float ny\r\nproperty float nz\r\nelement face 1\r\n\
         property uchar flag\r\nproperty list int uint vertex_index\r\n\
         property list uchar float texcoord\r\nend_header\r\n2 7 -8\r\n\r\n\
         0 0.5 255 0 0 0 0 1\r\n2 1 2 0 0 1 0 0 0 1\r\n1 0 1.5 0 0 -3 0 0 1\r\n\
         1 3 0 1 2 6 0 0 1 0 0 1\r\n",
    ),
    (
        "odd.off",
        Format::Off,
        "# first\nSTCNOFF # c\n3 1 0\n0 0 0  0 0 1  255 0 0 1  .5 .5\n1 0 0 0 0 1 0 0 0 0 0 0\n\
         0 1 0 0 0 1 0 0 0 0 1 1 #c\n3 0 1 2 0.5 0.5 0.5\n",
    ),
    (
        "two.stl",
        Format::Stl,
        "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n\
         vertex 0 1 0\n  endloop\n endfacet\nendsolid a\nSOLID b\r\nFACET NORMAL 0 0 -1\r\n\
         OUTER LOOP\r\nVERTEX 0 0 0\r\nVERTEX 0 1 0\r\nVERTEX 1 0 0\r\nENDLOOP\r\nENDFACET\r\n\
         ENDSOLID b\r\n",
    ),
    (
        "nodes.gltf",
        Format::Gltf,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[\
         {\"children\":[1,2],\"scale\":[2,2,2]},{\"mesh\":0},{\"mesh\":0,\"translation\":[1,0,0]}],\
         \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":5}]}],\
         \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\
         \"min\":[0,0,0],\"max\":[1,1,0]}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":48}],\
         \"buffers\":[{\"byteLength\":48,\"uri\":\"data:application/octet-stream;base64,\
         AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAAA\"}]}",
    ),
    (
        "sparse.gltf",
        Format::Gltf,
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0}],\"scenes\":[{\"nodes\":[0]}],\
         \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"accessors\":[{\
         \"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,0,0],\
         \"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"componentType\":5123},\
         \"values\":{\"bufferView\":1}}}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":2},\
         {\"buffer\":0,\"byteOffset\":4,\"byteLength\":12}],\"buffers\":[{\"byteLength\":16,\
         \"uri\":\"data:application/octet-stream;base64,AQAAAAAAgD8AAAAAAAAAAA==\"}]}",
    ),
    (
        "shared.gltf",
        Format::Gltf,
        "{\"asset\":{\"version\":\"2.0\"},\
         \"nodes\":[{\"mesh\":0},{\"mesh\":1,\"translation\":[3,0,0]}],\"meshes\":[{\"primitives\":[\
         {\"attributes\":{\"POSITION\":0},\"indices\":1}]},{\"primitives\":[\
         {\"attributes\":{\"POSITION\":0},\"indices\":1}]}],\
         \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},\
         {\"bufferView\":1,\"componentType\":5123,\"count\":12,\"type\":\"SCALAR\"}],\
         \"bufferViews\":[{\"buffer\":0,\"byteLength\":48},\
         {\"buffer\":0,\"byteOffset\":48,\"byteLength\":24}],\"buffers\":[{\"byteLength\":72,\
         \"uri\":\"data:application/octet-stream;base64,\
         AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\
         AAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAAADAAIAAQACAAMA\"}]}",
    ),
    (
        "layers.gltf",
        Format::Gltf,
        "{\"asset\":{\"version\":\"2.0\"},\
         \"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[\
         {\"attributes\":{\"POSITION\":0},\"indices\":1},\
         {\"attributes\":{\"POSITION\":0},\"indices\":1}]}],\
         \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},\
         {\"bufferView\":1,\"componentType\":5123,\"count\":12,\"type\":\"SCALAR\"}],\
         \"bufferViews\":[{\"buffer\":0,\"byteLength\":48},\
         {\"buffer\":0,\"byteOffset\":48,\"byteLength\":24}],\"buffers\":[{\"byteLength\":72,\
         \"uri\":\"data:application/octet-stream;base64,\
         AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\
         AAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAAADAAIAAQACAAMA\"}]}",
    ),
    (
        "instanced.gltf",
        Format::Gltf,
        "{\"asset\":{\"version\":\"2.0\"},\
         \"nodes\":[{\"mesh\":0,\"extensions\":{\"EXT_mesh_gpu_instancing\":{\
         \"attributes\":{\"TRANSLATION\":0}}}},{\"mesh\":0,\"scale\":[-1,1,1]}],\
         \"meshes\":[{\"primitives\":[\
         {\"attributes\":{\"POSITION\":0},\"indices\":1}]}],\
         \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},\
         {\"bufferView\":1,\"componentType\":5123,\"count\":12,\"type\":\"SCALAR\"}],\
         \"bufferViews\":[{\"buffer\":0,\"byteLength\":48},\
         {\"buffer\":0,\"byteOffset\":48,\"byteLength\":24}],\"buffers\":[{\"byteLength\":72,\
         \"uri\":\"data:application/octet-stream;base64,\
         AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\
         AAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAAADAAIAAQACAAMA\"}]}",
    ),
    (
        "doublets.obj",
        Format::Obj,
        "v 0 0 0\nv 0 0 2\nv 1 0 1\nv 0 1 1\nv -1 0 1\nv 0 -1 1\nv 5 0 0\nv 6 0 0\nv 7 1 0\n\
         v 6 2 0\nv 5 2 0\nf 1 3 2 4\nf 1 4 2 5\nf 1 5 2 6\nf 6 2 3 1\nf 7 8 9 10 11\n\
         f 11 10 9 8 7\n",
    ),
    (
        "glued.off",
        Format::Off,
        "OFF4 2 5\n0 0 0\n1 0 0\n1 1 1\n0 1 0\n4 0 1 2 3\n4 3 2 1 0\n",
    ),
];
