//! The bytes of a glTF file: the GLB container, data URIs and files beside it.

use super::json::{Buffer, Document};
use aonet::Error;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

/// The two chunks of a GLB; a `.gltf` is only JSON.
pub(super) struct Chunks<'a> {
    pub(super) json: &'a [u8],
    pub(super) bin: Option<&'a [u8]>,
}

/// Splits a file. GLB: glTF 2.0 specification §4.4.
pub(super) fn split(bytes: &[u8]) -> aonet::Result<Chunks<'_>> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Chunks { json: bytes, bin: None });
    }
    let word =
        |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let truncated = || Error::format("GLB header", "12 bytes", bytes.len());
    let (version, length) = word(4).zip(word(8)).ok_or_else(truncated)?;
    if version != 2 {
        return Err(Error::format("GLB version", 2, version));
    }
    let body = bytes.get(12..length).ok_or_else(|| {
        Error::format("GLB", format!("its declared {length} bytes"), format!("{} bytes", bytes.len()))
    })?;
    let (kind, json, rest) = chunk(body)?;
    if kind != b"JSON" {
        return Err(Error::format(
            "GLB first chunk",
            "JSON",
            format!("{:?}", kind.escape_ascii().to_string()),
        ));
    }
    let bin = match rest {
        [] => None,
        rest => Some(chunk(rest)?).filter(|(kind, ..)| *kind == b"BIN\0").map(|(_, bin, _)| bin),
    };
    Ok(Chunks { json, bin })
}

/// Kind and content of the first chunk, and what follows it.
fn chunk(bytes: &[u8]) -> aonet::Result<(&[u8; 4], &[u8], &[u8])> {
    let header = bytes
        .first_chunk::<8>()
        .ok_or_else(|| Error::format("GLB chunk header", "8 bytes", format!("{} bytes", bytes.len())))?;
    let length = u32::from_le_bytes([header[0], header[1], header[2], header[3]]) as usize;
    let (_, rest) = bytes.split_at(8);
    let (content, rest) = rest.split_at_checked(length).ok_or_else(|| {
        Error::format("GLB chunk", format!("its declared {length} bytes"), format!("{} bytes", rest.len()))
    })?;
    Ok((header.last_chunk().expect("8 bytes end in 4"), content, rest))
}

/// The content of every buffer of a document.
pub(super) struct Buffers<'a> {
    content: Vec<Content<'a>>,
    external: HashMap<&'a str, Vec<u8>>,
}

enum Content<'a> {
    Bytes(Cow<'a, [u8]>),
    External(&'a str),
    /// No URI and no BIN chunk, which only a compressed file may have.
    Absent,
}

impl<'a> Buffers<'a> {
    pub(super) fn load(
        document: &'a Document,
        bin: Option<&'a [u8]>,
        base_dir: Option<&Path>,
    ) -> crate::Result<Self> {
        let mut buffers = Self { content: Vec::new(), external: HashMap::new() };
        for (i, buffer) in document.buffers.iter().enumerate() {
            let bin = bin.filter(|_| i == 0);
            let content = buffers.content_of(buffer, bin, base_dir)?;
            buffers.content.push(content);
            let found = buffers.get(i).map_or(buffer.byte_length, <[u8]>::len);
            if found < buffer.byte_length {
                let expected = format!("its byteLength of {} bytes", buffer.byte_length);
                return Err(
                    Error::format(format!("glTF buffer {i}"), expected, format!("{found} bytes")).into()
                );
            }
        }
        Ok(buffers)
    }

    fn content_of(
        &mut self,
        buffer: &'a Buffer,
        bin: Option<&'a [u8]>,
        base_dir: Option<&Path>,
    ) -> crate::Result<Content<'a>> {
        let Some(uri) = buffer.uri.as_deref() else {
            return Ok(bin.map_or(Content::Absent, |bin| Content::Bytes(bin.into())));
        };
        if let Some(data) = uri.strip_prefix("data:") {
            return Ok(Content::Bytes(data_uri(data)?.into()));
        }
        if !self.external.contains_key(uri) {
            let path = path_beside(("buffer", uri), base_dir)?;
            self.external.insert(uri, std::fs::read(&path).map_err(crate::Error::io(&path))?);
        }
        Ok(Content::External(uri))
    }

    /// The bytes of buffer `index`, if it has any.
    pub(super) fn get(&self, index: usize) -> Option<&[u8]> {
        match self.content.get(index)? {
            Content::Bytes(bytes) => Some(bytes),
            Content::External(uri) => self.external.get(uri).map(Vec::as_slice),
            Content::Absent => None,
        }
    }

    /// Bytes read from other files.
    pub(super) fn external_bytes(&self) -> usize {
        self.external.values().map(Vec::len).sum()
    }
}

/// A file in the folder of the glTF or below it.
pub(super) fn path_beside((kind, uri): (&str, &str), base_dir: Option<&Path>) -> crate::Result<PathBuf> {
    let what = || format!("glTF {kind} uri {uri:?}");
    let folder = base_dir
        .ok_or_else(|| Error::value(what(), "embedded data (there is no folder to search)", "a file"))?;
    let decoded = String::from_utf8(percent_decode(uri.as_bytes()))
        .map_err(|_| Error::value(what(), "a percent-encoded UTF-8 path", "other bytes"))?;
    let relative = Path::new(&decoded);
    let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !inside || decoded.contains(['\\', ':', '\0']) {
        return Err(Error::value(
            what(),
            "a relative path that stays in the folder of the glTF file",
            decoded,
        )
        .into());
    }
    let path = folder.join(relative);
    let found = std::fs::metadata(&path).map_err(crate::Error::io(&path))?;
    if !found.is_file() {
        return Err(crate::Error::file(&path, "a regular file", "something else"));
    }
    Ok(path)
}

/// The content of a data URI, without its `data:`. RFC 2397.
pub(super) fn data_uri(uri: &str) -> aonet::Result<Vec<u8>> {
    let (kind, data) = uri
        .split_once(',')
        .ok_or_else(|| Error::format("glTF data URI", "a comma before the data", "none"))?;
    let bytes = percent_decode(data.as_bytes());
    if kind.ends_with(";base64") { base64(&bytes) } else { Ok(bytes) }
}

/// Replaces `%XX`; other bytes do not change.
fn percent_decode(text: &[u8]) -> Vec<u8> {
    let hex = |byte: u8| char::from(byte).to_digit(16);
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text;
    while let [first, tail @ ..] = rest {
        let escaped = match tail {
            [high, low, ..] if *first == b'%' => hex(*high).zip(hex(*low)),
            _ => None,
        };
        bytes.push(escaped.map_or(*first, |(high, low)| (high * 16 + low) as u8));
        rest = if escaped.is_some() { &tail[2..] } else { tail };
    }
    bytes
}

/// RFC 4648 §4, padding optional.
fn base64(text: &[u8]) -> aonet::Result<Vec<u8>> {
    let padding = text.iter().rev().take(2).take_while(|&&c| c == b'=').count();
    let text = &text[..text.len() - padding];
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for &c in group {
            bits = bits << 6 | sextet(c)?;
        }
        let whole = (bits << (6 * (4 - group.len()))).to_be_bytes();
        bytes.extend_from_slice(&whole[1..group.len()]);
    }
    Ok(bytes)
}

fn sextet(c: u8) -> aonet::Result<u32> {
    let value = match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return Err(Error::format("glTF data URI", "base64", format!("the byte {c:#04x}"))),
    };
    Ok(value.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_the_vectors_of_rfc_4648() {
        let pairs = [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob")];
        for (text, plain) in
            pairs.into_iter().chain([("Zm9vYmE=", "fooba"), ("Zm9vYmFy", "foobar"), ("Zg", "f")])
        {
            assert_eq!(base64(text.as_bytes()).unwrap(), plain.as_bytes(), "{text}");
        }
        assert_eq!(base64(b"+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        assert!(base64(b"Zm9*").is_err() && base64(b"=Zm9").is_err());
    }

    #[test]
    fn percent_decoding_leaves_broken_escapes_alone() {
        assert_eq!(percent_decode(b"a%20b%2fc"), b"a b/c");
        assert_eq!(percent_decode(b"%zz%4"), b"%zz%4");
    }
}
