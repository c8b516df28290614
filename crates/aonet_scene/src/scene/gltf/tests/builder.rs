//! Builds small glTF files.

use super::TRIANGLE;
use serde_json::{Value, json};

/// A document under construction with the content of its first buffer.
#[derive(Clone)]
pub(super) struct Builder {
    pub(super) json: Value,
    pub(super) bin: Vec<u8>,
}

impl Builder {
    pub(super) fn new() -> Self {
        Self { json: json!({"asset": {"version": "2.0"}}), bin: Vec::new() }
    }

    /// One node that shows one triangle without indices and normals.
    pub(super) fn triangle() -> Self {
        let mut file = Self::new();
        let position = file.vectors(&TRIANGLE);
        let mesh = file.mesh(json!({"POSITION": position}), json!({}));
        file.push("nodes", json!({"mesh": mesh}));
        file
    }

    /// Adds to a top-level list; gives the index.
    pub(super) fn push(&mut self, list: &str, value: Value) -> usize {
        let list = &mut self.json[list];
        if list.is_null() {
            *list = json!([]);
        }
        let list = list.as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// A buffer view of these bytes.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// An accessor of everything in a new buffer view.
    pub(super) fn accessor(&mut self, bytes: &[u8], component: u32, (shape, count): (&str, usize)) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": shape, "count": count});
        self.push("accessors", accessor)
    }

    pub(super) fn vectors<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let shape = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.accessor(&bytes(rows.as_flattened()), 5126, (shape, rows.len()))
    }

    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor(&bytes, 5125, ("SCALAR", indices.len()))
    }

    /// A mesh of one primitive with these attributes and other fields.
    pub(super) fn mesh(&mut self, attributes: Value, other: Value) -> usize {
        let mut primitive = other;
        primitive["attributes"] = attributes;
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// The JSON with the buffer at `uri`.
    pub(super) fn text(&self, uri: Option<&str>) -> Vec<u8> {
        let mut json = self.json.clone();
        if json["buffers"].is_null() {
            json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        }
        if let Some(uri) = uri {
            json["buffers"][0]["uri"] = json!(uri);
        }
        serde_json::to_vec(&json).unwrap()
    }

    pub(super) fn glb(&self) -> Vec<u8> {
        glb(self.text(None), self.bin.clone())
    }
}

/// The container around a JSON and a BIN chunk.
pub(super) fn glb(mut json: Vec<u8>, mut bin: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut file = b"glTF".to_vec();
    let word = |n: usize| (n as u32).to_le_bytes();
    file.extend([word(2), word(28 + json.len() + bin.len()), word(json.len())].as_flattened());
    file.extend(b"JSON");
    file.extend(json);
    file.extend(word(bin.len()));
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// Little-endian floats.
pub(super) fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}
